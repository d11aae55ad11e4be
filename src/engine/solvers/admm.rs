//! The alternating direction method of multipliers: a linear problem and a projection take turns until they
//! agree. The linear problem is factorized once per step, and again when the penalty changes.
//!
//! **Source.** `carpentier2024` (a cached factor, an adaptive penalty, the law of `desaxce1998`: friction as
//! one cone, with µ |ut| added to the normal velocity); `boyd2011`, section 3 (the method, and residual
//! balancing, 3.4.1).
//!
//! **Departures.** The factorized matrix is in the space of body velocities instead of contact impulses, so
//! its size does not depend on the number of points per contact. ρ is scaled by each point's effective mass,
//! the same along n and t. It changes by the square root of the ratio of residuals, at most every
//! `adapt_every` iterations; the source multiplies it by fixed powers of the ratio of extreme eigenvalues.
//! There is no proximal term: in the space of the bodies, linearly dependent rows need none. The multiplier
//! starts where the contact law puts it: at −u where points slide or open, at zero where they hold. Joint
//! rows are in the same vectors, with their bounds instead of cones. If a factor would be larger than
//! `factor_limit`, ten steps of conjugate gradients replace it.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` times 2 passes over contacts, 4 over vectors
//! and 1 substitution, n b operations for n = 3 rows a body in a band of b; n b²/2 of a factorization, of which a step has 1 to
//! 4.
//!
//! **Fails when** bands are wide: a pyramid of base m has b = 3 m. A small ρ is slow for sliding contacts, a
//! large ρ for loads that are carried down a column, and a step begins with one ρ for all contacts.
//!
//! # The method
//!
//! ```text
//! λ: (K + ρ D⁻¹) λ = ρ D⁻¹ (z − w) − b − (µ |ut|, 0)
//! z = Π(λ + w),   w ← w + λ − z
//! ```
//!
//! with the friction cone Π and scaled multipliers w. When λ and z agree, u + (µ |ut|, 0) = −ρ D⁻¹ w is in
//! the polar cone, which is Coulomb's law.
//!
//! # The penalty
//!
//! For each eigenvalue κ of D^(1/2) K D^(1/2) of the contacts that persist, λ converges by ρ/(ρ + κ) per
//! iteration. Small ρ is therefore fast, and κ falls with the square of the height of a column. The cone of a
//! sliding contact is shifted by u, which moves in proportion to ρ per iteration: there, large ρ is fast. The
//! residuals tell the two cases apart: λ − z is zero in a column, and some hundred times ρ D⁻¹ Δz in a slide.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Baumgarte, NormalRule};
use crate::constraints::kernels::velocity::sweep::Sweep;
use crate::constraints::records::point_vector::{
    PointEntry, Wide, difference, dot, plus_scaled, quotient, scaled, sum, sum_of_products, update,
};
use crate::constraints::vectors::blocks::JointBlocks;
use crate::constraints::vectors::body_matrix::{BodyMatrix, velocities};
use crate::constraints::{ImpactLaw, Passes, PointVector, Solver, System, numerics::cone};
use crate::lanes::Lanes;
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "admm",
    source: "carpentier2024",
    summary: "a factorized linear problem and a projection on friction cones in turn; adaptive penalty",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "penalty",
            unit: "",
            default: 0.3,
            range: [1e-4, 1e3],
            meaning: "ρ at the start of a step: weight of agreement against the law",
            trials: &[0.03, 0.1, 0.3],
        },
        Parameter {
            name: "adapt_every",
            unit: "iterations",
            default: 5.0,
            range: [0.0, 1000.0],
            meaning: "how often ρ may change; 0: never",
            trials: &[],
        },
        Parameter {
            name: "factor_limit",
            unit: "million numbers",
            default: 16.0,
            range: [0.0, 1000.0],
            meaning: "size of a factor above which conjugate gradients take its place",
            trials: &[],
        },
    ],
    exceptions: &[(
        Guarantee::Converges,
        "to the law of `pgs`, but its multipliers begin at the wrong contacts",
    )],
    impacts: ImpactLaw::None,
    islands: Islands::Alone,
    make: Variant::made_by(|| Box::new(Admm::default())),
    ..Variant::BASE
};

/// Target ratio of the primal residual to the dual one. The penalty is multiplied by the square root of ratio
/// ÷ target, by [`GREATEST_CHANGE`] at most. It changes only by a factor of more than [`TOLERATED`].
const BALANCE: f64 = 30.0;
const TOLERATED: f64 = 10.0;
const GREATEST_CHANGE: f64 = 30.0;
/// If both residuals are below this fraction of λ, the penalty is left alone (1).
const SMALL: f64 = 1e-5;
/// Bounds of the penalty.
const PENALTIES: [f64; 2] = [1e-4, 1.0];
/// Steps of conjugate gradients that replace a factor.
const LINEAR_STEPS: usize = 10;

