//! Random bodies, and the room around them.

use super::Room;
use crate::engine::bodies::BodyKind;
use crate::engine::joints::JointKind;
use crate::lab::scenes::{Capsule, Geometry, SceneBody, SceneJoint, SceneShape};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// A random number between `low` and `high`, uniform in its logarithm.
pub fn log_range(random: &mut Pcg64Mcg, low: f64, high: f64) -> f64 {
    random.random_range(low.ln()..high.ln()).exp()
}

/// True with probability 1/`n`.
pub fn once_in(random: &mut Pcg64Mcg, n: u32) -> bool {
    random.random_range(0..n) == 0
}

/// A disc, box, capsule or polygon within `size` (m) of its center, or two boxes that form a T. Without discs
/// if `rolls` is false: on a floor they would roll forever.
pub fn body(random: &mut Pcg64Mcg, position: [f64; 2], size: f64, rolls: bool) -> SceneBody {
    let part = |random: &mut Pcg64Mcg, low: f64| size * random.random_range(low..0.7);
    let mut second = None;
    let shape = match random.random_range(u32::from(!rolls)..6) {
        0 => SceneShape::disc(size * random.random_range(0.5..1.0)),
        1 | 2 => SceneShape::rectangle(part(random, 0.2), part(random, 0.2)),
        3 => capsule(part(random, 0.3), 0.4 * part(random, 0.2)),
        4 => {
            let (w, h) = (part(random, 0.4), 0.2 * part(random, 0.3));
            second = Some(SceneShape::rectangle_at([h, 0.5 * w], [0.0, 0.4 * w]));
            SceneShape::rectangle(w, h)
        }
        _ => polygon(random, size),
    };
    let mut body = SceneBody::dynamic(position, shape).turned(random.random_range(0.0..TAU));
    body.shapes.extend(second);
    body
}

/// A capsule along x.
pub fn capsule(half: f64, radius: f64) -> SceneShape {
    SceneShape::new(Geometry::Capsule(Capsule { a: [-half, 0.0], b: [half, 0.0], radius }))
}

/// Three to eight points on a circle, one in each equal sector.
fn polygon(random: &mut Pcg64Mcg, size: f64) -> SceneShape {
    let count = random.random_range(3..=8);
    let mut angle = |i: u32| TAU * (f64::from(i) + random.random_range(0.2..0.8)) / f64::from(count);
    let point = |a: f64| [size * a.cos(), size * a.sin()];
    SceneShape::polygon((0..count).map(|i| point(angle(i))).collect())
}

impl Room {
    /// A room with the middle of its floor at (`x`, 0).
    pub fn new(x: f64, half_width: f64, height: f64, wall: f64) -> Self {
        Room { low: [x - half_width, 0.0], high: [x + half_width, height], wall }
    }

    /// Floor, left and right wall, ceiling; they overlap at the corners.
    pub fn walls(&self) -> Vec<SceneBody> {
        let ([x0, y0], [x1, y1], t) = (self.low, self.high, self.wall);
        let slab = |low: [f64; 2], high: [f64; 2]| {
            let middle = [0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1])];
            let half = [0.5 * (high[0] - low[0]), 0.5 * (high[1] - low[1])];
            SceneBody::fixed(middle, SceneShape::rectangle(half[0], half[1]))
        };
        vec![
            slab([x0 - t, y0 - t], [x1 + t, y0]),
            slab([x0 - t, y0 - t], [x0, y1 + t]),
            slab([x1, y0 - t], [x1 + t, y1 + t]),
            slab([x0 - t, y1], [x1 + t, y1 + t]),
        ]
    }

    /// Positions for `count` bodies that reach at most `size`, apart from each other: rows from the floor up,
    /// `inset` from the two walls. Fewer if the room is too small.
    pub fn places(&self, random: &mut Pcg64Mcg, count: u32, size: f64, inset: [f64; 2]) -> Vec<[f64; 2]> {
        let cell = 2.3 * size;
        let (left, right) = (self.low[0] + inset[0], self.high[0] - inset[1]);
        let columns = (((right - left) / cell).floor() as u32).max(1);
        let rows = ((self.high[1] - self.low[1]) / cell).floor() as u32;
        let mut place = |i: u32| {
            let mut along = |k: u32| cell * (f64::from(k) + 0.5 + random.random_range(-0.05..0.05));
            [left + along(i % columns), self.low[1] + 1.01 * along(i / columns)]
        };
        (0..count.min(columns * rows)).map(&mut place).collect()
    }
}

/// A kinematic box.
pub fn driven(position: [f64; 2], half: [f64; 2], velocity: [f64; 2], spin: f64) -> SceneBody {
    SceneBody::new(BodyKind::Kinematic, position, SceneShape::rectangle(half[0], half[1]))
        .moving(velocity, spin)
}

/// A static disc, and a chain of boxes with half extents `half` that extends from it to the right.
pub fn chain(
    [x, y]: [f64; 2],
    half: [f64; 2],
    links: u32,
    kind: &JointKind,
) -> (Vec<SceneBody>, Vec<SceneJoint>) {
    let (mut bodies, mut joints) = (vec![SceneBody::fixed([x, y], SceneShape::disc(0.02))], vec![]);
    for i in 0..links {
        let link = SceneShape::rectangle(half[0], half[1]);
        let [before, place] = [bodies.len() - 1, bodies.len()];
        bodies.push(SceneBody::dynamic([x + half[0] * f64::from(2 * i + 1), y], link));
        let anchor = if i == 0 { 0.0 } else { half[0] };
        joints.push(SceneJoint::new(before, place, kind.clone()).at([anchor, 0.0], [-half[0], 0.0]));
    }
    (bodies, joints)
}

/// Gives every shape of a body this density (kg/m²).
pub fn of_density(mut body: SceneBody, density: f64) -> SceneBody {
    body.shapes.iter_mut().for_each(|shape| shape.density = density);
    body
}

/// Gives every shape of a body this friction and restitution.
pub fn of_surface(mut body: SceneBody, friction: f64, restitution: f64) -> SceneBody {
    for shape in &mut body.shapes {
        (shape.friction, shape.restitution) = (friction, restitution);
    }
    body
}
