//! One frozen problem in `f64`, solved row by row as the sources describe their methods: no lanes, no code
//! shared with the solvers.
//!
//! An impulse λ along a row J changes velocities by M⁻¹ Jᵀ λ. A single row is satisfied by λ ← λ − (J v +
//! b)/k, with k = J M⁻¹ Jᵀ. Bodies move by x ← x + h v. If the anchor r of a point has turned with its body
//! by θ, the gap of the point is
//!
//! ```text
//! s = s₀ + n·(x_b − x_a) + n·((R(θ_b) − 1) r_b) − n·((R(θ_a) − 1) r_a),   n·((R − 1) r) = sin θ (r × n) + (1 − cos θ)(r × t)
//! ```
//!
//! since r = −(r × t) n + (r × n) t. Likewise its drift along t contains sin θ (r × t) − (1 − cos θ)(r × n).

use crate::lab::reference::problem::SideRows;
use crate::lab::reference::{ContactProblem, DPair, Velocity};
use std::f64::consts::TAU;
use std::ops::Range;

/// Rows of a contact point, for each of its two bodies that is not static.
pub type SidesOfPoint = Vec<(usize, SideRows)>;

/// State of a run: bodies, impulses, substep.
#[derive(Clone, Debug)]
pub struct Model<'a> {
    /// The problem.
    pub problem: &'a ContactProblem,
    /// Substep (s), equal to the problem's step.
    pub h: f64,
    /// Inverse masses of every body (1/kg, 1/kg, 1/(kg·m²)).
    pub inverse: Vec<Velocity>,
    /// Change of velocity by forces in a substep (m/s, rad/s).
    pub gained: Vec<Velocity>,
    /// Velocities.
    pub v: Vec<Velocity>,
    /// Displacement and rotation of bodies since the start (m, rad).
    pub x: Vec<Velocity>,
    /// Accumulated impulses (N·s).
    pub l: Vec<DPair>,
    /// Points of each manifold, at most two.
    pub manifolds: Vec<Range<usize>>,
}

/// How a normal row treats the gap s.
#[derive(Clone, Copy, Debug)]
pub enum ScalarRule {
    /// A gap may close; overlap is not corrected.
    Rigid,
    /// As [`ScalarRule::Rigid`], but a gap counts as closed: the rows of sources without speculative
    /// contacts.
    Closed,
    /// b = max(β (s + slop)/h, −cap) (`baumgarte1972`): β (1), slop (m), cap (m/s).
    Baumgarte(f64, f64, f64),
    /// Soft contacts (`catto2011`).
    Soft(ScalarSpring),
    /// As [`ScalarRule::Rigid`], and the fraction β of an overlap smaller than a limit (m) is corrected
    /// (`coumans2015`).
    Shallow(f64, f64),
    /// Corrects the fraction β of an overlap larger than a limit (m); shallower points have no row.
    Deep(f64, f64),
    /// v_n ≥ 0 at points with a gap below a slop (m); other points have no row.
    Touching(f64),
}

/// Parameters of soft contacts.
#[derive(Clone, Copy, Debug)]
pub struct ScalarSpring {
    /// ω (rad/s) between dynamic bodies; twice that against other bodies.
    pub omega: f64,
    /// ζ (1)
    pub damping: f64,
    /// Push speed limit (m/s).
    pub cap: f64,
    /// Whether the cap applies to γ_m β s (`catto2024box2d`) or to β s (`catto2024solver2d`).
    pub scaled: bool,
    /// Whether the leak of a capped push is reduced in the same proportion, so that a load is carried at any
    /// depth (`shim`).
    pub carries: bool,
}

impl ScalarSpring {
    /// From a frequency of `hertz` (Hz), limited to `share` of the substep rate; `h` is the substep (s).
    pub fn new(hertz: f64, share: f64, damping: f64, cap: f64, h: f64) -> Self {
        ScalarSpring { omega: TAU * hertz.min(share / h), damping, cap, scaled: true, carries: false }
    }
}

