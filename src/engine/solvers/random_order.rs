//! Gauss–Seidel in a new random order for every sweep.
//!
//! A fixed order pushes in the same direction in every sweep, so its error is biased: a stack leans toward
//! the side that is solved first. A random order has no such bias.
//!
//! **Source.** `cottle1992` (the splitting); otherwise [`super::pgs`].
//!
//! **Departures.** Colors are visited in random order. Contacts are shuffled individually only where they are
//! solved one by one. The seed is the same in every step, so a step depends on nothing but its state, and all
//! widths give the same bits.
//!
//! **Agreement.** Within 6e-5 of the solution in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`], and a sort of colors (in natural order: of contacts) per sweep;
//! in natural order records are visited out of the order of memory.
//!
//! **Fails when** [`super::pgs`] does: changes travel no further per sweep.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{Passes, Schedule, SweepOrder};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "random_order",
    source: "cottle1992",
    summary: "sequential impulses, in a new random order each sweep",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "seed",
            unit: "",
            default: 1.0,
            range: [0.0, 16777215.0],
            meaning: "the orders are drawn from this",
            trials: &[],
        },
    ],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    let seed = u64::from(passes.parameter(1).to_bits()) << 32;
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.set_order(SweepOrder::Forward);
        passes.warm_start();
        for k in 0..budget.velocity_iterations {
            passes.set_order(SweepOrder::Random(seed + u64::from(substep * budget.velocity_iterations + k)));
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
        }
        passes.set_order(SweepOrder::Forward);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
