//! Comparison of two studies: changes beyond the noise.
//!
//! Settings in both studies are paired by scene, solver, budget, order and lanes. **Errors** have no noise:
//! the same program gives the same bits, so every difference is a change. They are compared with the
//! tolerance of the scene: an error below [`NEGLIGIBLE`] of it counts as zero. **Times** have noise. Both
//! studies run the same steps in the same blocks, so block k is paired with block k, and the median of the
//! ratios has an interval ([`Ratio`]). The machines may differ in speed; the median ratio over all settings
//! can be divided out.
//!
//! Two runs of one binary differ as well, by memory placement, clock rate and load. The measurable part of
//! this widens every interval ([`Noise`]): a fixed loop, timed between the rounds, measures the speed of the
//! machine; the scatter of the settings around their common ratio measures the rest, and it is widened so
//! that the largest of all settings stays within it. Other programs slow all settings of a scene alike for as
//! long as it is timed: by a third where they share a core's units and caches. No time tells such a spell from a
//! change of the whole scene, so times are divided by the median ratio of their scene in studies of many scenes, or
//! if threads had to wait. A change of one solver shows in all its settings, so it is detected even below that
//! noise ([`solvers`]).

pub mod solvers;
pub mod text;

use crate::engine::world::Order;
use crate::lab::report::study_file::{StudyFile, differing_settings};
use crate::lab::scenes::holds::Mark;
use crate::lab::study::Record;
use crate::lab::study::compare::Ratio;
use crate::lab::study::curve::ErrorAxis;
use crate::lab::study::sample::{Sample, median};
use serde::Serialize;
use solvers::SolverChange;
use std::collections::{BTreeMap, BTreeSet};

/// Errors below this fraction of their tolerance count as zero (1).
pub const NEGLIGIBLE: f64 = 0.01;

/// Options of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct CompareOptions {
    /// Smallest increase of a time or an error that counts as a regression (1): 0.1 is 10 %.
    pub threshold: f64,
    /// Whether times are divided by their common ratio.
    pub relative: bool,
}

/// A setting in both studies.
#[derive(Clone, Debug, Serialize)]
pub struct SettingPair {
    /// Name of the scene, with its size.
    pub scene: String,
    /// Name of the solver.
    pub solver: &'static str,
    /// Constraint order.
    pub order: Order,
    /// Lanes per instruction.
    pub lanes: usize,
    /// Work per step, for tables.
    pub budget: String,
    /// The failures before and after; `None` for a setting that holds.
    #[serde(rename = "holds", serialize_with = "words")]
    pub marks: [Option<Mark>; 2],
    /// Errors that both studies have.
    pub errors: Vec<ErrorChange>,
    /// Change of time; `None` if one of the studies has no time.
    pub time: Option<TimeChange>,
}

/// `yes`, or the word for the failure.
fn words<S: serde::Serializer>(marks: &[Option<Mark>; 2], serializer: S) -> Result<S::Ok, S::Error> {
    marks.map(|mark| mark.map_or("yes", Mark::word)).serialize(serializer)
}

/// An error before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ErrorChange {
    /// `penetration`, `residual`, `rest speed` or `reference`.
    pub error: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Before and after.
    pub values: [f64; 2],
    /// Value below which an error is negligible.
    pub negligible: f64,
}

/// A time before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TimeChange {
    /// [`Sample::cost_ns`], before and after.
    pub cost_ns: [f64; 2],
    /// Longest step (ns), before and after.
    pub longest_step_ns: [f64; 2],
    /// Median ratio over paired blocks; divided by the common one if times are relative.
    pub ratio: f64,
    /// Interval of the ratio, widened by the [`Noise`] between two runs.
    pub interval: [f64; 2],
}

