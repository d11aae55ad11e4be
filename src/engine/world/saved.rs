//! Serialization of a world: the state at the start of a step, without values that the step recomputes.
//!
//! Not saved: constraints of the caller's own types (a world with any is an error). A world continues bit-identically.

use super::edit::{Slots, StandingForces, Target};
use super::events::Events;
use super::joints::SavedJoints;
use super::sleep::Sleep;
use super::traits::Traits;
use super::{Settings, World};
use crate::bodies::{Bodies, BodyDef, Filter};
use crate::constraints::records::kept::SolverState;
use crate::contacts::Contact;
use crate::lanes::LaneWidth;
use crate::narrowphase::frozen::Found;
use crate::shapes::{MassProperties, Shape};
use crate::solvers::{self, Variant};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Default length unit of saved settings: one meter.
pub(super) fn one() -> f32 {
    1.0
}

/// Default size of groups of saved settings.
pub(super) fn group_size() -> usize {
    super::settings::GROUP_SIZE
}

/// Default number of threads of saved settings.
pub(super) fn one_thread() -> usize {
    1
}

/// A solver by its name. Errors: an unknown one.
pub(super) mod solver {
    use super::*;

    pub fn serialize<S: Serializer>(solver: &&'static Variant, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(solver.name)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<&'static Variant, D::Error> {
        solvers::find(&String::deserialize(from)?).map_err(serde::de::Error::custom)
    }
}

/// A width by its number of lanes. Errors: a number other than 1, 4, 8 and 16.
pub(super) mod lanes {
    use super::*;

    pub fn serialize<S: Serializer>(width: &LaneWidth, to: S) -> Result<S::Ok, S::Error> {
        width.lanes().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<LaneWidth, D::Error> {
        let n = usize::deserialize(from)?;
        let error = || serde::de::Error::custom(format!("{n} lanes: 1, 4, 8 or 16"));
        LaneWidth::from_lanes(n).ok_or_else(error)
    }
}

#[derive(Serialize, Deserialize)]
struct SavedWorld {
    settings: Settings,
    step_index: u64,
    slots: Slots,
    bodies: Bodies,
    shapes: Vec<Shape>,
    /// Friction and restitution of each shape.
    surfaces: Vec<[f32; 2]>,
    contacts: Vec<Contact>,
    impulses_of: Option<f32>,
    kept: SolverState,
    /// [`Solver::kept`](crate::constraints::Solver::kept)
    #[serde(default)]
    of_solver: Vec<f64>,
    #[serde(default)]
    found: Vec<Found>,
    applied: Vec<StandingForces>,
    #[serde(default)]
    targets: Vec<Target>,
    #[serde(default)]
    filters: Vec<Filter>,
    #[serde(default)]
    belts: Vec<u32>,
    events: Events,
    traits: Traits,
    #[serde(default)]
    joints: SavedJoints,
    #[serde(default)]
    sleep: Sleep,
}

/// Errors: constraints of the caller's own types.
impl Serialize for World {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        if !self.own_types().is_empty() {
            let message = "constraints of the caller's own types cannot be saved";
            return Err(serde::ser::Error::custom(message));
        }
        let is_active = std::ptr::eq(self.solver_is, self.settings.solver);
        let saved = SavedWorld {
            settings: self.settings.clone(),
            step_index: self.step_index,
            slots: self.slots.clone(),
            bodies: self.bodies.clone(),
            shapes: self.shapes.clone(),
            surfaces: self.surfaces.iter().map(|s| [s.friction, s.restitution]).collect(),
            contacts: self.contacts.clone(),
            impulses_of: self.impulses_of,
            kept: self.work.kept.clone(),
            // The caller may have changed the list of contacts.
            found: if self.narrow.has_lost(self.contacts.len()) { vec![] } else { self.narrow.found.clone() },
            of_solver: if is_active { self.solver.kept() } else { Vec::new() },
            applied: self.applied.clone(),
            targets: self.targets.clone(),
            filters: self.filters.clone(),
            belts: self.belts.clone(),
            events: self.events.clone(),
            traits: self.traits,
            joints: SavedJoints::of(self),
            sleep: self.sleep.clone(),
        };
        saved.serialize(to)
    }
}

impl<'de> Deserialize<'de> for World {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut saved = SavedWorld::deserialize(from)?;
        saved.check().and_then(|()| saved.restore()).map_err(serde::de::Error::custom)
    }
}

