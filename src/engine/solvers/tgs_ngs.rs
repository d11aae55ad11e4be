//! Substeps with one rigid velocity sweep and one position sweep each. Velocities get no position feedback:
//! overlap is removed from positions only.
//!
//! **Source.** `catto2024solver2d`, `solve_tgs_ngs`.
//!
//! **Departures.** Impulses are applied again in every substep, as in the source; from the second substep on,
//! this is a pass over bodies (see [`super::soft_step`]). Velocity rows keep the arms of the start of the
//! step; the arms of position rows turn with the bodies.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes, `velocity_iterations` velocity
//! sweeps and `position_iterations` position sweeps.
//!
//! **Fails when** the budget is small: contacts are rigid and there is no relaxing sweep, so the residual of
//! a sweep stays in the velocities and stacks jitter.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Rigid;
use crate::constraints::{ImpactLaw, Passes, PositionSweep, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "tgs_ngs",
    source: "catto2024solver2d",
    summary: "substeps of one rigid velocity sweep and one nonlinear position sweep",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 0, position_iterations: 1 },
    uses: Uses { velocity: true, relax: false, position: true },
    parameters: &[Parameter::CORRECTION],
    exceptions: &[(Guarantee::Rest, "jitters at its standard budget")],
    impacts: ImpactLaw::BOX2D,
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
        if substep == 0 {
            passes.integrate_velocities();
            passes.warm_start();
        } else {
            passes.integrate_and_warm_start();
        }
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