/// Order of the rows of a manifold, and which of them are solved together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowOrder {
    /// All normal rows, then all friction rows.
    NormalsFirst,
    /// Normal and friction row of one point, then of the other.
    PointByPoint,
    /// All friction rows, then all normal rows.
    FrictionFirst,
    /// As [`RowOrder::FrictionFirst`], with both normal rows solved together unless their determinant is
    /// below this fraction of k₁₁ k₂₂.
    BlockLast(f64),
    /// As [`RowOrder::NormalsFirst`], with both normal rows solved together; the number as in
    /// [`RowOrder::BlockLast`].
    BlockFirst(f64),
    /// Normal and friction row of a point solved together, exactly.
    Cone,
}

/// Parameters of a velocity sweep.
#[derive(Clone, Copy, Debug)]
pub struct ScalarSweep {
    /// Rule of normal rows.
    pub rule: ScalarRule,
    /// Order of the rows.
    pub rows: RowOrder,
    /// ω, the relaxation factor of every increment.
    pub relax: f64,
    /// Whether friction rows are solved.
    pub friction: bool,
    /// Whether lever arms turn with their bodies.
    pub turned: bool,
    /// Whether points and rows are solved in reverse order.
    pub reversed: bool,
}

impl ScalarSweep {
    /// A sweep with normal rows first, on fixed arms.
    pub fn new(rule: ScalarRule) -> Self {
        ScalarSweep {
            rule,
            rows: RowOrder::NormalsFirst,
            relax: 1.0,
            friction: true,
            turned: false,
            reversed: false,
        }
    }
}

/// New impulse of a row: keep · λ − m (scale · v_n + push).
struct Line {
    push: f64,
    scale: f64,
    keep: f64,
}

impl<'a> Model<'a> {
    /// The problem at its start, with its warm-start impulses or with none.
    pub fn new(problem: &'a ContactProblem, warm: bool) -> Self {
        let mut manifolds: Vec<Range<usize>> = Vec::new();
        for (i, c) in problem.contacts.iter().enumerate() {
            match manifolds.last_mut() {
                Some(Range { start, end })
                    if problem.contacts[*start].manifold == c.manifold && *end - *start < 2 =>
                {
                    *end = i + 1;
                }
                _ => manifolds.push(i..i + 1),
            }
        }
        let gained = |k: usize| {
            let b = &problem.bodies[k];
            [0, 1, 2].map(|i| b.free_velocity[i] - b.velocity[i])
        };
        let bodies = problem.bodies.len();
        Model {
            problem,
            h: problem.h,
            inverse: problem.bodies.iter().map(|b| [b.inv_mass, b.inv_mass, b.inv_inertia]).collect(),
            gained: (0..bodies).map(gained).collect(),
            v: problem.bodies.iter().map(|b| b.velocity).collect(),
            x: vec![[0.0; 3]; bodies],
            l: problem.contacts.iter().map(|c| if warm { c.warm_impulse } else { [0.0; 2] }).collect(),
            manifolds,
        }
    }

    /// v ← v + h a
    pub fn accelerate(&mut self) {
        for (v, gained) in self.v.iter_mut().zip(&self.gained) {
            (0..3).for_each(|k| v[k] += gained[k]);
        }
    }

    /// x ← x + h v
    pub fn advance(&mut self) {
        for (x, v) in self.x.iter_mut().zip(&self.v) {
            (0..3).for_each(|k| x[k] += self.h * v[k]);
        }
    }

    /// Applies all impulses; with `turned`, on arms that have turned with their bodies.
    pub fn warm_start(&mut self, turned: bool) {
        for i in 0..self.l.len() {
            let rows = self.rows(i, turned);
            (0..2).for_each(|axis| self.push(&rows, axis, self.l[i][axis]));
        }
    }

