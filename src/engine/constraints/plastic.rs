//! Plastic impacts: what comes in without restitution stays, before the step is solved.
//!
//! # The law
//!
//! That of [`super::impact`] with e = 0, at all points together: each has v_n⁺ ≥ 0, an impulse only where v_n⁺ = 0,
//! and Coulomb's friction on the impulses of the whole impact. Gauss–Seidel on accumulated impulses, from point to point
//! as an impact spreads: where a body is pushed, its other points are looked at next, until nothing comes in by more
//! than a ten-thousandth of the fastest arrival. So a row of boxes goes on together, and what
//! nothing hits costs nothing.
//!
//! # When in the step
//!
//! A point with the gap s that comes in at v is hit after t = s/|v|. Until then bodies fly as they did: an impulse
//! at t that makes them faster by Δv moves them by (dt − t) Δv until the end of the step. They have Δv from the
//! beginning of the step, and are put back by t Δv there. Such a point then touches all through the step.
//! One that is pushed again by a body that was hit at t′ is so at the later of both times.
//!
//! A contact is first seen when its bodies are closer than [`crate::engine::params::SPECULATIVE_DISTANCE`], and so
//! most impacts are found after they have happened, with an overlap of |s| ≤ |v| dt: t is negative then, and bodies
//! are put forward to where they would be.
//!
//! When the two centres are displaced by D against each other at the time of the impulse, it adds D × λ to angular
//! momentum with the arms of the step's beginning. So arms end at a point of both bodies then, r_a + D/2 and r_b − D/2;
//! round shapes have the frame of that moment (`touch.rs`). In the rows themselves and not beside them: what an
//! impulse does that its row does not know of may add energy, and has shot bodies out of piles. D does not depend on
//! impulses at that time, only on those at others. The solver goes on with these arms.
//!
//! # What has borne a body until then
//!
//! A block that rocks stands on one corner until the other one is hit. Its load F of the step before belongs to the first
//! corner until t, and in the step that is solved from its beginning on, all of it goes to the second: an error of F t
//! times the distance of both, which takes 3 % of the spin of a block 8 m high. So a point that an impact releases, which
//! is one that leaves faster than its load can bring it back within the step, gives F t beside the impact (for t < 0 it has
//! borne too long, and takes it back from what does not move), and the impact goes on to spread. A force in [0, t]
//! moves bodies by F t (dt − t/2)/m in the step.
//!
//! # How far
//!
//! Many impacts at once, as in a drum, are a load on many bodies, and their effects overlap: more than
//! 32 contacts are left to the solver. Fewer are followed as far as they go if that is rare, as when
//! something heavy falls on a pile: there are 2¹⁸ visits for that, which are earned anew by one for
//! 8 contacts in a step, a thirtieth of what a step costs. What comes in even then is stopped by the
//! solver, and no body is displaced: one might be into a third that nobody has looked at.

use super::batches::Batches;
use super::features::{Features, Layout};
use super::impact::{AHEAD, TURNED, rough_impulses};
use super::impact_statics::{Bearing, Carried, Pile};
use super::segment::Segment;
use super::statics::Support;
use super::sweep::turn;
use super::touch::{Frame, Round, couplings, write_arms};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, Lanes, held};
use crate::engine::params::LINEAR_SLOP;
use glam::DVec2;
use std::collections::VecDeque;

/// No lane, no point.
const NONE: u32 = u32::MAX;

/// Impacts spread until nothing comes in faster than this part of the fastest (1).
const TOLERANCE: f32 = 1e-4;

/// How often points are solved in any step: so often, and so often over the number of points that arrive.
const SOLVES: [usize; 2] = [64, 8192];

/// How often they are solved beyond that, until it has been earned again.
const MOST_SPENT: usize = 1 << 18;

/// How often of these a point is: heavy on light needs some thousands, a pair between whose edges friction runs to and
/// fro without an end has enough then.
const PER_POINT: usize = 8192;

/// Visits of each point after which what is left is sent down the pile, and again after twice as many (1).
const PATIENCE: usize = 64;

/// Least −n·d of a normal that bears against momentum in the direction d.
const BEARS: f64 = 0.5;

/// Greatest gap of a contact that hands momentum on at once (m).
const CLOSED: f32 = 0.02 * LINEAR_SLOP;

