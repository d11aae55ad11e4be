//! The plan of a study, and its checks.

use super::budget::{self, BudgetGrid};
use super::found::{Found, TunedBudget};
use super::sweep::{QuantitySweep, Swept};
use super::{DEFAULT_SCENES, default_solvers, horizon};
use crate::engine::bodies::BodyKind;
use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::Budget;
use crate::engine::solvers::{DEFAULT, Variant, find};
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::memory;
use crate::lab::overrides::{self, Override};
use crate::lab::parallel::processors;
use crate::lab::scenes::holds::Demand;
use crate::lab::scenes::tolerance::{GivenTolerances, Tolerance, Tolerances};
use crate::lab::scenes::{self, Loaded, Scene};
use crate::lab::units::si;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;

/// Everything that a study runs.
#[derive(Clone, Debug)]
pub struct StudyPlan {
    /// Scene names of the catalog, with sizes, or `.json` files.
    pub scenes: Vec<String>,
    /// Rows of [`VARIANTS`](crate::engine::solvers::VARIANTS).
    pub solvers: Vec<&'static Variant>,
    /// Lane widths of colored runs.
    pub widths: Vec<LaneWidth>,
    /// Constraint orders; only colored order uses lanes.
    pub orders: Vec<Order>,
    /// Treatments of impacts. Scenes without restitution run only the first.
    pub impacts: Vec<Impacts>,
    /// Treatments of frozen contacts. Of those that are the same for a solver, the first runs.
    pub frozen: Vec<Freezing>,
    /// Work per step. An empty grid stands for the [found](Self::found) settings.
    pub budgets: BudgetGrid,
    /// Settings to try if no budgets are given.
    pub found: Arc<Found>,
    /// Whether the settings of each solver on each scene are [searched](super::search) first.
    pub thorough: bool,
    /// Solver parameters, by name.
    pub overrides: Vec<Override>,
    /// The swept quantity; `None` in a study of budgets.
    pub sweep: Option<QuantitySweep>,
    /// Tolerances that override the scenes' own.
    pub tolerances: GivenTolerances,
    /// Whether errors without a tolerance in [`tolerances`](Self::tolerances) are not limited. The speed of a
    /// scene that must come to rest always is.
    pub only_given: bool,
    /// Scenes that must come to rest although their files do not say so, see [`Self::find_out`].
    pub rests: Vec<String>,
    /// Steps of an error run; `None` for the scene's own number.
    pub steps: Option<u32>,
    /// Maximum number of steps in a timing run.
    pub timing_steps: u32,
    /// Timing runs per setting.
    pub repeats: u32,
    /// Random seed for the order of timing runs, and for scenes with random elements.
    pub seed: u64,
    /// Seed of random pushes on the advised settings of scenes that must rest; `None` for none.
    pub poke: Option<u64>,
    /// Whether only errors are measured: no times, no extended runs.
    pub errors_only: bool,
    /// Of the pairs of scene and solver, every `share[1]`-th from `share[0]` (counted from 1) on; `None` for all.
    pub share: Option<[usize; 2]>,
}

/// Sweeps × bodies of timing a setting in one lane, about a second, above which that run is left out.
const LONG: f64 = 1.7e7;

/// Sweeps that take as long as the rest of a step.
const OTHERS: f64 = 6.0;

impl Default for StudyPlan {
    fn default() -> Self {
        StudyPlan {
            scenes: DEFAULT_SCENES.map(String::from).to_vec(),
            solvers: default_solvers(),
            widths: widths(native_width()),
            orders: vec![Order::Natural, Order::Colored],
            impacts: vec![Impacts::Own, Impacts::Waves],
            frozen: vec![Freezing::Own],
            budgets: BudgetGrid::default(),
            found: Found::shipped(),
            thorough: false,
            overrides: Vec::new(),
            sweep: None,
            tolerances: GivenTolerances::default(),
            only_given: false,
            rests: Vec::new(),
            steps: None,
            timing_steps: 300,
            repeats: 3,
            seed: 1,
            poke: None,
            errors_only: false,
            share: None,
        }
    }
}

