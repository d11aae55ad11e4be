//! A23 and A24: bodies on moving supports.

use super::Required::Yes;
use super::lab::*;
use super::{Case, Failure, Finding, Lab};
use crate::engine::bodies::BodyKind;
use crate::engine::world::World;
use crate::lab::scenes::{Scene, SceneBody, SceneShape};
use std::f64::consts::PI;

pub(super) static CASES: &[Case] = &[
    Case::new(
        "A23.lift",
        "load on a lift that accelerates at g/2, worst of its second second",
        "N",
        "1 %",
        lift,
        Yes("one body: its rows converge within a step"),
    ),
    Case::new(
        "A23.slip",
        "acceleration at which a box slips on a platform, over µ g",
        "1",
        "0.1 %, as for A1",
        platform,
        Yes("Coulomb's law in the last sweep"),
    ),
    Case::new(
        "A23.train",
        "force between boxes that a wall pushes along smooth ground, worst of five",
        "N",
        "1 %",
        train,
        Yes("an accelerating wall is an impact in every step, which spreads along the row before the step"),
    ),
    Case::new(
        "A23.shake",
        "gap or overlap under a box on a platform that shakes at g/2, all steps",
        "m",
        "how far the platform leaves its parabola in a step, a dt²/2",
        shake,
        Yes("one body: its rows converge within a step"),
    ),
    Case::new(
        "A23.carried",
        "slip of a stack of five boxes that a platform carries at 30 m/s for 5 s",
        "m",
        "A1.stick: 1e-4 m",
        carried_stack,
        Yes("contacts see differences of velocities"),
    ),
    Case::new(
        "A23.paddle",
        "rebound speed of an elastic disc from an approaching paddle",
        "m/s",
        "1e-5 of 8 m/s: exact in f32",
        paddle,
        Yes("rebounds use the relative velocity of the surfaces"),
    ),
    Case::new(
        "A24.belt",
        "speed of a disc once it rolls on a belt",
        "m/s",
        "0.5 %, as for A3",
        belt,
        Yes("the contact point of a disc does not turn with it"),
    ),
    Case::new(
        "A24.tiles",
        "distance of a box that slides over a floor of square tiles until it stops",
        "m",
        "1 %, as for A2",
        tiles,
        Yes("faces that only graze each other make no contact"),
    ),
    Case::new(
        "A24.seams",
        "speed that a rolling disc loses on a floor of square tiles, and height that it gains",
        "m/s, m",
        "1e-3",
        seams,
        Yes("gaps of circles are taken at their closest approach"),
    ),
];

fn platform_of(friction: f64) -> SceneBody {
    SceneBody::new(BodyKind::Kinematic, [0.0, -0.5], SceneShape::rectangle(100.0, 0.5).friction(friction))
}

/// Runs for `seconds`. Before each step, body 0 is set to the velocity that `of` returns for the end of the
/// step (m/s).
fn carry(
    lab: &Lab,
    scene: Scene,
    seconds: f64,
    of: impl Fn(f64) -> [f64; 2],
    mut look: impl FnMut(&World),
) -> Result<World, Failure> {
    let mut world = lab.world(scene)?;
    for _ in 0..steps(&world, seconds) {
        let [x, y] = of(time(&world) + f64::from(world.settings.dt));
        (world.bodies.velocity_x[0], world.bodies.velocity_y[0]) = (x as f32, y as f32);
        world.step()?;
        look(&world);
    }
    Ok(world)
}

