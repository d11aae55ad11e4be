//! Timing: worlds that differ in one setting, stepped in turn.
//!
//! A machine's clock rate and its other guests change from second to second. So all worlds
//! of a race take step 1, then all take step 2, in an order that is shuffled for every step:
//! whatever the machine does, it does to all of them.
//!
//! Clock readings within a step cost as much as a small scene's step. Every fourth step is
//! read phase by phase, and only the other three count as a step's time.

use crate::engine::clock::Phase;
use crate::engine::world::{Divergence, Settings, StepCounts, World};
use crate::lab::error::Error;
use crate::lab::scenes::Scene;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::time::Instant;

/// One in this many steps is read phase by phase.
const PHASE_STEPS: u32 = 4;

/// Times and counts of one world.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Sample {
    /// Median over the steps (ns); a step's time is the median of its repeats.
    pub median_ns: f64,
    /// Median distance of a repeat from its step's median (ns); with one repeat, of a
    /// step from the median step.
    pub spread_ns: f64,
    /// Lower and upper quartile of the steps (ns): how the scene's cost changes as it moves.
    pub quartiles_ns: [f64; 2],
    /// Median time of each phase (ns), in the order of [`Phase::ALL`].
    pub phase_ns: [f64; Phase::ALL.len()],
    /// Median time of all sweeps over the rows that they solve (ns).
    pub row_sweep_ns: f64,
    /// Averages over the steps.
    pub load: Load,
    /// Time of each step (ns), for comparing step by step; not a number where none was taken.
    #[serde(skip)]
    pub steps_ns: Vec<f64>,
    /// Hash of the final state.
    #[serde(skip)]
    pub hash: u64,
}

/// What a step has to do, averaged over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Load {
    /// Contacts with at least one point.
    pub contacts: f64,
    /// Constraint rows.
    pub rows: f64,
    /// Sweeps over the constraints.
    pub sweeps: f64,
    /// Most colours of any step.
    pub colors: usize,
    /// Contacts solved serially because colours ran out.
    pub overflow: f64,
    /// Share of lanes that hold a contact, in [0, 1].
    pub occupancy: f64,
    /// Prepared constraint records (bytes per contact, empty lanes left out).
    pub bytes_per_contact: f64,
}

/// Sums for [`Load`].
#[derive(Clone, Copy, Debug, Default)]
struct LoadSum {
    steps: usize,
    colors: usize,
    total: StepCounts,
}

impl LoadSum {
    fn add(&mut self, counts: &StepCounts) {
        self.steps += 1;
        self.colors = self.colors.max(counts.colors);
        let t = &mut self.total;
        t.contacts += counts.contacts;
        t.rows += counts.rows;
        t.sweeps += counts.sweeps;
        t.overflow += counts.overflow;
        t.lane_slots += counts.lane_slots;
        t.constraint_bytes += counts.constraint_bytes;
    }

    fn average(&self) -> Load {
        let mean = |sum: usize| sum as f64 / self.steps.max(1) as f64;
        let t = &self.total;
        Load {
            contacts: mean(t.contacts),
            rows: mean(t.rows),
            sweeps: mean(t.sweeps),
            colors: self.colors,
            overflow: mean(t.overflow),
            occupancy: t.contacts as f64 / t.lane_slots.max(1) as f64,
            bytes_per_contact: t.constraint_bytes as f64 / t.lane_slots.max(1) as f64,
        }
    }
}

/// What is kept of one world while the race runs.
struct Entrant {
    /// `[step][repeat]` (ns)
    samples: Vec<Vec<f64>>,
    phases: [Vec<f64>; Phase::ALL.len()],
    row_sweep: Vec<f64>,
    load: LoadSum,
    hash: u64,
    failure: Option<Divergence>,
}

/// Steps `scene` under each of `settings` and times them; a world that diverges drops out.
pub fn race(
    scene: &Scene,
    settings: &[Settings],
    steps: u32,
    repeats: u32,
    seed: u64,
) -> Result<Vec<Result<Sample, Divergence>>, Error> {
    let entrant = || Entrant {
        samples: vec![Vec::new(); steps as usize],
        phases: Default::default(),
        row_sweep: Vec::new(),
        load: LoadSum::default(),
        hash: 0,
        failure: None,
    };
    let mut entrants: Vec<Entrant> = settings.iter().map(|_| entrant()).collect();
    let mut order: Vec<usize> = (0..settings.len()).collect();
    let mut random = Pcg64::seed_from_u64(seed);
    for repeat in 0..repeats {
        let mut worlds: Vec<World> =
            settings.iter().map(|s| scene.build(s.clone())).collect::<Result<_, _>>()?;
        for step in 0..steps {
            order.shuffle(&mut random);
            for &i in &order {
                entrants[i].step(&mut worlds[i], step, repeat);
            }
        }
        for (entrant, world) in entrants.iter_mut().zip(&worlds) {
            entrant.hash = world.state_hash();
        }
    }
    Ok(entrants.into_iter().map(Entrant::finish).collect())
}

