//! The velocity problem of one step, as solvers see it: passes over bodies and constraints.

use super::batches::Batches;
use super::features::{Features, KernelFeatures};
use super::motion::Motion;
use super::observe::ObservedRule;
use super::prepare;
use super::restitution::{self, Bounces};
use super::sweep::{self, NormalRule};
use crate::engine::clock::{Clock, Phase};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, Lanes};
use crate::engine::params::Budget;
use std::marker::PhantomData;

/// Everything a step works on, kept from step to step so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    /// One row per body, and an inert one at the end.
    pub rows: Vec<BodyRow>,
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
    /// Keep the rule of the last velocity sweep in `last_rule`.
    pub observe: bool,
    /// See `observe`.
    pub last_rule: Option<ObservedRule>,
}

/// One step's problem at one width and with one set of needs.
///
/// Each method is one pass over all bodies or all constraints. Coloured batches run
/// first, colour by colour; then the serial ones.
pub struct Problem<'a, L, N> {
    work: &'a mut Workspace,
    contacts: &'a mut [Contact],
    clock: &'a mut Clock,
    features: Features,
    budget: Budget,
    h: f32,
    contact_hertz: f32,
    record_impulses: bool,
    points: usize,
    count: WorkCount,
    kernel: PhantomData<(L, N)>,
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
    /// What the scene needs.
    pub features: Features,
    /// Work per step.
    pub budget: Budget,
    /// Substep (s).
    pub h: f32,
    /// Stiffness of soft contacts (Hz).
    pub contact_hertz: f32,
    /// Sum impulses into [`Contact::step_impulse`].
    pub record_impulses: bool,
    /// Points of all contacts, to count rows by.
    pub points: usize,
}

impl<'a, L: Lanes, N: KernelFeatures> Problem<'a, L, N> {
    /// Prepares the constraints of a step.
    ///
    /// # Panics
    /// If a batch names a row or a contact that does not exist.
    pub fn new(
        work: &'a mut Workspace,
        contacts: &'a mut [Contact],
        clock: &'a mut Clock,
        input: &StepInput,
    ) -> Self {
        // A phase that is repeated finds the records, and the check, of the step before it.
        if !clock.skips(Phase::Prepare) {
            for (batches, width) in [(&work.lanes, L::WIDTH), (&work.serial, 1)] {
                batches.assert_fits(width, work.rows.len(), contacts.len());
            }
            let Workspace { rows, motion, lanes, serial, lane_bounces, serial_bounces, .. } = &mut *work;
            prepare::prepare::<L, N>(rows, lanes, contacts);
            prepare::prepare::<f32, N>(rows, serial, contacts);
            if input.features.restitution {
                let (velocity_increments, h) = (motion.velocity_increments(), input.h);
                restitution::prepare::<L, N>(rows, lanes, lane_bounces, contacts, velocity_increments, h);
                restitution::prepare::<f32, N>(
                    rows,
                    serial,
                    serial_bounces,
                    contacts,
                    velocity_increments,
                    h,
                );
            }
            clock.lap(Phase::Prepare);
        }
        Problem {
            work,
            contacts,
            clock,
            features: input.features,
            budget: input.budget,
            h: input.h,
            contact_hertz: input.contact_hertz,
            record_impulses: input.record_impulses,
            points: input.points,
            count: WorkCount::default(),
            kernel: PhantomData,
        }
    }

    /// Work allowed.
    pub fn budget(&self) -> Budget {
        self.budget
    }

    /// Substep (s).
    pub fn h(&self) -> f32 {
        self.h
    }

    /// Stiffness asked of soft contacts (Hz).
    pub fn contact_hertz(&self) -> f32 {
        self.contact_hertz
    }

    /// Body pass: v ← damped v + h a.
    pub fn integrate_velocities(&mut self) {
        if self.clock.skips(Phase::Integrate) {
            return;
        }
        self.work.motion.integrate_velocities(&mut self.work.rows);
        self.clock.lap(Phase::Integrate);
    }

