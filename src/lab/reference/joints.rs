//! Joints of a problem: rows in blocks, the law of a block, and the residual of impulses.
//!
//! # Rows
//!
//! A row has the error C (m or rad) and the Jacobian J of its rate, as defined in
//! `engine::constraints::joints::rows`:
//!
//! ```text
//! J v = d·(v_b − v_a) + s_b ω_b − s_a ω_a
//! ```
//!
//! Rows of a block are solved together, K = J M⁻¹ Jᵀ. Vectors of impulses start with the pairs (λn, λt) of
//! contacts, followed by a pair (λ, 0) for every row.
//!
//! # Laws
//!
//! Over a step of h, with v⁺ at its end:
//!
//! ```text
//! rigid    J v⁺ = 0                             an error that is there stays, as overlap does
//! limit    0 ≤ λ ⊥ J v⁺ + max(C, 0)/h ≥ 0       may close within the step, and no more
//! motor    λ = Π(λ − ρ (J v⁺ − u)),  |λ| ≤ F h
//! spring   λ = Π(−K⁻¹ (S C + D J v⁺)),  |λ| ≤ F h where it is bounded
//! ```
//!
//! Π is the projection onto the bounds: the nearest impulse whose norm over the block is within the cap. For
//! a single row all laws have the form J v + b + R λ = 0 on the box [lo, hi], with b = max(C, 0)/h, −u or
//! (S/D) C, and R = K/D for springs.
//!
//! # Residual
//!
//! Every law is the fixed point of a line,
//!
//! ```text
//! λ = Π(y),   y = α λ − K⁻¹ (c + q J v⁺)
//!
//! rigid, limit   α = q = 1/(1 + σ)   c = b/(1 + σ)      σ K: softness of a solver's own law; 0 of the rigid law
//! motor          α = q = 1           c = −u
//! spring         α = q = D/(1 + D)   c = S C/(1 + D)
//! ```
//!
//! This line is the exact solution of the block alone. The residual r = λ − Π(y) is therefore the natural map
//! with ρ = 1/(K + R) of the block: the change that one exact sweep over it would make, as for contacts. For
//! the spring, the fixed point inside the bounds is (1 − α) λ = −K⁻¹ (c + q J v), the law times 1/(1 + D). On
//! the bound, y = (D λ + f)/(1 + D) with f = −K⁻¹(S C + D J v). y points along λ and is no shorter than λ
//! exactly if the same holds for f, so λ = Π(f).
//!
//! The residual of an angular row is an angular impulse L. It counts as the impulse P through the centers of
//! mass that has the same energy, K L²/2 = (1/m_a + 1/m_b) P²/2. All rows are therefore in N·s.

use super::problem::{ContactProblem, DPair, Target, Velocity, dot};
pub use super::rows::{
    BlockLaw, LawLine, ProblemBlock, ProblemJoint, ProblemRow, ROWS, RowVector, row_scale,
};
use super::rows::{OwnRow, inverted};

/// A block with all data that does not depend on impulses.
#[derive(Clone, Debug)]
pub(super) struct BlockLine {
    line: LawLine,
    /// Index of its first row in vectors of impulses.
    pub first: usize,
    /// Non-static bodies with their part of J, sign included.
    pub sides: Vec<(usize, [Velocity; ROWS])>,
    /// Factors from impulses to N·s (1, or 1/m for angular rows).
    pub scale: RowVector,
}

impl std::ops::Deref for BlockLine {
    type Target = LawLine;

    fn deref(&self) -> &LawLine {
        &self.line
    }
}

impl BlockLine {
    fn new(
        problem: &ContactProblem,
        target: Target,
        joint: &ProblemJoint,
        block: &ProblemBlock,
        first: usize,
    ) -> Self {
        let sides = sides(joint, block);
        let response = response(problem, &sides);
        let (mut own, mut errors, mut scale) = ([OwnRow::default(); ROWS], [0.0; ROWS], [1.0; ROWS]);
        let through: f64 = sides.iter().map(|&(body, _)| problem.bodies[body].inv_mass).sum();
        for (i, row) in block.rows.iter().enumerate() {
            own[i] = match target {
                Target::Own(rows) => rows[first + i],
                Target::Rigid => OwnRow { bias: row.rigid_bias(block.law, problem.h), compliance: 0.0 },
            };
            errors[i] = row.error;
            scale[i] = row_scale(row.is_angular(), response[i][i], through);
        }
        let line = LawLine::new(block.law, block.rows.len(), errors, own, response);
        BlockLine { line, first, sides, scale }
    }

