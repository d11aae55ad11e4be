//! The convex problem in the velocities of the bodies, and Newton's method on it. In `f64`, one lane.
//!
//! ```text
//! ℓ(v) = ½ (v − v*)ᵀ M (v − v*) + Σ ½ γᵀ R γ,   γ(v) = the impulse within bounds that is nearest to y in the norm of R
//! y = R⁻¹ (v̂ − J v),   ∇ℓ = M (v − v*) − Jᵀ γ,   H = M + Σ Jᵀ G J,   G = −∂γ/∂(J v)
//! ```
//!
//! ℓ is strictly convex and once differentiable: γ is continuous. With e = v̂ − J v of a contact,
//! R = diag(R_n, R_t), s = sign(e_t) and w = (1, µ s),
//!
//! ```text
//! sticks  |y_t| ≤ µ y_n, y_n ≥ 0        γ = y                              G = R⁻¹
//! slides  e_n + µ |e_t| > 0 otherwise   γ = w (w·e)/(R_n + µ² R_t)         G = w wᵀ/(R_n + µ² R_t)
//! open    else                          γ = 0                              G = 0
//! ```
//!
//! since the point of an edge nearest to y is w (wᵀ R y)/(wᵀ R w). Rows of joints are free, or have
//! γ ≥ 0, or |γ| ≤ c:
//!
//! ```text
//! |y| > c     γ = B e,   B = (R + η 1)⁻¹ with |B e| = c     G = B − B γ γᵀ B/(γᵀ B γ)
//! ```
//!
//! In the plane, γ of a contact is piecewise linear. If no block has the bound |γ| ≤ c, ∇ℓ is piecewise
//! linear as well, and Newton's method ends after finitely many steps.

use crate::constraints::System;
use crate::constraints::kernels::velocity::rules::{Baumgarte, NormalRule, Softness};
use crate::constraints::numerics::cone;
use crate::constraints::numerics::envelope::{Couplings, Envelope};
use crate::constraints::records::rows::{RowBlock, RowLaw};
use crate::constraints::vectors::blocks::JointBlocks;
use crate::constraints::vectors::system::{Pair, PointRows};
use crate::lanes::BodyRow;

/// A block of three rows and columns.
type Block3 = [[f64; 3]; 3];

/// Norm of the gradient, relative to that of momenta and impulses, at which the problem counts as solved.
/// Below the resolution of f32.
const TOLERANCE: f64 = 1e-9;
/// Maximum number of iterations in a line search and in the search for η.
const TRIALS: usize = 30;
/// Slope at the end of a line search, relative to that at its start.
const FLAT: f64 = 1e-8;
/// R ÷ J M⁻¹ Jᵀ of rigid joint rows.
const RIGID: f64 = 1e-8;
/// Maximum number of conjugate-gradient iterations per Newton step, and the relative residual at which
/// they end.
const INNER: usize = 200;
const INNER_TOLERANCE: f64 = 1e-4;

/// Number of a body that does not move.
const FIXED: usize = usize::MAX;

/// A moving body.
#[derive(Clone, Copy, Debug)]
struct MovingBody {
    row: usize,
    /// Mass, mass, inertia; 1 if infinite.
    mass: [f64; 3],
    /// v*
    free: [f64; 3],
}

/// Bound on γ.
#[derive(Clone, Copy, Debug, Default)]
enum ImpulseBound {
    /// |γ_t| ≤ µ γ_n; R is diagonal.
    Cone(f64),
    #[default]
    Free,
    NotNegative,
    Norm(f64),
}

/// Up to three rows with one bound.
#[derive(Clone, Copy, Debug, Default)]
struct ConvexBlock {
    bodies: [usize; 2],
    size: usize,
    /// J of bodies a and b.
    jacobian: [Block3; 2],
    /// v̂, less the velocity of fixed bodies along the rows.
    target: [f64; 3],
    softness: Block3,
    /// R⁻¹
    inverse: Block3,
    bound: ImpulseBound,
    /// Current e, γ and G.
    error: [f64; 3],
    impulse: [f64; 3],
    stiffness: Block3,
}

