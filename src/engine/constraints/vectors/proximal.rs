//! Newton's method on a proximal contact law, in the velocities of bodies; its centre moves until the law is solved.
//!
//! A point gives way a little, around the impulse λ₀ that it is centred on: with R = ε/m and y = λ₀ − u/R,
//!
//! ```text
//! relaxed   λ = the nearest point of the cone to y                 (convex: Anitescu's relaxation)
//! Coulomb   λn = max(0, yn),  λt = yt within ±µ λn
//! F(v) = M (v − v_f) − Jᵀ λ(u(v)) = 0,   λ₀ ← λ
//! ```
//!
//! F is piecewise linear: where no point changes its state one Newton step solves it. The relaxed law has a potential, and a
//! step goes to the minimum along it, which converges from anywhere. Coulomb's has none: a step is halved until |F|² falls, and
//! where it does not, points give way more. Moving the centre is the method of multipliers. It makes the law
//! exact without a stiff matrix, and what the law leaves open stays where it was; ε decides only how often the centre moves.
//!
//! **Source**: Castro et al. 2022 (`castro2022`: the relaxed law); Alart & Curnier 1991 (`alart1991`: Coulomb's); Lee et al. 2025
//! (`lee2025`: moving centres).

use crate::engine::constraints::numerics::block_lu::Part3;
use crate::engine::constraints::numerics::cone::{Nearest, nearest};
use crate::engine::constraints::vectors::body_space::{BodyPoint, BodySpace, Point2};
use crate::engine::lanes::held;

/// Norm of F, relative to that of the momenta that contacts have given, at which F is zero.
const ZERO: f64 = 1e-9;
/// What is left of the law when the centre has come to rest, relative to the greatest impulse.
const TOLERANCE: f64 = 1e-7;
/// Slope that is left along a step, relative to the one at its start.
const SLOPE: f64 = 1e-6;
/// Evaluations of a line search to a minimum.
const EVALUATIONS: usize = 40;
/// Halvings of a step.
const HALVINGS: usize = 10;
/// Where steps fail, points give way so many times more, up to all of their effective mass.
const LOOSER: f64 = 30.0;

/// What the impulses of a point follow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointLaw {
    /// Anitescu's convex relaxation.
    Relaxed,
    /// Coulomb's law.
    Coulomb,
}

/// The method on its way; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub struct Proximal {
    /// The problem.
    pub space: BodySpace,
    /// λ (N·s)
    pub impulses: Vec<Point2>,
    centre: Vec<Point2>,
    v: Vec<Part3>,
    step: Vec<Part3>,
    trial: Vec<Part3>,
    u: Vec<Point2>,
    change: Vec<Point2>,
    blocks: Vec<[Point2; 2]>,
    /// ε at present.
    epsilon: f64,
}

impl PointLaw {
    /// λ of a point at y, and ∂λ/∂y.
    fn at(self, y: Point2, friction: f64) -> (Point2, [Point2; 2]) {
        match self {
            PointLaw::Relaxed => {
                let (impulse, place) = nearest(y, friction);
                let block = match place {
                    Nearest::Inside => [[1.0, 0.0], [0.0, 1.0]],
                    Nearest::Tip => [[0.0; 2]; 2],
                    Nearest::Side(sign) => {
                        let d = [1.0, sign * friction];
                        d.map(|a| d.map(|b| a * b / (1.0 + friction * friction)))
                    }
                };
                (impulse, block)
            }
            PointLaw::Coulomb => {
                let bound = friction * y[0];
                if y[0] <= 0.0 {
                    ([0.0; 2], [[0.0; 2]; 2])
                } else if y[1].abs() < bound {
                    (y, [[1.0, 0.0], [0.0, 1.0]])
                } else {
                    ([y[0], bound.copysign(y[1])], [[1.0, 0.0], [friction.copysign(y[1]), 0.0]])
                }
            }
        }
    }

    /// λ of a point centred on `centre` at u, and −∂λ/∂u. Coulomb's law has a stiffness of its own along each axis; a
    /// projection on a cone wants one for both.
    fn of(self, point: &BodyPoint, centre: Point2, u: Point2, epsilon: f64) -> (Point2, [Point2; 2]) {
        let along = |axis: usize| point.mass[if self == PointLaw::Relaxed { 0 } else { axis }] / epsilon;
        let stiffness = [along(0), along(1)];
        let (impulse, d) = self.at([0, 1].map(|k| centre[k] - stiffness[k] * u[k]), point.friction);
        (impulse, d.map(|row| [row[0] * stiffness[0], row[1] * stiffness[1]]))
    }
}

