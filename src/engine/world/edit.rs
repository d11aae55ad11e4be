//! Adding, removing and moving bodies.

use super::{Surface, World};
use crate::bodies::def::{finite, finite_pair};
use crate::bodies::{BodyDef, BodyHandle, BodyKind, Filter};
use crate::broadphase::{BroadPhase, Proxy};
use crate::constraints::kernels::types::ConstraintType;
use crate::error::Error;
use crate::shapes::{Aabb, MassProperties, Shape};
use glam::{DVec2, Vec2};
use std::f64::consts::TAU;
use std::hash::{BuildHasher, RandomState};
use std::ops::Range;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Body slots: which indices are in use.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Slots {
    /// Generation of the current or last body at each index. `[bodies]`
    pub generation: Vec<u32>,
    /// Whether the index is in use. `[bodies]`
    pub lives: Vec<bool>,
    /// First shape of each body; its shapes are consecutive. `[bodies]`
    pub first_shape: Vec<u32>,
    /// Number of shapes of each body. `[bodies]`
    pub shapes: Vec<u32>,
    /// Indices that may be reused.
    pub free: Vec<u32>,
    /// Generation of the first body at each index. Every new world has another one, so it does not accept the handles of
    /// others. Clones and saved copies keep it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub first_generation: u32,
    /// Bodies removed since the last step; their indices may be reused after the next.
    pub removed: Vec<u32>,
}

impl Slots {
    /// Slots of a new world.
    pub fn new() -> Self {
        /// Far from those of other worlds, however often indices are reused.
        const APART: u32 = 0x9E37_79B9;
        // Random, so that it is far from those of saved worlds and handles, too.
        static FIRST: LazyLock<u32> = LazyLock::new(|| RandomState::new().hash_one(APART) as u32);
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let apart = COUNT.fetch_add(APART, Ordering::Relaxed);
        Slots { first_generation: FIRST.wrapping_add(apart), ..Slots::default() }
    }

    /// The error for a handle with generation `given`, at an index whose last body or joint has generation `now`.
    pub fn rejects(&self, kind: &'static str, index: usize, given: u32, now: Option<u32>) -> Error {
        let age = |generation: u32| generation.wrapping_sub(self.first_generation);
        if now.is_some_and(|now| age(given) < age(now)) {
            return Error::Removed { kind, index };
        }
        Error::invalid(format!("{kind} {index}"), "is the handle of another world")
    }
}

/// Persistent force and torque of a body, saved before those for one step are added.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct StandingForces {
    pub(super) body: u32,
    force: Vec2,
    torque: f32,
}

/// Where a kinematic body is after the next step.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Target {
    pub(super) body: u32,
    position: [f64; 2],
    angle: f64,
}

/// Bounding box of an empty slot.
const NOWHERE: Aabb = Aabb { min: Vec2::NAN, max: Vec2::NAN };

