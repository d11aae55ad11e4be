//! Scenes of other programs: files of R.U.B.E. and its library b2dJson, and of the serializer of planck.js.
//!
//! The two name the same things of Box2D differently, so each value is looked up under both names. A chain becomes
//! segments. What a scene has no place for is counted in [`Scene::left_out`].

use super::format::{
    Capsule, Circle, Geometry, PolygonGeometry, Scene, SceneBody, SceneShape, SegmentGeometry,
};
use super::joints::SceneJoint;
use crate::engine::bodies::{BodyKind, Filter};
use crate::engine::joints::{Distance, JointKind, Motor, Mouse, Prismatic, Revolute, Spring, Weld, Wheel};
use crate::engine::params::{DEFAULT_DENSITY, DEFAULT_DT};
use crate::engine::shapes::{MassProperties, combine};
use crate::lab::error::Error;
use glam::DVec2;
use serde_json::Value;
use std::collections::BTreeMap;

/// Shortest edge of a chain that becomes a segment (m).
const SHORTEST: f64 = 1e-6;

/// The contents of a file of another program; `None` if it is none.
pub(super) fn of_others(text: &str) -> Option<Value> {
    // Saves reading scenes of simpulse twice.
    if !text.contains("\"fixture") {
        return None;
    }
    serde_json::from_str(text).ok().filter(is_foreign)
}

fn is_foreign(file: &Value) -> bool {
    let has = |key: &str| file.get(key).is_some_and(Value::is_array);
    let of_planck = |body: &Value| body.get("fixtures").is_some() || body.get("refType").is_some();
    has("body")
        || file.get("bodies").and_then(Value::as_array).is_some_and(|bodies| bodies.iter().any(of_planck))
        || file.get(0).is_some_and(|world| world.get("bodies").is_some())
}

/// A value of a file, with its place for errors.
#[derive(Clone)]
struct Node<'a> {
    value: &'a Value,
    at: String,
    /// The list that references point into.
    all: &'a Value,
}

impl<'a> Node<'a> {
    fn refuse<T>(&self, must: &str) -> Result<T, Error> {
        let text: String = self.value.to_string().chars().take(40).collect();
        Err(Error::invalid(self.at.clone(), format!("must be {must}, is {text}")))
    }

    fn to(&self, value: &'a Value, at: String) -> Self {
        // `{"refIndex": 3, "refType": "Body"}` stands for an entry of the list.
        let place = value.get("refIndex").and_then(Value::as_u64);
        let value = place.and_then(|i| self.all.get(i as usize)).unwrap_or(value);
        Node { value, at, all: self.all }
    }

    /// The value under the first of these names that the object has.
    fn get(&self, names: &[&str]) -> Option<Self> {
        let (name, value) = names.iter().find_map(|&name| Some((name, self.value.get(name)?)))?;
        Some(self.to(value, format!("{}.{name}", self.at)))
    }

    fn list(&self, names: &[&str]) -> Result<Vec<Self>, Error> {
        let Some(list) = self.get(names) else { return Ok(Vec::new()) };
        let Some(values) = list.value.as_array() else { return list.refuse("a list") };
        Ok(values.iter().enumerate().map(|(i, value)| list.to(value, format!("{}[{i}]", list.at))).collect())
    }

    fn number(&self) -> Result<f64, Error> {
        // b2dJson can write the bits of a number in hexadecimal.
        let bits =
            |text: &str| u32::from_str_radix(text, 16).ok().map(|bits| f64::from(f32::from_bits(bits)));
        let number = self.value.as_f64().or_else(|| self.value.as_str().and_then(bits));
        number.map_or_else(|| self.refuse("a number"), Ok)
    }

    fn real(&self, names: &[&str], default: f64) -> Result<f64, Error> {
        self.get(names).map_or(Ok(default), |node| node.number())
    }

    fn whole(&self, names: &[&str], default: i64) -> Result<i64, Error> {
        let Some(node) = self.get(names) else { return Ok(default) };
        node.value.as_i64().map_or_else(|| node.refuse("a whole number"), Ok)
    }

    fn flag(&self, names: &[&str]) -> bool {
        self.get(names)
            .is_some_and(|node| node.value.as_bool() == Some(true) || node.value.as_i64() == Some(1))
    }

    /// A vector: `{"x": 1, "y": 2}`, or one number for both coordinates.
    fn vector(&self, names: &[&str], default: [f64; 2]) -> Result<[f64; 2], Error> {
        let Some(node) = self.get(names) else { return Ok(default) };
        if node.value.is_object() {
            return Ok([node.real(&["x"], 0.0)?, node.real(&["y"], 0.0)?]);
        }
        node.number().map(|both| [both; 2])
    }

