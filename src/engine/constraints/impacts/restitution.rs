//! Bouncing: one pass at the end of a step, and its own side records. [`crate::engine::constraints::impacts::waves`] has let bounce before
//! the step what was seen to come in; here is what only others pushed together.
//!
//! Newton's law wants v_n⁺ = −e v_n⁻ at the moment of impact. A step does not stop there: the
//! speed is known at its start, some way s₀ above (or below) the surface, and the bounce is
//! applied at its end, at a separation s. In between, the relative normal acceleration a of
//! free flight changes the speed. Semi-implicit Euler of substep h keeps, in flight, not
//! v²/2 + a s but the shadow energy
//!
//! ```text
//! E = v²/2 + a (s − v h/2)          (v' = v − a h, s' = s + h v'  ⇒  E' = E)
//! ```
//!
//! so with E₀ from the start of the step, the rebound v > 0 that has e² E₀ at separation s is
//!
//! ```text
//! v = a h/2 + √((a h/2)² + 2 (e² E₀ − a s))
//! ```
//!
//! which is e |v₀| without acceleration. A ball that falls on the ground then returns to e² of
//! its height whatever the step. Between two bodies that fall together a is zero, also where one
//! of them is held up from below: what others do to them is not seen.
//!
//! Every point that came in faster than the threshold and pushed at all is given the impulse
//! λ = −m_eff (v_n − v), clamped on the accumulated impulse. Scenes in which nothing bounces have
//! neither the pass nor the side records.
//!
//! Source: `catto2024box2d` for the placement after the sweeps and for the threshold, and for e times the speed of approach;
//! the
//! rebound speed is *derived* here.

use crate::engine::constraints::kernels::frame::turn;
use crate::engine::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::engine::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::engine::constraints::records::bounces::Bounces;
use crate::engine::constraints::records::features::{KernelFeatures, Layout, LayoutOf, OppositeKind};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneIndex, Lanes};
use glam::Vec2;

/// Side record: the acceleration a of approach (m/s²), then per point the energy e² E₀ (m²/s²; zero where it shall not
/// bounce) and the largest normal impulse so far (N·s).
pub(super) const fn stride(points: usize) -> usize {
    1 + 2 * points
}

/// How fast what comes in shall leave, where nothing else says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rebound {
    /// Approach (m/s) that a point has to exceed.
    pub threshold: f32,
    /// At e times the height that it has come from, else at e times its speed.
    pub in_flight: bool,
    /// Points that bore an impulse in the step before bounce only if e ≥ 1.
    pub only_new: bool,
}

/// Reads the energies, before anything moves.
pub struct Begin<'a> {
    /// Substep (s).
    pub h: f32,
    /// How fast points shall leave.
    pub rebound: Rebound,
    /// Lane vectors of a side record.
    pub stride: usize,
    /// Contacts that do not bounce; none if empty. `[contacts]`
    pub stopped: &'a [bool],
    /// Whether a point may bounce: greater than zero (m²/s²).
    pub found: f32,
}

impl Pass for Begin<'_> {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        let bounce = 1 + 2 * layout.points;
        let read = 2 + layout.points * (layout.arms() + 1);
        PerLane { halves: 0, ..PerLane::of_bodies(read, bounce, opposite) }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        let (contacts, increments) = (on.contacts, on.increments);
        let most = prepare::<L, F>(on.rows, on.batches, on.bounces, contacts, increments, self);
        self.found = self.found.max(most);
    }
}

/// Notes the largest impulses, after each substep.
pub struct Track;

impl Pass for Track {
    fn traffic(&self, layout: &Layout, _: OppositeKind) -> PerLane {
        PerLane { floats_read: 2 * layout.points, floats_written: layout.points, ..PerLane::default() }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        track::<L, F>(on.batches, on.bounces);
    }
}

/// Bounces, at the end of the step.
pub struct Apply {
    /// Substep (s).
    pub h: f32,
}

impl Pass for Apply {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        // Bodies are gathered for each point: to look, and to push.
        let read = 3 + layout.points * (layout.arms() + 5);
        let once = PerLane::of_bodies(read, layout.points, opposite);
        let rows = layout.points * (once.rows + once.halves);
        PerLane { rows, halves: layout.points * once.halves, ..once }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        apply::<L, F>(on.rows, on.batches, on.bounces, self.h);
    }
}

/// Forgets the impulses of points that bounced.
pub struct Forget;

impl Pass for Forget {
    fn traffic(&self, layout: &Layout, _: OppositeKind) -> PerLane {
        let impulses = if layout.has_friction { 2 } else { 1 };
        let floats = layout.points * impulses;
        PerLane { floats_read: floats + 2 * layout.points, floats_written: floats, ..PerLane::default() }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        forget::<L, F>(on.batches, on.bounces);
    }
}

// What follows is compiled per width alone: layouts are looked up per segment, and a branch on
// them per batch is not measurable beside the gathers.

/// Reads energies before anything moves. `increments` are the changes of velocity in free flight
/// per substep, `[h aₓ, h a_y, h α, 0]` per row. Returns the greatest energy (m²/s²).
pub fn prepare<L: Lanes, N: KernelFeatures>(
    rows: &[BodyRow],
    batches: &mut Batches,
    bounces: &mut Bounces,
    contacts: &[Contact],
    increments: &[[f32; 4]],
    begin: &Begin<'_>,
) -> f32 {
    bounces.reserve(batches.lanes(), begin.stride);
    let mut most = 0.0_f32;
    batches.each_segment(N::layout, |batches, segment, layout| {
        let found =
            prepare_segment::<L>(rows, batches, segment, layout, bounces, contacts, increments, begin);
        most = most.max(found);
    });
    most
}

