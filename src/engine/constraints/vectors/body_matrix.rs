//! The matrix of a penalty on all rows, in the space of the bodies: factorized once, used many times.
//!
//! For a diagonal C and R of springs, (J M⁻¹ Jᵀ + R + C⁻¹) λ = r has one unknown per row of contacts and
//! joints. The same λ follows from the velocity change of the bodies, δ = M⁻¹ Jᵀ λ:
//!
//! ```text
//! (M + Jᵀ S J) δ = Jᵀ S r,   λ = S (r − J δ),   S = (C⁻¹ + R)⁻¹
//! ```
//!
//! This has three unknowns per body. Bodies that touch or are joined are coupled, no matter at how many
//! points they touch. The matrix is factorized as 1 + M^(−1/2) Jᵀ S J M^(−1/2). This form is symmetric,
//! has no pivot below one whatever the masses, and drops bodies that do not move.

use crate::constraints::numerics::envelope::{Couplings, Envelope};
use crate::constraints::records::rows::{ROWS, RowBlock};
use crate::constraints::vectors::blocks::JointBlocks;
use crate::constraints::vectors::system::{Pair, System};
use crate::lanes::BodyRow;

/// The matrix and its factor. Keeps its memory between steps.
#[derive(Clone, Debug, Default)]
pub struct BodyMatrix {
    envelope: Envelope,
    couplings: Couplings,
    /// M^(−1/2) of each body (kg^(−1/2), kg^(−1/2), kg^(−1/2) m⁻¹).
    roots: Vec<[f64; 3]>,
    surfaces: Vec<Pair>,
    unknowns: Vec<f64>,
}

/// A row of the Jacobian on bodies a and b, times M^(−1/2).
type Scaled = [[f64; 3]; 2];

impl BodyMatrix {
    /// Orders the bodies of a step. Returns the number of entries of the factor below its diagonal.
    pub fn begin(&mut self, system: &mut System<'_>, joints: &JointBlocks) -> usize {
        self.roots.clear();
        self.roots.extend(system.rows().iter().map(|row| {
            let [mass, inertia] = [row.velocity[3], row.delta[3]].map(|inverse| f64::from(inverse).sqrt());
            [mass, mass, inertia]
        }));
        let moves = |body: u32| self.roots.get(body as usize).is_some_and(|root| *root != [0.0; 3]);
        let ends = system.point_rows().map(|p| p.bodies).chain(joints.blocks.iter().map(|b| b.bodies));
        let both = ends.filter(|ends| ends.iter().all(|&body| moves(body)));
        let count = self.roots.len();
        self.couplings.begin(count, both.map(|ends| ends.map(|body| body as usize)));
        self.envelope.begin::<3, _>(count, |body| self.couplings.of(body));
        system.gaps_and_friction(&mut self.surfaces);
        self.envelope.entries()
    }

    /// Computes the factor for C = `compliance` D, where D is the inverse of the diagonal of
    /// J M⁻¹ Jᵀ + R. Both rows of a contact point use the entry of its normal row. Tangential rows
    /// without friction are left out. Returns `false` if a pivot is below 0.5 or not finite.
    pub fn factorize(&mut self, system: &System<'_>, joints: &JointBlocks, compliance: f64) -> bool {
        self.envelope.clear();
        let unit = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
        (0..self.roots.len()).for_each(|body| self.envelope.add_block::<3>(body, body, unit));
        for point in system.point_rows() {
            let rows = [0, 1].map(|axis| self.scaled(point.bodies, |side| point.on(side, axis)));
            let diagonal = square(&rows[0]);
            if diagonal > 0.0 {
                let root = (compliance / diagonal).sqrt();
                let rubs = self.surfaces[point.at][1] > 0.0;
                for row in &rows[..1 + usize::from(rubs)] {
                    self.add(point.bodies, row.map(|j| j.map(|x| root * x)));
                }
            }
        }
        for block in &joints.blocks {
            self.add_joint(block, compliance);
        }
        self.envelope.factorize(0.5)
    }