    /// J v (m/s or rad/s).
    pub fn velocity(&self, velocities: &[Velocity]) -> RowVector {
        let mut u = [0.0; ROWS];
        for (body, rows) in &self.sides {
            for (u, row) in u.iter_mut().zip(rows) {
                *u += dot(row, &velocities[*body]);
            }
        }
        u
    }

    /// Adds M⁻¹ Jᵀ `impulse` to the velocities.
    pub fn apply(&self, problem: &ContactProblem, impulse: RowVector, velocities: &mut [Velocity]) {
        apply(problem, &self.sides, impulse, velocities);
    }

    /// λ − Π(y) of every row (N·s); see the [module](self).
    pub fn residuals(&self, velocities: &[Velocity], impulses: &[DPair]) -> RowVector {
        let own = self.read(impulses);
        let exact = self.solution(self.velocity(velocities), own);
        [0, 1, 2].map(|i| self.scale[i] * (own[i] - exact[i]))
    }

    /// Its impulses, read from a vector.
    pub fn read(&self, impulses: &[DPair]) -> RowVector {
        read(impulses, self.first, self.size)
    }

    /// Writes its impulses into a vector.
    pub fn write(&self, own: RowVector, impulses: &mut [DPair]) {
        impulses[self.first..][..self.size].iter_mut().zip(own).for_each(|(pair, own)| pair[0] = own);
    }

    /// Applies mass splitting. Multiplies each body's part of J M⁻¹ Jᵀ by the body's `share`, which gives D
    /// for the response to its own impulses: P = (α D + (1 − α) K)⁻¹.
    pub fn split(&mut self, problem: &ContactProblem, share: &[f64]) {
        let mut d = [[0.0; ROWS]; ROWS];
        for side in &self.sides {
            let k = response(problem, std::slice::from_ref(side));
            (0..ROWS).for_each(|r| (0..ROWS).for_each(|c| d[r][c] += share[side.0] * k[r][c]));
        }
        for (d, k) in d.iter_mut().flatten().zip(self.response.iter().flatten()) {
            *d = self.alpha * *d + (1.0 - self.alpha) * k;
        }
        self.line.step = inverted(d, self.size).unwrap_or_default();
    }
}

/// Impulses of the `size` rows of a block from row `first`.
fn read(impulses: &[DPair], first: usize, size: usize) -> RowVector {
    [0, 1, 2].map(|i| if i < size { impulses[first + i][0] } else { 0.0 })
}

/// Non-static bodies with their part of J, sign included.
fn sides(joint: &ProblemJoint, block: &ProblemBlock) -> Vec<(usize, [Velocity; ROWS])> {
    let side = |body: Option<u32>, sign: f64, arm: fn(&ProblemRow) -> f64| {
        let mut rows = [[0.0; 3]; ROWS];
        for (to, row) in rows.iter_mut().zip(&block.rows) {
            *to = [row.axis[0], row.axis[1], arm(row)].map(|x| sign * x);
        }
        body.map(|body| (body as usize, rows))
    };
    let both = [side(joint.body_a, -1.0, |row| row.arm_a), side(joint.body_b, 1.0, |row| row.arm_b)];
    both.into_iter().flatten().collect()
}

/// K = J M⁻¹ Jᵀ.
fn response(problem: &ContactProblem, sides: &[(usize, [Velocity; ROWS])]) -> [RowVector; ROWS] {
    let mut k = [[0.0; ROWS]; ROWS];
    for (body, rows) in sides {
        let b = &problem.bodies[*body];
        for (r, k) in k.iter_mut().enumerate() {
            for (c, k) in k.iter_mut().enumerate() {
                let along = rows[r][0] * rows[c][0] + rows[r][1] * rows[c][1];
                *k += b.inv_mass * along + b.inv_inertia * rows[r][2] * rows[c][2];
            }
        }
    }
    k
}

fn apply(
    problem: &ContactProblem,
    sides: &[(usize, [Velocity; ROWS])],
    impulse: RowVector,
    velocities: &mut [Velocity],
) {
    for (body, rows) in sides {
        let inverse = problem.bodies[*body].inverse();
        for (row, impulse) in rows.iter().zip(impulse) {
            for k in 0..3 {
                velocities[*body][k] += inverse[k] * (row[k] * impulse);
            }
        }
    }
}

