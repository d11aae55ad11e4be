//! A7: a frictionless elastic disc hits another, off center.
//!
//! The line of centers is at the angle φ to the path, sin φ = b/(2r) = 0.6. Equal masses exchange their
//! velocities along it and keep those across it: the target leaves with v cos φ = 0.8 v along the line, the
//! other with v sin φ = 0.6 v across it.

use super::parts::*;

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
