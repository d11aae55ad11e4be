//! The law of rest: piles of a few boxes stay where they are at the standard budget.

use simpulse::engine::solvers::{Law, VARIANTS, Variant, find};
use simpulse::engine::world::World;
use simpulse::lab::scenes::Scene;

/// Piles of a few boxes: a stack, a pyramid, and one box held by friction.
const PILES: [&str; 3] = ["stack:10", "pyramid:4", "incline_stick"];

/// How far bodies may creep in the last five of ten seconds (m): a fifth of a slop.
const CREEP: f64 = 1e-3;

/// The greatest way of any body in the last five of ten seconds (m).
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
        if variant.promises(Law::Rest) && !ways.iter().all(|&way| way <= CREEP) {
            wrong.push(format!("{}: {ways:?}", variant.name));
        }
    }
    assert!(wrong.is_empty(), "promised rest, in {PILES:?} crept: {wrong:#?}");
}

#[test]
fn not_every_solver_keeps_them() {
    // Else the bound would hold nobody to anything.
    let variant = VARIANTS.iter().find(|v| v.name == "projection").unwrap();
    assert!(!variant.promises(Law::Rest) && creep("stack:10", variant) > CREEP);
}

/// Forty smooth discs in a row along the ground, which a tenth of their weight presses against a wall: as long a
/// chain as a column of forty, and no load that tells it.
#[test]
fn a_pressed_row_does_not_swing_on_its_preload() {
    let fixed = |position: [f64; 2], half: [f64; 2]| {
        let shape = format!(r#"{{"box":{{"half":[{},{}]}},"friction":0}}"#, half[0], half[1]);
        format!(r#"{{"type":"static","position":[{},{}],"shapes":[{shape}]}}"#, position[0], position[1])
    };
    let mut bodies = vec![fixed([0.0, -1.0], [200.0, 1.0]), fixed([-1.0, 5.0], [1.0, 5.0])];
    bodies.extend((0..40).map(|i| {
        let shape = r#"{"circle":{"radius":0.5},"friction":0}"#;
        format!(r#"{{"type":"dynamic","position":[{},0.5],"shapes":[{shape}]}}"#, 0.5 + f64::from(i))
    }));
    let text = format!(r#"{{"name":"row","gravity":[-1,-10],"bodies":[{}]}}"#, bodies.join(","));
    let scene = Scene::from_json(&text, "row.json".as_ref()).unwrap();
    let world = crate::common::run(&scene, crate::common::settings(find("shim").unwrap()), 900);
    let fastest = world.bodies.velocity_x.iter().fold(0.0f32, |most, v| most.max(v.abs()));
    assert!(fastest < 1e-4, "{fastest} m/s");
}

/// Lemke's method and Newton's end in the same state of the contact law, far closer to it than sweeps do.
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