/// A23. The load is m (g + a) on a lift that accelerates upward.
fn lift(lab: &Lab) -> Result<Finding, Failure> {
    let (a, mass) = (0.5 * G, 1.0);
    let body = SceneBody::dynamic([0.0, 0.5], SceneShape::rectangle(0.5, 0.5).density(mass));
    let scene = Scene::new("lift", vec![platform_of(0.6), body]);
    let truth = mass * (G + a);
    let mut worst = truth;
    carry(
        lab,
        scene,
        2.0,
        |t| [0.0, a * t],
        |world| {
            if time(world) > 1.0 {
                let load: f64 = world.contacts.iter().map(|c| impulse(c)[1]).sum();
                let load = load / f64::from(world.settings.dt);
                worst = if (load - truth).abs() >= (worst - truth).abs() { load } else { worst };
            }
        },
    )?;
    Ok(Finding::new(worst, truth, 0.01 * truth))
}

/// A23. A box on a platform that accelerates ε µ g above µ g falls behind by µ g ε t. A slip of 1 mm/s after
/// 2 s resolves ε = 1e-4.
fn platform(lab: &Lab) -> Result<Finding, Failure> {
    let friction = 0.5;
    let truth = friction * G;
    let found = bisect(0.5 * truth, 2.0 * truth, |a| {
        let body = SceneBody::dynamic([0.0, 0.25], SceneShape::rectangle(0.5, 0.25).friction(friction));
        let scene = Scene::new("platform", vec![platform_of(friction), body]);
        let world = carry(lab, scene, 2.0, |t| [a * t, 0.0], |_| ())?;
        Ok(velocity(&world, 0)[0] - velocity(&world, 1)[0] > 1e-3)
    })?;
    Ok(Finding::new(found / truth, 1.0, 1e-3))
}

/// A23. A wall that accelerates at a pushes five boxes: contact i bears (5 − i) m a.
fn train(lab: &Lab) -> Result<Finding, Failure> {
    let (count, a) = (5, 4.0);
    let wall = SceneShape::rectangle(0.5, 0.5).friction(0.0);
    let mut bodies = vec![SceneBody::new(BodyKind::Kinematic, [-0.5, 0.6], wall), ground(100.0, 0.0)];
    for i in 0..count {
        let square = SceneShape::rectangle(0.5, 0.5).friction(0.0);
        bodies.push(SceneBody::dynamic([0.5 + f64::from(i), 0.5], square));
    }
    let scene = Scene::new("train", bodies);
    let mut worst = 0.0;
    carry(
        lab,
        scene,
        3.0,
        |t| [a * t, 0.0],
        |world| {
            if time(world) > 2.0 {
                for c in world.contacts.iter().filter(|c| c.manifold.normal.x.abs() > 0.9) {
                    let first = c.body_a.min(c.body_b).saturating_sub(1);
                    let load = normal_impulse(c) / f64::from(world.settings.dt);
                    worst = largest([worst, (load - f64::from(count as u32 - first) * a).abs()]);
                }
            }
        },
    )?;
    Ok(Finding::new(worst, 0.0, 0.01 * f64::from(count) * a))
}

/// A23. A platform that oscillates with a peak acceleration of g/2 keeps its box.
fn shake(lab: &Lab) -> Result<Finding, Failure> {
    let (a, omega) = (0.5 * G, 20.0);
    let body = SceneBody::dynamic([0.0, 0.5], SceneShape::rectangle(0.5, 0.5));
    let scene = Scene::new("shake", vec![platform_of(0.6), body]);
    let dt = scene.dt;
    let mut worst = 0.0;
    carry(
        lab,
        scene,
        5.0,
        |t| [0.0, a / omega * (omega * t).sin()],
        |world| {
            worst = largest([worst, (center(world, 1)[1] - center(world, 0)[1] - 1.0).abs()]);
        },
    )?;
    Ok(Finding::new(worst, 0.0, 0.5 * a * dt * dt))
}

/// A23. A stack rests on a platform at constant speed as on a fixed one.
fn carried_stack(lab: &Lab) -> Result<Finding, Failure> {
    let mut bodies = vec![platform_of(0.6).moving([30.0, 0.0], 0.0)];
    for i in 0..5 {
        let square = SceneBody::dynamic([0.0, f64::from(i) + 0.5], SceneShape::rectangle(0.5, 0.5));
        bodies.push(square.moving([30.0, 0.0], 0.0));
    }
    let mut worst = 0.0;
    lab.run(Scene::new("carried", bodies), 5.0, |world| {
        for i in 1..6 {
            worst = largest([worst, (center(world, i)[0] - center(world, 0)[0]).abs()]);
        }
    })?;
    Ok(Finding::new(worst, 0.0, 1e-4))
}

