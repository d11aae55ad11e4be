//! Projected gradients on the convex relaxation of friction, with step lengths computed from the last change
//! of the gradient. These lengths follow the curvature of the problem without a bound on it. The objective
//! need not fall in every step.
//!
//! **Source.** `heyn2013`, section 4.2 (P-SPG-FB), as in Chrono's `ChSolverBB`; `barzilai1988` (step lengths), `birgin2000` (line
//! search); `anitescu2006` (the relaxation).
//!
//! **Departures.** Steps are scaled by each point's effective mass, the same along n and t, so that a cone
//! stays a cone. The first step has the length of a Jacobi step, not 10⁻⁴ of it. The result is the iterate
//! with the smallest objective, which bounds the error of the velocities; Chrono takes the iterate with the
//! smallest projected gradient, at one more projection per iteration. Joint rows are in the same vectors,
//! each scaled by its own mass and projected on its bounds. Points bounce by the
//! law of [`super::pgs`]: the rebound speed is part of b ([`bias`](crate::constraints::impacts::bias)). In Chrono, a
//! point bounces if its rebound is faster than 0.15 m/s, here if its approach is faster than 1 m/s.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` times 3 passes over
//! vectors in lanes, one more for each step that was too long.
//!
//! **Fails when** anything slides: the relaxation makes the surfaces separate at µ times the sliding speed.
//! Also when there are few iterations for the height of a pile.
//!
//! # The method
//!
//! See [`spectral`](crate::constraints::vectors::spectral); Π gives the nearest point of the cones.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::vectors::spectral::{Axes, ImpulseProblem, SpectralDescent};
use crate::constraints::{Passes, Schedule, numerics::cone};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "barzilai_borwein",
    source: "heyn2013",
    summary: "projected gradients of spectral length on the convex relaxation: lifts off while sliding",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[(Guarantee::Converges, "to the convex relaxation, which is another law")],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::new(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let rebounds = passes.rebounds();
        let mut problem = ImpulseProblem { bias: passes.vector(), mass: passes.vector() };
        let mut descent = SpectralDescent::new([(); 6].map(|_| passes.vector()));
        passes.with_system(Phase::Solve, |system| {
            problem.begin(system, &rule, rebounds.as_ref(), true);
            descent.begin(system, &problem, Axes::Both, cone::project_point);
        });
        for _ in 0..budget.velocity_iterations {
            passes.with_system(Phase::Solve, |system| {
                descent.advance(system, &problem, cone::project_point);
                system.set_lane_impulses(&mut descent.now);
            });
            passes.count_sweep(2);
            passes.iteration_done();
        }
        passes.with_system(Phase::Solve, |system| descent.end(system));
        passes.give_back(descent.vectors());
        passes.give_back(rebounds);
        passes.give_back([problem.bias, problem.mass]);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
