//! Ranking of the solvers over all scenes, and its robustness.
//!
//! On a scene, t(p) is the least time in which any setting of the solver p holds and meets every tolerance of
//! the scene. Its speed there is min over p of t(p)/t(p): 1 for the fastest solver, ½ for one that takes twice
//! as long, 0 for one that is never good enough. The score of a solver is its mean speed over all scenes. A
//! scene that no solver solves lowers every score alike. [Ties](super::compare) count where solvers are called
//! fastest, not in the score.
//!
//! The choice of scenes and tolerances is arbitrary. Every score therefore has a range: over all studies with
//! one scene left out, and with half or twice the tolerances. Only a solver that is first in all of them
//! [leads](Ranking::leader), by more than a negligible difference of time.

use super::Record;
use super::compare::TIE;
use super::curve::solvers_of;
use super::profile::times_of_fastest;
use crate::lab::scenes::tolerance::Accuracy;

/// Result of a solver over all scenes.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Standing {
    /// Name of the solver.
    pub solver: &'static str,
    /// Mean speed relative to the fastest solver, in [0, 1].
    pub score: f64,
    /// Smallest and largest score with one scene left out, or with other tolerances.
    pub range: [f64; 2],
    /// Number of scenes on which some setting holds.
    pub holds: usize,
    /// Number of scenes on which some setting holds and meets all tolerances, at each accuracy.
    pub good: [usize; 3],
    /// Number of scenes, for plausible runs, on which it is the fastest solver or ties with it.
    pub fastest: usize,
    /// Number of scenes, for plausible runs, on which it takes at most [`CLOSE`] times as long as the
    /// fastest.
    pub close: usize,
    /// Scenes on which none of its settings is good enough for a plausible run.
    pub fails_on: Vec<String>,
}

/// All solvers by score, and those that are first in some variation.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Ranking {
    /// Sorted by score, the best first; equal ones by name.
    pub standings: Vec<Standing>,
    /// Solvers that are first in some variation: with any scene left out, or with half or twice the
    /// tolerances. Sorted by score.
    pub first: Vec<&'static str>,
}

impl Ranking {
    /// The solver that is first in every variation; `None` if that depends on the variation.
    pub fn leader(&self) -> Option<&Standing> {
        let [only] = self.first[..] else { return None };
        self.standings.first().filter(|s| s.solver == only && s.score > 0.0)
    }
}

/// Times up to this multiple of the fastest count as close (1).
pub const CLOSE: f64 = 1.5;

