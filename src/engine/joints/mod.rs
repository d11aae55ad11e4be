//! Joints and their parameters, one file per type. `constraints/joints` solves them.
//!
//! ```
//! use simpulse_engine::prelude::*;
//!
//! // A pendulum of 1 m, released from the side.
//! let mut world = World::default();
//! let ceiling = world.add_body(&BodyDef::fixed([0.0, 0.0]))?;
//! let bob = world.add_body(&BodyDef::dynamic([1.0, 0.0]).with(ShapeDef::circle(0.1)?))?;
//! let joint = world.add_joint(&Joint::revolute(ceiling, bob).anchor([0.0, 0.0]))?;
//! for _ in 0..60 {
//!     world.step()?;
//! }
//! assert!(world.joint_state(joint)?.gap < 1e-4);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod axial;
mod distance;
mod motor;
mod mouse;
mod prismatic;
mod revolute;
mod weld;
mod wheel;

pub use axial::{Motor, Spring};
pub use distance::Distance;
pub use motor::MotorJoint;
pub use mouse::Mouse;
pub use prismatic::Prismatic;
pub use revolute::Revolute;
pub use weld::Weld;
pub use wheel::Wheel;

use crate::bodies::def::{finite, finite_pair};
use crate::bodies::{Bodies, BodyHandle};
use crate::constraints::joints::JointType;
use crate::error::Error;
use glam::{DVec2, Vec2};
use std::borrow::Cow;

/// Identifies a joint of a world; valid until the joint is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct JointHandle {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl JointHandle {
    /// Index among the joints of the world; reused after the joint is removed.
    pub fn index(self) -> usize {
        self.index as usize
    }
}

/// A joint between two bodies.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Joint {
    /// The first body; axes are fixed in its frame.
    pub a: BodyHandle,
    /// The second body.
    pub b: BodyHandle,
    /// Whether the two bodies collide with each other.
    pub collide_connected: bool,
    /// Force and torque above which [`JointState::breaks`] is set (N, N·m). Joints do not break by
    /// themselves.
    pub break_load: Option<[f64; 2]>,
    /// World positions of the anchors of a and b (m), converted to the bodies' frames when the joint is
    /// added; `None` if `kind` already has its frames.
    pub at: Option<[[f64; 2]; 2]>,
    /// Type of the joint, with its values.
    pub kind: JointKind,
}

/// Type of a joint, with its values.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum JointKind {
    /// A hinge.
    Revolute(Revolute),
    /// A slider.
    Prismatic(Prismatic),
    /// A rod, rope or spring between two points.
    Distance(Distance),
    /// A connection in position and angle, rigid or soft.
    Weld(Weld),
    /// A slider with a hinge: a wheel on its suspension.
    Wheel(Wheel),
    /// A drive to a relative pose, with bounded force and torque.
    Motor(MotorJoint),
    /// A spring from a point of b to a target point.
    Mouse(Mouse),
    /// No constraint: the two bodies just do not collide.
    Filter,
}

/// Optional rows that the joints of a group have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Form {
    /// A spring; for a weld, its linear spring.
    pub spring: bool,
    /// A motor; for a weld, its angular spring.
    pub motor: bool,
    /// Limits.
    pub limits: bool,
}

/// State of a joint after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct JointState {
    /// Position error of the rigid rows (m).
    pub gap: f64,
    /// Angle error of the rigid rows (rad).
    pub lean: f64,
    /// Angle of b relative to a, from the reference angle (rad); it counts full turns.
    pub angle: f64,
    /// Displacement of b's anchor along the axis, or distance between the anchors of a joint without an axis
    /// (m); 0 for hinges.
    pub translation: f64,
    /// How far limits are exceeded (m or rad); 0 within them.
    pub excess: f64,
    /// Force on b at its anchor in the last substep (N). The force on a is the opposite.
    pub force: [f64; 2],
    /// Torque on b in the last substep (N·m), besides that of the force.
    pub torque: f64,
    /// Whether the load exceeds [`Joint::break_load`].
    pub breaks: bool,
}

impl JointState {
    /// Magnitudes of the force (N) and the torque (N·m).
    pub fn load(&self) -> [f64; 2] {
        [DVec2::from(self.force).length(), self.torque.abs()]
    }
}