    /// `{"x": […], "y": […]}`, or a list of vectors.
    fn points(&self) -> Result<Vec<[f64; 2]>, Error> {
        let Some(node) = self.get(&["vertices"]) else { return self.refuse("a shape with vertices") };
        if node.value.is_array() {
            let points = self.list(&["vertices"])?;
            return points.iter().map(|p| Ok([p.real(&["x"], 0.0)?, p.real(&["y"], 0.0)?])).collect();
        }
        let (x, y) = (node.list(&["x"])?, node.list(&["y"])?);
        x.iter().zip(&y).map(|(x, y)| Ok([x.number()?, y.number()?])).collect()
    }
}

/// Counts of what a scene leaves out.
#[derive(Default)]
struct LeftOut(BTreeMap<String, usize>);

impl LeftOut {
    fn add(&mut self, what: impl Into<String>) {
        *self.0.entry(what.into()).or_default() += 1;
    }

    /// What the author of a file noted about a part of it.
    fn properties(&mut self, part: &Node<'_>) -> Result<(), Error> {
        part.list(&["customProperties"])?.iter().for_each(|_| self.add("custom properties"));
        Ok(())
    }
}

/// Reads a scene of another program. Errors: a value of another type than its name requires, with its place; no
/// more is checked.
pub(super) fn scene(file: &Value, name: &str) -> Result<Scene, Error> {
    let root = Node { value: file.get(0).unwrap_or(file), at: "world".to_string(), all: file };
    let mut left_out = LeftOut::default();
    let nodes = root.list(&["body", "bodies"])?;
    let bodies = nodes.iter().map(|node| body(node, &mut left_out)).collect::<Result<Vec<_>, _>>()?;
    let mut joints = Vec::new();
    for node in root.list(&["joint", "joints"])? {
        joints.extend(joint(&node, &nodes, &bodies, &mut left_out)?);
    }
    for image in root.list(&["image"])? {
        left_out.add("images");
        left_out.properties(&image)?;
    }
    left_out.properties(&root)?;
    let rate = root.real(&["stepsPerSecond"], 0.0)?;
    Ok(Scene {
        gravity: root.vector(&["gravity"], [0.0; 2])?,
        dt: if rate > 0.0 { 1.0 / rate } else { DEFAULT_DT },
        joints,
        left_out: left_out.0.into_iter().map(|(what, count)| format!("{what} ({count})")).collect(),
        ..Scene::new(name, bodies)
    })
}

fn is_active(body: &Node<'_>) -> bool {
    body.get(&["active"]).is_none_or(|active| active.value.as_bool() != Some(false))
}

