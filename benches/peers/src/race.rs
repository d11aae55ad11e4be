//! The race: all contenders in one process, block by block, in rotated order.
//!
//! A block is [`BLOCK`] steps of one contender. Its first step finds cold caches and is not counted, except
//! the first step of a run, which is as cold in any program. Contenders take turns, so a slow spell of the
//! machine affects all of them alike. Blocks begin at other steps in every repeat, so a step that is skipped
//! in one repeat is timed in another. The time of a step is the median over the repeats. A ratio is of whole
//! runs: the sum over the steps that were timed for both contenders. It includes spikes, and the longest step
//! is printed next to it. The last second of the first run is not timed: it is used for the check.

use crate::check::{Checker, Errors, WINDOW};
use crate::engine::{Contender, Engine, Maker};
use simpulse::engine::clock::waited;
use simpulse::engine::lanes::native_width;
use simpulse::lab::scenes::{self, Scene};
use simpulse::lab::study::sample::quantile;
use std::ops::Range;
use std::time::Instant;

/// Steps of a block.
const BLOCK: u32 = 10;

/// Blocks of a repeat begin this many steps before those of the previous repeat.
const SHIFT: u32 = 3;

/// A block is dropped if the thread waited for a processor for more than this fraction of it (1).
const WAITED: f64 = 0.01;

/// Times of the steps of a run (ms).
#[derive(Clone, Copy, Debug)]
pub struct Steps {
    /// Mean.
    pub mean: f64,
    /// Quartiles.
    pub quartiles: [f64; 3],
    /// Longest step.
    pub longest: f64,
}

impl Steps {
    /// From the time of each step; NaN where a step was not timed.
    fn of(steps: &[f64]) -> Option<Self> {
        let timed: Vec<f64> = steps.iter().copied().filter(|ms| ms.is_finite()).collect();
        let mean = timed.iter().sum::<f64>() / timed.len() as f64;
        Some(Steps { mean, quartiles: quartiles(&timed)?, longest: quantile(&timed, 1.0) })
    }
}

/// Quartiles of a sample; `None` if it is empty.
fn quartiles(sample: &[f64]) -> Option<[f64; 3]> {
    (!sample.is_empty()).then(|| [0.25, 0.5, 0.75].map(|p| quantile(sample, p)))
}

/// Time of one whole run relative to another, over the steps that were timed in both.
fn whole(one: &[f64], other: &[f64]) -> Option<f64> {
    let both = one.iter().zip(other).filter(|(a, b)| a.is_finite() && b.is_finite());
    let [a, b] = both.fold([0.0; 2], |[x, y], (a, b)| [x + a, y + b]);
    (b > 0.0).then(|| a / b)
}

/// Splits the steps of a repeat into blocks.
fn blocks(steps: u32, repeat: u32) -> impl Iterator<Item = Range<u32>> {
    let first = BLOCK - repeat * SHIFT % BLOCK;
    let starts = std::iter::once(0).chain((0..).map(move |i| first + i * BLOCK));
    starts
        .take_while(move |&start| start < steps)
        .map(move |start| start..if start < first { first } else { start + BLOCK }.min(steps))
}

/// Result of one contender in one scene.
pub struct Outcome {
    /// The contender.
    pub contender: Contender,
    /// Bodies and contact points in the engine at the end.
    pub counts: (usize, usize),
    /// Errors of the run, unless it did not finish.
    pub errors: Option<Errors>,
    /// Why the check failed. If it did, there are no times.
    pub failed: Option<String>,
    /// Times of the steps (ms).
    pub step: Option<Steps>,
    /// Fraction of the time in which the thread waited for a processor (1); not part of any other time.
    pub waited: f64,
    /// Time of the whole run relative to `soft_step` at the width of the CPU and with as many substeps.
    pub ratio: Option<f64>,
}

/// A contender in the race.
struct Runner {
    contender: Contender,
    engine: Box<dyn Engine>,
    counts: (usize, usize),
    errors: Option<Errors>,
    failed: Option<String>,
    /// Times (ms), `[repeat][step]`; NaN where a step was not timed.
    steps: Vec<Vec<f64>>,
    /// Time in which the thread waited, and time in which blocks ran (ms).
    waited_and_ran: [f64; 2],
}

