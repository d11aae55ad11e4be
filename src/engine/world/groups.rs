//! Groups of islands, each solved as a whole while its data are in the cache.
//!
//! Dynamic bodies that contacts connect are an island. Islands do not see each other within a step, and the colors of an
//! island follow from its own contacts in their order. So a group of islands, with rows, contacts and records of its own,
//! has the bits of the same islands in the whole world, whatever the group.
//!
//! A step of the whole world sweeps all records from memory several times per substep. A group is loaded once, swept
//! through all substeps, and stored. The groups of a thread follow each other in the same memory, which stays in its cache. An
//! island that is larger than a group is solved by all threads together.

#![allow(unsafe_code, reason = "threads that share rows and contacts, each those of other groups")]

use super::World;
use crate::bodies::{Bodies, BodyKind};
use crate::clock::{Clock, Timings};
use crate::constraints::kernels::observe::ObservedRule;
use crate::constraints::records::batches::Batches;
use crate::constraints::step::assign::{Assignment, Sides};
use crate::constraints::{Features, PartnerKind, Solver, StepInput, WorkCount, Workspace};
use crate::contacts::Contact;
use crate::disjoint::DisjointSets;
use crate::lanes::{BodyRow, LaneWidth, Shared, SharedRows};
use crate::solvers::{self, Islands, Variant};
use crate::workers::Workers;

/// Weight of a contact; that of a body is 1.
const CONTACT: u32 = 4;

/// Least number of groups for one thread. A smaller problem is in the third-level cache as a whole, which takes less time
/// than to copy it.
const LEAST_ALONE: usize = 8;

/// Least number of groups for several threads, which save the barriers between colors.
const LEAST_SHARED: usize = 4;

/// After a single island had most contacts, this many changes of contacts go by before islands are looked for again: a pile
/// seldom falls apart, and to look at it takes as long as a sweep.
const PAUSE: u32 = 16;

/// Group of a body that is in none.
const NONE: u32 = u32::MAX;

/// The groups of a step; keeps its memory.
#[derive(Clone, Debug, Default)]
pub(super) struct Groups {
    list: Vec<Group>,
    /// One for each thread.
    seats: Vec<Seat>,
    /// Widths, features, size and kind of islands that the lanes of `list` were assigned for.
    lanes_are_for: Option<([LaneWidth; 2], Features, usize, Islands)>,
    /// Number of groups of the last step; 0 if it was solved as a whole.
    count: usize,
    islands: DisjointSets,
    /// Weight of the island of which a body is the least one. `[bodies]`
    weights: Vec<u32>,
    /// Group of each body that can move. `[bodies]`
    group_of: Vec<u32>,
    /// Number of changes of contacts until islands are looked for again.
    pause: u32,
    /// Those of the workspace while groups are solved.
    workers: Workers,
    /// Row of each body in the group that is being filled. `[bodies]`
    row_of: Vec<u32>,
}

/// A group of islands.
#[derive(Clone, Debug, Default)]
struct Group {
    /// Its bodies, in ascending order, with the static and kinematic ones that they touch.
    bodies: Vec<u32>,
    kinds: Vec<BodyKind>,
    /// Its contacts, in ascending order.
    contacts: Vec<u32>,
    /// Rows of the bodies of each contact.
    edges: Vec<[u32; 2]>,
    /// `bodies`, `kinds` and `edges` of the last assignment.
    last: (Vec<u32>, Vec<BodyKind>, Vec<[u32; 2]>),
    /// Whether all threads solve it together.
    is_large: bool,
    lanes: Batches,
    serial: Batches,
    assignment: Assignment,
    /// Rows of its kinematic bodies after the step, with the bodies.
    kinematic: Vec<(u32, BodyRow)>,
    count: WorkCount,
    timings: Timings,
    /// The rule of its last velocity sweep, if observed.
    rule: Option<ObservedRule>,
}

/// Where a thread solves its groups.
#[derive(Clone, Debug, Default)]
struct Seat {
    work: Workspace,
    /// The contacts of a group, between rows of `work`.
    contacts: Vec<Contact>,
    solver: Option<(Box<dyn Solver>, &'static Variant)>,
    seen_rows: Vec<Vec<u32>>,
}

/// What all groups share.
#[derive(Clone, Copy)]
struct Whole<'a> {
    work: &'a Workspace,
    bodies: &'a Bodies,
    input: &'a StepInput,
    timed: bool,
    variant: &'static Variant,
}

