//! Restitution as one pass at the end of a step, with its own side records.
//!
//! Newton's law requires v_n⁺ = −e v_n⁻ at the time of impact. A step does not stop there: the approach speed is read
//! at its start, and the rebound is applied at its end.
//!
//! Every point that approached faster than the threshold and carried an impulse gets the impulse λ = −m_eff (v_n − e
//! |v_n⁻|), clamped on the accumulated impulse. Scenes in which nothing bounces have neither the pass nor the side
//! records.
//!
//! Source: `catto2024box2d`.

use crate::constraints::kernels::frame::turn;
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::bounces::Bounces;
use crate::constraints::records::features::{KernelFeatures, Layout, LayoutOf};
use crate::contacts::Contact;
use crate::lanes::{BodyRow, LaneIndex, Lanes};

/// Side record: per point the rebound speed (m/s; zero if it does not bounce) and the largest normal impulse
/// so far (N·s).
pub(super) const fn stride(points: usize) -> usize {
    2 * points
}

/// Which points bounce.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rebound {
    /// Approach speed above which a point bounces (m/s).
    pub threshold: f32,
    /// Points that carried an impulse in the previous step bounce only if e ≥ 1.
    pub only_new: bool,
}

/// Reads the approach speeds before anything moves.
pub struct ReadApproach {
    /// Which points bounce.
    pub rebound: Rebound,
    /// Lane vectors of a side record.
    pub stride: usize,
    /// The fastest rebound (m/s); zero if nothing bounces.
    pub found: f32,
}

impl Pass for ReadApproach {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        let most = prepare::<L, F>(on.rows, on.batches, on.bounces, on.contacts, self);
        self.found = self.found.max(most);
    }
}

/// Records the largest impulse of each point after each substep.
pub struct Track;

impl Pass for Track {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        track::<L, F>(on.batches, on.bounces);
    }
}

/// Applies the rebounds at the end of the step.
pub struct Apply;

impl Pass for Apply {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        apply::<L, F>(on.rows, on.batches, on.bounces);
    }
}

// The functions below are compiled once per lane width. Layouts are looked up per segment; a branch on
// them per batch costs nothing measurable next to the gathers.

/// Reads approach speeds before anything moves. Returns the fastest rebound (m/s).
pub fn prepare<L: Lanes, N: KernelFeatures>(
    rows: &[BodyRow],
    batches: &mut Batches,
    bounces: &mut Bounces,
    contacts: &[Contact],
    begin: &ReadApproach,
) -> f32 {
    bounces.reserve(batches.lanes(), begin.stride);
    let mut most = 0.0_f32;
    batches.each_segment(N::layout, |batches, segment, layout| {
        let found = prepare_segment::<L>(rows, batches, segment, layout, bounces, contacts, begin.rebound);
        most = most.max(found);
    });
    most
}

#[inline(never)]
fn prepare_segment<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    contacts: &[Contact],
    rebound: Rebound,
) -> f32 {
    let mut most = L::zero();
    let SegmentRecords { records, contact, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride).zip(row_a.batches().zip(row_b.batches()));
    let sides = bounces.of::<L>(segment);
    for (batch, (bounce, (record, (row_a, row_b)))) in sides.zip(records).enumerate() {
        let first = batch * L::WIDTH;
        let filled = segment.filled(batch, L::WIDTH);
        // Lanes without a contact have e = 0 and do not bounce.
        let e = restitution_of::<L>(contacts, &contact.entries()[first..first + filled]);
        for p in 0..layout.points {
            let [v, _] = point::<L>(rows, record, layout, p, row_a, row_b);
            let energy = L::splat(0.5) * v * v;
            let mut fast = (L::splat(-rebound.threshold) - v).select_positive(energy, L::zero());
            if rebound.only_new {
                let is_old = record[layout.at(p, layout.normal_impulse)];
                let lossy = (L::splat(1.0) - e).select_positive(L::zero(), fast);
                fast = is_old.select_positive(lossy, fast);
            }
            bounce[2 * p] = (L::splat(2.0) * (e * e * fast)).sqrt();
            bounce[2 * p + 1] = L::zero();
            most = most.max(bounce[2 * p]);
        }
    }
    largest(most)
}

/// The largest of all lanes, or zero.
pub(crate) fn largest<L: Lanes>(value: L) -> f32 {
    let floats: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&value));
    floats.iter().fold(0.0, |most, &x| x.max(most))
}

