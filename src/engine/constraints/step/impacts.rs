//! Impacts, and the impulses of a step.

use super::{Passes, Workspace};
use crate::clock::Phase;
use crate::constraints::impacts::restitution::Rebound;
use crate::constraints::impacts::spread::{self, Find, PropagationInput, VISITS};
use crate::constraints::impacts::{ImpactLaw, bias, restitution};
use crate::constraints::kernels::pass::PassMode;
use crate::constraints::records::batches::Part;
use crate::constraints::records::bounces::Bounces;
use crate::constraints::records::point_vector::PointVector;
use crate::params::RESTITUTION_THRESHOLD;

/// How impacts spread; see [`spread`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct ImpactWaves {
    /// Whether bodies bounce at the time of their impact instead of the beginning of the step.
    pub timed: bool,
    /// Whether points that do not bounce are stopped.
    pub stops: bool,
    /// Limit of visits for each of the first points of an island; [`VISITS`] where time does not matter.
    pub visits: usize,
}

impl Passes<'_> {
    /// Lets approaching points bounce or stop, before the step.
    pub(crate) fn spread_impacts(&mut self, spreading: ImpactWaves) {
        let ImpactWaves { timed, stops, visits } = spreading;
        let (h, dt, slop) = (self.h(), self.dt(), self.slop());
        let bounces = self.law() != ImpactLaw::None;
        if self.contacts.is_empty() {
            return;
        }
        let Some([least_gain, fastest]) =
            spread::impact_speeds(&self.work.rows, self.work.motion.velocity_increments(), h, dt)
        else {
            return;
        };
        let mut spread = std::mem::take(&mut self.work.impacts.spread);
        for (part, found) in [Part::Lanes, Part::Serial].into_iter().zip(spread.found()) {
            found.clear();
            self.over_part(part, &mut Find { h, dt, least_gain, fastest, bounces, stops, found });
        }
        let Workspace { rows, lanes, serial, motion, types, poses, .. } = &mut *self.work;
        let done = spread.run(&mut PropagationInput {
            rows,
            batches: [lanes, serial],
            contacts: self.contacts,
            features: &self.input.features,
            increments: motion.velocity_increments(),
            dt,
            h,
            slop,
            timed,
            stops,
            types,
            poses,
            visits,
            record_impulses: self.input.record_impulses,
            bounces,
        });
        if let Some([visits, cut]) = done {
            self.count.impact_visits += visits;
            self.count.cut_impacts += cut;
            motion.exclude_rotation_from_error(rows);
        }
        self.work.impacts.spread = spread;
    }

    /// Handles impacts before the step.
    pub(super) fn begin_impacts(&mut self) {
        self.work.impacts.bounces.iter_mut().for_each(Bounces::forget);
        (self.bounces, self.biased) = (false, false);
        match self.law() {
            ImpactLaw::None | ImpactLaw::Solver { .. } => {}
            ImpactLaw::Bias => self.begin_bias(true, self.input.h),
            ImpactLaw::EndPass { threshold, only_new } => {
                let threshold = threshold * self.length_unit();
                self.begin_bounces(Rebound { threshold, only_new });
            }
            ImpactLaw::Waves => {
                self.spread_impacts(ImpactWaves { timed: false, stops: false, visits: VISITS });
            }
        }
    }

    /// The impact law of the run.
    pub(crate) fn impacts(&self) -> ImpactLaw {
        self.input.impacts
    }

    /// As [`Self::impacts`], but `None` if nothing bounces.
    pub(crate) fn law(&self) -> ImpactLaw {
        if self.input.features.restitution { self.input.impacts } else { ImpactLaw::None }
    }

    /// Notes the approach speeds of points that are to bounce at the end of the step.
    fn begin_bounces(&mut self, rebound: Rebound) {
        let points = if self.input.features.two_points { 2 } else { 1 };
        let stride = self.law().stride(points);
        let mut begin = restitution::ReadApproach { rebound, stride, found: 0.0 };
        self.over_contacts(&mut begin);
        self.bounces = begin.found > 0.0;
    }

    /// Finds the points that bounce during the whole step. For solvers whose impulses add up over its
    /// substeps: a rebound must last until the end. They call [`Self::bounce`] for the last substep alone.
    pub(crate) fn find_bounces_of_step(&mut self) {
        if self.law() == ImpactLaw::Bias {
            self.begin_bias(false, self.dt());
        }
    }

    /// Finds the points that bounce within `h` (s).
    fn begin_bias(&mut self, is_first: bool, h: f32) {
        let slowest = RESTITUTION_THRESHOLD * self.length_unit();
        let mut begin = bias::FindBounces { h, is_first, slowest, fastest: 0.0 };
        self.over_contacts(&mut begin);
        self.biased = begin.fastest > 0.0;
    }

    /// Rebound speeds of points in the coming substep (m/s; zero if a point does not bounce), as normal entries;
    /// `None` if nothing bounces. The solver takes over their rows: sweeps that follow treat them as any other.
    pub fn rebounds(&mut self) -> Option<PointVector> {
        let mut rebounds = self.biased.then(|| self.vector())?;
        self.over_contacts(&mut bias::ReadTargets { to: self.parts_of(&mut rebounds) });
        self.biased = false;
        self.clock.lap(Phase::Restitution);
        Some(rebounds)
    }

    /// Solves the rows of points that bounce, after a sweep over the others.
    pub(super) fn sweep_bias(&mut self, phase: Phase) {
        if self.biased {
            self.over_contacts(&mut bias::BiasSweep);
            self.clock.lap(phase);
        }
    }

    /// Ends substep `substep`: bounces if it is the last, and books impulses if they are recorded.
    pub fn end_substep(&mut self, substep: u32) {
        self.bounce(substep);
        self.record_impulses();
    }

    /// The first part of [`Self::end_substep`].
    pub fn bounce(&mut self, substep: u32) {
        let is_last = substep + 1 == self.input.budget.substeps;
        if self.law() == ImpactLaw::Bias && !is_last {
            self.begin_bias(false, self.input.h);
            self.clock.lap(Phase::Restitution);
        }
        if self.bounces {
            self.over_contacts(&mut restitution::Track);
            if is_last {
                self.over_contacts(&mut restitution::Apply);
                self.count_sweep(1);
            }
            self.clock.lap(Phase::Restitution);
        }
    }

    /// The second part of [`Self::end_substep`]: adds the accumulated impulses to those of the step.
    pub fn record_impulses(&mut self) {
        if self.input.record_impulses {
            self.over_types_alone(Phase::Store, PassMode::Record);
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
}
