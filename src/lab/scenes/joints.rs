//! Joints of scenes: `{"revolute": {"a": 3, "b": 4, "anchor_a": [0.5, 0], "limits": [-1, 1]}}`.

use crate::engine::joints::{Distance, JointKind, MotorJoint, Mouse, Prismatic, Revolute, Weld, Wheel};
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};
use std::fmt;

/// A joint of a scene. In a file, an object whose one key is the kind.
#[derive(Clone, Debug, PartialEq)]
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

/// Names of the kinds in files.
const KINDS: [&str; 8] = ["revolute", "prismatic", "distance", "weld", "wheel", "motor", "mouse", "filter"];

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

    fn read(kind: &str, mut object: Map<String, Value>) -> Result<Self, String> {
        fn take<T: DeserializeOwned>(
            object: &mut Map<String, Value>,
            key: &str,
        ) -> Result<Option<T>, String> {
            let Some(value) = object.remove(key) else { return Ok(None) };
            serde_json::from_value(value).map(Some).map_err(|e| format!("{key}: {e}"))
        }
        fn rest<T: DeserializeOwned>(object: Map<String, Value>) -> Result<T, String> {
            serde_json::from_value(Value::Object(object)).map_err(|e| e.to_string())
        }
        let body = |object: &mut Map<String, Value>, key: &str| {
            take(object, key)?.ok_or_else(|| format!("missing field `{key}`, the index of a body"))
        };
        let (a, b) = (body(&mut object, "a")?, body(&mut object, "b")?);
        let collide_connected = take(&mut object, "collide_connected")?.unwrap_or(false);
        let break_load = take(&mut object, "break_load")?;
        if let Some((key, _)) = object.iter().find(|(_, value)| value.is_null()) {
            return Err(format!("{key}: null is no value: leave it out"));
        }
        let parts = ["spring", "motor", "linear", "angular"].into_iter();
        for (key, value) in parts.filter_map(|key| Some((key, object.get(key)?))) {
            if !value.is_object() {
                return Err(format!("{key}: must be an object, is {value}"));
            }
        }
        let kind = match kind {
            "revolute" => JointKind::Revolute(rest::<Revolute>(object)?),
            "prismatic" => JointKind::Prismatic(rest::<Prismatic>(object)?),
            "distance" => JointKind::Distance(rest::<Distance>(object)?),
            "weld" => JointKind::Weld(rest::<Weld>(object)?),
            "wheel" => JointKind::Wheel(rest::<Wheel>(object)?),
            "motor" => JointKind::Motor(rest::<MotorJoint>(object)?),
            "mouse" => JointKind::Mouse(rest::<Mouse>(object)?),
            "filter" => match object.keys().next() {
                None => JointKind::Filter,
                Some(key) => return Err(format!("unknown field `{key}`: a filter has bodies only")),
            },
            _ => return Err(format!("unknown kind `{kind}`: one of {}", KINDS.join(", "))),
        };
        Ok(SceneJoint { a, b, collide_connected, break_load, kind })
    }

    fn write(&self) -> serde_json::Result<Map<String, Value>> {
        let mut object = Map::new();
        object.insert("a".into(), self.a.into());
        object.insert("b".into(), self.b.into());
        if self.collide_connected {
            object.insert("collide_connected".into(), true.into());
        }
        if let Some(load) = self.break_load {
            object.insert("break_load".into(), serde_json::to_value(load)?);
        }
        let of_kind = match &self.kind {
            JointKind::Revolute(joint) => serde_json::to_value(joint)?,
            JointKind::Prismatic(joint) => serde_json::to_value(joint)?,
            JointKind::Distance(joint) => serde_json::to_value(joint)?,
            JointKind::Weld(joint) => serde_json::to_value(joint)?,
            JointKind::Wheel(joint) => serde_json::to_value(joint)?,
            JointKind::Motor(joint) => serde_json::to_value(joint)?,
            JointKind::Mouse(joint) => serde_json::to_value(joint)?,
            JointKind::Filter => Value::Object(Map::new()),
        };
        let Value::Object(of_kind) = of_kind else { return Ok(object) };
        object.extend(of_kind.into_iter().filter(|(_, value)| !value.is_null()));
        Ok(object)
    }
}

impl Serialize for SceneJoint {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut map = to.serialize_map(Some(1))?;
        map.serialize_entry(self.kind.name(), &self.write().map_err(serde::ser::Error::custom)?)?;
        map.end()
    }
}

impl<'de> Deserialize<'de> for SceneJoint {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct JointVisitor;
        impl<'de> Visitor<'de> for JointVisitor {
            type Value = SceneJoint;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a joint, {\"revolute\": {\"a\": 0, \"b\": 1, …}}")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<SceneJoint, A::Error> {
                use serde::de::Error;
                let Some((kind, object)) = map.next_entry::<String, Map<String, Value>>()? else {
                    return Err(A::Error::custom(format!(
                        "a joint without a kind: one of {}",
                        KINDS.join(", ")
                    )));
                };
                if let Some(other) = map.next_key::<String>()? {
                    return Err(A::Error::custom(format!("a joint of two kinds, `{kind}` and `{other}`")));
                }
                SceneJoint::read(&kind, object).map_err(|e| A::Error::custom(format!("{kind}: {e}")))
            }
        }
        from.deserialize_map(JointVisitor)
    }
}
