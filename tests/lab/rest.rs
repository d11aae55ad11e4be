//! The law of rest: piles of a few boxes stay in place at the standard budget.

use crate::common::{fastest, totals};
use simpulse::engine::bodies::{BodyDef, BodyHandle, ShapeDef};
use simpulse::engine::params::Without;
use simpulse::engine::solvers::{Guarantee, VARIANTS, Variant, find};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};

/// Piles of a few boxes: a stack, a pyramid, and one box held by friction.
const PILES: [&str; 3] = ["stack:10", "pyramid:4", "incline_stick"];

/// Allowed creep of bodies in the last five of ten seconds (m): a fifth of the slop.
const CREEP: f64 = 1e-3;

/// Largest displacement of any body in the last five of ten seconds (m).
fn creep(pile: &str, variant: &'static Variant) -> f64 {
    let scene = crate::common::scene(pile);
    let mut world = crate::common::run(&scene, crate::common::settings(variant), 300);
    let at = |world: &World| -> Vec<[f64; 2]> {
        let b = &world.bodies;
        (0..b.len()).map(|i| [f64::from(b.position_x[i]), f64::from(b.position_y[i])]).collect()
    };
    let before = at(&world);
    for _ in 0..300 {
        if world.step().is_err() {
            return f64::INFINITY;
        }
    }
    before.iter().zip(at(&world)).map(|(p, q)| (q[0] - p[0]).hypot(q[1] - p[1])).fold(0.0, f64::max)
}

#[test]
fn piles_of_a_few_boxes_stay_where_they_are() {
    let mut wrong = Vec::new();
    for variant in VARIANTS {
        let ways = PILES.map(|pile| creep(pile, variant));
        println!("{:<16} {:.1e} {:.1e} {:.1e} m", variant.name, ways[0], ways[1], ways[2]);
        if variant.promises(Guarantee::Rest) && !ways.iter().all(|&way| way <= CREEP) {
            wrong.push(format!("{}: {ways:?}", variant.name));
        }
    }
    assert!(wrong.is_empty(), "promised rest, in {PILES:?} crept: {wrong:#?}");
}

#[test]
fn not_every_solver_keeps_them() {
    // Otherwise the bound would exclude nothing.
    let variant = VARIANTS.iter().find(|v| v.name == "projection").unwrap();
    assert!(!variant.promises(Guarantee::Rest) && creep("stack:10", variant) > CREEP);
}

/// Forty frictionless discs in a row on the ground, pressed against a wall by a tenth of their weight. The
/// chain is as long as a column of forty, but no load reveals that.
#[test]
fn a_pressed_row_does_not_swing_on_its_preload() {
    let smooth = |x, y| SceneShape::rectangle(x, y).friction(0.0);
    let mut bodies = vec![
        SceneBody::fixed([0.0, -1.0], smooth(200.0, 1.0)),
        SceneBody::fixed([-1.0, 5.0], smooth(1.0, 5.0)),
    ];
    let disc = |i| SceneBody::dynamic([0.5 + f64::from(i), 0.5], SceneShape::disc(0.5).friction(0.0));
    bodies.extend((0..40).map(disc));
    let scene = Scene { gravity: [-1.0, -10.0], ..Scene::new("row", bodies) };
    let world = crate::common::run(&scene, crate::common::named("shim"), 900);
    let fastest = world.bodies.velocity_x.iter().fold(0.0f32, |most, v| most.max(v.abs()));
    assert!(fastest < 1e-4, "{fastest} m/s");
}

/// Median over the bodies of a pile of 1000 discs of their root mean square speed in the tenth second (m/s).
fn median_speed(seed: u64, without: Without) -> f64 {
    let scene = simpulse::lab::scenes::load_with_seed("circle_pile:1000", seed).unwrap().scene;
    let settings = Settings { without, ..crate::common::named("shim") };
    let mut world = crate::common::run(&scene, settings, 540);
    let mut squares = vec![0.0; world.bodies.len()];
    for _ in 0..60 {
        world.step().unwrap();
        for (i, square) in squares.iter_mut().enumerate() {
            *square += f64::from(world.bodies.velocity(i).length_squared()) / 60.0;
        }
    }
    squares.sort_by(f64::total_cmp);
    squares[squares.len() / 2].sqrt()
}

