//! The method of Box2D 3.2: soft contacts in substeps, with friction only in the relaxing sweeps.
//!
//! **Source.** `catto2024box2d` (version 3.2); the rows are those of [`super::soft_step`].
//!
//! **Departures.** Restitution is this crate's ([`crate::constraints::impacts::restitution`]), which
//! conserves energy; Box2D returns e times the approach speed. Contacts of discs are not
//! [frozen](crate::narrowphase::frozen). Contacts are solved in the order of this crate's colors.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes, `velocity_iterations` soft sweeps
//! without friction and `relax_iterations` rigid ones with it.
//!
//! **Fails when** [`super::soft_step`] does. Sliding and sticking are less accurate: in each substep friction
//! is solved only once, on top of the normal velocities that the springs left.

use super::{Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Rigid, Soft, angular_frequencies};
use crate::constraints::{ImpactLaw, Passes, Schedule};
use crate::narrowphase::frozen::FreezeLimits;
use crate::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "box2d",
    source: "catto2024box2d",
    summary: "soft contacts in substeps, friction while relaxing only: Box2D 3.2",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[Parameter::CONTACT_HERTZ, Parameter::PUSH_SPEED],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION, h)),
    impacts: ImpactLaw::BOX2D,
    frozen: Some(FreezeLimits::BOX2D),
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, push_speed] = [0, 1].map(|i| passes.parameter(i));
    let omega = angular_frequencies(hertz, CONTACT_HERTZ_FRACTION, h);
    let soft = Soft::new(omega, CONTACT_DAMPING_RATIO, push_speed, h).frictionless();
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
