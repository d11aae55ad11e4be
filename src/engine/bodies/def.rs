//! Definitions of bodies and shapes, and the valid ranges of their values.

use super::BodyKind;
use crate::error::Error;
use crate::params::{DEFAULT_DENSITY, DEFAULT_FRICTION};
use crate::shapes::{MassProperties, Shape, combine};
use glam::{DVec2, Vec2};

/// Maximum friction coefficient (1), so that the product of two is finite in `f32`.
pub const MAX_FRICTION: f64 = 1e9;

/// What a shape collides with: two shapes do if the mask of each has a bit of the other's category.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Filter {
    /// Bits of the categories that the shape belongs to.
    pub category: u64,
    /// Bits of the categories that it collides with.
    pub mask: u64,
}

/// Category 1, colliding with all.
impl Default for Filter {
    fn default() -> Self {
        Filter { category: 1, mask: u64::MAX }
    }
}

impl Filter {
    /// Whether two shapes with these filters collide.
    pub fn meets(&self, other: &Filter) -> bool {
        self.category & other.mask != 0 && other.category & self.mask != 0
    }
}

/// A shape and its surface properties.
///
/// ```
/// use simpulse_engine::bodies::ShapeDef;
///
/// let ice = ShapeDef::rectangle(0.5, 0.25)?.with_friction(0.02).with_density(917.0);
/// let wheel = ShapeDef::circle(0.3)?.at([0.6, -0.25]).with_restitution(0.4);
/// let error = ShapeDef::circle(-1.0).unwrap_err();
/// assert_eq!(error.to_string(), "circle: radius = -1 is not within 1e-9 to 1e9 m");
/// # let _ = (ice, wheel);
/// # Ok::<(), simpulse_engine::error::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ShapeDef {
    /// Geometry in the frame of the body's origin (m).
    pub shape: Shape,
    /// Density (kg/m²), > 0.
    pub density: f64,
    /// Coulomb coefficient, ≥ 0; two surfaces mix as √(µa µb).
    pub friction: f64,
    /// Restitution, in [0, 1]; two surfaces mix as max(ea, eb).
    pub restitution: f64,
    /// What it collides with.
    pub filter: Filter,
}

/// Definition of a body: its shapes and initial state.
///
/// ```
/// use simpulse_engine::bodies::{BodyDef, ShapeDef};
///
/// let crate_ = BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::rectangle(0.5, 0.5)?).with_velocity([2.0, 0.0]);
/// // Or as a plain struct:
/// let same = BodyDef { velocity: [2.0, 0.0], shapes: crate_.shapes.clone(), ..BodyDef::dynamic([0.0, 0.5]) };
/// assert_eq!(crate_, same);
/// # Ok::<(), simpulse_engine::error::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BodyDef {
    /// How the body moves.
    pub kind: BodyKind,
    /// Origin of the body's frame (m).
    pub position: [f64; 2],
    /// Initial angle (rad).
    pub angle: f64,
    /// Velocity of the center of mass (m/s).
    pub velocity: [f64; 2],
    /// Angular velocity (rad/s).
    pub angular_velocity: f64,
    /// Factor on gravity (1).
    pub gravity_scale: f64,
    /// Linear damping (1/s).
    pub linear_damping: f64,
    /// Angular damping (1/s).
    pub angular_damping: f64,
    /// Bodies of the same non-zero group do not collide.
    pub group: i32,
    /// Whether dynamic bodies also stop it in continuous collision, see [`crate::continuous`].
    pub bullet: bool,
    /// Whether it keeps its angle.
    pub fixed_rotation: bool,
    /// Whether its velocity is that of its surface only, as of a conveyor belt, while it stays where it is. For
    /// kinematic bodies. The surface moves as a rigid body would: faces along the velocity carry what lies on
    /// them, others push.
    pub belt: bool,
    /// Mass, center (m, in the body's frame) and inertia about it, in place of those of the shapes.
    pub given_mass: Option<MassProperties>,
    /// Shapes, rigidly connected.
    pub shapes: Vec<ShapeDef>,
}

impl ShapeDef {
    /// A shape with default density and friction, without restitution.
    pub fn new(shape: Shape) -> Self {
        ShapeDef {
            shape,
            density: DEFAULT_DENSITY,
            friction: DEFAULT_FRICTION,
            restitution: 0.0,
            filter: Filter::default(),
        }
    }

    /// A rectangle centered at the origin of the body. Half extents in m; errors: as [`Shape::rectangle`].
    pub fn rectangle(half_width: f64, half_height: f64) -> Result<Self, Error> {
        Shape::rectangle("rectangle", rounded([half_width, half_height]), Vec2::ZERO, 0.0, 0.0).map(Self::new)
    }

