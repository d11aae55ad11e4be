//! Frozen contacts: while two bodies hardly move, their contact keeps its normal and its lever arms.
//!
//! The narrow phase skips a pair as long as, since its manifold was found,
//!
//! ```text
//! |Δd| + ρ |sin Δθ| < distance,    |Δθ_a|, |Δθ_b| < turn
//! ```
//!
//! d is the center of b in the frame of a, Δθ the turn of b relative to a, and ρ the larger extent of the two
//! bodies, 0 for one that is static (`catto2024box2d`, `b2CollideTask`; `crozet2025rapier`, whose bound uses the chord
//! 2 ρ sin Δθ/2 instead). Normal n and arms r stay as they are **in the world**. Only the separations follow
//! the bodies:
//!
//! ```text
//! s = s₀ + n·(d + R(Δθ_b) r_b − R(Δθ_a) r_a),    d = x_b − x_a
//! ```
//!
//! s₀ is chosen such that s is the separation that was found. Points keep their feature ids and impulses.
//!
//! # What it changes
//!
//! A body that leans by Δθ shifts the arms of its loads by h Δθ, where h is their height above its center. Fresh
//! arms carry the moment F h Δθ of this shift into the sweeps, frozen ones do not. This moment is what makes a
//! column of soft contacts buckle (Greenhill's beam), so frozen columns stand. The same moment tips a box over
//! its edge, so frozen boxes tip late.
//!
//! A contact with two loaded points can take up the missing moment: it moves the load F between its points, by
//! F δ/2b for arms that are δ off on a base of half-width b. Nothing has to move for that. A contact on one point
//! has no such reserve: the whole missing moment acts on the motion. With [`FreezeLimits::loaded_only`], only
//! contacts whose two points both carry load are therefore frozen, and the error of a tipping moment is bounded
//! by δ/b, with δ ≤ distance.
//!
//! Contacts of discs are never frozen: their points do not stay fixed on them.
//!
//! # Subnormal numbers
//!
//! In the first steps of a symmetric scene, bodies turn by angles as small as 1e-40. Rounding soon hides them in a fresh
//! contact, but a frozen one would keep them, and their products with small velocities are subnormal. Many processors
//! take more than a hundred cycles for each such product. [`Found::note`] therefore replaces negligible parts of
//! normal and arms by zero.

use super::Margins;
use super::batch::{JobLists, NO_CONTACT};
use super::lanes::{PoseRow, Poses, Touch, abs, rotate, unrotate};
use crate::contacts::{Contact, quad};
use crate::lanes::{LaneIndex, Lanes, MOST_LANES, Shared, align_frame};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;

/// Motion within which a contact stays frozen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FreezeLimits {
    /// Motion of b relative to a (m for bodies of about a meter, see `Settings::length_unit`).
    pub distance: f32,
    /// Rotation of each body (rad).
    pub turn: f32,
    /// Whether only contacts with two points, both of which carried load in the last step, are frozen.
    #[cfg_attr(feature = "serde", serde(default))]
    pub loaded_only: bool,
}

impl FreezeLimits {
    /// Those of Box2D and rapier: 5 cm, and acos 0.98 (`catto2024box2d`, `crozet2025rapier`).
    pub const BOX2D: FreezeLimits = FreezeLimits { distance: 0.05, turn: 0.200_335, loaded_only: false };

    /// Where only contacts with two loaded points are frozen: 1 mm errs by 0.2 % of a tipping moment on a base of a meter,
    /// and 4 mrad by 1 % of the angle of friction for µ = 0.5.
    pub const LOADED: FreezeLimits = FreezeLimits { distance: 0.001, turn: 0.004, loaded_only: true };
}

/// Whether the contacts of a world are frozen while bodies hardly move, see the [module](self).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Freezing {
    /// As in the solver's source.
    #[default]
    Own,
    /// Never: every manifold is found again in every step.
    Off,
    /// Within these limits.
    Within(FreezeLimits),
}

impl Freezing {
    /// The limits of a run under a solver whose source has `own`; `None` if nothing is frozen. A distance of
    /// zero freezes nothing.
    pub fn limits(self, own: Option<FreezeLimits>) -> Option<FreezeLimits> {
        let limits = match self {
            Freezing::Own => own,
            Freezing::Off => None,
            Freezing::Within(limits) => Some(limits),
        };
        limits.filter(|l| l.distance > 0.0)
    }
}

