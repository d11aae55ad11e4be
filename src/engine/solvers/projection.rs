//! Projection: push overlapping bodies apart, then remove the velocity at which they approach. This is the
//! ground constraint of the founding article (`pos += penetration; velocity = 0`), extended to contacts
//! between bodies.
//!
//! **Source.** `article`, section "Constraints".
//!
//! **Departures.** The push is shared between the two bodies according to their masses and inertias, λ =
//! −s/k. Velocities are projected only along the normal, and only while the bodies approach.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, `position_iterations` position sweeps and
//! `velocity_iterations` velocity sweeps.
//!
//! **Fails when** anything should slide, roll or lean: there is no friction. Without warm starting, every
//! step starts from zero impulses, so tall stacks sink and spread.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Touching;
use crate::constraints::{ImpactLaw, Passes, PositionSweep, Schedule};
use crate::params::Budget;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "projection",
    source: "article",
    summary: "pushes positions apart, then removes approach velocities; no warm starting, no friction",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 4 },
    uses: Uses { velocity: true, relax: false, position: true },
    exceptions: &[(Guarantee::Rest, "no friction and no warm starting")],
    impacts: ImpactLaw::None,
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let positions =
        PositionSweep { fraction: 1.0, slop: 0.0, max_correction: passes.max_correction(), turned: false };
    let touching = Touching::rule(passes.slop());
    for substep in 0..budget.substeps {
        passes.forget_impulses();
        passes.integrate_velocities();
        passes.drive_joints();
        passes.integrate_positions();
        for _ in 0..budget.position_iterations {
            passes.position_sweep(positions);
        }
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &touching);
            passes.iteration_done();
        }
        passes.end_substep(substep);
    }
}
