//! Passes over bodies.

use super::Passes;
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::motion::Motion;
use crate::engine::constraints::kernels::velocity::masses::{EffectiveMasses, ScaledMasses};
use crate::engine::constraints::records::graph::Graph;
use crate::engine::lanes::BodyRow;

impl Passes<'_> {
    /// How long a body moves with the velocity of [`Self::integrate_velocities`] (s): h, or 0 where it has
    /// moved before (explicit Euler).
    pub fn motion_after_velocities(&self) -> f32 {
        self.work.motion.after_velocities()
    }

    /// Body pass of the solver's own, on the rows and on what moves them, booked on `phase`.
    pub fn over_bodies(&mut self, phase: Phase, pass: impl FnOnce(&mut Vec<BodyRow>, &mut Motion)) {
        if self.input.phases.runs(phase) {
            pass(&mut self.work.rows, &mut self.work.motion);
            self.clock.lap(phase);
        }
    }

    /// Body pass: v ← damped v + h a.
    pub fn integrate_velocities(&mut self) {
        self.driven = false;
        self.over_bodies(Phase::Integrate, |rows, motion| motion.integrate_velocities(rows));
    }

    /// Body pass: as [`Self::integrate_velocities`] and a warm start in one, valid from
    /// the second substep on (see [`Motion::extrapolate_velocities`]).
    pub fn integrate_and_warm_start(&mut self) {
        if self.work.types.is_empty() {
            self.over_bodies(Phase::Integrate, |rows, motion| motion.extrapolate_velocities(rows));
        } else {
            // Arms of joints have turned.
            self.integrate_velocities();
            self.warm_start();
        }
    }

    /// Body pass: x ← x + h v.
    pub fn integrate_positions(&mut self) {
        self.over_bodies(Phase::Integrate, |rows, motion| motion.integrate_positions(rows));
    }

    /// Body pass: takes the turns of round bodies out of their rows, as moving them by velocities does.
    pub fn hide_turns(&mut self) {
        self.over_bodies(Phase::Integrate, |rows, motion| motion.hide_turns(rows));
    }

    /// Finds out which constraints each body has.
    pub fn build_graph(&mut self, graph: &mut Graph) {
        let bodies = self.work.rows.len() - 1;
        let dynamic = |body: u32| self.work.rows[body as usize].velocity[3] > 0.0;
        graph.build(bodies, self.contacts.iter().map(|c| [c.body_a, c.body_b]), dynamic);
        graph.count_others(self.work.types.iter().flat_map(|t| t.kind.ends()).copied());
    }

    /// As [`Self::build_graph`]; constraints of other types are edges as well, behind the contacts.
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

    /// Multiplies inverse masses and inertias by `factor(body)`, from what they are without
    /// any, and lets the effective masses of the constraints follow that the order has. Until
    /// [`Self::restore_masses`] a Jacobi sweep takes a factor n for n copies of a body.
    pub fn scale_masses(&mut self, phase: Phase, masses: &mut ScaledMasses, factor: impl Fn(usize) -> f32) {
        if !self.input.phases.runs(phase) {
            return;
        }
        masses.scale(&mut self.work.rows, factor);
        self.book_rows([32.0, 32.0]);
        self.over_batches(phase, &mut EffectiveMasses { factors: &[] });
        self.clock.lap(phase);
    }

    /// Ends what [`Self::scale_masses`] began.
    pub fn restore_masses(&mut self, phase: Phase, masses: &mut ScaledMasses) {
        self.scale_masses(phase, masses, |_| 1.0);
        if self.input.phases.runs(phase) {
            masses.forget();
        }
    }
}