impl ContactProblem {
    /// Every block with its joint and the index of its first row in vectors of impulses.
    pub fn blocks(&self) -> impl Iterator<Item = (usize, &ProblemJoint, &ProblemBlock)> {
        let mut next = self.contacts.len();
        let blocks =
            self.joints.iter().flat_map(|joint| joint.blocks.iter().map(move |block| (joint, block)));
        blocks.map(move |(joint, block)| {
            let first = next;
            next += block.rows.len();
            (first, joint, block)
        })
    }

    /// Number of joint rows.
    pub fn joint_rows(&self) -> usize {
        self.joints.iter().map(|joint| joint.rows().count()).sum()
    }

    /// Length of vectors of impulses: one pair for every contact, then one for every joint row.
    pub fn unknowns(&self) -> usize {
        self.contacts.len() + self.joint_rows()
    }

    /// Impulses of a cold start.
    pub fn no_impulses(&self) -> Vec<DPair> {
        vec![[0.0; 2]; self.unknowns()]
    }

    /// Impulses of a warm start.
    pub fn warm_impulses(&self) -> Vec<DPair> {
        let joints = self.joints.iter().flat_map(ProblemJoint::rows).map(|row| [row.warm_impulse, 0.0]);
        self.contacts.iter().map(|c| c.warm_impulse).chain(joints).collect()
    }

    /// Replaces the impulses of a warm start.
    ///
    /// # Panics
    /// If there are not [`Self::unknowns`] of them.
    pub fn set_warm_impulses(&mut self, impulses: &[DPair]) {
        assert_eq!(impulses.len(), self.unknowns(), "a pair for every contact and every row");
        let (of_contacts, of_rows) = impulses.split_at(self.contacts.len());
        self.contacts.iter_mut().zip(of_contacts).for_each(|(c, &impulse)| c.warm_impulse = impulse);
        let rows =
            self.joints.iter_mut().flat_map(|joint| &mut joint.blocks).flat_map(|block| &mut block.rows);
        rows.zip(of_rows).for_each(|(row, impulse)| row.warm_impulse = impulse[0]);
    }

    /// The rigid law of every joint row.
    pub fn rigid_rows(&self) -> impl Iterator<Item = OwnRow> {
        self.blocks().flat_map(|(_, _, block)| {
            block.rows.iter().map(|row| OwnRow { bias: row.rigid_bias(block.law, self.h), compliance: 0.0 })
        })
    }

    /// The blocks under a law, with precomputed data.
    pub(super) fn lines(&self, target: Target) -> Vec<BlockLine> {
        self.blocks().map(|(first, joint, block)| BlockLine::new(self, target, joint, block, first)).collect()
    }

    /// Adds M⁻¹ Jᵀ λ of all joints to the velocities.
    pub(super) fn push_joints(&self, impulses: &[DPair], velocities: &mut [Velocity]) {
        for (first, joint, block) in self.blocks() {
            let own = read(impulses, first, block.rows.len());
            apply(self, &sides(joint, block), own, velocities);
        }
    }

    /// K of a block; see the [module](self).
    pub(super) fn block_response(&self, joint: &ProblemJoint, block: &ProblemBlock) -> [RowVector; ROWS] {
        response(self, &sides(joint, block))
    }

    /// Whether all joint impulses are bounded row by row. A problem without friction is then convex.
    pub(super) fn has_boxes_alone(&self) -> bool {
        self.blocks().all(|(_, _, block)| block.rows.len() == 1 || block.law.cap().is_none())
    }
}