/// 1, 4 and 8 lanes, and wider ones that are not emulated.
fn widths(native: LaneWidth) -> Vec<LaneWidth> {
    LaneWidth::ALL.into_iter().filter(|&w| w <= LaneWidth::W8 || w <= native).collect()
}

impl StudyPlan {
    /// An overview within seconds: short runs without repeats.
    pub fn quick() -> Self {
        StudyPlan { steps: Some(60), timing_steps: 36, repeats: 1, ..StudyPlan::default() }
    }

    /// Checks the plan. Errors: a plan that cannot run.
    pub fn check(&self) -> Result<(), Error> {
        let empty = [
            ("scenes", self.scenes.is_empty()),
            ("solvers", self.solvers.is_empty()),
            ("lanes", self.widths.is_empty()),
            ("orders", self.orders.is_empty()),
            ("impacts", self.impacts.is_empty()),
            ("frozen", self.frozen.is_empty()),
        ];
        if let Some((name, _)) = empty.into_iter().find(|e| e.1) {
            return Err(Error::invalid(name, "none given"));
        }
        overrides::check(&self.solvers, &self.overrides)?;
        let counts = [("steps", self.steps.unwrap_or(1)), ("repeats", self.repeats)];
        if let Some((name, _)) = counts.into_iter().find(|c| c.1 == 0) {
            return Err(Error::invalid(name, "0 is too few: at least 1 is needed"));
        }
        if let Some(sweep) = &self.sweep {
            sweep.check(&self.solvers, &self.overrides, &self.budgets)?;
        }
        for solver in &self.solvers {
            self.budgets(solver, None)?;
        }
        let mut names = Vec::new();
        for name in &self.scenes {
            // All points of a sweep share one scene name.
            let (mut scene, mut settings) = (None, 0);
            for point in self.points() {
                let own = self.open_at(name, point)?.scene;
                for solver in self.solvers.iter().filter(|solver| own.runs_on(solver).is_ok()) {
                    settings += self.candidates(&own.name, solver, self.impacts[0], point)?.len();
                }
                scene = Some(own);
            }
            let Some(scene) = scene else { continue };
            let worlds = settings
                * self.impacts_on(&scene).len()
                * self.frozen.len()
                * (self.widths.len() + self.orders.len());
            let threads = processors();
            memory::check(name, scene.bodies.len(), worlds, threads)?;
            if self.solvers.iter().all(|solver| scene.runs_on(solver).is_err()) {
                scene.runs_on(self.solvers[0])?;
            }
            if names.contains(&scene.name) {
                return Err(Error::invalid("scenes", format!("two are called '{}'", scene.name)));
            }
            names.push(scene.name);
        }
        Ok(())
    }

    /// One line for each solver that is left out on a scene because it does not support the scene's joints.
    ///
    /// Errors: as [`Self::check`].
    pub fn not_held(&self) -> Result<Vec<String>, Error> {
        let mut lines = Vec::new();
        for name in &self.scenes {
            let scene = self.open_at(name, self.points().pop().flatten())?.scene;
            lines.extend(
                self.solvers.iter().filter_map(|solver| Some(scene.runs_on(solver).err()?.to_string())),
            );
        }
        Ok(lines)
    }

