//! Sleep: islands that have rested are not solved until something touches or edits them.
//!
//! **Rest.** A body that moves no farther than s within a time T has a mean acceleration below 2 s/T². With the slop, 5 mm,
//! and T = 0.5 s this is 0.04 m/s², 0.4 % of the weight on Earth. So a body whose points have all stayed within s of where they were
//! T ago is in balance to that, whatever it trembles. With the pose (x₀, R₀) at which the time began and the reach r, no
//! point has moved farther than
//!
//! ```text
//! max(|x − x₀|, |y − y₀|) + r |R − R₀| ≤ s                                     (1)
//! ```
//!
//! An island falls asleep when (1) has held for all its bodies for T, unless it touches or is joined to a body that moves and
//! is not dynamic, or nothing holds it against gravity. Its velocities are then zero, and its contacts are in no lane, but keep
//! their impulses. The time begins anew for a body whose support may have gone: it is edited, it is joined to or touches one
//! that is, or it loses the contact with one that moves.
//!
//! **Waking.** A body is active if it is awake and dynamic, kinematic and moving, or was edited. Pairs without an active
//! body are not looked at. An island wakes as a whole, within the step, if a contact with an active body is found; if one of its
//! bodies, or an immovable one that it touches or is joined to, was edited; and if a setting changed. Edits are found by
//! comparing bodies with what they were, so it does not matter how they were made.
//!
//! Islands do not see each other within a step, so those awake move as they would if none slept, bit for bit.
//!
//! **Source:** sleeping islands, Catto 2011 (Box2D 2.2). **Departure:** a bound of the way instead of the speed.

use super::{Settings, World};
use crate::bodies::{Bodies, BodyKind};
use crate::constraints::kernels::types::ConstraintSet;
use crate::contacts::Contact;
use crate::disjoint::DisjointSets;
use crate::narrowphase::Margins;
use crate::params::{Budget, Parameters, Without};
use crate::solvers::{Islands, Variant};
use glam::Vec2;

/// T (s).
const REST_TIME: f32 = 0.5;

/// Pose of (1) of a body that has not rested.
const NOWHERE: [f32; 6] = [f32::MAX; 6];

/// A body that brings no change to this step.
const INACTIVE: u8 = 0;
/// An active body whose pairs are listed.
const LISTED: u8 = 1;
/// An active body whose pairs are not yet listed.
const DUE: u8 = 2;

/// The settings that a rest depends on.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
struct RestedUnder {
    #[cfg_attr(feature = "serde", serde(with = "super::saved::solver"))]
    solver: &'static Variant,
    gravity: [f32; 2],
    dt: f32,
    length_unit: f32,
    budget: Budget,
    parameters: Parameters,
    without: Without,
    record_impulses: bool,
    contact_events: bool,
}

impl PartialEq for RestedUnder {
    fn eq(&self, other: &Self) -> bool {
        let key = |of: &RestedUnder| {
            let numbers = (of.gravity, of.dt, of.length_unit, of.budget, of.parameters);
            (of.solver.name, numbers, of.without, of.record_impulses, of.contact_events)
        };
        key(self) == key(other)
    }
}

impl RestedUnder {
    fn of(settings: &Settings) -> Self {
        let Settings { solver, gravity, dt, length_unit, budget, parameters, without, .. } = *settings;
        let Settings { record_impulses, contact_events, .. } = *settings;
        RestedUnder {
            solver,
            gravity,
            dt,
            length_unit,
            budget,
            parameters,
            without,
            record_impulses,
            contact_events,
        }
    }
}

