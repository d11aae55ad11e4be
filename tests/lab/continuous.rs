//! Continuous collision: fast bodies do not pass through, slow bodies are unaffected, and lanes do not
//! matter.

use crate::common::{named, run, settings, with_width};
use simpulse::engine::bodies::BodyKind;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{VARIANTS, Variant, find};
use simpulse::engine::world::Settings;
use simpulse::lab::scenes::{Scene, SceneBody, SceneShape};
use simpulse::lab::torture::{TortureVerdict, family, run_solver};

fn on(variant: &'static Variant) -> Settings {
    Settings { continuous: true, ..settings(variant) }
}

/// A `target` of 1 cm at x = 0, and `what` flying at it at 300 m/s from 7.3 m away.
fn shot(what: SceneShape, target: SceneBody, bullet: bool) -> Scene {
    let body = SceneBody { bullet, ..SceneBody::dynamic([-7.3, 0.1], what) };
    Scene::new("shot", vec![target, body.moving([300.0, 0.0], 20.0)]).weightless()
}

fn wall() -> SceneBody {
    SceneBody::fixed([0.0, 0.0], SceneShape::rectangle(0.005, 3.0))
}

#[test]
fn a_bullet_stops_at_a_wall_under_every_solver_and_without_goes_through() {
    let shapes = [
        SceneShape::disc(0.05),
        SceneShape::rectangle(0.05, 0.03),
        SceneShape::polygon(vec![[-0.05, -0.05], [0.05, -0.05], [0.0, 0.05]]),
    ];
    for variant in &VARIANTS {
        let mut through = 0;
        for (shape, k) in shapes.iter().flat_map(|shape| (0..30).map(move |k| (shape, f64::from(k)))) {
            let mut scene = shot(shape.clone(), wall(), false);
            scene.bodies[1].position[0] += 0.02 * k;
            scene.bodies[1].angular_velocity -= 2.0 * k;
            // NaN if the solver diverges.
            let x = |settings| {
                let mut world = scene.build(settings).unwrap();
                let ends = (0..60).all(|_| world.step().is_ok());
                if ends { world.bodies.center(1)[0] } else { f64::NAN }
            };
            let stops = x(on(variant)) < 0.0;
            through += u32::from(!stops);
            if k == 0.0 {
                assert!(stops || KNOWN_AT_FIRST.contains(&variant.name), "{} {shape:?}", variant.name);
                let off = Settings { continuous: false, ..settings(variant) };
                let passes = x(off) > 0.0;
                assert!(
                    passes || KNOWN_AT_FIRST.contains(&variant.name),
                    "{} {shape:?}: 5 m in a step",
                    variant.name
                );
            }
        }
        let known = KNOWN.iter().find(|(name, _)| *name == variant.name).map_or(0, |(_, most)| *most);
        assert!(through <= known, "{}: {through} of 90", variant.name);
    }
}

/// Solvers under which the first shot eventually gets through, or that diverge.
const KNOWN_AT_FIRST: [&str; 6] = ["pgs_soft", "jacobi", "mass_splitting", "tgs_soft", "tgs_sticky", "physx"];

/// The same for all 90 shots, with the largest allowed number of failures. A body that stops deep in the
/// contact and spins may pass through in later steps, since rotation is not traced.
const KNOWN: [(&str, u32); 12] = [
    ("projection", 6),
    ("pgs_soft", 3),
    ("anderson", 1),
    ("admm", 1),
    ("shock", 1),
    ("split_impulse", 1),
    ("jacobi", 3),
    ("mass_splitting", 6),
    ("tgs_soft", 44),
    ("tgs_sticky", 2),
    ("xpbd", 8),
    ("physx", 45),
];

#[test]
fn dynamic_bodies_stop_those_that_ask_for_it() {
    let soft_step = find("soft_step").unwrap();
    let plate = SceneBody::dynamic([0.0, 0.0], SceneShape::rectangle(0.005, 3.0).density(1e4));
    let x = |bullet| {
        let scene = shot(SceneShape::disc(0.05), plate.clone(), bullet);
        let world = run(&scene, on(soft_step), 60);
        world.bodies.center(1)[0] - world.bodies.center(0)[0]
    };
    assert!(x(true) < 0.0 && x(false) > 0.0, "{} {}", x(true), x(false));
}

