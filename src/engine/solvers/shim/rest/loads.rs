//! One projected Gauss–Seidel sweep over the loads of closed points; see [`super`].
//!
//! With P = F h and the change of velocity per substep w = h a instead of accelerations,
//!
//! ```text
//! P_n ← max(0, P_n − m_n J_n w)      P_t ← P_t − m_t J_t w within ±µ P_n
//! ```

use super::closed::{arms_of, push, store};
use crate::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{KernelFeatures, Layout, OppositeKind};
use crate::lanes::{BodyRow, LaneIndex, Lanes, Quad};

/// See the [module](self).
pub(in super::super) struct LoadSweep<'a> {
    /// w: changes of velocity per substep under the loads so far. `[rows]`
    pub fields: &'a mut [BodyRow],
    /// Substep (s).
    pub h: f32,
}

impl Pass for LoadSweep<'_> {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        PerLane::of_bodies(7 + layout.points * (layout.arms() + 2), 4, opposite)
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            sweep::<L>(self.fields, batches, segment, layout, on.kept.contacts(), self.h);
        });
    }
}

#[inline(never)]
fn sweep<L: Lanes>(
    fields: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    kept: &mut [f32],
    h: f32,
) {
    let SegmentRecords { records, contact, row_a, row_b } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride).zip(contact.batches::<L::Index>());
    let quads: &mut [Quad] = bytemuck::cast_slice_mut(kept);
    let (zero, per_substep, h) = (L::zero(), L::splat(1.0 / h), L::splat(h));
    let rows_of = row_a.batches().zip(row_b.batches());
    for (batch, ((record, index), (row_a, row_b))) in records.zip(rows_of).enumerate() {
        let (row_a, row_b): (LaneIndex<L::Index>, LaneIndex<L::Index>) = (row_a, row_b);
        let mut b = L::gather(fields, row_b);
        let mut a = if layout.a_has_row { L::gather(fields, row_a) } else { [zero; 8] };
        let [nx, ny] = [record[0], record[1]];
        let mut loads: [L; 4] = L::gather_quads::<2, 0>(quads, index);
        for p in 0..layout.points {
            let arms = arms_of(record, layout, p);
            let is_closed = loads[2 * p] + L::splat(0.5);
            let mass = |quantity: usize| is_closed.select_positive(record[layout.at(p, quantity)], zero);
            let along = |x: L, y: L, axis: usize, a: &[L; 8], b: &[L; 8]| {
                let straight = x.mul_add(b[0] - a[0], y * (b[1] - a[1]));
                a[2].neg_mul_add(arms[0][axis], b[2].mul_add(arms[1][axis], straight))
            };
            let old = loads[2 * p].max(zero) * h;
            let new = mass(layout.normal_mass).neg_mul_add(along(nx, ny, 0, &a, &b), old).max(zero);
            push([&mut a, &mut b], [nx, ny], arms, [new - old, zero]);
            loads[2 * p] = is_closed.select_positive(new * per_substep, loads[2 * p]);
            if layout.has_friction {
                let bound = record[layout.friction] * new;
                let old = loads[2 * p + 1] * h;
                let wanted = mass(layout.tangent_mass).neg_mul_add(along(ny, -nx, 1, &a, &b), old);
                let new = is_closed.select_positive(wanted.min(bound).max(-bound), old);
                push([&mut a, &mut b], [nx, ny], arms, [zero, new - old]);
                loads[2 * p + 1] = new * per_substep;
            }
        }
        L::scatter_velocity(fields, row_b, [b[0], b[1], b[2], b[3]]);
        if segment.pushes_a() {
            L::scatter_velocity(fields, row_a, [a[0], a[1], a[2], a[3]]);
        }
        store::<L, 0>(quads, index, segment.filled(batch, L::WIDTH), loads);
    }
}
