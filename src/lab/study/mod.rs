//! Studies: solvers × scenes × budgets × lane widths → [`Record`]s of speed and error.
//!
//! Every setting runs twice. *Errors* come from one run with recorded impulses. No clock is read, so these
//! runs use all cores in parallel. *Times* come from [interleaved timing](interleave) of all settings of a
//! scene in common rounds, on one core. All colored widths and the error run must agree to the last bit
//! ([`Record::bits_equal`]). Settings that would be recommended are then [extended](horizon) to a minute,
//! untimed and on all cores.
//!
//! The settings that a solver runs on a scene are [found](search) by errors alone, with one rule for all
//! solvers, and [recorded](found).

#[doc(hidden)]
pub mod answer;
pub mod budget;
pub mod compare;
#[doc(hidden)]
pub mod curve;
pub mod found;
#[doc(hidden)]
pub mod horizon;
#[doc(hidden)]
pub mod interleave;
pub mod pace;
pub mod plan;
#[doc(hidden)]
pub mod profile;
#[doc(hidden)]
pub mod ranking;
pub mod record;
#[doc(hidden)]
pub mod sample;
pub mod search;
pub mod sweep;
#[doc(hidden)]
pub mod telling;

use crate::engine::constraints::{Features, Impacts};
use crate::engine::lanes::LaneWidth;
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::Budget;
use crate::engine::solvers::{VARIANTS, Variant, find};
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::parallel::{in_parallel, processors};
use crate::lab::scenes::class::SceneClass;
use crate::lab::scenes::{Loaded, Scene};
use crate::lab::trial::{Trial, TrialOutcome};
use compare::Ratio;
use found::{Found, FoundSetting, TunedBudget};
use interleave::Interleaved;
pub use plan::{StudyPlan, check_seed, is_path, open_scene, seed_of};
pub use record::{FailedAt, Record, TruthError};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use sweep::Swept;

/// Scenes of the default study. Each one shows an effect that the others do not. As many arrive at rest as are
/// placed there, see [`SceneClass`].
pub const DEFAULT_SCENES: [&str; 14] = [
    "disc_column:10",
    "stack:20",
    "arch",
    "card_house",
    "pyramid:30",
    "vertical_stack",
    "circle_stack",
    "high_mass_ratio_1",
    "high_mass_ratio_2",
    "overlap_recovery",
    "incline_slip",
    "bounce",
    "friction_ramp",
    "circle_pile:500",
];

/// Default solvers of a comparison: sequential impulses without and with position sweeps, accelerated, in
/// parallel, in substeps, position-based, and soft; all of them fast. The other [`VARIANTS`] run if they are
/// named, or with `all`.
pub const DEFAULT_SOLVERS: [&str; 7] =
    ["pgs", "pgs_ngs_block", "nncg", "tgs_ngs", "xpbd", "soft_step", "shim"];

/// The rows of [`DEFAULT_SOLVERS`].
pub fn default_solvers() -> Vec<&'static Variant> {
    DEFAULT_SOLVERS.iter().filter_map(|name| find(name).ok()).collect()
}

/// Solvers of the crate that a default comparison leaves out. Empty unless `ran` is the default list, because
/// the choice was explicit then.
pub fn left_out(ran: &[&str]) -> Vec<&'static str> {
    let is_default =
        ran.len() == DEFAULT_SOLVERS.len() && ran.iter().all(|name| DEFAULT_SOLVERS.contains(name));
    let others = VARIANTS.iter().map(|v| v.name).filter(|name| is_default && !ran.contains(name));
    others.collect()
}

/// State of a running study, for a progress bar.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Number of parts of the work that were finished before this one.
    pub done: usize,
    /// Number of parts.
    pub total: usize,
    /// Description of the current part.
    pub what: String,
}

/// Parts of the work on a scene, for the progress bar.
const PARTS: usize = 1000;

/// The settings that share an error run per order: one cell for each value of a sweep, solver and budget.
#[derive(Clone, Copy)]
struct ErrorCell {
    /// Index of the value of the sweep, and the value.
    point: usize,
    swept: Option<Swept>,
    solver: &'static Variant,
    impacts: Impacts,
    frozen: Freezing,
    tuned: TunedBudget,
    /// Whether the cell runs at its widest lanes only, see [`StudyPlan::widest_alone`].
    widest_alone: bool,
}

impl ErrorCell {
    /// Its budget, and the parameters that differ from the solver's defaults.
    fn text(&self) -> String {
        let TunedBudget { budget, parameters } = &self.tuned;
        budget::whole(budget, self.solver, (self.impacts, self.frozen), parameters)
    }
}