    /// Rows of point `i`.
    pub fn rows(&self, i: usize, turned: bool) -> SidesOfPoint {
        let turn = |(body, [n, t]): (usize, SideRows)| {
            let (sin, cos) = if turned { self.x[body][2].sin_cos() } else { (0.0, 1.0) };
            let arms = [n[2] * cos + t[2] * sin, t[2] * cos - n[2] * sin];
            (body, [[n[0], n[1], arms[0]], [t[0], t[1], arms[1]]])
        };
        self.problem.contacts[i].sides().map(turn).collect()
    }

    /// J v
    pub fn speed(&self, rows: &SidesOfPoint, axis: usize) -> f64 {
        rows.iter().map(|(b, j)| (0..3).map(|k| j[axis][k] * self.v[*b][k]).sum::<f64>()).sum()
    }

    /// k = J₁ M⁻¹ J₂ᵀ of two rows of one manifold (1/kg).
    pub fn coupling(&self, one: (&SidesOfPoint, usize), other: (&SidesOfPoint, usize)) -> f64 {
        let product = |((b, p), (_, q)): (&(usize, SideRows), &(usize, SideRows))| {
            (0..3).map(|k| self.inverse[*b][k] * p[one.1][k] * q[other.1][k]).sum::<f64>()
        };
        one.0.iter().zip(other.0).map(product).sum()
    }

    /// Effective mass of a row (kg).
    pub fn mass(&self, rows: &SidesOfPoint, axis: usize) -> f64 {
        1.0 / self.coupling((rows, axis), (rows, axis))
    }

    /// v ← v + M⁻¹ Jᵀ λ
    pub fn push(&mut self, rows: &SidesOfPoint, axis: usize, impulse: f64) {
        for (b, j) in rows {
            (0..3).for_each(|k| self.v[*b][k] += self.inverse[*b][k] * j[axis][k] * impulse);
        }
    }

    /// x ← x + M⁻¹ Jᵀ p
    pub fn displace(&mut self, rows: &SidesOfPoint, axis: usize, by: f64) {
        for (b, j) in rows {
            (0..3).for_each(|k| self.x[*b][k] += self.inverse[*b][k] * j[axis][k] * by);
        }
    }

    /// Gap of point `i`, and its drift along t (m).
    pub fn place(&self, i: usize) -> DPair {
        let mut place = [self.problem.contacts[i].gap, 0.0];
        for (b, [n, t]) in self.problem.contacts[i].sides() {
            let ([x, y, turn], versine) = (self.x[b], 1.0 - self.x[b][2].cos());
            place[0] += n[0] * x + n[1] * y + turn.sin() * n[2] + versine * t[2];
            place[1] += t[0] * x + t[1] * y + turn.sin() * t[2] - versine * n[2];
        }
        place
    }

    /// Whether one side of point `i` is not dynamic.
    fn against_static(&self, i: usize) -> bool {
        let dynamic = |b: &Option<u32>| {
            b.is_some_and(|b| {
                let b = &self.problem.bodies[b as usize];
                b.inv_mass > 0.0 || b.inv_inertia > 0.0
            })
        };
        let c = &self.problem.contacts[i];
        !(dynamic(&c.body_a) && dynamic(&c.body_b))
    }

    fn line(&self, i: usize, rule: ScalarRule) -> Line {
        let s = self.place(i)[0];
        let rigid = |push: f64| Line { push, scale: 1.0, keep: 1.0 };
        match rule {
            ScalarRule::Closed => rigid(0.0),
            ScalarRule::Touching(slop) => Line { scale: if s < slop { 1.0 } else { 0.0 }, ..rigid(0.0) },
            ScalarRule::Deep(share, limit) if s < -limit => rigid(share * s / self.h),
            ScalarRule::Deep(..) => Line { scale: 0.0, ..rigid(0.0) },
            _ if s > 0.0 => rigid(s / self.h),
            ScalarRule::Shallow(share, limit) => rigid(if s > -limit { share * s / self.h } else { 0.0 }),
            ScalarRule::Rigid => rigid(0.0),
            ScalarRule::Baumgarte(share, slop, cap) => {
                rigid((share * (s + slop).min(0.0) / self.h).max(-cap))
            }
            ScalarRule::Soft(ScalarSpring { omega, damping, cap, scaled, carries }) => {
                let omega = if self.against_static(i) { 2.0 * omega } else { omega };
                let rate = omega / (2.0 * damping + self.h * omega);
                let a = self.h * omega * (2.0 * damping + self.h * omega);
                let (scale, leak) = (a / (1.0 + a), 1.0 / (1.0 + a));
                let wanted = -scale * rate * s;
                let push = if scaled { wanted.min(cap) } else { scale * (-rate * s).min(cap) };
                let leak = if carries && wanted > cap { leak * cap / wanted } else { leak };
                Line { push: -push, scale, keep: 1.0 - leak }
            }
        }
    }