/// Single discs keep rolling for long, as they should. The pile around them does not swell and settle with
/// the shortening of its springs. The limit is that of case B5.
#[test]
fn a_pile_of_discs_hardly_breathes() {
    let without = Without::default().and(find("shim").unwrap().mechanism("once").unwrap());
    let median = |seeds: &[u64], without| {
        let mut speeds: Vec<f64> = seeds.iter().map(|&seed| median_speed(seed, without)).collect();
        speeds.sort_by(f64::total_cmp);
        speeds[speeds.len() / 2]
    };
    let (once, free) = (median(&[1, 2, 3, 4, 5], Without::default()), median(&[1, 2, 3], without));
    assert!(free > 1e-4 && once < 1e-4, "{once} m/s, and {free} m/s without");
}

/// Lemke's and Newton's methods reach the same solution of the contact law, far more exactly than sweeps do.
#[test]
fn lemke_and_newton_agree_on_a_stack() {
    let direct = find("direct").unwrap();
    let scene = crate::common::scene("stack:5");
    let heights = [0.0, 1.0].map(|lemke| {
        let mut settings = crate::common::settings(direct);
        direct.set(&mut settings.parameters, "lemke", lemke).unwrap();
        let world = crate::common::run(&scene, settings, 120);
        (1..world.bodies.len()).map(|i| world.bodies.position_y[i]).collect::<Vec<_>>()
    });
    for (i, (newton, lemke)) in heights[0].iter().zip(&heights[1]).enumerate() {
        let truth = i as f32 + 0.5;
        assert!((newton - truth).abs() < 1e-6 && (lemke - truth).abs() < 1e-6, "{i}: {newton} {lemke}");
    }
}

/// Root mean square of √(2 E_kin/M) over the third second of a scene (mm/s). `after` is called after each
/// step. With `parts`, each substep of the standard budget becomes `parts` steps of one substep.
fn residual_speed(scene: &Scene, solver: &str, parts: Option<u32>, after: impl Fn(&mut World)) -> f64 {
    let mut settings = crate::common::named(solver);
    let parts = parts.map_or(1, |parts| parts * std::mem::replace(&mut settings.budget.substeps, 1));
    settings.dt /= parts as f32;
    let mut world = scene.build(settings).unwrap();
    let mut squares = 0.0;
    for step in 0..180 * parts {
        world.step().unwrap();
        after(&mut world);
        if step >= 120 * parts {
            let mass: f64 =
                world.bodies.inv_mass.iter().filter(|m| **m > 0.0).map(|m| 1.0 / f64::from(*m)).sum();
            let [.., energy] = totals(&world);
            squares += 2.0 * energy / mass / f64::from(60 * parts);
        }
    }
    1e3 * squares.sqrt()
}

/// Discards the low part of positions, as in engines that keep positions in one `f32`.
fn round_positions(world: &mut World) {
    world.bodies.position_x_lo.fill(0.0);
    world.bodies.position_y_lo.fill(0.0);
}

/// Residual speed at rest comes from the rounding of positions. With one `f32` per coordinate it grows with
/// the distance from the origin, as in engines that store positions this way.
#[test]
fn speeds_at_rest_grow_with_what_positions_are_rounded_to() {
    let speeds = ["many_pyramids:5", "many_pyramids:10"].map(|name| {
        let scene = crate::common::scene(name);
        [
            residual_speed(&scene, "box2d", None, |_| ()),
            residual_speed(&scene, "box2d", None, round_positions),
        ]
    });
    let [[low, low_rounded], [high, high_rounded]] = speeds;
    assert!(low_rounded > 20.0 * low && high_rounded > 20.0 * high, "{speeds:?}");
    // Twice as high. Float spacing doubles at powers of two.
    assert!((1.5..3.0).contains(&(high_rounded / low_rounded)) && high < 1.5 * low, "{speeds:?}");
}

