//! The scene file: a body list in SI units, read from and written to JSON.
//!
//! A scene keeps its numbers in `f64`, as the file gives them; only
//! [`Scene::body_defs`] rounds geometry to `f32`. Writing a valid scene and
//! reading it back therefore gives the same bits.

use super::expect::Expect;
use super::import;
use super::joints::SceneJoint;
use crate::engine::bodies::{BodyKind, Filter};
use crate::engine::params::{DEFAULT_DENSITY, DEFAULT_DT, DEFAULT_FRICTION, DEFAULT_GRAVITY};
use crate::engine::shapes::MassProperties;
use crate::lab::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Default number of steps: five seconds at the default step.
pub const DEFAULT_STEPS: u32 = 300;

/// A scene: bodies, gravity, step and number of steps, and expectations on a run.
///
/// Scenes are written in code or read from JSON (`simpulse list NAME --json` prints one):
///
/// ```
/// use simpulse::{solvers, world::Settings};
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "simpulse scene")]
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
    /// What the file of another program has and this scene has not, with counts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
    /// Bodies, in the order of their indices in a world.
    pub bodies: Vec<SceneBody>,
    /// Joints between them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<SceneJoint>,
}

/// One body of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub bullet: bool,
    /// Whether it keeps its angle.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed_rotation: bool,
    /// Whether its velocity is that of its surface only, see [`BodyDef::belt`](crate::engine::bodies::BodyDef::belt).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub belt: bool,
    /// Mass (kg), center (m) and inertia about it (kg·m²), in place of those of the shapes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<MassProperties>,
    /// Shapes that move as one.
    pub shapes: Vec<SceneShape>,
}

/// A shape with its surface. In a file, an object with one geometry key beside the three numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SceneShape {
    /// Geometry in the frame of the body (m).
    #[serde(flatten)]
    pub geometry: Geometry,
    /// Density (kg/m²), > 0.
    #[serde(default = "default_density", skip_serializing_if = "is_default_density")]
    pub density: f64,
    /// Coulomb coefficient, ≥ 0 and ≤ 10⁹; two surfaces mix as √(µa µb).
    #[serde(default = "default_friction", skip_serializing_if = "is_default_friction")]
    pub friction: f64,
    /// Restitution, in [0, 1]; two surfaces mix as max(ea, eb).
    #[serde(default, skip_serializing_if = "is_zero")]
    pub restitution: f64,
    /// What it collides with.
    #[serde(default, skip_serializing_if = "is_no_filter")]
    pub filter: Filter,
}

/// The area that a shape covers (m, rad).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Circle {
    /// m
    #[serde(default, skip_serializing_if = "is_origin")]
    pub center: [f64; 2],
    /// m, > 0
    pub radius: f64,
}

/// A rectangle turned about its center, grown by `radius`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolygonGeometry {
    /// Vertices in either winding (m).
    pub points: Vec<[f64; 2]>,
    /// m, ≥ 0
    #[serde(default, skip_serializing_if = "is_zero")]
    pub radius: f64,
}

/// All points within `radius` of the segment a–b.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentGeometry {
    /// m
    pub a: [f64; 2],
    /// m
    pub b: [f64; 2],
}

impl Scene {
    /// Reads a scene; `path` only names the text in errors.
    ///
    /// Files of R.U.B.E., b2dJson and planck.js are recognized; see [`Scene::left_out`].
    ///
    /// Errors: text that is not JSON of this form, with place, line and column; a value out of range
    /// ([`Scene::validate`]), with its place.
    pub fn from_json(text: &str, path: &Path) -> Result<Self, Error> {
        let failed = |message| Error::Format { path: path.to_path_buf(), message };
        if let Some(file) = import::of_others(text) {
            let name = path.file_stem().map_or("scene".into(), |stem| stem.to_string_lossy());
            let scene = import::scene(&file, &name);
            return scene
                .and_then(|scene| scene.validate().map(|()| scene))
                .map_err(|e| failed(e.to_string()));
        }
        let mut reader = serde_json::Deserializer::from_str(text);
        let scene: Scene =
            serde_path_to_error::deserialize(&mut reader).map_err(|e| failed(at_place(text, &e)))?;
        reader.end().map_err(|e| failed(e.to_string()))?;
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
        fn line(value: &impl Serialize) -> String {
            serde_json::to_string(value).unwrap_or_default()
        }
        fn lines<T: Serialize>(key: &str, list: &[T]) -> String {
            format!(", \"{key}\": [\n{}\n]", list.iter().map(line).collect::<Vec<_>>().join(",\n"))
        }
        let head = Scene { bodies: Vec::new(), joints: Vec::new(), ..self.clone() };
        let head = line(&head).replace(",\"bodies\":[]}", "");
        let joints = if self.joints.is_empty() { String::new() } else { lines("joints", &self.joints) };
        format!("{head}{}{joints}}}\n", lines("bodies", &self.bodies))
    }
}

/// JSON schema of scene files (2020-12). Ranges are checked by reading only.
pub fn schema() -> String {
    format!("{:#}\n", schemars::schema_for!(Scene).as_value())
}

/// Longest place that a message repeats (characters), to leave room for the message.
const LONGEST_PLACE: usize = 120;

/// The place of an error and the error, with the number if that is out of range.
fn at_place(text: &str, error: &serde_path_to_error::Error<serde_json::Error>) -> String {
    let inner = error.inner();
    let mut message = inner.to_string();
    if message.starts_with("number out of range") {
        let before = text.lines().nth(inner.line().saturating_sub(1)).and_then(|l| l.get(..inner.column()));
        let number = |c: char| c.is_ascii_alphanumeric() || "+-.".contains(c);
        let end = before.unwrap_or_default().trim_end_matches(|c| !number(c));
        message += &format!(" ({})", &end[end.trim_end_matches(number).len()..]);
    }
    let place: String = error.path().to_string();
    let cut: String = place.chars().take(LONGEST_PLACE).collect();
    let more = if cut.len() < place.len() { "…" } else { "" };
    if [".", "?"].contains(&place.as_str()) { message } else { format!("{cut}{more}: {message}") }
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

fn is_no_filter(filter: &Filter) -> bool {
    *filter == Filter::default()
}

fn is_default_density(value: &f64) -> bool {
    same(*value, DEFAULT_DENSITY)
}

fn is_default_friction(value: &f64) -> bool {
    same(*value, DEFAULT_FRICTION)
}