/// An error run.
struct JudgedRun {
    /// Its record, without times.
    record: Record,
    /// Hash of the state after the steps of a timing run.
    hash: u64,
    /// Sweeps plus substeps of an average step.
    work: f64,
}

/// A record that waits for its times.
struct TimedRun {
    record: Record,
    /// Index of the value of the sweep, and the settings.
    point: usize,
    settings: Settings,
}

/// Receives the records of a scene, and the settings that a search found for it.
pub type SceneFinished<'a> = dyn FnMut(&[Record], &[FoundSetting]) -> Result<(), Error> + 'a;

/// Runs the plan, scene by scene. Returns one record per scene, solver, budget, order and width, in that
/// order. `finished` receives the records of a scene, and the settings that a search found for it, as soon as
/// they are complete; its error ends the study.
///
/// Errors: anything that [`StudyPlan::check`] rejects. A run that diverges is a record, not an error.
pub fn run(
    plan: &StudyPlan,
    progress: &(dyn Fn(Progress) + Sync),
    finished: &mut SceneFinished,
) -> Result<Vec<Record>, Error> {
    plan.check()?;
    let (mut records, total) = (Vec::new(), PARTS * plan.scenes.len());
    for (i, name) in plan.scenes.iter().enumerate() {
        let tell = |share: f64, what: String| {
            progress(Progress { done: PARTS * i + (PARTS as f64 * share.min(1.0)) as usize, total, what });
        };
        let mut plan = plan.clone();
        if plan.thorough {
            let found =
                Found { entries: search::search(&plan, name, &|share, what| tell(0.7 * share, what))? };
            plan.found = Arc::new(found);
        }
        let begun = if plan.thorough { 0.7 } else { 0.0 };
        let own = scene_records(&plan, name, &|share, what| tell(begun + (1.0 - begun) * share, what))?;
        finished(&own, if plan.thorough { &plan.found.entries } else { &[] })?;
        records.extend(own);
    }
    Ok(records)
}

/// The records of one scene. `tell` receives the finished share of the work and the name of the next part.
fn scene_records(
    plan: &StudyPlan,
    name: &str,
    tell: &(dyn Fn(f64, String) + Sync),
) -> Result<Vec<Record>, Error> {
    let mut cells = Vec::new();
    let mut variants = Vec::new();
    for (point, &swept) in plan.points().iter().enumerate() {
        let loaded = plan.open_at(name, swept)?;
        let scene = &loaded.scene;
        for solver in plan.solvers_on(name, scene) {
            for &impacts in plan.impacts_on(scene) {
                for tuned in plan.candidates(&scene.name, solver, impacts, swept)? {
                    let widest_alone = plan.widest_alone(scene, &tuned.budget, solver);
                    let cell =
                        |frozen| ErrorCell { point, swept, solver, impacts, frozen, tuned, widest_alone };
                    cells.extend(plan.frozen_of(solver).into_iter().map(cell));
                }
            }
        }
        variants.push(loaded);
    }
    let steps = timing_steps(plan, variants.iter().map(|v| &v.scene));
    let jobs: Vec<(&ErrorCell, Order)> =
        cells.iter().flat_map(|cell| plan.orders.iter().map(move |&order| (cell, order))).collect();
    let (done, total) = (AtomicUsize::new(0), (jobs.len() + 1).max(2) as f64);
    let judged = in_parallel(&jobs, processors(), |&(cell, order)| {
        let share = done.fetch_add(1, Ordering::Relaxed) as f64 / total;
        tell(0.5 * share, format!("errors {name} · {} · {}", cell.solver.name, cell.text()));
        let width = match order {
            Order::Colored => plan.widths.iter().copied().max().unwrap_or(LaneWidth::W1),
            _ => LaneWidth::W1,
        };
        judge(plan, name, cell, (order, width), Some(steps))
    })?;
    let mut runs: Vec<TimedRun> = Vec::new();
    for (&(cell, order), JudgedRun { record, hash, .. }) in jobs.iter().zip(judged) {
        let widths = match order {
            Order::Colored if cell.widest_alone => &plan.widths[plan.widths.len() - 1..],
            _ if cell.widest_alone => &[],
            Order::Colored => &plan.widths,
            _ => &[LaneWidth::W1],
        };
        let own = |&width: &LaneWidth| TimedRun {
            record: Record { lanes: width.lanes(), hash: Some(format!("{hash:016x}")), ..record.clone() },
            point: cell.point,
            settings: settings(plan, cell, order, width),
        };
        runs.extend(widths.iter().map(own));
    }
    // What was asked for is judged in any case.
    if plan.steps.is_some() && !plan.only_given {
        leave_out_unseen(
            &mut runs.iter_mut().map(|run| &mut run.record).collect::<Vec<_>>(),
            variants[0].scene.steps,
        );
    }
    let class = SceneClass::of(&variants[0])?;
    runs.iter_mut().for_each(|run| run.record.class = class);
    if plan.errors_only {
        return Ok(runs.into_iter().map(|run| run.record).collect());
    }
    timed(plan, &variants, runs, &|share, what| tell(0.5 + 0.5 * share, what))
}

