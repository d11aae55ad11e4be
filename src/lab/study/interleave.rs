//! Interleaved timing: all settings of a scene take turns, in blocks of steps.
//!
//! The clock rate and load of a machine change from second to second, so times measured one setting after
//! another are not comparable. Here every setting of a scene has its own world. In every round, each world
//! runs the same block of steps, in an order that rotates from round to round. Settings are compared by
//! blocks of the same round ([`super::compare`]), so slow changes affect all settings alike.
//!
//! ```text
//! block:  ○ ● ● ● ● ● ● ● ● ◐     ○ meets cold caches, not timed
//!                                 ● timed, each step for itself
//!                                 ◐ read phase by phase, which costs as much as a small step
//! ```
//!
//! Blocks start at other steps in every pass, so that a step left out in one pass is timed in another. The
//! first step of a run is always timed, because it is cold in any program. The time of a step is the lower
//! median over the passes: an outlier in a single pass is attributed to the machine, a recurring one to the
//! solver. Mean, median and longest step of the run are computed from these times. A step that only one pass
//! timed, while others were timed again, is left out of them: nothing confirms its time.
//!
//! If the thread waited for a processor, the wait is subtracted from a long step, while a block of short
//! steps is left out. A setting that waited in every block keeps its steps without the waits but has no
//! blocks to compare, so it ties with everything.

use super::sample::{LoadSum, Sample, median, quantile};
use crate::engine::clock::{Phase, waited};
use crate::engine::world::{Divergence, Settings, StepError, World};
use crate::lab::error::Error;
use crate::lab::scenes::Scene;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::ops::Range;
use std::time::{Duration, Instant};

/// Maximum number of steps in a block.
const BLOCK: u32 = 10;

/// Minimum number of blocks in a pass, if it has enough steps.
const LEAST_BLOCKS: u32 = 12;

/// Minimum number of steps in a block, one of each kind.
const LEAST_BLOCK: u32 = 3;

/// In each pass, blocks start earlier than in the previous pass by a block length divided by this number.
const SHIFTS: u32 = 4;

/// Time of a step (ns) above which the wait is read around the next step. Reading it takes some microseconds.
const LONG_STEP: f64 = 2e5;

/// A block of short steps is left out if the thread waited for more than this fraction of it (1).
const WAITED: f64 = 0.01;

/// Lets `count` settings take turns for a number of rounds, with one call `turn(setting, round)` for each.
///
/// The order of a round is that of the previous one, rotated. Read from its start it goes 0, 1, −1, 2, −2, …,
/// and every second round is read backward (Williams 1949). The predecessor of a setting therefore changes,
/// too: a setting that fills the caches does not always run before the same one. The rotation is the golden
/// section of the count, so that after any number of rounds every setting has been early and late about
/// equally often.
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

/// Settings that are timed in turns.
pub struct Interleaved<'a> {
    /// Each setting with its scene: one scene for all, or variants of one.
    settings: Vec<(&'a Scene, Settings)>,
    steps: u32,
    /// Number of passes so far.
    passes: u32,
    timings: Vec<Timing>,
    random: Pcg64,
}

/// Measurements of one setting.
#[derive(Clone, Default)]
struct Timing {
    /// `[pass][step]` (ns); NaN for steps that were not timed.
    steps: Vec<Vec<f64>>,
    /// Steps of blocks that were left out (ns). The wait is subtracted from the longest step of each block.
    spare: Vec<f64>,
    /// `[pass][block]` (ns per step)
    blocks: Vec<Vec<f64>>,
    /// Number of passes.
    rounds: u32,
    /// Total time in which the thread waited, and in which the steps ran (ns).
    waited_and_ran: [f64; 2],
    phases: [Vec<f64>; Phase::ALL.len()],
    row_sweep: Vec<f64>,
    yardstick: Vec<f64>,
    load: LoadSum,
    hash: u64,
    failure: Option<Divergence>,
}

/// The steps of a pass, divided into blocks. All but the first and the last block have the same length.
fn blocks(steps: u32, pass: u32) -> Vec<Range<u32>> {
    let length = (steps / LEAST_BLOCKS).clamp(LEAST_BLOCK, BLOCK).min(steps).max(1);
    let first = length - pass * length.div_ceil(SHIFTS) % length;
    let ends = (0..).map(|i| first + i * length).take_while(|&end| end < steps).chain([steps]);
    let mut start = 0;
    let ranges = ends.map(|end| std::mem::replace(&mut start, end)..end);
    ranges.filter(|r| !r.is_empty()).collect()
}