/// How islands are divided.
#[derive(Clone, Copy, Debug)]
struct Division {
    /// Number of contacts in a group.
    size: usize,
    /// Least number of groups.
    least: usize,
    /// Whether each island with contacts is a group of its own, if there is another island.
    alone: bool,
}

impl Groups {
    /// Whether the step is solved in groups.
    pub fn are_in_use(&self) -> bool {
        self.count > 0
    }

    /// Solves the next step as a whole.
    pub fn leave(&mut self) {
        self.count = 0;
    }

    fn in_use(&self) -> &[Group] {
        &self.list[..self.count]
    }

    /// Lanes of the widest group.
    pub fn width(&self) -> usize {
        self.in_use().iter().map(|group| group.lanes.width()).max().unwrap_or(1)
    }

    /// Divides islands into groups. `false`, and no groups, if the division does not pay. Bodies that are asleep are in none.
    fn divide(&mut self, by: Division, kinds: &[BodyKind], contacts: &[Contact], asleep: &[bool]) -> bool {
        let Division { size, least, alone } = by;
        let Groups { list, count, islands, weights, group_of, row_of, pause, .. } = self;
        let is_dynamic = |body: u32| kinds[body as usize] == BodyKind::Dynamic;
        let sleeps = |body: u32| asleep.get(body as usize).copied().unwrap_or(false);
        let moving =
            || (0..kinds.len() as u32).filter(|&i| kinds[i as usize] != BodyKind::Static && !sleeps(i));
        let touching = || (0..).zip(contacts).filter(|(_, contact)| !sleeps(contact.body_b));
        *count = 0;
        let room = u32::try_from(size).unwrap_or(u32::MAX).saturating_mul(CONTACT);
        *pause = pause.saturating_sub(1);
        if !alone && *pause > 0 {
            return false;
        }
        let all = touching().count() as u32 * CONTACT + moving().count() as u32;
        if !alone && all / room < least as u32 {
            return false;
        }
        islands.begin(kinds.len());
        for (_, contact) in touching().filter(|(_, contact)| is_dynamic(contact.body_a)) {
            islands.join(contact.body_a, contact.body_b);
        }
        weights.clear();
        weights.resize(kinds.len(), 0);
        touching().for_each(|(_, contact)| weights[islands.least(contact.body_b) as usize] += CONTACT);
        for body in moving() {
            weights[islands.least(body) as usize] += 1;
        }
        if alone {
            if weights.iter().filter(|&&weight| weight > 0).count() < 2 {
                return false;
            }
        } else if 2 * weights.iter().copied().max().unwrap_or(0) > all {
            *pause = PAUSE;
            return false;
        }
        group_of.clear();
        group_of.resize(kinds.len(), NONE);
        let (mut group, mut weight) = (0, 0);
        // Islands of the first group have no contacts, so nothing couples them.
        let opens = |weight, own| if alone { own > 1 } else { weight > 0 && weight + own > room };
        if alone {
            list.resize_with(list.len().max(1), Group::default);
            list[0].begin();
        }
        for body in moving() {
            let least = islands.least(body);
            if least == body {
                let own = weights[body as usize];
                if opens(weight, own) {
                    (group, weight) = (group + 1, 0);
                }
                weight += own;
                if list.len() <= group {
                    list.push(Group::default());
                }
                if weight == own && (group > 0 || !alone) {
                    list[group].begin();
                }
                list[group].is_large |= own > 2 * room;
            }
            group_of[body as usize] = match (least == body, alone && weights[least as usize] == 1) {
                (true, false) => group as u32,
                (true, true) => 0,
                (false, _) => group_of[least as usize],
            };
            list[group_of[body as usize] as usize].bodies.push(body);
        }
        for (i, contact) in touching() {
            let of = group_of[contact.body_b as usize];
            let group = &mut list[of as usize];
            group.contacts.push(i);
            if group_of[contact.body_a as usize] != of {
                group.bodies.push(contact.body_a);
            }
        }
        *count = group + 1;
        row_of.resize(kinds.len(), 0);
        for group in &mut list[..*count] {
            group.bodies.sort_unstable();
            group.bodies.dedup();
            group.kinds.extend(group.bodies.iter().map(|&body| kinds[body as usize]));
            (0..).zip(&group.bodies).for_each(|(row, &body)| row_of[body as usize] = row);
            let Group { edges, contacts: own, .. } = group;
            edges.extend(own.iter().map(|&i| {
                let Contact { body_a, body_b, .. } = contacts[i as usize];
                [body_a, body_b].map(|body| row_of[body as usize])
            }));
        }
        true
    }

