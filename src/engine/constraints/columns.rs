//! How stiff contacts have to be so that no column buckles on them.
//!
//! A column that leans by θ gains what the weight above gives way, and loses what its springs resist. Let joint j be
//! all contacts that carry one part of a pile: with points of effective mass m_p, springs of the angular
//! frequency ω and x the place of a point along the joint, it resists rotation by
//!
//! ```text
//! K_j = ω² Σ m_p (x_p − x̄)²
//! ```
//!
//! and were all others rigid, it would buckle under what it carries if K_j < g Σ m_i (z_i − z_j), the moment of the
//! weight above for one radian. With all joints soft Southwell's theorem bounds the critical load from below by the
//! harmonic sum of those of one soft joint each, so that the pile stands if
//!
//! ```text
//! ω² ≥ ω_c² = Σ_j g Σ_i m_i (z_i − z_j) / Σ_p m_p (x_p − x̄)²
//! ```
//!
//! along each path from the ground to a top. For N equal boxes that is N³/6 instead of Greenhill's N³/7.837
//! (`papers/shim.md`): on the safe side by 14 % of ω.
//!
//! Parts and joints come from the levels of the contact graph, the number of contacts between a body and the ground.
//! From the top downwards, the bodies of a level join the parts that they touch, and what joins a
//! part to the level below is its joint. A joint of one point is a hinge, which no stiffness helps.

use super::graph::Graph;
use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::contacts::{Contact, ManifoldPoint};
use crate::engine::lanes::held;
use crate::engine::params::LINEAR_SLOP;
use glam::{DVec2, Vec2};
use std::ops::Range;

/// Least width of a joint (m, rms) over the radius of gyration of the body that stands on it: what stands on less
/// is about to fall, not to buckle.
const NARROWEST: f64 = 0.1;

/// A connected part of a pile, down to a level.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    /// kg
    mass: f64,
    /// Σ m x, horizontal, and Σ m z, upwards (kg·m).
    moment: DVec2,
    /// Greatest sum over the joints on a path to a top (s⁻²).
    sum: f64,
    /// Its joint to the level below.
    joint: Joint,
}

/// All contacts between a part and the level below it.
#[derive(Clone, Copy, Debug, Default)]
struct Joint {
    /// Σ m_p (kg)
    mass: f64,
    /// Σ m_p x, Σ m_p z (kg·m)
    moment: DVec2,
    /// Σ m_p x² (kg·m²)
    second: f64,
    /// Least and greatest x of its points (m).
    range: [f64; 2],
    /// A body moves on what bears it.
    moves: bool,
}

impl Joint {
    /// Adds a point at x, z (m).
    fn add(&mut self, mass: f64, at: DVec2, moves: bool) {
        let [least, greatest] = if self.mass > 0.0 { self.range } else { [at.x; 2] };
        self.range = [least.min(at.x), greatest.max(at.x)];
        self.mass += mass;
        self.moment += mass * at;
        self.second += mass * at.x * at.x;
        self.moves |= moves;
    }

    /// Moment of the weight above it over the resistance of its springs at 1 rad/s (s⁻²), for gravity g (m/s²) and
    /// bodies of the radius of gyration √`gyration` (m²); 0 where the part does not stand on it.
    fn softness(&self, above: &Part, gyration: f64, g: f64) -> f64 {
        if self.mass <= 0.0 || self.moves {
            return 0.0;
        }
        let middle = self.moment / self.mass;
        let resistance = self.second - self.mass * middle.x * middle.x;
        let lever = above.moment / above.mass;
        let stands = (self.range[0]..=self.range[1]).contains(&lever.x) && lever.y > middle.y;
        if stands && resistance > NARROWEST * NARROWEST * gyration * self.mass {
            g * above.mass * (lever.y - middle.y) / resistance
        } else {
            0.0
        }
    }
}

/// Finds columns; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    graph: Graph,
    /// Union–find: a body that its body is in one part with.
    parent: Vec<u32>,
    /// Of each body that stands for its part.
    parts: Vec<Part>,
}

impl Columns {
    /// The angular frequency ω_c (rad/s) of springs on which no column buckles under `gravity` (m/s²); 0 if there is
    /// none to buckle. Joints that move by more than `still` (m/s) do not count.
    pub fn critical_frequency(
        &mut self,
        bodies: &Bodies,
        contacts: &[Contact],
        gravity: Vec2,
        still: f32,
    ) -> f64 {
        let g = f64::from(gravity.length());
        if g <= 0.0 {
            return 0.0;
        }
        let up = -gravity.as_dvec2() / g;
        let is_dynamic = |body: u32| bodies.kind[body as usize] == BodyKind::Dynamic;
        let touching = contacts.iter().map(|c| [c.body_a, c.body_b]);
        self.graph.build(bodies.len(), touching, is_dynamic);
        self.parent.clear();
        self.parent.extend(0..bodies.len() as u32);
        self.parts.clear();
        self.parts.extend((0..bodies.len()).map(|b| {
            let mass = 1.0 / f64::from(bodies.inv_mass[b]);
            Part { mass, moment: mass * upright(center(bodies, b), up), ..Part::default() }
        }));
        let mut greatest = 0.0f64;
        let mut end = self.graph.upwards().len();
        while end > 0 {
            let level = self.level_of(self.graph.upwards()[end - 1]);
            let below = self.graph.upwards()[..end].iter().rposition(|&body| self.level_of(body) < level);
            let begin = below.map_or(0, |last| last + 1);
            greatest = greatest.max(self.add_level(begin..end, bodies, contacts, (up, g, still)));
            end = begin;
        }
        greatest.sqrt()
    }

