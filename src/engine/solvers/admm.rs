//! The alternating direction method of multipliers: a linear problem and a projection take turns
//! until they agree.
//!
//! **Source.** `boyd2011`, section 3; `desaxce1998` (friction as one cone, of which µ |ut| is part of the
//! normal velocity).
//!
//! **Departures.** Rows of joints are in the same vectors, with their bounds in place of cones. The linear problem is solved by a few steps of conjugate gradients, preconditioned by D, from the last
//! solution on. ρ is scaled by each point's effective mass, the same along n and t. The multiplier
//! starts where the contact law puts it, at −u.
//!
//! **Agreement.** The source at its best: ρ by problem, until both residuals are reached. Here: 20 iterations,
//! baumgarte 0.3, penalty 0.3, linear_steps 3. Apart from the source's method in `f64` over 10 iterations by less
//! than 6e-5: `simpulse agree --solvers admm`. Departures, and how far each moves the result: the multiplier starts
//! at the law's −u (source: 0): 200 %; 3 conjugate-gradient steps (source: linear problem solved): 30 %.
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` times
//! 3·`linear_steps` + 3 passes over vectors, in lanes. Sweeps of a step request 63131 B per contact.
//!
//! **Fails when** ρ suits other scenes: it decides how fast λ and z agree against how fast they move. A
//! pyramid of 15 boxes takes it 70 iterations to a residual of 10⁻⁴ and 170 to 10⁻⁶.
//!
//! # The method
//!
//! ```text
//! λ: (K + ρ D⁻¹) λ = ρ D⁻¹ (z − w) − b − (µ |ut|, 0)
//! z = Π(λ + w),   w ← w + λ − z
//! ```
//!
//! with the cone of friction Π and scaled multipliers w; where both agree, u + (µ |ut|, 0) = −ρ D⁻¹ w
//! is in the polar cone, which is Coulomb's law.

use super::{Law, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::{Baumgarte, NormalRule};
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::records::point_vector::{
    PointEntry, Wide, difference, dot, plus_scaled, quotient, scaled, sum, sum_of_products, update,
};
use crate::engine::constraints::{ImpactLaw, Passes, PointVector, Schedule, System, numerics::cone};
use crate::engine::lanes::Lanes;
use crate::engine::params::{Budget, LINEAR_SLOP, MAX_PUSH_SPEED, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "admm",
    source: "boyd2011",
    summary: "a linear problem and a projection on friction cones in turn",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "penalty",
            unit: "",
            default: 0.3,
            range: [1e-4, 1e3],
            meaning: "ρ: weight of agreement against the law",
            trials: &[0.1, 0.3, 1.0],
        },
        Parameter {
            name: "linear_steps",
            unit: "",
            default: 3.0,
            range: [1.0, 100.0],
            meaning: "conjugate-gradient steps per iteration",
            trials: &[3.0, 6.0],
        },
    ],
    breaks: &[
        (Law::Converges, "to the law of `pgs`, but roundings grow in its inner iterations"),
        (Law::Rest, "20 iterations are too few for tall stacks"),
    ],
    impacts: ImpactLaw::None,
    make: || Schedule::boxed(step),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [fraction, penalty, linear] = [0, 1, 2].map(|i| passes.parameter(i));
    let rule = Baumgarte::new(fraction, LINEAR_SLOP, MAX_PUSH_SPEED, h);
    let law = rule.of_errors();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let [mut bias, mut stiffness, mut inverse, mut lambda, mut z, mut w] =
            [(); 6].map(|_| passes.vector());
        let [mut u, mut right, mut direction, mut image, mut step] = [(); 5].map(|_| passes.vector());
        passes.with_system(Phase::Solve, |system| {
            system.lane_surfaces(&mut bias);
            update([&mut bias], [], |[b], []| [[rule.bias(b[0]), b[1]]]);
            system.lane_bias(law, &mut bias);
            system.lane_masses(&mut stiffness);
            // ρ D⁻¹ and D/(1 + ρ), the same along n and t.
            update([&mut stiffness, &mut inverse], [], |[mass, _], []| {
                let mass = [mass[0]; 2];
                [quotient([Wide::splat(penalty); 2], mass), scaled(1.0 / (1.0 + penalty), mass)]
            });
            system.lane_impulses(&mut lambda);
            z.clone_from(&lambda);
            velocity(system, &bias, &mut lambda, &mut u);
            update([&mut w], [&u, &bias, &stiffness], |_, [u, bias, stiffness]| {
                let w = quotient(scaled(-1.0, with_slide(u, bias)), stiffness);
                // A multiplier is in the polar cone.
                [difference(w, cone::project_point(w, bias[1]))]
            });
            if system.has_joints() {
                // What is beyond the bounds of a joint of z − u/S.
                update([&mut right], [&u, &stiffness, &z], |_, [u, stiffness, z]| {
                    [difference(z, quotient(u, stiffness))]
                });
                step.clone_from(&right);
                system.bound_lanes(&mut step);
                update([&mut w], [&right, &step], |[w], [all, within]| [sum(w, difference(all, within))]);
            }
        });
        for _ in 0..budget.velocity_iterations {
            passes.with_system(Phase::Solve, |system| {
                // Residual of the linear problem at λ: velocities are those of λ.
                velocity(system, &bias, &mut lambda, &mut u);
                update(
                    [&mut right],
                    [&u, &bias, &stiffness, &z, &w, &lambda],
                    |_, [u, bias, stiffness, z, w, lambda]| {
                        let target = [0, 1].map(|k| stiffness[k] * (z[k] - w[k] - lambda[k]));
                        [difference(target, with_slide(u, bias))]
                    },
                );
                conjugate_gradients(
                    system,
                    linear as u32,
                    [&stiffness, &inverse],
                    [&mut lambda, &mut right, &mut direction, &mut image, &mut step, &mut u],
                );
                update([&mut z, &mut w], [&lambda, &bias], |[_, w], [lambda, bias]| {
                    let both = sum(lambda, w);
                    let z = cone::project_point(both, bias[1]);
                    [z, difference(both, z)]
                });
                if system.has_joints() {
                    // Of joints z is λ + w by now, and w zero.
                    right.clone_from(&z);
                    system.bound_lanes(&mut z);
                    update([&mut w], [&right, &z], |[w], [both, z]| [sum(w, difference(both, z))]);
                }
                system.set_lane_impulses(&mut z);
            });
            passes.count_sweep(2);
            passes.iteration_done();
        }
        passes.with_system(Phase::Solve, |system| {
            // What is kept is z, which is in the cones.
            update([&mut step], [&z, &lambda], |_, [z, lambda]| [difference(z, lambda)]);
            system.push_lanes(&mut step);
        });
        passes.solves(&Sweep(rule));
        passes.give_back([bias, stiffness, inverse, lambda, z, w]);
        passes.give_back([u, right, direction, image, step]);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}