/// Most energy that loads of a pile may leave of what forces make in a substep, if it rests on them (1).
const AT_REST: f64 = 1e-3;

/// Contacts of a step that earn one visit (1).
const EARNING: usize = 8;

/// Spreads impacts; keeps its memory from step to step.
#[derive(Debug, Default)]
pub struct PlasticImpacts {
    /// Lanes in which something arrives, of the coloured batches and of the serial ones.
    pub(super) found: [Vec<u32>; 2],
    /// `[rows]`
    bodies: Vec<Body>,
    /// The next end of the same body. Lane l, counted through both sets of batches, has the ends 2 l and 2 l + 1.
    /// `[2 lanes]`
    next: Vec<u32>,
    /// Place of the first of the two points of a lane in `points`, or none. `[lanes]`
    listed: Vec<u32>,
    /// In pairs; a point that is not there, or that bounces, has no mass.
    points: Vec<Point>,
    /// Bodies that were pushed since their points were looked at.
    queue: VecDeque<u32>,
    /// What carries the momentum of an impact, the rows of its bodies, and the points of its bearings.
    pile: Pile,
    carried_rows: Vec<u32>,
    bearing: Vec<u32>,
    /// Where a row is in these. `[rows]`
    carried: Vec<u32>,
    /// Points that arrive, the first ones.
    arrived: usize,
    /// Momentum has gone down a pile in this step.
    is_carried: bool,
    /// How often a point was solved in this step.
    solved: usize,
    /// How often points were solved in the last steps beyond what any step may, less what has been earned since.
    pub(crate) spent: usize,
}

/// What is known of a body.
#[derive(Clone, Copy, Debug)]
struct Body {
    /// Its first end; see `next`.
    first: u32,
    /// When it was last pushed (s); −∞ for never.
    time: f32,
    is_queued: bool,
    /// `time` when only what arrives had been solved (s).
    begun: f32,
    /// Its velocity before anything pushed it (m/s, m/s, rad/s).
    flown: [f32; 3],
    /// What rounding has taken from its velocity, to be added next (m/s, m/s, rad/s): there may be very many pushes.
    rounded: [f32; 3],
}

/// A body that nothing has pushed.
const STILL: Body = Body {
    first: NONE,
    time: f32::NEG_INFINITY,
    is_queued: false,
    flown: [0.0; 3],
    begun: f32::NEG_INFINITY,
    rounded: [0.0; 3],
};

/// A contact point that may be hit.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    lane: u32,
    index: u32,
    contact: u32,
    /// Rows of a and b.
    rows: [u32; 2],
    /// Impulses change a.
    pushes_a: bool,
    normal: [f32; 2],
    /// r × n and r × t of a and b (m), and the same of the contact's frame.
    arms: [[f32; 2]; 2],
    own_arms: [[f32; 2]; 2],
    /// k_nn, k_tt, k_nt (1/kg).
    k: [f32; 3],
    /// 1/k_nn (kg).
    mass: f32,
    friction: f32,
    /// At the beginning of the step (m).
    separation: f32,
    /// Impulses so far, along n and t (N·s).
    impulse: [f32; 2],
    /// Impulses of the last substep, along both (N·s).
    borne: [f32; 2],
    /// When it is hit (s).
    time: f32,
    /// From a to b, as far as they have moved against each other when arms end at one point (m).
    apart: [f32; 2],
    /// What is round, until it is hit.
    round: Option<Round>,
    /// It is of a round shape.
    is_round: bool,
}

/// What [`PlasticImpacts::spread`] works on.
pub(super) struct On<'a> {
    pub rows: &'a mut [BodyRow],
    /// Coloured batches, serial ones.
    pub batches: [&'a mut Batches; 2],
    pub contacts: &'a mut [Contact],
    pub features: &'a Features,
    /// What forces add to the velocities of rows in a substep (m/s).
    pub increments: &'a [[f32; 4]],
    /// See [`super::pass::PassInput::weights`].
    pub weights: &'a mut Vec<f32>,
    /// Step and substep (s).
    pub dt: f32,
    pub h: f32,
    /// Slower is rest (m/s).
    pub slowest: f32,
    pub record_impulses: bool,
}

