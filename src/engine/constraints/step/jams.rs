//! Jammed pairs of bodies, and bodies in a squeeze.
//!
//! If two bodies overlap at several of their shapes, from opposite sides, no motion separates them: a body of two
//! shapes that was thrown half-way through a line, or a disc between two jaws of one body. The two contacts push
//! against each other, and neither loads nor the contact law determine how hard: any impulses that cancel are a
//! solution. Since the overlap never shrinks, stiff springs build up thousands of times the weight. As soon as a
//! normal turns by φ, for example at the end of the line, a part sin φ of that remains in the next warm start and
//! throws the bodies apart.
//!
//! So contacts of the same two bodies with
//!
//! ```text
//! n₁ · n₂ < −1/4
//! ```
//!
//! that are both deeper than the slop, and by four slops together, start a step without impulses. Within the step
//! their normals stay fixed, so impulses that cancel keep canceling. Contacts of a wedge at rest are far less deep,
//! and keep theirs.
//!
//! Bodies welded to a static or kinematic body count as that body: a rod between two planks of a beam has one
//! body on both sides.
//!
//! # Squeezes
//!
//! The same happens if a kinematic body leaves others no room. A body is in a squeeze if it touches a
//! kinematic body, or contacts deeper than the slop connect it with one that does. With s₁ and s₂ the separations
//! of two contacts that oppose each other, whichever bodies they touch, the body has the room s₁ + s₂. It is in a
//! jam if that is below −4 slops: what overlaps a pressed body by 12 cm and touches a wall behind it is as jammed as
//! what overlaps both. All contacts of such a body, also those that are not deep, start a step without impulses:
//! three that press from three sides hold each other as well. Bodies under a heavy one, which are as deep in each
//! other, keep their impulses.
//!
//! Normals turn between steps. Where a jam ends that way, its last step has left impulses that cancel no longer, so
//! its contacts start the next step without them as well.
//!
//! # Bound of the speed
//!
//! The closing speed V of the squeezing surfaces cannot be removed, so each of the sweeps adds m V to
//! impulses that cancel only as long as nothing yields. A body that gives way sideways by an angle φ from the
//! direction of V would have to move at V/tan φ to make room: the contact law itself bounds no speed. Energy
//! does. A kinematic body that hits one at rest without loss gives it 2V, and overlap is pushed apart at the
//! push speed u. A jammed body is left with overlap instead of more speed: with v₀, ω₀ from before the step,
//! ρ the radius of gyration and V the fastest surface that presses its squeeze,
//!
//! ```text
//! v² + ρ²ω² ≤ max(2V + u, √(v₀² + ρ²ω₀²) + g dt)²
//! ```
//!
//! Velocities beyond that are scaled down in each substep before bodies move, and at its end.

use super::CollisionScene;
use crate::bodies::{Bodies, BodyKind};
use crate::constraints::kernels::types::ConstraintSet;
use crate::contacts::{Contact, ManifoldPoint};
use crate::disjoint::DisjointSets;
use crate::narrowphase::Margins;
use crate::workers::Apart;
use glam::Vec2;

/// Normals with a smaller product oppose each other (1). Friction holds a body in a wedge, so that impulses can grow
/// without bound, up to n₁ · n₂ = −(1 − µ²)/(1 + µ²), which is −1/4 with µ = 0.77.
const OPPOSED: f32 = -0.25;

/// Two contacts leave a body no room if they oppose each other and overlap by more than this together (slops). One of them
/// is then deeper than half of it.
const NO_ROOM: f32 = 4.0;

/// A contact: the bodies by which it is grouped, its index, and whether the normal keeps its sign.
type GroupedContact = ([u32; 2], u32, bool);

/// Least number of contacts that are worth a thread.
const LEAST_CONTACTS: usize = 1024;

/// Deep contacts and pressed bodies; see [`Jams`].
#[derive(Clone, Debug, Default)]
struct Scan {
    deep: Vec<GroupedContact>,
    pressed: Vec<(u32, f32)>,
}

impl Scan {
    /// Looks at `contacts`, of which the first has the index `first`.
    fn over(&mut self, contacts: &[Contact], first: usize, bodies: &Bodies, slop: f32) {
        self.deep.clear();
        self.pressed.clear();
        for (i, contact) in (first..).zip(contacts) {
            if contact.manifold.points().iter().any(|point| point.separation < -slop) {
                self.deep.push(([contact.body_a, contact.body_b], i as u32, true));
            }
            for (by, of) in [(contact.body_a, contact.body_b), (contact.body_b, contact.body_a)] {
                if bodies.kind[by as usize] == BodyKind::Kinematic {
                    self.pressed.push((of, surface_speed(bodies, contact, by)));
                }
            }
        }
    }
}

