//! The study as `study.csv` and `study.json`.

use super::columns;
use super::environment::Environment;
use crate::engine::params;
use crate::engine::solvers::Uses;
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::study::{Record, StudyPlan, search};
use serde_json::{Value, json};

/// `study.csv`, see [`columns`].
pub fn csv(records: &[Record], environment: &Environment) -> Result<Vec<u8>, Error> {
    columns::study_csv(records, environment)
}

/// All settings of a study, chosen by the caller or constant.
pub fn settings(plan: &StudyPlan) -> Value {
    #[derive(serde::Serialize)]
    struct ExportedSolver {
        name: &'static str,
        source: &'static str,
        standard_budget: params::Budget,
        uses: Uses,
        parameters: serde_json::Map<String, Value>,
    }
    let solver = |v: &&'static crate::engine::solvers::Variant| ExportedSolver {
        name: v.name,
        source: v.source,
        standard_budget: v.budget,
        uses: v.uses,
        parameters: overrides::values(v, &plan.overrides)
            .map_or_else(|_| Default::default(), |values| overrides::by_name(v, &values)),
    };
    let standard = plan.solvers.first().map(|v| {
        let s = Settings::new(v);
        json!({
            "broadphase": format!("{:?}", s.broadphase),
            "integrator": s.integrator,
            "rotation": s.rotation,
        })
    });
    json!({
        "scenes": plan.scenes,
        "solvers": plan.solvers.iter().map(solver).collect::<Vec<_>>(),
        "lanes": plan.widths.iter().map(|w| w.lanes()).collect::<Vec<_>>(),
        "orders": plan.orders,
        "impacts": plan.impacts,
        "frozen": plan.frozen.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "budgets": plan.budgets,
        "budget_search": plan.searched().then(|| json!({"rule": search::rule(), "not_searched": plan.not_searched()})),
        "steps": plan.steps,
        "timing_steps": plan.timing_steps,
        "repeats": plan.repeats,
        "set": plan.overrides,
        "sweep": plan.sweep,
        "tolerance": plan.tolerances,
        "found_to_rest": plan.rests,
        "seed": plan.seed,
        "world": standard,
        "constants": {
            "linear_slop_m": columns::decimal(params::LINEAR_SLOP),
            "speculative_distance_m": columns::decimal(params::SPECULATIVE_DISTANCE),
            "aabb_margin_m": columns::decimal(params::AABB_MARGIN),
            "restitution_threshold_m_s": columns::decimal(params::RESTITUTION_THRESHOLD),
            "max_position_correction_m": columns::decimal(params::MAX_POSITION_CORRECTION),
            "diverged_speed_m_s": columns::decimal(params::DIVERGED_SPEED),
        },
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::report::columns::STUDY;
    use crate::lab::study::record::tests::record;

    #[test]
    fn every_column_is_documented() {
        let bytes = csv(&[record(8, 1, 1.0, 0.0)], &Environment::current()).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        assert!(STUDY.documents(&header), "{header:?}");
        assert_eq!(text.lines().nth(1).unwrap().split(',').count(), header.len());
        // Terms must be consistent with other studies, so these synonyms are not allowed.
        assert!(header.iter().all(|n| !n.contains("law") && !n.contains("truth") && !n.contains("mark")));
    }
}