/// State of Newton's method.
#[derive(Debug, Default)]
pub struct Convex {
    bodies: Vec<MovingBody>,
    /// Blocks of contact points, then of joints.
    blocks: Vec<ConvexBlock>,
    /// Indices of the points in vectors.
    places: Vec<usize>,
    joints: JointBlocks,
    velocities: Vec<[f64; 3]>,
    gradient: Vec<[f64; 3]>,
    direction: Vec<[f64; 3]>,
    /// J times the direction, per block.
    change: Vec<[f64; 3]>,
    matrix: Envelope,
    /// Whether the pattern of the matrix is set.
    is_coupled: bool,
    most_work: f64,
    pub is_solved: bool,
    /// Norm of the gradient, relative to that of momenta and impulses.
    pub residual: f64,
}

fn dot(x: [f64; 3], y: [f64; 3]) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

fn times(m: &Block3, x: [f64; 3]) -> [f64; 3] {
    m.map(|row| dot(row, x))
}

/// The inverse of a symmetric positive definite block of `size` rows. Other rows are zero.
fn inverse(m: &Block3, size: usize) -> Block3 {
    let (mut m, mut to) = (*m, [[0.0; 3]; 3]);
    (0..size).for_each(|i| to[i][i] = 1.0);
    for j in 0..size {
        let pivot = 1.0 / m[j][j];
        (0..3).for_each(|c| (m[j][c], to[j][c]) = (m[j][c] * pivot, to[j][c] * pivot));
        for i in (0..size).filter(|&i| i != j) {
            let factor = m[i][j];
            (0..3).for_each(|c| {
                m[i][c] -= factor * m[j][c];
                to[i][c] -= factor * to[j][c];
            });
        }
    }
    to
}

impl ConvexBlock {
    /// γ and G for an error e.
    fn at(&self, e: [f64; 3]) -> ([f64; 3], Block3) {
        let y = times(&self.inverse, e);
        let sticks = (y, self.inverse);
        let open = ([0.0; 3], [[0.0; 3]; 3]);
        match self.bound {
            ImpulseBound::Free => sticks,
            ImpulseBound::NotNegative => {
                if y[0] > 0.0 {
                    sticks
                } else {
                    open
                }
            }
            ImpulseBound::Cone(friction) => {
                // The edge sticks, and so does y = 0: contacts of a stack at rest are then all in the first
                // factorization. As open ones they would close one level per step.
                if y[0] >= 0.0 && y[1].abs() <= friction * y[0] {
                    return sticks;
                }
                let w = [1.0, friction.copysign(e[1]), 0.0];
                let along = dot(w, e) / (self.softness[0][0] + friction * friction * self.softness[1][1]);
                if along <= 0.0 {
                    return open;
                }
                let each = 1.0 / (self.softness[0][0] + friction * friction * self.softness[1][1]);
                (w.map(|w| w * along), w.map(|a| w.map(|b| each * a * b)))
            }
            ImpulseBound::Norm(cap) => {
                let mut norm = dot(y, y).sqrt();
                if norm <= cap {
                    return sticks;
                }
                if cap <= 0.0 {
                    return open;
                }
                // |B e| falls and is convex as η grows, so Newton's method on 1/|B e| = 1/c does not
                // overshoot.
                let (mut shift, mut b, mut impulse) = (0.0, self.inverse, y);
                for _ in 0..TRIALS {
                    let bent = dot(impulse, times(&b, impulse));
                    shift += (norm - cap) / cap * norm * norm / bent;
                    let mut shifted = self.softness;
                    (0..self.size).for_each(|i| shifted[i][i] += shift);
                    b = inverse(&shifted, self.size);
                    impulse = times(&b, e);
                    norm = dot(impulse, impulse).sqrt();
                    if (norm - cap).abs() <= 1e-12 * cap {
                        break;
                    }
                }
                let bent = times(&b, impulse);
                let across = dot(impulse, bent);
                let mut g = b;
                for r in 0..3 {
                    (0..3).for_each(|c| g[r][c] -= bent[r] * bent[c] / across);
                }
                (impulse, g)
            }
        }
    }

    /// J v of moving bodies.
    fn speed(&self, v: &[[f64; 3]]) -> [f64; 3] {
        let of = |side: usize| match v.get(self.bodies[side]) {
            Some(&v) => times(&self.jacobian[side], v),
            None => [0.0; 3],
        };
        let (a, b) = (of(0), of(1));
        [0, 1, 2].map(|r| a[r] + b[r])
    }

    /// to ← to + factor Jᵀ x.
    fn push(&self, x: [f64; 3], factor: f64, to: &mut [[f64; 3]]) {
        for side in 0..2 {
            let Some(to) = to.get_mut(self.bodies[side]) else { continue };
            for (row, x) in self.jacobian[side].iter().zip(x) {
                (0..3).for_each(|c| to[c] += factor * row[c] * x);
            }
        }
    }

