//! Recordings of the scene on which solvers differ most.

use super::answer::Answer;
use super::curve::distinct;
use super::{Record, StudyPlan};
use crate::engine::world::{Order, Settings};
use crate::lab::error::Error;
use crate::lab::recording::record::{Caption, record_trial};
use crate::lab::trial::Trial;
use std::cmp::Reverse;

/// Maximum number of runs shown side by side.
const MOST: usize = 4;
/// Limits that let a page open at once: bodies of a replayed scene, and frames of a recording.
const LARGEST: usize = 300;
const FRAMES: u32 = 300;

/// The runs to replay, from the scene with the largest minimum of holding and failing solvers. First the
/// cheapest setting within tolerance, or the one nearest to it, then runs that broke, then others that hold;
/// each of another solver. Empty in a sweep, whose scenes differ, and without colored runs on a small scene.
pub fn telling(records: &[Record]) -> Vec<&Record> {
    let is_small = |scene: &&[Record]| scene[0].bodies <= LARGEST && scene[0].swept.is_none();
    let scenes = records.chunk_by(|a, b| a.scene == b.scene).filter(is_small);
    let shown = scenes.map(|scene| (contrast(scene), scene[0].bodies, shown(scene)));
    let shown = shown.filter(|(.., runs)| !runs.is_empty());
    shown.min_by_key(|&(contrast, bodies, _)| Reverse((contrast, bodies))).map_or(Vec::new(), |most| most.2)
}

fn is_colored(record: &&Record) -> bool {
    record.order == Order::Colored
}

/// The smaller one of the numbers of solvers of which a setting holds, and of which one does not.
fn contrast(scene: &[Record]) -> usize {
    let solvers = |holds: bool| {
        let own = scene.iter().filter(is_colored).filter(|r| r.holds() == holds);
        distinct(own.map(|r| r.solver)).len()
    };
    solvers(true).min(solvers(false))
}

/// The runs to replay of a scene.
fn shown(scene: &[Record]) -> Vec<&Record> {
    let answer = Answer::of(scene);
    let best = answer.iter().flat_map(|a| a.good.iter().copied().chain(a.nearest)).find(is_colored);
    let mut others: Vec<&Record> = scene.iter().filter(is_colored).filter(|r| r.failure.is_none()).collect();
    // The earliest failures first, then the most accurate of those that hold.
    others.sort_by_key(|r| Reverse(r.lanes));
    others.sort_by(|a, b| a.excess().total_cmp(&b.excess()));
    others.sort_by_key(|r| (r.holds(), r.failed_step()));
    let mut chosen: Vec<&Record> = Vec::new();
    for record in best.into_iter().chain(others) {
        if chosen.len() < MOST && chosen.iter().all(|c| c.solver != record.solver) {
            chosen.push(record);
        }
    }
    chosen
}

/// Runs the most telling scene again and records it. Returns the bytes of the files. A run that diverges is
/// recorded up to that point.
pub fn recordings(plan: &StudyPlan, records: &[Record]) -> Result<Vec<Vec<u8>>, Error> {
    telling(records).into_iter().map(|record| recording(plan, record)).collect()
}

fn recording(plan: &StudyPlan, record: &Record) -> Result<Vec<u8>, Error> {
    let mut opened = plan.scenes.iter().filter_map(|name| plan.open(name).ok());
    let Some(mut loaded) = opened.find(|loaded| loaded.scene.name == record.scene) else {
        return Err(Error::invalid("replay", format!("no run of {} on {}", record.solver, record.scene)));
    };
    let setting = record.setting_text();
    let caption = Caption { scene: record.scene.clone(), solver: record.solver.into(), setting };
    let every = loaded.scene.steps.div_ceil(FRAMES);
    let trial = Trial::of(&mut loaded, Settings { record_impulses: true, ..record.settings()? });
    Ok(record_trial(trial, &|_| caption.clone(), every, true, &mut |_| ())?.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::recording::read::read;
    use crate::lab::study::record::tests::{fell, record};

    #[test]
    fn the_scene_with_the_most_contrast_is_told() {
        let on = |scene: &str, solver: &'static str, record: Record| Record {
            scene: scene.into(),
            solver,
            ..record
        };
        let records = [
            on("calm", "a", record(8, 1, 1.0, 0.0)),
            on("calm", "b", record(8, 1, 1.0, 0.0)),
            on("split", "a", record(8, 1, 1.0, 1e-3)),
            on("split", "b", fell(8, 1, 1.0, 0.0)),
            on("split", "c", record(8, 1, 1.0, 1.0)),
            Record { bodies: 9999, ..on("large", "a", record(8, 1, 1.0, 0.0)) },
        ];
        let chosen: Vec<_> = telling(&records).iter().map(|r| (r.scene.as_str(), r.solver)).collect();
        assert_eq!(chosen, [("split", "a"), ("split", "b"), ("split", "c")]);
        assert!(telling(&[]).is_empty());
    }

    #[test]
    fn a_recording_is_of_the_run_that_was_chosen() {
        let plan = StudyPlan { scenes: vec!["stack:2".into()], steps: Some(20), ..StudyPlan::default() };
        let files = recordings(&plan, &[record(4, 1, 1.0, 1e-3)]).unwrap();
        let found = read(&files[0]).unwrap();
        assert_eq!((found.header.solver.as_str(), found.frames.len()), ("pgs", 21));
        assert_eq!(found.header.setting, "1 substeps, 4 lanes");
    }
}