    /// Assigns the lanes of every group, except where they would be those of the last step.
    fn assign(&mut self, widths: [LaneWidth; 2], features: &Features, workers: &Workers) {
        self.seats.resize_with(workers.count(), Seat::default);
        workers.in_turn(&mut self.list[..self.count], &mut self.seats, |group, seat| {
            if !group.is_as_before() {
                group.assign(widths, features, seat);
            }
        });
    }

    /// Color of each of `contacts` contacts in its group; see [`World::contact_colors`].
    pub fn contact_colors(&self, contacts: usize) -> Vec<Option<u16>> {
        let mut colors = vec![None; contacts];
        for group in self.in_use() {
            let own = group.assignment.contact_colors(group.contacts.len());
            group.contacts.iter().zip(own).for_each(|(&i, color)| colors[i as usize] = color);
        }
        colors
    }
}

impl Group {
    /// Empties it for a new division.
    fn begin(&mut self) {
        let Group { bodies, kinds, edges, last, .. } = self;
        std::mem::swap(bodies, &mut last.0);
        std::mem::swap(kinds, &mut last.1);
        std::mem::swap(edges, &mut last.2);
        bodies.clear();
        kinds.clear();
        edges.clear();
        self.contacts.clear();
        self.is_large = false;
    }

    fn is_as_before(&self) -> bool {
        self.edges == self.last.2 && self.kinds == self.last.1 && self.bodies == self.last.0
    }

    /// Assigns the lanes.
    fn assign(&mut self, widths: [LaneWidth; 2], features: &Features, seat: &mut Seat) {
        self.exchange(seat);
        let Group { edges, kinds, assignment, is_large, .. } = self;
        let Seat { work, contacts, seen_rows, .. } = seat;
        contacts.clear();
        contacts.extend(edges.iter().map(|&[body_a, body_b]| Contact {
            body_a,
            body_b,
            ..Contact::default()
        }));
        let partner = |row: u32| PartnerKind::of(kinds[row as usize]);
        let sides = Sides { bodies: kinds.len(), partner, levels: None, asleep: &[] };
        assignment.colored(work, widths, features, contacts, &sides);
        if *is_large {
            work.lanes.check_disjoint(kinds.len() as u32, seen_rows, &work.workers);
        }
        self.exchange(seat);
    }

    /// Exchanges its batches for those of the seat.
    fn exchange(&mut self, seat: &mut Seat) {
        seat.work.lanes.exchange(&mut self.lanes);
        seat.work.serial.exchange(&mut self.serial);
    }

    /// Solves the group: takes rows and contacts, runs the solver, and gives back what it changed.
    ///
    /// Rows of kinematic bodies may be in several groups; they are noted.
    fn solve(&mut self, seat: &mut Seat, rows: SharedRows<'_>, contacts: Shared<'_, Contact>, of: Whole<'_>) {
        self.exchange(seat);
        let Seat { work, contacts: copies, solver, .. } = seat;
        let Group { bodies, kinds, edges, .. } = self;
        work.rows.clear();
        work.rows.extend(bodies.iter().map(|&body| rows.get(body as usize)));
        work.rows.push(BodyRow::default());
        work.motion.select(&of.work.motion, bodies, |body| of.bodies.round[body]);
        work.observe = of.work.observe;
        work.speed_limits.clear();
        for &(body, limit) in &of.work.speed_limits {
            work.speed_limits.extend(bodies.binary_search(&body).ok().map(|row| (row as u32, limit)));
        }
        copies.clear();
        copies.extend(self.contacts.iter().zip(&*edges).map(|(&i, &[body_a, body_b])| Contact {
            body_a,
            body_b,
            ..contacts.get(i as usize)
        }));
        let points = copies.iter().map(|contact| contact.manifold.count as usize).sum();
        let input = StepInput { points, ..*of.input };
        let width = LaneWidth::from_lanes(work.lanes.width()).unwrap_or(LaneWidth::W1);
        let mut clock = Clock::start(of.timed);
        let (solver, _) = match solver {
            Some(known) if std::ptr::eq(known.1, of.variant) => known,
            other => other.insert(((of.variant.make)(), of.variant)),
        };
        self.count = solvers::run(solver.as_mut(), work, copies, &mut clock, &input, width);
        self.timings = clock.stop();
        self.rule = work.last_rule.take();
        work.motion.finish(&mut work.rows);
        self.kinematic.clear();
        for ((row, &body), kind) in work.rows.iter().zip(&*bodies).zip(&*kinds) {
            match kind {
                BodyKind::Dynamic => rows.set(body as usize, *row),
                BodyKind::Kinematic => self.kinematic.push((body, *row)),
                BodyKind::Static => {}
            }
        }
        for (copy, &i) in copies.iter().zip(&self.contacts) {
            let Contact { body_a, body_b, .. } = contacts.get(i as usize);
            contacts.set(i as usize, Contact { body_a, body_b, ..*copy });
        }
        self.exchange(seat);
    }
}

