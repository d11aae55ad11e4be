//! A weld: b does not move relative to a, except as far as springs give way.

use super::axial::Spring;
use super::{Definition, Form, JointState, Measured, check_anchors};
use crate::bodies::def::finite;
use crate::constraints::joints::rows::{Jacobian, JointPass, RowLaw};
use crate::constraints::joints::{JointSetup, JointType};
use crate::error::Error;
use crate::lanes::Lanes;
use glam::DVec2;

/// A weld, rigid or soft. Position and angle have separate springs.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Weld {
    /// Anchor in the frame of a (m).
    pub anchor_a: [f64; 2],
    /// Anchor in the frame of b (m).
    pub anchor_b: [f64; 2],
    /// Angle of b relative to a (rad).
    pub reference_angle: f64,
    /// Spring between the anchors; `None` is rigid.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub linear: Option<Spring>,
    /// Spring on the angle; `None` is rigid.
    #[cfg_attr(feature = "serde", serde(skip_serializing_if = "Option::is_none"))]
    pub angular: Option<Spring>,
}

/// Numbers: `[angle]`, then `[S, D]` of each spring.
const FRAME: usize = 1;

impl JointType for Weld {
    type Form = Form;

    fn anchors(&self) -> [[f64; 2]; 2] {
        [self.anchor_a, self.anchor_b]
    }

    fn numbers(form: Form) -> usize {
        FRAME + 2 * usize::from(form.spring) + 2 * usize::from(form.motor)
    }

    fn kept(form: Form) -> usize {
        3 + 2 * usize::from(form.spring) + usize::from(form.motor)
    }

    fn place(&self, _form: Form, mut at: JointSetup<'_>, numbers: &mut [f32]) {
        numbers[0] = at.angle(self.reference_angle);
        let springs =
            [self.linear, self.angular].into_iter().flatten().map(|spring| spring.coefficients(at.h));
        for (number, value) in numbers[FRAME..].iter_mut().zip(springs.flatten()) {
            *number = value;
        }
    }

    #[inline(always)]
    fn rows<L: Lanes>(form: Form, numbers: &[L], kept: &mut [L], on: &mut impl JointPass<L>) {
        let spring =
            |at: usize| RowLaw::Spring { stiffness: numbers[at], damping: numbers[at + 1], cap: None };
        let (linear, angular) = (form.spring, form.motor);
        if !linear && !angular {
            let ([x, y], offset) = on.point();
            let error = [offset[0], offset[1], numbers[0] + on.turn()];
            return on.block([x, y, Jacobian::angle()], error, RowLaw::Rigid, kept);
        }
        let (of_points, of_angle) = kept.split_at_mut(if linear { 4 } else { 2 });
        let law = if angular { spring(if linear { FRAME + 2 } else { FRAME }) } else { RowLaw::Rigid };
        let (angle, (rows, offset)) = (numbers[0] + on.turn(), on.point());
        if linear {
            on.row(Jacobian::angle(), angle, law, of_angle);
        } else {
            let ease = on.ease(&Jacobian::angle(), &rows);
            on.free_row(Jacobian::angle(), angle, law, of_angle, ease);
        }
        let law = if linear { spring(FRAME) } else { RowLaw::Rigid };
        on.block(rows, offset, law, of_points);
    }
}

impl Definition for Weld {
    fn form(&self) -> Form {
        Form { spring: self.linear.is_some(), motor: self.angular.is_some(), limits: false }
    }

    fn check(&self) -> Result<(), Error> {
        check_anchors(self.anchor_a, self.anchor_b)?;
        finite("reference_angle", self.reference_angle)?;
        for (name, spring) in [("linear", self.linear), ("angular", self.angular)] {
            spring.map_or(Ok(()), |spring| spring.check().map_err(|e| e.within(name)))?;
        }
        Ok(())
    }

    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2] {
        [&mut self.anchor_a, &mut self.anchor_b]
    }

    fn refer(&mut self, angle: f64, _length: f64) {
        self.reference_angle = angle;
    }

    fn measure(&self, at: &Measured) -> JointState {
        JointState {
            gap: if self.linear.is_some() { 0.0 } else { at.offset.length() },
            lean: if self.angular.is_some() { 0.0 } else { at.angle.abs() },
            angle: at.angle,
            translation: at.offset.length(),
            ..JointState::default()
        }
    }

    fn impulse(&self, kept: &[f32], _at: &Measured) -> (DVec2, f64) {
        let angle = if self.linear.is_some() { 4 } else { 2 };
        (DVec2::new(kept[0].into(), kept[1].into()), kept[angle].into())
    }
}
