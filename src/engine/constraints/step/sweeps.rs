//! Passes over constraints: warm starts, velocity sweeps and position sweeps.

use super::{Passes, Workspace};
use crate::clock::Phase;
use crate::constraints::joints::chains::{ChainStage, Chains};
use crate::constraints::kernels::observe::ObservedRule;
use crate::constraints::kernels::pass::{AnyPass, PassMode};
use crate::constraints::kernels::position::PositionSweep;
use crate::constraints::kernels::velocity::block::BlockSweep;
use crate::constraints::kernels::velocity::jacobi::{self, JacobiSweep};
use crate::constraints::kernels::velocity::masses::{EffectiveMasses, ScaledMasses};
use crate::constraints::kernels::velocity::rules::{NormalRule, Rule, Soft};
use crate::constraints::kernels::velocity::sweep::{ContactLaw, Sweep, VelocitySweep};
use crate::constraints::kernels::velocity::warm_start::WarmStart;
use crate::lanes::BodyRow;

impl Passes<'_> {
    /// Sets all accumulated impulses to zero, for solvers without warm starting.
    pub fn forget_impulses(&mut self) {
        let mut zero = self.vector();
        self.system().set_lane_impulses(&mut zero);
        self.give_back([zero]);
        self.over_types_alone(Phase::Prepare, PassMode::Forget);
        self.clock.lap(Phase::Prepare);
    }

    /// Pass over joints alone: resets their impulses to zero, then applies springs and motors. For solvers
    /// that move bodies before they solve: the law of a spring is for velocities that have not moved bodies
    /// yet.
    pub fn drive_joints(&mut self) {
        if !self.work.types.is_empty() {
            self.over_types_alone(Phase::Prepare, PassMode::Forget);
            self.over_types_alone(Phase::Solve, PassMode::Drive);
            self.driven = true;
            self.clock.lap(Phase::Solve);
        }
    }

    /// Pass over joints alone: books their impulses and resets them to zero. For solvers whose contacts sum
    /// up their impulses over a step of several substeps.
    pub fn restart_joints(&mut self) {
        if !self.work.types.is_empty() {
            if self.input.record_impulses {
                self.over_types_alone(Phase::Store, PassMode::Record);
            }
            self.over_types_alone(Phase::Prepare, PassMode::Forget);
            self.clock.lap(Phase::Solve);
        }
    }

    /// Finds the joints for [`Self::solve_chains`]. Other passes skip their rigid rows until the step ends.
    /// Also finds the masses of their bodies for contacts, which apply until [`Self::leave_chains`].
    pub fn find_chains(&mut self, chains: &mut Chains) {
        if self.work.types.is_empty() {
            return;
        }
        let Workspace { rows, types, poses, .. } = &mut *self.work;
        chains.find(types, rows);
        chains.disable_rows(types, poses);
        if !chains.is_empty() && !self.contacts.is_empty() {
            let pairs = self.contacts.iter().map(|contact| [contact.body_a, contact.body_b]);
            let shared = chains.share_masses(types, rows, self.input.length_unit, pairs);
            if let Some((masses, factors)) = shared {
                masses.scale(rows, |body| factors[body]);
                self.over_batches(Phase::Prepare, &mut EffectiveMasses { factors });
            }
            self.clock.lap(Phase::Prepare);
        }
    }

    /// Body pass: restores the masses of bodies of chains.
    pub fn leave_chains(&mut self, chains: &mut Chains) {
        chains.restore_masses(&mut self.work.rows);
    }

    /// Body pass: notes the velocities of chains. Called before warm starts, which change them by the masses
    /// for contacts.
    pub fn snapshot_chains(&mut self, chains: &mut Chains) {
        chains.snapshot_velocities(&self.work.rows);
    }

    /// Pass over joints alone: solves the rigid rows of each chain of joints at once.
    pub fn solve_chains(&mut self, chains: &mut Chains, stage: ChainStage) {
        let phase = if stage == ChainStage::Relax { Phase::Relax } else { Phase::Solve };
        // No sweep has moved the bodies since.
        let is_done = stage != ChainStage::Begin && self.has_no_sweeps();
        if self.has_chains(chains) && !is_done {
            let Workspace { rows, types, .. } = &mut *self.work;
            chains.solve(types, rows, [self.input.h, self.input.length_unit], stage);
            self.clock.lap(phase);
        }
    }

    /// Pass over joints alone: joints of chains take over the impulses of the last substep, or of every
    /// substep if impulses are recorded.
    pub fn keep_chains(&mut self, chains: &Chains, is_last: bool) {
        if (is_last || self.input.record_impulses) && self.has_chains(chains) {
            chains.give_impulses(&mut self.work.types);
            if self.input.record_impulses {
                // Types defined by the caller treat this pass as a normal store.
                self.over_types_alone(Phase::Store, PassMode::LoadDirectImpulses);
            }
            self.clock.lap(Phase::Relax);
        }
    }

    fn has_chains(&self, chains: &Chains) -> bool {
        !chains.is_empty() && !self.work.types.is_empty()
    }

    /// Pass over joints alone: their records take up the changes by [`ConstraintType::replace`].
    ///
    /// [`ConstraintType::replace`]: crate::constraints::kernels::types::ConstraintType::replace
    pub fn reload_types(&mut self) {
        if !self.work.types.is_empty() {
            self.over_types_alone(Phase::Prepare, PassMode::InTurn);
            self.clock.lap(Phase::Solve);
        }
    }

    /// Constraint pass: applies the accumulated impulses.
    pub fn warm_start(&mut self) {
        self.run(Phase::WarmStart, &mut WarmStart { turned: false });
    }

    /// As [`Self::warm_start`], with arms that have turned with their bodies since the step began.
    pub fn warm_start_turned(&mut self) {
        self.run(Phase::WarmStart, &mut WarmStart { turned: true });
    }

    /// Constraint pass: one velocity sweep under `rule`, Gauss–Seidel, booked on `phase`.
    pub fn sweep(&mut self, phase: Phase, rule: &Rule) {
        self.velocity_sweep(phase, { *rule }.sweep());
    }

    /// As [`Self::sweep`], with the solver's own rule.
    pub fn velocity_sweep(&mut self, phase: Phase, sweep: &mut dyn VelocitySweep) {
        self.run(phase, sweep);
        self.sweep_bias(phase);
        self.solved(sweep);
    }

    /// Constraint pass: as [`Self::sweep`], but the two normal rows of a contact are solved
    /// together; see [`crate::constraints::kernels::velocity::block`].
    pub fn block_sweep<R: NormalRule>(&mut self, phase: Phase, rule: R) {
        self.sweep_by(phase, &mut BlockSweep::<_, false>(rule), &Sweep(rule));
    }

    /// Constraint pass: as [`Self::block_sweep`], but friction rows come last, bounded by the new impulses.
    pub fn block_sweep_normal_first<R: NormalRule>(&mut self, phase: Phase, rule: R) {
        self.sweep_by(phase, &mut BlockSweep::<_, true>(rule), &Sweep(rule));
    }

    /// Constraint pass: one velocity sweep with the solver's own pass. `law` is the law that it solves.
    pub fn sweep_by(&mut self, phase: Phase, pass: &mut dyn AnyPass, law: &dyn ContactLaw) {
        self.run(phase, pass);
        self.sweep_bias(phase);
        self.solved(law);
    }

    /// Constraint pass: every contact reads the velocities from before the pass. The changes of each body,
    /// times `relaxation`, are summed up in `sums`; see
    /// [`crate::constraints::kernels::velocity::jacobi`]. `split`: bodies that are split into copies.
    pub fn jacobi_sweep(
        &mut self,
        phase: Phase,
        rule: Soft,
        relaxation: f32,
        sums: &mut Vec<BodyRow>,
        split: Option<&ScaledMasses>,
    ) {
        jacobi::begin(&self.work.rows, sums);
        self.over_batches(phase, &mut JacobiSweep { rule, relaxation, sums });
        jacobi::finish(&mut self.work.rows, sums, split.map_or(&[], ScaledMasses::whole));
        self.clock.lap(phase);
        self.solved(&Sweep(rule));
    }

    /// Constraint pass: as [`Self::sweep`], on velocities that only move bodies apart. The observed law
    /// remains that of the solver's other sweeps.
    pub fn push_sweep(&mut self, phase: Phase, rule: &Rule) {
        let mut rule = *rule;
        let sweep = rule.sweep();
        self.run(phase, sweep);
        let rows = if sweep.has_friction() { self.rows_per_point() } else { 1 };
        self.count_sweep(rows);
    }

    /// Constraint pass: one position sweep, nonlinear Gauss–Seidel.
    pub fn position_sweep(&mut self, mut sweep: PositionSweep) {
        self.run(Phase::Position, &mut sweep);
        self.count_sweep(1);
    }

    /// Sets the observed law, for solvers that solve it without a sweep.
    pub fn solves(&mut self, law: &dyn ContactLaw) {
        if self.work.observe {
            self.work.last_rule = Some(ObservedRule::of(law, &self.work.rows));
        }
    }

    /// Counts a velocity sweep, and keeps its law if `observe` is set.
    pub fn solved(&mut self, law: &dyn ContactLaw) {
        let rows = if law.has_friction() { self.rows_per_point() } else { 1 };
        self.count_sweep(rows);
        self.solves(law);
    }
}
