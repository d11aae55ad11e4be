//! What piles ask of soft contacts: stiffness, so that no column buckles, and patience with their slowest mode.
//!
//! Contacts are springs here, of the stiffness m_p ω² at a point of effective mass m_p. A pile is cut into joints: the
//! levels of the contact graph count contacts between a body and the ground, and from the top downwards the bodies
//! of a level join the parts that they touch; what joins a part to the level below is a joint.
//!
//! # Buckling
//!
//! Joint j resists rotation by K_j = ω² Σ m_p (x_p − x̄)², with x the place of a point along it. Were all others
//! rigid, it would buckle if K_j < Σ w_i (z_i − z_j), the moment of the weights above for one radian. With all joints
//! soft, Southwell's theorem bounds the critical load from below by the harmonic sum of those of one soft
//! joint each, so that a column stands if
//!
//! ```text
//! ω² ≥ ω_c² = Σ_j Σ_i w_i (z_i − z_j) / Σ_p m_p (x_p − x̄)²
//! ```
//!
//! along each path from the ground to a top. For N equal boxes that has N³/6 in place of Greenhill's N³/7.837
//! (`papers/shim.md`): on the safe side by 14 % of ω.
//!
//! # The slowest mode
//!
//! A column of bodies, each of which one contact of k_j = ω² Σ m_p (n·d)² bears along d, has a slowest mode ω₁ that
//! Dunkerley's formula bounds, with M_j the mass of the column from body j upwards:
//!
//! ```text
//! 1/κ = ω²/ω₁² ≤ Σ_j M_j ω²/k_j
//! ```
//!
//! That is N² for N equal discs, and 5/4 N² for boxes. A pile is taken to be as slow as the slowest column in it: from
//! the top downwards, each body carries the heaviest and the slowest column that touches it from above, and is
//! borne by the stiffest of its contacts with the level below. Both the vertical and the horizontal are searched, each
//! through the contacts whose normal is within 60° of it: boxes in a row along the ground that are pressed against
//! a wall swing as a column of as many does. Parts that nothing fixed bears along d, and that loads hold together (cards
//! that lean on each other), count as a column of all their bodies that is held in its middle.
//!
//! Preload has no moment on one contact, and so does not rock a column of boxes; on two legs of a table it has. With J_j
//! the inertia above a joint about its middle, and K′_j its resistance with the points of each contact in one place,
//! Dunkerley's formula for rotations, times the part of the stiffness that preload shortens, is
//!
//! ```text
//! 1/κ ≤ Σ_j (J_j ω²/K_j) (K′_j/K_j)
//! ```
//!
//! and the greater of both counts.

use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::constraints::numerics::supports::{self, Support};
use crate::engine::constraints::records::graph::{Graph, UNSUPPORTED};
use crate::engine::constraints::records::kept::Kept;
use crate::engine::contacts::{Contact, ManifoldPoint};
use crate::engine::lanes::held;
use crate::engine::params::LINEAR_SLOP;
use crate::engine::solvers::shim::piles::equilibrium::Equilibrium;
use crate::engine::solvers::shim::preload::LEFT;
use crate::engine::solvers::shim::{PRELOAD, WAIT};
use glam::{DVec2, Vec2};
use std::ops::Range;

/// What the piles of a scene ask for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PileModes {
    /// Angular frequency ω_c of springs on which no column buckles (rad/s); 0 if there is none to buckle.
    pub critical_frequency: f32,
    /// Bound on 1/κ, the square of the frequency of springs over that of the slowest mode (1).
    pub slowness: f32,
}

/// Least width of a joint (m, rms) over the radius of gyration of the body that stands on it: what stands on less
/// is about to fall, not to buckle.
const NARROWEST: f64 = 0.1;

/// Least cosine between a direction and the normals of the contacts that bear along it.
const BEARING: f32 = 0.5;

/// A connected part of a pile, down to a level.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    /// kg
    mass: f64,
    /// Σ m (x, z), z along the direction (kg·m).
    moment: DVec2,
    /// Σ w and Σ w z of its weights, with what users push them down with (N, N·m).
    weight: [f64; 2],
    /// Σ m (x² + z²) + I (kg·m²)
    inertia: f64,
    /// Its bodies, and the least of their masses (kg).
    bodies: u32,
    lightest: f64,
    /// Greatest sum of what makes joints buckle, on a path to a top (s⁻²).
    buckling: f64,
    /// The same of what makes preload rock them (1).
    rocking: f64,
    /// Bodies of it were placed in each other.
    is_placed: bool,
    /// Its joint to the level below.
    joint: Joint,
}