/// Where the record of a lane is.
struct Place {
    /// Which batches.
    part: usize,
    /// Its lane in these, and how many there are in a batch.
    of: usize,
    width: usize,
    /// Its first float; the next quantity is `width` floats further.
    first: usize,
    layout: Layout,
    pushes_a: bool,
}

impl On<'_> {
    fn lanes(&self) -> usize {
        self.batches[0].lanes() + self.batches[1].lanes()
    }

    fn place(&self, lane: u32) -> Place {
        let (lane, lanes) = (lane as usize, self.batches[0].lanes());
        let (part, of) = if lane < lanes { (0, lane) } else { (1, lane - lanes) };
        let (batches, width) = (&self.batches[part], self.batches[part].width());
        let holds = |s: &&Segment| (s.first_lane..s.first_lane + s.batches * width).contains(&of);
        let segment = batches.segments().iter().find(holds).expect("a segment for each lane");
        let in_segment = of - segment.first_lane;
        let vector = segment.first_vector + in_segment / width * segment.stride;
        let layout = Layout::for_features(self.features, segment.opposite);
        Place {
            part,
            of,
            width,
            first: vector * width + in_segment % width,
            layout,
            pushes_a: segment.pushes_a(),
        }
    }

    /// A point has the frame of the moment of touch.
    fn turn(&mut self, point: &Point, frame: &Frame) {
        let Place { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let rows = point.rows.map(|row| &self.rows[row as usize]);
        frame.write_record(&layout, rows, |vector, value| floats[first + vector * width] = value);
        frame.write_contact(&mut self.contacts[point.contact as usize]);
    }

    /// What is left of the step is solved with the arms of the impact.
    fn put(&mut self, point: &Point) {
        let Place { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let put = |vector: usize, value: f32| floats[first + vector * width] = value;
        write_arms(&layout, point.index as usize, point.arms, [point.mass, 1.0 / point.k[1]], put);
    }

    /// A point bears no load any more.
    fn release(&mut self, point: &Point) {
        let Place { part, width, first, layout, .. } = self.place(point.lane);
        let floats: &mut [f32] = bytemuck::cast_slice_mut(self.batches[part].records_mut());
        let mut forget = |of: usize| floats[first + layout.at(point.index as usize, of) * width] = 0.0;
        forget(layout.normal_impulse);
        if layout.has_friction {
            forget(layout.tangent_impulse);
        }
    }

    /// The points of a lane.
    fn points(&self, lane: u32) -> [Point; 2] {
        let Place { part, of, width, first, layout, pushes_a } = self.place(lane);
        let batches = &self.batches[part];
        let floats: &[f32] = bytemuck::cast_slice(batches.records());
        let contact = batches.contact()[of];
        let bounces = self.contacts[contact as usize].restitution > 0.0;
        let rows = [batches.row_a()[of], batches.row_b()[of]];
        let at = |quantity: usize| floats[first + quantity * width];
        std::array::from_fn(|p| {
            let is_there = p < layout.points && !bounces;
            let mass = if is_there { at(layout.at(p, layout.normal_mass)) } else { 0.0 };
            let mut point =
                Point { lane, contact, rows, pushes_a, mass, index: p as u32, ..Point::default() };
            if mass <= 0.0 {
                return point;
            }
            let arm = |arm: usize, has: bool| {
                if has { [at(layout.at(p, arm)), at(layout.at(p, arm) + 1)] } else { [0.0; 2] }
            };
            let arms = [arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0])];
            let inertia =
                |body: usize| self.rows[rows[body] as usize].delta[3] * arms[body][0] * arms[body][1];
            let k_nt = inertia(1) + if pushes_a { inertia(0) } else { 0.0 };
            let k_tt = if layout.has_friction { 1.0 / at(layout.at(p, layout.tangent_mass)) } else { 1.0 };
            (point.normal, point.arms, point.own_arms) = ([at(0), at(1)], arms, arms);
            point.k = [1.0 / mass, k_tt, k_nt];
            point.friction = if layout.has_friction { at(layout.friction) } else { 0.0 };
            point.separation = at(layout.at(p, layout.separation));
            let tangent = if layout.has_friction { at(layout.at(p, layout.tangent_impulse)) } else { 0.0 };
            point.borne = [at(layout.at(p, layout.normal_impulse)), tangent];
            point.round = Round::of(&self.contacts[contact as usize], !pushes_a);
            point.is_round = point.round.is_some();
            point
        })
    }
}