    /// c and s of a normal row: the impulse that solves the row alone is max(0, c − s v_n).
    fn normal_line(&self, i: usize, sweep: &ScalarSweep) -> DPair {
        let Line { push, scale, keep } = self.line(i, sweep.rule);
        let (m, old) = (self.mass(&self.rows(i, false), 0), self.l[i][0]);
        let c = keep * old - m * push;
        [old + sweep.relax * (c - old), sweep.relax * m * scale]
    }

    /// Sets the impulse of a row and updates velocities.
    pub fn set(&mut self, i: usize, axis: usize, rows: &SidesOfPoint, new: f64) {
        let old = std::mem::replace(&mut self.l[i][axis], new);
        self.push(rows, axis, new - old);
    }

    fn normal_row(&mut self, i: usize, sweep: &ScalarSweep) {
        let rows = self.rows(i, sweep.turned);
        let [c, s] = self.normal_line(i, sweep);
        let new = (c - s * self.speed(&rows, 0)).max(0.0);
        self.set(i, 0, &rows, new);
    }

    fn friction_row(&mut self, i: usize, sweep: &ScalarSweep) {
        let bound = self.problem.contacts[i].friction * self.l[i][0];
        let (rows, m) = (self.rows(i, sweep.turned), self.mass(&self.rows(i, false), 1));
        let new = (self.l[i][1] - sweep.relax * m * self.speed(&rows, 1)).clamp(-bound, bound);
        self.set(i, 1, &rows, new);
    }

    /// Solves the rows of one manifold.
    pub fn contact(&mut self, m: Range<usize>, sweep: &ScalarSweep) {
        let mut points: Vec<usize> = m.collect();
        if sweep.reversed {
            points.reverse();
        }
        let (normals_last, block) = match sweep.rows {
            RowOrder::NormalsFirst => (sweep.reversed, None),
            RowOrder::FrictionFirst => (true, None),
            RowOrder::BlockFirst(singular) => (false, Some(singular)),
            RowOrder::BlockLast(singular) => (true, Some(singular)),
            RowOrder::Cone => return points.iter().for_each(|&i| self.cone(i, sweep)),
            RowOrder::PointByPoint => {
                return points.iter().for_each(|&i| {
                    self.normal_row(i, sweep);
                    self.friction_row(i, sweep);
                });
            }
        };
        for normals in [!normals_last, normals_last] {
            match (normals, block) {
                (true, Some(singular)) => self.block(&points, sweep, singular),
                (true, None) => points.iter().for_each(|&i| self.normal_row(i, sweep)),
                (false, _) if sweep.friction => points.iter().for_each(|&i| self.friction_row(i, sweep)),
                (false, _) => {}
            }
        }
    }

