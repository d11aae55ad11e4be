//! Loads handed down from body to body.
//!
//! A sweep spreads a change of loads by one contact, and a moment along a column of N bodies takes N⁴ sweeps. One
//! pass down the contact graph suffices: each body stands on its closed points with the bodies below it, whose loads
//! are chosen so that nothing accelerates it ([`supports`]); the changes of these loads act on the bodies below.
//! Bodies without acceleration are skipped, so a pile at rest costs one comparison per body.
//!
//! "Below" means nearer to the ground in the graph of contacts whose normals are within 60° of gravity. Bodies that
//! these do not connect with the ground, such as a row of boxes pressed against a wall, use the graph of all
//! contacts of such bodies.

use super::{OPEN, PER_CONTACT};
use crate::bodies::{Bodies, BodyKind};
use crate::constraints::numerics::supports::{self, Support};
use crate::constraints::records::graph::{Graph, UNSUPPORTED};
use crate::contacts::Contact;
use crate::lanes::BodyRow;
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
pub(in super::super) struct PropagateLoads {
    /// Contacts that hand loads down.
    upright: Below,
    /// Contacts of bodies that `upright` does not connect with the ground.
    hanging: Below,
    /// Bodies from the top downward.
    downwards: Vec<u32>,
    /// Supports of the current body.
    supports: Vec<Support>,
}

/// The graph of some contacts.
#[derive(Clone, Debug, Default)]
struct Below {
    graph: Graph,
    /// The contact of each edge. `[edges]`
    contacts: Vec<u32>,
}

impl Below {
    /// Builds the graph of the chosen contacts.
    fn build(
        &mut self,
        bodies: usize,
        contacts: &[Contact],
        is_chosen: impl Fn(&Contact) -> bool,
        is_dynamic: impl Fn(u32) -> bool,
    ) {
        self.contacts.clear();
        self.contacts.extend((0..).zip(contacts).filter(|(_, contact)| is_chosen(contact)).map(|(i, _)| i));
        let ends = |c: &u32| [contacts[*c as usize].body_a, contacts[*c as usize].body_b];
        self.graph.build(bodies, self.contacts.iter().map(ends), is_dynamic);
    }

    /// Contacts of a body, with the body on their other side.
    fn of(&self, body: u32) -> impl Iterator<Item = (u32, u32)> {
        self.graph.edges_of(body as usize).iter().map(move |&edge| {
            let [a, b] = self.graph.ends(edge as usize);
            (self.contacts[edge as usize], if a == body { b } else { a })
        })
    }
}

/// The data that [`PropagateLoads::run`] works on.
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

impl PropagateLoads {
    /// Whether the graphs are those of other contacts: normals have turned. A graph that lasted until contacts anywhere in the
    /// world come or go would make a pile depend on another.
    pub fn is_stale(&self, contacts: &[Contact], gravity: Vec2) -> bool {
        let up = up(gravity);
        let mut bearing = self.upright.contacts.iter().peekable();
        (0..).zip(contacts).any(|(i, contact)| bears(contact, up) != bearing.next_if_eq(&&i).is_some())
    }

    /// Builds the graphs of contacts between bodies without joints.
    pub fn build(&mut self, bodies: &Bodies, joined: &[bool], contacts: &[Contact], gravity: Vec2) {
        let up = up(gravity);
        let is_dynamic = |body: u32| {
            bodies.kind[body as usize] == BodyKind::Dynamic && joined.get(body as usize) != Some(&true)
        };
        let Self { upright, hanging, downwards, .. } = self;
        upright.build(bodies.len(), contacts, |contact| bears(contact, up), is_dynamic);
        let levels = upright.graph.levels();
        let hangs = |body: u32| is_dynamic(body) && levels[body as usize] == UNSUPPORTED;
        let of_hanging = |contact: &Contact| hangs(contact.body_a) || hangs(contact.body_b);
        hanging.build(bodies.len(), contacts, of_hanging, hangs);
        downwards.clear();
        downwards.extend([hanging, upright].iter().flat_map(|below| below.graph.upwards().iter().rev()));
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
        let below = self.below(body);
        let level = below.graph.levels()[body as usize];
        let mut normal: Option<Vec2> = None;
        for (contact, other) in below.of(body) {
            let Contact { manifold, body_b, .. } = &contacts[contact as usize];
            let (of_other, n) = (below.graph.levels()[other as usize], manifold.normal);
            let n = if *body_b == body { n } else { -n };
            if of_other == level || of_other < level && normal.get_or_insert(n).dot(n) < ALIKE {
                return true;
            }
        }
        false
    }

    /// The graph in which a body stands on those below it.
    fn below(&self, body: u32) -> &Below {
        let hangs = self.upright.graph.levels()[body as usize] == UNSUPPORTED;
        if hangs { &self.hanging } else { &self.upright }
    }

    /// Lists the closed points of `body` with the bodies below it, and their loads.
    fn find_supports(&mut self, on: &HandDownInput<'_>, body: u32) {
        let mut supports = std::mem::take(&mut self.supports);
        supports.clear();
        let below = self.below(body);
        let levels = below.graph.levels();
        let is_below = |other: u32| levels[other as usize] < levels[body as usize];
        for (index, _) in below.of(body).filter(|(_, other)| is_below(*other)) {
            let contact = &on.contacts[index as usize];
            let (normal, is_b) = (contact.manifold.normal.as_dvec2(), contact.body_b == body);
            let loads = &on.kept[PER_CONTACT * index as usize..][..4];
            for (point, p) in contact.manifold.points().iter().enumerate() {
                if loads[2 * point] != OPEN {
                    supports.push(Support {
                        contact: index,
                        point,
                        normal: if is_b { normal } else { -normal },
                        arm: if is_b { p.anchor_b } else { p.anchor_a }.as_dvec2(),
                        friction: f64::from(contact.friction),
                        load: [loads[2 * point], loads[2 * point + 1]].map(f64::from),
                    });
                }
            }
        }
        self.supports = supports;
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
}

/// Unit vector against gravity; y without gravity.
fn up(gravity: Vec2) -> Vec2 {
    (-gravity).try_normalize().unwrap_or(Vec2::Y)
}

/// Whether a contact hands loads down.
fn bears(contact: &Contact, up: Vec2) -> bool {
    contact.manifold.normal.dot(up).abs() >= BEARING
}