/// Variations of the tolerances, as multiples of the scenes' own (1).
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Speed of each solver on a scene, relative to the fastest, and whether it ties with that one. Speed 0 if
/// none of a solver's settings is good enough.
fn speeds(scene: &[Record], solvers: &[&'static str], tolerance: f64) -> Vec<(f64, bool)> {
    let times = times_of_fastest(scene, solvers, |r| r.excess() <= tolerance);
    times.into_iter().map(|time| time.map_or((0.0, false), |(t, ties)| (1.0 / t, ties))).collect()
}

/// Mean speed of each solver over the scenes, without one of them if given.
fn scores(speeds: &[Vec<(f64, bool)>], without: Option<usize>) -> Vec<f64> {
    let kept: Vec<&Vec<(f64, bool)>> =
        speeds.iter().enumerate().filter(|(i, _)| Some(*i) != without).map(|(_, s)| s).collect();
    let count = kept.first().map_or(0, |s| s.len());
    (0..count).map(|k| kept.iter().map(|s| s[k].0).sum::<f64>() / kept.len() as f64).collect()
}

/// Ranks the solvers over the scenes of `records`.
pub fn ranking(records: &[Record]) -> Ranking {
    let solvers = solvers_of(records);
    let scenes: Vec<&[Record]> = records.chunk_by(|a, b| a.scene == b.scene).collect();
    let by_factor = |factor: f64| -> Vec<Vec<(f64, bool)>> {
        scenes.iter().map(|s| speeds(s, &solvers, factor)).collect()
    };
    let own = by_factor(1.0);
    let mut tried: Vec<Vec<f64>> = FACTORS.into_iter().map(|f| scores(&by_factor(f), None)).collect();
    if scenes.len() > 1 {
        tried.extend((0..scenes.len()).map(|i| scores(&own, Some(i))));
    }
    let whole = scores(&own, None);
    tried.push(whole.clone());
    let standing = |(k, &solver): (usize, &&'static str)| {
        let times = own.iter().map(|s| s[k]);
        let good = |accuracy: Accuracy| {
            let is_good = |s: &&&[Record]| s.iter().any(|r| r.solver == solver && r.is_good(accuracy));
            scenes.iter().filter(is_good).count()
        };
        let least = tried.iter().map(|t| t[k]).fold(f64::INFINITY, f64::min);
        let most = tried.iter().map(|t| t[k]).fold(0.0, f64::max);
        let failing = scenes.iter().zip(&own).filter(|(_, speeds)| speeds[k].0 == 0.0);
        Standing {
            solver,
            score: whole[k],
            range: [least, most],
            holds: scenes.iter().filter(|s| s.iter().any(|r| r.solver == solver && r.holds())).count(),
            good: Accuracy::ALL.map(good),
            fastest: times.clone().filter(|&(_, ties)| ties).count(),
            close: times.filter(|&(speed, _)| speed * CLOSE >= 1.0).count(),
            fails_on: failing.map(|(scene, _)| scene[0].scene.clone()).collect(),
        }
    };
    let mut standings: Vec<Standing> = solvers.iter().enumerate().map(standing).collect();
    standings.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.solver.cmp(b.solver)));
    // Solvers that share first place all count; so do those behind by a difference that is no verdict.
    let is_first = |k: usize| {
        let best = |t: &[f64]| t.iter().copied().fold(0.0, f64::max);
        tried.iter().any(|t| t[k] > 0.0 && t[k] * (1.0 + TIE) >= best(t))
    };
    let first: Vec<&'static str> = (0..solvers.len()).filter(|&k| is_first(k)).map(|k| solvers[k]).collect();
    let first = standings.iter().map(|s| s.solver).filter(|name| first.contains(name)).collect();
    Ranking { standings, first }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    fn on(scene: &str, solver: &'static str, time: f64, error: f64) -> Record {
        Record { scene: scene.to_string(), solver, ..record(8, 1, time, error) }
    }

    #[test]
    fn the_score_is_the_mean_speed_of_what_is_good_enough() {
        // The tolerance is 10 mm.
        let records = [
            on("x", "b", 10.0, 9e-4),
            on("x", "a", 40.0, 9e-4),
            on("x", "a", 1.0, 1.0),
            // A tie.
            on("y", "b", 10.1, 1e-3),
            on("y", "a", 10.0, 9e-5),
            // The faster run fell, the other one sinks too deep.
            Record { scene: "z".to_string(), solver: "b", ..fell(8, 1, 1.0, 0.0) },
            on("z", "a", 2.0, 1.0),
            // No solver.
            Record { scene: "w".to_string(), solver: "a", ..failed(8) },
        ];
        let found = ranking(&records);
        let [b, a] = &found.standings[..] else { panic!("{found:?}") };
        // Ties count as fastest, and the score is of times.
        let tied = 1.0 / ((1e3 * 10.1) / (1e3 * 10.0));
        assert_eq!((b.solver, b.score, b.holds, b.good), ("b", (1.0 + tied) / 4.0, 2, [2, 2, 0]));
        assert_eq!((a.solver, a.score, a.holds, a.good), ("a", 1.25 / 4.0, 3, [2, 2, 1]));
        assert_eq!(([b.fastest, b.close], [a.fastest, a.close]), ([2, 2], [1, 1]));
        assert_eq!(a.fails_on, ["z", "w"]);
        // Without x b scores a third of its tie, without z or w two thirds.
        assert_eq!((b.range, a.range), ([tied / 3.0, (1.0 + tied) / 3.0], [0.25 / 3.0, 1.25 / 3.0]));
        // They share first place without x.
        assert_eq!((found.first.clone(), found.leader()), (vec!["b", "a"], None));
    }

    #[test]
    fn who_is_first_by_one_scene_alone_does_not_lead() {
        let mut records = vec![
            on("x", "a", 10.0, 1e-3),
            on("x", "b", 90.0, 1e-3),
            on("y", "a", 11.0, 1e-3),
            on("y", "b", 10.0, 1e-3),
        ];
        let found = ranking(&records);
        assert_eq!((found.standings[0].solver, found.leader()), ("a", None));
        // First on every scene, at any tolerance.
        records[2] = on("y", "a", 9.0, 1e-3);
        assert_eq!(ranking(&records).leader().map(|s| s.solver), Some("a"));
        // Not good enough at half the tolerance.
        (records[0], records[2]) = (on("x", "a", 10.0, 6e-3), on("y", "a", 9.0, 6e-3));
        assert_eq!(ranking(&records).leader(), None);
    }

    #[test]
    fn the_order_of_the_list_decides_nothing() {
        let mut records = vec![on("x", "c", 10.0, 0.0), on("x", "a", 10.1, 0.0), on("x", "b", 9.9, 0.0)];
        for _ in 0..3 {
            records.rotate_left(1);
            let names: Vec<_> = ranking(&records).standings.into_iter().map(|s| s.solver).collect();
            assert_eq!(names, ["b", "c", "a"]);
        }
        // All three tie, so nobody leads.
        assert_eq!(ranking(&records).first.len(), 3);
        assert!(ranking(&[]).standings.is_empty() && ranking(&[]).leader().is_none());
    }
}
