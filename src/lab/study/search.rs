//! Search for the settings of a solver that are worth timing on a scene, with one rule and the same effort
//! for every solver.
//!
//! Candidates are [`SUBSTEPS`] × [`SWEEPS`] (at most [`MOST_SWEEPS`] sweeps in a step) at the solver's
//! standard parameters. Further ones are drawn at random from other values of its [stiffness](STIFFNESS), or
//! of the trial values in its row, up to [`MOST`] in all. Candidates are compared by errors alone, so no
//! clock is read and all cores can work:
//!
//! ```text
//! 54 candidates ─ 1/16 of the run ─► a quarter ─ 1/4 of the run ─► 6 ─ whole run ─► at most 5, which a study times
//! ```
//!
//! A candidate has an excess over the tolerances of the scene and a *work*: the sweeps and substeps of an
//! average step, as counted by the solver. Candidates are sorted by non-dominated fronts: a candidate beats
//! another one with at most as much work and less excess. This is successive halving (Jamieson and Talwalkar,
//! "Non-stochastic best arm identification and hyperparameter optimization", 2016), with fronts instead of
//! one loss. Unbeaten candidates are never dropped: before the first contact, short runs show no difference.
//! Of the last candidates, a study times those with the least work at each of the [`LEVELS`] of the
//! tolerances. Each of these must stand for a minute if the scene should come to rest. If they are fewer than
//! three, the next plausible ones are added. If none of the last candidates is plausible, the dropped ones get
//! whole runs as well, until one is. So no solver fails on a scene because of candidates that only had short
//! runs.

use super::found::{FoundSetting, TunedBudget};
use super::horizon::later;
use super::{ErrorCell, JudgedRun, Record, StudyPlan, judge, leave_out_unseen, settings};
use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::{Budget, Parameter, Parameters};
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::parallel::{in_parallel, processors};
use crate::lab::scenes::holds::Demand;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::scenes::{Loaded, Scene};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Substeps to try.
pub const SUBSTEPS: [u32; 5] = [1, 2, 4, 8, 14];
/// Sweeps per substep to try. Other kinds of sweeps keep their proportion in the standard budget.
pub const SWEEPS: [u32; 6] = [1, 2, 4, 8, 16, 32];
/// Maximum number of sweeps in a step.
pub const MOST_SWEEPS: u32 = 128;
/// Maximum number of candidates of a solver.
pub const MOST: usize = 54;
/// Stiffness values to try besides the standard one, if the solver's row lists none.
pub const STIFFNESS: [(&str, &[f32]); 4] = [
    ("baumgarte", &[0.1, 0.8]),
    ("correction", &[0.4, 0.8]),
    ("stiffness", &[0.08, 0.2]),
    ("beta", &[1e4, 1e6]),
];

/// Fractions of a run (as divisors) after which a quarter of the candidates remains.
const PARTS: [u32; 2] = [16, 4];
/// Minimum number of candidates with whole runs, and minimum number of timed settings if as many are plausible.
const LAST: usize = 6;
const TIMED: usize = 3;
/// Multiples of the tolerances at which the setting of least work is searched: those of
/// [`Accuracy::ALL`](crate::lab::scenes::tolerance::Accuracy::ALL), and those by which a
/// [ranking](super::ranking) varies.
pub const LEVELS: [f64; 5] = [2.0, 1.0, 0.5, 0.1, 0.01];

/// The rule in one sentence, for pages.
pub fn rule() -> String {
    let list = |values: &[u32]| values.iter().map(u32::to_string).collect::<Vec<_>>().join(", ");
    format!(
        "substeps {} × sweeps {} (at most {MOST_SWEEPS} in a step) × stiffness, at most {MOST} settings for each solver and scene, \
         in parallel order, by successive halving on errors; timed are those of least work at 2, 1, 0.5, 0.1 and 0.01 times the tolerances",
        list(&SUBSTEPS),
        list(&SWEEPS)
    )
}

/// Searches for settings of every solver of the plan on one of its scenes, on all cores. `tell` receives the
/// finished share of the work and the name of the next part.
///
/// Errors: a scene that cannot be opened or built.
pub fn search(
    plan: &StudyPlan,
    name: &str,
    tell: &(dyn Fn(f64, String) + Sync),
) -> Result<Vec<FoundSetting>, Error> {
    let loaded = plan.open(name)?;
    let rests = loaded.rests();
    let Loaded { scene, demands, .. } = loaded;
    let solvers = plan.solvers.iter().filter(|solver| scene.runs_on(solver).is_ok());
    let jobs: Vec<SearchJob> = solvers
        .flat_map(|&solver| plan.impacts_on(&scene).iter().map(move |&impacts| (solver, impacts)))
        .map(|(solver, impacts)| SearchJob {
            plan,
            name,
            scene: &scene,
            demands: &demands,
            rests,
            solver,
            impacts,
        })
        .collect();
    let (done, total) = (AtomicUsize::new(0), jobs.len() as f64);
    in_parallel(&jobs, processors(), |job| {
        let share = done.fetch_add(1, Ordering::Relaxed) as f64 / total;
        tell(share, format!("searching {name} · {}", job.solver.name));
        let best = job.best()?;
        Ok(best
            .iter()
            .map(|b| FoundSetting::new(&scene.name, job.solver, job.impacts, b))
            .collect::<Vec<_>>())
    })
    .map(|found| found.concat())
}

