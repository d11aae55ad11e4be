//! Impacts that spread from body to body, solved before the step.
//!
//! # The law
//!
//! The law of a single point is in [`law`]. An impact proceeds in *waves*. A wave begins by finding all
//! approaching points and fixing the rebound velocity of each. They are solved together by Gauss–Seidel on
//! accumulated impulses, so a box that lands flat bounces flat. Points that approach afterwards form the next
//! wave: an impact runs through a row of balls ball by ball.
//!
//! Let dv be the speed that forces give a resting body in a step. A point whose rebound would be slower than dv/10 does not bounce.
//! It *stops* the approach, v_n⁺ ≥ 0 with an impulse only where v_n⁺ = 0, in this wave and in all later ones. So zero restitution is
//! the limit of a small one.
//!
//! After a body is pushed, its other points are visited, until no approach is faster than 10⁻³ of the first.
//! Bodies that nothing hits cost nothing. Visiting the two points of a contact in turn leaves a fraction
//! c²/(k₀ k₁) of the error, with c the velocity that a unit impulse at one adds to the other. If the fraction
//! is more than half, as for corners that just overlap, both normal impulses are solved together ([`pair`]).
//! A wave that visits do not solve is solved as a whole, if it only stops, and so is one in which joints take part ([`whole`]).
//!
//! # Time of the impact within the step
//!
//! In flight, semi-implicit Euler follows a parabola with w = v − a h/2 instead of v. A point with gap s reaches the surface at the time
//! t with the speed w₁ and bounces. Its new parabola has these values at the beginning of the step:
//!
//! ```text
//! w₁ = √(w² + 2 a s)   t = 2 s/(w₁ − w)   v⁺ = e w₁ + a t + a h/2   s⁺ = s − t (v⁺ − v)
//! ```
//!
//! So a body that gets the velocity v⁺ and is moved by −t Δv flies as if it had been hit at t: in the coming
//! step, or, for an overlap (t < 0), in the last one. Times before the last step or after the coming one are
//! clamped, and v⁺ keeps the energy of height. A point that stops touches from t = s/|v| on. A point that is
//! pushed again by a body that was hit at t′ uses the later time. Solvers that derive velocities from
//! positions, and those of other engines, bounce at the beginning of the step (`timed` is false).
//!
//! At the time of the impulse the centers have moved relative to each other by D. With the arms of the start
//! of the step the impulse would add D × λ to the angular momentum. So both arms end at one point at that
//! time, r_a + D/2 and r_b − D/2, and round shapes have the frame of that time (`touch.rs`). The rows
//! themselves use these arms and frames: an impulse with an effect that its row leaves out may add energy,
//! and has shot bodies out of piles.
//!
//! Bodies that would end deeper in another body than they began are not moved.
//!
//! # Joints
//!
//! Where bodies with joints are hit, the rigid rows and limits of their joints are part of the problem ([`whole`]). Welded bodies
//! bounce, but are not stopped: sweeps know the masses that the planks of a beam lend to their contacts, impacts do not.
//!
//! # A bound for each island
//!
//! Bodies connected by contacts or joints form an island. Islands are solved independently, so a scene behaves the same
//! next to another one. An island has at most 32 waves, of which the last 4 only stop, and a visit limit that
//! grows with its number of points ([`VISITS`]). The solver stops points that still approach after that.
//! So the time of a step is bounded.

mod find;
mod joints;
mod law;
mod pair;
mod point;
mod whole;

use crate::constraints::impacts::touch::Round;
use crate::disjoint::DisjointSets;
pub(crate) use find::{Find, impact_speeds};
use joints::WaveJoints;
use law::{lossy_impulses, rough_impulses};
pub(crate) use point::PropagationInput;
use point::{Body, HitPoint, Role, STILL};
use std::collections::VecDeque;

/// No lane, no point.
const NONE: u32 = u32::MAX;

/// Impacts spread until no approach is faster than this fraction of the fastest (1).
const TOLERANCE: f32 = 1e-3;

/// Factor on [`TOLERANCE`] if a point bounces (1): the spin that an error gives to a flat box grows with each
/// bounce.
const FINER: f32 = 1e-3;

/// How far ahead the motion of a point is followed, as a multiple of its path in the step (1).
const AHEAD: f32 = 1.1;

