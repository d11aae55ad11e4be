//! What begins to bear: loads that go down from body to body.
//!
//! A body that nothing has borne before, and that is closed now, is new. From the top of the contact graph downwards each new body stands, with
//! what it bears itself, on its closed points with the level below ([`supports`]); these begin with their loads and, as far as they
//! have none, with the impulses of a substep. What stands on a body that others bear already adds to the loads below that one. Weight goes
//! down along gravity, no more and no less. What leans on each other is found by the sweeps ([`super::loads`]).

use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::constraints::numerics::supports::{self, Support};
use crate::engine::constraints::records::graph::Graph;
use crate::engine::constraints::step::Scene;
use crate::engine::contacts::{Contact, ManifoldPoint};
use crate::engine::lanes::held;
use crate::engine::params::LINEAR_SLOP;
use glam::{DVec2, Vec2};

/// Least cosine between gravity and the normals of contacts that hand it down.
const BEARING: f32 = 0.5;

/// Hands loads down; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct HandDown {
    graph: Graph,
    /// Contacts that hand down, the edges of `graph`.
    bearing: Vec<u32>,
    /// What each body bears: weight (N), and its torque about the centre of mass (N·m).
    borne: Vec<[f64; 2]>,
    /// What of that is new to a body that is not.
    added: Vec<[f64; 2]>,
    /// Whether a contact of the body has borne a load.
    is_loaded: Vec<bool>,
    /// Of one body.
    supports: Vec<Support>,
    /// A body may be new in the coming step.
    is_pending: bool,
}

/// Gravity as loads have it.
#[derive(Clone, Copy)]
struct Down {
    /// m/s²
    gravity: DVec2,
    /// Unit vector against it.
    up: DVec2,
    /// Speed (m/s) of what rests: what gravity makes in a step.
    still: f32,
    /// Substep (s).
    h: f32,
}

impl HandDown {
    /// Gives new bodies their loads. Those from index `stepped` on have not taken a step; whether there are any new ones.
    pub fn begin(&mut self, scene: &mut Scene<'_>, stepped: usize) -> bool {
        let Some(up) = (-scene.gravity).try_normalize() else { return false };
        if !scene.contacts_changed && !self.is_pending {
            return false;
        }
        let gravity = scene.gravity.as_dvec2();
        let still = scene.gravity.length() * scene.dt;
        let down = Down { gravity, up: up.as_dvec2(), still, h: scene.h() };
        self.find_loaded(scene);
        let (bodies, contacts) = (scene.bodies, &*scene.contacts);
        let is_new = |body: u32, is_loaded: &[bool]| {
            bodies.kind[body as usize] == BodyKind::Dynamic && !is_loaded[body as usize]
        };
        let mut any = false;
        self.is_pending = false;
        for contact in contacts {
            if [contact.body_a, contact.body_b].iter().any(|&body| is_new(body, &self.is_loaded)) {
                self.is_pending = true;
                any |= contact.manifold.points().iter().any(|p| rests(bodies, contact, p, still));
            }
        }
        if any {
            self.build(bodies, contacts, up, still);
            self.hand_down(scene, down, stepped);
        }
        any
    }

    fn find_loaded(&mut self, scene: &mut Scene<'_>) {
        self.is_loaded.clear();
        self.is_loaded.resize(scene.bodies.len(), false);
        for (i, contact) in scene.contacts.iter().enumerate() {
            let loads = &scene.kept.contact(i)[..4];
            let has_impulse = contact.manifold.points().iter().any(|p| p.normal_impulse > 0.0);
            if has_impulse || loads[0] > 0.0 || loads[2] > 0.0 {
                self.is_loaded[contact.body_a as usize] = true;
                self.is_loaded[contact.body_b as usize] = true;
            }
        }
    }

    /// Builds the graph of the contacts that hand down.
    fn build(&mut self, bodies: &Bodies, contacts: &[Contact], up: Vec2, still: f32) {
        let bears = |contact: &Contact| {
            contact.manifold.normal.dot(up).abs() >= BEARING
                && contact.manifold.points().iter().any(|p| rests(bodies, contact, p, still))
        };
        self.bearing.clear();
        self.bearing.extend((0..contacts.len() as u32).filter(|&c| bears(&contacts[c as usize])));
        let ends = self.bearing.iter().map(|&c| [contacts[c as usize].body_a, contacts[c as usize].body_b]);
        self.graph.build(bodies.len(), ends, |body| bodies.kind[body as usize] == BodyKind::Dynamic);
    }

