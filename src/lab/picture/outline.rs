//! Shapes as closed polygons.

use crate::engine::shapes::Shape;
use std::f64::consts::TAU;

/// Corners per full turn; their chords are within 0.2 % of the arc.
const ROUND: usize = 48;

/// The border of a shape in its body's frame (m), counter-clockwise. A segment has two points; arcs become
/// chords.
pub fn outline(shape: &Shape) -> Vec<[f64; 2]> {
    let mut core: Vec<[f64; 2]> = Vec::new();
    shape.for_each_vertex(|v| core.push([f64::from(v.x), f64::from(v.y)]));
    let radius = f64::from(shape.radius());
    if radius == 0.0 {
        return core;
    }
    // At every vertex, an arc from the normal of the previous edge to that of the next one.
    let count = core.len();
    let direction = |i: usize| {
        let ([px, py], [qx, qy]) = (core[i % count], core[(i + 1) % count]);
        (px - qx).atan2(qy - py)
    };
    let mut points = Vec::new();
    for (i, [x, y]) in core.iter().enumerate() {
        let (start, turn) = match count {
            1 => (0.0, TAU),
            _ => {
                let (before, after) = (direction(i + count - 1), direction(i));
                (before, (after - before).rem_euclid(TAU))
            }
        };
        let chords = ((turn / TAU * ROUND as f64).ceil() as usize).max(1);
        let last = if count == 1 { chords - 1 } else { chords };
        for k in 0..=last {
            let angle = start + turn * k as f64 / chords as f64;
            points.push([x + radius * angle.cos(), y + radius * angle.sin()]);
        }
    }
    points
}

/// Points of a body's frame, transformed by its pose (m, rad).
pub fn placed(points: &[[f64; 2]], [x, y, angle]: [f64; 3]) -> Vec<[f64; 2]> {
    let (sin, cos) = angle.sin_cos();
    points.iter().map(|[u, v]| [x + cos * u - sin * v, y + sin * u + cos * v]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    fn area(points: &[[f64; 2]]) -> f64 {
        let next = points.iter().cycle().skip(1);
        points.iter().zip(next).map(|(p, q)| 0.5 * (p[0] * q[1] - p[1] * q[0])).sum()
    }

    #[test]
    fn outlines_enclose_the_area_of_their_shape() {
        let shapes = [
            Shape::circle("", Vec2::new(3.0, 1.0), 0.5).unwrap(),
            Shape::capsule("", Vec2::new(-1.0, 0.0), Vec2::new(1.0, 2.0), 0.25).unwrap(),
            Shape::rectangle("", Vec2::new(1.0, 0.5), Vec2::ZERO, 0.3, 0.0).unwrap(),
            Shape::rectangle("", Vec2::new(1.0, 0.5), Vec2::ZERO, 0.3, 0.2).unwrap(),
        ];
        for shape in shapes {
            // At unit density the mass is the area.
            let (found, exact) = (area(&outline(&shape)), shape.mass(1.0).mass);
            assert!((found / exact - 1.0).abs() < 4e-3, "{shape:?}: {found} {exact}");
        }
        let segment = Shape::segment("", Vec2::ZERO, Vec2::X).unwrap();
        assert_eq!(outline(&segment), [[0.0, 0.0], [1.0, 0.0]]);
    }

    #[test]
    fn a_pose_turns_and_moves() {
        let [p] = placed(&[[1.0, 0.0]], [2.0, 3.0, TAU / 4.0])[..] else { panic!() };
        assert!((p[0] - 2.0).abs() < 1e-15 && (p[1] - 4.0).abs() < 1e-15);
    }
}
