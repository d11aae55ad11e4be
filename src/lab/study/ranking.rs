//! One ranking of the solvers over all scenes.
//!
//! On a scene, t(p) is the least time in which any setting of the solver p holds and keeps every
//! tolerance of the scene. Its speed there is min over p of t(p)/t(p): 1 for the fastest and for
//! those that [tie](super::compare) with it, ½ for one that takes twice as long, 0 for one that is
//! never good enough. The score of a solver is its mean speed over all scenes, and a scene that nobody
//! solves lowers every score alike.

use super::Record;
use super::curve::solvers_of;
use super::profile::times_of_fastest;

/// A solver over all scenes.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Standing {
    /// Its name.
    pub solver: &'static str,
    /// Mean speed in that of the fastest, in [0, 1].
    pub score: f64,
    /// Scenes on which some setting holds.
    pub holds: usize,
    /// Scenes on which some setting holds and keeps all tolerances.
    pub good: usize,
    /// Of those, the ones on which it is the fastest, or ties with it.
    pub fastest: usize,
    /// Of those, the ones on which it takes at most [`CLOSE`] times as long as the fastest.
    pub close: usize,
}

/// What counts as close to the fastest (1).
pub const CLOSE: f64 = 1.5;

/// The solvers by their score, the best first; equal ones by name.
pub fn ranking(records: &[Record]) -> Vec<Standing> {
    let solvers = solvers_of(records);
    let standing =
        |&solver: &&'static str| Standing { solver, score: 0.0, holds: 0, good: 0, fastest: 0, close: 0 };
    let mut all: Vec<Standing> = solvers.iter().map(standing).collect();
    let mut scenes = 0;
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        scenes += 1;
        let times = times_of_fastest(scene, &solvers, |r| r.excess() <= 1.0);
        for (own, time) in all.iter_mut().zip(times) {
            own.holds += scene.iter().any(|r| r.solver == own.solver && r.holds()) as usize;
            let Some(time) = time else { continue };
            own.score += 1.0 / time;
            own.good += 1;
            own.fastest += (time <= 1.0) as usize;
            own.close += (time <= CLOSE) as usize;
        }
    }
    all.iter_mut().for_each(|own| own.score /= f64::from(scenes.max(1)));
    all.sort_by(|a, b| b.score.total_cmp(&a.score).then(a.solver.cmp(b.solver)));
    all
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
        // 10 mm are allowed.
        let records = [
            on("x", "b", 10.0, 1e-3),
            on("x", "a", 40.0, 1e-3),
            on("x", "a", 1.0, 1.0),
            // Tied.
            on("y", "b", 10.1, 1e-3),
            on("y", "a", 10.0, 1e-3),
            // The faster one fell, the other one is too deep.
            Record { scene: "z".to_string(), solver: "b", ..fell(8, 1, 1.0, 0.0) },
            on("z", "a", 2.0, 1.0),
            // Nobody.
            Record { scene: "w".to_string(), solver: "a", ..failed(8) },
        ];
        let found = ranking(&records);
        let b = Standing { solver: "b", score: 0.5, holds: 2, good: 2, fastest: 2, close: 2 };
        let a = Standing { solver: "a", score: 1.25 / 4.0, holds: 3, good: 2, fastest: 1, close: 1 };
        assert_eq!(found, [b, a]);
    }

    #[test]
    fn the_order_of_the_list_decides_nothing() {
        let mut records = vec![on("x", "c", 10.0, 0.0), on("x", "a", 10.1, 0.0), on("x", "b", 9.9, 0.0)];
        for _ in 0..3 {
            records.rotate_left(1);
            let names: Vec<_> = ranking(&records).into_iter().map(|s| s.solver).collect();
            assert_eq!(names, ["a", "b", "c"]);
        }
        assert!(ranking(&[]).is_empty());
    }
}