    /// J_rowᵀ G J_column, where `row` and `column` are sides of the block.
    fn curvature(&self, [row, column]: [usize; 2]) -> Block3 {
        let of = |entry: &dyn Fn(usize, usize, usize) -> f64| -> Block3 {
            let sum = |r, c| (0..self.size).map(|k| entry(r, c, k)).sum();
            [0, 1, 2].map(|r| [0, 1, 2].map(|c| sum(r, c)))
        };
        let half = of(&|r, c, k| self.stiffness[r][k] * self.jacobian[column][k][c]);
        of(&|r, c, k| self.jacobian[row][k][r] * half[k][c])
    }

    /// Pairs of sides for which the block contributes to H, each once.
    fn couplings(&self) -> impl Iterator<Item = [usize; 2]> {
        let moves = self.bodies.map(|body| body != FIXED);
        let has = move |[row, column]: &[usize; 2]| moves[*row] && moves[*column];
        [[0, 0], [1, 1], [0, 1]].into_iter().filter(has)
    }
}

impl Convex {
    /// The problem of a step, in which the bodies have the velocities v* now. `softness` is R ÷ J M⁻¹ Jᵀ
    /// of contacts along n and t. Factorizations take at most `most_work` multiplications.
    pub fn new(
        system: &mut System<'_>,
        rule: &Baumgarte,
        softness: [f64; 2],
        h: f32,
        most_work: f64,
    ) -> Self {
        let mut problem = Convex { most_work, ..Convex::default() };
        let mut numbers = Vec::new();
        for (row, body) in system.rows().iter().enumerate() {
            let inverse = [body.velocity[3], body.velocity[3], body.delta[3]].map(f64::from);
            let moves = inverse.iter().any(|&i| i > 0.0);
            numbers.push(if moves { problem.bodies.len() } else { FIXED });
            if moves {
                let mass = inverse.map(|i| if i > 0.0 { 1.0 / i } else { 1.0 });
                let free = [0, 1, 2].map(|k| f64::from(body.velocity[k]));
                problem.bodies.push(MovingBody { row, mass, free });
            }
        }
        let mut surfaces = Vec::new();
        system.gaps_and_friction(&mut surfaces);
        let points: Vec<PointRows> = system.point_rows().collect();
        for point in &points {
            let [gap, friction] = surfaces[point.at];
            let jacobian = [0, 1].map(|side| [point.on(side, 0), point.on(side, 1), [0.0; 3]]);
            let target = [-f64::from(rule.bias(gap)), 0.0, 0.0];
            let bound = ImpulseBound::Cone(f64::from(friction));
            let mut block =
                problem.placed(system.rows(), &numbers, (point.bodies, 2), jacobian, target, bound);
            let response = [0, 1].map(|r| {
                let of = |side: usize| {
                    problem.bodies.get(block.bodies[side]).map_or(0.0, |body| {
                        (0..3).map(|c| block.jacobian[side][r][c].powi(2) / body.mass[c]).sum::<f64>()
                    })
                };
                of(0) + of(1)
            });
            // A row that moves no body has no impulse.
            for (r, k) in response.into_iter().enumerate() {
                block.softness[r][r] = if k > 0.0 { softness[r] * k } else { f64::MAX.sqrt() };
                block.inverse[r][r] = 1.0 / block.softness[r][r];
            }
            problem.places.push(point.at);
            problem.blocks.push(block);
        }
        if system.has_joints() {
            problem.joints = system.joint_blocks();
            for k in 0..problem.joints.blocks.len() {
                let block = problem.joints.blocks[k];
                let block = problem.of_joint(system.rows(), &numbers, &block, rule.of_errors(), h);
                problem.blocks.push(block);
            }
        }
        problem
    }

    /// A block with Jacobian J. Components that cannot move are removed from J; their velocities are
    /// subtracted from the target.
    fn placed(
        &self,
        rows: &[BodyRow],
        numbers: &[usize],
        (bodies, size): ([u32; 2], usize),
        mut jacobian: [Block3; 2],
        mut target: [f64; 3],
        bound: ImpulseBound,
    ) -> ConvexBlock {
        let moving = bodies.map(|body| numbers.get(body as usize).copied().unwrap_or(FIXED));
        for side in 0..2 {
            let Some(row) = rows.get(bodies[side] as usize) else { continue };
            let inverse = [row.velocity[3], row.velocity[3], row.delta[3]];
            for r in 0..size {
                for c in (0..3).filter(|&c| inverse[c] <= 0.0) {
                    target[r] -= jacobian[side][r][c] * f64::from(row.velocity[c]);
                    jacobian[side][r][c] = 0.0;
                }
            }
        }
        ConvexBlock { bodies: moving, size, jacobian, target, bound, ..ConvexBlock::default() }
    }