impl World {
    /// Adds a body. The handle stays valid until the body is removed.
    ///
    /// The body reuses the index of a body that was removed before the last step and had the same number of
    /// shapes, if there is one. Errors: as [`BodyDef::check`].
    ///
    /// ```
    /// use simpulse_engine::prelude::*;
    ///
    /// let mut world = World::default();
    /// let ball = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(ShapeDef::circle(0.5)?))?;
    /// assert_eq!(world.body(ball)?.position(), [0.0, 2.0]);
    /// let heavy = ShapeDef::circle(0.5)?.with_density(-1.0);
    /// let error = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(heavy)).unwrap_err();
    /// assert_eq!(error.to_string(), "shapes[0].density: must be positive, is -1.0");
    /// # Ok::<(), simpulse_engine::error::Error>(())
    /// ```
    pub fn add_body(&mut self, body: &BodyDef) -> Result<BodyHandle, Error> {
        let mass = body.check()?;
        if matches!(&self.broadphase, BroadPhase::Spaces(spaces) if spaces.is_closed()) {
            return Err(Error::invalid("world", "is that of a batch, which has all its bodies"));
        }
        let center = Vec2::new(mass.center[0] as f32, mass.center[1] as f32);
        let shapes: Vec<Shape> = body.shapes.iter().map(|part| part.shape.translated(-center)).collect();
        let count = shapes.len() as u32;
        let slots = &mut self.slots;
        let place = slots.free.iter().position(|&i| slots.shapes[i as usize] == count);
        let index = match place {
            Some(k) => {
                let index = slots.free.swap_remove(k) as usize;
                self.bodies.set(index, body, &mass);
                self.work.kept.forget_body(index);
                index
            }
            None => self.push_body(body, &mass, shapes.len()),
        };
        self.slots.lives[index] = true;
        let round = |shape: &Shape| matches!(shape, Shape::Circle { center, .. } if *center == Vec2::ZERO);
        self.bodies.round[index] = shapes.iter().all(round);
        let first = self.slots.first_shape[index] as usize;
        for (k, (part, shape)) in body.shapes.iter().zip(shapes).enumerate() {
            self.set_shape(first + k, index, shape, [part.friction, part.restitution].map(|x| x as f32));
            if part.filter != Filter::default() {
                self.filters.resize(self.shapes.len(), Filter::default());
            }
            if let Some(filter) = self.filters.get_mut(first + k) {
                *filter = part.filter;
            }
        }
        self.fat_boxes.set(index, first, &self.shapes[first..first + count as usize]);
        if !self.filters.is_empty() {
            self.filters.resize(self.shapes.len(), Filter::default());
        }
        self.sleep.edit(index as u32);
        self.belts.extend(body.belt.then_some(index as u32));
        self.traits.add(body, self.bodies.round[index]);
        self.features = self.traits.features();
        (self.pairs_are_stale, self.continuous_is_stale, self.lanes_are_for) = (true, true, None);
        Ok(BodyHandle { index: index as u32, generation: self.slots.generation[index] })
    }

    /// Appends a slot for a body and its shapes; returns the body's index.
    pub(super) fn push_body(&mut self, body: &BodyDef, mass: &MassProperties, shapes: usize) -> usize {
        let index = self.bodies.push(body, mass);
        let slots = &mut self.slots;
        slots.generation.push(slots.first_generation);
        slots.lives.push(false);
        slots.first_shape.push(self.shapes.len() as u32);
        slots.shapes.push(shapes as u32);
        for _ in 0..shapes {
            self.shapes.push(Shape::Circle { center: Vec2::ZERO, radius: 1.0 });
            self.shape_body.push(index as u32);
            self.surfaces.push(Surface::default());
            self.proxies.push(Proxy { aabb: NOWHERE, body: index as u32, group: 0, dynamic: false });
        }
        index
    }

    /// Sets shape `i` of body `body`, with its friction and restitution.
    pub(super) fn set_shape(
        &mut self,
        i: usize,
        body: usize,
        shape: Shape,
        [friction, restitution]: [f32; 2],
    ) {
        // Fat boxes are computed in the next step.
        let aabb = shape.aabb(&self.bodies.pose(body));
        let (class, number) = self.narrow.shapes.push(&shape);
        self.shapes[i] = shape;
        self.surfaces[i] = Surface {
            friction,
            restitution,
            reach: shape.reach(),
            half_width: shape.min_half_extent(),
            class,
            number,
        };
        let (group, dynamic) = (self.bodies.group[body], self.bodies.is_dynamic(body));
        self.proxies[i] = Proxy { aabb, body: body as u32, group, dynamic };
    }

