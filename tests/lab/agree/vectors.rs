//! The methods that iterate on the vector of all impulses; as [`super::methods`].

use super::Model;
use super::methods::{CAP, Fault, Run, rebound};
use super::rules::ScalarRule;
use simpulse::engine::constraints::numerics::matrix::solve_in_place;
use simpulse::lab::reference::iterate::{Acceleration, Anderson, ConjugateSweeps, dot, plus};
use simpulse::lab::reference::oracle::{GapRule, ScalarSweep, SidesOfPoint};
use simpulse::lab::reference::{DPair, Velocity};

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

/// u = J v(λ) + b of contacts, then of the rows of rigid joints, whose second entries are zero.
struct VectorLaw {
    bias: Vec<f64>,
    /// Effective masses D (kg).
    mass: Vec<DPair>,
    /// µ; `None` for a row of a joint, which has no bounds.
    friction: Vec<Option<f64>>,
    /// J of joint rows on their bodies.
    joints: Vec<Vec<(usize, Velocity)>>,
}

impl VectorLaw {
    /// With `alike`, D of a point is the same along n and t.
    fn new(model: &Model, run: &Run, alike: bool) -> Self {
        let (contacts, rule) = (&model.problem.contacts, run.baumgarte());
        let push = |i: usize| match contacts[i].rebound {
            0.0 => rule.line(model, i).push,
            u => -u,
        };
        let mass = |i: usize| {
            let [n, t] = [0, 1].map(|axis| model.mass(&model.rows(i, false), axis));
            [
                n,
                if contacts[i].friction == 0.0 {
                    0.0
                } else if alike {
                    n
                } else {
                    t
                },
            ]
        };
        let mut law = VectorLaw {
            bias: (0..contacts.len()).map(push).collect(),
            mass: (0..contacts.len()).map(mass).collect(),
            friction: contacts.iter().map(|c| Some(c.friction)).collect(),
            joints: Vec::new(),
        };
        for (joint, row) in model.problem.joints.iter().flat_map(|j| j.rows().map(move |row| (j, row))) {
            let side = |body: Option<u32>, sign: f64, arm: f64| {
                body.map(|b| (b as usize, [row.axis[0], row.axis[1], arm].map(|x| sign * x)))
            };
            let sides = [side(joint.body_a, -1.0, row.arm_a), side(joint.body_b, 1.0, row.arm_b)];
            let sides: Vec<(usize, Velocity)> = sides.into_iter().flatten().collect();
            let k =
                |(b, j): &(usize, Velocity)| (0..3).map(|c| model.inverse[*b][c] * j[c] * j[c]).sum::<f64>();
            law.mass.push([1.0 / sides.iter().map(k).sum::<f64>(), 0.0]);
            law.bias.push(run.get("baumgarte") / model.h * row.error);
            law.friction.push(None);
            law.joints.push(sides);
        }
        law
    }

    fn speeds(&self, model: &mut Model, at: &[DPair]) -> Vec<DPair> {
        model.jump(at);
        let along = |(b, j): &(usize, Velocity)| (0..3).map(|c| j[c] * model.v[*b][c]).sum::<f64>();
        let joints = self.joints.iter().map(|sides| [sides.iter().map(along).sum(), 0.0]);
        let contacts = model.problem.contact_velocities(&model.v).into_iter();
        contacts.chain(joints).zip(&self.bias).map(|(u, b)| [u[0] + b, u[1]]).collect()
    }

    /// Applies the projection of a point to all points.
    fn within(&self, l: &[DPair], project: fn(f64, DPair) -> DPair) -> Vec<DPair> {
        l.iter().zip(&self.friction).map(|(&l, mu)| mu.map_or(l, |mu| project(mu, l))).collect()
    }

    /// D x, or with `inverse` D⁻¹ x, without entries that have no mass.
    fn scaled(&self, x: &[DPair], inverse: bool) -> Vec<DPair> {
        let entry = |x: f64, m: f64| {
            if !inverse {
                m * x
            } else if m > 0.0 {
                x / m
            } else {
                0.0
            }
        };
        x.iter().zip(&self.mass).map(|(x, m)| [entry(x[0], m[0]), entry(x[1], m[1])]).collect()
    }

