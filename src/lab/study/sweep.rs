//! A sweep: one quantity takes several values, and everything else stays the same.
//!
//! The quantity belongs to solvers (a parameter), to the budget, to the scene, or to the kernels (their
//! features). Solvers without the quantity are left out. If the step length changes, runs keep their duration.
//! If friction changes, the scene has no reference value, because those of the catalog hold for the scene's own
//! friction.

use super::budget::{self, BudgetGrid};
use super::curve::distinct;
use crate::engine::constraints::Features;
use crate::engine::params::{Budget, Parameters};
use crate::engine::solvers::{VARIANTS, Variant};
use crate::lab::error::Error;
use crate::lab::interned::{self, Name};
use crate::lab::overrides;
use crate::lab::scenes::{self, Entry, Loaded};
use crate::lab::units::quantity;
use serde::{Deserialize, Serialize};
use std::fmt::{Display, Formatter};
use std::str::FromStr;

/// Maximum number of values in a sweep.
const MOST: usize = 100;

/// Quantities that a sweep can vary besides solver parameters: name, unit, kind.
const QUANTITIES: [(&str, &str, QuantityKind); 10] = [
    ("substeps", "", QuantityKind::Budget),
    ("iterations", "", QuantityKind::Budget),
    ("velocity_iterations", "", QuantityKind::Budget),
    ("relax_iterations", "", QuantityKind::Budget),
    ("position_iterations", "", QuantityKind::Budget),
    ("dt", "s", QuantityKind::Dt),
    ("friction", "", QuantityKind::Friction),
    ("mass_ratio", "", QuantityKind::MassRatio),
    ("size", "", QuantityKind::Size),
    ("features", "", QuantityKind::Features),
];

/// Kind of a quantity: what it belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum QuantityKind {
    /// A parameter of solvers.
    Parameter,
    /// A field of the budget. `iterations` are velocity sweeps; position sweeps for solvers without velocity sweeps.
    Budget,
    /// Step length of the scene (s).
    Dt,
    /// Friction coefficient of every shape (1).
    Friction,
    /// Size of a scene with one mass on another.
    MassRatio,
    /// Size of a scene: the number after its colon.
    Size,
    /// Features of the kernels: 0 for those of the scene, 1 for all.
    Features,
}

/// The quantity and its values, ascending.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct QuantitySweep {
    /// Name in `snake_case`.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// The distinct values.
    pub values: Vec<f64>,
    #[serde(skip)]
    kind: QuantityKind,
}

/// The swept quantity of one record.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swept {
    /// Name of the quantity.
    #[serde(deserialize_with = "interned::read")]
    pub name: Name,
    /// Its unit; empty for a pure number.
    #[serde(deserialize_with = "interned::read")]
    pub unit: Name,
    /// Value in that unit.
    pub value: f64,
}

impl Display for Swept {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", format!("{} {} {}", self.name, self.value, self.unit).trim_end())
    }
}

