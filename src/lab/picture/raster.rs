//! Pictures as pixels, with smooth edges from the coverage of `ab_glyph_rasterizer`.

use super::letters::{self, HEIGHT};
use super::{Anchor, Color, Item, Picture};
use ab_glyph_rasterizer::{Rasterizer, point};
use std::f64::consts::TAU;

/// Height of capitals ÷ font size.
const CAPITAL: f64 = 0.70;

/// The pixels of a picture, row by row.
pub fn pixels(picture: &Picture) -> Vec<[u8; 3]> {
    let [width, height] = picture.size;
    let Color(r, g, b, _) = picture.background;
    let mut canvas = Canvas { size: picture.size, pixels: vec![[r, g, b]; (width * height) as usize] };
    picture.items.iter().for_each(|item| canvas.draw(item));
    canvas.pixels
}

struct Canvas {
    size: [u32; 2],
    pixels: Vec<[u8; 3]>,
}

impl Canvas {
    fn draw(&mut self, item: &Item) {
        match item {
            Item::Polygon { points, fill, stroke, .. } => {
                if let Some(fill) = fill {
                    self.fill(points, *fill);
                }
                if let Some((color, width)) = stroke {
                    self.stroke(points, true, *color, *width);
                }
            }
            Item::Line { from, to, color, width } => self.stroke(&[*from, *to], false, *color, *width),
            Item::Disc { at, radius, color, .. } => self.fill(&disc(*at, *radius), *color),
            Item::Text { at: [x, y], size, anchor, color, text } => {
                let unit = CAPITAL * size / HEIGHT;
                let before = match anchor {
                    Anchor::Start => 0.0,
                    Anchor::Middle => 0.5,
                    Anchor::End => 1.0,
                };
                let mut left = x - before * unit * letters::width(text);
                for letter in text.chars() {
                    let [begin, advance] = letters::extent(letter);
                    for stroke in letters::strokes(letter) {
                        let points: Vec<_> =
                            stroke.iter().map(|[u, v]| [left + unit * (u - begin), y - unit * v]).collect();
                        match points[..] {
                            // A dot is slightly narrower than two strokes.
                            [first, last] if first == last => self.fill(&disc(first, 0.08 * size), *color),
                            _ => self.stroke(&points, false, *color, 0.095 * size),
                        }
                    }
                    left += unit * advance;
                }
            }
        }
    }

    /// Segments with round ends. All have one color and are drawn as one coverage, so that joints are not
    /// visible in a transparent color.
    fn stroke(&mut self, points: &[[f64; 2]], closed: bool, color: Color, width: f64) {
        let half = 0.5 * width;
        let mut parts: Vec<Vec<[f64; 2]>> = points.iter().map(|&at| disc(at, half)).collect();
        let next = points.iter().skip(1).chain(closed.then_some(points.first()).flatten());
        for (p, q) in points.iter().zip(next) {
            let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
            let length = dx.hypot(dy);
            if length > 0.0 {
                let (u, v) = (-half * dy / length, half * dx / length);
                parts.push(vec![
                    [p[0] - u, p[1] - v],
                    [q[0] - u, q[1] - v],
                    [q[0] + u, q[1] + v],
                    [p[0] + u, p[1] + v],
                ]);
            }
        }
        self.cover(&parts, color);
    }

    fn fill(&mut self, polygon: &[[f64; 2]], color: Color) {
        self.cover(std::slice::from_ref(&polygon.to_vec()), color);
    }

    /// Blends `color` where any of the polygons covers a pixel.
    fn cover(&mut self, polygons: &[Vec<[f64; 2]>], color: Color) {
        let [width, height] = self.size.map(f64::from);
        let clipped: Vec<Vec<[f64; 2]>> =
            polygons.iter().map(|p| clip(p, width, height)).filter(|p| p.len() > 2).collect();
        let Some(whole) = clipped.iter().map(|p| bounds(p)).reduce(union) else { return };
        let [[left, top], [right, bottom]] = whole;
        if right <= left || bottom <= top {
            return;
        }
        let columns = right - left;
        let mut most = vec![0.0_f32; columns * (bottom - top)];
        for polygon in &clipped {
            let [[x, y], [end, low]] = bounds(polygon);
            let mut raster = Rasterizer::new(end - x, low - y);
            let local = |p: &[f64; 2]| point((p[0] - x as f64) as f32, (p[1] - y as f64) as f32);
            let next = polygon.iter().cycle().skip(1);
            polygon.iter().zip(next).for_each(|(p, q)| raster.draw_line(local(p), local(q)));
            raster.for_each_pixel_2d(|u, v, coverage| {
                let i = (y - top + v as usize) * columns + x - left + u as usize;
                most[i] = most[i].max(coverage.min(1.0));
            });
        }
        let Color(r, g, b, alpha) = color;
        for (i, &coverage) in most.iter().enumerate().filter(|c| *c.1 > 0.0) {
            let at = (top + i / columns) * self.size[0] as usize + left + i % columns;
            let Some(pixel) = self.pixels.get_mut(at) else { continue };
            let share = coverage * f32::from(alpha) / 255.0;
            for (old, new) in pixel.iter_mut().zip([r, g, b]) {
                *old = (f32::from(*old) + share * (f32::from(new) - f32::from(*old))).round() as u8;
            }
        }
    }
}

