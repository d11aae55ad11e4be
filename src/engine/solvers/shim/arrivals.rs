//! Arrivals: which contacts without restitution are hit in the coming step.
//!
//! A point arrives if it closes its gap within the step, and comes in several times as fast as what rests can.
//! Forces alone make a speed of dt |a| in a step: between two bodies that others push as well, in any direction,
//! dt (|a_a| + |a_b|); against one that nothing pushes, dt |n·a_b|, so that a wall that moves with a jolt is seen.

use crate::engine::constraints::impacts::waves::AHEAD;
use crate::engine::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::engine::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::engine::constraints::records::features::{KernelFeatures, Layout, OppositeKind};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneIndex, Lanes, Quad};

/// Looks for arrivals; see the [module](self).
pub(crate) struct Arrivals<'a> {
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Slower is rest (m/s).
    pub slowest: f32,
    /// Least that forces add to the speed of a dynamic body in a step (m/s).
    pub least_gain: f32,
    /// No point of a body is faster (m/s).
    pub fastest: f32,
    /// Lanes of the contacts that are hit, in order: all of them, or more than are followed.
    pub found: &'a mut Vec<u32>,
}

impl Pass for Arrivals<'_> {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        // Half a row of accelerations for each body that has some.
        let accelerations = if opposite == OppositeKind::Dynamic { 8 } else { 4 };
        let read = 2 + accelerations + layout.points * (layout.arms() + 2);
        PerLane { halves: 0, ..PerLane::of_bodies(read, 0, opposite) }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            arrivals::<L>(on.rows, batches, segment, layout, on.contacts, on.increments, self);
        });
    }
}

/// More contacts that are hit at once are not followed.
pub(crate) const MOST: usize = 32;

/// How much faster than what forces make in a step something comes in (1). Slower impacts are left to soft contacts, as
/// loads are: a house of cards that is built with air below its cards comes down on them in its first steps.
const FASTER: f32 = 2.0;

#[inline(never)]
fn arrivals<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    contacts: &[Contact],
    increments: &[[f32; 4]],
    &mut Arrivals { h, dt, slowest, least_gain, fastest, ref mut found }: &mut Arrivals<'_>,
) {
    let between_dynamic = segment.pushes_a();
    let least = if between_dynamic { slowest.max(2.0 * FASTER * least_gain) } else { slowest };
    if 2.0 * fastest <= least {
        return;
    }
    let SegmentRecords { records, contact, row_a, row_b } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride).zip(row_a.batches().zip(row_b.batches()));
    let quads: &[Quad] = bytemuck::cast_slice(increments);
    let (zero, per_step) = (L::zero(), L::splat(FASTER * dt / h));
    for (batch, (record, (row_a, row_b))) in records.enumerate() {
        let (row_a, row_b): (LaneIndex<L::Index>, LaneIndex<L::Index>) = (row_a, row_b);
        if found.len() > MOST {
            return;
        }
        // No body has moved yet.
        let b = L::gather(rows, row_b);
        let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
        let along = |x: L, y: L| record[0].mul_add(x, record[1] * y);
        let straight = along(b[0] - a[0], b[1] - a[1]);
        let velocity = |p: usize| {
            let arm = |of: usize, has: bool| if has { record[layout.at(p, of)] } else { zero };
            let (of_a, of_b) = (arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0]));
            a[2].neg_mul_add(of_a, b[2].mul_add(of_b, straight))
        };
        let fastest = (0..layout.points).fold(zero, |most, p| most.max(-velocity(p)));
        if !(fastest - L::splat(least)).any_positive() {
            continue;
        }
        let [bx, by, ..] = L::gather_quads::<1, 0>(quads, row_b);
        // What forces add to the velocity of approach in a substep, and what at most (m/s).
        let (gained, most) = if between_dynamic {
            let [ax, ay, ..] = L::gather_quads::<1, 0>(quads, row_a);
            let size = |x: L, y: L| x.mul_add(x, y * y).sqrt();
            (along(ax - bx, ay - by), size(ax, ay) + size(bx, by))
        } else {
            let gained = -along(bx, by);
            (gained, gained.max(-gained))
        };
        let threshold = (per_step * most).max(L::splat(slowest));
        let fall = gained * L::splat((0.5 * dt + 0.5 * h) / h);
        let mut any = zero;
        for p in 0..layout.points {
            let (v, s) = (velocity(p), record[layout.at(p, layout.separation)]);
            let closes = (v - fall).mul_add(L::splat(AHEAD * dt), s);
            let fast = record[layout.at(p, layout.normal_mass)].select_positive(-threshold - v, zero);
            any = any.max((-closes).select_positive(fast, zero));
        }
        if any.any_positive() {
            let hit: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&any));
            let first = batch * L::WIDTH;
            for lane in (0..segment.filled(batch, L::WIDTH)).filter(|&lane| hit[lane] > 0.0) {
                if contacts[contact.entries()[first + lane] as usize].restitution == 0.0 {
                    found.push((segment.first_lane + first + lane) as u32);
                }
            }
        }
    }
}