/// State of the method, and buffers of the current step.
#[derive(Clone, Debug, Default)]
struct Admm {
    matrix: BodyMatrix,
    joints: JointBlocks,
    /// v without impulses, and the change of v by impulses (m/s, rad/s).
    free: Vec<[f64; 3]>,
    added: Vec<[f64; 3]>,
    change: Vec<[f64; 3]>,
    penalty: f64,
    is_factorized: bool,
}

/// Vectors of a substep.
struct AdmmVectors {
    /// b, and µ.
    bias: PointVector,
    /// D: the same along n and t; zero along t without friction.
    mass: PointVector,
    /// D/ρ
    compliance: PointVector,
    lambda: PointVector,
    z: PointVector,
    w: PointVector,
    /// J v + b
    u: PointVector,
    /// z − w − (µ |ut|, 0) D/ρ: λ at u = 0.
    target: PointVector,
    trial: PointVector,
    image: PointVector,
    /// Search direction of conjugate gradients.
    direction: PointVector,
}

impl Solver for Admm {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [fraction, penalty, every, limit] = [0, 1, 2, 3].map(|i| passes.parameter(i));
        let rule = Baumgarte::new(fraction, passes.slop(), passes.push_speed(), h);
        self.penalty = f64::from(penalty);
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.with_system(Phase::Solve, |system| velocities(system.rows(), &mut self.free));
            passes.warm_start();
            let [bias, mass, compliance, lambda, z, w, u, target, trial, image, direction] =
                [(); 11].map(|()| passes.vector());
            let mut v =
                AdmmVectors { bias, mass, compliance, lambda, z, w, u, target, trial, image, direction };
            passes.with_system(Phase::Solve, |system| {
                self.begin(system, &mut v, rule);
                if substep == 0 || system.has_joints() {
                    self.joints =
                        if system.has_joints() { system.joint_blocks() } else { JointBlocks::default() };
                    let numbers = self.matrix.begin(system, &self.joints);
                    self.is_factorized = numbers as f64 <= 1e6 * f64::from(limit) && self.factorize(system);
                }
            });
            for k in 1..=budget.velocity_iterations {
                let adapts =
                    every >= 1.0 && k % every as u32 == 0 && k + every as u32 <= budget.velocity_iterations;
                passes.with_system(Phase::Solve, |system| self.iterate(system, &mut v, adapts));
                passes.count_sweep(2);
                passes.iteration_done();
            }
            passes.with_system(Phase::Solve, |system| {
                // The kept impulses are z, which are within the cones; velocities become those of z.
                for (row, free) in system.rows().iter_mut().zip(&self.free) {
                    (0..3).for_each(|k| row.velocity[k] = free[k] as f32);
                }
                system.push_lanes(&mut v.z);
            });
            passes.solves(&Sweep(rule));
            let AdmmVectors { bias, mass, compliance, lambda, z, w, u, target, trial, image, direction } = v;
            passes.give_back([bias, mass, compliance, lambda, z, w]);
            passes.give_back([u, target, trial, image, direction]);
            passes.integrate_positions();
            passes.end_substep(substep);
        }
    }
}

impl Admm {
    /// Starts from λ = z = the current impulses and w = (x − Π(x))/ρ, where x = λ − D (u + (µ |ut|, 0)).
    /// Where a point slides or opens, w is −u D/ρ. Where it holds, the remaining u is not a multiplier.
    fn begin(&mut self, system: &mut System<'_>, v: &mut AdmmVectors, rule: Baumgarte) {
        system.lane_surfaces(&mut v.bias);
        update([&mut v.bias], [], |[b], []| [[rule.bias(b[0]), b[1]]]);
        system.lane_bias(rule.of_errors(), &mut v.bias);
        system.lane_masses(&mut v.mass);
        let compliance = (1.0 / self.penalty) as f32;
        update([&mut v.mass, &mut v.compliance], [&v.bias], |[m, _], [bias]| {
            let m = [m[0], Lanes::select_positive(bias[1], m[0], Wide::zero())];
            [m, scaled(compliance, m)]
        });
        system.lane_impulses(&mut v.lambda);
        v.z.clone_from(&v.lambda);
        system.lane_velocities(&mut v.u);
        update([&mut v.u], [&v.bias], |[u], [b]| [[u[0] + b[0], u[1]]]);
        v.trial.clone_from(&v.u);
        system.add_compliance_lanes(&mut v.trial, &mut v.lambda);
        // x = λ − D (u + R λ + (µ |ut|, 0))
        update([&mut v.w, &mut v.target], [&v.z, &v.trial, &v.bias, &v.mass], |_, [z, u, bias, m]| {
            let x = difference(z, product(m, with_slide(u, bias)));
            [difference(x, cone::project_point(x, bias[1])), x]
        });
        if system.has_joints() {
            v.image.clone_from(&v.target);
            system.project_lanes(&mut v.image);
            update([&mut v.w], [&v.target, &v.image], |[w], [x, within]| [sum(w, difference(x, within))]);
        }
        update([&mut v.w], [], |[w], []| [scaled(compliance, w)]);
        velocities(system.rows(), &mut self.added);
        self.added.iter_mut().zip(&self.free).for_each(|(v, free)| (0..3).for_each(|k| v[k] -= free[k]));
    }

