//! A frame as a picture: shapes, contact points, normals, impulses as arrows, penetration as color, with a
//! scale bar and a legend.

use super::frame::{Frame, Stage, TouchPoint};
use super::outline::{outline, placed};
use super::svg::{Drawing, hex};
use super::{Color, joints};
use crate::engine::bodies::BodyKind;
use crate::engine::shapes::Shape;
use crate::lab::units::{si, si_short};

/// Color of text and frames.
const INK: Color = Color::rgb(0x1f2933);
const FAINT: Color = Color::rgb(0x616e7c);
const BORDER: Color = Color::rgb(0x52606d);
const FIXED: Color = Color::rgb(0xd3d8de);
const MOVED: Color = Color::rgb(0xd9d2e9);
/// Blue and green of Okabe and Ito: distinct with any color vision, and distinct from the ramp.
const IMPULSE: Color = Color::rgb(0x0072b2);
const NORMAL: Color = Color::rgb(0x009e73);
/// From no overlap to the deepest. Lightness falls steadily, so that the ramp is readable in gray, too.
const RAMP: [Color; 5] = [
    Color::rgb(0xf3f5f8),
    Color::rgb(0xfde4a0),
    Color::rgb(0xf59b4b),
    Color::rgb(0xcc3d33),
    Color::rgb(0x6b1030),
];

/// Width of the narrowest and the widest picture (pixels).
pub const WIDTHS: [u32; 2] = [400, 8000];
const MARGIN: f64 = 28.0;
const HEADER: f64 = 66.0;
const LEGEND: f64 = 84.0;
/// Smallest and largest height ÷ width of the part with the scene.
const ASPECT: [f64; 2] = [0.3, 0.95];

/// The color of an overlap, given as a fraction of the deepest in the legend.
fn ramp(share: f64) -> Color {
    let place = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let i = (place as usize).min(RAMP.len() - 2);
    RAMP[i].toward(RAMP[i + 1], place - i as f64)
}

/// The largest of 1, 2, 5 × 10ⁿ that is at most `value`; 0 for 0.
fn round_down(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let decade = 10f64.powf(value.log10().floor());
    decade * [5.0, 2.0, 1.0].into_iter().find(|s| s * decade <= value * (1.0 + 1e-9)).unwrap_or(0.5)
}

/// Maps meters on the stage to pixels.
struct StageView {
    scale: f64,
    left: f64,
    bottom: f64,
    low: [f64; 2],
}

impl StageView {
    fn at(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        [self.left + self.scale * (x - self.low[0]), self.bottom - self.scale * (y - self.low[1])]
    }
}

/// Lower and upper corner of all moving shapes and of the joints' anchors; of everything, if nothing moves.
fn bounds(stage: &Stage, outlines: &[Vec<[f64; 2]>], poses: &[[f64; 3]]) -> [[f64; 2]; 2] {
    let moves = |i: usize| stage.kinds[stage.shapes[i].0 as usize] != BodyKind::Static;
    let any = (0..outlines.len()).any(moves);
    let shown = outlines.iter().enumerate().filter(|(i, _)| !any || moves(*i));
    let hinges = stage.joints.iter().flat_map(|joint| joint.ends(poses));
    let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for point in shown.flat_map(|(_, points)| points.iter().copied()).chain(hinges) {
        if point[0].is_finite() && point[1].is_finite() {
            low = [0, 1].map(|k| low[k].min(point[k]));
            high = [0, 1].map(|k| high[k].max(point[k]));
        }
    }
    if low[0] > high[0] {
        return [[-1.0; 2], [1.0; 2]];
    }
    let room = 0.05 * (high[0] - low[0]).max(high[1] - low[1]).max(1e-9);
    [low.map(|x| x - room), high.map(|x| x + room)]
}

/// Default penetration of the darkest color (m): visible on bodies of one meter.
pub const DARKEST: f64 = 0.01;

