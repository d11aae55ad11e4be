//! Sequential impulses: Gauss–Seidel on velocities, one contact row after the other. Each row applies the
//! impulse that corrects its own velocity. Repeated sweeps over all rows correct all of them.
//!
//! **Source.** `catto2005` (projected Gauss–Seidel on J M⁻¹ Jᵀ λ = b, warm starting), `catto2006` (impulses
//! applied at once, accumulated clamping), `baumgarte1972`, and `article`, whose factor 0.3 is used here.
//!
//! **Departures.** A slop is left uncorrected, so that resting contacts stay contacts. Separated points may
//! close their gap, but not penetrate (speculative contacts). The push is capped. The article has none of the
//! three.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` sweeps.
//!
//! **Fails when** a heavy body rests on a light one (the error shrinks by R/(1+R) per sweep for the mass
//! ratio R), and in tall stacks (by cos²(π/2N) per sweep for N bodies): overlap grows faster than the few
//! sweeps of a frame remove it. Baumgarte's push also adds energy when deep overlap is resolved.
//!
//! # The method
//!
//! A contact row with Jacobian J requires J v + b ≥ 0 and λ ≥ 0, and one of the two must be zero. With all
//! other impulses fixed, λ changes the velocity of its row by k = J M⁻¹ Jᵀ per unit, so the impulse that
//! gives J v + b = 0 is Δλ = −(J v + b)/k. The *accumulated* impulse must not become negative; the increment
//! may:
//!
//! ```text
//! λ ← max(0, λ − (J v + b)/k)
//! ```
//!
//! A push can therefore be taken back in a later sweep. Friction clamps its own accumulated impulse to ±µλ.
//! The accumulated impulses are kept, and the next step starts from them.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{Passes, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "pgs",
    source: "catto2006",
    summary: "sequential impulses with warm starting and Baumgarte stabilization",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
