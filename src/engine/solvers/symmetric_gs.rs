//! Symmetric Gauss–Seidel: every sweep over the contacts is followed by one in reverse order.
//!
//! A forward sweep carries a change up a whole stack, but down by only one contact. A forward and a backward
//! sweep together carry it both ways.
//!
//! **Source.** `cottle1992` (splittings of a linear complementarity problem); otherwise [`super::pgs`].
//!
//! **Departures.** The colors are visited in reverse order, but the rows within a contact keep their order.
//! The splitting is therefore symmetric by contacts, not by rows.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`]; an iteration is two sweeps.
//!
//! **Fails when** [`super::pgs`] does. In natural order, the error of a column of discs shrinks to 0.957 of
//! its size per iteration, and to 0.976 per plain sweep: no gain per sweep. In colored order, changes travel
//! one contact per sweep in either direction.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{Passes, Schedule, SweepOrder};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "symmetric_gs",
    source: "cottle1992",
    summary: "sequential impulses, forward and back again",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[(Guarantee::Rest, "8 sweeps in 4 pairs are too few for tall stacks and large mass ratios")],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.set_order(SweepOrder::Reverse);
            passes.sweep(Phase::Solve, &rule);
            passes.set_order(SweepOrder::Forward);
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
