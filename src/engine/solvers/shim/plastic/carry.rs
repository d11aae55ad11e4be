//! Momentum of an impact goes down a pile at once, and what is stopped so rests.
//!
//! # Momentum
//!
//! Where visits have not stopped an impact, as when something falls on what is hundreds of times lighter, momentum goes
//! to the ground as loads do (`pile.rs`), along contacts that are closed. All of it acts when the impact arrives,
//! at the time t of the bodies that are hit first: a body is moved back by t (v⁺ − v⁻), however often visits have
//! pushed it to and fro. They go on from there, down to speeds that are rest.
//!
//! # Rest
//!
//! A pile that is at rest after an impact has a new load, for which its springs are not shortened: one of 300 times the mass
//! sinks into ten boxes by 14 cm, and swings for seconds. So the same way down is taken by what forces add in a substep to the
//! momentum of bodies that nothing has borne before. If that stops them, contacts of two points begin the step with these
//! impulses beside their own, and with the preload of both ([`crate::engine::solvers::shim::preload`]). Contacts of one point follow motion:
//! they roll under preload that is raised.

use super::pile::{Bearing, Carried};
use super::point::{Body, On, Place, Point, STILL};
use super::{NONE, PlasticImpacts};
use crate::engine::constraints::numerics::supports::Support;
use crate::engine::lanes::BodyRow;
use crate::engine::params::LINEAR_SLOP;
use glam::DVec2;

/// Least −n·d of a normal that bears against momentum in the direction d.
const BEARS: f64 = 0.5;

/// Greatest gap of a contact that hands momentum on at once (m).
const CLOSED: f32 = 0.02 * LINEAR_SLOP;

/// Most energy that loads of a pile may leave of what forces make in a substep, if it rests on them (1).
const AT_REST: f64 = 1e-3;

impl Point {
    /// What bears body b, or body a, against `direction`: the row of the other one, its arm (m), and the support.
    fn supports(&self, is_b: bool, direction: DVec2, has_arrived: bool) -> Option<(u32, DVec2, Support)> {
        let [nx, ny] = self.normal.map(f64::from);
        let n = DVec2::new(nx, ny);
        let normal = if is_b { n } else { -n };
        let touches = self.separation <= CLOSED || has_arrived && self.impulse[0] > 0.0;
        if self.mass <= 0.0 || !touches || normal.dot(direction) > -BEARS {
            return None;
        }
        // Nothing turns a smooth disc. With t = (n_y, −n_x), r = (r × n) t − (r × t) n.
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
}

impl PlasticImpacts {
    /// Sends the momentum of pushed bodies down to what does not move, if that takes energy from them.
    pub(crate) fn carry(&mut self, on: &mut On<'_>) -> bool {
        let found = self.find_pile(on, |row, _| on.rows[row].velocity);
        if !found || self.pile.stop().is_none_or(|left| left >= 1.0) {
            return false;
        }
        // What nothing that arrives has hit from above is pushed when the impact begins.
        let begun = self.bodies.iter().map(|body| body.begun).filter(|time| time.is_finite());
        let first = begun.fold(f32::INFINITY, f32::min);
        for (&row, carried) in self.pile.rows.iter().zip(&self.pile.bodies) {
            let time = if carried.time > STILL.time { carried.time } else { first };
            let body = &mut self.bodies[row as usize];
            (body.time, body.begun) = (time, time);
        }
        for i in 0..self.pile.bearings.len() {
            let Bearing { above, point: place, support, .. } = self.pile.bearings[i];
            let [n, t] = support.load.map(|load| load as f32);
            if [n, t] == [0.0; 2] {
                continue;
            }
            let time = self.bodies[self.pile.rows[above as usize] as usize].time;
            let point = &mut self.points[place as usize];
            point.time = time;
            point.meet(on.rows);
            point.impulse = [point.impulse[0] + n, point.impulse[1] + t];
            self.push(on, place as usize, [n, t], [time; 2]);
        }
        self.displace(on.rows);
        true
    }

    /// Puts bodies of the pile where they would be if all that has pushed them had done so when the impact began.
    pub(crate) fn displace(&self, rows: &mut [BodyRow]) {
        for &row in &self.pile.rows {
            let (row, body) = (&mut rows[row as usize], &self.bodies[row as usize]);
            for k in 0..3 {
                row.delta[k] = -body.begun * (row.velocity[k] - body.flown[k]);
            }
        }
    }

    /// Lists what was pushed, and what bears it against the sum of its momentum at these velocities of rows; false if it
    /// has none, or if something bears that moves although nothing can push it.
    fn find_pile(&mut self, on: &On<'_>, velocity: impl Fn(usize, &Body) -> [f32; 4]) -> bool {
        self.pile.clear(on.rows.len());
        let mut momentum = DVec2::ZERO;
        for (row, body) in (0..).zip(&self.bodies).filter(|(_, body)| body.time > STILL.time) {
            self.pile.place(row);
            let [x, y, ..] = velocity(row as usize, body).map(f64::from);
            momentum += DVec2::new(x, y) / f64::from(on.rows[row as usize].velocity[3]);
        }
        let Some(direction) = momentum.try_normalize() else { return false };
        let mut above = 0;
        while let Some(&row) = self.pile.rows.get(above as usize) {
            let BodyRow { velocity: [.., inv_mass], delta: [.., inv_inertia] } = on.rows[row as usize];
            let body = &self.bodies[row as usize];
            let [x, y, turn, _] = velocity(row as usize, body).map(f64::from);
            let (inverse, time, mut end) = ([inv_mass, inv_inertia].map(f64::from), body.begun, body.first);
            self.pile.bodies.push(Carried { velocity: [x, y, turn], inverse, time });
            while end != NONE {
                // Ends of a are even.
                let (lane, is_b) = (end / 2, end % 2 == 1);
                end = self.next[end as usize];
                let first = self.list(on, lane);
                for place in first..first + 2 {
                    let point = &self.points[place];
                    let Some((other, arm_below, support)) =
                        point.supports(is_b, direction, place < self.arrived)
                    else {
                        continue;
                    };
                    let moves = !is_b || point.pushes_a;
                    if !moves && on.rows[other as usize].velocity[..3] != [0.0; 3] {
                        return false;
                    }
                    let below = moves.then(|| self.pile.place(other));
                    self.pile.bearings.push(Bearing {
                        above,
                        below,
                        point: place as u32,
                        arm_below,
                        support,
                    });
                }
            }
            above += 1;
        }
        true
    }
}
