//! Finds closed points, and applies their loads of the last step to the accelerations of bodies.
//!
//! A point is closed if three conditions hold. Its gap is below a fraction of the slop. Its normal speed is
//! at most the speed that forces give resting bodies in a step, v ≤ dt (|a_a| + |a_b|). And it is still
//! closed in the middle of the step: a load acts until the end of the step, and does work on bodies that have
//! separated. The load of a newly closed point starts from the impulse of the last substep, which it
//! replaces. So a sagging point counts as closed as long as it overlaps. If its spring lost its impulse
//! whenever a heavy body rocks on it, the rocking would not stop.
//!
//! A contact is calm if its points have been slower than 1 mm/s for 0.3 s, which is longer than a rocking
//! body pauses between swings. If its springs are also shortened for nearly all of its load, they follow the
//! load at once from then on ([`super::shorten`]).
//!
//! As long as it is not, the load of a slow contact is at most the force of its spring. Loads that squeeze a body
//! between others have no single solution. Those of a landing, which loads start from, may be many times what the
//! springs bear afterwards, and preload for them would wedge the body.
//!
//! The part of the impulses for which springs are not shortened is the part that statics does not explain.

use super::{JOINED, OPEN};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{KernelFeatures, Layout};
use crate::lanes::{BodyRow, LaneIndex, Lanes, Quad};
use crate::params::LINEAR_SLOP;

/// Greatest gap of a closed point (m).
const CLOSED: f32 = 0.02 * LINEAR_SLOP;

/// Speed below which a point is calm (m/s): a twentieth of the gap of a closed point in the time in which
/// loads rise.
const CALM_SPEED: f32 = 1e-3;

/// Time after which a slow contact is calm (s).
pub(super) const CALM_TIME: f32 = 0.3;

/// Fraction of its load at which the springs of a calm contact start to follow the load at once, and of the force of a
/// spring above which it is more than its load (1).
pub(super) const NEARLY: f32 = 0.99;

/// Largest preload ÷ (mass × radius of gyration ÷ dt²) (1); see [`super::shorten`].
const MOST: f32 = 50.0;

/// Finds closed points, and starts from their loads.
pub(in super::super) struct Close<'a> {
    /// Changes of velocity in free flight per substep. `[rows]`
    pub fields: &'a mut [BodyRow],
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Size of typical bodies (m).
    pub length_unit: f32,
}

impl Pass for Close<'_> {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            close::<L>(on.rows, batches, segment, layout, on.kept.contacts(), on.increments, self);
        });
    }
}