    /// The block of a joint. R is K/D for a spring and a small multiple of K for a rigid row.
    fn of_joint(
        &self,
        rows: &[BodyRow],
        numbers: &[usize],
        joint: &RowBlock,
        rigid: Softness,
        h: f32,
    ) -> ConvexBlock {
        let mut jacobian = [[[0.0; 3]; 3]; 2];
        for (side, to) in jacobian.iter_mut().enumerate() {
            (0..joint.size).for_each(|r| to[r] = joint.on(side, r));
        }
        let bound = match (joint.law, joint.cap()) {
            (RowLaw::Limit, _) => ImpulseBound::NotNegative,
            (_, Some(cap)) => ImpulseBound::Norm(f64::from(cap)),
            _ => ImpulseBound::Free,
        };
        let target = joint.bias(rigid, h).map(|b| -f64::from(b));
        let mut block = self.placed(rows, numbers, (joint.bodies, joint.size), jacobian, target, bound);
        let scale = f64::from(joint.softness()).max(RIGID);
        let largest = (0..joint.size).map(|r| f64::from(joint.response[r][r])).fold(0.0, f64::max);
        for r in 0..joint.size {
            for c in 0..joint.size {
                block.softness[r][c] = scale * f64::from(joint.response[r][c]);
            }
            // K of equal rows is singular. Rows of lengths and of angles differ in units, so each
            // diagonal entry is raised by a fraction of itself.
            let own = f64::from(joint.response[r][r]);
            block.softness[r][r] += 1e-6 * scale * if own > 0.0 { own } else { largest };
        }
        if largest > 0.0 {
            block.inverse = inverse(&block.softness, joint.size);
        }
        block
    }

    /// Starts from these velocities of all rows.
    pub fn begin(&mut self, velocities: &[[f32; 3]]) {
        self.velocities = self.bodies.iter().map(|body| velocities[body.row].map(f64::from)).collect();
        self.gradient = vec![[0.0; 3]; self.bodies.len()];
        self.direction.clone_from(&self.gradient);
        self.change = vec![[0.0; 3]; self.blocks.len()];
        self.evaluate();
    }

    /// γ, G and the gradient at v.
    fn evaluate(&mut self) {
        // Squared norms of M v and Jᵀ γ, weighted by M⁻¹.
        let (mut momentum, mut pushed) = (0.0, 0.0);
        self.gradient.iter_mut().for_each(|g| *g = [0.0; 3]);
        for block in &mut self.blocks {
            let speed = block.speed(&self.velocities);
            block.error = [0, 1, 2].map(|r| block.target[r] - speed[r]);
            (block.impulse, block.stiffness) = block.at(block.error);
            block.push(block.impulse, -1.0, &mut self.gradient);
        }
        let mut square = 0.0;
        for ((g, v), body) in self.gradient.iter_mut().zip(&self.velocities).zip(&self.bodies) {
            for c in 0..3 {
                pushed += g[c] * g[c] / body.mass[c];
                momentum += v[c] * v[c] * body.mass[c];
                g[c] += body.mass[c] * (v[c] - body.free[c]);
                square += g[c] * g[c] / body.mass[c];
            }
        }
        let scale = f64::max(momentum, pushed);
        // At rest without impulses there is nothing to compare with: such a start is solved only if it is exact.
        self.residual = if square > 0.0 { (square / scale).sqrt() } else { 0.0 };
        self.is_solved |= self.residual <= TOLERANCE;
    }

    /// One Newton step with an exact line search. Returns `false` if the problem was already solved.
    pub fn step(&mut self) -> bool {
        if self.is_solved {
            return false;
        }
        if !self.is_coupled {
            self.couple();
        }
        let by_factor = self.matrix.work() <= self.most_work;
        self.direction.iter_mut().zip(&self.gradient).for_each(|(d, g)| *d = g.map(|g| -g));
        if !(by_factor && self.by_factor()) {
            self.by_gradients();
        }
        for (change, block) in self.change.iter_mut().zip(&self.blocks) {
            *change = block.speed(&self.direction);
        }
        let s = self.length();
        for (v, d) in self.velocities.iter_mut().zip(&self.direction) {
            (0..3).for_each(|c| v[c] += s * d[c]);
        }
        // Because of rounding, no step lowers ℓ any further.
        self.is_solved = !(s > 0.0 && s.is_finite());
        self.evaluate();
        true
    }