impl Proximal {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let points = [&self.impulses, &self.centre, &self.u, &self.change].map(held).iter().sum::<usize>();
        let nodes = [&self.v, &self.step, &self.trial].map(held).iter().sum::<usize>();
        self.space.held_bytes() + points + nodes + held(&self.blocks)
    }

    /// Begins with the problem that `space` has loaded, centred on its warm start.
    pub fn begin(&mut self, epsilon: f64) {
        let Proximal { space, v, impulses, centre, .. } = self;
        v.clone_from(&space.free);
        impulses.clone_from(&space.warm);
        centre.clone_from(&space.warm);
        for (point, &impulse) in space.points.iter().zip(impulses.iter()) {
            point.push(&space.inertia, v, impulse);
        }
        self.epsilon = epsilon;
    }

    /// One step of Newton's method with points that give way by `epsilon`, moving the centre first where F is zero. True
    /// where nothing is left to do.
    pub fn iterate(&mut self, law: PointLaw, epsilon: f64) -> bool {
        let mut zero = self.residual(law);
        if zero {
            if self.moves_no_more() {
                return true;
            }
            self.centre.clone_from(&self.impulses);
            self.epsilon = (self.epsilon / 10.0).max(epsilon);
            zero = self.residual(law);
        }
        if zero {
            return true;
        }
        let Proximal { space, blocks, centre, u, step, change, .. } = self;
        blocks.clear();
        let at = space.points.iter().zip(centre.iter()).zip(u.iter());
        blocks.extend(at.map(|((p, centre), u)| law.of(p, *centre, *u, self.epsilon).1));
        if !space.factorise(blocks.iter().copied()) {
            return true;
        }
        space.factor.solve(step);
        change.clear();
        change.extend(space.points.iter().map(|point| point.along(step)));
        match law {
            PointLaw::Relaxed => self.go(minimum(|alpha| self.slope(alpha))),
            PointLaw::Coulomb => match self.falling() {
                Some(alpha) => self.go(alpha),
                None if self.epsilon >= 1.0 => return true,
                None => {
                    self.centre.clone_from(&self.impulses);
                    self.epsilon = (self.epsilon * LOOSER).min(1.0);
                }
            },
        }
        self.residual(law);
        false
    }

    /// u, λ, and −F in the place of the step; whether F is zero.
    fn residual(&mut self, law: PointLaw) -> bool {
        let Proximal { space, v, step, impulses, centre, u, epsilon, .. } = self;
        u.clear();
        u.extend(space.points.iter().map(|point| space.velocity(point, v)));
        for (((point, u), centre), impulse) in
            space.points.iter().zip(u.iter()).zip(centre.iter()).zip(impulses.iter_mut())
        {
            *impulse = law.of(point, *centre, *u, *epsilon).0;
        }
        let given = rest(space, v, impulses, step);
        square(space, step) <= ZERO * ZERO * given
    }

    /// Whether the centre is where the law has the impulses.
    fn moves_no_more(&self) -> bool {
        let greatest = self.impulses.iter().fold(0.0_f64, |most, l| most.max(l[0]));
        let both = self.impulses.iter().zip(&self.centre);
        let moved = both.fold(0.0_f64, |most, (l, c)| most.max((l[0] - c[0]).abs()).max((l[1] - c[1]).abs()));
        self.epsilon * moved <= TOLERANCE * greatest
    }

    fn go(&mut self, alpha: f64) {
        for (v, d) in self.v.iter_mut().zip(&self.step) {
            (0..3).for_each(|k| v[k] += alpha * d[k]);
        }
    }

    /// First and second derivative of the potential along the step, at `alpha`.
    fn slope(&self, alpha: f64) -> (f64, f64) {
        let Proximal { space, v, step, centre, u, change, epsilon, .. } = self;
        let (mut first, mut second) = (0.0, 0.0);
        for (node, d) in step.iter().enumerate() {
            for k in 0..3 {
                let m = space.inertia[node][k] * d[k];
                first += m * (v[node][k] + alpha * d[k] - space.free[node][k]);
                second += m * d[k];
            }
        }
        for (((point, u), c), centre) in space.points.iter().zip(u).zip(change).zip(centre) {
            let u = [0, 1].map(|k| u[k] + alpha * c[k]);
            let (l, g) = PointLaw::Relaxed.of(point, *centre, u, *epsilon);
            first -= l[0] * c[0] + l[1] * c[1];
            second += (0..2).map(|i| c[i] * (g[i][0] * c[0] + g[i][1] * c[1])).sum::<f64>();
        }
        (first, second)
    }

    /// The first of 1, ½, ¼, … at which |F|² falls enough; `step` is that of Newton's method.
    fn falling(&mut self) -> Option<f64> {
        let Proximal { space, v, step, trial, impulses, centre, u, change, epsilon, .. } = self;
        // The step has taken the place of −F.
        let mut f = std::mem::take(trial);
        rest(space, v, impulses, &mut f);
        let now = square(space, &f);
        let mut moved = v.clone();
        let found = (0..HALVINGS).map(|k| 0.5_f64.powi(k as i32)).find(|alpha| {
            for ((to, v), d) in moved.iter_mut().zip(v.iter()).zip(step.iter()) {
                *to = [0, 1, 2].map(|k| v[k] + alpha * d[k]);
            }
            let at = space.points.iter().zip(u.iter()).zip(change.iter()).zip(centre.iter());
            impulses.clear();
            impulses.extend(at.map(|(((point, u), c), centre)| {
                let u = [0, 1].map(|k| u[k] + alpha * c[k]);
                PointLaw::Coulomb.of(point, *centre, u, *epsilon).0
            }));
            rest(space, &moved, impulses, &mut f);
            square(space, &f) <= (1.0 - 2e-4 * alpha) * now
        });
        *trial = f;
        if found.is_none() {
            let at = space.points.iter().zip(u.iter()).zip(centre.iter());
            impulses.clear();
            impulses
                .extend(at.map(|((point, u), centre)| PointLaw::Coulomb.of(point, *centre, *u, *epsilon).0));
        }
        found
    }
}

