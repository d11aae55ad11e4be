//! Adding, changing, removing and reading joints.

use super::World;
use super::candidates::ignores;
use crate::bodies::{Bodies, BodyHandle};
use crate::constraints::joints::Joints;
use crate::constraints::kernels::types::{BodyStates, ConstraintSet, ConstraintType, RecordedImpulses};
use crate::constraints::records::rows::{ROWS, RowBlock};
use crate::error::Error;
use crate::joints::{Definition, Form, Joint, JointHandle, JointKind, JointState, measured, of_kind};
use crate::lanes::BodyRow;
use crate::narrowphase::lanes::PoseRow;
use std::any::Any;
use std::collections::BTreeSet;
use std::ops::Range;

/// A block of rows of a joint after a step.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct SolvedBlock {
    /// The joint; `None` for a constraint of the caller's own type.
    pub joint: Option<JointHandle>,
    /// The block's rows, with the impulses of the last substep.
    pub block: RowBlock,
    /// Impulses of the whole step, with `Settings::record_impulses`; zeros otherwise (N·s or N·m·s). `[size]`
    pub step_impulses: [f32; ROWS],
}

/// Joint slots, and where each joint is solved.
#[derive(Clone, Debug, Default)]
pub(super) struct JointSlots {
    /// `[joints]`
    joints: Vec<Option<Joint>>,
    generation: Vec<u32>,
    /// Indices that may be reused.
    free: Vec<u32>,
    /// Index of the joint's group among the types of the workspace, and its index in that group; `[joints]`.
    places: Vec<Option<[u32; 2]>>,
    /// Number of groups of joints; they are the last types of the workspace.
    groups: usize,
    /// Whether joints were added, changed or removed since they were grouped.
    stale: bool,
    /// `[body, joint]`: the joints of each body.
    of_body: BTreeSet<[u32; 2]>,
    /// Kept numbers and angles of a deserialized world; `[joints]`, or empty.
    read: Vec<(Vec<f32>, f32)>,
    /// Pairs of bodies that do not collide with each other, smaller index first.
    apart: BTreeSet<[u32; 2]>,
}

impl JointSlots {
    /// Whether a joint keeps two bodies from colliding.
    pub fn keeps_apart(&self, [a, b]: [u32; 2]) -> bool {
        self.keeps_any_apart() && self.apart.contains(&[a.min(b), a.max(b)])
    }

    /// Whether joints keep any bodies from colliding.
    pub fn keeps_any_apart(&self) -> bool {
        !self.apart.is_empty()
    }

    fn remove(&mut self, index: usize) {
        self.set(index, None);
        self.generation[index] = self.generation[index].wrapping_add(1);
        self.places[index] = None;
        self.free.push(index as u32);
    }

    /// Replaces the joint at an index.
    fn set(&mut self, index: usize, joint: Option<Joint>) {
        let ends = |joint: &Joint| joint.ends().map(|body| [body.index, index as u32]);
        for end in self.joints[index].iter().flat_map(ends) {
            self.of_body.remove(&end);
        }
        self.of_body.extend(joint.iter().flat_map(ends));
        self.joints[index] = joint;
    }

    fn add(&mut self, joint: Joint, first_generation: u32) -> JointHandle {
        let index = self.free.pop().map_or(self.joints.len(), |index| index as usize);
        if index == self.joints.len() {
            self.joints.push(None);
            self.generation.push(first_generation);
            self.places.push(None);
        }
        keep_apart(&mut self.apart, &joint);
        self.set(index, Some(joint));
        JointHandle { index: index as u32, generation: self.generation[index] }
    }
}

/// Records the bodies of a joint that keeps them from colliding.
fn keep_apart(apart: &mut BTreeSet<[u32; 2]>, joint: &Joint) {
    if !joint.collide_connected {
        let [a, b] = [joint.a.index() as u32, joint.b.index() as u32];
        apart.insert([a.min(b), a.max(b)]);
    }
}

