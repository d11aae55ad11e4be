//! A rounded hull and a circle, in lanes: the point of the core nearest to the circle's center.
//!
//! That point lies on the face with the largest height h of the center above it (see [`super::hulls`], with a
//! single point as the other hull). Let o be the distance of the center past an end of the face, or 0. The
//! center is at h n + o n⊥ from the point. Over the face and inside the core that is along n itself, so a
//! long segment adds no rounding error.

use super::Margins;
use super::circles::{PASSING, Rolling, arrival};
use super::hull::{Hull, HullRow};
use super::lanes::{Poses, ShapeRow, Touch, abs, displacement_between, dot, perp, rotate, unrotate};
use crate::lanes::{LaneIndex, Lanes, MOST_LANES};

/// Hulls (as a) and circles (as b).
pub struct HullCircle<L> {
    hull: Hull<L>,
    /// The circle's center in its body's frame, and its radius (m).
    circle: ([L; 2], L),
    /// Number of slots in use.
    count: usize,
}

impl<L: Lanes> HullCircle<L> {
    /// Empty buffers for `L::WIDTH` pairs.
    pub fn empty() -> Self {
        HullCircle { hull: Hull::empty(), circle: ([L::zero(); 2], L::zero()), count: 0 }
    }

    /// Reads `L::WIDTH` pairs.
    #[inline(always)]
    pub fn gather(&mut self, hulls: &[HullRow], rows: &[ShapeRow], [a, b]: [LaneIndex<L::Index>; 2]) {
        self.count = self.hull.gather_heads(hulls, a);
        self.hull.gather_corners(hulls, a, self.count, |corner| corner);
        let [place, size] = ShapeRow::gather::<L>(rows, b);
        self.circle = ([place[0], place[1]], size[2]);
    }

    /// Displacement of the circle's center in the hull's frame when bodies move by `[x, y, θ, 0]` (m, rad).
    #[inline(always)]
    fn displacement(&self, poses: &Poses<L>, displacements: [[L; 4]; 2]) -> [L; 2] {
        let center = rotate(poses.rotation[1], self.circle.0);
        displacement_between(
            displacements,
            [[poses.centers[0] + center[0], poses.centers[1] + center[1]], center],
        )
    }