/// The candidates of a solver in steps of `dt` (s): those with standard parameters first, then the others as
/// drawn.
pub fn candidates(solver: &Variant, dt: f64) -> Vec<TunedBudget> {
    let (mut standard, mut others) = (Vec::new(), Vec::new());
    for budget in budgets(solver) {
        let h = dt as f32 / budget.substeps as f32;
        let mut list = parameters(solver, h, |p| match STIFFNESS.iter().find(|s| s.0 == p.name) {
            Some((_, values)) if p.trials.is_empty() => values,
            _ => p.trials,
        })
        .into_iter()
        .map(|parameters| TunedBudget { budget, parameters });
        standard.extend(list.next());
        others.extend(list);
    }
    others.shuffle(&mut Pcg64::seed_from_u64(1));
    others.truncate(MOST.saturating_sub(standard.len()));
    standard.extend(others);
    standard
}

/// The distinct budgets of the grid.
fn budgets(solver: &Variant) -> Vec<Budget> {
    let standard = solver.budget;
    let unit = if solver.uses.velocity { standard.velocity_iterations } else { standard.position_iterations };
    let mut budgets: Vec<Budget> = Vec::new();
    for substeps in SUBSTEPS {
        for sweeps in SWEEPS.into_iter().filter(|sweeps| substeps * sweeps <= MOST_SWEEPS) {
            // Other sweeps keep their ratio in the standard budget, with at least one each.
            let scaled = |own: u32| (own * sweeps / unit.max(1)).max(own.min(1));
            let budget = Budget {
                substeps,
                velocity_iterations: scaled(standard.velocity_iterations),
                relax_iterations: scaled(standard.relax_iterations),
                position_iterations: scaled(standard.position_iterations),
            };
            if !budgets.contains(&budget) {
                budgets.push(budget);
            }
        }
    }
    budgets
}

/// The standard parameters of a solver, then every combination of their `trials`, in substeps of `h` (s).
/// Stiffness values with the same effect count once.
pub fn parameters<'a>(solver: &Variant, h: f32, trials: impl Fn(&Parameter) -> &'a [f32]) -> Vec<Parameters> {
    let mut all = vec![solver.defaults()];
    for (place, parameter) in solver.parameters.iter().enumerate() {
        for known in 0..all.len() {
            for &trial in trials(parameter).iter().filter(|&&trial| trial != parameter.default) {
                let mut values = all[known];
                values[place] = trial;
                all.push(values);
            }
        }
    }
    let Some(softness) = solver.softness else { return all };
    let mut kept: Vec<Parameters> = Vec::new();
    for values in all {
        if !kept.iter().any(|k| softness(k, h) == softness(&values, h)) {
            kept.push(values);
        }
    }
    kept
}

/// The search for one solver on one scene.
struct SearchJob<'a> {
    plan: &'a StudyPlan,
    name: &'a str,
    scene: &'a Scene,
    demands: &'a [Demand],
    /// Whether the scene must come to rest.
    rests: bool,
    solver: &'static Variant,
    impacts: Impacts,
}

/// A candidate with the results of a run.
struct SearchTrial {
    candidate: TunedBudget,
    record: Record,
    /// Sweeps plus substeps of an average step.
    work: f64,
}

impl SearchTrial {
    /// Excess over the strictest tolerances. All values within them count as equal.
    fn excess(&self) -> f64 {
        self.record.excess_at(Accuracy::Exact.share()).max(1.0)
    }

    fn is_plausible(&self) -> bool {
        self.record.is_good(Accuracy::Plausible)
    }
}

