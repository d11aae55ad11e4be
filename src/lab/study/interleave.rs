//! Timing: all settings of a scene take turns, in blocks of some steps.
//!
//! A machine's clock rate and its other guests change from second to second, so settings that are
//! timed one after another are compared with the weather. Here every setting of a scene has a world
//! of its own, and in every round each world goes the same block of steps, in an order that rotates
//! from round to round. Settings are compared by the blocks of the same round ([`super::compare`]),
//! so what changes slowly changes both.
//!
//! ```text
//! block:  ○ ● ● ● ● ● ● ● ● ◐     ○ meets cold caches, not timed
//!                                 ● timed together: two clock readings for all of them
//!                                 ◐ read phase by phase, which costs as much as a small step
//! ```

use crate::engine::clock::Phase;
use crate::engine::world::{Divergence, Settings, StepCounts, World};
use crate::lab::error::Error;
use crate::lab::scenes::Scene;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::ops::Range;
use std::time::Instant;

/// Most steps of a block.
const BLOCK: u32 = 10;

/// Blocks that a pass has at least, if it has steps for them.
const LEAST_BLOCKS: u32 = 12;

/// Fewest steps of a block, one of each kind.
const LEAST_BLOCK: u32 = 3;

/// Times and counts of one setting.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Sample {
    /// Median over the blocks (ns per step); a block's time is the median of its repeats.
    pub median_ns: f64,
    /// Median distance of a repeat from its block's median (ns); with one repeat, of a
    /// block from the median block.
    pub spread_ns: f64,
    /// Lower and upper quartile of the blocks (ns): how the scene's cost changes as it moves.
    pub quartiles_ns: [f64; 2],
    /// Median time of each phase (ns), in the order of [`Phase::ALL`].
    pub phase_ns: [f64; Phase::ALL.len()],
    /// Median time of all sweeps over the rows that they solve (ns).
    pub row_sweep_ns: f64,
    /// Averages over the steps.
    pub load: Load,
    /// Time of each block (ns per step) by pass, for comparing block by block; not a number where
    /// the setting took no part.
    #[serde(with = "blocks")]
    pub blocks_ns: Vec<Vec<f64>>,
    /// Hash of the final state.
    #[serde(skip)]
    pub hash: u64,
}

/// Blocks in files: tenths of nanoseconds, and what is not a number as null.
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

/// What a step has to do, averaged over a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
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

/// Lets `count` settings take turns in so many rounds: `turn(setting, round)` for each of them.
///
/// The order of a round is the last one's, rotated. Read from its start it goes 0, 1, −1, 2, −2, …,
/// and every second round is read backwards (Williams 1949), so that who comes after whom changes,
/// too: a setting that leaves the caches full of its own does not always leave them to the same one.
/// It rotates by the golden section of the count, so that after any number of rounds everybody has
/// been early and late about as often.
pub fn take_turns(count: usize, rounds: usize, mut turn: impl FnMut(usize, usize)) {
    const GOLDEN: f64 = 0.618_033_988_749_895;
    for round in 0..rounds {
        let start = ((round as f64 * GOLDEN).fract() * count as f64) as usize;
        for mut place in 0..count {
            if round % 2 == 1 {
                place = count - 1 - place;
            }
            let step = if place % 2 == 1 { place.div_ceil(2) } else { count - place / 2 };
            turn((start + step) % count, round);
        }
    }
}

/// Settings, timed in turns.
pub struct Interleaved<'a> {
    /// Each with its scene: one for all, or variants of one.
    settings: Vec<(&'a Scene, Settings)>,
    blocks: Vec<Range<u32>>,
    timings: Vec<Timing>,
    random: Pcg64,
}

/// What is kept of one setting.
#[derive(Clone, Default)]
struct Timing {
    /// `[pass][block]` (ns per step)
    blocks: Vec<Vec<f64>>,
    phases: [Vec<f64>; Phase::ALL.len()],
    row_sweep: Vec<f64>,
    load: LoadSum,
    hash: u64,
    failure: Option<Divergence>,
}

/// The steps of a pass in blocks; what is left over is not run.
fn blocks(steps: u32) -> Vec<Range<u32>> {
    let length = (steps / LEAST_BLOCKS).clamp(LEAST_BLOCK, BLOCK).min(steps);
    (0..steps / length.max(1)).map(|i| i * length..(i + 1) * length).collect()
}

/// How many of so many steps interleaved timing takes.
pub fn whole_blocks(steps: u32) -> u32 {
    blocks(steps).last().map_or(0, |block| block.end)
}

