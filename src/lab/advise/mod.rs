//! Finds the cheapest setting that is good enough for a scene.
//!
//! A *setting* is a solver, a constraint order, a budget and, for solvers with soft contacts, their
//! stiffness. It runs at its fastest lane width. The search
//!
//! 1. tries a grid in which every part of the budget is doubled, the least work first;
//! 2. refines the good-enough settings: each part is lowered by bisection toward its half;
//! 3. times the best few again, interleaved and several times. These times decide.
//!
//! If a scene has to rest, a setting within the limits is [run for a minute](crate::lab::study::horizon) before it
//! counts as good enough.
//!
//! Settings that cannot be cheaper than a known one are skipped. These are budgets that contain, in every
//! part, a good-enough budget of the same solver, order and stiffness; or a budget of the same solver and
//! order that took much longer than the limit or than the fastest good-enough setting. Errors need not fall
//! when a budget grows, so a skipped setting may be more accurate, but not cheaper.

pub mod limits;
mod search;

use crate::engine::constraints::Impacts;
use crate::engine::lanes::LaneWidth;
use crate::engine::params::{Budget, Parameters};
use crate::engine::solvers::Variant;
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::metrics::Errors;
use crate::lab::overrides;
use crate::lab::scenes::holds::Broken;
use crate::lab::study::compare::compare;
use crate::lab::study::interleave::time_in_turns;
use crate::lab::study::record::Later;
use crate::lab::study::sample::Sample;
use crate::lab::study::{FailedAt, Progress, TruthError, budget, open_scene};
use crate::lab::units::{ratio, si};
use limits::Limits;
use search::Search;

/// The scene, the solvers and the time limit of a search.
#[derive(Clone, Debug)]
pub struct SearchPlan {
    /// Name of a scene of the catalog with its size, or a `.json` file.
    pub scene: String,
    /// Limits that a good-enough setting meets.
    pub limits: Limits,
    /// Treatment of impacts.
    pub impacts: Impacts,
    /// Rows of [`crate::engine::solvers::VARIANTS`].
    pub solvers: Vec<&'static Variant>,
    /// Lane widths of colored settings. If one lane is among them, natural order is tried too.
    pub widths: Vec<LaneWidth>,
    /// Steps of the runs that measure errors; `None` for the scene's own.
    pub steps: Option<u32>,
    /// Timing runs per setting in the final timing.
    pub repeats: u32,
    /// Random seed of scenes that have one, and of the order of timing runs.
    pub seed: u64,
    /// Time limit of the search (s).
    pub seconds: f64,
}

/// Steps per setting in a trial's timing, and in the final timing.
const TRIAL_STEPS: u32 = 60;
const RACE_STEPS: u32 = 200;

/// Settings in the final timing, not counting the best setting of every other solver.
const FINALISTS: usize = 4;

/// A solver, an order, a budget and parameters.
#[derive(Clone, Copy, Debug)]
pub struct SearchSetting {
    /// The solver.
    pub solver: &'static Variant,
    /// Constraint order.
    pub order: Order,
    /// Work per step.
    pub budget: Budget,
    /// Values of the solver's parameters.
    pub parameters: Parameters,
    /// Treatment of impacts.
    pub impacts: Impacts,
}

impl SearchSetting {
    /// The settings of a world at this width.
    pub fn settings(&self, width: LaneWidth) -> Settings {
        Settings {
            order: self.order,
            budget: self.budget,
            parameters: self.parameters,
            impacts: self.impacts,
            ..Settings::new(self.solver).exactly(width)
        }
    }

    /// `soft_step, 4 sub 1 vel 1 rel, contact_hertz 60 Hz`
    pub fn text(&self) -> String {
        let budget = budget::with_impacts(budget::brief(&self.budget, self.solver), self.impacts);
        let mut text = format!("{}, {budget}", self.solver.name);
        let changed = overrides::brief(self.solver, &self.parameters);
        if !changed.is_empty() {
            text += &format!(", {changed}");
        }
        text
    }
}