/// The heaviest and the slowest column down to a body.
#[derive(Clone, Copy, Debug, Default)]
struct Column {
    /// kg
    mass: f64,
    /// Σ M_j ω²/k_j (1)
    slowness: f64,
}

/// All contacts between a part and the level below it.
#[derive(Clone, Copy, Debug, Default)]
struct Joint {
    /// Σ m_p (kg)
    mass: f64,
    /// Σ m_p (x, z) (kg·m)
    moment: DVec2,
    /// Σ m_p x² (kg·m²), and the same with the points of each contact in their middle.
    second: f64,
    between: f64,
    /// Least and greatest x of its points (m).
    range: [f64; 2],
    /// A body moves on what bears it.
    moves: bool,
}

impl Joint {
    /// Adds a contact, the sums of mass and moment of whose points are these.
    fn add_contact(&mut self, mass: f64, moment: f64) {
        self.between += if mass > 0.0 { moment * moment / mass } else { 0.0 };
    }

    /// Adds a point at x, z (m).
    fn add(&mut self, mass: f64, at: DVec2, moves: bool) {
        let [least, greatest] = if self.mass > 0.0 { self.range } else { [at.x; 2] };
        self.range = [least.min(at.x), greatest.max(at.x)];
        self.mass += mass;
        self.moment += mass * at;
        self.second += mass * at.x * at.x;
        self.moves |= moves;
    }

    /// Resistance to rotation over ω² (kg·m²): Σ m_p (x_p − x̄)², and the part of it that each contact adds as a whole.
    fn resistance(&self) -> [f64; 2] {
        [self.second, self.between].map(|sum| sum - self.moment.x * self.moment.x / self.mass)
    }

    /// Inertia above it over the resistance of its springs at 1 rad/s (s⁻²), times the part of these that preload
    /// shortens.
    fn rocking(&self, above: &Part) -> f64 {
        let (middle, [all, between]) = (self.moment / self.mass, self.resistance());
        let inertia = above.inertia - 2.0 * middle.dot(above.moment) + above.mass * middle.length_squared();
        // What rounding leaves of a contact alone is none.
        if between > 1e-9 * self.second { inertia * between / (all * all) } else { 0.0 }
    }

    /// Whether the part `above` it stands on it: it does not move, has the centre of mass over it, and is not too narrow
    /// for a body of the radius of gyration √`gyration` (m²).
    fn stands(&self, above: &Part, gyration: f64) -> bool {
        let (middle, lever) = (self.moment / self.mass, above.moment / above.mass);
        let wide = self.resistance()[0] > NARROWEST * NARROWEST * gyration * self.mass;
        let is_over = (self.range[0]..=self.range[1]).contains(&lever.x) && lever.y > middle.y;
        wide && is_over && !self.moves
    }

    /// Moment of the weight above it for one radian over the resistance of its springs at 1 rad/s (s⁻²).
    fn buckling(&self, above: &Part) -> f64 {
        let [weight, moment] = above.weight;
        (moment - weight * self.moment.y / self.mass).max(0.0) / self.resistance()[0]
    }
}

/// One direction to search.
#[derive(Clone, Copy)]
struct Search<'w> {
    bodies: &'w Bodies,
    contacts: &'w [Contact],
    /// The direction, a unit vector.
    up: Vec2,
    /// m/s²
    gravity: DVec2,
    /// Speed (m/s) above which a body moves on what bears it.
    still: f32,
    /// Step (s).
    dt: f32,
}

impl Search<'_> {
    /// (x, z) of a place (m).
    fn upright(&self, at: DVec2) -> DVec2 {
        let up = self.up.as_dvec2();
        DVec2::new(up.perp().dot(at), up.dot(at))
    }

    /// A body alone.
    fn part(&self, body: usize) -> Part {
        let mass = 1.0 / f64::from(self.bodies.inv_mass[body]);
        let at = self.upright(center(self.bodies, body));
        let inertia = mass * at.length_squared() + 1.0 / f64::from(self.bodies.inv_inertia[body]);
        let down = -force(self.bodies, body, self.gravity).dot(self.up.as_dvec2());
        let weight = [down, down * at.y];
        Part { mass, moment: mass * at, weight, inertia, bodies: 1, lightest: mass, ..Part::default() }
    }

    /// Of a contact along the direction, over ω² (kg).
    fn stiffness(&self, contact: &Contact) -> f64 {
        let along = f64::from(contact.manifold.normal.dot(self.up));
        let points = contact.manifold.points().iter();
        along * along * points.map(|point| effective_mass(self.bodies, contact, point)).sum::<f64>()
    }

    /// It bears along the direction and touches, or will within the step.
    fn bears(&self, contact: &Contact) -> bool {
        let near = |p: &ManifoldPoint| p.separation <= LINEAR_SLOP + self.dt * speed(self.bodies, contact, p);
        contact.manifold.normal.dot(self.up).abs() >= BEARING && contact.manifold.points().iter().any(near)
    }
}

