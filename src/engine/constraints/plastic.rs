//! Plastic impacts: what comes in without restitution stays, before the step is solved.
//!
//! # The law
//!
//! That of [`super::impact`] with e = 0, at all points together: each has v_n⁺ ≥ 0, an impulse only where v_n⁺ = 0, and
//! Coulomb's friction on the impulses of the whole impact. Gauss–Seidel on accumulated impulses, from point to point
//! as an impact spreads: where a body is pushed, its other points are looked at next, until nothing comes in by more
//! than [`IMPACT_TOLERANCE`] of the fastest arrival. So a row of boxes goes on together, and what
//! nothing hits costs nothing.
//!
//! # When in the step
//!
//! A point with the gap s that comes in at v is hit after t = s/|v|. Until then bodies fly as they did: an impulse
//! at t that makes them faster by Δv moves them by (dt − t) Δv until the end of the step. They have Δv from the beginning of
//! the step, and are put back by t Δv there. Such a point then touches all through the step. One
//! that is pushed again by a body that was hit at t′ is so at the later of both times.
//!
//! Bodies that are put back may seem to overlap others from which they move away. What they are in truth not, is not
//! pushed out: the gap in the record grows by as much.

use super::arrivals::AHEAD;
use super::batches::Batches;
use super::features::{Features, Layout};
use super::impact::rough_impulses;
use super::sweep::turn;
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, Lanes, held};
use crate::engine::params::{IMPACT_TOLERANCE, IMPACT_VISITS};
use std::collections::VecDeque;

/// No lane, no point.
const NONE: u32 = u32::MAX;

/// Spreads impacts; keeps its memory from step to step.
#[derive(Debug, Default)]
pub struct PlasticImpacts {
    /// Lanes in which something arrives, of the coloured batches and of the serial ones.
    pub(super) found: [Vec<u32>; 2],
    /// First end of each body; see `next`. `[bodies]`
    first: Vec<u32>,
    /// The next end of the same body. Lane l, counted through both sets of batches, has the ends 2 l and 2 l + 1. `[2 lanes]`
    next: Vec<u32>,
    /// Places of the two points of a lane in `points`, or none. `[2 lanes]`
    listed: Vec<u32>,
    points: Vec<Point>,
    /// Points that have to be looked at.
    queue: VecDeque<u32>,
    /// Bodies that were pushed.
    pushed: Vec<u32>,
    /// `[bodies]`
    is_pushed: Vec<bool>,
}

/// A contact point that may be hit.
#[derive(Clone, Copy, Debug)]
struct Point {
    index: u32,
    contact: u32,
    /// Rows of a and b.
    rows: [u32; 2],
    /// Impulses change a.
    pushes_a: bool,
    normal: [f32; 2],
    /// r × n and r × t of a and b (m).
    arms: [[f32; 2]; 2],
    /// k_nn, k_tt, k_nt (1/kg).
    k: [f32; 3],
    /// 1/k_nn (kg).
    mass: f32,
    friction: f32,
    /// At the beginning of the step (m).
    separation: f32,
    /// Impulses so far, along n and t (N·s).
    impulse: [f32; 2],
    /// When it is hit (s).
    time: f32,
    is_queued: bool,
}

/// What [`PlasticImpacts::spread`] works on.
pub(super) struct On<'a> {
    pub rows: &'a mut [BodyRow],
    /// Coloured batches, serial ones.
    pub batches: [&'a mut Batches; 2],
    pub contacts: &'a mut [Contact],
    pub features: &'a Features,
    /// Step (s).
    pub dt: f32,
    pub record_impulses: bool,
}

/// Where a lane keeps its record.
struct Place {
    layout: Layout,
    part: usize,
    width: usize,
    /// In its batches.
    lane: usize,
    /// Of the first quantity, in floats.
    first: usize,
    pushes_a: bool,
}

