//! Nonlinear conjugate gradients around any iteration on impulses. The change of the impulses in one
//! iteration serves as the gradient.
//!
//! Source: `silcowitz2010`, algorithm 1: r = λ⁺ − λ, β = |r|²/|r⁻|² with a restart if it is above one,
//! p = β p + r, and the next iteration starts from λ⁺ + β p. In scenes with joints, |r|² = Σ r²/m with the
//! effective mass m of each row: joint rows are in N·s and N·m·s, whose squares cannot be added.

use crate::constraints::records::point_vector::{PointVector, difference, energy, scaled, sum, update};
use crate::constraints::vectors::system::System;

/// State within a substep. Its vectors belong to the workspace.
#[derive(Debug)]
pub struct Conjugate {
    last: PointVector,
    swept: PointVector,
    direction: PointVector,
    masses: Option<PointVector>,
    previous: f64,
}

impl Conjugate {
    /// Takes vectors of zeros, and the masses for [`energy`].
    pub fn new([last, swept, direction]: [PointVector; 3], masses: Option<PointVector>) -> Self {
        Conjugate { last, swept, direction, masses, previous: f64::INFINITY }
    }

    /// Starts from the current impulses.
    pub fn begin(&mut self, system: &mut System<'_>) {
        system.lane_impulses(&mut self.last);
    }

    /// Extrapolates along the search direction, and updates impulses and velocities.
    pub fn go_on(&mut self, system: &mut System<'_>) {
        let Conjugate { last, swept, direction, masses, previous } = self;
        system.lane_impulses(swept);
        // `last` becomes r, then the increment of λ.
        update([last], [&*swept], |[last], [swept]| [difference(swept, last)]);
        let square = energy(last, last, masses.as_ref());
        let beta = if square <= *previous && square > 0.0 { (square / *previous) as f32 } else { 0.0 };
        *previous = square;
        update([&mut *last, direction, &mut *swept], [], |[r, p, swept], []| {
            let step = scaled(beta, p);
            [step, sum(r, step), sum(swept, step)]
        });
        system.set_lane_impulses(swept);
        system.push_lanes(last);
        std::mem::swap(last, swept);
    }

    /// The vectors and the masses, to return to the workspace.
    pub fn vectors(self) -> impl DoubleEndedIterator<Item = PointVector> {
        [self.last, self.swept, self.direction].into_iter().chain(self.masses)
    }
}