    fn factorize(&mut self, system: &System<'_>) -> bool {
        self.matrix.factorize(system, &self.joints, 1.0 / self.penalty)
    }

    fn iterate(&mut self, system: &mut System<'_>, v: &mut AdmmVectors, adapts: bool) {
        update([&mut v.target], [&v.z, &v.w, &v.u, &v.bias, &v.compliance], |_, [z, w, u, bias, c]| {
            let slide = difference(with_slide(u, bias), u);
            [difference(difference(z, w), product(c, slide))]
        });
        if self.is_factorized {
            self.solve(system, v);
        } else {
            self.solve_by_gradients(system, v);
        }
        v.image.clone_from(&v.z);
        update([&mut v.z, &mut v.w], [&v.lambda, &v.bias], |[_, w], [lambda, bias]| {
            let both = sum(lambda, w);
            let z = cone::project_point(both, bias[1]);
            [z, difference(both, z)]
        });
        if system.has_joints() {
            // For joints, z is now λ + w, and w is zero.
            v.trial.clone_from(&v.z);
            system.project_lanes(&mut v.z);
            update([&mut v.w], [&v.trial, &v.z], |[w], [both, z]| [sum(w, difference(both, z))]);
        }
        if adapts {
            self.adapt(system, v);
        }
        system.set_lane_impulses(&mut v.z);
    }