fn body(node: &Node<'_>, left_out: &mut LeftOut) -> Result<SceneBody, Error> {
    let kind = match node.get(&["type"]).map(|kind| kind.value.clone()) {
        Some(Value::String(kind)) if kind == "dynamic" => BodyKind::Dynamic,
        Some(Value::String(kind)) if kind == "kinematic" => BodyKind::Kinematic,
        Some(Value::Number(kind)) if kind.as_i64() == Some(2) => BodyKind::Dynamic,
        Some(Value::Number(kind)) if kind.as_i64() == Some(1) => BodyKind::Kinematic,
        _ => BodyKind::Static,
    };
    let is_active = is_active(node);
    // Nothing moves a body that is not active.
    let kind = if is_active { kind } else { BodyKind::Static };
    left_out.properties(node)?;
    if !is_active {
        left_out.add("bodies that are not active");
    }
    let (mut shapes, mut masses, mut groups) = (Vec::new(), Vec::new(), Vec::new());
    for fixture in node.list(&["fixture", "fixtures"])?.iter().filter(|_| is_active) {
        left_out.properties(fixture)?;
        if fixture.flag(&["sensor", "isSensor"]) {
            left_out.add("sensors");
            continue;
        }
        groups.push(fixture.whole(&["filter-groupIndex", "filterGroupIndex"], 0)?);
        let density = fixture.real(&["density"], 0.0)?;
        for geometry in geometries(fixture, left_out)? {
            let shape = SceneShape {
                geometry,
                // A density of zero is one for shapes only: the mass of the body is given.
                density: if density > 0.0 { density } else { DEFAULT_DENSITY },
                friction: fixture.real(&["friction"], 0.0)?,
                restitution: fixture.real(&["restitution"], 0.0)?.clamp(0.0, 1.0),
                filter: Filter {
                    category: fixture.whole(&["filter-categoryBits", "filterCategoryBits"], 1)? as u16 as u64,
                    mask: fixture.whole(&["filter-maskBits", "filterMaskBits"], 0xFFFF)? as u16 as u64,
                },
            };
            masses.push(
                super::check::shape_def(&shape).map_err(|e| e.within(&fixture.at))?.shape.mass(density),
            );
            shapes.push(shape);
        }
    }
    let group = groups.first().copied().unwrap_or(0);
    let is_one = group <= 0 && groups.iter().all(|&other| other == group);
    if !is_one {
        left_out.add("groups of single or always colliding fixtures");
    }
    let mut of_shapes = combine(&masses);
    let mass = node.real(&["massData-mass"], 0.0)?;
    if mass > 0.0 {
        let center = node.vector(&["massData-center"], [0.0; 2])?;
        // Box2D's inertia is about the origin of the body.
        let inertia = node.real(&["massData-I"], 0.0)? - mass * (center[0].powi(2) + center[1].powi(2));
        of_shapes = MassProperties { mass, center, inertia };
    } else if of_shapes.mass <= 0.0 {
        of_shapes.mass = 1.0;
    }
    let is_dynamic = kind == BodyKind::Dynamic;
    let given = is_dynamic && (mass > 0.0 || masses.iter().any(|part| part.mass <= 0.0) || shapes.is_empty());
    Ok(SceneBody {
        angle: node.real(&["angle"], 0.0)?,
        velocity: node.vector(&["linearVelocity"], [0.0; 2])?,
        angular_velocity: node.real(&["angularVelocity"], 0.0)?,
        gravity_scale: node.real(&["gravityScale"], 1.0)?,
        linear_damping: node.real(&["linearDamping"], 0.0)?,
        angular_damping: node.real(&["angularDamping"], 0.0)?,
        group: if is_one { group as i32 } else { 0 },
        bullet: node.flag(&["bullet"]),
        fixed_rotation: is_dynamic && (node.flag(&["fixedRotation"]) || of_shapes.inertia <= 0.0),
        mass: given.then_some(of_shapes),
        shapes,
        ..SceneBody::new(kind, node.vector(&["position"], [0.0; 2])?, SceneShape::disc(1.0))
    })
}

/// The shapes of a fixture.
fn geometries(fixture: &Node<'_>, left_out: &mut LeftOut) -> Result<Vec<Geometry>, Error> {
    let shape = fixture.get(&["shape"]);
    let named = |name: &str| {
        let is = |shape: &&Node<'_>| shape.value.get("type").and_then(Value::as_str) == Some(name);
        fixture.get(&[name]).or_else(|| shape.as_ref().filter(is).cloned())
    };
    let segments = |points: &[[f64; 2]]| {
        let edges = points.windows(2).map(|ends| (ends[0], ends[1]));
        let edges = edges.filter(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]) > SHORTEST);
        edges.map(|(a, b)| Geometry::Segment(SegmentGeometry { a, b })).collect()
    };
    if let Some(circle) = named("circle") {
        let center = circle.vector(&["center", "p"], [0.0; 2])?;
        return Ok(vec![Geometry::Circle(Circle { center, radius: circle.real(&["radius"], 0.0)? })]);
    }
    if let Some(polygon) = named("polygon") {
        let points = polygon.points()?;
        return Ok(match points[..] {
            // Older files write edges as polygons of two vertices.
            [a, b] => vec![Geometry::Segment(SegmentGeometry { a, b })],
            _ => vec![Geometry::Polygon(PolygonGeometry { points, radius: 0.0 })],
        });
    }
    if let Some(capsule) = named("capsule") {
        let [a, b] = [["center1"], ["center2"]].map(|name| capsule.vector(&name, [0.0; 2]));
        return Ok(vec![Geometry::Capsule(Capsule {
            a: a?,
            b: b?,
            radius: capsule.real(&["radius"], 0.0)?,
        })]);
    }
    if let Some(edge) = named("edge") {
        let [a, b] = [["vertex1"], ["vertex2"]].map(|name| edge.vector(&name, [0.0; 2]));
        return Ok(segments(&[a?, b?]));
    }
    if let Some(chain) = named("chain").or_else(|| named("loop")) {
        let mut points = chain.points()?;
        if chain.flag(&["isLoop"]) || fixture.get(&["loop"]).is_some() {
            points.extend(points.first().copied());
        }
        return Ok(segments(&points));
    }
    left_out.add("fixtures of unknown shape");
    Ok(Vec::new())
}