/// u = J v + b + R λ, b along n alone; R of joints with springs.
fn velocity(system: &mut System<'_>, bias: &PointVector, lambda: &mut PointVector, to: &mut PointVector) {
    system.lane_velocities(to);
    update([to], [bias], |[u], [b]| [[u[0] + b[0], u[1]]]);
    system.soften_lanes(to, lambda);
}

/// u + (µ |ut|, 0), the second entry of `bias` being µ.
fn with_slide(u: PointEntry, bias: PointEntry) -> PointEntry {
    [bias[1].mul_add(Lanes::max(u[1], -u[1]), u[0]), u[1]]
}

/// Steps of conjugate gradients on (K + S) x = r, S diagonal; λ becomes λ + x, and velocities follow.
fn conjugate_gradients(
    system: &mut System<'_>,
    steps: u32,
    [stiffness, inverse]: [&PointVector; 2],
    [lambda, residual, direction, image, step, before]: [&mut PointVector; 6],
) {
    // Preconditioned: rows of soft joints are stiffer than contacts by any factor.
    let norm = |r: &PointVector| sum_of_products([r, inverse], |[r, m]| [r, [0, 1].map(|k| m[k] * r[k])]);
    update([direction], [residual, inverse], |_, [r, m]| [[0, 1].map(|k| m[k] * r[k])]);
    let mut square = norm(residual);
    for _ in 0..steps {
        if square <= 0.0 {
            break;
        }
        // K p is the change of J v under the impulses p.
        system.lane_velocities(before);
        system.push_lanes(direction);
        system.lane_velocities(image);
        update([image], [before, stiffness, direction], |[after], [before, stiffness, p]| {
            [[0, 1].map(|k| after[k] - before[k] + stiffness[k] * p[k])]
        });
        system.soften_lanes(image, direction);
        let curve = dot(direction, image);
        if curve <= 0.0 {
            // Rounding: take the trial back and stop.
            update([step], [direction], |_, [p]| [scaled(-1.0, p)]);
            system.push_lanes(step);
            break;
        }
        let length = (square / curve) as f32;
        update([step, lambda, residual], [direction, image], |[_, lambda, residual], [p, image]| {
            [scaled(length - 1.0, p), plus_scaled(lambda, length, p), plus_scaled(residual, -length, image)]
        });
        system.push_lanes(step);
        let next = norm(residual);
        let beta = (next / square) as f32;
        square = next;
        update([direction], [residual, inverse], |[p], [r, m]| {
            [plus_scaled([0, 1].map(|k| m[k] * r[k]), beta, p)]
        });
    }
}