    /// Contacts in the coming step, in which bodies move by `displacements` (`[x, y, θ, 0]`, m and rad); those farther
    /// apart than `margins.speculative` (m) are omitted. Also returns their gaps, which at a corner are those
    /// of two passing circles ([`super::circles`]), and the radii of curvature of hull and circle if
    /// `rolling` is given, otherwise zeros.
    #[inline(always)]
    pub fn in_step(
        &self,
        poses: &Poses<L>,
        displacements: [[L; 4]; 2],
        rolling: Option<Rolling>,
        margins: Margins,
    ) -> (Touch<L>, L, [L; 2]) {
        let displacement = self.displacement(poses, displacements);
        let (zero, one, half) = (L::zero(), L::splat(1.0), L::splat(0.5));
        let rotation_a = poses.rotation[0];
        let (center, radius) = (rotate(poses.rotation[1], self.circle.0), self.circle.1);
        let c = unrotate(rotation_a, [poses.centers[0] + center[0], poses.centers[1] + center[1]]);
        let corners = &self.hull.corners[..self.count];
        let mut height = L::splat(f32::NEG_INFINITY);
        let mut face = [zero; 6];
        for (i, &[x, y, nx, ny]) in corners.iter().enumerate() {
            let [next_x, next_y, ..] = corners[if i + 1 == corners.len() { 0 } else { i + 1 }];
            let over = dot([nx, ny], [c[0] - x, c[1] - y]);
            let lower = height - over;
            height = lower.select_positive(height, over);
            let new = [x, y, nx, ny, next_x, next_y];
            face = std::array::from_fn(|k| lower.select_positive(face[k], new[k]));
        }
        let [x, y, nx, ny, next_x, next_y] = face;
        let (n, t) = ([nx, ny], perp([nx, ny]));
        let (along, length) = (dot(t, [c[0] - x, c[1] - y]), dot(t, [next_x - x, next_y - y]));
        let past = along - along.min(length).max(zero);
        let slant = height.mul_add(height, past * past).sqrt();
        // Past an end, and not too close to define a direction.
        let corner = height.min(abs(past)).min(slant - L::splat(f32::MIN_POSITIVE));
        let distance = corner.select_positive(slant, height);
        let inverse = one / corner.select_positive(slant, one);
        let normal = [
            corner.select_positive(height.mul_add(n[0], past * t[0]) * inverse, n[0]),
            corner.select_positive(height.mul_add(n[1], past * t[1]) * inverse, n[1]),
        ];
        let separation = distance - (self.hull.head[0] + radius);
        let displacement = unrotate(rotation_a, displacement);
        let gap = {
            let slop = L::splat(margins.slop);
            let (up, aside) = (dot(n, displacement), dot(t, displacement));
            let toward = height.mul_add(up, past * aside);
            let length_of = |x: L, y: L| x.mul_add(x, y * y).sqrt();
            // Position at the end of the step: above the face, or past one of its ends.
            let (over, along) = (height + up, along + aside);
            let end = length_of(over, along - along.min(length).max(zero));
            let straight = inverse.mul_add(toward, distance);
            let bend = (end - straight).max(zero);
            let squared = up.mul_add(up, aside * aside);
            let part = -toward / squared.select_positive(squared, one);
            let until = part.max(zero).min(one);
            let reach = distance - separation;
            let closest = length_of(until.mul_add(up, height), until.mul_add(aside, past)).min(end) - reach;
            let raised = separation + bend;
            let free = inverse.neg_mul_add(toward, slop * L::splat(PASSING[1]));
            let has_passed = (one - part).min(bend - slop * L::splat(PASSING[0]));
            let raised = has_passed.select_positive(raised.max(free), raised);
            let passes = corner.min(separation).min(over).min(closest + slop);
            passes.select_positive(raised, separation)
        };
        let mut gap = gap;
        let mut radii = [zero; 2];
        if let Some(rolling) = rolling {
            let rolls = rolling.rolls(dot(normal, displacement));
            gap = rolls.select_positive(separation, gap);
            // When the circle is at touching distance, it must still be past the same end, and above the
            // face.
            let reach = distance - separation;
            let [part, comes] = arrival(
                dot(normal, displacement) * distance,
                dot(displacement, displacement),
                [distance, reach],
            );
            let part = comes.select_positive(part, zero);
            let (up, aside) = (dot(n, displacement), dot(t, displacement));
            let outside = past * part.mul_add(aside, past);
            let stays = rolls.select_positive(one, part.mul_add(up, height).min(outside));
            let curved = corner.select_positive(self.hull.head[0], L::splat(f32::INFINITY));
            let is_told = corner.select_positive(stays, one);
            radii = [curved, radius].map(|radius| is_told.select_positive(radius, zero));
        }
        let normal = rotate(rotation_a, normal);
        let between = poses.centers;
        // Relative to the circle's center: for a circle centered on its body the anchor is a multiple of the
        // normal, so only friction can turn it. a's anchor follows from the centers of mass.
        let arm = half.mul_add(separation, radius);
        let anchor_b = [arm.neg_mul_add(normal[0], center[0]), arm.neg_mul_add(normal[1], center[1])];
        let anchor_a = [anchor_b[0] + between[0], anchor_b[1] + between[1]];
        let touch = Touch {
            normal,
            count: (separation - L::splat(margins.speculative)).select_positive(zero, one),
            anchor_a: [anchor_a; 2],
            anchor_b: [anchor_b; 2],
            separation: [separation; 2],
            feature: [zero; 2],
            passes: zero,
        };
        (touch, gap, radii)
    }
}

impl HullCircle<f32> {
    /// A single pair.
    pub fn new(hull: HullRow, row: ShapeRow) -> Self {
        let mut pair = Self::empty();
        pair.gather(&[hull], &[row], [LaneIndex::new(&[0; MOST_LANES]); 2]);
        pair
    }
}
