//! The prepared problem of a step: passes over bodies and constraints, which a solver calls in its own order.
//!
//! [`Passes`] is the whole interface of a solver. Its methods are in files by what they work on: `bodies`,
//! `sweeps`, `impacts` and `vectors`. This file runs the passes.

#[doc(hidden)]
pub mod assign;
mod bodies;
mod drifts;
mod impacts;
pub(crate) mod jams;
mod solver;
mod sweeps;
mod vectors;
mod workspace;

pub(crate) use drifts::Drifts;
pub(crate) use impacts::ImpactWaves;
pub use solver::{CloneSolver, Collision, CollisionScene, Schedule, Solver};
pub use workspace::{IterationObserver, StepInput, Watch, WorkCount, Workspace};

use crate::clock::{Clock, Phase};
use crate::constraints::kernels::pass::{AnyPass, PassInput, PassMode};
use crate::constraints::kernels::prepare::{Prepare, Store};
use crate::constraints::kernels::types::{ConstraintSet, TypeInput, TypeRows};
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::records::batches::{Batches, Part};
use crate::constraints::records::kept::SolverState;
use crate::constraints::records::order::SweepOrder;
use crate::constraints::vectors::system::Others;
use crate::contacts::Contact;
use crate::lanes::LaneWidth;
use crate::narrowphase::Margins;
use crate::params::{Budget, MAX_POSITION_CORRECTION, MAX_PUSH_SPEED};

/// One step's problem, prepared.
///
/// Each method is one pass over all bodies or all constraints. Colored batches run first, color by color;
/// then the serial ones. This type is not generic: passes are compiled per width and features, schedules
/// once.
pub struct Passes<'a> {
    work: &'a mut Workspace,
    contacts: &'a mut [Contact],
    clock: &'a mut Clock,
    input: &'a StepInput,
    width: LaneWidth,
    count: WorkCount,
    iterations: u32,
    order: SweepOrder,
    /// Whether something may bounce at the end of the step.
    bounces: bool,
    /// Whether rows have rebound speeds as targets.
    biased: bool,
    /// Whether springs and motors of joints have acted in this substep.
    driven: bool,
}

