//! Many worlds in one.

use super::{StepError, World};
use crate::bodies::def::finite_pair;
use crate::bodies::{Bodies, BodyKind};
use crate::broadphase::{BroadPhase, Spaces};
use crate::error::Error;
use crate::world::Settings;
use std::ops::Range;

/// Copies or variants of a scene that never touch, stepped as one world, so that lanes are filled across them.
///
/// Every copy has its own space, gravity and start. Its bits are those of the copy alone. Observations and actions are flat
/// arrays: `[copies][bodies][numbers]`.
///
/// ```
/// use simpulse_engine::batch::Batch;
/// use simpulse_engine::prelude::*;
///
/// // Carts on rails, each with a pole to balance.
/// let mut batch = Batch::new(Settings::new(solvers::SOFT_STEP), 16, |copy, world| {
///     let rail = world.add_body(&BodyDef::fixed([0.0, 0.0]))?;
///     let cart = world.add_body(&BodyDef::dynamic([0.0, 0.0]).with(ShapeDef::rectangle(0.25, 0.15)?))?;
///     let lean = 0.01 * copy as f64;
///     let pole = BodyDef { angle: lean, ..BodyDef::dynamic([-0.5 * lean.sin(), 0.5 * lean.cos()]) };
///     let pole = world.add_body(&pole.with(ShapeDef::rectangle(0.02, 0.5)?))?;
///     world.add_joint(&Joint::prismatic(rail, cart, [1.0, 0.0]).anchor([0.0, 0.0]))?;
///     world.add_joint(&Joint::revolute(cart, pole).anchor([0.0, 0.0]))?;
///     Ok(())
/// })?;
/// let (mut seen, mut forces) = (vec![0.0; batch.observation_len()], vec![0.0; batch.action_len()]);
/// for _ in 0..60 {
///     batch.observe(&mut seen);
///     for (seen, force) in seen.chunks(3 * Batch::OBSERVED).zip(forces.chunks_mut(3 * Batch::ACTED)) {
///         let [cart, pole] = [1, 2].map(|body| &seen[body * Batch::OBSERVED..]);
///         // A force on the cart: under the pole, and back to the middle.
///         force[Batch::ACTED] = -60.0 * pole[2] - 8.0 * pole[5] + 1.0 * cart[0] + 2.0 * cart[3];
///     }
///     batch.act(&forces);
///     for copy in batch.step()? {
///         batch.reset(copy);
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Batch {
    world: World,
    /// First body of each copy, and the end of the last.
    bodies: Vec<u32>,
    /// First joint of each copy, and the end of the last.
    joints: Vec<u32>,
    /// Bodies before the first step.
    start: Bodies,
}

impl Batch {
    /// Numbers of a body in an observation: position of the center of mass x, y (m), angle (rad), velocity x, y (m/s), spin
    /// (rad/s).
    pub const OBSERVED: usize = 6;
    /// Numbers of a body in an action: force x, y (N), torque (N·m).
    pub const ACTED: usize = 3;

    /// A batch of `copies`; `build` adds the bodies and joints of each. It may give them other values, but each copy has as
    /// many bodies as the first.
    ///
    /// Errors: those of `build`; no copies; a copy with another number of bodies; a body that was removed again.
    pub fn new(
        settings: Settings,
        copies: usize,
        mut build: impl FnMut(usize, &mut World) -> Result<(), Error>,
    ) -> Result<Batch, Error> {
        if copies == 0 {
            return Err(Error::invalid("copies", "must be at least 1"));
        }
        let mut world = World::new(settings);
        world.broadphase = BroadPhase::Spaces(Spaces::default());
        let (mut bodies, mut joints) = (vec![0], vec![0]);
        for copy in 0..copies {
            build(copy, &mut world).map_err(|e| e.within(&format!("copy {copy}")))?;
            if !world.slots.removed.is_empty() {
                return Err(Error::invalid(format!("copy {copy}"), "removes a body that it has added"));
            }
            if let BroadPhase::Spaces(spaces) = &mut world.broadphase {
                spaces.end(world.shapes.len());
            }
            bodies.push(world.bodies.len() as u32);
            joints.push(world.joints().count() as u32);
            let [first, own] = [bodies[1], bodies[copy + 1] - bodies[copy]];
            if own != first {
                let message = format!("has {own} bodies, and the first copy has {first}");
                return Err(Error::invalid(format!("copy {copy}"), message));
            }
        }
        let start = world.bodies.clone();
        Ok(Batch { world, bodies, joints, start })
    }

