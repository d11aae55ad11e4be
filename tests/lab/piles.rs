//! Piles and impacts under the default solver.

use super::common;
use simpulse::engine::world::World;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};
use simpulse::lab::torture::families::FAMILIES;
use simpulse::lab::torture::{family, run_solver};

fn scene(name: &str) -> World {
    common::scene(name).build(common::named("shim")).unwrap()
}

/// The scene after these steps.
fn stepped(scene: &Scene, steps: u32) -> World {
    common::run(scene, common::named("shim"), steps)
}

/// Cards start up to 2 mm inside each other, and those above with air below them. In each step length they land
/// differently, and the highest pair may tip: at 29 of the rates from 30 to 499, here at 4 of 47,
/// at 9 without impacts.
#[test]
fn a_house_of_cards_that_begins_in_itself_stands_at_most_steps() {
    let falls = |rate: u32| {
        let mut world = scene("card_house");
        world.settings.dt = 1.0 / rate as f32;
        let heights = world.bodies.position_y.clone();
        (0..4 * rate).for_each(|_| world.step().unwrap());
        world.bodies.position_y.iter().zip(heights.iter()).any(|(now, then)| (now - then).abs() >= 0.05)
    };
    let fallen: Vec<u32> = (30..500).step_by(10).filter(|&rate| falls(rate)).collect();
    assert!(fallen.len() <= 7, "falls at {fallen:?} steps a second");
}

/// Boxes of 100, 200 and 300 times the mass of a brick arrive at 6.3 m/s. Their impact must reach the ground
/// in the step in which it happens, or bricks are thrown out of the pile. How far single bricks move depends
/// on where the boxes hit: typically 0.06 m over 48 drops side by side, and at most 0.13 m.
#[test]
fn pyramids_stand_under_heavy_boxes_that_are_dropped_on_them() {
    for aside in -4..=4 {
        let mut world = scene("high_mass_ratio_1");
        let heights = world.bodies.position_y.clone();
        for body in (0..heights.len()).filter(|&body| heights[body] > 20.0) {
            world.bodies.position_x[body] += 0.004 * aside as f32;
        }
        (0..600).for_each(|_| world.step().unwrap());
        for (body, (now, then)) in world.bodies.position_y.iter().zip(heights.iter()).enumerate() {
            let falls = if *then > 20.0 { 2.0 } else { 0.0 };
            assert!((now - then + falls).abs() < 0.2, "{aside}: body {body} is at {now}, and was at {then}");
        }
    }
}

/// Random scenes side by side. The first scene of a world moves to the same bits as alone, whatever the other
/// scene is, one kilometer away. Scenes with their own step, gravity or substeps cannot share a world and are
/// skipped.
#[test]
fn a_random_scene_moves_as_it_does_alone_beside_another() {
    const SCENES: u32 = 30;
    const STEPS: u32 = 150;
    let settings = || common::named("shim");
    let families: Vec<_> = FAMILIES.iter().filter(|family| family.name != "extremes").collect();
    let state = |world: &World, body: usize| {
        let b = &world.bodies;
        let place = [b.position_x[body], b.position_y[body], b.position_x_lo[body], b.position_y_lo[body]];
        let motion = [b.velocity_x[body], b.velocity_y[body], b.angular_velocity[body]];
        (place.map(f32::to_bits), motion.map(f32::to_bits), b.rotation_cos[body].to_bits())
    };
    for (k, family) in families.iter().enumerate() {
        for number in 0..SCENES {
            let beside = families[(k + 1 + number as usize) % families.len()];
            let alone = family.case(5, number).scene;
            let mut both = alone.bodies.clone();
            for mut body in beside.case(6, number).scene.bodies {
                body.position[0] += 1e3;
                both.push(body);
            }
            let build = |bodies| Scene { bodies, ..alone.clone() }.build(settings()).unwrap();
            let (mut one, mut two) = (build(alone.bodies.clone()), build(both));
            for step in 1..=STEPS {
                one.step().unwrap();
                two.step().unwrap();
                for body in 0..alone.bodies.len() {
                    let [p, q] = [&one, &two].map(|world| state(world, body));
                    assert_eq!(
                        p, q,
                        "{} {number} beside {}: body {body}, step {step}",
                        family.name, beside.name
                    );
                }
            }
        }
    }
}

/// Impacts before the step are bounded. An island may visit points 18 times for each of its first eight
/// points and once for each of the others, plus one more wave and the points of one body. Steps of random
/// scenes, with restitution and without, stay within this bound.
#[test]
fn impacts_of_a_step_stay_within_their_bound() {
    let (mut most, mut cut) = (0, 0);
    for family in FAMILIES {
        for number in 0..10 {
            let mut world = family.case(9, number).scene.build(common::named("shim")).unwrap();
            let dynamic = (0..world.bodies.len()).filter(|&body| world.bodies.is_dynamic(body)).count();
            for _ in 0..60 {
                if world.step().is_err() {
                    break;
                }
                let counts = *world.counts();
                let bound = 144 * dynamic + 4 * counts.points;
                assert!(counts.impact_visits <= bound, "{} {number}: {counts:?}", family.name);
                most = most.max(counts.impact_visits);
                cut += counts.cut_impacts;
            }
        }
    }
    assert!(most > 256 && cut > 0, "no scene needs a bound: {most} visits, {cut} islands cut off");
}

