//! The Jacobi sweep: all contacts read the velocities from before the sweep, and what they add
//! to a body is summed up and applied afterwards.
//!
//! Within a contact the rows are still solved one after the other (`catto2024solver2d`,
//! `solve_jacobi`). Sums have an order: colour by colour, so that they have the same bits at every
//! width; in exact arithmetic no order matters. The kernel is that of [`super::sweep`], given a store
//! of rows that reads from one place and adds up in another.

use super::features::{KernelFeatures, OnDynamic, OnKinematic, OnStatic, OppositeKind};
use super::pass::{AnyPass, Pass, PassInput};
use super::rules::{Rigid, Rule, Soft};
use super::sweep::{INV_MASS, NormalRule, Sweep, VX, VY, W, over_segments, sweep_segment};
use crate::engine::lanes::{BodyRow, IndexList, LaneIndex, Lanes, RowStore};

/// A Jacobi sweep under a rule.
#[derive(Clone, Copy, Debug)]
struct JacobiSweep<R> {
    rule: R,
    relaxation: f32,
}

impl<R: NormalRule> Pass for JacobiSweep<R> {
    const COUNTED: bool = false;

    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&self, on: PassInput<'_>) {
        let mut store = SummedRows { before: on.rows, sums: on.sums };
        let rule = Relaxed { rule: self.rule, factor: self.relaxation };
        over_segments!(sweep_segment, L, F, Relaxed<R>, SummedRows; &mut store, on.batches, rule);
    }
}

/// A rule that a Jacobi sweep is compiled for, as a value.
#[derive(Clone, Copy, Debug)]
pub enum JacobiRule {
    /// [`Soft`]
    Soft(Soft),
    /// [`Rigid`]
    Rigid(Rigid),
}

impl JacobiRule {
    /// The same rule of a Gauss–Seidel sweep.
    pub(super) fn rule(self) -> Rule {
        match self {
            JacobiRule::Soft(rule) => Rule::Soft(Sweep(rule)),
            JacobiRule::Rigid(rule) => Rule::Rigid(Sweep(rule)),
        }
    }

    /// Calls `then` with the Jacobi sweep.
    pub(super) fn with_pass(self, relaxation: f32, then: impl FnOnce(&dyn AnyPass)) {
        match self {
            JacobiRule::Soft(rule) => then(&JacobiSweep { rule, relaxation }),
            JacobiRule::Rigid(rule) => then(&JacobiSweep { rule, relaxation }),
        }
    }
}

/// Another rule's line c − s v, a part of the way from the old impulse: λ + ω (c − s v − λ).
#[derive(Clone, Copy, Debug)]
struct Relaxed<R> {
    rule: R,
    factor: f32,
}

impl<R: NormalRule> NormalRule for Relaxed<R> {
    const FRICTION: bool = R::FRICTION;

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let [constant, slope] = self.rule.line(against_static, separation, mass, old);
        let factor = L::splat(self.factor);
        [factor.mul_add(constant - old, old), factor * slope]
    }

    #[inline(always)]
    fn tangent_slope<L: Lanes>(&self, mass: L) -> L {
        L::splat(self.factor) * self.rule.tangent_slope(mass)
    }
}

/// Sums start at zero.
pub(super) fn begin(rows: &[BodyRow], sums: &mut Vec<BodyRow>) {
    sums.clear();
    sums.resize(rows.len(), BodyRow::default());
}

/// v ← v + Σ Δv, for every row.
pub(super) fn finish(rows: &mut [BodyRow], sums: &[BodyRow]) {
    for (row, sum) in rows.iter_mut().zip(sums) {
        for k in [VX, VY, W] {
            row.velocity[k] += sum.velocity[k];
        }
    }
}

/// Reads velocities from before the sweep; a write adds the difference to the sums.
struct SummedRows<'a> {
    before: &'a [BodyRow],
    sums: &'a mut [BodyRow],
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