impl FromStr for QuantitySweep {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refuse = |message: String| Error::invalid("sweep", message);
        let Some((given, values)) = text.split_once('=') else {
            return Err(refuse(format!("'{text}' is not NAME=VALUE,VALUE,…")));
        };
        let parameters = || VARIANTS.iter().flat_map(|v| v.parameters);
        let snake = given.trim().replace('-', "_");
        let fixed = QUANTITIES.into_iter().find(|q| q.0 == snake);
        let own =
            || parameters().find(|p| p.name == snake).map(|p| (p.name, p.unit, QuantityKind::Parameter));
        let Some((name, unit, kind)) = fixed.or_else(own) else {
            let known = distinct(QUANTITIES.iter().map(|q| q.0).chain(parameters().map(|p| p.name)));
            return Err(Error::unknown("quantity to sweep", &snake, known.into_iter()));
        };
        if values.trim().is_empty() {
            return Err(refuse(format!("the list of values of {name} is empty")));
        }
        // A number without a unit is in the quantity's own unit.
        let read = |value: &str| {
            let plain = value.trim().parse::<f64>().is_ok();
            quantity("sweep", value, if plain { "" } else { unit })
        };
        let mut values = values.split(',').map(read).collect::<Result<Vec<f64>, Error>>()?;
        let is_count = !matches!(kind, QuantityKind::Parameter | QuantityKind::Dt | QuantityKind::Friction);
        if let (QuantityKind::Features, Some(broken)) =
            (kind, values.iter().find(|v| ![0.0, 1.0].contains(v)))
        {
            return Err(refuse(format!("{broken} is neither 0 (the features of the scene) nor 1 (all)")));
        }
        if let Some(broken) = values.iter().find(|v| is_count && (v.fract() != 0.0 || **v > 1e9)) {
            return Err(refuse(format!("{broken} is not a whole number, which {name} is")));
        }
        values.sort_by(f64::total_cmp);
        values.dedup();
        if values.len() > MOST {
            return Err(refuse(format!("{} values, where at most {MOST} are possible", values.len())));
        }
        Ok(QuantitySweep { name, unit, values, kind })
    }
}

impl QuantitySweep {
    /// The sweep of kernel features: those of the scene, then all.
    pub fn of_features() -> Self {
        QuantitySweep { name: "features", unit: "", values: vec![0.0, 1.0], kind: QuantityKind::Features }
    }

    /// The points of the sweep, in order.
    pub fn points(&self) -> impl Iterator<Item = Swept> {
        self.values.iter().map(|&value| Swept { name: self.name, unit: self.unit, value })
    }

    /// Whether this solver has the quantity, or the scene does.
    pub fn concerns(&self, variant: &Variant) -> bool {
        let uses = variant.uses;
        match self.name {
            "velocity_iterations" => uses.velocity,
            "relax_iterations" => uses.relax,
            "position_iterations" => uses.position,
            "iterations" => uses.velocity || uses.position,
            name => self.kind != QuantityKind::Parameter || variant.parameter(name).is_ok(),
        }
    }

    /// Checks the budget grid of a sweep: a solver's own budget, or a given one.
    ///
    /// Errors: a list of several values, or a list for the swept quantity.
    pub fn check_grid(&self, grid: &BudgetGrid) -> Result<(), Error> {
        let lists = [
            ("substeps", &grid.substeps),
            ("velocity-iterations", &grid.velocity_iterations),
            ("relax-iterations", &grid.relax_iterations),
            ("position-iterations", &grid.position_iterations),
        ];
        for (option, list) in lists {
            if list.len() > 1 {
                let message = format!("{} values, but a sweep needs one", list.len());
                return Err(Error::invalid(format!("--{option}"), message));
            }
            let is_own = option.replace('-', "_") == self.name
                || (self.name == "iterations" && option == "velocity-iterations");
            if !list.is_empty() && is_own {
                return Err(Error::invalid(format!("--{option}"), format!("--sweep {} sets it", self.name)));
            }
        }
        Ok(())
    }

