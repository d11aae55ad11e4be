//! Nonsmooth nonlinear conjugate gradients: the change of a sweep serves as the gradient, and each sweep
//! is extrapolated along the previous search direction, as in the Fletcher–Reeves method.
//!
//! **Source.** `silcowitz2010`, algorithm 1; the sweeps are those of [`super::pgs`].
//!
//! **Departures.** The last iteration does not extrapolate beyond its sweep, so that impulses end within
//! their bounds. With joints, |r|² is a sum of energies ([`Conjugate`]), since impulses in N·s and N·m·s
//! cannot be added. Conjugate gradients require a symmetric preconditioner, which a forward sweep is not:
//! symmetric pairs of sweeps leave more residual per sweep.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`]; between iterations impulses are
//! read, replaced and applied, 3 passes over vectors, in lanes.
//!
//! **Fails when** iterations are few or friction keeps switching: each β above 1 causes a restart, and
//! the method degrades to Gauss–Seidel.
//!
//! # The method
//!
//! ```text
//! r = sweep(λ) − λ,   β = |r|²/|r_last|² (0 if above 1),   λ ← sweep(λ) + β p,   p ← r + β p
//! ```
//!
//! v changes by M⁻¹Jᵀ β p. The next sweep brings λ back within its bounds.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::vectors::conjugate::Conjugate;
use crate::constraints::{Passes, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "nncg",
    source: "silcowitz2010",
    summary: "conjugate gradients around sweeps",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let vectors = [(); 3].map(|_| passes.vector());
        let mut conjugate = Conjugate::new(vectors, passes.energy_masses(Phase::Solve));
        passes.with_system(Phase::Solve, |system| conjugate.begin(system));
        for k in 1..=budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
            if k < budget.velocity_iterations {
                passes.with_system(Phase::Solve, |system| conjugate.go_on(system));
            }
        }
        passes.give_back(conjugate.vectors());
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