    /// Sets the pattern of H.
    fn couple(&mut self) {
        let mut couplings = Couplings::default();
        let pairs = self.blocks.iter().map(|block| block.bodies).filter(|pair| !pair.contains(&FIXED));
        couplings.begin(self.bodies.len(), pairs);
        self.matrix.begin::<3, _>(self.bodies.len(), |i| couplings.of(i));
        self.is_coupled = true;
    }

    /// Replaces −∇ℓ by −H⁻¹ ∇ℓ. Returns `false` if rounding makes H indefinite.
    fn by_factor(&mut self) -> bool {
        self.matrix.clear();
        for (i, body) in self.bodies.iter().enumerate() {
            let [x, y, turn] = body.mass;
            self.matrix.add_block(i, i, [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, turn]]);
        }
        for block in &self.blocks {
            for sides in block.couplings() {
                let [row, column] = sides.map(|side| block.bodies[side]);
                self.matrix.add_block(row, column, block.curvature(sides));
            }
        }
        if !self.matrix.factorize(f64::MIN_POSITIVE) {
            return false;
        }
        self.matrix.substitute(self.direction.as_flattened_mut());
        true
    }

    /// The same by conjugate gradients, preconditioned by the diagonal blocks of H.
    fn by_gradients(&mut self) {
        let mut diagonal: Vec<Block3> = Vec::new();
        for MovingBody { mass: [x, y, turn], .. } in &self.bodies {
            diagonal.push([[*x, 0.0, 0.0], [0.0, *y, 0.0], [0.0, 0.0, *turn]]);
        }
        for block in &self.blocks {
            for sides in block.couplings().filter(|[row, column]| row == column) {
                let more = block.curvature(sides);
                for (to, more) in
                    diagonal[block.bodies[sides[0]]].iter_mut().flatten().zip(more.iter().flatten())
                {
                    *to += more;
                }
            }
        }
        diagonal.iter_mut().for_each(|block| *block = inverse(block, 3));
        let preconditioned = |r: &[[f64; 3]]| -> Vec<[f64; 3]> {
            r.iter().zip(&diagonal).map(|(r, block)| times(block, *r)).collect()
        };
        let product = |x: &[[f64; 3]], y: &[[f64; 3]]| x.iter().zip(y).map(|(x, y)| dot(*x, *y)).sum::<f64>();
        let mut residual = self.direction.clone();
        let mut found = vec![[0.0; 3]; residual.len()];
        let mut z = preconditioned(&residual);
        let mut along = z.clone();
        let mut square = product(&residual, &z);
        let goal = INNER_TOLERANCE * INNER_TOLERANCE * square;
        for _ in 0..INNER {
            if square <= goal {
                break;
            }
            let mut image: Vec<[f64; 3]> = along
                .iter()
                .zip(&self.bodies)
                .map(|(p, body)| [0, 1, 2].map(|c| body.mass[c] * p[c]))
                .collect();
            for block in &self.blocks {
                block.push(times(&block.stiffness, block.speed(&along)), 1.0, &mut image);
            }
            let length = square / product(&along, &image);
            for i in 0..found.len() {
                (0..3).for_each(|c| {
                    found[i][c] += length * along[i][c];
                    residual[i][c] -= length * image[i][c];
                });
            }
            z = preconditioned(&residual);
            let next = product(&residual, &z);
            let beta = next / std::mem::replace(&mut square, next);
            along.iter_mut().zip(&z).for_each(|(p, z)| (0..3).for_each(|c| p[c] = z[c] + beta * p[c]));
        }
        self.direction = found;
    }

    /// Step length along the direction: the zero of the slope of ℓ, found by Newton's method within a
    /// bracket.
    ///
    /// ```text
    /// ℓ'(s) = dᵀ M (v − v*) + s dᵀ M d − Σ γ(e − s J d)·J d,   ℓ''(s) = dᵀ M d + Σ (J d)ᵀ G J d
    /// ```
    fn length(&self) -> f64 {
        let (mut begin, mut inertia) = (0.0, 0.0);
        for ((d, v), body) in self.direction.iter().zip(&self.velocities).zip(&self.bodies) {
            for c in 0..3 {
                begin += d[c] * body.mass[c] * (v[c] - body.free[c]);
                inertia += d[c] * body.mass[c] * d[c];
            }
        }
        let slope = |s: f64| {
            let (mut slope, mut curve) = (begin + s * inertia, inertia);
            for (block, &change) in self.blocks.iter().zip(&self.change) {
                let (impulse, stiffness) = block.at([0, 1, 2].map(|r| block.error[r] - s * change[r]));
                slope -= dot(impulse, change);
                curve += dot(change, times(&stiffness, change));
            }
            [slope, curve]
        };
        let flat = FLAT * slope(0.0)[0].abs();
        let (mut least, mut greatest, mut s) = (0.0, f64::INFINITY, 1.0);
        for _ in 0..TRIALS {
            let [slope, curve] = slope(s);
            if slope.abs() <= flat {
                break;
            }
            if slope < 0.0 {
                least = s
            } else {
                greatest = s
            }
            s -= slope / curve;
            if !(s > least && s < greatest) {
                s = if greatest.is_finite() { 0.5 * (least + greatest) } else { 2.0 * least };
            }
        }
        s
    }

    /// Writes velocities and impulses to the system.
    pub fn write(&mut self, system: &mut System<'_>) {
        for (v, body) in self.velocities.iter().zip(&self.bodies) {
            let to = &mut system.rows()[body.row].velocity;
            v.iter().zip(to).for_each(|(v, to)| *to = *v as f32);
        }
        let mut impulses: Vec<Pair> = vec![[0.0; 2]; system.len()];
        for (&at, block) in self.places.iter().zip(&self.blocks) {
            let ImpulseBound::Cone(friction) = block.bound else { continue };
            let normal = (block.impulse[0] as f32).max(0.0);
            impulses[at] = [normal, cone::friction(block.impulse[1] as f32, friction as f32 * normal)];
        }
        system.set_impulses(&impulses);
        if !self.joints.blocks.is_empty() {
            let found = &self.blocks[self.places.len()..];
            for (joint, block) in self.joints.blocks.iter_mut().zip(found) {
                for r in (0..joint.size).filter(|_| block.inverse[0][0] > 0.0) {
                    joint.impulses[r] = block.impulse[r] as f32;
                }
            }
            system.set_joint_impulses(&self.joints);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The impulse is the gradient of a convex function: it is monotone, and G is its derivative.
    #[test]
    fn impulses_are_monotone_and_have_the_stated_derivative() {
        let softness = [[2.0, 0.3, 0.0], [0.3, 1.0, 0.1], [0.0, 0.1, 1.5]];
        let diagonal = [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0; 3]];
        let bounds = [
            (ImpulseBound::Cone(0.6), 2, diagonal),
            (ImpulseBound::Cone(0.0), 2, diagonal),
            (ImpulseBound::Free, 3, softness),
            (ImpulseBound::NotNegative, 1, [[2.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]),
            (ImpulseBound::Norm(0.7), 3, softness),
        ];
        for (bound, size, softness) in bounds {
            let inverse = inverse(&softness, size);
            let block = ConvexBlock { size, softness, inverse, bound, ..ConvexBlock::default() };
            // None of these is the apex of a cone, which has no derivative.
            let errors: Vec<[f64; 3]> = (1..60)
                .map(|i| {
                    [0, 1, 2]
                        .map(|k| if k < size { (1.7 * f64::from(i * (k as i32 + 2))).sin() } else { 0.0 })
                })
                .collect();
            for e in &errors {
                let (impulse, stiffness) = block.at(*e);
                for other in &errors {
                    let (d, change) = ([0, 1, 2].map(|k| other[k] - e[k]), block.at(*other).0);
                    let change = [0, 1, 2].map(|k| change[k] - impulse[k]);
                    assert!(dot(d, change) >= -1e-12, "{bound:?} {e:?} {other:?}");
                    let near = [0, 1, 2].map(|k| e[k] + 1e-7 * d[k]);
                    let (moved, linear) = (block.at(near).0, times(&stiffness, d));
                    for k in 0..size {
                        let slope = (moved[k] - impulse[k]) / 1e-7;
                        assert!((slope - linear[k]).abs() < 1e-4, "{bound:?} {e:?}: {slope} {}", linear[k]);
                    }
                }
            }
        }
    }
}