    /// Solves the system of [`Self::factorize`] for δ. On entry, x is the velocity change M⁻¹ Jᵀ S r due
    /// to the impulses S r (m/s and rad/s); on return, it is δ.
    pub fn solve(&mut self, x: &mut [[f64; 3]]) {
        self.unknowns.clear();
        for (x, root) in x.iter().zip(&self.roots) {
            self.unknowns.extend([0, 1, 2].map(|k| if root[k] > 0.0 { x[k] / root[k] } else { 0.0 }));
        }
        self.envelope.substitute(&mut self.unknowns);
        for ((x, root), y) in x.iter_mut().zip(&self.roots).zip(self.unknowns.chunks_exact(3)) {
            *x = [0, 1, 2].map(|k| root[k] * y[k]);
        }
    }

    /// Adds the rows of a joint: with C⁻¹ + R = L Lᵀ, these are the rows of L⁻¹ J.
    fn add_joint(&mut self, block: &RowBlock, compliance: f64) {
        let (n, softness) = (block.size, f64::from(block.softness()));
        let mut rows = [[[0.0; 3]; 2]; ROWS];
        let mut lower = [[0.0; ROWS]; ROWS];
        for r in 0..n {
            rows[r] = self.scaled(block.bodies, |side| block.on(side, r));
            let mut k = block.response[r].map(f64::from);
            if k[r] <= 0.0 {
                // No body can move along this row.
                k = [0.0; ROWS];
                k[r] = 1.0;
                rows[r] = [[0.0; 3]; 2];
            }
            for c in 0..=r {
                let shift = if r == c { (1.0 + softness) * k[r] / compliance } else { 0.0 };
                let below: f64 = (0..c).map(|i| lower[r][i] * lower[c][i]).sum();
                let rest = softness * k[c] + shift - below;
                lower[r][c] = if r == c { rest.sqrt() } else { rest / lower[c][c] };
            }
            for c in 0..r {
                let before = rows[c];
                for (own, before) in rows[r].iter_mut().zip(before) {
                    (0..3).for_each(|i| own[i] -= lower[r][c] * before[i]);
                }
            }
            rows[r] = rows[r].map(|j| j.map(|x| x / lower[r][r]));
            self.add(block.bodies, rows[r]);
        }
    }

    /// J M^(−1/2) of a row, where `on(side)` is J. Zero for an index that is not a body.
    fn scaled(&self, bodies: [u32; 2], on: impl Fn(usize) -> [f64; 3]) -> Scaled {
        [0, 1].map(|side| {
            let root = self.roots.get(bodies[side] as usize).copied().unwrap_or_default();
            let j = on(side);
            [0, 1, 2].map(|k| root[k] * j[k])
        })
    }

    /// Adds jᵀ j.
    fn add(&mut self, bodies: [u32; 2], j: Scaled) {
        let moves = j.map(|j| j != [0.0; 3]);
        let product = |s: usize, t: usize| j[s].map(|x| j[t].map(|y| x * y));
        for side in 0..2 {
            if moves[side] {
                let body = bodies[side] as usize;
                self.envelope.add_block::<3>(body, body, product(side, side));
            }
        }
        if moves[0] && moves[1] {
            self.envelope.add_block::<3>(bodies[0] as usize, bodies[1] as usize, product(0, 1));
        }
    }
}

/// J M⁻¹ Jᵀ of a row.
fn square(j: &Scaled) -> f64 {
    j.iter().flatten().map(|x| x * x).sum()
}

/// Velocities of all bodies (m/s, rad/s).
pub fn velocities(rows: &[BodyRow], to: &mut Vec<[f64; 3]>) {
    to.clear();
    to.extend(rows.iter().map(|row| [0, 1, 2].map(|k| f64::from(row.velocity[k]))));
}
