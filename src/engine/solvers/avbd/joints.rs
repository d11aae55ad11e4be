//! Joints in block descent, one by one: the rows of a joint become forces and stiffness on its bodies.
//!
//! # Forces
//!
//! A row has an error C at the current positions, C⁰ at the start of the substep, a multiplier λ and a
//! penalty k:
//!
//! ```text
//! rigid    f = λ − k (C − α C⁰)
//! limit    the same, f ≥ 0; C⁰ is 0 where it is open, which may close
//! motor    f = λ − K⁻¹ (C − C⁰ − u h)/h², |f| ≤ F;   C is the way that it has gone in the step
//! spring   f = −K⁻¹ (S C⁰ + D (C − C⁰)/h)/h, |f| ≤ F
//! ```
//!
//! The last line is the spring of all solvers, λ = −K⁻¹ (S x + D v⁺) (see `constraints/joints/rows.rs`), with
//! f = λ/h and v⁺ = (C − C⁰)/h, the velocity at the end of the substep. Springs and motors have their own
//! stiffness, K⁻¹ D/h² and K⁻¹/h², and no growing penalty.
//!
//! # Stiffness
//!
//! C is evaluated at the current positions, not linearized. A turning arm adds f ∂²C/∂θ² = f d·r to the
//! stiffness of a row along d. Its magnitude, |f| √(|r|² − s²) with s = r × d, is added to the diagonal, as
//! in the source.

use super::input::{DescentInput, PENALTY};
use crate::constraints::joints::rows::{RowBlock, RowLaw};
use crate::constraints::kernels::types::{BodyStates, ConstraintSet};
use crate::constraints::records::rows::ROWS;

/// Numbers per row of a block.
type JointRows = [f32; ROWS];

/// Joints of a world, and the state of their rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointDescent {
    /// Type of each joint, and its index within the type. `[joints]`
    places: Vec<[u32; 2]>,
    /// Where the blocks of each joint begin, and where the last ones end. `[joints + 1]`
    starts: Vec<u32>,
    /// Bodies of each block. `[blocks]`
    bodies: Vec<[u32; 2]>,
    blocks: Vec<KeptBlock>,
    found: Vec<RowBlock>,
}

/// State of a block from iteration to iteration; penalties are also kept from step to step.
#[derive(Clone, Copy, Debug, Default)]
struct KeptBlock {
    /// λ (N or N·m)
    force: JointRows,
    /// k (N/m or N·m)
    penalty: JointRows,
    /// C⁰ (m or rad)
    first: JointRows,
}

/// Forces of a block at the current positions.
struct Forces {
    /// f (N or N·m)
    force: JointRows,
    /// −∂f/∂C
    stiffness: [JointRows; ROWS],
    /// Error to be removed (m or rad).
    error: JointRows,
    /// Whether the penalties of the rows may grow.
    grows: bool,
}

impl JointDescent {
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Lists the joints. Penalties are kept as long as the joints stay the same.
    pub fn assign(&mut self, types: &mut [ConstraintSet], on: BodyStates<'_>) {
        self.places.clear();
        self.starts.clear();
        self.found.clear();
        for (t, joined) in types.iter_mut().enumerate() {
            for i in 0..joined.kind.ends().len() {
                self.places.push([t as u32, i as u32]);
                self.starts.push(self.found.len() as u32);
                joined.kind.collect(i, on, &mut self.found);
            }
        }
        self.starts.push(self.found.len() as u32);
        let bodies = self.found.iter().map(|block| block.bodies);
        if !self.bodies.iter().copied().eq(bodies.clone()) {
            self.bodies.clear();
            self.bodies.extend(bodies);
            self.blocks.clear();
            self.blocks.resize(self.bodies.len(), KeptBlock::default());
        }
    }

    /// Bodies and penalties of all blocks, five numbers each.
    pub fn kept(&self) -> Vec<f64> {
        let of = |(bodies, block): (&[u32; 2], &KeptBlock)| {
            bodies.map(f64::from).into_iter().chain(block.penalty.map(f64::from))
        };
        self.bodies.iter().zip(&self.blocks).flat_map(of).collect()
    }