#[test]
#[ignore = "a minute; prints figures of papers/peers.md"]
fn speeds_at_rest_with_positions_in_f32() {
    for name in ["many_pyramids:5", "many_pyramids:10", "many_pyramids", "stack:14"] {
        let scene = crate::common::scene(name);
        for solver in ["box2d", "rapier", "soft_step"] {
            let whole = residual_speed(&scene, solver, None, |_| ());
            let [steps, substeps] =
                [None, Some(1)].map(|parts| residual_speed(&scene, solver, parts, round_positions));
            let finer = residual_speed(&scene, solver, Some(1), |_| ());
            println!(
                "{name} {solver}: {whole:.5} mm/s, rounded every step {steps:.5}; a step for each substep {finer:.5}, \
                 rounded {substeps:.5}"
            );
        }
    }
}

/// Boxes of 100 to 300 times the mass, dropped on pyramids, rock at first. Preload that followed their loads
/// back and forth would keep them rocking for minutes, at a few centimeters per second.
#[test]
fn heavy_boxes_on_pyramids_come_to_rest() {
    let scene = crate::common::scene("high_mass_ratio_1");
    let world = crate::common::run(&scene, crate::common::named("shim"), 1500);
    let fastest = fastest(&world);
    // The target of 1e-3 is for speeds averaged over a second and over mass. This is the fastest body of a
    // single step.
    assert!(fastest < 5e-3, "{fastest} m/s");
}

/// Sum of the normal forces on a body, as a mean over the last step (N).
fn pressed(world: &World, body: BodyHandle) -> f64 {
    let touching = world.contacts.iter().filter(|c| [c.body_a, c.body_b].contains(&(body.index() as u32)));
    let impulse: f64 = touching.flat_map(|c| c.step_impulse).map(|[normal, _]| f64::from(normal)).sum();
    impulse / f64::from(world.settings.dt)
}

/// Weight of a body (N).
fn weight(world: &World, body: BodyHandle) -> f64 {
    f64::from(world.settings.gravity[1].abs()) / f64::from(world.bodies.inv_mass[body.index()])
}

/// Load on the floor of a silo with rough walls after a minute, as a fraction of the weight in it. `only_discs`: instead of
/// boxes and some discs.
fn load_of_a_silo(without: Without, only_discs: bool, friction: f64, variation: u32) -> f64 {
    let mut world = World::new(Settings { without, ..crate::common::named("shim") });
    world.settings.record_impulses = true;
    let rough = |shape: ShapeDef| shape.with_friction(friction);
    let block = |x, y| rough(ShapeDef::rectangle(x, y).unwrap());
    let floor = world.add_body(&BodyDef::fixed([0.0, -0.5]).with(block(5.0, 0.5))).unwrap();
    for x in [-1.5, 1.5] {
        world.add_body(&BodyDef::fixed([x, 10.0]).with(block(0.5, 10.0))).unwrap();
    }
    let mut total = 0.0;
    for i in 0..80 {
        let aside = 0.009 * f64::from((i + variation) * (7 + variation) % 5);
        let place = [-0.738 + 0.48 * f64::from(i % 4) + aside, 0.3 + 0.5 * f64::from(i / 4)];
        let is_disc = only_discs || (i + variation).is_multiple_of(3);
        let shape = if is_disc { rough(ShapeDef::circle(0.22).unwrap()) } else { block(0.2, 0.2) };
        let body = world.add_body(&BodyDef::dynamic(place).with(shape)).unwrap();
        total += weight(&world, body);
    }
    (0..3600).for_each(|_| world.step().unwrap());
    pressed(&world, floor) / total
}

