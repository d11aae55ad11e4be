//! Measurements of a timed setting: times, counts, and their file format.

use crate::engine::clock::Phase;
use crate::engine::world::StepCounts;

/// Waiting below this fraction of the time is not mentioned (1).
pub const BUSY: f64 = 0.05;

/// Number of passes at which the median over them starts to tell recurring spikes from single ones.
const REPEATED: u32 = 3;

/// Times and counts of one setting.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Sample {
    /// Mean over the steps of the run (ns).
    #[serde(rename = "mean_step_ns")]
    pub mean_ns: f64,
    /// Median over the steps (ns).
    #[serde(rename = "median_step_ns")]
    pub median_ns: f64,
    /// Longest step (ns).
    #[serde(rename = "longest_step_ns")]
    pub worst_ns: f64,
    /// Number of passes.
    pub rounds: u32,
    /// Fraction of the time in which the thread waited for a processor (1). It was subtracted or left out.
    #[serde(rename = "waited_share")]
    pub waited: f64,
    /// Median deviation of a repeat ÷ median step (1). With a single pass, the deviation of a step from the
    /// median step.
    #[serde(rename = "noise_share")]
    pub noise: f64,
    /// Median deviation of a repeat (ns), see `noise`.
    pub spread_ns: f64,
    /// Lower and upper quartile of the steps (ns): how the scene's cost changes as it moves.
    pub quartiles_ns: [f64; 2],
    /// Median time of each phase (ns), in the order of [`Phase::ALL`].
    #[serde(with = "phases")]
    pub phase_ns: [f64; Phase::ALL.len()],
    /// Median time of all sweeps ÷ number of rows that they solve (ns).
    pub row_sweep_ns: f64,
    /// Median time of a fixed loop before each round (ns): the speed of the machine at that time.
    pub yardstick_ns: f64,
    /// Averages over the steps.
    pub load: Load,
    /// Time of each block (ns per step) by pass, for comparing block by block. NaN for blocks in which the
    /// setting was not timed or had to wait.
    #[serde(with = "blocks")]
    pub blocks_ns: Vec<Vec<f64>>,
    /// Hash of the final state.
    #[serde(skip)]
    pub hash: u64,
}

impl Sample {
    /// Time of a step (ns): the mean over the run if there are enough passes to tell spikes of the solver
    /// from those of the machine, otherwise the median.
    pub fn cost_ns(&self) -> f64 {
        if self.rounds >= REPEATED { self.mean_ns } else { self.median_ns }
    }

    /// Mean ÷ median: 1 without spikes, or with too few passes to tell.
    pub fn spikes(&self) -> f64 {
        if self.median_ns > 0.0 { self.cost_ns() / self.median_ns } else { 1.0 }
    }
}

/// File format of phases: by name.
mod phases {
    use crate::engine::clock::Phase;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::collections::BTreeMap;

    pub fn serialize<S: Serializer>(ns: &[f64; Phase::ALL.len()], serializer: S) -> Result<S::Ok, S::Error> {
        let named = Phase::ALL.iter().zip(ns).map(|(phase, ns)| (phase.name(), *ns));
        named.collect::<BTreeMap<_, _>>().serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<[f64; Phase::ALL.len()], D::Error> {
        let named = BTreeMap::<String, f64>::deserialize(deserializer)?;
        Ok(Phase::ALL.map(|phase| named.get(phase.name()).copied().unwrap_or(0.0)))
    }
}

/// File format of blocks: rounded to tenths of nanoseconds, with null for NaN.
mod blocks {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(blocks: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
        let short = |ns: &f64| ns.is_finite().then(|| (10.0 * ns).round() / 10.0);
        let passes: Vec<Vec<_>> = blocks.iter().map(|pass| pass.iter().map(short).collect()).collect();
        passes.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Vec<f64>>, D::Error> {
        let passes = Vec::<Vec<Option<f64>>>::deserialize(deserializer)?;
        let number = |ns: Option<f64>| ns.unwrap_or(f64::NAN);
        Ok(passes.into_iter().map(|pass| pass.into_iter().map(number).collect()).collect())
    }
}

/// Work of a step, averaged over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Load {
    /// Contacts with at least one point.
    pub contacts: f64,
    /// Constraint rows.
    pub rows: f64,
    /// Sweeps over the constraints.
    pub sweeps: f64,
    /// Largest number of colors in any step.
    pub colors: usize,
    /// Contacts solved serially because colors ran out.
    pub overflow: f64,
    /// Fraction of lanes that hold a contact, in [0, 1].
    pub occupancy: f64,
    /// Prepared constraint records (bytes per contact, empty lanes left out).
    pub bytes_per_contact: f64,
    /// Fraction of steps that were too large for the solver's own method.
    #[serde(default)]
    pub unsolved: f64,
}

/// Sums for [`Load`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LoadSum {
    steps: usize,
    colors: usize,
    total: StepCounts,
}

impl LoadSum {
    pub(super) fn add(&mut self, counts: &StepCounts) {
        self.steps += 1;
        self.colors = self.colors.max(counts.colors);
        let t = &mut self.total;
        t.contacts += counts.contacts;
        t.rows += counts.rows;
        t.sweeps += counts.sweeps;
        t.overflow += counts.overflow;
        t.lane_slots += counts.lane_slots;
        t.constraint_bytes += counts.constraint_bytes;
        t.unsolved += usize::from(counts.unsolved > 0);
    }

    pub(super) fn average(&self) -> Load {
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
            unsolved: mean(t.unsolved),
        }
    }
}

/// The median; 0 for an empty list.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The `p`-quantile with linear interpolation; 0 for an empty list.
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

    #[test]
    fn occupancy_is_contacts_over_lanes() {
        let mut sum = LoadSum::default();
        for (contacts, lane_slots, colors, rows) in [(6, 16, 2, 24), (10, 16, 1, 0)] {
            let mut counts = StepCounts::default();
            (counts.contacts, counts.lane_slots, counts.colors, counts.rows) =
                (contacts, lane_slots, colors, rows);
            sum.add(&counts);
        }
        let load = sum.average();
        assert_eq!((load.occupancy, load.colors, load.rows, load.contacts), (0.5, 2, 12.0, 8.0));
    }
}