/// Relative pose of the two bodies of a joint.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// Vector from a's anchor to b's (m).
    pub offset: DVec2,
    /// Rotation of a, as a unit vector.
    pub rotation_a: DVec2,
    /// Angle of b relative to a, from the reference angle (rad); it counts full turns.
    pub angle: f64,
}

impl Measured {
    /// A direction in the frame of a, in world axes.
    fn turned(&self, axis: [f64; 2]) -> DVec2 {
        self.rotation_a.rotate(DVec2::from(axis).normalize())
    }
}

/// Properties of a joint type other than its rows.
pub(crate) trait Definition: JointType<Form = Form> {
    /// The optional rows it has.
    fn form(&self) -> Form;
    /// Errors: a value out of range.
    fn check(&self) -> Result<(), Error>;
    /// Mutable [`JointType::anchors`].
    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2];
    /// Sets the reference values to the current angle (rad) and distance of the anchors (m).
    fn refer(&mut self, _angle: f64, _length: f64) {}
    /// The joint's state at these poses, without its load.
    fn measure(&self, at: &Measured) -> JointState;
    /// Linear (N·s) and angular (N·m·s) impulse on b, from its kept numbers.
    fn impulse(&self, kept: &[f32], at: &Measured) -> (DVec2, f64);
}

macro_rules! of_kind {
    ($kind:expr, $joint:ident => $then:expr, else $other:expr) => {
        match $kind {
            JointKind::Revolute($joint) => $then,
            JointKind::Prismatic($joint) => $then,
            JointKind::Distance($joint) => $then,
            JointKind::Weld($joint) => $then,
            JointKind::Wheel($joint) => $then,
            JointKind::Motor($joint) => $then,
            JointKind::Mouse($joint) => $then,
            JointKind::Filter => $other,
        }
    };
}
pub(crate) use of_kind;

impl JointKind {
    /// Name in files.
    pub fn name(&self) -> &'static str {
        match self {
            JointKind::Revolute(_) => "revolute",
            JointKind::Prismatic(_) => "prismatic",
            JointKind::Distance(_) => "distance",
            JointKind::Weld(_) => "weld",
            JointKind::Wheel(_) => "wheel",
            JointKind::Motor(_) => "motor",
            JointKind::Mouse(_) => "mouse",
            JointKind::Filter => "filter",
        }
    }

    /// Errors: a value out of range, with its path.
    pub fn check(&self) -> Result<(), Error> {
        of_kind!(self, joint => joint.check().map_err(|e| e.within(self.name())), else Ok(()))
    }

    /// The optional rows it has.
    pub fn form(&self) -> Form {
        of_kind!(self, joint => joint.form(), else Form::default())
    }

    /// Anchors in the frames of a and b (m).
    pub fn anchors(&self) -> [[f64; 2]; 2] {
        of_kind!(self, joint => joint.anchors(), else [[0.0; 2]; 2])
    }

    /// The joint that is solved in its place: a hinge or slider whose limits leave no room is a weld.
    pub(crate) fn solved(&self) -> Cow<'_, JointKind> {
        let weld = |anchor_a, anchor_b, reference_angle| {
            Cow::Owned(JointKind::Weld(Weld { anchor_a, anchor_b, reference_angle, ..Weld::default() }))
        };
        match self {
            JointKind::Revolute(Revolute {
                anchor_a,
                anchor_b,
                reference_angle,
                limits: Some([l, u]),
                ..
            }) if l == u => weld(*anchor_a, *anchor_b, reference_angle + l),
            JointKind::Prismatic(Prismatic {
                anchor_a,
                anchor_b,
                axis,
                reference_angle,
                limits: Some([l, u]),
                ..
            }) if l == u => {
                let anchor_a = DVec2::from(*anchor_a) + *l * DVec2::from(*axis).normalize();
                weld(anchor_a.to_array(), *anchor_b, *reference_angle)
            }
            _ => Cow::Borrowed(self),
        }
    }

    pub(crate) fn measure(&self, at: &Measured) -> JointState {
        of_kind!(self, joint => joint.measure(at), else JointState { angle: at.angle, ..JointState::default() })
    }

    pub(crate) fn impulse(&self, kept: &[f32], at: &Measured) -> (DVec2, f64) {
        of_kind!(self, joint => joint.impulse(kept, at), else (DVec2::ZERO, 0.0))
    }
}

