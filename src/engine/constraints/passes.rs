//! What a solver sees: passes over bodies and over constraints, to be called in its own order.

use super::batches::Batches;
use super::block::BlockSweep;
use super::bounces::Bounces;
use super::features::Features;
use super::graph::Graph;
use super::jacobi::{self, JacobiRule};
use super::kept::Kept;
use super::motion::Motion;
use super::observe::ObservedRule;
use super::pass::{AnyPass, PassInput, PassWidth};
use super::position::PositionSweep;
use super::prepare::{Prepare, Store};
use super::restitution;
use super::rules::{Rigid, Rule};
use super::sweep::{Sweep, VelocitySweep, WarmStart};
use super::system::System;
use crate::engine::clock::{Clock, Phase, PhaseFilter};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneWidth};
use crate::engine::params::{Budget, Parameters};

/// Everything a step works on, kept from step to step so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    /// One row per body, and an inert one at the end.
    pub rows: Vec<BodyRow>,
    /// Sums of velocity increments, a row each; empty unless the solver is a Jacobi iteration.
    pub sums: Vec<BodyRow>,
    /// Forces, damping, integration.
    pub motion: Motion,
    /// Coloured batches at the chosen width.
    pub lanes: Batches,
    /// What is solved one after the other: everything in natural order, else the overflow.
    pub serial: Batches,
    /// Bounces of `lanes`.
    pub lane_bounces: Bounces,
    /// Bounces of `serial`.
    pub serial_bounces: Bounces,
    /// Numbers that a solver keeps per contact point and per body.
    pub kept: Kept,
    /// Which constraints each body has.
    pub graph: Graph,
    /// Keep the rule of the last velocity sweep in `last_rule`.
    pub observe: bool,
    /// See `observe`.
    pub last_rule: Option<ObservedRule>,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCount {
    /// Passes over all constraints that solve something; warm starts are not counted.
    pub sweeps: usize,
    /// Rows solved in all sweeps: a normal row per point, and a tangential one where the
    /// sweep has friction.
    pub row_updates: usize,
}

/// What a step is given besides the workspace.
#[derive(Clone, Copy, Debug)]
pub struct StepInput {
    /// What the scene has.
    pub features: Features,
    /// Work per step.
    pub budget: Budget,
    /// Substep (s).
    pub h: f32,
    /// The solver's own parameters.
    pub parameters: Parameters,
    /// Which phases run.
    pub phases: PhaseFilter,
    /// Sum impulses into [`Contact::step_impulse`].
    pub record_impulses: bool,
    /// Points of all contacts, to count rows by.
    pub points: usize,
}

/// One step's problem, prepared.
///
/// Each method is one pass over all bodies or all constraints. Coloured batches run
/// first, colour by colour; then the serial ones. Nothing here is generic: passes are
/// compiled per width and features, schedules once.
pub struct Passes<'a> {
    work: &'a mut Workspace,
    contacts: &'a mut [Contact],
    clock: &'a mut Clock,
    input: &'a StepInput,
    width: LaneWidth,
    count: WorkCount,
}

impl<'a> Passes<'a> {
    /// Prepares the constraints of a step.
    ///
    /// # Panics
    /// If a batch names a row or a contact that does not exist.
    pub fn new(
        work: &'a mut Workspace,
        contacts: &'a mut [Contact],
        clock: &'a mut Clock,
        input: &'a StepInput,
        width: LaneWidth,
    ) -> Self {
        let mut passes = Passes { work, contacts, clock, input, width, count: WorkCount::default() };
        // A phase that is repeated finds the records, and the check, of the step before it.
        if passes.input.phases.runs(Phase::Prepare) {
            for (batches, width) in [(&passes.work.lanes, width.lanes()), (&passes.work.serial, 1)] {
                batches.assert_fits(width, passes.work.rows.len(), passes.contacts.len());
            }
            passes.over_batches(&Prepare);
            if input.features.restitution {
                passes.over_batches(&restitution::Begin { h: input.h });
            }
            passes.clock.lap(Phase::Prepare);
        }
        passes
    }

