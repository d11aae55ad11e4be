//! Law: rival solvers are as good as their sources.

use crate::common::fastest;
use simpulse::engine::world::World;

/// A scene under a solver at its standard budget, with `substeps` substeps if given.
fn run(scene: &str, solver: &str, substeps: Option<u32>, steps: u32) -> World {
    let mut settings = crate::common::named(solver);
    settings.budget.substeps = substeps.unwrap_or(settings.budget.substeps);
    crate::common::run(&crate::common::scene(scene), settings, steps)
}

/// A box slides down an incline of 0.25 rad with µ = 0.24: 297 mm in two seconds. Solver2D slides 13.8 % too
/// far with 4 substeps and 2.8 % with 20, because it solves all normals of a contact before its frictions.
/// Solving point by point gives 91 % and 89 %.
#[test]
fn xpbd_slides_as_its_source_does_and_converges_with_substeps() {
    let excess = |substeps: u32| {
        let world = run("incline_slip", "xpbd", Some(substeps), 120);
        let (sin, cos) = 0.25f64.sin_cos();
        let [x, y] = world.bodies.center(1);
        let time = 2.0;
        // The discrete distance of semi-implicit Euler.
        let truth = 0.5 * 0.148650 * time * time * (1.0 + 1.0 / f64::from(120 * substeps));
        100.0 * ((x * cos - y * sin) / truth - 1.0)
    };
    let [four, twenty, many] = [4, 20, 64].map(excess);
    println!("{four:.1} {twenty:.1} {many:.2} %");
    assert!((four - 13.8).abs() < 0.5, "{four} %");
    assert!((twenty - 2.8).abs() < 0.2, "{twenty} %");
    assert!(many < 1.0, "{many} %");
}

/// The demonstration's start positions, margin and whole multipliers bring piles to rest. Sticking holds them
/// in place.
///
/// Velocities are differences of positions over a step of 1/60 s. Coordinates of the pyramid are below 4 m,
/// where adjacent single-precision numbers are 2⁻²² m apart. One such step along both axes is
/// √2 · 2⁻²² · 60 = 2.0e-5 m/s.
#[test]
fn avbd_comes_to_rest() {
    let rounding = 2.0f32.sqrt() * 2.0f32.powi(-22) * 60.0;
    for (scene, bound) in [("stack:10", 1e-6), ("pyramid:4", rounding), ("disc_column:10", 1e-5)] {
        let world = run(scene, "avbd", None, 600);
        assert!(fastest(&world) < bound, "{scene}: {} m/s", fastest(&world));
    }
}

/// Rigid sweeps spread over substeps hold a stack higher than the same number of sweeps in one step.
#[test]
fn substeps_hold_higher_than_sweeps() {
    let top = |solver: &str, sweeps: u32| {
        let mut settings = crate::common::named(solver);
        settings.budget.velocity_iterations = sweeps;
        let mut world = crate::common::scene("stack:20").build(settings).unwrap();
        (0..300).take_while(|_| world.step().is_ok()).count();
        world.bodies.position_y[20]
    };
    let [substeps, sweeps] =
        [("pgs_substeps", 2), ("pgs", 16)].map(|(solver, n)| (top(solver, n) - 19.5).abs());
    assert!(substeps < 0.01 && sweeps > 2.0 * substeps, "{substeps} {sweeps}");
}
