//! With warm starting, sweeps of earlier frames count. Tested on a column of discs, where the rate of
//! Gauss–Seidel is known exactly.
//!
//! N discs of mass m stand on each other. With λ the impulse of each contact, bottom first, the exact answer
//! is λ_i = (N − i) m g h. The error of Gauss–Seidel shrinks by cos²(π/2N) per sweep (tests/lab/converge.rs).

use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers;
use simpulse::engine::world::{Order, World};

const DISCS: usize = 10;

/// A column whose solver runs `sweeps` sweeps per step.
fn column(sweeps: u32) -> World {
    let mut settings = crate::common::with_width(solvers::find("pgs").unwrap(), LaneWidth::W1);
    settings.order = Order::Natural;
    settings.budget.velocity_iterations = sweeps;
    crate::common::scene(&format!("disc_column:{DISCS}")).build(settings).unwrap()
}

/// Largest error of a normal impulse, relative to the load on the ground.
fn error(world: &World) -> f64 {
    let dt = world.settings.dt as f64;
    let mass = 1.0 / world.bodies.inv_mass[1] as f64;
    assert_eq!(world.contacts.len(), DISCS);
    let exact = |i: usize| (DISCS - i) as f64 * mass * 10.0 * dt;
    let errors = world.contacts.iter().enumerate().map(|(i, contact)| {
        assert_eq!(contact.body_b as usize, i + 1, "contacts are sorted from the ground up");
        (contact.manifold.points[0].normal_impulse as f64 - exact(i)).abs()
    });
    errors.fold(0.0, f64::max) / exact(0)
}

#[test]
fn frames_of_few_sweeps_equal_one_frame_of_many() {
    let mut once = column(80);
    once.frozen_step();
    let mut often = column(8);
    (0..10).for_each(|_| often.frozen_step());
    let (cold, warm) = (error(&once), error(&often));
    assert!((warm / cold - 1.0).abs() < 1e-2, "{warm} for {cold}");
}

#[test]
fn warm_starting_cuts_the_sweeps_to_a_residual() {
    let tolerance = 1e-2;
    let sweeps_needed = |frames_before: usize| {
        (1..400).find(|&sweeps| {
            let mut world = column(20);
            (0..frames_before).for_each(|_| world.frozen_step());
            world.settings.budget.velocity_iterations = sweeps;
            world.frozen_step();
            error(&world) < tolerance
        })
    };
    let (cold, warm) = (sweeps_needed(0).unwrap(), sweeps_needed(6).unwrap());
    // 6 frames of 20 sweeps: the warm start saves 120 sweeps.
    assert!(cold > 120, "{cold}");
    assert!((cold - warm).abs_diff(120) <= 1, "{cold} cold, {warm} warm");
}
