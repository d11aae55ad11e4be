//! Rows of individual joints, for methods that assemble a system of all rows of a scene.

use crate::clock::Phase;
use crate::constraints::kernels::pass::PassMode;
use crate::constraints::kernels::types::BodyStates;
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::records::rows::{ROWS, RowBlock, RowLaw};
use crate::constraints::vectors::system::System;

/// The blocks of all joints, ordered by type.
#[derive(Clone, Debug, Default)]
pub struct JointBlocks {
    /// All blocks, with the impulses of the records.
    pub blocks: Vec<RowBlock>,
    /// Type of each joint, its index within the type, and its first block. `[joints]`
    joints: Vec<[usize; 3]>,
}

impl System<'_> {
    /// Reads the blocks of all joints.
    pub fn joint_blocks(&mut self) -> JointBlocks {
        self.over_types(Phase::Store, PassMode::InTurn);
        let mut all = JointBlocks::default();
        let placed = BodyStates { rows: self.rows, poses: self.others.poses };
        for (t, joined) in self.others.types.iter_mut().enumerate() {
            for i in 0..joined.kind.ends().len() {
                all.joints.push([t, i, all.blocks.len()]);
                joined.kind.collect(i, placed, &mut all.blocks);
            }
        }
        all
    }

    /// Sets the impulses of the joints to those of the blocks. Velocities do not change.
    pub fn set_joint_impulses(&mut self, from: &JointBlocks) {
        let ends = from.joints.iter().skip(1).map(|joint| joint[2]).chain([from.blocks.len()]);
        let placed = BodyStates { rows: self.rows, poses: self.others.poses };
        for (&[t, i, first], end) in from.joints.iter().zip(ends) {
            self.others.types[t].kind.replace(i, placed, &from.blocks[first..end]);
        }
        self.over_types(Phase::Prepare, PassMode::InTurn);
    }
}

impl RowBlock {
    /// Row `r` of J on body a (`side` 0) or b: `[d, d, s]`, with the sign of the side.
    pub fn on(&self, side: usize, r: usize) -> [f64; 3] {
        let (sign, j) = (if side == 0 { -1.0 } else { 1.0 }, &self.jacobians[r]);
        [j.axis[0], j.axis[1], j.arms[side]].map(|x| sign * f64::from(x))
    }

    /// b of J v + b + R λ = 0, see `constraints/joints/rows.rs`. `rigid` is the softness of rigid rows.
    pub fn bias(&self, rigid: Softness, h: f32) -> [f32; ROWS] {
        let pushed = rigid.pushed(&self.jacobians, self.errors);
        std::array::from_fn(|r| match self.law {
            RowLaw::Limit if self.errors[r] > 0.0 => self.errors[r] / h,
            RowLaw::Rigid | RowLaw::Limit => rigid.bias_rate * pushed[r],
            RowLaw::Motor { speed, .. } => -speed,
            RowLaw::Spring { stiffness, damping, .. } => stiffness / damping.max(1e-9) * self.errors[r],
        })
    }

    /// Factor of K in R = `softness` K (1).
    pub fn softness(&self) -> f32 {
        match self.law {
            RowLaw::Spring { damping, .. } => 1.0 / damping.max(1e-9),
            _ => 0.0,
        }
    }

    /// Limit on the norm of its impulses, if any.
    pub fn cap(&self) -> Option<f32> {
        self.law.cap()
    }
}