    /// The solvers of this part that run on a scene; `name` is one of [`Self::scenes`].
    pub(super) fn solvers_on<'a>(
        &'a self,
        name: &str,
        scene: &'a Scene,
    ) -> impl Iterator<Item = &'static Variant> + 'a {
        let place = self.scenes.iter().position(|own| own == name).unwrap_or(0) * self.solvers.len();
        let is_own = move |i: usize| self.share.is_none_or(|[index, count]| (place + i) % count == index - 1);
        let own = self.solvers.iter().enumerate().filter(move |(i, _)| is_own(*i)).map(|(_, solver)| *solver);
        own.filter(|solver| scene.runs_on(solver).is_ok())
    }

    /// The treatments of impacts to run on a scene. Without restitution they are all the same, so only the
    /// first runs.
    pub(super) fn impacts_on(&self, scene: &Scene) -> &[Impacts] {
        let bounces = scene.bodies.iter().flat_map(|b| &b.shapes).any(|s| s.restitution > 0.0);
        if bounces { &self.impacts } else { &self.impacts[..self.impacts.len().min(1)] }
    }

    /// The treatments of frozen contacts to run under a solver: each with other limits.
    pub(super) fn frozen_of(&self, solver: &Variant) -> Vec<Freezing> {
        let mut kept: Vec<Freezing> = Vec::new();
        for &frozen in &self.frozen {
            let limits = |f: Freezing| f.limits(solver.frozen);
            if kept.iter().all(|&other| limits(other) != limits(frozen)) {
                kept.push(frozen);
            }
        }
        kept
    }

    /// Opens a scene, with the tolerances of the plan.
    pub(super) fn open(&self, name: &str) -> Result<Loaded, Error> {
        Ok(self.judged(name, open_scene(name, Some(self.seed), self.steps, None)?))
    }

    /// Replaces tolerances, and requires rest where that was found out.
    fn judged(&self, name: &str, mut loaded: Loaded) -> Loaded {
        if self.rests.iter().any(|own| own == name) {
            loaded.demands.push(Demand::Rests);
            loaded.tolerances.rest = Some(Tolerances::resting(&loaded.scene));
            loaded.unchecked = vec!["a reference value: the file has none".to_string()];
        }
        loaded.tolerances = loaded.tolerances.with(&self.tolerances);
        if self.only_given {
            let tolerances = &mut loaded.tolerances;
            let unlimited = Tolerance::new(f64::MAX, "not limited");
            if self.tolerances.penetration.is_none() {
                tolerances.penetration = unlimited;
            }
            if self.tolerances.residual.is_none() {
                tolerances.residual = unlimited;
            }
            tolerances.truth = tolerances.truth.filter(|_| self.tolerances.truth.is_some());
        }
        loaded
    }

    /// Finds out what the files of the plan do not say: a scene without `expect` runs for a minute under the
    /// default solver at its standard setting. If it comes to rest, every setting has to bring it to rest and
    /// is checked for a minute, as if its file said so. Returns a sentence for each scene.
    ///
    /// Errors: a scene that cannot be opened or built.
    pub fn find_out(&mut self) -> Result<Vec<String>, Error> {
        let mut said = Vec::new();
        for name in self.scenes.clone() {
            if !is_path(&name) {
                continue;
            }
            let loaded = open_scene(&name, Some(self.seed), None, None)?;
            if loaded.scene.expect.is_some() {
                continue;
            }
            let later = horizon::later(&loaded.scene, &loaded.demands, Settings::new(find(DEFAULT)?), None)?;
            let limit = self.tolerances.rest.unwrap_or(Tolerances::resting(&loaded.scene).value);
            let found = match (later.broken, later.rest_speed_m_s) {
                (None, Some(speed)) if speed <= limit => {
                    self.rests.push(name.clone());
                    format!(
                        "it comes to rest under {DEFAULT} ({} rms in the last second of a minute), so rest is \
                         required: it must come to rest and stand for a minute",
                        si(speed, "m/s")
                    )
                }
                (broken, speed) => {
                    let moves =
                        || format!("moves at {} after a minute", si(speed.unwrap_or(f64::NAN), "m/s"));
                    let why = broken.map_or_else(moves, |broken| broken.to_string());
                    format!(
                        "under {DEFAULT} it does not come to rest ({why}), so no rest is required: only that \
                         nothing blows up or passes through static or kinematic bodies, for its own {} steps",
                        self.steps.unwrap_or(loaded.scene.steps)
                    )
                }
            };
            said.push(format!("{name} does not say what must hold (\"expect\"). Found out: {found}."));
        }
        Ok(said)
    }

    /// The points of a sweep in order; a single `None` without a sweep.
    pub(super) fn points(&self) -> Vec<Option<Swept>> {
        self.sweep.as_ref().map_or(vec![None], |sweep| sweep.points().map(Some).collect())
    }

    /// Opens a scene at a point of the sweep.
    pub(super) fn open_at(&self, name: &str, point: Option<Swept>) -> Result<Loaded, Error> {
        let Some((sweep, Swept { value, .. })) = self.sweep.as_ref().zip(point) else {
            return self.open(name);
        };
        let name = sweep.scene_name(value, name)?;
        let Some(dt) = sweep.dt(value) else { return Ok(sweep.adapt(value, self.open(&name)?)) };
        let Scene { steps, dt: own, .. } = self.open(&name)?.scene;
        // The duration stays the same up to rounding; the last step may start before its end.
        let steps = (f64::from(steps) * own / dt * (1.0 - 1e-9)).ceil().max(1.0);
        Ok(self.judged(&name, open_scene(&name, Some(self.seed), Some(steps as u32), Some(dt))?))
    }

    /// The budgets of a solver. A point of a sweep has exactly one.
    pub(super) fn budgets(&self, variant: &Variant, point: Option<Swept>) -> Result<Vec<Budget>, Error> {
        let Some(sweep) = &self.sweep else { return self.budgets.budgets(variant) };
        let standard = self.budgets == BudgetGrid::default();
        let own = if standard { vec![variant.budget] } else { self.budgets.budgets(variant)? };
        let at = |budget| point.map_or(Ok(budget), |point| sweep.budget(point.value, budget, variant));
        own.into_iter().map(at).collect()
    }

    /// Whether the found settings are used where the list has some.
    pub fn searched(&self) -> bool {
        self.sweep.is_none() && self.budgets == BudgetGrid::default()
    }

    /// Scenes for which the list lacks settings of some solver.
    pub fn not_searched(&self) -> Vec<&str> {
        let found =
            |scene: &Scene, solver: &Variant| self.found.of(&scene.name, solver, Impacts::Own).is_some();
        let lacks = |name: &&String| {
            let Ok(Loaded { scene, .. }) = self.open(name) else { return true };
            let mut own = self.solvers.iter().filter(|solver| scene.runs_on(solver).is_ok());
            own.any(|solver| !found(&scene, solver))
        };
        self.scenes.iter().filter(lacks).map(String::as_str).collect()
    }

    /// Whether a setting runs only in colored order at the widest lanes. This applies to found settings whose
    /// timing in one lane takes more than [`LONG`], unless lanes or orders were given.
    pub(super) fn widest_alone(&self, scene: &Scene, budget: &Budget, solver: &Variant) -> bool {
        let own = StudyPlan::default();
        let is_found = self.searched() && self.found.of(&scene.name, solver, Impacts::Own).is_some();
        let is_open = is_found && self.widths == own.widths && self.orders == own.orders;
        let sweeps = OTHERS + f64::from(budget::sweeps(budget, solver));
        let timed = f64::from(scene.steps.min(self.timing_steps)) * f64::from(self.repeats);
        is_open && timed * scene.bodies.len() as f64 * sweeps > LONG
    }

    /// Settings of a solver to run on a scene: the found ones with the plan's parameters. The plan's budgets
    /// are used instead if some are given, in a sweep, and for scenes without a search.
    pub(super) fn candidates(
        &self,
        scene: &str,
        solver: &'static Variant,
        impacts: Impacts,
        point: Option<Swept>,
    ) -> Result<Vec<TunedBudget>, Error> {
        let found = self.found.of(scene, solver, impacts).filter(|_| self.searched());
        let Some(found) = found else {
            let parameters = overrides::values(solver, &self.overrides)?;
            let budgets = self.budgets(solver, point)?.into_iter();
            return Ok(budgets.map(|budget| TunedBudget { budget, parameters }).collect());
        };
        let mut candidates = Vec::new();
        for TunedBudget { budget, mut parameters } in found {
            for Override { name, value } in
                self.overrides.iter().filter(|o| solver.parameter(&o.name).is_ok())
            {
                solver.set(&mut parameters, name, *value)?;
            }
            let candidate = TunedBudget { budget, parameters };
            if !candidates.contains(&candidate) {
                candidates.push(candidate);
            }
        }
        Ok(candidates)
    }
}

