//! Rigid sequential impulses in substeps: the rows of [`super::pgs`], swept once or twice in each of many
//! short substeps.
//!
//! [`super::tgs_soft`] and its relatives add springs and relaxing sweeps, so this solver shows how much of their
//! quality comes from substeps alone.
//!
//! **Source.** `macklin2019` (small steps instead of iterations); the rows of `catto2006`.
//!
//! **Departures.** The source displaces positions, as [`super::xpbd`] does. Here velocities are solved, with
//! a warm start in every substep: the first is a pass over contacts, the others are passes over bodies.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes and `velocity_iterations` sweeps.
//!
//! **Fails when** there is only one sweep per substep. The residual of that sweep is applied again by the
//! warm start of the next substep, and grows in pyramids (`papers/solver2d.md`); a second sweep damps it.
//! Baumgarte's push adds energy, as in [`super::pgs`].

use super::{Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{Passes, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "pgs_substeps",
    source: "macklin2019",
    summary: "rigid sequential impulses in substeps",
    budget: Budget { substeps: 8, velocity_iterations: 2, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    for substep in 0..budget.substeps {
        if substep == 0 {
            passes.integrate_velocities();
            passes.warm_start();
        } else {
            passes.integrate_and_warm_start();
        }
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