    /// Number of copies.
    pub fn copies(&self) -> usize {
        self.bodies.len() - 1
    }

    /// Indices of the bodies of a copy in [`Self::world`].
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn bodies_of(&self, copy: usize) -> Range<usize> {
        self.bodies[copy] as usize..self.bodies[copy + 1] as usize
    }

    /// All copies as one world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Number of numbers in an observation.
    pub fn observation_len(&self) -> usize {
        self.world.bodies.len() * Self::OBSERVED
    }

    /// Number of numbers in an action.
    pub fn action_len(&self) -> usize {
        self.world.bodies.len() * Self::ACTED
    }

    /// Advances all copies by a step. Returns the copies of which a body diverged; the others are not affected.
    /// Errors: as [`Settings::check`].
    pub fn step(&mut self) -> Result<Vec<usize>, StepError> {
        match self.world.step() {
            Err(StepError::Diverged(_)) => {
                let has_diverged =
                    |&copy: &usize| self.bodies_of(copy).any(|body| self.world.is_out_of_bounds(body));
                Ok((0..self.copies()).filter(has_diverged).collect())
            }
            result => result.map(|()| Vec::new()),
        }
    }

    /// Puts a copy back to its start: bodies, contacts and joints.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn reset(&mut self, copy: usize) {
        let bodies = self.bodies_of(copy);
        let joints = self.joints[copy]..self.joints[copy + 1];
        self.world.bodies.restore(&mut self.start, bodies.clone());
        self.world.restart(bodies, joints);
    }

    /// Sets the gravity of a copy (m/s²); it lasts beyond resets. Errors: a value that is not finite.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn set_gravity(&mut self, copy: usize, gravity: [f64; 2]) -> Result<(), Error> {
        finite_pair("gravity", gravity)?;
        let (bodies, world) = (self.bodies_of(copy), &mut self.world);
        world.gravities.resize(world.bodies.len(), world.settings.gravity);
        world.gravities[bodies].fill(gravity.map(|x| x as f32));
        Ok(())
    }

    /// Writes the state of all bodies, `[copies][bodies][OBSERVED]`.
    ///
    /// # Panics
    /// If `to` has another length than [`Self::observation_len`].
    pub fn observe(&self, to: &mut [f32]) {
        assert_eq!(to.len(), self.observation_len(), "length of an observation");
        let b = &self.world.bodies;
        for (i, to) in to.chunks_exact_mut(Self::OBSERVED).enumerate() {
            to.copy_from_slice(&[
                b.position_x[i],
                b.position_y[i],
                b.rotation_sin[i].atan2(b.rotation_cos[i]),
                b.velocity_x[i],
                b.velocity_y[i],
                b.angular_velocity[i],
            ]);
        }
    }

    /// Sets the forces and torques of all dynamic bodies, `[copies][bodies][ACTED]`. They last until the next action.
    ///
    /// # Panics
    /// If `forces` has another length than [`Self::action_len`].
    pub fn act(&mut self, forces: &[f32]) {
        assert_eq!(forces.len(), self.action_len(), "length of an action");
        let b = &mut self.world.bodies;
        for (i, force) in forces.chunks_exact(Self::ACTED).enumerate() {
            if b.kind[i] == BodyKind::Dynamic {
                (b.force_x[i], b.force_y[i], b.torque[i]) = (force[0], force[1], force[2]);
            }
        }
    }

    /// Hash of every bit of the body state of a copy, as [`World::state_hash`] of the copy alone.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn state_hash(&self, copy: usize) -> u64 {
        self.world.hash_of(self.bodies_of(copy))
    }
}
