//! The scene file: a body list in SI units, read from and written to JSON.
//!
//! A scene keeps its numbers in `f64`, as the file gives them; only
//! [`Scene::body_defs`] rounds geometry to `f32`. Writing a valid scene and
//! reading it back therefore gives the same bits.

use super::expect::Expect;
use super::joints::SceneJoint;
use super::place::place_at;
use crate::engine::bodies::BodyKind;
use crate::engine::params::{DEFAULT_DENSITY, DEFAULT_DT, DEFAULT_FRICTION, DEFAULT_GRAVITY};
use crate::lab::error::Error;
use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::path::Path;

/// Default number of steps: five seconds at the default step.
pub const DEFAULT_STEPS: u32 = 300;

/// A scene: bodies, gravity, step and number of steps, and expectations on a run.
///
/// Scenes are written in code or read from JSON (`simpulse list NAME --json` prints one):
///
/// ```
/// use simpulse::engine::{solvers, world::Settings};
/// use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};
///
/// let ground = SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(20.0, 1.0));
/// let ball = SceneBody::dynamic([0.0, 2.0], SceneShape::disc(0.5).restitution(0.8)).moving([1.0, 0.0], 0.0);
/// let scene = Scene::new("ball", vec![ground, ball]).steps(120);
/// scene.validate()?;
///
/// assert_eq!(Scene::from_json(&scene.to_json(), "ball.json".as_ref())?, scene);
/// let mut world = scene.build(Settings::new(solvers::find("shim")?))?;
/// world.step()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name in tables; not empty.
    pub name: String,
    /// Gravity (m/s²).
    #[serde(default = "default_gravity")]
    pub gravity: [f64; 2],
    /// Step (s), > 0.
    #[serde(default = "default_dt")]
    pub dt: f64,
    /// Number of steps of a run, ≥ 1.
    #[serde(default = "default_steps")]
    pub steps: u32,
    /// Size of typical bodies (m), in [`LENGTH_UNITS`](super::LENGTH_UNITS), see
    /// [`Settings::length_unit`](crate::engine::world::Settings::length_unit).
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub length_unit: f64,
    /// Conditions on a run; `None` if it is not checked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expect: Option<Expect>,
    /// Bodies, in the order of their indices in a world.
    pub bodies: Vec<SceneBody>,
    /// Joints between them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<SceneJoint>,
}

/// One body of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneBody {
    /// How it moves.
    #[serde(rename = "type")]
    pub kind: BodyKind,
    /// Origin of the body's frame (m).
    pub position: [f64; 2],
    /// Angle (rad).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub angle: f64,
    /// Velocity of the center of mass (m/s).
    #[serde(default, skip_serializing_if = "is_origin")]
    pub velocity: [f64; 2],
    /// Angular velocity (rad/s).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub angular_velocity: f64,
    /// Factor on gravity (1).
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub gravity_scale: f64,
    /// Linear damping (1/s), ≥ 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub linear_damping: f64,
    /// Angular damping (1/s), ≥ 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub angular_damping: f64,
    /// Bodies of the same non-zero group do not collide.
    #[serde(default, skip_serializing_if = "is_no_group")]
    pub group: i32,
    /// Whether dynamic bodies stop it, too, if it is fast and continuous collision is on.
    #[serde(default, skip_serializing_if = "is_false")]
    pub bullet: bool,
    /// Shapes that move as one.
    pub shapes: Vec<SceneShape>,
}

/// A shape with its surface. In a file, an object with one geometry key beside the three numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(into = "ShapeObject")]
pub struct SceneShape {
    /// Geometry in the frame of the body (m).
    pub geometry: Geometry,
    /// Density (kg/m²), > 0.
    pub density: f64,
    /// Coulomb coefficient, ≥ 0 and ≤ 10⁹; two surfaces mix as √(µa µb).
    pub friction: f64,
    /// Restitution, in [0, 1]; two surfaces mix as max(ea, eb).
    pub restitution: f64,
}

