//! The times of a run, measured separately from its errors.

use crate::engine::clock::Phase;
use crate::engine::world::{Settings, StepCounts, World};
use crate::lab::error::Error;
use crate::lab::scenes::Scene;
use crate::lab::study::interleave::time_in_turns;
use crate::lab::study::sample::{BUSY, Sample, median};
use crate::lab::units::{digits, si};
use std::time::{Duration, Instant};

/// Passes over the run; one pass if they would take longer than `PATIENCE`.
const PASSES: u32 = 3;
const PATIENCE: Duration = Duration::from_secs(10);

/// Times of the steps of a run.
pub struct Times {
    /// Times of steps, measured as in a study.
    pub sample: Sample,
    /// Times of phases, with the clock read around each (ns).
    pub phases: [Vec<f64>; Phase::ALL.len()],
    /// Counts of each step.
    pub counts: Vec<StepCounts>,
    /// Whether the timed passes ended in the same bits as the run whose errors were measured.
    pub same_bits: bool,
}

impl Times {
    /// Times all steps of a scene. `hash` is the final state of the run whose errors were measured.
    ///
    /// Errors: a scene that cannot be built, or that diverges.
    pub fn measure(scene: &Scene, settings: Settings, hash: u64) -> Result<Self, Error> {
        let start = Instant::now();
        let mut phases: [Vec<f64>; Phase::ALL.len()] = Default::default();
        let mut counts = Vec::new();
        let mut world: World = scene.build(Settings { timed: true, ..settings.clone() })?;
        for _ in 0..scene.steps {
            world.step().map_err(|d| Error::invalid("time", d.to_string()))?;
            for (times, &ns) in phases.iter_mut().zip(&world.timings().phase_ns) {
                times.push(ns as f64);
            }
            counts.push(*world.counts());
        }
        let passes = if start.elapsed() * PASSES > PATIENCE { 1 } else { PASSES };
        let sample = time_in_turns(scene, &[settings], scene.steps, passes, 1)?.pop();
        let sample = match sample {
            Some(Ok(sample)) => sample,
            Some(Err(divergence)) => return Err(Error::invalid("time", divergence.to_string())),
            None => return Err(Error::invalid("time", "nothing was timed")),
        };
        let same_bits = sample.hash == hash && world.state_hash() == hash;
        Ok(Times { sample, phases, counts, same_bits })
    }

    /// Median times (ns) of the phases that the solver has.
    pub fn by_phase(&self) -> impl Iterator<Item = (String, f64)> {
        let all = Phase::ALL.iter().zip(&self.phases).filter(|(_, times)| times.iter().any(|&t| t > 0.0));
        all.map(|(phase, times)| (phase.name().to_string(), median(times)))
    }

    /// The phase with the largest share of a median step, and that share (1).
    pub fn longest(&self) -> (&'static str, f64) {
        let all = || Phase::ALL.iter().zip(&self.phases).map(|(phase, times)| (phase.name(), median(times)));
        let whole: f64 = all().map(|(_, ns)| ns).sum();
        let (name, ns) = all().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(("none", 0.0));
        (name, ns / whole.max(1.0))
    }

    /// The phase with the largest share of the longest step of the clocked pass, the number of that step
    /// counted from 1, and the share (1).
    fn longest_step(&self) -> Option<(&'static str, usize, f64)> {
        let whole = |i: usize| self.phases.iter().map(|times| times[i]).sum::<f64>();
        let count = self.phases.first().map_or(0, Vec::len);
        let step = (0..count).max_by(|&a, &b| whole(a).total_cmp(&whole(b)))?;
        let (phase, times) =
            Phase::ALL.iter().zip(&self.phases).max_by(|a, b| a.1[step].total_cmp(&b.1[step]))?;
        Some((phase.name(), step + 1, times[step] / whole(step).max(1.0)))
    }

    /// Median and longest step as text.
    pub fn spread(&self) -> String {
        let s = &self.sample;
        let mut text =
            format!("median {}, longest {}", si(1e-9 * s.median_ns, "s"), si(1e-9 * s.worst_ns, "s"));
        if let Some((phase, step, share)) = self.longest_step()
            && s.worst_ns > 3.0 * s.median_ns
        {
            text += &format!(" (step {step}: {phase}, {:.0} %)", 100.0 * share);
        }
        text
    }

    /// Warnings about the quality of the times.
    pub fn note(&self) -> String {
        let mut text = String::new();
        if self.sample.waited >= BUSY {
            text += &format!(
                "the timed thread waited for a processor {:.0} % of the time; waiting is not counted\n",
                100.0 * self.sample.waited
            );
        }
        if !self.same_bits {
            text += "the timed passes did NOT end in the bits of the run whose errors were measured\n";
        }
        text
    }

    /// Table of mean and median per step. Phases that the solver does not have are left out.
    pub fn table(&self) -> String {
        let mean = |times: &[f64]| times.iter().sum::<f64>() / times.len().max(1) as f64;
        let most = |times: &[f64]| times.iter().copied().fold(0.0, f64::max);
        let whole: f64 = self.phases.iter().map(|times| mean(times)).sum();
        let line = |name: &str, [mean, median, longest]: [f64; 3], share: f64| {
            let [mean, median, longest] = [mean, median, longest].map(|ns| digits(ns / 1e3));
            format!("  {name:<12}{mean:>12}{median:>12}{longest:>12}{:>9.1} %\n", 100.0 * share)
        };
        let mut text = format!(
            "  {:<12}{:>12}{:>12}{:>12}{:>11}\n",
            "µs per step", "mean", "median", "longest", "share"
        );
        for (phase, times) in Phase::ALL.iter().zip(&self.phases) {
            if times.iter().any(|&t| t > 0.0) {
                let share = if whole > 0.0 { mean(times) / whole } else { 0.0 };
                text += &line(phase.name(), [mean(times), median(times), most(times)], share);
            }
        }
        let s = &self.sample;
        text + &line("whole step", [s.mean_ns, s.median_ns, s.worst_ns], 1.0)
    }
}