/// A time, and the lane width at which it was reached.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct FoundTime {
    /// Lanes per instruction.
    pub lanes: usize,
    /// Mean time of a step over the run (ns).
    #[serde(rename = "mean_step_ns")]
    pub mean_ns: f64,
    /// Median time of a step (ns).
    #[serde(rename = "median_step_ns")]
    pub median_ns: f64,
    /// The longest step (ns).
    #[serde(rename = "longest_step_ns")]
    pub worst_ns: f64,
    /// Spread of the steps (ns), see [`Sample::spread_ns`].
    pub spread_ns: f64,
}

/// A setting with its cost and errors.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The setting.
    pub setting: SearchSetting,
    /// Time at the fastest width; `None` if the run failed.
    pub time: Option<FoundTime>,
    /// Sample of the final timing at that width; `None` before it.
    pub sample: Option<Sample>,
    /// Errors of the run; `None` if it failed.
    pub errors: Option<Errors>,
    /// Distance to the scene's reference value.
    pub truth: Option<TruthError>,
    /// Why the run failed.
    pub failure: Option<FailedAt>,
    /// The first demand of the scene that was not met. If there is one, no limit counts as met.
    pub broken: Option<Broken>,
    /// Result of the one-minute run, if the scene has to rest and the run itself was within the limits.
    pub later: Option<Later>,
    /// The largest of errors and time, each ÷ its limit; at most 1 is good enough.
    pub excess: f64,
}

impl Trial {
    /// Whether it meets every limit.
    pub fn is_good(&self) -> bool {
        self.excess <= 1.0
    }

    /// Why it is not good enough, as text; `None` if it is.
    pub fn fails(&self, limits: &Limits) -> Option<String> {
        if self.is_good() {
            return None;
        }
        if let Some(failure) = self.failure {
            return Some(failure.to_string());
        }
        if let Some(broken) = self.broken.or(self.later.and_then(|later| later.broken)) {
            return Some(broken.to_string());
        }
        let errors = self.errors?;
        let speed = self.later.and_then(|l| l.rest_speed_m_s).unwrap_or(0.0).max(errors.rest_velocity());
        let reference = self.truth.and_then(|t| t.error);
        let over = |value: f64, limit: Option<f64>| limit.is_some_and(|limit| value > limit);
        let unit = self.truth.map_or("", |t| t.unit);
        let reasons = [
            (over(speed, limits.rest), format!("moves at {} at rest", si(speed, "m/s"))),
            (
                over(errors.penetration(limits.rest.is_some()), limits.penetration),
                format!("{} of penetration", si(errors.penetration(limits.rest.is_some()), "m")),
            ),
            (
                over(errors.law_rms_lighter(), limits.residual),
                format!("residual {}", ratio(errors.law_rms_lighter())),
            ),
            (
                limits.truth.is_some() && reference.is_none_or(|e| over(e, limits.truth)),
                reference.map_or("never reaches its reference value".into(), |e| {
                    format!("{} off its reference value", si(e, unit))
                }),
            ),
            (over(self.time_ns(), limits.time_ns), format!("takes {}", si(1e-9 * self.time_ns(), "s"))),
        ];
        reasons.into_iter().find(|(is_over, _)| *is_over).map(|(_, reason)| reason)
    }

    fn time_ns(&self) -> f64 {
        self.time.map_or(f64::INFINITY, |t| t.median_ns)
    }

    /// Whether two trials of the final timing are too close to call.
    pub fn ties(&self, other: &Trial) -> bool {
        matches!((&self.sample, &other.sample), (Some(a), Some(b)) if compare(a, b).is_eq())
    }
}

