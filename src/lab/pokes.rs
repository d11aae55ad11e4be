//! Pokes: small random pushes on random bodies at random times, as a player would give them, from a seed.
//!
//! A push gives a body up to a tenth of the speed that it gains in a fall of its own reach, so that a crate of a meter
//! slides by a centimeter at most (v²/2µg) and a pile that stands under exact forces keeps standing. The same seed
//! gives the same pushes to the same scene, whatever its solver.

use crate::engine::world::World;
use crate::lab::error::Error;
use crate::lab::metrics::state::reaches;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::TAU;

/// Least and greatest speed that a push gives, as a fraction of √(2 g × reach) (1).
const SPEED: [f64; 2] = [0.03, 0.1];
/// Shortest and longest time between two pushes (s).
const PAUSE: [f64; 2] = [0.1, 0.5];
/// Greatest distance of a push from the center of mass, as a fraction of the body's reach (1).
const OFF_CENTER: f64 = 0.5;
/// Gravity for what a player does in scenes without any (m/s²).
const STANDARD_GRAVITY: f64 = 10.0;

/// Gravity that determines how strong a player is (m/s²): that of the world, or the standard one where there is none.
pub(crate) fn gravity(world: &World) -> f64 {
    let [x, y] = world.settings.gravity.map(f64::from);
    Some(x.hypot(y)).filter(|gravity| *gravity > 0.0).unwrap_or(STANDARD_GRAVITY)
}

/// The pushes of a run.
#[derive(Clone, Debug)]
pub struct Pokes {
    random: Pcg64Mcg,
    /// Dynamic bodies with their reach (m).
    bodies: Vec<(usize, f64)>,
    gravity: f64,
    dt: f64,
    /// Step before which the next push is given.
    next: u64,
    /// The first step without pushes.
    end: u64,
    given: u32,
}

impl Pokes {
    /// Pushes on the dynamic bodies that `world` has now, before steps up to `end`.
    pub fn new(seed: u64, world: &World, end: u64) -> Self {
        let reaches = reaches(world).into_iter().enumerate();
        let mut pokes = Pokes {
            random: Pcg64Mcg::seed_from_u64(seed),
            bodies: reaches.filter(|&(i, _)| world.bodies.is_dynamic(i)).collect(),
            gravity: gravity(world),
            dt: f64::from(world.settings.dt),
            next: world.step_index(),
            end,
            given: 0,
        };
        pokes.pause();
        pokes
    }

    /// Number of pushes so far.
    pub fn given(&self) -> u32 {
        self.given
    }

    fn pause(&mut self) {
        let seconds = self.random.random_range(PAUSE[0]..PAUSE[1]);
        self.next += (seconds / self.dt).round().max(1.0) as u64;
    }

    /// Gives the push that is due before the next step of `world`, if there is one. A body that was removed is spared.
    pub fn act(&mut self, world: &mut World) -> Result<(), Error> {
        if world.step_index() < self.next || world.step_index() >= self.end || self.bodies.is_empty() {
            return Ok(());
        }
        let (body, reach) = self.bodies[self.random.random_range(0..self.bodies.len())];
        let full = (2.0 * self.gravity * reach).sqrt();
        let speed = full * self.random.random_range(SPEED[0]..SPEED[1]);
        let [push, offset] = [0; 2].map(|_| self.random.random_range(0.0..TAU).sin_cos());
        let arm = reach * self.random.random_range(0.0..OFF_CENTER);
        self.given += 1;
        self.pause();
        let Some(handle) = world.handle(body).filter(|_| world.bodies.is_dynamic(body)) else {
            return Ok(());
        };
        let impulse = speed / f64::from(world.bodies.inv_mass[body]);
        let [x, y] = world.bodies.center(body);
        let point = [x + arm * offset.1, y + arm * offset.0];
        world.apply_impulse(handle, [push.1, push.0].map(|u| impulse * u), point)?;
        Ok(())
    }
}

/// Distance of the dynamic bodies of `poked` from where they are in `still`, of the same scene at the same step: root
/// mean square, and greatest (m).
pub fn displacement(poked: &World, still: &World) -> [f64; 2] {
    let dynamic = (0..poked.bodies.len().min(still.bodies.len())).filter(|&i| poked.bodies.is_dynamic(i));
    let mut squares = Vec::new();
    for i in dynamic {
        let ([x, y], [u, v]) = (poked.bodies.center(i), still.bodies.center(i));
        squares.push((x - u).powi(2) + (y - v).powi(2));
    }
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    [mean, squares.iter().copied().fold(0.0, f64::max)].map(f64::sqrt)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;
    use crate::engine::world::Settings;
    use crate::lab::scenes::load;

    /// The world after these steps of a poked stack, the number of pushes, and the fastest change of speed by one.
    fn poked(solver: &str, seed: u64, end: u64, steps: u64) -> (World, u32, f32) {
        let scene = load("stack:10").unwrap().scene;
        let mut world = scene.build(Settings::new(find(solver).unwrap())).unwrap();
        let mut pokes = Pokes::new(seed, &world, end);
        let mut fastest = 0.0_f32;
        for _ in 0..steps {
            let before: Vec<_> = (0..world.bodies.len()).map(|i| world.bodies.velocity(i)).collect();
            pokes.act(&mut world).unwrap();
            let changes = before.iter().enumerate().map(|(i, v)| (world.bodies.velocity(i) - *v).length());
            fastest = fastest.max(changes.fold(0.0, f32::max));
            world.step().unwrap();
        }
        (world, pokes.given(), fastest)
    }

    #[test]
    fn a_seed_gives_the_same_pushes_to_every_solver() {
        let (one, count, fastest) = poked("shim", 7, u64::MAX, 300);
        let (other, again, same) = poked("soft_step", 7, u64::MAX, 300);
        assert_eq!((count, fastest), (again, same));
        assert_ne!(one.state_hash(), other.state_hash());
        assert_eq!(one.state_hash(), poked("shim", 7, u64::MAX, 300).0.state_hash());
        assert_ne!(one.state_hash(), poked("shim", 8, u64::MAX, 300).0.state_hash());
        // In 5 s, every 0.1 to 0.5 s; the reach of a crate is √½ m, of which a fall gives √(20 × √½) = 3.76 m/s.
        assert!((10..=50).contains(&count) && (0.112..0.377).contains(&fastest), "{count} {fastest}");
    }

    #[test]
    fn pushes_end_and_a_stack_survives_them() {
        let (world, count, _) = poked("shim", 3, 120, 600);
        assert_eq!(count, poked("shim", 3, 120, 120).1);
        let still = poked("shim", 3, 0, 600).0;
        let [rms, most] = displacement(&world, &still);
        assert!(rms > 1e-4 && most < 0.1 && rms <= most, "{rms} {most}");
        assert_eq!(displacement(&world, &world), [0.0; 2]);
        assert!((0..11).all(|i| world.bodies.velocity(i).length() < 1e-3));
    }
}