/// The rule of the last velocity sweeps of all groups, for `rows` rows; `None` without any.
fn rule_of(list: &mut [Group], rows: usize) -> Option<ObservedRule> {
    let mut rules = list.iter_mut().filter_map(|group| Some((group.rule.take()?, &group.bodies)));
    let (mut rule, bodies) = rules.next()?;
    let mut deltas = vec![[0.0; 4]; rows];
    let mut spread = |own: &[[f32; 4]], bodies: &[u32]| {
        bodies.iter().zip(own).for_each(|(&body, &delta)| deltas[body as usize] = delta);
    };
    spread(&rule.deltas, bodies);
    rules.for_each(|(rule, bodies)| spread(&rule.deltas, bodies));
    rule.deltas = deltas;
    Some(rule)
}

impl World {
    /// Divides the step into groups if that pays, and assigns their lanes.
    pub(super) fn group_islands(&mut self, features: &Features) -> bool {
        let World { groups, settings, bodies, contacts, work, sleep, .. } = self;
        let choice = Some((settings.widths(), *features, settings.group_size, settings.solver.islands));
        if groups.lanes_are_for != choice {
            groups.list.clear();
            groups.lanes_are_for = choice;
        }
        let least = if work.workers.count() > 1 { LEAST_SHARED } else { LEAST_ALONE };
        let alone = settings.solver.islands == Islands::Alone;
        let by = Division { size: settings.group_size, least, alone };
        if !groups.divide(by, &bodies.kind, contacts, sleep.asleep()) {
            return false;
        }
        groups.assign(settings.widths(), features, &work.workers);
        let of = groups.in_use();
        let slots = |group: &Group| group.lanes.lanes() + group.serial.lanes();
        self.counts.colors = of.iter().map(|group| group.assignment.colors).max().unwrap_or(0);
        self.counts.groups = of.len();
        self.counts.overflow = of.iter().map(|group| group.assignment.overflow).sum();
        self.counts.lane_slots = of.iter().map(slots).sum();
        self.counts.constraint_bytes =
            of.iter().map(|group| group.lanes.bytes() + group.serial.bytes()).sum();
        true
    }

    /// Solves every group, after the rows have been loaded.
    pub(super) fn solve_groups(&mut self, clock: &mut Clock, input: &StepInput) -> WorkCount {
        let World { groups, work, contacts, bodies, settings, solver_is, .. } = self;
        let mut rows = std::mem::take(&mut work.rows);
        std::mem::swap(&mut work.workers, &mut groups.workers);
        let of = Whole { work, bodies, input, timed: settings.timed, variant: solver_is };
        let Groups { list, seats, workers, group_of, count, .. } = groups;
        let list = &mut list[..*count];
        seats.resize_with(workers.count(), Seat::default);
        {
            let rows = Shared::from(&mut rows[..]);
            let contacts = Shared::from(&mut contacts[..]);
            for group in list.iter_mut().filter(|group| group.is_large) {
                std::mem::swap(&mut seats[0].work.workers, workers);
                group.solve(&mut seats[0], rows, contacts, of);
                std::mem::swap(&mut seats[0].work.workers, workers);
            }
            // SAFETY: a contact and a dynamic body are in one group. Rows of other bodies are only read.
            let (rows, contacts) = unsafe { (rows.sent(), contacts.sent()) };
            workers.in_turn(list, seats, |group, seat| {
                if !group.is_large {
                    group.solve(seat, rows.get(), contacts.get(), of);
                }
            });
        }
        let mut count = WorkCount::default();
        for (i, group) in (0..).zip(&*list) {
            for &(body, row) in &group.kinematic {
                if group_of[body as usize] == i {
                    rows[body as usize] = row;
                }
            }
            count.sweeps = count.sweeps.max(group.count.sweeps);
            count.row_updates += group.count.row_updates;
            count.impact_visits += group.count.impact_visits;
            count.cut_impacts += group.count.cut_impacts;
            count.unsolved += group.count.unsolved;
        }
        work.rows = rows;
        std::mem::swap(&mut work.workers, workers);
        work.last_rule = rule_of(list, work.rows.len());
        clock.divide(list.iter().map(|group| &group.timings));
        count
    }
}
