//! The grid, the bisection, and the rule for skipping settings.

use super::{SearchPlan, SearchSetting, TRIAL_STEPS, Trial, excess, fastest, rank, widths};
use crate::engine::params::Budget;
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::scenes::Scene;
use crate::lab::study::horizon;
use crate::lab::study::interleave::time_in_turns;
use crate::lab::study::search::parameters;
use crate::lab::study::{FailedAt, Progress, observe, open_scene};
use std::time::Instant;

/// Limits of the grid: substeps, and sweeps of one kind per step.
const MOST_SUBSTEPS: u32 = 32;
const MOST_SWEEPS: u32 = 64;

/// A budget must be too slow by this factor before larger ones are skipped. A badly solved scene moves more
/// and has more contacts, so a larger budget can be somewhat faster: on the pyramid of 40 rows, four substeps
/// take 0.9 times the time of two.
const TOO_SLOW: f64 = 1.5;

/// Number of good-enough settings to refine.
const REFINED: usize = 4;

/// The state of a search.
pub struct Search<'a> {
    plan: &'a SearchPlan,
    scene: &'a Scene,
    progress: &'a dyn Fn(Progress),
    start: Instant,
    total: usize,
    /// All trials so far.
    pub trials: Vec<Trial>,
    /// Number of settings skipped because they can only cost more.
    pub left_out: usize,
    /// Whether the time limit was reached before the search was done.
    pub is_cut_short: bool,
}

/// The parts of a budget.
fn parts(b: &Budget) -> [u32; 4] {
    [b.substeps, b.velocity_iterations, b.relax_iterations, b.position_iterations]
}

fn from_parts([substeps, velocity_iterations, relax_iterations, position_iterations]: [u32; 4]) -> Budget {
    Budget { substeps, velocity_iterations, relax_iterations, position_iterations }
}

/// Whether `large` is at least as large as `small` in every part.
fn contains(large: &Budget, small: &Budget) -> bool {
    parts(large).iter().zip(parts(small)).all(|(l, s)| *l >= s)
}

fn sweeps(b: &Budget) -> u32 {
    b.substeps * (b.velocity_iterations + b.relax_iterations + b.position_iterations)
}

/// Budgets of a solver: powers of two of substeps and of velocity and position sweeps, which are equal;
/// relaxing sweeps as in the standard budget.
pub fn budgets(solver: &Variant) -> Vec<Budget> {
    let mut budgets = Vec::new();
    let doubled = |most: u32| (0..).map(|i| 1 << i).take_while(move |&n: &u32| n <= most);
    for substeps in doubled(MOST_SUBSTEPS) {
        for n in doubled(MOST_SWEEPS / substeps) {
            let or = |used: bool, own: u32| if used { n } else { own };
            let standard = solver.budget;
            let budget = Budget {
                substeps,
                velocity_iterations: or(solver.uses.velocity, standard.velocity_iterations),
                position_iterations: or(solver.uses.position, standard.position_iterations),
                ..standard
            };
            if !budgets.contains(&budget) {
                budgets.push(budget);
            }
        }
    }
    budgets
}

impl<'a> Search<'a> {
    /// A search without trials; its clock starts now.
    pub fn new(plan: &'a SearchPlan, scene: &'a Scene, progress: &'a dyn Fn(Progress)) -> Self {
        Search {
            plan,
            scene,
            progress,
            start: Instant::now(),
            total: 0,
            trials: Vec::new(),
            left_out: 0,
            is_cut_short: false,
        }
    }

    /// Tries the grid, the least work first, so that skippable settings are recognized early.
    pub fn coarse(&mut self) -> Result<(), Error> {
        let orders: &[Order] = match self.plan.widths.iter().any(|w| w.lanes() == 1) {
            true => &[Order::Natural, Order::Colored],
            false => &[Order::Colored],
        };
        let mut grid = Vec::new();
        for &solver in &self.plan.solvers {
            for budget in budgets(solver) {
                let h = self.scene.dt as f32 / budget.substeps as f32;
                for parameters in parameters(solver, h, |p| p.trials) {
                    let impacts = self.plan.impacts;
                    let of = |&order: &Order| SearchSetting { solver, order, budget, parameters, impacts };
                    grid.extend(orders.iter().map(of));
                }
            }
        }
        grid.sort_by_key(|s| sweeps(&s.budget));
        self.total = grid.len();
        for setting in grid {
            if !self.consider(setting)? {
                break;
            }
        }
        Ok(())
    }

