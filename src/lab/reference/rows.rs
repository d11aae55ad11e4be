//! Rows of joints, and the law of a block as a line; see [`super::joints`].

use crate::engine::constraints::numerics::coulomb_lcp::DPair;
use crate::engine::constraints::numerics::matrix::solve_in_place;
use crate::engine::constraints::records::rows::RowLaw;
use serde::{Deserialize, Serialize};

/// Maximum number of rows in a block.
pub const ROWS: usize = 3;
/// One number per row of a block; zero for absent rows.
pub type RowVector = [f64; ROWS];

/// A joint of a problem.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemJoint {
    /// Body a; `None` if that side is static.
    pub body_a: Option<u32>,
    /// Body b; `None` if that side is static.
    pub body_b: Option<u32>,
    /// Lengths of the arms from the centers of mass of a and b to the anchors (m).
    pub reach: DPair,
    /// Its blocks, in the order of solving.
    pub blocks: Vec<ProblemBlock>,
}

/// Joint rows that are solved together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemBlock {
    /// The law of all its rows.
    pub law: BlockLaw,
    /// One to three rows.
    pub rows: Vec<ProblemRow>,
}

/// The law of a block; see [`super::joints`].
pub type BlockLaw = RowLaw<f64>;

/// A row of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProblemRow {
    /// d: a unit vector, or zero for an angle.
    pub axis: [f64; 2],
    /// s_a: r_a × d (m), or 1 for an angle.
    pub arm_a: f64,
    /// s_b: the same for b.
    pub arm_b: f64,
    /// C at the start of the step (m or rad).
    pub error: f64,
    /// Initial impulse of a warm-started solver (N·s or N·m·s).
    pub warm_impulse: f64,
}

impl ProblemRow {
    /// Whether the row constrains an angle.
    pub fn is_angular(&self) -> bool {
        self.axis == [0.0; 2]
    }
}

impl ProblemJoint {
    /// Rows of all its blocks.
    pub fn rows(&self) -> impl Iterator<Item = &ProblemRow> {
        self.blocks.iter().flat_map(|block| &block.rows)
    }

    /// A revolute joint with coinciding anchors: `r` from the centers of mass to the point (m).
    pub fn revolute(bodies: [Option<u32>; 2], r: [[f64; 2]; 2]) -> Self {
        let arm = |k: usize, d: [f64; 2]| bodies[k].map_or(0.0, |_| r[k][0] * d[1] - r[k][1] * d[0]);
        let row = |axis| ProblemRow {
            axis,
            arm_a: arm(0, axis),
            arm_b: arm(1, axis),
            error: 0.0,
            warm_impulse: 0.0,
        };
        let [body_a, body_b] = bodies;
        let rows = vec![row([1.0, 0.0]), row([0.0, 1.0])];
        let reach = [0, 1].map(|k| bodies[k].map_or(0.0, |_| r[k][0].hypot(r[k][1])));
        ProblemJoint { body_a, body_b, reach, blocks: vec![ProblemBlock { law: BlockLaw::Rigid, rows }] }
    }
}

/// The law of a block as a line in the velocity; see [`super::joints`].
#[derive(Clone, Debug)]
pub struct LawLine {
    /// Number of rows.
    pub size: usize,
    /// K
    pub(super) response: [RowVector; ROWS],
    /// P of [`Self::solution`], initially K⁻¹.
    pub(super) step: [RowVector; ROWS],
    /// α = q
    pub(super) alpha: f64,
    offset: RowVector,
    law: BlockLaw,
}

