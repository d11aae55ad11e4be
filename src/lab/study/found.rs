//! Default settings of a study, as found by [`super::search`].
//!
//! `simpulse study --solvers all --thorough` rebuilds the list. The program ships with the list in
//! `budgets.csv`.

use crate::engine::constraints::Impacts;
use crate::engine::params::{Budget, Parameters};
use crate::engine::solvers::{Variant, find};
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::study::plan::seed_of;
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

/// A setting found for a solver on a scene: a line of the file. Those of a solver on a scene are sorted by work, the
/// least first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundSetting {
    /// Scene name with its size.
    pub scene: String,
    /// Name of the solver.
    pub solver: String,
    /// How impacts are solved.
    pub impacts: Impacts,
    substeps: u32,
    velocity_iterations: u32,
    relax_iterations: u32,
    position_iterations: u32,
    /// The parameters that differ from the solver's defaults.
    parameters: String,
}

impl FoundSetting {
    /// From a setting.
    pub fn new(scene: &str, solver: &Variant, impacts: Impacts, tuned: &TunedBudget) -> Self {
        let Budget { substeps, velocity_iterations, relax_iterations, position_iterations } = tuned.budget;
        FoundSetting {
            scene: scene.into(),
            solver: solver.name.into(),
            impacts,
            substeps,
            velocity_iterations,
            relax_iterations,
            position_iterations,
            parameters: overrides::changed(solver, &tuned.parameters),
        }
    }

    /// The setting itself. Errors: unknown solvers or parameters.
    fn tuned(&self) -> Result<TunedBudget, Error> {
        let FoundSetting { substeps, velocity_iterations, relax_iterations, position_iterations, .. } = *self;
        let budget = Budget { substeps, velocity_iterations, relax_iterations, position_iterations };
        Ok(TunedBudget { budget, parameters: overrides::of_words(find(&self.solver)?, &self.parameters)? })
    }
}

/// A list of found settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// The lines, grouped by scene.
    pub entries: Vec<FoundSetting>,
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
        // All members of an ensemble have the settings of the scene.
        let scene = seed_of(scene).map_or(scene, |(whole, _)| whole);
        let with = |impacts: Impacts| {
            let is = |e: &&FoundSetting| e.scene == scene && e.solver == solver.name && e.impacts == impacts;
            let settings: Vec<_> = self.entries.iter().filter(is).filter_map(|e| e.tuned().ok()).collect();
            Some(settings).filter(|settings| !settings.is_empty())
        };
        with(impacts).or_else(|| with(Impacts::Own))
    }

    /// Parses a list in CSV format. Errors: malformed text, and unknown solvers or parameters.
    pub fn of_csv(text: &str) -> Result<Found, Error> {
        let lines = csv::Reader::from_reader(text.as_bytes()).into_deserialize();
        let entries = lines.collect::<Result<Vec<FoundSetting>, _>>();
        let entries = entries.map_err(|e| Error::invalid(NAME, e.to_string()))?;
        entries.iter().try_for_each(|entry| entry.tuned().map(|_| ()))?;
        Ok(Found { entries })
    }

    /// The list in CSV format.
    pub fn to_csv(&self) -> Result<Vec<u8>, Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for line in &self.entries {
            writer.serialize(line).map_err(|e| Error::invalid(NAME, e.to_string()))?;
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