impl SearchJob<'_> {
    /// The settings to time, the least work first.
    fn best(&self) -> Result<Vec<TunedBudget>, Error> {
        let mut left = candidates(self.solver, self.scene.dt);
        let mut dropped = Vec::new();
        for part in PARTS {
            let trials = self.judged(&left, Some((self.scene.steps / part).max(1)))?;
            let points: Vec<[f64; 2]> = trials.iter().map(|t| [t.work, t.excess()]).collect();
            let fronts = by_fronts(&points);
            let unbeaten = fronts.first().map_or(0, Vec::len);
            let kept = left.len().div_ceil(4).max(LAST).max(unbeaten).min(left.len());
            let order: Vec<TunedBudget> = fronts.into_iter().flatten().map(|i| left[i]).collect();
            dropped.splice(0..0, order[kept..].iter().copied());
            left = order[..kept].to_vec();
        }
        let mut trials = self.judged(&left, self.plan.steps)?;
        let mut dropped = dropped.into_iter();
        loop {
            let chosen = choose(&trials);
            let unknown = chosen.iter().copied().find(|&i| self.rests && trials[i].record.later.is_none());
            let none = !chosen.iter().any(|&i| trials[i].is_plausible());
            if let Some(i) = unknown {
                let (order, width) = self.order();
                let own = settings(self.plan, &self.cell(&trials[i].candidate), order, width);
                trials[i].record.later = Some(later(self.scene, self.demands, own, None)?);
            } else if let Some(next) = dropped.next().filter(|_| none) {
                trials.extend(self.judged(&[next], self.plan.steps)?);
            } else if chosen.is_empty() {
                // The nearest candidate. If none holds, the standard budget, which a reader expects.
                let nearest = trials.iter().min_by(|a, b| a.record.excess().total_cmp(&b.record.excess()));
                let nearest = nearest.filter(|t| t.record.excess().is_finite()).map(|t| t.candidate);
                let (budget, parameters) = (self.solver.budget, self.solver.defaults());
                return Ok(vec![nearest.unwrap_or(TunedBudget { budget, parameters })]);
            } else {
                return Ok(chosen.into_iter().map(|i| trials[i].candidate).collect());
            }
        }
    }

    fn cell(&self, &tuned: &TunedBudget) -> ErrorCell {
        let SearchJob { solver, impacts, .. } = *self;
        let frozen = Freezing::Own;
        ErrorCell { point: 0, swept: None, solver, impacts, frozen, tuned, widest_alone: false }
    }

    /// All widths of colored order give the same bits. The plan may contain natural order only.
    fn order(&self) -> (Order, LaneWidth) {
        match self.plan.orders[..] {
            [order] if order.is_serial() => (order, LaneWidth::W1),
            _ => (Order::Colored, native_width()),
        }
    }

    /// Runs candidates for `steps` steps, or for those of the scene.
    fn judged(&self, list: &[TunedBudget], steps: Option<u32>) -> Result<Vec<SearchTrial>, Error> {
        let plan = StudyPlan { steps, ..self.plan.clone() };
        let run = |candidate| judge(&plan, self.name, &self.cell(candidate), self.order(), None);
        let runs = list.iter().map(run).collect::<Result<Vec<JudgedRun>, Error>>()?;
        let (mut records, works): (Vec<Record>, Vec<f64>) =
            runs.into_iter().map(|run| (run.record, run.work)).unzip();
        let is_last = plan.only_given && steps == self.plan.steps;
        if let Some(steps) = steps.filter(|_| !is_last) {
            leave_out_unseen(&mut records.iter_mut().collect::<Vec<_>>(), steps);
        }
        let trials = list.iter().zip(records).zip(works);
        Ok(trials.map(|((&candidate, record), work)| SearchTrial { candidate, record, work }).collect())
    }
}

