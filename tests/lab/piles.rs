//! What piles ask of soft contacts, against sums worked out by hand.

use super::common;
use glam::Vec2;
use simpulse::engine::bodies::{BodyDef, BodyKind, ShapeDef};
use simpulse::engine::constraints::kernels::velocity::rules::Softness;
use simpulse::engine::shapes::Shape;
use simpulse::engine::solvers;
use simpulse::engine::solvers::shim::piles::modes::{PileModes, Piles};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::metrics::Observation;
use simpulse::lab::scenes::Scene;
use std::f32::consts::TAU;

const GRAVITY: Vec2 = Vec2::new(0.0, -10.0);

fn modes(world: &mut World) -> PileModes {
    world.find_contacts();
    let (gravity, mut kept) = (Vec2::from(world.settings.gravity), world.workspace().kept.clone());
    Piles::default().modes(&world.bodies, &mut world.contacts, &mut kept, gravity, [1.0, 1.0])
}

fn scene(name: &str) -> World {
    common::scene(name).build(common::settings(solvers::find("shim").unwrap())).unwrap()
}

/// Unit boxes at these places on a ground whose surface is y = 0, with a wall whose surface is x = 0 if there is
/// one, under `gravity`.
fn boxes(places: &[[f64; 2]], with_wall: bool, gravity: Vec2) -> World {
    let settings = Settings { gravity: gravity.into(), ..Settings::new(solvers::find("shim").unwrap()) };
    let mut world = World::new(settings);
    let block = |half: [f32; 2]| {
        let shape = Shape::rectangle("box", Vec2::from(half), Vec2::ZERO, 0.0, 0.0).unwrap();
        vec![ShapeDef::new(shape)]
    };
    world.add_body(&BodyDef::new(BodyKind::Static, [0.0, -1.0], block([300.0, 1.0]))).unwrap();
    if with_wall {
        world.add_body(&BodyDef::new(BodyKind::Static, [-1.0, 10.0], block([1.0, 20.0]))).unwrap();
    }
    for &place in places {
        world.add_body(&BodyDef::new(BodyKind::Dynamic, place, block([0.5, 0.5]))).unwrap();
    }
    world
}