/// Which bodies sleep, and which may soon. Empty while no body may sleep.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default))]
pub(super) struct Sleep {
    /// `[bodies]`
    asleep: Vec<bool>,
    /// Lowest body of the island with which a body fell asleep. `[bodies]`
    island: Vec<u32>,
    /// Time for which (1) has held (s). `[bodies]`
    still: Vec<f32>,
    /// Pose of (1): x and y with their low parts, cos, sin. `[bodies]`
    from: Vec<[f32; 6]>,
    /// Bodies that sleep or are not dynamic, as the last step found them.
    seen: Bodies,
    /// Bodies that were added, removed or changed otherwise than in their arrays since the last step.
    edited: Vec<u32>,
    /// Settings of the last step.
    rested_under: Option<RestedUnder>,
    /// Whether contacts came or went, or bodies came to rest, since islands were looked at.
    #[cfg_attr(feature = "serde", serde(skip, default = "yes"))]
    is_changed: bool,
    /// Number of bodies that sleep.
    #[cfg_attr(feature = "serde", serde(skip))]
    count: usize,
    /// [`INACTIVE`], [`LISTED`] or [`DUE`]. `[bodies]`
    #[cfg_attr(feature = "serde", serde(skip))]
    state: Vec<u8>,
    /// All bits of a body that is asleep or static, no bits of others. `[bodies]`
    #[cfg_attr(feature = "serde", serde(skip))]
    fixed: Vec<u32>,
    #[cfg_attr(feature = "serde", serde(skip))]
    kinematic: Vec<u32>,
    /// Bodies that were edited, and those that move and are not dynamic. `[bodies]`
    #[cfg_attr(feature = "serde", serde(skip))]
    drives: Vec<bool>,
    /// Islands that are about to wake. `[bodies]`
    #[cfg_attr(feature = "serde", serde(skip))]
    wakes: Vec<bool>,
    /// Sets of bodies that are awake, and whether each must stay so, at its lowest body.
    #[cfg_attr(feature = "serde", serde(skip))]
    islands: DisjointSets,
    #[cfg_attr(feature = "serde", serde(skip))]
    stays: Vec<bool>,
    /// Whether an immovable body holds a set, by a contact or a joint.
    #[cfg_attr(feature = "serde", serde(skip))]
    held: Vec<bool>,
}

#[cfg(feature = "serde")]
fn yes() -> bool {
    true
}

impl Sleep {
    /// Notes that a body was edited.
    pub fn edit(&mut self, body: u32) {
        self.edited.push(body);
    }

    /// Whether some body sleeps.
    pub fn any(&self) -> bool {
        self.count > 0
    }

    /// Which bodies sleep; empty or `[bodies]`.
    pub fn asleep(&self) -> &[bool] {
        &self.asleep
    }

    /// Notes that contacts came or went.
    pub fn note_change(&mut self) {
        self.is_changed = true;
    }

    /// Notes that a pair of bodies lost its contact. One that has rested may have rested on the other, if that has not.
    pub fn part(&mut self, pair: [u32; 2], bodies: &Bodies) {
        if self.still.is_empty() {
            return;
        }
        let pair = pair.map(|body| body as usize);
        let moved = pair.map(|i| bodies.is_dynamic(i) && self.still[i] < REST_TIME);
        for (i, other_moved) in pair.into_iter().zip([moved[1], moved[0]]) {
            if other_moved {
                self.still[i] = 0.0;
            }
        }
    }

    /// Whether a pair of bodies is to be listed: one of them is due, and none was before.
    #[inline(always)]
    pub fn lists(&self, [a, b]: [u32; 2]) -> bool {
        self.state[a as usize] | self.state[b as usize] == DUE
    }

    /// Whether one of a pair of bodies is active.
    pub fn is_active(&self, [a, b]: [u32; 2]) -> bool {
        self.state[a as usize] | self.state[b as usize] != INACTIVE
    }

    /// Notes that the pairs of all active bodies are listed.
    pub fn note_listed(&mut self) {
        self.state.iter_mut().for_each(|state| *state = u8::from(*state != INACTIVE) * LISTED);
    }

    /// Whether lists have the right length for `bodies` bodies, or none. Data from a file may not.
    #[cfg(feature = "serde")]
    pub fn is_consistent(&mut self, bodies: usize) -> bool {
        let len = self.asleep.len();
        let lists = [self.island.len(), self.still.len(), self.from.len()];
        let arrays = self.seen.arrays_mut().map(|array| array.len());
        let rows = [self.seen.local_center.len(), self.seen.bullet.len(), self.seen.len()];
        len <= bodies
            && lists.into_iter().chain(arrays).chain(rows).all(|other| other == len)
            && self
                .island
                .iter()
                .zip(&self.asleep)
                .all(|(&island, &asleep)| !asleep || (island as usize) < len)
            && self.edited.iter().all(|&body| (body as usize) < bodies)
    }