impl<'a> Interleaved<'a> {
    /// Of the first `steps` steps; `seed` decides who begins.
    pub fn new(settings: Vec<(&'a Scene, Settings)>, steps: u32, seed: u64) -> Self {
        let timings = vec![Timing::default(); settings.len()];
        Interleaved { settings, blocks: blocks(steps), timings, random: Pcg64::seed_from_u64(seed) }
    }

    /// Goes through the steps so many times with those settings that `enter`; a world that diverges
    /// drops out.
    pub fn run(&mut self, passes: u32, enter: &[usize]) -> Result<(), Error> {
        let mut names = enter.to_vec();
        for _ in 0..passes {
            // Nobody's place in the list is a place in the order.
            names.shuffle(&mut self.random);
            let mut worlds: Vec<World> = Vec::new();
            for &i in &names {
                let (scene, settings) = &self.settings[i];
                worlds.push(scene.build(settings.clone())?);
            }
            for timing in &mut self.timings {
                timing.blocks.push(vec![f64::NAN; self.blocks.len()]);
            }
            let Interleaved { blocks, timings, .. } = self;
            take_turns(names.len(), blocks.len(), |place, round| {
                timings[names[place]].go(&mut worlds[place], blocks[round].clone(), round);
            });
            for (&i, world) in names.iter().zip(&worlds) {
                self.timings[i].hash = world.state_hash();
            }
        }
        Ok(())
    }

    /// What was found about a setting; why it dropped out, if it did.
    pub fn sample(&self, setting: usize) -> Result<Sample, Divergence> {
        self.timings[setting].sample()
    }
}

/// Times all settings of a scene side by side; a world that diverges drops out.
pub fn time_in_turns(
    scene: &Scene,
    settings: &[Settings],
    steps: u32,
    repeats: u32,
    seed: u64,
) -> Result<Vec<Result<Sample, Divergence>>, Error> {
    let all: Vec<usize> = (0..settings.len()).collect();
    let settings = settings.iter().map(|s| (scene, s.clone())).collect();
    let mut interleaved = Interleaved::new(settings, steps, seed);
    interleaved.run(repeats, &all)?;
    Ok(all.into_iter().map(|i| interleaved.sample(i)).collect())
}

impl Timing {
    /// Goes one block, the last pass's number `round`.
    fn go(&mut self, world: &mut World, steps: Range<u32>, round: usize) {
        if self.failure.is_some() {
            return;
        }
        // Of one step there is no cold one and none for the phases.
        let (cold, clocked) = if steps.len() >= 3 { (1, 1) } else { (0, 0) };
        let timed = steps.len() - cold - clocked;
        for _ in 0..cold {
            self.step(world);
        }
        let start = Instant::now();
        for _ in 0..timed {
            self.step(world);
        }
        let elapsed = start.elapsed().as_nanos() as f64 / timed.max(1) as f64;
        world.settings.timed = true;
        for _ in 0..clocked {
            self.step(world);
            for (times, &ns) in self.phases.iter_mut().zip(&world.timings.phase_ns) {
                times.push(ns as f64);
            }
            if world.counts.row_updates > 0 {
                let rows = world.counts.row_updates as f64;
                self.row_sweep.push(world.timings.sweep_ns() as f64 / rows);
            }
        }
        world.settings.timed = false;
        if let Some(pass) = self.blocks.last_mut() {
            pass[round] = elapsed;
        }
    }

    fn step(&mut self, world: &mut World) {
        if self.failure.is_none() {
            self.failure = world.step().err();
            self.load.add(&world.counts);
        }
    }

    fn sample(&self) -> Result<Sample, Divergence> {
        if let Some(divergence) = self.failure {
            return Err(divergence);
        }
        let count = self.blocks.first().map_or(0, Vec::len);
        let repeats = |block: usize| -> Vec<f64> {
            self.blocks.iter().map(|pass| pass[block]).filter(|t| !t.is_nan()).collect()
        };
        let times: Vec<Vec<f64>> = (0..count).map(repeats).filter(|t| !t.is_empty()).collect();
        let medians: Vec<f64> = times.iter().map(|t| median(t)).collect();
        let middle = median(&medians);
        let repeated = times.iter().any(|t| t.len() > 1);
        let deviations: Vec<f64> = times
            .iter()
            .zip(&medians)
            .filter(|(t, _)| t.len() > 1 || !repeated)
            .flat_map(|(t, &own)| t.iter().map(move |t| (t - if repeated { own } else { middle }).abs()))
            .collect();
        Ok(Sample {
            median_ns: middle,
            spread_ns: median(&deviations),
            quartiles_ns: [quantile(&medians, 0.25), quantile(&medians, 0.75)],
            phase_ns: self.phases.each_ref().map(|times| median(times)),
            row_sweep_ns: median(&self.row_sweep),
            load: self.load.average(),
            blocks_ns: self.blocks.clone(),
            hash: self.hash,
        })
    }
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
pub(crate) mod tests {
    use super::*;