    /// Lowers each part of the best good-enough settings in turn, by bisection.
    pub fn refine(&mut self) -> Result<(), Error> {
        let mut good: Vec<Trial> = self.trials.iter().filter(|t| t.is_good()).cloned().collect();
        rank(&mut good);
        for trial in good.iter().take(REFINED) {
            let mut setting = trial.setting;
            for part in 0..4 {
                // The grid contains half of the part; a part of 0 or 1 cannot be lowered.
                let (mut low, mut high) = (parts(&setting.budget)[part] / 2, parts(&setting.budget)[part]);
                while high - low > 1 && low > 0 {
                    let middle = low + (high - low) / 2;
                    let mut lowered = parts(&setting.budget);
                    lowered[part] = middle;
                    let candidate = SearchSetting { budget: from_parts(lowered), ..setting };
                    if !self.consider(candidate)? {
                        return Ok(());
                    }
                    let is_good = self.trial_of(&candidate).is_some_and(Trial::is_good);
                    if is_good {
                        (high, setting) = (middle, candidate);
                    } else {
                        low = middle;
                    }
                }
            }
        }
        Ok(())
    }

    fn trial_of(&self, s: &SearchSetting) -> Option<&Trial> {
        self.trials.iter().find(|t| same(&t.setting, s) && t.setting.budget == s.budget)
    }

    /// Tries a setting unless it is already known or can be skipped. Returns whether time is left.
    fn consider(&mut self, setting: SearchSetting) -> Result<bool, Error> {
        if self.start.elapsed().as_secs_f64() > self.plan.seconds {
            self.is_cut_short = true;
            return Ok(false);
        }
        if self.trial_of(&setting).is_some() {
            return Ok(true);
        }
        if self.can_only_cost_more(&setting) {
            self.left_out += 1;
            return Ok(true);
        }
        let done = self.trials.len() + self.left_out;
        self.total = self.total.max(done + 1);
        (self.progress)(Progress { done, total: self.total, what: setting.text() });
        let trial = self.run(setting)?;
        self.trials.push(trial);
        Ok(true)
    }

    /// Whether the setting can be skipped, see the [module above](super).
    fn can_only_cost_more(&self, s: &SearchSetting) -> bool {
        let fastest =
            self.trials.iter().filter(|t| t.is_good()).map(Trial::time_ns).fold(f64::INFINITY, f64::min);
        let limit = fastest.min(self.plan.limits.time_ns.unwrap_or(f64::INFINITY)) * TOO_SLOW;
        self.trials.iter().any(|t| {
            let own = &t.setting;
            let smaller = contains(&s.budget, &own.budget) && s.budget != own.budget;
            let is_slow = t.time.is_some_and(|time| time.median_ns > limit);
            let alike = own.solver.name == s.solver.name && own.order == s.order;
            smaller && alike && (is_slow || (t.is_good() && same(own, s)))
        })
    }

    /// Errors from a whole run, time from a short interleaved timing of all widths.
    fn run(&self, setting: SearchSetting) -> Result<Trial, Error> {
        let loaded = open_scene(&self.plan.scene, Some(self.plan.seed), self.plan.steps, None)?;
        let widths = widths(self.plan, setting.order);
        let widest = widths.iter().copied().max().unwrap_or(crate::engine::lanes::LaneWidth::W1);
        let outcome = observe(loaded, setting.settings(widest), 0)?;
        let mut trial = Trial {
            setting,
            time: None,
            sample: None,
            errors: outcome.errors.ok(),
            truth: outcome.truth,
            failure: outcome.errors.err().map(FailedAt::from),
            broken: outcome.broken,
            later: None,
            excess: f64::INFINITY,
        };
        if trial.errors.is_some() {
            let settings: Vec<_> = widths.iter().map(|&w| setting.settings(w)).collect();
            let samples =
                time_in_turns(self.scene, &settings, self.scene.steps.min(TRIAL_STEPS), 1, self.plan.seed)?;
            let finished =
                widths.iter().zip(&samples).filter_map(|(&w, sample)| Some((w, sample.as_ref().ok()?)));
            trial.time = fastest(finished).map(|(time, _)| time);
            trial.excess = excess(&self.plan.limits, &trial);
            let loaded = open_scene(&self.plan.scene, Some(self.plan.seed), self.plan.steps, None)?;
            if trial.is_good() && loaded.rests() {
                trial.later = Some(horizon::later(&loaded, setting.settings(widest))?);
                trial.excess = excess(&self.plan.limits, &trial);
            }
        }
        Ok(trial)
    }
}

/// Whether two settings differ at most in their budget.
fn same(a: &SearchSetting, b: &SearchSetting) -> bool {
    a.solver.name == b.solver.name && a.order == b.order && a.parameters == b.parameters
}

#[cfg(test)]
mod tests {
    use super::super::limits::Limits;
    use super::super::tests::trial;
    use super::*;
    use crate::engine::constraints::Impacts;
    use crate::engine::lanes::LaneWidth;
    use crate::engine::solvers::{VARIANTS, find};
    use crate::lab::scenes;