    /// Removes a body, its contacts and its joints. Handles and indices of other bodies stay valid.
    ///
    /// Until its index is reused, it belongs to a static body without contacts. `contacts` lists those of the
    /// last step until the next step. Errors: the body was removed before; a constraint from
    /// [`World::add_constraints`] is attached to it.
    ///
    /// ```
    /// # use simpulse_engine::prelude::*;
    /// let mut world = World::default();
    /// let ball = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(ShapeDef::circle(0.5)?))?;
    /// world.remove_body(ball)?;
    /// assert!(!world.contains(ball));
    /// let error = world.set_velocity(ball, [1.0, 0.0], 0.0).unwrap_err();
    /// assert_eq!(error.to_string(), "body 0 was removed");
    /// # Ok::<(), simpulse_engine::error::Error>(())
    /// ```
    pub fn remove_body(&mut self, body: BodyHandle) -> Result<(), Error> {
        let i = self.index_of(body)?;
        if self
            .own_types()
            .iter()
            .any(|joined| joined.kind.ends().iter().flatten().any(|&end| end as usize == i))
        {
            return Err(Error::invalid(format!("body {i}"), "has constraints of another type than contacts"));
        }
        self.remove_joints_of(body);
        self.sleep.edit(body.index);
        self.seams_are_stale |= self.bodies.kind[i] == BodyKind::Static;
        let nothing = BodyDef::fixed([0.0; 2]);
        self.bodies.set(i, &nothing, &MassProperties::ZERO);
        let slots = &mut self.slots;
        slots.lives[i] = false;
        slots.generation[i] = slots.generation[i].wrapping_add(1);
        slots.removed.push(body.index);
        let [first, count] = [slots.first_shape[i], slots.shapes[i]].map(|k| k as usize);
        self.leave_world(i, first, count);
        self.applied.retain(|standing| standing.body != body.index);
        self.belts.retain(|&belt| belt != body.index);
        self.targets.retain(|target| target.body != body.index);
        (self.pairs_are_stale, self.continuous_is_stale, self.lanes_are_for) = (true, true, None);
        Ok(())
    }

    /// Removes a body's shapes, `count` of them starting at `first`, from the broad phase.
    pub(super) fn leave_world(&mut self, body: usize, first: usize, count: usize) {
        for (proxy, surface) in self.proxies[first..].iter_mut().zip(&self.surfaces[first..]).take(count) {
            (proxy.aabb, proxy.dynamic) = (NOWHERE, false);
            self.narrow.shapes.remove(surface.number);
        }
        self.fat_boxes.remove(body);
    }

    /// Whether the body is still in the world.
    pub fn contains(&self, body: BodyHandle) -> bool {
        self.index_of(body).is_ok()
    }

    /// The index of a body. Errors: the body was removed, or is of another world.
    pub fn index_of(&self, body: BodyHandle) -> Result<usize, Error> {
        let (i, slots) = (body.index(), &self.slots);
        let now = slots.generation.get(i).copied();
        let is_same = now == Some(body.generation) && slots.lives[i];
        if is_same { Ok(i) } else { Err(slots.rejects("body", i, body.generation, now)) }
    }

    /// The handle of the body at an index, as found in contacts and divergences; `None` if the index is not
    /// in use.
    pub fn handle(&self, index: usize) -> Option<BodyHandle> {
        let lives = self.slots.lives.get(index).copied().unwrap_or(false);
        lives.then(|| BodyHandle { index: index as u32, generation: self.slots.generation[index] })
    }

    /// Handles of all bodies, in the order of their indices.
    pub fn handles(&self) -> impl Iterator<Item = BodyHandle> {
        (0..self.bodies.len()).filter_map(|i| self.handle(i))
    }

    /// Moves a body: sets the origin of its frame to `position` (m) and its angle to `angle` (rad). The
    /// velocity is unchanged.
    ///
    /// Errors: the body was removed; a value that is not finite.
    ///
    /// ```
    /// # use simpulse_engine::prelude::*;
    /// # let mut world = World::default();
    /// # let ball = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(ShapeDef::circle(0.5)?))?;
    /// world.set_pose(ball, [3.0, 1.0], 0.3)?;
    /// world.set_velocity(ball, [0.0, 5.0], -1.0)?;
    /// assert_eq!(world.body(ball)?.position(), [3.0, 1.0]);
    /// # Ok::<(), simpulse_engine::error::Error>(())
    /// ```
    pub fn set_pose(&mut self, body: BodyHandle, position: [f64; 2], angle: f64) -> Result<(), Error> {
        let i = self.index_of(body)?;
        finite_pair("position", position)?;
        finite("angle", angle)?;
        let center = self.bodies.local_center[i].as_dvec2().to_array();
        self.bodies.place(i, position, angle, center);
        self.fat_boxes.forget(i);
        Ok(())
    }