/// Finds the modes of piles; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub struct Piles {
    graph: Graph,
    /// Contacts that bear along the direction, the edges of `graph`.
    bearing: Vec<u32>,
    /// Union–find: a body that its body is in one part with.
    parent: Vec<u32>,
    /// Of each body that stands for its part.
    parts: Vec<Part>,
    /// Of each body.
    columns: Vec<Column>,
    /// What each body bears: weight (N), and its torque about the centre of mass (N·m).
    forces: Vec<[f64; 2]>,
    /// What of that is set on the pile in this step.
    added: Vec<[f64; 2]>,
    /// Whether a contact of the body has borne a load.
    is_loaded: Vec<bool>,
    /// Of one body.
    supports: Vec<Support>,
    /// Of each contact (N).
    weights: Vec<f32>,
    equilibrium: Equilibrium,
}

impl Piles {
    /// The modes under `gravity` (m/s²), in steps of `dt` (s); without gravity there is no vertical, and x and y are
    /// searched. Finds [`Self::weights`], and writes impulses per substep of `h` (s) where there have been none.
    pub fn modes(
        &mut self,
        bodies: &Bodies,
        contacts: &mut [Contact],
        kept: &mut Kept,
        gravity: Vec2,
        [dt, h]: [f32; 2],
    ) -> PileModes {
        self.weights.clear();
        self.weights.resize(contacts.len(), 0.0);
        let up = -gravity.try_normalize().unwrap_or(Vec2::NEG_Y);
        // What gravity does in a step is still.
        let (still, gravity) = (gravity.length() * dt, gravity.as_dvec2());
        let has_weight = gravity != DVec2::ZERO;
        let search = Search { bodies, contacts, up, gravity, still, dt };
        self.build(&search);
        let [buckling, rocking] = if has_weight { self.joints(&search) } else { [0.0; 2] };
        let vertical = self.slowness(&search);
        if has_weight {
            self.weigh(bodies, contacts, kept, gravity, still, h);
            self.balance(bodies, contacts, kept, gravity, still, h);
        }
        let search = Search { bodies, contacts, up: up.perp(), gravity, still, dt };
        self.build(&search);
        let horizontal = self.slowness(&search);
        PileModes {
            critical_frequency: buckling.sqrt() as f32,
            slowness: vertical.max(horizontal).max(rocking) as f32,
        }
    }

    /// Builds the graph of the contacts that bear along a direction.
    fn build(&mut self, search: &Search<'_>) {
        let Search { bodies, contacts, .. } = *search;
        self.bearing.clear();
        self.bearing.extend((0..contacts.len() as u32).filter(|&c| search.bears(&contacts[c as usize])));
        let ends = self.bearing.iter().map(|&c| [contacts[c as usize].body_a, contacts[c as usize].body_b]);
        self.graph.build(bodies.len(), ends, |body| bodies.kind[body as usize] == BodyKind::Dynamic);
        self.parent.clear();
        self.parent.extend(0..bodies.len() as u32);
        self.parts.clear();
        self.parts.extend((0..bodies.len()).map(|body| search.part(body)));
    }

    /// The greatest Σ_j of what makes joints buckle (s⁻²), and of what makes preload rock them (1).
    fn joints(&mut self, search: &Search<'_>) -> [f64; 2] {
        let mut greatest = [0.0; 2];
        let mut end = self.graph.upwards().len();
        while end > 0 {
            let level = self.level_of(self.graph.upwards()[end - 1]);
            let below = self.graph.upwards()[..end].iter().rposition(|&body| self.level_of(body) < level);
            let begin = below.map_or(0, |last| last + 1);
            self.join_level(begin..end);
            self.add_joints(begin..end, search);
            self.bear(begin..end, search, &mut greatest);
            end = begin;
        }
        greatest
    }