    #[test]
    fn the_grid_doubles_and_is_bounded() {
        for variant in &VARIANTS {
            let grid = budgets(variant);
            assert!(
                grid.iter().all(|b| b.substeps * b.velocity_iterations <= MOST_SWEEPS),
                "{}",
                variant.name
            );
            assert!(grid.iter().all(|b| crate::lab::study::budget::check(b, variant).is_ok()));
            assert!(grid.iter().all(|b| b.substeps.is_power_of_two()));
        }
        // 1 to 64 sweeps with 1 substep, 1 to 32 with 2, … 1 and 2 with 32.
        assert_eq!(budgets(find("pgs").unwrap()).len(), 7 + 6 + 5 + 4 + 3 + 2);
    }

    #[test]
    fn capped_stiffnesses_count_once() {
        let soft = find("soft_step").unwrap();
        // The cap is an eighth of the substep rate: 7.5 Hz at 1/60 s, 60 at 1/480, 240 at 1/1920.
        let count = |rate: f32| parameters(soft, 1.0 / rate, |p| p.trials).len();
        assert_eq!([count(60.0), count(480.0), count(1920.0)], [1, 3, 4]);
        let pgs = find("pgs").unwrap();
        assert_eq!(parameters(pgs, 0.01, |p| p.trials), [pgs.defaults()]);
    }

    fn plan(limits: Limits) -> SearchPlan {
        SearchPlan {
            scene: "stack:1".to_string(),
            impacts: Impacts::Own,
            limits,
            solvers: vec![find("pgs").unwrap()],
            widths: vec![LaneWidth::W8],
            steps: None,
            repeats: 1,
            seed: 1,
            seconds: 1e9,
        }
    }

    #[test]
    fn only_what_costs_more_is_left_out() {
        let scene = scenes::load("stack:1").unwrap().scene;
        let plan = plan(Limits { time_ns: Some(50.0), ..Limits::default() });
        let mut search = Search::new(&plan, &scene, &|_| ());
        let known = |velocity: u32, time: f64, excess: f64| {
            let mut known = trial(time, excess);
            known.setting.budget.velocity_iterations = velocity;
            known
        };
        let asked = |search: &Search, velocity: u32| {
            let setting = known(velocity, 0.0, 0.0).setting;
            let natural = SearchSetting { order: Order::Natural, ..setting };
            [search.can_only_cost_more(&setting), search.can_only_cost_more(&natural)]
        };
        search.trials = vec![known(8, 10.0, 2.0)];
        assert_eq!(asked(&search, 16), [false, false]);
        // Good with 16 sweeps in 20 ns: 17 are skipped, 15 are not, nor is the other order.
        search.trials.push(known(16, 20.0, 0.5));
        assert_eq!([asked(&search, 15), asked(&search, 17)], [[false, false], [true, false]]);
        // Not good, but slower than 1.5 times the fastest good one, or than 1.5 times the limit.
        search.trials = vec![known(8, 31.0, 2.0), known(64, 20.0, 0.5)];
        assert_eq!(asked(&search, 16), [true, false]);
        search.trials = vec![known(8, 76.0, 2.0)];
        assert_eq!(asked(&search, 16), [true, false]);
        search.trials = vec![known(8, 74.0, 2.0)];
        assert_eq!(asked(&search, 16), [false, false]);
    }

    #[test]
    fn bisection_ends_at_the_least_that_is_good() {
        let scene = scenes::load("stack:4").unwrap().scene;
        let limits = Limits { penetration: Some(2e-3), ..Limits::default() };
        let plan = SearchPlan { scene: "stack:4".to_string(), steps: Some(60), ..plan(limits) };
        let mut search = Search::new(&plan, &scene, &|_| ());
        // A good setting so slow that no time causes a skip.
        let mut known = trial(1e15, 0.5);
        known.setting.budget = from_parts([1, 64, 0, 0]);
        search.trials.push(known);
        search.refine().unwrap();
        let tried: Vec<(u32, bool)> =
            search.trials[1..].iter().map(|t| (t.setting.budget.velocity_iterations, t.is_good())).collect();
        // 48 first, then toward the boundary between the largest bad and the smallest good one.
        assert_eq!((tried.len(), tried[0].0), (5, 48));
        let least_good = tried.iter().filter(|t| t.1).map(|t| t.0).min().unwrap_or(64);
        let most_bad = tried.iter().filter(|t| !t.1).map(|t| t.0).max().unwrap_or(32);
        assert_eq!(least_good, most_bad + 1, "{tried:?}");
    }

    #[test]
    fn no_time_is_no_trial() {
        let scene = scenes::load("stack:1").unwrap().scene;
        let plan = SearchPlan { seconds: -1.0, ..plan(Limits::default()) };
        let mut search = Search::new(&plan, &scene, &|_| ());
        search.coarse().unwrap();
        assert!(search.is_cut_short && search.trials.is_empty());
    }
}
