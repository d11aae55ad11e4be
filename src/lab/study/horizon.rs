//! Extended runs: checks that recommended settings stand for a minute.
//!
//! A stack that stands for the five seconds of a run may fall after thirteen. The settings that an [`Answer`]
//! would name are therefore extended, untimed and on all cores. Each setting that fails is replaced by the
//! next one.

use super::Record;
use super::answer::{Answer, same};
use super::record::Later;
use super::search::LEVELS;
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::metrics::rest::REST_WINDOW;
use crate::lab::parallel::{in_parallel, processors};
use crate::lab::scenes::Scene;
use crate::lab::scenes::holds::{Broken, Demand, HORIZON, Mark};
use crate::lab::trial::Trial;

/// Runs a scene that should come to rest for [`HORIZON`], or for its own steps if that is longer, under its demands;
/// with a seed, it is pushed at random in the first half, as a player would.
///
/// Errors: a scene that cannot be built.
pub fn later(
    scene: &Scene,
    demands: &[Demand],
    settings: Settings,
    poked: Option<u64>,
) -> Result<Later, Error> {
    let steps = ((HORIZON / scene.dt).ceil() as u64).max(u64::from(scene.steps));
    let measured = (REST_WINDOW / scene.dt).round().max(1.0) as u64;
    let settings = Settings { record_impulses: false, timed: false, ..settings };
    let trial = Trial {
        demands: demands.to_vec(),
        steps,
        measured,
        until_broken: true,
        poked,
        ..Trial::new(scene, settings)
    };
    let found = trial.run(&mut |_| Ok(()))?;
    let diverged = found.failure.map(|d| Broken { mark: Mark::BlewUp, step: d.step, body: Some(d.body) });
    let broken = diverged.or(found.broken);
    let rest_speed_m_s = found.errors.filter(|_| broken.is_none()).map(|e| e.rest_velocity());
    Ok(Later { steps, seconds: steps as f64 * scene.dt, broken, rest_speed_m_s })
}

/// Extends the settings of a scene that an answer at some accuracy would name, until every named setting has
/// an extended run.
///
/// Errors: as [`later`].
pub fn run_on(
    scene: &Scene,
    demands: &[Demand],
    records: &mut [Record],
    tell: &dyn Fn(String),
) -> Result<(), Error> {
    loop {
        let mut untried: Vec<&Record> = Vec::new();
        for level in LEVELS {
            let Some(answer) = Answer::at(records, level) else { return Ok(()) };
            // A ranking has the best setting of each solver at these levels.
            let each = if level >= 0.5 { answer.of_each_solver() } else { Vec::new() };
            for record in answer.untried().chain(each.into_iter().filter(|r| r.later.is_none())) {
                if untried.iter().all(|other| !same(other, record)) {
                    untried.push(record);
                }
            }
        }
        if untried.is_empty() {
            return Ok(());
        }
        tell(format!("extending {} to a minute: {} settings", scene.name, untried.len()));
        let untried: Vec<Record> = untried.into_iter().cloned().collect();
        let found =
            in_parallel(&untried, processors(), |record| later(scene, demands, record.settings()?, None))?;
        for (record, later) in untried.iter().zip(found) {
            records.iter_mut().filter(|r| same(r, record)).for_each(|r| r.later = Some(later));
        }
    }
}

/// Pushes the cheapest good setting of each solver on a scene, from a seed.
///
/// Errors: as [`later`].
pub fn poke(scene: &Scene, demands: &[Demand], records: &mut [Record], seed: u64) -> Result<(), Error> {
    let Some(answer) = Answer::of(records) else { return Ok(()) };
    let advised: Vec<Record> = answer.of_each_solver().into_iter().cloned().collect();
    let found =
        in_parallel(&advised, processors(), |record| later(scene, demands, record.settings()?, Some(seed)))?;
    for (record, poked) in advised.iter().zip(found) {
        records.iter_mut().filter(|r| same(r, record)).for_each(|r| r.poked = Some(poked));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;
    use crate::lab::scenes;
    use crate::lab::study::record::tests::{failed, record};

    #[test]
    fn what_falls_in_a_minute_is_found_with_its_step() {
        let run = |solver: &str, velocity_iterations: u32| {
            let solver = find(solver).unwrap();
            let mut settings = Settings::new(solver);
            settings.budget.velocity_iterations = velocity_iterations;
            let loaded = scenes::load("stack:20").unwrap();
            later(&loaded.scene, &loaded.demands, settings, None).unwrap()
        };
        // Eight sweeps do not support twenty boxes.
        let fallen = run("pgs", 8);
        assert_eq!(fallen.broken.map(|b| b.mark), Some(Mark::Fell), "{fallen:?}");
        assert!(fallen.broken.is_some_and(|b| b.step > 0 && b.step < fallen.steps));
        // Only settings that would be advised are pushed.
        let mut records = [Record { solver: "pgs", ..record(8, 1, 1.0, 0.0) }, failed(8)];
        let loaded = scenes::load("stack:2").unwrap();
        poke(&loaded.scene, &loaded.demands, &mut records, 1).unwrap();
        assert!(records[0].poked.is_some_and(|poked| poked.steps == 3600) && records[1].poked.is_none());
        let stands = run("shim", 1);
        assert_eq!((stands.broken, stands.steps), (None, 3600));
        assert!(stands.rest_speed_m_s.is_some_and(|speed| speed < 5e-3), "{stands:?}");
    }
}