#[inline(never)]
fn close<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    kept: &mut [f32],
    increments: &[[f32; 4]],
    &mut Close { ref mut fields, h, dt, length_unit }: &mut Close<'_>,
) {
    let SegmentRecords { records, contact, row_a, row_b } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride).zip(contact.batches::<L::Index>());
    let quads: &mut [Quad] = bytemuck::cast_slice_mut(kept);
    let increments: &[Quad] = bytemuck::cast_slice(increments);
    let (zero, one, open) = (L::zero(), L::splat(1.0), L::splat(OPEN));
    let (closed, half_step) = (L::splat(CLOSED * length_unit), L::splat(0.5 * dt));
    let (per_step, per_substep, h) = (L::splat(dt / h), L::splat(1.0 / h), L::splat(h));
    let rows_of = row_a.batches().zip(row_b.batches());
    for (batch, ((record, index), (row_a, row_b))) in records.zip(rows_of).enumerate() {
        let (row_a, row_b): (LaneIndex<L::Index>, LaneIndex<L::Index>) = (row_a, row_b);
        let gather = |rows: &[BodyRow]| {
            let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
            [a, L::gather(rows, row_b)]
        };
        let ([a, b], [mut free_a, mut free_b]) = (gather(rows), gather(fields));
        let gained = |row: LaneIndex<L::Index>| {
            let [x, y, ..]: [L; 4] = L::gather_quads::<1, 0>(increments, row);
            x.mul_add(x, y * y).sqrt()
        };
        let of_a = if segment.pushes_a() { gained(row_a) } else { zero };
        let still = per_step * (of_a + gained(row_b));
        let is_free = L::splat(0.5) - free_a[JOINED].max(free_b[JOINED]);
        let [nx, ny] = [record[0], record[1]];
        let straight = nx.mul_add(b[0] - a[0], ny * (b[1] - a[1]));
        let last: [L; 4] = L::gather_quads::<2, 0>(quads, index);
        let [calm, _, borne_0, borne_1]: [L; 4] = L::gather_quads::<2, 1>(quads, index);
        let mut loads = [open, zero, open, zero];
        let (mut fastest, mut is_short) = (zero, zero);
        for p in 0..layout.points {
            let arms = arms_of(record, layout, p);
            let vn = a[2].neg_mul_add(arms[0][0], b[2].mul_add(arms[1][0], straight));
            let speed = vn.max(-vn);
            fastest = fastest.max(record[layout.at(p, layout.normal_mass)].select_positive(speed, zero));
            let at = |quantity: usize| record[layout.at(p, quantity)];
            let near = closed - at(layout.separation);
            let in_the_middle = half_step.mul_add(vn, at(layout.separation));
            let stays = near.min(still - speed).min(closed - in_the_middle);
            let is_closed = at(layout.normal_mass).min(is_free).select_positive(stays, zero);
            let has_borne = last[2 * p] + L::splat(0.5);
            let begun = |kept: L, impulse: L| has_borne.select_positive(kept, impulse * per_substep);
            let borne = if p == 0 { borne_0 } else { borne_1 };
            let lacks =
                (borne + L::splat(0.5)).select_positive(L::splat(NEARLY).mul_add(last[2 * p], -borne), zero);
            let carried = at(layout.normal_impulse) * per_substep / last[2 * p];
            let carried = carried.max(L::splat(f32::EPSILON)).min(one);
            let share = last[2 * p].min(calm).min(lacks).select_positive(carried, one);
            let last = [last[2 * p] * share, last[2 * p + 1] * share];
            let normal = begun(last[0], at(layout.normal_impulse));
            let tangent = if layout.has_friction { begun(last[1], at(layout.tangent_impulse)) } else { zero };
            loads[2 * p] = is_closed.select_positive(normal, open);
            loads[2 * p + 1] = is_closed.select_positive(tangent, zero);
            let impulse = [loads[2 * p].max(zero) * h, loads[2 * p + 1] * h];
            // The rest of the impulses is what statics does not explain.
            let part = last[0].select_positive(borne.max(zero) / last[0], one);
            is_short = is_short.max(lacks);
            let at = layout.at(p, layout.normal_impulse);
            record[at] = part.neg_mul_add(impulse[0], record[at]);
            if layout.has_friction {
                let at = layout.at(p, layout.tangent_impulse);
                record[at] = part.neg_mul_add(impulse[1], record[at]);
            }
            push([&mut free_a, &mut free_b], [nx, ny], arms, impulse);
        }
        L::scatter_velocity(fields, row_b, [free_b[0], free_b[1], free_b[2], free_b[3]]);
        if segment.pushes_a() {
            L::scatter_velocity(fields, row_a, [free_a[0], free_a[1], free_a[2], free_a[3]]);
        }
        store::<L, 0>(quads, index, segment.filled(batch, L::WIDTH), loads);
        let calm = (calm + L::splat(dt)).min(L::splat(2.0 * CALM_TIME));
        let calm = (L::splat(CALM_SPEED * length_unit) - fastest).select_positive(calm, zero);
        let at_once = calm - L::splat(CALM_TIME);
        let is_pair = if layout.points == 2 { record[layout.at(1, layout.normal_mass)] } else { zero };
        let at_once = is_pair.select_positive(is_short.select_positive(zero, at_once), zero);
        let borne = [borne_0, borne_1].map(|borne| at_once.select_positive(-one, borne));
        let size = |body: &[L; 8]| {
            let [inv_mass, inv_inertia] = [body[3], body[7]];
            let turns = inv_inertia.select_positive(inv_inertia, one);
            inv_inertia.select_positive((inv_mass / turns).sqrt(), L::splat(1e30))
        };
        let most = L::splat(MOST / (dt * dt)) * size(&a).min(size(&b));
        store::<L, 1>(quads, index, segment.filled(batch, L::WIDTH), [calm, most, borne[0], borne[1]]);
    }
}

/// r × n and r × t of a and b at point `p` (m).
#[inline(always)]
pub(super) fn arms_of<L: Lanes>(record: &[L], layout: &Layout, p: usize) -> [[L; 2]; 2] {
    let arm = |first: usize, has: bool| {
        if has { [record[layout.at(p, first)], record[layout.at(p, first) + 1]] } else { [L::zero(); 2] }
    };
    [arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0])]
}

/// Applies impulses along n and t (N·s) to a and b.
#[inline(always)]
pub(super) fn push<L: Lanes>([a, b]: [&mut [L; 8]; 2], [nx, ny]: [L; 2], arms: [[L; 2]; 2], [n, t]: [L; 2]) {
    let (x, y) = (nx.mul_add(n, ny * t), ny.mul_add(n, -(nx * t)));
    let turn = |arm: [L; 2]| arm[0].mul_add(n, arm[1] * t);
    (b[0], b[1]) = (b[3].mul_add(x, b[0]), b[3].mul_add(y, b[1]));
    b[2] = b[7].mul_add(turn(arms[1]), b[2]);
    (a[0], a[1]) = (a[3].neg_mul_add(x, a[0]), a[3].neg_mul_add(y, a[1]));
    a[2] = a[7].neg_mul_add(turn(arms[0]), a[2]);
}

/// Writes quad `O` of the kept numbers of the contacts in the `filled` lanes of a batch.
#[inline(always)]
pub(super) fn store<L: Lanes, const O: usize>(
    quads: &mut [Quad],
    index: LaneIndex<L::Index>,
    filled: usize,
    values: [L; 4],
) {
    if filled == L::WIDTH {
        L::scatter_quads::<2, O>(quads, index, values);
        return;
    }
    for (lane, &contact) in index.entries()[..filled].iter().enumerate() {
        let of = |value: &L| bytemuck::cast_slice::<L, f32>(std::slice::from_ref(value))[lane];
        quads[2 * contact as usize + O].0 = [of(&values[0]), of(&values[1]), of(&values[2]), of(&values[3])];
    }
}
