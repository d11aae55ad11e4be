//! The Jacobi sweep: all contacts read the velocities from before the sweep. The increments of each body are
//! summed up and applied afterward.
//!
//! Within a contact the rows are still solved one after the other (`catto2024solver2d`, `solve_jacobi`). Sums
//! are taken color by color, so that they have the same bits at every width; in exact arithmetic the order
//! does not matter. The kernel is that of [`crate::constraints::kernels::velocity::sweep`], with a
//! row store that reads from one place and accumulates in another.

use crate::constraints::kernels::frame::{INV_MASS, VX, VY, W};
use crate::constraints::kernels::pass::{Pass, PassInput, PassMode};
use crate::constraints::kernels::stages::over_segments;
use crate::constraints::kernels::velocity::rules::{NormalRule, Relaxed, Soft, Softness};
use crate::constraints::kernels::velocity::sweep::sweep_segment;
use crate::constraints::records::features::{KernelFeatures, OnMoving, OnStatic, PartnerKind};
use crate::lanes::{BodyRow, IndexList, LaneIndex, Lanes, RowStore};

/// A Jacobi sweep under the soft rule, which is the rigid rule if it has no springs.
#[derive(Debug)]
pub(crate) struct JacobiSweep<'a> {
    pub rule: Soft,
    pub relaxation: f32,
    /// Sums of velocity increments. `[rows]`
    pub sums: &'a mut [BodyRow],
}

impl Pass for JacobiSweep<'_> {
    fn mode(&self) -> PassMode {
        PassMode::Jacobi { relaxation: self.relaxation }
    }

    fn law(&self) -> Softness {
        self.rule.of_errors()
    }

    fn sums(&mut self) -> &mut [BodyRow] {
        self.sums
    }

    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        let mut store = SummedRows { before: on.rows, sums: self.sums };
        let rule = Relaxed { rule: self.rule, factor: self.relaxation };
        over_segments!(sweep_segment, L, F, Relaxed<Soft>, SummedRows; &mut store, on.batches, rule);
    }
}

/// Resets the sums to zero, one per row.
pub(crate) fn begin(rows: &[BodyRow], sums: &mut Vec<BodyRow>) {
    sums.clear();
    sums.resize(rows.len(), BodyRow::default());
}

/// v ← v + Σ Δv, for every row. A body split into n copies, each with 1/n of its mass, gets the mean of the
/// copies: v + Σ Δv/n. `masses` are the inverse masses and inertias of the whole bodies, or empty.
pub(crate) fn finish(rows: &mut [BodyRow], sums: &[BodyRow], masses: &[[f32; 2]]) {
    for (i, (row, sum)) in rows.iter_mut().zip(sums).enumerate() {
        let split = row.velocity[INV_MASS];
        let share = match masses.get(i) {
            Some(whole) if split > 0.0 => whole[0] / split,
            _ => 1.0,
        };
        for k in [VX, VY, W] {
            row.velocity[k] = share.mul_add(sum.velocity[k], row.velocity[k]);
        }
    }
}

/// Reads velocities from before the sweep. A write adds the difference to the sums.
pub(crate) struct SummedRows<'a> {
    pub(crate) before: &'a [BodyRow],
    pub(crate) sums: &'a mut [BodyRow],
}

impl RowStore for SummedRows<'_> {
    #[inline(always)]
    fn assert_rows(&self, index: IndexList) {
        self.before.assert_rows(index);
        self.sums.assert_rows(index);
    }

    #[inline(always)]
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        L::gather(self.before, index)
    }

    #[inline(always)]
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]) {
        let (old, mut sum) = (L::gather(self.before, index), L::gather(self.sums, index));
        for k in [VX, VY, W] {
            sum[k] = sum[k] + (velocity[k] - old[k]);
        }
        L::scatter_velocity(self.sums, index, [sum[VX], sum[VY], sum[W], sum[INV_MASS]]);
    }
}