    /// Joins the bodies of a level with what they touch on it and above.
    fn join_level(&mut self, range: Range<usize>) {
        for i in range {
            let body = self.graph.upwards()[i];
            for e in 0..self.graph.edges_of(body as usize).len() {
                let (other, _) = self.other(body, e);
                if self.level_of(other) >= self.level_of(body) {
                    self.join(body, other);
                }
            }
        }
    }

    /// Adds the points of a level's contacts with the level below to the joints of its parts.
    fn add_joints(&mut self, range: Range<usize>, search: &Search<'_>) {
        let Search { bodies, contacts, still, .. } = *search;
        for i in range {
            let body = self.graph.upwards()[i];
            let root = self.root(body) as usize;
            for e in 0..self.graph.edges_of(body as usize).len() {
                let (other, contact) = self.other(body, e);
                if self.level_of(other) >= self.level_of(body) {
                    continue;
                }
                let contact = &contacts[contact as usize];
                let joint = &mut self.parts[root].joint;
                let before = (joint.mass, joint.moment.x);
                for point in contact.manifold.points() {
                    let at = center(bodies, contact.body_b as usize) + point.anchor_b.as_dvec2();
                    let moves = speed(bodies, contact, point) > still;
                    joint.add(effective_mass(bodies, contact, point), search.upright(at), moves);
                }
                joint.add_contact(joint.mass - before.0, joint.moment.x - before.1);
            }
        }
    }

    /// Lets the joints of a level bear what is above them.
    fn bear(&mut self, range: Range<usize>, search: &Search<'_>, greatest: &mut [f64; 2]) {
        for i in range {
            let body = self.graph.upwards()[i] as usize;
            let root = self.root(body as u32) as usize;
            let part = &mut self.parts[root];
            // Empty if another body of the part has been here.
            let joint = std::mem::take(&mut part.joint);
            if joint.mass > 0.0 {
                let gyration = f64::from(search.bodies.inv_mass[body] / search.bodies.inv_inertia[body]);
                if joint.stands(part, gyration) {
                    part.buckling += joint.buckling(part);
                    part.rocking += joint.rocking(part);
                }
            }
            *greatest = [greatest[0].max(part.buckling), greatest[1].max(part.rocking)];
        }
    }

    /// The slowness of the slowest column (1).
    fn slowness(&mut self, search: &Search<'_>) -> f64 {
        self.columns.clear();
        self.columns.resize(search.bodies.len(), Column::default());
        let mut greatest = 0.0;
        for &body in self.graph.upwards().iter().rev() {
            let (mut above, mut stiffness) = (Column::default(), 0.0);
            for e in 0..self.graph.edges_of(body as usize).len() {
                let (other, contact) = self.other(body, e);
                if self.level_of(other) > self.level_of(body) {
                    let column = self.columns[other as usize];
                    above.mass = f64::max(above.mass, column.mass);
                    above.slowness = f64::max(above.slowness, column.slowness);
                } else if self.level_of(other) < self.level_of(body) {
                    stiffness = f64::max(stiffness, search.stiffness(&search.contacts[contact as usize]));
                }
            }
            let mass = above.mass + 1.0 / f64::from(search.bodies.inv_mass[body as usize]);
            let slowness = above.slowness + mass / stiffness;
            self.columns[body as usize] = Column { mass, slowness };
            greatest = f64::max(greatest, slowness);
        }
        f64::max(greatest, self.unsupported(search))
    }

