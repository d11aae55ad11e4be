//! Many copies of a scene.

use super::{StepError, World};
use crate::bodies::def::finite_pair;
use crate::bodies::{Bodies, BodyHandle, BodyKind};
use crate::broadphase::{BroadPhase, Spaces};
use crate::contacts::Contact;
use crate::error::Error;
use crate::joints::Joint;
use crate::solvers::Islands;
use crate::workers::Workers;
use crate::world::{Order, Settings};
use std::ops::Range;

/// Number of bodies in a world of a batch. With their contacts they fit a second-level cache of 1 to 2 MiB, and fill the lanes.
const BODIES: usize = 2500;

/// A copy of more shapes gets a world of its own, whose lanes it fills, and a search for pairs made for many.
const LARGE: usize = 64;

/// Copies or variants of a scene that never touch. Several are in one world, so that lanes are filled across them: as many as
/// a cache holds. Threads take a world each.
///
/// Every copy has its own space, gravity and start. Its bits are those of the copy alone, with one exception: chains of joints
/// under `shim` differ in the last digits. Observations and actions are flat arrays: `[copies][bodies][numbers]`.
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
    rooms: Vec<Room>,
    copies: usize,
    /// Number of copies in a room; the last one has the rest.
    each: usize,
    /// Number of bodies of a copy.
    bodies: usize,
    threads: usize,
    workers: Workers,
}

/// Copies in one world.
#[derive(Clone, Debug)]
struct Room {
    world: World,
    /// First joint of each copy, and the end of the last.
    joints: Vec<u32>,
    /// Bodies before the first step.
    start: Bodies,
    /// What the last step gave.
    result: Result<(), StepError>,
}

impl Batch {
    /// Numbers of a body in an observation: position of the center of mass x, y (m), angle (rad), velocity x, y (m/s), spin
    /// (rad/s).
    pub const OBSERVED: usize = 6;
    /// Numbers of a body in an action: force x, y (N), torque (N·m).
    pub const ACTED: usize = 3;

    /// A batch of `copies`; `build` adds the bodies and joints of each to a world that has those of others. It may give them
    /// other values, but each copy has as many bodies as the first. What it changes in the settings is undone.
    ///
    /// Errors: those of `build`; no copies; a solver or an order for which islands see each other; a copy with another number of
    /// bodies, or none; one that removes a body, joins one of another copy, steps or replaces its world.
    pub fn new(
        settings: Settings,
        copies: usize,
        mut build: impl FnMut(usize, &mut World) -> Result<(), Error>,
    ) -> Result<Batch, Error> {
        if copies == 0 {
            return Err(Error::invalid("copies", "must be at least 1"));
        }
        if settings.solver.islands == Islands::Together {
            let message =
                format!("{} solves copies together, so they would see each other", settings.solver.name);
            return Err(Error::invalid("solver", message));
        }
        if settings.solver.islands == Islands::Alone && settings.order != Order::Colored {
            let message =
                format!("of {} must be by color: in others it solves copies together", settings.solver.name);
            return Err(Error::invalid("order", message));
        }
        if settings.order == Order::Shuffled {
            return Err(Error::invalid("order", "of a copy would depend on its number, is shuffled"));
        }
        let threads = settings.threads;
        let settings = Settings { threads: 1, ..settings };
        let empty = |is_large: bool| {
            let mut world = World::new(settings.clone());
            if !is_large {
                world.broadphase = BroadPhase::Spaces(Spaces::default());
            }
            world
        };
        let (mut each, mut bodies, mut is_large) = (copies, 0, false);
        let spaces_of = |world: &World| match &world.broadphase {
            BroadPhase::Spaces(spaces) => Some(spaces.len()),
            _ => None,
        };
        let (mut rooms, mut joints, mut world) = (Vec::new(), Vec::new(), empty(false));
        let has_joints =
            |world: &World| settings.solver.islands == Islands::Alone && world.joints().next().is_some();
        for copy in 0..copies {
            let invalid = |message: String| Error::invalid(format!("copy {copy}"), message);
            let (before, first_joint, spaces) =
                (world.bodies.len(), world.joints().count(), spaces_of(&world));
            joints.push(first_joint as u32);
            build(copy, &mut world).map_err(|e| e.within(&format!("copy {copy}")))?;
            if has_joints(&world) {
                let message = format!("{} solves copies with joints together", settings.solver.name);
                return Err(Error::invalid("solver", message));
            }
            if !world.slots.removed.is_empty() {
                return Err(invalid("removes a body that it has added".into()));
            }
            if world.step_index > 0 || spaces_of(&world) != spaces || world.bodies.len() < before {
                return Err(invalid("steps or replaces the world that it is built in".into()));
            }
            let ends = |joint: &Joint| joint.ends().map(BodyHandle::index);
            if world.joints().skip(first_joint).any(|(_, joint)| ends(joint).iter().any(|&end| end < before))
            {
                return Err(invalid("has a joint to a body of another copy".into()));
            }
            world.settings.clone_from(&settings);
            if let BroadPhase::Spaces(spaces) = &mut world.broadphase {
                spaces.end(world.shapes.len());
            }
            let own = world.bodies.len() - before;
            if copy == 0 {
                (bodies, each) = (own, BODIES.div_ceil(own.max(1)));
                if world.shapes.len() > LARGE {
                    each = 1;
                    is_large = true;
                    world.broadphase = BroadPhase::new(settings.broadphase);
                }
            }
            if own != bodies || own == 0 {
                return Err(invalid(format!("has {own} bodies, and the first copy has {bodies}")));
            }
            if (copy + 1) % each == 0 || copy + 1 == copies {
                joints.push(world.joints().count() as u32);
                if let BroadPhase::Spaces(spaces) = &mut world.broadphase {
                    spaces.close();
                }
                let (world, joints) =
                    (std::mem::replace(&mut world, empty(is_large)), std::mem::take(&mut joints));
                rooms.push(Room { start: world.bodies.clone(), world, joints, result: Ok(()) });
            }
        }
        Ok(Batch { rooms, copies, each, bodies, threads, workers: Workers::default() })
    }

