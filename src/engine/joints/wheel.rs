//! A wheel: b turns freely and moves along an axis of a.

use super::axial::{Axial, Motor, Spring};
use super::prismatic::along_and_across;
use super::{Definition, Form, JointState, Measured, check_anchors, check_axis, excess, unit};
use crate::constraints::joints::rows::{Jacobian, JointPass, RowLaw};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// A wheel, optionally with a suspension along its axis and a motor.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Wheel {
    /// Anchor in the frame of a (m).
    pub anchor_a: [f64; 2],
    /// Anchor in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// Direction of the suspension in the frame of a, of any length.
    pub axis: [f64; 2],
    /// Spring of the suspension.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub spring: Option<Spring>,
    /// Motor that turns the wheel.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub motor: Option<Motor>,
    /// Lower and upper limit of the displacement along the axis (m).
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub limits: Option<[f64; 2]>,
}

impl Default for Wheel {
    fn default() -> Self {
        let (zero, axis) = ([0.0; 2], [0.0, 1.0]);
        Wheel { anchor_a: zero, anchor_b: zero, axis, spring: None, motor: None, limits: None }
    }
}

impl Wheel {
    fn suspension(&self) -> Axial {
        Axial { spring: self.spring, motor: None, limits: self.limits }
    }

    fn drive(&self) -> Axial {
        Axial { spring: None, motor: self.motor, limits: None }
    }
}

/// Splits a form into its parts along the axis and on the angle.
const fn split(form: Form) -> [Form; 2] {
    let Form { spring, motor, limits } = form;
    [Form { spring, motor: false, limits }, Form { spring: false, motor, limits: false }]
}

/// Numbers: `[axis]`, then the suspension, then the motor.
const FRAME: usize = 2;

impl JointType for Wheel {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.anchor_a, self.anchor_b]
    }

    fn numbers(form: Form) -> usize {
        FRAME + Axial::numbers(form)
    }

    fn kept(form: Form) -> usize {
        1 + Axial::kept(form)
    }

    fn place(&self, form: Form, at: JointSetup<'_>, numbers: &mut [f32]) {
        numbers[..2].copy_from_slice(&at.direction(unit(self.axis)).to_array());
        let (suspension, drive) = numbers[FRAME..].split_at_mut(Axial::numbers(split(form)[0]));
        self.suspension().place(at.h, suspension);
        self.drive().place(at.h, drive);
    }

    #[inline(always)]
    fn rows<L: Lanes>(form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let [suspension, drive] = split(form);
        let ([along, across], [translation, off]) = along_and_across(numbers, on);
        let (rigid, kept) = kept.split_at_mut(1);
        let (of_suspension, of_drive) = kept.split_at_mut(Axial::kept(suspension));
        let (first, second) = numbers[FRAME..].split_at(Axial::numbers(suspension));
        Axial::rows(suspension, (along, [across]), translation, first, of_suspension, on);
        Axial::rows(drive, (Jacobian::angle(), [across]), L::zero(), second, of_drive, on);
        on.row(across, off, RowLaw::Rigid, rigid);
    }
}

impl Definition for Wheel {
    fn form(&self) -> Form {
        Form { motor: self.motor.is_some(), ..self.suspension().form() }
    }

    fn check(&self) -> Result<(), Error> {
        check_anchors(self.anchor_a, self.anchor_b)?;
        check_axis(self.axis)?;
        self.suspension().check()?;
        self.drive().check()
    }

    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2] {
        [&mut self.anchor_a, &mut self.anchor_b]
    }

    fn measure(&self, at: &Measured) -> JointState {
        let axis = at.turned(self.axis);
        let translation = axis.dot(at.offset);
        JointState {
            gap: axis.perp_dot(at.offset).abs(),
            angle: at.angle,
            translation,
            excess: excess(self.limits, translation),
            ..JointState::default()
        }
    }

    fn impulse(&self, kept: &[f32], at: &Measured) -> (DVec2, f64) {
        let [suspension, drive] = split(self.form());
        let (first, second) = kept[1..].split_at(Axial::kept(suspension));
        let along = Axial::impulse(suspension, first);
        let force = at.turned(self.axis).rotate(DVec2::new(along, kept[0].into()));
        (force, Axial::impulse(drive, second))
    }
}
