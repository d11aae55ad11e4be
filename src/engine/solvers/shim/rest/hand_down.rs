//! Loads handed down from body to body.
//!
//! A sweep spreads a change of loads by one contact, and a moment along a column of N bodies takes N⁴ sweeps. One
//! pass down the contact graph suffices: each body stands on its closed points with the bodies below it, whose loads
//! are chosen so that nothing accelerates it ([`supports`]); the changes of these loads act on the bodies below.
//! Bodies without acceleration are skipped, so a pile at rest costs one comparison per body.
//!
//! "Below" means nearer to the ground in the graph of contacts whose normals are within 60° of gravity. Bodies that
//! these do not connect with the ground, such as a row of boxes pressed against a wall, use the graph of all
//! contacts.

use super::{OPEN, PER_CONTACT};
use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::constraints::numerics::supports::{self, Support};
use crate::engine::constraints::records::graph::{Graph, UNSUPPORTED};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, held};
use glam::{DVec2, Vec2};

/// Smallest cosine between gravity and the normals of contacts that hand loads down.
const BEARING: f32 = 0.5;

/// Acceleration that is ignored, as a fraction of that of free flight (1): the lean of a column grows unless
/// loads fit its position.
const STILL: f32 = 1e-5;

/// Smallest cosine between the normals of a body that does not lean (1).
const ALIKE: f32 = 0.99;

/// Hands loads down; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct HandDown {
    upright: Graph,
    /// Contacts of `upright`.
    bearing: Vec<u32>,
    /// Graph of all contacts; empty if `upright` supports all bodies with contacts.
    all: Graph,
    /// Bodies from the top downward.
    downwards: Vec<u32>,
    /// Supports of the current body.
    supports: Vec<Support>,
}

/// The data that [`HandDown::run`] works on.
pub(in super::super) struct HandDownInput<'a> {
    /// All contacts.
    pub contacts: &'a [Contact],
    /// N and T of both points of each contact (N), N negative if it is open. `[contacts × PER_CONTACT]`
    pub kept: &'a mut [f32],
    /// Changes of velocity per substep under the loads. `[rows]`
    pub fields: &'a mut [BodyRow],
    /// Changes of velocity per substep in free flight. `[rows]`
    pub increments: &'a [[f32; 4]],
    /// Substep (s).
    pub h: f32,
}

impl HandDown {
    /// Whether the graphs are those of other contacts: normals have turned. A graph that lasted until contacts anywhere in the
    /// world come or go would make a pile depend on another.
    pub fn is_stale(&self, contacts: &[Contact], gravity: Vec2) -> bool {
        let up = up(gravity);
        let mut bearing = self.bearing.iter().peekable();
        (0..).zip(contacts).any(|(i, contact)| bears(contact, up) != bearing.next_if_eq(&&i).is_some())
    }

    /// Builds the graphs of contacts between bodies without joints.
    pub fn build(&mut self, bodies: &Bodies, joined: &[bool], contacts: &[Contact], gravity: Vec2) {
        let up = up(gravity);
        let is_dynamic = |body: u32| {
            bodies.kind[body as usize] == BodyKind::Dynamic && joined.get(body as usize) != Some(&true)
        };
        let ends = |c: &u32| [contacts[*c as usize].body_a, contacts[*c as usize].body_b];
        self.bearing.clear();
        self.bearing.extend((0..).zip(contacts).filter(|(_, contact)| bears(contact, up)).map(|(i, _)| i));
        self.upright.build(bodies.len(), self.bearing.iter().map(ends), is_dynamic);
        let hangs = |c: &Contact| {
            [c.body_a, c.body_b]
                .into_iter()
                .any(|b| is_dynamic(b) && self.upright.levels()[b as usize] == UNSUPPORTED)
        };
        self.downwards.clear();
        if contacts.iter().any(hangs) {
            let ends = contacts.iter().map(|c| [c.body_a, c.body_b]);
            self.all.build(bodies.len(), ends, is_dynamic);
            let hangs = |body: &&u32| self.upright.levels()[**body as usize] == UNSUPPORTED;
            self.downwards.extend(self.all.upwards().iter().rev().filter(hangs));
        } else {
            self.all = Graph::default();
        }
        self.downwards.extend(self.upright.upwards().iter().rev());
    }

    /// Supports accelerating bodies by loads on the bodies below, from top to bottom.
    pub fn run(&mut self, on: &mut HandDownInput<'_>) {
        for i in 0..self.downwards.len() {
            let body = self.downwards[i];
            let [x, y, turn, inv_mass] = on.fields[body as usize].velocity;
            let inv_inertia = on.fields[body as usize].delta[3];
            let [free_x, free_y, ..] = on.increments[body as usize];
            let turning = if inv_inertia > 0.0 { turn * turn * inv_mass / inv_inertia } else { 0.0 };
            let free = free_x.mul_add(free_x, free_y * free_y);
            let moves = x.mul_add(x, y.mul_add(y, turning));
            if moves <= free * (STILL * STILL) {
                continue;
            }
            // A body without support accelerates as in free flight.
            let leans = self.leans(on.contacts, body);
            if leans && moves <= 0.25 * free {
                continue;
            }
            self.find_supports(on, body);
            let is_new = self.supports.iter().all(|support| support.load == [0.0; 2]);
            if !self.supports.is_empty() && (is_new || !leans) {
                self.stand(on, body);
            }
        }
    }

