//! This crate's `soft_step`, a schedule that the other two engines have as well, and its other solvers at
//! their own settings.

use crate::engine::{Contender, Engine, Maker, State};
use simpulse::engine::solvers;
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes::Scene;

/// A scene in a [`World`] of this crate.
pub struct Simpulse(World);

impl Simpulse {
    /// Errors: an invalid scene or an unknown solver.
    pub fn new(scene: &Scene, contender: &Contender) -> Result<Self, String> {
        let name = if let Maker::Solver(name) = contender.maker { name } else { "soft_step" };
        let solver = solvers::find(name).map_err(|e| e.to_string())?;
        let Contender { continuous, threads, .. } = *contender;
        let mut settings = Settings { continuous, threads, ..Settings::new(solver) };
        settings.budget.substeps = contender.substeps;
        if let Maker::Simpulse(width, broadphase) = contender.maker {
            settings = Settings { broadphase, ..settings.exactly(width) };
            let set = solver.set(&mut settings.parameters, "contact_hertz", contender.hertz);
            set.map_err(|e| e.to_string())?;
        }
        Ok(Simpulse(scene.build(settings).map_err(|e| e.to_string())?))
    }
}

impl Engine for Simpulse {
    fn step(&mut self) -> Result<(), String> {
        self.0.step().map_err(|d| d.to_string())
    }

    fn state(&self, i: usize) -> State {
        let b = &self.0.bodies;
        State {
            position: [b.position_x[i], b.position_y[i]],
            rotation: [b.rotation_cos[i], b.rotation_sin[i]],
            velocity: [b.velocity_x[i], b.velocity_y[i]],
            angular_velocity: b.angular_velocity[i],
        }
    }

    fn bodies(&self) -> usize {
        self.0.bodies.len()
    }

    fn points(&self) -> usize {
        self.0.counts().points
    }
}