/// Walls that are hit make no energy, however a hit compresses them.
#[test]
fn walls_that_are_hit_make_no_energy() {
    let struck = family("struck").unwrap();
    let settings = common::named("shim");
    for number in 0..60 {
        let outcome = run_solver(&struck.case(1, number), &settings).unwrap();
        assert!(outcome.energy < 1.1, "struck {number} makes {} of the energy", outcome.energy);
    }
}

/// Restitution goes to zero continuously: rebounds slower than a tenth of what gravity adds in a step are
/// stopped. So ten boxes that fall on each other move at e = 10⁻⁶ as at e = 0.
#[test]
fn a_little_restitution_is_none() {
    let fallen = |e: f64| {
        let boxed = |i: u32| {
            let shape = SceneShape::rectangle(0.5, 0.5).restitution(e);
            SceneBody::dynamic([0.02 * f64::from(i % 3), 0.6 + 1.2 * f64::from(i)], shape)
        };
        stepped(&common::on_ground((0..10).map(boxed).collect()), 180).state_hash()
    };
    assert_eq!(fallen(0.0), fallen(1e-6));
}

/// Bodies on the ground, after the top one or all of them have fallen: the fastest upward speed of any body in any step (m/s).
fn rebound(bodies: Vec<SceneBody>) -> f64 {
    let mut world = common::on_ground(bodies).build(common::named("shim")).unwrap();
    let mut fastest = 0.0_f64;
    for _ in 0..90 {
        world.step().unwrap();
        fastest = world.bodies.velocity_y.iter().fold(fastest, |most, &v| most.max(f64::from(v)));
    }
    fastest
}

fn boxed(x: f64, y: f64, density: f64) -> SceneBody {
    SceneBody::dynamic([x, y], SceneShape::rectangle(0.5, 0.5).density(density))
}

/// Speed that gravity adds in a step (m/s).
const OF_A_STEP: f64 = 10.0 / 60.0;

/// With e = 0 nothing that lands goes up again: an impact is one problem for all bodies that touch.
#[test]
fn what_lands_without_restitution_stays_down() {
    let block = |wide: u32, high: u32, x: f64| {
        (0..wide * high).map(move |i| boxed(x + f64::from(i % wide), 2.5 + f64::from(i / wide), 1.0))
    };
    for (wide, high) in [(1, 10), (1, 30), (2, 3), (4, 3)] {
        let speed = rebound(block(wide, high, 0.0).collect());
        assert!(speed < OF_A_STEP, "{wide} × {high} boxes: {speed} m/s");
    }
    let speed = rebound((0..25).flat_map(|i| block(4, 3, 4.5 * f64::from(i) - 56.0)).collect());
    assert!(speed < OF_A_STEP, "25 blocks of 4 × 3 boxes: {speed} m/s");
}

/// A box of many times the mass falls by two meters on one box, or on ten.
#[test]
fn a_heavy_box_does_not_bounce_on_light_ones() {
    for (count, ratio) in [(1, 10.0), (1, 30.0), (1, 100.0), (1, 300.0), (10, 10.0), (10, 30.0), (10, 100.0)]
    {
        let pile = (0..count).map(|i| boxed(0.0, 0.5 + f64::from(i), 1.0));
        let speed = rebound(pile.chain([boxed(0.0, f64::from(count) + 2.5, ratio)]).collect());
        assert!(speed < OF_A_STEP, "{ratio} : 1 on {count}: {speed} m/s");
    }
}

/// Planks of six boxes each, with twelve points between neighbors: a sweep takes turns among pairs of bodies.
#[test]
fn bodies_with_many_contacts_come_to_rest() {
    for planks in [6, 10] {
        let plank = |i: u32| {
            let part = |k: u32| SceneShape::rectangle_at([0.1, 0.1], [0.3 * f64::from(k) - 0.75, 0.0]);
            let shapes = (0..6).map(part).collect();
            SceneBody { shapes, ..SceneBody::dynamic([0.0, 0.1 + 0.2 * f64::from(i)], part(0)) }
        };
        let scene = common::on_ground((0..planks).map(plank).collect());
        for solver in ["shim", "soft_step", "box2d", "rapier"] {
            let fastest = common::fastest(&common::run(&scene, common::named(solver), 600));
            assert!(fastest < 1e-4, "{planks} planks, {solver}: {fastest} m/s");
        }
    }
}