    /// Work allowed.
    pub fn budget(&self) -> Budget {
        self.input.budget
    }

    /// Substep (s).
    pub fn h(&self) -> f32 {
        self.input.h
    }

    /// The solver's own parameter of this index in [`crate::engine::solvers::Variant::parameters`].
    pub fn parameter(&self, index: usize) -> f32 {
        self.input.parameters[index]
    }

    /// Body pass: v ← damped v + h a.
    pub fn integrate_velocities(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.integrate_velocities(&mut work.rows));
    }

    /// Body pass: as [`Self::integrate_velocities`] and a warm start in one, valid from
    /// the second substep on (see [`Motion::extrapolate_velocities`]).
    pub fn integrate_and_warm_start(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.extrapolate_velocities(&mut work.rows));
    }

    /// Body pass: x ← x + h v.
    pub fn integrate_positions(&mut self) {
        self.over_bodies(Phase::Integrate, |work| work.motion.integrate_positions(&mut work.rows));
    }

    /// Sets all accumulated impulses to zero, for solvers without warm starting.
    pub fn forget_impulses(&mut self) {
        if !self.input.phases.runs(Phase::Prepare) {
            return;
        }
        for batches in [&mut self.work.lanes, &mut self.work.serial] {
            let width = batches.width();
            batches.for_each_lane(&self.input.features, |_, layout, record, lane| {
                for p in 0..layout.points {
                    record[layout.at(p, layout.normal_impulse) * width + lane] = 0.0;
                    if layout.has_friction {
                        record[layout.at(p, layout.tangent_impulse) * width + lane] = 0.0;
                    }
                }
            });
        }
        self.clock.lap(Phase::Prepare);
    }

    /// Constraint pass: applies the accumulated impulses.
    pub fn warm_start(&mut self) {
        self.run(Phase::WarmStart, &WarmStart);
    }

    /// Constraint pass: one velocity sweep under `rule`, Gauss–Seidel, booked on `phase`.
    pub fn sweep(&mut self, phase: Phase, rule: &Rule) {
        self.velocity_sweep(phase, rule.sweep());
    }

    /// As [`Self::sweep`], under a rule of the solver's own.
    pub fn velocity_sweep(&mut self, phase: Phase, sweep: &dyn VelocitySweep) {
        if self.run(phase, sweep) {
            self.solved(sweep);
        }
    }

    /// Constraint pass: as [`Self::sweep`], but the two normal rows of a contact are solved
    /// together; see [`super::block`].
    pub fn block_sweep(&mut self, phase: Phase, rule: Rigid) {
        if self.run(phase, &BlockSweep(rule)) {
            self.solved(&Sweep(rule));
        }
    }

    /// Constraint pass: every contact reads the velocities from before the pass, and what all of
    /// them add to a body, times `relaxation`, is summed up; see [`super::jacobi`].
    pub fn jacobi_sweep(&mut self, phase: Phase, rule: JacobiRule, relaxation: f32) {
        if !self.input.phases.runs(phase) {
            return;
        }
        jacobi::begin(&self.work.rows, &mut self.work.sums);
        rule.with_pass(relaxation, |pass| self.over_batches(pass));
        jacobi::finish(&mut self.work.rows, &self.work.sums);
        self.clock.lap(phase);
        self.solved(rule.rule().sweep());
    }

    /// Constraint pass: one position sweep, nonlinear Gauss–Seidel.
    pub fn position_sweep(&mut self, sweep: PositionSweep) {
        if self.run(Phase::Position, &sweep) {
            self.count_sweep(1);
        }
    }

    /// Constraint pass of the solver's own, booked on `phase`; returns whether it ran, which it
    /// does not while another phase is repeated alone. What solves rows is counted by
    /// [`Self::count_sweep`].
    pub fn run(&mut self, phase: Phase, pass: &dyn AnyPass) -> bool {
        if !self.input.phases.runs(phase) {
            return false;
        }
        self.over_batches(pass);
        self.clock.lap(phase);
        true
    }

    /// Counts a sweep that solved `rows_per_point` rows at each contact point.
    pub fn count_sweep(&mut self, rows_per_point: usize) {
        self.count.sweeps += 1;
        self.count.row_updates += rows_per_point * self.input.points;
    }

    /// All impulses and velocities as vectors, in an order that no width changes.
    pub fn system(&mut self) -> System<'_> {
        let Workspace { rows, lanes, serial, .. } = &mut *self.work;
        System::new(rows, [lanes, serial], self.contacts, &self.input.features)
    }

    /// Which contacts each body has.
    pub fn graph(&mut self) -> &Graph {
        let bodies = self.work.rows.len() - 1;
        let dynamic = |body: u32| self.work.rows[body as usize].velocity[3] > 0.0;
        self.work.graph.build(bodies, self.contacts.iter().map(|c| [c.body_a, c.body_b]), dynamic);
        &self.work.graph
    }

    /// Numbers kept per contact point and per body, see
    /// [`crate::engine::solvers::Variant::kept`].
    pub fn kept(&mut self) -> &mut Kept {
        &mut self.work.kept
    }

    /// Ends substep `substep`: bounces if it is the last, and books impulses where asked.
    pub fn end_substep(&mut self, substep: u32) {
        if self.input.features.restitution && self.input.phases.runs(Phase::Restitution) {
            self.over_batches(&restitution::Track);
            if substep + 1 == self.input.budget.substeps {
                self.over_batches(&restitution::Apply { h: self.input.h });
                self.count_sweep(1);
            }
            self.clock.lap(Phase::Restitution);
        }
        if self.input.record_impulses && self.input.phases.runs(Phase::Store) {
            let Workspace { lanes, serial, .. } = &mut *self.work;
            for batches in [lanes, serial] {
                let width = batches.width();
                batches.for_each_lane(&self.input.features, |contact, layout, record, lane| {
                    let contact = &mut self.contacts[contact as usize];
                    for p in 0..layout.points {
                        let at = |quantity: usize| record[layout.at(p, quantity) * width + lane];
                        contact.step_impulse[p][0] += at(layout.normal_impulse);
                        if layout.has_friction {
                            contact.step_impulse[p][1] += at(layout.tangent_impulse);
                        }
                    }
                });
            }
            self.clock.lap(Phase::Store);
        }
    }

    /// Writes accumulated impulses back to the contacts; returns what was done.
    pub fn finish(mut self) -> WorkCount {
        if self.input.phases.runs(Phase::Store) {
            if self.input.features.restitution {
                self.over_batches(&restitution::Forget);
            }
            self.over_batches(&Store);
            self.clock.lap(Phase::Store);
        }
        self.count
    }

    /// Counts a velocity sweep, and keeps its rule where that is asked for.
    fn solved(&mut self, sweep: &dyn VelocitySweep) {
        let friction = self.input.features.friction && sweep.has_friction();
        self.count_sweep(if friction { 2 } else { 1 });
        if self.work.observe {
            self.work.last_rule = Some(ObservedRule::of(sweep, &self.work.rows));
        }
    }

    fn over_bodies(&mut self, phase: Phase, pass: impl FnOnce(&mut Workspace)) {
        if self.input.phases.runs(phase) {
            pass(self.work);
            self.clock.lap(phase);
        }
    }

    /// Coloured batches at the width of the step, then serial ones at one lane.
    fn over_batches(&mut self, pass: &dyn AnyPass) {
        let width = PassWidth { width: self.width, counted: self.input.phases.counted };
        let serial = PassWidth { width: LaneWidth::W1, counted: false };
        let Workspace { rows, sums, motion, lanes, serial: one, lane_bounces, serial_bounces, .. } =
            &mut *self.work;
        for (width, batches, bounces) in [(width, lanes, lane_bounces), (serial, one, serial_bounces)] {
            let on = PassInput {
                rows,
                sums,
                batches,
                bounces,
                contacts: self.contacts,
                increments: motion.velocity_increments(),
            };
            pass.run_at(width, &self.input.features, on);
        }
    }
}
