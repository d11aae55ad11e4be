//! Sequential impulses on rigid velocities, then nonlinear Gauss–Seidel on positions: overlap is never turned
//! into velocity.
//!
//! **Source.** `catto2024solver2d`, `solve_pgs_ngs`.
//!
//! **Departures.** Points with a gap may close it, but not penetrate (speculative contacts); the source's
//! rigid rows have no such term. A position sweep corrects a joint by at most 0.2 m, as it does a contact.
//! Normal rows come before friction rows, as in [`super::pgs`]; in the source they come after them.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start, `velocity_iterations` velocity sweeps and
//! `position_iterations` position sweeps.
//!
//! **Fails when** there are too few sweeps for the height of a stack, as with [`super::pgs`]. The residual of
//! the sweeps stays in the velocities, and two position sweeps correct little of the resulting overlap.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Rigid;
use crate::constraints::{Passes, PositionSweep, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "pgs_ngs",
    source: "catto2024solver2d",
    summary: "sequential impulses without position feedback; nonlinear position sweeps",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 2 },
    uses: Uses { velocity: true, relax: false, position: true },
    parameters: &[Parameter::CORRECTION],
    exceptions: &[(Guarantee::Rest, "4 sweeps are too few for stacks")],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rigid = Rigid::rule(passes.h());
    let positions = PositionSweep {
        fraction: passes.parameter(0),
        slop: passes.slop(),
        max_correction: passes.max_correction(),
        turned: true,
    };
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rigid);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.position_iterations {
            passes.position_sweep(positions);
        }
        passes.end_substep(substep);
    }
}