/// Result of the search.
#[derive(Clone, Debug)]
pub struct Advice {
    /// The settings of the final timing: first those that are good enough, fastest first, then the others,
    /// nearest first. The first one is the advice if it is good enough.
    pub finalists: Vec<Trial>,
    /// Settings that are faster than the best one but not good enough: the slowest such setting of each
    /// solver, first those that fail only in the one-minute run. They are timed in the same rounds as the
    /// finalists.
    pub rejected: Vec<Trial>,
    /// Everything that was tried, in the order of the search, with the times of the trials.
    pub trials: Vec<Trial>,
    /// Number of settings skipped because they cannot be cheaper.
    pub left_out: usize,
    /// Whether the time limit was reached before the search was done.
    pub is_cut_short: bool,
    /// Rounds and steps of the final timing.
    pub timing: [u32; 2],
}

impl Advice {
    /// The cheapest setting that is good enough.
    pub fn best(&self) -> Option<&Trial> {
        self.finalists.first().filter(|t| t.is_good())
    }

    /// The second-cheapest setting that is good enough.
    pub fn runner_up(&self) -> Option<&Trial> {
        self.finalists.get(1).filter(|t| t.is_good())
    }

    /// The setting nearest to the limits, of those that are not good enough.
    pub fn nearest(&self) -> Option<&Trial> {
        self.finalists.iter().find(|t| !t.is_good())
    }
}

/// Searches, then times the best settings again.
///
/// Errors: an unknown scene; no solvers or lanes; zero steps or repeats; a limit on the distance to the
/// reference value for a scene that has none.
pub fn advise(plan: &SearchPlan, progress: &dyn Fn(Progress)) -> Result<Advice, Error> {
    for (name, missing) in [("solvers", plan.solvers.is_empty()), ("lanes", plan.widths.is_empty())] {
        if missing {
            return Err(Error::invalid(name, "none given"));
        }
    }
    for (name, count) in [("steps", plan.steps.unwrap_or(1)), ("repeats", plan.repeats)] {
        if count == 0 {
            return Err(Error::invalid(name, "0 is too few: at least 1 is needed"));
        }
    }
    let loaded = open_scene(&plan.scene, Some(plan.seed), plan.steps, None)?;
    if plan.limits.truth.is_some() && loaded.truth.is_none() {
        return Err(Error::invalid("max-truth", format!("no reference value is known for '{}'", plan.scene)));
    }
    let mut search = Search::new(plan, &loaded.scene, progress);
    search.coarse()?;
    search.refine()?;
    progress(Progress { done: 1, total: 1, what: "final timing".to_string() });
    let Search { trials, left_out, is_cut_short, .. } = search;

    let mut finalists = choose(&trials);
    let rejected = match finalists.first() {
        Some(best) if best.is_good() => insufficient(&trials, LIKELY_FASTER * best.time_ns()),
        _ => Vec::new(),
    };
    let count = finalists.len();
    finalists.extend(rejected);
    let steps = loaded.scene.steps.min(RACE_STEPS);
    race_again(plan, &loaded.scene, &mut finalists, steps)?;
    let mut rejected = finalists.split_off(count);
    rank(&mut finalists);
    let mean = |t: &Trial| t.time.map_or(f64::INFINITY, |t| t.mean_ns);
    rejected.retain(|t| mean(t) < mean(&finalists[0]));
    Ok(Advice { finalists, rejected, trials, left_out, is_cut_short, timing: [plan.repeats, steps] })
}

/// Trials are not timed interleaved, so a setting up to this factor slower may be faster in the final timing.
const LIKELY_FASTER: f64 = 1.2;

/// Settings faster than `time_ns` that are not good enough: the slowest of each solver, first those that fail
/// only in the one-minute run.
fn insufficient(trials: &[Trial], time_ns: f64) -> Vec<Trial> {
    let mut faster: Vec<&Trial> = trials.iter().filter(|t| !t.is_good() && t.time_ns() < time_ns).collect();
    faster
        .sort_by(|a, b| b.later.is_some().cmp(&a.later.is_some()).then(b.time_ns().total_cmp(&a.time_ns())));
    let mut kept: Vec<Trial> = Vec::new();
    for trial in faster {
        if kept.iter().all(|k| k.setting.solver.name != trial.setting.solver.name) {
            kept.push(trial.clone());
        }
    }
    kept
}

