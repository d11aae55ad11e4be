//! `simpulse advise`: its recommendation holds, and it reports what it cannot do.

use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::find;
use simpulse::lab::advise::limits::Limits;
use simpulse::lab::advise::{SearchPlan, Trial, advise};
use simpulse::lab::study::{observe, open_scene};
use std::path::Path;
use std::process::{Command, Output};

fn simpulse(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_simpulse")).current_dir(folder).args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Nothing here may depend on the clock: the search never runs out of time.
fn plan(scene: &str, limits: Limits) -> SearchPlan {
    SearchPlan {
        impacts: simpulse::engine::constraints::Impacts::Own,
        scene: scene.to_string(),
        limits,
        solvers: ["pgs", "soft_step"].map(|name| find(name).unwrap()).to_vec(),
        widths: vec![LaneWidth::W1, LaneWidth::W8],
        steps: Some(60),
        repeats: 1,
        seed: 1,
        seconds: 1e9,
    }
}

#[test]
fn what_is_recommended_keeps_the_limits_when_it_is_run_again() {
    // The standard budgets stay within 5 mm on this stack; 2 mm needs a little more.
    let limits = Limits { penetration: Some(2e-3), truth: Some(0.05), ..Limits::default() };
    let plan = plan("stack:4", limits);
    let advice = advise(&plan, &|_| ()).unwrap();
    let best = advice.best().unwrap();
    assert!(!advice.is_cut_short && advice.left_out > 0);
    let width = LaneWidth::from_lanes(best.time.unwrap().lanes).unwrap();
    let again =
        observe(open_scene("stack:4", Some(1), Some(60), None).unwrap(), best.setting.settings(width), 0)
            .unwrap();
    let errors = again.errors.unwrap();
    assert_eq!(Some(errors), best.errors);
    assert!(errors.penetration(false) <= 2e-3 && again.truth.unwrap().error.unwrap() <= 0.05);

    // The recommendation is the fastest finalist that meets the limits, and the finalists are sorted by time.
    let times: Vec<f64> =
        advice.finalists.iter().filter(|t| t.is_good()).map(|t| t.time.unwrap().median_ns).collect();
    assert!(times.is_sorted(), "{times:?}");
    // Both solvers meet the limits, so both are timed.
    let solvers = |t: &Trial| t.setting.solver.name;
    for name in ["pgs", "soft_step"] {
        assert!(advice.finalists.iter().any(|t| solvers(t) == name), "{name}");
    }
}

#[test]
fn a_limit_out_of_reach_has_a_nearest_setting_and_no_advice() {
    // f32 resolves the height of these bodies to 2e-7 m, and settling takes more than that.
    let limits = Limits { penetration: Some(1e-9), ..Limits::default() };
    let advice = advise(&plan("stack:3", limits), &|_| ()).unwrap();
    assert!(advice.best().is_none() && advice.runner_up().is_none());
    let nearest = advice.nearest().unwrap();
    assert!(nearest.excess > 1.0 && nearest.excess.is_finite());
    assert!(advice.trials.iter().all(|t| t.excess >= nearest.excess));
    // No setting was good and none was too slow, so the whole grid was tried.
    assert_eq!(advice.left_out, 0);
    // No step is as fast as a nanosecond, and more work is no faster, so few settings are tried.
    let limits = Limits { time_ns: Some(1.0), penetration: Some(1.0), ..Limits::default() };
    let hopeless = advise(&plan("stack:3", limits), &|_| ()).unwrap();
    assert!(hopeless.best().is_none() && hopeless.trials.len() < advice.trials.len() / 4);
}

#[test]
fn the_program_prints_evidence_and_writes_it() {
    let folder = tempfile::tempdir().unwrap();
    let common = ["--steps", "60", "--repeats", "1", "--lanes", "1,8", "--seconds", "1e6"];
    let with = |args: &[&str]| simpulse(folder.path(), &[&["advise"], args, &common].concat());
    let limits = ["stack:3", "--max-penetration", "5mm", "--max-time", "1s"];
    let found = with(&limits);
    let out = text(&found.stdout);
    assert_eq!(found.status.code(), Some(0), "{}", text(&found.stderr));
    for part in [
        "limits on stack:3: penetration ≤ 5 mm, stands for a minute, rest speed ≤ 5 mm/s, time ≤ 1 s",
        "Stands for 60 s (checked)",
        "runner-up: ",
        "slower",
        "penetration max",
        "±",
    ] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
    let json = |args: &[&str]| -> serde_json::Value {
        serde_json::from_slice(&with(&[args, &["--json"]].concat()).stdout).unwrap()
    };
    let found = json(&limits);
    assert!(found["best"]["errors"]["held_depth_p99_m"].as_f64().unwrap() <= 5e-3);
    assert_eq!(found["best"]["keeps_limits"], true);
    assert_eq!(found["limits"]["time_ns"], 1e9);
    assert!(found["trials"].as_array().unwrap().len() > 4);
    let cpu = &found["environment"]["cpu"];
    assert!(cpu.is_string(), "{cpu}");

    let limits = ["stack:3", "--max-penetration", "1nm", "--solvers", "pgs"];
    let none = with(&limits);
    let out = text(&none.stdout);
    assert_eq!(none.status.code(), Some(1), "{}", text(&none.stderr));
    assert!(
        out.contains("none of the settings tried meets the limits") && out.contains("nearest: pgs"),
        "{out}"
    );
    assert!(out.contains("exceeds its worst limit by a factor of"), "{out}");
    let none = json(&limits);
    assert!(none["best"].is_null() && none["nearest"]["keeps_limits"] == false);
}

#[test]
fn bad_requests_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let table: &[(&[&str], &[&str])] = &[
        (&["staack", "--max-penetration", "1mm"], &["'staack'", "'stack'"]),
        (&["stack:3"], &["set at least one limit"]),
        (&["stack:3", "--max-time", "1ms"], &["set at least one limit"]),
        (&["stack:3", "--max-penetration", "1"], &["max-penetration", "'1'", "unit"]),
        (&["stack:3", "--max-penetration", "1furlong"], &["'1furlong'", "'furlong'", "mm"]),
        (&["stack:3", "--max-penetration", "1mm", "--max-time", "5mm"], &["max-time", "'5mm'", "us"]),
        (&["stack:3", "--max-penetration", "-1mm"], &["'-1mm'"]),
        (&["stack:3", "--max-residual", "1%"], &["max-residual", "'1%'"]),
        (&["stack:3", "--max-reference", "5N"], &["max-reference", "'5N'"]),
        (&["circle_pile:10", "--max-reference", "1mm"], &["max-reference", "circle_pile:10"]),
        (&["stack:3", "--max-penetration", "1mm", "--lanes", "3"], &["lanes", "3"]),
        (&["stack:3", "--max-penetration", "1mm", "--solvers", "pgz"], &["'pgz'", "'pgs'"]),
        (&["stack:3", "--max-penetration", "1mm", "--steps", "0"], &["steps", "0"]),
        (&["stack:3", "--max-penetration", "1mm", "--repeats", "0"], &["repeats", "0"]),
        (&["stack:3", "--max-penetration", "1mm", "--seconds", "0"], &["seconds", "0"]),
    ];
    for (args, parts) in table {
        let output = simpulse(folder.path(), &[&["advise"], *args].concat());
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(
            message.starts_with("error: ") && message.trim_end().lines().count() == 1,
            "{args:?}: {message}"
        );
        for part in *parts {
            assert!(message.contains(part), "{args:?}: '{part}' is not in: {message}");
        }
        assert!(output.stdout.is_empty(), "{args:?}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
