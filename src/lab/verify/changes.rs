//! B25: gravity, pushes and step lengths that change while a pile rests. Nothing may move, because each
//! change keeps the equilibrium.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::bodies::{BodyDef, BodyKind, ShapeDef};
use crate::engine::shapes::Shape;
use crate::engine::world::World;
use crate::lab::scenes::Scene;
use glam::Vec2;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B25.gravity",
        "largest displacement in a stack of twenty boxes, 20 s after gravity grew tenfold",
        "m",
        "the slop",
        gravity,
        Yes("loads change with gravity, and loads are fed forward, so a lean decays"),
    ),
    Case::new(
        "B25.off",
        "largest speed in a stack of twenty boxes in 5 s after gravity is turned off",
        "m/s",
        "0.05 m/s, as for B9",
        off,
        Yes("loads of gravity vanish with it"),
    ),
    Case::new(
        "B25.on",
        "largest displacement in a stack of twenty boxes in 10 s after gravity is turned on",
        "m",
        "the slop",
        on,
        Yes("bodies without loads start with those of statics"),
    ),
    Case::new(
        "B25.heavy",
        "largest displacement in 20 s of twenty boxes with 100 times the gravity on the top box",
        "m",
        "the slop",
        heavy,
        Yes("loads are fed forward, so a lean decays"),
    ),
    Case::new(
        "B25.pushed",
        "largest sideways displacement in 20 s of twenty boxes under 100 box weights, applied to the top box at once",
        "m",
        "the slop",
        pushed,
        Yes("user forces count as weights, and their loads converge within 32 steps"),
    ),
    Case::new(
        "B25.set",
        "largest displacement in 10 s of ten boxes after one of 100 times the mass is placed on top",
        "m",
        "the slop",
        set,
        Yes("a new load reaches the whole pile in one step"),
    ),
    Case::new(
        "B25.step",
        "largest speed in a stack of twenty boxes at steps of 1/60, 1/240, 1/30 and 1/60 s, one second each",
        "m/s",
        "0.05 m/s, as for B9",
        step,
        Yes("impulses and loads scale with the length of the step"),
    ),
];

/// Twenty unit boxes.
fn boxes(lab: &Lab) -> Result<Scene, Failure> {
    lab.scene("stack:20")
}

/// A world with these boxes after 3 s at rest.
fn rested(lab: &Lab) -> Result<World, Failure> {
    lab.run(boxes(lab)?, 3.0, |_| ())
}

/// Runs `world` for `seconds`. Returns the greatest displacement of a body along x and along y (m), and the
/// greatest speed (m/s).
fn watch(world: &mut World, seconds: f64) -> Result<[f64; 3], Failure> {
    let places: Vec<_> = (0..world.bodies.len()).map(|i| center(world, i)).collect();
    let mut most = [0.0; 3];
    for _ in 0..steps(world, seconds) {
        world.step()?;
        for (i, from) in places.iter().enumerate() {
            let (at, [vx, vy]) = (center(world, i), velocity(world, i));
            let found = [(at[0] - from[0]).abs(), (at[1] - from[1]).abs(), vx.hypot(vy)];
            most = [0, 1, 2].map(|k| largest([most[k], found[k]]));
        }
    }
    Ok(most)
}

fn moves(world: &mut World, seconds: f64) -> Result<Finding, Failure> {
    let [x, y, _] = watch(world, seconds)?;
    Ok(Finding::new(x.hypot(y), 0.0, SLOP))
}

fn gravity(lab: &Lab) -> Result<Finding, Failure> {
    let mut world = rested(lab)?;
    world.settings.gravity[1] *= 10.0;
    moves(&mut world, 20.0)
}

fn off(lab: &Lab) -> Result<Finding, Failure> {
    let mut world = rested(lab)?;
    world.settings.gravity = [0.0; 2];
    let [.., speed] = watch(&mut world, 5.0)?;
    Ok(Finding::new(speed, 0.0, 0.05))
}

fn on(lab: &Lab) -> Result<Finding, Failure> {
    let scene = boxes(lab)?;
    let gravity = scene.gravity.map(|g| g as f32);
    let mut world = lab.run(scene.weightless(), 3.0, |_| ())?;
    world.settings.gravity = gravity;
    moves(&mut world, 10.0)
}

fn heavy(lab: &Lab) -> Result<Finding, Failure> {
    let mut scene = boxes(lab)?;
    if let Some(highest) = scene.bodies.last_mut() {
        highest.gravity_scale = 100.0;
    }
    let mut world = lab.world(scene)?;
    moves(&mut world, 20.0)
}

fn pushed(lab: &Lab) -> Result<Finding, Failure> {
    let mut world = rested(lab)?;
    if let Some((highest, mass, _)) = dynamic(&world).last() {
        world.bodies.force_y[highest] = (-100.0 * G * mass) as f32;
    }
    let [x, ..] = watch(&mut world, 20.0)?;
    Ok(Finding::new(x, 0.0, SLOP))
}

fn set(lab: &Lab) -> Result<Finding, Failure> {
    let mut world = lab.run(lab.scene("stack:10")?, 3.0, |_| ())?;
    let highest = largest(dynamic(&world).map(|(i, ..)| center(&world, i)[1]));
    let shape = Shape::rectangle("B25.set", Vec2::splat(0.5), Vec2::ZERO, 0.0, 0.0)
        .map_err(|error| Failure::Unmeasured(error.to_string()))?;
    let heavy = ShapeDef { density: 100.0, ..ShapeDef::new(shape) };
    let body = BodyDef::new(BodyKind::Dynamic, [0.0, highest + 1.0], vec![heavy]);
    world.add_body(&body).map_err(|error| Failure::Unmeasured(error.to_string()))?;
    moves(&mut world, 10.0)
}

fn step(lab: &Lab) -> Result<Finding, Failure> {
    let mut world = rested(lab)?;
    let usual = world.settings.dt;
    let mut fastest = 0.0;
    for factor in [1.0, 0.25, 2.0, 1.0] {
        world.settings.dt = factor * usual;
        fastest = largest([fastest, watch(&mut world, 1.0)?[2]]);
    }
    Ok(Finding::new(fastest, 0.0, 0.05))
}