/// The area that a shape covers (m, rad).
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// `{"circle": …}`
    Circle(Circle),
    /// `{"box": …}`
    Box(Rectangle),
    /// `{"polygon": …}`
    Polygon(PolygonGeometry),
    /// `{"capsule": …}`
    Capsule(Capsule),
    /// `{"segment": …}`
    Segment(SegmentGeometry),
}

/// All points within `radius` of `center`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Circle {
    /// m
    #[serde(default, skip_serializing_if = "is_origin")]
    pub center: [f64; 2],
    /// m, > 0
    pub radius: f64,
}

/// A rectangle turned about its center, grown by `radius`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rectangle {
    /// Half width and half height (m), > 0.
    pub half: [f64; 2],
    /// m
    #[serde(default, skip_serializing_if = "is_origin")]
    pub center: [f64; 2],
    /// rad
    #[serde(default, skip_serializing_if = "is_zero")]
    pub angle: f64,
    /// m, ≥ 0
    #[serde(default, skip_serializing_if = "is_zero")]
    pub radius: f64,
}

/// A convex polygon of 3 to 8 vertices, grown by `radius`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PolygonGeometry {
    /// Vertices in either winding (m).
    pub points: Vec<[f64; 2]>,
    /// m, ≥ 0
    #[serde(default, skip_serializing_if = "is_zero")]
    pub radius: f64,
}

/// All points within `radius` of the segment a–b.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Capsule {
    /// m
    pub a: [f64; 2],
    /// m
    pub b: [f64; 2],
    /// m, > 0
    pub radius: f64,
}

/// A massless two-sided line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentGeometry {
    /// m
    pub a: [f64; 2],
    /// m
    pub b: [f64; 2],
}

/// A shape in a file. Serde cannot reject unknown keys of a flattened enum, so every geometry is an optional
/// key, and exactly one must be present.
#[derive(Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ShapeObject {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    circle: Option<Circle>,
    #[serde(default, rename = "box", skip_serializing_if = "Option::is_none")]
    rectangle: Option<Rectangle>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    polygon: Option<PolygonGeometry>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    capsule: Option<Capsule>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    segment: Option<SegmentGeometry>,
    #[serde(default = "default_density", skip_serializing_if = "is_default_density")]
    density: f64,
    #[serde(default = "default_friction", skip_serializing_if = "is_default_friction")]
    friction: f64,
    #[serde(default, skip_serializing_if = "is_zero")]
    restitution: f64,
}

impl TryFrom<ShapeObject> for SceneShape {
    type Error = String;

    fn try_from(object: ShapeObject) -> Result<Self, String> {
        let ShapeObject { circle, rectangle, polygon, capsule, segment, density, friction, restitution } =
            object;
        let given: Vec<Geometry> = [
            circle.map(Geometry::Circle),
            rectangle.map(Geometry::Box),
            polygon.map(Geometry::Polygon),
            capsule.map(Geometry::Capsule),
            segment.map(Geometry::Segment),
        ]
        .into_iter()
        .flatten()
        .collect();
        let count = given.len();
        match <[Geometry; 1]>::try_from(given) {
            Ok([geometry]) => Ok(SceneShape { geometry, density, friction, restitution }),
            Err(_) => Err(format!(
                "a shape with {count} geometries, where exactly one of circle, box, polygon, capsule, segment is needed"
            )),
        }
    }
}

/// Not `serde(try_from)`, which would report a wrong number of geometries after the whole list of shapes;
/// from inside the map it is reported at the shape.
impl<'de> Deserialize<'de> for SceneShape {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ShapeVisitor;
        impl<'de> Visitor<'de> for ShapeVisitor {
            type Value = SceneShape;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a shape")
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<SceneShape, A::Error> {
                let object = ShapeObject::deserialize(MapAccessDeserializer::new(map))?;
                object.try_into().map_err(serde::de::Error::custom)
            }
        }
        deserializer.deserialize_map(ShapeVisitor)
    }
}

impl From<SceneShape> for ShapeObject {
    fn from(shape: SceneShape) -> Self {
        let SceneShape { geometry, density, friction, restitution } = shape;
        let mut object = ShapeObject { density, friction, restitution, ..Default::default() };
        match geometry {
            Geometry::Circle(circle) => object.circle = Some(circle),
            Geometry::Box(rectangle) => object.rectangle = Some(rectangle),
            Geometry::Polygon(polygon) => object.polygon = Some(polygon),
            Geometry::Capsule(capsule) => object.capsule = Some(capsule),
            Geometry::Segment(segment) => object.segment = Some(segment),
        }
        object
    }
}