/// Whether a name refers to a file: it ends in `.json` or contains a separator.
pub fn is_path(name: &str) -> bool {
    name.ends_with(".json") || name.contains(['/', '\\'])
}

/// Opens a scene of the catalog or of a file (a name with a separator, or one that ends in `.json`), or a member of an
/// [ensemble](seed_of). The
/// number of steps and their length `dt` (s) can be overridden. The reference value is then the one for that
/// run.
pub fn open_scene(
    name: &str,
    seed: Option<u64>,
    steps: Option<u32>,
    dt: Option<f64>,
) -> Result<Loaded, Error> {
    if let Some((whole, own)) = seed_of(name) {
        let mut loaded = open_scene(whole, Some(own), steps, dt)?;
        if !scenes::is_seeded(whole) {
            disturb(&mut loaded.scene, own);
        }
        loaded.scene.name += &format!("@{own}");
        return Ok(loaded);
    }
    if is_path(name) {
        let mut scene = Scene::from_file(name)?;
        scene.steps = steps.unwrap_or(scene.steps);
        scene.dt = dt.unwrap_or(scene.dt);
        scene.validate()?;
        return scenes::expecting(scene);
    }
    scenes::load_run(name, seed, steps, dt)
}

/// Name and seed of a member of an ensemble, `arch@3`: a scene from a seed. Scenes without a random element differ by
/// the velocities with which bodies start, see `DISTURBANCE`.
pub fn seed_of(name: &str) -> Option<(&str, u64)> {
    let (whole, seed) = name.rsplit_once('@')?;
    Some((whole, seed.parse().ok()?))
}