/// Times the settings of a scene, extends those that would be advised to a minute, and pushes them if that is wanted.
fn timed(
    plan: &StudyPlan,
    variants: &[Loaded],
    mut runs: Vec<TimedRun>,
    tell: &(dyn Fn(f64, String) + Sync),
) -> Result<Vec<Record>, Error> {
    let steps = timing_steps(plan, variants.iter().map(|v| &v.scene));
    time(plan, variants, steps, &mut runs, &|share, what| tell(0.8 * share, what))?;
    let mut records: Vec<Record> = runs.into_iter().map(|run| run.record).collect();
    if plan.sweep.is_none() && variants[0].rests() {
        let Loaded { scene, demands, .. } = &variants[0];
        horizon::run_on(scene, demands, &mut records, &|what| tell(0.9, what))?;
        if let Some(seed) = plan.poke {
            horizon::poke(scene, demands, &mut records, seed)?;
        }
    }
    Ok(records)
}

/// Times the settings of a study of errors, scene by scene, as [`run`] does.
///
/// Errors: as [`run`]; a record of another version, or of a scene that is not in the plan.
pub fn run_times(
    plan: &StudyPlan,
    records: &[Record],
    progress: &(dyn Fn(Progress) + Sync),
) -> Result<Vec<Record>, Error> {
    let scenes: Vec<&[Record]> = records.chunk_by(|a, b| a.scene == b.scene).collect();
    let (mut all, total) = (Vec::new(), PARTS * scenes.len());
    for (i, scene) in scenes.into_iter().enumerate() {
        let mut opened = plan.scenes.iter().filter_map(|name| plan.open(name).ok());
        let Some(loaded) = opened.find(|loaded| loaded.scene.name == scene[0].scene) else {
            return Err(Error::invalid("times", format!("the plan has no scene '{}'", scene[0].scene)));
        };
        let run =
            |record: &Record| Ok(TimedRun { record: record.clone(), point: 0, settings: record.settings()? });
        let runs = scene.iter().map(run).collect::<Result<Vec<_>, Error>>()?;
        let tell = |share: f64, what: String| {
            progress(Progress { done: PARTS * i + (PARTS as f64 * share.min(1.0)) as usize, total, what });
        };
        all.extend(timed(plan, &[loaded], runs, &tell)?);
    }
    Ok(all)
}

/// Removes tolerances for errors that runs of a scene that were shortened to `steps` could not observe.
fn leave_out_unseen(records: &mut [&mut Record], steps: u32) {
    let window = 2.0 * crate::lab::metrics::rest::REST_WINDOW;
    if records.first().is_some_and(|r| f64::from(steps) * r.dt < window) {
        // Rest is measured over the last second, which must be preceded by at least as long a run.
        records.iter_mut().for_each(|r| r.tolerances.rest = None);
    }
    if records.iter().all(|r| r.truth.is_none_or(|t| t.error.is_none())) {
        records.iter_mut().for_each(|r| r.tolerances.truth = None);
    }
}

/// Settings of a cell for one order and one width.
fn settings(plan: &StudyPlan, cell: &ErrorCell, order: Order, width: LaneWidth) -> Settings {
    let TunedBudget { budget, mut parameters } = cell.tuned;
    let mut extra_features = Features::NONE;
    if let Some((sweep, point)) = plan.sweep.as_ref().zip(cell.swept) {
        // Errors were ruled out when the plan was checked.
        let _ = sweep.set(point.value, &mut parameters, cell.solver);
        extra_features = sweep.features(point.value);
    }
    let ErrorCell { impacts, frozen, .. } = *cell;
    let own = Settings::new(cell.solver).exactly(width);
    Settings { order, budget, impacts, frozen, parameters, extra_features, ..own }
}

/// Number of steps of a timing run for scenes that take turns.
fn timing_steps<'a>(plan: &StudyPlan, scenes: impl IntoIterator<Item = &'a Scene>) -> u32 {
    scenes.into_iter().map(|scene| scene.steps).fold(plan.timing_steps, u32::min)
}

