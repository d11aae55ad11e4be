//! The race: all contenders in one process, block by block, in rotated order.
//!
//! A block is [`BLOCK`] steps of one contender; its first step meets cold caches and is not
//! counted. Contenders take turns, so that a machine that slows down slows all of them, and each
//! ratio is between blocks of the same round. The last second of every run is not timed: it
//! belongs to the check.

use crate::box2d::Box2d;
use crate::check::{Checker, Errors, WINDOW};
use crate::engine::{Contender, Engine, Maker, Stage};
use crate::ours::Simpulse;
use crate::rapier::Rapier;
use simpulse::engine::lanes::LaneWidth;
use simpulse::lab::scenes::{self, Scene};
use std::time::Instant;

/// The scene in the contender's engine. Errors: what the engine cannot hold.
pub fn build(contender: &Contender, scene: &Scene) -> Result<Box<dyn Engine>, String> {
    Ok(match contender.maker {
        Maker::Box2d => Box::new(Box2d::new(scene, contender)?),
        Maker::Rapier => Box::new(Rapier::new(scene, contender)?),
        Maker::Simpulse(width, pairs) => Box::new(Simpulse::soft_step(scene, contender, width, pairs)?),
        Maker::Solver(name) => Box::new(Simpulse::of(scene, name, contender)?),
    })
}

/// Steps of a block.
const BLOCK: u32 = 10;

/// In every fourth round the clocks inside the steps run, and whole steps are not counted.
const CLOCKED_ROUND: u32 = 4;

/// Quartiles of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Quartiles {
    /// A quarter is below.
    pub low: f64,
    /// Half is below.
    pub median: f64,
    /// A quarter is above.
    pub high: f64,
}

impl Quartiles {
    /// Of a sample that has a value.
    pub fn of(mut sample: Vec<f64>) -> Option<Self> {
        sample.sort_by(f64::total_cmp);
        let at = |share: f64| sample.get((share * (sample.len() - 1) as f64).round() as usize).copied();
        if sample.is_empty() {
            return None;
        }
        Some(Quartiles { low: at(0.25)?, median: at(0.5)?, high: at(0.75)? })
    }
}

/// What one contender did in one scene.
pub struct Outcome {
    /// Who.
    pub contender: Contender,
    /// Bodies and contact points in the engine at the end.
    pub counts: (usize, usize),
    /// Its errors, unless it did not come to its end.
    pub errors: Option<Errors>,
    /// What failed, if the check did. Then there are no times.
    pub failed: Option<String>,
    /// ms per step.
    pub step: Option<Quartiles>,
    /// ms per step and stage with the clocks on, and of the whole step.
    pub stages: Option<Breakdown>,
    /// Time of a step against simpulse's widest lanes at as many substeps.
    pub ratio: Option<Quartiles>,
    /// The same of warm start, solve, relax and integrate alone.
    pub stages_ratio: Option<Quartiles>,
}

/// Times of steps taken apart (ms), all of the same steps, so that they add up.
#[derive(Clone, Copy, Debug)]
pub struct Breakdown {
    /// By [`Stage`]; none where the engine does not tell.
    pub stages: [Option<f64>; Stage::ALL.len()],
    /// Of the whole step.
    pub step: f64,
}

impl Breakdown {
    /// Mean of a sample; none of an empty one.
    fn mean(sample: &[Self]) -> Option<Self> {
        let count = sample.len() as f64;
        let mean =
            |of: &dyn Fn(&Self) -> Option<f64>| Some(sample.iter().map(of).sum::<Option<f64>>()? / count);
        let stages = std::array::from_fn(|k| mean(&|b| b.stages[k]));
        Some(Breakdown { stages, step: mean(&|b| Some(b.step)).filter(|_| count > 0.0)? })
    }

    /// Mean of the faster half of a block: what interrupted a step is no stage of it.
    fn of_block(mut sample: Vec<Self>) -> Option<Self> {
        sample.sort_by(|a, b| a.step.total_cmp(&b.step));
        Self::mean(&sample[..sample.len().div_ceil(2)])
    }
}

/// A contender in the race.
struct Runner {
    contender: Contender,
    engine: Box<dyn Engine>,
    failed: Option<String>,
    /// ms per step, the median of each block; all repeats.
    blocks: Vec<f64>,
    /// Of each clocked block.
    clocked: Vec<Breakdown>,
}

