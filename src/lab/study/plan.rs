//! The plan of a study, and its checks.

use super::budget::BudgetGrid;
use super::cost;
use super::found::{Found, TunedBudget};
use super::sweep::{QuantitySweep, Swept};
use super::{DEFAULT_SCENES, default_solvers};
use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::params::Budget;
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::estimate;
use crate::lab::files;
use crate::lab::overrides::{self, Override};
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::scenes::{self, Loaded, Scene};
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
    /// Work per step. An empty grid stands for the [found](Self::found) settings.
    pub budgets: BudgetGrid,
    /// Settings to try if no budgets are given.
    pub found: Arc<Found>,
    /// Solver parameters, by name.
    pub overrides: Vec<Override>,
    /// The swept quantity; `None` in a study of budgets.
    pub sweep: Option<QuantitySweep>,
    /// Tolerances that override the scenes' own.
    pub tolerances: GivenTolerances,
    /// Steps of an error run; `None` for the scene's own number.
    pub steps: Option<u32>,
    /// Maximum number of steps in a timing run.
    pub timing_steps: u32,
    /// Timing runs per setting.
    pub repeats: u32,
    /// Random seed for the order of timing runs, and for scenes with random elements.
    pub seed: u64,
}

/// Estimated time of timing a setting in one lane (s) above which that run is left out.
const LONG: f64 = 1.0;

impl Default for StudyPlan {
    fn default() -> Self {
        StudyPlan {
            scenes: DEFAULT_SCENES.map(String::from).to_vec(),
            solvers: default_solvers(),
            widths: widths(native_width()),
            orders: vec![Order::Natural, Order::Colored],
            impacts: vec![Impacts::Own, Impacts::Waves],
            budgets: BudgetGrid::default(),
            found: Found::shipped(),
            overrides: Vec::new(),
            sweep: None,
            tolerances: GivenTolerances::default(),
            steps: None,
            timing_steps: 300,
            repeats: 3,
            seed: 1,
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
            let mut scene = None;
            for point in self.points() {
                scene = Some(self.open_at(name, point)?.scene);
            }
            let Some(scene) = scene else { continue };
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

    /// The treatments of impacts to run on a scene. Without restitution they are all the same, so only the
    /// first runs.
    pub(super) fn impacts_on(&self, scene: &Scene) -> &[Impacts] {
        let bounces = scene.bodies.iter().flat_map(|b| &b.shapes).any(|s| s.restitution > 0.0);
        if bounces { &self.impacts } else { &self.impacts[..self.impacts.len().min(1)] }
    }

    pub(super) fn open(&self, name: &str) -> Result<Loaded, Error> {
        open_scene(name, Some(self.seed), self.steps, None)
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
        open_scene(&name, Some(self.seed), Some(steps as u32), Some(dt))
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
    pub(super) fn widest_alone(
        &self,
        scene: &str,
        bodies: usize,
        steps: u32,
        budget: &Budget,
        solver: &Variant,
    ) -> bool {
        let own = StudyPlan::default();
        let is_found = self.searched() && self.found.of(scene, solver, Impacts::Own).is_some();
        let is_open = is_found && self.widths == own.widths && self.orders == own.orders;
        let step = estimate::step(bodies, cost::sweeps(budget, solver), 1);
        let timed = f64::from(steps.min(self.timing_steps)) * f64::from(self.repeats);
        is_open && timed * step > LONG
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

/// Opens a scene of the catalog or of a file (a name with a separator, or one that ends in `.json`). The
/// number of steps and their length `dt` (s) can be overridden. The reference value is then the one for that
/// run.
pub fn open_scene(
    name: &str,
    seed: Option<u64>,
    steps: Option<u32>,
    dt: Option<f64>,
) -> Result<Loaded, Error> {
    if is_path(name) {
        let mut scene = Scene::from_file(files::path_of(name))?;
        scene.steps = steps.unwrap_or(scene.steps);
        scene.dt = dt.unwrap_or(scene.dt);
        scene.validate()?;
        return scenes::expecting(scene);
    }
    let mut loaded = match seed {
        Some(seed) => scenes::load_with_seed(name, seed)?,
        None => scenes::load(name)?,
    };
    let scene = &mut loaded.scene;
    let (own_steps, own_dt) = (scene.steps, scene.dt);
    scene.steps = steps.unwrap_or(own_steps);
    scene.dt = dt.unwrap_or(own_dt);
    scene.validate()?;
    let (stem, size) = name.split_once(':').unwrap_or((name, ""));
    let entry = scenes::CATALOG.iter().find(|e| e.name == stem);
    match entry {
        Some(entry) if (scene.steps, scene.dt) != (own_steps, own_dt) => {
            let size = size.parse().ok().or(entry.size.map(|s| s.default));
            Ok(entry.loaded(loaded.scene, size.unwrap_or(0)))
        }
        _ => Ok(loaded),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::world::Settings;

    #[test]
    fn wide_lanes_run_by_themselves_where_they_are_native() {
        assert_eq!(widths(LaneWidth::W16), LaneWidth::ALL);
        for native in [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8] {
            assert_eq!(widths(native), [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8]);
        }
        assert_eq!(Settings::new(default_solvers()[0]).width, native_width());
    }
}
