//! Sequential impulses in which the two normal rows of a contact are solved together. Overlap is removed from
//! positions.
//!
//! **Source.** `catto2024solver2d`, `solve_pgs_ngs_block`; `catto2006` (the 2 × 2 problem, solved by
//! enumerating its four cases).
//!
//! **Departures.** Points with a gap may close it, but not penetrate (speculative contacts); the source's
//! rigid rows have no such term. Position sweeps solve point by point; the source also solves those in pairs.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start, `velocity_iterations` block sweeps and
//! `position_iterations` position sweeps.
//!
//! **Fails when** loads must travel far: the block couples the two points of a contact, not two contacts, so
//! convergence over a stack is that of [`super::pgs`].

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Soft;
use crate::constraints::{Passes, PositionSweep, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "pgs_ngs_block",
    source: "catto2024solver2d",
    summary: "sequential impulses, both points of a contact at once; nonlinear position sweeps",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 2 },
    uses: Uses { velocity: true, relax: false, position: true },
    parameters: &[Parameter::CORRECTION],
    exceptions: &[
        (Guarantee::Cone, "friction rows come first, bounded by the normal impulses before the sweep"),
        (Guarantee::Rest, "4 sweeps are too few for stacks"),
    ],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rigid = Soft::without_springs(passes.h());
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
            passes.block_sweep(Phase::Solve, rigid);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.position_iterations {
            passes.position_sweep(positions);
        }
        passes.end_substep(substep);
    }
}
