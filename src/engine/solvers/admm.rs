//! The alternating direction method of multipliers: a linear problem and a projection take turns
//! until they agree.
//!
//! **Source.** `boyd2011`, section 3; `desaxce1998` (friction as one cone, of which µ |ut| is part of the
//! normal velocity).
//!
//! `carpentier2024` (the factor, and a penalty that adapts).
//!
//! **Departures.** The factor is of the body-space matrix M + Jᵀ S⁻¹ J, three unknowns a body, not of a Cholesky decomposition
//! in joint coordinates; there is no proximal term, as that matrix is definite without. S = ρ/m is scaled by each point's
//! effective mass, the same along n and t. The penalty follows the ratio of both residuals (`boyd2011`, section 3.4.1), not
//! powers of an estimated condition number. The multiplier starts where the contact law puts it, at −u. What ρ has become
//! goes on to the next step.
//!
//! **Cost.** Per substep 2 body passes, 1 warm start, a factorisation of 3 × 3 blocks, one more where the penalty changes, and
//! `velocity_iterations` times a solution with the factors and a pass over points, in `f64`, one lane. Sweeps of a step
//! request 0 B per contact.
//!
//! **Fails when** iterations are few for how much friction points change between sticking and slipping: the projection
//! carries news of that as slowly as any other first-order method, however exact the linear problem is.
//!
//! # The method
//!
//! ```text
//! λ: (K + S) λ = S (z − w) − b − (µ |ut|, 0)
//! z = Π(λ + w),   w ← w + λ − z
//! ```
//!
//! with the cone of friction Π and scaled multipliers w; where both agree, u + (µ |ut|, 0) = −S w is in the polar cone, which
//! is Coulomb's law. As K = J M⁻¹ Jᵀ, with the right-hand side r and the change of velocities x = M⁻¹ Jᵀ λ
//!
//! ```text
//! (M + Jᵀ S⁻¹ J) x = Jᵀ S⁻¹ r,   λ = S⁻¹ (r − J x)
//! ```

use super::{Law, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::numerics::block_lu::Part3;
use crate::engine::constraints::numerics::cone::nearest;
use crate::engine::constraints::vectors::body_space::{BodySpace, Point2};
use crate::engine::constraints::{ImpactLaw, Passes, Solver};
use crate::engine::lanes::held;
use crate::engine::params::{Budget, LINEAR_SLOP, MAX_PUSH_SPEED, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "admm",
    source: "boyd2011",
    summary: "a linear problem with a sparse factor and a projection on friction cones in turn",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "penalty",
            unit: "",
            default: 0.03,
            range: [1e-6, 1e3],
            meaning: "ρ at first: weight of agreement against the law",
            trials: &[0.01, 0.03, 0.1],
        },
        Parameter {
            name: "adapt",
            unit: "",
            default: 10.0,
            range: [1.0, 1e6],
            meaning: "ratio of both residuals from which ρ changes; 1: it never does",
            trials: &[],
        },
    ],
    breaks: &[(Law::Converges, "to the law of `pgs`, but slowly where points change their state")],
    impacts: ImpactLaw::None,
    make: || Box::new(Admm::default()),
    ..Variant::BASE
};

/// ρ changes by this factor, after so many iterations at the earliest.
const CHANGE: f64 = 4.0;
const PATIENCE: u32 = 5;
/// ρ is within these bounds.
const PENALTIES: [f64; 2] = [1e-6, 1e3];
/// Both residuals, relative to the impulses, at which it ends.
const TOLERANCE: f64 = 1e-8;

/// What it keeps.
#[derive(Clone, Debug, Default)]
struct Admm {
    space: BodySpace,
    /// ρ over what the parameter says.
    adapted: Option<f64>,
    lambda: Vec<Point2>,
    z: Vec<Point2>,
    w: Vec<Point2>,
    /// J v without contact impulses, b included.
    free: Vec<Point2>,
    /// u of λ.
    u: Vec<Point2>,
    x: Vec<Part3>,
}

