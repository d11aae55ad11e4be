//! B23: loads that appear, disappear or move within a step.

use super::Required::{No, Yes};
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::bodies::BodyKind;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use std::f64::consts::PI;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B23.release",
        "spread of the velocities of ten boxes after the support of their column is removed",
        "m/s",
        "0.05 m/s, as for B9",
        release,
        No(
            "the first substep starts from the impulses of the removed load, and sweeps do not undo all of them",
        ),
    ),
    Case::new(
        "B23.rolling",
        "speed of a disc of 100 kg that rolls over a floor of boxes of 0.25 kg, after 4 s",
        "m/s",
        "1 %, as for A1.slip",
        rolling,
        No("a box under new load sinks before its springs are shortened, so the next edge is a step"),
    ),
    Case::new(
        "B23.dropped",
        "largest upward speed of ten 0.1 m boxes that fall on each other across 1 cm gaps",
        "m/s",
        "g dt: time is resolved to one step",
        dropped,
        Yes("impacts faster than 2 a dt are solved before the step, and push no bodies apart"),
    ),
    Case::new(
        "B23.heavy",
        "largest upward speed of a box of 300 times the mass dropped from 2 m on a stack of ten boxes, and on a pyramid of 55",
        "m/s",
        "g dt: time is resolved to one step",
        heavy,
        No(
            "an impact may visit each point that it reaches 8 times on average; 300 times the mass takes thousands",
        ),
    ),
];

/// B23. Two frictionless plates under a column of ten boxes move apart and leave both its corners at the same
/// time, 1.99 s after the start. Nothing supports the column from then on, so all boxes fall at the same
/// speed.
fn release(lab: &Lab) -> Result<Finding, Failure> {
    let (speed, wait, count) = (5.0, 1.99, 10);
    let end = speed * wait - 0.5;
    let plate = |side: f64| {
        let shape = SceneShape::rectangle(0.5 * (end + 2.0), 0.5).friction(0.0);
        SceneBody::new(BodyKind::Kinematic, [-side * 0.5 * (end - 2.0), -0.5], shape)
            .moving([side * speed, 0.0], 0.0)
    };
    let mut bodies = vec![plate(1.0), plate(-1.0)];
    bodies.extend(
        (0..count).map(|i| SceneBody::dynamic([0.0, f64::from(i) + 0.5], SceneShape::rectangle(0.5, 0.5))),
    );
    let world = lab.run(Scene::new("release", bodies), wait + 0.5, |_| ())?;
    let speeds: Vec<f64> = dynamic(&world).map(|(i, _, _)| velocity(&world, i)[1]).collect();
    let fastest = speeds.iter().copied().fold(f64::INFINITY, f64::min);
    let slowest = speeds.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if fastest > -0.3 * G {
        return Err(Failure::Unmeasured("the column does not fall".into()));
    }
    Ok(Finding::new(slowest - fastest, 0.0, 0.05))
}

/// B23. Without restitution, a heavy box stays where it lands, and the pile below it stands.
fn heavy(lab: &Lab) -> Result<Finding, Failure> {
    let boxed = |x: f64, y: f64| SceneBody::dynamic([x, y], SceneShape::rectangle(0.5, 0.5));
    let (mut fastest, mut dt) = (0.0, 0.0);
    for base in [1, 10] {
        let mut bodies = vec![ground(20.0, 0.6)];
        for row in 0..10 {
            let count = if base == 1 { 1 } else { base - row };
            bodies.extend(
                (0..count).map(|i| boxed(f64::from(i) - 0.5 * f64::from(count - 1), f64::from(row) + 0.5)),
            );
        }
        let top = bodies.len();
        bodies.push(SceneBody::dynamic([0.0, 12.5], SceneShape::rectangle(0.5, 0.5).density(300.0)));
        let world = lab.run(Scene::new("heavy", bodies), 3.0, |world| {
            fastest = largest([velocity(world, top)[1], fastest]);
        })?;
        let height = world.bodies.center(top)[1];
        if (height - 10.5).abs() > 0.1 {
            return Err(Failure::Unmeasured(format!("the heavy box is at {height:.3} m")));
        }
        dt = f64::from(world.settings.dt);
    }
    Ok(Finding::new(fastest, 0.0, G * dt))
}

/// B23. Boxes side by side form a flat floor: a rolling disc keeps its speed, whatever its weight.
fn rolling(lab: &Lab) -> Result<Finding, Failure> {
    let (radius, half, mass, speed, count) = (1.0, 0.25, 100.0, 5.0, 80);
    let mut bodies = vec![ground(200.0, 0.6)];
    bodies.extend(
        (0..count).map(|i| {
            SceneBody::dynamic([2.0 * half * f64::from(i), half], SceneShape::rectangle(half, half))
        }),
    );
    let disc = SceneShape::disc(radius).density(mass / (PI * radius * radius));
    bodies.push(
        SceneBody::dynamic([6.0 * half, 2.0 * half + radius], disc).moving([speed, 0.0], -speed / radius),
    );
    let last = bodies.len() - 1;
    let world = lab.run(Scene::new("rolling", bodies), 4.0, |_| ())?;
    Ok(Finding::new(velocity(&world, last)[0], speed, 0.01 * speed))
}

/// B23. Bodies that land without restitution never move up.
fn dropped(lab: &Lab) -> Result<Finding, Failure> {
    let (half, gap) = (0.05, 0.01);
    let mut bodies = vec![ground(20.0, 0.6)];
    bodies.extend((0..10).map(|i| {
        SceneBody::dynamic([0.0, half + f64::from(i) * (2.0 * half + gap)], SceneShape::rectangle(half, half))
    }));
    let mut fastest = 0.0;
    let world = lab.run(Scene::new("dropped", bodies), 2.0, |world| {
        fastest = largest(dynamic(world).map(|(i, _, _)| velocity(world, i)[1]).chain([fastest]));
    })?;
    Ok(Finding::new(fastest, 0.0, G * f64::from(world.settings.dt)))
}
