//! Joints of scenes: `{"revolute": {"a": 3, "b": 4, "anchor_a": [0.5, 0], "limits": [-1, 1]}}`.

use crate::engine::joints::{Distance, JointKind, MotorJoint, Mouse, Prismatic, Revolute, Weld, Wheel};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A joint of a scene. In a file, an object whose one key is the kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "JointObject", into = "JointObject")]
pub struct SceneJoint {
    /// Index of body a.
    pub a: usize,
    /// Index of body b.
    pub b: usize,
    /// Whether the two bodies collide with each other.
    pub collide_connected: bool,
    /// Force (N) and torque (N·m) above which the joint counts as broken.
    pub break_load: Option<[f64; 2]>,
    /// Type of the joint, with its values.
    pub kind: JointKind,
}

impl SceneJoint {
    /// A joint between the bodies with these indices, which do not collide with each other.
    pub fn new(a: usize, b: usize, kind: JointKind) -> Self {
        SceneJoint { a, b, collide_connected: false, break_load: None, kind }
    }

    /// A hinge at these points of the bodies' frames (m).
    pub fn revolute(a: usize, b: usize, anchor_a: [f64; 2], anchor_b: [f64; 2]) -> Self {
        SceneJoint::new(a, b, JointKind::Revolute(Revolute { anchor_a, anchor_b, ..Revolute::default() }))
    }

    /// The same joint with its anchors at these points of the bodies' frames (m); for hinges and welds.
    pub fn at(mut self, a: [f64; 2], b: [f64; 2]) -> Self {
        match &mut self.kind {
            JointKind::Revolute(Revolute { anchor_a, anchor_b, .. })
            | JointKind::Weld(Weld { anchor_a, anchor_b, .. }) => (*anchor_a, *anchor_b) = (a, b),
            _ => {}
        }
        self
    }
}

/// A joint in a file: an object whose one key is the kind.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum JointObject {
    Revolute(Ends<Revolute>),
    Prismatic(Ends<Prismatic>),
    Distance(Ends<Distance>),
    Weld(Ends<Weld>),
    Wheel(Ends<Wheel>),
    Motor(Ends<MotorJoint>),
    Mouse(Ends<Mouse>),
    Filter(Ends<Nothing>),
}

/// The bodies of a joint and what all kinds have, beside the values of its kind.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Ends<T> {
    /// Index of body a, in whose frame axes are.
    a: usize,
    /// Index of body b.
    b: usize,
    /// Whether the two bodies collide with each other.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    collide_connected: bool,
    /// Force (N) and torque (N·m) above which the joint counts as broken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    break_load: Option<[f64; 2]>,
    #[serde(flatten)]
    of_kind: T,
}

/// A joint without values of its own.
#[derive(Serialize, Deserialize, JsonSchema)]
struct Nothing {}

impl<T> Ends<T> {
    fn joint(self, kind: impl Fn(T) -> JointKind) -> SceneJoint {
        let Ends { a, b, collide_connected, break_load, of_kind } = self;
        SceneJoint { a, b, collide_connected, break_load, kind: kind(of_kind) }
    }
}

impl From<JointObject> for SceneJoint {
    fn from(object: JointObject) -> Self {
        match object {
            JointObject::Revolute(ends) => ends.joint(JointKind::Revolute),
            JointObject::Prismatic(ends) => ends.joint(JointKind::Prismatic),
            JointObject::Distance(ends) => ends.joint(JointKind::Distance),
            JointObject::Weld(ends) => ends.joint(JointKind::Weld),
            JointObject::Wheel(ends) => ends.joint(JointKind::Wheel),
            JointObject::Motor(ends) => ends.joint(JointKind::Motor),
            JointObject::Mouse(ends) => ends.joint(JointKind::Mouse),
            JointObject::Filter(ends) => ends.joint(|_| JointKind::Filter),
        }
    }
}

impl From<SceneJoint> for JointObject {
    fn from(joint: SceneJoint) -> Self {
        let SceneJoint { a, b, collide_connected, break_load, kind } = joint;
        macro_rules! ends {
            ($of_kind:expr) => {
                Ends { a, b, collide_connected, break_load, of_kind: $of_kind }
            };
        }
        match kind {
            JointKind::Revolute(joint) => JointObject::Revolute(ends!(joint)),
            JointKind::Prismatic(joint) => JointObject::Prismatic(ends!(joint)),
            JointKind::Distance(joint) => JointObject::Distance(ends!(joint)),
            JointKind::Weld(joint) => JointObject::Weld(ends!(joint)),
            JointKind::Wheel(joint) => JointObject::Wheel(ends!(joint)),
            JointKind::Motor(joint) => JointObject::Motor(ends!(joint)),
            JointKind::Mouse(joint) => JointObject::Mouse(ends!(joint)),
            JointKind::Filter => JointObject::Filter(ends!(Nothing {})),
        }
    }
}
