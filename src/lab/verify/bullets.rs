//! A28: bodies that move farther than their width in one step, with continuous collision.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A28.wall",
        "penetration of 5 cm bodies at 300 m/s into a 1 cm wall, worst of shapes and of impact times within a step",
        "m",
        "the slop: a contact, not a passage",
        wall,
        Yes("with continuous collision a body stops where it would pass through a surface"),
    ),
    Case::new(
        "A28.plate",
        "penetration of a 5 cm bullet at 300 m/s into a dynamic 1 cm plate of 1000 times its mass",
        "m",
        "slop, as above",
        plate,
        Yes("bullets stop at dynamic bodies as well"),
    ),
];

/// Distance traveled in one step (m): 300 m/s at 60 Hz.
const WAY: f64 = 5.0;

/// Greatest depth (m) of a projectile's far side beyond the target's near side. The projectile comes from the
/// left; the near side is at x = 0.
fn thrown(lab: &Lab, target: &SceneBody, bullet: bool) -> Result<f64, Failure> {
    let lab = lab.continuous();
    let shapes =
        [SceneShape::disc(0.05), SceneShape::rectangle(0.05, 0.05), SceneShape::rectangle(0.05, 0.02)];
    let mut deepest = f64::NEG_INFINITY;
    for (shape, k) in shapes.iter().flat_map(|shape| (0..10).map(move |k| (shape, k))) {
        let start = -12.0 - WAY * f64::from(k) / 10.0;
        let thrown = SceneBody { bullet, ..SceneBody::dynamic([start, 0.0], shape.clone()) };
        let bodies = vec![target.clone(), thrown.moving([60.0 * WAY, 0.0], 0.0)];
        let scene = Scene::new("bullet", bodies).weightless();
        lab.run(scene, 0.5, |world| {
            // Displacement of the target since the start.
            let moved = center(world, 0)[0] - target.position[0];
            deepest = largest([deepest, center(world, 1)[0] + 0.05 - moved]);
        })?;
    }
    Ok(deepest)
}

/// A28. The far side of a stopped projectile must not pass the near side of the wall.
fn wall(lab: &Lab) -> Result<Finding, Failure> {
    let wall = SceneBody::fixed([0.005, 0.0], SceneShape::rectangle(0.005, 2.0));
    Ok(Finding::new(thrown(lab, &wall, false)?.max(0.0), 0.0, SLOP))
}

/// A28. A plate of 1 cm × 2 m with a thousand times the mass of the largest projectile, 0.01 m² of 1 kg/m²:
/// 500 kg/m².
fn plate(lab: &Lab) -> Result<Finding, Failure> {
    let plate = SceneShape::rectangle(0.005, 1.0).density(500.0);
    let plate = SceneBody::dynamic([0.005, 0.0], plate);
    Ok(Finding::new(thrown(lab, &plate, true)?.max(0.0), 0.0, SLOP))
}