/// These bodies, each after a comma, on the ground.
fn on_ground(bodies: &str) -> Scene {
    let ground = r#"{"type":"static","position":[0,-1],"shapes":[{"box":{"half":[60,1]}}]}"#;
    Scene::from_json(&format!(r#"{{"name":"piles","bodies":[{ground}{bodies}]}}"#), "piles.json".as_ref())
        .unwrap()
}

/// Bodies of 1 kg, two equal masses at a joint and one on the ground: Σ j/(1/2) up to N − 1, and N.
#[test]
fn a_column_of_discs_is_slow_by_the_square_of_its_length_and_has_hinges() {
    for count in [1u32, 2, 10, 100] {
        let PileModes { critical_frequency, slowness } = modes(&mut scene(&format!("disc_column:{count}")));
        let expected = f64::from(count).powi(2);
        assert!((f64::from(slowness) - expected).abs() <= 1e-5 * expected, "{count}: {slowness}");
        assert_eq!(critical_frequency, 0.0, "{count}");
    }
}

/// A corner of a unit box has x = 1/2, so that m_p = m/(2 (1 + 6/4)) = m/5 between boxes and 2m/5 on the ground, and
/// Σ m_p x² is a half of it. Joint j from the top carries the moment g m j²/2.
#[test]
fn boxes_buckle_on_springs_below_southwells_bound() {
    for count in [2u32, 10, 60] {
        let places: Vec<_> = (0..count).map(|i| [0.0, 0.5 + f64::from(i)]).collect();
        let found = f64::from(modes(&mut boxes(&places, false, GRAVITY)).critical_frequency);
        let moment = |j: u32| 10.0 * f64::from(j * j) / 2.0;
        let squared = (1..count).map(|j| moment(j) / 0.1).sum::<f64>() + moment(count) / 0.2;
        assert!((found * found - squared).abs() <= 1e-3 * squared, "{count}: {found} for {}", squared.sqrt());
    }
}

#[test]
fn a_bounce_in_the_air_or_without_gravity_asks_for_nothing() {
    assert_eq!(modes(&mut boxes(&[[0.0, 3.0]], false, GRAVITY)), PileModes::default());
    let column = [[0.0, 0.5], [0.0, 1.5]];
    assert_eq!(modes(&mut boxes(&column, false, Vec2::ZERO)).critical_frequency, 0.0);
}

/// Boxes along the ground that their weight presses against a wall are a column that lies down, and each of them stands
/// on the ground.
#[test]
fn a_row_against_a_wall_is_as_slow_as_a_column() {
    let row: Vec<_> = (0..30).map(|i| [0.5 + f64::from(i), 0.5]).collect();
    let column: Vec<_> = (0..30).map(|i| [0.0, 0.5 + f64::from(i)]).collect();
    let lying = modes(&mut boxes(&row, true, Vec2::new(-1.0, -10.0)));
    let standing = modes(&mut boxes(&column, false, GRAVITY));
    assert!((lying.slowness / standing.slowness - 1.0).abs() < 0.02, "{lying:?} {standing:?}");
    // A box tilts on 2 m_p = 4/5 kg at x = 1/2: (10.05 · 1/2)/(1/5).
    assert!(lying.critical_frequency < 6.0, "{lying:?}");
}

/// Boxes beside a column hang on it by a corner, and make it hardly stiffer and no shorter.
#[test]
fn what_leans_on_a_column_does_not_hide_it() {
    let mut places: Vec<_> = (0..40).map(|i| [0.0, 0.5 + f64::from(i)]).collect();
    let alone = modes(&mut boxes(&places, false, GRAVITY));
    places.push([1.0, 20.5]);
    places.push([1.0, 0.5]);
    let leaning = modes(&mut boxes(&places, false, GRAVITY));
    assert!(leaning.critical_frequency >= 0.95 * alone.critical_frequency, "{leaning:?} {alone:?}");
    assert!(leaning.slowness >= alone.slowness, "{leaning:?} {alone:?}");
}

/// The base of a pyramid is as wide as it is high.
#[test]
fn a_pyramid_is_slow_and_does_not_buckle() {
    let pyramid = modes(&mut scene("pyramid:30"));
    let column: Vec<_> = (0..30).map(|i| [0.0, 0.5 + f64::from(i)]).collect();
    let column = modes(&mut boxes(&column, false, GRAVITY));
    assert!(pyramid.critical_frequency < 0.2 * column.critical_frequency, "{pyramid:?} {column:?}");
    let ratio = pyramid.slowness / column.slowness;
    assert!((0.5..2.0).contains(&ratio), "{pyramid:?} {column:?}");
}

/// Sweeps that a step of `shim` makes.
fn sweeps(name: &str) -> usize {
    let mut world = scene(name);
    world.step().unwrap();
    world.counts.sweeps
}

#[test]
fn only_a_column_that_would_buckle_pays_for_it() {
    let usual = sweeps("disc_column:60");
    assert_eq!([sweeps("stack:30"), sweeps("pyramid:30"), sweeps("card_house")], [usual; 3]);
    // Springs of the square root of the added sweeps, and so 64 at most.
    let [sixty, thousand] = ["stack:60", "stack:1000"].map(sweeps);
    assert!(usual < sixty && sixty < thousand, "{usual} {sixty} {thousand}");
    let substeps = solvers::find("shim").unwrap().budget.substeps as usize;
    assert_eq!(thousand, usual + 64 * substeps);
}

/// Ten tables on top of each other rock on their legs, which preload shortens, and a column of boxes does not.
#[test]
fn tables_rock_more_slowly_than_their_columns_move() {
    let column: Vec<_> = (0..10).map(|i| [0.0, 0.5 + f64::from(i)]).collect();
    let one = modes(&mut boxes(&column, false, GRAVITY)).slowness;
    let two: Vec<_> = column.iter().flat_map(|&[_, y]| [[-2.0, y], [2.0, y]]).collect();
    assert_eq!(modes(&mut boxes(&two, false, GRAVITY)).slowness, one);
    let table = |i: u32| {
        let y = 1.5 * f64::from(i);
        let part = |x: f64, y: f64, half: [f64; 2]| {
            format!(r#",{{"type":"dynamic","position":[{x},{y}],"shapes":[{{"box":{{"half":{half:?}}}}}]}}"#)
        };
        let legs = [-1.5, 1.5].map(|x| part(x, y + 0.5, [0.2, 0.5]));
        legs.concat() + &part(0.0, y + 1.25, [2.0, 0.25])
    };
    let scene = on_ground(&(0..10).map(table).collect::<String>());
    let build = || scene.build(common::settings(solvers::find("shim").unwrap())).unwrap();
    assert!(modes(&mut build()).slowness > 5.0 * one);
    let mut world = build();
    // They rest within ten seconds.
    for _ in 0..600 {
        world.step().unwrap();
    }
    let fastest = (0..world.bodies.len()).map(|b| world.bodies.velocity(b).length()).fold(0.0, f32::max);
    assert!(fastest < 1e-3, "{fastest}");
}

/// A stack that begins at rest stays there from its first step on, and sinks by no more than what is left of its sag.
#[test]
fn statics_leaves_a_stack_where_it_is() {
    for name in ["stack:20", "pyramid:10", "disc_column:10"] {
        let mut world = scene(name);
        let before = world.bodies.clone();
        for _ in 0..120 {
            world.step().unwrap();
            for body in 0..world.bodies.len() {
                let moved = (world.bodies.pose(body).position - before.pose(body).position).length();
                // 20 µm at each contact below.
                assert!(moved < 2e-5 * 20.0, "{name}: body {body} {moved} m");
            }
        }
    }
}

/// An arch stands on thrust, and begins with it: its crown sinks by 2 mm, and not by 12
/// as under loads that know no thrust.
#[test]
fn an_arch_begins_with_its_thrust() {
    let mut world = scene("arch");
    let before = world.bodies.clone();
    for _ in 0..300 {
        world.step().unwrap();
        for body in 0..world.bodies.len() {
            let moved = (world.bodies.pose(body).position - before.pose(body).position).length();
            assert!(moved < 4e-3, "body {body} {moved} m after {} steps", world.step_index);
        }
    }
}

/// Unit boxes under one of many times their mass, for a minute: 20 µm at each contact.
#[test]
fn columns_bear_boxes_of_a_hundred_and_nine_hundred_times_the_mass() {
    for (count, density) in [(10, 100.0), (20, 900.0)] {
        let boxed = |i: u32, density: f64| {
            let y = 0.5 + f64::from(i);
            let shape = format!(r#"{{"box":{{"half":[0.5,0.5]}},"density":{density}}}"#);
            format!(r#",{{"type":"dynamic","position":[0,{y}],"shapes":[{shape}]}}"#)
        };
        let bodies = (0..count).map(|i| boxed(i, 1.0)).collect::<String>() + &boxed(count, density);
        let mut world = on_ground(&bodies).build(common::settings(solvers::find("shim").unwrap())).unwrap();
        for _ in 0..3600 {
            world.step().unwrap();
        }
        let heavy = world.bodies.len() - 1;
        let sunk = 0.5 + f64::from(count) - f64::from(world.bodies.position_y[heavy]);
        println!(
            "{count} boxes under {density} times the mass: the heavy one has sunk by {:.0} µm",
            1e6 * sunk
        );
        assert!(sunk.abs() < 2e-5 * f64::from(count + 1) + 1e-5, "{count}: {sunk}");
        assert!(world.bodies.velocity(heavy).length() < 1e-3, "{count}");
    }
}

/// They begin with all of their sag, and do not fall into it: nothing but rounding moves them.
#[test]
fn piles_that_begin_at_rest_create_no_energy() {
    for name in ["stack:20", "pyramid:20", "disc_column:30", "mass_ratio:1000"] {
        let mut world = scene(name);
        world.settings.record_impulses = true;
        let mut observation = Observation::new(&world);
        for _ in 0..300 {
            world.step().unwrap();
            observation.observe(&world);
        }
        let created = observation.errors().energy_created;
        println!("{name}: {created:.1e} of the energy in the worst step");
        assert!(created < 3e-6, "{name}: {created}");
    }
}

/// Cards begin up to 2 mm in each other. Pushed apart at once, they lose the top of the house at many lengths of a step.
#[test]
fn a_house_of_cards_that_begins_in_itself_stands_at_any_step() {
    for rate in [30, 40, 60, 90, 120, 240, 480] {
        let mut world = scene("card_house");
        world.settings.dt = 1.0 / rate as f32;
        let heights = world.bodies.position_y.clone();
        for _ in 0..4 * rate {
            world.step().unwrap();
        }
        for (body, (now, then)) in world.bodies.position_y.iter().zip(heights.iter()).enumerate() {
            assert!(
                (now - then).abs() < 0.05,
                "{rate} steps a second: card {body} is at {now}, and was at {then}"
            );
        }
    }
}

/// Two discs without weight, 0.2 m in each other. Of the overlap p with which springs are content, a step leaves
/// p τ/(τ + dt) − 20 µm, and in each substep springs push what is beyond at γ_m β.
#[test]
fn placed_overlap_goes_in_a_tenth_of_a_second() {
    let mut world =
        World::new(Settings { gravity: [0.0; 2], ..common::settings(solvers::find("shim").unwrap()) });
    for x in [-0.4, 0.4] {
        let disc = Shape::circle("disc", Vec2::ZERO, 0.5).unwrap();
        world.add_body(&BodyDef::new(BodyKind::Dynamic, [x, 0.0], vec![ShapeDef::new(disc)])).unwrap();
    }
    let (dt, h) = (world.settings.dt, world.settings.h());
    let [stiffness, damping_ratio] = [0, 1].map(|i| world.settings.parameters[i]);
    let springs = Softness::new(TAU * stiffness / h, damping_ratio, h);
    let (mut content, mut overlap) = (0.2_f32, 0.2_f32);
    for step in 0..60 {
        content = (content.min(overlap) * (0.1 / (0.1 + dt)) - 2e-5).max(0.0);
        for _ in 0..world.settings.budget.substeps {
            overlap -= h * springs.mass_scale * springs.bias_rate * (overlap - content);
        }
        world.step().unwrap();
        let found = 1.0 - (world.bodies.position_x[1] - world.bodies.position_x[0]);
        assert!((found - overlap).abs() < 1e-5, "step {step}: {found} m left, {overlap} expected");
    }
    assert!(overlap < 1e-3, "{overlap}");
}

/// Boxes of 100, 200 and 300 times the mass of a brick arrive at 6.3 m/s. Their impact reaches the ground in the step in
/// which it happens, or bricks are thrown out of the pile.
#[test]
fn pyramids_stand_under_heavy_boxes_that_are_dropped_on_them() {
    let mut world = scene("high_mass_ratio_1");
    let heights = world.bodies.position_y.clone();
    for _ in 0..600 {
        world.step().unwrap();
    }
    for (body, (now, then)) in world.bodies.position_y.iter().zip(heights.iter()).enumerate() {
        let falls = if *then > 20.0 { 2.0 } else { 0.0 };
        assert!((now - then + falls).abs() < 0.1, "body {body} is at {now}, and was at {then}");
    }
}
