//! B24: piles near the limit of static stability.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use std::f64::consts::PI;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "B24.deck",
        "slip in 10 s of twenty plates on an incline, µ 3 % above tan θ",
        "m",
        "A1.stick: 1e-4 m",
        deck,
        Yes("impulses start from the loads of statics, which spread friction evenly over the points"),
    ),
    Case::new(
        "B24.bricks",
        "overhang at which eight bricks fall, over L/2 (1 + 1/2 + … + 1/8)",
        "1",
        "0.1 %, as for A1",
        bricks,
        Yes("each point's spring is shortened by the sag of its own load, so no joint turns"),
    ),
    Case::new(
        "B24.logs",
        "smallest friction under and between three stacked logs, over (2 − √3)/3 and 2 − √3, larger error",
        "1",
        "1 %, as for B10",
        logs,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "B24.shaft",
        "loads of two frictionless discs in a shaft (floor, walls, each other), worst",
        "N",
        "momentum per step at the speed limit of B5.jitter",
        shaft,
        Yes("two bodies: their four rows converge in a few warm-started steps"),
    ),
];

/// B24. Every joint needs friction of tan θ times its load. The weight acts 0.29 m from the middle of a half
/// width of 0.5 m.
fn deck(lab: &Lab) -> Result<Finding, Failure> {
    let (friction, half) = (0.3, 0.05);
    let slope = f64::atan(friction / 1.03);
    let mut bodies = vec![ground(50.0, friction)];
    bodies.extend((0..20).map(|i| {
        let plate = SceneShape::rectangle(0.5, half).friction(friction);
        SceneBody::dynamic([0.0, half * f64::from(2 * i + 1)], plate)
    }));
    let mut scene = Scene::new("deck", bodies);
    scene.gravity = [G * slope.sin(), -G * slope.cos()];
    let world = lab.run(scene, 10.0, |_| ())?;
    let off = dynamic(&world).map(|(i, _, _)| center(&world, i)[0].abs());
    Ok(Finding::new(largest(off), 0.0, 1e-4))
}

/// B24. Brick k from the top may project by L/(2 k) over the next one: the center of mass of all bricks above
/// is then at its edge.
fn bricks(lab: &Lab) -> Result<Finding, Failure> {
    let (count, half, high) = (8, 1.0, 0.25);
    let found = bisect(0.9, 1.1, |part| {
        let table = SceneBody::fixed([0.0, -0.5], SceneShape::rectangle(half, 0.5));
        let (mut bodies, mut out) = (vec![table], 0.0);
        for i in 0..count {
            out += part * half / f64::from(count - i);
            let brick = SceneShape::rectangle(half, high);
            bodies.push(SceneBody::dynamic([out, high * f64::from(2 * i + 1)], brick));
        }
        let world = lab.run(Scene::new("bricks", bodies), 8.0, |_| ())?;
        Ok((center(&world, count as usize)[0] - out).abs() > 0.1)
    })?;
    Ok(Finding::new(found, 1.0, 1e-3))
}

/// B24. Two touching logs carry a third one with a normal force N at 30° from the vertical. A lower log rests
/// without rolling if the friction F at both its contacts is the same and N sin 30° = F (1 + cos 30°), so F/N
/// = tan 15° = 2 − √3. The third log weighs 2 (N cos 30° + F sin 30°) = 2 N, so each ground contact bears 3
/// N, with the friction F.
fn logs(lab: &Lab) -> Result<Finding, Failure> {
    let radius = 0.5;
    let between = 2.0 - 3f64.sqrt();
    let stands = |on_ground: f64, between: f64| -> Result<bool, Failure> {
        // Friction coefficients combine as the root of their product.
        let floor = ground(50.0, on_ground * on_ground / between);
        let log = |x: f64, y: f64| SceneBody::dynamic([x, y], SceneShape::disc(radius).friction(between));
        let top = radius * (1.0 + 3f64.sqrt());
        let scene = Scene::new("logs", vec![floor, log(-radius, radius), log(radius, radius), log(0.0, top)]);
        let world = lab.run(scene, 4.0, |_| ())?;
        Ok((center(&world, 3)[1] - top).abs() < 0.02)
    };
    let below = bisect(0.8, 1.2, |part| stands(part * between / 3.0, 0.6))?;
    let beside = bisect(0.8, 1.2, |part| stands(0.6, part * between))?;
    let worst = if (below - 1.0).abs() > (beside - 1.0).abs() { below } else { beside };
    Ok(Finding::new(worst, 1.0, 0.01).note(format!("{below:.5} under, {beside:.5} between")))
}

/// B24. Discs of radius r in a shaft of width w touch with their line of centers at sin β = (w − 2 r)/2 r
/// from the vertical. The floor bears 2 m g, each wall m g tan β, and the contact between the discs m g/cos
/// β.
fn shaft(lab: &Lab) -> Result<Finding, Failure> {
    let (radius, width) = (0.5, 1.6);
    let sin: f64 = (width - 2.0 * radius) / (2.0 * radius);
    let cos = (1.0 - sin * sin).sqrt();
    let wall = |x: f64| SceneBody::fixed([x, 0.0], SceneShape::line(20.0).friction(0.0)).turned(PI / 2.0);
    let disc = |x: f64, y: f64| SceneBody::dynamic([x, y], SceneShape::disc(radius).friction(0.0));
    let bodies = vec![
        ground(20.0, 0.0),
        wall(0.0),
        wall(width),
        disc(radius, radius),
        disc(width - radius, radius + 2.0 * radius * cos),
    ];
    let world = lab.run(Scene::new("shaft", bodies), 4.0, |_| ())?;
    let weight = 0.5 * mass(&world) * G;
    let load = |a: u32| {
        let of_a = world.contacts.iter().filter(|c| c.body_a == a);
        of_a.map(normal_impulse).sum::<f64>() / f64::from(world.settings.dt)
    };
    let truths = [2.0 * weight, weight * sin / cos, weight * sin / cos, weight / cos];
    let off = (0..4).map(|a| (load(a) - truths[a as usize]).abs());
    Ok(Finding::new(largest(off), 0.0, load_tolerance(mass(&world), 1.0 / 60.0)))
}