/// Slowest rebound, as a multiple of the speed that forces give a resting body in a step (1).
const BOUNCES: f32 = 0.1;

/// Most waves of an island, and the number of last waves that only stop.
const WAVES: [u32; 2] = [32, 4];

/// Visit limit of an island, per point for its [`FIRST`] points. Each further point adds one.
pub(crate) const VISITS: usize = 18;

/// Number of points to which [`VISITS`] applies.
const FIRST: usize = 8;

/// How much deeper a point may end, as a fraction of the slop (1): the
/// residual approach of touching bodies makes them overlap.
const DEEPER: f32 = 0.1;

/// Solves impacts; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub struct ImpactPropagation {
    /// Lanes that are hit, of the colored batches and of the serial ones. `hit` has those of both, by island.
    found: [Vec<u32>; 2],
    hit: Vec<(u32, u32)>,
    /// `[rows]`
    bodies: Vec<Body>,
    /// Bodies that contacts connect. `[rows]`
    islands: DisjointSets,
    /// The next end of the same body. Lane l, counted through both sets of batches, has the ends 2 l and 2 l + 1.
    /// `[2 lanes]`
    next: Vec<u32>,
    /// Index in `points` of the first of the two points of a lane, or [`NONE`]. `[lanes]`
    listed: Vec<u32>,
    /// Points, in pairs. A missing point has zero mass.
    points: Vec<HitPoint>,
    /// Bodies that were pushed since their points were last visited.
    queue: VecDeque<u32>,
    /// Bodies of the island that were pushed, with their velocities before that.
    pushed: Vec<(u32, [f32; 3])>,
    /// Joints of the island.
    joints: WaveJoints,
    /// The first point of the island.
    first: usize,
    /// When its first points, those that were hit from outside, close their gaps (s).
    arrivals: Vec<f32>,
    /// Number of visits to points of the island, and of solutions of its waves.
    visits: usize,
    solutions: u32,
    /// Approach speed of the impact, and that below which a point counts as solved (m/s).
    fastest: f32,
    slowest: f32,
}

impl ImpactPropagation {
    /// Where [`find`] writes what it finds.
    pub(crate) fn found(&mut self) -> &mut [Vec<u32>; 2] {
        &mut self.found
    }

    /// Solves the impacts of the lanes that were found, island by island. Returns the number of visits and of
    /// islands that reached their bound; `None` if no impacts occurred.
    pub(crate) fn run(&mut self, on: &mut PropagationInput<'_>) -> Option<[usize; 2]> {
        if self.found.iter().all(Vec::is_empty) {
            return None;
        }
        self.link(on);
        self.hit.clear();
        let lanes = on.batches[0].lanes() as u32;
        for (part, first) in [0, lanes].into_iter().enumerate() {
            for i in 0..self.found[part].len() {
                let lane = first + self.found[part][i];
                let root = self.island_of(on, lane);
                self.hit.push((root, lane));
            }
        }
        // Lanes of an island stay in order.
        self.hit.sort_unstable();
        let (mut begin, mut cut, mut visits) = (0, 0, 0);
        while begin < self.hit.len() {
            let root = self.hit[begin].0;
            let end = begin + self.hit[begin..].partition_point(|&(other, _)| other == root);
            cut += usize::from(!self.island(on, begin..end));
            visits += self.visits;
            begin = end;
        }
        for point in self.points.iter().filter(|point| point.given != [0.0; 2]) {
            on.put(point);
            if on.record_impulses {
                let contact = on.contact_of(point.lane);
                let sum = &mut on.contacts[contact].step_impulse[usize::from(point.index)];
                *sum = [sum[0] + point.given[0], sum[1] + point.given[1]];
            }
        }
        Some([visits, cut])
    }