/// A23. A disc falls at 4 m/s onto a paddle that rises at 2 m/s and leaves at 2 · 2 + 4.
fn paddle(lab: &Lab) -> Result<Finding, Failure> {
    let surface = SceneShape::rectangle(2.0, 0.5).restitution(1.0).friction(0.0);
    let paddle = SceneBody::new(BodyKind::Kinematic, [0.0, -0.5], surface).moving([0.0, 2.0], 0.0);
    let disc = SceneShape::disc(0.5).restitution(1.0).friction(0.0);
    let disc = SceneBody::dynamic([0.0, 1.27], disc).moving([0.0, -4.0], 0.0);
    let world = lab.run(Scene::new("paddle", vec![paddle, disc]).weightless(), 0.5, |_| ())?;
    Ok(Finding::new(velocity(&world, 1)[1], 8.0, 1e-5 * 8.0))
}

/// A24. On a belt of speed V, friction accelerates the disc at µ g and spins it up at 2 µ g/r, until the two
/// add up to V. The final speed is V/3.
fn belt(lab: &Lab) -> Result<Finding, Failure> {
    let disc = SceneBody::dynamic([0.0, 0.5], SceneShape::disc(0.5).friction(0.5));
    let scene = Scene::new("belt", vec![platform_of(0.5).moving([3.0, 0.0], 0.0), disc]);
    let world = lab.run(scene, 2.0, |_| ())?;
    Ok(Finding::new(velocity(&world, 1)[0], 1.0, 0.005))
}

/// A floor at height 0 made of squares of side 1, from −3 m to 20 m.
fn tiled(friction: f64) -> Vec<SceneBody> {
    let tile =
        |i: i32| SceneBody::fixed([f64::from(i), -0.5], SceneShape::rectangle(0.5, 0.5).friction(friction));
    (-3..=20).map(tile).collect()
}

/// A24. The stopping distance is v²/(2 µ g) − v h/2, with or without seams.
fn tiles(lab: &Lab) -> Result<Finding, Failure> {
    let (speed, friction) = (6.0, 0.4);
    let mut bodies = tiled(friction);
    let last = bodies.len();
    let shape = SceneShape::rectangle(0.3, 0.3).friction(friction);
    bodies.push(SceneBody::dynamic([0.1, 0.3], shape).moving([speed, 0.0], 0.0));
    let world = lab.run(Scene::new("tiles", bodies), 2.5, |_| ())?;
    let h = f64::from(world.settings.dt) / lab.substeps();
    let truth = speed * speed / (2.0 * friction * G) - 0.5 * speed * h;
    let note = format!("turned by {:.1e} rad", f64::from(world.bodies.rotation_sin[last]).asin());
    Ok(Finding::new(center(&world, last)[0] - 0.1, truth, 0.01 * truth).note(note))
}

/// A24. A disc rolling at 5 m/s keeps its speed and its height.
fn seams(lab: &Lab) -> Result<Finding, Failure> {
    let mut bodies = tiled(0.6);
    let last = bodies.len();
    let disc = SceneBody::dynamic([0.0, 0.5], SceneShape::disc(0.5).density(4.0 / PI).friction(0.6));
    bodies.push(disc.moving([5.0, 0.0], -10.0));
    let mut worst = 0.0;
    lab.run(Scene::new("seams", bodies), 3.0, |world| {
        worst = largest([worst, (velocity(world, last)[0] - 5.0).abs(), center(world, last)[1] - 0.5]);
    })?;
    Ok(Finding::new(worst, 0.0, 1e-3))
}
