//! Laws of impacts without restitution, under the solver that resolves them before the step.

use super::common::totals;
use proptest::prelude::*;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{DEFAULT, find};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};
use simpulse::lab::torture::{family, run_solver};

fn pair(
    angles: [f64; 2],
    offset: f64,
    speed: [f64; 2],
    spins: [f64; 2],
    friction: f64,
    density: f64,
) -> Scene {
    let boxed = |half: f64| SceneShape::rectangle(half, 0.5).friction(friction);
    let bodies = vec![
        SceneBody::dynamic([0.0, 0.0], boxed(0.8)).moving([0.0, 0.0], spins[0]).turned(angles[0]),
        SceneBody::dynamic([-2.0, offset], boxed(0.5).density(density))
            .moving(speed, spins[1])
            .turned(angles[1]),
    ];
    Scene::new("pair", bodies).weightless()
}

proptest! {
    /// Two free boxes that hit each other anywhere conserve both momenta and gain no energy.
    #[test]
    fn momenta_are_kept_and_no_energy_is_made(
        angles in [-1.5f64..1.5, -1.5..1.5],
        offset in -0.8f64..0.8,
        speed in [3f64..10.0, -1.0..1.0],
        spins in [-4f64..4.0, -4.0..4.0],
        friction in 0f64..1.0,
        density in 0.2f64..5.0,
    ) {
        let scene = pair(angles, offset, speed, spins, friction, density);
        let mut world = scene.build(crate::common::named(DEFAULT)).unwrap();
        let before = totals(&world);
        (0..60).for_each(|_| world.step().unwrap());
        let after = totals(&world);
        let scale = before[0].hypot(before[1]).max(1.0);
        for k in 0..2 {
            // 60 · 14 substeps round each velocity four times, by 2⁻²⁴ of it: √3360 · 6e-8 = 3.5e-6. The
            // bound is six times that.
            prop_assert!((after[k] - before[k]).abs() < 2.1e-5 * scale, "{before:?} {after:?}");
        }
        // A gap that closes unpredicted within a step leaves an overlap. In the next step, springs push it
        // out with an impulse of at most μ v_n. They act on the two bodies at points that coincide at the
        // start of that step and are v_t h apart at its end. So at most μ v_n v_t h is gained.
        let reduced = 1.6 * density / (1.6 + density);
        let passing = speed[0].hypot(speed[1]) + 0.95 * spins[0].abs() + 0.75 * spins[1].abs();
        let gained = reduced * passing * passing / 60.0;
        prop_assert!((after[2] - before[2]).abs() < 0.01 * scale + gained, "{before:?} {after:?}");
        prop_assert!(after[3] < 1.0001 * before[3], "{before:?} {after:?}");
    }
}

#[test]
fn impacts_of_a_crowd_have_the_same_bits_at_every_width() {
    let mut bodies = Vec::new();
    for i in 0..60 {
        let (x, y) = (f64::from(i % 10), f64::from(i / 10));
        let shape = if i % 3 == 0 { SceneShape::disc(0.48) } else { SceneShape::rectangle(0.48, 0.45) };
        let body = SceneBody::dynamic([1.02 * x, 1.02 * y], shape);
        let (sin, cos) = f64::from(i).sin_cos();
        bodies.push(body.moving([8.0 * cos - x, 8.0 * sin - y], 3.0 * sin));
    }
    let scene = Scene::new("crowd", bodies).weightless();
    let hash = |width| {
        let settings = crate::common::with_width(find(DEFAULT).unwrap(), width);
        crate::common::run(&scene, settings, 60).state_hash()
    };
    let one = hash(LaneWidth::W1);
    for width in [LaneWidth::W4, LaneWidth::W8, LaneWidth::W16] {
        assert_eq!(hash(width), one, "{width:?}");
    }
}

#[test]
fn a_body_that_lands_lies_on_the_ground_and_not_where_the_step_found_it() {
    // 4 m/s, from heights that are not whole numbers of steps.
    for height in [0.005, 0.012, 0.03, 0.05] {
        let ground = SceneBody::fixed([0.0, 0.0], SceneShape::line(5.0));
        let falling = SceneBody::dynamic([0.0, 0.5 + height], SceneShape::disc(0.5)).moving([0.0, -4.0], 0.0);
        let scene = Scene::new("landing", vec![ground, falling]).weightless();
        let world = crate::common::run(&scene, crate::common::named(DEFAULT), 3);
        let [_, y] = world.bodies.center(1);
        assert!((y - 0.5).abs() < 1e-6 && world.bodies.velocity_y[1].abs() < 1e-6, "{height}: {y}");
    }
}

/// Three kinds of squeezes: a body overlaps a pressed one and only touches the wall behind it, the normals of a
/// jam turn from one step to the next until they no longer oppose each other, and a body without room is pressed
/// sideways.
#[test]
fn what_a_piston_presses_is_not_shot_away() {
    let settings = Settings::new(find(DEFAULT).unwrap());
    for (seed, number) in [(1, 2339), (4, 3515), (6, 3015), (5, 1658), (4, 441)] {
        let outcome = run_solver(&family("driven").unwrap().case(seed, number), &settings).unwrap();
        assert!(outcome.energy < 1.2, "driven:{number} of seed {seed}: {} energy budgets", outcome.energy);
    }
}

/// A body thrown halfway through a line has one shape above it and one below, and slides to the end of the
/// line. Contacts that push against each other must not store anything that shoots the body off there with
/// many times its energy.
#[test]
fn a_body_that_is_caught_in_a_line_makes_no_energy_where_the_line_ends() {
    let text = r#"{"name":"caught","dt":0.03333333333333333,"bodies":[
        {"type":"static","position":[0,0],"shapes":[{"segment":{"a":[-10,0],"b":[10,0]},"friction":0}]},
        {"type":"dynamic","position":[0.5,1.2],"velocity":[-7.7,-18.5],"shapes":[
            {"polygon":{"points":[[-0.483,-0.119],[0.483,-0.119],[0,0.119]]},"friction":0},
            {"circle":{"center":[0.055,0.159],"radius":0.232},"friction":0}]}]}"#;
    let scene = Scene::from_json(text, "caught.json".as_ref()).unwrap();
    let energy = |world: &World| {
        let b = &world.bodies;
        let (spin, [_, y]) = (f64::from(b.angular_velocity[1]), b.center(1));
        let turning = f64::from(b.inv_mass[1]) / f64::from(b.inv_inertia[1]) * spin * spin;
        0.5 * (f64::from(b.velocity(1).length_squared()) + turning) + 10.0 * y
    };
    let run = |substeps: u32| {
        // Otherwise it would not get into the line.
        let mut settings = Settings { continuous: false, ..crate::common::named(DEFAULT) };
        settings.budget.substeps = substeps;
        let mut world = scene.build(settings).unwrap();
        let (before, mut most, mut was_caught) = (energy(&world), 0.0, false);
        for _ in 0..120 {
            world.step().unwrap();
            most = energy(&world).max(most);
            was_caught |= world.contacts.len() == 2;
        }
        assert!(was_caught);
        most / before
    };
    for substeps in [14, 64] {
        let most = run(substeps);
        assert!(most <= 1.01, "{substeps} substeps: {most} of the energy that it had");
    }
}