/// Noise between two runs of one program.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Noise {
    /// Time of the fixed loop after ÷ before (1); all times are divided by it.
    pub machine: f64,
    /// Scatter of the logarithms of the settings' ratios around their median (1); 0 for too few settings.
    pub scatter: f64,
    /// Fraction of the time that threads waited, in the busier of the two runs (1). It is not part of the
    /// times.
    pub waited: f64,
    /// Widening of every interval toward slower and toward faster, as a logarithm of a ratio (1).
    pub allowed: [f64; 2],
}

/// Difference that remains between two runs on an idle machine, because code and data are at other addresses.
const PLACEMENT: f64 = 0.02;

/// Fraction of the time that threads waited from which a machine counts as busy (1).
const BUSY: f64 = 0.02;

/// Fewest settings from which scatter is estimated.
const FEWEST: usize = 8;

/// Probability that a comparison of one program with itself reports any setting as changed, and any solver.
const FALSE_ALARM: f64 = 0.02;

/// Fraction of the deviations on a side that form its tail, and their smallest number.
const TAIL: f64 = 0.4;
const FEWEST_IN_TAIL: usize = 10;

impl Noise {
    /// From all pairs: logarithms of their ratios, ratio of the fixed loop, and fraction of waiting.
    fn of(logs: &[f64], machine: f64, waited: f64) -> Self {
        let scatter = if logs.len() < FEWEST { 0.0 } else { scatter(logs) };
        // The loop uses neither memory nor vectors, so half of its change may not apply to the settings.
        let common = PLACEMENT + 0.5 * machine.ln().abs();
        let middle = median(logs);
        // What became faster shows how far chance moves settings that did not become slower, and vice versa.
        let side = |sign: f64| logs.iter().map(|x| sign * (x - middle)).filter(|x| *x > 0.0).collect();
        let allowed = [-1.0, 1.0].map(|sign| common + largest(side(sign), logs.len(), scatter));
        Noise { machine, scatter, waited, allowed }
    }
}

/// Deviation that the largest of `count` unchanged settings exceeds on one side with the probability
/// [`FALSE_ALARM`]/2, from the deviations on a side.
///
/// Hundreds of settings are compared, and a few of them are far from the others: the scatter between runs is
/// not normal. Beyond a high threshold u most distributions have exponential tails or lighter ones (Pickands
/// 1975; Balkema and de Haan 1974): with m deviations above u, and s the mean of their excess, the expected
/// number above u + y is m exp(−y/s). The largest is above it with at most that probability, whatever the
/// dependence between settings (Bonferroni), so
///
/// ```text
/// y = s ln(2m/α).
/// ```
///
/// With few deviations they count as normal, with the standard deviation σ: from P(|x| > zσ) ≤ exp(−z²/2)
/// follows z = √(2 ln(n/α)).
fn largest(mut deviations: Vec<f64>, count: usize, scatter: f64) -> f64 {
    deviations.sort_by(f64::total_cmp);
    let tail = (TAIL * deviations.len() as f64) as usize;
    if tail < FEWEST_IN_TAIL {
        return scatter * normal_quantile(count);
    }
    let (below, above) = deviations.split_at(deviations.len() - tail);
    let threshold = below.last().copied().unwrap_or(0.0);
    let excess = above.iter().map(|x| x - threshold).sum::<f64>() / tail as f64;
    threshold + excess * (2.0 * tail as f64 / FALSE_ALARM).ln()
}

/// Standard deviations within which all of `count` normal numbers are, except with the probability
/// [`FALSE_ALARM`].
fn normal_quantile(count: usize) -> f64 {
    (2.0 * (count.max(1) as f64 / FALSE_ALARM).ln()).sqrt()
}

/// Standard deviation of normal numbers, estimated as 1.48 d from their median deviation d.
fn scatter(logs: &[f64]) -> f64 {
    let middle = median(logs);
    1.4826 * median(&logs.iter().map(|x| (x - middle).abs()).collect::<Vec<_>>())
}

/// Whether a change matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Better by more than the threshold.
    Better,
    /// Within the threshold, the noise, or the negligible range.
    Same,
    /// Worse by more than the threshold.
    Worse,
}

