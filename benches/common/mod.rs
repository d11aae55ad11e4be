//! Scenes shared by the benches.
#![allow(dead_code)]

use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers;
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes;

/// Scenes whose contacts fit in the second-level cache and in the third-level cache.
pub const KERNEL_SCENES: [&str; 2] = ["pyramid:30", "large_pyramid"];

/// A small scene, a medium one, and one without boxes.
pub const STEP_SCENES: [&str; 3] = ["stack:20", "pyramid:30", "circle_pile:500"];

/// A scene after 30 steps of `solver` at `width`, with the clock on.
pub fn settled(scene: &str, solver: &str, width: LaneWidth) -> World {
    stable(scene, solver, width).expect("a stable start")
}

/// As [`settled`]; `None` if the solver diverges, as Jacobi iterations on pyramids do.
pub fn stable(scene: &str, solver: &str, width: LaneWidth) -> Option<World> {
    let mut settings = Settings::new(solvers::find(solver).expect("a solver of the table")).exactly(width);
    settings.timed = true;
    let scene = scenes::load(scene).expect("a scene of the catalog").scene;
    let mut world = scene.build(settings).expect("a valid scene");
    for _ in 0..30 {
        world.step().ok()?;
    }
    Some(world)
}