/// Runs a scene of the catalog or a `.json` file for `steps` steps, `repeats` times, with `seed` if it has
/// one. With `stands`, the check fails if anything falls. Errors: an unknown scene, or one that an engine
/// does not support.
pub fn race(
    name: &str,
    seed: Option<u64>,
    steps: u32,
    repeats: u32,
    stands: bool,
    contenders: &[Contender],
) -> Result<Vec<Outcome>, String> {
    let load = || match seed {
        Some(seed) => scenes::load_with_seed(name, seed),
        None if name.ends_with(".json") => Scene::from_file(name).and_then(scenes::expecting),
        None => scenes::load(name),
    };
    let load = || load().map_err(|e| e.to_string());
    let scene = load()?.scene;
    let rounds = steps.saturating_sub(WINDOW) / BLOCK;
    let mut runners = Vec::new();
    for &contender in contenders {
        let engine = contender.build(&scene).map_err(|e| format!("{}: {e}", contender.name()))?;
        runners.push(Runner {
            contender,
            engine,
            counts: (0, 0),
            errors: None,
            failed: None,
            steps: Vec::new(),
            waited_and_ran: [0.0; 2],
        });
    }
    for repeat in 0..repeats {
        for runner in &mut runners {
            if repeat > 0 {
                runner.engine = runner.contender.build(&scene)?;
            }
            runner.steps.push(vec![f64::NAN; steps as usize]);
        }
        let timed = if repeat == 0 { rounds * BLOCK } else { steps };
        for (round, block) in (0..).zip(blocks(timed, repeat)) {
            for turn in 0..runners.len() {
                let place = (turn + (round + repeat) as usize) % runners.len();
                runners[place].block(block.clone());
            }
        }
        // Runs are deterministic, so one check is enough. It comes before any time is used.
        if repeat == 0 {
            for runner in &mut runners {
                runner.check(Checker::new(load()?)?, steps - rounds * BLOCK, stands);
            }
        }
    }
    Ok(runners.iter().map(|runner| runner.outcome(&runners)).collect())
}

impl Runner {
    /// The result, relative to `soft_step` at the width of the CPU and at the same settings, with default options.
    fn outcome(&self, all: &[Runner]) -> Outcome {
        let timed = self.failed.is_none();
        let maker = Maker::Simpulse(native_width(), Default::default());
        let rival = Contender { maker, recycling: true, ..self.contender };
        let rival = all.iter().find(|r| r.contender == rival && r.failed.is_none()).filter(|_| timed);
        let [waits, ran] = self.waited_and_ran;
        Outcome {
            contender: self.contender,
            counts: self.counts,
            step: Steps::of(&self.medians()).filter(|_| timed),
            waited: waits / (waits + ran).max(1e-9),
            ratio: rival.and_then(|rival| whole(&self.medians(), &rival.medians())),
            errors: self.errors.clone(),
            failed: self.failed.clone(),
        }
    }

    /// Median over the repeats for each step; NaN where no repeat timed it.
    fn medians(&self) -> Vec<f64> {
        let count = self.steps.first().map_or(0, Vec::len);
        let median = |step: usize| {
            let timed = self.steps.iter().map(|run| run[step]).filter(|ms| ms.is_finite());
            quartiles(&timed.collect::<Vec<_>>()).map_or(f64::NAN, |q| q[1])
        };
        (0..count).map(median).collect()
    }

    /// Runs the steps of a block of the last repeat.
    fn block(&mut self, steps: Range<u32>) {
        if self.failed.is_some() {
            return;
        }
        let before = waited();
        let mut times = Vec::with_capacity(steps.len());
        for _ in steps.clone() {
            let start = Instant::now();
            let result = self.engine.step();
            times.push(start.elapsed().as_secs_f64() * 1e3);
            if let Err(message) = result {
                self.failed = Some(message);
                return;
            }
        }
        let ran: f64 = times.iter().sum();
        let waits = waited().zip(before).map_or(0.0, |(after, before)| 1e3 * (after - before).as_secs_f64());
        self.waited_and_ran = [self.waited_and_ran[0] + waits, self.waited_and_ran[1] + ran];
        if waits > WAITED * ran {
            return;
        }
        // Another contender ran before, so the first step found cold caches. The first step of the run is
        // kept.
        if steps.start > 0 {
            times[0] = f64::NAN;
        }
        if let Some(run) = self.steps.last_mut() {
            run[steps.start as usize..][..times.len()].copy_from_slice(&times);
        }
    }

    /// Runs the last `left` steps and checks the last second.
    fn check(&mut self, mut checker: Checker, left: u32, stands: bool) {
        let mut observe = |left: u32| match self.engine.step() {
            Ok(()) if left < WINDOW => checker.observe(&*self.engine, left),
            stepped => stepped,
        };
        if self.failed.is_none() {
            self.failed = (0..left).rev().try_for_each(&mut observe).err();
            if self.failed.is_none() {
                let errors = checker.finish();
                self.failed = errors.verdict(stands).err();
                self.errors = Some(errors);
            }
        }
        self.counts = (self.engine.bodies(), self.engine.points());
    }
}