/// Verdict on the ratio `growth` = after ÷ before.
fn judged(growth: f64, threshold: f64) -> Verdict {
    if growth > 1.0 + threshold {
        Verdict::Worse
    } else if growth < 1.0 / (1.0 + threshold) {
        Verdict::Better
    } else {
        Verdict::Same
    }
}

/// Verdict on a ratio known within an interval: [`Verdict::Same`] if the interval contains 1.
fn judged_within(growth: f64, [low, high]: [f64; 2], threshold: f64) -> Verdict {
    if low <= 1.0 && 1.0 <= high { Verdict::Same } else { judged(growth, threshold) }
}

impl ErrorChange {
    /// Whether a single bit differs.
    pub fn changed(&self) -> bool {
        self.values[0].to_bits() != self.values[1].to_bits()
    }

    /// After ÷ before, with both raised to at least the negligible value (1).
    pub fn growth(&self) -> f64 {
        let [before, after] = self.values.map(|v| v.max(self.negligible));
        if before == after { 1.0 } else { after / before }
    }

    /// Verdict on the change.
    pub fn verdict(&self, threshold: f64) -> Verdict {
        judged(self.growth(), threshold)
    }
}

impl TimeChange {
    /// Verdict on the change. A difference within the noise counts as [`Verdict::Same`].
    pub fn verdict(&self, threshold: f64) -> Verdict {
        judged_within(self.ratio, self.interval, threshold)
    }
}

impl SettingPair {
    /// Whether the setting stopped holding, or holds again.
    pub fn holding(&self) -> Verdict {
        match self.marks.map(|m| m.is_none()) {
            [true, false] => Verdict::Worse,
            [false, true] => Verdict::Better,
            _ => Verdict::Same,
        }
    }
}

/// Result of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Comparison {
    /// Noise that was allowed for.
    pub noise: Noise,
    /// Whether times are divided by the median ratio of their scene.
    pub relative_to_scenes: bool,
    /// Median ratio of times over all settings (1); `None` without times.
    pub common: Option<f64>,
    /// Whether times are divided by the common ratio.
    pub relative: bool,
    /// See [`CompareOptions::threshold`].
    pub threshold: f64,
    /// Settings that both studies have.
    pub pairs: Vec<SettingPair>,
    /// Changes by solver, relative to the other solvers.
    pub solvers: Vec<SolverChange>,
    /// Number of settings that only the first study has, and that only the second has.
    pub alone: [usize; 2],
    /// Differences in settings and machines, as text.
    pub differences: Vec<String>,
}

impl Comparison {
    /// Whether anything became worse.
    pub fn regressed(&self) -> bool {
        let worse = |p: &SettingPair| {
            p.holding() == Verdict::Worse
                || p.errors.iter().any(|e| e.verdict(self.threshold) == Verdict::Worse)
                || p.time.is_some_and(|t| t.verdict(self.threshold) == Verdict::Worse)
        };
        self.pairs.iter().any(worse)
            || self.solvers.iter().any(|s| s.verdict(self.threshold) == Verdict::Worse)
    }
}