    /// Solves the impacts of an island. Returns false if it reached its bound.
    fn island(&mut self, on: &mut PropagationInput<'_>, hit: std::ops::Range<usize>) -> bool {
        (self.first, self.visits, self.solutions) = (self.points.len(), 0, 0);
        self.pushed.clear();
        self.joints.clear();
        for i in hit {
            self.list(on, self.hit[i].1);
        }
        let arrived = self.points.len();
        let mut is_done = false;
        for wave in 0..WAVES[0] {
            let bounces = wave + WAVES[1] < WAVES[0];
            if wave == 0 {
                let speeds = self.points[self.first..].iter().map(|p| -p.velocity(on.rows)[0]);
                self.fastest = speeds.fold(0.0, f32::max);
                self.slowest = TOLERANCE * self.fastest;
                let points = &self.points[self.first..];
                self.arrivals.clear();
                // A deeper point overlapped before.
                let when = |time: f32| if time < -on.dt { 0.0 } else { time };
                self.arrivals.extend(points.iter().map(|p| arrival(p, on, 0.0).map_or(-on.dt, when)));
            }
            let any = self.begin_wave(on, wave == 0, bounces);
            if wave == 0 && self.points[self.first..].iter().any(|point| point.role == Role::Bounces) {
                self.slowest *= FINER;
            }
            if !any && wave > 0 && !(on.stops && self.release(on)) {
                is_done = true;
                break;
            }
            let known = if wave == 0 { arrived } else { self.points.len() };
            for place in self.first..known {
                self.visit(on, place, bounces);
            }
            if !self.spread(on, bounces) && !self.whole(on, wave == 0, bounces) {
                break;
            }
        }
        for &(row, _) in &self.pushed {
            if !on.timed || self.joints.has(row) {
                on.rows[row as usize].delta[..3].fill(0.0);
            }
        }
        if on.timed {
            self.stay(on);
        }
        is_done
    }

    /// Cancels the displacement of bodies that have a point, visited or not, that would end deeper. A point that has bounced leaves.
    fn stay(&mut self, on: &mut PropagationInput<'_>) {
        let deeper = DEEPER * on.slop;
        for i in 0..self.pushed.len() {
            let mut end = self.bodies[self.pushed[i].0 as usize].first;
            while end != NONE {
                self.list(on, end / 2);
                end = self.next[end as usize];
            }
        }
        let mut stay: Vec<u32> = vec![];
        let bounced = |point: &HitPoint| matches!(point.role, Role::Left | Role::Bounces);
        for point in self.points[self.first..].iter().filter(|point| point.exists && !bounced(point)) {
            if point.gap(on.rows) < point.separation.min(0.0) - deeper {
                stay.extend(point.moved());
            }
        }
        for row in stay {
            on.rows[row as usize].delta[..3].fill(0.0);
        }
    }

    /// Finds the points that bounce in this wave. Returns whether there are any.
    fn begin_wave(&mut self, on: &mut PropagationInput<'_>, is_first: bool, bounces: bool) -> bool {
        let mut any = false;
        for place in self.first..self.points.len() {
            let point = &mut self.points[place];
            if point.role == Role::Bounces {
                point.role = Role::Left;
            }
            if point.role == Role::Stops || !point.exists {
                continue;
            }
            let Some(mut target) = rebounds(point, on, is_first) else { continue };
            if !bounces {
                // It is stopped when it is visited.
                any = true;
                continue;
            }
            if let Some(round) = on.round(point) {
                let ends = point.rows.map(|row| &on.rows[row as usize]);
                if let Some(frame) = round.frame(ends, [-AHEAD * on.dt, on.dt]) {
                    let mut turned = *point;
                    turned.turn(&frame, on.rows);
                    on.fall(&mut turned);
                    // If the turned point does not bounce, the row of the start would still stop it, so it
                    // bounces on that row.
                    if let Some(then) = rebounds(&turned, on, is_first) {
                        on.turn(&turned, &frame);
                        (*point, target) = (turned, then);
                    }
                }
            }
            let [v, slip] = point.velocity(on.rows);
            (point.target, point.time) = (target[0], target[1]);
            (point.slip, point.lost) = (slip, (-v - target[0]).max(0.0));
            (point.role, point.impulse) = (Role::Bounces, [0.0; 2]);
            any = true;
        }
        any
    }

