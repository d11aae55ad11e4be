//! A spring of bounded force to a target point.

use super::axial::Spring;
use super::{Definition, Form, JointState, Measured, check_not_negative};
use crate::bodies::def::finite_pair;
use crate::constraints::joints::rows::{JointPass, RowLaw};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// Pulls a point of b to a target, which may be changed between steps. Body a should not move.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Mouse {
    /// The target, in the frame of a (m).
    pub target: [f64; 2],
    /// The pulled point, in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// The spring that pulls.
    pub spring: Spring,
    /// Maximum force (N).
    pub max_force: f64,
}

impl Default for Mouse {
    fn default() -> Self {
        let spring = Spring { hertz: 5.0, damping_ratio: 0.7, rest: 0.0 };
        Mouse { target: [0.0; 2], anchor_b: [0.0; 2], spring, max_force: 1.0 }
    }
}

/// Numbers: `[S, D, F h]`.
const NUMBERS: usize = 3;

impl JointType for Mouse {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.target, self.anchor_b]
    }

    fn numbers(_form: Form) -> usize {
        NUMBERS
    }

    fn kept(_form: Form) -> usize {
        4
    }

    fn place(&self, _form: Form, at: JointSetup<'_>, numbers: &mut [f32]) {
        numbers[..2].copy_from_slice(&self.spring.coefficients(at.h));
        numbers[2] = self.max_force as f32 * at.h;
    }

    #[inline(always)]
    fn rows<L: Lanes>(_form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let law = RowLaw::Spring { stiffness: numbers[0], damping: numbers[1], cap: Some(numbers[2]) };
        let (rows, offset) = on.point();
        on.block(rows, offset, law, kept);
    }
}

impl Definition for Mouse {
    fn form(&self) -> Form {
        Form::default()
    }

    fn check(&self) -> Result<(), Error> {
        finite_pair("target", self.target)?;
        finite_pair("anchor_b", self.anchor_b)?;
        self.spring.check().map_err(|e| e.within("spring"))?;
        check_not_negative("max_force", self.max_force)
    }

    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2] {
        [&mut self.target, &mut self.anchor_b]
    }

    fn measure(&self, at: &Measured) -> JointState {
        JointState { angle: at.angle, translation: at.offset.length(), ..JointState::default() }
    }

    fn impulse(&self, kept: &[f32], _at: &Measured) -> (DVec2, f64) {
        (DVec2::new(kept[0].into(), kept[1].into()), 0.0)
    }
}