impl Scene {
    /// Reads a scene; `path` only names the text in errors.
    ///
    /// Errors: text that is not JSON of this form, with line, column and place; a value out of range
    /// ([`Scene::validate`]), with its place.
    pub fn from_json(text: &str, path: &Path) -> Result<Self, Error> {
        let failed = |message| Error::Format { path: path.to_path_buf(), message };
        // Derived code would accept a list of values in the order of the fields.
        if let Some(at) = text.find(|c: char| !c.is_whitespace())
            && text[at..].starts_with('[')
        {
            let line = text[..at].matches('\n').count() + 1;
            let column = at - text[..at].rfind('\n').map_or(0, |end| end + 1) + 1;
            let message = format!("a scene is an object, {{…}}, not a list, at line {line} column {column}");
            return Err(failed(message));
        }
        let scene: Scene = serde_json::from_str(text).map_err(|e| failed(place_at(text, &e)))?;
        scene.validate().map_err(|e| failed(e.to_string()))?;
        Ok(scene)
    }

    /// Reads a scene file. Errors: as [`Scene::from_json`], and a file that cannot be read.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(Error::io(path))?;
        Self::from_json(&text, path)
    }

    /// The scene as JSON, one body per line; defaults of bodies and shapes are left out. JSON has no NaN: it
    /// becomes `null`, which reading rejects.
    pub fn to_json(&self) -> String {
        // Infallible: every map key is a string and nothing here can fail to serialize.
        let line = |value: serde_json::Result<String>| value.unwrap_or_default();
        let bodies: Vec<String> = self.bodies.iter().map(|b| line(serde_json::to_string(b))).collect();
        let joints: Vec<String> = self.joints.iter().map(|j| line(serde_json::to_string(j))).collect();
        let joints = if joints.is_empty() {
            String::new()
        } else {
            format!(", \"joints\": [\n{}\n]", joints.join(",\n"))
        };
        let unit = line(serde_json::to_string(&self.length_unit));
        let unit =
            if is_one(&self.length_unit) { String::new() } else { format!("\"length_unit\": {unit}, ") };
        let expect = self.expect.as_ref().map(|e| line(serde_json::to_string(e)));
        let expect = expect.map_or(String::new(), |text| format!("\"expect\": {text}, "));
        format!(
            "{{\"name\": {}, \"gravity\": {}, \"dt\": {}, \"steps\": {}, {unit}{expect}\"bodies\": [\n{}\n]{joints}}}\n",
            line(serde_json::to_string(&self.name)),
            line(serde_json::to_string(&self.gravity)),
            line(serde_json::to_string(&self.dt)),
            self.steps,
            bodies.join(",\n")
        )
    }
}

fn default_gravity() -> [f64; 2] {
    DEFAULT_GRAVITY
}

fn default_dt() -> f64 {
    DEFAULT_DT
}

fn default_steps() -> u32 {
    DEFAULT_STEPS
}

fn default_density() -> f64 {
    DEFAULT_DENSITY
}

fn default_friction() -> f64 {
    DEFAULT_FRICTION
}

fn one() -> f64 {
    1.0
}

// Values left out of a file must be read back bit for bit, so −0 is written.

fn same(value: f64, default: f64) -> bool {
    value.to_bits() == default.to_bits()
}

fn is_zero(value: &f64) -> bool {
    same(*value, 0.0)
}

fn is_one(value: &f64) -> bool {
    same(*value, 1.0)
}

fn is_origin(point: &[f64; 2]) -> bool {
    point.iter().all(is_zero)
}

fn is_no_group(group: &i32) -> bool {
    *group == 0
}

fn is_false(value: &bool) -> bool {
    !*value
}

fn is_default_density(value: &f64) -> bool {
    same(*value, DEFAULT_DENSITY)
}

fn is_default_friction(value: &f64) -> bool {
    same(*value, DEFAULT_FRICTION)
}
