//! The cost of a contact as scenes grow: which phases stay flat, which have a step at the end of a cache, and
//! which grow.
//!
//! Scenes of all sizes are frozen and timed interleaved, so a slow spell of the machine affects all of them
//! alike. A turn is a few whole steps on the same state, each with a new search for pairs. The first step of
//! a turn finds cold caches and is not timed.

use super::ceilings::ReadCurve;
use super::waiting::{self, waited};
use crate::engine::clock::{Phase, Timings};
use crate::engine::world::{Memory, StepCounts, World};
use crate::lab::metrics::Errors;
use crate::lab::study::sample::median;
use std::time::{Duration, Instant};

/// A world of one size.
pub struct GrowthWorld {
    /// Name of the scene with its size.
    pub scene: String,
    /// The settled world.
    pub world: World,
    /// Errors of its last settling steps.
    pub errors: Option<Errors>,
}

/// Times of repeated steps (ns).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepTime {
    /// Median.
    pub ns: f64,
    /// Mean.
    pub mean_ns: f64,
    /// Longest.
    pub longest_ns: f64,
    /// Median deviation from the median.
    pub spread_ns: f64,
}

impl StepTime {
    fn of(samples: &[f64]) -> StepTime {
        let ns = median(samples);
        let deviations: Vec<f64> = samples.iter().map(|t| (t - ns).abs()).collect();
        let mean_ns = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
        let longest_ns = samples.iter().copied().fold(0.0, f64::max);
        StepTime { ns, mean_ns, longest_ns, spread_ns: median(&deviations) }
    }
}

/// Measurements of one size.
#[derive(Clone, Debug)]
pub struct SizeRow {
    /// Name of the scene with its size.
    pub scene: String,
    /// Number of bodies.
    pub bodies: usize,
    /// Counts of the repeated step.
    pub counts: StepCounts,
    /// Time of the whole step.
    pub step: StepTime,
    /// Time of each phase, in the order of [`Phase::ALL`].
    pub phases: [StepTime; Phase::ALL.len()],
    /// Memory of the world.
    pub memory: Memory,
    /// Errors of the last settling steps.
    pub errors: Option<Errors>,
}

impl SizeRow {
    /// Time per contact (ns).
    pub fn per_contact(&self, time: StepTime) -> f64 {
        time.ns / self.counts.contacts.max(1) as f64
    }

    fn phase(&self, phase: Phase) -> StepTime {
        self.phases[phase as usize]
    }
}

/// Time of one world in one round, without its first step.
const TURN: Duration = Duration::from_millis(40);
/// Time to measure one working-set size in one round.
const READ: Duration = Duration::from_millis(1);
/// In steps longer than this (ns), pauses are measured and subtracted, at negligible cost. Shorter steps
/// mostly have no pause; those that have one are dropped.
const LONG_NS: u64 = 4_000_000;
/// A step that waited for a processor for more than this fraction of its time is dropped, if enough others
/// remain.
const PAUSE: f64 = 0.01;
/// Minimum number of steps that are kept.
const FEWEST: usize = 3;
/// Maximum number of steps in a turn: the caches are warm long before.
const STEPS: usize = 400;

/// Result of the measurement.
pub struct Measurement {
    /// One row per world, in the given order.
    pub rows: Vec<SizeRow>,
    /// Read bandwidth of memory, measured in the same rounds.
    pub memory: ReadCurve,
    /// Fraction of the time in which the thread waited for a processor, if known.
    pub waiting: Option<f64>,
}

/// A step, and the fraction of its time in which the thread waited.
type StepSample = (Timings, f64);

/// Times all worlds in turn for `repeats` rounds, and measures read bandwidth in each round.
pub fn measure(entries: &mut [GrowthWorld], repeats: u32, progress: &dyn Fn(u32)) -> Measurement {
    let largest = entries.iter().map(|e| e.world.memory().used()).max().unwrap_or(0);
    let mut memory = ReadCurve::new(largest);
    let mut samples: Vec<Vec<StepSample>> = vec![Vec::new(); entries.len()];
    let (start, before) = (Instant::now(), waited());
    for round in 0..repeats {
        progress(round);
        memory.sample(READ);
        for (entry, samples) in entries.iter_mut().zip(&mut samples) {
            turn(&mut entry.world, samples);
        }
    }
    let waiting = waiting::share(before, start.elapsed());
    let rows = entries.iter().zip(samples).map(|(entry, samples)| row(entry, samples)).collect();
    Measurement { rows, memory, waiting }
}