    /// A sample of these blocks (ns per step), `[pass][block]`.
    pub fn sample(blocks: Vec<Vec<f64>>) -> Sample {
        Timing { blocks, ..Timing::default() }.sample().unwrap()
    }

    #[test]
    fn quantiles_interpolate_and_of_nothing_are_zero() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0]), 2.5);
        assert_eq!(quantile(&[0.0, 1.0, 2.0, 3.0, 4.0], 0.25), 1.0);
        assert_eq!(median(&[]), 0.0);
    }

    #[test]
    fn the_spread_is_of_repeats_and_not_of_blocks() {
        // Blocks cost 10, 20 and 30; one repeat in three was interrupted, and one took no part.
        let s = sample(vec![
            vec![10.0, 20.0, 30.0],
            vec![11.0, 21.0, 30.0],
            vec![500.0, 22.0, 30.0],
            vec![f64::NAN; 3],
        ]);
        assert_eq!((s.median_ns, s.quartiles_ns), (21.0, [16.0, 25.5]));
        // Deviations: 1, 0, 489, 1, 0, 1, 0, 0, 0.
        assert_eq!(s.spread_ns, 0.0);
        let once = sample(vec![vec![10.0, 20.0, 60.0]]);
        assert_eq!((once.median_ns, once.spread_ns), (20.0, 10.0));
    }

    #[test]
    fn occupancy_is_contacts_over_lanes() {
        let mut sum = LoadSum::default();
        sum.add(&StepCounts { contacts: 6, lane_slots: 16, colors: 2, rows: 24, ..StepCounts::default() });
        sum.add(&StepCounts { contacts: 10, lane_slots: 16, colors: 1, ..StepCounts::default() });
        let load = sum.average();
        assert_eq!((load.occupancy, load.colors, load.rows, load.contacts), (0.5, 2, 12.0, 8.0));
    }

    #[test]
    fn steps_are_cut_into_blocks() {
        assert_eq!(blocks(200).len(), 20);
        assert_eq!((blocks(40).len(), blocks(40)[1].clone()), (13, 3..6));
        let ends = |n| blocks(n).iter().map(|b| [b.start, b.end]).collect::<Vec<_>>();
        assert_eq!((ends(2), ends(1), ends(0)), (vec![[0, 2]], vec![[0, 1]], vec![]));
        for steps in 0..300 {
            assert_eq!(blocks(whole_blocks(steps)), blocks(steps));
        }
    }

    #[test]
    fn everybody_has_a_turn_in_every_round_and_no_fixed_place_or_predecessor() {
        for count in [1, 2, 7, 12, 45] {
            let rounds = 60;
            let mut places = vec![vec![0; count]; count];
            let mut order: Vec<Vec<usize>> = vec![Vec::new(); rounds];
            take_turns(count, rounds, |setting, round| {
                places[setting][order[round].len()] += 1;
                order[round].push(setting);
            });
            for round in &order {
                let mut sorted = round.clone();
                sorted.sort();
                assert_eq!(sorted, (0..count).collect::<Vec<_>>());
            }
            // The mean place of everybody is the middle, to a twentieth of the field.
            for own in &places {
                let mean = own.iter().enumerate().map(|(i, n)| (i * n) as f64).sum::<f64>() / rounds as f64;
                assert!(
                    (mean - 0.5 * (count - 1) as f64).abs() < 0.05 * count as f64 + 1e-9,
                    "{count} {mean}"
                );
            }
            // Who comes before 0: many different ones.
            let before = |round: &Vec<usize>| {
                let at = round.iter().position(|&e| e == 0)?;
                Some(round[at.checked_sub(1)?])
            };
            let mut all: Vec<usize> = order.iter().filter_map(before).collect();
            all.sort();
            all.dedup();
            assert!(all.len() + 2 >= count.min(rounds / 2), "{count}: {all:?}");
        }
    }
}
