//! Builds a world from a scene: checks every value and rounds geometry to `f32`.

use super::format::{Geometry, Scene, SceneBody, SceneShape};
pub use crate::engine::bodies::MAX_FRICTION;
use crate::engine::bodies::{BodyDef, BodyHandle, BodyKind, ShapeDef};
use crate::engine::joints::{Joint, JointKind};
use crate::engine::shapes::Shape;
use crate::engine::solvers::Variant;
use crate::engine::world::{Settings, World};
use crate::lab::error::Error;
use glam::Vec2;

/// Maximum number of bodies of a scene.
pub const MAX_BODIES: usize = 1_000_000;

/// Shortest step (s): shorter ones would be shown as 0, and `f32` would round most of their motion away.
pub const MIN_DT: f64 = 1e-9;

/// Longest step (s): in longer ones, impulses of ordinary scenes approach the range of `f32`, and metrics
/// that square them are not finite.
pub const MAX_DT: f64 = 1e3;

/// Allowed sizes of typical bodies (m): from cells to planets.
pub const LENGTH_UNITS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// Maximum number of steps of a run: 46 hours at 60 steps a second.
pub const MAX_STEPS: u32 = 10_000_000;

impl Scene {
    /// Whether a world can be built from this scene.
    ///
    /// Errors, naming place and value: a name that is empty or has control characters; a number that is not
    /// finite in `f32`; `dt` below [`MIN_DT`] or above [`MAX_DT`]; `length_unit` outside [`LENGTH_UNITS`]; no
    /// steps, or more than [`MAX_STEPS`]; no bodies, or more than [`MAX_BODIES`]; density ≤ 0; negative
    /// friction or damping; friction above [`MAX_FRICTION`]; restitution outside [0, 1]; a shape that
    /// [`Shape`]'s constructors reject; a dynamic body without mass; a joint to a body that does not exist,
    /// from a body to itself or between two bodies neither of which is dynamic.
    pub fn validate(&self) -> Result<(), Error> {
        self.check_head()?;
        let check = |(i, body)| body_def(body).map(drop).map_err(|e| e.within(&format!("bodies[{i}]")));
        self.bodies.iter().enumerate().try_for_each(check)?;
        self.check_joints()
    }

    fn check_head(&self) -> Result<(), Error> {
        let name = &self.name;
        Error::require(!name.trim().is_empty(), "name", || format!("must not be empty, is '{name}'"))?;
        let plain = !name.chars().any(char::is_control);
        Error::require(plain, "name", || format!("must not have control characters, is {name:?}"))?;
        finite_pair("gravity", self.gravity)?;
        positive("dt", self.dt)?;
        let dt = self.dt;
        Error::require(dt >= MIN_DT, "dt", || format!("must be at least {MIN_DT:e} s, is {dt:e} s"))?;
        Error::require(dt <= MAX_DT, "dt", || format!("must be at most {MAX_DT} s, is {dt:e} s"))?;
        Error::require(LENGTH_UNITS.contains(&self.length_unit), "length_unit", || {
            let [least, most] = [LENGTH_UNITS.start(), LENGTH_UNITS.end()];
            format!("must be at least {least:e} m and at most {most:e} m, is {:?} m", self.length_unit)
        })?;
        Error::require((1..=MAX_STEPS).contains(&self.steps), "steps", || {
            format!("must be at least 1 and at most {MAX_STEPS}, is {}", self.steps)
        })?;
        let count = self.bodies.len();
        Error::require(count > 0, "bodies", || "there are none: a scene needs at least one".to_string())?;
        Error::require(count <= MAX_BODIES, "bodies", || {
            format!("{count} bodies, where at most {MAX_BODIES} are possible")
        })?;
        self.expect.as_ref().map_or(Ok(()), |expect| expect.validate(self).map_err(|e| e.within("expect")))
    }

    /// The bodies as definitions for a world. Errors: as [`Scene::validate`].
    pub fn body_defs(&self) -> Result<Vec<BodyDef>, Error> {
        self.check_head()?;
        let def = |(i, body)| body_def(body).map_err(|e| e.within(&format!("bodies[{i}]")));
        self.bodies.iter().enumerate().map(def).collect()
    }

    /// A world with these bodies, in their order. Gravity, step and length unit are those of the scene,
    /// everything else is from `settings`. Errors: as [`Scene::validate`] and [`Settings::check`].
    pub fn build(&self, settings: Settings) -> Result<World, Error> {
        let bodies = self.body_defs()?;
        let (gravity, length_unit) = (self.gravity.map(|g| g as f32), self.length_unit as f32);
        let settings = Settings { gravity, dt: self.dt as f32, length_unit, ..settings };
        settings.check()?;
        let mut world = World::new(settings);
        self.check_joints()?;
        self.add(&bodies, &mut world)?;
        Ok(world)
    }

    /// Adds the bodies and joints to a world that may have others. Errors: as [`Self::build`].
    pub fn add_to(&self, world: &mut World) -> Result<(), Error> {
        self.check_joints()?;
        Ok(self.add(&self.body_defs()?, world)?)
    }

    fn add(&self, bodies: &[BodyDef], world: &mut World) -> Result<(), crate::engine::error::Error> {
        let handles = bodies.iter().map(|body| world.add_body(body)).collect::<Result<Vec<_>, _>>()?;
        self.joint_defs(&handles).try_for_each(|joint| world.add_joint(&joint).map(drop))
    }