    /// Whether a body leans, on a body of its own level or on several in different directions: only sweeps find its thrust.
    fn leans(&self, contacts: &[Contact], body: u32) -> bool {
        let hangs = self.upright.levels()[body as usize] == UNSUPPORTED;
        let graph = if hangs { &self.all } else { &self.upright };
        let level = graph.levels()[body as usize];
        let mut below: Option<Vec2> = None;
        for &edge in graph.edges_of(body as usize) {
            let [a, b] = graph.ends(edge as usize);
            let contact = if hangs { edge } else { self.bearing[edge as usize] };
            let (other, n) = (if a == body { b } else { a }, contacts[contact as usize].manifold.normal);
            let (of_other, normal) = (graph.levels()[other as usize], if b == body { n } else { -n });
            if of_other == level {
                return true;
            }
            if of_other < level && below.get_or_insert(normal).dot(normal) < ALIKE {
                return true;
            }
        }
        false
    }

    /// Lists the closed points of `body` with the bodies below it, and their loads.
    fn find_supports(&mut self, on: &HandDownInput<'_>, body: u32) {
        self.supports.clear();
        let level = self.upright.levels()[body as usize];
        let hangs = level == UNSUPPORTED;
        let graph = if hangs { &self.all } else { &self.upright };
        for &edge in graph.edges_of(body as usize) {
            let [a, b] = graph.ends(edge as usize);
            let other = if a == body { b } else { a } as usize;
            let is_below = if hangs {
                self.upright.levels()[other] != UNSUPPORTED
                    || self.all.levels()[other] < self.all.levels()[body as usize]
            } else {
                self.upright.levels()[other] < level
            };
            if !is_below {
                continue;
            }
            let index = if hangs { edge } else { self.bearing[edge as usize] };
            let contact = &on.contacts[index as usize];
            let normal = contact.manifold.normal.as_dvec2();
            let loads = &on.kept[PER_CONTACT * index as usize..][..4];
            for (point, p) in contact.manifold.points().iter().enumerate() {
                if loads[2 * point] != OPEN {
                    self.supports.push(Support {
                        contact: index,
                        point,
                        normal: if b == body { normal } else { -normal },
                        arm: if b == body { p.anchor_b } else { p.anchor_a }.as_dvec2(),
                        friction: f64::from(contact.friction),
                        load: [loads[2 * point], loads[2 * point + 1]].map(f64::from),
                    });
                }
            }
        }
    }

    /// Finds the loads that support `body`.
    fn stand(&mut self, on: &mut HandDownInput<'_>, body: u32) {
        let BodyRow { velocity: [x, y, turn, inv_mass], delta: [.., inv_inertia] } = on.fields[body as usize];
        let h = f64::from(on.h);
        let [inv_mass, inv_inertia] = [inv_mass, inv_inertia].map(f64::from);
        let mut force = DVec2::new(f64::from(x), f64::from(y)) / (inv_mass * h);
        let mut torque = if inv_inertia > 0.0 { f64::from(turn) / (inv_inertia * h) } else { 0.0 };
        for support in &self.supports {
            force -= support.force();
            torque -= support.arm.perp_dot(support.force());
        }
        let gyration = if inv_inertia > 0.0 { (inv_mass / inv_inertia).sqrt() } else { 0.0 };
        supports::load(&mut self.supports, force, torque, gyration);
        for support in &self.supports {
            let loads = &mut on.kept[PER_CONTACT * support.contact as usize + 2 * support.point..][..2];
            let old = Support { load: [loads[0], loads[1]].map(f64::from), ..*support };
            let change = h * (support.force() - old.force());
            let new = support.load.map(|load| load as f32);
            loads.copy_from_slice(&new);
            let contact = &on.contacts[support.contact as usize];
            let point = &contact.manifold.points[support.point];
            for (row, arm) in [(contact.body_a, point.anchor_a), (contact.body_b, point.anchor_b)] {
                let change = if row == body { change } else { -change };
                let BodyRow { velocity, delta } = &mut on.fields[row as usize];
                velocity[0] += velocity[3] * change.x as f32;
                velocity[1] += velocity[3] * change.y as f32;
                velocity[2] += delta[3] * arm.as_dvec2().perp_dot(change) as f32;
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        self.upright.held_bytes()
            + self.all.held_bytes()
            + held(&self.bearing)
            + held(&self.downwards)
            + held(&self.supports)
    }
}

/// Unit vector against gravity; y without gravity.
fn up(gravity: Vec2) -> Vec2 {
    (-gravity).try_normalize().unwrap_or(Vec2::Y)
}

/// Whether a contact hands loads down.
fn bears(contact: &Contact, up: Vec2) -> bool {
    contact.manifold.normal.dot(up).abs() >= BEARING
}