    /// Takes the numbers of [`Self::kept`]; returns whether they are whole blocks.
    pub fn set_kept(&mut self, kept: &[f64]) -> bool {
        let (blocks, rest) = kept.as_chunks::<{ 2 + ROWS }>();
        self.bodies = blocks.iter().map(|&[a, b, ..]| [a as u32, b as u32]).collect();
        let block = |&[_, _, x, y, z]: &[f64; 5]| KeptBlock {
            penalty: [x, y, z].map(|x| x as f32),
            ..KeptBlock::default()
        };
        self.blocks = blocks.iter().map(block).collect();
        rest.is_empty()
    }

    /// Collects the blocks of `joint` at the current positions of bodies; returns their range in `blocks`.
    fn collect(&mut self, joint: usize, on: &mut DescentInput<'_>) -> std::ops::Range<usize> {
        let [t, i] = self.places[joint];
        self.found.clear();
        let placed = BodyStates { rows: on.rows, poses: on.poses };
        on.types[t as usize].kind.collect(i as usize, placed, &mut self.found);
        self.starts[joint] as usize..self.starts[joint + 1] as usize
    }

    /// Begins a substep of `h` (s), before bodies move. Multipliers and penalties are multiplied by `keep`.
    pub fn begin(&mut self, on: &mut DescentInput<'_>, h: f32, keep: [f32; 2]) {
        for joint in 0..self.places.len() {
            let range = self.collect(joint, on);
            for (block, kept) in self.found.iter().zip(&mut self.blocks[range]) {
                for r in 0..block.size {
                    kept.force[r] = keep[0] * block.impulses[r] / h;
                    kept.penalty[r] = (kept.penalty[r] * keep[1]).clamp(PENALTY[0], PENALTY[1]);
                    kept.first[r] = match block.law {
                        RowLaw::Rigid | RowLaw::Spring { .. } => block.errors[r],
                        RowLaw::Limit => block.errors[r].min(0.0),
                        RowLaw::Motor { .. } => block.travel[r],
                    };
                }
                if matches!(block.law, RowLaw::Limit) && block.errors[0] > 0.0 && kept.force[0] == 0.0 {
                    kept.penalty[0] = PENALTY[0];
                }
            }
        }
    }

    /// Contribution of the joints of a body, edges `joints`, to its system: the upper half of the matrix row
    /// by row, and the right-hand side.
    pub fn system(
        &mut self,
        body: u32,
        joints: impl Iterator<Item = usize>,
        on: &mut DescentInput<'_>,
        alpha: f32,
    ) -> [f32; 9] {
        let mut sum = [0.0_f32; 9];
        for joint in joints {
            let range = self.collect(joint, on);
            for (block, kept) in self.found.iter().zip(&self.blocks[range]) {
                let Forces { force, stiffness, .. } = forces(block, kept, on.h, alpha);
                let side = usize::from(block.bodies[1] == body);
                let sign = if side == 0 { -1.0 } else { 1.0 };
                let turns = if on.rows[body as usize].delta[3] > 0.0 { sign } else { 0.0 };
                let j = block.jacobians.map(|j| [sign * j.axis[0], sign * j.axis[1], turns * j.arms[side]]);
                for r in 0..block.size {
                    (0..3).for_each(|i| sum[6 + i] += j[r][i] * force[r]);
                    for c in 0..block.size {
                        let k = stiffness[r][c];
                        for (at, (u, v)) in
                            [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].into_iter().enumerate()
                        {
                            sum[at] += k * j[r][u] * j[c][v];
                        }
                    }
                    if turns != 0.0 && j[r][..2] != [0.0; 2] {
                        let (reach, arm) = (block.reach[side], j[r][2]);
                        sum[5] += force[r].abs() * (reach * reach - arm * arm).max(0.0).sqrt();
                    }
                }
            }
        }
        sum
    }