    /// A disc centered at the origin of the body. Radius in m; errors: as [`Shape::circle`].
    pub fn circle(radius: f64) -> Result<Self, Error> {
        Shape::circle("circle", Vec2::ZERO, radius as f32).map(Self::new)
    }

    /// All points within `radius` of the segment a–b (m). Errors: as [`Shape::capsule`].
    pub fn capsule(a: [f64; 2], b: [f64; 2], radius: f64) -> Result<Self, Error> {
        Shape::capsule("capsule", rounded(a), rounded(b), radius as f32).map(Self::new)
    }

    /// A massless line from a to b (m), for static bodies. Errors: as [`Shape::segment`].
    pub fn segment(a: [f64; 2], b: [f64; 2]) -> Result<Self, Error> {
        Shape::segment("segment", rounded(a), rounded(b)).map(Self::new)
    }

    /// A convex polygon of 3 to 8 vertices (m), in either winding. Errors: as [`Shape::polygon`].
    pub fn polygon(vertices: &[[f64; 2]]) -> Result<Self, Error> {
        let vertices: Vec<Vec2> = vertices.iter().copied().map(rounded).collect();
        Shape::polygon("polygon", &vertices, 0.0).map(Self::new)
    }

    /// Moves the shape by `offset` (m) in the frame of the body.
    pub fn at(self, offset: [f64; 2]) -> Self {
        ShapeDef { shape: self.shape.translated(rounded(offset)), ..self }
    }

    /// Sets the density (kg/m²).
    pub fn with_density(self, density: f64) -> Self {
        ShapeDef { density, ..self }
    }

    /// Sets the Coulomb coefficient.
    pub fn with_friction(self, friction: f64) -> Self {
        ShapeDef { friction, ..self }
    }

    /// Sets the restitution.
    pub fn with_restitution(self, restitution: f64) -> Self {
        ShapeDef { restitution, ..self }
    }

    /// Sets what the shape collides with, in bits of categories.
    pub fn with_filter(self, category: u64, mask: u64) -> Self {
        ShapeDef { filter: Filter { category, mask }, ..self }
    }

    /// Checks the values. Errors: a density ≤ 0, a negative friction or one above [`MAX_FRICTION`], a
    /// restitution outside [0, 1], and values that are not finite in `f32`.
    pub fn check(&self) -> Result<(), Error> {
        finite("density", self.density)?;
        // A density too small for 32 bits becomes zero.
        if self.density as f32 <= 0.0 {
            return Err(Error::invalid("density", format!("must be positive, is {:?}", self.density)));
        }
        not_negative("friction", self.friction)?;
        if self.friction > MAX_FRICTION {
            let message = format!("must be at most {MAX_FRICTION:e}, is {:?}", self.friction);
            return Err(Error::invalid("friction", message));
        }
        finite("restitution", self.restitution)?;
        if !(0.0..=1.0).contains(&self.restitution) {
            let message = format!("must be in [0, 1], is {}", self.restitution);
            return Err(Error::invalid("restitution", message));
        }
        self.shape.check()
    }
}

impl BodyDef {
    /// A body at rest at `position` (m), at angle 0, undamped.
    pub fn new(kind: BodyKind, position: [f64; 2], shapes: Vec<ShapeDef>) -> Self {
        BodyDef {
            kind,
            position,
            angle: 0.0,
            velocity: [0.0; 2],
            angular_velocity: 0.0,
            gravity_scale: 1.0,
            linear_damping: 0.0,
            angular_damping: 0.0,
            group: 0,
            bullet: false,
            fixed_rotation: false,
            belt: false,
            given_mass: None,
            shapes,
        }
    }

    /// A body moved by forces and contacts, at rest at `position` (m), without shapes.
    pub fn dynamic(position: [f64; 2]) -> Self {
        BodyDef::new(BodyKind::Dynamic, position, Vec::new())
    }

    /// A body that never moves, at `position` (m), without shapes.
    pub fn fixed(position: [f64; 2]) -> Self {
        BodyDef::new(BodyKind::Static, position, Vec::new())
    }