    /// Solves both normal rows together: takes the one of four cases in which no impulse is negative and no
    /// point approaches.
    fn block(&mut self, points: &[usize], sweep: &ScalarSweep, singular: f64) {
        let &[i, j] = points else { return self.normal_row(points[0], sweep) };
        let rows = [i, j].map(|i| self.rows(i, sweep.turned));
        let [[c1, s1], [c2, s2]] = [i, j].map(|i| self.normal_line(i, sweep));
        let k = self.coupling((&rows[0], 0), (&rows[1], 0));
        if 1.0 - s1 * s2 * k * k < singular {
            points.iter().for_each(|&i| self.normal_row(i, sweep));
            return;
        }
        let [v1, v2] = [0, 1].map(|p| self.speed(&rows[p], 0));
        // If both impulses are positive: λ₁ + s₁ k λ₂ = q₁ and s₂ k λ₁ + λ₂ = q₂.
        let (q1, q2) = (c1 - s1 * (v1 - k * self.l[j][0]), c2 - s2 * (v2 - k * self.l[i][0]));
        let det = 1.0 - s1 * s2 * k * k;
        let cases = [[(q1 - s1 * k * q2) / det, (q2 - s2 * k * q1) / det], [q1, 0.0], [0.0, q2], [0.0, 0.0]];
        let holds = |&&[a, b]: &&DPair| {
            let wanted = [q1 - s1 * k * b, q2 - s2 * k * a];
            a >= 0.0 && b >= 0.0 && (a > 0.0 || wanted[0] <= 0.0) && (b > 0.0 || wanted[1] <= 0.0)
        };
        let [a, b] = *cases.iter().find(holds).unwrap_or(&cases[3]);
        self.set(i, 0, &rows[0], a);
        self.set(j, 0, &rows[1], b);
    }

    /// Solves both rows of a point together: takes the case that holds of open, sticking, and slipping in
    /// either direction.
    fn cone(&mut self, i: usize, sweep: &ScalarSweep) {
        let rows = self.rows(i, false);
        let Line { push, .. } = self.line(i, sweep.rule);
        let (l, mu) = (self.l[i], self.problem.contacts[i].friction);
        let k = |a, b| self.coupling((&rows, a), (&rows, b));
        let (nn, nt, tt) = (k(0, 0), k(0, 1), k(1, 1));
        // Velocities without the impulse of this point.
        let n = self.speed(&rows, 0) + push - nn * l[0] - nt * l[1];
        let t = self.speed(&rows, 1) - nt * l[0] - tt * l[1];
        let det = nn * tt - nt * nt;
        let stick = [(nt * t - tt * n) / det, (nt * n - nn * t) / det];
        let slip = |side: f64| {
            let normal = -n / (nn + side * mu * nt);
            [normal, side * mu * normal]
        };
        let slides = |side: f64, [a, b]: DPair| a >= 0.0 && side * (t + nt * a + tt * b) <= 0.0;
        let new = match () {
            () if n >= 0.0 => [0.0; 2],
            () if stick[0] >= 0.0 && stick[1].abs() <= mu * stick[0] => stick,
            () if slides(1.0, slip(1.0)) => slip(1.0),
            () if slides(-1.0, slip(-1.0)) => slip(-1.0),
            () => [0.0; 2],
        };
        (0..2).for_each(|axis| self.set(i, axis, &rows, new[axis]));
    }

    /// Gauss–Seidel over the manifolds in the given order.
    pub fn sweep_in(&mut self, sweep: &ScalarSweep, order: impl Iterator<Item = usize>) {
        order.for_each(|m| self.contact(self.manifolds[m].clone(), sweep));
    }

    /// Gauss–Seidel over all manifolds.
    pub fn sweep(&mut self, sweep: &ScalarSweep) {
        self.sweep_in(sweep, 0..self.manifolds.len());
    }

