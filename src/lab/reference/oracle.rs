//! One Gauss–Seidel in `f64`, a row at a time and without code of the solvers. It certifies references
//! ([`super::certify`]), shows how plain sweeps converge, and is the arithmetic of the sources' methods with
//! which every solver is compared (`cargo test --test lab agree`).
//!
//! An impulse λ along a row J changes velocities by M⁻¹ Jᵀ λ. The impulse that satisfies a row alone is a
//! line in its velocity, projected onto its bounds λn ≥ 0, |λt| ≤ µ λn:
//!
//! ```text
//! λn' = max(0, keep λn − m (scale un + push)),    λt' = clamp(λt − m ut, ±µ λn'),    m = 1/(J M⁻¹ Jᵀ)
//! ```
//!
//! The law un + b + c λn = 0 of a [`Target`] has scale = keep = k/(k + c) and push = scale · b, with k = 1/m,
//! so the fixed points of a sweep are the zeros of the natural map. Joints are solved block by block, before
//! the contacts as in the simulation; each block gets the impulses that satisfy it alone.
//!
//! Bodies move by x ← x + h v. If the anchor r of a point has turned with its body by θ, its gap is
//!
//! ```text
//! s = s₀ + n·(x_b − x_a) + n·((R(θ_b) − 1) r_b) − n·((R(θ_a) − 1) r_a),   n·((R − 1) r) = sin θ (r × n) + (1 − cos θ)(r × t)
//! ```
//!
//! since r = −(r × t) n + (r × n) t. Its drift along t contains sin θ (r × t) − (1 − cos θ)(r × n).

use super::joints::BlockLine;
use super::problem::{ContactProblem, DPair, SideRows, Target, Velocity};
use super::residual::clamp;
use super::rows::{OwnRow, positive};
use std::ops::Range;

/// Rows of a contact point on its bodies, with the sign of the side; `None` for a static one.
pub type SidesOfPoint = [Option<(usize, SideRows)>; 2];

/// State of a run: bodies and impulses.
#[derive(Clone, Debug)]
pub struct Oracle<'a> {
    /// The problem.
    pub problem: &'a ContactProblem,
    /// Step (s).
    pub h: f64,
    /// Inverse masses of every body (1/kg, 1/kg, 1/(kg·m²)).
    pub inverse: Vec<Velocity>,
    /// Velocities.
    pub v: Vec<Velocity>,
    /// Displacement and rotation of bodies since the start (m, rad).
    pub x: Vec<Velocity>,
    /// Accumulated impulses of contacts, then (λ, 0) of joint rows (N·s).
    pub l: Vec<DPair>,
    /// Points of each manifold, at most two.
    pub manifolds: Vec<Range<usize>>,
    lines: Vec<BlockLine>,
}

/// The line of a normal row; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Bias (m/s); negative values push apart.
    pub push: f64,
    /// Factor of the velocity (1).
    pub scale: f64,
    /// Factor of the impulse so far (1).
    pub keep: f64,
}

impl Line {
    /// un + `push` = 0.
    pub fn rigid(push: f64) -> Self {
        Line { push, scale: 1.0, keep: 1.0 }
    }
}

/// How normal rows treat gaps.
pub trait GapRule: Copy {
    /// The line of point `i`.
    fn line(self, oracle: &Oracle, i: usize) -> Line;
}