    /// Number of copies.
    pub fn copies(&self) -> usize {
        self.copies
    }

    /// The world that a copy is in, and the indices of its bodies there.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn world_of(&self, copy: usize) -> (&World, Range<usize>) {
        let (room, bodies) = self.place(copy);
        (&self.rooms[room].world, bodies)
    }

    /// Gives a world that holds the scene of a copy alone the state of the copy: bodies, contacts and number of steps. It then
    /// serves to measure the copy, except for the loads of joints.
    ///
    /// # Panics
    /// If there is no such copy, or `to` has another number of bodies.
    pub fn read(&mut self, copy: usize, to: &mut World) {
        let (i, bodies) = self.place(copy);
        assert_eq!(to.bodies.len(), self.bodies, "bodies of a copy");
        let world = &mut self.rooms[i].world;
        to.bodies.restore(0, &mut world.bodies, bodies.clone());
        let (body, shape) = (bodies.start as u32, world.slots.first_shape[bodies.start]);
        let from = world.contacts.partition_point(|c| c.body_b < body && c.body_a < body);
        to.contacts.clear();
        let own = world.contacts[from..].iter().take_while(|c| bodies.contains(&(c.body_b as usize)));
        to.contacts.extend(own.map(|c| Contact {
            body_a: c.body_a - body,
            body_b: c.body_b - body,
            shape_a: c.shape_a - shape,
            shape_b: c.shape_b - shape,
            ..*c
        }));
        to.step_index = world.step_index;
    }

    /// Room and bodies of a copy.
    fn place(&self, copy: usize) -> (usize, Range<usize>) {
        assert!(copy < self.copies, "no copy {copy}: there are {}", self.copies);
        let first = copy % self.each * self.bodies;
        (copy / self.each, first..first + self.bodies)
    }

    /// Number of numbers in an observation.
    pub fn observation_len(&self) -> usize {
        self.copies * self.bodies * Self::OBSERVED
    }

    /// Number of numbers in an action.
    pub fn action_len(&self) -> usize {
        self.copies * self.bodies * Self::ACTED
    }

    /// Advances all copies by a step. Returns the copies of which a body diverged; the others are not affected.
    /// Errors: as [`Settings::check`]; with several threads, a panic.
    pub fn step(&mut self) -> Result<Vec<usize>, StepError> {
        self.workers.set(self.threads);
        let is_shared = self.workers.count() > 1;
        let mut seats = vec![(); self.workers.count()];
        self.workers.in_turn(&mut self.rooms, &mut seats, |Room { world, result, .. }, ()| {
            *result = if is_shared { StepError::caught(|| world.step()).flatten() } else { world.step() };
        });
        let mut diverged = Vec::new();
        for (i, Room { world, result, .. }) in self.rooms.iter().enumerate() {
            match result {
                Ok(()) => {}
                Err(StepError::Diverged(_)) => {
                    let copies = i * self.each..self.copies.min((i + 1) * self.each);
                    let is_out = |&copy: &usize| self.place(copy).1.any(|body| world.is_out_of_bounds(body));
                    diverged.extend(copies.filter(is_out));
                }
                Err(error) => return Err(error.clone()),
            }
        }
        Ok(diverged)
    }

    /// Puts a copy back to its start: bodies, contacts and joints.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn reset(&mut self, copy: usize) {
        let (i, bodies) = self.place(copy);
        let Room { world, start, joints, .. } = &mut self.rooms[i];
        let number = copy % self.each;
        let joints = joints[number]..joints[number + 1];
        world.bodies.restore(bodies.start, start, bodies.clone());
        world.restart(bodies, joints);
    }

    /// Moves body `body` of a copy, as [`World::set_pose`]: position of the origin of its frame (m) and angle (rad). For a start
    /// of its own after a reset. Errors: no such body; a value that is not finite.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn set_pose(
        &mut self,
        copy: usize,
        body: usize,
        position: [f64; 2],
        angle: f64,
    ) -> Result<(), Error> {
        let (world, handle) = self.body_of(copy, body)?;
        world.set_pose(handle, position, angle)
    }

    /// Sets the velocity (m/s) and spin (rad/s) of body `body` of a copy, as [`World::set_velocity`]. Errors: no such body; a
    /// static body; a value that is not finite.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn set_velocity(
        &mut self,
        copy: usize,
        body: usize,
        velocity: [f64; 2],
        spin: f64,
    ) -> Result<(), Error> {
        let (world, handle) = self.body_of(copy, body)?;
        world.set_velocity(handle, velocity, spin)
    }

    /// The world and the handle of body `body` of a copy.
    fn body_of(&mut self, copy: usize, body: usize) -> Result<(&mut World, BodyHandle), Error> {
        let (room, bodies) = self.place(copy);
        let missing = || Error::invalid("body", format!("is {body}, and a copy has {}", self.bodies));
        let index = bodies.clone().nth(body).ok_or_else(missing)?;
        let world = &mut self.rooms[room].world;
        let handle = world.handle(index).ok_or_else(|| Error::invalid("body", "was removed"))?;
        Ok((world, handle))
    }

    /// Sets the gravity of a copy (m/s²); it lasts beyond resets. Errors: a value that is not finite.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn set_gravity(&mut self, copy: usize, gravity: [f64; 2]) -> Result<(), Error> {
        finite_pair("gravity", gravity)?;
        let (i, bodies) = self.place(copy);
        let world = &mut self.rooms[i].world;
        world.gravities.resize(world.bodies.len(), world.settings.gravity);
        bodies.clone().for_each(|body| world.sleep.edit(body as u32));
        world.gravities[bodies].fill(gravity.map(|x| x as f32));
        Ok(())
    }

    /// Writes the state of all bodies, `[copies][bodies][OBSERVED]`.
    ///
    /// # Panics
    /// If `to` has another length than [`Self::observation_len`].
    pub fn observe(&self, to: &mut [f32]) {
        assert_eq!(to.len(), self.observation_len(), "length of an observation");
        let all = self.rooms.iter().flat_map(|room| {
            let b = &room.world.bodies;
            (0..b.len()).map(move |i| (b, i))
        });
        for ((b, i), to) in all.zip(to.chunks_exact_mut(Self::OBSERVED)) {
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
        let mut forces = forces.chunks_exact(Self::ACTED);
        for Room { world, .. } in &mut self.rooms {
            let b = &mut world.bodies;
            for (i, force) in (0..b.len()).zip(&mut forces) {
                if b.kind[i] == BodyKind::Dynamic {
                    (b.force_x[i], b.force_y[i], b.torque[i]) = (force[0], force[1], force[2]);
                }
            }
        }
    }

    /// Hash of every bit of the body state of a copy, as [`World::state_hash`] of the copy alone.
    ///
    /// # Panics
    /// If there is no such copy.
    pub fn state_hash(&self, copy: usize) -> u64 {
        let (world, bodies) = self.world_of(copy);
        world.hash_of(bodies)
    }
}
