//! The default method of rapier: soft contacts in substeps, the two normal rows of a contact solved together,
//! and stabilizing sweeps with friction.
//!
//! **Source.** `crozet2025rapier` (2D, version 0.35). The pair of rows is that of [`super::pgs_ngs_block`],
//! with soft rows on its diagonal. Normal rows come before friction rows.
//!
//! **Departures.** The contact frequency is clamped to an eighth of the substep rate, which rapier leaves to
//! its user; at its standard 4 substeps both have 30 Hz. Pairs with a determinant below a thousandth of the
//! product of their diagonal are solved row by row; rapier's threshold is a hundredth. Restitution is this
//! crate's. Contacts of discs are not [frozen](crate::narrowphase::frozen). Contacts are solved in the order of this crate's colors.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes, `velocity_iterations` soft block sweeps
//! without friction and `relax_iterations` rigid block sweeps with it.
//!
//! **Fails when** [`super::soft_step`] does: the block couples the two points of a contact, not two contacts.

use super::{Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Frictionless, Soft, angular_frequencies};
use crate::constraints::{ImpactLaw, Passes, Schedule};
use crate::narrowphase::frozen::FreezeLimits;
use crate::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "rapier",
    source: "crozet2025rapier",
    summary: "soft contacts in substeps, both points at once, friction while stabilizing: rapier",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[Parameter::CONTACT_HERTZ, Parameter::PUSH_SPEED],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION, h)),
    impacts: ImpactLaw::RAPIER,
    frozen: Some(FreezeLimits::BOX2D),
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, push_speed] = [0, 1].map(|i| passes.parameter(i));
    let soft = Frictionless(Soft::new(
        angular_frequencies(hertz, CONTACT_HERTZ_FRACTION, h),
        CONTACT_DAMPING_RATIO,
        push_speed,
        h,
    ));
    let rigid = Soft::without_springs(h);
    for substep in 0..budget.substeps {
        if substep == 0 {
            passes.integrate_velocities();
            passes.warm_start();
        } else {
            passes.integrate_and_warm_start();
        }
        for _ in 0..budget.velocity_iterations {
            passes.block_sweep(Phase::Solve, soft);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.relax_iterations {
            passes.block_sweep_normal_first(Phase::Relax, rigid);
        }
        passes.end_substep(substep);
    }
}