/// Compares `after` with `before`.
pub fn compare(before: &StudyFile, after: &StudyFile, options: &CompareOptions) -> Comparison {
    let mut pairs: Vec<SettingPair> = Vec::new();
    let mut alone = [before.records.len(), after.records.len()];
    for one in &before.records {
        if let Some(other) = after.records.iter().find(|r| key(r) == key(one)) {
            alone = alone.map(|n| n - 1);
            pairs.push(pair(one, other));
        }
    }
    let solvers = solvers::changes(&pairs);
    let busy = [before, after].into_iter().any(|study| mean(study, |s| s.waited) > BUSY);
    let scenes: BTreeSet<&str> = pairs.iter().map(|p| p.scene.as_str()).collect();
    let relative_to_scenes = busy || scenes.len() >= FEWEST;
    let common = median_ratio(&pairs);
    if relative_to_scenes {
        divide_out_scenes(&mut pairs);
    }
    let noise = noise(before, after, &pairs);
    for time in pairs.iter_mut().filter_map(|p| p.time.as_mut()) {
        time.ratio /= noise.machine;
        let [low, high] = time.interval.map(|bound| bound / noise.machine);
        let [slower, faster] = noise.allowed;
        time.interval = [low * (-slower).exp(), high * faster.exp()];
    }
    let common = common.map(|ratio| ratio / noise.machine);
    if let (true, false, Some(common)) = (options.relative, relative_to_scenes, common) {
        for time in pairs.iter_mut().filter_map(|p| p.time.as_mut()) {
            time.ratio /= common;
            time.interval = time.interval.map(|bound| bound / common);
        }
    }
    Comparison {
        noise,
        relative_to_scenes,
        common,
        relative: options.relative,
        threshold: options.threshold,
        pairs,
        solvers,
        alone,
        differences: differences(before, after),
    }
}

/// The median ratio of times over all settings; `None` without times.
fn median_ratio(pairs: &[SettingPair]) -> Option<f64> {
    let mut ratios: Vec<f64> = pairs.iter().filter_map(|p| p.time.map(|t| t.ratio)).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied()
}

/// Divides times by the median ratio of their scene.
fn divide_out_scenes(pairs: &mut [SettingPair]) {
    let mut scenes: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for (scene, time) in pairs.iter().filter_map(|p| Some((&p.scene, p.time?))) {
        scenes.entry(scene.clone()).or_default().push(time.ratio);
    }
    for pair in pairs {
        if let (Some(time), Some(ratios)) = (&mut pair.time, scenes.get(&pair.scene)) {
            let common = median(ratios);
            time.ratio /= common;
            time.interval = time.interval.map(|bound| bound / common);
        }
    }
}

