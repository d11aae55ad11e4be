//! A body of a world, by its handle.

use super::World;
use crate::bodies::{BodyHandle, BodyKind};
use crate::contacts::Contact;
use crate::error::Error;
use crate::joints::{Joint, JointHandle};
use glam::DVec2;

/// A body of a world, for reading. Vectors are in world axes.
///
/// ```
/// use simpulse_engine::prelude::*;
///
/// let mut world = World::default();
/// world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(10.0, 1.0)?))?;
/// let crate_ = world.add_body(&BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::rectangle(0.5, 0.5)?))?;
/// for _ in 0..60 {
///     world.step()?;
/// }
/// let body = world.body(crate_)?;
/// assert!((body.position()[1] - 0.5).abs() < 1e-3);
/// // The normal impulse of a substep ÷ its length is the force: the weight of the box.
/// let points = body.contacts().flat_map(|contact| world.points_of(contact));
/// let force = points.map(|point| point.normal_impulse).sum::<f64>() / f64::from(world.settings.h());
/// assert!((force / (10.0 * body.mass()) - 1.0).abs() < 1e-3, "{force} N");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Body<'w> {
    world: &'w World,
    handle: BodyHandle,
}

impl World {
    /// A body. Errors: it was removed; it is of another world.
    pub fn body(&self, handle: BodyHandle) -> Result<Body<'_>, Error> {
        self.index_of(handle)?;
        Ok(Body { world: self, handle })
    }
}

impl<'w> Body<'w> {
    fn index(self) -> usize {
        self.handle.index()
    }

    /// Its handle.
    pub fn handle(self) -> BodyHandle {
        self.handle
    }

    /// How it moves.
    pub fn kind(self) -> BodyKind {
        self.world.bodies.kind(self.index())
    }

    /// Origin of its frame (m), as in [`BodyDef::position`](crate::bodies::BodyDef::position).
    pub fn position(self) -> [f64; 2] {
        self.world.bodies.origin(self.index())
    }

    /// Its angle in (−π, π] (rad).
    pub fn angle(self) -> f64 {
        self.world.bodies.angle(self.index()).into()
    }

    /// Center of mass (m).
    pub fn center(self) -> [f64; 2] {
        self.world.bodies.center(self.index())
    }

    /// Velocity of the center of mass (m/s).
    pub fn velocity(self) -> [f64; 2] {
        self.world.bodies.velocity(self.index()).as_dvec2().to_array()
    }

    /// Whether it sleeps, see [`Settings::sleep`](super::Settings::sleep).
    pub fn is_asleep(self) -> bool {
        self.world.is_asleep(self.index())
    }

    /// Angular velocity (rad/s).
    pub fn spin(self) -> f64 {
        self.world.bodies.angular_velocity[self.index()].into()
    }

    /// Velocity of its material at a world point (m/s).
    pub fn velocity_at(self, point: [f64; 2]) -> [f64; 2] {
        let arm = DVec2::from(point) - DVec2::from(self.center());
        (DVec2::from(self.velocity()) + self.spin() * arm.perp()).to_array()
    }

    /// Mass (kg); infinite unless the body is dynamic.
    pub fn mass(self) -> f64 {
        f64::from(self.world.bodies.inv_mass[self.index()]).recip()
    }

    /// Moment of inertia about the center of mass (kg·m²); infinite unless the body is dynamic and rotates.
    pub fn inertia(self) -> f64 {
        f64::from(self.world.bodies.inv_inertia[self.index()]).recip()
    }

    /// Its contacts in the last step, found by a search through all contacts. See [`World::points_of`],
    /// [`World::bodies_of`].
    pub fn contacts(self) -> impl Iterator<Item = &'w Contact> {
        let i = self.handle.index;
        self.world.contacts.iter().filter(move |c| c.body_a == i || c.body_b == i)
    }

    /// Its joints, with their handles.
    pub fn joints(self) -> impl Iterator<Item = (JointHandle, &'w Joint)> {
        self.world.joints_of(self.handle)
    }
}