impl Entrant {
    fn step(&mut self, world: &mut World, step: u32, repeat: u32) {
        if self.failure.is_some() {
            return;
        }
        let by_phase = (step + repeat).is_multiple_of(PHASE_STEPS);
        world.settings.timed = by_phase;
        let start = Instant::now();
        let outcome = world.step();
        let elapsed = start.elapsed().as_nanos() as f64;
        if let Err(divergence) = outcome {
            self.failure = Some(divergence);
            return;
        }
        self.load.add(&world.counts);
        if !by_phase {
            self.samples[step as usize].push(elapsed);
            return;
        }
        for (times, &ns) in self.phases.iter_mut().zip(&world.timings.phase_ns) {
            times.push(ns as f64);
        }
        let work = world.counts.row_updates;
        if work > 0 {
            self.row_sweep.push(world.timings.sweep_ns() as f64 / work as f64);
        }
    }

    fn finish(mut self) -> Result<Sample, Divergence> {
        if let Some(divergence) = self.failure {
            return Err(divergence);
        }
        // The first step finds cold caches and grows every array.
        if self.samples.iter().skip(1).any(|s| !s.is_empty()) {
            self.samples[0].clear();
        }
        let steps_ns: Vec<f64> =
            self.samples.iter().map(|s| if s.is_empty() { f64::NAN } else { median(s) }).collect();
        let known: Vec<f64> = steps_ns.iter().copied().filter(|t| !t.is_nan()).collect();
        let middle = median(&known);
        let repeated = self.samples.iter().any(|s| s.len() > 1);
        let deviations: Vec<f64> = self
            .samples
            .iter()
            .zip(&steps_ns)
            .filter(|(s, _)| s.len() > 1 || !repeated)
            .flat_map(|(s, &own)| s.iter().map(move |t| (t - if repeated { own } else { middle }).abs()))
            .collect();
        Ok(Sample {
            median_ns: middle,
            spread_ns: median(&deviations),
            quartiles_ns: [quantile(&known, 0.25), quantile(&known, 0.75)],
            phase_ns: self.phases.each_ref().map(|times| median(times)),
            row_sweep_ns: median(&self.row_sweep),
            load: self.load.average(),
            steps_ns,
            hash: self.hash,
        })
    }
}

/// How many times faster `lap` is than `other`, the median over the steps that both have;
/// none if there is no such step.
pub fn speed_up(lap: &Sample, other: &Sample) -> Option<f64> {
    let ratios: Vec<f64> = lap
        .steps_ns
        .iter()
        .zip(&other.steps_ns)
        .map(|(own, other)| other / own)
        .filter(|ratio| ratio.is_finite())
        .collect();
    (!ratios.is_empty()).then(|| median(&ratios))
}

/// The median, 0 of nothing.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The `p`-quantile with linear interpolation, 0 of nothing.
pub fn quantile(values: &[f64], p: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let Some(last) = sorted.len().checked_sub(1) else { return 0.0 };
    let at = p * last as f64;
    let (low, high) = (at.floor() as usize, at.ceil() as usize);
    sorted[low] + (at - low as f64) * (sorted[high] - sorted[low])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate_and_of_nothing_are_zero() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0]), 2.5);
        assert_eq!(quantile(&[0.0, 1.0, 2.0, 3.0, 4.0], 0.25), 1.0);
        assert_eq!(median(&[]), 0.0);
    }

    fn lap(samples: Vec<Vec<f64>>) -> Sample {
        let entrant = Entrant {
            samples,
            phases: Default::default(),
            row_sweep: Vec::new(),
            load: LoadSum::default(),
            hash: 0,
            failure: None,
        };
        entrant.finish().unwrap()
    }

    #[test]
    fn the_spread_is_of_repeats_and_not_of_steps() {
        // Steps cost 10, 20 and 30; one repeat in three was interrupted.
        let l = lap(vec![vec![99.0], vec![10.0, 11.0, 500.0], vec![20.0, 21.0, 22.0], vec![30.0; 3]]);
        assert_eq!((l.median_ns, l.quartiles_ns), (21.0, [16.0, 25.5]));
        // Deviations: 1, 0, 489, 1, 0, 1, 0, 0, 0.
        assert_eq!(l.spread_ns, 0.0);
        let once = lap(vec![vec![99.0], vec![10.0], vec![], vec![20.0], vec![60.0]]);
        assert_eq!((once.median_ns, once.spread_ns), (20.0, 10.0));
    }

    #[test]
    fn the_speed_up_compares_step_by_step() {
        let slow = lap(vec![vec![1.0], vec![10.0], vec![400.0], vec![30.0]]);
        let fast = lap(vec![vec![1.0], vec![5.0], vec![100.0], vec![]]);
        assert_eq!(speed_up(&fast, &slow), Some(3.0));
        assert_eq!(speed_up(&lap(vec![]), &slow), None);
    }

    #[test]
    fn occupancy_is_contacts_over_lanes() {
        let mut sum = LoadSum::default();
        sum.add(&StepCounts { contacts: 6, lane_slots: 16, colors: 2, rows: 24, ..StepCounts::default() });
        sum.add(&StepCounts { contacts: 10, lane_slots: 16, colors: 1, ..StepCounts::default() });
        let load = sum.average();
        assert_eq!((load.occupancy, load.colors, load.rows, load.contacts), (0.5, 2, 12.0, 8.0));
    }
}
