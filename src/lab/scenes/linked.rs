//! Known values of scenes with joints, and their building blocks.

use super::parts::*;
use crate::engine::solvers::{DEFAULT, find};
use crate::engine::world::Settings;

/// A small static pin at `at` (m), in the group of bodies that do not collide.
pub(super) fn pin(at: [f64; 2]) -> SceneBody {
    SceneBody { group: -1, ..SceneBody::fixed(at, SceneShape::disc(0.05)) }
}

/// A horizontal capsule about the origin, by half the length of its straight part and its radius (m).
pub(super) fn link(half: f64, radius: f64) -> SceneShape {
    SceneShape::new(Geometry::Capsule(Capsule { a: [-half, 0.0], b: [half, 0.0], radius }))
}

/// The same body, damped by a tenth per second.
pub(super) fn damped(body: SceneBody) -> SceneBody {
    SceneBody { linear_damping: 0.1, angular_damping: 0.1, ..body }
}

/// Root mean square of the gaps of all joints, over all steps from `seconds` on. Rigid joints have none.
pub(super) fn gaps(scene: &Scene, seconds: f64) -> Truth {
    let from = (seconds / scene.dt).round() as u64;
    let observer = Gaps { from, sum: 0.0, count: 0.0 };
    Truth::new("gap of joints, rms", "m", 0.0, observer)
}

struct Gaps {
    from: u64,
    sum: f64,
    count: f64,
}

impl Observer for Gaps {
    fn observe(&mut self, world: &World) {
        if world.step_index() < self.from {
            return;
        }
        for (handle, _) in world.joints() {
            self.sum += world.joint_state(handle).map_or(f64::INFINITY, |state| state.gap.powi(2));
            self.count += 1.0;
        }
    }

    fn error(&self) -> Option<f64> {
        let error = (self.sum / self.count).sqrt();
        (self.count > 0.0).then_some(if error.is_nan() { f64::INFINITY } else { error })
    }
}

/// Change of energy at the end of a motion without losses, as a fraction of the initial energy above the
/// `lowest` potential energy (J).
pub(super) fn energy(scene: &Scene, lowest: f64) -> Truth {
    let start = find(DEFAULT).ok().and_then(|solver| {
        let world = scene.build(Settings::new(solver)).ok()?;
        Some(energies(&world).iter().sum::<f64>())
    });
    let observer = Energy { start: start.unwrap_or(f64::NAN), lowest, last: None };
    Truth::new("change of energy, share", "1", 0.0, observer)
}

struct Energy {
    start: f64,
    lowest: f64,
    last: Option<f64>,
}

impl Observer for Energy {
    fn observe(&mut self, world: &World) {
        let now: f64 = energies(world).iter().sum();
        let change = ((now - self.start) / (self.start - self.lowest)).abs();
        self.last = Some(if change.is_nan() { f64::INFINITY } else { change });
    }

    fn error(&self) -> Option<f64> {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn world() -> (Scene, World) {
        let bob = SceneBody::dynamic([1.0, 0.0], SceneShape::disc(0.1));
        let joint = SceneJoint::revolute(0, 1, [0.0, 0.0], [-1.0, 0.0]);
        let scene = Scene::new("x", vec![pin([0.0, 0.0]), bob]).joined(vec![joint]);
        let world = scene.build(Settings::new(find("pgs").unwrap())).unwrap();
        (scene, world)
    }

    #[test]
    fn gaps_are_the_root_of_the_mean_square_from_a_time_on() {
        let (scene, mut world) = world();
        let mut observer = gaps(&scene, 2.0 * scene.dt).observer;
        for (step, x) in [(1, 9.0), (2, 1.5), (3, 0.5), (4, 1.0)] {
            world.set_step_index(step);
            world.bodies.position_x[1] = x;
            observer.observe(&world);
            assert_eq!(observer.error().is_some(), step >= 2);
        }
        assert!((observer.error().unwrap() - (0.5_f64 / 3.0).sqrt()).abs() < 1e-7);
        world.bodies.position_x[1] = f32::NAN;
        observer.observe(&world);
        assert_eq!(observer.error(), Some(f64::INFINITY));
    }

    #[test]
    fn the_change_of_energy_is_a_share_of_what_can_move() {
        let (scene, mut world) = world();
        let weight = 10.0 / f64::from(world.bodies.inv_mass[1]);
        let mut observer = energy(&scene, -weight).observer;
        observer.observe(&world);
        assert_eq!(observer.error(), Some(0.0));
        world.bodies.position_y[1] = -0.25;
        observer.observe(&world);
        assert!((observer.error().unwrap() - 0.25).abs() < 1e-7);
    }
}