/// Bounding box of a polygon on the canvas, in whole pixels: lower corner, and upper corner (exclusive).
fn bounds(polygon: &[[f64; 2]]) -> [[usize; 2]; 2] {
    let least = |k: usize| polygon.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min).floor() as usize;
    let most = |k: usize| polygon.iter().map(|p| p[k]).fold(0.0, f64::max).ceil() as usize;
    [[least(0), least(1)], [most(0), most(1)]]
}

fn union([a, b]: [[usize; 2]; 2], [c, d]: [[usize; 2]; 2]) -> [[usize; 2]; 2] {
    [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]]
}

fn disc([x, y]: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    let corners = (6.0 * radius.max(1.0).sqrt()).ceil().clamp(8.0, 90.0);
    let angle = |k: f64| TAU * k / corners;
    (0..corners as usize)
        .map(|k| [x + radius * angle(k as f64).cos(), y + radius * angle(k as f64).sin()])
        .collect()
}

/// The part of a polygon within the canvas, clipped at one side after the other.
fn clip(polygon: &[[f64; 2]], width: f64, height: f64) -> Vec<[f64; 2]> {
    let mut points = polygon.to_vec();
    for (axis, limit, sign) in [(0, 0.0, 1.0), (0, width, -1.0), (1, 0.0, 1.0), (1, height, -1.0)] {
        let depth = |p: &[f64; 2]| sign * (p[axis] - limit);
        let mut kept = Vec::with_capacity(points.len() + 4);
        for (i, q) in points.iter().enumerate() {
            let p = &points[(i + points.len() - 1) % points.len()];
            let (from, to) = (depth(p), depth(q));
            if (from < 0.0) != (to < 0.0) {
                let share = from / (from - to);
                kept.push([p[0] + share * (q[0] - p[0]), p[1] + share * (q[1] - p[1])]);
            }
            if to >= 0.0 {
                kept.push(*q);
            }
        }
        points = kept;
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(draw: impl FnOnce(&mut Picture)) -> Vec<[u8; 3]> {
        let mut picture = Picture::new([20, 10], Color::rgb(0xffffff));
        draw(&mut picture);
        pixels(&picture)
    }

    #[test]
    fn edges_cover_their_share_of_a_pixel() {
        let found = picture(|p| p.rectangle([2.5, 1.0], [4.0, 3.0], Color::rgb(0)));
        let at = |x: usize, y: usize| found[20 * y + x][0];
        assert_eq!([at(1, 1), at(3, 1), at(5, 3), at(7, 2), at(3, 0), at(3, 4)], [255, 0, 0, 255, 255, 255]);
        assert!([at(2, 2), at(6, 2)].iter().all(|v| (126..=129).contains(v)));
    }

    #[test]
    fn what_is_outside_is_cut_off() {
        let found = picture(|p| p.rectangle([-50.0, -70.0], [500.0, 75.0], Color(0, 0, 0, 255)));
        assert!(found[..100].iter().all(|p| *p == [0; 3]) && found[100..].iter().all(|p| *p == [255; 3]));
        let none = picture(|p| p.line([-5.0, -5.0], [-9.0, 30.0], Color::rgb(0), 2.0));
        assert!(none.iter().all(|p| *p == [255; 3]));
    }

    #[test]
    fn joints_of_transparent_strokes_do_not_show() {
        let corners = vec![[3.0, 3.0], [15.0, 3.0], [15.0, 8.0]];
        let stroke = Some((Color(0, 0, 0, 128), 2.0));
        let item = Item::Polygon { points: corners, fill: None, stroke, title: String::new() };
        let found = picture(|p| p.items.push(item));
        assert!(found.iter().all(|p| p[0] >= 127), "{:?}", found.iter().map(|p| p[0]).min());
    }
}