    /// Writes what contacts bear at rest, from the top downwards: each body stands, with what it bears, on its
    /// contacts with the level below. Bodies that have borne nothing yet get their impulses per substep of `h` (s), too, and
    /// what bears them already others gets theirs added: what it bore before is known from motion. Nor is anything written
    /// there for contacts of one point, since discs in a pile share their loads in many ways.
    fn weigh(
        &mut self,
        bodies: &Bodies,
        contacts: &mut [Contact],
        kept: &mut Kept,
        gravity: DVec2,
        still: f32,
        h: f32,
    ) {
        let up = -gravity.normalize();
        self.forces.clear();
        self.forces.resize(bodies.len(), [0.0; 2]);
        self.added.clear();
        self.added.resize(bodies.len(), [0.0; 2]);
        self.is_loaded.clear();
        self.is_loaded.resize(bodies.len(), false);
        let borne =
            contacts.iter().enumerate().filter(|(i, contact)| has_borne(contact, kept.contact(*i)[PRELOAD]));
        for (_, contact) in borne {
            self.is_loaded[contact.body_a as usize] = true;
            self.is_loaded[contact.body_b as usize] = true;
        }
        for &body in self.graph.upwards().iter().rev() {
            let b = body as usize;
            self.supports.clear();
            for e in 0..self.graph.edges_of(b).len() {
                let (other, contact) = self.other(body, e);
                if self.level_of(other) < self.level_of(body) {
                    self.supports.extend(supports(bodies, contacts, contact, body, still));
                }
            }
            let [borne, torque] = self.forces[b];
            let force = force(bodies, b, gravity) - borne * up;
            let torque = torque + f64::from(bodies.torque[b]);
            hand_down(bodies, contacts, body, [force, up], torque, &mut self.supports, &mut self.forces);
            let is_new = !self.is_loaded[b];
            for support in &self.supports {
                let contact = &mut contacts[support.contact as usize];
                if is_new || contact.manifold.count > 1 {
                    self.weights[support.contact as usize] += support.load[0] as f32;
                }
                if is_new {
                    let point = &mut contact.manifold.points[support.point];
                    [point.normal_impulse, point.tangent_impulse] = support.load.map(|load| load as f32 * h);
                }
            }
            // What has fallen is borne by what it has done to the pile.
            let is_set = is_new && self.supports.iter().any(|s| kept.contact(s.contact as usize)[WAIT] < 0.0);
            let [borne, turns] = self.added[b];
            let (force, torque) = if is_set { (force, torque) } else { (-borne * up, turns) };
            if force == DVec2::ZERO {
                continue;
            }
            hand_down(bodies, contacts, body, [force, up], torque, &mut self.supports, &mut self.added);
            for support in self.supports.iter().filter(|_| !is_new) {
                let contact = &mut contacts[support.contact as usize];
                if contact.manifold.count > 1 {
                    let point = &mut contact.manifold.points[support.point];
                    point.normal_impulse += support.load[0] as f32 * h;
                    point.tangent_impulse += support.load[1] as f32 * h;
                    let points = contact.manifold.points().iter();
                    self.weights[support.contact as usize] = points.map(|p| p.normal_impulse / h).sum();
                }
            }
        }
    }

    /// Balances the loads of bodies that begin; see `equilibrium.rs`.
    fn balance(
        &mut self,
        bodies: &Bodies,
        contacts: &mut [Contact],
        kept: &mut Kept,
        gravity: DVec2,
        still: f32,
        h: f32,
    ) {
        let is_loaded = &self.is_loaded;
        let begins = |body: u32| bodies.kind[body as usize] == BodyKind::Dynamic && !is_loaded[body as usize];
        let rests = |contact: &Contact, p: usize| rests(bodies, contact, &contact.manifold.points[p], still);
        self.equilibrium.balance(bodies, contacts, gravity, h, begins, rests);
        for (weight, contact) in self.weights.iter_mut().zip(contacts.iter()) {
            if begins(contact.body_a) || begins(contact.body_b) {
                *weight = contact.manifold.points().iter().map(|p| p.normal_impulse / h).sum();
            }
        }
        self.spare_placed(bodies, contacts, kept);
    }

    /// Where bodies were placed in each other, no contact of the pile begins with all of its sag.
    fn spare_placed(&mut self, bodies: &Bodies, contacts: &[Contact], kept: &mut Kept) {
        let ends = |contact: &Contact| {
            [contact.body_a, contact.body_b]
                .into_iter()
                .filter(|&b| bodies.kind[b as usize] == BodyKind::Dynamic)
        };
        let numbers = |kept: &mut Kept, i: usize, of: usize| kept.contact(i)[of];
        for (i, contact) in contacts.iter().enumerate() {
            if numbers(kept, i, PRELOAD) >= -LEFT {
                continue;
            }
            for body in ends(contact) {
                let root = self.root(body) as usize;
                self.parts[root].is_placed = true;
            }
        }
        for (i, contact) in contacts.iter().enumerate() {
            if numbers(kept, i, WAIT) >= 0.0 {
                continue;
            }
            if ends(contact).any(|body| {
                let root = self.root(body) as usize;
                self.parts[root].is_placed
            }) {
                kept.contact(i)[WAIT] = 0.0;
            }
        }
    }

