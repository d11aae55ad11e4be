//! Sequential impulses with several local iterations at each contact before the next one.
//!
//! The rows of one contact are coupled more strongly than the rows of different contacts, because they share
//! both bodies. Repeating them while their data is in the cache brings each contact close to its exact
//! solution, at little memory traffic. [`super::pgs_ngs_block`] solves the two normal rows exactly; local
//! iterations include friction as well.
//!
//! **Source.** `acary2018` (block Gauss–Seidel with a local solver); otherwise [`super::pgs`].
//!
//! **Departures.** A whole color is swept several times in a row. The result is the same, because the
//! contacts of a color share no movable body.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`] with `velocity_iterations` × `local_iterations` sweeps.
//!
//! **Fails when** loads must travel far, which takes sweeps over all contacts.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{Passes, Schedule, SweepOrder};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "local_gs",
    source: "acary2018",
    summary: "sequential impulses, each contact several times in a row",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "local_iterations",
            unit: "",
            default: 2.0,
            range: [1.0, 100.0],
            meaning: "times that each contact is solved before the next one",
            trials: &[1.0, 2.0, 4.0],
        },
    ],
    exceptions: &[(
        Guarantee::Rest,
        "4 sweeps over all contacts are too few for tall stacks and large mass ratios",
    )],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    let local = SweepOrder::Local(passes.parameter(1) as u32);
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.set_order(SweepOrder::Forward);
        passes.warm_start();
        passes.set_order(local);
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
        }
        passes.set_order(SweepOrder::Forward);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