impl World {
    /// Adds a joint. The handle stays valid until the joint is removed.
    ///
    /// Errors: a value out of range; the handle of a removed body; a joint from a body to itself; two bodies
    /// neither of which is dynamic; a solver without support for joints. The last two do not apply to
    /// filters.
    pub fn add_joint(&mut self, joint: &Joint) -> Result<JointHandle, Error> {
        let joint = self.admit(joint)?;
        Ok(self.joints.add(joint, self.slots.first_generation))
    }

    /// Checks a joint and prepares its bodies; returns the joint with its frames.
    fn admit(&mut self, joint: &Joint) -> Result<Joint, Error> {
        self.check_joint(joint)?;
        let joint = joint.placed(&self.bodies);
        joint.kind.check()?;
        for body in [joint.a.index(), joint.b.index()] {
            // The anchors of round bodies turn, too.
            self.bodies.round[body] = false;
        }
        self.traits.spins();
        self.features = self.traits.features();
        self.edit(joint.ends());
        self.joints_changed();
        Ok(joint)
    }

    /// Changes a joint: its bodies, frames and values. Impulses carry over row by row.
    ///
    /// Errors: as [`Self::add_joint`]; the joint was removed.
    pub fn set_joint(&mut self, handle: JointHandle, joint: &Joint) -> Result<(), Error> {
        let old = self.joint(handle)?.ends();
        let joint = self.admit(joint)?;
        self.edit(old);
        keep_apart(&mut self.joints.apart, &joint);
        self.joints.set(handle.index(), Some(joint));
        Ok(())
    }

    /// Removes a joint. Errors: it was removed before.
    pub fn remove_joint(&mut self, handle: JointHandle) -> Result<(), Error> {
        let ends = self.joint(handle)?.ends();
        self.remove_slot(handle.index(), ends);
        Ok(())
    }

    /// The definition of a joint, with its frames. Errors: the joint was removed, or is of another world.
    pub fn joint(&self, handle: JointHandle) -> Result<&Joint, Error> {
        let (index, slots) = (handle.index(), &self.joints);
        let now = slots.generation.get(index).copied();
        let joint =
            slots.joints.get(index).and_then(Option::as_ref).filter(|_| now == Some(handle.generation));
        joint.ok_or_else(|| self.slots.rejects("joint", index, handle.generation, now))
    }

    /// All joints, with their handles.
    pub fn joints(&self) -> impl Iterator<Item = (JointHandle, &Joint)> {
        self.joints.joints.iter().zip(&self.joints.generation).enumerate().filter_map(
            |(i, (joint, &generation))| {
                joint.as_ref().map(|joint| (JointHandle { index: i as u32, generation }, joint))
            },
        )
    }

    /// Joints of a body, with their handles.
    pub(super) fn joints_of(&self, body: BodyHandle) -> impl Iterator<Item = (JointHandle, &Joint)> {
        let JointSlots { joints, generation, of_body, .. } = &self.joints;
        of_body.range([body.index, 0]..=[body.index, u32::MAX]).filter_map(|&[_, index]| {
            let handle = JointHandle { index, generation: generation[index as usize] };
            joints[index as usize].as_ref().map(|joint| (handle, joint))
        })
    }

    /// Position errors and load of a joint after the last step. Errors: the joint was removed, or is of another world.
    pub fn joint_state(&self, handle: JointHandle) -> Result<JointState, Error> {
        let joint = self.joint(handle)?;
        let ends = [joint.a.index(), joint.b.index()];
        let (kept, last) = match self.joints.places[handle.index()] {
            Some([group, place]) => {
                let kind = &self.work.types[group as usize].kind;
                (kind.impulses(place as usize), f64::from(kind.angle(place as usize)))
            }
            None => (&[][..], 0.0),
        };
        let solved = joint.kind.solved();
        let angle = f64::from(self.bodies.angle(ends[1])) - f64::from(self.bodies.angle(ends[0]));
        let angle = angle - reference(&solved);
        let turns = ((last - angle) / std::f64::consts::TAU).round();
        let angle = angle + turns * std::f64::consts::TAU + (reference(&solved) - reference(&joint.kind));
        let at = measured(&self.bodies, ends, joint.kind.anchors(), angle);
        let mut state = joint.kind.measure(&at);
        if !kept.is_empty() {
            let ((linear, angular), h) = (solved.impulse(kept, &at), f64::from(self.settings.h()));
            (state.force, state.torque) = ((linear / h).to_array(), angular / h);
        }
        let load = state.load();
        state.breaks = joint.break_load.is_some_and(|most| (0..2).any(|k| load[k] > most[k]));
        Ok(state)
    }