impl Solver for Admm {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [fraction, penalty, adapt] = [0, 1, 2].map(|i| passes.parameter(i));
        let rule = Baumgarte::new(fraction, LINEAR_SLOP, MAX_PUSH_SPEED, h);
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.warm_start();
            let mut rho = f64::from(penalty) * self.adapted.unwrap_or(1.0);
            passes.with_system(Phase::Solve, |system| {
                self.space.load(system, |gap| rule.bias(gap));
                self.begin(rho);
            });
            let mut since = 0;
            for _ in 0..budget.velocity_iterations {
                let done = passes.with_system(Phase::Solve, |system| {
                    let [primal, dual, size] = self.iterate(rho);
                    self.space.write(system, &self.z);
                    since += 1;
                    let adapt = f64::from(adapt);
                    if adapt > 1.0 && since >= PATIENCE {
                        let up = primal > adapt * dual;
                        if up || dual > adapt * primal {
                            let last = rho;
                            rho = (if up { rho * CHANGE } else { rho / CHANGE })
                                .clamp(PENALTIES[0], PENALTIES[1]);
                            self.change(last, rho);
                            since = 0;
                        }
                    }
                    primal.max(dual) <= TOLERANCE * size
                });
                passes.count_sweep(2);
                passes.iteration_done();
                if done {
                    break;
                }
            }
            self.adapted = Some(rho / f64::from(penalty));
            passes.solves(&Sweep(rule));
            passes.integrate_positions();
            passes.end_substep(substep);
        }
    }

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        let points = [&self.lambda, &self.z, &self.w, &self.free, &self.u].map(held).iter().sum::<usize>();
        self.space.held_bytes() + points + held(&self.x)
    }
}

impl Admm {
    /// Begins at the impulses of the warm start, with multipliers of the velocities there.
    fn begin(&mut self, rho: f64) {
        let Admm { space, lambda, z, w, free, u, x, .. } = self;
        x.clone_from(&space.free);
        free.clear();
        free.extend(space.points.iter().map(|p| space.velocity(p, x)));
        lambda.clone_from(&space.warm);
        z.clone_from(lambda);
        for (point, &impulse) in space.points.iter().zip(lambda.iter()) {
            point.push(&space.inertia, x, impulse);
        }
        u.clear();
        u.extend(space.points.iter().map(|p| space.velocity(p, x)));
        w.clear();
        w.extend(space.points.iter().zip(u.iter()).map(|(p, u)| {
            let scale = p.mass[0] / rho;
            let w = [-scale * (u[0] + p.friction * u[1].abs()), -scale * u[1]];
            // A multiplier is in the polar cone.
            let (inside, _) = nearest(w, p.friction);
            [w[0] - inside[0], w[1] - inside[1]]
        }));
        self.factorise(rho);
    }

    fn factorise(&mut self, rho: f64) {
        // The matrix is definite: there is always a factor.
        let points = self.space.points.iter().map(|p| p.mass[0] / rho);
        let stiffness: Vec<f64> = points.collect();
        self.space.factorise(stiffness.into_iter().map(|s| [[s, 0.0], [0.0, s]]));
    }

    /// Another ρ: multipliers S w stay what they are.
    fn change(&mut self, last: f64, rho: f64) {
        for w in &mut self.w {
            *w = w.map(|w| w * last / rho);
        }
        self.factorise(rho);
    }

    /// One iteration; how far λ and z disagree, how far z moved, and how large both are, in the measure of the law.
    fn iterate(&mut self, rho: f64) -> [f64; 3] {
        let Admm { space, lambda, z, w, free, u, x, .. } = self;
        x.clear();
        x.resize(space.inertia.len(), [0.0; 3]);
        // S⁻¹ r in the place of λ.
        for (i, point) in space.points.iter().enumerate() {
            let scale = point.mass[0] / rho;
            let slide = point.friction * u[i][1].abs();
            lambda[i] =
                [z[i][0] - w[i][0] - scale * (free[i][0] + slide), z[i][1] - w[i][1] - scale * free[i][1]];
            point.pull(x, lambda[i]);
        }
        space.factor.solve(x);
        let mut sums = [0.0; 3];
        for (i, point) in space.points.iter().enumerate() {
            let (scale, moved) = (point.mass[0] / rho, point.along(x));
            for k in 0..2 {
                lambda[i][k] -= scale * moved[k];
                u[i][k] = free[i][k] + moved[k];
            }
            let both = [0, 1].map(|k| lambda[i][k] + w[i][k]);
            let (next, _) = nearest(both, point.friction);
            for k in 0..2 {
                let (apart, went) = (lambda[i][k] - next[k], rho * (next[k] - z[i][k]));
                sums[0] += apart * apart / point.mass[0];
                sums[1] += went * went / point.mass[0];
                sums[2] += next[k] * next[k] / point.mass[0];
            }
            w[i] = [0, 1].map(|k| both[k] - next[k]);
            z[i] = next;
        }
        sums.map(f64::sqrt)
    }
}