impl Point {
    /// Velocity of b against a along n and t (m/s).
    fn velocity(&self, rows: &[BodyRow]) -> [f32; 2] {
        let ([a, b], [nx, ny]) = (self.rows.map(|row| rows[row as usize].velocity), self.normal);
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let [of_a, of_b] = self.arms;
        let along = [nx.mul_add(x, ny * y), ny.mul_add(x, -(nx * y))];
        std::array::from_fn(|i| b[2].mul_add(of_b[i], a[2].neg_mul_add(of_a[i], along[i])))
    }

    /// Gap as bodies are now (m).
    fn gap(&self, rows: &[BodyRow]) -> f32 {
        let ([a, b], [nx, ny]) = (self.rows.map(|row| rows[row as usize].delta), self.normal);
        let moved = nx.mul_add(b[0] - a[0], ny * (b[1] - a[1]));
        let turned = |angle: f32, [n, t]: [f32; 2]| {
            let (sine, versine) = turn(angle);
            sine.mul_add(n, versine * t)
        };
        self.separation + moved + turned(b[2], self.arms[1]) - turned(a[2], self.arms[0])
    }

    /// Impulses `[n, t]` (N·s) on both bodies, at `time` (s).
    fn push(&self, rows: &mut [BodyRow], bodies: &mut [Body], [n, t]: [f32; 2], time: f32) {
        let [nx, ny] = self.normal;
        let (x, y) = (nx.mul_add(n, ny * t), ny.mul_add(n, -(nx * t)));
        let mut give = |body: usize, sign: f32, rows: &mut [BodyRow]| {
            let (place, arm) = (self.rows[body] as usize, self.arms[body]);
            let (row, rounded) = (&mut rows[place], &mut bodies[place].rounded);
            let (mass, inertia) = (sign * row.velocity[3], sign * row.delta[3]);
            let gained = [mass * x, mass * y, inertia * arm[0].mul_add(n, arm[1] * t)];
            for (k, gained) in gained.into_iter().enumerate() {
                row.delta[k] = time.neg_mul_add(gained, row.delta[k]);
                let (before, gained) = (row.velocity[k], gained + rounded[k]);
                row.velocity[k] = before + gained;
                rounded[k] = gained - (row.velocity[k] - before);
            }
        };
        give(1, 1.0, rows);
        if self.pushes_a {
            give(0, -1.0, rows);
        }
    }

    /// What bears body b, or body a, against `direction`: the other one, its arm (m), and the support.
    fn supports(&self, is_b: bool, direction: DVec2, has_arrived: bool) -> Option<(u32, DVec2, Support)> {
        let [nx, ny] = self.normal.map(f64::from);
        let n = DVec2::new(nx, ny);
        let normal = if is_b { n } else { -n };
        let touches = || self.separation <= CLOSED || has_arrived && self.impulse[0] > 0.0;
        if self.mass <= 0.0 || normal.dot(direction) > -BEARS || !touches() {
            return None;
        }
        // With t = (n_y, −n_x), r = (r × n) t − (r × t) n.
        // Nothing turns a smooth disc.
        let turns = self.friction > 0.0 || !self.is_round;
        let arm = |k: usize| {
            let [with_n, with_t] = if turns { self.arms[k].map(f64::from) } else { [0.0; 2] };
            with_n * DVec2::new(ny, -nx) - with_t * n
        };
        let (above, below) = if is_b { (1, 0) } else { (0, 1) };
        let (contact, point, friction) = (self.contact, self.index as usize, f64::from(self.friction));
        let support = Support { contact, point, normal, arm: arm(above), friction, load: [0.0; 2] };
        Some((self.rows[below], arm(below), support))
    }

