//! A hinge: the anchors of the two bodies coincide.

use super::axial::{Axial, Motor, Spring};
use super::{Definition, Form, JointState, Measured, check_anchors, excess};
use crate::bodies::def::finite;
use crate::constraints::joints::rows::{Jacobian, JointPass, RowLaw};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// A hinge, optionally with spring, motor and limits of the angle.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Revolute {
    /// Anchor in the frame of a (m).
    pub anchor_a: [f64; 2],
    /// Anchor in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// Angle of b relative to a that counts as zero (rad).
    pub reference_angle: f64,
    /// Spring on the angle.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub spring: Option<Spring>,
    /// Motor on the angle.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub motor: Option<Motor>,
    /// Lower and upper limit of the angle (rad).
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub limits: Option<[f64; 2]>,
}

impl Revolute {
    fn axial(&self) -> Axial {
        Axial { spring: self.spring, motor: self.motor, limits: self.limits }
    }
}

impl JointType for Revolute {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.anchor_a, self.anchor_b]
    }

    fn numbers(form: Form) -> usize {
        let axial = Axial::numbers(form);
        axial + usize::from(axial > 0)
    }

    fn kept(form: Form) -> usize {
        2 + Axial::kept(form)
    }

    fn place(&self, form: Form, mut at: JointSetup<'_>, numbers: &mut [f32]) {
        if Axial::numbers(form) > 0 {
            numbers[0] = at.angle(self.reference_angle);
            self.axial().place(at.h, &mut numbers[1..]);
        }
    }

    #[inline(always)]
    fn rows<L: Lanes>(form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let (point, kept) = kept.split_at_mut(2);
        if Axial::numbers(form) > 0 {
            let (angle, held) = (numbers[0] + on.turn(), on.point().0);
            Axial::rows(form, (Jacobian::angle(), held), angle, &numbers[1..], kept, on);
        }
        let (rows, offset) = on.point();
        on.block(rows, offset, RowLaw::Rigid, point);
    }
}

impl Definition for Revolute {
    fn form(&self) -> Form {
        self.axial().form()
    }

    fn check(&self) -> Result<(), Error> {
        check_anchors(self.anchor_a, self.anchor_b)?;
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
        let angle = at.angle;
        JointState {
            gap: at.offset.length(),
            angle,
            excess: excess(self.limits, angle),
            ..JointState::default()
        }
    }

    fn impulse(&self, kept: &[f32], _at: &Measured) -> (DVec2, f64) {
        (DVec2::new(kept[0].into(), kept[1].into()), Axial::impulse(self.form(), &kept[2..]))
    }
}