    /// |x|² in the norm of D⁻¹.
    fn square(&self, x: &[DPair]) -> f64 {
        dot(x, &self.scaled(x, true))
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
            next = law.within(&plus(&y, -1.0 / steepness, &law.scaled(&g, false)), project_cone);
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
        let mut next = law.within(&plus(&now, -length, &law.scaled(&g, false)), project);
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
            () => curve / dot(&change, &law.scaled(&change, false)),
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

/// K + C⁻¹ is that of impulses, (1 + C K) λ = target − C (J v* + b), so that C may be zero.
pub(super) fn admm(model: &mut Model, run: &Run) {
    model.accelerate();
    let none = vec![[0.0; 2]; model.l.len()];
    let start = std::mem::replace(&mut model.l, none.clone());
    let law = VectorLaw::new(model, run, true);
    let free = law.speeds(model, &none);
    let columns: Vec<Vec<f64>> = (0..2 * none.len())
        .map(|j| {
            let mut unit = none.clone();
            unit[j / 2][j % 2] = 1.0;
            let mut column = plus(&law.speeds(model, &unit), -1.0, &free).into_flattened();
            if run.makes(Fault::Uncoupled) {
                column.iter_mut().enumerate().filter(|(i, _)| *i != j).for_each(|(_, k)| *k = 0.0);
            }
            column
        })
        .collect();
    let shifted = |u: &[DPair]| -> Vec<DPair> {
        let slide = |(u, mu): (&DPair, &Option<f64>)| [u[0] + mu.unwrap_or(0.0) * u[1].abs(), u[1]];
        u.iter().zip(&law.friction).map(slide).collect()
    };
    let (mut rho, every) = (run.get("penalty"), run.get("adapt_every") as u32);
    let (mut z, mut u) = (start.clone(), law.speeds(model, &start));
    let x = plus(&z, -1.0, &law.scaled(&shifted(&u), false));
    let mut w = plus(&x, -1.0, &law.within(&x, project_cone));
    w.iter_mut().flatten().for_each(|w| *w /= rho);
    for k in 1..=run.budget.velocity_iterations {
        let c: Vec<f64> = law.mass.iter().flatten().map(|m| m / rho).collect();
        let slide = law.scaled(&plus(&shifted(&u), -1.0, &u), false);
        let target = plus(&plus(&z, -1.0, &w), -1.0 / rho, &slide);
        let mut b = plus(&target, -1.0 / rho, &law.scaled(&free, false)).into_flattened();
        let entry = |i: usize, j: usize| c[i] * columns[j][i] + if i == j { 1.0 } else { 0.0 };
        let mut a: Vec<f64> = (0..b.len() * b.len()).map(|at| entry(at / b.len(), at % b.len())).collect();
        assert!(solve_in_place(&mut a, &mut b, 0.0));
        let l: Vec<DPair> = b.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        u = law.speeds(model, &l);
        let (both, old) = (plus(&l, 1.0, &w), z);
        z = law.within(&both, project_cone);
        w = plus(&both, -1.0, &z);
        if every == 0 || k % every != 0 || k + every > run.budget.velocity_iterations {
            continue;
        }
        let primal = law.square(&plus(&l, -1.0, &z));
        let dual = rho * rho * law.square(&plus(&z, -1.0, &old));
        if primal.max(dual) > 1e-10 * law.square(&z) {
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

/// Newton's method on ℓ(v) = ½ |v − v*|²_M + ½ Σ γᵀ R γ (`castro2022`, equations in `sap/convex.rs`), from the
/// velocities of the last step.
pub(super) fn sap(model: &mut Model, run: &Run) {
    let mut v = model.v.concat();
    model.accelerate();
    let free = model.v.concat();
    let inverse = model.inverse.concat();
    let mass: Vec<f64> = inverse.iter().map(|&i| if i > 0.0 { 1.0 / i } else { 1.0 }).collect();
    let rule = ScalarRule::Baumgarte(run.get("baumgarte"), 0.0, CAP);
    let soft = ["softness", "tangent_softness"].map(|name| run.get(name));
    let n = v.len();
    let rows: Vec<SidesOfPoint> = (0..model.l.len()).map(|i| model.rows(i, false)).collect();
    let push: Vec<f64> = (0..rows.len()).map(|i| rule.line(model, i).push).collect();
    let speed = |i: usize, v: &[f64]| {
        let mut u = [0.0; 2];
        for (b, j) in rows[i].iter().flatten() {
            (0..6).for_each(|k| u[k / 3] += j[k / 3][k % 3] * v[3 * b + k % 3]);
        }
        u
    };
    // γ and G of a point at e = v̂ − J v.
    let point = |i: usize, u: DPair| -> (DPair, [DPair; 2]) {
        let (e, mu) = ([-push[i] - u[0], -u[1]], model.problem.contacts[i].friction);
        let r = [0, 1].map(|axis| soft[axis] / model.mass(&rows[i], axis));
        let y = [e[0] / r[0], e[1] / r[1]];
        let across = r[0] + mu * mu * r[1];
        let w = [1.0, mu.copysign(e[1])];
        let along = (e[0] + w[1] * e[1]) / across;
        match () {
            () if y[0] >= 0.0 && y[1].abs() <= mu * y[0] => (y, [[1.0 / r[0], 0.0], [0.0, 1.0 / r[1]]]),
            () if along > 0.0 => (w.map(|w| w * along), w.map(|a| w.map(|b| a * b / across))),
            () => ([0.0; 2], [[0.0; 2]; 2]),
        }
    };
    let gradient = |v: &[f64]| {
        let mut g: Vec<f64> = (0..n).map(|k| mass[k] * (v[k] - free[k])).collect();
        for (i, rows) in rows.iter().enumerate() {
            let (gamma, _) = point(i, speed(i, v));
            for (b, j) in rows.iter().flatten() {
                (0..6).for_each(|k| g[3 * b + k % 3] -= j[k / 3][k % 3] * gamma[k / 3]);
            }
        }
        g
    };
    for _ in 0..run.budget.velocity_iterations {
        let g = gradient(&v);
        let mut h = vec![0.0; n * n];
        (0..n).for_each(|k| h[k * n + k] = mass[k]);
        for (i, rows) in rows.iter().enumerate() {
            let (_, stiff) = point(i, speed(i, &v));
            for ((a, p), (b, q)) in
                rows.iter().flatten().flat_map(|a| rows.iter().flatten().map(move |b| (a, b)))
            {
                for (r, c) in (0..9).map(|k| (k / 3, k % 3)) {
                    let sum = |k: usize| p[k / 2][r] * stiff[k / 2][k % 2] * q[k % 2][c];
                    h[(3 * a + r) * n + 3 * b + c] += (0..4).map(sum).sum::<f64>();
                }
            }
        }
        let mut d: Vec<f64> = g.iter().map(|g| -g).collect();
        if !solve_in_place(&mut h, &mut d, 0.0) {
            break;
        }
        // The slope of ℓ along d rises: bisection finds its zero.
        let at = |s: f64| -> Vec<f64> { v.iter().zip(&d).map(|(v, d)| v + s * d).collect() };
        let slope = |s: f64| gradient(&at(s)).iter().zip(&d).map(|(g, d)| g * d).sum::<f64>();
        let (mut low, mut high) = (0.0, 1.0);
        while slope(high) < 0.0 && high < 1e6 {
            high *= 2.0;
        }
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) < 0.0 { low = middle } else { high = middle }
        }
        v = at(high);
    }
    model.l = (0..rows.len()).map(|i| point(i, speed(i, &v)).0).collect();
    model.v = v.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect();
    model.advance();
}