    /// Body pass: as [`Self::integrate_velocities`] and a warm start in one, valid from
    /// the second substep on (see [`Motion::extrapolate_velocities`]).
    pub fn integrate_and_warm_start(&mut self) {
        if self.clock.skips(Phase::Integrate) {
            return;
        }
        self.work.motion.extrapolate_velocities(&mut self.work.rows);
        self.clock.lap(Phase::Integrate);
    }

    /// Body pass: x ← x + h v.
    pub fn integrate_positions(&mut self) {
        if self.clock.skips(Phase::Integrate) {
            return;
        }
        self.work.motion.integrate_positions(&mut self.work.rows);
        self.clock.lap(Phase::Integrate);
    }

    /// Sets all accumulated impulses to zero, for solvers without memory.
    pub fn forget_impulses(&mut self) {
        if self.clock.skips(Phase::Prepare) {
            return;
        }
        for batches in [&mut self.work.lanes, &mut self.work.serial] {
            let width = batches.width();
            batches.for_each_lane(&self.features, |_, layout, record, lane| {
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
        if self.clock.skips(Phase::WarmStart) {
            return;
        }
        sweep::warm_start::<L, N>(&mut self.work.rows, &mut self.work.lanes);
        sweep::warm_start::<f32, N>(&mut self.work.rows, &mut self.work.serial);
        self.clock.lap(Phase::WarmStart);
    }

    /// Constraint pass: one velocity sweep under `rule`, booked on `phase`.
    pub fn sweep<R: NormalRule>(&mut self, phase: Phase, rule: R) {
        if self.clock.skips(phase) {
            return;
        }
        sweep::sweep::<L, N, _>(&mut self.work.rows, &mut self.work.lanes, rule);
        sweep::sweep::<f32, N, _>(&mut self.work.rows, &mut self.work.serial, rule);
        self.count_sweep(if N::FRICTION && R::FRICTION { 2 } else { 1 });
        if self.work.observe {
            self.work.last_rule = Some(ObservedRule::of(rule, &self.work.rows));
        }
        self.clock.lap(phase);
    }

    /// Constraint pass: one position sweep that removes `fraction` of each overlap.
    pub fn position_sweep(&mut self, fraction: f32) {
        if self.clock.skips(Phase::Position) {
            return;
        }
        sweep::position_sweep::<L, N>(&mut self.work.rows, &mut self.work.lanes, fraction);
        sweep::position_sweep::<f32, N>(&mut self.work.rows, &mut self.work.serial, fraction);
        self.count_sweep(1);
        self.clock.lap(Phase::Position);
    }

    fn count_sweep(&mut self, rows_per_point: usize) {
        self.count.sweeps += 1;
        self.count.row_updates += rows_per_point * self.points;
    }

    /// Ends substep `substep`: bounces if it is the last, and books impulses where asked.
    pub fn end_substep(&mut self, substep: u32) {
        if self.features.restitution && !self.clock.skips(Phase::Restitution) {
            let Workspace { rows, lanes, serial, lane_bounces, serial_bounces, .. } = self.work;
            restitution::track::<L, N>(rows, lanes, lane_bounces);
            restitution::track::<f32, N>(rows, serial, serial_bounces);
            if substep + 1 == self.budget.substeps {
                restitution::apply::<L, N>(rows, lanes, lane_bounces, self.h);
                restitution::apply::<f32, N>(rows, serial, serial_bounces, self.h);
                self.count_sweep(1);
            }
            self.clock.lap(Phase::Restitution);
        }
        if self.record_impulses && !self.clock.skips(Phase::Store) {
            let Workspace { lanes, serial, .. } = self.work;
            for batches in [lanes, serial] {
                let width = batches.width();
                batches.for_each_lane(&self.features, |contact, layout, record, lane| {
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
    pub fn finish(self) -> WorkCount {
        if self.clock.skips(Phase::Store) {
            return self.count;
        }
        let Workspace { rows, lanes, serial, lane_bounces, serial_bounces, .. } = self.work;
        if self.features.restitution {
            restitution::forget::<L, N>(rows, lanes, lane_bounces);
            restitution::forget::<f32, N>(rows, serial, serial_bounces);
        }
        prepare::store::<L, N>(rows, lanes, self.contacts);
        prepare::store::<f32, N>(rows, serial, self.contacts);
        self.clock.lap(Phase::Store);
        self.count
    }
}