/// Runs a scene of the catalog for `steps` steps, `repeats` times, with `seed` where it has one; `stands` tells the check that
/// nothing may fall. Errors: an unknown scene, or one that an engine cannot hold.
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
        None => scenes::load(name),
    };
    let load = || load().map_err(|e| e.to_string());
    let scene = load()?.scene;
    let rounds = steps.saturating_sub(WINDOW) / BLOCK;
    let mut runners = Vec::new();
    for &contender in contenders {
        let engine = build(&contender, &scene).map_err(|e| format!("{}: {e}", contender.name()))?;
        runners.push(Runner { contender, engine, failed: None, blocks: Vec::new(), clocked: Vec::new() });
    }
    let mut errors = Vec::new();
    let mut counts = Vec::new();
    for repeat in 0..repeats {
        if repeat > 0 {
            for runner in &mut runners {
                runner.engine = build(&runner.contender, &scene)?;
            }
        }
        for round in 0..rounds {
            for turn in 0..runners.len() {
                let place = (turn + (round + repeat) as usize) % runners.len();
                runners[place].block(round);
            }
        }
        // Runs repeat to the bit, so one check is enough; it comes before any time is looked at.
        if repeat == 0 {
            for runner in &mut runners {
                errors.push(runner.check(Checker::new(load()?)?, steps - rounds * BLOCK, stands));
                counts.push((runner.engine.bodies(), runner.engine.points()));
            }
        }
    }
    let rivals: Vec<Option<usize>> = contenders.iter().map(|c| rival(contenders, c)).collect();
    let outcome = |(i, (errors, counts)): (usize, (Option<Errors>, (usize, usize)))| {
        let runner = &runners[i];
        let timed = runner.failed.is_none();
        let against = |of: fn(&Runner) -> Vec<f64>| {
            let rival = &runners[rivals[i]?];
            if rival.failed.is_some() || !timed {
                return None;
            }
            Quartiles::of(of(runner).iter().zip(of(rival)).map(|(a, b)| a / b).collect())
        };
        let stages = |r: &Runner| r.clocked.iter().filter_map(|b| b.stages[Stage::Stages as usize]).collect();
        Outcome {
            contender: runner.contender,
            counts,
            step: Quartiles::of(runner.blocks.clone()).filter(|_| timed),
            stages: Breakdown::mean(&runner.clocked).filter(|_| timed),
            ratio: against(|r| r.blocks.clone()),
            stages_ratio: against(stages),
            errors,
            failed: runner.failed.clone(),
        }
    };
    Ok(errors.into_iter().zip(counts).enumerate().map(outcome).collect())
}

/// Simpulse's widest lanes at the same settings, without options.
fn rival(contenders: &[Contender], of: &Contender) -> Option<usize> {
    let maker = Maker::Simpulse(LaneWidth::W16, Default::default());
    contenders.iter().position(|c| *c == Contender { maker, recycling: true, ..*of })
}

impl Runner {
    fn block(&mut self, round: u32) {
        if self.failed.is_some() {
            return;
        }
        let clocked = round % CLOCKED_ROUND == CLOCKED_ROUND - 1;
        self.engine.set_timed(clocked);
        let mut times = Vec::with_capacity(BLOCK as usize);
        let mut clocked_steps = Vec::new();
        for _ in 0..BLOCK {
            let start = Instant::now();
            let result = self.engine.step();
            times.push(start.elapsed().as_secs_f64() * 1e3);
            if let Err(message) = result {
                self.failed = Some(message);
                return;
            }
            if clocked {
                clocked_steps
                    .extend(times.last().map(|&step| Breakdown { stages: self.engine.stages(), step }));
            }
        }
        times.remove(0);
        if clocked {
            clocked_steps.remove(0);
            self.clocked.extend(Breakdown::of_block(clocked_steps));
        } else if round > 0 {
            // The first block begins with the step that finds all contacts.
            self.blocks.extend(Quartiles::of(times).map(|q| q.median));
        }
    }

    /// The last `left` steps, those of the last second under the checker's eyes; its errors,
    /// unless the engine diverges.
    fn check(&mut self, mut checker: Checker, left: u32, stands: bool) -> Option<Errors> {
        if self.failed.is_some() {
            return None;
        }
        self.engine.set_timed(false);
        for left in (0..left).rev() {
            let seen = match self.engine.step() {
                Ok(()) if left < WINDOW => checker.observe(&*self.engine, left),
                stepped => stepped,
            };
            if let Err(message) = seen {
                self.failed = Some(message);
                return None;
            }
        }
        let errors = checker.finish();
        self.failed = errors.verdict(stands).err();
        Some(errors)
    }
}