    fn hand_down(&mut self, scene: &mut Scene<'_>, down: Down, stepped: usize) {
        let Scene { bodies, contacts, kept, .. } = scene;
        for list in [&mut self.borne, &mut self.added] {
            list.clear();
            list.resize(bodies.len(), [0.0; 2]);
        }
        for &body in self.graph.upwards().iter().rev() {
            let b = body as usize;
            let is_new = !self.is_loaded[b];
            let [borne, turns] = if is_new { self.borne[b] } else { self.added[b] };
            if !is_new && borne == 0.0 {
                continue;
            }
            self.supports.clear();
            for &edge in self.graph.edges_of(b) {
                let [a, c] = self.graph.ends(edge as usize);
                let other = if a == body { c } else { a };
                if self.graph.levels()[other as usize] < self.graph.levels()[b] {
                    let contact = self.bearing[edge as usize];
                    self.supports.extend(supports_of(bodies, contacts, contact, body, down.still));
                }
            }
            let mut force = -borne * down.up;
            let mut torque = turns;
            if is_new {
                force += weight(bodies, b, down.gravity);
                torque += f64::from(bodies.torque[b]);
            }
            let gyration = (f64::from(bodies.inv_mass[b]) / f64::from(bodies.inv_inertia[b])).sqrt();
            supports::load(&mut self.supports, force, torque, gyration);
            let shares = shares(bodies, contacts, body, force, down.up, &self.supports);
            for (other, carried) in shares {
                for list in [&mut self.borne, &mut self.added] {
                    list[other][0] += carried[0];
                    list[other][1] += carried[1];
                }
            }
            for support in &self.supports {
                let (index, p) = (support.contact as usize, support.point);
                let loads = &mut kept.contact(index)[2 * p..2 * p + 2];
                let point = &mut contacts[index].manifold.points[p];
                // What has fallen on others is borne by what it has done to them.
                let is_set = is_new || b >= stepped;
                for (axis, impulse) in
                    [&mut point.normal_impulse, &mut point.tangent_impulse].into_iter().enumerate()
                {
                    let load = support.load[axis] as f32;
                    loads[axis] = if is_new { load } else { loads[axis].max(0.0) + load };
                    if is_set {
                        *impulse = if is_new { load * down.h } else { *impulse + load * down.h };
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        self.graph.held_bytes()
            + held(&self.bearing)
            + held(&self.borne)
            + held(&self.added)
            + held(&self.is_loaded)
            + held(&self.supports)
    }
}

/// The points of the contact `index` on which `body` rests.
fn supports_of<'c>(
    bodies: &'c Bodies,
    contacts: &'c [Contact],
    index: u32,
    body: u32,
    still: f32,
) -> impl Iterator<Item = Support> + 'c {
    let contact = &contacts[index as usize];
    let is_b = contact.body_b == body;
    let normal = contact.manifold.normal.as_dvec2();
    let points = contact.manifold.points().iter().enumerate();
    points.filter(move |(_, p)| rests(bodies, contact, p, still)).map(move |(point, p)| Support {
        contact: index,
        point,
        normal: if is_b { normal } else { -normal },
        arm: if is_b { p.anchor_b } else { p.anchor_a }.as_dvec2(),
        friction: f64::from(contact.friction),
        load: [0.0; 2],
    })
}

/// What each body below `body` bears of the `force` (N) on it: weight (N) and torque (N·m).
fn shares<'c>(
    bodies: &'c Bodies,
    contacts: &'c [Contact],
    body: u32,
    force: DVec2,
    up: DVec2,
    supports: &'c [Support],
) -> impl Iterator<Item = (usize, [f64; 2])> + 'c {
    let carried = move |support: &Support| support.force().dot(up).max(0.0);
    let part = (-force.dot(up)).max(0.0) / supports.iter().map(carried).sum::<f64>();
    supports.iter().filter(move |_| part.is_finite()).map(move |support| {
        let contact = &contacts[support.contact as usize];
        let other = if contact.body_a == body { contact.body_b } else { contact.body_a } as usize;
        let arm = center(bodies, body as usize) + support.arm - center(bodies, other);
        let carried = part * carried(support);
        (other, [carried, -carried * arm.perp_dot(up)])
    })
}

/// A point touches, and moves by no more than `still` (m/s).
fn rests(bodies: &Bodies, contact: &Contact, point: &ManifoldPoint, still: f32) -> bool {
    point.separation.abs() <= LINEAR_SLOP && speed(bodies, contact, point) <= still
}

/// Weight of a body, and what users push it with (N).
fn weight(bodies: &Bodies, body: usize, gravity: DVec2) -> DVec2 {
    let pushed = DVec2::new(f64::from(bodies.force_x[body]), f64::from(bodies.force_y[body]));
    f64::from(bodies.gravity_scale[body]) / f64::from(bodies.inv_mass[body]) * gravity + pushed
}

/// Centre of mass of a body (m).
fn center(bodies: &Bodies, body: usize) -> DVec2 {
    DVec2::new(f64::from(bodies.position_x[body]), f64::from(bodies.position_y[body]))
}

/// Speed of body b at a point relative to body a (m/s).
fn speed(bodies: &Bodies, contact: &Contact, point: &ManifoldPoint) -> f32 {
    let side = |body: u32, anchor: Vec2| {
        bodies.velocity(body as usize) + bodies.angular_velocity[body as usize] * anchor.perp()
    };
    (side(contact.body_b, point.anchor_b) - side(contact.body_a, point.anchor_a)).length()
}