#[allow(clippy::too_many_arguments)]
#[inline(never)]
fn prepare_segment<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    contacts: &[Contact],
    increments: &[[f32; 4]],
    &Begin { h, rebound, stopped, .. }: &Begin<'_>,
) -> f32 {
    let mut most = L::zero();
    let SegmentRecords { records, contact, row_a, row_b } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride);
    let rows_of = row_a.batches().zip(row_b.batches());
    let all = bounces.of::<L>(segment).zip(records);
    let all = all.zip(contact.batches::<L::Index>().zip(rows_of));
    for (batch, ((bounce, record), (contact, (row_a, row_b)))) in all.enumerate() {
        let floats: &mut [f32] = bytemuck::cast_slice_mut(bounce);
        for lane in 0..L::WIDTH {
            // Lanes without a contact have e = 0 and so no energy.
            let e = if lane < segment.filled(batch, L::WIDTH) {
                let index = contact.entries()[lane] as usize;
                let is_stopped = stopped.get(index).is_some_and(|is| *is);
                if is_stopped { 0.0 } else { contacts[index].restitution }
            } else {
                0.0
            };
            let increment = |row: u32| Vec2::new(increments[row as usize][0], increments[row as usize][1]);
            let [a, b] = [row_a, row_b].map(|row| increment(row.entries()[lane]));
            let record: &[f32] = bytemuck::cast_slice(record);
            let n = Vec2::new(record[lane], record[L::WIDTH + lane]);
            floats[lane] = if rebound.in_flight { -n.dot(b - a) / h } else { 0.0 };
            floats[L::WIDTH + lane] = e;
        }
        let (a, e) = (bounce[0], bounce[1]);
        for p in 0..layout.points {
            let [v, s] = point::<L>(rows, record, layout, p, row_a, row_b);
            let energy = L::splat(0.5) * v * v + a * (s - v * L::splat(0.5 * h));
            let mut fast = (L::splat(-rebound.threshold) - v).select_positive(energy, L::zero());
            if rebound.only_new {
                let is_old = record[layout.at(p, layout.normal_impulse)];
                let lossy = (L::splat(1.0) - e).select_positive(L::zero(), fast);
                fast = is_old.select_positive(lossy, fast);
            }
            bounce[1 + 2 * p] = e * e * fast;
            bounce[2 + 2 * p] = L::zero();
            most = most.max(bounce[1 + 2 * p]);
        }
    }
    largest(most)
}

/// The largest of all lanes, or zero.
pub(crate) fn largest<L: Lanes>(value: L) -> f32 {
    let floats: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&value));
    floats.iter().fold(0.0, |most, &x| x.max(most))
}

/// The speed v of a rebound that has the energy `energy` (m²/s²) at `separation` (m); see the [module](self).
#[inline(always)]
pub(crate) fn rebound<L: Lanes>(energy: L, a: L, separation: L, h: f32) -> L {
    let half = a * L::splat(0.5 * h);
    let left = half * half + L::splat(2.0) * (energy - a * separation);
    half + left.max(L::zero()).sqrt()
}

/// Normal velocity (m/s) and separation (m) of point `p` of a batch, as bodies now are.
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

/// Notes the largest impulse of each point so far.
pub fn track<L: Lanes, N: KernelFeatures>(batches: &mut Batches, bounces: &mut Bounces) {
    each_record::<L>(batches, bounces, N::layout, |record, bounce, layout| {
        for p in 0..layout.points {
            bounce[2 + 2 * p] = bounce[2 + 2 * p].max(record[layout.at(p, layout.normal_impulse)]);
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

/// The bounce itself, contact after contact in sweep order.
pub fn apply<L: Lanes, N: KernelFeatures>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    bounces: &mut Bounces,
    h: f32,
) {
    batches.each_segment(N::layout, |batches, segment, layout| {
        apply_segment::<L>(rows, batches, segment, layout, bounces, h);
    });
}

#[inline(never)]
fn apply_segment<L: Lanes>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    h: f32,
) {
    let pushes_a = segment.pushes_a();
    let SegmentRecords { records, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride).zip(bounces.of::<L>(segment));
    for ((record, bounce), (row_a, row_b)) in records.zip(row_a.batches().zip(row_b.batches())) {
        for p in 0..layout.points {
            let [vn, separation] = point::<L>(rows, record, layout, p, row_a, row_b);
            let (a, energy, peak) = (bounce[0], bounce[1 + 2 * p], bounce[2 + 2 * p]);
            let rebound = rebound(energy, a, separation, h);
            let old = record[layout.at(p, layout.normal_impulse)];
            let mass = record[layout.at(p, layout.normal_mass)];
            let target = mass.neg_mul_add(vn - rebound, old).max(L::zero());
            let new = bounced(energy, peak, target, old);
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

/// `yes` where a point with this energy and this largest impulse bounces, else `no`.
#[inline(always)]
fn bounced<L: Lanes>(energy: L, peak: L, yes: L, no: L) -> L {
    energy.select_positive(peak.select_positive(yes, no), no)
}

/// Forgets the impulses of points that bounced: they say nothing about the next step.
pub fn forget<L: Lanes, N: KernelFeatures>(batches: &mut Batches, bounces: &mut Bounces) {
    each_record::<L>(batches, bounces, N::layout, |record, bounce, layout| {
        for p in 0..layout.points {
            let mut forget = |at: usize| {
                let at = layout.at(p, at);
                record[at] = bounced(bounce[1 + 2 * p], bounce[2 + 2 * p], L::zero(), record[at]);
            };
            forget(layout.normal_impulse);
            if layout.has_friction {
                forget(layout.tangent_impulse);
            }
        }
    });
}
