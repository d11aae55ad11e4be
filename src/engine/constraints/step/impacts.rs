//! What bounces, and the impulses of a step.

use super::Passes;
use crate::engine::clock::Phase;
use crate::engine::constraints::impacts::restitution::Rebound;
use crate::engine::constraints::impacts::{ImpactLaw, bias, restitution, waves};
use crate::engine::constraints::records::bounces::Bounces;
use crate::engine::params::{IMPACT_SWEEPS, IMPACT_TOLERANCE, IMPACT_WAVES, RESTITUTION_THRESHOLD};

/// What only others push together after waves of impacts.
pub(crate) const AFTER_WAVES: Rebound =
    Rebound { threshold: RESTITUTION_THRESHOLD, in_flight: true, only_new: false };

impl Passes<'_> {
    /// Lets bounce what comes in, wave by wave; see [`waves`].
    pub(crate) fn bounce_before(&mut self, timed: bool) {
        let (h, dt) = (self.h(), self.dt());
        self.over_contacts(&mut waves::Load { h, dt, timed });
        let (mut has_bounced, mut has_ended) = (false, false);
        self.work.impacts.rebounds.stopped.clear();
        for _ in 0..IMPACT_WAVES {
            let mut wave = waves::Wave { h, dt, is_first: !has_bounced, found: 0.0 };
            self.over_contacts(&mut wave);
            let fastest = wave.found;
            has_ended = fastest == 0.0;
            if has_ended {
                break;
            }
            has_bounced = true;
            self.work.impacts.rebounds.begin(&self.work.rows);
            let friction = self.input.features.friction;
            if !self.solve_wave(timed, fastest, friction)
                && friction
                && self.work.impacts.rebounds.has_gained(&self.work.rows)
            {
                self.work.impacts.rebounds.undo(&mut self.work.rows);
                self.solve_wave(timed, fastest, false);
            }
            if self.input.record_impulses {
                self.over_contacts(&mut waves::Book);
            }
            if timed {
                self.over_contacts(&mut waves::PutBack);
                self.work.impacts.rebounds.bound(&mut self.work.rows, dt);
            }
        }
        if has_bounced && timed {
            if !has_ended {
                // Bodies stay where they are: one might be in a third that nobody has looked at.
                self.work.rows.iter_mut().for_each(|row| row.delta[..3].fill(0.0));
                let mut stopped = std::mem::take(&mut self.work.impacts.rebounds.stopped);
                stopped.resize(self.contacts.len(), false);
                self.over_contacts(&mut waves::Bounced { found: &mut stopped });
                self.work.impacts.rebounds.stopped = stopped;
            }
            self.work.motion.hide_turns(&mut self.work.rows);
            self.over_contacts(&mut waves::Leave);
        }
    }

    /// Solves a wave, the fastest point of which shall leave at `fastest` (m/s), from no impulses; whether it is solved.
    fn solve_wave(&mut self, timed: bool, fastest: f32, with_friction: bool) -> bool {
        for sweep in 0..IMPACT_SWEEPS {
            let is_first = sweep == 0;
            let mut solve = waves::Solve { timed, fastest, is_first, with_friction, change: 0.0 };
            self.over_contacts(&mut solve);
            self.count_sweep(if with_friction { self.rows_per_point() } else { 1 });
            if solve.change < IMPACT_TOLERANCE {
                return true;
            }
        }
        false
    }

    /// What is done before the step where bodies hit each other.
    pub(super) fn begin_impacts(&mut self) {
        self.work.impacts.bounces.iter_mut().for_each(Bounces::forget);
        (self.bounces, self.biased) = (false, false);
        match self.law() {
            ImpactLaw::None | ImpactLaw::Solver { .. } => {}
            ImpactLaw::Bias => self.begin_bias(true),
            ImpactLaw::EndPass { threshold, only_new } => {
                self.begin_bounces(Rebound { threshold, in_flight: false, only_new });
            }
            ImpactLaw::Waves => {
                self.bounce_before(false);
                self.begin_bounces(AFTER_WAVES);
            }
        }
    }

    /// The law of impacts of the run; none where nothing bounces.
    pub(crate) fn law(&self) -> ImpactLaw {
        if self.input.features.restitution { self.input.impacts } else { ImpactLaw::None }
    }

    /// Notes how fast points come in that shall bounce at the end of the step.
    pub(crate) fn begin_bounces(&mut self, rebound: Rebound) {
        let points = if self.input.features.two_points { 2 } else { 1 };
        let stride = self.law().stride(points);
        let stopped = std::mem::take(&mut self.work.impacts.rebounds.stopped);
        let mut begin =
            restitution::Begin { h: self.input.h, rebound, stride, stopped: &stopped, found: 0.0 };
        self.over_contacts(&mut begin);
        self.bounces = begin.found > 0.0;
        self.work.impacts.rebounds.stopped = stopped;
    }

    /// Finds what bounces in the coming substep.
    fn begin_bias(&mut self, is_first: bool) {
        let mut begin = bias::Begin { h: self.input.h, is_first, fastest: 0.0 };
        self.over_contacts(&mut begin);
        self.biased = begin.fastest > 0.0;
    }

    /// Solves rows that bounce, after a sweep over the others.
    pub(super) fn sweep_bias(&mut self, phase: Phase) {
        if self.biased && self.input.phases.runs(phase) {
            self.over_contacts(&mut bias::BiasSweep);
            self.clock.lap(phase);
        }
    }

    /// Ends substep `substep`: bounces if it is the last, and books impulses where asked.
    pub fn end_substep(&mut self, substep: u32) {
        self.bounce(substep);
        self.book_impulses();
    }

    /// The first part of [`Self::end_substep`].
    pub fn bounce(&mut self, substep: u32) {
        let is_last = substep + 1 == self.input.budget.substeps;
        if self.law() == ImpactLaw::Bias && !is_last && self.input.phases.runs(Phase::Restitution) {
            self.begin_bias(false);
            self.clock.lap(Phase::Restitution);
        }
        if self.bounces && self.input.phases.runs(Phase::Restitution) {
            self.over_contacts(&mut restitution::Track);
            if is_last {
                self.over_contacts(&mut restitution::Apply { h: self.input.h });
                self.count_sweep(1);
            }
            self.clock.lap(Phase::Restitution);
        }
    }

    /// The second part of [`Self::end_substep`]: adds the accumulated impulses to those of the step.
    pub fn book_impulses(&mut self) {
        if self.input.record_impulses && self.input.phases.runs(Phase::Store) {
            let super::Workspace { lanes, serial, .. } = &mut *self.work;
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

    /// The impulses of what has bounced are no start for the next step. Sources with a pass of their own keep them.
    pub(super) fn forget_bounced(&mut self) {
        if self.bounces && !matches!(self.law(), ImpactLaw::EndPass { .. }) {
            self.over_contacts(&mut restitution::Forget);
        }
    }
}
