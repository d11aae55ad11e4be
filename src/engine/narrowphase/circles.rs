//! Two circles, in lanes.
//!
//! # Circles that pass
//!
//! A step uses the gap along the normal n at its start. Let Δ be the relative motion over one step plus the
//! substep that a sweep at its end looks ahead. Two circles that pass each other during the displacement Δ end up farther
//! apart than along n. With the distance ℓ of their centers and Δ = (Δ_n, Δ_t), the distance at the end is
//!
//! ```text
//! ℓ' = √((ℓ + Δ_n)² + Δ_t²) = ℓ + Δ_n + Δ_t²/(ℓ' + ℓ + Δ_n)
//! ```
//!
//! The reported gap is increased by the last term if the circles come no closer during their displacement than an overlap
//! of one slop. It is then correct at the end of the step, and circles that do not touch are not pushed
//! apart. Circles that overlap by less than the slop, and have passed each other by the end of the step, are
//! left alone until the next step detects them.

use super::Margins;
use super::lanes::{Poses, ShapePair, Touch, abs, dot, rotate};
use crate::lanes::Lanes;

/// As fractions of the slop (1): smallest last term for which circles count as having passed, and smallest
/// gap that they then have at the end of the step.
pub(super) const PASSING: [f32; 2] = [0.2, 1e-3];

/// The gap (m) of two circles with centers `distance` apart (m) and a relative motion of `displacement` in the coming
/// step (m); see the [module](self).
#[inline(always)]
pub fn passing<L: Lanes>(touch: &Touch<L>, distance: L, displacement: [L; 2], slop: f32) -> L {
    let (zero, one, slop) = (L::zero(), L::splat(1.0), L::splat(slop));
    let gap = touch.separation[0];
    let [nx, ny] = touch.normal;
    let along = nx.mul_add(displacement[0], ny * displacement[1]);
    let across = nx.mul_add(displacement[1], -(ny * displacement[0]));
    let length = |x: L, y: L| x.mul_add(x, y * y).sqrt();
    let straight = distance + along;
    let end = length(straight, across);
    let sum = end + straight;
    let bend = sum.select_positive(across * across / sum.select_positive(sum, one), zero);
    // Fraction of the displacement at which they come closest.
    let squared = along.mul_add(along, across * across);
    let part = -(distance * along) / squared.select_positive(squared, one);
    let until = part.max(zero).min(one);
    let closest = length(until.mul_add(along, distance), until * across) - (distance - gap);
    let raised = gap + bend;
    let free = slop * L::splat(PASSING[1]) - along;
    let has_passed = (one - part).min(bend - slop * L::splat(PASSING[0]));
    let raised = has_passed.select_positive(raised.max(free), raised);
    gap.min(closest + slop).select_positive(raised, gap)
}

/// Time, as a fraction of the displacement, at which two centers that are `distance` apart (m) are `reach` apart:
/// |d + u t| = R. The second value is positive if they come that close. `toward` is the product d·u,
/// `squared` is u².
#[inline(always)]
pub fn arrival<L: Lanes>(toward: L, squared: L, [distance, reach]: [L; 2]) -> [L; 2] {
    let product = (distance - reach) * (distance + reach);
    let root = toward.mul_add(toward, -(squared * product));
    let sum = root.max(L::zero()).sqrt() - toward;
    let comes = root.min(-toward);
    [product / comes.select_positive(sum, L::splat(1.0)), comes]
}

/// Option for solvers that turn the frames of round contacts.
///
/// A contact rolls if its gap changes by less than [`Rolling::limit`] in the coming step. A rolling contact
/// keeps the gap at the start of the step, since its normal turns with it; other contacts use [`passing`].
#[derive(Clone, Copy, Debug)]
pub struct Rolling {
    /// Largest change of the gap of a rolling contact (m).
    pub limit: f32,
}

impl Rolling {
    /// Positive if a contact whose gap changes by `along` (m) rolls.
    #[inline(always)]
    pub fn rolls<L: Lanes>(self, along: L) -> L {
        L::splat(self.limit) - abs(along)
    }
}

/// Contacts of the circles of `pair` in the coming step, in which bodies move by `displacements` (`[x, y, θ, 0]`, m
/// and rad). Also returns their radii of curvature if `rolling` is given, otherwise zeros; see [`Rolling`].
#[inline(always)]
pub fn in_step<L: Lanes>(
    pair: &ShapePair<L>,
    displacements: [[L; 4]; 2],
    rolling: Option<Rolling>,
    margins: Margins,
) -> (Touch<L>, [L; 2]) {
    let (touch, distance) = with_distance(pair, margins.speculative);
    let displacement = pair.displacement(displacements);
    let immovable = pair.poses.immovable[0];
    let gap = passing(&touch, distance, displacement, margins.slop);
    let touch = touch.against_immovable(immovable);
    let Some(rolling) = rolling else { return (touch.with_gap(gap), [L::zero(); 2]) };
    let gap = rolling.rolls(dot(touch.normal, displacement)).select_positive(touch.separation[0], gap);
    // Coincident centers define no direction to turn.
    let radii = pair.size.map(|size| distance.select_positive(size[2], L::zero()));
    (touch.with_gap(gap), radii)
}

/// Contacts of the circles of `pair`. Circles farther apart than `speculative` (m) are omitted.
#[inline(always)]
pub fn collide<L: Lanes>(pair: &ShapePair<L>, speculative: f32) -> Touch<L> {
    with_distance(pair, speculative).0
}

/// As [`collide`]; also returns the distances of the centers (m).
#[inline(always)]
pub fn with_distance<L: Lanes>(pair: &ShapePair<L>, speculative: f32) -> (Touch<L>, L) {
    let (zero, one) = (L::zero(), L::splat(1.0));
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
    let touch = Touch {
        normal,
        count: (separation - L::splat(speculative)).select_positive(zero, one),
        anchor_a: [[zero; 2]; 2],
        anchor_b: [[zero; 2]; 2],
        separation: [separation; 2],
        feature: [zero; 2],
        passes: zero,
    };
    (touch.with_anchors(center_a, center_b, [size_a[2], size_b[2]]), distance)
}

impl<L: Lanes> Touch<L> {
    /// The same contact with its anchors set. The centers of the circles are given relative to the centers of
    /// mass (m); `size` are the radii (m).
    ///
    /// Each anchor is computed from its own center and radius: for circles centered on their bodies both
    /// anchors are then multiples of the normal, and only friction can turn them.
    #[inline(always)]
    fn with_anchors(self, center_a: [L; 2], center_b: [L; 2], size: [L; 2]) -> Self {
        let [r_a, r_b] = size.map(|size| L::splat(0.5).mul_add(self.separation[0], size));
        let [nx, ny] = self.normal;
        let anchor_a = [r_a.mul_add(nx, center_a[0]), r_a.mul_add(ny, center_a[1])];
        let anchor_b = [r_b.neg_mul_add(nx, center_b[0]), r_b.neg_mul_add(ny, center_b[1])];
        Touch { anchor_a: [anchor_a; 2], anchor_b: [anchor_b; 2], ..self }
    }
}
