//! `simpulse study`: the main job, also in parts.

use super::args::StudyArgs;
use super::interrupt::on_interrupt;
use super::output::{note, print};
use super::progress::Bar;
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::report::study_file::StudyFile;
use crate::lab::report::{self, answer, html};
use crate::lab::study::{self, Record, StudyPlan, telling};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

/// One of several equal parts of a study: whole scenes, so that times of a scene come from one machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// From 1.
    index: usize,
    count: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || format!("'{text}' is not I/N with 1 ≤ I ≤ N, for example 2/8");
        let (index, count) = text.split_once('/').ok_or_else(refused)?;
        let (index, count) = (index.parse().map_err(|_| refused())?, count.parse().map_err(|_| refused())?);
        if (1..=count).contains(&index) { Ok(Shard { index, count }) } else { Err(refused()) }
    }
}

impl Shard {
    /// The scenes of this part, and all others. Errors: a part without scenes.
    fn split(self, scenes: Vec<String>) -> Result<(Vec<String>, Vec<String>), Error> {
        let total = scenes.len();
        let (own, others): (Vec<_>, Vec<_>) =
            scenes.into_iter().enumerate().partition(|(i, _)| i % self.count == self.index - 1);
        if own.is_empty() {
            let message = format!("{}/{} has no scene: there are {total}", self.index, self.count);
            return Err(Error::invalid("--shard", message));
        }
        let names = |list: Vec<(usize, String)>| list.into_iter().map(|(_, name)| name).collect();
        Ok((names(own), names(others)))
    }
}

/// Runs the command.
pub fn run(args: &StudyArgs) -> Result<ExitCode, Error> {
    let mut plan = args.plan()?;
    let mut elsewhere = Vec::new();
    if let Some(shard) = args.shard {
        (plan.scenes, elsewhere) = shard.split(plan.scenes)?;
    }
    plan.check()?;
    // Before the long wait, not after it.
    files::prepare_folder(&args.out)?;
    html::write_recordings(&args.out, &[])?;
    let finished: Arc<Mutex<Vec<Record>>> = Arc::default();
    let rescue = {
        let (plan, out, finished, elsewhere) =
            (plan.clone(), args.out.clone(), Arc::clone(&finished), elsewhere.clone());
        move || {
            let records = finished.lock().unwrap_or_else(PoisonError::into_inner).clone();
            note(&keep(&plan, &out, records, elsewhere));
        }
    };
    let guard = on_interrupt(rescue);
    let bar = Bar::new();
    let records = study::run(&plan, &|p| bar.show(p.done, p.total, p.what), &|scene| {
        finished.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(scene);
    })?;
    drop(bar);
    let study = StudyFile::new(&plan, records, elsewhere);
    let replays = telling::recordings(&plan, &study.records)?;
    let replays = html::write_recordings(&args.out, &replays)?;
    let mut paths = report::write_study(&args.out, &study)?;
    paths.extend(replays);
    drop(guard);
    if args.json {
        return print(&String::from_utf8_lossy(&study.to_json()?));
    }
    print(&text(&study, plan.steps, &args.out, &paths, args.verbose))
}

/// The answer, and where the files are.
pub fn text(study: &StudyFile, steps: Option<u32>, out: &Path, paths: &[PathBuf], verbose: bool) -> String {
    let mut text = study.caution() + &answer::text(&study.records, &study.environment, steps);
    let names: Vec<String> =
        paths.iter().filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned())).collect();
    text += &format!("\nwrote {} in {}\n", names.join(", "), out.display());
    if verbose {
        text += &format!("\n{}", report::tables(&study.records));
    }
    text
}

/// Writes the scenes that are finished when the study is interrupted; says so.
fn keep(plan: &StudyPlan, out: &Path, records: Vec<Record>, elsewhere: Vec<String>) -> String {
    let done = records.chunk_by(|a, b| a.scene == b.scene).count();
    let all = plan.scenes.len();
    if done == 0 {
        return format!("interrupted before the first of {all} scenes was finished; nothing written\n");
    }
    // Scenes are finished in the order of the plan.
    let missing = plan.scenes[done.min(all)..].iter().cloned().chain(elsewhere).collect();
    match report::write_study(out, &StudyFile::new(plan, records, missing)) {
        Ok(_) if done == all => format!("interrupted; all scenes are in {}\n", out.display()),
        Ok(_) => format!("interrupted; {done} of {all} scenes are in {}, marked as partial\n", out.display()),
        Err(error) => format!("interrupted; finished scenes could not be written: {error}\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_whole_scenes_and_make_the_whole() {
        let scenes: Vec<String> = ["a", "b", "c", "d", "e"].map(String::from).to_vec();
        let mut all = Vec::new();
        for index in 1..=3 {
            let shard: Shard = format!("{index}/3").parse().unwrap();
            let (own, others) = shard.split(scenes.clone()).unwrap();
            assert_eq!(own.len() + others.len(), 5);
            all.extend(own);
        }
        all.sort();
        assert_eq!(all, scenes);
        for bad in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2", ""] {
            assert!(bad.parse::<Shard>().is_err_and(|e| e.contains(bad)), "{bad}");
        }
        let late = Shard { index: 7, count: 8 }.split(scenes).unwrap_err().to_string();
        assert_eq!(late, "--shard: 7/8 has no scene: there are 5");
    }
}
