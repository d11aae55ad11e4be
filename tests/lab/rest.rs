//! The law of rest: piles of a few boxes stay where they are at the standard budget.

use simpulse::engine::solvers::{Law, VARIANTS, Variant};
use simpulse::engine::world::World;

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