    /// Lets all bodies be awake; returns whether some were asleep.
    fn clear(&mut self) -> bool {
        self.edited.clear();
        let had = self.any();
        if !self.asleep.is_empty() {
            *self = Sleep::default();
        }
        had
    }

    /// Wakes the island of a body with the next [`Self::wake`]. If it is awake, its time of rest begins anew.
    fn disturb(&mut self, body: usize) {
        (self.still[body], self.from[body]) = (0.0, NOWHERE);
        if self.asleep[body] {
            self.wakes[self.island[body] as usize] = true;
        }
    }

    /// Wakes the bodies of islands in `wakes`; returns whether there are any.
    fn wake(&mut self) -> bool {
        let before = self.count;
        for i in 0..self.asleep.len() {
            if self.asleep[i] && self.wakes[self.island[i] as usize] {
                (self.asleep[i], self.state[i], self.fixed[i]) = (false, DUE, 0);
                (self.still[i], self.from[i]) = (0.0, NOWHERE);
                self.count -= 1;
            }
        }
        self.wakes.fill(false);
        self.count != before
    }

    /// Bodies whose arrays differ from those of the last step, among those that sleep or are not dynamic.
    fn find_edited(&mut self, bodies: &mut Bodies) {
        let Sleep { seen, fixed, kinematic, edited, .. } = self;
        let known = seen.len();
        let (now, then) = (bodies.arrays_mut(), seen.arrays_mut());
        let arrays: [_; 17] = std::array::from_fn(|k| (&*now[k], &*then[k]));
        let differ = |now: &f32, then: &f32| now.to_bits() ^ then.to_bits();
        for (now, then) in arrays {
            let bits = || {
                now.iter().zip(then.iter()).zip(&*fixed).map(|((now, then), fixed)| differ(now, then) & fixed)
            };
            if bits().fold(0, |any, bits| any | bits) != 0 {
                edited.extend((0..).zip(bits()).filter(|&(_, bits)| bits != 0).map(|(i, _)| i));
            }
            let has_moved =
                |&&i: &&u32| (i as usize) < known && differ(&now[i as usize], &then[i as usize]) != 0;
            edited.extend(kinematic.iter().filter(has_moved));
        }
    }

    /// Adds bodies that are new, and updates what depends on their kinds.
    fn follow(&mut self, bodies: &Bodies) {
        let count = bodies.len();
        if self.seen.len() == count && self.edited.is_empty() && self.fixed.len() == count {
            return;
        }
        self.asleep.resize(count, false);
        self.island.resize(count, 0);
        self.still.resize(count, 0.0);
        self.from.resize(count, NOWHERE);
        self.state.resize(count, INACTIVE);
        self.drives.resize(count, false);
        self.wakes.resize(count, false);
        self.kinematic.clear();
        self.kinematic.extend((0..count as u32).filter(|&i| bodies.kind[i as usize] == BodyKind::Kinematic));
        self.fixed.clear();
        let fixed = |(&asleep, &kind): (&bool, &BodyKind)| {
            if asleep || kind == BodyKind::Static { u32::MAX } else { 0 }
        };
        self.fixed.extend(self.asleep.iter().zip(&bodies.kind).map(fixed));
        self.count = self.asleep.iter().filter(|&&asleep| asleep).count();
    }

