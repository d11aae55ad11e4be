//! Nonlinear conjugate gradients around whatever makes impulses better: the change that it makes is the gradient.
//!
//! Source: `silcowitz2010`, algorithm 1: r = λ⁺ − λ, β = |r|²/|r⁻|² with a restart where it is above one, p = β p + r, and
//! the next iteration begins at λ⁺ + β p.

use crate::engine::constraints::records::point_vector::{PointVector, difference, dot, scaled, sum, update};
use crate::engine::constraints::vectors::system::System;

/// Directions of a substep, with vectors of the workspace.
#[derive(Debug)]
pub struct Conjugate {
    last: PointVector,
    swept: PointVector,
    direction: PointVector,
    previous: f64,
}

impl Conjugate {
    /// With vectors of zeros.
    pub fn new([last, swept, direction]: [PointVector; 3]) -> Self {
        Conjugate { last, swept, direction, previous: f64::INFINITY }
    }

    /// Begins at the impulses that are there.
    pub fn begin(&mut self, system: &mut System<'_>) {
        system.lane_impulses(&mut self.last);
    }

    /// Goes on along the direction; impulses and velocities follow.
    pub fn go_on(&mut self, system: &mut System<'_>) {
        let Conjugate { last, swept, direction, previous } = self;
        system.lane_impulses(swept);
        // From here on `last` is r, then what is added to λ.
        update([last], [&*swept], |[last], [swept]| [difference(swept, last)]);
        let square = dot(last, last);
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

    /// The vectors, for the workspace.
    pub fn vectors(self) -> [PointVector; 3] {
        [self.last, self.swept, self.direction]
    }
}
