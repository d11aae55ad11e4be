//! Accelerated projected gradients on the convex relaxation of friction: Nesterov's method on ½ λᵀ K λ + bᵀ
//! λ, with every λ in its cone.
//!
//! **Source.** `mazhar2015`, algorithm of section 4; `anitescu2006` (the relaxation).
//!
//! **Departures.** Steps are scaled by each point's effective mass, the same along n and t, so that a cone
//! stays a cone. L is kept from step to step. The gradient at an
//! extrapolated point is extrapolated as well, because the problem is linear. Joint rows are in the same
//! vectors, each scaled by its own mass and projected on its bounds. Points bounce by the
//! law of [`super::pgs`]: the rebound speed is part of b ([`bias`](crate::constraints::impacts::bias)). In Chrono, a
//! point bounces if its rebound is faster than 0.15 m/s, here if its approach is faster than 1 m/s.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` times 2 passes over
//! vectors in lanes, one more for each step that was too long.
//!
//! **Fails when** anything slides: the relaxation makes the surfaces separate at µ times the sliding speed.
//! (Clamping friction by the normal impulse has no such effect, but is no convex problem.) Also when
//! iterations are few: the error falls with the square of their number, however few contacts there are.
//!
//! # The method
//!
//! ```text
//! λ⁺ = Π(y − D g(y)/L),   θ⁺ = (√(θ⁴ + 4θ²) − θ²)/2,   y⁺ = λ⁺ + θ(1 − θ)/(θ² + θ⁺) (λ⁺ − λ)
//! ```
//!
//! with g = J v(λ) + b, and L doubled until (λ⁺ − y)ᵀ K (λ⁺ − y) ≤ L |λ⁺ − y|²_{D⁻¹}. If g·(λ⁺ − λ) > 0, the
//! momentum is reset.

use super::{Guarantee, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::records::point_vector::{
    Wide, difference, dot, plus_scaled, quotient, scaled, sum_of_products, update,
};
use crate::constraints::vectors::spectral::ImpulseProblem;
use crate::constraints::{Passes, Solver, numerics::cone};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "apgd",
    source: "mazhar2015",
    summary: "accelerated projected gradients on the convex relaxation: lifts off while sliding",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[
        (Guarantee::Converges, "to the convex relaxation, which is another law"),
        (Guarantee::Rest, "gradients spread a load more slowly than sweeps"),
    ],
    make: Variant::made_by(|| Box::new(Apgd::default())),
    ..Variant::BASE
};

/// Factor by which L shrinks per iteration, so that one place of high curvature does not slow down the
/// following iterations (1).
const FORGET: f64 = 0.9;
/// Most doublings of L in one iteration.
const DOUBLINGS: usize = 20;

/// State from step to step.
#[derive(Clone, Copy, Debug, Default)]
struct Apgd {
    /// L of the last step (1).
    steepness: f64,
}

impl Solver for Apgd {
    fn step(&mut self, passes: &mut Passes<'_>) {
        step(passes, &mut self.steepness);
    }

    fn kept(&self) -> Vec<f64> {
        vec![self.steepness]
    }

    fn set_kept(&mut self, kept: &[f64]) -> bool {
        if let &[steepness] = kept {
            self.steepness = steepness;
        }
        matches!(kept, []) || matches!(kept, [steepness] if *steepness >= 0.0)
    }
}

fn step(passes: &mut Passes<'_>, steepness: &mut f64) {
    let (budget, h) = (passes.budget(), passes.h());
    let rule = Baumgarte::new(passes.parameter(0), passes.slop(), passes.push_speed(), h);
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let rebounds = passes.rebounds();
        let [bias, mass, mut now, mut next, mut y] = [(); 5].map(|_| passes.vector());
        let mut problem = ImpulseProblem { bias, mass };
        let [mut g_now, mut g_next, mut g_y, mut step] = [(); 4].map(|_| passes.vector());
        passes.with_system(Phase::Solve, |system| {
            problem.begin(system, &rule, rebounds.as_ref(), true);
            system.lane_impulses(&mut now);
            problem.gradient(system, &mut now, &mut g_now);
            y.clone_from(&now);
            g_y.clone_from(&g_now);
        });
        let mut theta = 1.0_f64;
        // For a single row, L is 1. It would decay below 1 once the impulses stop changing.
        *steepness = steepness.max(1.0);
        for _ in 0..budget.velocity_iterations {
            passes.with_system(Phase::Solve, |system| {
                for _ in 0..DOUBLINGS {
                    let shorter = Wide::splat(1.0 / *steepness as f32);
                    update(
                        [&mut next, &mut step],
                        [&y, &g_y, &problem.mass, &problem.bias, &now],
                        |_, [y, g, mass, bias, now]| {
                            let point = [0, 1].map(|k| y[k] - shorter * mass[k] * g[k]);
                            let next = cone::project_point(point, bias[1]);
                            [next, difference(next, now)]
                        },
                    );
                    if system.has_joints() {
                        system.project_lanes(&mut next);
                        update([&mut step], [&next, &now], |_, [next, now]| [difference(next, now)]);
                    }
                    system.push_lanes(&mut step);
                    problem.gradient(system, &mut next, &mut g_next);
                    let curve = sum_of_products([&next, &y, &g_next, &g_y], |[next, y, g_next, g_y]| {
                        [difference(next, y), difference(g_next, g_y)]
                    });
                    let length = sum_of_products([&next, &y, &problem.mass], |[next, y, mass]| {
                        let d = difference(next, y);
                        [d, quotient(d, mass)]
                    });
                    if curve <= *steepness * length * (1.0 + 1e-5) {
                        break;
                    }
                    // Restore the velocities of `now`.
                    update([&mut step], [], |[s], []| [scaled(-1.0, s)]);
                    system.push_lanes(&mut step);
                    *steepness *= 2.0;
                    next.clone_from(&now);
                    g_next.clone_from(&g_now);
                }
                let square = theta * theta;
                let theta_next = 0.5 * ((square * square + 4.0 * square).sqrt() - square);
                let mut beta = (theta * (1.0 - theta) / (square + theta_next)) as f32;
                theta = theta_next;
                update([&mut step], [&next, &now], |_, [next, now]| [difference(next, now)]);
                if dot(&g_y, &step) > 0.0 {
                    (beta, theta) = (0.0, 1.0);
                }
                update(
                    [&mut y, &mut g_y],
                    [&next, &now, &g_next, &g_now],
                    |_, [next, now, g_next, g_now]| {
                        let ahead = |to, from| plus_scaled(to, beta, difference(to, from));
                        [ahead(next, now), ahead(g_next, g_now)]
                    },
                );
                std::mem::swap(&mut now, &mut next);
                std::mem::swap(&mut g_now, &mut g_next);
                *steepness *= FORGET;
                system.set_lane_impulses(&mut now);
            });
            passes.count_sweep(2);
            passes.iteration_done();
        }
        passes.give_back([problem.bias, problem.mass, now, next, y]);
        passes.give_back(rebounds);
        passes.give_back([g_now, g_next, g_y, step]);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
