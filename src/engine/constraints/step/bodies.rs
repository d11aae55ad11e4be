//! Passes over bodies.

use super::Passes;
use super::jams::speed;
use crate::clock::Phase;
use crate::constraints::kernels::motion::Motion;
use crate::constraints::kernels::velocity::masses::{EffectiveMasses, ScaledMasses};
use crate::constraints::records::graph::Graph;
use crate::lanes::BodyRow;
use crate::workers::Workers;

impl Passes<'_> {
    /// Time for which bodies move with the velocities of [`Self::integrate_velocities`] (s): h, or 0 if they
    /// have moved before (explicit Euler).
    pub fn motion_after_velocities(&self) -> f32 {
        self.work.motion.after_velocities()
    }

    /// Runs a body pass of the solver's own, on the rows and on their motion, booked on `phase`.
    /// Threads may share it.
    pub fn over_bodies(&mut self, phase: Phase, pass: impl FnOnce(&mut Vec<BodyRow>, &mut Motion, &Workers)) {
        pass(&mut self.work.rows, &mut self.work.motion, &self.work.workers);
        self.clock.lap(phase);
    }

    /// Body pass: v ← damped v + h a.
    pub fn integrate_velocities(&mut self) {
        self.driven = false;
        self.over_bodies(Phase::Integrate, |rows, motion, workers| {
            motion.integrate_velocities(rows, workers)
        });
    }

    /// Body pass: [`Self::integrate_velocities`] and a warm start in one. Valid from the second substep on
    /// (see [`Motion::extrapolate_velocities`]).
    pub fn integrate_and_warm_start(&mut self) {
        if self.work.types.is_empty() {
            self.over_bodies(Phase::Integrate, |rows, motion, workers| {
                motion.extrapolate_velocities(rows, workers)
            });
        } else {
            // Arms of joints have turned, so the last change of velocities is not a warm start.
            self.integrate_velocities();
            self.warm_start();
        }
    }

    /// Body pass: x ← x + h v.
    pub fn integrate_positions(&mut self) {
        self.over_bodies(Phase::Integrate, |rows, motion, workers| motion.integrate_positions(rows, workers));
    }

    /// Body pass: scales the velocities of bodies with a limit down to it, see [`Workspace::speed_limits`](super::Workspace).
    pub fn limit_speeds(&mut self) {
        for &(body, most) in &self.work.speed_limits {
            let row = &mut self.work.rows[body as usize];
            let [x, y, spin, inv_mass] = row.velocity;
            let speed = speed([x, y], spin, inv_mass / row.delta[3]);
            if speed > most {
                let part = most / speed;
                row.velocity = [part * x, part * y, part * spin, inv_mass];
            }
        }
    }

    /// Body pass: takes the turns of round bodies out of their rows, as the integration of positions does.
    pub fn exclude_rotation_from_error(&mut self) {
        self.over_bodies(Phase::Integrate, |rows, motion, _| motion.exclude_rotation_from_error(rows));
    }

    /// Builds the contact graph, and counts the other constraints of each body.
    pub fn build_graph(&mut self, graph: &mut Graph) {
        let bodies = self.work.rows.len() - 1;
        let dynamic = |body: u32| self.work.rows[body as usize].velocity[3] > 0.0;
        graph.build(bodies, self.contacts.iter().map(|c| [c.body_a, c.body_b]), dynamic);
        graph.count_others(self.work.types.iter().flat_map(|t| t.kind.ends()).copied());
    }

    /// As [`Self::build_graph`], but constraints of other types are edges as well, after the contacts.
    pub fn build_whole_graph(&mut self, graph: &mut Graph) {
        let bodies = self.work.rows.len() - 1;
        let dynamic = |body: u32| self.work.rows[body as usize].velocity[3] > 0.0;
        let contacts = self.contacts.iter().map(|c| [c.body_a, c.body_b]);
        graph.build(
            bodies,
            contacts.chain(self.work.types.iter().flat_map(|t| t.kind.ends()).copied()),
            dynamic,
        );
    }

    /// Scales inverse masses and inertias by `factor(body)`, relative to their unscaled values, and
    /// recomputes the effective masses of the constraints in the present order. Until
    /// [`Self::restore_masses`], a Jacobi sweep treats a factor n as n copies of a body.
    pub fn scale_masses(&mut self, phase: Phase, masses: &mut ScaledMasses, factor: impl Fn(usize) -> f32) {
        masses.scale(&mut self.work.rows, factor);
        self.over_batches(phase, &mut EffectiveMasses { factors: &[] });
        self.clock.lap(phase);
    }

    /// Ends the scaling by [`Self::scale_masses`].
    pub fn restore_masses(&mut self, phase: Phase, masses: &mut ScaledMasses) {
        self.scale_masses(phase, masses, |_| 1.0);
        masses.forget();
    }
}
