//! Separates the static deflection of soft contacts from excess penetration.
//!
//! A contact that is a spring of angular frequency ω rests where the spring carries the
//! load: with the load F on the contact point and its effective mass m,
//!
//! ```text
//! F = m ω² s,   s = F/(m ω²)
//! ```
//!
//! whatever the damping and the number of sweeps. A solver with such contacts declares them in its
//! [row](crate::engine::solvers::Variant::softness). The formula holds at rest: in an impact, the impulse of
//! a step is not a load. Floor and excess are therefore those of the last [`REST_WINDOW`], and the floor is
//! meaningless if bodies still fall then.

use super::rest::REST_WINDOW;
use std::collections::VecDeque;

/// s = F/(m ω²) (m): load (N), effective mass (kg), angular frequency (rad/s).
/// Zero if nothing can move.
pub fn floor(load: f64, mass: f64, omega: f64) -> f64 {
    let stiffness = mass * omega * omega;
    if stiffness > 0.0 { load.max(0.0) / stiffness } else { 0.0 }
}

/// Deepest penetration at rest, and the part of it that is static deflection of the springs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depths {
    /// Deepest overlap (m).
    pub penetration: f64,
    /// Largest analytic floor of any point (m).
    pub floor: f64,
    /// Largest overlap beyond its own point's floor (m).
    pub excess: f64,
}

impl Depths {
    /// Adds a point with its overlap and its floor (m).
    pub fn add(&mut self, penetration: f64, floor: f64) {
        self.penetration = self.penetration.max(penetration);
        self.floor = self.floor.max(floor);
        self.excess = self.excess.max(penetration - floor);
    }
}

/// The depths of the last [`REST_WINDOW`], a value per step.
#[derive(Clone, Debug, Default)]
pub struct RestDepths {
    steps: VecDeque<Depths>,
}

impl RestDepths {
    /// Adds a step of `dt` (s).
    pub fn add(&mut self, depths: Depths, dt: f64) {
        self.steps.push_back(depths);
        if self.steps.len() > (REST_WINDOW / dt).round().max(1.0) as usize {
            self.steps.pop_front();
        }
    }

    /// The largest value of each.
    pub fn largest(&self) -> Depths {
        self.steps.iter().fold(Depths::default(), |worst, d| Depths {
            penetration: worst.penetration.max(d.penetration),
            floor: worst.floor.max(d.floor),
            excess: worst.excess.max(d.excess),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_excess_is_over_each_points_own_floor() {
        let mut depths = Depths::default();
        depths.add(0.5, 0.25);
        depths.add(0.375, 0.0);
        depths.add(-1.0, 0.0);
        // 0.375 beyond no floor is more than 0.5 beyond 0.25.
        assert_eq!(depths, Depths { penetration: 0.5, floor: 0.25, excess: 0.375 });
    }

    #[test]
    fn what_was_before_the_window_is_forgotten() {
        let mut rest = RestDepths::default();
        let deep = Depths { penetration: 3.0, floor: 2.0, excess: 1.0 };
        rest.add(deep, 0.25);
        assert_eq!(rest.largest(), deep);
        for _ in 0..3 {
            rest.add(Depths::default(), 0.25);
        }
        assert_eq!(rest.largest(), deep);
        rest.add(Depths { floor: 0.5, ..Depths::default() }, 0.25);
        assert_eq!(rest.largest(), Depths { floor: 0.5, ..Depths::default() });
    }
}