/// The picture of a frame as SVG, `width` pixels wide, below a title and a subtitle. An overlap of `darkest`
/// (m) or more has the darkest color, so pictures with the same scale are comparable.
pub fn draw(stage: &Stage, frame: &Frame, title: &str, subtitle: &str, width: u32, darkest: f64) -> String {
    let of_shape = |(body, shape): &(u32, Shape)| placed(&outline(shape), frame.poses[*body as usize]);
    let outlines: Vec<Vec<[f64; 2]>> = stage.shapes.iter().map(of_shape).collect();
    let [low, high] = bounds(stage, &outlines, &frame.poses);
    let (w, h, width) = (high[0] - low[0], high[1] - low[1], f64::from(width));
    let inner = width - 2.0 * MARGIN;
    let height = inner * (h / w).clamp(ASPECT[0], ASPECT[1]);
    let scale = (inner / w).min(height / h);
    let view = StageView {
        scale,
        left: MARGIN + 0.5 * (inner - scale * w),
        bottom: HEADER + height - 0.5 * (height - scale * h),
        low,
    };
    let top = HEADER + height;
    let mut drawing = Drawing::new([width, (top + LEGEND).round()]);
    let size = typical(stage, scale);
    // The deepest overlap at each body.
    let mut depths = vec![0.0_f64; stage.kinds.len()];
    for (body, point) in frame.points.iter().flat_map(|point| point.bodies.map(|body| (body as usize, point)))
    {
        depths[body] = depths[body].max(-f64::from(point.separation));
    }
    for (points, (body, shape)) in outlines.iter().zip(&stage.shapes) {
        let points: Vec<[f64; 2]> = points.iter().map(|&p| view.at(p)).collect();
        let body = *body as usize;
        let fill = match stage.kinds[body] {
            BodyKind::Static => FIXED,
            BodyKind::Kinematic => MOVED,
            BodyKind::Dynamic => ramp(depths[body] / darkest),
        };
        if !points.iter().flatten().all(|x| x.is_finite()) {
            continue;
        }
        let border = Some((BORDER, (0.03 * size).clamp(0.4, 1.4)));
        let title = format!("body {body}, deepest overlap {}", si(depths[body], "m"));
        drawing.polygon(&points, fill, border, &title);
        if let Shape::Circle { center, radius } = shape {
            // A spoke shows the rotation.
            let [x, y] = [center.x, center.y].map(f64::from);
            let spoke = placed(&[[x, y], [x + f64::from(*radius), y]], frame.poses[body]);
            drawing.line([view.at(spoke[0]), view.at(spoke[1])], BORDER, 0.8, 0.0);
        }
    }
    let mark = (0.3 * size).clamp(3.0, 12.0);
    joints::draw(&mut drawing, stage, &frame.poses, mark, |place| view.at(place));
    let arrow = points(&mut drawing, frame, &view, size, darkest);
    // Cover shapes that reach into the header or the legend.
    drawing.rectangle([0.0, 0.0], [width, HEADER - 6.0], "#ffffff");
    drawing.rectangle([0.0, top], [width, LEGEND], "#ffffff");
    // Text is smaller in a narrow picture, so that no line ends outside of it.
    let fitted = |text: &str, size: f64| size.min(1.5 * inner / text.chars().count().max(1) as f64);
    drawing.text([MARGIN, 30.0], fitted(title, 21.0), "start", INK, title);
    drawing.text([MARGIN, 52.0], fitted(subtitle, 14.0), "start", FAINT, subtitle);
    legend(&mut drawing, [top, 0.25 * inner], scale, [darkest, frame.deepest()], arrow, stage.dt);
    drawing.finish()
}