/// Normal velocity (m/s) and separation (m) of point `p` of a batch, at the current positions.
#[inline(always)]
pub(crate) fn point<L: Lanes>(
    rows: &[BodyRow],
    record: &[L],
    layout: &Layout,
    p: usize,
    row_a: LaneIndex<L::Index>,
    row_b: LaneIndex<L::Index>,
) -> [L; 2] {
    let b = L::gather(rows, row_b);
    let a = if layout.a_has_row { L::gather(rows, row_a) } else { [L::zero(); 8] };
    let along_n = |at: usize| record[0].mul_add(b[at] - a[at], record[1] * (b[at + 1] - a[at + 1]));
    let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[6]), turn(b[6]));
    let with_arms = |base: L, [a, b]: [L; 2], axis: usize| {
        let mut v = base;
        if layout.has_arms[0] {
            v = b.mul_add(record[layout.at(p, layout.arm_b) + axis], v);
        }
        if layout.has_arms[1] {
            v = a.neg_mul_add(record[layout.at(p, layout.arm_a) + axis], v);
        }
        v
    };
    let separation = record[layout.at(p, layout.separation)] + along_n(4);
    let separation = with_arms(separation, [sine_a, sine_b], 0);
    [with_arms(along_n(0), [a[2], b[2]], 0), with_arms(separation, [versine_a, versine_b], 1)]
}

/// Records the largest impulse of each point so far.
pub fn track<L: Lanes, N: KernelFeatures>(batches: &mut Batches, bounces: &mut Bounces) {
    each_record::<L>(batches, bounces, N::layout, |record, bounce, layout| {
        for p in 0..layout.points {
            bounce[2 * p + 1] = bounce[2 * p + 1].max(record[layout.at(p, layout.normal_impulse)]);
        }
    });
}

/// Calls `visit` with every record and its side record.
#[inline(always)]
fn each_record<L: Lanes>(
    batches: &mut Batches,
    bounces: &mut Bounces,
    layout_of: LayoutOf,
    mut visit: impl FnMut(&mut [L], &mut [L], &Layout),
) {
    batches.each_segment(layout_of, |batches, segment, layout| {
        let records = batches.records_of::<L>(segment, layout).records.chunks_exact_mut(layout.stride);
        for (record, bounce) in records.zip(bounces.of::<L>(segment)) {
            visit(record, bounce, layout);
        }
    });
}

/// Applies the rebounds, contact by contact in sweep order.
pub fn apply<L: Lanes, N: KernelFeatures>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    bounces: &mut Bounces,
) {
    batches.each_segment(N::layout, |batches, segment, layout| {
        apply_segment::<L>(rows, batches, segment, layout, bounces);
    });
}

#[inline(never)]
fn apply_segment<L: Lanes>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
) {
    let pushes_a = segment.pushes_a();
    let SegmentRecords { records, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride).zip(bounces.of::<L>(segment));
    for ((record, bounce), (row_a, row_b)) in records.zip(row_a.batches().zip(row_b.batches())) {
        for p in 0..layout.points {
            let [vn, _] = point::<L>(rows, record, layout, p, row_a, row_b);
            let (rebound, peak) = (bounce[2 * p], bounce[2 * p + 1]);
            let old = record[layout.at(p, layout.normal_impulse)];
            let mass = record[layout.at(p, layout.normal_mass)];
            let target = mass.neg_mul_add(vn - rebound, old).max(L::zero());
            let new = rebound.select_positive(peak.select_positive(target, old), old);
            record[layout.at(p, layout.normal_impulse)] = new;
            let delta = new - old;
            push::<L>(rows, record, layout, p, [row_a, row_b], pushes_a, delta);
        }
    }
}

/// Applies the impulse `delta` along n (N·s) at point `p` of a batch.
#[inline(always)]
pub(super) fn push<L: Lanes>(
    rows: &mut [BodyRow],
    record: &[L],
    layout: &Layout,
    p: usize,
    [row_a, row_b]: [LaneIndex<L::Index>; 2],
    pushes_a: bool,
    delta: L,
) {
    let arms = |at: usize| record[layout.at(p, at)];
    let (x, y) = (record[0] * delta, record[1] * delta);
    let b = L::gather(rows, row_b);
    let w = if layout.has_arms[0] { (b[7] * arms(layout.arm_b)).mul_add(delta, b[2]) } else { b[2] };
    L::scatter_velocity(rows, row_b, [b[3].mul_add(x, b[0]), b[3].mul_add(y, b[1]), w, b[3]]);
    if pushes_a {
        let a = L::gather(rows, row_a);
        let turned = (a[7] * arms(layout.arm_a)).neg_mul_add(delta, a[2]);
        let w = if layout.has_arms[1] { turned } else { a[2] };
        let v = [a[3].neg_mul_add(x, a[0]), a[3].neg_mul_add(y, a[1]), w, a[3]];
        L::scatter_velocity(rows, row_a, v);
    }
}

/// e of the contacts in the filled lanes of a batch, zero in the others.
#[inline(always)]
pub(crate) fn restitution_of<L: Lanes>(contacts: &[Contact], filled: &[u32]) -> L {
    let mut e = L::zero();
    let lanes: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut e));
    lanes.iter_mut().zip(filled).for_each(|(lane, &contact)| *lane = contacts[contact as usize].restitution);
    e
}
