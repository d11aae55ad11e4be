//! Ranking of the solvers over all scenes, and its robustness.
//!
//! On a scene, t(p) is the least time in which any setting of the solver p holds and meets every tolerance of
//! the scene. Its speed there is min over p of t(p)/t(p): 1 for the fastest solver, ½ for one that takes twice
//! as long, 0 for one that is never good enough. The score of a solver is its mean speed over all scenes. A
//! scene that no solver solves lowers every score alike. [Ties](super::compare) count where solvers are called
//! fastest, not in the score.
//!
//! The choice of scenes and tolerances is arbitrary. Every score therefore has a range: over all studies with
//! one scene or one [class](crate::lab::scenes::class::SceneClass) of scenes left out, and with half or twice the tolerances, at which
//! settings were [searched](super::search) as well. Only a solver that is first in all of them
//! [leads](Ranking::leader), by more than a negligible difference of time.

use super::Record;
use super::compare::TIE;
use super::curve::{distinct, solvers_of};
use super::profile::times_of_fastest;
use crate::lab::scenes::tolerance::Accuracy;

/// Result of a solver over all scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct Standing {
    /// Name of the solver.
    pub solver: &'static str,
    /// Mean speed relative to the fastest solver, in [0, 1].
    pub score: f64,
    /// Smallest and largest score with one scene or class left out, or with other tolerances.
    pub range: [f64; 2],
    /// Number of scenes on which some setting holds and meets all tolerances, at each accuracy.
    pub good: [usize; 3],
    /// Number of scenes, for plausible runs, on which it is the fastest solver or ties with it.
    pub fastest: usize,
    /// Scenes on which none of its settings is good enough for a plausible run.
    pub fails_on: Vec<String>,
}

/// All solvers by score, and those that are first in some variation.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// Sorted by score, the best first; equal ones by name.
    pub standings: Vec<Standing>,
    /// Solvers that are first in some variation: with no scene, any scene or any class left out, or with half or twice
    /// the tolerances.
    pub first: FirstPlaces,
}

/// First places of solvers in variations of a ranking; solvers may share one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FirstPlaces {
    /// Solvers with the number of their first places, the most first.
    pub solvers: Vec<(&'static str, usize)>,
    /// Number of variations.
    pub variations: usize,
}

impl Ranking {
    /// The solver that is first in every variation; `None` if that depends on the variation.
    pub fn leader(&self) -> Option<&Standing> {
        let [(only, _)] = self.first.solvers[..] else { return None };
        self.standings.first().filter(|s| s.solver == only && s.score > 0.0)
    }
}

/// Variations of the tolerances, as multiples of the scenes' own (1).
const FACTORS: [f64; 2] = [0.5, 2.0];

/// The speeds of all solvers on a scene, relative to the fastest, and whether they tie with that one. Speed 0 if
/// none of a solver's settings is good enough.
type Speeds = Vec<(f64, bool)>;

fn speeds(scene: &[Record], solvers: &[&'static str], share: f64) -> Speeds {
    let times = times_of_fastest(scene, solvers, |r| r.excess_at(share) <= 1.0);
    times.into_iter().map(|time| time.map_or((0.0, false), |(t, ties)| (1.0 / t, ties))).collect()
}

/// Scenes with their speeds at their own tolerances, and at each of [`FACTORS`].
type SceneSpeeds<'a> = (&'a [Record], [Speeds; 3]);

/// Mean speed of each solver over those of the scenes that are kept, at the tolerances with this index.
fn scores(scenes: &[&SceneSpeeds], at: usize, keep: impl Fn(&[Record]) -> bool) -> Vec<f64> {
    let kept: Vec<&Speeds> = scenes.iter().filter(|s| keep(s.0)).map(|s| &s.1[at]).collect();
    let count = kept.first().map_or(0, |s| s.len());
    (0..count).map(|k| kept.iter().map(|s| s[k].0).sum::<f64>() / kept.len() as f64).collect()
}

/// The scores over these scenes in every variation; those over all of them at their own tolerances are the first.
fn variations(scenes: &[&SceneSpeeds]) -> Vec<Vec<f64>> {
    let mut tried: Vec<Vec<f64>> = (0..=FACTORS.len()).map(|at| scores(scenes, at, |_| true)).collect();
    tried.extend(scenes.iter().map(|out| scores(scenes, 0, |own| own[0].scene != out.0[0].scene)));
    let classes = distinct(scenes.iter().map(|s| s.0[0].class));
    tried.extend(classes.into_iter().map(|out| scores(scenes, 0, |own| own[0].class != out)));
    tried.retain(|scores| !scores.is_empty());
    tried
}