/// Largest absolute impulse (N·s). Angular rows are scaled as in residuals.
pub(super) fn impulse_sizes(problem: &ContactProblem, impulses: &[DPair]) -> f64 {
    let contacts = impulses[..problem.contacts.len()].iter().flatten().fold(0.0, |m: f64, l| m.max(l.abs()));
    let lines = problem.lines(Target::Rigid);
    let rows =
        lines.iter().flat_map(|line| (0..line.size).map(|i| line.scale[i] * impulses[line.first + i][0]));
    rows.fold(contacts, |m, l| m.max(l.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::certify::{Uniqueness, reference};
    use crate::lab::reference::gallery::{machine, pendulum_rod};
    use crate::lab::reference::iterate::{Iteration, Stop, iterate};

    fn close(name: &str, found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-11, "{name}: {found} is not {expected}");
    }

    /// A body of 1 kg at (3, 4) m/s under two rows with a cap. The impulse opposes the motion. It has the
    /// size of the cap, or that of the spring's force if this is within the cap.
    #[test]
    fn a_cap_bounds_the_norm_of_a_block() {
        let mut p = pendulum_rod(0.0);
        (p.bodies[0].inv_inertia, p.bodies[0].free_velocity) = (0.0, [3.0, 4.0, 0.0]);
        let stop = Stop { tolerance: 1e-14, iterations: 4000 };
        let solve = |p: &ContactProblem| {
            iterate(p, Target::Rigid, &p.no_impulses(), Iteration::Forward, stop).impulses
        };
        p.joints[0].blocks[0].law = BlockLaw::Motor { speed: 0.0, cap: 2.5 };
        p.validate().unwrap();
        let l = solve(&p);
        // The speed is 5 m/s along (3, 4)/5.
        close("x", l[0][0], -1.5);
        close("y", l[1][0], -2.0);
        // λ = −D v⁺ = −D (v* + λ): −(3, 4)/2 with D = 1, of norm 2.5.
        for (cap, factor) in [(3.0, 0.5), (2.0, 0.4)] {
            p.joints[0].blocks[0].law = BlockLaw::Spring { stiffness: 7.0, damping: 1.0, cap: Some(cap) };
            let l = solve(&p);
            close("x", l[0][0], -3.0 * factor);
            close("y", l[1][0], -4.0 * factor);
            let r = reference(&p).unwrap();
            close("reference", r.impulses[0][0], -3.0 * factor);
            // The law is not a box, so uniqueness is agreed by two methods instead of proven.
            assert_eq!(r.certificate.uniqueness, Uniqueness::Agreed);
        }
    }

    /// r = λ − Π(y) by hand; for an angle as an impulse through the centers of mass.
    #[test]
    fn residuals_are_what_one_sweep_would_change() {
        let p = machine();
        let v = vec![[0.0; 3]; p.bodies.len()];
        let residuals = |l: &[DPair]| -> Vec<f64> {
            let lines = p.lines(Target::Rigid);
            lines.iter().flat_map(|line| line.residuals(&v, l).into_iter().take(line.size)).collect()
        };
        let r = residuals(&p.no_impulses());
        // The motor stands still: 0.01 N·m·s are missing, scaled by √(K m) = √2/m.
        close("motor", r[0], -0.01 * 2.0_f64.sqrt());
        // Unloaded hinges at rest, and the open limit.
        [1, 2, 3, 4, 5].iter().for_each(|&i| close("rest", r[i], 0.0));
        // Springs: (D λ + f)/(1 + D) with f = −S C.
        close("spring", r[6], -0.2 / 1.5);
        close("capped spring", r[7], 0.01);
        // A limit that pushes although it is open.
        let mut l = p.no_impulses();
        l[4][0] = 0.5;
        close("limit", residuals(&l)[3], 12.0_f64.sqrt() * (1e-4 / p.h / 12.0));
        l[4][0] = -0.5;
        close("pull", residuals(&l)[3], -0.5 * 12.0_f64.sqrt());
    }

    #[test]
    fn bad_joints_are_named() {
        type Spoil = fn(&mut ContactProblem);
        let spoils: [(Spoil, &str); 9] = [
            (|p| p.joints[0].body_b = Some(9), "joints[0]: names body 9 of 4"),
            (|p| p.joints[0].body_b = None, "joints[0]: both sides"),
            (|p| p.joints[1].blocks.clear(), "joints[1]: has 0 blocks"),
            (|p| p.joints[1].blocks[0].rows.clear(), "joints[1].blocks[0]: has 0 rows"),
            (
                |p| p.joints[1].blocks[1].rows[0].axis = [2.0, 0.0],
                "joints[1].blocks[1]: the axis has length 2",
            ),
            (|p| p.joints[1].blocks[1].law = BlockLaw::Limit, "joints[1].blocks[1]: a limit has 2 rows"),
            (|p| p.joints[0].blocks[0].rows[0].error = f64::NAN, "joints[0].blocks[0]: NaN"),
            (
                |p| p.joints[0].blocks[0].law = BlockLaw::Motor { speed: 1.0, cap: -1.0 },
                "joints[0].blocks[0]: cap is -1",
            ),
            (
                |p| p.joints[1].blocks[1].rows[1] = p.joints[1].blocks[1].rows[0],
                "joints[1].blocks[1]: its rows do not answer",
            ),
        ];
        for (spoil, message) in spoils {
            let mut p = machine();
            spoil(&mut p);
            let error = p.validate().unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }
}
