//! Joints: what they are and what they are made of. One file per type; `constraints/joints` solves them.
//!
//! ```
//! # use simpulse_engine as simpulse;
//! use simpulse::engine::bodies::{BodyDef, ShapeDef};
//! use simpulse::engine::{joints::Joint, solvers, world::{Settings, World}};
//!
//! // A pendulum of 1 m, released from the side.
//! let mut world = World::new(Settings::new(solvers::find("shim")?));
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

use crate::engine::bodies::def::{finite, finite_pair};
use crate::engine::bodies::{Bodies, BodyHandle};
use crate::engine::constraints::joints::JointType;
use crate::engine::error::Error;
use glam::{DVec2, Vec2};

/// Name of a joint, valid until it is removed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct JointHandle {
    pub(crate) index: u32,
    pub(crate) generation: u32,
}

impl JointHandle {
    /// Place among all joints that a world has had.
    pub fn index(self) -> usize {
        self.index as usize
    }
}

/// A joint between two bodies.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Joint {
    /// The body in whose frame axes are.
    pub a: BodyHandle,
    /// The other one.
    pub b: BodyHandle,
    /// Whether the two bodies collide with each other.
    pub collide_connected: bool,
    /// Load from which on [`JointState::breaks`] is set (N, N·m); joints do not break by themselves.
    pub break_load: Option<[f64; 2]>,
    /// Points of the world (m) where the anchors of a and b are, from which frames are taken as the joint is added; none
    /// if they are as `kind` has them.
    pub at: Option<[[f64; 2]; 2]>,
    /// What it holds.
    pub kind: JointKind,
}

/// What a joint holds.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum JointKind {
    /// A hinge.
    Revolute(Revolute),
    /// A slider.
    Prismatic(Prismatic),
    /// A rod, a rope or a spring between two points.
    Distance(Distance),
    /// No motion.
    Weld(Weld),
    /// A slider with a hinge: the suspension of a wheel.
    Wheel(Wheel),
    /// A drive to a pose, of bounded force.
    Motor(MotorJoint),
    /// A spring to a point of the world.
    Mouse(Mouse),
    /// Nothing: the bodies do not collide.
    Filter,
}

/// Which rows the joints of a group have besides those of their type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Form {
    /// A spring; of a weld, that of its linear rows.
    pub spring: bool,
    /// A motor; of a weld, the spring of its angle.
    pub motor: bool,
    /// Limits.
    pub limits: bool,
}

/// State of a joint after a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointState {
    /// Size of the error of what is held along a line (m).
    pub gap: f64,
    /// Error of the angle, where it is held (rad).
    pub lean: f64,
    /// Angle of b against a from the reference, counted on from turn to turn (rad).
    pub angle: f64,
    /// Way of b's anchor along the axis, or length of the joint (m).
    pub translation: f64,
    /// How far limits are exceeded (m or rad); 0 within them.
    pub excess: f64,
    /// Force (N) and torque (N·m) of the last substep.
    pub load: [f64; 2],
    /// Whether the load is above [`Joint::break_load`].
    pub breaks: bool,
}

/// Poses of the two bodies of a joint.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    /// From a's anchor to b's (m).
    pub way: DVec2,
    /// Rotation of a, as a unit vector.
    pub rotation_a: DVec2,
    /// Angle of b against a (rad), counted on.
    pub angle: f64,
}

/// What every type of joint says of itself besides its rows.
pub(crate) trait Definition: JointType<Form = Form> {
    /// Which rows it has.
    fn form(&self) -> Form;
    /// Whether its values are within their ranges.
    fn check(&self) -> Result<(), Error>;
    /// [`JointType::anchors`], to write.
    fn anchors_mut(&mut self) -> [&mut [f64; 2]; 2];
    /// Takes angle (rad) and length (m) between bodies as they are for its reference.
    fn refer(&mut self, _angle: f64, _length: f64) {}
    /// Its errors.
    fn measure(&self, at: &Measured) -> JointState;
    /// Impulses of force (N·s) and of torque (N·m·s) among its kept numbers.
    fn load(&self, kept: &[f32]) -> [f64; 2];
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
    /// Its name in files.
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

    /// Errors: a value out of its range, with its place.
    pub fn check(&self) -> Result<(), Error> {
        of_kind!(self, joint => joint.check().map_err(|e| e.within(self.name())), else Ok(()))
    }

    /// Which rows it has.
    pub fn form(&self) -> Form {
        of_kind!(self, joint => joint.form(), else Form::default())
    }

    /// Anchors in the frames of a and b (m).
    pub fn anchors(&self) -> [[f64; 2]; 2] {
        of_kind!(self, joint => joint.anchors(), else [[0.0; 2]; 2])
    }

    pub(crate) fn measure(&self, at: &Measured) -> JointState {
        of_kind!(self, joint => joint.measure(at), else JointState { angle: at.angle, ..JointState::default() })
    }

    pub(crate) fn load(&self, kept: &[f32]) -> [f64; 2] {
        of_kind!(self, joint => joint.load(kept), else [0.0; 2])
    }
}

impl Joint {
    /// A joint of this kind between two bodies that do not collide.
    pub fn new(a: BodyHandle, b: BodyHandle, kind: JointKind) -> Self {
        Joint { a, b, collide_connected: false, break_load: None, at: None, kind }
    }

    /// A hinge.
    pub fn revolute(a: BodyHandle, b: BodyHandle) -> Self {
        Joint::new(a, b, JointKind::Revolute(Revolute::default()))
    }

