//! A frame as a picture: shapes, contact points, normals, impulses as arrows, penetration as color, with a
//! scale bar and a legend.

use super::frame::{Frame, Stage, TouchPoint};
use super::outline::{outline, placed};
use super::{Anchor, Color, Item, Picture};
use crate::engine::bodies::BodyKind;
use crate::engine::shapes::Shape;
use crate::lab::units::{si, si_short};

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
/// Additional height for the row of joint marks.
const JOINTS: f64 = 26.0;
/// Smallest and largest height ÷ width of the part with the scene.
const ASPECT: [f64; 2] = [0.3, 0.95];

/// The color of an overlap, given as a fraction of the deepest in the legend.
fn ramp(share: f64) -> Color {
    let place = share.clamp(0.0, 1.0) * (RAMP.len() - 1) as f64;
    let i = (place as usize).min(RAMP.len() - 2);
    RAMP[i].toward(RAMP[i + 1], place - i as f64)
}

/// The smallest of 1, 2, 5 × 10ⁿ that is at least `value`; 0 for 0.
fn round_up(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let decade = 10f64.powf(value.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|s| s * decade >= value * (1.0 - 1e-9));
    step.unwrap_or(10.0) * decade
}

/// The largest of 1, 2, 5 × 10ⁿ that is at most `value`; 0 for 0.
fn round_down(value: f64) -> f64 {
    let up = round_up(value);
    match up {
        0.0 => 0.0,
        up if up <= value * (1.0 + 1e-9) => up,
        // One step down: 2 → 1, 5 → 2, 10 → 5.
        up => round_up(up * 0.39),
    }
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

/// Distance from each body's center to its farthest point (m); infinite for a body that is not dynamic.
fn reaches(stage: &Stage) -> Vec<f64> {
    let is_dynamic = |kind: &BodyKind| *kind == BodyKind::Dynamic;
    let mut all: Vec<f64> =
        stage.kinds.iter().map(|kind| if is_dynamic(kind) { 0.0 } else { f64::INFINITY }).collect();
    for (body, shape) in &stage.shapes {
        let own = &mut all[*body as usize];
        shape.for_each_vertex(|v| *own = own.max(f64::from(v.length() + shape.radius())));
    }
    all
}

/// Lower and upper corner of all moving shapes and of the joints' anchors; of everything, if nothing moves.
fn bounds(stage: &Stage, outlines: &[Vec<[f64; 2]>], poses: &[[f64; 3]]) -> [[f64; 2]; 2] {
    let moves = |i: usize| stage.kinds[stage.shapes[i].0 as usize] != BodyKind::Static;
    let any = (0..outlines.len()).any(moves);
    let points = || {
        let shown = outlines.iter().enumerate().filter(|(i, _)| !any || moves(*i));
        let hinges = stage.joints.iter().flat_map(|joint| joint.ends(poses));
        let points = shown.flat_map(|(_, points)| points.iter().copied()).chain(hinges);
        points.filter(|p| p[0].is_finite() && p[1].is_finite())
    };
    if points().next().is_none() {
        return [[-1.0; 2], [1.0; 2]];
    }
    let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
    for point in points() {
        for k in 0..2 {
            low[k] = low[k].min(point[k]);
            high[k] = high[k].max(point[k]);
        }
    }
    let room = 0.05 * (high[0] - low[0]).max(high[1] - low[1]).max(1e-9);
    [low.map(|x| x - room), high.map(|x| x + room)]
}

/// Default penetration of the darkest color (m): visible on bodies of one meter.
pub const DARKEST: f64 = 0.01;

/// The picture of a frame, `width` pixels wide, below a title and a subtitle. An overlap of `darkest` (m) or
/// more has the darkest color, so pictures with the same scale are comparable.
pub fn draw(stage: &Stage, frame: &Frame, title: &str, subtitle: &str, width: u32, darkest: f64) -> Picture {
    let outlines: Vec<Vec<[f64; 2]>> = stage
        .shapes
        .iter()
        .map(|(body, shape)| placed(&outline(shape), frame.poses[*body as usize]))
        .collect();
    let [low, high] = bounds(stage, &outlines, &frame.poses);
    let (w, h) = (high[0] - low[0], high[1] - low[1]);
    let inner = f64::from(width) - 2.0 * MARGIN;
    let height = inner * (h / w).clamp(ASPECT[0], ASPECT[1]);
    let scale = (inner / w).min(height / h);
    let view = StageView {
        scale,
        left: MARGIN + 0.5 * (inner - scale * w),
        bottom: HEADER + height - 0.5 * (height - scale * h),
        low,
    };
    let legend_height = if stage.joints.is_empty() { LEGEND } else { LEGEND + JOINTS };
    let size = [width, (HEADER + height + legend_height).round() as u32];
    let mut picture = Picture::new(size, Color::rgb(0xffffff));
    let deepest = if frame.deepest() > 0.0 { darkest } else { 0.0 };
    let depth_of = depths(stage, frame);
    for (points, (body, shape)) in outlines.iter().zip(&stage.shapes) {
        let points: Vec<[f64; 2]> = points.iter().map(|&p| view.at(p)).collect();
        let body = *body as usize;
        let fill = match stage.kinds[body] {
            BodyKind::Static => FIXED,
            BodyKind::Kinematic => MOVED,
            BodyKind::Dynamic => ramp(depth_of[body] / deepest.max(f64::MIN_POSITIVE)),
        };
        if !points.iter().flatten().all(|x| x.is_finite()) {
            continue;
        }
        let stroke = Some((BORDER, (0.03 * typical(stage, scale)).clamp(0.4, 1.4)));
        let title = format!("body {body}, deepest overlap {}", si(depth_of[body], "m"));
        picture.items.push(Item::Polygon { points, fill: Some(fill), stroke, title });
        if let Shape::Circle { center, radius } = shape {
            // A spoke shows the rotation.
            let spoke = [center, &(*center + glam::Vec2::new(*radius, 0.0))]
                .map(|v| [f64::from(v.x), f64::from(v.y)]);
            let spoke = placed(&spoke, frame.poses[body]);
            picture.line(view.at(spoke[0]), view.at(spoke[1]), BORDER, 0.8);
        }
    }
    let mark = (0.3 * typical(stage, scale)).clamp(3.0, 12.0);
    super::joints::draw(&mut picture, &stage.joints, &frame.poses, &reaches(stage), mark, |place| {
        view.at(place)
    });
    let arrow = points(&mut picture, stage, frame, &view, deepest);
    // Cover shapes that reach into the header or the legend.
    let top = HEADER + height;
    picture.rectangle([0.0, 0.0], [f64::from(width), HEADER - 6.0], Color::rgb(0xffffff));
    picture.rectangle([0.0, top], [f64::from(width), legend_height], Color::rgb(0xffffff));
    // Text is smaller in a narrow picture, so that no line ends outside of it.
    let fitted = |text: &str, size: f64| size.min(1.5 * inner / text.chars().count().max(1) as f64);
    picture.text([MARGIN, 30.0], fitted(title, 21.0), Anchor::Start, INK, title);
    picture.text([MARGIN, 52.0], fitted(subtitle, 14.0), Anchor::Start, FAINT, subtitle);
    legend(&mut picture, top, &view, [deepest, frame.deepest()], arrow, stage.dt);
    super::joints::legend(&mut picture, &stage.joints, [MARGIN, top + LEGEND], INK);
    picture
}

/// The deepest overlap at each body (m).
fn depths(stage: &Stage, frame: &Frame) -> Vec<f64> {
    let mut depths = vec![0.0_f64; stage.kinds.len()];
    for point in &frame.points {
        for body in point.bodies {
            depths[body as usize] = depths[body as usize].max(-f64::from(point.separation));
        }
    }
    depths
}

/// The median size of the moving shapes in pixels: the side of a square with the shape's area.
fn typical(stage: &Stage, scale: f64) -> f64 {
    let moving = stage.shapes.iter().filter(|(body, _)| stage.kinds[*body as usize] != BodyKind::Static);
    let mut widths: Vec<f64> = moving.map(|(_, s)| s.mass(1.0).mass.sqrt()).collect();
    widths.retain(|w| *w > 0.0 && w.is_finite());
    widths.sort_by(f64::total_cmp);
    scale * widths.get(widths.len() / 2).copied().unwrap_or(1.0)
}

/// Draws contact points, normals and impulses. Returns an impulse for the legend (N·s) and the length of its
/// arrow (pixels).
fn points(picture: &mut Picture, stage: &Stage, frame: &Frame, view: &StageView, deepest: f64) -> (f64, f64) {
    let size = typical(stage, view.scale);
    let length = |p: &TouchPoint| p.impulse_vector()[0].hypot(p.impulse_vector()[1]);
    let largest = frame.points.iter().map(length).fold(0.0, f64::max);
    let longest = (1.6 * size).clamp(16.0, 150.0);
    let pixels = if largest > 0.0 { longest / largest } else { 0.0 };
    let (radius, normal) = ((0.06 * size).clamp(0.8, 4.0), (0.35 * size).clamp(3.0, 14.0));
    let place = |p: &TouchPoint| view.at(p.at);
    let along = |[x, y]: [f64; 2], [u, v]: [f64; 2], s: f64| [x + s * u, y - s * v];
    for point in &frame.points {
        let n = point.normal.map(f64::from);
        picture.line(place(point), along(place(point), n, normal), NORMAL, (0.4 * radius).max(0.6));
    }
    for point in &frame.points {
        let tip = along(place(point), point.impulse_vector(), pixels);
        arrow(picture, place(point), tip, (0.55 * radius).clamp(0.7, 2.0));
    }
    for point in &frame.points {
        let depth = -f64::from(point.separation);
        let color = ramp(depth / deepest.max(f64::MIN_POSITIVE));
        let [at, [normal, tangent]] = [place(point).map(|x| x as f32), point.impulse];
        let at = at.map(f64::from);
        let gap = if depth > 0.0 { "overlap" } else { "gap" };
        let title = format!(
            "bodies {} and {}: {gap} {}, impulse {} along the normal, {} across",
            point.bodies[0],
            point.bodies[1],
            si(depth.abs(), "m"),
            si(f64::from(normal), "N·s"),
            si(f64::from(tangent), "N·s")
        );
        picture.items.push(Item::Disc { at, radius: 1.35 * radius, color: INK, title: title.clone() });
        picture.items.push(Item::Disc { at, radius, color, title });
    }
    let shown = round_down(largest);
    (shown, shown * pixels)
}

/// Draws a shaft, and a head if there is room for one.
fn arrow(picture: &mut Picture, from: [f64; 2], to: [f64; 2], width: f64) {
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if length < 0.5 || !length.is_finite() {
        return;
    }
    let head = (5.0 * width).min(0.6 * length);
    let (u, v) = (dx / length, dy / length);
    let neck = [to[0] - head * u, to[1] - head * v];
    picture.line(from, neck, IMPULSE, width);
    let side = 0.42 * head;
    let corner = |s: f64| [neck[0] - s * v, neck[1] + s * u];
    let points = vec![to, corner(side), corner(-side)];
    picture.items.push(Item::Polygon { points, fill: Some(IMPULSE), stroke: None, title: String::new() });
}

/// Minimum width of a color bar with room for a label in the middle (pixels).
const THREE_LABELS: f64 = 140.0;

/// `darkest`: the penetration of the darkest color, and the deepest in the frame (m).
fn legend(
    picture: &mut Picture,
    top: f64,
    view: &StageView,
    [darkest, deepest]: [f64; 2],
    arrow_at: (f64, f64),
    dt: f64,
) {
    let (bar_y, text_y, quarter) =
        (top + 34.0, top + 58.0, (f64::from(picture.size[0]) - 2.0 * MARGIN) / 4.0);
    let column = |k: usize| MARGIN + quarter * k as f64;
    let size = (0.06 * quarter).min(13.0);
    let text = |picture: &mut Picture, x: f64, y: f64, anchor, text: String| {
        picture.text([x, y], size, anchor, INK, text);
    };
    // Length scale.
    let meters = round_down(0.6 * quarter / view.scale);
    let (x, bar) = (column(0), meters * view.scale);
    picture.line([x, bar_y], [x + bar, bar_y], INK, 2.0);
    for end in [x, x + bar] {
        picture.line([end, bar_y - 5.0], [end, bar_y + 5.0], INK, 1.4);
    }
    text(picture, x, text_y, Anchor::Start, si_short(meters, "m"));
    // Penetration.
    let (x, wide) = (column(1), 0.62 * quarter);
    if deepest > 0.0 {
        let steps = 48;
        for k in 0..steps {
            let share = k as f64 / (steps - 1) as f64;
            let (left, step) = (x + wide * k as f64 / steps as f64, wide / steps as f64);
            picture.rectangle([left, bar_y - 7.0], [step + 0.3, 14.0], ramp(share));
        }
        text(picture, x, text_y, Anchor::Start, "0".into());
        if wide > THREE_LABELS {
            text(picture, x + 0.5 * wide, text_y, Anchor::Middle, si_short(0.5 * darkest, "m"));
        }
        let more = if deepest > darkest { "≥ " } else { "" };
        text(picture, x + wide, text_y, Anchor::End, format!("{more}{}", si_short(darkest, "m")));
        text(picture, x, bar_y - 14.0, Anchor::Start, "penetration".into());
    } else {
        text(picture, x, bar_y + 4.0, Anchor::Start, "nothing overlaps".into());
    }
    // Impulses.
    let x = column(2);
    let (impulse, pixels) = arrow_at;
    if impulse > 0.0 {
        arrow(picture, [x, bar_y], [x + pixels, bar_y], 1.8);
        let force = si(impulse / dt, "N");
        text(
            picture,
            x,
            text_y,
            Anchor::Start,
            format!("{}, {force} over the step", si_short(impulse, "N·s")),
        );
        text(picture, x, bar_y - 14.0, Anchor::Start, "impulse".into());
    } else {
        text(picture, x, bar_y + 4.0, Anchor::Start, "no impulses".into());
    }
    // Points and normals.
    let x = column(3) + (quarter - 200.0).clamp(6.0, 0.25 * quarter);
    picture.line([x, bar_y], [x, bar_y - 14.0], NORMAL, 1.6);
    picture.items.push(Item::Disc { at: [x, bar_y], radius: 4.0, color: INK, title: String::new() });
    picture.items.push(Item::Disc { at: [x, bar_y], radius: 3.0, color: RAMP[0], title: String::new() });
    text(picture, x + 14.0, bar_y + 4.0, Anchor::Start, "contact and normal".into());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;
    use crate::engine::world::Settings;
    use crate::lab::metrics::overlaps::Overlaps;
    use crate::lab::picture::{raster, svg};
    use crate::lab::scenes;

    fn frame(name: &str, steps: u32) -> Picture {
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
        assert_eq!([0.0, 0.3, 1.0, 1.2, 2.0, 7.0].map(round_up), [0.0, 0.5, 1.0, 2.0, 2.0, 10.0]);
        let down = [0.0, 0.3, 1.0, 1.2, 4.9, 7.0].map(round_down);
        let expected = [0.0, 0.2, 1.0, 1.0, 2.0, 5.0];
        assert!(down.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{down:?}");
    }

    #[test]
    fn every_body_point_and_arrow_is_drawn() {
        let picture = frame("stack:3", 120);
        let polygons = picture
            .items
            .iter()
            .filter(|i| matches!(i, Item::Polygon { title, .. } if title.starts_with("body")));
        assert_eq!(polygons.count(), 4);
        let discs = picture
            .items
            .iter()
            .filter(|i| matches!(i, Item::Disc { title, .. } if title.contains("impulse")));
        // Two discs for each of six points: a ring and its inside.
        assert_eq!(discs.count(), 12);
        let text = svg::svg(&picture);
        for part in ["stack:3", "below", "penetration", "N·s", "over the step", "contact and normal", " mm<"]
        {
            assert!(text.contains(part), "{part}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }

    #[test]
    fn without_contacts_the_legend_says_so() {
        let text = svg::svg(&frame("bounce", 1));
        assert!(text.contains("nothing overlaps") && text.contains("no impulses"), "{text}");
    }

    #[test]
    fn the_deepest_overlap_has_the_darkest_color() {
        let lightness = |c: Color| 0.2 * f64::from(c.0) + 0.7 * f64::from(c.1) + 0.1 * f64::from(c.2);
        let shades: Vec<f64> = (0..=20).map(|k| lightness(ramp(f64::from(k) / 20.0))).collect();
        assert!(shades.windows(2).all(|w| w[1] < w[0]), "{shades:?}");
        let found = raster::pixels(&frame("pyramid:5", 120));
        let Color(r, g, b, _) = INK;
        assert!(found.contains(&[r, g, b]) && found.contains(&[255; 3]));
    }
}