#[test]
fn two_bullets_do_not_pass_each_other() {
    let ball = |x: f64, v: f64| {
        let body = SceneBody::dynamic([x, 0.0], SceneShape::disc(0.05)).moving([v, 0.0], 0.0);
        SceneBody { bullet: true, ..body }
    };
    let scene = Scene::new("duel", vec![ball(-8.3, 300.0), ball(9.1, -250.0)]).weightless();
    let world = run(&scene, on(find("soft_step").unwrap()), 60);
    assert!(world.bodies.center(0)[0] < world.bodies.center(1)[0]);
}

#[test]
fn what_is_not_fast_keeps_its_bits_and_lanes_do_not_matter() {
    for variant in &VARIANTS {
        let scene = crate::common::scene("pyramid:6");
        let hash = |continuous| run(&scene, Settings { continuous, ..settings(variant) }, 60).state_hash();
        assert_eq!(hash(true), hash(false), "{}", variant.name);
    }
    let case = family("fast").unwrap().case(5, 3);
    let soft_step = find("soft_step").unwrap();
    let hashes = LaneWidth::ALL.map(|width| {
        let settings = Settings { continuous: true, ..with_width(soft_step, width) };
        run(&case.scene, settings, 120).state_hash()
    });
    assert!(hashes.iter().all(|h| *h == hashes[0]), "{hashes:?}");
}

#[test]
fn fast_bodies_stay_in_their_rooms() {
    let soft_step = find("soft_step").unwrap();
    let escapes = |settings: &Settings| {
        let case = |number| family("fast").unwrap().case(1, number);
        (0..60).filter(|&n| run_solver(&case(n), settings).unwrap().has(TortureVerdict::Escaped)).count()
    };
    assert_eq!(escapes(&on(soft_step)), 0);
    // Otherwise the scenes would be too easy.
    assert!(escapes(&settings(soft_step)) > 20);
    assert_eq!(escapes(&named("shim")), 0);
}

/// A box between a wall 2 m thick and a door that moves toward it at 1 m/s and on into the wall.
#[test]
fn what_a_door_presses_does_not_leave_through_the_wall() {
    let still =
        |position, half: [f64; 2]| SceneBody::fixed(position, SceneShape::rectangle(half[0], half[1]));
    let door = SceneBody::new(BodyKind::Kinematic, [1.5, 2.55], SceneShape::rectangle(1.0, 2.5));
    let scene = Scene::new(
        "door",
        vec![
            still([0.0, -1.0], [10.0, 1.0]),
            still([7.0, 3.0], [1.0, 7.0]),
            SceneBody::dynamic([5.5, 0.5], SceneShape::rectangle(0.5, 0.5)),
            door.moving([1.0, 0.0], 0.0),
        ],
    );
    for variant in ["shim", "soft_step", "pgs", "pgs_soft", "box2d", "rapier"] {
        let mut world = scene.build(on(find(variant).unwrap())).unwrap();
        for step in 0..400 {
            world.step().unwrap();
            let [x, y] = world.bodies.center(2);
            assert!(x < 6.01 && y > -0.01, "{variant} at step {step}: ({x}, {y})");
        }
    }
}

/// A rod that turns strikes a disc at rest. It touches the disc at a distance r from its pivot, and gives it (1 + e) ω r along its
/// normal.
#[test]
fn a_turning_rod_strikes_what_is_in_its_way() {
    let (half, radius, far) = (0.1_f64, 0.05_f64, 1.5_f64);
    let r = (far * far - (half + radius).powi(2)).sqrt();
    for spin in [2.0_f64, 5.0, 20.0, -20.0] {
        for (k, e) in [(0, 1.0), (1, 1.0), (2, 0.5), (3, 0.0)] {
            let smooth = |shape: SceneShape| SceneShape { friction: 0.0, restitution: e, ..shape };
            let rod = SceneBody::new(BodyKind::Kinematic, [0.0; 2], smooth(SceneShape::rectangle(2.0, half)));
            let angle = 0.9 + 0.05 * f64::from(k);
            let disc = smooth(SceneShape::disc(radius));
            let disc = SceneBody::dynamic([far * angle.cos(), spin.signum() * far * angle.sin()], disc);
            let scene = Scene::new("striker", vec![rod.moving([0.0; 2], spin), disc]).weightless();
            let mut world = scene.build(named("shim")).unwrap();
            let speed = |world: &simpulse::engine::world::World| f64::from(world.bodies.velocity(1).length());
            let steps = (0..60).take_while(|_| {
                world.step().unwrap();
                speed(&world) == 0.0
            });
            let steps = steps.count();
            let (found, expected) = (speed(&world), (1.0 + e) * spin.abs() * r);
            assert!(
                (found / expected - 1.0).abs() < 0.02,
                "{spin} rad/s, e = {e}: {found} for {expected} m/s, {steps}"
            );
        }
    }
}

