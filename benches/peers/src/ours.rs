//! This crate's `soft_step`, a schedule that the other two engines have as well, and its other solvers at
//! their own settings.

use crate::engine::{Contender, Engine, Stage, State};
use simpulse::engine::broadphase::BroadPhaseKind;
use simpulse::engine::clock::Phase;
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers;
use simpulse::engine::world::{Settings, World};
use simpulse::lab::scenes::Scene;

/// A scene in a [`World`] of this crate.
pub struct Simpulse(World);

impl Simpulse {
    /// Runs `soft_step`. Errors: an invalid scene.
    pub fn soft_step(
        scene: &Scene,
        contender: &Contender,
        width: LaneWidth,
        broadphase: BroadPhaseKind,
    ) -> Result<Self, String> {
        let solver = solvers::find("soft_step").map_err(|e| e.to_string())?;
        let continuous = contender.continuous;
        let mut settings = Settings { broadphase, continuous, ..Settings::new(solver).exactly(width) };
        let set = solver.set(&mut settings.parameters, "contact_hertz", contender.hertz);
        set.map_err(|e| e.to_string())?;
        settings.budget.substeps = contender.substeps;
        Ok(Simpulse(scene.build(settings).map_err(|e| e.to_string())?))
    }

    /// Runs another solver at its own settings; it uses fewer lanes where a scene cannot fill them. Errors: as above, or
    /// an unknown solver.
    pub fn of(scene: &Scene, name: &str, contender: &Contender) -> Result<Self, String> {
        let solver = solvers::find(name).map_err(|e| e.to_string())?;
        let mut settings = Settings { continuous: contender.continuous, ..Settings::new(solver) };
        settings.budget.substeps = contender.substeps;
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
        self.0.counts.points
    }

    fn stages(&self) -> [Option<f64>; Stage::ALL.len()] {
        let sum = |phases: &[Phase]| {
            phases.iter().map(|&p| self.0.timings.phase_ns[p as usize] as f64).sum::<f64>() * 1e-6
        };
        Stage::ALL.map(|stage| {
            Some(sum(match stage {
                Stage::Pairs => &[Phase::Pairs],
                Stage::Collide => &[Phase::Collide],
                Stage::Color => &[Phase::Color],
                Stage::Prepare => &[Phase::Prepare],
                Stage::WarmStart => &[Phase::WarmStart],
                Stage::Solve => &[Phase::Solve, Phase::Position],
                Stage::Relax => &[Phase::Relax, Phase::Restitution],
                Stage::Integrate => &[Phase::Integrate],
                Stage::Stages => &[
                    Phase::WarmStart,
                    Phase::Solve,
                    Phase::Position,
                    Phase::Relax,
                    Phase::Restitution,
                    Phase::Integrate,
                ],
                Stage::Store => &[Phase::Store],
            }))
        })
    }

    fn set_timed(&mut self, on: bool) {
        self.0.settings.timed = on;
    }
}
