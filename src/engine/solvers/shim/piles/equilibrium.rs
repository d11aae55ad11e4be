//! Loads of statics that balance all bodies together: thrust, as in arches and houses of cards.
//!
//! Loads that go down from body to body ([`crate::engine::constraints::numerics::supports`]) know nothing of what leans on each other. They are where
//! projected Gauss–Seidel starts here, on accelerations: with those of free fall a₀, and the loads F,
//!
//! ```text
//! a = a₀ + M⁻¹ Jᵀ F,    F_n ≥ 0,  J_n a ≥ 0,  F_n J_n a = 0,    |F_t| ≤ µ F_n,  J_t a = 0 or |F_t| = µ F_n
//! ```
//!
//! point by point, to and fro, until no body that begins is accelerated by more than [`TOLERANCE`] of gravity by what a
//! visit changes, or [`VISITS`] are spent. A pile whose loads balance already is left as it is; what cannot rest gets the
//! loads with which it begins to fall.

use crate::engine::bodies::Bodies;
use crate::engine::contacts::Contact;
use crate::engine::lanes::held;
use glam::DVec2;

/// Acceleration that a visit may change and be the last, over gravity (1).
const TOLERANCE: f64 = 1e-5;

/// Most visits of points: some milliseconds, once for bodies that begin.
const VISITS: usize = 1 << 18;

/// Balances loads; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub(crate) struct Equilibrium {
    points: Vec<Point>,
    /// (x, y, θ) of each body (m/s², rad/s²).
    accelerations: Vec<[f64; 3]>,
}

/// A point that bears.
#[derive(Clone, Copy, Debug)]
struct Point {
    contact: u32,
    index: u32,
    bodies: [u32; 2],
    /// Inverse masses and inertias; of what does not begin, zero.
    inverse: [[f64; 2]; 2],
    /// n and t.
    axes: [DVec2; 2],
    /// r × n and r × t of a and b (m).
    arms: [[f64; 2]; 2],
    /// Effective masses along both (kg).
    masses: [f64; 2],
    friction: f64,
    /// Along both (N).
    load: [f64; 2],
}

impl Point {
    /// Acceleration of b against a along an axis (m/s²).
    fn acceleration(&self, accelerations: &[[f64; 3]], axis: usize) -> f64 {
        let of = |body: usize| {
            let [x, y, turn] = accelerations[self.bodies[body] as usize];
            self.axes[axis].dot(DVec2::new(x, y)) + turn * self.arms[body][axis]
        };
        of(1) - of(0)
    }

    /// Adds a load along an axis (N).
    fn push(&self, accelerations: &mut [[f64; 3]], axis: usize, load: f64) {
        for (body, load) in [-load, load].into_iter().enumerate() {
            let [inv_mass, inv_inertia] = self.inverse[body];
            let acceleration = &mut accelerations[self.bodies[body] as usize];
            let gained = inv_mass * load * self.axes[axis];
            acceleration[0] += gained.x;
            acceleration[1] += gained.y;
            acceleration[2] += inv_inertia * load * self.arms[body][axis];
        }
    }
}

impl Equilibrium {
    /// Balances the impulses per `h` (s) of the points that `rests` says, on bodies that begin, under `gravity` (m/s²).
    pub fn balance(
        &mut self,
        bodies: &Bodies,
        contacts: &mut [Contact],
        gravity: DVec2,
        h: f32,
        begins: impl Fn(u32) -> bool,
        rests: impl Fn(&Contact, usize) -> bool,
    ) {
        self.points.clear();
        for (index, contact) in contacts.iter().enumerate() {
            if begins(contact.body_a) || begins(contact.body_b) {
                let points = (0..contact.manifold.count as usize).filter(|&p| rests(contact, p));
                self.points.extend(points.map(|p| point(bodies, contact, index as u32, p, h, &begins)));
            }
        }
        if self.points.is_empty() {
            return;
        }
        self.accelerations.clear();
        self.accelerations.extend((0..bodies.len()).map(|i| {
            if !begins(i as u32) {
                return [0.0; 3];
            }
            let [inv_mass, inv_inertia] = [bodies.inv_mass[i], bodies.inv_inertia[i]].map(f64::from);
            let pushed = [bodies.force_x[i], bodies.force_y[i], bodies.torque[i]].map(f64::from);
            let weight = f64::from(bodies.gravity_scale[i]) * gravity;
            [weight.x + inv_mass * pushed[0], weight.y + inv_mass * pushed[1], inv_inertia * pushed[2]]
        }));
        for point in &self.points {
            (0..2).for_each(|axis| point.push(&mut self.accelerations, axis, point.load[axis]));
        }
        let still = TOLERANCE * gravity.length();
        let mut is_reverse = false;
        for _ in 0..VISITS.div_ceil(self.points.len()) {
            let mut greatest = 0.0_f64;
            for i in 0..self.points.len() {
                let i = if is_reverse { self.points.len() - 1 - i } else { i };
                let point = &mut self.points[i];
                for axis in 0..2 {
                    let old = point.load[axis];
                    let wanted = old - point.masses[axis] * point.acceleration(&self.accelerations, axis);
                    let most = point.friction * point.load[0];
                    point.load[axis] = if axis == 0 { wanted.max(0.0) } else { wanted.clamp(-most, most) };
                    let change = point.load[axis] - old;
                    point.push(&mut self.accelerations, axis, change);
                    greatest = greatest.max(change.abs() / point.masses[axis]);
                }
            }
            is_reverse = !is_reverse;
            if greatest <= still {
                break;
            }
        }
        for point in &self.points {
            let stored = &mut contacts[point.contact as usize].manifold.points[point.index as usize];
            [stored.normal_impulse, stored.tangent_impulse] = point.load.map(|load| load as f32 * h);
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.points) + held(&self.accelerations)
    }
}

fn point(
    bodies: &Bodies,
    contact: &Contact,
    index: u32,
    p: usize,
    h: f32,
    begins: &impl Fn(u32) -> bool,
) -> Point {
    let (ends, stored) = ([contact.body_a, contact.body_b], &contact.manifold.points[p]);
    let inverse = ends.map(|body| match begins(body) {
        true => [bodies.inv_mass[body as usize], bodies.inv_inertia[body as usize]].map(f64::from),
        false => [0.0; 2],
    });
    let n = contact.manifold.normal.as_dvec2();
    let axes = [n, -n.perp()];
    let arms = [stored.anchor_a, stored.anchor_b].map(|anchor| axes.map(|u| anchor.as_dvec2().perp_dot(u)));
    let masses = [0, 1].map(|axis| {
        let of = |k: usize| inverse[k][0] + inverse[k][1] * arms[k][axis] * arms[k][axis];
        1.0 / (of(0) + of(1))
    });
    let load = [stored.normal_impulse, stored.tangent_impulse].map(|impulse| f64::from(impulse / h));
    let friction = f64::from(contact.friction);
    Point { contact: index, index: p as u32, bodies: ends, inverse, axes, arms, masses, friction, load }
}
