//! Iterations can be watched: every solver reports each of its iterations, with the problem as it stands
//! then.

use simpulse::engine::constraints::System;
use simpulse::engine::constraints::step::Watch;
use simpulse::engine::solvers::{VARIANTS, Variant, find};
use simpulse::engine::world::World;
use std::sync::Arc;
use std::sync::Mutex;

/// Reports of one step of a pyramid: iteration and residual of the rigid law (N·s).
fn watched(variant: &'static Variant, iterations: u32) -> Vec<(u32, f64)> {
    let mut settings = crate::common::settings(variant);
    settings.budget = variant.of_iterations(iterations);
    let mut world: World = crate::common::scene("pyramid:4").build(settings).unwrap();
    let h = world.settings.h();
    let seen = Arc::new(Mutex::new(Vec::new()));
    let to = seen.clone();
    let look = move |k: u32, system: &mut System<'_>| to.lock().unwrap().push((k, system.residual(h)));
    world.workspace().watch = Some(Watch(Box::new(look)));
    world.step().unwrap();
    world.workspace().watch = None;
    std::mem::take(&mut *seen.lock().unwrap())
}

#[test]
fn every_iteration_of_every_solver_is_seen_once() {
    for variant in VARIANTS {
        for iterations in [1, 5] {
            let seen: Vec<u32> = watched(variant, iterations).iter().map(|(k, _)| *k).collect();
            assert_eq!(seen, (1..=iterations).collect::<Vec<_>>(), "{}", variant.name);
        }
    }
}

#[test]
fn the_residual_falls_by_iterations() {
    let seen = watched(find("pgs").unwrap(), 200);
    let (first, last) = (seen[0].1, seen[199].1);
    assert!(first > 1e-2 && last < 1e-4, "{first:e} to {last:e}");
}