    /// Impulses of a joint in the last step, with `Settings::record_impulses`; `None` without it, or if the
    /// joint was added since. Errors: the joint was removed, or is of another world.
    pub fn joint_impulses(&self, handle: JointHandle) -> Result<Option<RecordedImpulses>, Error> {
        self.joint(handle)?;
        let place = self.joints.places[handle.index()];
        Ok(place.and_then(|[group, i]| self.work.types[group as usize].kind.recorded(i as usize)))
    }

    /// Blocks of all joints in the next step, as if it were a single step of `h` (s) without substeps, with
    /// their warm-start impulses. Each block comes with the number of its joint in solving order; the blocks
    /// of a joint are consecutive. Call [`World::find_contacts`] first.
    pub fn coming_blocks(&self, h: f32) -> Vec<(usize, RowBlock)> {
        let bodies = &self.bodies;
        let row = |i: usize| BodyRow {
            velocity: [
                bodies.velocity_x[i],
                bodies.velocity_y[i],
                bodies.angular_velocity[i],
                bodies.inv_mass[i],
            ],
            delta: [0.0, 0.0, 0.0, bodies.inv_inertia[i]],
        };
        let rows: Vec<BodyRow> = (0..bodies.len()).map(row).chain([BodyRow::default()]).collect();
        let poses: Vec<PoseRow> = self.narrow.poses().iter().copied().chain([PoseRow::default()]).collect();
        let mut found = Vec::new();
        let mut blocks = Vec::new();
        let mut number = 0;
        for joined in &self.work.types {
            let mut kind = joined.kind.clone();
            kind.begin(bodies, h);
            for i in 0..kind.ends().len() {
                found.clear();
                kind.collect(i, BodyStates { rows: &rows, poses: &poses }, &mut found);
                blocks.extend(found.iter().map(|&block| (number, block)));
                number += 1;
            }
        }
        blocks
    }

    /// Blocks of all joints at the state after the last step, in the order in which they are solved.
    pub fn solved_blocks(&self) -> Vec<SolvedBlock> {
        let work = &self.work;
        let mut names = vec![Vec::new(); work.types.len()];
        for (handle, _) in self.joints() {
            if let Some([group, i]) = self.joints.places[handle.index()] {
                let of_group: &mut Vec<Option<JointHandle>> = &mut names[group as usize];
                of_group.resize(of_group.len().max(i as usize + 1), None);
                of_group[i as usize] = Some(handle);
            }
        }
        let on = BodyStates { rows: &work.rows, poses: &work.poses };
        let (mut last, mut step, mut solved) = (Vec::new(), Vec::new(), Vec::new());
        if work.poses.len() != work.rows.len() {
            return solved;
        }
        for (joined, names) in work.types.iter().zip(&names) {
            let mut kind = joined.kind.clone();
            for i in 0..kind.ends().len() {
                last.clear();
                step.clear();
                kind.collect(i, on, &mut last);
                kind.collect_recorded(i, on, &mut step);
                let joint = names.get(i).copied().flatten();
                solved.extend(last.iter().zip(&step).map(|(&block, step): (&RowBlock, &RowBlock)| {
                    SolvedBlock { joint, block, step_impulses: step.impulses }
                }));
            }
        }
        solved
    }

    /// Whether a joint or filters keep two shapes from colliding. A removed or changed joint still does until the
    /// next step.
    pub fn keeps_apart(&self, shapes: [u32; 2]) -> bool {
        let bodies = shapes.map(|shape| self.shape_body[shape as usize]);
        ignores(&self.joints, &self.filters, shapes, bodies)
    }