/// Mean of a quantity over the timed settings of a study.
fn mean(study: &StudyFile, of: fn(&Sample) -> f64) -> f64 {
    let values: Vec<f64> = study.records.iter().filter_map(|r| r.sample.as_ref().map(of)).collect();
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Noise between the two studies.
fn noise(before: &StudyFile, after: &StudyFile, pairs: &[SettingPair]) -> Noise {
    let logs: Vec<f64> = pairs.iter().filter_map(|p| p.time.map(|t| t.ratio.ln())).collect();
    let loops = [before, after].map(|study| mean(study, |s| s.yardstick_ns));
    let machine = if loops.iter().all(|ns| *ns > 0.0) { loops[1] / loops[0] } else { 1.0 };
    let waited = mean(before, |s| s.waited).max(mean(after, |s| s.waited));
    Noise::of(&logs, machine, waited)
}

fn key(r: &Record) -> impl PartialEq {
    (r.setting(), r.lanes)
}

fn pair(one: &Record, other: &Record) -> SettingPair {
    let errors = ErrorAxis::ALL.into_iter().filter_map(|axis| {
        let values = [axis.of(one)?, axis.of(other)?];
        // Values are fractions.
        let unit = match axis.unit(std::slice::from_ref(one)) {
            "%" => "1",
            unit => unit,
        };
        let tolerance = axis.tolerance(&one.tolerances).map_or(0.0, |t| t.value);
        Some(ErrorChange { error: axis.word(), unit, values, negligible: NEGLIGIBLE * tolerance })
    });
    let time = || {
        let samples = [one.sample.as_ref()?, other.sample.as_ref()?];
        let Ratio { median, interval, .. } = Ratio::of(samples[1], samples[0])?;
        let (cost_ns, longest_step_ns) = (samples.map(Sample::cost_ns), samples.map(|s| s.worst_ns));
        Some(TimeChange { cost_ns, longest_step_ns, ratio: median, interval })
    };
    SettingPair {
        scene: one.scene.clone(),
        solver: one.solver,
        order: one.order,
        lanes: one.lanes,
        budget: one.budget_text.clone() + &one.swept.map_or(String::new(), |s| format!(" {s}")),
        marks: [one.mark(), other.mark()],
        errors: errors.collect(),
        time: time(),
    }
}

/// Differences in settings and machines, as text.
fn differences(before: &StudyFile, after: &StudyFile) -> Vec<String> {
    let mut found = Vec::new();
    let mut differ = |what: &str, a: String, b: String| {
        if a != b {
            found.push(format!("{what}: {a} → {b}"));
        }
    };
    let (a, b) = (&before.environment, &after.environment);
    differ("processor", a.cpu.clone(), b.cpu.clone());
    differ("instructions", a.instructions().into(), b.instructions().into());
    differ("compiler", a.compiler.clone(), b.compiler.clone());
    differ("version", a.version.clone(), b.version.clone());
    differ("commit", a.commit.clone(), b.commit.clone());
    for (name, [a, b]) in differing_settings(&before.settings, &after.settings) {
        match a == b {
            _ if name == "scenes" => {}
            true => found.push(format!("{name}: differs")),
            false => found.push(format!("{name}: {a} → {b}")),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::StudyPlan;
    use crate::lab::study::record::tests::{fell, record};

    fn study(records: Vec<Record>) -> StudyFile {
        StudyFile::new(&StudyPlan::default(), records, Vec::new())
    }

    const STRICT: CompareOptions = CompareOptions { threshold: 0.1, relative: false };

    #[test]
    fn a_study_is_as_good_as_itself() {
        let study = study(vec![record(8, 1, 10.0, 1e-3), fell(8, 2, 1.0, 0.5)]);
        let same = compare(&study, &study, &STRICT);
        assert!(!same.regressed() && same.differences.is_empty());
        assert_eq!((same.pairs.len(), same.alone, same.common), (2, [0, 0], Some(1.0)));
        assert!(same.pairs.iter().flat_map(|p| &p.errors).all(|e| !e.changed()));
    }

    #[test]
    fn errors_times_and_falling_are_judged_apart() {
        let before =
            study(vec![record(8, 1, 10.0, 1e-3), record(8, 2, 20.0, 1e-3), record(8, 3, 30.0, 1e-3)]);
        let deeper = study(vec![record(8, 1, 10.0, 1.2e-3), record(8, 2, 20.0, 1e-3)]);
        let found = compare(&before, &deeper, &STRICT);
        assert!(found.regressed());
        assert_eq!(found.alone, [1, 0]);
        assert_eq!(found.pairs[0].errors[0].verdict(0.1), Verdict::Worse);
        assert_eq!(found.pairs[0].errors[0].verdict(0.3), Verdict::Same);
        assert_eq!(found.pairs[0].time.unwrap().verdict(0.1), Verdict::Same);

        let slower = study(vec![record(8, 1, 12.0, 1e-3), record(8, 2, 20.0, 1e-3)]);
        let found = compare(&before, &slower, &STRICT);
        assert_eq!(found.pairs[0].time.unwrap().verdict(0.1), Verdict::Worse);
        assert!(found.regressed() && found.pairs[0].errors[0].verdict(0.1) == Verdict::Same);
        // A faster setting is not a regression.
        assert!(!compare(&slower, &before, &STRICT).regressed());

        let fallen = study(vec![fell(8, 1, 10.0, 1e-3)]);
        assert_eq!(compare(&before, &fallen, &STRICT).pairs[0].holding(), Verdict::Worse);
        assert!(compare(&before, &fallen, &STRICT).regressed());
        assert!(!compare(&fallen, &before, &STRICT).regressed());
    }

    #[test]
    fn what_is_negligible_is_no_regression() {
        // The tolerance is 1 cm; a hundredth of it is 0.1 mm.
        let of = |depth| study(vec![record(8, 1, 10.0, depth)]);
        assert!(!compare(&of(1e-9), &of(9e-5), &STRICT).regressed());
        assert!(compare(&of(1e-9), &of(1.2e-4), &STRICT).regressed());
        assert!(compare(&of(1e-9), &of(9e-5), &STRICT).pairs[0].errors[0].changed());
    }

    #[test]
    fn a_slower_machine_can_be_divided_out() {
        let before = study((1..=5).map(|i| record(8, i, 10.0, 1e-3)).collect());
        let mut times = [15.0, 15.0, 15.0, 15.0, 30.0].into_iter().zip(1..);
        let after = study(times.by_ref().map(|(time, i)| record(8, i, time, 1e-3)).collect());
        let raw = compare(&before, &after, &STRICT);
        let count = |c: &Comparison| {
            c.pairs.iter().filter(|p| p.time.unwrap().verdict(0.1) == Verdict::Worse).count()
        };
        assert_eq!((raw.common, count(&raw)), (Some(1.5), 5));
        let relative = compare(&before, &after, &CompareOptions { relative: true, ..STRICT });
        assert_eq!(count(&relative), 1);
    }

    #[test]
    fn a_heavy_tail_of_chance_is_allowed_for_and_the_changed_side_is_not_part_of_it() {
        // Laplace numbers have a 10 000 times heavier tail at 5 σ than normal ones: x = ±ln u.
        let logs: Vec<f64> = (1..=500).map(|i| 0.01 * (f64::from(i) / 501.0).ln()).collect();
        let both: Vec<f64> = logs.iter().flat_map(|x| [*x, -x]).collect();
        let calm = Noise::of(&both, 1.0, 0.4);
        // ln(2·500/α) scales, and nothing for waiting.
        let expected = PLACEMENT + 0.01 * (2.0 * 500.0 / FALSE_ALARM).ln();
        assert!(calm.allowed.iter().all(|a| (a / expected - 1.0).abs() < 0.05), "{calm:?} {expected}");
        // A tenth of the settings became slower: they do not hide themselves.
        let changed: Vec<f64> =
            both.iter().enumerate().map(|(i, x)| x + if i % 10 == 0 { 0.3 } else { 0.0 }).collect();
        let [slower, faster] = Noise::of(&changed, 1.0, 0.4).allowed;
        assert!(slower < 1.1 * calm.allowed[0] && faster > 2.0 * calm.allowed[1], "{slower} {faster}");
    }

    /// Two studies of one program with `count` settings. Times scatter by `scatter` from run to run, the
    /// machine is slower by the factor `machine` in the second study, and setting 0 is slower by the factor
    /// `slower`.
    fn two_runs(count: u32, scatter: f64, machine: f64, slower: f64, seed: u64) -> Comparison {
        use rand::{RngExt, SeedableRng};
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut run = |machine: f64, slower: f64| {
            let records = (0..count).map(|i| {
                // Sums of three are close enough to normal. One setting in 30 scatters twice as much.
                let normal: f64 = (0..3).map(|_| random.random_range(-1.0..1.0)).sum();
                let own = if i % 30 == 7 { 2.0 * scatter } else { scatter };
                let own = machine * (own * normal).exp() * if i == 0 { slower } else { 1.0 };
                let mut r = record(8, i + 1, 10.0 * own, 1e-3);
                let sample = r.sample.as_mut().unwrap();
                sample.yardstick_ns *= machine;
                for block in sample.blocks_ns.iter_mut().flatten() {
                    *block *= 1.0 + random.random_range(-0.02..0.02);
                }
                r
            });
            study(records.collect())
        };
        let before = run(1.0, 1.0);
        let after = run(machine, slower);
        compare(&before, &after, &CompareOptions { threshold: 0.05, relative: false })
    }

    #[test]
    fn a_null_race_finds_no_difference_and_a_known_slowdown_is_found() {
        let worse = |c: &Comparison| {
            let verdicts = c.pairs.iter().map(|p| p.time.unwrap().verdict(c.threshold));
            verdicts.filter(|v| *v != Verdict::Same).count()
        };
        for seed in 0..20 {
            for (scatter, machine) in [(0.005, 1.0), (0.05, 1.0), (0.1, 1.3), (0.03, 0.8)] {
                let null = two_runs(120, scatter, machine, 1.0, seed);
                assert_eq!(worse(&null), 0, "seed {seed}, scatter {scatter}, machine {machine}");
            }
        }
        let found = (0..10).filter(|&seed| {
            let slowed = two_runs(120, 0.004, 1.0, 1.1, seed);
            slowed.pairs[0].time.unwrap().verdict(0.05) == Verdict::Worse
        });
        assert!(found.count() >= 9);
    }

    #[test]
    fn on_a_busy_machine_a_slow_spell_of_a_scene_is_none_of_its_settings() {
        let run = |waited: f64, spell: f64, slower: f64| {
            let of = |i: u32, scene: &str, time: f64| {
                let mut r = Record { scene: scene.into(), ..record(8, i, time, 1e-3) };
                r.sample.as_mut().unwrap().waited = waited;
                r
            };
            let calm = (1..=35).map(|i| of(i, "x", 10.0 * if i == 1 { slower } else { 1.0 }));
            study(calm.chain((1..=5).map(|i| of(i, "y", 20.0 * spell))).collect())
        };
        let worse = |c: Comparison| {
            c.pairs.iter().filter(|p| p.time.unwrap().verdict(0.05) == Verdict::Worse).count()
        };
        let busy = compare(&run(0.4, 1.0, 1.0), &run(0.3, 1.3, 1.0), &STRICT);
        assert!(busy.relative_to_scenes && worse(busy) == 0);
        // On an idle machine all settings of the scene did become slower.
        assert_eq!(worse(compare(&run(0.0, 1.0, 1.0), &run(0.0, 1.3, 1.0), &STRICT)), 5);
        // Not everything is a tie.
        let found = compare(&run(0.4, 1.0, 1.0), &run(0.3, 1.3, 1.5), &STRICT);
        assert_eq!((worse(found.clone()), found.regressed()), (1, true));
    }

    #[test]
    fn in_a_study_of_many_scenes_a_spell_that_slows_some_of_them_is_no_regression() {
        // Ten scenes of 40 settings, three of them in a spell; setting 1 of scene 7 is slower by `slower`.
        let run = |spell: f64, slower: f64| {
            let record = |scene: u32, i: u32| {
                let own = if (scene, i) == (7, 1) { slower } else { 1.0 };
                let time = 10.0 * own * if scene < 3 { spell } else { 1.0 };
                Record { scene: scene.to_string(), ..record(8, i, time, 1e-3) }
            };
            study((0..10).flat_map(|scene| (1..=40).map(move |i| record(scene, i))).collect())
        };
        let worse = |spell: f64, slower: f64| {
            let found = compare(&run(1.0, 1.0), &run(spell, slower), &STRICT);
            let verdicts = found.pairs.iter().map(|p| p.time.unwrap().verdict(0.1));
            verdicts.filter(|v| *v == Verdict::Worse).count()
        };
        assert_eq!([worse(1.5, 1.0), worse(0.7, 1.0), worse(1.5, 1.3)], [0, 0, 1]);
    }

    #[test]
    fn noise_is_no_regression() {
        let noisy = |seed: u64| {
            let mut r = record(8, 1, 10.0, 1e-3);
            let sample = r.sample.as_mut().unwrap();
            // ±30 %, without a trend.
            sample.blocks_ns[0].iter_mut().enumerate().for_each(|(i, ns)| {
                *ns *= 1.0 + 0.3 * (((i as u64 * 7 + seed * 13) % 11) as f64 / 5.0 - 1.0);
            });
            study(vec![r])
        };
        let found = compare(&noisy(1), &noisy(2), &CompareOptions { threshold: 0.01, relative: false });
        assert_eq!(found.pairs[0].time.unwrap().verdict(0.01), Verdict::Same);
    }
}
