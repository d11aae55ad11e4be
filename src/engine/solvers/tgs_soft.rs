//! Soft contacts in substeps, with Jacobians that follow the bodies: anchors turn within the step.
//!
//! **Source.** `catto2024solver2d`, `solve_tgs_soft`. The only difference from [`super::soft_step`] is the
//! arms: the arms of the start of the step, turned by the rotation of each body since then.
//!
//! **Departures.** Effective masses stay those of the start of the step, as in the source. So does the normal
//! n of a contact.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start, `velocity_iterations` soft sweeps and
//! `relax_iterations` rigid ones. As Jacobians move, impulses are applied again by a pass over
//! constraints in every substep; [`super::soft_step`] needs a pass over bodies for it.
//!
//! **Fails when** [`super::soft_step`] does. The benefit shows only where bodies turn by more than a few
//! degrees within a step; the cost is always paid.

use super::{Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Soft, angular_frequencies};
use crate::constraints::{ImpactLaw, Passes, Schedule};
use crate::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "tgs_soft",
    source: "catto2024solver2d",
    summary: "soft contacts in substeps; anchors turn with their bodies within the step",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[Parameter::CONTACT_HERTZ, Parameter::push_speed(4.0)],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION, h)),
    impacts: ImpactLaw::BOX2D,
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, push_speed] = [0, 1].map(|i| passes.parameter(i));
    let soft = Soft::new(
        angular_frequencies(hertz, CONTACT_HERTZ_FRACTION, h),
        CONTACT_DAMPING_RATIO,
        push_speed,
        h,
    )
    .turned();
    let rigid = Soft::without_springs(h).turned();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start_turned();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &soft);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.relax_iterations {
            passes.sweep(Phase::Relax, &rigid);
        }
        passes.end_substep(substep);
    }
}