    /// Applies the loads that points carried until the impact released them. Returns whether there are any.
    ///
    /// A block that rocks stands on one corner until the other one is hit. Its load F of the step before belongs to the first
    /// corner until t, and in the step that is solved from its beginning on, all of it goes to the second: an error of F t
    /// times the distance of both. So a point that an impact releases, which
    /// is one that leaves faster than its load can bring it back within the step, gives F t beside the impact (for t < 0 it has
    /// borne too long, and takes it back from what does not move). A force in [0, t] moves bodies by F t (dt − t/2)/m in the step.
    fn release(&mut self, on: &mut PropagationInput<'_>) -> bool {
        let mut any = false;
        for place in self.first..self.points.len() {
            let point = self.points[place];
            let time =
                point.rows.map(|row| self.bodies[row as usize].time).into_iter().fold(STILL.time, f32::max);
            if point.role != Role::Open || !point.exists || time == STILL.time {
                continue;
            }
            let speed = point.velocity(on.rows)[0];
            if speed <= 0.0 {
                continue;
            }
            let borne = on.borne(&point);
            let brings_back = point.k[0] * borne[0] * (on.dt / on.h);
            if borne[0] <= 0.0 || speed <= brings_back || Round::is_of(on.contact(&point)) {
                continue;
            }
            on.release(&point);
            if time < 0.0 && point.pushes_a || !on.timed {
                continue;
            }
            let given = borne.map(|impulse| impulse * (time / on.h));
            self.points[place].given = given;
            self.push(on, place, given, [0.5 * time, time]);
            any = true;
        }
        any
    }

    /// Visits the points of pushed bodies until none is left or the bound is reached. Returns whether none is
    /// left.
    fn spread(&mut self, on: &mut PropagationInput<'_>, bounces: bool) -> bool {
        let mut is_done = true;
        while let Some(body) = self.queue.pop_front() {
            self.bodies[body as usize].is_queued = false;
            if !is_done {
                continue;
            }
            let mut end = self.bodies[body as usize].first;
            while end != NONE {
                let lane = end / 2;
                end = self.next[end as usize];
                let first = self.list(on, lane);
                self.visit_both(on, first);
                self.visit(on, first, bounces);
                self.visit(on, first + 1, bounces);
            }
            let points = self.points.len() - self.first;
            is_done = !self.joints.act()
                && self.visits <= on.visits * points.min(FIRST) + points.saturating_sub(FIRST);
        }
        is_done && !self.joints.act()
    }

    /// Solves both normal impulses of a contact together, if both are positive and alternating visits would
    /// converge slowly.
    fn visit_both(&mut self, on: &mut PropagationInput<'_>, first: usize) {
        let pushes = |p: &HitPoint| p.impulse[0] > 0.0 && matches!(p.role, Role::Stops | Role::Bounces);
        if !self.points[first].is_tight || !self.points[first..first + 2].iter().all(pushes) {
            return;
        }
        self.visits += 1;
        self.meet(on, first);
        self.meet(on, first + 1);
        let points = [self.points[first], self.points[first + 1]];
        let wanted = points.map(|point| point.target - point.velocity(on.rows)[0]);
        if wanted[0].abs().max(wanted[1].abs()) <= self.slowest {
            return;
        }
        let (k, old) = (points.map(|point| point.k[0]), points.map(|point| point.impulse[0]));
        let coupling = points[0].coupling(&points[1], on.rows);
        let Some(new) = pair::impulses(k, coupling, old, wanted) else { return };
        for i in 0..2 {
            self.change(on, first + i, [new[i], points[i].impulse[1]]);
        }
    }

    /// Moves a point to the middle between the positions of its bodies at the time of its impact.
    fn meet(&mut self, on: &PropagationInput<'_>, place: usize) {
        if on.timed {
            let point = &mut self.points[place];
            for row in point.rows {
                point.time = point.time.max(self.bodies[row as usize].time);
            }
            // Nothing turns a smooth disc.
            if point.pushes_a && (point.friction > 0.0 || !Round::is_of(on.contact(point))) {
                point.meet(on.rows);
            }
        }
    }

    /// Whether a point takes part in the wave: it does if it was hit before, or approaches fast enough.
    fn admit(&mut self, on: &mut PropagationInput<'_>, place: usize, bounces: bool) -> bool {
        let point = &mut self.points[place];
        if !point.exists || point.role == Role::Left && bounces {
            return false;
        }
        let mut touch = None;
        if matches!(point.role, Role::Open | Role::Left) {
            if !self.joints.act() && point.rows.iter().any(|&row| self.joints.is_welded(on.types, row)) {
                return false;
            }
            let Some(mut time) = arrival(point, on, self.slowest) else { return false };
            if bounces && will_bounce(point, on) {
                // In the next wave.
                return false;
            }
            if let Some(round) = on.round(point) {
                let ends = point.rows.map(|row| &on.rows[row as usize]);
                touch = round.frame(ends, [-on.dt, on.dt]);
            }
            if let Some(frame) = &touch {
                let mut turned = *point;
                turned.turn(frame, on.rows);
                let Some(then) = arrival(&turned, on, self.slowest) else { return false };
                (*point, time) = (turned, then);
                on.turn(point, frame);
                on.fall(point);
            }
            point.time = if time < -on.dt || !on.timed { 0.0 } else { time };
            point.stop();
        }
        true
    }