impl SavedWorld {
    /// Whether all arrays have matching lengths and all indices are valid.
    fn check(&mut self) -> Result<(), String> {
        self.settings.check().map_err(|e| e.within("settings").to_string())?;
        let (n, shapes) = (self.bodies.len(), self.shapes.len());
        let floats = self.bodies.arrays_mut().map(|array| array.len());
        let (b, s) = (&self.bodies, &self.slots);
        let lengths = [
            b.group.len(),
            b.bullet.len(),
            b.round.len(),
            b.local_center.len(),
            s.generation.len(),
            s.lives.len(),
            s.first_shape.len(),
            s.shapes.len(),
        ];
        if floats.into_iter().chain(lengths).any(|len| len != n) {
            return Err(format!("arrays of bodies have other lengths than {n}"));
        }
        if self.surfaces.len() != shapes {
            return Err(format!("{} surfaces of {shapes} shapes", self.surfaces.len()));
        }
        let mut next = 0_u64;
        for (i, (&first, &count)) in s.first_shape.iter().zip(&s.shapes).enumerate() {
            if u64::from(first) != next {
                return Err(format!("body {i}: its shapes begin at {first}, not at {next}"));
            }
            next += u64::from(count);
        }
        if next != shapes as u64 {
            return Err(format!("bodies have {next} shapes of {shapes}"));
        }
        for (i, shape) in self.shapes.iter().enumerate() {
            shape.check().map_err(|e| format!("shapes[{i}]: {e}"))?;
        }
        self.joints.check(n)?;
        if !self.sleep.is_consistent(n) {
            return Err("sleep: lists of other lengths than of bodies".into());
        }
        if !self.kept.is_consistent() {
            return Err("kept: as many numbers as names".into());
        }
        if !self.filters.is_empty() && self.filters.len() != shapes {
            return Err(format!("{} filters of {shapes} shapes", self.filters.len()));
        }
        if !self.found.is_empty() && self.found.len() != self.contacts.len() {
            return Err(format!("found: {} entries for {} contacts", self.found.len(), self.contacts.len()));
        }
        let is_body = |&i: &u32| (i as usize) < n;
        let mut named = s.free.iter().chain(&s.removed);
        if !named.all(is_body)
            || !self.applied.iter().all(|standing| is_body(&standing.body))
            || !self.targets.iter().all(|target| is_body(&target.body))
            || !self.belts.iter().all(is_body)
        {
            return Err(format!("a body that is none of {n}"));
        }
        let is_one = |c: &Contact| {
            let in_range = [c.shape_a, c.shape_b].into_iter().all(|shape| (shape as usize) < shapes);
            in_range && [c.body_a, c.body_b].iter().all(is_body) && c.manifold.count <= 2
        };
        match self.contacts.iter().position(|contact| !is_one(contact)) {
            Some(i) => Err(format!("contacts[{i}] names a body or shape that there is not")),
            None => Ok(()),
        }
    }

    fn restore(self) -> Result<World, String> {
        let mut world = World::new(self.settings);
        let nothing = BodyDef::fixed([0.0; 2]);
        for &count in &self.slots.shapes {
            world.push_body(&nothing, &MassProperties::ZERO, count as usize);
        }
        world.bodies = self.bodies;
        for (i, (shape, surface)) in self.shapes.into_iter().zip(self.surfaces).enumerate() {
            world.set_shape(i, world.shape_body[i] as usize, shape, surface);
        }
        for (i, (&first, &count)) in self.slots.first_shape.iter().zip(&self.slots.shapes).enumerate() {
            let (first, count) = (first as usize, count as usize);
            world.fat_boxes.set(i, first, &world.shapes[first..first + count]);
            if !self.slots.lives[i] {
                world.leave_world(i, first, count);
            }
        }
        world.slots = self.slots;
        (world.step_index, world.traits) = (self.step_index, self.traits);
        world.features = world.traits.features();
        (world.applied, world.events, world.impulses_of) = (self.applied, self.events, self.impulses_of);
        (world.targets, world.filters, world.belts) = (self.targets, self.filters, self.belts);
        world.narrow.found = self.found;
        if self.kept.size() == world.solver_is.kept {
            world.work.kept = self.kept;
        }
        if !world.solver.set_kept(&self.of_solver) {
            return Err(format!("of_solver: are not numbers of {}", world.solver_is.name));
        }
        self.joints.restore(&mut world);
        world.contacts = self.contacts;
        world.narrow.expect(world.contacts.len());
        world.sleep = self.sleep;
        world.resume_sleep();
        world.update_pairs();
        world.narrow.relink(&mut world.contacts);
        Ok(world)
    }
}
