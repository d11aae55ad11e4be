//! A slider: b moves along an axis of a and does not turn relative to it.

use super::axial::{Axial, Motor, Spring};
use super::{Definition, Form, JointState, Measured, check_anchors, check_axis, excess, unit};
use crate::bodies::def::finite;
use crate::constraints::joints::rows::{Jacobian, JointPair, JointPass, RowLaw, add, dot};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// A slider, optionally with spring, motor and limits along its axis.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Prismatic {
    /// Anchor in the frame of a (m).
    pub anchor_a: [f64; 2],
    /// Anchor in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// Direction of the slider in the frame of a, of any length.
    pub axis: [f64; 2],
    /// Angle of b relative to a (rad).
    pub reference_angle: f64,
    /// Spring along the axis.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub spring: Option<Spring>,
    /// Motor along the axis.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub motor: Option<Motor>,
    /// Lower and upper limit of the displacement along the axis (m).
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub limits: Option<[f64; 2]>,
}

impl Default for Prismatic {
    fn default() -> Self {
        Prismatic {
            anchor_a: [0.0; 2],
            anchor_b: [0.0; 2],
            axis: [1.0, 0.0],
            reference_angle: 0.0,
            spring: None,
            motor: None,
            limits: None,
        }
    }
}

impl Prismatic {
    fn axial(&self) -> Axial {
        Axial { spring: self.spring, motor: self.motor, limits: self.limits }
    }
}

/// Numbers: `[axis, angle]`, then the parts along the axis.
const FRAME: usize = 3;

/// Jacobians of the rows along `axis` and along t = (−axis_y, axis_x), and the displacement in both
/// directions.
///
/// The axis turns with a, so a's arm reaches to the anchor of b: (r_a + offset) × d.
#[inline(always)]
pub(super) fn along_and_across<L: Lanes>(numbers: &[L], on: &JointPair<L>) -> ([Jacobian<L>; 2], [L; 2]) {
    let ([ra, rb], offset) = on.anchors();
    let axis = on.turned(0, [numbers[0], numbers[1]]);
    let across = [-axis[1], axis[0]];
    let arms = [add(ra, offset), rb];
    ([Jacobian::along(axis, arms), Jacobian::along(across, arms)], [dot(axis, offset), dot(across, offset)])
}

impl JointType for Prismatic {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.anchor_a, self.anchor_b]
    }

    fn numbers(form: Form) -> usize {
        FRAME + Axial::numbers(form)
    }

    fn kept(form: Form) -> usize {
        2 + Axial::kept(form)
    }

    fn place(&self, _form: Form, mut at: JointSetup<'_>, numbers: &mut [f32]) {
        numbers[..2].copy_from_slice(&at.direction(unit(self.axis)).to_array());
        numbers[2] = at.angle(self.reference_angle);
        self.axial().place(at.h, &mut numbers[FRAME..]);
    }

    #[inline(always)]
    fn rows<L: Lanes>(form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let ([along, across], [translation, off]) = along_and_across(numbers, on);
        let (rigid, kept) = kept.split_at_mut(2);
        let held = [across, Jacobian::angle()];
        Axial::rows(form, (along, held), translation, &numbers[FRAME..], kept, on);
        on.block(held, [off, numbers[2] + on.turn()], RowLaw::Rigid, rigid);
    }
}

impl Definition for Prismatic {
    fn form(&self) -> Form {
        self.axial().form()
    }

    fn check(&self) -> Result<(), Error> {
        check_anchors(self.anchor_a, self.anchor_b)?;
        check_axis(self.axis)?;
        finite("reference_angle", self.reference_angle)?;
        self.axial().check()
    }

    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2] {
        [&mut self.anchor_a, &mut self.anchor_b]
    }

    fn refer(&mut self, angle: f64, _length: f64) {
        self.reference_angle = angle;
    }

    fn measure(&self, at: &Measured) -> JointState {
        let axis = at.turned(self.axis);
        let translation = axis.dot(at.offset);
        JointState {
            gap: axis.perp_dot(at.offset).abs(),
            lean: at.angle.abs(),
            angle: at.angle,
            translation,
            excess: excess(self.limits, translation),
            ..JointState::default()
        }
    }

    fn impulse(&self, kept: &[f32], at: &Measured) -> (DVec2, f64) {
        let along = Axial::impulse(self.form(), &kept[2..]);
        (at.turned(self.axis).rotate(DVec2::new(along, kept[0].into())), kept[1].into())
    }
}
