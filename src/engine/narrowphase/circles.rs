//! Two circles, in lanes.

use super::lanes::{Poses, ShapePair, Touch, rotate};
use crate::engine::lanes::Lanes;

/// Contacts of the circles of `pair`; those farther apart than `speculative` (m) are left out.
#[inline(always)]
pub fn collide<L: Lanes>(pair: &ShapePair<L>, speculative: f32) -> Touch<L> {
    let (zero, one, half) = (L::zero(), L::splat(1.0), L::splat(0.5));
    let Poses { centers, rotation, .. } = pair.poses;
    let [[place_a, place_b], [size_a, size_b]] = [pair.place, pair.size];
    let center_a = rotate(rotation[0], [place_a[0], place_a[1]]);
    let center_b = rotate(rotation[1], [place_b[0], place_b[1]]);
    let d = [centers[0] + (center_b[0] - center_a[0]), centers[1] + (center_b[1] - center_a[1])];
    let distance = d[0].mul_add(d[0], d[1] * d[1]).sqrt();
    let apart = distance - L::splat(f32::MIN_POSITIVE);
    let inverse = one / apart.select_positive(distance, one);
    let normal = [apart.select_positive(d[0] * inverse, zero), apart.select_positive(d[1] * inverse, one)];
    let separation = distance - (size_a[2] + size_b[2]);
    // From each centre by its own radius: for circles centred on their bodies both anchors are
    // multiples of the normal, and friction is all that turns them.
    let (r_a, r_b) = (half.mul_add(separation, size_a[2]), half.mul_add(separation, size_b[2]));
    let anchor_a = [r_a.mul_add(normal[0], center_a[0]), r_a.mul_add(normal[1], center_a[1])];
    let anchor_b = [r_b.neg_mul_add(normal[0], center_b[0]), r_b.neg_mul_add(normal[1], center_b[1])];
    Touch {
        normal,
        count: (separation - L::splat(speculative)).select_positive(zero, one),
        anchor_a: [anchor_a; 2],
        anchor_b: [anchor_b; 2],
        separation: [separation; 2],
        feature: [zero; 2],
    }
}