    /// Whether a solver can run this scene.
    ///
    /// Errors: the scene has joints with rows and the solver does not support joints, with its reason.
    pub fn runs_on(&self, solver: &Variant) -> Result<(), Error> {
        match solver.joints_unsupported {
            Some(reason) if self.joints.iter().any(|joint| joint.kind != JointKind::Filter) => {
                Err(Error::invalid(&self.name, format!("{} holds no joints: {reason}", solver.name)))
            }
            _ => Ok(()),
        }
    }

    /// Errors, naming place and value: a body that does not exist, a joint from a body to itself or between
    /// two bodies neither of which is dynamic, a value out of range.
    fn check_joints(&self) -> Result<(), Error> {
        for (i, joint) in self.joints.iter().enumerate() {
            let place = format!("joints[{i}].{}", joint.kind.name());
            let (at_b, count) = (format!("{place}.b"), self.bodies.len());
            for (name, body) in [("a", joint.a), ("b", joint.b)] {
                Error::require(body < count, &format!("{place}.{name}"), || {
                    format!("there is no body {body} among {count}")
                })?;
            }
            Error::require(joint.a != joint.b, &at_b, || format!("body {} has no joint to itself", joint.b))?;
            let moves = |body: usize| self.bodies[body].kind == BodyKind::Dynamic;
            Error::require(
                moves(joint.a) || moves(joint.b) || joint.kind == JointKind::Filter,
                &at_b,
                || format!("neither body {} nor body {} moves by forces", joint.a, joint.b),
            )?;
            for (k, load) in joint.break_load.into_iter().flatten().enumerate() {
                Error::require(
                    (load as f32).is_finite() && load >= 0.0,
                    &format!("{place}.break_load[{k}]"),
                    || format!("must be finite in 32 bits and not negative, is {load:?}"),
                )?;
            }
            joint.kind.check().map_err(|e| Error::from(e.within(&format!("joints[{i}]"))))?;
        }
        Ok(())
    }

    /// The scene's joints, between these bodies.
    fn joint_defs<'s>(&'s self, bodies: &'s [BodyHandle]) -> impl Iterator<Item = Joint> + 's {
        self.joints.iter().map(|joint| Joint {
            collide_connected: joint.collide_connected,
            break_load: joint.break_load,
            ..Joint::new(bodies[joint.a], bodies[joint.b], joint.kind.clone())
        })
    }
}

/// The definition of a body. Errors name places within the body.
fn body_def(body: &SceneBody) -> Result<BodyDef, Error> {
    let shape = |(k, shape)| shape_def(shape).map_err(|e| e.within(&format!("shapes[{k}]")));
    let shapes = body.shapes.iter().enumerate().map(shape);
    let def = BodyDef {
        kind: body.kind,
        position: body.position,
        angle: body.angle,
        velocity: body.velocity,
        angular_velocity: body.angular_velocity,
        gravity_scale: body.gravity_scale,
        linear_damping: body.linear_damping,
        angular_damping: body.angular_damping,
        group: body.group,
        bullet: body.bullet,
        fixed_rotation: body.fixed_rotation,
        belt: body.belt,
        given_mass: body.mass,
        shapes: shapes.collect::<Result<_, _>>()?,
    };
    def.check()?;
    Ok(def)
}

/// The definition of a shape. Errors name places within the shape.
pub(super) fn shape_def(shape: &SceneShape) -> Result<ShapeDef, Error> {
    Ok(ShapeDef {
        shape: geometry(&shape.geometry)?,
        density: shape.density,
        friction: shape.friction,
        restitution: shape.restitution,
        filter: shape.filter,
    })
}

/// [`Shape`]'s constructors check ranges. This only checks that rounding to `f32` does not make a finite
/// number infinite.
fn geometry(geometry: &Geometry) -> Result<Shape, Error> {
    let point = |name: &str, p: [f64; 2]| {
        finite_pair(name, p)?;
        Ok::<Vec2, Error>(Vec2::new(p[0] as f32, p[1] as f32))
    };
    let number = |name: &str, x: f64| {
        finite(name, x)?;
        Ok::<f32, Error>(x as f32)
    };
    let shape = match geometry {
        Geometry::Circle(c) => {
            Shape::circle("circle", point("circle.center", c.center)?, number("circle.radius", c.radius)?)
        }
        Geometry::Box(b) => Shape::rectangle(
            "box",
            point("box.half", b.half)?,
            point("box.center", b.center)?,
            number("box.angle", b.angle)?,
            number("box.radius", b.radius)?,
        ),
        Geometry::Polygon(p) => {
            let points = p.points.iter().enumerate().map(|(i, &v)| point(&format!("polygon.points[{i}]"), v));
            let points = points.collect::<Result<Vec<_>, _>>()?;
            Shape::polygon("polygon", &points, number("polygon.radius", p.radius)?)
        }
        Geometry::Capsule(c) => Shape::capsule(
            "capsule",
            point("capsule.a", c.a)?,
            point("capsule.b", c.b)?,
            number("capsule.radius", c.radius)?,
        ),
        Geometry::Segment(s) => Shape::segment("segment", point("segment.a", s.a)?, point("segment.b", s.b)?),
    }?;
    Ok(shape)
}

pub(super) fn finite(place: &str, value: f64) -> Result<(), Error> {
    Error::require((value as f32).is_finite(), place, || format!("must be finite in 32 bits, is {value:?}"))
}

pub(super) fn finite_pair(place: &str, value: [f64; 2]) -> Result<(), Error> {
    (0..2).try_for_each(|k| finite(&format!("{place}[{k}]"), value[k]))
}

pub(super) fn positive(place: &str, value: f64) -> Result<(), Error> {
    finite(place, value)?;
    // A value too small for 32 bits becomes zero.
    Error::require(value as f32 > 0.0, place, || format!("must be positive, is {value:?}"))
}
