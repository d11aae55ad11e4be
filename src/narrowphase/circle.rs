//! A circle as shape b: against a circle, a capsule or segment, and a polygon.
//!
//! All three come down to the normal, the distance of the circle's centre from a's
//! core, and [`contact`].

use super::{Frame, unrotate};
use crate::contacts::{Manifold, ManifoldPoint};
use crate::shapes::{Polygon, Shape};
use glam::Vec2;

/// Contact of `a` with the circle of `radius` around `center` (b's frame).
#[inline]
pub(super) fn collide(a: &Shape, center: Vec2, radius: f32, frame: &Frame, speculative: f32) -> Manifold {
    let center = frame.rotation_b.rotate(center);
    let (radius_a, (normal, distance)) = match a {
        Shape::Circle { center: center_a, radius: radius_a } => {
            let center_a = frame.rotation_a.rotate(*center_a);
            let apart = frame.centers + (center - center_a);
            let (normal, distance) = direction(apart, Vec2::Y);
            let separation = distance - (radius_a + radius);
            if separation > speculative {
                return Manifold::default();
            }
            // From each centre by its own radius: for circles centred on their bodies both
            // anchors are multiples of the normal, and friction is all that turns them.
            let point = ManifoldPoint {
                anchor_a: center_a + (radius_a + 0.5 * separation) * normal,
                anchor_b: center - (radius + 0.5 * separation) * normal,
                separation,
                ..ManifoldPoint::default()
            };
            return Manifold::single(normal, point);
        }
        Shape::Capsule { a, b, radius } => (*radius, from_segment(*a, *b, center, frame)),
        Shape::Segment { a, b } => (0.0, from_segment(*a, *b, center, frame)),
        Shape::Polygon(polygon) => {
            (polygon.radius, from_polygon(polygon, center, frame, speculative + radius + polygon.radius))
        }
    };
    let separation = distance - (radius_a + radius);
    if separation > speculative {
        return Manifold::default();
    }
    // From the circle's centre, for the same reason; a follows from the centres of mass.
    let anchor_b = center - (radius + 0.5 * separation) * normal;
    let anchor_a = anchor_b + frame.centers;
    Manifold::single(normal, ManifoldPoint { anchor_a, anchor_b, separation, ..ManifoldPoint::default() })
}

/// Unit vector along `v` and the length of `v`; `otherwise` if it has none.
#[inline(always)]
fn direction(v: Vec2, otherwise: Vec2) -> (Vec2, f32) {
    let length = v.length();
    if length > f32::MIN_POSITIVE { (v / length, length) } else { (otherwise, 0.0) }
}

/// From the segment a–b (a's frame) to `center` (from b's centre of mass, world axes):
/// unit normal in world axes, and distance.
#[inline(always)]
fn from_segment(a: Vec2, b: Vec2, center: Vec2, frame: &Frame) -> (Vec2, f32) {
    let a_to_center = unrotate(frame.rotation_a, frame.centers + center) - a;
    let edge = b - a;
    // Closest point a + t·edge of the segment.
    let t = (a_to_center.dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
    let side = edge.perp().normalize_or(Vec2::Y);
    let (normal, distance) = if t > 0.0 && t < 1.0 {
        // From the line itself: exact for long segments, where a + t·edge would round.
        let height = a_to_center.dot(side);
        (if height < 0.0 { -side } else { side }, height.abs())
    } else {
        direction(a_to_center - t * edge, side)
    };
    (frame.rotation_a.rotate(normal), distance)
}

/// As [`from_segment`], for a polygon's core; negative inside. Gives up, with the
/// separation of one face, once that is above `reach`.
#[inline(always)]
fn from_polygon(polygon: &Polygon, center: Vec2, frame: &Frame, reach: f32) -> (Vec2, f32) {
    let c = unrotate(frame.rotation_a, frame.centers + center);
    // The face farthest below the centre carries the closest point (see `hull_hull`, with
    // a single point for the other hull). Padding repeats the last face and changes nothing.
    let heights: [f32; 8] = std::array::from_fn(|i| polygon.normals[i].dot(c - polygon.vertices[i]));
    let mut face = 0;
    for i in 1..8 {
        face = if heights[i] > heights[face] { i } else { face };
    }
    let (normal, height) = (polygon.normals[face], heights[face]);
    let (v1, v2) = (polygon.vertices[face], polygon.vertices[(face + 1) % polygon.count as usize]);
    let tangent = normal.perp();
    let (from_v1, from_v2) = (c - v1, c - v2);
    let (local, distance) = if height <= 0.0 || height > reach {
        (normal, height)
    } else if tangent.dot(from_v1) < 0.0 {
        direction(from_v1, normal)
    } else if tangent.dot(from_v2) > 0.0 {
        direction(from_v2, normal)
    } else {
        (normal, height)
    };
    (frame.rotation_a.rotate(local), distance)
}