/// Indices of the settings to time: the least work at each of the [`LEVELS`], then the next plausible ones. Sorted
/// by work.
fn choose(trials: &[SearchTrial]) -> Vec<usize> {
    let within = |i: usize, level: f64| trials[i].record.excess_at(level) <= 1.0;
    let mut sorted: Vec<usize> = (0..trials.len()).filter(|&i| within(i, LEVELS[0])).collect();
    sorted.sort_by(|&a, &b| {
        let key = |i: usize| (trials[i].work, trials[i].excess());
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let cheapest = |level| sorted.iter().copied().find(|&i| within(i, level));
    let mut chosen: Vec<usize> = LEVELS.into_iter().filter_map(cheapest).collect();
    chosen.dedup();
    for &i in sorted.iter().filter(|&&i| within(i, 1.0)) {
        if chosen.len() < TIMED && !chosen.contains(&i) {
            chosen.push(i);
        }
    }
    sorted.retain(|i| chosen.contains(i));
    sorted
}

/// Indices of points (work, excess) by non-dominated fronts: first those that no other point beats with at
/// most as much work and less excess, then those that only the first front beats, and so on. Within a front,
/// the least excess comes first. Points with an infinite excess come last, sorted by work.
fn by_fronts(points: &[[f64; 2]]) -> Vec<Vec<usize>> {
    let (mut left, mut failed): (Vec<usize>, Vec<usize>) =
        (0..points.len()).partition(|&i| points[i][1].is_finite());
    let key = |&i: &usize, by: [usize; 2]| by.map(|k| points[i][k]);
    let order = |a: [f64; 2], b: [f64; 2]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]));
    let beats = |a: usize, b: usize| points[a][0] <= points[b][0] && points[a][1] < points[b][1];
    let mut fronts = Vec::new();
    while !left.is_empty() {
        let (mut front, rest): (Vec<usize>, Vec<usize>) =
            left.iter().partition(|&&i| !left.iter().any(|&j| beats(j, i)));
        front.sort_by(|a, b| order(key(a, [1, 0]), key(b, [1, 0])));
        fronts.push(front);
        left = rest;
    }
    failed.sort_by(|a, b| order(key(a, [0, 1]), key(b, [0, 1])));
    // Candidates with an infinite excess form one last front, beaten by any finite one.
    fronts.extend((!fronts.is_empty() && !failed.is_empty()).then_some(failed.clone()));
    if fronts.is_empty() {
        fronts = failed.into_iter().map(|i| vec![i]).collect();
    }
    fronts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{VARIANTS, find};
    use crate::lab::study::{budget, found::Found};

    #[test]
    fn every_solver_has_the_same_grid_and_no_more_candidates_than_any_other() {
        for solver in VARIANTS {
            let list = candidates(solver, 1.0 / 60.0);
            assert!((20..=MOST).contains(&list.len()), "{} {}", solver.name, list.len());
            assert!(list.iter().all(|c| budget::check(&c.budget, solver).is_ok()));
            assert!(list.iter().enumerate().all(|(i, c)| !list[..i].contains(c)), "{}", solver.name);
            for substeps in SUBSTEPS {
                assert!(
                    list.iter().any(|c| c.budget.substeps == substeps && c.parameters == solver.defaults())
                );
            }
        }
        let soft = candidates(find("soft_step").unwrap(), 1.0 / 60.0);
        let hertz = |value: f32| soft.iter().filter(|c| c.parameters[0] == value).count();
        assert!(hertz(30.0) >= 27 && hertz(120.0) > 3, "{soft:?}");
    }

    #[test]
    fn other_sweeps_keep_their_proportion() {
        let of = |name: &str, sweeps: u32| {
            let list = budgets(find(name).unwrap()).into_iter().filter(|b| b.substeps == 1);
            let key = |b: &Budget| {
                if b.velocity_iterations > 0 { b.velocity_iterations } else { b.position_iterations }
            };
            list.filter(|b| key(b) == sweeps)
                .map(|b| [b.relax_iterations, b.position_iterations])
                .collect::<Vec<_>>()
        };
        assert_eq!(of("pgs_soft", 16), [[8, 0]]);
        assert_eq!(of("pgs_ngs", 1), [[0, 1]]);
        assert_eq!(of("soft_step", 8), [[8, 0]]);
        assert_eq!(of("pgs", 32), [[0, 0]]);
    }

    #[test]
    fn fronts_come_one_after_the_other() {
        let infinite = f64::INFINITY;
        let points =
            [[1.0, 9.0], [2.0, 9.0], [3.0, 2.0], [1.0, infinite], [4.0, 3.0], [9.0, 1.0], [0.5, infinite]];
        // Point 1 has more work than point 0 but the same excess, so it is not beaten.
        assert_eq!(by_fronts(&points), [vec![5, 2, 0, 1], vec![4], vec![6, 3]]);
        assert_eq!(by_fronts(&points[6..]), [[0]]);
        assert!(by_fronts(&[]).is_empty());
    }

    #[test]
    fn a_search_finds_what_holds_and_what_needs_least_work() {
        let plan = StudyPlan {
            scenes: vec!["stack:2".into()],
            solvers: vec![find("pgs").unwrap(), find("jacobi").unwrap()],
            ..StudyPlan::default()
        };
        let search = || Found { entries: search(&plan, "stack:2", &|_, _| ()).unwrap() };
        let found = search();
        let pgs = found.of("stack:2", plan.solvers[0], Impacts::Own).unwrap();
        assert_eq!(pgs.len(), 3);
        let work = |c: &TunedBudget| c.budget.substeps * (1 + c.budget.velocity_iterations);
        assert!(pgs.windows(2).all(|w| work(&w[0]) <= work(&w[1])), "{pgs:?}");
        // The same twice, and the same from a file.
        assert_eq!(search(), found);
        assert_eq!(Found::of_csv(&String::from_utf8(found.to_csv().unwrap()).unwrap()).unwrap(), found);
        let none = found.of("stack:3", plan.solvers[0], Impacts::Own);
        assert_eq!(none, None);
    }
}