    /// Moves a kinematic body to a pose in the next step, at the velocity that this takes; what it meets on its way
    /// is pushed. It then rests there. Position in m, angle in rad; it turns the shorter way.
    ///
    /// Errors: the body was removed; it is not kinematic; a value that is not finite.
    ///
    /// ```
    /// # use simpulse_engine::prelude::*;
    /// # let mut world = World::default();
    /// let lift = BodyDef::kinematic([0.0, 0.0]).with(ShapeDef::rectangle(2.0, 0.1)?);
    /// let lift = world.add_body(&lift)?;
    /// world.move_to(lift, [0.0, 0.05], 0.01)?;
    /// world.step()?;
    /// assert!((world.body(lift)?.position()[1] - 0.05).abs() < 1e-12);
    /// assert_eq!(world.body(lift)?.velocity(), [0.0; 2]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn move_to(&mut self, body: BodyHandle, position: [f64; 2], angle: f64) -> Result<(), Error> {
        let i = self.index_of(body)?;
        finite_pair("position", position)?;
        finite("angle", angle)?;
        self.settings.check()?;
        if self.bodies.kind[i] != BodyKind::Kinematic {
            return Err(Error::invalid(format!("body {i}"), "is not kinematic"));
        }
        let dt = f64::from(self.settings.dt);
        let center = DVec2::from_angle(angle).rotate(self.bodies.local_center[i].as_dvec2());
        let way = DVec2::from(position) + center - DVec2::from(self.bodies.center(i));
        let turn = angle - f64::from(self.bodies.angle(i));
        let turn = turn - (turn / TAU).round() * TAU;
        self.set_velocity(body, (way / dt).to_array(), turn / dt)?;
        self.targets.push(Target { body: body.index, position, angle });
        Ok(())
    }

    /// Sets the collision group of a body; bodies of the same non-zero group do not collide. Errors: the body was removed.
    pub fn set_group(&mut self, body: BodyHandle, group: i32) -> Result<(), Error> {
        let i = self.index_of(body)?;
        self.bodies.group[i] = group;
        self.sleep.edit(body.index);
        let [first, count] = [self.slots.first_shape[i], self.slots.shapes[i]].map(|k| k as usize);
        self.proxies[first..first + count].iter_mut().for_each(|proxy| proxy.group = group);
        self.pairs_are_stale = true;
        Ok(())
    }

    /// Sets the velocity of a body's center of mass (m/s) and its spin (rad/s). Cancels [`World::move_to`].
    ///
    /// Errors: the body was removed; it is static; a value that is not finite.
    pub fn set_velocity(&mut self, body: BodyHandle, velocity: [f64; 2], spin: f64) -> Result<(), Error> {
        let i = self.index_of(body)?;
        finite_pair("velocity", velocity)?;
        finite("angular_velocity", spin)?;
        if self.bodies.kind[i] == BodyKind::Static {
            return Err(Error::invalid(format!("body {i}"), "is static and has no velocity"));
        }
        self.targets.retain(|target| target.body != body.index);
        [self.bodies.velocity_x[i], self.bodies.velocity_y[i]] = velocity.map(|x| x as f32);
        self.bodies.angular_velocity[i] = spin as f32;
        Ok(())
    }

    /// Applies a force (N) at the center of mass during the next step only, in addition to the persistent
    /// [`Bodies::force_x`](crate::bodies::Bodies::force_x), which lasts until it is changed. It moves
    /// only dynamic bodies.
    ///
    /// Errors: the body was removed; a value that is not finite.
    ///
    /// ```
    /// # use simpulse_engine::prelude::*;
    /// # let mut world = World::default();
    /// # let ball = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(ShapeDef::circle(0.5)?))?;
    /// world.apply_force(ball, [500.0, 0.0])?;
    /// world.step()?;
    /// let speed = world.body(ball)?.velocity()[0];
    /// world.step()?;
    /// assert_eq!(world.body(ball)?.velocity()[0], speed);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn apply_force(&mut self, body: BodyHandle, force: [f64; 2]) -> Result<(), Error> {
        self.apply(body, force, 0.0)
    }

    /// Applies a torque (N·m) during the next step only. Errors: as [`World::apply_force`].
    pub fn apply_torque(&mut self, body: BodyHandle, torque: f64) -> Result<(), Error> {
        self.apply(body, [0.0; 2], torque)
    }

    /// Changes the velocity of a dynamic body immediately, by an impulse (N·s) at a world point (m).
    ///
    /// Errors: the body was removed; a value that is not finite.
    ///
    /// ```
    /// # use simpulse_engine::prelude::*;
    /// # let mut world = World::default();
    /// let plate = ShapeDef::rectangle(1.0, 0.125)?.with_density(2.0);
    /// let plate = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(plate))?;
    /// // 2 N·s upward at the right end of 1 kg: it rises and turns.
    /// world.apply_impulse(plate, [0.0, 2.0], [1.0, 2.0])?;
    /// assert_eq!(world.body(plate)?.velocity()[1], 2.0);
    /// assert!(world.body(plate)?.spin() > 5.0);
    /// # Ok::<(), simpulse_engine::error::Error>(())
    /// ```
    pub fn apply_impulse(
        &mut self,
        body: BodyHandle,
        impulse: [f64; 2],
        point: [f64; 2],
    ) -> Result<(), Error> {
        let i = self.index_of(body)?;
        finite_pair("impulse", impulse)?;
        finite_pair("point", point)?;
        let [x, y] = self.bodies.center(i);
        let arm = Vec2::new((point[0] - x) as f32, (point[1] - y) as f32);
        let impulse = DVec2::from(impulse).as_vec2();
        let b = &mut self.bodies;
        b.velocity_x[i] += b.inv_mass[i] * impulse.x;
        b.velocity_y[i] += b.inv_mass[i] * impulse.y;
        b.angular_velocity[i] += b.inv_inertia[i] * arm.perp_dot(impulse);
        Ok(())
    }

    fn apply(&mut self, body: BodyHandle, force: [f64; 2], torque: f64) -> Result<(), Error> {
        let i = self.index_of(body)?;
        finite_pair("force", force)?;
        finite("torque", torque)?;
        let b = &mut self.bodies;
        let standing = StandingForces {
            body: body.index,
            force: Vec2::new(b.force_x[i], b.force_y[i]),
            torque: b.torque[i],
        };
        self.applied.push(standing);
        b.force_x[i] += force[0] as f32;
        b.force_y[i] += force[1] as f32;
        b.torque[i] += torque as f32;
        Ok(())
    }

    /// After bodies with these indices were put back to their start: forgets their contacts, what the solver keeps of them, and
    /// forces for the next step; restarts their joints.
    pub(super) fn restart(&mut self, bodies: Range<usize>, joints: Range<u32>) {
        let shapes =
            |i: usize| self.slots.first_shape.get(i).map_or(self.shapes.len() as u32, |&first| first);
        let shapes = shapes(bodies.start)..shapes(bodies.end);
        for i in bodies.clone() {
            // The ground has not moved.
            if self.bodies.kind[i] != BodyKind::Static {
                self.fat_boxes.forget(i);
            }
            self.work.kept.forget_body(i);
            self.sleep.edit(i as u32);
        }
        self.applied.retain(|standing| !bodies.contains(&(standing.body as usize)));
        self.targets.retain(|target| !bodies.contains(&(target.body as usize)));
        self.work.kept.forget_shapes(shapes.clone());
        self.narrow.forget(shapes);
        self.restart_joints(joints);
    }

    /// After a step: restores persistent forces, ends moves of kinematic bodies and frees the indices of removed bodies.
    pub(super) fn end_edits(&mut self) {
        while let Some(StandingForces { body, force, torque }) = self.applied.pop() {
            let i = body as usize;
            (self.bodies.force_x[i], self.bodies.force_y[i]) = (force.x, force.y);
            self.bodies.torque[i] = torque;
        }
        while let Some(Target { body, position, angle }) = self.targets.pop() {
            let (i, b) = (body as usize, &mut self.bodies);
            b.place(i, position, angle, b.local_center[i].as_dvec2().to_array());
            (b.velocity_x[i], b.velocity_y[i], b.angular_velocity[i]) = (0.0, 0.0, 0.0);
        }
        self.slots.free.append(&mut self.slots.removed);
    }

    /// Adds constraints of a type of your own. They take part in every pass of the solver.
    pub fn add_constraints(&mut self, kind: Box<dyn ConstraintType>) {
        kind.ends().iter().flatten().for_each(|&body| self.sleep.edit(body));
        self.add_type(kind);
        self.lanes_are_for = None;
    }
}
