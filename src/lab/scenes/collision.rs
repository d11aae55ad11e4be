//! A7: a frictionless elastic disc hits another, off center.
//!
//! The line of centers is at the angle φ to the path, sin φ = b/(2r) = 0.6. Equal masses exchange their
//! velocities along it and keep those across it: the target leaves with v cos φ = 0.8 v along the line, the
//! other with v sin φ = 0.6 v across it.

use super::holds::Demand;
use super::tolerance::Tolerances;
use super::truth::{Truth, View, Worst, largest};
use super::{Entry, Scene, SceneBody, SceneShape};

/// Initial speed (m/s): twice the restitution threshold of 1 m/s. The approach along the normal is 0.8 of it;
/// at 1 m/s the collision would be plastic.
const SPEED: f64 = 2.0;

pub(super) const OBLIQUE: Entry = Entry::new(
    "oblique_collision",
    "two frictionless elastic discs, one at rest, collide off center",
    |_| {
        // They touch after half a second, at the end of a step, so that the normal of
        // the step that sees the collision is exact and the error is the law's alone.
        let disc = || SceneShape::disc(0.5).friction(0.0).restitution(1.0);
        let bodies = vec![
            SceneBody::dynamic([-0.8 - 0.5 * SPEED, -0.6], disc()).moving([SPEED, 0.0], 0.0),
            SceneBody::dynamic([0.0, 0.0], disc()),
        ];
        Scene::new("oblique_collision", bodies).weightless().steps(60)
    },
)
.known(|scene, _| {
    let truth = Worst::from_time(scene, 0.75, |view| Some(error(view)));
    Truth::new("outgoing speeds, from 0.75 s on", "m/s", 0.8 * SPEED, truth)
})
.holds(&[Demand::GainsNoEnergy])
.within(|scene, speed| Tolerances::impacts(scene).percent(speed));

/// The worse of the two speeds.
fn error(view: &View) -> f64 {
    let off = |i: usize, speed: f64| {
        let [x, y] = view.velocity(i);
        (x.hypot(y) - speed).abs()
    };
    largest([off(0, 0.6 * SPEED), off(1, 0.8 * SPEED)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::truth::by_hand;

    #[test]
    fn the_exact_outcome_has_no_error_and_a_miss_has() {
        let mut bodies = by_hand::bodies(&[[0.0, 0.0], [1.0, 0.0]]);
        // Normal (0.8, 0.6): the target gets 1.6 along it, the other keeps 1.2 along (0.6, −0.8).
        (bodies.velocity_x[0], bodies.velocity_y[0]) = (0.72, -0.96);
        (bodies.velocity_x[1], bodies.velocity_y[1]) = (1.28, 0.96);
        assert!(error(&by_hand::view(&bodies, 50)) < 1e-7);
        (bodies.velocity_x[0], bodies.velocity_y[0]) = (2.0, 0.0);
        (bodies.velocity_x[1], bodies.velocity_y[1]) = (0.0, 0.0);
        assert_eq!(error(&by_hand::view(&bodies, 50)), 1.6);
        bodies.velocity_x[0] = f32::NAN;
        assert_eq!(error(&by_hand::view(&bodies, 50)), f64::INFINITY);
    }
}