/// Finds jams; reuses its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(crate) struct Jams {
    /// What each thread finds among the contacts.
    scans: Vec<Apart<Scan>>,
    /// Deep contacts, by pair of bodies, and the contacts of each body in a squeeze.
    deep: Vec<GroupedContact>,
    /// Bodies that touch a kinematic one, and how fast its surface is there (m/s).
    pressed: Vec<(u32, f32)>,
    /// Dynamic bodies that deep contacts connect.
    connected: DisjointSets,
    /// V of the squeeze that a body is in (m/s), negative if it is in none; at the lowest index of the connected bodies.
    /// `[bodies]`
    squeezed: Vec<f32>,
    /// Whether a body has a contact that is deep enough for a jam. `[bodies]`
    may_jam: Vec<bool>,
    /// Whether a body is in `jammed`. `[bodies]`
    is_jammed: Vec<bool>,
    /// Bodies in a jam of a squeeze, by number, and the bound of their speed (m/s); those of the last step until
    /// this step's are known.
    jammed: Vec<(u32, f32)>,
    /// Bodies that welds hold together.
    welded: DisjointSets,
    /// Non-dynamic body of each welded set, if any, at the lowest index of the set. `[bodies]`
    holders: Vec<u32>,
}

impl Jams {
    /// Zeroes the impulses of contacts that push against each other, and limits the speeds of bodies in a jam. `push_speed`:
    /// m/s.
    pub fn release(&mut self, scene: &mut CollisionScene<'_>, push_speed: f32) {
        let slop = Margins::of(scene.length_unit).slop;
        let (contacts, bodies, types) = (&mut *scene.contacts, scene.bodies, scene.types);
        self.deep.clear();
        self.pressed.clear();
        // Jams of the last step.
        self.forget_jams(contacts, bodies.len());
        self.jammed.clear();
        let scan =
            |first: usize, contacts: &[Contact], scan: &mut Scan| scan.over(contacts, first, bodies, slop);
        for Apart(scan) in scene.workers.each_part(contacts, LEAST_CONTACTS, &mut self.scans, scan) {
            self.deep.extend_from_slice(&scan.deep);
            self.pressed.extend_from_slice(&scan.pressed);
        }
        if !self.deep.is_empty() {
            self.hold(types, bodies);
        }
        self.squeeze(bodies, contacts, slop);
        self.deep.sort_unstable();
        for group in self.deep.chunk_by(|p, q| p.0 == q.0).filter(|group| group.len() > 1) {
            let [body, same] = group[0].0;
            if body != same && bodies.is_dynamic(body as usize) && bodies.is_dynamic(same as usize) {
                continue;
            }
            for pushing in group {
                let (n, depth) = overlap(contacts, pushing);
                let opposes = |other| {
                    let (m, other) = overlap(contacts, other);
                    n.dot(m) < OPPOSED && depth + other > NO_ROOM * slop
                };
                if depth <= slop || !group.iter().any(opposes) {
                    continue;
                }
                if body == same {
                    self.jammed.push((body, self.squeezed[self.connected.least(body) as usize]));
                    break;
                }
                forget(&mut contacts[pushing.1 as usize]);
            }
        }
        if self.jammed.is_empty() {
            return;
        }
        self.forget_jams(contacts, bodies.len());
        for (body, most) in &mut self.jammed {
            let (i, square) = (*body as usize, square_gyration(bodies, *body));
            let gravity = scene.gravities.get(i).copied().unwrap_or(scene.gravity);
            let had = speed(bodies.velocity(i).to_array(), bodies.angular_velocity[i], square);
            *most = (2.0 * *most + push_speed).max(had + Vec2::from(gravity).length() * scene.dt);
        }
        scene.speed_limits.extend_from_slice(&self.jammed);
    }

    /// Zeroes the impulses of bodies in a jam of a squeeze.
    fn forget_jams(&mut self, contacts: &mut [Contact], bodies: usize) {
        if self.jammed.is_empty() {
            return;
        }
        self.is_jammed.clear();
        self.is_jammed.resize(bodies, false);
        for &(body, _) in &self.jammed {
            self.is_jammed.get_mut(body as usize).into_iter().for_each(|jammed| *jammed = true);
        }
        for contact in contacts {
            if self.is_jammed[contact.body_a as usize] || self.is_jammed[contact.body_b as usize] {
                forget(contact);
            }
        }
    }