    fn check_joint(&self, joint: &Joint) -> Result<(), Error> {
        joint.kind.check()?;
        let ends = [self.index_of(joint.a)?, self.index_of(joint.b)?];
        if ends[0] == ends[1] {
            return Err(Error::invalid("b", format!("body {} has no joint to itself", ends[1])));
        }
        if !ends.iter().any(|&i| self.bodies.is_dynamic(i)) && joint.kind != JointKind::Filter {
            let message = format!("neither body {} nor body {} moves by forces", ends[0], ends[1]);
            return Err(Error::invalid("b", message));
        }
        if let (Some(reason), false) =
            (self.settings.solver.joints_unsupported, joint.kind == JointKind::Filter)
        {
            let message = format!("{} holds no joints: {reason}", self.settings.solver.name);
            return Err(Error::invalid("solver", message));
        }
        Ok(())
    }

    /// Constraints of the caller's own types.
    pub(super) fn own_types(&self) -> &[ConstraintSet] {
        &self.work.types[..self.work.types.len() - self.joints.groups]
    }

    /// Adds constraints of one of the caller's own types, before the groups of joints.
    pub(super) fn add_type(&mut self, kind: Box<dyn ConstraintType>) {
        let place = self.own_types().len();
        self.work.types.insert(place, ConstraintSet::new(kind));
        for [group, _] in self.joints.places.iter_mut().flatten() {
            *group += 1;
        }
    }

    /// Removes all joints of a body.
    pub(super) fn remove_joints_of(&mut self, body: BodyHandle) {
        while let Some(&[_, joint]) =
            self.joints.of_body.range([body.index, 0]..=[body.index, u32::MAX]).next()
        {
            let ends = self.joints.joints[joint as usize].as_ref().map_or([body; 2], Joint::ends);
            self.remove_slot(joint as usize, ends);
        }
    }

    /// Forgets what joints with these indices keep from step to step.
    pub(super) fn restart_joints(&mut self, joints: Range<u32>) {
        for index in joints {
            if let Some([group, i]) = self.joints.places[index as usize] {
                self.work.types[group as usize].kind.restart(i as usize);
            }
        }
    }

    /// Removes the joint at an index, which joins these bodies.
    fn remove_slot(&mut self, index: usize, ends: [BodyHandle; 2]) {
        self.edit(ends);
        self.joints.remove(index);
        self.joints_changed();
    }

    /// Wakes bodies.
    fn edit(&mut self, bodies: [BodyHandle; 2]) {
        bodies.iter().for_each(|body| self.sleep.edit(body.index));
    }

    fn joints_changed(&mut self) {
        (self.joints.stale, self.lanes_are_for, self.pairs_are_stale) = (true, None, true);
    }