/// Runs a scene and measures its errors: to its end, with the hash after step `hash_at`, or without one only up to the
/// first violated requirement.
fn judge(
    plan: &StudyPlan,
    name: &str,
    cell: &ErrorCell,
    (order, width): (Order, LaneWidth),
    hash_at: Option<u32>,
) -> Result<JudgedRun, Error> {
    let mut loaded = plan.open_at(name, cell.swept)?;
    let own = settings(plan, cell, order, width);
    let parameters = overrides::words(cell.solver, &own.parameters);
    let own = Settings { record_impulses: true, observe_rule: true, ..own };
    let (mut hash, mut steps, mut sweeps) = (0, 0_u64, 0);
    let trial = Trial { until_broken: hash_at.is_none(), ..Trial::of(&mut loaded, own) };
    let found = trial.run(&mut |world| {
        if hash_at.is_some_and(|step| world.step_index() == u64::from(step)) {
            hash = world.state_hash();
        }
        if world.step_index() > 0 {
            (steps, sweeps) = (steps + 1, sweeps + world.counts().sweeps);
        }
        Ok(())
    })?;
    let TrialOutcome { errors, failure, truth, broken, world, .. } = found;
    let Loaded { scene, tolerances, unchecked, .. } = loaded;
    let Budget { substeps, .. } = cell.tuned.budget;
    let record = Record {
        lanes: width.lanes(),
        budget_text: cell.text(),
        swept: cell.swept,
        errors: failure.is_none().then(|| errors.unwrap_or_default()),
        truth,
        broken: broken.filter(|_| failure.is_none()),
        unchecked,
        failure: failure.map(FailedAt::from),
        parameters,
        ..Record::of(&scene, tolerances, &world.settings)
    };
    let work = (sweeps as f64 + steps as f64 * f64::from(substeps)) / (steps as f64).max(1.0);
    Ok(JudgedRun { record, hash, work })
}

/// Times all settings of a scene that did not diverge, in common rounds. `variants`: the scene at each value
/// of the sweep.
fn time(
    plan: &StudyPlan,
    variants: &[Loaded],
    steps: u32,
    runs: &mut [TimedRun],
    tell: &dyn Fn(f64, String),
) -> Result<(), Error> {
    let running = runs.iter().filter(|run| run.record.failure.is_none());
    let chosen = running.map(|run| (&variants[run.point].scene, run.settings.clone()));
    let mut interleaved = Interleaved::new(chosen.collect(), steps, plan.seed);
    let name = &variants[0].scene.name;
    for pass in 1..=plan.repeats {
        tell(f64::from(pass - 1) / f64::from(plan.repeats), format!("times {name} · pass {pass}"));
        interleaved.run(1)?;
    }
    for (i, run) in runs.iter_mut().filter(|run| run.record.failure.is_none()).enumerate() {
        match interleaved.sample(i) {
            Ok(sample) => {
                let hash = run.record.hash.take();
                run.record.bits_equal = hash.map(|hash| hash == format!("{:016x}", sample.hash));
                run.record.sample = Some(sample);
            }
            Err(divergence) => {
                run.record.errors = None;
                run.record.failure = Some(divergence.into());
            }
        }
    }
    for i in 0..runs.len() {
        let own = &runs[i].record;
        let key = |r: &Record| (r.solver, r.budget, r.impacts, r.frozen, r.swept);
        let is_own = |r: &Record| key(r) == key(own) && r.parameters == own.parameters;
        let one_lane = |r: &&Record| r.order == Order::Colored && r.lanes == 1 && is_own(r);
        let slow = runs.iter().map(|run| &run.record).find(one_lane).and_then(|r| r.sample.as_ref());
        let ratio = slow.zip(own.sample.as_ref()).and_then(|(slow, own)| Ratio::of(slow, own));
        runs[i].record.speed_up = ratio.map(|r| r.median);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_scenes_arrive_at_rest_as_are_placed() {
        let of = |name: &&&str| SceneClass::of(&open_scene(name, None, None, None).unwrap()).unwrap();
        let count = |class| DEFAULT_SCENES.iter().filter(|name| of(name) == class).count();
        assert_eq!(SceneClass::ALL.map(count), [5, 5, 4]);
    }

    #[test]
    fn every_solver_of_the_default_list_exists() {
        assert_eq!(default_solvers().len(), DEFAULT_SOLVERS.len());
        assert!(DEFAULT_SOLVERS.contains(&crate::engine::solvers::DEFAULT));
        assert_eq!(left_out(&DEFAULT_SOLVERS).len(), VARIANTS.len() - DEFAULT_SOLVERS.len());
        assert!(left_out(&["pgs"]).is_empty() && left_out(&[]).is_empty());
    }
}