    /// A body that keeps its given velocity in every collision, at `position` (m), without shapes.
    ///
    /// ```
    /// # use simpulse_engine::prelude::*;
    /// let mut world = World::default();
    /// let belt = BodyDef::kinematic([0.0, -1.0]).with(ShapeDef::rectangle(50.0, 1.0)?).with_velocity([1.0, 0.0]);
    /// world.add_body(&belt)?;
    /// let cargo = world.add_body(&BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::rectangle(0.5, 0.5)?))?;
    /// for _ in 0..60 {
    ///     world.step()?;
    /// }
    /// // Friction has brought the box to the speed of the belt.
    /// assert!((world.body(cargo)?.velocity()[0] - 1.0).abs() < 1e-3);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn kinematic(position: [f64; 2]) -> Self {
        BodyDef::new(BodyKind::Kinematic, position, Vec::new())
    }

    /// Adds a shape.
    pub fn with(mut self, shape: ShapeDef) -> Self {
        self.shapes.push(shape);
        self
    }

    /// Sets the angle (rad).
    pub fn with_angle(self, angle: f64) -> Self {
        BodyDef { angle, ..self }
    }

    /// Sets the velocity of the center of mass (m/s).
    pub fn with_velocity(self, velocity: [f64; 2]) -> Self {
        BodyDef { velocity, ..self }
    }

    /// Sets the angular velocity (rad/s).
    pub fn with_angular_velocity(self, angular_velocity: f64) -> Self {
        BodyDef { angular_velocity, ..self }
    }

    /// Keeps its angle, whatever pushes it.
    pub fn with_fixed_rotation(self) -> Self {
        BodyDef { fixed_rotation: true, ..self }
    }

    /// Mass (kg), center (m, in the body's frame) and inertia (kg·m²): as given, or of all shapes.
    pub fn mass(&self) -> MassProperties {
        if let Some(given) = self.given_mass {
            return given;
        }
        combine(&self.shapes.iter().map(|s| s.shape.mass(s.density)).collect::<Vec<_>>())
    }

    /// Checks whether a world accepts this body; returns its mass properties.
    ///
    /// Errors, with field and value: a number that is not finite in `f32`; negative damping; a shape rejected
    /// by [`ShapeDef::check`]; a dynamic body without shapes or given mass, or with a mass or inertia that is zero or
    /// not finite; a center that is not finite; a belt that is not kinematic.
    pub fn check(&self) -> Result<MassProperties, Error> {
        finite_pair("position", self.position)?;
        finite("angle", self.angle)?;
        finite_pair("velocity", self.velocity)?;
        finite("angular_velocity", self.angular_velocity)?;
        finite("gravity_scale", self.gravity_scale)?;
        not_negative("linear_damping", self.linear_damping)?;
        not_negative("angular_damping", self.angular_damping)?;
        for (k, shape) in self.shapes.iter().enumerate() {
            shape.check().map_err(|e| e.within(&format!("shapes[{k}]")))?;
        }
        let mass = self.mass();
        finite_pair("given_mass.center", mass.center)?;
        if self.belt && self.kind != BodyKind::Kinematic {
            return Err(Error::invalid("belt", format!("needs a kinematic body, is {:?}", self.kind)));
        }
        if self.kind == BodyKind::Dynamic {
            if self.shapes.is_empty() && self.given_mass.is_none() {
                return Err(Error::invalid("shapes", "a dynamic body needs at least one shape, has 0"));
            }
            let inertia = if self.fixed_rotation { 1.0 } else { mass.inertia as f32 };
            for (name, value) in [("mass", mass.mass as f32), ("inertia", inertia)] {
                // The solver stores the reciprocal, so it must be a normal number too.
                if !(value > 0.0 && value.is_normal() && value.recip().is_normal()) {
                    let place = if self.given_mass.is_some() { "given_mass" } else { "shapes" };
                    let message =
                        format!("the {name} of a dynamic body must be positive and finite, is {value}");
                    return Err(Error::invalid(place, message));
                }
            }
        }
        Ok(mass)
    }
}

/// A vector as shapes store it.
fn rounded(v: [f64; 2]) -> Vec2 {
    DVec2::from(v).as_vec2()
}

pub(crate) fn finite(place: &str, value: f64) -> Result<(), Error> {
    if (value as f32).is_finite() {
        return Ok(());
    }
    Err(Error::invalid(place, format!("must be finite in 32 bits, is {value:?}")))
}

pub(crate) fn finite_pair(place: &str, value: [f64; 2]) -> Result<(), Error> {
    match (0..2).find(|&k| !(value[k] as f32).is_finite()) {
        Some(k) => finite(&format!("{place}[{k}]"), value[k]),
        None => Ok(()),
    }
}

pub(crate) fn not_negative(place: &str, value: f64) -> Result<(), Error> {
    finite(place, value)?;
    if value >= 0.0 {
        return Ok(());
    }
    Err(Error::invalid(place, format!("must not be negative, is {value:?}")))
}