    /// Has the frame of the moment of touch from now on.
    fn turn(&mut self, frame: &Frame, rows: &[BodyRow]) {
        let k = couplings(self.rows.map(|row| &rows[row as usize]), frame.arms);
        (self.normal, self.arms, self.own_arms) = (frame.normal.to_array(), frame.arms, frame.arms);
        (self.k, self.mass, self.separation) = (k, 1.0 / k[0], frame.separation);
        let [a, b] = self.rows.map(|row| rows[row as usize]);
        let apart = |k: usize| frame.time.mul_add(b.velocity[k] - a.velocity[k], b.delta[k] - a.delta[k]);
        self.apart = [apart(0), apart(1)];
    }

    /// Puts its place between where both bodies are at its time; see the [module](self).
    fn meet(&mut self, rows: &[BodyRow]) {
        // Nothing turns a smooth disc.
        if !self.pushes_a || self.friction == 0.0 && self.is_round {
            return;
        }
        let [a, b] = self.rows.map(|row| rows[row as usize]);
        let apart = |k: usize| {
            self.time.mul_add(b.velocity[k] - a.velocity[k], b.delta[k] - a.delta[k]) - self.apart[k]
        };
        let ([x, y], [nx, ny]) = ([0.5 * apart(0), 0.5 * apart(1)], self.normal);
        // D/2 × n and D/2 × t.
        let shift = [x.mul_add(ny, -(y * nx)), -x.mul_add(nx, y * ny)];
        for (axis, shift) in shift.into_iter().enumerate() {
            self.arms[0][axis] = self.own_arms[0][axis] + shift;
            self.arms[1][axis] = self.own_arms[1][axis] - shift;
        }
        self.k = couplings([&a, &b], self.arms);
        self.mass = 1.0 / self.k[0];
    }
}