/// Ranks the solvers over the scenes of `records`.
pub fn ranking(records: &[Record]) -> Ranking {
    let solvers = solvers_of(records);
    let by_factor =
        |scene: &[Record]| [1.0, FACTORS[0], FACTORS[1]].map(|share| speeds(scene, &solvers, share));
    let scenes: Vec<SceneSpeeds> =
        records.chunk_by(|a, b| a.scene == b.scene).map(|scene| (scene, by_factor(scene))).collect();
    let all: Vec<&SceneSpeeds> = scenes.iter().collect();
    let tried = variations(&all);
    let standing = |(k, &solver): (usize, &&'static str)| {
        let good = |accuracy: Accuracy| {
            let is_good = |s: &&SceneSpeeds| s.0.iter().any(|r| r.solver == solver && r.is_good(accuracy));
            scenes.iter().filter(is_good).count()
        };
        let least = tried.iter().map(|t| t[k]).fold(f64::INFINITY, f64::min);
        let most = tried.iter().map(|t| t[k]).fold(0.0, f64::max);
        let failing = scenes.iter().filter(|s| s.1[0][k].0 == 0.0);
        Standing {
            solver,
            score: tried[0][k],
            range: [least, most],
            good: Accuracy::ALL.map(good),
            fastest: scenes.iter().filter(|s| s.1[0][k].1).count(),
            fails_on: failing.map(|s| s.0[0].scene.clone()).collect(),
        }
    };
    let mut standings: Vec<Standing> = solvers.iter().enumerate().map(standing).collect();
    standings.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.solver.cmp(b.solver)));
    // Solvers that share first place all count; so do those behind by a difference that is no verdict.
    let places = |tried: &Vec<Vec<f64>>| {
        let is_first =
            |t: &Vec<f64>, k: usize| t[k] > 0.0 && t.iter().all(|other| t[k] * (1.0 + TIE) >= *other);
        let count = |k: usize| tried.iter().filter(|t| is_first(t, k)).count();
        let own = |s: &Standing| Some((s.solver, count(solvers.iter().position(|name| *name == s.solver)?)));
        let mut solvers: Vec<_> = standings.iter().filter_map(own).filter(|(_, count)| *count > 0).collect();
        solvers.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
        FirstPlaces { solvers, variations: tried.len() }
    };
    Ranking { first: places(&tried), standings }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::class::SceneClass;
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
        assert_eq!((b.solver, b.score, b.good), ("b", (1.0 + tied) / 4.0, [2, 2, 0]));
        assert_eq!((a.solver, a.score, a.good), ("a", 1.25 / 4.0, [2, 2, 1]));
        assert_eq!((b.fastest, a.fastest), (2, 1));
        assert_eq!(a.fails_on, ["z", "w"]);
        // Without x b scores a third of its tie, without z or w two thirds.
        assert_eq!((b.range, a.range), ([tied / 3.0, (1.0 + tied) / 3.0], [0.25 / 3.0, 1.25 / 3.0]));
        // They share first place without x.
        assert_eq!((&found.first.solvers[..], found.leader()), (&[("b", 7), ("a", 1)][..], None));
        assert_eq!(found.first.variations, 7);
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
    fn who_is_first_by_one_class_alone_does_not_lead() {
        let of = |class, scene: &str, a: f64, b: f64| {
            [("a", a), ("b", b)].map(|(solver, time)| Record { class, ..on(scene, solver, time, 1e-3) })
        };
        let (placed, moves) = (SceneClass::Placed, SceneClass::Moves);
        let records = [
            of(placed, "x", 10.0, 90.0),
            of(placed, "y", 10.0, 90.0),
            of(placed, "z", 10.0, 90.0),
            of(moves, "w", 11.0, 10.0),
        ];
        let found = ranking(records.as_flattened());
        // No single scene decides, but without those that are placed b is first.
        assert_eq!((found.standings[0].solver, &found.first.solvers[..]), ("a", &[("a", 8), ("b", 1)][..]));
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
        assert_eq!(ranking(&records).first.solvers.len(), 3);
        assert!(ranking(&[]).standings.is_empty() && ranking(&[]).leader().is_none());
    }
}
