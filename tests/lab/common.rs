//! Helpers shared by several test files.
#![allow(dead_code)]

use simpulse::engine::bodies::BodyKind;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{Variant, find};
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes::{self, Scene, SceneBody, SceneShape};

/// Standard settings of a solver.
pub fn settings(variant: &'static Variant) -> Settings {
    Settings::new(variant)
}

/// Standard settings of the solver with this name.
pub fn named(solver: &str) -> Settings {
    settings(find(solver).unwrap())
}

/// These bodies on the ground.
pub fn on_ground(bodies: Vec<SceneBody>) -> Scene {
    let ground = SceneBody::fixed([0.0, -1.0], SceneShape::rectangle(60.0, 1.0));
    Scene::new("on ground", std::iter::once(ground).chain(bodies).collect())
}

/// Standard settings of a solver at one width.
pub fn with_width(variant: &'static Variant, width: LaneWidth) -> Settings {
    Settings::new(variant).exactly(width)
}

/// A scene of the catalog, or `crowded_plate`: one dynamic plate under more bodies than there are colors, so
/// that contacts overflow. The plate lies on a kinematic plate that moves sideways.
pub fn scene(name: &str) -> Scene {
    if name != "crowded_plate" {
        return scenes::load(name).unwrap().scene;
    }
    let boxed = |x, y| SceneShape::rectangle(x, y);
    let belt = SceneBody::new(BodyKind::Kinematic, [0.0, -1.0], boxed(60.0, 1.0)).moving([0.3, 0.0], 0.0);
    let mut bodies = vec![belt, SceneBody::dynamic([0.0, 0.5], boxed(50.0, 0.5))];
    bodies.extend((0..90).map(|i| {
        let shape = if i % 3 == 0 { SceneShape::disc(0.4) } else { boxed(0.4, 0.4) };
        SceneBody::dynamic([f64::from(i) - 44.5, 1.41], shape)
    }));
    Scene::new(name, bodies)
}

/// Steps a scene; panics if it diverges.
pub fn run(scene: &Scene, settings: Settings, steps: u32) -> World {
    let mut world = scene.build(settings).unwrap();
    for _ in 0..steps {
        world.step().unwrap();
    }
    world
}

/// Linear momentum (N·s), angular momentum (N·m·s) and kinetic energy (J) of dynamic bodies.
pub fn totals(world: &World) -> [f64; 4] {
    let b = &world.bodies;
    (0..b.len()).filter(|&i| b.inv_mass[i] > 0.0).fold([0.0; 4], |[px, py, spin, energy], i| {
        let (m, inertia) = (1.0 / f64::from(b.inv_mass[i]), 1.0 / f64::from(b.inv_inertia[i]));
        let [x, y] = b.center(i);
        let [vx, vy, w] = [b.velocity_x[i], b.velocity_y[i], b.angular_velocity[i]].map(f64::from);
        [
            px + m * vx,
            py + m * vy,
            spin + m * (x * vy - y * vx) + inertia * w,
            energy + 0.5 * (m * (vx * vx + vy * vy) + inertia * w * w),
        ]
    })
}

/// Largest speed of a body (m/s).
pub fn fastest(world: &World) -> f32 {
    (0..world.bodies.len()).map(|i| world.bodies.velocity(i).length()).fold(0.0, f32::max)
}