/// A plate and a disc fly at each other. They meet within a step, at the start of which the disc is farther away than the plate
/// moves.
#[test]
fn a_plate_takes_along_what_flies_at_it() {
    for (speed, plate_speed) in [(600.0, 60.0), (300.0, 30.0), (60.0, 60.0), (600.0, 600.0)] {
        for gap in 1..=20 {
            let plate = SceneBody::new(BodyKind::Kinematic, [0.0; 2], SceneShape::rectangle(0.05, 2.0));
            let disc = SceneBody::dynamic([0.5 * f64::from(gap), 0.1], SceneShape::disc(0.05));
            let bodies = vec![plate.moving([plate_speed, 0.0], 0.0), disc.moving([-speed, 0.0], 0.0)];
            let world = run(&Scene::new("head_on", bodies).weightless(), named("shim"), 20);
            let distance = world.bodies.center(1)[0] - world.bodies.center(0)[0];
            assert!(distance > 0.0, "{speed} and {plate_speed} m/s, {gap}: {distance} m");
        }
    }
}

#[test]
fn no_body_is_fast_once_continuous_collision_is_off() {
    let disc = SceneBody::dynamic([0.0; 2], SceneShape::disc(0.05)).moving([100.0, 0.0], 0.0);
    let mut world = Scene::new("fast", vec![disc]).weightless().build(named("shim")).unwrap();
    for (continuous, fast) in [(true, 1), (false, 0)] {
        world.settings.continuous = continuous;
        world.step().unwrap();
        assert_eq!(world.counts().fast, fast);
    }
}

/// A rod on its tip with another body on it tips over. Continuous collision must not hold it in place while
/// its speed grows.
#[test]
fn what_stands_on_its_tip_tips_over() {
    let case = family("drops").unwrap().case(1, 19);
    assert!(!run_solver(&case, &on(find("shim").unwrap())).unwrap().has(TortureVerdict::Sunk));
}

#[test]
fn where_pistons_leave_no_room_nothing_is_flung_and_nothing_leaves() {
    let shim = named("shim");
    assert!(shim.continuous);
    for number in 0..60 {
        let outcome = run_solver(&family("driven").unwrap().case(1, number), &shim).unwrap();
        let fails = [TortureVerdict::Diverged, TortureVerdict::Flung, TortureVerdict::Escaped]
            .map(|verdict| outcome.has(verdict));
        assert_eq!(fails, [false; 3], "driven:{number}: {:?}", outcome.faults);
    }
}

/// A box of 0.05 kg under one of 320 kg, a capsule under 3·10⁶ kg, and a body with its leg between two planks of a beam.
/// With springs shortened by any length the first leaves at 104 m/s and the second spins at 10⁵ rad/s; with
/// over-relaxation that friction does not bound, the third leaves at 200 m/s.
#[test]
fn what_is_crushed_is_not_flung() {
    let shim = named("shim");
    for (name, seed, number) in [("ratios", 20, 54), ("scales", 1, 601), ("hung", 3, 1420)] {
        let outcome = run_solver(&family(name).unwrap().case(seed, number), &shim).unwrap();
        let fails = [TortureVerdict::Diverged, TortureVerdict::Energy, TortureVerdict::Flung]
            .map(|verdict| outcome.has(verdict));
        assert_eq!(fails, [false; 3], "{name}:{number}: {:?}", outcome.faults);
    }
}