impl LawLine {
    /// The line of `law` for `size` rows with these errors, in a block with the response K. `own`: right-hand
    /// sides of rigid rows and limits.
    pub fn new(
        law: BlockLaw,
        size: usize,
        errors: RowVector,
        own: [OwnRow; ROWS],
        response: [RowVector; ROWS],
    ) -> Self {
        let alpha = match law {
            BlockLaw::Rigid | BlockLaw::Limit => 1.0 / (1.0 + own[0].compliance),
            BlockLaw::Motor { .. } => 1.0,
            BlockLaw::Spring { damping, .. } => damping / (1.0 + damping),
        };
        let mut offset = [0.0; ROWS];
        for (i, offset) in offset.iter_mut().enumerate().take(size) {
            *offset = match law {
                BlockLaw::Rigid | BlockLaw::Limit => alpha * own[i].bias,
                BlockLaw::Motor { speed, .. } => -speed,
                BlockLaw::Spring { stiffness, damping, .. } => stiffness / (1.0 + damping) * errors[i],
            };
        }
        let step = inverted(response, size).unwrap_or_default();
        LawLine { size, response, step, alpha, offset, law }
    }

    /// Π(y), y = λ − P (c + q J v + (1 − α) K λ): the impulses that satisfy the block alone, at the velocity
    /// J v = `u` with impulses `l`.
    pub fn solution(&self, u: RowVector, l: RowVector) -> RowVector {
        let soft = product(&self.response, l);
        let f = [0, 1, 2].map(|i| self.offset[i] + self.alpha * u[i] + (1.0 - self.alpha) * soft[i]);
        let x = product(&self.step, f);
        self.project([0, 1, 2].map(|i| l[i] - x[i]))
    }

    /// Π; NaN stays NaN.
    fn project(&self, y: RowVector) -> RowVector {
        match (self.law, self.law.cap()) {
            (BlockLaw::Limit, _) => [positive(y[0]), y[1], y[2]],
            (_, Some(cap)) => {
                let norm = y.iter().map(|y| y * y).sum::<f64>().sqrt();
                if norm > cap { y.map(|y| y * (cap / norm)) } else { y }
            }
            (_, None) => y,
        }
    }
}

/// Normal law of a solver at one contact: un = Jn v + bias + compliance λn. For a rigid row or a limit of a
/// joint: J v + bias + compliance K λ. Motors and springs have the law of the joint.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OwnRow {
    /// Bias (m/s); negative values push apart.
    pub bias: f64,
    /// Velocity that the contact yields per impulse (1/kg), ≥ 0. For a joint row, as a multiple of its K (1).
    pub compliance: f64,
}

impl ProblemRow {
    /// b of the rigid law (m/s or rad/s).
    pub fn rigid_bias(&self, law: BlockLaw, h: f64) -> f64 {
        match law {
            BlockLaw::Limit => self.error.max(0.0) / h,
            _ => 0.0,
        }
    }
}

/// Factor from an impulse of a row to N·s: 1, or √(K m) for an angle (1/m). `inv_mass` is the sum of both
/// inverse masses (1/kg).
pub fn row_scale(is_angular: bool, response: f64, inv_mass: f64) -> f64 {
    if is_angular && inv_mass > 0.0 { (response / inv_mass).sqrt() } else { 1.0 }
}

/// The inverse of K, computed with the diagonal scaled to 1. `None` if K is singular to 9 digits.
pub(super) fn inverted(k: [RowVector; ROWS], size: usize) -> Option<[RowVector; ROWS]> {
    let mut inverse = [[0.0; ROWS]; ROWS];
    let scale = [0, 1, 2].map(|i| if i < size { 1.0 / k[i][i].sqrt() } else { 1.0 });
    for column in 0..size {
        let mut a = [0.0; ROWS * ROWS];
        let (a, x) = (&mut a[..size * size], &mut [0.0; ROWS][..size]);
        for r in 0..size {
            for c in 0..size {
                a[r * size + c] = scale[r] * k[r][c] * scale[c];
            }
        }
        x[column] = 1.0;
        if a.iter().any(|a| !a.is_finite()) || !solve_in_place(a, x, 1e-9) {
            return None;
        }
        for (row, x) in x.iter().enumerate() {
            inverse[row][column] = scale[row] * x * scale[column];
        }
    }
    Some(inverse)
}

fn product(matrix: &[RowVector; ROWS], x: RowVector) -> RowVector {
    matrix.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// max(x, 0) that propagates NaN, so that a diverged solver cannot look exact.
pub(super) fn positive(x: f64) -> f64 {
    if x <= 0.0 { 0.0 } else { x }
}
