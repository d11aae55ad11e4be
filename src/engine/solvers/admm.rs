//! The alternating direction method of multipliers: a linear problem and a projection take turns
//! until they agree.
//!
//! **Source.** `boyd2011`, section 3; `desaxce1998` (friction as one cone, of which µ |ut| is part of the
//! normal velocity).
//!
//! **Departures.** The linear problem is solved by a few steps of conjugate gradients, from the last
//! solution on. ρ is scaled by each point's effective mass, the same along n and t. The multiplier
//! starts where the contact law puts it, at −u.
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` times
//! 2·`linear_steps` + 3 passes over vectors. They go point by point, not in lanes.
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

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kept::KeptSize;
use crate::engine::constraints::rules::Baumgarte;
use crate::engine::constraints::sweep::Sweep;
use crate::engine::constraints::{Passes, System, cone};
use crate::engine::params::{BAUMGARTE, Budget, LINEAR_SLOP, MAX_PUSH_SPEED, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "admm",
    source: "boyd2011",
    summary: "a linear problem and a projection on friction cones in turn",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    uses: Uses { velocity: true, relax: false, position: false },
    iterations: |k| Budget { velocity_iterations: k, ..SOLVER.budget },
    parameters: &[
        Parameter {
            name: "baumgarte",
            unit: "",
            default: BAUMGARTE,
            range: [0.0, 1.0],
            meaning: "share of the overlap that is removed per step",
            trials: &[],
        },
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
    softness: None,
    by_levels: false,
    kept: KeptSize { per_point: 0, per_body: 0 },
    breaks: &[
        (Law::Converges, "to the law of `pgs`, but roundings grow in its inner iterations"),
        (Law::Rest, "20 iterations are too few for tall stacks"),
    ],
    step,
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [fraction, penalty, linear] = [0, 1, 2].map(|i| passes.parameter(i));
    let rule = Baumgarte::new(fraction, LINEAR_SLOP, MAX_PUSH_SPEED, h);
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let [mut bias, mut stiffness, mut lambda, mut z, mut w] = [(); 5].map(|_| passes.vector());
        let [mut u, mut right, mut direction, mut image, mut step] = [(); 5].map(|_| passes.vector());
        passes.with_system(Phase::Solve, |system| {
            system.gaps_and_friction(&mut bias);
            bias.iter_mut().for_each(|b| b[0] = rule.bias(b[0]));
            system.effective_masses(&mut stiffness);
            // ρ D⁻¹, the same along n and t.
            for s in &mut stiffness {
                *s = if s[0] > 0.0 { [penalty / s[0]; 2] } else { [0.0; 2] };
            }
            system.impulses(&mut lambda);
            z.clone_from(&lambda);
            velocity(system, &bias, &mut u);
            for i in 0..w.len() {
                let held = [u[i][0] + bias[i][1] * u[i][1].abs(), u[i][1]];
                w[i] = [0, 1].map(|k| if stiffness[i][k] > 0.0 { -held[k] / stiffness[i][k] } else { 0.0 });
                // A multiplier is in the polar cone.
                let inside = cone::project(w[i], bias[i][1]);
                w[i] = [w[i][0] - inside[0], w[i][1] - inside[1]];
            }
        });
        for _ in 0..budget.velocity_iterations {
            passes.with_system(Phase::Solve, |system| {
                // Residual of the linear problem at λ: velocities are those of λ.
                velocity(system, &bias, &mut u);
                for i in 0..u.len() {
                    let slide = bias[i][1] * u[i][1].abs();
                    let target = [0, 1].map(|k| stiffness[i][k] * (z[i][k] - w[i][k] - lambda[i][k]));
                    right[i] = [target[0] - u[i][0] - slide, target[1] - u[i][1]];
                }
                conjugate_gradients(
                    system,
                    linear as u32,
                    &stiffness,
                    [&mut lambda, &mut right, &mut direction, &mut image, &mut step, &mut u],
                );
                for i in 0..z.len() {
                    let sum = [0, 1].map(|k| lambda[i][k] + w[i][k]);
                    z[i] = cone::project(sum, bias[i][1]);
                    w[i] = [0, 1].map(|k| sum[k] - z[i][k]);
                }
                system.set_impulses(&z);
            });
            passes.count_sweep(2);
            passes.iteration_done();
        }
        passes.with_system(Phase::Solve, |system| {
            // What is kept is z, which is in the cones.
            for (s, (z, l)) in step.iter_mut().zip(z.iter().zip(&lambda)) {
                *s = [z[0] - l[0], z[1] - l[1]];
            }
            system.apply(&step);
        });
        passes.solves(&Sweep(rule));
        passes.give_back([bias, stiffness, lambda, z, w]);
        passes.give_back([u, right, direction, image, step]);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}

/// u = J v + b, b along n alone.
fn velocity(system: &mut System<'_>, bias: &[[f32; 2]], to: &mut Vec<[f32; 2]>) {
    system.relative_velocities(to);
    to.iter_mut().zip(bias).for_each(|(u, b)| u[0] += b[0]);
}

/// Steps of conjugate gradients on (K + S) x = r, S diagonal; λ becomes λ + x, and velocities follow.
fn conjugate_gradients(
    system: &mut System<'_>,
    steps: u32,
    stiffness: &[[f32; 2]],
    [lambda, residual, direction, image, step, before]: [&mut Vec<[f32; 2]>; 6],
) {
    direction.clone_from(residual);
    let mut square = System::dot(residual, residual);
    for _ in 0..steps {
        if square <= 0.0 {
            break;
        }
        // K p is the change of J v under the impulses p.
        system.relative_velocities(before);
        system.apply(direction);
        system.relative_velocities(image);
        for (i, k) in image.iter_mut().enumerate() {
            *k = [0, 1].map(|a| k[a] - before[i][a] + stiffness[i][a] * direction[i][a]);
        }
        let curve = System::dot(direction, image);
        if curve <= 0.0 {
            // Rounding: take the trial back and stop.
            step.iter_mut().zip(&*direction).for_each(|(s, p)| *s = [-p[0], -p[1]]);
            system.apply(step);
            break;
        }
        let length = (square / curve) as f32;
        step.iter_mut().zip(&*direction).for_each(|(s, p)| *s = p.map(|p| (length - 1.0) * p));
        system.apply(step);
        for i in 0..lambda.len() {
            for a in 0..2 {
                lambda[i][a] += length * direction[i][a];
                residual[i][a] -= length * image[i][a];
            }
        }
        let next = System::dot(residual, residual);
        let beta = (next / square) as f32;
        square = next;
        for (p, r) in direction.iter_mut().zip(&*residual) {
            *p = [0, 1].map(|a| r[a] + beta * p[a]);
        }
    }
}
