//! What a study tries, and what it refuses.

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
use crate::lab::overrides::{self, Override};
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::scenes::{self, Loaded, Scene};
use crate::lab::{estimate, files};
use std::sync::Arc;

/// What a study tries.
#[derive(Clone, Debug)]
pub struct StudyPlan {
    /// Names of the catalog, with sizes, or `.json` files.
    pub scenes: Vec<String>,
    /// Rows of [`VARIANTS`](crate::engine::solvers::VARIANTS).
    pub solvers: Vec<&'static Variant>,
    /// Lane widths of colored runs.
    pub widths: Vec<LaneWidth>,
    /// Constraint orders; only colored order has lanes.
    pub orders: Vec<Order>,
    /// Impact laws; scenes where nothing bounces run only the first.
    pub impacts: Vec<Impacts>,
    /// Work per step; where nothing is given, what was [found](Self::found).
    pub budgets: BudgetGrid,
    /// Settings to try where no budgets are given.
    pub found: Arc<Found>,
    /// Parameters of solvers, by name.
    pub overrides: Vec<Override>,
    /// The swept quantity; none in a study of budgets.
    pub sweep: Option<QuantitySweep>,
    /// Tolerances that override the scenes' own.
    pub tolerances: GivenTolerances,
    /// Steps of an error run; where none, the scene's own.
    pub steps: Option<u32>,
    /// Most steps of a timing run.
    pub timing_steps: u32,
    /// Timing runs per setting.
    pub repeats: u32,
    /// Random seed of the order of timing runs, and of scenes that have one.
    pub seed: u64,
}

/// Time of timing a setting in one lane (s), beyond which it is left out.
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

/// 1, 4 and 8 lanes, and wider ones where they are not emulated.
fn widths(native: LaneWidth) -> Vec<LaneWidth> {
    LaneWidth::ALL.into_iter().filter(|&w| w <= LaneWidth::W8 || w <= native).collect()
}

impl StudyPlan {
    /// An overview in seconds: short runs without repeats.
    pub fn quick() -> Self {
        StudyPlan { steps: Some(60), timing_steps: 36, repeats: 1, ..StudyPlan::default() }
    }

    /// Errors: a plan that cannot be run.
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
            // All points of a sweep have one name.
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

    /// What is left out because solvers do not hold what scenes have, in lines.
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

    /// The treatments of impacts that a scene runs with: where nothing bounces they are all the same.
    pub(super) fn impacts_on(&self, scene: &Scene) -> &[Impacts] {
        let bounces = scene.bodies.iter().flat_map(|b| &b.shapes).any(|s| s.restitution > 0.0);
        if bounces { &self.impacts } else { &self.impacts[..self.impacts.len().min(1)] }
    }

    pub(super) fn open(&self, name: &str) -> Result<Loaded, Error> {
        open_scene(name, Some(self.seed), self.steps, None)
    }

    /// What a sweep sets, one after the other; one nothing without a sweep.
    pub(super) fn points(&self) -> Vec<Option<Swept>> {
        self.sweep.as_ref().map_or(vec![None], |sweep| sweep.points().map(Some).collect())
    }

    /// A scene at a point of the sweep.
    pub(super) fn open_at(&self, name: &str, point: Option<Swept>) -> Result<Loaded, Error> {
        let Some((sweep, Swept { value, .. })) = self.sweep.as_ref().zip(point) else {
            return self.open(name);
        };
        let name = sweep.scene_name(value, name)?;
        let Some(dt) = sweep.dt(value) else { return Ok(sweep.adapt(value, self.open(&name)?)) };
        let Scene { steps, dt: own, .. } = self.open(&name)?.scene;
        // As long a time, up to rounding; the last step may begin before its end.
        let steps = (f64::from(steps) * own / dt * (1.0 - 1e-9)).ceil().max(1.0);
        open_scene(&name, Some(self.seed), Some(steps as u32), Some(dt))
    }

    /// The budgets of a solver; at a point of a sweep there is one.
    pub(super) fn budgets(&self, variant: &Variant, point: Option<Swept>) -> Result<Vec<Budget>, Error> {
        let Some(sweep) = &self.sweep else { return self.budgets.budgets(variant) };
        let standard = self.budgets == BudgetGrid::default();
        let own = if standard { vec![variant.budget] } else { self.budgets.budgets(variant)? };
        let at = |budget| point.map_or(Ok(budget), |point| sweep.budget(point.value, budget, variant));
        own.into_iter().map(at).collect()
    }

    /// Whether settings are those that were found, where there are any.
    pub fn searched(&self) -> bool {
        self.sweep.is_none() && self.budgets == BudgetGrid::default()
    }

    /// Scenes on which the settings of some solver were not searched.
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

    /// Whether a setting runs in colored order at the widest lanes alone: what was found and takes more than [`LONG`] for its
    /// timing in one lane, where nobody asked for lanes or orders.
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

    /// What a solver tries on a scene: the settings that were found for it, under the plan's parameters; the budgets
    /// of the plan where some are given, in a sweep, and where nobody has searched.
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

/// Whether a name means a file: it ends in `.json` or has a separator.
pub fn is_path(name: &str) -> bool {
    name.ends_with(".json") || name.contains(['/', '\\'])
}

/// A scene of the catalog or of a file (a name with a separator, or that ends in `.json`), for
/// so many steps of length `dt` (s) if these are given; what is known about it is for that run.
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