/// The median size of the moving shapes in pixels: the side of a square with the shape's area.
fn typical(stage: &Stage, scale: f64) -> f64 {
    let moving = stage.shapes.iter().filter(|(body, _)| stage.kinds[*body as usize] != BodyKind::Static);
    let mut widths: Vec<f64> = moving.map(|(_, s)| s.mass(1.0).mass.sqrt()).collect();
    widths.retain(|w| *w > 0.0 && w.is_finite());
    widths.sort_by(f64::total_cmp);
    scale * widths.get(widths.len() / 2).copied().unwrap_or(1.0)
}

/// Draws contact points, normals and impulses on bodies of this size (pixels). Returns an impulse for the
/// legend (N·s) and the length of its arrow (pixels).
fn points(drawing: &mut Drawing, frame: &Frame, view: &StageView, size: f64, darkest: f64) -> (f64, f64) {
    let length = |p: &TouchPoint| p.impulse_vector()[0].hypot(p.impulse_vector()[1]);
    let largest = frame.points.iter().map(length).fold(0.0, f64::max);
    let longest = (1.6 * size).clamp(16.0, 150.0);
    let pixels = if largest > 0.0 { longest / largest } else { 0.0 };
    let (radius, normal) = ((0.06 * size).clamp(0.8, 4.0), (0.35 * size).clamp(3.0, 14.0));
    let along = |[x, y]: [f64; 2], [u, v]: [f64; 2], s: f64| [x + s * u, y - s * v];
    for point in &frame.points {
        let (at, normal_tip) = (view.at(point.at), point.normal.map(f64::from));
        drawing.line([at, along(at, normal_tip, normal)], NORMAL, (0.4 * radius).max(0.6), 0.0);
    }
    for point in &frame.points {
        let at = view.at(point.at);
        arrow(drawing, at, along(at, point.impulse_vector(), pixels), (0.55 * radius).clamp(0.7, 2.0));
    }
    for point in &frame.points {
        let depth = -f64::from(point.separation);
        let title = format!(
            "bodies {} and {}: {} {}, impulse {} along the normal, {} across",
            point.bodies[0],
            point.bodies[1],
            if depth > 0.0 { "overlap" } else { "gap" },
            si(depth.abs(), "m"),
            si(f64::from(point.impulse[0]), "N·s"),
            si(f64::from(point.impulse[1]), "N·s")
        );
        drawing.disc(view.at(point.at), 1.2 * radius, ramp(depth / darkest), (INK, 0.35 * radius), &title);
    }
    let shown = round_down(largest);
    (shown, shown * pixels)
}

/// Draws a shaft, and a head if there is room for one.
fn arrow(drawing: &mut Drawing, from: [f64; 2], to: [f64; 2], width: f64) {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length < 0.5 || !length.is_finite() {
        return;
    }
    let head = (5.0 * width).min(0.6 * length);
    let (u, v) = (dx / length, dy / length);
    let neck = [to[0] - head * u, to[1] - head * v];
    drawing.line([from, neck], IMPULSE, width, 0.0);
    let corner = |s: f64| [neck[0] - s * head * v, neck[1] + s * head * u];
    drawing.polygon(&[to, corner(0.42), corner(-0.42)], IMPULSE, None, "");
}

