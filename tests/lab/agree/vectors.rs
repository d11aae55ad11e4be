//! The methods that iterate on the vector of all impulses; as [`super::methods`].

use super::Model;
use super::methods::{CAP, Run};
use super::rules::ScalarRule;
use simpulse::lab::reference::DPair;
use simpulse::lab::reference::iterate::{Acceleration, Anderson, ConjugateSweeps, dot, plus};
use simpulse::lab::reference::oracle::{GapRule, ScalarSweep};

/// Sweeps with an extrapolation after each; with `plain`, not after the last.
fn accelerated(model: &mut Model, run: &Run, mut by: impl Acceleration, plain: bool) {
    let (sweep, count) = (ScalarSweep::new(run.baumgarte()), run.budget.velocity_iterations);
    model.accelerate();
    model.warm_start(false);
    for k in 0..count {
        let before = model.l.clone();
        model.sweep(&sweep);
        if k + 1 < count || !plain {
            let next = by.next(&before, &model.l);
            model.jump(&next);
        }
    }
    model.advance();
}

pub(super) fn nncg(model: &mut Model, run: &Run) {
    accelerated(model, run, ConjugateSweeps::default(), !run.undoes(0));
}

pub(super) fn anderson(model: &mut Model, run: &Run) {
    let mut mixing = Anderson::new(run.get("depth") as usize);
    (mixing.restarts, mixing.damps_sum, mixing.damping) = (!run.undoes(0), true, 1e-9);
    accelerated(model, run, mixing, true);
}

/// b of every normal row (m/s), under a rule without springs.
fn biases(model: &Model, rule: ScalarRule) -> Vec<f64> {
    (0..model.l.len()).map(|i| rule.line(model, i).push).collect()
}

/// Euclidean projection onto the wedge K = {λn ≥ 0, |λt| ≤ µ λn}: the identity inside K, the apex in the polar
/// wedge {µ|λt| ≤ −λn}. Elsewhere the nearest point on the nearer edge (1, ±µ)/√(1 + µ²): n' = (λn + µ|λt|)/(1 + µ²).
fn project_cone(mu: f64, [ln, lt]: DPair) -> DPair {
    if ln >= 0.0 && lt.abs() <= mu * ln {
        [ln, lt]
    } else if mu * lt.abs() <= -ln {
        [0.0, 0.0]
    } else {
        let n = (ln + mu * lt.abs()) / (1.0 + mu * mu);
        [n, (mu * n).copysign(lt)]
    }
}

/// u = J v(λ) + b, and the effective masses of normal rows.
struct VectorLaw {
    bias: Vec<f64>,
    mass: Vec<f64>,
    friction: Vec<f64>,
}

impl VectorLaw {
    fn new(model: &Model, rule: ScalarRule) -> Self {
        let friction = model.problem.contacts.iter().map(|c| c.friction).collect();
        let mass = (0..model.l.len()).map(|i| model.mass(&model.rows(i, false), 0)).collect();
        VectorLaw { bias: biases(model, rule), mass, friction }
    }

    fn speeds(&self, model: &mut Model, at: &[DPair]) -> Vec<DPair> {
        model.jump(at);
        model
            .problem
            .contact_velocities(&model.v)
            .into_iter()
            .zip(&self.bias)
            .map(|(u, b)| [u[0] + b, u[1]])
            .collect()
    }

    fn project(&self, l: &[DPair]) -> Vec<DPair> {
        l.iter().zip(&self.friction).map(|(&l, &mu)| project_cone(mu, l)).collect()
    }

    /// Every pair, scaled by a function of its effective mass.
    fn scaled(&self, l: &[DPair], by: impl Fn(f64) -> f64) -> Vec<DPair> {
        l.iter().zip(&self.mass).map(|(l, &m)| l.map(|l| by(m) * l)).collect()
    }
}

pub(super) fn apgd(model: &mut Model, run: &Run) {
    model.accelerate();
    model.warm_start(false);
    let mut law = VectorLaw::new(model, run.baumgarte());
    let (mut theta, mut steepness, mut now) = (1.0_f64, 1.0, model.l.clone());
    if run.undoes(0) {
        law.mass.fill(1.0);
        let ones = vec![[1.0; 2]; now.len()];
        steepness = dot(&model.problem.delassus_product(&ones), &model.problem.delassus_product(&ones))
            .sqrt()
            / dot(&ones, &ones).sqrt();
    }
    let mut y = now.clone();
    for _ in 0..run.budget.velocity_iterations {
        let g = law.speeds(model, &y);
        let mut next;
        let mut tries = 0;
        loop {
            next = law.project(&plus(&y, -1.0 / steepness, &law.scaled(&g, |m| m)));
            let step = plus(&next, -1.0, &y);
            let curve = dot(&step, &plus(&law.speeds(model, &next), -1.0, &g));
            tries += 1;
            if curve <= steepness * dot(&step, &law.scaled(&step, |m| 1.0 / m)) * (1.0 + 1e-5) || tries == 20
            {
                break;
            }
            steepness *= 2.0;
        }
        let square = theta * theta;
        let after = 0.5 * ((square * square + 4.0 * square).sqrt() - square);
        let mut beta = theta * (1.0 - theta) / (square + after);
        theta = after;
        if dot(&g, &plus(&next, -1.0, &now)) > 0.0 {
            (beta, theta) = (0.0, 1.0);
        }
        y = plus(&next, beta, &plus(&next, -1.0, &now));
        now = next;
        steepness *= 0.9;
    }
    model.jump(&now);
    model.advance();
}

/// The solution of the convex relaxation of soft contacts: the minimum of ½ γᵀ (J M⁻¹ Jᵀ + R) γ +
/// γᵀ (J v − v̂) within the cones, found point by point.
pub(super) fn sap(model: &mut Model, run: &Run) {
    model.accelerate();
    model.warm_start(false);
    let push = biases(model, ScalarRule::Baumgarte(run.get("baumgarte"), 0.0, CAP));
    for i in (0..5000).flat_map(|_| 0..push.len()) {
        let (rows, l, mu) = (model.rows(i, false), model.l[i], model.problem.contacts[i].friction);
        let k = |a, b| model.coupling((&rows, a), (&rows, b));
        let (nn, nt, tt, gives) = (k(0, 0), k(0, 1), k(1, 1), 1.0 + run.get("softness"));
        // J v − v̂ without γ of this point, and J M⁻¹ Jᵀ + R.
        let n = model.speed(&rows, 0) + push[i] - nn * l[0] - nt * l[1];
        let t = model.speed(&rows, 1) - nt * l[0] - tt * l[1];
        let (a, b) = (gives * nn, gives * tt);
        let stick = [nt * t - b * n, nt * n - a * t].map(|x| x / (a * b - nt * nt));
        let edge = |side: f64| {
            let least = -(n + side * mu * t) / (a + 2.0 * side * mu * nt + mu * mu * b);
            [least.max(0.0), side * mu * least.max(0.0)]
        };
        let energy =
            |g: DPair| 0.5 * (a * g[0] * g[0] + b * g[1] * g[1]) + nt * g[0] * g[1] + n * g[0] + t * g[1];
        let (one, other) = (edge(1.0), edge(-1.0));
        let new = match () {
            () if stick[1].abs() <= mu * stick[0] => stick,
            () if energy(one) < energy(other) => one,
            () => other,
        };
        (0..2).for_each(|axis| model.set(i, axis, &rows, new[axis]));
    }
    model.advance();
}