/// As on the command line: own, off, or distance (m) and turn (rad).
impl std::fmt::Display for Freezing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Freezing::Own => write!(f, "own"),
            Freezing::Off => write!(f, "off"),
            Freezing::Within(FreezeLimits { distance, turn, loaded_only }) => {
                write!(f, "{distance},{turn}{}", if *loaded_only { ",loaded" } else { "" })
            }
        }
    }
}

/// The poses at which a manifold was found, as two quads.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Found {
    /// d in the frame of a, and s₀ of both points (m).
    place: [f32; 4],
    /// Cosine and sine of the rotations of a and b.
    turns: [f32; 4],
}

/// Quads of a [`Found`].
const STRIDE: usize = 2;
const PLACE: usize = 0;
const TURNS: usize = 1;

/// Parts of a normal below this, and parts of arms below this share of the slop, are zero in a frozen contact (1). It is
/// far below the rounding of a unit vector, and far above numbers whose products are subnormal.
const NEGLIGIBLE: f32 = 1e-10;

impl Found {
    /// Of a contact that is found again in the next step.
    pub const NEVER: Found = Found { place: [f32::MAX; 4], turns: [0.0; 4] };

    /// Notes the poses of contacts that were just found, for the contacts `target`. Returns them without negligible
    /// parts, and with separations rounded as those that will [follow](follow), so that a second collision at the same
    /// poses gives the same contacts. Does nothing if `found` is empty.
    #[inline(always)]
    pub fn note<L: Lanes>(
        found: Shared<'_, Found>,
        target: LaneIndex<L::Index>,
        poses: &Poses<L>,
        touch: Touch<L>,
        margins: Margins,
    ) -> Touch<L> {
        if found.is_empty() {
            return touch;
        }
        let parts =
            |v: [L; 2], least: f32| v.map(|x| (abs(x) - L::splat(least)).select_positive(x, L::zero()));
        let arms = |anchors: [[L; 2]; 2]| anchors.map(|r| parts(r, NEGLIGIBLE * margins.slop));
        let normal = parts(touch.normal, NEGLIGIBLE);
        let (anchor_a, anchor_b) = (arms(touch.anchor_a), arms(touch.anchor_b));
        let [a, b] = poses.rotation;
        let turns = Turns::since([a, b], poses);
        let gap = [0, 1].map(|p| turns.gap(poses, normal, anchor_a[p], anchor_b[p]));
        let start = [0, 1].map(|p| touch.separation[p] - gap[p]);
        let [x, y] = unrotate(a, poses.centers);
        L::scatter_shared::<_, STRIDE, PLACE>(found, target, [x, y, start[0], start[1]]);
        L::scatter_shared::<_, STRIDE, TURNS>(found, target, [a[0], a[1], b[0], b[1]]);
        let separation = [0, 1].map(|p| start[p] + gap[p]);
        Touch { normal, anchor_a, anchor_b, separation, ..touch }
    }
}

/// Rotations Δθ of a and b, (cos, sin).
struct Turns<L>([[L; 2]; 2]);

impl<L: Lanes> Turns<L> {
    /// From earlier rotations of a and b.
    #[inline(always)]
    fn since([a, b]: [[L; 2]; 2], poses: &Poses<L>) -> Self {
        Turns([unrotate(a, poses.rotation[0]), unrotate(b, poses.rotation[1])])
    }

    /// n·(d + R(Δθ_b) r_b − R(Δθ_a) r_a) (m).
    #[inline(always)]
    fn gap(&self, poses: &Poses<L>, [nx, ny]: [L; 2], anchor_a: [L; 2], anchor_b: [L; 2]) -> L {
        let (a, b) = (rotate(self.0[0], anchor_a), rotate(self.0[1], anchor_b));
        let gap = |k: usize| poses.centers[k] + b[k] - a[k];
        nx * gap(0) + ny * gap(1)
    }
}