/// Errors: a seed beside the one that the name of a scene has.
pub fn check_seed(name: &str, seed: Option<u64>) -> Result<(), Error> {
    match (seed_of(name), seed) {
        (Some((whole, own)), Some(seed)) => {
            let message =
                format!("is {seed}, and '{name}' has {own}: leave one out, or name the scene '{whole}'");
            Err(Error::invalid("seed", message))
        }
        _ => Ok(()),
    }
}

/// Largest speed that a seed gives to a body of a scene without a random element, in length units per second: a fifth
/// of what is visible.
const DISTURBANCE: f64 = 1e-3;

/// Gives each dynamic body a random velocity in addition to its own.
fn disturb(scene: &mut Scene, seed: u64) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let limit = DISTURBANCE * scene.length_unit;
    for body in scene.bodies.iter_mut().filter(|body| body.kind == BodyKind::Dynamic) {
        for value in &mut body.velocity {
            *value += random.random_range(-limit..=limit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_moves_every_dynamic_body_a_little_or_makes_another_scene() {
        let open = |name: &str| open_scene(name, None, None, None).unwrap().scene;
        let (plain, one, two) = (open("stack:3"), open("stack:3@1"), open("stack:3@2"));
        assert_eq!((one.name.as_str(), one.bodies.len()), ("stack:3@1", plain.bodies.len()));
        for ((a, b), c) in one.bodies.iter().zip(&two.bodies).zip(&plain.bodies) {
            let moves = a.kind == BodyKind::Dynamic;
            assert_eq!(
                (a.velocity != c.velocity, a.velocity != b.velocity, a.position),
                (moves, moves, c.position)
            );
            assert!(a.velocity.iter().all(|v| v.abs() <= DISTURBANCE));
        }
        assert_ne!(open("circle_pile:9@1").bodies[3].position, open("circle_pile:9@2").bodies[3].position);
        assert_eq!(open("circle_pile:9@1").bodies[3].velocity, open("circle_pile:9").bodies[3].velocity);
        assert!(open_scene("stack:3@x", None, None, None).is_err() && seed_of("a@b@7") == Some(("a@b", 7)));
    }

    #[test]
    fn wide_lanes_run_by_themselves_where_they_are_native() {
        assert_eq!(widths(LaneWidth::W16), LaneWidth::ALL);
        for native in [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8] {
            assert_eq!(widths(native), [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8]);
        }
        assert_eq!(Settings::new(default_solvers()[0]).width, native_width());
    }
}