/// −F, and the square of the momenta that contacts have given.
fn rest(space: &BodySpace, v: &[Part3], impulses: &[Point2], to: &mut Vec<Part3>) -> f64 {
    to.clear();
    to.resize(v.len(), [0.0; 3]);
    for (point, &impulse) in space.points.iter().zip(impulses) {
        point.pull(to, impulse);
    }
    let mut given = 0.0;
    for (node, f) in to.iter_mut().enumerate() {
        for k in 0..3 {
            let (m, change) = (space.inertia[node][k], v[node][k] - space.free[node][k]);
            f[k] -= m * change;
            given += m * change * change;
        }
    }
    given
}

/// |p|² of momenta, in the measure of M⁻¹.
fn square(space: &BodySpace, momenta: &[Part3]) -> f64 {
    let one = |(p, m): (&Part3, &Part3)| (0..3).map(|k| p[k] * p[k] / m[k]).sum::<f64>();
    momenta.iter().zip(&space.inertia).map(one).sum()
}

/// Where a convex function is least, of whose first and second derivative at α ≥ 0 `slope` tells: Newton's method, kept
/// between the greatest α that is known to be too small and the least that is too large.
fn minimum(slope: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (at_start, _) = slope(0.0);
    let (mut low, mut high, mut alpha) = (0.0, f64::INFINITY, 1.0);
    for _ in 0..EVALUATIONS {
        let (first, second) = slope(alpha);
        if first.abs() <= SLOPE * at_start.abs() {
            break;
        }
        if first < 0.0 {
            low = alpha
        } else {
            high = alpha
        }
        let next = alpha - first / second;
        alpha = match next > low && next < high {
            true => next,
            false if high.is_finite() => 0.5 * (low + high),
            false => 2.0 * alpha,
        };
    }
    alpha
}

#[cfg(test)]
mod tests {
    use super::minimum;

    #[test]
    fn a_kink_is_found() {
        // Slopes −1 + α up to 0.2, then 50 times as steep.
        let slope = |a: f64| if a < 0.2 { (a - 1.0, 1.0) } else { (-0.8 + 50.0 * (a - 0.2), 50.0) };
        assert!((minimum(slope) - 0.216).abs() < 1e-6);
        assert!((minimum(|a| (a - 3.0, 1.0)) - 3.0).abs() < 1e-5);
    }
}