fn row(entry: &GrowthWorld, mut samples: Vec<StepSample>) -> SizeRow {
    // Keep the steps without a pause, or at least those with the shortest ones.
    samples.sort_by(|a, b| a.1.total_cmp(&b.1));
    let whole = samples.iter().take_while(|s| s.1 <= PAUSE).count();
    samples.truncate(whole.max(FEWEST));
    let time = |of: &dyn Fn(&Timings) -> u64| {
        StepTime::of(&samples.iter().map(|(timings, _)| of(timings) as f64).collect::<Vec<_>>())
    };
    SizeRow {
        scene: entry.scene.clone(),
        bodies: entry.world.bodies.len(),
        counts: entry.world.counts,
        step: time(&|t| t.step_ns),
        phases: std::array::from_fn(|k| time(&|t| t.phase_ns[k])),
        memory: entry.world.memory(),
        errors: entry.errors,
    }
}

/// One turn: a step on cold caches that is not timed, then as many steps as fit.
fn turn(world: &mut World, samples: &mut Vec<StepSample>) {
    let mut frozen = world.hold();
    let net = frozen.step(false).step_ns > LONG_NS;
    let (start, mut steps) = (Instant::now(), 0);
    while steps == 0 || (start.elapsed() < TURN && steps < STEPS) {
        let before = waited();
        let begin = Instant::now();
        let timings = frozen.step(net);
        let share = waiting::share(before, begin.elapsed()).unwrap_or(0.0);
        samples.push((timings, if net { 0.0 } else { share }));
        steps += 1;
    }
}

/// The size at which a scene has `target` contacts, from two sizes and their numbers of contacts, if contacts
/// grow as a power of the size. `None` if they do not grow.
pub fn size_for(target: f64, [small, large]: [(f64, f64); 2]) -> Option<f64> {
    let power = (large.1 / small.1).ln() / (large.0 / small.0).ln();
    let size = large.0 * (target / large.1).powf(1.0 / power);
    (power > 0.1 && size.is_finite()).then_some(size)
}

/// How the cost per contact changed from one size to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// It stayed or fell.
    Flat,
    /// It rose by no more than reading the phase's working set from memory became slower.
    Cache,
    /// It rose by no more than that times the logarithm.
    Logarithm,
    /// It rose by more than n log n and memory explain.
    Faster,
}

/// The change from one size to the next.
#[derive(Clone, Copy, Debug)]
pub struct Growth {
    /// Number of contacts before and after.
    pub contacts: [usize; 2],
    /// Cost per contact, after ÷ before.
    pub ratio: f64,
    /// Read bandwidth of memory, before ÷ after.
    pub memory: f64,
    /// Kind of the change.
    pub change: Change,
}

/// Tolerance of a ratio for reasons other than growth: on a machine with other guests, ratios of equal worlds
/// differ by a tenth.
const TOLERANCE: f64 = 1.15;

/// Classifies a ratio of costs per contact, given the numbers of contacts, the relative spread of the times
/// and the slowdown of memory.
///
/// The cost per contact of an n log n method grows by ln n₂/ln n₁, and that of streaming by the slowdown of
/// memory. Growth is faster if it exceeds the product of both with the tolerance and twice the spread.
pub fn judge(contacts: [usize; 2], ratio: f64, spread: f64, memory: f64) -> Growth {
    let [before, after] = contacts.map(|n| (n.max(2) as f64).ln());
    let room = TOLERANCE + 2.0 * spread;
    // NaN, if nothing was measured, counts as no slowdown.
    let (memory, logarithm) = (memory.max(1.0), (after / before).max(1.0));
    let change = match ratio {
        r if r <= room => Change::Flat,
        r if r <= room * memory => Change::Cache,
        r if r <= room * memory * logarithm => Change::Logarithm,
        _ => Change::Faster,
    };
    Growth { contacts, ratio, memory, change }
}

/// Growth of one phase over all sizes.
#[derive(Clone, Debug)]
pub struct GrowthVerdict {
    /// The phase; `None` for the whole step.
    pub phase: Option<Phase>,
    /// p in time ~ contactsᵖ, least squares on logarithms.
    pub exponent: f64,
    /// Smallest and largest cost per contact (ns).
    pub range: [f64; 2],
    /// Changes from each size to the next.
    pub steps: Vec<Growth>,
    /// Change from the smallest size to the largest, which reveals many small rises.
    pub whole: Growth,
}

/// Phases that cost less than this are not judged (ns per contact).
const NEGLIGIBLE: f64 = 0.5;