    /// Replaces welded bodies of deep contacts by the non-dynamic body that holds them, except within one
    /// set.
    fn hold(&mut self, types: &[ConstraintSet], bodies: &Bodies) {
        let welds =
            || types.iter().filter(|joined| joined.kind.rigid_size() == 3).flat_map(|j| j.kind.ends());
        if welds().next().is_none() {
            return;
        }
        let Jams { deep, welded, holders, .. } = self;
        welded.begin(bodies.len());
        welds().for_each(|&[a, b]| welded.join(a, b));
        holders.clear();
        holders.extend(0..bodies.len() as u32);
        for &body in welds().flatten().filter(|&&body| !bodies.is_dynamic(body as usize)) {
            holders[welded.least(body) as usize] = body;
        }
        for (pair, _, is_own) in deep {
            let [a, b] = pair.map(|body| {
                let holder = holders[welded.least(body) as usize];
                let is_held = bodies.is_dynamic(body as usize) && !bodies.is_dynamic(holder as usize);
                if is_held { holder } else { body }
            });
            if a != b {
                (*pair, *is_own) = ([a.min(b), a.max(b)], a < b);
            }
        }
    }

    /// The bodies in a jam.
    pub fn kept(&self) -> impl Iterator<Item = u32> {
        self.jammed.iter().map(|&(body, _)| body)
    }

    /// Takes the bodies of [`Self::kept`].
    pub fn set_kept(&mut self, bodies: impl Iterator<Item = u32>) {
        self.jammed = bodies.map(|body| (body, 0.0)).collect();
    }

    /// Forgets the bodies in a jam.
    pub fn clear(&mut self) {
        self.jammed.clear();
    }

    /// Finds the squeezes, and lists the contacts of bodies in them.
    fn squeeze(&mut self, bodies: &Bodies, contacts: &[Contact], slop: f32) {
        if self.deep.is_empty() || self.pressed.is_empty() {
            return;
        }
        let is_dynamic = |body: u32| bodies.is_dynamic(body as usize);
        let Jams { deep, pressed, connected, squeezed, may_jam, .. } = self;
        connected.begin(bodies.len());
        may_jam.clear();
        may_jam.resize(bodies.len(), false);
        for pushing in &*deep {
            // The pair of contacts of welded bodies names those that hold them.
            let Contact { body_a, body_b, .. } = contacts[pushing.1 as usize];
            if is_dynamic(pushing.0[0]) && is_dynamic(pushing.0[1]) {
                connected.join(pushing.0[0], pushing.0[1]);
            }
            if overlap(contacts, pushing).1 > 0.5 * NO_ROOM * slop {
                (may_jam[body_a as usize], may_jam[body_b as usize]) = (true, true);
            }
        }
        squeezed.clear();
        squeezed.resize(bodies.len(), -1.0);
        for &(body, speed) in pressed.iter().filter(|p| is_dynamic(p.0)) {
            let most = &mut squeezed[connected.least(body) as usize];
            *most = most.max(speed);
        }
        for (i, contact) in contacts.iter().enumerate() {
            for (own, is_own) in [(contact.body_a, false), (contact.body_b, true)] {
                let mut is_squeezed = || squeezed[connected.least(own) as usize] >= 0.0;
                if may_jam[own as usize] && is_dynamic(own) && is_squeezed() {
                    deep.push(([own; 2], i as u32, is_own));
                }
            }
        }
    }
}

/// The normal of a contact as its body sees it, and its largest overlap (m), negative for a gap.
fn overlap(contacts: &[Contact], &(_, i, is_own): &GroupedContact) -> (Vec2, f32) {
    let manifold = &contacts[i as usize].manifold;
    let depth = manifold.points().iter().map(|point| -point.separation).fold(f32::MIN, f32::max);
    (if is_own { manifold.normal } else { -manifold.normal }, depth)
}

/// ρ² (m²); infinite for a body that cannot turn.
fn square_gyration(bodies: &Bodies, body: u32) -> f32 {
    bodies.inv_mass[body as usize] / bodies.inv_inertia[body as usize]
}

/// √(v² + ρ²ω²), with ρ² as `gyration` (m²); that of a body that cannot turn is infinite and its spin zero.
pub(super) fn speed([x, y]: [f32; 2], spin: f32, gyration: f32) -> f32 {
    let turning = if gyration.is_finite() { gyration * spin * spin } else { 0.0 };
    (x * x + y * y + turning).sqrt()
}

/// Speed of the surface of a body at its contact (m/s).
fn surface_speed(bodies: &Bodies, contact: &Contact, body: u32) -> f32 {
    let (velocity, spin) = (bodies.velocity(body as usize), bodies.angular_velocity[body as usize]);
    let arm = |point: &ManifoldPoint| if body == contact.body_a { point.anchor_a } else { point.anchor_b };
    let speeds = contact.manifold.points().iter().map(|point| (velocity + spin * arm(point).perp()).length());
    speeds.fold(0.0, f32::max)
}

/// Starts a contact without impulses.
fn forget(contact: &mut Contact) {
    for point in &mut contact.manifold.points {
        (point.normal_impulse, point.tangent_impulse) = (0.0, 0.0);
    }
}
