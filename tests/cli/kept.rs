//! Files left after an interrupt, and differences between two runs of the same program.

use crate::{interrupted, succeeds};
use simpulse::lab::compare::{CompareOptions, Comparison, Verdict, compare};
use simpulse::lab::report::study_file::StudyFile;
use std::path::Path;

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_what_was_there_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::create_dir(path.join("old")).unwrap();
    std::fs::write(path.join("old/replay-1.rec"), "of before").unwrap();
    for out in ["old", "new/inner"] {
        // The folder is in use as soon as the study has begun.
        let files = || std::fs::read_dir(path.join(out)).map_or(0, |all| all.count());
        let is_used = || files() > usize::from(out == "old");
        let study = format!("study --scenes pyramid:60 --solvers shim --out {out}");
        let output = interrupted(path, &study, "-INT", is_used);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(130), "{message}");
        assert!(message.contains("nothing written"), "{message}");
    }
    assert_eq!(std::fs::read_to_string(path.join("old/replay-1.rec")).unwrap(), "of before");
    assert_eq!(std::fs::read_dir(path.join("old")).unwrap().count(), 1);
    assert!(!path.join("new").exists());
}

/// Compares two studies as `simpulse compare` does.
fn compared(before: &Path, after: &StudyFile) -> Comparison {
    let before = StudyFile::read(before).unwrap();
    compare(&before, after, &CompareOptions { threshold: 0.05, relative: false })
}

/// Number of settings and solvers whose time is judged worse, and better.
fn told(found: &Comparison) -> [usize; 2] {
    let times = found.pairs.iter().filter_map(|pair| pair.time.map(|time| time.verdict(found.threshold)));
    let verdicts: Vec<_> = times.chain(found.solvers.iter().map(|s| s.verdict(found.threshold))).collect();
    [Verdict::Worse, Verdict::Better].map(|verdict| verdicts.iter().filter(|v| **v == verdict).count())
}

/// `cargo test --release --test cli null_race -- --ignored --nocapture`: how often a program compared with
/// itself is reported to differ (never, even on a busy machine), and how often a solver that is slower by a
/// tenth is found (nine times out of ten). The slower solver is the second run with its times lengthened by a
/// tenth.
#[test]
#[ignore = "takes minutes"]
fn null_race() {
    const TRIES: usize = 20;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    succeeds(path, "study --quick --out 0");
    let (mut differ, mut found) = (0, 0);
    for i in 1..=TRIES {
        let (before, after) = ((i - 1).to_string(), i.to_string());
        succeeds(path, &format!("study --quick --out {after}"));
        let mut study = StudyFile::read(&path.join(&after)).unwrap();
        let null = compared(&path.join(&before), &study);
        differ += usize::from(told(&null) != [0, 0]);
        for record in study.records.iter_mut().filter(|r| r.solver == "soft_step") {
            let Some(sample) = &mut record.sample else { continue };
            sample.blocks_ns.iter_mut().flatten().for_each(|ns| *ns *= 1.1);
            (sample.mean_ns, sample.median_ns) = (1.1 * sample.mean_ns, 1.1 * sample.median_ns);
        }
        let slower = compared(&path.join(&before), &study);
        found += usize::from(told(&slower)[0] > 0);
        println!("{i}: null {:?}, slower {:?}, {:?}", told(&null), told(&slower), null.noise);
    }
    println!("differences in {differ} of {TRIES} null races; a tenth found in {found} of {TRIES}");
    assert!(differ == 0 && 10 * found >= 9 * TRIES);
}

/// `cargo test --release --test cli agree_on_the_time -- --ignored`: `run` and `study` report the same time for a
/// step, within a fifth.
#[test]
#[ignore = "measures times; needs a machine that is not too busy"]
fn commands_agree_on_the_time_of_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let run = succeeds(folder.path(), "run pyramid:20 --solver soft_step --lanes 8 --json");
    let run: serde_json::Value = serde_json::from_str(&run).unwrap();
    let study = "study --scenes pyramid:20 --solvers soft_step --lanes 8 --substeps 4 --out study";
    succeeds(folder.path(), study);
    let study = StudyFile::read(&folder.path().join("study")).unwrap();
    let colored = study.records.iter().find(|r| r.lanes == 8).and_then(|r| r.sample.as_ref()).unwrap();
    let ratio = run["median_step_ns"].as_f64().unwrap() / colored.median_ns;
    assert!((0.8..1.25).contains(&ratio), "{ratio}");
}

#[test]
fn a_sweep_says_which_values_are_the_same_run() {
    let folder = tempfile::tempdir().unwrap();
    let words = "study --quick --scenes stack:2 --solvers soft_step --sweep contact-hertz=15,30,60,120";
    let text = succeeds(folder.path(), words);
    assert!(text.contains("30, 60, 120 Hz give the same run"), "{text}");
}