/// Judges every phase and the whole step; rows are in ascending order of contacts.
pub fn verdicts(rows: &[SizeRow], memory: &ReadCurve) -> Vec<GrowthVerdict> {
    let kinds = std::iter::once(None).chain(Phase::ALL.into_iter().map(Some));
    let mut verdicts = Vec::new();
    for phase in kinds {
        let time = |row: &SizeRow| phase.map_or(row.step, |p| row.phase(p));
        let costs: Vec<f64> = rows.iter().map(|r| r.per_contact(time(r))).collect();
        let range =
            [costs.iter().copied().fold(f64::INFINITY, f64::min), costs.iter().copied().fold(0.0, f64::max)];
        if costs.len() < 2 || range[1] < NEGLIGIBLE {
            continue;
        }
        let speeds: Vec<f64> = rows.iter().map(|r| memory.at(working_set(&r.memory, phase))).collect();
        let between = |i: usize, j: usize| {
            let spread = |r: &SizeRow| time(r).spread_ns / time(r).ns.max(1.0);
            judge(
                [rows[i].counts.contacts, rows[j].counts.contacts],
                costs[j] / costs[i],
                spread(&rows[i]) + spread(&rows[j]),
                speeds[i] / speeds[j],
            )
        };
        let steps = (1..rows.len()).map(|j| between(j - 1, j)).collect();
        let whole = between(0, rows.len() - 1);
        let points: Vec<[f64; 2]> =
            rows.iter().map(|r| [r.counts.contacts as f64, time(r).ns].map(|x| x.max(1.0).ln())).collect();
        verdicts.push(GrowthVerdict { phase, exponent: slope(&points), range, steps, whole });
    }
    verdicts
}

/// Bytes that a phase accesses, from the sizes of its arrays.
fn working_set(memory: &Memory, phase: Option<Phase>) -> usize {
    let names: &[&str] = match phase {
        None => return memory.used(),
        Some(Phase::Pairs) => &["shapes", "proxies", "broad phase", "candidates"],
        Some(Phase::Collide) => &["candidates", "contacts", "shapes"],
        Some(Phase::Color) => &["contacts", "coloring"],
        Some(Phase::Prepare) => &["bodies", "contacts", "records", "rows"],
        Some(Phase::Integrate) => &["rows"],
        Some(Phase::Store) => &["bodies", "contacts", "records", "rows"],
        Some(_) => &["records", "rows"],
    };
    memory.components.iter().filter(|c| names.contains(&c.name)).map(|c| c.used).sum()
}

/// Slope of the least-squares line.
fn slope(points: &[[f64; 2]]) -> f64 {
    let count = points.len().max(1) as f64;
    let mean = [0, 1].map(|k| points.iter().map(|p| p[k]).sum::<f64>() / count);
    let sum = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>();
    sum(&|p| (p[0] - mean[0]) * (p[1] - mean[1])) / sum(&|p| (p[0] - mean[0]).powi(2)).max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_follow_the_power_of_their_contacts() {
        // 1.5 N² for a pyramid, N for a column.
        let size = size_for(15_000.0, [(10.0, 150.0), (20.0, 600.0)]).unwrap();
        assert!((size - 100.0).abs() < 1e-9, "{size}");
        assert!((size_for(500.0, [(10.0, 10.0), (20.0, 20.0)]).unwrap() - 500.0).abs() < 1e-9);
        assert_eq!(size_for(500.0, [(10.0, 10.0), (20.0, 10.0)]), None);
        assert_eq!(size_for(500.0, [(10.0, 0.0), (20.0, 0.0)]), None);
    }

    #[test]
    fn growth_is_told_from_caches_and_logarithms() {
        let judge = |ratio, memory| judge([1000, 1_000_000], ratio, 0.0, memory).change;
        // ln 10⁶/ln 10³ = 2.
        assert_eq!(judge(0.5, 1.0), Change::Flat);
        assert_eq!(judge(1.1, 1.0), Change::Flat);
        assert_eq!(judge(2.2, 1.0), Change::Logarithm);
        assert_eq!(judge(2.4, 1.0), Change::Faster);
        assert_eq!(judge(2.4, 3.0), Change::Cache);
        assert_eq!(judge(6.0, 3.0), Change::Logarithm);
        assert_eq!(judge(7.0, 3.0), Change::Faster);
        // Memory that happens to be read faster does not tighten the bound.
        assert_eq!(judge(2.2, 0.5), Change::Logarithm);
        assert_eq!(super::judge([1000, 1_000_000], 1.3, 0.1, 1.0).change, Change::Flat);
    }

    #[test]
    fn a_power_law_has_its_exponent() {
        let points: Vec<[f64; 2]> = (1..6).map(f64::from).map(|x| [x, 1.5 * x + 0.3]).collect();
        assert!((slope(&points) - 1.5).abs() < 1e-12);
    }
}