impl Joint {
    /// Bodies a and b.
    pub(crate) fn ends(&self) -> [BodyHandle; 2] {
        [self.a, self.b]
    }

    /// A joint of kind `kind`; its two bodies do not collide with each other.
    pub fn new(a: BodyHandle, b: BodyHandle, kind: JointKind) -> Self {
        Joint { a, b, collide_connected: false, break_load: None, at: None, kind }
    }

    /// A hinge.
    pub fn revolute(a: BodyHandle, b: BodyHandle) -> Self {
        Joint::new(a, b, JointKind::Revolute(Revolute::default()))
    }

    /// A slider along `axis`, given in the frame of a.
    pub fn prismatic(a: BodyHandle, b: BodyHandle, axis: [f64; 2]) -> Self {
        Joint::new(a, b, JointKind::Prismatic(Prismatic { axis, ..Prismatic::default() }))
    }

    /// A rod between two points, given in world coordinates (m).
    pub fn distance(a: BodyHandle, b: BodyHandle, points: [[f64; 2]; 2]) -> Self {
        Joint { at: Some(points), ..Joint::new(a, b, JointKind::Distance(Distance::default())) }
    }

    /// A weld: b does not move relative to a.
    pub fn weld(a: BodyHandle, b: BodyHandle) -> Self {
        Joint::new(a, b, JointKind::Weld(Weld::default()))
    }

    /// A wheel b with a suspension along `axis`, given in the frame of a.
    pub fn wheel(a: BodyHandle, b: BodyHandle, axis: [f64; 2]) -> Self {
        Joint::new(a, b, JointKind::Wheel(Wheel { axis, ..Wheel::default() }))
    }

    /// A drive, of bounded force (N) and torque (N·m), to a pose of b relative to a.
    pub fn motor_joint(a: BodyHandle, b: BodyHandle, max_force: f64, max_torque: f64) -> Self {
        Joint::new(a, b, JointKind::Motor(MotorJoint { max_force, max_torque, ..MotorJoint::default() }))
    }

    /// A spring of bounded force (N) that pulls the world point `point` of body b to a target. The target
    /// starts at `point`. Body a should not move.
    pub fn mouse(a: BodyHandle, b: BodyHandle, point: [f64; 2], max_force: f64) -> Self {
        let mouse = Mouse { target: point, max_force, ..Mouse::default() };
        Joint { at: Some([point; 2]), ..Joint::new(a, b, JointKind::Mouse(mouse)) }
    }

    /// No constraint: the two bodies just do not collide.
    pub fn filter(a: BodyHandle, b: BodyHandle) -> Self {
        Joint::new(a, b, JointKind::Filter)
    }

    /// Places both anchors at a world point (m). The angle of the bodies when the joint is added is the
    /// reference.
    pub fn anchor(self, point: [f64; 2]) -> Self {
        Joint { at: Some([point; 2]), ..self }
    }

    /// Lets the two bodies collide with each other.
    pub fn colliding(self) -> Self {
        Joint { collide_connected: true, ..self }
    }

    /// Sets limits of the angle (rad), of the displacement along the axis (m) or of the length (m). Errors: a kind
    /// without limits.
    pub fn limits(mut self, lower: f64, upper: f64) -> Result<Self, Error> {
        let limits = Some([lower, upper]);
        match &mut self.kind {
            JointKind::Revolute(joint) => joint.limits = limits,
            JointKind::Prismatic(joint) => joint.limits = limits,
            JointKind::Distance(joint) => joint.limits = limits,
            JointKind::Wheel(joint) => joint.limits = limits,
            other => return Err(Error::invalid(other.name(), "has no limits")),
        }
        Ok(self)
    }

    /// Sets the speed (rad/s or m/s) and maximum torque or force (N·m or N) of the motor. Errors: a kind without
    /// a motor.
    pub fn motor(mut self, speed: f64, max: f64) -> Result<Self, Error> {
        let motor = Some(Motor { speed, max });
        match &mut self.kind {
            JointKind::Revolute(joint) => joint.motor = motor,
            JointKind::Prismatic(joint) => joint.motor = motor,
            JointKind::Distance(joint) => joint.motor = motor,
            JointKind::Wheel(joint) => joint.motor = motor,
            other => return Err(Error::invalid(other.name(), "has no motor")),
        }
        Ok(self)
    }