    /// Sorts joints into groups of one type and form, which lanes solve together.
    pub(super) fn group_joints(&mut self) {
        if !std::mem::take(&mut self.joints.stale) {
            return;
        }
        let first = self.work.types.len() - self.joints.groups;
        let old: Vec<ConstraintSet> = self.work.types.drain(first..).collect();
        self.joints.apart.clear();
        let of_substep = self.impulses_of.unwrap_or_default();
        let mut keys: Vec<(&'static str, Form, bool)> = Vec::new();
        for index in 0..self.joints.joints.len() {
            let place = self.joints.places[index].take();
            let Some(joint) = &self.joints.joints[index] else { continue };
            keep_apart(&mut self.joints.apart, joint);
            let [a, b] = [joint.a.index() as u32, joint.b.index() as u32];
            let solved = joint.kind.solved();
            let key = (solved.name(), solved.form(), !self.bodies.is_dynamic(b as usize));
            let was = place.map(|[group, i]| (&old[group as usize - first].kind, i as usize));
            let (kept, angle) = match (was, self.joints.read.get(index)) {
                (Some((kind, i)), _) => (kind.impulses(i), kind.angle(i)),
                (None, Some((kept, angle))) => (&kept[..], *angle),
                (None, None) => (&[][..], 0.0),
            };
            of_kind!(&*solved, definition => {
                let group = keys.iter().position(|k| *k == key).unwrap_or_else(|| {
                    keys.push(key);
                    self.work.types.push(ConstraintSet::new(empty(definition, key.2, of_substep)));
                    keys.len() - 1
                });
                let kind: &mut dyn Any = self.work.types[first + group].kind.as_mut();
                let at = push(kind, definition, &self.bodies, [a, b], kept, angle);
                self.joints.places[index] = Some([(first + group) as u32, at]);
            }, else {});
        }
        self.joints.groups = keys.len();
        self.joints.read.clear();
    }
}

fn empty<T: Definition>(of: &T, swapped: bool, h: f32) -> Box<dyn ConstraintType> {
    Box::new(Joints::<T>::new(of.form(), swapped, h))
}

/// Adds a joint to its group; returns its index there.
fn push<T: Definition>(
    group: &mut dyn Any,
    joint: &T,
    bodies: &Bodies,
    ends: [u32; 2],
    kept: &[f32],
    angle: f32,
) -> u32 {
    let Some(group) = group.downcast_mut::<Joints<T>>() else { unreachable!("a group has one type") };
    group.push(joint.clone(), bodies, ends, kept, angle);
    group.joints.len() as u32 - 1
}

/// Angle of b relative to a that counts as zero (rad).
fn reference(kind: &JointKind) -> f64 {
    match kind {
        JointKind::Revolute(joint) => joint.reference_angle,
        JointKind::Prismatic(joint) => joint.reference_angle,
        JointKind::Weld(joint) => joint.reference_angle,
        JointKind::Motor(joint) => joint.angle,
        JointKind::Distance(_) | JointKind::Wheel(_) | JointKind::Mouse(_) | JointKind::Filter => 0.0,
    }
}

/// Serialized joints: definitions and generations by index, and the kept numbers of their rows.
#[cfg(feature = "serde")]
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub(super) struct SavedJoints {
    joints: Vec<Option<Joint>>,
    generation: Vec<u32>,
    free: Vec<u32>,
    kept: Vec<(Vec<f32>, f32)>,
}

#[cfg(feature = "serde")]
impl SavedJoints {
    pub fn of(world: &World) -> Self {
        let JointSlots { joints, generation, free, places, .. } = &world.joints;
        let kept = places.iter().map(|place| match place {
            Some([group, i]) => {
                let kind = &world.work.types[*group as usize].kind;
                (kind.impulses(*i as usize).to_vec(), kind.angle(*i as usize))
            }
            None => Default::default(),
        });
        SavedJoints {
            joints: joints.clone(),
            generation: generation.clone(),
            free: free.clone(),
            kept: kept.collect(),
        }
    }

    /// Errors: lists of different lengths, a body that does not exist, a value out of range.
    pub fn check(&self, bodies: usize) -> Result<(), String> {
        let SavedJoints { joints, generation, free, kept } = self;
        if generation.len() != joints.len() || kept.len() != joints.len() {
            return Err(format!("lists of joints have other lengths than {}", joints.len()));
        }
        let mut ascending = free.clone();
        ascending.sort_unstable();
        if !ascending.into_iter().eq((0..joints.len() as u32).filter(|&i| joints[i as usize].is_none())) {
            return Err("free joints are not those that there are not".into());
        }
        for (i, joint) in joints.iter().enumerate() {
            let Some(joint) = joint else { continue };
            if joint.a.index().max(joint.b.index()) >= bodies || joint.a == joint.b {
                return Err(format!("joints[{i}] names a body that there is not"));
            }
            joint.kind.check().map_err(|e| format!("joints[{i}]: {e}"))?;
        }
        Ok(())
    }

    pub fn restore(self, world: &mut World) {
        let places = vec![None; self.joints.len()];
        world.joints = JointSlots {
            free: self.free,
            joints: vec![None; self.joints.len()],
            generation: self.generation,
            places,
            read: self.kept,
            ..JointSlots::default()
        };
        for (index, joint) in self.joints.into_iter().enumerate() {
            world.joints.set(index, joint);
        }
        world.joints_changed();
        world.group_joints();
    }
}
