//! Performance profiles: the share of scenes that a solver solves within a factor of the fastest.
//!
//! **Source.** Dolan and Moré, "Benchmarking optimization software with performance profiles" (2002). Let
//! t(p, s) be the least time in which any setting of the solver p holds and has an error within the tolerance
//! of the scene s, and infinite if none does. Then
//!
//! ```text
//! r(p, s) = t(p, s)/min over p of t(p, s),   ρ(p, τ) = share of scenes with r(p, s) ≤ τ
//! ```
//!
//! ρ(p, 1) is the share of scenes on which p is fastest, ρ(p, ∞) the share that it solves at all. Scenes that
//! no solver solves count as well. A time that ties with the smallest one counts as the smallest, so that
//! noise decides nothing.

use super::Record;
use super::compare::compare;
use super::curve::{ErrorAxis, solvers_of};
use super::sample::Sample;

/// For each solver, the least time of its `allowed` records of one scene, relative to that of the fastest
/// solver (1), and whether it ties with that time. `None` if no record is allowed.
pub fn times_of_fastest(
    scene: &[Record],
    solvers: &[&str],
    allowed: impl Fn(&Record) -> bool,
) -> Vec<Option<(f64, bool)>> {
    let less = |a: &&Sample, b: &&Sample| a.cost_ns().total_cmp(&b.cost_ns());
    let own = |solver: &&str| {
        let allowed = scene.iter().filter(|r| r.solver == *solver && allowed(r));
        allowed.filter_map(|r| r.sample.as_ref()).min_by(less)
    };
    let times: Vec<Option<&Sample>> = solvers.iter().map(own).collect();
    let Some(least) = times.iter().flatten().copied().min_by(less) else { return vec![None; solvers.len()] };
    let ratio = |t: &Sample| (t.cost_ns() / least.cost_ns(), compare(t, least).is_eq());
    times.into_iter().map(|time| time.map(ratio)).collect()
}

/// The profile along one axis, over all scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// The error that has to be within its tolerance.
    pub axis: ErrorAxis,
    /// Number of scenes with such an error.
    pub scenes: usize,
    /// Number of those that at least one solver solves.
    pub solvable: usize,
    /// For each solver, the ratios r(p, s) of the scenes that it solves, sorted.
    pub ratios: Vec<(&'static str, Vec<f64>)>,
}

impl Profile {
    /// The profile of all records along an axis, with the tolerances of their scenes. A run that does not
    /// hold solves nothing.
    pub fn of(records: &[Record], axis: ErrorAxis) -> Profile {
        let mut ratios: Vec<(&'static str, Vec<f64>)> =
            solvers_of(records).into_iter().map(|s| (s, Vec::new())).collect();
        let (mut scenes, mut solvable) = (0, 0);
        for group in records.chunk_by(|a, b| a.scene == b.scene) {
            // A reference value counts even if no run reached the observed event.
            let known = axis != ErrorAxis::Truth || group.iter().any(|r| r.truth.is_some());
            scenes += known as usize;
            let solvers: Vec<&str> = ratios.iter().map(|(solver, _)| *solver).collect();
            let within = |r: &Record| r.holds() && r.in_tolerance(axis).is_some_and(|e| e <= 1.0);
            let found = times_of_fastest(group, &solvers, within);
            solvable += found.iter().any(Option::is_some) as usize;
            for ((_, ratios), ratio) in ratios.iter_mut().zip(found) {
                ratios.extend(ratio.map(|(ratio, ties)| if ties { 1.0 } else { ratio }));
            }
        }
        ratios.iter_mut().for_each(|(_, r)| r.sort_by(f64::total_cmp));
        Profile { axis, scenes, solvable, ratios }
    }

    /// ρ(τ) of the solver at this index: its share of all scenes.
    pub fn share(&self, solver: usize, factor: f64) -> f64 {
        let within = self.ratios[solver].1.iter().filter(|&&r| r <= factor).count();
        within as f64 / self.scenes.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    fn on(scene: &str, solver: &'static str, time: f64, error: f64) -> Record {
        Record { scene: scene.to_string(), solver, ..record(8, 1, time, error) }
    }

    #[test]
    fn shares_count_scenes_within_a_factor_of_the_fastest() {
        let good = record(8, 1, 1.0, 0.0).tolerances.penetration.value;
        let records = [
            // a is fastest. b takes three times as long; its faster setting sinks too deep.
            on("x", "a", 10.0, good),
            on("x", "b", 30.0, 0.0),
            on("x", "b", 5.0, 2.0 * good),
            Record { scene: "x".to_string(), solver: "b", ..fell(8, 1, 1.0, 0.0) },
            // A tie, then a scene that only a solves.
            on("y", "a", 10.2, 0.0),
            on("y", "b", 10.0, 0.0),
            on("z", "a", 10.0, 0.0),
            on("z", "b", 1.0, 1.0),
            // No solver.
            on("w", "a", 1.0, 1.0),
            Record { scene: "w".to_string(), solver: "b", ..failed(8) },
        ];
        let profile = Profile::of(&records, ErrorAxis::Penetration);
        assert_eq!((profile.scenes, profile.solvable), (4, 3));
        assert_eq!(profile.ratios, [("a", vec![1.0; 3]), ("b", vec![1.0, 3.0])]);
        assert_eq!([1.0, 2.9, 3.0, 1e9].map(|f| profile.share(1, f)), [0.25, 0.25, 0.5, 0.5]);
        assert_eq!(profile.share(0, 1.0), 0.75);
        let none = Profile::of(&records, ErrorAxis::Truth);
        assert_eq!((none.scenes, none.share(0, 1e9)), (0, 0.0));
    }
}