    /// Multipliers become the forces. Penalties of rows within their bounds grow by `beta` (N/m²).
    pub fn raise(&mut self, on: &mut DescentInput<'_>, alpha: f32, beta: f32) {
        for joint in 0..self.places.len() {
            let range = self.collect(joint, on);
            for (block, kept) in self.found.iter().zip(&mut self.blocks[range]) {
                let Forces { force, error, grows, .. } = forces(block, kept, on.h, alpha);
                kept.force = force;
                let rows = if grows { block.size } else { 0 };
                for (penalty, error) in kept.penalty.iter_mut().zip(error).take(rows) {
                    *penalty = beta.mul_add(error.abs(), *penalty).min(PENALTY[1]);
                }
            }
        }
    }

    /// Stores the impulses h f in the joints.
    pub fn store(&mut self, on: &mut DescentInput<'_>) {
        for joint in 0..self.places.len() {
            let range = self.collect(joint, on);
            for (block, kept) in self.found.iter_mut().zip(&self.blocks[range]) {
                block.impulses = kept.force.map(|force| on.h * force);
            }
            let ([t, i], placed) = (self.places[joint], BodyStates { rows: on.rows, poses: on.poses });
            on.types[t as usize].kind.replace(i as usize, placed, &self.found);
        }
    }
}

/// Forces of a block; see the [module](self).
fn forces(block: &RowBlock, kept: &KeptBlock, h: f32, alpha: f32) -> Forces {
    let mut stiffness = [[0.0; ROWS]; ROWS];
    let mut error = [0.0; ROWS];
    let inv_square = 1.0 / (h * h);
    let mut force = [0.0; ROWS];
    let mut cap = None;
    match block.law {
        RowLaw::Rigid | RowLaw::Limit => {
            for r in 0..block.size {
                error[r] = alpha.mul_add(-kept.first[r], block.errors[r]);
                stiffness[r][r] = kept.penalty[r];
                force[r] = kept.penalty[r].mul_add(-error[r], kept.force[r]);
            }
        }
        RowLaw::Motor { speed, cap: bound } => {
            (0..block.size).for_each(|r| error[r] = block.travel[r] - kept.first[r] - speed * h);
            stiffness = inverse(block, inv_square);
            let change = block.solved(error).map(|x| x * inv_square);
            (0..block.size).for_each(|r| force[r] = kept.force[r] - change[r]);
            cap = Some(bound / h);
        }
        RowLaw::Spring { stiffness: s, damping: d, cap: bound } => {
            let moved = |r: usize| block.errors[r] - kept.first[r];
            let x = std::array::from_fn(|r| s * kept.first[r] / h + d * moved(r) * inv_square);
            stiffness = inverse(block, d * inv_square);
            let x = block.solved(x);
            (0..block.size).for_each(|r| force[r] = -x[r]);
            cap = bound.map(|bound| bound / h);
        }
    }
    if matches!(block.law, RowLaw::Limit) {
        force[0] = force[0].max(0.0);
    }
    if let Some(cap) = cap {
        let norm = force.iter().map(|f| f * f).sum::<f32>().sqrt();
        if norm > cap {
            // A constant force has no stiffness.
            force = force.map(|f| f * (cap / norm));
            stiffness = [[0.0; ROWS]; ROWS];
        }
    }
    let grows = match block.law {
        RowLaw::Rigid => true,
        RowLaw::Limit => force[0] > 0.0,
        RowLaw::Motor { .. } | RowLaw::Spring { .. } => false,
    };
    Forces { force, stiffness, error, grows }
}

/// K⁻¹ times `scale`.
fn inverse(block: &RowBlock, scale: f32) -> [JointRows; ROWS] {
    let mut columns = [[0.0; ROWS]; ROWS];
    for (c, column) in columns.iter_mut().enumerate().take(block.size) {
        let mut unit = [0.0; ROWS];
        unit[c] = scale;
        *column = block.solved(unit);
        column[block.size..].fill(0.0);
    }
    columns
}
