//! Default settings of a study, as found by [`super::search`].
//!
//! `simpulse study --solvers all --thorough` rebuilds the list. The program ships with the list in
//! `budgets.csv`.

use crate::engine::constraints::Impacts;
use crate::engine::params::{Budget, Parameters};
use crate::engine::solvers::{Variant, find};
use crate::lab::error::Error;
use crate::lab::overrides;
use serde::{Deserialize, Serialize};
use std::sync::{Arc, LazyLock};

/// File name of the list in the output folder of a study with a search.
pub const NAME: &str = "budgets.csv";

/// A budget together with the solver's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TunedBudget {
    /// Work per step.
    pub budget: Budget,
    /// Parameter values, in the order of the solver's table.
    pub parameters: Parameters,
}

/// Settings found for one solver on one scene.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundBudgets {
    /// Scene name with its size.
    pub scene: String,
    /// Name of the solver.
    pub solver: &'static str,
    /// How impacts are solved.
    pub impacts: Impacts,
    /// The settings, sorted by work, the least first.
    pub candidates: Vec<TunedBudget>,
}

/// A list of found settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// The entries, grouped by scene.
    pub entries: Vec<FoundBudgets>,
}

/// A line of the file.
#[derive(Serialize, Deserialize)]
struct BudgetLine {
    scene: String,
    solver: String,
    impacts: Impacts,
    substeps: u32,
    velocity_iterations: u32,
    relax_iterations: u32,
    position_iterations: u32,
    parameters: String,
}

impl Found {
    /// The list that ships with the program.
    pub fn shipped() -> Arc<Found> {
        static SHIPPED: LazyLock<Arc<Found>> =
            LazyLock::new(|| Arc::new(Found::of_csv(include_str!("budgets.csv")).unwrap_or_default()));
        SHIPPED.clone()
    }

    /// Settings found for a solver on a scene with this treatment of impacts, or else with the solver's own.
    /// `None` if the list has neither.
    pub fn of(&self, scene: &str, solver: &Variant, impacts: Impacts) -> Option<Vec<TunedBudget>> {
        let with = |impacts: Impacts| {
            let is =
                |e: &&FoundBudgets| (e.scene.as_str(), e.solver, e.impacts) == (scene, solver.name, impacts);
            self.entries.iter().find(is).map(|e| e.candidates.clone())
        };
        with(impacts).or_else(|| with(Impacts::Own))
    }

    /// Parses a list in CSV format. Errors: malformed text, and unknown solvers or parameters.
    pub fn of_csv(text: &str) -> Result<Found, Error> {
        let mut entries: Vec<FoundBudgets> = Vec::new();
        for line in csv::Reader::from_reader(text.as_bytes()).deserialize() {
            let line: BudgetLine = line.map_err(|e| Error::invalid(NAME, e.to_string()))?;
            let solver = find(&line.solver)?;
            let candidate = TunedBudget {
                budget: Budget {
                    substeps: line.substeps,
                    velocity_iterations: line.velocity_iterations,
                    relax_iterations: line.relax_iterations,
                    position_iterations: line.position_iterations,
                },
                parameters: overrides::of_words(solver, &line.parameters)?,
            };
            match entries.last_mut() {
                Some(last)
                    if (&last.scene, last.solver, last.impacts)
                        == (&line.scene, solver.name, line.impacts) =>
                {
                    last.candidates.push(candidate);
                }
                _ => entries.push(FoundBudgets {
                    scene: line.scene,
                    solver: solver.name,
                    impacts: line.impacts,
                    candidates: vec![candidate],
                }),
            }
        }
        Ok(Found { entries })
    }

    /// The list in CSV format, one line per setting.
    pub fn to_csv(&self) -> Result<Vec<u8>, Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for FoundBudgets { scene, solver, impacts, candidates } in &self.entries {
            for TunedBudget { budget, parameters } in candidates {
                let line = BudgetLine {
                    scene: scene.clone(),
                    solver: (*solver).into(),
                    impacts: *impacts,
                    substeps: budget.substeps,
                    velocity_iterations: budget.velocity_iterations,
                    relax_iterations: budget.relax_iterations,
                    position_iterations: budget.position_iterations,
                    parameters: overrides::changed(find(solver)?, parameters),
                };
                writer.serialize(line).map_err(|e| Error::invalid(NAME, e.to_string()))?;
            }
        }
        writer.into_inner().map_err(|e| Error::invalid(NAME, e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::VARIANTS;
    use crate::lab::study::{DEFAULT_SCENES, DEFAULT_SOLVERS, budget, open_scene};

    /// Scenes that were not searched for every solver of the crate, because that takes too long.
    const LARGE: [&str; 3] = ["pyramid:30", "circle_pile:500", "high_mass_ratio_1"];

    #[test]
    fn the_shipped_list_has_every_solver_on_the_scenes_of_the_study() {
        let found = Found::of_csv(include_str!("budgets.csv")).unwrap();
        for name in DEFAULT_SCENES {
            let scene = open_scene(name, None, None, None).unwrap().scene;
            let of_study = |v: &&&Variant| !LARGE.contains(&name) || DEFAULT_SOLVERS.contains(&v.name);
            for solver in VARIANTS.iter().filter(of_study).filter(|solver| scene.runs_on(solver).is_ok()) {
                let candidates = found.of(&scene.name, solver, Impacts::Own).unwrap_or_default();
                assert!((1..=5).contains(&candidates.len()), "{} on {}", solver.name, scene.name);
                for candidate in candidates {
                    budget::check(&candidate.budget, solver).unwrap();
                }
            }
        }
        // Parsing and writing give back the same file.
        assert_eq!(found.to_csv().unwrap(), include_bytes!("budgets.csv"));
    }

    #[test]
    fn what_is_no_list_is_refused() {
        let head = "scene,solver,impacts,substeps,velocity_iterations,relax_iterations,position_iterations,parameters\n";
        let message = |line: &str| Found::of_csv(&format!("{head}{line}\n")).unwrap_err().to_string();
        assert!(message("arch,pgz,own,1,1,0,0,").contains("'pgz'"));
        assert!(message("arch,pgs,own,one,1,0,0,").contains("budgets.csv"));
        assert!(message("arch,pgs,own,1,1,0,0,penalty=2").contains("penalty"));
        assert_eq!(Found::of_csv(head).unwrap(), Found::default());
    }
}
