//! B24: slender structures that are statically stable.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B24.pressed",
        "displacement in 10 s of five boxes in a row that 27 box weights press against a wall (25 suffice)",
        "m",
        "the slop",
        pressed,
        Yes("user forces count as loads, and springs are shortened by their sag"),
    ),
    Case::new(
        "B24.needles",
        "displacement in 20 s of a stack of ten boxes of 0.1 m × 1 m",
        "m",
        "the slop",
        needles,
        Yes("loads are fed forward, so a lean decays"),
    ),
    Case::new(
        "B24.tree",
        "displacement in 20 s of five stories, each a plank on a post with a weight at each end",
        "m",
        "the slop",
        tree,
        Yes("loads are fed forward, so a lean decays"),
    ),
    Case::new(
        "B24.turned",
        "displacement in 20 s of a stack of twenty boxes in a world rotated by 45°",
        "m",
        "the slop",
        turned,
        Yes("only gravity defines a direction"),
    ),
];

/// The greatest distance of a body from its start position (m), over all steps of `seconds`.
fn movement(lab: &Lab, scene: Scene, push: Option<f64>, seconds: f64) -> Result<Finding, Failure> {
    let mut world = lab.world(scene)?;
    if let Some(push) = push {
        let last = world.bodies.len() - 1;
        world.bodies.force_x[last] = push as f32;
    }
    let places: Vec<_> = (0..world.bodies.len()).map(|i| center(&world, i)).collect();
    let mut most = 0.0;
    for _ in 0..steps(&world, seconds) {
        world.step()?;
        let of = |(i, from): (usize, &[f64; 2])| {
            let at = center(&world, i);
            (at[0] - from[0]).hypot(at[1] - from[1])
        };
        most = largest(places.iter().enumerate().map(of).chain([most]));
    }
    Ok(Finding::new(most, 0.0, SLOP))
}

/// B24. A row of n unit boxes pressed against a wall needs friction for the weight n m g, which takes a push
/// of n/µ times the weight of one box. The joint at the wall needs a moment of n²/2 m g. A push through its
/// middle provides up to half of itself: 25 m g for five boxes.
fn pressed(lab: &Lab) -> Result<Finding, Failure> {
    let wall = SceneBody::fixed([-0.5, 0.0], SceneShape::rectangle(0.5, 20.0));
    let mut bodies = vec![wall];
    bodies.extend(
        (0..5).map(|i| SceneBody::dynamic([f64::from(i) + 0.5, 0.0], SceneShape::rectangle(0.5, 0.5))),
    );
    movement(lab, Scene::new("pressed", bodies), Some(-27.0 * G), 10.0)
}

fn needles(lab: &Lab) -> Result<Finding, Failure> {
    let mut bodies = vec![ground(20.0, 0.6)];
    bodies.extend(
        (0..10).map(|i| SceneBody::dynamic([0.0, f64::from(i) + 0.5], SceneShape::rectangle(0.05, 0.5))),
    );
    movement(lab, Scene::new("needles", bodies), None, 20.0)
}

fn tree(lab: &Lab) -> Result<Finding, Failure> {
    let mut bodies = vec![ground(20.0, 0.6)];
    for storey in 0..5 {
        let floor = 1.1 * f64::from(storey);
        bodies.push(SceneBody::dynamic([0.0, floor + 0.5], SceneShape::rectangle(0.2, 0.5)));
        bodies.push(SceneBody::dynamic([0.0, floor + 1.05], SceneShape::rectangle(2.0, 0.05)));
        bodies.extend(
            [-1.75, 1.75].map(|x| {
                SceneBody::dynamic([x, floor + 1.35], SceneShape::rectangle(0.25, 0.25).density(4.0))
            }),
        );
    }
    movement(lab, Scene::new("tree", bodies), None, 20.0)
}

fn turned(lab: &Lab) -> Result<Finding, Failure> {
    let mut scene = lab.scene("stack:20")?;
    let (angle, half) = (std::f64::consts::FRAC_PI_4, 0.5f64.sqrt());
    let turn = |[x, y]: [f64; 2]| [half * (x - y), half * (x + y)];
    scene.gravity = turn(scene.gravity);
    for body in &mut scene.bodies {
        (body.position, body.angle) = (turn(body.position), body.angle + angle);
    }
    movement(lab, scene, None, 20.0)
}
