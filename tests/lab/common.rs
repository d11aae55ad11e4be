//! Helpers shared by several test files.
#![allow(dead_code)]

use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::Variant;
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes::{self, Scene};

/// Standard settings of a solver.
pub fn settings(variant: &'static Variant) -> Settings {
    Settings::new(variant)
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
    let mut bodies = String::from(
        r#"{"type":"kinematic","position":[0,-1],"velocity":[0.3,0],"shapes":[{"box":{"half":[60,1]}}]},
           {"type":"dynamic","position":[0,0.5],"shapes":[{"box":{"half":[50,0.5]}}]}"#,
    );
    for i in 0..90 {
        let shape = if i % 3 == 0 { r#"{"circle":{"radius":0.4}}"# } else { r#"{"box":{"half":[0.4,0.4]}}"# };
        let x = i as f64 - 44.5;
        bodies += &format!(r#",{{"type":"dynamic","position":[{x},1.41],"shapes":[{shape}]}}"#);
    }
    let text = format!(r#"{{"name":"crowded_plate","bodies":[{bodies}]}}"#);
    Scene::from_json(&text, "crowded_plate.json".as_ref()).unwrap()
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
