//! Symmetric Gauss–Seidel: every sweep over the contacts is followed by one in reverse order.
//!
//! A forward sweep carries news upward through a stack within one sweep, and downward by one contact a
//! sweep; a symmetric pair carries them both ways.
//!
//! **Source.** `cottle1992` (splittings of a linear complementarity problem); otherwise [`super::pgs`].
//!
//! **Departures.** Colors are taken in reverse, and within a contact rows keep their order: the
//! splitting is symmetric by contacts, not by rows.
//!
//! **Agreement.** The source at its best: until a residual is reached. Here: 4 iterations, baumgarte 0.3. Apart from
//! the source's method in `f64` over 10 iterations by less than 6e-5: `simpulse agree --solvers symmetric_gs`.
//! Departures, and how far each moves the result: rows of a contact keep their order on the way back (source:
//! reversed): 30 %.
//!
//! **Cost.** That of [`super::pgs`]; an iteration is two sweeps. Sweeps of a step request 1750 B per contact.
//!
//! **Fails when** [`super::pgs`] does. In natural order a column of discs converges by 0.957
//! per iteration and by 0.976 per plain sweep, which is no gain per sweep; colors carry news by one contact a sweep either way.

use super::{Law, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::{Passes, Schedule, SweepOrder};
use crate::engine::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "symmetric_gs",
    source: "cottle1992",
    summary: "sequential impulses, forward and back again",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    breaks: &[(Law::Rest, "8 sweeps in 4 pairs are too few for tall stacks and large mass ratios")],
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
