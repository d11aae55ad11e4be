//! Gain and cost of impact waves for each solver, from settings that ran with both treatments of impacts.

use super::Record;
use super::compare::Ratio;
use super::curve::ErrorAxis;
use crate::engine::constraints::Impacts;

/// One solver on one scene, summarized over its settings: results with waves ÷ results with its own impact
/// law.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Gain {
    /// Scene name with its size.
    pub scene: String,
    /// Name of the solver.
    pub solver: &'static str,
    /// Number of settings that ran with both treatments.
    pub settings: usize,
    /// Number of these that hold, with the solver's own law and with waves.
    pub holds: [usize; 2],
    /// Median ratio of the contact-law residuals (1).
    pub residual: f64,
    /// Median ratio of the distances to the reference value (1); `None` if the scene has no reference value.
    pub reference: Option<f64>,
    /// Median ratio of the times (1); `None` without times.
    pub time: Option<f64>,
}

/// Smaller errors are raised to this value before a ratio is formed, so that no ratio is infinite.
const NOTHING: f64 = 1e-9;

/// One entry for each scene and solver that ran with both treatments.
pub fn gains(records: &[Record]) -> Vec<Gain> {
    let mut found: Vec<Gain> = Vec::new();
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        for solver in super::curve::solvers_of(scene) {
            let own = scene.iter().filter(|r| r.solver == solver && r.impacts == Impacts::Own);
            let pairs: Vec<[&Record; 2]> = own
                .filter_map(|one| {
                    let key = |r: &Record| (r.budget, r.order, r.lanes, r.swept, r.parameters.clone());
                    let is_twin =
                        |r: &&Record| r.solver == solver && r.impacts == Impacts::Waves && key(r) == key(one);
                    Some([one, scene.iter().find(is_twin)?])
                })
                .collect();
            if pairs.is_empty() {
                continue;
            }
            let error = |axis: ErrorAxis| {
                let ratio = |[one, other]: &[&Record; 2]| {
                    Some(axis.of(other)?.max(NOTHING) / axis.of(one)?.max(NOTHING))
                };
                median(pairs.iter().filter_map(ratio).collect())
            };
            let time = |[one, other]: &[&Record; 2]| {
                Some(Ratio::of(other.sample.as_ref()?, one.sample.as_ref()?)?.median)
            };
            let holds = [0, 1].map(|k| pairs.iter().filter(|p| p[k].holds()).count());
            found.push(Gain {
                scene: scene[0].scene.clone(),
                solver,
                settings: pairs.len(),
                holds,
                residual: error(ErrorAxis::Law).unwrap_or(1.0),
                reference: error(ErrorAxis::Truth),
                time: median(pairs.iter().filter_map(time).collect()),
            });
        }
    }
    found
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::metrics::Errors;
    use crate::lab::study::record::tests::record;

    #[test]
    fn a_gain_is_of_settings_that_ran_with_both() {
        let with = |impacts, substeps, time, residual| {
            let mut own = Record { impacts, ..record(8, substeps, time, 1e-3) };
            own.errors = Some(Errors::default().with("residual_rms_lighter_weights", residual));
            own
        };
        let (own, waves) = (Impacts::Own, Impacts::Waves);
        let records = [with(own, 1, 10.0, 0.4), with(waves, 1, 15.0, 0.1), with(own, 2, 20.0, 0.4)];
        let found = gains(&records);
        assert_eq!((found.len(), found[0].settings, found[0].reference), (1, 1, None));
        assert_eq!((found[0].residual, found[0].time, found[0].holds), (0.25, Some(1.5), [1, 1]));
        assert!(gains(&records[2..]).is_empty());
    }
}
