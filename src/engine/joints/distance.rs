//! A rod, rope or spring between two points.

use super::axial::{Axial, Motor, Spring};
use super::{Definition, Form, JointState, Measured, check_anchors, check_not_negative, excess};
use crate::constraints::joints::rows::{Jacobian, JointPass, RowLaw, dot};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// Controls the distance of two points. It is a rigid rod if there is neither spring nor motor nor limits.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Distance {
    /// Anchor in the frame of a (m).
    pub anchor_a: [f64; 2],
    /// Anchor in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// Length of the rod, or of the relaxed spring (m).
    pub length: f64,
    /// Spring along the line between the points.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub spring: Option<Spring>,
    /// Motor along the line between the points; a positive speed lengthens it.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub motor: Option<Motor>,
    /// Minimum and maximum distance (m); a rope has `[0, length]`.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub limits: Option<[f64; 2]>,
}

impl Distance {
    fn axial(&self) -> Axial {
        Axial { spring: self.spring, motor: self.motor, limits: self.limits }
    }
}

/// Numbers: `[length]`, then the parts along the line.
const FRAME: usize = 1;

/// Points closer than this have no line between them (m).
const NO_LINE: f32 = 1e-9;

impl JointType for Distance {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.anchor_a, self.anchor_b]
    }

    fn numbers(form: Form) -> usize {
        FRAME + Axial::numbers(form)
    }

    fn kept(form: Form) -> usize {
        match Axial::kept(form) {
            0 => 1,
            count => count,
        }
    }

    fn place(&self, _form: Form, at: JointSetup<'_>, numbers: &mut [f32]) {
        numbers[0] = self.length as f32;
        // Parts measure from the length, but limits are given as distances.
        let limits = self.limits.map(|limits| limits.map(|x| x - self.length));
        Axial { limits, ..self.axial() }.place(at.h, &mut numbers[FRAME..]);
    }

    #[inline(always)]
    fn rows<L: Lanes>(form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let (arms, offset) = on.anchors();
        let distance = dot(offset, offset).sqrt();
        let scale = (distance - L::splat(NO_LINE)).select_positive(L::splat(1.0) / distance, L::zero());
        let j = Jacobian::along(offset.map(|x| x * scale), arms);
        let error = distance - numbers[0];
        if Axial::kept(form) == 0 {
            on.row(j, error, RowLaw::Rigid, kept);
        } else {
            Axial::rows(form, (j, []), error, &numbers[FRAME..], kept, on);
        }
    }
}

impl Definition for Distance {
    fn form(&self) -> Form {
        self.axial().form()
    }

    fn check(&self) -> Result<(), Error> {
        check_anchors(self.anchor_a, self.anchor_b)?;
        check_not_negative("length", self.length)?;
        if let Some([least, _]) = self.limits {
            check_not_negative("limits[0]", least)?;
        }
        self.axial().check()
    }

    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2] {
        [&mut self.anchor_a, &mut self.anchor_b]
    }

    fn refer(&mut self, _angle: f64, length: f64) {
        self.length = length;
    }

    fn measure(&self, at: &Measured) -> JointState {
        let translation = at.offset.length();
        let rigid = self.form() == Form::default();
        JointState {
            gap: if rigid { (translation - self.length).abs() } else { 0.0 },
            angle: at.angle,
            translation,
            excess: excess(self.limits, translation),
            ..JointState::default()
        }
    }

    fn impulse(&self, kept: &[f32], at: &Measured) -> (DVec2, f64) {
        let form = self.form();
        let along = if form == Form::default() { f64::from(kept[0]) } else { Axial::impulse(form, kept) };
        (along * at.offset.normalize_or_zero(), 0.0)
    }
}