impl On<'_> {
    fn lanes(&self) -> usize {
        self.batches[0].lanes() + self.batches[1].lanes()
    }

    fn place(&self, lane: u32) -> Place {
        let (lane, lanes) = (lane as usize, self.batches[0].lanes());
        let (part, lane) = if lane < lanes { (0, lane) } else { (1, lane - lanes) };
        let (batches, width) = (&self.batches[part], self.batches[part].width());
        // Segments follow each other in the order of their lanes, or of their stages.
        let holds = |s: &&super::segment::Segment| {
            (s.first_lane..s.first_lane + s.batches * width).contains(&lane)
        };
        let segment = batches.segments().iter().find(holds).expect("a segment for each lane");
        let of = lane - segment.first_lane;
        let vector = segment.first_vector + of / width * segment.stride;
        let layout = Layout::for_features(self.features, segment.opposite);
        Place { layout, part, width, lane, first: vector * width + of % width, pushes_a: segment.pushes_a() }
    }

    fn floats(&self, part: usize) -> &[f32] {
        bytemuck::cast_slice(self.batches[part].records())
    }

    /// The points of a lane.
    fn points(&self, lane: u32) -> [Option<Point>; 2] {
        let Place { layout, part, width, lane: of, first, pushes_a } = self.place(lane);
        let (batches, floats) = (&self.batches[part], self.floats(part));
        let contact = batches.contact()[of];
        if self.contacts[contact as usize].restitution > 0.0 {
            return [None; 2];
        }
        let rows = [batches.row_a()[of], batches.row_b()[of]];
        let at = |quantity: usize| floats[first + quantity * width];
        std::array::from_fn(|p| {
            let mass = if p < layout.points { at(layout.at(p, layout.normal_mass)) } else { 0.0 };
            if mass <= 0.0 {
                return None;
            }
            let arm = |arm: usize, has: bool| {
                if has { [at(layout.at(p, arm)), at(layout.at(p, arm) + 1)] } else { [0.0; 2] }
            };
            let arms = [arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0])];
            let inertia = |body: usize| self.rows[rows[body] as usize].delta[3] * arms[body][0] * arms[body][1];
            let k_nt = inertia(1) + if pushes_a { inertia(0) } else { 0.0 };
            let k_tt = if layout.has_friction { 1.0 / at(layout.at(p, layout.tangent_mass)) } else { 1.0 };
            Some(Point {
                index: p as u32,
                contact,
                rows,
                pushes_a,
                normal: [at(0), at(1)],
                arms,
                k: [1.0 / mass, k_tt, k_nt],
                mass,
                friction: if layout.has_friction { at(layout.friction) } else { 0.0 },
                separation: at(layout.at(p, layout.separation)),
                impulse: [0.0; 2],
                time: 0.0,
                is_queued: false,
            })
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

    /// Whether it comes in faster than `slowest` (m/s), and within the step.
    fn comes_in(&self, rows: &[BodyRow], slowest: f32, dt: f32) -> bool {
        let [v, _] = self.velocity(rows);
        v < -slowest && v.mul_add(AHEAD * dt, self.gap(rows)) < 0.0
    }

    /// Impulses `delta` (N·s) on both bodies, at its time.
    fn push(&self, rows: &mut [BodyRow], [n, t]: [f32; 2]) {
        let [nx, ny] = self.normal;
        let (x, y) = (nx.mul_add(n, ny * t), ny.mul_add(n, -(nx * t)));
        for (body, sign) in [(1, 1.0), (0, -1.0)].into_iter().filter(|&(body, _)| body == 1 || self.pushes_a) {
            let (row, arm) = (&mut rows[self.rows[body] as usize], self.arms[body]);
            let (mass, inertia) = (sign * row.velocity[3], sign * row.delta[3]);
            let gained = [mass * x, mass * y, inertia * arm[0].mul_add(n, arm[1] * t)];
            for (k, gained) in gained.into_iter().enumerate() {
                row.velocity[k] += gained;
                row.delta[k] = self.time.neg_mul_add(gained, row.delta[k]);
            }
        }
    }
}

