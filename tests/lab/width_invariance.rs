//! Law: the number of lanes changes the run time of a step and nothing else.

use crate::common::{named, run, settings, with_width};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{VARIANTS, find};
use simpulse::engine::world::{Order, Settings};
use simpulse::lab::scenes;

/// Scenes whose kernels use different features: discs with and without friction, boxes, polygons,
/// restitution, kinematic bodies, exhausted colors.
const SCENES: [&str; 8] = [
    "disc_column:10",
    "stack:12",
    "pyramid:12",
    "circle_pile:120",
    "card_house",
    "arch",
    "oblique_collision",
    "crowded_plate",
];
/// Two seconds: discs have fallen on each other, and what diverges has diverged.
const STEPS: u32 = 120;

#[test]
fn all_widths_give_the_same_bits() {
    for scene in SCENES {
        let scene = crate::common::scene(scene);
        for variant in &VARIANTS {
            let mut hashes = Vec::new();
            for width in LaneWidth::ALL {
                let mut world = scene.build(crate::common::with_width(variant, width)).unwrap();
                let mut trail = Vec::new();
                for _ in 0..STEPS {
                    let outcome = world.step();
                    trail.push(world.state_hash());
                    if outcome.is_err() {
                        break;
                    }
                }
                hashes.push(trail);
            }
            for (width, trail) in LaneWidth::ALL.iter().zip(&hashes).skip(1) {
                let first = trail.iter().zip(&hashes[0]).position(|(a, b)| a != b);
                assert_eq!(first, None, "{} {} {width:?}: first differing step", scene.name, variant.name);
                assert_eq!(trail.len(), hashes[0].len(), "{} {}: diverged apart", scene.name, variant.name);
            }
        }
    }
}

/// In natural order. Colored runs are compared with hashes of earlier ones (`golden`).
#[test]
fn the_same_run_twice_gives_the_same_bits() {
    for name in ["pyramid:10", "circle_pile:80"] {
        for variant in &VARIANTS {
            let scene = crate::common::scene(name);
            let settings = Settings { order: Order::Natural, ..with_width(variant, LaneWidth::W1) };
            let (a, b) = (run(&scene, settings.clone(), 200), run(&scene, settings, 200));
            assert_eq!(a.state_hash(), b.state_hash(), "{name} {}", variant.name);
        }
    }
}

#[test]
fn the_order_of_constraints_does_change_the_bits() {
    // Otherwise the hashes above would compare nothing.
    let scene = crate::common::scene("pyramid:10");
    let colored = run(&scene, named("pgs"), 50);
    let mut natural = named("pgs");
    (natural.order, natural.width) = (Order::Natural, LaneWidth::W1);
    assert_ne!(colored.state_hash(), run(&scene, natural, 50).state_hash());
}

#[test]
fn a_crowded_plate_runs_out_of_colors() {
    let world = run(&scenes::load("pyramid:4").unwrap().scene, named("soft_step"), 1);
    assert_eq!(world.counts().overflow, 0);
    let world = run(&crate::common::scene("crowded_plate"), named("soft_step"), 60);
    assert!(world.counts().overflow > 0, "{:?}", world.counts());
}

#[test]
fn few_contacts_run_in_fewer_lanes_with_the_same_bits() {
    // A stack of five has colors of one and two contacts, a pyramid of 40 rows colors of hundreds.
    for (name, lanes) in [("stack:5", LaneWidth::W4), ("pyramid:40", LaneWidth::WIDEST)] {
        let scene = crate::common::scene(name);
        let solver = find("soft_step").unwrap();
        let fitted = Settings { width: LaneWidth::WIDEST, narrowest: LaneWidth::W4, ..settings(solver) };
        let world = run(&scene, fitted, 30);
        assert_eq!(world.lane_width(), lanes, "{name}");
        let exactly = run(&scene, with_width(solver, LaneWidth::WIDEST), 30);
        assert_eq!(exactly.lane_width(), LaneWidth::WIDEST, "{name}");
        assert_eq!(world.state_hash(), exactly.state_hash(), "{name}");
    }
}