    /// Solves all manifolds from the same velocities. With `split`, each body is split into as many copies as
    /// it has manifolds, each with an equal part of its mass; its new velocity is the mean of the copies.
    /// With `by_rows`, each row of a manifold is solved from the same velocities too, and rows are counted
    /// instead of manifolds.
    pub fn jacobi(&mut self, sweep: &ScalarSweep, split: bool, by_rows: bool) {
        let mut copies = vec![0.0; self.v.len()];
        for m in &self.manifolds {
            let count = if by_rows { 2.0 * m.len() as f64 } else { 1.0 };
            self.problem.contacts[m.start].sides().for_each(|(b, _)| copies[b] += count);
        }
        let (inverse, before) = (self.inverse.clone(), self.v.clone());
        if split {
            self.inverse.iter_mut().zip(&copies).for_each(|(m, &n)| *m = m.map(|m| m * f64::max(n, 1.0)));
        }
        let mut sum = vec![[0.0; 3]; self.v.len()];
        let mut add = |model: &mut Self| {
            for ((v, before), sum) in model.v.iter_mut().zip(&before).zip(&mut sum) {
                (0..3).for_each(|k| sum[k] += v[k] - before[k]);
                *v = *before;
            }
        };
        for m in 0..self.manifolds.len() {
            if by_rows {
                for i in self.manifolds[m].clone() {
                    self.normal_row(i, sweep);
                    add(self);
                    self.friction_row(i, sweep);
                    add(self);
                }
            } else {
                self.contact(self.manifolds[m].clone(), sweep);
                add(self);
            }
        }
        self.inverse = inverse;
        for ((v, sum), n) in self.v.iter_mut().zip(&sum).zip(&copies) {
            let share = if split { 1.0 / f64::max(*n, 1.0) } else { 1.0 };
            (0..3).for_each(|k| v[k] += share * sum[k]);
        }
    }

    /// Sets all impulses and updates velocities.
    pub fn jump(&mut self, to: &[DPair]) {
        for (i, &[n, t]) in to.iter().enumerate() {
            let rows = self.rows(i, false);
            self.set(i, 0, &rows, n);
            self.set(i, 1, &rows, t);
        }
    }

    /// b of every normal row (m/s), under a rule without springs.
    pub fn bias(&self, rule: ScalarRule) -> Vec<f64> {
        (0..self.l.len()).map(|i| self.line(i, rule).push).collect()
    }

    /// J v of every point (m/s).
    pub fn speeds(&self) -> Vec<DPair> {
        self.problem.contact_velocities(&self.v)
    }

    /// Nonlinear Gauss–Seidel on positions: corrects the fraction `share` of an overlap beyond `slop` (m), by
    /// at most `most` (m).
    pub fn positions(&mut self, share: f64, slop: f64, most: f64, turned: bool) {
        for i in 0..self.l.len() {
            let error = (share * (self.place(i)[0] + slop)).clamp(-most, 0.0);
            let rows = self.rows(i, turned);
            self.displace(&rows, 0, -error * self.mass(&rows, 0));
        }
    }

    /// As [`Self::positions`] on turned arms, with both points of a manifold together (`catto2024solver2d`):
    /// C + K p ≥ 0 with p ≥ 0, by its four cases.
    pub fn positions_in_pairs(&mut self, share: f64, slop: f64, most: f64) {
        for m in self.manifolds.clone() {
            let error = |model: &Self, i: usize| (share * (model.place(i)[0] + slop)).clamp(-most, 0.0);
            let rows: Vec<SidesOfPoint> = m.clone().map(|i| self.rows(i, true)).collect();
            let c: Vec<f64> = m.clone().map(|i| error(self, i)).collect();
            let k = |a: usize, b: usize| self.coupling((&rows[a], 0), (&rows[b], 0));
            let p = match c[..] {
                [c] => vec![-c / k(0, 0)],
                _ => {
                    let (a, b, d) = (k(0, 0), k(0, 1), k(1, 1));
                    let det = a * d - b * b;
                    let cases = [
                        [(b * c[1] - d * c[0]) / det, (b * c[0] - a * c[1]) / det],
                        [-c[0] / a, 0.0],
                        [0.0, -c[1] / d],
                        [0.0, 0.0],
                    ];
                    let holds = |p: &&[f64; 2]| {
                        let w = [c[0] + a * p[0] + b * p[1], c[1] + b * p[0] + d * p[1]];
                        (0..2).all(|i| p[i] >= 0.0 && w[i] >= -1e-12)
                    };
                    cases.iter().find(holds).unwrap_or(&cases[3]).to_vec()
                }
            };
            rows.iter().zip(p).for_each(|(rows, p)| self.displace(rows, 0, p));
        }
    }
}