impl<'a> Interleaved<'a> {
    /// For the first `steps` steps. `seed` decides the initial order.
    pub fn new(settings: Vec<(&'a Scene, Settings)>, steps: u32, seed: u64) -> Self {
        let timings = vec![Timing::default(); settings.len()];
        Interleaved { settings, steps, passes: 0, timings, random: Pcg64::seed_from_u64(seed) }
    }

    /// Runs the steps `passes` times with all settings. A world that diverges drops out.
    pub fn run(&mut self, passes: u32) -> Result<(), Error> {
        let mut names: Vec<usize> = (0..self.settings.len()).collect();
        for _ in 0..passes {
            // The position in the list must not decide the position in the order.
            names.shuffle(&mut self.random);
            let mut worlds: Vec<World> = Vec::new();
            for &i in &names {
                let (scene, settings) = &self.settings[i];
                worlds.push(scene.build(settings.clone())?);
            }
            let blocks = blocks(self.steps, self.passes);
            self.passes += 1;
            for timing in &mut self.timings {
                timing.rounds += 1;
                timing.steps.push(vec![f64::NAN; self.steps as usize]);
                timing.blocks.push(vec![f64::NAN; blocks.len()]);
            }
            let timings = &mut self.timings;
            let mut measured = Vec::new();
            let mut last = None;
            take_turns(names.len(), blocks.len(), |place, round| {
                if last != Some(round) {
                    last = Some(round);
                    measured.push(yardstick());
                }
                timings[names[place]].go(&mut worlds[place], blocks[round].clone(), round);
            });
            timings.iter_mut().for_each(|timing| timing.yardstick.extend(&measured));
            for (&i, world) in names.iter().zip(&worlds) {
                self.timings[i].hash = world.state_hash();
            }
        }
        Ok(())
    }

    /// Measurements of a setting, or the divergence that made it drop out.
    pub fn sample(&self, setting: usize) -> Result<Sample, Divergence> {
        self.timings[setting].sample()
    }
}

/// Times all settings of a scene in turns. A world that diverges drops out.
pub fn time_in_turns(
    scene: &Scene,
    settings: &[Settings],
    steps: u32,
    repeats: u32,
    seed: u64,
) -> Result<Vec<Result<Sample, Divergence>>, Error> {
    let settings: Vec<_> = settings.iter().map(|s| (scene, s.clone())).collect();
    let count = settings.len();
    let mut interleaved = Interleaved::new(settings, steps, seed);
    interleaved.run(repeats)?;
    Ok((0..count).map(|i| interleaved.sample(i)).collect())
}

impl Timing {
    /// Runs one block, number `round` of the current pass.
    fn go(&mut self, world: &mut World, steps: Range<u32>, round: usize) {
        // A shorter block has no cold step and no step with timed phases.
        let whole = steps.len() >= LEAST_BLOCK as usize;
        let before = waited();
        let (mut times, mut taken) = (Vec::with_capacity(steps.len()), 0.0);
        for step in steps.clone() {
            if self.failure.is_some() {
                return;
            }
            if whole && step + 1 == steps.end {
                self.clocked(world);
            } else {
                let (ns, pause) = self.timed(world, times.last().is_some_and(|t| *t > LONG_STEP));
                taken += pause;
                let cold = whole && step == steps.start && step > 0;
                times.push(if cold { f64::NAN } else { ns });
            }
        }
        let ran = times.iter().filter(|t| t.is_finite()).sum::<f64>();
        let waits = waited().zip(before).map_or(0.0, |(after, before)| nanos(after.saturating_sub(before)));
        self.waited_and_ran = [self.waited_and_ran[0] + waits, self.waited_and_ran[1] + ran];
        // The part of the wait that was not subtracted from a step occurred elsewhere in the block.
        if waits - taken > WAITED * ran {
            let mut kept: Vec<f64> = times.into_iter().filter(|t| t.is_finite()).collect();
            // The wait may have occurred in an untimed step: no time falls below the shortest.
            let shortest = kept.iter().copied().fold(f64::INFINITY, f64::min);
            if let Some(longest) = kept.iter_mut().max_by(|a, b| a.total_cmp(b)) {
                *longest = (*longest - (waits - taken)).max(shortest);
            }
            self.spare.extend(kept);
            return;
        }
        let timed: Vec<f64> = times.iter().copied().filter(|t| t.is_finite()).collect();
        if let (Some(pass), false) = (self.blocks.last_mut(), timed.is_empty()) {
            pass[round] = timed.iter().sum::<f64>() / timed.len() as f64;
        }
        if let Some(pass) = self.steps.last_mut() {
            pass[steps.start as usize..][..times.len()].copy_from_slice(&times);
        }
    }

