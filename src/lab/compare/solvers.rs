//! Times of one solver relative to those of the others.
//!
//! A slow spell of the machine hits all settings of a scene alike, because they are timed interleaved. So the
//! deviation of a setting from its scene's common ratio is due to the solver. The median over a solver's
//! settings reveals a slowdown that no single setting shows.

use super::{FEWEST, SettingPair, Verdict, judged_within};
use crate::lab::study::sample::median;
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

/// Fewest solvers on a scene; with fewer, the common ratio would be that of one of them.
const FEWEST_SOLVERS: usize = 3;

/// A solver's times after ÷ before, relative to the other solvers on the same scenes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SolverChange {
    /// Name of the solver.
    pub solver: &'static str,
    /// Number of settings with times in both studies.
    pub settings: usize,
    /// Median over the settings (1).
    pub ratio: f64,
    /// Interval of the ratio (1).
    pub interval: [f64; 2],
}

impl SolverChange {
    /// Verdict on the change.
    pub fn verdict(&self, threshold: f64) -> Verdict {
        judged_within(self.ratio, self.interval, threshold)
    }
}

/// Changes by solver, for scenes with enough solvers and for solvers with enough settings.
pub fn changes(pairs: &[SettingPair]) -> Vec<SolverChange> {
    let mut scenes: BTreeMap<&str, BTreeMap<&'static str, Vec<f64>>> = BTreeMap::new();
    for pair in pairs {
        if let Some(time) = pair.time {
            scenes.entry(&pair.scene).or_default().entry(pair.solver).or_default().push(time.ratio.ln());
        }
    }
    let mut deviations: BTreeMap<&'static str, Vec<f64>> = BTreeMap::new();
    for by_solver in scenes.values().filter(|by_solver| by_solver.len() >= FEWEST_SOLVERS) {
        let common = median(&by_solver.values().map(|logs| median(logs)).collect::<Vec<_>>());
        for (solver, logs) in by_solver {
            deviations.entry(solver).or_default().extend(logs.iter().map(|log| log - common));
        }
    }
    deviations.retain(|_, all| all.len() >= FEWEST);
    let errors = super::normal_quantile(deviations.len());
    deviations.into_iter().map(|(solver, all)| change(solver, &all, errors)).collect()
}

/// The median of k normal numbers with standard deviation σ has the standard error √(π/2) σ/√k; `errors` of
/// them are allowed for.
fn change(solver: &'static str, deviations: &[f64], errors: f64) -> SolverChange {
    let middle = median(deviations);
    let scatter = super::scatter(deviations);
    let allowed = super::PLACEMENT + errors * FRAC_PI_2.sqrt() * scatter / (deviations.len() as f64).sqrt();
    let interval = [middle - allowed, middle + allowed].map(f64::exp);
    SolverChange { solver, settings: deviations.len(), ratio: middle.exp(), interval }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::world::Order;
    use crate::lab::compare::TimeChange;
    use rand::{RngExt, SeedableRng};

    /// Seven solvers on six scenes, with a slow spell per scene and scatter per setting.
    fn race(seed: u64, slower: f64) -> Vec<SolverChange> {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let mut pairs = Vec::new();
        for scene in 0..6 {
            let spell = random.random_range(-0.3..0.3);
            for (i, solver) in ["a", "b", "c", "d", "e", "f", "g"].into_iter().enumerate() {
                for _ in 0..24 {
                    let scatter: f64 = (0..3).map(|_| random.random_range(-0.1..0.1)).sum();
                    let ratio = f64::exp(spell + scatter) * if i == 0 { slower } else { 1.0 };
                    let time = TimeChange {
                        cost_ns: [1.0; 2],
                        longest_step_ns: [1.0; 2],
                        ratio,
                        interval: [ratio; 2],
                    };
                    pairs.push(SettingPair {
                        scene: scene.to_string(),
                        solver,
                        order: Order::Colored,
                        lanes: 8,
                        budget: String::new(),
                        marks: [None; 2],
                        errors: Vec::new(),
                        time: Some(time),
                    });
                }
            }
        }
        changes(&pairs)
    }

    #[test]
    fn a_tenth_is_found_in_noise_that_hides_it_in_every_setting() {
        for seed in 0..20 {
            let verdicts =
                |slower| race(seed, slower).into_iter().map(|s| s.verdict(0.05)).collect::<Vec<_>>();
            assert_eq!(verdicts(1.0), [Verdict::Same; 7], "seed {seed}");
            assert_eq!(verdicts(1.1)[0], Verdict::Worse, "seed {seed}");
            assert_eq!(verdicts(1.1)[1..], [Verdict::Same; 6], "seed {seed}");
        }
    }
}