/// The law of every contact: its bias and compliance at the start of the step.
impl GapRule for &[OwnRow] {
    fn line(self, oracle: &Oracle, i: usize) -> Line {
        let OwnRow { bias, compliance } = self[i];
        if compliance == 0.0 {
            return Line::rigid(bias);
        }
        let share = 1.0 / (1.0 + compliance * oracle.mass(&oracle.rows(i, false), 0));
        Line { push: share * bias, scale: share, keep: share }
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
pub struct ScalarSweep<R> {
    /// Rule of normal rows.
    pub rule: R,
    /// Order of the rows.
    pub rows: RowOrder,
    /// ω, the relaxation factor of every increment.
    pub relax: f64,
    /// Whether friction rows are solved.
    pub friction: bool,
    /// Whether lever arms turn with their bodies.
    pub turned: bool,
    /// Whether points, rows and joints are solved in reverse order.
    pub reversed: bool,
}

impl<R> ScalarSweep<R> {
    /// A sweep with normal rows first, on fixed arms.
    pub fn new(rule: R) -> Self {
        let rows = RowOrder::NormalsFirst;
        ScalarSweep { rule, rows, relax: 1.0, friction: true, turned: false, reversed: false }
    }
}

impl<'a> Oracle<'a> {
    /// Bodies at the start of the step without forces, and these impulses, not applied yet. `target` is the
    /// law of joints.
    pub fn new(problem: &'a ContactProblem, target: Target, impulses: Vec<DPair>) -> Self {
        let mut manifolds: Vec<Range<usize>> = Vec::new();
        for (i, c) in problem.contacts.iter().enumerate() {
            match manifolds.last_mut() {
                Some(m) if problem.contacts[m.start].manifold == c.manifold && m.len() < 2 => m.end = i + 1,
                _ => manifolds.push(i..i + 1),
            }
        }
        Oracle {
            problem,
            h: problem.h,
            inverse: problem.bodies.iter().map(|b| b.inverse()).collect(),
            v: problem.bodies.iter().map(|b| b.velocity).collect(),
            x: vec![[0.0; 3]; problem.bodies.len()],
            l: impulses,
            manifolds,
            lines: problem.lines(target),
        }
    }

    /// v ← v + h a
    pub fn accelerate(&mut self) {
        for (v, b) in self.v.iter_mut().zip(&self.problem.bodies) {
            (0..3).for_each(|k| v[k] += b.free_velocity[k] - b.velocity[k]);
        }
    }

    /// x ← x + h v
    pub fn advance(&mut self) {
        for (x, v) in self.x.iter_mut().zip(&self.v) {
            (0..3).for_each(|k| x[k] += self.h * v[k]);
        }
    }

    /// Applies all impulses; with `turned`, those of contacts on arms that have turned with their bodies.
    pub fn warm_start(&mut self, turned: bool) {
        for i in 0..self.problem.contacts.len() {
            let rows = self.rows(i, turned);
            (0..2).for_each(|axis| self.push(&rows, axis, self.l[i][axis]));
        }
        self.problem.push_joints(&self.l, &mut self.v);
    }

    /// Rows of point `i`.
    pub fn rows(&self, i: usize, turned: bool) -> SidesOfPoint {
        let rows = self.problem.contacts[i].both_sides();
        if !turned {
            return rows;
        }
        rows.map(|side| {
            side.map(|(body, [n, t])| {
                let (sin, cos) = self.x[body][2].sin_cos();
                let arms = [n[2] * cos + t[2] * sin, t[2] * cos - n[2] * sin];
                (body, [[n[0], n[1], arms[0]], [t[0], t[1], arms[1]]])
            })
        })
    }

    /// J v
    pub fn speed(&self, rows: &SidesOfPoint, axis: usize) -> f64 {
        let side = |(b, j): &(usize, SideRows)| (0..3).map(|k| j[axis][k] * self.v[*b][k]).sum::<f64>();
        rows.iter().flatten().map(side).sum()
    }

    /// k = J₁ M⁻¹ J₂ᵀ of two rows of one manifold (1/kg).
    pub fn coupling(&self, one: (&SidesOfPoint, usize), other: (&SidesOfPoint, usize)) -> f64 {
        let product = |((b, p), (_, q)): (&(usize, SideRows), &(usize, SideRows))| {
            (0..3).map(|k| self.inverse[*b][k] * p[one.1][k] * q[other.1][k]).sum::<f64>()
        };
        one.0.iter().flatten().zip(other.0.iter().flatten()).map(product).sum()
    }

    /// Effective mass of a row (kg).
    pub fn mass(&self, rows: &SidesOfPoint, axis: usize) -> f64 {
        1.0 / self.coupling((rows, axis), (rows, axis))
    }

    /// v ← v + M⁻¹ Jᵀ λ
    pub fn push(&mut self, rows: &SidesOfPoint, axis: usize, impulse: f64) {
        for (b, j) in rows.iter().flatten() {
            (0..3).for_each(|k| self.v[*b][k] += self.inverse[*b][k] * j[axis][k] * impulse);
        }
    }

    /// x ← x + M⁻¹ Jᵀ p
    pub fn displace(&mut self, rows: &SidesOfPoint, axis: usize, by: f64) {
        for (b, j) in rows.iter().flatten() {
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

    /// Sets the impulse of a row of point `i` and updates velocities.
    pub fn set(&mut self, i: usize, axis: usize, rows: &SidesOfPoint, new: f64) {
        let old = std::mem::replace(&mut self.l[i][axis], new);
        self.push(rows, axis, new - old);
    }

    /// Sets all impulses and updates velocities.
    pub fn jump(&mut self, to: &[DPair]) {
        let change: Vec<DPair> = to.iter().zip(&self.l).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
        for (c, &change) in self.problem.contacts.iter().zip(&change) {
            self.problem.apply(c, change, &mut self.v);
        }
        self.problem.push_joints(&change, &mut self.v);
        self.l = to.to_vec();
    }

    /// c and s of a normal row: the impulse that satisfies the row alone is max(0, c − s un).
    fn normal_line<R: GapRule>(&self, i: usize, sweep: &ScalarSweep<R>) -> DPair {
        let Line { push, scale, keep } = sweep.rule.line(self, i);
        let (m, old) = (self.mass(&self.rows(i, false), 0), self.l[i][0]);
        let c = keep * old - m * push;
        [old + sweep.relax * (c - old), sweep.relax * m * scale]
    }

    /// Solves the normal row of point `i`.
    pub fn normal_row<R: GapRule>(&mut self, i: usize, sweep: &ScalarSweep<R>) {
        let rows = self.rows(i, sweep.turned);
        let [c, s] = self.normal_line(i, sweep);
        // NaN stays NaN, so that divergence is detected.
        let new = positive(c - s * self.speed(&rows, 0));
        self.set(i, 0, &rows, new);
    }

    /// Solves the friction row of point `i`.
    pub fn friction_row<R>(&mut self, i: usize, sweep: &ScalarSweep<R>) {
        let bound = self.problem.contacts[i].friction * self.l[i][0];
        if bound == 0.0 && self.l[i][1] == 0.0 {
            return;
        }
        let (rows, m) = (self.rows(i, sweep.turned), self.mass(&self.rows(i, false), 1));
        let new = clamp(self.l[i][1] - sweep.relax * m * self.speed(&rows, 1), bound);
        self.set(i, 1, &rows, new);
    }

    /// Solves the rows of one manifold.
    pub fn contact<R: GapRule>(&mut self, m: Range<usize>, sweep: &ScalarSweep<R>) {
        let mut both = [m.start, m.end - 1];
        let points = &mut both[..m.len()];
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
                (true, Some(singular)) => self.block(points, sweep, singular),
                (true, None) => points.iter().for_each(|&i| self.normal_row(i, sweep)),
                (false, _) if sweep.friction => points.iter().for_each(|&i| self.friction_row(i, sweep)),
                (false, _) => {}
            }
        }
    }

    /// Solves both normal rows together: takes the one of four cases in which no impulse is negative and no
    /// point approaches.
    fn block<R: GapRule>(&mut self, points: &[usize], sweep: &ScalarSweep<R>, singular: f64) {
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
    fn cone<R: GapRule>(&mut self, i: usize, sweep: &ScalarSweep<R>) {
        let rows = self.rows(i, false);
        let Line { push, .. } = sweep.rule.line(self, i);
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

    /// Gauss–Seidel over manifolds in the given order.
    pub fn sweep_in<R: GapRule>(&mut self, sweep: &ScalarSweep<R>, order: impl Iterator<Item = usize>) {
        order.for_each(|m| self.contact(self.manifolds[m].clone(), sweep));
    }

    /// Gauss–Seidel over all joints, then all manifolds; reversed, from last to first.
    pub fn sweep<R: GapRule>(&mut self, sweep: &ScalarSweep<R>) {
        if sweep.reversed {
            self.sweep_in(sweep, (0..self.manifolds.len()).rev());
            (0..self.lines.len()).rev().for_each(|line| self.joint(line));
        } else {
            (0..self.lines.len()).for_each(|line| self.joint(line));
            self.sweep_in(sweep, 0..self.manifolds.len());
        }
    }

    fn joint(&mut self, line: usize) {
        let line = &self.lines[line];
        let old = line.read(&self.l);
        let new = line.solution(line.velocity(&self.v), old);
        line.apply(self.problem, [0, 1, 2].map(|i| new[i] - old[i]), &mut self.v);
        line.write(new, &mut self.l);
    }

    /// Solves all manifolds from the same velocities. With `split`, each body is split into as many copies as
    /// it has manifolds, each with an equal part of its mass; its new velocity is the mean of the copies.
    /// With `by_rows`, each row of a manifold is solved from the same velocities too, and rows are counted
    /// instead of manifolds. Blocks of joints count as their rows.
    ///
    /// Whole masses diverge where λ_max(D⁻¹G) > 2. A copy with 1/n of the mass sees n times the inverse mass,
    /// and averaging divides the effect of its impulse by n again: Jacobi with D_i = ∑_sides n J_i M⁻¹ J_iᵀ.
    /// Since (∑ᵢ xᵢ)² ≤ n ∑ xᵢ² on every body, D ≥ G, so it converges (Tonge et al. 2012).
    pub fn jacobi<R: GapRule>(&mut self, sweep: &ScalarSweep<R>, split: bool, by_rows: bool) {
        let mut copies = vec![0.0; self.v.len()];
        for m in &self.manifolds {
            let rows = |c: &super::ProblemContact| if c.friction > 0.0 { 2.0 } else { 1.0 };
            let count = if by_rows { self.problem.contacts[m.clone()].iter().map(rows).sum() } else { 1.0 };
            self.problem.contacts[m.start].sides().for_each(|(b, _)| copies[b] += count);
        }
        for line in &self.lines {
            line.sides.iter().for_each(|(b, _)| copies[*b] += line.size as f64);
        }
        let (inverse, before) = (self.inverse.clone(), self.v.clone());
        let mut lines = self.lines.clone();
        if split {
            self.inverse.iter_mut().zip(&copies).for_each(|(m, &n)| *m = m.map(|m| m * f64::max(n, 1.0)));
            lines.iter_mut().for_each(|line| line.split(self.problem, &copies));
        }
        let mut sum = vec![[0.0; 3]; self.v.len()];
        let mut add = |oracle: &mut Self, m: &Range<usize>| {
            for (b, _) in oracle.problem.contacts[m.start].sides() {
                (0..3).for_each(|k| sum[b][k] += oracle.v[b][k] - before[b][k]);
                oracle.v[b] = before[b];
            }
        };
        for m in self.manifolds.clone() {
            if by_rows {
                for i in m.clone() {
                    self.normal_row(i, sweep);
                    add(self, &m);
                    self.friction_row(i, sweep);
                    add(self, &m);
                }
            } else {
                self.contact(m.clone(), sweep);
                add(self, &m);
            }
        }
        self.inverse = inverse;
        for ((v, sum), n) in self.v.iter_mut().zip(&sum).zip(&copies) {
            let share = if split { 1.0 / f64::max(*n, 1.0) } else { 1.0 };
            (0..3).for_each(|k| v[k] += share * sum[k]);
        }
        for line in &lines {
            let old = line.read(&self.l);
            let new = line.solution(line.velocity(&before), old);
            line.apply(self.problem, [0, 1, 2].map(|i| new[i] - old[i]), &mut self.v);
            line.write(new, &mut self.l);
        }
    }
}