    /// Solves the linear problem for velocities, in the space of the bodies. With S = (C⁻¹ + R)⁻¹:
    ///
    /// ```text
    /// (M + Jᵀ S J) δ = Jᵀ S (C⁻¹ target − u) − M Δv,    Δv ← Δv + δ,   u ← u + J δ
    /// ```
    ///
    /// u and Δv are updated by the small δ, so that rounding errors of large velocities are not divided by ρ.
    fn solve(&mut self, system: &mut System<'_>, v: &mut AdmmVectors) {
        // λ = (1 + C R)⁻¹ (target − C u), before and after the solve.
        let impulses = |system: &mut System<'_>, v: &mut AdmmVectors| {
            update([&mut v.lambda], [&v.target, &v.u, &v.compliance], |_, [t, u, c]| {
                [difference(t, product(c, u))]
            });
            system.solve_compliance_lanes(&mut v.lambda, &mut v.compliance);
        };
        impulses(system, v);
        system.rows().iter_mut().for_each(|row| row.velocity[..3].fill(0.0));
        system.push_lanes(&mut v.lambda);
        velocities(system.rows(), &mut self.change);
        self.change.iter_mut().zip(&self.added).for_each(|(x, added)| (0..3).for_each(|k| x[k] -= added[k]));
        self.matrix.solve(&mut self.change);
        for ((row, added), x) in system.rows().iter_mut().zip(&mut self.added).zip(&self.change) {
            for k in 0..3 {
                row.velocity[k] = x[k] as f32;
                added[k] += x[k];
            }
        }
        system.lane_velocities(&mut v.image);
        update([&mut v.u], [&v.image], |[u], [more]| [sum(u, more)]);
        impulses(system, v);
        self.show(system);
    }

    /// A few steps of conjugate gradients on (K + R + C⁻¹) λ = C⁻¹ target − J v − b, starting at the last λ.
    /// Preconditioned by D/(1 + ρ), because rows of soft joints can be stiffer than contacts by any factor.
    fn solve_by_gradients(&mut self, system: &mut System<'_>, v: &mut AdmmVectors) {
        let share = 1.0 / (1.0 + self.penalty as f32);
        let before = |r: PointEntry, m: PointEntry| scaled(share, product(m, r));
        let norm =
            |r: &PointVector, mass: &PointVector| sum_of_products([r, mass], |[r, m]| [r, before(r, m)]);
        // `trial` is the residual.
        v.image.clone_from(&v.u);
        system.add_compliance_lanes(&mut v.image, &mut v.lambda);
        update(
            [&mut v.trial, &mut v.direction],
            [&v.target, &v.lambda, &v.image, &v.compliance, &v.mass],
            |_, [t, lambda, u, c, m]| {
                let r = difference(quotient(difference(t, lambda), c), u);
                [r, before(r, m)]
            },
        );
        let mut square = norm(&v.trial, &v.mass);
        for _ in 0..LINEAR_STEPS {
            if square <= 0.0 {
                break;
            }
            // K p is J v when the impulses p alone give v.
            system.rows().iter_mut().for_each(|row| row.velocity[..3].fill(0.0));
            system.push_lanes(&mut v.direction);
            velocities(system.rows(), &mut self.change);
            system.lane_velocities(&mut v.image);
            system.add_compliance_lanes(&mut v.image, &mut v.direction);
            update([&mut v.image], [&v.direction, &v.compliance], |[image], [p, c]| {
                [sum(image, quotient(p, c))]
            });
            let curve = dot(&v.direction, &v.image);
            if curve <= 0.0 {
                break;
            }
            let length = square / curve;
            for (added, x) in self.added.iter_mut().zip(&self.change) {
                (0..3).for_each(|k| added[k] += length * x[k]);
            }
            let length = length as f32;
            update([&mut v.lambda, &mut v.trial], [&v.direction, &v.image], |[lambda, r], [p, image]| {
                [plus_scaled(lambda, length, p), plus_scaled(r, -length, image)]
            });
            let next = norm(&v.trial, &v.mass);
            let beta = (next / square) as f32;
            square = next;
            update([&mut v.direction], [&v.trial, &v.mass], |[p], [r, m]| {
                [plus_scaled(before(r, m), beta, p)]
            });
        }
        self.show(system);
        system.lane_velocities(&mut v.u);
        update([&mut v.u], [&v.bias], |[u], [b]| [[u[0] + b[0], u[1]]]);
    }

    /// Sets the velocities of the bodies to those of λ.
    fn show(&self, system: &mut System<'_>) {
        for ((row, free), added) in system.rows().iter_mut().zip(&self.free).zip(&self.added) {
            (0..3).for_each(|k| row.velocity[k] = (free[k] + added[k]) as f32);
        }
    }

    /// Residual balancing: compares λ − z with ρ D⁻¹ Δz, in units of energy.
    fn adapt(&mut self, system: &mut System<'_>, v: &mut AdmmVectors) {
        let energy = |x: &PointVector, y: &PointVector| {
            sum_of_products([x, y, &v.mass], |[x, y, m]| {
                let d = difference(x, y);
                [d, quotient(d, m)]
            })
        };
        let (primal, dual) = (energy(&v.lambda, &v.z), self.penalty.powi(2) * energy(&v.z, &v.image));
        let whole = sum_of_products([&v.z, &v.mass], |[z, m]| [z, quotient(z, m)]);
        if primal.max(dual) <= SMALL * SMALL * whole {
            return;
        }
        let balance = (primal / dual).sqrt() / BALANCE;
        let change = balance.sqrt().clamp(1.0 / GREATEST_CHANGE, GREATEST_CHANGE);
        let penalty =
            (self.penalty * change).clamp(PENALTIES[0].min(self.penalty), PENALTIES[1].max(self.penalty));
        let change = (penalty / self.penalty) as f32;
        if (1.0 / TOLERATED as f32..=TOLERATED as f32).contains(&change) {
            return;
        }
        self.penalty = penalty;
        update([&mut v.w, &mut v.compliance], [], |[w, c], []| {
            [scaled(1.0 / change, w), scaled(1.0 / change, c)]
        });
        self.is_factorized = self.is_factorized && self.factorize(system);
    }
}

/// Entrywise product.
fn product(x: PointEntry, y: PointEntry) -> PointEntry {
    [x[0] * y[0], x[1] * y[1]]
}

/// u + (µ |ut|, 0); the second entry of `bias` is µ.
fn with_slide(u: PointEntry, bias: PointEntry) -> PointEntry {
    let slide = bias[1].max(Wide::zero()) * Lanes::max(u[1], -u[1]);
    [u[0] + slide, u[1]]
}