    /// Joins the bodies of a level with what they touch on it and above, and adds their joints; the greatest sum.
    fn add_level(
        &mut self,
        range: Range<usize>,
        bodies: &Bodies,
        contacts: &[Contact],
        (up, g, still): (DVec2, f64, f32),
    ) -> f64 {
        for i in range.clone() {
            let body = self.graph.upwards()[i];
            for e in 0..self.graph.edges_of(body as usize).len() {
                let other = self.other(body, e);
                if self.level_of(other) >= self.level_of(body) {
                    self.join(body, other);
                }
            }
        }
        for i in range.clone() {
            let body = self.graph.upwards()[i];
            let root = self.root(body) as usize;
            for e in 0..self.graph.edges_of(body as usize).len() {
                if self.level_of(self.other(body, e)) < self.level_of(body) {
                    let contact = &contacts[self.graph.edges_of(body as usize)[e] as usize];
                    for point in contact.manifold.points().iter().filter(|p| p.separation <= LINEAR_SLOP) {
                        let at = center(bodies, contact.body_b as usize) + point.anchor_b.as_dvec2();
                        let moves = speed(bodies, contact, point) > still;
                        let joint = &mut self.parts[root].joint;
                        joint.add(effective_mass(bodies, contact, point), upright(at, up), moves);
                    }
                }
            }
        }
        let mut greatest = 0.0f64;
        for i in range {
            let body = self.graph.upwards()[i];
            let root = self.root(body) as usize;
            let part = &mut self.parts[root];
            let inverse =
                [&bodies.inv_mass, &bodies.inv_inertia].map(|array| f64::from(array[body as usize]));
            // Empty if another body of the level has taken it.
            let joint = std::mem::take(&mut part.joint);
            part.sum += joint.softness(part, inverse[0] / inverse[1], g);
            greatest = greatest.max(part.sum);
        }
        greatest
    }

    fn level_of(&self, body: u32) -> u32 {
        self.graph.levels().get(body as usize).copied().unwrap_or(0)
    }

    /// The body at the other end of the edge `e` of `body`.
    fn other(&self, body: u32, e: usize) -> u32 {
        let [a, b] = self.graph.ends(self.graph.edges_of(body as usize)[e] as usize);
        if a == body { b } else { a }
    }

    /// The body that stands for the part of `body`; paths are halved on the way.
    fn root(&mut self, mut body: u32) -> u32 {
        while self.parent[body as usize] != body {
            let above = self.parent[body as usize];
            self.parent[body as usize] = self.parent[above as usize];
            body = above;
        }
        body
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return;
        }
        let Part { mass, moment, sum, .. } = self.parts[b as usize];
        let part = &mut self.parts[a as usize];
        part.mass += mass;
        part.moment += moment;
        part.sum = part.sum.max(sum);
        self.parent[b as usize] = a;
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        self.graph.held_bytes() + held(&self.parent) + held(&self.parts)
    }
}

/// Centre of mass of a body (m).
fn center(bodies: &Bodies, body: usize) -> DVec2 {
    DVec2::new(f64::from(bodies.position_x[body]), f64::from(bodies.position_y[body]))
}

/// `at` (m) in axes of which the second points upwards.
fn upright(at: DVec2, up: DVec2) -> DVec2 {
    DVec2::new(up.perp().dot(at), up.dot(at))
}

/// Effective mass of a point along the normal (kg).
fn effective_mass(bodies: &Bodies, contact: &Contact, point: &ManifoldPoint) -> f64 {
    let side = |body: u32, anchor: Vec2| {
        let arm = anchor.perp_dot(contact.manifold.normal);
        bodies.inv_mass[body as usize] + bodies.inv_inertia[body as usize] * arm * arm
    };
    let inverse = side(contact.body_a, point.anchor_a) + side(contact.body_b, point.anchor_b);
    1.0 / f64::from(inverse)
}

/// Speed of body b at a point relative to body a (m/s).
fn speed(bodies: &Bodies, contact: &Contact, point: &ManifoldPoint) -> f32 {
    let side = |body: u32, anchor: Vec2| {
        bodies.velocity(body as usize) + bodies.angular_velocity[body as usize] * anchor.perp()
    };
    (side(contact.body_b, point.anchor_b) - side(contact.body_a, point.anchor_a)).length()
}
