//! The methods that iterate on the vector of all impulses; as [`super::methods`].

use super::Model;
use super::methods::{CAP, Fault, Run, rebound};
use super::rules::ScalarRule;
use simpulse::engine::constraints::numerics::matrix::solve_in_place;
use simpulse::lab::reference::iterate::{Acceleration, Anderson, ConjugateSweeps, dot, plus};
use simpulse::lab::reference::oracle::{GapRule, ScalarSweep};
use simpulse::lab::reference::problem::minus;
use simpulse::lab::reference::{ContactProblem, DPair, ProblemContact};

/// Sweeps with an extrapolation after each; with `plain`, not after the last.
fn accelerated(model: &mut Model, run: &Run, mut by: impl Acceleration, plain: bool) {
    let (sweep, count) = (ScalarSweep::new(run.baumgarte()), run.budget.velocity_iterations);
    model.accelerate();
    model.warm_start(false);
    for k in 0..count {
        let before = model.l.clone();
        model.sweep(&sweep);
        rebound(model);
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

/// Rows of J over the velocities of all bodies, two for every pair of impulses; zero for the second of a joint row.
pub(super) fn jacobian(problem: &ContactProblem) -> Vec<Vec<f64>> {
    let none = problem.no_impulses();
    let masses = problem.bodies.iter().flat_map(|b| b.inverse()).map(|i| if i > 0.0 { 1.0 / i } else { 0.0 });
    let masses: Vec<f64> = masses.collect();
    let row = |at: usize| {
        let mut unit = none.clone();
        unit[at / 2][at % 2] = 1.0;
        let pushed = minus(&problem.velocities(&unit), &problem.velocities(&none));
        pushed.concat().iter().zip(&masses).map(|(v, m)| v * m).collect()
    };
    (0..2 * none.len()).map(row).collect()
}

/// K = J M⁻¹ Jᵀ.
pub(super) fn couplings(problem: &ContactProblem) -> Vec<Vec<f64>> {
    let (rows, inverse) = (jacobian(problem), problem.bodies.iter().flat_map(|b| b.inverse()));
    let inverse: Vec<f64> = inverse.collect();
    let entry = |a: &[f64], b: &[f64]| (0..a.len()).map(|k| a[k] * inverse[k] * b[k]).sum();
    rows.iter().map(|a| rows.iter().map(|b| entry(a, b)).collect()).collect()
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// u = J v(λ) + b of contacts and of the rows of rigid joints, and effective masses D.
struct VectorLaw {
    rows: Vec<Vec<f64>>,
    bias: Vec<f64>,
    mass: Vec<DPair>,
    /// µ; `None` for a row of a joint, which has no bounds.
    friction: Vec<Option<f64>>,
}

impl VectorLaw {
    /// With `alike`, D of a point is the same along n and t.
    fn new(model: &Model, run: &Run, alike: bool) -> Self {
        let (problem, rule) = (model.problem, run.baumgarte());
        let push = |(i, c): (usize, &ProblemContact)| match c.rebound {
            0.0 => rule.line(model, i).push,
            u => -u,
        };
        let rate = run.get("baumgarte") / model.h;
        let joints = problem.joints.iter().flat_map(|joint| joint.rows());
        let bias = problem.contacts.iter().enumerate().map(push).chain(joints.map(|row| rate * row.error));
        let friction = problem.contacts.iter().map(|c| Some(c.friction));
        let friction: Vec<_> = friction.chain((0..problem.joint_rows()).map(|_| None)).collect();
        let k = couplings(problem);
        let mass = |(i, mu): (usize, &Option<f64>)| {
            let [n, t] = [2 * i, 2 * i + 1].map(|r| 1.0 / k[r][r]);
            [
                n,
                if mu.is_none_or(|mu| mu == 0.0) {
                    0.0
                } else if alike {
                    n
                } else {
                    t
                },
            ]
        };
        let mass = friction.iter().enumerate().map(mass).collect();
        VectorLaw { rows: jacobian(problem), bias: bias.collect(), mass, friction }
    }

    fn speeds(&self, model: &mut Model, at: &[DPair]) -> Vec<DPair> {
        model.jump(at);
        let v = model.v.concat();
        let rows = self.rows.chunks_exact(2).zip(&self.bias);
        rows.map(|(j, b)| [inner(&j[0], &v) + b, inner(&j[1], &v)]).collect()
    }

    /// Applies the projection of a point to all points.
    fn within(&self, l: &[DPair], project: fn(f64, DPair) -> DPair) -> Vec<DPair> {
        l.iter().zip(&self.friction).map(|(&l, mu)| mu.map_or(l, |mu| project(mu, l))).collect()
    }

    /// D x.
    fn scaled(&self, x: &[DPair]) -> Vec<DPair> {
        x.iter().zip(&self.mass).map(|(x, m)| [m[0] * x[0], m[1] * x[1]]).collect()
    }

    /// |x|² in the norm of D⁻¹, over entries that have a mass.
    fn square(&self, x: &[DPair]) -> f64 {
        let entries = x.iter().flatten().zip(self.mass.iter().flatten());
        entries.filter(|(_, m)| **m > 0.0).map(|(x, m)| x * x / m).sum()
    }
}

pub(super) fn apgd(model: &mut Model, run: &Run) {
    model.accelerate();
    model.warm_start(false);
    let mut law = VectorLaw::new(model, run, true);
    let mut kept = run.kept.borrow_mut();
    let (mut theta, mut steepness, mut now) = (1.0_f64, kept.steepness.max(1.0), model.l.clone());
    if run.undoes(0) {
        law.mass.fill([1.0; 2]);
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
            next = law.within(&plus(&y, -1.0 / steepness, &law.scaled(&g)), project_cone);
            let step = plus(&next, -1.0, &y);
            let curve = dot(&step, &plus(&law.speeds(model, &next), -1.0, &g));
            tries += 1;
            if curve <= steepness * law.square(&step) * (1.0 + 1e-5) || tries == 20 {
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
    kept.steepness = steepness;
    model.jump(&now);
    model.advance();
}

/// At most `count` projected gradients of spectral length (`birgin2000`, with both step lengths of `barzilai1988`
/// in turn) from the current impulses, along the axes marked by ones. Ends at the smallest objective.
fn descend(
    model: &mut Model,
    law: &VectorLaw,
    axes: DPair,
    project: fn(f64, DPair) -> DPair,
    count: u32,
    fixed: bool,
) {
    let gradient = |model: &mut Model, at: &[DPair]| {
        let masked = |(u, mu): (DPair, &Option<f64>)| {
            if mu.is_some() { [axes[0] * u[0], axes[1] * u[1]] } else { u }
        };
        law.speeds(model, at).into_iter().zip(&law.friction).map(masked).collect::<Vec<DPair>>()
    };
    let mut now = law.within(&model.l, project);
    let mut g = gradient(model, &now);
    let (mut best, mut value, mut least, mut length) = (now.clone(), 0.0, 0.0, 1.0_f64);
    let mut values = vec![0.0];
    for k in 1..=count {
        let mut next = law.within(&plus(&now, -length, &law.scaled(&g)), project);
        let d = plus(&next, -1.0, &now);
        let way = law.square(&d);
        if way <= (1e-7 * length.max(1.0)).powi(2) * law.square(&now) {
            break;
        }
        let mut after = gradient(model, &next);
        let change = plus(&after, -1.0, &g);
        let (slope, curve) = (dot(&d, &g), dot(&d, &change));
        let along = |s: f64| value + s * slope + 0.5 * s * s * curve;
        let highest = values.iter().rev().take(10).copied().fold(f64::NEG_INFINITY, f64::max);
        let mut s = 1.0;
        for _ in 1..4 {
            if along(s) <= highest + 1e-4 * s * slope {
                break;
            }
            s = (-slope / curve).max(0.1 * s).min(0.9 * s);
        }
        if s < 1.0 {
            next = law.within(&plus(&now, s, &d), project);
            after = plus(&g, s, &change);
        }
        value = along(s);
        values.push(value);
        length = match () {
            () if fixed || curve <= 0.0 => 1.0,
            () if k % 2 == 1 => way / curve,
            () => curve / dot(&change, &law.scaled(&change)),
        };
        length = length.min(1e4);
        (now, g) = (next, after);
        if value < least {
            least = value;
            best.clone_from(&now);
        }
    }
    model.jump(if value > least { &best } else { &now });
}

pub(super) fn barzilai_borwein(model: &mut Model, run: &Run) {
    model.accelerate();
    model.warm_start(false);
    let law = VectorLaw::new(model, run, true);
    let fixed = run.makes(Fault::FixedLength);
    descend(model, &law, [1.0; 2], project_cone, run.budget.velocity_iterations, fixed);
    model.advance();
}

pub(super) fn staggered(model: &mut Model, run: &Run) {
    model.accelerate();
    model.warm_start(false);
    let (law, inner) = (VectorLaw::new(model, run, false), run.get("inner") as u32);
    for _ in 0..run.budget.velocity_iterations {
        descend(model, &law, [1.0, 0.0], |_, [n, t]| [n.max(0.0), t], inner, false);
        descend(model, &law, [0.0, 1.0], |mu, [n, t]| [n, t.clamp(-mu * n, mu * n)], inner, false);
    }
    model.advance();
}

/// In the space of impulses, where C may be zero: (1 + C K) λ = target − C (J v* + b).
pub(super) fn admm(model: &mut Model, run: &Run) {
    model.accelerate();
    let none = vec![[0.0; 2]; model.l.len()];
    let start = std::mem::replace(&mut model.l, none.clone());
    let law = VectorLaw::new(model, run, true);
    let (free, k) = (law.speeds(model, &none), couplings(model.problem));
    let coupled = |i: usize, j: usize| if i != j && run.makes(Fault::Uncoupled) { 0.0 } else { k[i][j] };
    // D (u + (µ |ut|, 0)) and D (µ |ut|, 0)
    let slide = |u: &[DPair], whole: f64| {
        let one =
            |(u, mu): (&DPair, &Option<f64>)| [whole * u[0] + mu.unwrap_or(0.0) * u[1].abs(), whole * u[1]];
        law.scaled(&u.iter().zip(&law.friction).map(one).collect::<Vec<DPair>>())
    };
    let (mut rho, every, count) =
        (run.get("penalty"), run.get("adapt_every") as u32, run.budget.velocity_iterations);
    let (mut z, mut u) = (start.clone(), law.speeds(model, &start));
    let x = plus(&z, -1.0, &slide(&u, 1.0));
    let mut w = plus(&x, -1.0, &law.within(&x, project_cone));
    w.iter_mut().flatten().for_each(|w| *w /= rho);
    for step in 1..=count {
        let target = plus(&plus(&z, -1.0, &w), -1.0 / rho, &slide(&u, 0.0));
        let mut l = plus(&target, -1.0 / rho, &law.scaled(&free)).into_flattened();
        let (n, mass) = (l.len(), law.mass.as_flattened());
        let entry = |i: usize, j: usize| mass[i] / rho * coupled(i, j) + if i == j { 1.0 } else { 0.0 };
        let mut a: Vec<f64> = (0..n * n).map(|at| entry(at / n, at % n)).collect();
        assert!(solve_in_place(&mut a, &mut l, 0.0));
        let l: Vec<DPair> = l.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        u = law.speeds(model, &l);
        let (both, old) = (plus(&l, 1.0, &w), z);
        z = law.within(&both, project_cone);
        w = plus(&both, -1.0, &z);
        let primal = law.square(&plus(&l, -1.0, &z));
        let dual = rho * rho * law.square(&plus(&z, -1.0, &old));
        let adapts = every > 0 && step % every == 0 && step + every <= count;
        if adapts && primal.max(dual) > 1e-10 * law.square(&z) {
            let change = ((primal / dual).sqrt() / 30.0).sqrt().clamp(1.0 / 30.0, 30.0);
            let next = (rho * change).clamp(1e-4_f64.min(rho), 1.0_f64.max(rho));
            if !(0.1..=10.0).contains(&(next / rho)) {
                w.iter_mut().flatten().for_each(|w| *w *= rho / next);
                rho = next;
            }
        }
    }
    model.jump(&z);
    model.advance();
}

/// Newton's method on ℓ(v) = ½ |v − v*|²_M + ½ Σ γᵀ R γ (`castro2022`), from the velocities of the last step. A point
/// at e = v̂ − J v sticks, slides or is open, with γ = R⁻¹ e, its nearest point of an edge, or zero.
pub(super) fn sap(model: &mut Model, run: &Run) {
    let mut v = model.v.concat();
    model.accelerate();
    let (free, rows, k) = (model.v.concat(), jacobian(model.problem), couplings(model.problem));
    let mass: Vec<f64> =
        model.inverse.concat().iter().map(|&i| if i > 0.0 { 1.0 / i } else { 1.0 }).collect();
    let rule = ScalarRule::Baumgarte(run.get("baumgarte"), 0.0, CAP);
    let push: Vec<f64> = (0..model.l.len()).map(|i| rule.line(model, i).push).collect();
    let soft = ["softness", "tangent_softness"].map(|name| run.get(name));
    let point = |i: usize, v: &[f64]| -> (DPair, [DPair; 2]) {
        let e = [-push[i] - inner(&rows[2 * i], v), -inner(&rows[2 * i + 1], v)];
        let mu = model.problem.contacts[i].friction;
        let r = [0, 1].map(|axis| soft[axis] * k[2 * i + axis][2 * i + axis]);
        let (y, w) = ([e[0] / r[0], e[1] / r[1]], [1.0, mu.copysign(e[1])]);
        let across = r[0] + mu * mu * r[1];
        let along = (e[0] + w[1] * e[1]) / across;
        match () {
            () if y[0] >= 0.0 && y[1].abs() <= mu * y[0] => (y, [[1.0 / r[0], 0.0], [0.0, 1.0 / r[1]]]),
            () if along > 0.0 => (w.map(|w| w * along), w.map(|a| w.map(|b| a * b / across))),
            () => ([0.0; 2], [[0.0; 2]; 2]),
        }
    };
    let (n, points) = (v.len(), push.len());
    let gradient = |v: &[f64]| {
        let loads: Vec<f64> = (0..points).flat_map(|i| point(i, v).0).collect();
        let pushed = |c: usize| rows.iter().zip(&loads).map(|(j, l)| j[c] * l).sum::<f64>();
        (0..n).map(|c| mass[c] * (v[c] - free[c]) - pushed(c)).collect::<Vec<f64>>()
    };
    for _ in 0..run.budget.velocity_iterations {
        let mut h = vec![0.0; n * n];
        (0..n).for_each(|c| h[c * n + c] = mass[c]);
        for (i, (p, q)) in (0..points).flat_map(|i| [(0, 0), (0, 1), (1, 0), (1, 1)].map(|pair| (i, pair))) {
            let stiff = point(i, &v).1[p][q];
            (0..n * n).for_each(|at| h[at] += rows[2 * i + p][at / n] * stiff * rows[2 * i + q][at % n]);
        }
        let mut d: Vec<f64> = gradient(&v).iter().map(|g| -g).collect();
        assert!(solve_in_place(&mut h, &mut d, 0.0));
        // The slope of ℓ along d rises: bisection finds its zero.
        let at = |s: f64| v.iter().zip(&d).map(|(v, d)| v + s * d).collect::<Vec<f64>>();
        let rises = |s: f64| inner(&gradient(&at(s)), &d) >= 0.0;
        let mut high = 1.0;
        while !rises(high) && high < 1e6 {
            high *= 2.0;
        }
        let mut low = 0.0;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            (low, high) = if rises(middle) { (low, middle) } else { (middle, high) };
        }
        v = at(high);
    }
    model.l = (0..points).map(|i| point(i, &v).0).collect();
    model.v = v.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
    model.advance();
}