    /// Counts for how long bodies that are awake have rested; returns whether some rest for long enough.
    fn rest(&mut self, bodies: &Bodies, reach: &[f32], dt: f32, near: f32) -> bool {
        let mut any = false;
        for (i, (still, from)) in self.still.iter_mut().zip(&mut self.from).enumerate() {
            if bodies.kind[i] != BodyKind::Dynamic || self.asleep[i] {
                continue;
            }
            let pose = [
                bodies.position_x[i],
                bodies.position_y[i],
                bodies.position_x_lo[i],
                bodies.position_y_lo[i],
                bodies.rotation_cos[i],
                bodies.rotation_sin[i],
            ];
            let d: [f32; 6] = std::array::from_fn(|k| pose[k] - from[k]);
            let shift = (d[0] + d[2]).abs().max((d[1] + d[3]).abs());
            let way = shift + reach[i] * (d[4] * d[4] + d[5] * d[5]).sqrt();
            if way <= near {
                let rested = *still >= REST_TIME;
                *still += dt;
                self.is_changed |= !rested && *still >= REST_TIME;
                any |= *still >= REST_TIME;
            } else {
                (*still, *from) = (0.0, pose);
            }
        }
        any
    }
}

/// The bodies of all contacts and of all constraints of other types.
fn tied<'a>(contacts: &'a [Contact], types: &'a [ConstraintSet]) -> impl Iterator<Item = [u32; 2]> + 'a {
    let joined = types.iter().flat_map(|joined| joined.kind.ends().iter().copied());
    contacts.iter().map(|contact| [contact.body_a, contact.body_b]).chain(joined)
}

impl World {
    /// Whether a body sleeps, see [`Settings::sleep`](super::Settings::sleep).
    pub(super) fn is_asleep(&self, body: usize) -> bool {
        self.sleep.asleep.get(body).copied().unwrap_or(false)
    }

    /// Finds which bodies are active. `false` if none is: the step then has nothing to do.
    pub(super) fn begin_sleep(&mut self) -> bool {
        let is_whole = self.settings.solver.islands == Islands::Alone && !self.may_divide();
        if !self.settings.sleep || is_whole || self.work.watch.is_some() {
            if self.sleep.clear() {
                self.regroup_awake();
            }
            return true;
        }
        let World { sleep, bodies, settings, contacts, work, .. } = self;
        let under = Some(RestedUnder::of(settings));
        let is_same = std::mem::replace(&mut sleep.rested_under, under) == under;
        sleep.follow(bodies);
        sleep.find_edited(bodies);
        if !is_same || self.narrow.has_lost(contacts.len()) {
            sleep.wakes.fill(true);
            sleep.still.fill(0.0);
        }
        for (state, (kind, &asleep)) in sleep.state.iter_mut().zip(bodies.kind.iter().zip(&sleep.asleep)) {
            *state = if *kind == BodyKind::Dynamic && !asleep { DUE } else { INACTIVE };
        }
        let mut any_drives = false;
        for k in 0..sleep.kinematic.len() {
            let i = sleep.kinematic[k] as usize;
            if bodies.velocity(i) != Vec2::ZERO || bodies.angular_velocity[i] != 0.0 {
                (sleep.state[i], sleep.drives[i], any_drives) = (DUE, true, true);
            }
        }
        while let Some(body) = sleep.edited.pop() {
            let i = body as usize;
            (sleep.state[i], sleep.drives[i], any_drives) = (DUE, true, true);
            sleep.disturb(i);
            if i < sleep.seen.len() {
                sleep.seen.restore(i, bodies, i..i + 1);
            }
        }
        if sleep.seen.len() != bodies.len() {
            sleep.seen.clone_from(bodies);
        }
        if any_drives {
            for [a, b] in tied(contacts, &work.types).map(|pair| pair.map(|body| body as usize)) {
                for (of, by) in [(a, b), (b, a)] {
                    if sleep.drives[by] {
                        sleep.disturb(of);
                    }
                }
            }
            sleep.drives.fill(false);
        }
        if sleep.wake() {
            self.regroup_awake();
        }
        self.sleep.state.iter().any(|&state| state != INACTIVE) || self.pairs_are_stale
    }

    /// After loading: finds what was edited before the world was saved, while its contacts are still there.
    #[cfg(feature = "serde")]
    pub(super) fn resume_sleep(&mut self) {
        self.begin_sleep();
        let World { sleep, bodies, .. } = self;
        // The next step looks at the pairs of immovable bodies that were edited.
        let is_edited = |&i: &usize| bodies.kind[i] != BodyKind::Dynamic && sleep.state[i] != INACTIVE;
        sleep.edited.extend((0..sleep.state.len()).filter(is_edited).map(|i| i as u32));
    }