/// Data for a solver's own passes over bodies and contacts.
#[non_exhaustive]
pub struct StepParts<'p> {
    /// The workspace.
    pub work: &'p mut Workspace,
    /// The contacts of the step.
    pub contacts: &'p mut [Contact],
    /// Inputs of the step.
    pub input: &'p StepInput,
    /// Books the time of passes.
    pub clock: &'p mut Clock,
    /// Lanes of the colored batches.
    pub width: LaneWidth,
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
        let (count, order) = (WorkCount::default(), SweepOrder::Forward);
        let mut passes = Passes {
            work,
            contacts,
            clock,
            input,
            width,
            count,
            iterations: 0,
            order,
            bounces: false,
            biased: false,
            driven: false,
        };
        passes.set_order(SweepOrder::Forward);
        for (batches, width) in [(&passes.work.lanes, width.lanes()), (&passes.work.serial, 1)] {
            batches.assert_fits(width, passes.work.rows.len(), passes.contacts.len());
        }
        passes.over_batches(Phase::Prepare, &mut Prepare);
        passes.begin_impacts();
        passes.clock.lap(Phase::Prepare);
        passes
    }

    /// Work allowed per step.
    pub fn budget(&self) -> Budget {
        self.input.budget
    }

    /// Substep (s).
    pub fn h(&self) -> f32 {
        self.input.h
    }

    /// Step (s).
    pub fn dt(&self) -> f32 {
        self.input.h * self.input.budget.substeps as f32
    }

    /// Size of typical bodies (m), [`Settings::length_unit`](crate::world::Settings::length_unit).
    pub fn length_unit(&self) -> f32 {
        self.input.length_unit
    }

    /// Overlap that position correction leaves uncorrected (m).
    pub fn slop(&self) -> f32 {
        Margins::of(self.input.length_unit).slop
    }

    /// Speed limit for pushing overlap apart by Baumgarte stabilization (m/s).
    pub fn push_speed(&self) -> f32 {
        MAX_PUSH_SPEED * self.input.length_unit
    }

    /// Largest correction in one position sweep: overlap at a point (m), and angle (rad).
    pub fn max_correction(&self) -> [f32; 2] {
        [self.input.length_unit, 1.0].map(|unit| MAX_POSITION_CORRECTION * unit)
    }

    /// The solver's own parameter of this index in `Variant::parameters`.
    pub fn parameter(&self, index: usize) -> f32 {
        self.input.parameters[index]
    }

    /// Whether the solver's mechanism of this index in `Variant::mechanisms` is active.
    pub fn has(&self, mechanism: usize) -> bool {
        !self.input.without.leaves_out(mechanism)
    }

    /// Whether a pair of shapes that may touch has a disc.
    pub fn has_discs(&self) -> bool {
        self.input.has_discs
    }

    /// Number of points of all contacts.
    pub fn points(&self) -> usize {
        self.input.points
    }

    /// Numbers that the solver keeps per contact, contact point and body; see `Variant::kept`.
    pub fn kept(&mut self) -> &mut SolverState {
        &mut self.work.kept
    }

    /// Data for a solver's own passes over bodies and contacts.
    pub fn parts(&mut self) -> StepParts<'_> {
        StepParts {
            work: self.work,
            contacts: self.contacts,
            input: self.input,
            clock: self.clock,
            width: self.width,
        }
    }

    /// Runs a constraint pass of the solver's own, booked on `phase`. Passes that solve rows are counted by
    /// [`Self::count_sweep`].
    pub fn run(&mut self, phase: Phase, pass: &mut dyn AnyPass) {
        if is_sweep(phase) && self.has_no_sweeps() {
            return;
        }
        if matches!(phase, Phase::Prepare | Phase::Store) {
            // Constraints of other types have their records already.
            self.over_contacts(pass);
        } else {
            self.over_batches(phase, pass);
        }
        self.clock.lap(phase);
    }

    /// Sets the order of the passes that follow, until the next call or the end of the step.
    pub fn set_order(&mut self, order: SweepOrder) {
        let Workspace { lanes, serial, types, .. } = &mut *self.work;
        lanes.arrange(order);
        serial.arrange(order);
        types.iter_mut().for_each(|joined| joined.arrange(order));
        self.order = order;
    }

    /// Number of levels in the contact graph: 1 unless the solver groups contacts by them.
    pub fn levels(&self) -> u32 {
        let segments = self.work.lanes.segments().iter().chain(self.work.serial.segments());
        1 + segments.map(|s| s.level).max().unwrap_or(0)
    }

    /// Ends an iteration, as the solver defines it.
    pub fn iteration_done(&mut self) {
        self.iterations += 1;
        if let Some(mut watch) = self.work.watch.take() {
            let iteration = self.iterations;
            (watch.0)(iteration, &mut self.system());
            self.work.watch = Some(watch);
        }
    }

    /// Counts a sweep that solved `rows_per_point` rows at each contact point.
    pub fn count_sweep(&mut self, rows_per_point: usize) {
        self.count.sweeps += 1;
        self.count.row_updates += rows_per_point * self.input.points;
    }

    /// Counts a substep that was too large for the solver's own method and was solved by sweeps alone.
    pub fn count_unsolved(&mut self) {
        self.count.unsolved += 1;
    }

    /// Rows that a sweep with friction solves at each contact point.
    pub fn rows_per_point(&self) -> usize {
        if self.input.features.friction { 2 } else { 1 }
    }

    /// Writes accumulated impulses back to the contacts, and returns the work done.
    pub fn finish(mut self) -> WorkCount {
        self.set_order(SweepOrder::Forward);
        self.over_batches(Phase::Store, &mut Store);
        self.clock.lap(Phase::Store);
        let Workspace { types, poses, .. } = &mut *self.work;
        types.iter_mut().for_each(|joined| joined.kind.link(&[], poses));
        self.count
    }

    /// Runs over the colored batches at the width of the step, then over the serial ones at one lane. In
    /// reverse order, the serial ones come first. Includes constraints of other types.
    fn over_batches(&mut self, phase: Phase, pass: &mut dyn AnyPass) {
        let passes_by = is_sweep(phase) || phase == Phase::Store;
        if self.work.types.is_empty() || passes_by && self.types_are_idle() {
            return self.over_contacts(pass);
        }
        for part in self.parts_in_order() {
            let order = self.order;
            for batches in self.all(part) {
                batches.unfocus();
            }
            while let Some(rank) = self.all(part).filter_map(|batches| batches.next_rank()).min() {
                self.over_types(phase, pass, part, rank);
                let batches = part.of(&mut self.work.lanes, &mut self.work.serial);
                if batches.next_rank() == Some(rank) {
                    batches.focus_on(rank);
                    self.over_part(part, pass);
                }
            }
            self.all(part).for_each(|batches| batches.arrange(order));
        }
    }

    /// Whether sweeps have nothing to do: there are no contacts, and all rows of other types belong to links.
    fn has_no_sweeps(&self) -> bool {
        self.contacts.is_empty() && self.types_are_idle()
    }

    /// Whether all rows of other types belong to links.
    fn types_are_idle(&self) -> bool {
        self.work.types.iter().all(|joined| joined.kind.is_idle())
    }

    /// As [`Self::over_batches`], over contacts alone.
    pub(crate) fn over_contacts(&mut self, pass: &mut dyn AnyPass) {
        for part in self.parts_in_order() {
            self.over_part(part, pass);
        }
    }

    /// Runs over the constraints of other types with this rank.
    fn over_types(&mut self, phase: Phase, pass: &mut dyn AnyPass, part: Part, rank: u64) {
        let (width, mode, law, driven) = (self.width_of(part), pass.mode_of(), pass.law_of(), self.driven);
        let Workspace { rows, types, poses, .. } = &mut *self.work;
        for ConstraintSet { kind, lanes, serial } in types {
            let batches = part.of(lanes, serial);
            if batches.next_rank() == Some(rank) {
                batches.focus_on(rank);
                let rows = TypeRows::new(rows, pass.sums_of(), mode);
                kind.run(TypeInput {
                    phase,
                    mode,
                    law,
                    driven,
                    h: self.input.h,
                    width,
                    rows,
                    poses,
                    batches,
                    vectors: [&mut [], &mut []],
                });
            }
        }
    }

    /// Runs over the constraints of other types, without the contacts.
    pub(super) fn over_types_alone(&mut self, phase: Phase, mode: PassMode) {
        let Workspace { rows, types, poses, .. } = &mut *self.work;
        let mut others = Others { types, poses, h: self.input.h, driven: self.driven };
        others.run(rows, self.width, (phase, mode), Softness::RIGID, [&mut [], &mut []]);
    }

    pub(crate) fn over_part(&mut self, part: Part, pass: &mut dyn AnyPass) {
        let width = self.width_of(part);
        let Workspace { rows, motion, lanes, serial, impacts, kept, workers, .. } = &mut *self.work;
        let batches = part.of(lanes, serial);
        let on = PassInput {
            rows,
            batches,
            part,
            bounces: &mut impacts.bounces[part as usize],
            contacts: self.contacts,
            workers,
            increments: motion.velocity_increments(),
            kept,
        };
        pass.run_at(width, &self.input.features, on);
    }

    fn parts_in_order(&self) -> [Part; 2] {
        match self.order {
            SweepOrder::Reverse => [Part::Serial, Part::Lanes],
            _ => [Part::Lanes, Part::Serial],
        }
    }

    fn width_of(&self, part: Part) -> LaneWidth {
        match part {
            Part::Lanes => self.width,
            Part::Serial => LaneWidth::W1,
        }
    }

    /// Batches of all types of constraints.
    fn all(&mut self, part: Part) -> impl Iterator<Item = &mut Batches> {
        let Workspace { lanes, serial, types, .. } = &mut *self.work;
        let types = types.iter_mut().map(move |t| part.of(&mut t.lanes, &mut t.serial));
        types.chain([part.of(lanes, serial)])
    }
}

/// Whether the phase solves or applies impulses.
fn is_sweep(phase: Phase) -> bool {
    matches!(phase, Phase::WarmStart | Phase::Solve | Phase::Relax | Phase::Position)
}