    /// One step; its time and the wait that was subtracted from it (ns).
    fn timed(&mut self, world: &mut World, long: bool) -> (f64, f64) {
        let before = if long { waited() } else { None };
        let start = Instant::now();
        self.failure = world.step().err().and_then(StepError::divergence);
        let elapsed = start.elapsed();
        let pause = match before {
            Some(before) => waited().unwrap_or(before).saturating_sub(before).min(elapsed),
            None => Duration::ZERO,
        };
        self.load.add(world.counts());
        (nanos(elapsed - pause), nanos(pause))
    }

    /// One step with all phases timed.
    fn clocked(&mut self, world: &mut World) {
        world.settings.timed = true;
        self.failure = world.step().err().and_then(StepError::divergence);
        self.load.add(world.counts());
        for (times, &ns) in self.phases.iter_mut().zip(&world.timings().phase_ns) {
            times.push(ns as f64);
        }
        if world.counts().row_updates > 0 {
            self.row_sweep.push(world.timings().sweep_ns() as f64 / world.counts().row_updates as f64);
        }
        world.settings.timed = false;
    }

    fn sample(&self) -> Result<Sample, Divergence> {
        if let Some(divergence) = self.failure {
            return Err(divergence);
        }
        let count = self.steps.first().map_or(0, Vec::len);
        let repeats = |step: usize| -> Vec<f64> {
            self.steps.iter().map(|pass| pass[step]).filter(|t| !t.is_nan()).collect()
        };
        let mut times: Vec<Vec<f64>> = (0..count).map(repeats).filter(|t| !t.is_empty()).collect();
        if times.is_empty() {
            times = self.spare.iter().map(|&t| vec![t]).collect();
        }
        let repeated = times.iter().any(|t| t.len() > 1);
        times.retain(|t| t.len() > 1 || !repeated);
        let medians: Vec<f64> = times.iter_mut().map(|t| lower_median(t)).collect();
        let middle = median(&medians);
        let deviations: Vec<f64> = times
            .iter()
            .zip(&medians)
            .flat_map(|(t, &own)| t.iter().map(move |t| (t - if repeated { own } else { middle }).abs()))
            .collect();
        let spread_ns = median(&deviations);
        let [waits, ran] = self.waited_and_ran;
        Ok(Sample {
            mean_ns: medians.iter().sum::<f64>() / medians.len().max(1) as f64,
            median_ns: middle,
            worst_ns: medians.iter().copied().fold(0.0, f64::max),
            rounds: self.rounds,
            waited: if waits > 0.0 { waits / (waits + ran) } else { 0.0 },
            noise: if middle > 0.0 { spread_ns / middle } else { 0.0 },
            spread_ns,
            quartiles_ns: [quantile(&medians, 0.25), quantile(&medians, 0.75)],
            phase_ns: self.phases.each_ref().map(|times| median(times)),
            row_sweep_ns: median(&self.row_sweep),
            yardstick_ns: median(&self.yardstick),
            load: self.load.average(),
            blocks_ns: self.blocks.clone(),
            hash: self.hash,
        })
    }
}

/// The smaller of the two middle values of a list that is not empty, so that of two values an outlier is not
/// taken.
fn lower_median(values: &mut [f64]) -> f64 {
    let middle = (values.len() - 1) / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Time of a chain of dependent multiply-adds (ns), about 10 µs. No optimization can shorten it.
fn yardstick() -> f64 {
    const LINKS: u32 = 4000;
    let start = Instant::now();
    let mut x = std::hint::black_box(1.0_f32);
    for _ in 0..LINKS {
        x = x * 0.999 + 0.001;
    }
    std::hint::black_box(x);
    nanos(start.elapsed())
}

fn nanos(duration: Duration) -> f64 {
    duration.as_nanos() as f64
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A sample with these blocks (ns per step), `[pass][block]`.
    pub fn sample(blocks: Vec<Vec<f64>>) -> Sample {
        let rounds = blocks.len() as u32;
        Timing { steps: blocks.clone(), blocks, rounds, ..Timing::default() }.sample().unwrap()
    }

    #[test]
    fn the_spread_is_of_repeats_and_not_of_blocks() {
        // Blocks cost 10, 20 and 30. One pass of three was interrupted, and one was not timed.
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
    fn blocks_cover_every_step_and_begin_elsewhere_in_every_pass() {
        assert_eq!((blocks(200, 0).len(), blocks(40, 0)[1].clone()), (20, 3..6));
        assert_eq!((blocks(200, 1)[0].clone(), blocks(200, 1)[1].clone()), (0..7, 7..17));
        assert_eq!([blocks(2, 0).len(), blocks(1, 0).len(), blocks(0, 0).len()], [1, 1, 0]);
        for (steps, pass) in (0..300).flat_map(|steps| (0..5).map(move |pass| (steps, pass))) {
            let covered: Vec<u32> = blocks(steps, pass).into_iter().flatten().collect();
            assert_eq!(covered, (0..steps).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_spike_that_comes_back_is_the_solvers_and_one_that_does_not_the_machines() {
        let mut passes = vec![vec![10.0; 20]; 3];
        passes[0][7] = 900.0;
        let quiet = sample(passes.clone());
        assert_eq!((quiet.mean_ns, quiet.median_ns, quiet.worst_ns), (10.0, 10.0, 10.0));
        passes.iter_mut().for_each(|pass| pass[3] = 210.0);
        let spiky = sample(passes);
        assert_eq!(
            (spiky.mean_ns, spiky.median_ns, spiky.worst_ns, spiky.spikes()),
            (20.0, 10.0, 210.0, 2.0)
        );
        // A step that was left out of a pass has two times, and one that was left out of two passes has one.
        let mut partly = vec![vec![10.0; 20]; 3];
        (partly[0][7], partly[1][7]) = (900.0, f64::NAN);
        (partly[0][8], partly[1][8], partly[2][8]) = (900.0, f64::NAN, f64::NAN);
        assert_eq!((sample(partly.clone()).mean_ns, sample(partly).worst_ns), (10.0, 10.0));
        // A single pass cannot tell spikes of the solver from those of the machine.
        let mut once = vec![10.0; 20];
        once[3] = 900.0;
        assert_eq!(sample(vec![once]).spikes(), 1.0);
    }

    #[test]
    fn a_setting_that_always_waited_has_a_time_and_ties() {
        let waited = Timing {
            steps: vec![vec![f64::NAN; 4]],
            blocks: vec![vec![f64::NAN; 2]],
            spare: vec![10.0, 30.0, 20.0],
            ..Timing::default()
        };
        let (waited, quiet) = (waited.sample().unwrap(), sample(vec![vec![1.0; 20]]));
        assert_eq!((waited.median_ns, waited.mean_ns, waited.worst_ns), (20.0, 20.0, 30.0));
        assert!(crate::lab::study::compare::compare(&waited, &quiet).is_eq());
    }

    #[test]
    fn three_passes_time_every_step() {
        let scene = crate::lab::scenes::load("stack:2").unwrap().scene;
        let settings = Settings::new(crate::engine::solvers::find("pgs").unwrap());
        let mut turns = Interleaved::new(vec![(&scene, settings)], 60, 1);
        turns.run(3).unwrap();
        let timing = &turns.timings[0];
        for step in 0..60 {
            // Blocks in which the thread waited are left out entirely.
            let whole = timing.blocks.iter().flatten().all(|t| t.is_finite());
            assert!(!whole || timing.steps.iter().any(|pass| pass[step].is_finite()), "{step}");
        }
        let sample = turns.sample(0).unwrap();
        assert!(sample.worst_ns >= sample.mean_ns && sample.rounds == 3);
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
            // The mean position of every setting is the middle, to a twentieth of the count.
            for own in &places {
                let mean = own.iter().enumerate().map(|(i, n)| (i * n) as f64).sum::<f64>() / rounds as f64;
                assert!(
                    (mean - 0.5 * (count - 1) as f64).abs() < 0.05 * count as f64 + 1e-9,
                    "{count} {mean}"
                );
            }
            // The predecessors of setting 0: many different ones.
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
