//! The problem of a step as a quadratic program in impulses, solved by spectral projected gradients.
//!
//! ```text
//! f(λ) = ½ λᵀ (K + R) λ + λᵀ (J v* + b),   g = J v(λ) + b + R λ
//! ```
//!
//! where v(λ) = v* + M⁻¹ Jᵀ λ are the current velocities of the bodies. With D the effective masses, each
//! iteration is
//!
//! ```text
//! d = Π(λ − α D g) − λ
//! λ ← λ + s d,   the first s of 1, s₁, … with  f(λ + s d) ≤ max of the last 10 f + γ s g·d
//! α ← |Δλ|²_{D⁻¹}/(Δλ·Δg)   or   Δλ·Δg/|Δg|²_D   in turn
//! ```
//!
//! The first α is the inverse of the curvature of f along Δλ. The second is the same for the inverse of
//! the matrix. These steps are longer than monotone descent allows, and f need not fall in each
//! (`barzilai1988`, `birgin2000`). f is quadratic, so a trial of s costs two sums and no pass:
//!
//! ```text
//! f(λ + s d) = f(λ) + s g·d + ½ s² d·(K + R) d
//! ```

use crate::constraints::kernels::velocity::rules::{Baumgarte, NormalRule};
use crate::constraints::records::point_vector::{
    PointEntry, PointVector, Wide, difference, dot, plus_scaled, quotient, sum_of_products, update,
};
use crate::constraints::vectors::system::System;
use crate::lanes::Lanes;

/// b, µ of each point in its second entries, and D.
#[derive(Debug)]
pub struct ImpulseProblem {
    /// b (m/s or rad/s) and µ. A negative µ marks rows of joints.
    pub bias: PointVector,
    /// D (kg)
    pub mass: PointVector,
}

/// Impulses of contacts that a descent changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// Both.
    Both,
    /// Along n only.
    Normal,
    /// Along t only.
    Tangent,
}

impl ImpulseProblem {
    /// Reads the problem of a step. `rule` pushes overlap apart. Points with a rebound speed u > 0 have b = −u
    /// instead: the row requires J v ≥ u. With `alike`, D is the same along n and t, so that cones stay cones.
    pub fn begin(
        &mut self,
        system: &mut System<'_>,
        rule: &Baumgarte,
        rebounds: Option<&PointVector>,
        alike: bool,
    ) {
        system.lane_surfaces(&mut self.bias);
        update([&mut self.bias], [], |[b], []| [[rule.bias(b[0]), b[1]]]);
        if let Some(rebounds) = rebounds {
            update([&mut self.bias], [rebounds], |[b], [u]| [[u[0].select_positive(-u[0], b[0]), b[1]]]);
        }
        system.lane_bias(rule.of_errors(), &mut self.bias);
        system.lane_masses(&mut self.mass);
        if alike {
            update([&mut self.mass], [], |[m], []| [[m[0], m[0]]]);
        }
    }

    /// g = J v + b + R λ. For contacts, b acts along n only.
    pub fn gradient(&self, system: &mut System<'_>, lambda: &mut PointVector, to: &mut PointVector) {
        system.lane_velocities(to);
        update([to], [&self.bias], |[g], [b]| [[g[0] + b[0], g[1]]]);
        system.add_compliance_lanes(to, lambda);
    }

    /// The same, with zeros for impulses that do not change.
    fn gradient_along(
        &self,
        system: &mut System<'_>,
        axes: Axes,
        lambda: &mut PointVector,
        to: &mut PointVector,
    ) {
        self.gradient(system, lambda, to);
        let keeps = match axes {
            Axes::Both => return,
            Axes::Normal => [1.0, 0.0].map(Wide::splat),
            Axes::Tangent => [0.0, 1.0].map(Wide::splat),
        };
        // Rows of joints, where µ is below zero, always change.
        update([to], [&self.bias], |[g], [b]| {
            [[0, 1].map(|k| (-b[1]).select_positive(g[k], keeps[k] * g[k]))]
        });
    }
}

/// Number of values of f with which the next one is compared.
const REMEMBERED: usize = 10;
/// Maximum number of trials of s in one iteration.
const TRIALS: usize = 4;
/// Smallest and largest s, as fractions of the previous one.
const SHORTER: [f64; 2] = [0.1, 0.9];
/// γ: required fraction of the decrease that the slope predicts.
const DECREASE: f64 = 1e-4;
/// Largest α (1). Beyond it, rounding errors of g turn into impulses.
const LONGEST: f64 = 1e4;
/// |d| ÷ |λ| at which the descent ends: a few rounding errors.
const STILL: f64 = 1e-7;

/// State of a descent.
#[derive(Debug)]
pub struct SpectralDescent {
    /// λ
    pub now: PointVector,
    gradient: PointVector,
    next: PointVector,
    next_gradient: PointVector,
    direction: PointVector,
    best: PointVector,
    /// The last values of f, relative to the start (J); the current one; and the smallest so far.
    values: [f64; REMEMBERED],
    value: f64,
    least: f64,
    /// α (1)
    length: f64,
    iterations: usize,
    axes: Axes,
}

