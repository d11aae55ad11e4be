//! Pendulums and linkages: motion without losses.

use super::linked::{energy, pin};
use super::parts::*;

/// A rod of 1 m and 0.1 m² that hangs from `top` at an angle (rad) from its lowest position, and does not
/// collide.
pub(super) fn rod(top: [f64; 2], angle: f64) -> SceneBody {
    let (sin, cos) = angle.sin_cos();
    let center = [top[0] + 0.5 * sin, top[1] - 0.5 * cos];
    let rod = SceneBody::dynamic(center, SceneShape::rectangle(0.05, 0.5)).turned(angle);
    SceneBody { group: -1, ..rod }
}

/// A rod on a pin, released at rest at `angle` from its lowest position (rad).
pub(super) fn pendulum(name: &str, angle: f64) -> Scene {
    let joint = SceneJoint::revolute(0, 1, [0.0, 0.0], [0.0, 0.5]);
    Scene::new(name, vec![pin([0.0, 0.0]), rod([0.0, 0.0], angle)]).joined(vec![joint])
}

pub(super) const PENDULUM: Entry =
    Entry::new("pendulum", "a rod on a pin, released 120° from its lowest place, for a minute", |_| {
        pendulum("pendulum", 2.0 * FRAC_PI_3).steps(3600)
    })
    .known(|scene, _| energy(scene, -0.5 * weight(scene)))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(0.005, "half a percent in a minute"));

/// Two rods, both released 120° from the lowest position.
pub(super) const DOUBLE: Entry =
    Entry::new("double_pendulum", "two rods on a pin, released 120° from the lowest place", |_| {
        let angle = 2.0 * FRAC_PI_3;
        let (sin, cos) = angle.sin_cos();
        let bodies = vec![pin([0.0, 0.0]), rod([0.0, 0.0], angle), rod([sin, -cos], angle)];
        let joints = vec![
            SceneJoint::revolute(0, 1, [0.0, 0.0], [0.0, 0.5]),
            SceneJoint::revolute(1, 2, [0.0, -0.5], [0.0, 0.5]),
        ];
        Scene::new("double_pendulum", bodies).joined(joints).steps(3600)
    })
    // Centers at ½ m and 1½ m below the pin.
    .known(|scene, _| energy(scene, -weight(scene)))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(0.01, "A15: 1 % in a minute"));

/// Three cranks of 1 m, parallel at all times, under one coupler: 12 coordinates and 12 rows, one of them
/// redundant, so that it can swing.
pub(super) const FOUR_BAR: Entry =
    Entry::new("four_bar", "a coupler on three parallel cranks: closed loops with a redundant row", |_| {
        let angle = FRAC_PI_3;
        let (sin, cos) = angle.sin_cos();
        let mut bodies = vec![SceneBody::fixed([2.0, 1.0], SceneShape::line(2.0))];
        let mut joints = vec![];
        for k in 0..3 {
            let x = 2.0 * f64::from(k);
            bodies.push(rod([x, 0.0], angle));
            joints.push(SceneJoint::revolute(0, k as usize + 1, [x - 2.0, -1.0], [0.0, 0.5]));
        }
        bodies.push(SceneBody::dynamic([2.0 + sin, -cos], SceneShape::rectangle(2.0, 0.05)));
        joints
            .extend((0..3).map(|k| SceneJoint::revolute(k + 1, 4, [0.0, -0.5], [2.0 * k as f64 - 2.0, 0.0])));
        Scene::new("four_bar", bodies).joined(joints).steps(3600)
    })
    // Three cranks of 0.1 kg at half a meter, a coupler of 0.4 kg at one.
    .known(|scene, _| energy(scene, -weight(scene) * (0.3 * 0.5 + 0.4) / 0.7))
    .holds(&[Demand::GainsNoEnergy])
    .within(|scene, _| Tolerances::standard(scene).truth(0.01, "1 % in a minute, as for A15"));

/// Length of the cradle's rods (m).
const CRADLE: f64 = 5.0;

/// Newton's cradle: the last ball takes over the motion of the first.
pub(super) const CRADLE_OF_FIVE: Entry =
    Entry::new("cradle", "Newton's cradle: five balls on rods, e = 1", |_| {
        let mut bodies = vec![SceneBody::fixed([2.0, CRADLE + 1.0], SceneShape::line(2.0))];
        let mut joints = vec![];
        let (sin, cos) = FRAC_PI_3.sin_cos();
        for i in 0..5 {
            let x = f64::from(i);
            let ball = SceneShape::disc(0.5).friction(0.0).restitution(1.0);
            bodies.push(match i {
                0 => SceneBody::dynamic([-CRADLE * sin, CRADLE * (1.0 - cos)], ball).turned(-FRAC_PI_3),
                _ => SceneBody::dynamic([x, 0.0], ball),
            });
            joints.push(SceneJoint::revolute(0, i as usize + 1, [x - 2.0, -1.0], [0.0, CRADLE]));
        }
        Scene::new("cradle", bodies).joined(joints).steps(150)
    })
    .known(|scene, _| {
        let height = CRADLE * (1.0 - FRAC_PI_3.cos());
        let mut highest = 0.0_f64;
        let end = u64::from(scene.steps);
        let observer = Worst::from_step(1, move |view| {
            highest = highest.max(view.center(5)[1]);
            (view.step >= end).then_some(highest - height)
        });
        Truth::new("greatest height of the last ball", "m", height, observer)
    })
    .within(|scene, height| Tolerances::impacts(scene).percent(height));
