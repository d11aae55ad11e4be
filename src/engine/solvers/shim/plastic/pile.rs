//! Impulses that stop what comes down on a pile: momentum goes down to the ground as loads do.
//!
//! Gauss–Seidel takes M/m visits to stop a body of mass M on one of mass m, and n² times as many for n levels of these.
//! Statics takes one from the top to the ground: each body, with what it has been given by those above, is stopped by
//! its supports as well as their laws allow,
//!
//! ```text
//! least |A Λ + (p, L/ρ)|,   Λ_n ≥ 0,   |Λ_t| ≤ µ Λ_n
//! ```
//!
//! (see [`super::statics`]) with its momentum p and its angular momentum L. A plastic impact has the least kinetic energy that
//! impulses of this kind can leave, so they are taken if they leave less than there was; Gauss–Seidel goes on from
//! them. Where a body has nothing under it, as in a row on ice, it would only hand momentum from end to end.

use crate::engine::constraints::numerics::supports::{self, Support};
use crate::engine::lanes::held;
use glam::DVec2;

/// A body that momentum goes through.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carried {
    /// (v_x, v_y, ω) (m/s, rad/s).
    pub velocity: [f64; 3],
    /// 1/kg, 1/(kg m²)
    pub inverse: [f64; 2],
    /// When it was last pushed (s).
    pub time: f32,
}

/// A point at which a body stands on another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bearing {
    /// Which bodies; none below is what does not move.
    pub above: u32,
    pub below: Option<u32>,
    /// Which point.
    pub point: u32,
    /// From the centre of the body below (m).
    pub arm_below: DVec2,
    /// Of the body above. Its load is the impulse found (N·s).
    pub support: Support,
}

/// Bodies, their supports, and how far they are done.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pile {
    pub bodies: Vec<Carried>,
    /// Their rows.
    pub rows: Vec<u32>,
    /// Where a row is in these. `[rows]`
    places: Vec<Option<u32>>,
    /// Those of each body next to each other.
    pub bearings: Vec<Bearing>,
    /// Range of each body's own in `bearings`, and how many bear on it from above.
    links: Vec<([u32; 2], u32)>,
    /// Bodies on which nothing bears that is still to come.
    ready: Vec<u32>,
    /// Of one body.
    supports: Vec<Support>,
}

impl Carried {
    fn energy(&self) -> f64 {
        let [x, y, turn] = self.velocity;
        0.5 * ((x * x + y * y) / self.inverse[0] + self.spin() * turn)
    }

    /// Angular momentum about its centre (N·m·s); of what cannot turn none.
    fn spin(&self) -> f64 {
        if self.inverse[1] > 0.0 { self.velocity[2] / self.inverse[1] } else { 0.0 }
    }

    fn push(&mut self, impulse: DVec2, arm: DVec2) {
        self.velocity[0] += self.inverse[0] * impulse.x;
        self.velocity[1] += self.inverse[0] * impulse.y;
        self.velocity[2] += self.inverse[1] * arm.perp_dot(impulse);
    }
}

impl Pile {
    /// Begins with no body, of so many rows.
    pub fn clear(&mut self, rows: usize) {
        self.bodies.clear();
        self.rows.clear();
        self.bearings.clear();
        self.places.clear();
        self.places.resize(rows, None);
    }

    /// The place of a row in `rows`, from now on if it was not there.
    pub fn place(&mut self, row: u32) -> u32 {
        *self.places[row as usize].get_or_insert_with(|| {
            self.rows.push(row);
            self.rows.len() as u32 - 1
        })
    }

    /// Finds the impulses of its supports, and the part of the kinetic energy that they leave; none if some body has no
    /// support.
    pub fn stop(&mut self) -> Option<f64> {
        self.link();
        let energy = |bodies: &[Carried]| bodies.iter().map(Carried::energy).sum::<f64>();
        let before = energy(&self.bodies);
        let mut next = 0;
        while let Some(&body) = self.ready.get(next) {
            next += 1;
            let ([first, end], _) = self.links[body as usize];
            if first == end {
                return None;
            }
            self.stop_body(body, first as usize..end as usize);
        }
        (next == self.bodies.len()).then(|| energy(&self.bodies) / before)
    }

    fn link(&mut self) {
        self.links.clear();
        self.links.resize(self.bodies.len(), ([0; 2], 0));
        for (place, bearing) in (0..).zip(&self.bearings) {
            let (range, _) = &mut self.links[bearing.above as usize];
            *range = [if range[1] == 0 { place } else { range[0] }, place + 1];
            if let Some(below) = bearing.below {
                self.links[below as usize].1 += 1;
            }
        }
        self.ready.clear();
        self.ready.extend((0..self.bodies.len() as u32).filter(|&body| self.links[body as usize].1 == 0));
    }

    fn stop_body(&mut self, body: u32, range: std::ops::Range<usize>) {
        let carried = &self.bodies[body as usize];
        let (Carried { velocity: [x, y, _], inverse: [inv_mass, inv_inertia], time }, spin) =
            (*carried, carried.spin());
        self.supports.clear();
        self.supports.extend(self.bearings[range.clone()].iter().map(|bearing| bearing.support));
        let gyration = (inv_mass / inv_inertia).sqrt();
        supports::load(&mut self.supports, DVec2::new(x, y) / inv_mass, spin, gyration);
        for (bearing, support) in self.bearings[range].iter_mut().zip(&self.supports) {
            bearing.support = *support;
            self.bodies[body as usize].push(support.force(), support.arm);
            if let Some(below) = bearing.below {
                let carried = &mut self.bodies[below as usize];
                carried.push(-support.force(), bearing.arm_below);
                carried.time = carried.time.max(time);
                let (_, above) = &mut self.links[below as usize];
                *above -= 1;
                if *above == 0 {
                    self.ready.push(below);
                }
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.bodies)
            + held(&self.bearings)
            + held(&self.links)
            + held(&self.ready)
            + held(&self.supports)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Unit boxes in a column, of which the uppermost comes down.
    fn column(masses: &[f64], on_ground: bool) -> Pile {
        let mut pile = Pile::default();
        for (body, mass) in (0..).zip(masses) {
            let velocity = [0.0, if body == 0 { -1.0 } else { 0.0 }, 0.0];
            pile.bodies.push(Carried { velocity, inverse: [1.0 / mass, 6.0 / mass], time: 0.0 });
            let below = (body as usize + 1 < masses.len()).then_some(body + 1);
            if below.is_none() && !on_ground {
                continue;
            }
            for (point, x) in [-0.5, 0.5].into_iter().enumerate() {
                let support = Support {
                    contact: body,
                    point,
                    normal: DVec2::Y,
                    arm: DVec2::new(x, -0.5),
                    friction: 0.5,
                    load: [0.0; 2],
                };
                pile.bearings.push(Bearing {
                    above: body,
                    below,
                    point: 0,
                    arm_below: DVec2::new(x, 0.5),
                    support,
                });
            }
        }
        pile
    }

    #[test]
    fn a_column_on_the_ground_stops() {
        let mut pile = column(&[300.0, 1.0, 2.0, 1.0], true);
        assert!(pile.stop().unwrap() < 1e-4);
        for Carried { velocity, .. } in &pile.bodies {
            assert!(velocity.iter().all(|v| v.abs() < 1e-3), "{velocity:?}");
        }
        for bearing in &pile.bearings {
            assert!((bearing.support.load[0] - 150.0).abs() < 0.1, "{bearing:?}");
        }
    }

    #[test]
    fn one_in_the_air_is_left_alone() {
        assert!(column(&[300.0, 1.0, 2.0, 1.0], false).stop().is_none());
    }
}