impl SpectralDescent {
    /// A descent that works in the given vectors.
    pub fn new([now, gradient, next, next_gradient, direction, best]: [PointVector; 6]) -> Self {
        let values = [f64::NEG_INFINITY; REMEMBERED];
        SpectralDescent {
            now,
            gradient,
            next,
            next_gradient,
            direction,
            best,
            values,
            value: 0.0,
            least: 0.0,
            length: 1.0,
            iterations: 0,
            axes: Axes::Both,
        }
    }

    /// The vectors, to return to the workspace.
    pub fn vectors(self) -> [PointVector; 6] {
        [self.now, self.gradient, self.next, self.next_gradient, self.direction, self.best]
    }

    /// Starts from the impulses of the records, projected by `project`. Velocities are updated to match.
    pub fn begin(
        &mut self,
        system: &mut System<'_>,
        problem: &ImpulseProblem,
        axes: Axes,
        project: impl Fn(PointEntry, Wide) -> PointEntry,
    ) {
        self.axes = axes;
        system.lane_impulses(&mut self.now);
        update([&mut self.next, &mut self.direction], [&self.now, &problem.bias], |_, [now, bias]| {
            let next = project(now, bias[1]);
            [next, difference(next, now)]
        });
        system.push_lanes(&mut self.direction);
        std::mem::swap(&mut self.now, &mut self.next);
        problem.gradient_along(system, axes, &mut self.now, &mut self.gradient);
        self.best.clone_from(&self.now);
        (self.value, self.least, self.length, self.iterations) = (0.0, 0.0, 1.0, 1);
        self.values = [f64::NEG_INFINITY; REMEMBERED];
        self.values[0] = 0.0;
    }

    /// One iteration. `project(λ, µ)` is the allowed point nearest to λ. A negative µ marks rows of
    /// joints, which have bounds of their own. Returns `false` if the descent has ended.
    pub fn advance(
        &mut self,
        system: &mut System<'_>,
        problem: &ImpulseProblem,
        project: impl Fn(PointEntry, Wide) -> PointEntry,
    ) -> bool {
        let SpectralDescent { now, gradient, next, next_gradient, direction, axes, .. } = self;
        let length = Wide::splat(self.length as f32);
        update(
            [next, direction],
            [now, gradient, &problem.mass, &problem.bias],
            |_, [now, gradient, mass, bias]| {
                let point = [0, 1].map(|k| now[k] - length * mass[k] * gradient[k]);
                let next = project(point, bias[1]);
                [next, difference(next, now)]
            },
        );
        if system.has_joints() {
            system.project_lanes(next);
            update([direction], [next, now], |_, [next, now]| [difference(next, now)]);
        }
        let way = sum_of_products([direction, &problem.mass], |[d, mass]| [d, quotient(d, mass)]);
        // The rounding error of g grows with α.
        let still = (STILL * self.length.max(1.0)).powi(2);
        if way <= still * sum_of_products([now, &problem.mass], |[now, mass]| [now, quotient(now, mass)]) {
            return false;
        }
        system.push_lanes(direction);
        problem.gradient_along(system, *axes, next, next_gradient);
        let slope = dot(direction, gradient);
        let curve = sum_of_products([direction, next_gradient, gradient], |[d, next, now]| {
            [d, difference(next, now)]
        });
        // The value of f at s along d, and the first s with a low enough value.
        let along = |s: f64| self.value + s * slope + 0.5 * s * s * curve;
        let highest = self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut s = 1.0;
        for _ in 1..TRIALS {
            if along(s) <= highest + DECREASE * s * slope {
                break;
            }
            s = (-slope / curve).max(SHORTER[0] * s).min(SHORTER[1] * s);
        }
        if s < 1.0 {
            let part = s as f32;
            update(
                [next, next_gradient, direction],
                [now, gradient, &problem.bias],
                |[next, next_gradient, _], [now, gradient, bias]| {
                    let change = difference(next_gradient, gradient);
                    // Lies between two allowed points, except for rounding.
                    let between = project(plus_scaled(now, part, difference(next, now)), bias[1]);
                    [between, plus_scaled(gradient, part, change), difference(between, next)]
                },
            );
            system.push_lanes(direction);
        }
        self.value = along(s);
        self.values[self.iterations % REMEMBERED] = self.value;
        self.iterations += 1;
        // |Δλ|² = s² |d|², Δλ·Δg = s² d·(K + R) d.
        self.length = if curve <= 0.0 {
            1.0
        } else if self.iterations.is_multiple_of(2) {
            way / curve
        } else {
            let square = sum_of_products([next_gradient, gradient, &problem.mass], |[next, now, mass]| {
                let change = difference(next, now);
                [change, [0, 1].map(|k| mass[k] * change[k])]
            });
            if square > 0.0 { s * s * curve / square } else { LONGEST }
        };
        self.length = self.length.min(LONGEST);
        std::mem::swap(&mut self.now, &mut self.next);
        std::mem::swap(&mut self.gradient, &mut self.next_gradient);
        if self.value < self.least {
            self.least = self.value;
            self.best.clone_from(&self.now);
        }
        true
    }

    /// Returns to the smallest f, where velocities are at most √(2 (f − f*)) off in the mass norm, and
    /// stores its impulses in the records.
    pub fn end(&mut self, system: &mut System<'_>) {
        if self.value > self.least {
            update([&mut self.direction], [&self.best, &self.now], |_, [best, now]| [difference(best, now)]);
            system.push_lanes(&mut self.direction);
            self.now.clone_from(&self.best);
        }
        system.set_lane_impulses(&mut self.now);
    }
}