/// The best few, and the best of every solver that is not among them. If none is good enough: the nearest
/// setting of each solver.
fn choose(trials: &[Trial]) -> Vec<Trial> {
    let mut ranked = trials.to_vec();
    rank(&mut ranked);
    let few = if ranked.first().is_some_and(Trial::is_good) { FINALISTS } else { 1 };
    let mut chosen: Vec<Trial> = Vec::new();
    for trial in ranked {
        let is_new = chosen.iter().all(|t| t.setting.solver.name != trial.setting.solver.name);
        if is_new || (chosen.len() < few && trial.is_good()) {
            chosen.push(trial);
        }
    }
    chosen
}

/// Sorts good-enough settings by time, then the others by how far they exceed the limits.
fn rank(trials: &mut [Trial]) {
    let key = |t: &Trial| if t.is_good() { (false, t.time_ns()) } else { (true, t.excess) };
    trials.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
}

/// Widths at which a setting may run.
fn widths(plan: &SearchPlan, order: Order) -> Vec<LaneWidth> {
    match order {
        Order::Colored => plan.widths.clone(),
        _ => vec![LaneWidth::W1],
    }
}

/// Times all finalists at all widths interleaved, and judges them by these times.
fn race_again(
    plan: &SearchPlan,
    scene: &crate::lab::scenes::Scene,
    finalists: &mut [Trial],
    steps: u32,
) -> Result<(), Error> {
    let runs: Vec<(usize, LaneWidth)> = finalists
        .iter()
        .enumerate()
        .filter(|(_, t)| t.errors.is_some())
        .flat_map(|(i, t)| widths(plan, t.setting.order).into_iter().map(move |w| (i, w)))
        .collect();
    let settings: Vec<Settings> = runs.iter().map(|&(i, w)| finalists[i].setting.settings(w)).collect();
    let samples = time_in_turns(scene, &settings, steps, plan.repeats, plan.seed)?;
    for (i, trial) in finalists.iter_mut().enumerate() {
        let own = runs.iter().zip(&samples).filter(|((j, _), _)| *j == i);
        let samples = own.filter_map(|((_, width), sample)| Some((*width, sample.as_ref().ok()?)));
        if let Some((time, sample)) = fastest(samples) {
            (trial.time, trial.sample) = (Some(time), Some(sample.clone()));
            trial.excess = excess(&plan.limits, trial);
        }
    }
    Ok(())
}

fn fastest<'a>(samples: impl Iterator<Item = (LaneWidth, &'a Sample)>) -> Option<(FoundTime, &'a Sample)> {
    let (width, sample) = samples.min_by(|a, b| a.1.median_ns.total_cmp(&b.1.median_ns))?;
    let time = FoundTime {
        lanes: width.lanes(),
        mean_ns: sample.mean_ns,
        median_ns: sample.median_ns,
        worst_ns: sample.worst_ns,
        spread_ns: sample.spread_ns,
    };
    Some((time, sample))
}

