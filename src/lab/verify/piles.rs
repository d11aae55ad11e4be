//! B6–B9, B21 and B24: pyramids, planks and other piles at rest. B25: gravity, pushes and step lengths that change
//! while a pile rests; nothing may move, because each change keeps the equilibrium.

use super::lab::*;
use crate::engine::bodies::{BodyDef, ShapeDef};
use crate::lab::error::Error;

pub(super) static CASES: &[Case] = &[
    // Boxes of sides 1, 2, 4 … 32 m, the smallest at the bottom, if the largest is still on top: its underside
    // starts at a height of 31 m.
    Case::new("B6.doubling", "ground load under boxes of 1 to 32 m, smallest at the bottom", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("stiff springs bear 1364 kg on 1 kg")
        .by(|lab| {
            let boxes = (0..6).map(|i| {
                let half = 0.5 * f64::from(1 << i);
                SceneBody::dynamic([0.0, 3.0 * half - 1.0], SceneShape::rectangle(half, half))
            });
            let weight = (4f64.powi(6) - 1.0) / 3.0 * G;
            let mut worst: f64 = weight;
            let bodies = with(ground(50.0, 0.6), boxes);
            let world = lab.run(Scene::new("doubling", bodies), 10.0, |world| {
                if time(world) > 9.0 {
                    worst = farther(weight, worst, ground_load(world));
                }
            })?;
            let lowest = center(&world, 6)[1] - 16.0;
            let load = if lowest > 31.0 - 0.5 { worst } else { f64::INFINITY };
            let note = format!("underside of the largest at {lowest:.2} m of 31");
            Ok(Finding::new(load, weight, load_tolerance(weight / G, world.settings.dt.into())).note(note))
        }),
    Case::new("B7.pyramid", "ground load of a pyramid of 55 boxes, last second of five", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("cos²(π/20) per sweep to the power 1920 is 2e-21")
        .by(|lab| lab.catalog("pyramid:10", load_tolerance(55.0, 1.0 / 60.0))),
    Case::new("B7.large", "ground load of a pyramid of 5050 boxes, last second of 8.3", "N")
        .within("momentum per step at the speed limit of B5.jitter")
        .not_required("cos²(π/200) per sweep to the power 3500 is 0.4: no rest by then")
        .by(|lab| lab.catalog("large_pyramid", load_tolerance(5050.0, 1.0 / 60.0))),
    // The individual loads are indeterminate, but their sum and moment are not. Measures the larger of the
    // relative error of the sum and the moment relative to weight × half length, in the last second of 20.
    Case::new("B8.plank", "sum and moment of the loads on a plank on three discs, relative", "1")
        .within("momentum per step at the speed limit of B5.jitter")
        .required("sum and moment are unique, and a pile two rows deep converges")
        .by(|lab| {
            let half = 3.0;
            let discs = [-2.0, 0.0, 2.0].map(|x| SceneBody::dynamic([x, 0.5], SceneShape::disc(0.5)));
            let plank = SceneBody::dynamic([0.0, 1.25], SceneShape::rectangle(half, 0.25));
            let scene = Scene::new("plank", with(ground(20.0, 0.6), discs.into_iter().chain([plank])));
            let weight = 4.0 * half * 0.25 * G;
            let tolerance = load_tolerance(1.0, f64::from(scene.dt as f32)) / G;
            lab.most(scene, 19.0..20.0, tolerance, |world| {
                let ([sum, moment], dt) = (bearing(world, 4), f64::from(world.settings.dt));
                largest([(sum / dt / weight - 1.0).abs(), (moment / dt / (weight * half)).abs()])
            })
        }),
    Case::new("B9.speed", "upward speed after the heavy third disc is removed", "m/s")
        .within("0.05 m/s")
        .not_required(
            "a sagging contact stores the energy F²/2k, which it gives back when its load is removed",
        )
        .by(|lab| Ok(Finding::new(released(lab)?[0], 0.0, 0.05))),
    Case::new("B9.gap", "gap that opens then", "m")
        .within("the slop")
        .required("stiff springs store little energy")
        .by(|lab| Ok(Finding::new(released(lab)?[1], 0.0, SLOP))),
    Case::new("B21.three", "speed of three boxes on an incline, µ 10 % above tan θ, 5 min to 10 min", "m/s")
        .within("1e-5 m/s")
        .required("friction rows are rigid and warm-started")
        .by(|lab| creep(lab, 3)),
    Case::new("B21.ten", "the same for ten boxes", "m/s")
        .within("1e-5 m/s")
        .required("stiff springs hardly sag, so the upper boxes do not turn")
        .by(|lab| creep(lab, 10)),
    // A row of n unit boxes pressed against a wall needs friction for the weight n m g, which takes a push of
    // n/µ times the weight of one box. The joint at the wall needs a moment of n²/2 m g. A push through its
    // middle provides up to half of itself: 25 m g for five boxes.
    Case::new("B24.pressed", "displacement in 10 s of five boxes that 27 weights press on a wall", "m")
        .within("the slop")
        .not_required("a contact sags by F/k, here under 27 weights")
        .by(|lab| {
            let wall = SceneBody::fixed([-0.5, 0.0], SceneShape::rectangle(0.5, 20.0));
            let boxes = (0..5).map(|i| square(f64::from(i) + 0.5, 0.0));
            let mut world = lab.world(Scene::new("pressed", with(wall, boxes)))?;
            world.bodies.force_x[5] = (-27.0 * G) as f32;
            moves(&mut world, 10.0)
        }),
    Case::new("B24.needles", "displacement in 20 s of a stack of ten boxes of 0.1 m × 1 m", "m")
        .within("the slop")
        .required("frozen contacts keep their arms, so a lean does not grow")
        .by(|lab| {
            let bodies = with(ground(20.0, 0.6), column(10, [0.05, 0.5], 0.0));
            moves(&mut lab.world(Scene::new("needles", bodies))?, 20.0)
        }),
    Case::new("B24.tree", "displacement in 20 s of five planks with weights, each on a post", "m")
        .within("the slop")
        .not_required("a contact sags by F/k, and posts lean with it")
        .by(|lab| {
            let storey = |i: u32| {
                let floor = 1.1 * f64::from(i);
                let weight = || SceneShape::rectangle(0.25, 0.25).density(4.0);
                [
                    SceneBody::dynamic([0.0, floor + 0.5], SceneShape::rectangle(0.2, 0.5)),
                    SceneBody::dynamic([0.0, floor + 1.05], SceneShape::rectangle(2.0, 0.05)),
                    SceneBody::dynamic([-1.75, floor + 1.35], weight()),
                    SceneBody::dynamic([1.75, floor + 1.35], weight()),
                ]
            };
            let bodies = with(ground(20.0, 0.6), (0..5).flat_map(storey));
            moves(&mut lab.world(Scene::new("tree", bodies))?, 20.0)
        }),
    Case::new("B24.turned", "displacement in 20 s of twenty boxes in a world rotated by 45°", "m")
        .within("the slop")
        .not_required("contacts are frozen only after their points bear load, and columns lean until then")
        .by(|lab| {
            let (mut scene, half) = (lab.scene("stack:20")?, 0.5f64.sqrt());
            let turn = |[x, y]: [f64; 2]| [half * (x - y), half * (x + y)];
            scene.gravity = turn(scene.gravity);
            for body in &mut scene.bodies {
                (body.position, body.angle) = (turn(body.position), body.angle + FRAC_PI_4);
            }
            moves(&mut lab.world(scene)?, 20.0)
        }),
    Case::new("B25.gravity", "displacement in twenty boxes, 20 s after gravity grew tenfold", "m")
        .within("the slop")
        .not_required("a contact sags by F/k, here under ten times the load")
        .by(|lab| {
            let mut world = rested(lab)?;
            world.settings.gravity[1] *= 10.0;
            moves(&mut world, 20.0)
        }),
    Case::new("B25.off", "largest speed in twenty boxes in 5 s after gravity is turned off", "m/s")
        .within("0.05 m/s, as for B9")
        .not_required(
            "a sagging contact stores the energy F²/2k, which it gives back when its load is removed",
        )
        .by(|lab| {
            let mut world = rested(lab)?;
            world.settings.gravity = [0.0; 2];
            let [.., speed] = watch(&mut world, 5.0)?;
            Ok(Finding::new(speed, 0.0, 0.05))
        }),
    Case::new("B25.on", "displacement in twenty boxes in 10 s after gravity is turned on", "m")
        .within("the slop")
        .not_required("contacts are frozen only after their points bear load, and columns lean until then")
        .by(|lab| {
            let scene = lab.scene("stack:20")?;
            let gravity = scene.gravity.map(|g| g as f32);
            let mut world = lab.run(scene.weightless(), 3.0, |_| ())?;
            world.settings.gravity = gravity;
            moves(&mut world, 10.0)
        }),
    Case::new("B25.heavy", "displacement in 20 s of twenty boxes, 100 times the gravity on the top", "m")
        .within("the slop")
        .not_required("a contact sags by F/k, here by centimeters")
        .by(|lab| {
            let mut scene = lab.scene("stack:20")?;
            scene.bodies[20].gravity_scale = 100.0;
            moves(&mut lab.world(scene)?, 20.0)
        }),
    Case::new("B25.pushed", "sideways displacement in 20 s of twenty boxes under 100 weights at once", "m")
        .within("the slop")
        .required("user forces count as weights, and their loads converge within 32 steps")
        .by(|lab| {
            let mut world = rested(lab)?;
            if let Some((highest, mass, _)) = dynamic(&world).last() {
                world.bodies.force_y[highest] = (-100.0 * G * mass) as f32;
            }
            let [x, ..] = watch(&mut world, 20.0)?;
            Ok(Finding::new(x, 0.0, SLOP))
        }),
    Case::new("B25.set", "displacement in 10 s of ten boxes after one of 100 kg is placed on top", "m")
        .within("the slop")
        .not_required("a contact sags by F/k, here under a hundred times the weight of a box")
        .by(|lab| {
            let mut world = lab.run(lab.scene("stack:10")?, 3.0, |_| ())?;
            let highest = largest(dynamic(&world).map(|(i, ..)| center(&world, i)[1]));
            let heavy = ShapeDef::rectangle(0.5, 0.5).map_err(Error::from)?.with_density(100.0);
            world.add_body(&BodyDef::dynamic([0.0, highest + 1.0]).with(heavy)).map_err(Error::from)?;
            moves(&mut world, 10.0)
        }),
    Case::new("B25.step", "largest speed in twenty boxes at steps of 1/60, 1/240, 1/30 and 1/60 s", "m/s")
        .within("0.05 m/s, as for B9")
        .not_required("springs follow the substep, so the sag changes with the step")
        .by(|lab| {
            let mut world = rested(lab)?;
            let usual = world.settings.dt;
            largest_of([1.0, 0.25, 2.0, 1.0], 0.05, |factor| {
                world.settings.dt = factor * usual;
                Ok(watch(&mut world, 1.0)?[2])
            })
        }),
];

/// Upward impulse on a body in the last step (N·s), and its moment about the body's center (N·m·s).
fn bearing(world: &World, body: u32) -> [f64; 2] {
    let mut sum = [0.0; 2];
    for c in world.contacts.iter().filter(|c| c.body_a == body || c.body_b == body) {
        let n = c.manifold.normal;
        for (point, [normal, tangent]) in c.manifold.points().iter().zip(c.step_impulse) {
            let (sign, arm) = if c.body_b == body { (1.0, point.anchor_b) } else { (-1.0, point.anchor_a) };
            let (normal, tangent) = (sign * f64::from(normal), sign * f64::from(tangent));
            let (nx, ny) = (f64::from(n.x), f64::from(n.y));
            let (x, y) = (normal * nx + tangent * ny, normal * ny - tangent * nx);
            sum = [sum[0] + y, sum[1] + f64::from(arm.x) * y - f64::from(arm.y) * x];
        }
    }
    sum
}

/// B9. The top one of three discs, 100 times as dense, is removed after two seconds. Returns the greatest
/// upward speed (m/s) and the greatest gap (m) after that.
fn released(lab: &Lab) -> Result<[f64; 2], Failure> {
    let disc = |y: f64, density: f64| SceneBody::dynamic([0.0, y], SceneShape::disc(0.5).density(density));
    let bodies = vec![ground(20.0, 0.6), disc(0.5, 1.0), disc(1.5, 1.0), disc(2.5, 100.0)];
    let mut world = lab.run(Scene::new("release", bodies), 2.0, |_| ())?;
    world.bodies.position_x[3] = 1000.0;
    world.bodies.gravity_scale[3] = 0.0;
    (world.bodies.velocity_x[3], world.bodies.velocity_y[3]) = (0.0, 0.0);
    let (mut speed, mut gap) = (0.0, 0.0);
    for _ in 0..120 {
        world.step()?;
        let [low, high] = [center(&world, 1)[1], center(&world, 2)[1]];
        speed = largest([speed, velocity(&world, 1)[1], velocity(&world, 2)[1]]);
        gap = largest([gap, low - 0.5, high - low - 1.0]);
    }
    Ok([speed, gap])
}

/// B21. Boxes on an incline of 0.05 rad with µ = 1.1 tan 0.05, for ten minutes. Measures the greatest speed
/// of a box after 5 min. (At 0.25 rad ten boxes would topple: their center is 5 m up and the base ± ½ m wide,
/// so tan θ < 1/10.)
fn creep(lab: &Lab, count: u32) -> Measured {
    let angle: f64 = 0.05;
    let (sin, cos) = angle.sin_cos();
    let mut scene = on_slope(angle, 1.1 * angle.tan(), SceneShape::rectangle(0.5, 0.5), 0.5);
    for i in 1..count {
        let height = 0.5 + f64::from(i);
        scene.bodies.push(SceneBody { position: [height * sin, height * cos], ..scene.bodies[1].clone() });
    }
    let mut paths = vec![Vec::new(); count as usize];
    lab.run(scene, 600.0, |world| {
        if time(world) >= 300.0 && world.step_index().is_multiple_of(20) {
            for (i, path) in paths.iter_mut().enumerate() {
                path.push((time(world), downhill(center(world, i + 1), angle)));
            }
        }
    })?;
    Ok(Finding::new(largest(paths.iter().map(|path| slope(path).abs())), 0.0, 1e-5))
}

/// A world with twenty unit boxes after 3 s at rest.
fn rested(lab: &Lab) -> Result<World, Failure> {
    lab.run(lab.scene("stack:20")?, 3.0, |_| ())
}

/// Runs `world` for `seconds`. Returns the greatest displacement of a body along x and altogether (m), and the
/// greatest speed (m/s).
fn watch(world: &mut World, seconds: f64) -> Result<[f64; 3], Failure> {
    let places = places(world);
    let mut most = [0.0; 3];
    for _ in 0..steps(world, seconds) {
        world.step()?;
        for (i, from) in places.iter().enumerate() {
            let (at, [vx, vy]) = (center(world, i), velocity(world, i));
            let [x, y] = [at[0] - from[0], at[1] - from[1]];
            let found = [x.abs(), x.hypot(y), vx.hypot(vy)];
            most = [0, 1, 2].map(|k| largest([most[k], found[k]]));
        }
    }
    Ok(most)
}

/// The greatest distance of a body from its start position, over all steps of `seconds`: within the slop.
fn moves(world: &mut World, seconds: f64) -> Measured {
    Ok(Finding::new(watch(world, seconds)?[1], 0.0, SLOP))
}