    /// The field of the budget that the quantity sets; `None` for other quantities.
    fn field<'b>(&self, budget: &'b mut Budget, variant: &Variant) -> Option<&'b mut u32> {
        match self.name {
            "substeps" => Some(&mut budget.substeps),
            "iterations" if variant.uses.velocity => Some(&mut budget.velocity_iterations),
            "velocity_iterations" => Some(&mut budget.velocity_iterations),
            "relax_iterations" => Some(&mut budget.relax_iterations),
            "position_iterations" | "iterations" => Some(&mut budget.position_iterations),
            _ => None,
        }
    }

    /// `budget` with this value. Errors: a budget that the solver cannot run with.
    pub fn budget(&self, value: f64, mut budget: Budget, variant: &Variant) -> Result<Budget, Error> {
        if let Some(field) = self.field(&mut budget, variant) {
            *field = value as u32;
        }
        budget::check(&budget, variant)?;
        Ok(budget)
    }

    /// Sets this value in `parameters`. Errors: a value out of the parameter's range.
    pub fn set(&self, value: f64, parameters: &mut Parameters, variant: &Variant) -> Result<(), Error> {
        match self.kind {
            QuantityKind::Parameter => Ok(variant.set(parameters, self.name, value as f32)?),
            _ => Ok(()),
        }
    }

    /// Features that kernels have at this value in addition to those of the scene.
    pub fn features(&self, value: f64) -> Features {
        let all = self.kind == QuantityKind::Features && value > 0.0;
        if all { Features { damping: false, ..Features::FULL } } else { Features::NONE }
    }

    /// The name that opens the scene at this value. Errors: a scene without the quantity.
    pub fn scene_name(&self, value: f64, name: &str) -> Result<String, Error> {
        let is_ratio = self.kind == QuantityKind::MassRatio;
        if !is_ratio && self.kind != QuantityKind::Size {
            return Ok(name.to_string());
        }
        let (stem, _) = name.split_once(':').unwrap_or((name, ""));
        let has = |e: &&Entry| e.size.is_some_and(|s| !is_ratio || s.meaning == scenes::MASS_RATIO);
        if !scenes::CATALOG.iter().filter(has).any(|e| e.name == stem) {
            let known: Vec<&str> = scenes::CATALOG.iter().filter(has).map(|e| e.name).collect();
            let what = if is_ratio { "mass ratio" } else { "size" };
            let message = format!("scene '{name}' has no {what}; scenes with one: {}", known.join(", "));
            return Err(Error::invalid("sweep", message));
        }
        Ok(format!("{stem}:{value}"))
    }

    /// Step length (s) at this value; `None` unless the step length is swept.
    pub fn dt(&self, value: f64) -> Option<f64> {
        (self.kind == QuantityKind::Dt).then_some(value)
    }

    /// The scene at this value, under the same name as at the others. The reference value is kept only if it
    /// still holds.
    pub fn adapt(&self, value: f64, mut loaded: Loaded) -> Loaded {
        match self.kind {
            QuantityKind::Friction => {
                let shapes = loaded.scene.bodies.iter_mut().flat_map(|b| &mut b.shapes);
                shapes.for_each(|shape| shape.friction = value);
                loaded.truth = None;
                loaded.tolerances.truth = None;
            }
            QuantityKind::MassRatio | QuantityKind::Size => {
                let stem = loaded.scene.name.split(':').next().unwrap_or_default();
                loaded.scene.name = stem.to_string();
            }
            _ => {}
        }
        loaded
    }

    /// Rejects an impossible sweep: no solver has the quantity, the same parameter is also set, or a value is
    /// out of its range.
    pub fn check(
        &self,
        solvers: &[&'static Variant],
        overrides: &[overrides::Override],
        grid: &BudgetGrid,
    ) -> Result<(), Error> {
        self.check_grid(grid)?;
        if overrides.iter().any(|o| o.name == self.name) {
            return Err(Error::invalid("--set", format!("--sweep sets {}", self.name)));
        }
        if let Some(other) = solvers.iter().find(|v| !self.concerns(v)) {
            let having: Vec<&str> = VARIANTS.iter().filter(|v| self.concerns(v)).map(|v| v.name).collect();
            let having = having.join(", ");
            let message = format!("{} does not have {}; solvers that do: {having}", other.name, self.name);
            return Err(Error::invalid("sweep", message));
        }
        for (variant, &value) in solvers.iter().flat_map(|v| self.values.iter().map(move |value| (v, value)))
        {
            self.set(value, &mut variant.defaults(), variant)?;
            self.budget(value, variant.budget, variant)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;

    fn sweep(text: &str) -> QuantitySweep {
        text.parse().unwrap()
    }

    #[test]
    fn values_are_sorted_and_each_is_there_once() {
        let dt = sweep("dt = 10ms,0.005,0.02,5ms");
        assert_eq!((dt.name, dt.unit, &dt.values[..]), ("dt", "s", &[0.005, 0.01, 0.02][..]));
        assert_eq!(sweep("contact-hertz=60,15 Hz").values, [15.0, 60.0]);
        assert_eq!(sweep("mass-ratio=10").points().next().unwrap().value, 10.0);
    }

    #[test]
    fn what_is_no_sweep_is_refused_with_its_text() {
        let message = |text: &str| text.parse::<QuantitySweep>().unwrap_err().to_string();
        assert!(message("contact-hertz").contains("'contact-hertz' is not NAME=VALUE"));
        assert!(message("friction=0.1,,0.3").contains("''"));
        assert!(message("substeps=2.5").contains("2.5 is not a whole number"));
        assert!(message("features=2").contains("2 is neither 0"));
    }

    #[test]
    fn a_quantity_changes_what_it_belongs_to_and_nothing_else() {
        let (soft, pgs, xpbd) = (find("soft_step").unwrap(), find("pgs").unwrap(), find("xpbd").unwrap());
        let hertz = sweep("contact-hertz=60");
        assert!(hertz.concerns(soft) && !hertz.concerns(pgs));
        let mut parameters = soft.defaults();
        hertz.set(60.0, &mut parameters, soft).unwrap();
        assert_eq!(overrides::brief(soft, &parameters), "contact_hertz 60 Hz");
        assert_eq!(hertz.budget(60.0, soft.budget, soft).unwrap(), soft.budget);

        let iterations = sweep("iterations=3");
        assert_eq!(iterations.budget(3.0, pgs.budget, pgs).unwrap().velocity_iterations, 3);
        assert_eq!(iterations.budget(3.0, xpbd.budget, xpbd).unwrap().position_iterations, 3);
        assert!(iterations.budget(0.0, pgs.budget, pgs).is_err());

        let ratio = sweep("mass-ratio=10");
        assert_eq!(ratio.scene_name(10.0, "mass_ratio:100").unwrap(), "mass_ratio:10");
        let message = ratio.scene_name(10.0, "arch").unwrap_err().to_string();
        assert!(message.contains("'arch'") && message.contains("mass_ratio"), "{message}");

        let slippery = sweep("friction=0").adapt(0.0, scenes::load("stack:3").unwrap());
        assert!(slippery.truth.is_none() && slippery.tolerances.truth.is_none());
        assert!(slippery.scene.bodies.iter().flat_map(|b| &b.shapes).all(|s| s.friction == 0.0));
    }

    #[test]
    fn a_plan_that_contradicts_its_sweep_is_refused() {
        let (soft, pgs) = (find("soft_step").unwrap(), find("pgs").unwrap());
        let (hertz, grid) = (sweep("contact-hertz=15,60"), BudgetGrid::default());
        hertz.check(&[soft], &[], &grid).unwrap();
        let message = |r: Result<(), Error>| r.unwrap_err().to_string();
        assert!(message(hertz.check(&[soft, pgs], &[], &grid)).contains("pgs does not have contact_hertz"));
        let set = "contact_hertz=30".parse().unwrap();
        assert_eq!(message(hertz.check(&[soft], &[set], &grid)), "--set: --sweep sets contact_hertz");
        assert!(message(sweep("contact-hertz=1e9").check(&[soft], &[], &grid)).contains("contact_hertz"));
        let two = BudgetGrid { substeps: vec![2, 4], ..grid.clone() };
        assert!(message(hertz.check(&[soft], &[], &two)).starts_with("--substeps: 2 values"));
        let one = BudgetGrid { substeps: vec![2], ..grid };
        assert!(
            message(sweep("substeps=1,2").check(&[soft], &[], &one)).contains("--sweep substeps sets it")
        );
    }
}