    /// The greatest slowness of parts that nothing bears: n bodies of the mass M in a chain that is held in the
    /// middle have Σ_j M_j/m_p ≤ (n/2) (M/2)/2 at each end, over 2/5 of the least mass (two points of a box).
    fn unsupported(&mut self, search: &Search<'_>) -> f64 {
        let mut greatest = 0.0f64;
        for edge in 0..self.bearing.len() {
            let contact = &search.contacts[self.bearing[edge] as usize];
            let (a, b) = (contact.body_a, contact.body_b);
            let free = [a, b].iter().all(|&body| self.level_of(body) == UNSUPPORTED);
            if free && contact.manifold.points().iter().any(|p| p.normal_impulse > 0.0) {
                self.join(a, b);
                let root = self.root(a) as usize;
                let part = &self.parts[root];
                greatest = greatest.max(f64::from(part.bodies) * part.mass / (8.0 * 0.4 * part.lightest));
            }
        }
        greatest
    }

    fn level_of(&self, body: u32) -> u32 {
        self.graph.levels().get(body as usize).copied().unwrap_or(0)
    }

    /// The body at the other end of the edge `e` of `body`, and its contact.
    fn other(&self, body: u32, e: usize) -> (u32, u32) {
        let edge = self.graph.edges_of(body as usize)[e] as usize;
        let [a, b] = self.graph.ends(edge);
        (if a == body { b } else { a }, self.bearing[edge])
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
        let other = self.parts[b as usize];
        let part = &mut self.parts[a as usize];
        part.mass += other.mass;
        part.moment += other.moment;
        part.weight = [0, 1].map(|i| part.weight[i] + other.weight[i]);
        part.inertia += other.inertia;
        part.bodies += other.bodies;
        part.lightest = part.lightest.min(other.lightest);
        part.buckling = part.buckling.max(other.buckling);
        part.rocking = part.rocking.max(other.rocking);
        self.parent[b as usize] = a;
    }

    /// What contacts bear in statics (N), as of the last call of [`Self::modes`]. `[contacts]`
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        self.graph.held_bytes()
            + held(&self.bearing)
            + held(&self.parent)
            + held(&self.parts)
            + held(&self.columns)
            + held(&self.forces)
            + held(&self.added)
            + held(&self.is_loaded)
            + held(&self.supports)
            + held(&self.weights)
            + self.equilibrium.held_bytes()
    }
}

/// The points of the contact `index` on which `body` rests: those that touch and move by no more than `still` (m/s).
fn supports<'c>(
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

/// Lets `supports` of a body bear a force (N) and a torque (N·m), and gives what they bear to the bodies below. Weight goes
/// down the pile along −`up`, no more and no less; pushes to the sides end here.
fn hand_down(
    bodies: &Bodies,
    contacts: &[Contact],
    body: u32,
    [force, up]: [DVec2; 2],
    torque: f64,
    supports: &mut [Support],
    forces: &mut [[f64; 2]],
) {
    let b = body as usize;
    let gyration = (f64::from(bodies.inv_mass[b]) / f64::from(bodies.inv_inertia[b])).sqrt();
    supports::load(supports, force, torque, gyration);
    let carried = |support: &Support| support.force().dot(up).max(0.0);
    let part = (-force.dot(up)).max(0.0) / supports.iter().map(carried).sum::<f64>();
    if !part.is_finite() {
        return;
    }
    for support in supports.iter() {
        let contact = &contacts[support.contact as usize];
        let other = if contact.body_a == body { contact.body_b } else { contact.body_a } as usize;
        let arm = center(bodies, b) + support.arm - center(bodies, other);
        let carried = part * carried(support);
        forces[other][0] += carried;
        forces[other][1] -= carried * arm.perp_dot(up);
    }
}

/// A point touches, and moves by no more than `still` (m/s).
fn rests(bodies: &Bodies, contact: &Contact, point: &ManifoldPoint, still: f32) -> bool {
    point.separation.abs() <= LINEAR_SLOP && speed(bodies, contact, point) <= still
}

/// A load, now or before.
fn has_borne(contact: &Contact, preload: f32) -> bool {
    preload > 0.0 || contact.manifold.points().iter().any(|p| p.normal_impulse > 0.0)
}

/// Weight of a body, and what users push it with (N).
fn force(bodies: &Bodies, body: usize, gravity: DVec2) -> DVec2 {
    let pushed = DVec2::new(f64::from(bodies.force_x[body]), f64::from(bodies.force_y[body]));
    f64::from(bodies.gravity_scale[body]) / f64::from(bodies.inv_mass[body]) * gravity + pushed
}

/// Centre of mass of a body (m).
fn center(bodies: &Bodies, body: usize) -> DVec2 {
    DVec2::new(f64::from(bodies.position_x[body]), f64::from(bodies.position_y[body]))
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