fn joint(
    node: &Node<'_>,
    nodes: &[Node<'_>],
    bodies: &[SceneBody],
    left_out: &mut LeftOut,
) -> Result<Option<SceneJoint>, Error> {
    left_out.properties(node)?;
    let kind = node.value.get("type").and_then(Value::as_str).unwrap_or("unknown");
    let kind = kind.trim_end_matches("-joint");
    let end = |name: &str| {
        let Some(of) = node.get(&[name]) else { return node.refuse("a joint of two bodies") };
        // A number, or a reference to a body.
        let found = nodes.iter().position(|body| std::ptr::eq(body.value, of.value));
        let index = found.or_else(|| of.value.as_u64().map(|index| index as usize));
        index.filter(|&index| index < bodies.len()).map_or_else(|| of.refuse("a body of the file"), Ok)
    };
    let [a, b] = [end("bodyA")?, end("bodyB")?];
    let zero = [0.0; 2];
    let anchor_a = node.vector(&["anchorA", "localAnchorA"], zero)?;
    let anchor_b = node.vector(&["anchorB", "localAnchorB"], zero)?;
    let reference_angle = node.real(&["refAngle", "referenceAngle"], 0.0)?;
    let axis = node.vector(&["localAxisA", "localAxis1"], [1.0, 0.0])?;
    let limits = match node.flag(&["enableLimit"]) {
        true => Some([
            node.real(&["lowerLimit", "lowerAngle", "lowerTranslation"], 0.0)?,
            node.real(&["upperLimit", "upperAngle", "upperTranslation"], 0.0)?,
        ]),
        false => None,
    };
    let motor = match node.flag(&["enableMotor"]) {
        true => Some(Motor {
            speed: node.real(&["motorSpeed"], 0.0)?,
            max: node.real(&["maxMotorTorque", "maxMotorForce"], 0.0)?,
        }),
        false => None,
    };
    let spring = Spring {
        hertz: node.real(&["frequency", "springFrequency", "frequencyHz"], 0.0)?,
        damping_ratio: node.real(&["dampingRatio", "springDampingRatio"], 0.0)?,
        rest: 0.0,
    };
    let soft = (spring.hertz > 0.0).then_some(spring);
    let kind = match kind {
        "revolute" => {
            JointKind::Revolute(Revolute { anchor_a, anchor_b, reference_angle, limits, motor, spring: None })
        }
        "prismatic" => {
            let of = Prismatic { anchor_a, anchor_b, axis, reference_angle, limits, motor, spring: None };
            JointKind::Prismatic(of)
        }
        "wheel" => JointKind::Wheel(Wheel { anchor_a, anchor_b, axis, limits, motor, spring: soft }),
        "weld" => JointKind::Weld(Weld { anchor_a, anchor_b, reference_angle, linear: None, angular: soft }),
        "distance" => {
            let length = node.real(&["length"], 1.0)?;
            JointKind::Distance(Distance { anchor_a, anchor_b, length, spring: soft, ..Distance::default() })
        }
        "rope" => {
            let length = node.real(&["maxLength"], 1.0)?;
            let limits = Some([0.0, length]);
            JointKind::Distance(Distance { anchor_a, anchor_b, length, limits, ..Distance::default() })
        }
        "mouse" => {
            let target = node.vector(&["target"], zero)?;
            let anchor_b = match node.get(&["anchorB"]) {
                // Of all anchors, only this one is a point of the world.
                Some(_) => DVec2::from_angle(-bodies[b].angle)
                    .rotate(DVec2::from(anchor_b) - DVec2::from(bodies[b].position))
                    .to_array(),
                None => node.vector(&["_localAnchorB"], anchor_b)?,
            };
            JointKind::Mouse(Mouse { target, anchor_b, spring, max_force: node.real(&["maxForce"], 0.0)? })
        }
        other => {
            left_out.add(format!("joints of kind {other}"));
            return Ok(None);
        }
    };
    if ![a, b].iter().all(|&body| is_active(&nodes[body])) {
        left_out.add("joints of bodies that are not active");
        return Ok(None);
    }
    if [a, b].iter().all(|&body| bodies[body].kind != BodyKind::Dynamic) {
        left_out.add("joints between bodies that are not dynamic");
        return Ok(None);
    }
    Ok(Some(SceneJoint {
        collide_connected: node.flag(&["collideConnected"]),
        ..SceneJoint::new(a, b, kind)
    }))
}