    /// Solves a point, if it takes part in the wave. Points of bodies with joints are left to [`Self::whole`].
    fn visit(&mut self, on: &mut PropagationInput<'_>, place: usize, bounces: bool) {
        if !self.admit(on, place, bounces) {
            return;
        }
        if self.points[place].rows.iter().any(|&row| self.joints.has(row)) {
            self.joints.join();
            return;
        }
        self.meet(on, place);
        let point = &mut self.points[place];
        let ([vn, vt], old) = (point.velocity(on.rows), point.impulse);
        let wanted = [point.target - vn, -vt];
        let mut new = rough_impulses(point.k, point.friction, old, wanted);
        if point.role == Role::Bounces && point.friction > 0.0 {
            let [k_nn, k_tt, k_nt] = point.k;
            let from_none = [
                k_nn.mul_add(old[0], k_nt.mul_add(old[1], wanted[0])),
                k_nt.mul_add(old[0], k_tt.mul_add(old[1], wanted[1])),
            ];
            new = lossy_impulses(point.k, new, from_none, [point.slip, point.lost]);
        }
        self.visits += 1;
        let delta = [new[0] - old[0], new[1] - old[1]];
        if point.k[0] * (delta[0].abs() + delta[1].abs()) <= self.slowest {
            return;
        }
        self.change(on, place, new);
    }

    /// Changes the impulses of a point (N·s), at the time of its impact.
    fn change(&mut self, on: &mut PropagationInput<'_>, place: usize, new: [f32; 2]) {
        let point = &mut self.points[place];
        let delta = [new[0] - point.impulse[0], new[1] - point.impulse[1]];
        point.given = [point.given[0] + delta[0], point.given[1] + delta[1]];
        point.impulse = new;
        let time = point.time;
        self.push(on, place, delta, [time; 2]);
    }

    /// Applies an impulse (N·s) to both bodies of a point and queues them. The impulse acts until `time` (s),
    /// and at `at` (s) on average.
    fn push(&mut self, on: &mut PropagationInput<'_>, place: usize, impulse: [f32; 2], [at, time]: [f32; 2]) {
        let HitPoint { rows, pushes_a, .. } = self.points[place];
        for row in rows.into_iter().skip(usize::from(!pushes_a)) {
            self.note_push(on, row);
            let body = &mut self.bodies[row as usize];
            body.time = body.time.max(time);
        }
        self.points[place].push(on.rows, impulse, if on.timed { at } else { 0.0 });
    }

    /// Notes that a body is pushed, with its velocity before that, and queues it.
    fn note_push(&mut self, on: &PropagationInput<'_>, row: u32) {
        if !std::mem::replace(&mut self.bodies[row as usize].is_pushed, true) {
            let [x, y, spin, _] = on.rows[row as usize].velocity;
            self.pushed.push((row, [x, y, spin]));
        }
        enqueue(&mut self.bodies, &mut self.queue, row);
    }

    /// Links the ends of each body, and joins bodies in contact into islands.
    fn link(&mut self, on: &PropagationInput<'_>) {
        let (count, lanes) = (on.rows.len(), on.batches[0].lanes() + on.batches[1].lanes());
        self.bodies.clear();
        self.bodies.resize(count, STILL);
        self.islands.begin(count);
        self.next.resize(2 * lanes, NONE);
        self.listed.clear();
        self.listed.resize(lanes, NONE);
        self.points.clear();
        self.joints.link(on.types, on.rows);
        let mut end = 0;
        for part in 0..2 {
            let batches = &on.batches[part];
            for (&a, &b) in batches.row_a().iter().zip(batches.row_b()) {
                for body in [a, b] {
                    // The last row is that of empty lanes.
                    if (body as usize) < count - 1 {
                        self.next[end] = std::mem::replace(&mut self.bodies[body as usize].first, end as u32);
                    }
                    end += 1;
                }
                let moves = |row: u32| on.rows[row as usize].velocity[3] > 0.0;
                if moves(a) && moves(b) {
                    self.islands.join(a, b);
                }
            }
        }
        for &[a, b] in self.joints.ends() {
            if self.joints.has(a) && self.joints.has(b) {
                self.islands.join(a, b);
            }
        }
    }