fn excess(limits: &Limits, trial: &Trial) -> f64 {
    let Some(errors) = trial.errors.as_ref().filter(|_| trial.broken.is_none()) else { return f64::INFINITY };
    if let Some(later) = &trial.later {
        let rest = later.rest_speed_m_s.filter(|_| later.broken.is_none());
        let Some(speed) = rest else { return f64::INFINITY };
        let errors = errors.with("rest_speed_m_s", speed.max(errors.rest_velocity()));
        return limits.of_errors(&errors, trial.truth.as_ref()).max(limits.of_time(trial.time_ns()));
    }
    limits.of_errors(errors, trial.truth.as_ref()).max(limits.of_time(trial.time_ns()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;

    pub fn trial(time: f64, excess: f64) -> Trial {
        let solver = find("pgs").unwrap();
        let (budget, parameters) = (solver.budget, solver.defaults());
        let setting =
            SearchSetting { solver, order: Order::Colored, budget, parameters, impacts: Impacts::Own };
        let (mean_ns, median_ns, worst_ns) = (time, time, time);
        let time = Some(FoundTime { lanes: 8, mean_ns, median_ns, worst_ns, spread_ns: 0.0 });
        Trial {
            setting,
            time,
            sample: None,
            errors: Some(Errors::default()),
            truth: None,
            failure: None,
            broken: None,
            later: None,
            excess,
        }
    }

    #[test]
    fn good_ones_are_ranked_by_time_and_the_others_by_excess() {
        let mut trials = [trial(1.0, 9.0), trial(30.0, 0.9), trial(99.0, 2.0), trial(20.0, 1.0)];
        rank(&mut trials);
        assert_eq!(trials.each_ref().map(|t| t.time_ns()), [20.0, 30.0, 99.0, 1.0]);
        let advice = Advice {
            finalists: trials.to_vec(),
            rejected: Vec::new(),
            trials: Vec::new(),
            left_out: 0,
            is_cut_short: false,
            timing: [1, 1],
        };
        let time = |t: Option<&Trial>| t.map(Trial::time_ns);
        assert_eq!(time(advice.best()), Some(20.0));
        assert_eq!((time(advice.runner_up()), time(advice.nearest())), (Some(30.0), Some(99.0)));
        let none = Advice { finalists: vec![trial(1.0, 2.0)], ..advice };
        assert_eq!(
            (time(none.best()), time(none.runner_up()), time(none.nearest())),
            (None, None, Some(1.0))
        );
    }

    #[test]
    fn the_best_few_race_and_the_best_of_every_other_solver() {
        let by = |name: &str, time: f64, excess: f64| {
            let mut trial = trial(time, excess);
            trial.setting.solver = find(name).unwrap();
            trial
        };
        let mut trials: Vec<Trial> = (1..9).map(|i| by("pgs", f64::from(i), 0.5)).collect();
        trials.extend([by("projection", 1.0, 7.0), by("projection", 9.0, 3.0)]);
        trials.extend([by("soft_step", 60.0, 0.1), by("soft_step", 50.0, 0.1)]);
        let times = |trials: &[Trial]| choose(trials).iter().map(Trial::time_ns).collect::<Vec<_>>();
        assert_eq!(times(&trials), [1.0, 2.0, 3.0, 4.0, 50.0, 9.0]);
        assert_eq!(times(&trials[8..10]), [9.0]);
    }

    #[test]
    fn of_what_is_faster_and_not_good_the_nearest_of_each_solver_is_told() {
        let mut other = trial(3.0, 2.0);
        other.setting.solver = find("soft_step").unwrap();
        let trials = [trial(1.0, 9.0), trial(4.0, 2.0), trial(2.0, 0.5), trial(6.0, 2.0), other];
        let times: Vec<f64> = insufficient(&trials, 5.0).iter().map(Trial::time_ns).collect();
        assert_eq!(times, [4.0, 3.0]);
    }

    #[test]
    fn a_setting_says_what_it_is() {
        let soft = find("soft_step").unwrap();
        let mut parameters = soft.defaults();
        soft.set(&mut parameters, "contact_hertz", 60.0).unwrap();
        let (order, impacts) = (Order::Natural, Impacts::Own);
        let setting = SearchSetting { solver: soft, order, budget: soft.budget, parameters, impacts };
        assert_eq!(setting.text(), "soft_step, 4 sub 1 vel 1 rel, contact_hertz 60 Hz");
        let settings = setting.settings(LaneWidth::W1);
        assert_eq!(
            (settings.parameters, settings.order, settings.budget),
            (parameters, Order::Natural, soft.budget)
        );
    }
}