/// Lets the contacts of a batch of jobs stay frozen whose bodies have hardly moved: their separations follow the bodies.
/// Returns the number of points of each contact that stays frozen, and 0 for other jobs. Jobs without a contact read
/// contact `none`, which never stays frozen.
#[inline(never)]
pub(super) fn follow<L: Lanes>(
    lists: JobLists,
    batch: Range<usize>,
    poses: &[PoseRow],
    limits: FreezeLimits,
    (contacts, found, none): (Shared<'_, Contact>, Shared<'_, Found>, u32),
) -> [f32; MOST_LANES] {
    use quad::{ANCHORS_0, ANCHORS_1, HEADER, STATE_0, STATE_1};
    const RECORD: usize = quad::STRIDE;
    align_frame();
    let contact_of = |&i: &u32| if i == NO_CONTACT { none } else { i };
    let [a, b, .., all] = lists.0;
    let coming = batch.end..(batch.end + L::WIDTH).min(all.entries().len());
    for i in all.entries()[coming].iter().map(contact_of) {
        found.prefetch(i);
        contacts.prefetch(i);
    }
    let mut target = [none; MOST_LANES];
    target.iter_mut().zip(&all.entries()[batch.clone()]).for_each(|(to, i)| *to = contact_of(i));
    let target = LaneIndex::new(&target);
    let [room_a, room_b] = &mut [[0; MOST_LANES]; 2];
    let bodies = [a.batch_at(batch.start, room_a), b.batch_at(batch.start, room_b)];
    let poses = Poses::<L>::gather(poses, bodies);
    let (zero, one, two) = (L::zero(), L::splat(1.0), L::splat(2.0).integer_bits());
    let mut counts = [0.0; MOST_LANES];

    let [x, y, s_0, s_1] = L::gather_shared::<_, STRIDE, PLACE>(found, target);
    let [cos_a, sin_a, cos_b, sin_b] = L::gather_shared::<_, STRIDE, TURNS>(found, target);
    let ([a, b], [a_0, b_0]) = (poses.rotation, [[cos_a, sin_a], [cos_b, sin_b]]);
    let offset = unrotate(a, poses.centers);
    let moved = [offset[0] - x, offset[1] - y];
    let (now, then) = (unrotate(a, b), unrotate(a_0, b_0));
    let sine = abs(now[0] * then[1] - now[1] * then[0]);
    let motion = (moved[0] * moved[0] + moved[1] * moved[1]).sqrt() + poses.extent * sine;
    // Selections in turn, so that no lane with a NaN stays.
    let turned = |p: [L; 2], q: [L; 2]| p[0] * q[0] + p[1] * q[1] - L::splat(limits.turn.cos());
    let stays = turned(b, b_0).select_positive(one, zero);
    let stays = turned(a, a_0).select_positive(stays, zero);
    let mut stays = (L::splat(limits.distance) - motion).select_positive(stays, zero);
    if !stays.any_positive() {
        return counts;
    }
    let [separation_0, id_0, normal_0, tangent_0] = L::gather_shared::<_, RECORD, STATE_0>(contacts, target);
    let [separation_1, id_1, normal_1, tangent_1] = L::gather_shared::<_, RECORD, STATE_1>(contacts, target);
    if limits.loaded_only {
        // A point that is not in use bears nothing.
        stays = normal_0.select_positive(normal_1.select_positive(stays, zero), zero);
        if !stays.any_positive() {
            return counts;
        }
    }
    let [nx, ny, used, _] = L::gather_shared::<_, RECORD, HEADER>(contacts, target);
    let turns = Turns::since([a_0, b_0], &poses);
    let gap = |[ax, ay, bx, by]: [L; 4]| turns.gap(&poses, [nx, ny], [ax, ay], [bx, by]);
    let new_0 = s_0 + gap(L::gather_shared::<_, RECORD, ANCHORS_0>(contacts, target));
    let new_1 = s_1 + gap(L::gather_shared::<_, RECORD, ANCHORS_1>(contacts, target));
    let new_0 = stays.select_positive(new_0, separation_0);
    let new_1 = used.select_equal(two, stays.select_positive(new_1, separation_1), separation_1);
    L::scatter_shared::<_, RECORD, STATE_0>(contacts, target, [new_0, id_0, normal_0, tangent_0]);
    L::scatter_shared::<_, RECORD, STATE_1>(contacts, target, [new_1, id_1, normal_1, tangent_1]);
    let count = stays.select_positive(used.select_equal(two, L::splat(2.0), one), zero);
    counts[..L::WIDTH].copy_from_slice(bytemuck::cast_slice(&[count]));
    counts
}