    /// The body that represents the island of a lane.
    fn island_of(&mut self, on: &PropagationInput<'_>, lane: u32) -> u32 {
        let (part, of) = on.part_of(lane);
        // Body b is dynamic.
        self.islands.least(on.batches[part].row_b()[of])
    }

    /// Index of the first point of a lane. Adds the points of the lane to the list if they are not in it.
    fn list(&mut self, on: &PropagationInput<'_>, lane: u32) -> usize {
        let (first, listed) = (self.points.len(), &mut self.listed[lane as usize]);
        if *listed == NONE {
            *listed = first as u32;
            self.points.resize(first + 2, HitPoint::default());
            let points = &mut self.points[first..];
            on.read_points(lane, points);
            let [k_0, k_1] = [points[0].k[0], points[1].k[0]];
            points[0].is_tight =
                points[1].exists && points[0].coupling(&points[1], on.rows).powi(2) > 0.5 * k_0 * k_1;
        }
        *listed as usize
    }
}

/// Queues a body whose points are to be visited.
fn enqueue(bodies: &mut [Body], queue: &mut VecDeque<u32>, row: u32) {
    if !std::mem::replace(&mut bodies[row as usize].is_queued, true) {
        queue.push_back(row);
    }
}

/// Time (s) at which a point that approaches faster than `slowest` (m/s) closes its gap, if within the step.
fn arrival(point: &HitPoint, on: &PropagationInput<'_>, slowest: f32) -> Option<f32> {
    let [vn, _] = point.velocity(on.rows);
    if vn >= -slowest {
        return None;
    }
    let gap = point.gap(on.rows);
    (vn.mul_add(AHEAD * on.dt, gap) < 0.0).then(|| gap / -vn)
}

/// Whether a point approaches fast enough to bounce.
fn will_bounce(point: &HitPoint, on: &PropagationInput<'_>) -> bool {
    let speed = -point.velocity(on.rows)[0];
    speed > point.slow && on.restitution(point) * speed > BOUNCES * point.slow
}

/// Rebound velocity of an approaching point (m/s), and the time of its impact (s); see the [module](self).
fn rebounds(point: &HitPoint, on: &PropagationInput<'_>, is_first: bool) -> Option<[f32; 2]> {
    if !will_bounce(point, on) {
        return None;
    }
    let (v, s, a, e) = (point.velocity(on.rows)[0], point.gap(on.rows), point.falls, on.restitution(point));
    let (dt, h) = (on.dt, on.h);
    // Its gap slightly after the end of the step.
    if (v - a * 0.5 * (dt + h)).mul_add(AHEAD * dt, s) >= 0.0 {
        return None;
    }
    if on.timed {
        let w = v - 0.5 * a * h;
        let square = w.mul_add(w, 2.0 * a * s);
        let touch = 2.0 * s / (square.max(0.0).sqrt() - w);
        // A deeper point overlapped before, or is hit because another one was.
        let earliest = if is_first { -dt } else { 0.0 };
        let time = if square > 0.0 && touch > earliest { touch.min(dt) } else { 0.0 };
        if time != 0.0 {
            let (gap, then) = ((w - 0.5 * a * time).mul_add(time, s), w - a * time);
            let fall = 2.0 * a * gap;
            let left = e * e * then.mul_add(then, fall) - fall;
            return Some([left.max(0.0).sqrt() + a * time + 0.5 * a * h, time]);
        }
    }
    // In flight, E = v²/2 + a (s − v h/2) is kept: the rebound has e² E at s.
    let energy = e * e * (0.5 * v * v + a * (s - 0.5 * v * h));
    let half = 0.5 * a * h;
    Some([half + half.mul_add(half, 2.0 * (energy - a * s)).max(0.0).sqrt(), 0.0])
}
