//! Soft contacts in substeps: instead of many sweeps over one step, the step is cut into substeps with one
//! sweep each. Contacts are stiff springs with strong damping. A second sweep without the springs removes the
//! velocity that they added.
//!
//! **Source.** `catto2024solver2d` (the schedule), `catto2011` (soft constraints),
//! `macklin2019` (substeps instead of iterations).
//!
//! **Departures.** From the second substep on, the warm start is a pass over bodies instead of constraints
//! (see [`crate::constraints::kernels::motion::Motion::extrapolate_velocities`]); in exact arithmetic
//! the result is the same. Contacts with static and kinematic bodies are twice as stiff, as in the source.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes, `velocity_iterations`
//! soft sweeps and `relax_iterations` rigid ones.
//!
//! **Fails when** the load is large for the stiffness. At rest a contact sinks by F/(m_eff ω²), whatever the
//! number of iterations, so tall stacks and heavy bodies on light ones sag. More substeps allow a higher
//! frequency, and the sag falls with the square of the frequency.

use super::{Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Rigid, Soft, angular_frequencies};
use crate::constraints::{ImpactLaw, Passes, Schedule};
use crate::params::{Budget, CONTACT_HERTZ_FRACTION, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "soft_step",
    source: "catto2024solver2d",
    summary: "substeps, soft contacts and a relaxing sweep without position feedback",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[Parameter::CONTACT_HERTZ, Parameter::DAMPING_RATIO, Parameter::PUSH_SPEED],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION, h)),
    impacts: ImpactLaw::BOX2D,
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, damping_ratio, push_speed] = [0, 1, 2].map(|i| passes.parameter(i));
    let soft =
        Soft::rule(angular_frequencies(hertz, CONTACT_HERTZ_FRACTION, h), damping_ratio, push_speed, h);
    let rigid = Rigid::rule(h);
    for substep in 0..budget.substeps {
        if substep == 0 {
            passes.integrate_velocities();
            passes.warm_start();
        } else {
            passes.integrate_and_warm_start();
        }
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