    /// Sets the frequency (Hz) and damping ratio (1) of the springs. Errors: a filter.
    pub fn spring(mut self, hertz: f64, damping_ratio: f64) -> Result<Self, Error> {
        let spring = Spring { hertz, damping_ratio, rest: 0.0 };
        match &mut self.kind {
            JointKind::Revolute(joint) => joint.spring = Some(spring),
            JointKind::Prismatic(joint) => joint.spring = Some(spring),
            JointKind::Distance(joint) => joint.spring = Some(spring),
            JointKind::Weld(joint) => (joint.linear, joint.angular) = (Some(spring), Some(spring)),
            JointKind::Wheel(joint) => joint.spring = Some(spring),
            JointKind::Motor(joint) => joint.spring = spring,
            JointKind::Mouse(joint) => joint.spring = spring,
            JointKind::Filter => return Err(Error::invalid("filter", "has no spring")),
        }
        Ok(self)
    }

    /// The joint with its frames computed from the world points in `at`.
    pub(crate) fn placed(&self, bodies: &Bodies) -> Joint {
        let mut joint = self.clone();
        let Some(points) = joint.at.take() else { return joint };
        let ends = [self.a.index(), self.b.index()];
        let local = |k: usize| {
            let [x, y] = bodies.origin(ends[k]);
            let rotation = bodies.pose(ends[k]).rotation.as_dvec2();
            let point = DVec2::new(points[k][0] - x, points[k][1] - y);
            [rotation.dot(point), rotation.perp_dot(point)]
        };
        let [from, to] = points.map(DVec2::from);
        let angle = f64::from(bodies.angle(ends[1])) - f64::from(bodies.angle(ends[0]));
        of_kind!(&mut joint.kind, kind => {
            let [a, b] = kind.anchors_mut();
            (*a, *b) = (local(0), local(1));
            kind.refer(angle, (to - from).length());
        }, else {});
        joint
    }
}

/// Relative pose of the ends of a joint, from full-precision positions.
pub(crate) fn measured(bodies: &Bodies, ends: [usize; 2], anchors: [[f64; 2]; 2], angle: f64) -> Measured {
    let anchor = |k: usize| {
        let pose = bodies.pose(ends[k]);
        let offset = DVec2::from(anchors[k]) - bodies.local_center[ends[k]].as_dvec2();
        DVec2::from(bodies.center(ends[k])) + pose.rotation.as_dvec2().rotate(offset)
    };
    Measured { offset: anchor(1) - anchor(0), rotation_a: bodies.pose(ends[0]).rotation.as_dvec2(), angle }
}

/// How far `value` exceeds `limits`.
fn excess(limits: Option<[f64; 2]>, value: f64) -> f64 {
    limits.map_or(0.0, |[lower, upper]| (lower - value).max(value - upper).max(0.0))
}

/// `axis`, normalized.
fn unit(axis: [f64; 2]) -> Vec2 {
    DVec2::from(axis).normalize_or_zero().as_vec2()
}

fn check_anchors(a: [f64; 2], b: [f64; 2]) -> Result<(), Error> {
    finite_pair("anchor_a", a)?;
    finite_pair("anchor_b", b)
}

fn check_axis(axis: [f64; 2]) -> Result<(), Error> {
    finite_pair("axis", axis)?;
    if unit(axis) == Vec2::ZERO {
        return Err(Error::invalid("axis", "must have a direction, is [0, 0]"));
    }
    Ok(())
}

fn check_limits(limits: Option<[f64; 2]>) -> Result<(), Error> {
    let Some([lower, upper]) = limits else { return Ok(()) };
    finite_pair("limits", [lower, upper])?;
    if lower > upper {
        return Err(Error::invalid(
            "limits",
            format!("lower must not be above upper, is [{lower}, {upper}]"),
        ));
    }
    Ok(())
}

fn check_not_negative(place: &str, value: f64) -> Result<(), Error> {
    finite(place, value)?;
    if value < 0.0 {
        return Err(Error::invalid(place, format!("must not be negative, is {value}")));
    }
    Ok(())
}
