//! Random shapes and poses, for laws of the narrow phase.

use glam::Vec2;
use proptest::prelude::*;
use simpulse::engine::shapes::{Pose, Shape};

pub fn v(x: f32, y: f32) -> Vec2 {
    Vec2::new(x, y)
}

pub fn coordinate(limit: f32) -> impl Strategy<Value = f32> {
    // Built from integers: over many cases, the sampler of symmetric float ranges fails its own assertion.
    (-(1i32 << 20)..=1 << 20).prop_map(move |k| limit * k as f32 / (1 << 20) as f32)
}

pub fn point(limit: f32) -> impl Strategy<Value = Vec2> {
    (coordinate(limit), coordinate(limit)).prop_map(|(x, y)| v(x, y))
}

/// Radius by which a shape is grown, often none.
pub fn rounding() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0f32), 0.01f32..0.5]
}

pub fn rectangle() -> impl Strategy<Value = Shape> {
    (0.05f32..1.5, 0.05f32..1.5, point(0.5), coordinate(3.0), rounding()).prop_map(
        |(hx, hy, center, angle, r)| Shape::rectangle("b", v(hx, hy), center, angle, r).expect("valid"),
    )
}

pub fn circle() -> impl Strategy<Value = Shape> {
    (point(0.5), 0.05f32..1.0).prop_map(|(c, r)| Shape::circle("c", c, r).expect("valid"))
}

pub fn capsule() -> impl Strategy<Value = Shape> {
    (point(1.0), point(1.0), 0.01f32..0.5)
        .prop_filter_map("long enough", |(a, b, r)| Shape::capsule("c", a, b, r).ok())
}

pub fn segment() -> impl Strategy<Value = Shape> {
    (point(1.5), point(1.5)).prop_filter_map("long enough", |(a, b)| Shape::segment("s", a, b).ok())
}

/// 3 to 8 points of an ellipse in angular order, so convex by construction.
pub fn polygon() -> impl Strategy<Value = Shape> {
    let angles = prop::collection::vec(0.0f32..std::f32::consts::TAU, 3..=8);
    (angles, 0.1f32..1.5, 0.1f32..1.5, point(0.5), rounding()).prop_filter_map(
        "valid polygon",
        |(mut angles, rx, ry, center, radius)| {
            angles.sort_by(f32::total_cmp);
            let corner = |&t: &f32| center + v(rx, ry) * Vec2::from_angle(t);
            Shape::polygon("polygon", &angles.iter().map(corner).collect::<Vec<_>>(), radius).ok()
        },
    )
}

/// Multiples of a quarter turn make flush faces common.
pub fn pose(limit: f32) -> impl Strategy<Value = Pose> {
    let angle =
        prop_oneof![4 => coordinate(3.2), 1 => (-2..3).prop_map(|k| k as f32 * std::f32::consts::FRAC_PI_2)];
    (point(limit), angle).prop_map(|(position, angle)| Pose::new(position, angle))
}