impl PlasticImpacts {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = [&self.next, &self.listed, &self.carried, &self.carried_rows, &self.bearing];
        let queue = self.queue.capacity() * size_of::<u32>() + self.pile.held_bytes();
        let found = held(&self.found[0]) + held(&self.found[1]);
        lists.map(held).iter().sum::<usize>() + held(&self.points) + held(&self.bodies) + queue + found
    }

    /// Begins a step with so many contacts.
    pub(super) fn earn(&mut self, contacts: usize) {
        self.spent = self.spent.saturating_sub(contacts / EARNING);
    }

    /// Lets impacts spread from the lanes in `found`; see the [module](self).
    pub(super) fn spread(&mut self, on: &mut On<'_>) {
        self.link(on);
        for (part, first) in [0, on.batches[0].lanes() as u32].into_iter().enumerate() {
            for i in 0..self.found[part].len() {
                self.list(on, first + self.found[part][i]);
            }
        }
        let arrived = self.points.len();
        self.arrived = arrived;
        let fastest = self.points.iter().map(|p| -p.velocity(on.rows)[0]).fold(0.0, f32::max);
        let mut slowest = TOLERANCE * fastest;
        let always = SOLVES[0] + SOLVES[1] / arrived.max(1);
        let left = MOST_SPENT.saturating_sub(self.spent);
        (self.solved, self.is_carried) = (0, false);
        for i in 0..arrived {
            self.visit(on, i, slowest);
        }
        self.bodies.iter_mut().for_each(|body| body.begun = body.time);
        let most = |points: usize| always + left.min(PER_POINT * points);
        let is_done = self.run(on, &mut slowest, most);
        let is_done = is_done && (self.is_carried || !self.release(on) || self.run(on, &mut slowest, most));
        if !is_done {
            self.put_back(on.rows);
        }
        if self.is_carried {
            self.displace(on.rows);
        }
        self.queue.clear();
        for point in self.points.iter().filter(|point| point.impulse[0] > 0.0) {
            on.put(point);
        }
        self.spent += self.solved.saturating_sub(always);
        self.rest(on);
        if on.record_impulses {
            for point in &self.points {
                let sum = &mut on.contacts[point.contact as usize].step_impulse[point.index as usize];
                *sum = [sum[0] + point.impulse[0], sum[1] + point.impulse[1]];
            }
        }
    }

    /// Visits the points of bodies that were pushed, until none is left; or until the points that are known, `most` of which
    /// says so, have been visited too often.
    fn run(&mut self, on: &mut On<'_>, slowest: &mut f32, most: impl Fn(usize) -> usize) -> bool {
        let mut patience = PATIENCE;
        while let Some(body) = self.queue.pop_front() {
            self.bodies[body as usize].is_queued = false;
            let mut end = self.bodies[body as usize].first;
            while end != NONE {
                let lane = end / 2;
                end = self.next[end as usize];
                let first = self.list(on, lane);
                self.visit(on, first, *slowest);
                self.visit(on, first + 1, *slowest);
            }
            if !self.is_carried && self.solved > patience * self.points.len() {
                patience *= 2;
                self.is_carried = self.carry(on);
                if self.is_carried {
                    *slowest = slowest.max(on.slowest);
                }
            }
            if self.solved > most(self.points.len()) {
                return false;
            }
        }
        true
    }

    /// Gives bodies what has borne them until they were hit, by points that the impact releases; whether there are any.
    fn release(&mut self, on: &mut On<'_>) -> bool {
        for place in 0..self.points.len() {
            let point = self.points[place];
            let time =
                point.rows.map(|row| self.bodies[row as usize].time).into_iter().fold(STILL.time, f32::max);
            let brings_back = point.k[0] * point.borne[0] * (on.dt / on.h);
            let leaves = point.impulse[0] == 0.0 && point.velocity(on.rows)[0] > brings_back;
            if point.is_round || point.borne[0] <= 0.0 || time == STILL.time || !leaves {
                continue;
            }
            on.release(&point);
            if time < 0.0 && point.pushes_a {
                continue;
            }
            let given = point.borne.map(|impulse| impulse * (time / on.h));
            self.push(on, place, given, [0.5 * time, time]);
            if on.record_impulses {
                let sum = &mut on.contacts[point.contact as usize].step_impulse[point.index as usize];
                *sum = [sum[0] + given[0], sum[1] + given[1]];
            }
        }
        !self.queue.is_empty()
    }

    /// Sends what momentum pushed bodies have left down to what does not move, if that stops them better; see `impact_statics.rs`.
    fn carry(&mut self, on: &mut On<'_>) -> bool {
        let found = self.find_bearings(on, |place| on.rows[place].velocity);
        if !found || self.pile.stop().is_none_or(|left| left >= 1.0) {
            return false;
        }
        for (&place, carried) in self.carried_rows.iter().zip(&self.pile.bodies) {
            let body = &mut self.bodies[place as usize];
            if carried.time > STILL.time {
                body.time = carried.time;
            }
            body.begun = body.time;
        }
        for i in 0..self.bearing.len() {
            let Bearing { above, support, .. } = self.pile.bearings[i];
            let load = support.load.map(|load| load as f32);
            if load == [0.0; 2] {
                continue;
            }
            let point = &mut self.points[self.bearing[i] as usize];
            point.time = self.bodies[self.carried_rows[above as usize] as usize].time;
            point.meet(on.rows);
            point.impulse = [point.impulse[0] + load[0], point.impulse[1] + load[1]];
            let time = point.time;
            self.push(on, self.bearing[i] as usize, load, [time; 2]);
        }
        self.displace(on.rows);
        true
    }

    /// Puts what momentum went through where it would be if all of that had happened at the time at which it began: what only
    /// goes through a body does not displace it.
    fn displace(&self, rows: &mut [BodyRow]) {
        for &place in &self.carried_rows {
            let (row, body) = (&mut rows[place as usize], &self.bodies[place as usize]);
            for k in 0..3 {
                row.delta[k] = -body.begun * (row.velocity[k] - body.flown[k]);
            }
        }
    }

    /// Lists bodies with momentum and what bears them; false if something that bears moves, but nothing moves it.
    fn find_bearings(&mut self, on: &On<'_>, velocity: impl Fn(usize) -> [f32; 4]) -> bool {
        self.pile.clear();
        self.bearing.clear();
        self.carried.clear();
        self.carried.resize(on.rows.len(), NONE);
        self.carried_rows.clear();
        let mut momentum = DVec2::ZERO;
        for (place, (row, body)) in (0..).zip(on.rows.iter().zip(&self.bodies)) {
            if body.time > STILL.time {
                self.carried[place as usize] = self.carried_rows.len() as u32;
                self.carried_rows.push(place);
                let [x, y, ..] = velocity(place as usize).map(f64::from);
                momentum += DVec2::new(x, y) / f64::from(row.velocity[3]);
            }
        }
        let Some(direction) = momentum.try_normalize() else { return false };
        let mut next = 0;
        while let Some(&place) = self.carried_rows.get(next) {
            next += 1;
            let row = &on.rows[place as usize];
            let [x, y, turn, _] = velocity(place as usize).map(f64::from);
            let inverse = [row.velocity[3], row.delta[3]].map(f64::from);
            let time = self.bodies[place as usize].begun;
            self.pile.bodies.push(Carried { velocity: [x, y, turn], inverse, time });
            let mut end = self.bodies[place as usize].first;
            while end != NONE {
                // Ends of a are even.
                let (lane, is_b) = (end / 2, end % 2 == 1);
                end = self.next[end as usize];
                let first = self.list(on, lane);
                for point in first..first + 2 {
                    let Some((below, arm_below, support)) =
                        self.points[point].supports(is_b, direction, point < self.arrived)
                    else {
                        continue;
                    };
                    let moves = !is_b || self.points[point].pushes_a;
                    if !moves && on.rows[below as usize].velocity[..3] != [0.0; 3] {
                        return false;
                    }
                    let local = &mut self.carried[below as usize];
                    if moves && *local == NONE {
                        *local = self.carried_rows.len() as u32;
                        self.carried_rows.push(below);
                    }
                    let below = moves.then_some(*local);
                    self.bearing.push(point as u32);
                    self.pile.bearings.push(Bearing { above: next as u32 - 1, below, arm_below, support });
                }
            }
        }
        true
    }

    /// What has been stopped rests from now on: contacts that will bear more than twice what they bore begin with it.
    fn rest(&mut self, on: &mut On<'_>) {
        let found = self.find_bearings(on, |place| {
            let [x, y, ..] = on.increments[place];
            [x, y, 0.0, 0.0]
        });
        let still = |&place: &u32| {
            let ([x, y, ..], [gx, gy, ..]) =
                (on.rows[place as usize].velocity, on.increments[place as usize]);
            x.hypot(y) * on.h <= gx.hypot(gy) * on.dt
        };
        if !found
            || !self.carried_rows.iter().all(still)
            || self.pile.stop().is_none_or(|left| left > AT_REST)
        {
            return;
        }
        let mut i = 0;
        while i < self.bearing.len() {
            let lane = self.points[self.bearing[i] as usize].lane;
            let end = (i..self.bearing.len())
                .find(|&k| self.points[self.bearing[k] as usize].lane != lane)
                .unwrap_or(self.bearing.len());
            let Place { part, width, first, layout, .. } = on.place(lane);
            let floats: &mut [f32] = bytemuck::cast_slice_mut(on.batches[part].records_mut());
            let load: f64 = self.pile.bearings[i..end].iter().map(|bearing| bearing.support.load[0]).sum();
            let at = |p: usize, quantity: usize| first + layout.at(p, quantity) * width;
            let borne: f32 = (0..layout.points).map(|p| floats[at(p, layout.normal_impulse)]).sum();
            let contact = self.points[self.bearing[i] as usize].contact as usize;
            if on.contacts[contact].manifold.count == 2 && load > 2.0 * f64::from(borne) {
                for k in i..end {
                    let (p, load) =
                        (self.points[self.bearing[k] as usize].index, self.pile.bearings[k].support.load);
                    floats[at(p as usize, layout.normal_impulse)] = load[0] as f32;
                    if layout.has_friction {
                        floats[at(p as usize, layout.tangent_impulse)] = load[1] as f32;
                    }
                }
                if on.weights.is_empty() {
                    on.weights.resize(on.contacts.len(), 0.0);
                }
                on.weights[contact] = load as f32 / on.h;
            }
            i = end;
        }
    }

    /// Bodies stay where they are: nothing has looked yet at what they were displaced into.
    fn put_back(&self, rows: &mut [BodyRow]) {
        for (row, _) in rows.iter_mut().zip(&self.bodies).filter(|(_, body)| body.time > STILL.time) {
            row.delta[..3].fill(0.0);
        }
    }

    /// Links the ends of each body.
    fn link(&mut self, on: &On<'_>) {
        let (count, lanes) = (on.rows.len(), on.lanes());
        self.bodies.clear();
        self.bodies.extend(
            on.rows.iter().map(|row| Body { flown: std::array::from_fn(|k| row.velocity[k]), ..STILL }),
        );
        self.next.resize(2 * lanes, NONE);
        self.listed.clear();
        self.listed.resize(lanes, NONE);
        self.points.clear();
        let mut end = 0;
        for batches in &on.batches {
            for (&a, &b) in batches.row_a().iter().zip(batches.row_b()) {
                for body in [a, b] {
                    // The last row is that of empty lanes.
                    if (body as usize) < count - 1 {
                        self.next[end] = std::mem::replace(&mut self.bodies[body as usize].first, end as u32);
                    }
                    end += 1;
                }
            }
        }
    }

    /// The place of the first point of a lane.
    fn list(&mut self, on: &On<'_>, lane: u32) -> usize {
        let listed = &mut self.listed[lane as usize];
        if *listed == NONE {
            *listed = self.points.len() as u32;
            let mut points = on.points(lane);
            for point in points.iter_mut().filter(|point| point.mass > 0.0) {
                // Arms end at one point at the time of the frame, if nothing is hit.
                let [a, b] = point.rows.map(|row| self.bodies[row as usize].flown);
                let contact = &on.contacts[point.contact as usize];
                let lead = if contact.manifold.count == 1 { contact.turn } else { 0.0 };
                point.apart = std::array::from_fn(|k| lead * (b[k] - a[k]));
                point.is_round |= lead != 0.0;
            }
            self.points.extend(points);
        }
        *listed as usize
    }

    /// Solves a point, if it comes in faster than `slowest` (m/s) or has been hit.
    #[inline(always)]
    fn visit(&mut self, on: &mut On<'_>, place: usize, slowest: f32) {
        let point = &mut self.points[place];
        if point.mass <= 0.0 {
            return;
        }
        let mut touch = None;
        if point.impulse[0] == 0.0 {
            let arrival = |point: &Point, rows: &[BodyRow]| {
                let ([vn, _], gap) = (point.velocity(rows), point.gap(rows));
                (vn < -slowest && vn.mul_add(AHEAD * on.dt, gap) < 0.0).then(|| gap / -vn)
            };
            let Some(mut time) = arrival(point, on.rows) else { return };
            if let Some(round) = point.round {
                let ends = point.rows.map(|row| &on.rows[row as usize]);
                touch = round.frame(ends, [-on.dt, TURNED * on.dt]);
            }
            if let Some(frame) = &touch {
                let mut turned = *point;
                turned.turn(frame, on.rows);
                let Some(then) = arrival(&turned, on.rows) else { return };
                (*point, time) = (turned, then);
            }
            point.time = if time < -on.dt { 0.0 } else { time };
        }
        for row in point.rows {
            point.time = point.time.max(self.bodies[row as usize].time);
        }
        if let Some(frame) = &touch {
            self.points[place].round = None;
            on.turn(&self.points[place], frame);
        }
        let point = &mut self.points[place];
        point.meet(on.rows);
        let [vn, vt] = point.velocity(on.rows);
        let old = point.impulse;
        let new = rough_impulses(point.k, point.mass, point.friction, old, [-vn, -vt]);
        self.solved += 1;
        let delta = [new[0] - old[0], new[1] - old[1]];
        if point.k[0] * (delta[0].abs() + delta[1].abs()) <= slowest {
            return;
        }
        point.impulse = new;
        let time = point.time;
        self.push(on, place, delta, [time; 2]);
    }

    /// Pushes both bodies of a point with an impulse (N·s) up to `time` (s), in the mean at `at` (s), and has their points
    /// looked at.
    #[inline(always)]
    fn push(&mut self, on: &mut On<'_>, place: usize, impulse: [f32; 2], [at, time]: [f32; 2]) {
        let point = &self.points[place];
        point.push(on.rows, &mut self.bodies, impulse, at);
        for (row, is_pushed) in point.rows.into_iter().zip([point.pushes_a, true]) {
            let body = &mut self.bodies[row as usize];
            if !is_pushed {
                continue;
            }
            body.time = body.time.max(time);
            if !std::mem::replace(&mut body.is_queued, true) {
                self.queue.push_back(row);
            }
        }
    }
}