    /// Wakes islands that touch an active body; returns whether there are any.
    pub(super) fn wake_touched(&mut self) -> bool {
        if !self.sleep.any() {
            return false;
        }
        let sleep = &mut self.sleep;
        for candidate in self.narrow.candidates.iter().filter(|candidate| candidate.touches()) {
            let [a, b] = candidate.bodies.map(|body| body as usize);
            for (of, by) in [(a, b), (b, a)] {
                if sleep.asleep[of] && sleep.state[by] != INACTIVE {
                    sleep.disturb(of);
                }
            }
        }
        let any = sleep.wake();
        if any {
            self.regroup_awake();
        }
        any
    }

    /// Assigns lanes anew, because other islands are awake than in the last step.
    fn regroup_awake(&mut self) {
        (self.lanes_are_for, self.narrow.jobs_are_current) = (None, false);
    }

    /// A step of a world in which nothing is active.
    pub(super) fn sleep_on(&mut self) {
        let (pairs, contacts) = (self.narrow.candidates.len(), self.contacts.len());
        self.counts = super::StepCounts { pairs, contacts, asleep: self.sleep.count, ..Default::default() };
        self.clear_events();
    }

    /// After a step: lets islands fall asleep that have rested for long enough.
    pub(super) fn end_sleep(&mut self) {
        let World { sleep, bodies, settings, contacts, work, narrow, gravities, .. } = self;
        self.counts.asleep = sleep.count;
        if sleep.asleep.is_empty() {
            return;
        }
        let near = Margins::of(settings.length_unit).slop;
        if !sleep.rest(bodies, &narrow.extents, settings.dt, near) || !std::mem::take(&mut sleep.is_changed) {
            return;
        }
        let Sleep { asleep, island, still, islands, stays, held, state, fixed, seen, .. } = sleep;
        islands.begin(bodies.len());
        let is_free = |body: u32| bodies.kind[body as usize] == BodyKind::Dynamic;
        held.clear();
        held.resize(bodies.len(), false);
        stays.clear();
        let each = still.iter().zip(&bodies.kind);
        stays.extend(each.map(|(&still, kind)| *kind != BodyKind::Dynamic || still < REST_TIME));
        for [a, b] in tied(contacts, &work.types) {
            if is_free(a) && is_free(b) {
                islands.join(a, b);
            } else {
                let (of, by) = if is_free(b) { (b, a) } else { (a, b) };
                let is_driven = state[by as usize] != INACTIVE;
                (stays[of as usize], held[of as usize]) = (stays[of as usize] || is_driven, true);
                // It may sleep as soon as the other rests.
                sleep.is_changed |= is_driven;
            }
        }
        for body in 0..bodies.len() {
            let least = islands.least(body as u32) as usize;
            stays[least] |= stays[body];
            held[least] |= held[body];
        }
        // What nothing holds does not rest, however slowly it falls.
        for body in 0..bodies.len() {
            let least = islands.least(body as u32) as usize;
            let gravity = gravities.get(body).copied().unwrap_or(settings.gravity);
            let falls = bodies.gravity_scale[body] != 0.0 && gravity != [0.0; 2];
            let pushed =
                [&bodies.force_x, &bodies.force_y, &bodies.torque].iter().any(|force| force[body] != 0.0);
            stays[least] |= !held[least] && (falls || pushed);
        }
        let mut any = false;
        for body in 0..bodies.len() {
            let least = islands.least(body as u32);
            if asleep[body] || stays[least as usize] {
                continue;
            }
            (asleep[body], island[body], fixed[body], any) = (true, least, u32::MAX, true);
            sleep.count += 1;
            for velocity in [&mut bodies.velocity_x, &mut bodies.velocity_y, &mut bodies.angular_velocity] {
                velocity[body] = 0.0;
            }
            seen.restore(body, bodies, body..body + 1);
        }
        self.counts.asleep = sleep.count;
        if any {
            self.regroup_awake();
        }
    }
}
