//! Metrics on real runs: what must be zero, what must not, and what an outsider can compute.

use simpulse::lanes::LaneWidth;
use simpulse::metrics::{Errors, Observation};
use simpulse::scenes::{self, Scene};
use simpulse::solvers::{VARIANTS, find};
use simpulse::world::{Settings, World};

fn build(scene: &Scene, solver: &str) -> World {
    let settings = Settings { record_impulses: true, ..Settings::new(find(solver).unwrap()) };
    scene.build(settings).unwrap()
}

fn observe(world: &mut World, steps: u32) -> Errors {
    let mut observation = Observation::new(world);
    for _ in 0..steps {
        world.step().unwrap();
        observation.observe(world);
    }
    observation.errors()
}

fn json(bodies: &str, gravity: f64) -> Scene {
    let text = format!(r#"{{"name":"x","gravity":[0,{gravity}],"bodies":[{bodies}]}}"#);
    Scene::from_json(&text, "x.json".as_ref()).unwrap()
}

#[test]
fn a_scene_without_bodies_has_no_errors() {
    for variant in &VARIANTS {
        let errors = observe(&mut build(&json("", -10.0), variant.name), 3);
        assert_eq!(errors, Errors { steps: 3, ..Errors::default() });
    }
}

#[test]
fn free_fall_keeps_everything_to_rounding() {
    for variant in &VARIANTS {
        let mut world = build(&scenes::load("free_fall").unwrap().scene, variant.name);
        let errors = observe(&mut world, 60);
        // 60 steps of up to 4 substeps, each a few roundings of 6e-8 of what it adds to.
        for value in [errors.momentum, errors.energy_change.abs(), errors.energy_created] {
            assert!(value < 1e-5, "{} {errors:?}", variant.name);
        }
        assert_eq!((errors.points, errors.law_rms, errors.penetration_max), (0, 0.0, 0.0));
    }
}

#[test]
fn the_ground_takes_the_momentum_that_weight_gives() {
    for variant in &VARIANTS {
        // Boxes on a slope and on each other: impulses of both kinds, at both ends.
        for name in ["incline_slip", "pyramid:6", "friction_ramp"] {
            let errors = observe(&mut build(&scenes::load(name).unwrap().scene, variant.name), 120);
            // Rounding of velocities below 10 m/s in 120 steps; a lost impulse would be 1e-2.
            assert!(errors.momentum < 1e-4, "{name} {} {errors:?}", variant.name);
        }
    }
}

#[test]
fn a_push_from_nowhere_shows_in_every_balance() {
    let mut world = build(&scenes::load("stack:3").unwrap().scene, "pgs");
    let mut observation = Observation::new(&world);
    for step in 0..40 {
        if step == 20 {
            world.bodies.velocity_x[3] += 0.5;
            world.bodies.angular_velocity[3] += 0.5;
        }
        world.step().unwrap();
        observation.observe(&world);
    }
    let errors = observation.errors();
    // One of three boxes of 1 kg: 0.5 N·s of 3 kg × at most 0.5/√3 · √(1 + 1/6) m/s.
    assert!(errors.momentum > 0.3, "{errors:?}");
    assert!(errors.angular_momentum > 0.1, "{errors:?}");
    // ½ 1 kg 0.25 m²/s² + ½ (1/6) 0.25 = 0.146 J, of which friction takes some in the same
    // step; the scale is the weight of 30 N × √(1/6) m = 12.2 J and more.
    assert!((0.003..0.146 / 12.2).contains(&errors.energy_created), "{errors:?}");
}

#[test]
fn a_solver_without_friction_breaks_the_tangential_law_only() {
    let scene = scenes::load("incline_slip").unwrap().scene;
    let with = observe(&mut build(&scene, "pgs"), 60);
    let without = observe(&mut build(&scene, "projection"), 60);
    // Friction should be µ N = 0.24 cos θ m g Δt in all, shared by two points.
    let expected = 0.24 * 0.25_f64.cos() / 2.0;
    assert!(with.law_tangent_rms < 1e-3, "{with:?}");
    assert!((without.law_tangent_rms - expected).abs() < 0.05 * expected, "{without:?}");
    assert!(without.law_normal_rms < 1e-2, "{without:?}");
}

#[test]
fn penetration_is_what_the_poses_say() {
    let scene = json(
        r#"{"type":"static","position":[0,-1],"shapes":[{"box":{"half":[5,1]}}]},
           {"type":"dynamic","position":[0,0.3],"shapes":[{"circle":{"radius":0.5}}]}"#,
        0.0,
    );
    let mut world = build(&scene, "pgs");
    let errors = observe(&mut world, 1);
    let depth = 0.5 - world.bodies.position_y[1] as f64;
    assert!(depth > 0.1 && depth < 0.2, "{depth}");
    // One point, one step: the maximum is the mean. Distances of 1 m in f32.
    for value in [errors.penetration_max, errors.penetration_mean, errors.penetration_rms] {
        assert!((value - depth).abs() < 1e-6, "{value} {depth}");
    }
    assert!((errors.penetration_relative - depth / 0.5).abs() < 1e-5);
}

#[test]
fn a_lift_gives_energy_that_is_accounted_for() {
    let scene = json(
        r#"{"type":"kinematic","position":[0,-1],"velocity":[0,1],"shapes":[{"box":{"half":[5,1]}}]},
           {"type":"dynamic","position":[0,0.5],"velocity":[0,1],"shapes":[{"box":{"half":[0.5,0.5]}}]}"#,
        -10.0,
    );
    let mut world = build(&scene, "pgs");
    let errors = observe(&mut world, 120);
    // 2 m × 10 N = 20 J came in; the scale is 0.5 J + 10 N × √(1/6) m = 4.6 J.
    assert!(world.bodies.position_y[1] > 2.4);
    assert!(errors.energy_change.abs() < 1e-3, "{errors:?}");
}

#[test]
fn rest_velocity_is_of_the_last_second() {
    // 2 m/s for ever; and a disc that spins with 2 rad/s: √(ω² r²/2) = 0.7071 m/s at r = 0.5.
    let moving =
        r#"{"type":"dynamic","position":[0,0],"velocity":[2,0],"shapes":[{"circle":{"radius":0.5}}]}"#;
    let spinning =
        r#"{"type":"dynamic","position":[0,0],"angular_velocity":2,"shapes":[{"circle":{"radius":0.5}}]}"#;
    let speed = |body: &str| observe(&mut build(&json(body, 0.0), "pgs"), 90).rest_velocity;
    assert!((speed(moving) - 2.0).abs() < 1e-6);
    assert!((speed(spinning) - 0.5_f64.sqrt()).abs() < 1e-6);
}

#[test]
fn errors_do_not_depend_on_the_lane_width() {
    let scene = scenes::load("pyramid:5").unwrap().scene;
    let of = |width| {
        let settings = Settings { record_impulses: true, width, ..Settings::new(find("soft_step").unwrap()) };
        observe(&mut scene.build(settings).unwrap(), 60)
    };
    let one = of(LaneWidth::W1);
    assert!(one.penetration_max > 0.0 && one.law_rms > 0.0);
    for width in LaneWidth::ALL {
        assert_eq!(of(width), one, "{width:?}");
    }
}
