//! A drive to a relative pose: springs of bounded force and torque.

use super::axial::Spring;
use super::{Definition, Form, JointState, Measured, check_anchors, check_not_negative};
use crate::bodies::def::finite;
use crate::constraints::joints::rows::{Jacobian, JointPass, RowLaw};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// Drives b to a pose relative to a.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct MotorJoint {
    /// Target of b's anchor, in the frame of a (m).
    pub anchor_a: [f64; 2],
    /// Anchor in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// Target angle of b relative to a (rad).
    pub angle: f64,
    /// The springs that drive it.
    pub spring: Spring,
    /// Maximum force (N).
    pub max_force: f64,
    /// Maximum torque (N·m).
    pub max_torque: f64,
}

impl Default for MotorJoint {
    fn default() -> Self {
        MotorJoint {
            anchor_a: [0.0; 2],
            anchor_b: [0.0; 2],
            angle: 0.0,
            spring: Spring { hertz: 5.0, damping_ratio: 1.0, rest: 0.0 },
            max_force: 1.0,
            max_torque: 1.0,
        }
    }
}

/// Numbers: `[angle, S, D, F h, M h]`.
const NUMBERS: usize = 5;

impl JointType for MotorJoint {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.anchor_a, self.anchor_b]
    }

    fn numbers(_form: Form) -> usize {
        NUMBERS
    }

    fn kept(_form: Form) -> usize {
        6
    }

    fn place(&self, _form: Form, mut at: JointSetup<'_>, numbers: &mut [f32]) {
        numbers[0] = at.angle(self.angle);
        numbers[1..3].copy_from_slice(&self.spring.coefficients(at.h));
        (numbers[3], numbers[4]) = (self.max_force as f32 * at.h, self.max_torque as f32 * at.h);
    }

    #[inline(always)]
    fn rows<L: Lanes>(_form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let law = |cap: L| RowLaw::Spring { stiffness: numbers[1], damping: numbers[2], cap: Some(cap) };
        let (of_points, of_angle) = kept.split_at_mut(4);
        on.row(Jacobian::angle(), numbers[0] + on.turn(), law(numbers[4]), of_angle);
        let (rows, offset) = on.point();
        on.block(rows, offset, law(numbers[3]), of_points);
    }
}

impl Definition for MotorJoint {
    fn form(&self) -> Form {
        Form::default()
    }

    fn check(&self) -> Result<(), Error> {
        check_anchors(self.anchor_a, self.anchor_b)?;
        finite("angle", self.angle)?;
        self.spring.check().map_err(|e| e.within("spring"))?;
        check_not_negative("max_force", self.max_force)?;
        check_not_negative("max_torque", self.max_torque)
    }

    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2] {
        [&mut self.anchor_a, &mut self.anchor_b]
    }

    fn refer(&mut self, angle: f64, _length: f64) {
        self.angle = angle;
    }

    fn measure(&self, at: &Measured) -> JointState {
        JointState { angle: at.angle, translation: at.offset.length(), ..JointState::default() }
    }

    fn impulse(&self, kept: &[f32], _at: &Measured) -> (DVec2, f64) {
        (DVec2::new(kept[0].into(), kept[1].into()), kept[4].into())
    }
}