impl PlasticImpacts {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = [&self.found[0], &self.found[1], &self.first, &self.next, &self.listed, &self.pushed];
        let queue = self.queue.capacity() * size_of::<u32>();
        lists.map(held).iter().sum::<usize>() + held(&self.points) + held(&self.is_pushed) + queue
    }

    /// Lets impacts spread from the lanes in `found`; see the [module](self). Returns how many points were visited.
    pub(super) fn spread(&mut self, on: &mut On<'_>) -> usize {
        self.link(on);
        let coloured = on.batches[0].lanes() as u32;
        for part in 0..2 {
            for i in 0..self.found[part].len() {
                self.list(on, self.found[part][i] + coloured * part as u32, 0.0);
            }
        }
        let fastest = self.points.iter().map(|p| -p.velocity(on.rows)[0]).fold(0.0, f32::max);
        let slowest = IMPACT_TOLERANCE * fastest;
        let mut visits = 0;
        while let Some(i) = self.queue.pop_front() {
            visits += 1;
            if visits > IMPACT_VISITS {
                break;
            }
            let point = &mut self.points[i as usize];
            point.is_queued = false;
            let [vn, vt] = point.velocity(on.rows);
            if point.impulse[0] == 0.0 {
                if !point.comes_in(on.rows, slowest, on.dt) {
                    continue;
                }
                point.time = point.time.max(point.gap(on.rows) / -vn);
            }
            let old = point.impulse;
            let new = rough_impulses(point.k, point.mass, point.friction, old, [-vn, -vt]);
            let delta = [new[0] - old[0], new[1] - old[1]];
            point.impulse = new;
            let point = *point;
            point.push(on.rows, delta);
            if point.k[0] * (delta[0].abs() + delta[1].abs()) <= slowest {
                continue;
            }
            for (body, row) in point.rows.into_iter().enumerate().filter(|&(body, _)| body == 1 || point.pushes_a)
            {
                self.look_around(on, row, i, point.time, slowest);
                let _ = body;
            }
        }
        self.queue.clear();
        self.part(on);
        if on.record_impulses {
            for point in &self.points {
                let sum = &mut on.contacts[point.contact as usize].step_impulse[point.index as usize];
                *sum = [sum[0] + point.impulse[0], sum[1] + point.impulse[1]];
            }
        }
        visits
    }

    /// Links the ends of each body.
    fn link(&mut self, on: &On<'_>) {
        let bodies = on.rows.len();
        self.first.clear();
        self.first.resize(bodies, NONE);
        self.is_pushed.clear();
        self.is_pushed.resize(bodies, false);
        let lanes = on.lanes();
        self.next.clear();
        self.next.resize(2 * lanes, NONE);
        self.listed.clear();
        self.listed.resize(2 * lanes, NONE);
        self.points.clear();
        self.pushed.clear();
        let mut end = 0;
        for batches in &on.batches {
            for (&a, &b) in batches.row_a().iter().zip(batches.row_b()) {
                for body in [a, b] {
                    // The last row is that of empty lanes.
                    if (body as usize) < bodies - 1 {
                        self.next[end] = std::mem::replace(&mut self.first[body as usize], end as u32);
                    }
                    end += 1;
                }
            }
        }
    }

    /// Adds the points of a lane to those that are looked at; none is hit before `time` (s).
    fn list(&mut self, on: &On<'_>, lane: u32, time: f32) {
        for (p, point) in on.points(lane).into_iter().enumerate() {
            if let Some(point) = point {
                self.listed[2 * lane as usize + p] = self.points.len() as u32;
                self.queue.push_back(self.points.len() as u32);
                self.points.push(Point { time, is_queued: true, ..point });
            }
        }
    }

    /// Looks at the points of a body that point `cause` has pushed at `time`.
    fn look_around(&mut self, on: &On<'_>, row: u32, cause: u32, time: f32, slowest: f32) {
        if !std::mem::replace(&mut self.is_pushed[row as usize], true) {
            self.pushed.push(row);
        }
        let mut end = self.first[row as usize];
        while end != NONE {
            let lane = end / 2;
            end = self.next[end as usize];
            let places = [self.listed[2 * lane as usize], self.listed[2 * lane as usize + 1]];
            if places == [NONE; 2] {
                let comes_in = |point: &Point| point.comes_in(on.rows, slowest, on.dt);
                if on.points(lane).iter().flatten().any(comes_in) {
                    self.list(on, lane, time);
                }
                continue;
            }
            for place in places.into_iter().filter(|&place| place != NONE && place != cause) {
                let point = &mut self.points[place as usize];
                point.time = point.time.max(time);
                if !std::mem::replace(&mut point.is_queued, true) {
                    self.queue.push_back(place);
                }
            }
        }
    }

    /// Widens the gaps that bodies seem to have lost as they were put back.
    fn part(&mut self, on: &mut On<'_>) {
        for i in 0..self.pushed.len() {
            let mut end = self.first[self.pushed[i] as usize];
            while end != NONE {
                let lane = end / 2;
                end = self.next[end as usize];
                let Place { layout, part, width, first, .. } = on.place(lane);
                for (p, point) in on.points(lane).into_iter().enumerate() {
                    let Some(point) = point else { continue };
                    let lost = point.separation.min(0.0) - point.gap(on.rows);
                    if lost > 0.0 {
                        let at = first + layout.at(p, layout.separation) * width;
                        bytemuck::cast_slice_mut::<_, f32>(on.batches[part].records_mut())[at] += lost;
                    }
                }
            }
        }
    }
}