    /// A slider along `axis`, in the frame of a.
    pub fn prismatic(a: BodyHandle, b: BodyHandle, axis: [f64; 2]) -> Self {
        Joint::new(a, b, JointKind::Prismatic(Prismatic { axis, ..Prismatic::default() }))
    }

    /// A rod between two points of the world (m).
    pub fn distance(a: BodyHandle, b: BodyHandle, points: [[f64; 2]; 2]) -> Self {
        Joint { at: Some(points), ..Joint::new(a, b, JointKind::Distance(Distance::default())) }
    }

    /// No motion of b against a.
    pub fn weld(a: BodyHandle, b: BodyHandle) -> Self {
        Joint::new(a, b, JointKind::Weld(Weld::default()))
    }

    /// A wheel b with a suspension along `axis`, in the frame of a.
    pub fn wheel(a: BodyHandle, b: BodyHandle, axis: [f64; 2]) -> Self {
        Joint::new(a, b, JointKind::Wheel(Wheel { axis, ..Wheel::default() }))
    }

    /// A drive of bounded force (N) and torque (N·m) to the pose that b has against a.
    pub fn motor_joint(a: BodyHandle, b: BodyHandle, max_force: f64, max_torque: f64) -> Self {
        Joint::new(a, b, JointKind::Motor(MotorJoint { max_force, max_torque, ..MotorJoint::default() }))
    }

    /// A spring of bounded force (N) from `point` of the world on body b to a target, at first the same; a is a body
    /// that does not move.
    pub fn mouse(a: BodyHandle, b: BodyHandle, point: [f64; 2], max_force: f64) -> Self {
        let mouse = Mouse { target: point, max_force, ..Mouse::default() };
        Joint { at: Some([point; 2]), ..Joint::new(a, b, JointKind::Mouse(mouse)) }
    }

    /// Two bodies that do not collide.
    pub fn filter(a: BodyHandle, b: BodyHandle) -> Self {
        Joint::new(a, b, JointKind::Filter)
    }

    /// At this point of the world (m), at the angle that the bodies have.
    pub fn anchor(self, point: [f64; 2]) -> Self {
        Joint { at: Some([point; 2]), ..self }
    }

    /// The two bodies collide.
    pub fn colliding(self) -> Self {
        Joint { collide_connected: true, ..self }
    }

    /// Within limits of the angle (rad), the way along the axis (m) or the length (m), where the kind has them.
    pub fn limits(mut self, lower: f64, upper: f64) -> Self {
        let limits = Some([lower, upper]);
        match &mut self.kind {
            JointKind::Revolute(joint) => joint.limits = limits,
            JointKind::Prismatic(joint) => joint.limits = limits,
            JointKind::Distance(joint) => joint.limits = limits,
            JointKind::Wheel(joint) => joint.limits = limits,
            JointKind::Weld(_) | JointKind::Motor(_) | JointKind::Mouse(_) | JointKind::Filter => {}
        }
        self
    }

    /// With a motor of this speed (rad/s or m/s) and greatest torque or force (N·m or N), where the kind has one.
    pub fn motor(mut self, speed: f64, max: f64) -> Self {
        let motor = Some(Motor { speed, max });
        match &mut self.kind {
            JointKind::Revolute(joint) => joint.motor = motor,
            JointKind::Prismatic(joint) => joint.motor = motor,
            JointKind::Distance(joint) => joint.motor = motor,
            JointKind::Wheel(joint) => joint.motor = motor,
            JointKind::Weld(_) | JointKind::Motor(_) | JointKind::Mouse(_) | JointKind::Filter => {}
        }
        self
    }

    /// With a spring of this frequency (Hz) and damping ratio, where the kind has one.
    pub fn spring(mut self, hertz: f64, damping_ratio: f64) -> Self {
        let spring = Spring { hertz, damping_ratio, rest: 0.0 };
        match &mut self.kind {
            JointKind::Revolute(joint) => joint.spring = Some(spring),
            JointKind::Prismatic(joint) => joint.spring = Some(spring),
            JointKind::Distance(joint) => joint.spring = Some(spring),
            JointKind::Weld(joint) => (joint.linear, joint.angular) = (Some(spring), Some(spring)),
            JointKind::Wheel(joint) => joint.spring = Some(spring),
            JointKind::Motor(joint) => joint.spring = spring,
            JointKind::Mouse(joint) => joint.spring = spring,
            JointKind::Filter => {}
        }
        self
    }

    /// Takes frames from the points of the world that were given.
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

/// Poses of the ends of a joint, from full positions.
pub(crate) fn measured(bodies: &Bodies, ends: [usize; 2], anchors: [[f64; 2]; 2], angle: f64) -> Measured {
    let anchor = |k: usize| {
        let pose = bodies.pose(ends[k]);
        let offset = DVec2::from(anchors[k]) - bodies.local_center[ends[k]].as_dvec2();
        DVec2::from(bodies.center(ends[k])) + pose.rotation.as_dvec2().rotate(offset)
    };
    Measured { way: anchor(1) - anchor(0), rotation_a: bodies.pose(ends[0]).rotation.as_dvec2(), angle }
}

/// How far `value` is beyond `limits`.
fn excess(limits: Option<[f64; 2]>, value: f64) -> f64 {
    limits.map_or(0.0, |[lower, upper]| (lower - value).max(value - upper).max(0.0))
}

/// `axis` (1) as a unit vector.
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
