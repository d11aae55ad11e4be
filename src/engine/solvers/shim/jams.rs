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
//! n₁ · n₂ < −1/2
//! ```
//!
//! that are both deeper than the slop start a step without impulses. Within the step their normals stay fixed, so
//! impulses that cancel keep canceling. Contacts of a wedge at rest are far less deep, and keep theirs.
//!
//! Bodies welded to a static or kinematic body count as that body: a rod between two planks of a beam has one
//! body on both sides.
//!
//! # Squeezes
//!
//! The same happens if a kinematic body leaves others no room. A body is in a squeeze if it touches a
//! kinematic body, or contacts deeper than the slop connect it with one that does; it is in a jam there if
//! two of its deep contacts oppose each other, whichever bodies they touch. All contacts of such a body, also
//! those that are not deep, start a step without impulses: three that press from three sides hold each other
//! as well. Bodies under a heavy one, which are as deep in each other, keep their impulses.
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

use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::constraints::Passes;
use crate::engine::constraints::kernels::types::Joined;
use crate::engine::constraints::step::CollisionScene;
use crate::engine::contacts::{Contact, ManifoldPoint};
use crate::engine::disjoint::DisjointSets;
use crate::engine::lanes::held;
use crate::engine::narrowphase::Margins;

/// Normals with a smaller product oppose each other (1).
const OPPOSED: f32 = -0.5;

/// Finds jams; reuses its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Jams {
    /// Deep contacts: bodies by which they are grouped, index, and whether the normal keeps its sign.
    deep: Vec<([u32; 2], u32, bool)>,
    /// Bodies that touch a kinematic one, and how fast its surface is there (m/s).
    pressed: Vec<(u32, f32)>,
    /// V of the squeeze that a body is in (m/s), negative if it is in none.
    squeezed: Vec<f32>,
    /// Bodies in a jam of a squeeze, by number, and the bound of their speed (m/s).
    jammed: Vec<(u32, f32)>,
    /// Bodies that welds hold together.
    welded: DisjointSets,
    /// Non-dynamic body of each welded set, if any, at the lowest index of the set. `[bodies]`
    holders: Vec<u32>,
}

impl Jams {
    /// Zeroes the impulses of contacts that push against each other, and finds bodies in a jam. `push_speed`: m/s.
    pub fn release(&mut self, scene: &mut CollisionScene<'_>, push_speed: f32) {
        let slop = Margins::of(scene.length_unit).slop;
        let (contacts, bodies, types) = (&mut *scene.contacts, scene.bodies, scene.types);
        self.deep.clear();
        self.pressed.clear();
        self.jammed.clear();
        for (i, contact) in contacts.iter().enumerate() {
            if contact.manifold.points().iter().any(|point| point.separation < -slop) {
                self.deep.push(([contact.body_a, contact.body_b], i as u32, true));
            }
            for (by, of) in [(contact.body_a, contact.body_b), (contact.body_b, contact.body_a)] {
                if bodies.kind[by as usize] == BodyKind::Kinematic {
                    self.pressed.push((of, surface_speed(bodies, contact, by)));
                }
            }
        }
        if !self.deep.is_empty() {
            self.hold(types, bodies);
        }
        self.squeeze(&bodies.kind);
        self.deep.sort_unstable();
        for group in self.deep.chunk_by(|p, q| p.0 == q.0).filter(|group| group.len() > 1) {
            let normal = |contacts: &[Contact], i: u32, is_own: bool| {
                let n = contacts[i as usize].manifold.normal;
                if is_own { n } else { -n }
            };
            let [body, same] = group[0].0;
            if body != same && bodies.is_dynamic(body as usize) && bodies.is_dynamic(same as usize) {
                continue;
            }
            let mut is_jam = false;
            for &(_, i, is_own) in group {
                let n = normal(contacts, i, is_own);
                if group.iter().any(|&(_, j, is_own)| n.dot(normal(contacts, j, is_own)) < OPPOSED) {
                    is_jam = true;
                    forget(&mut contacts[i as usize]);
                }
            }
            if is_jam && body == same {
                let i = body as usize;
                let gyration = bodies.inv_mass[i] / bodies.inv_inertia[i];
                let had = speed(bodies.velocity(i).to_array(), bodies.angular_velocity[i], gyration);
                let lent = 2.0 * self.squeezed[i] + push_speed;
                self.jammed.push((body, lent.max(had + scene.gravity.length() * scene.dt)));
            }
        }
        if !self.jammed.is_empty() {
            let is_jammed = |body| self.jammed.binary_search_by_key(&body, |j| j.0).is_ok();
            contacts.iter_mut().filter(|c| is_jammed(c.body_a) || is_jammed(c.body_b)).for_each(forget);
        }
    }

    /// Replaces welded bodies of deep contacts by the non-dynamic body that holds them, except within one
    /// set.
    fn hold(&mut self, types: &[Joined], bodies: &Bodies) {
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

    /// Clears the list of bodies in a jam.
    pub fn clear(&mut self) {
        self.jammed.clear();
    }

    /// Bounds the speeds of bodies in a jam.
    pub fn bound(&self, passes: &mut Passes<'_>) {
        if self.jammed.is_empty() {
            return;
        }
        let rows = &mut passes.parts().work.rows;
        for &(body, most) in &self.jammed {
            let row = &mut rows[body as usize];
            let [x, y, spin, inv_mass] = row.velocity;
            let speed = speed([x, y], spin, inv_mass / row.delta[3]);
            if speed > most {
                let part = most / speed;
                row.velocity = [part * x, part * y, part * spin, inv_mass];
            }
        }
    }

    /// Lists the contacts of bodies in a squeeze once more, by body.
    fn squeeze(&mut self, kinds: &[BodyKind]) {
        if self.deep.is_empty() || self.pressed.is_empty() {
            return;
        }
        let is_dynamic = |body: u32| kinds[body as usize] == BodyKind::Dynamic;
        self.squeezed.clear();
        self.squeezed.resize(kinds.len(), -1.0);
        for &(body, speed) in self.pressed.iter().filter(|p| is_dynamic(p.0)) {
            let most = &mut self.squeezed[body as usize];
            *most = most.max(speed);
        }
        let mut grows = true;
        while grows {
            grows = false;
            for ([a, b], ..) in &self.deep {
                for (from, to) in [(*a, *b), (*b, *a)] {
                    let speed = self.squeezed[from as usize];
                    if speed > self.squeezed[to as usize] && is_dynamic(to) {
                        (self.squeezed[to as usize], grows) = (speed, true);
                    }
                }
            }
        }
        for k in 0..self.deep.len() {
            let ([a, b], i, _) = self.deep[k];
            for (own, is_own) in [(a, false), (b, true)] {
                if self.squeezed[own as usize] >= 0.0 {
                    self.deep.push(([own; 2], i, is_own));
                }
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.deep)
            + held(&self.pressed)
            + held(&self.squeezed)
            + held(&self.jammed)
            + self.welded.bytes()
            + held(&self.holders)
    }
}

/// √(v² + ρ²ω²), with ρ² as `gyration` (m²); that of a body that cannot turn is infinite and its spin zero.
fn speed([x, y]: [f32; 2], spin: f32, gyration: f32) -> f32 {
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