/// The legend below `top`, in columns of this width (pixels): a length at this scale (pixels per meter), penetration
/// by color, an impulse (N·s) as long as its arrow (pixels), and a contact. What the frame has none of is left out.
fn legend(
    drawing: &mut Drawing,
    [top, column]: [f64; 2],
    scale: f64,
    [darkest, deepest]: [f64; 2],
    (impulse, pixels): (f64, f64),
    dt: f64,
) {
    let (y, size) = (top + 34.0, (0.06 * column).min(13.0));
    let left = |k: f64| MARGIN + column * k;
    let text = |drawing: &mut Drawing, [x, dy]: [f64; 2], anchor: &str, text: &str| {
        drawing.text([x, y + dy], size, anchor, INK, text);
    };
    let meters = round_down(0.6 * column / scale);
    let ends = [left(0.0), left(0.0) + meters * scale];
    drawing.line(ends.map(|x| [x, y]), INK, 2.0, 0.0);
    for x in ends {
        drawing.line([[x, y - 5.0], [x, y + 5.0]], INK, 1.4, 0.0);
    }
    text(drawing, [ends[0], 24.0], "start", &si_short(meters, "m"));
    if deepest > 0.0 {
        let (x, wide) = (left(1.0), 0.62 * column);
        let stop = |(i, color): (usize, &Color)| {
            let share = i as f64 / (RAMP.len() - 1) as f64;
            format!("<stop offset=\"{share}\" stop-color=\"{}\"/>", hex(*color))
        };
        drawing.group("linearGradient id=\"ramp\"", &RAMP.iter().enumerate().map(stop).collect::<String>());
        drawing.rectangle([x, y - 7.0], [wide, 14.0], "url(#ramp)");
        let more = if deepest > darkest { "≥ " } else { "" };
        text(drawing, [x, -14.0], "start", "overlap");
        text(drawing, [x, 24.0], "start", "0");
        text(drawing, [x + wide, 24.0], "end", &format!("{more}{}", si_short(darkest, "m")));
    }
    if impulse > 0.0 {
        let force = format!("{}, {} over the step", si_short(impulse, "N·s"), si(impulse / dt, "N"));
        arrow(drawing, [left(2.0), y], [left(2.0) + pixels, y], 1.8);
        text(drawing, [left(2.0), -14.0], "start", "impulse");
        text(drawing, [left(2.0), 24.0], "start", &force);
    }
    let x = left(3.0) + (column - 200.0).clamp(6.0, 0.25 * column);
    drawing.line([[x, y], [x, y - 14.0]], NORMAL, 1.6, 0.0);
    drawing.disc([x, y], 3.5, RAMP[0], (INK, 1.0), "");
    text(drawing, [x + 14.0, 4.0], "start", "contact and normal");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;
    use crate::engine::world::Settings;
    use crate::lab::metrics::overlaps::Overlaps;
    use crate::lab::scenes;

    fn frame(name: &str, steps: u32) -> String {
        let settings = Settings { record_impulses: true, ..Settings::new(find("soft_step").unwrap()) };
        let mut world = scenes::load(name).unwrap().scene.build(settings).unwrap();
        for _ in 0..steps {
            world.step().unwrap();
        }
        let stage = Stage::of(&world);
        draw(&stage, &Frame::of(&world, &stage, Some(&mut Overlaps::default())), name, "below", 600, DARKEST)
    }

    #[test]
    fn round_numbers_are_next_to_what_they_stand_for() {
        let down = [0.0, 0.3, 1.0, 1.2, 4.9, 7.0].map(round_down);
        let expected = [0.0, 0.2, 1.0, 1.0, 2.0, 5.0];
        assert!(down.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{down:?}");
    }

    #[test]
    fn every_body_point_and_arrow_is_drawn() {
        let text = frame("stack:3", 120);
        let count = |part: &str| text.matches(part).count();
        assert_eq!((count("<title>body"), count("along the normal")), (4, 6), "{text}");
        // An arrow at each of six points, and one in the legend.
        assert_eq!(count(&format!("fill=\"{}\"", hex(IMPULSE))), 7, "{text}");
        for part in ["stack:3", "below", ">overlap<", "N·s", "over the step", "contact and normal", " mm<"] {
            assert!(text.contains(part), "{part}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"));
        let none = frame("bounce", 1);
        assert!(!none.contains(">overlap<") && !none.contains("over the step"), "{none}");
    }

    #[test]
    fn the_deepest_overlap_has_the_darkest_color() {
        let lightness = |c: Color| 0.2 * f64::from(c.0) + 0.7 * f64::from(c.1) + 0.1 * f64::from(c.2);
        let shades: Vec<f64> = (0..=20).map(|k| lightness(ramp(f64::from(k) / 20.0))).collect();
        assert!(shades.windows(2).all(|w| w[1] < w[0]), "{shades:?}");
    }
}
