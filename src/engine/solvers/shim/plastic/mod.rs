//! Plastic impacts: what comes in without restitution stays, before the step is solved.
//!
//! # The law
//!
//! That of [`crate::engine::constraints::impacts::waves`] with e = 0, at all points together: each has v_n⁺ ≥ 0, an impulse only where v_n⁺ = 0,
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
//! # How far
//!
//! Many impacts at once, as in a drum, are a load on many bodies, and their effects overlap: more than
//! 32 contacts are left to the solver. Fewer are followed as far as they go if that is rare, as when
//! something heavy falls on a pile: there are 2¹⁸ visits for that, which are earned anew by one for
//! 8 contacts in a step, a thirtieth of what a step costs. What comes in even then is stopped by the
//! solver, and no body is displaced: one might be into a third that nobody has looked at.

mod carry;
mod pile;
mod point;
mod release;

use crate::engine::constraints::impacts::waves::{AHEAD, TURNED, rough_impulses};
use crate::engine::lanes::{BodyRow, held};
use crate::engine::solvers::shim::rest::{LEAD, PER_CONTACT};
use pile::Pile;
pub(crate) use point::On;
use point::{Body, Point, STILL};
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

/// Contacts of a step that earn one visit (1).
const EARNING: usize = 8;

/// Spreads impacts; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub struct PlasticImpacts {
    /// Lanes in which something arrives, of the coloured batches and of the serial ones.
    pub(crate) found: [Vec<u32>; 2],
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
    /// What carries the momentum of an impact.
    pile: Pile,
    /// Points that arrive, the first ones.
    arrived: usize,
    /// Momentum has gone down a pile in this step.
    is_carried: bool,
    /// How often a point was solved in this step.
    solved: usize,
    /// How often points were solved in the last steps beyond what any step may, less what has been earned since.
    pub(crate) spent: usize,
}

impl PlasticImpacts {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = [&self.next, &self.listed];
        let queue = self.queue.capacity() * size_of::<u32>() + self.pile.held_bytes();
        let found = held(&self.found[0]) + held(&self.found[1]);
        lists.map(held).iter().sum::<usize>() + held(&self.points) + held(&self.bodies) + queue + found
    }

    /// Begins a step with so many contacts.
    pub(crate) fn earn(&mut self, contacts: usize) {
        self.spent = self.spent.saturating_sub(contacts / EARNING);
    }

    /// Lets impacts spread from the lanes in `found`; see the [module](self).
    pub(crate) fn spread(&mut self, on: &mut On<'_>) {
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
                let lead = on.kept[PER_CONTACT * point.contact as usize + LEAD];
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
