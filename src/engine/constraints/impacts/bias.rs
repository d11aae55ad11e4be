//! Restitution as a velocity bias: the rebound speed is the target of the rows.
//!
//! A point that approaches at v⁻ < −1 m/s and reaches the surface within the substep leaves at u = e |v⁻|.
//! Its row is
//!
//! ```text
//! λ ← max(0, λ − m_eff (v_n − u))
//! ```
//!
//! instead of the row of the solver's rule. Few points bounce in a step, so a separate sweep over them
//! follows each sweep of the solver. The solver's sweep skips them, because their effective mass is moved to
//! the side record. Friction rows are unchanged. Scenes without bounces have neither the sweep nor the side
//! records.
//!
//! Solvers of vectors read the same u into the right-hand side of their problem instead, b = −u ([`ReadTargets`]).
//!
//! Source: `catto2007box2d` (`b2ContactSolver`, velocity bias, Box2D 1 to 2.4).

use super::restitution::{largest, point, restitution_of};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::bounces::Bounces;
use crate::constraints::records::features::{KernelFeatures, Layout};
use crate::constraints::records::point_vector::places;
use crate::contacts::Contact;
use crate::lanes::{Block, BodyRow, Lanes};

/// Side record: per point u (m/s; zero if it does not bounce) and its effective mass (kg).
pub(super) const fn stride(points: usize) -> usize {
    2 * points
}

/// Finds the points that bounce in the coming substep.
pub struct FindBounces {
    /// Substep (s).
    pub h: f32,
    /// Whether this is the first substep: no effective masses have to be restored.
    pub is_first: bool,
    /// Approach speed above which a point bounces (m/s).
    pub slowest: f32,
    /// The fastest rebound (m/s); zero if nothing bounces.
    pub fastest: f32,
}

/// One sweep over the points that bounce.
pub struct BiasSweep;

/// Reads u of every point into the normal entries of a vector, and restores effective masses: the rows of points
/// that bounce become rows like the others.
pub struct ReadTargets<'a> {
    /// Entries of the colored and of the serial batches.
    pub to: [&'a mut [Block]; 2],
}

impl Pass for FindBounces {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.bounces.reserve(on.batches.lanes(), stride(F::POINTS));
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            begin::<L>(on.rows, batches, segment, layout, on.bounces, on.contacts, self);
        });
    }
}

impl Pass for BiasSweep {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            sweep::<L>(on.rows, batches, segment, layout, on.bounces);
        });
    }
}

impl Pass for ReadTargets<'_> {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        let to: &mut [L] = bytemuck::cast_slice_mut(self.to[on.part as usize]);
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            let records = batches.records_of::<L>(segment, layout).records.chunks_exact_mut(layout.stride);
            for (batch, (record, side)) in records.zip(on.bounces.of::<L>(segment)).enumerate() {
                for p in 0..layout.points {
                    let at = layout.at(p, layout.normal_mass);
                    let (target, mass) = (side[2 * p], side[2 * p + 1]);
                    record[at] = target.select_positive(mass, record[at]);
                    to[places::<L>(segment.first_slot + batch * L::WIDTH, p)[0]] = target;
                }
            }
        });
    }
}

#[inline(never)]
fn begin<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    contacts: &[Contact],
    to: &mut FindBounces,
) {
    let SegmentRecords { records, contact, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let indices = contact.batches::<L::Index>().zip(row_a.batches().zip(row_b.batches()));
    let records = records.chunks_exact_mut(layout.stride).zip(bounces.of::<L>(segment));
    let (zero, h) = (L::zero(), L::splat(to.h));
    let mut most = zero;
    for (batch, ((record, side), (contact, (row_a, row_b)))) in records.zip(indices).enumerate() {
        let e = restitution_of::<L>(contacts, &contact.entries()[..segment.filled(batch, L::WIDTH)]);
        for p in 0..layout.points {
            let at = layout.at(p, layout.normal_mass);
            if !to.is_first {
                record[at] = side[2 * p].select_positive(side[2 * p + 1], record[at]);
            }
            let [v, gap] = point::<L>(rows, record, layout, p, row_a, row_b);
            let reaches = -v.mul_add(h, gap);
            let is_hit = (L::splat(-to.slowest) - v).min(reaches).min(record[at]);
            let target = is_hit.select_positive(-(e * v), zero);
            (side[2 * p], side[2 * p + 1]) = (target, record[at]);
            record[at] = target.select_positive(zero, record[at]);
            most = most.max(target);
        }
    }
    to.fastest = largest(most).max(to.fastest);
}

#[inline(never)]
fn sweep<L: Lanes>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
) {
    let pushes_a = segment.pushes_a();
    let SegmentRecords { records, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride).zip(bounces.of::<L>(segment));
    for ((record, side), (row_a, row_b)) in records.zip(row_a.batches().zip(row_b.batches())) {
        for p in 0..layout.points {
            let (target, mass) = (side[2 * p], side[2 * p + 1]);
            if !target.any_positive() {
                continue;
            }
            let [vn, _] = point::<L>(rows, record, layout, p, row_a, row_b);
            let at = layout.at(p, layout.normal_impulse);
            let old = record[at];
            let new = mass.neg_mul_add(vn - target, old).max(L::zero());
            record[at] = target.select_positive(new, old);
            super::restitution::push::<L>(
                rows,
                record,
                layout,
                p,
                [row_a, row_b],
                pushes_a,
                record[at] - old,
            );
        }
    }
}
