//! The time of impact of round shapes, and the contact frame at that time.
//!
//! Two centers (a corner counts as one) are d apart at the beginning of a step and have the relative velocity
//! u. Their shapes touch when
//!
//! ```text
//! |d + u t| = R,   t = c/(−b + √(b² − u² c)),   b = d·u < 0,   c = (|d| − R)(|d| + R)
//! ```
//!
//! with R the sum of both radii. t > 0 is in the coming step; t < 0 if the contact was first found as an
//! overlap. The impulse acts along n = (d + u t)/R, not along d. These directions differ by up to |u| dt/R.
//! Arms end at the point of touch.
//!
//! An impact is solved at the beginning of the step. Its row replaces the row of the beginning: it has the
//! frame of the time t and the gap −v_n t, which the bodies close until then. This is valid only for impacts
//! that are solved before the step. In a crowd, where sweeps solve them, the motion of two bodies until they
//! touch is not known.

use crate::constraints::kernels::frame::turn;
use crate::constraints::records::features::Layout;
use crate::contacts::{Contact, Manifold};
use crate::lanes::BodyRow;
use crate::narrowphase::circles::arrival;
use glam::Vec2;

/// A round contact, with the frame of the beginning of the step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Round {
    /// From the centers of mass to the centers of the round shapes (m).
    centers: [Vec2; 2],
    /// From the center on a to the center on b at the beginning of the step (m).
    between: Vec2,
    /// R (m).
    reach: f32,
    /// Radii: distances from the centers to the point of touch (m).
    radii: [f32; 2],
}

/// The contact frame at the time of touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TouchFrame {
    /// Time of touch since the beginning of the step (s).
    pub time: f32,
    /// Unit normal from a to b.
    pub normal: Vec2,
    /// r × n and r × t (m).
    pub arms: [[f32; 2]; 2],
    /// Separation in the row (m): the gap that v_n closes by the time of touch, from the start of the step.
    pub separation: f32,
}

impl Round {
    /// Whether a contact is one of round shapes.
    pub fn is_of(contact: &Contact) -> bool {
        let reach = contact.radii[0] + contact.radii[1];
        reach > 0.0 && reach < f32::INFINITY
    }

    /// The round shapes of a contact, if it has any. `is_held`: a is held, and the point lies on b's surface.
    pub fn of(contact: &Contact, is_held: bool) -> Option<Self> {
        if !Self::is_of(contact) {
            return None;
        }
        let (radii, reach) = (contact.radii, contact.radii[0] + contact.radii[1]);
        let Manifold { points: [point, _], normal, .. } = contact.manifold;
        // The point is on b's surface if a is held, else in the middle of the gap.
        let of_gap = if is_held { 0.0 } else { 0.5 };
        let distance = |k: usize, share: f32| share.mul_add(point.separation, radii[k]) * normal;
        let centers = [point.anchor_a - distance(0, 1.0 - of_gap), point.anchor_b + distance(1, of_gap)];
        let between = (point.anchor_a - point.anchor_b) + (centers[1] - centers[0]);
        Some(Round { centers, between, reach, radii })
    }

    /// The frame in which the bodies touch at their current velocities, if between the times `from` and `to`
    /// (s).
    pub fn frame(&self, [a, b]: [&BodyRow; 2], [from, to]: [f32; 2]) -> Option<TouchFrame> {
        let spins = [a.velocity[2], b.velocity[2]];
        let moved = |k: usize| {
            let (row, c) = ([a, b][k], self.centers[k]);
            let of = |v: [f32; 4]| Vec2::new(v[0], v[1]) + v[2] * c.perp();
            [of(row.delta), of(row.velocity)]
        };
        let ([at_a, with_a], [at_b, with_b]) = (moved(0), moved(1));
        let (d, u) = (self.between + (at_b - at_a), with_b - with_a);
        let [time, comes] = arrival(d.dot(u), u.length_squared(), [d.length(), self.reach]);
        if comes <= 0.0 {
            return None;
        }
        if !(from..=to).contains(&time) {
            return None;
        }
        let touching = d + time * u;
        let normal = touching / touching.length();
        // Centers move along tangents, as in u. So both arms end at one point, and angular momentum is
        // conserved.
        let center =
            |k: usize| self.centers[k] + (time * spins[k] + [a, b][k].delta[2]) * self.centers[k].perp();
        let anchors = [center(0) + self.radii[0] * normal, center(1) - self.radii[1] * normal];
        let arms = anchors.map(|r| [r.perp_dot(normal), -r.dot(normal)]);
        let approach =
            (straight(b) - straight(a)).dot(normal) + spins[1] * arms[1][0] - spins[0] * arms[0][0];
        let shifted = |row: &BodyRow, [n, t]: [f32; 2]| {
            let (sine, versine) = turn(row.delta[2]);
            Vec2::new(row.delta[0], row.delta[1]).dot(normal) + sine.mul_add(n, versine * t)
        };
        let separation = -approach * time - (shifted(b, arms[1]) - shifted(a, arms[0]));
        Some(TouchFrame { time, normal, arms, separation })
    }
}

fn straight(row: &BodyRow) -> Vec2 {
    Vec2::new(row.velocity[0], row.velocity[1])
}

impl TouchFrame {
    /// Replaces the frame in the record of its lane, by `put(vector, value)`.
    pub fn write_record(&self, layout: &Layout, rows: [&BodyRow; 2], mut put: impl FnMut(usize, f32)) {
        let [k_nn, k_tt, _] = couplings(rows, self.arms);
        put(0, self.normal.x);
        put(1, self.normal.y);
        put(layout.at(0, layout.separation), self.separation);
        write_arms(layout, 0, self.arms, [1.0 / k_nn, 1.0 / k_tt], put);
    }
}

/// k_nn, k_tt and k_nt of a row between two bodies with these arms (1/kg).
pub(crate) fn couplings([a, b]: [&BodyRow; 2], arms: [[f32; 2]; 2]) -> [f32; 3] {
    let direct = a.velocity[3] + b.velocity[3];
    let turns = |i: usize, j: usize| {
        let of = |row: &BodyRow, arm: [f32; 2]| row.delta[3] * arm[i] * arm[j];
        of(a, arms[0]) + of(b, arms[1])
    };
    [direct + turns(0, 0), direct + turns(1, 1), turns(0, 1)]
}

/// Writes arms (m) and the effective masses 1/k_nn and 1/k_tt (kg) of point `p` into a record, by `put(vector, value)`.
pub(crate) fn write_arms(
    layout: &Layout,
    p: usize,
    arms: [[f32; 2]; 2],
    [normal_mass, tangent_mass]: [f32; 2],
    mut put: impl FnMut(usize, f32),
) {
    let ends = [(layout.arm_a, layout.has_arms[1]), (layout.arm_b, layout.has_arms[0])];
    for ((first, has), [n, t]) in ends.into_iter().zip(arms) {
        if has {
            put(layout.at(p, first), n);
            put(layout.at(p, first) + 1, t);
        }
    }
    put(layout.at(p, layout.normal_mass), normal_mass);
    if layout.has_friction {
        put(layout.at(p, layout.tangent_mass), tangent_mass);
    }
}