/// Friction of the walls bears a part of the weight, and holds down what preload would lift. Springs that are shortened
/// against it press on the floor; a preload that finds no room has to go. Without that the floors bear 0.17 of the
/// weight more.
#[test]
fn preload_adds_no_load_in_silos() {
    let statics = Without::default().and(find("shim").unwrap().mechanism("statics").unwrap());
    let mut more = Vec::new();
    for only_discs in [false, true] {
        for friction in [0.3, 0.8] {
            let loads = |without| {
                let sum: f64 = (0..4).map(|i| load_of_a_silo(without, only_discs, friction, i)).sum();
                sum / 4.0
            };
            let [with, without] = [Without::default(), statics].map(loads);
            println!(
                "only discs: {only_discs}, friction {friction}: {with:.3} of the weight, {without:.3} without statics"
            );
            more.push(with - without);
        }
    }
    let mean = more.iter().sum::<f64>() / more.len() as f64;
    assert!(mean < 0.1, "the floors bear {mean:.3} of the weight more");
}

/// Normal forces on a plug after ten seconds and after a minute, in weights. It falls by `drop` (m) into a rough taper, and
/// stays wedged.
fn load_of_a_plug(without: Without, degrees: f32, friction: f64, drop: f64) -> [f64; 2] {
    let mut world = World::new(Settings { without, ..crate::common::named("shim") });
    world.settings.record_impulses = true;
    let wide = |y: f32| 0.5 + degrees.to_radians().tan() * y;
    let mut add = |body: BodyDef, vertices: [[f32; 2]; 4]| {
        let shape = ShapeDef::polygon(&vertices).unwrap().with_friction(friction);
        world.add_body(&body.with(shape)).unwrap()
    };
    let [low, high] = [-3.0, 3.0].map(wide);
    add(BodyDef::fixed([0.0; 2]), [[low, -3.0], [2.0, -3.0], [2.0, 3.0], [high, 3.0]]);
    add(BodyDef::fixed([0.0; 2]), [[-high, 3.0], [-2.0, 3.0], [-2.0, -3.0], [-low, -3.0]]);
    let [low, high] = [-0.5, 0.5].map(wide);
    let plug = [[-low, -0.5], [low, -0.5], [high, 0.5], [-high, 0.5]];
    let plug = add(BodyDef::dynamic([0.0, drop]), plug);
    [600, 3000].map(|steps| {
        (0..steps).for_each(|_| world.step().unwrap());
        pressed(&world, plug) / weight(&world, plug)
    })
}

/// Preload against the walls of a taper finds no room, so they bear what they bear without it. A plug that is placed in
/// contact has its preload in the first step, and one that falls far lands in another way than without statics: they are
/// pressed harder, but no more after a minute than after ten seconds.
#[test]
fn preload_presses_no_plug() {
    let statics = Without::default().and(find("shim").unwrap().mechanism("statics").unwrap());
    for (degrees, friction, drop) in [(1.0, 0.5, 0.1), (3.0, 0.3, 0.1), (1.0, 0.5, 0.0), (1.0, 0.5, 0.5)] {
        let [with, without] =
            [Without::default(), statics].map(|parts| load_of_a_plug(parts, degrees, friction, drop));
        println!("{degrees}°, falls by {drop} m: {with:.2?} weights, {without:.2?} without statics");
        let limit = if drop == 0.1 { 1.1 * without[0] } else { 1.01 * with[0] };
        assert!(with.iter().all(|load| *load < limit), "{with:?}, without statics {without:?} weights");
    }
}

/// Limbs that fall into each other at 9 m/s end up crossed, held by joints and pushed apart by contacts.
/// Impacts, jams and static loads must leave this equilibrium alone.
#[test]
fn most_piles_of_ragdolls_come_to_rest() {
    let moves = |humans: u32| {
        let scene = crate::common::scene(&format!("ragdolls:{humans}"));
        let world = crate::common::run(&scene, crate::common::named("shim"), 800);
        fastest(&world) > 0.01
    };
    let restless: Vec<u32> = (3..11).filter(|&humans| moves(humans)).collect();
    assert!(restless.len() <= 2, "{restless:?} humans");
}
