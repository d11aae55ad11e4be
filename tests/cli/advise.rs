//! `simpulse advise`: its recommendation holds, it finds out what a file does not say, and it reports what it
//! cannot do.

use crate::{refused, simpulse, text};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::find;
use simpulse::engine::world::Settings;
use simpulse::lab::scenes::Scene;
use simpulse::lab::scenes::tolerance::GivenTolerances;
use simpulse::lab::study::answer::Answer;
use simpulse::lab::study::{self, Record, StudyPlan, open_scene};
use simpulse::lab::trial::Trial;

/// A disc on two crates, and a big box dropped beside them.
const GAME: &str = r#"{ "name": "game", "steps": 300, "bodies": [
    { "type": "static", "position": [0, -1], "shapes": [{ "box": { "half": [10, 1] } }] },
    { "type": "dynamic", "position": [-0.6, 0.5], "shapes": [{ "box": { "half": [0.5, 0.5] } }] },
    { "type": "dynamic", "position": [0.6, 0.5], "shapes": [{ "box": { "half": [0.5, 0.5] } }] },
    { "type": "dynamic", "position": [0, 1.6], "shapes": [{ "circle": { "radius": 0.5 } }] },
    { "type": "dynamic", "position": [3, 3], "shapes": [{ "box": { "half": [1.5, 1.5] } }] }
] }"#;

fn plan(scene: &str, tolerances: GivenTolerances) -> StudyPlan {
    StudyPlan {
        scenes: vec![scene.to_string()],
        solvers: ["pgs", "soft_step"].map(|name| find(name).unwrap()).to_vec(),
        widths: vec![LaneWidth::W1, LaneWidth::W8],
        thorough: true,
        tolerances,
        only_given: true,
        steps: Some(60),
        repeats: 1,
        ..StudyPlan::default()
    }
}

fn records(plan: &StudyPlan) -> Vec<Record> {
    study::run(plan, &|_| (), &mut |_, _| Ok(())).unwrap()
}

#[test]
fn what_is_recommended_keeps_the_limits_when_it_is_run_again() {
    let limits = GivenTolerances { penetration: Some(2e-3), truth: Some(0.05), ..GivenTolerances::default() };
    let records = records(&plan("stack:4", limits));
    let answer = Answer::of(&records).unwrap();
    let best = answer.best().unwrap();
    let mut scene = open_scene("stack:4", Some(1), Some(60), None).unwrap();
    let own = Settings { record_impulses: true, observe_rule: true, ..best.settings().unwrap() };
    let again = Trial::of(&mut scene, own).run(&mut |_| Ok(())).unwrap();
    assert_eq!(again.errors, best.errors);
    assert!(best.errors.unwrap().penetration(true) <= 2e-3);
    assert!(again.truth.unwrap().error.unwrap() <= 0.05);
    // Both solvers meet the limits.
    assert_eq!(answer.of_each_solver().len(), 2);
    // It stands for a minute.
    assert!(best.later.is_some_and(|later| later.broken.is_none()));
}

#[test]
fn a_limit_out_of_reach_has_a_nearest_setting_and_no_advice() {
    // f32 resolves the height of these bodies to 2e-7 m, and settling takes more than that.
    let limits = GivenTolerances { penetration: Some(1e-9), ..GivenTolerances::default() };
    let records = records(&plan("stack:3", limits));
    let answer = Answer::of(&records).unwrap();
    assert!(answer.best().is_none());
    let excess = answer.nearest.unwrap().excess();
    assert!(excess > 1.0 && excess.is_finite());
}

#[test]
fn a_file_that_says_nothing_must_rest_if_the_default_solver_brings_it_to_rest() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("game.json"), GAME).unwrap();
    let words = "advise game.json --max-penetration 5mm --solvers pgs,soft_step,shim --repeats 1 --json";
    let json = simpulse(folder.path(), words);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let said = json["found_out"][0].as_str().unwrap();
    assert!(said.contains("does not say what must hold") && said.contains("rest is required"), "{said}");
    // Nothing ends below the ground within a minute, under any setting that is named.
    let scene = Scene::from_json(GAME, "game.json".as_ref()).unwrap();
    for key in ["best", "runner_up"] {
        let record: Record = serde_json::from_value(json[key].clone()).unwrap();
        let trial = Trial { steps: 3600, measured: 0, ..Trial::new(&scene, record.settings().unwrap()) };
        let end = trial.run(&mut |_| Ok(())).unwrap();
        assert!(end.failure.is_none() && end.broken.is_none());
        let heights = (1..5).map(|i| end.world.bodies.center(i)[1]);
        assert!(heights.into_iter().all(|y| y > 0.4), "{key}");
    }
    // A body that falls for ever need not rest, and that is said first.
    let falls = GAME.replace("[3, 3]", "[30, 3]");
    std::fs::write(folder.path().join("falls.json"), falls).unwrap();
    let out = simpulse(folder.path(), "advise falls.json --max-penetration 5mm --solvers shim");
    let first: String = text(&out.stdout).lines().take(3).collect::<Vec<_>>().join(" ");
    assert!(
        first.starts_with("falls.json does not say") && first.contains("does not come to rest"),
        "{first}"
    );
}

#[test]
fn the_program_prints_evidence_and_writes_it() {
    let folder = tempfile::tempdir().unwrap();
    let with = |words: &str| {
        simpulse(folder.path(), &format!("advise stack:3 --steps 60 --repeats 1 --lanes 1,8 {words}"))
    };
    let limits = "--max-penetration 5mm --max-time 1s";
    let found = with(limits);
    let out = text(&found.stdout);
    assert_eq!(found.status.code(), Some(0), "{}", text(&found.stderr));
    for part in [
        "limits on stack:3: overlap ≤ 5 mm, stands for a minute, rest speed ≤ 5 mm/s, time ≤ 1 s",
        "The cheapest setting that is good enough",
        "slower",
        "verdict",
        "± ",
        "to run it: simpulse run stack:3 --solver ",
    ] {
        assert!(out.contains(part), "'{part}' is not in:\n{out}");
    }
    let json = |words: &str| -> serde_json::Value {
        serde_json::from_slice(&with(&format!("{words} --json")).stdout).unwrap()
    };
    let found = json(limits);
    assert!(found["best"]["errors"]["held_depth_p99_m"].as_f64().unwrap() <= 5e-3);
    assert_eq!(found["max_step_ns"], 1e9);
    assert!(found["trials"].as_array().unwrap().len() > 4);
    let cpu = &found["environment"]["cpu"];
    assert!(cpu.is_string(), "{cpu}");

    let limits = "--max-penetration 1nm --solvers pgs";
    let none = with(limits);
    let out = text(&none.stdout);
    assert_eq!(none.status.code(), Some(1), "{}", text(&none.stderr));
    assert!(out.contains("nearest is pgs") && out.contains("× tolerance"), "{out}");
    let none = json(limits);
    assert!(none["best"].is_null() && none["nearest"]["solver"] == "pgs");
    // A time out of reach.
    let none = with("--max-penetration 5mm --max-time 1ns --solvers pgs");
    assert_eq!(none.status.code(), Some(1));
    let out = text(&none.stdout);
    assert!(out.contains("none of the settings tried meets the limits: the fastest takes "), "{out}");
}

#[test]
fn bad_requests_are_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let table: &[(&str, &[&str])] = &[
        ("staack --max-penetration 1mm", &["'staack'", "'stack'"]),
        ("stack:3", &["set at least one limit"]),
        ("stack:3 --max-time 1ms", &["set at least one limit"]),
        ("stack:3 --max-penetration 1", &["max-penetration", "'1'", "unit"]),
        ("stack:3 --max-penetration 1furlong", &["'1furlong'", "'furlong'", "mm"]),
        ("stack:3 --max-penetration 1mm --max-time 5mm", &["max-time", "'5mm'", "us"]),
        ("stack:3 --max-penetration -1mm", &["'-1mm'"]),
        ("stack:3 --max-residual 1%", &["max-residual", "'1%'"]),
        ("stack:3 --max-reference 5N", &["max-reference", "'5N'"]),
        ("circle_pile:10 --max-reference 1mm", &["max-reference", "circle_pile:10"]),
        ("smash --max-penetration 1mm --max-rest-speed 1m/s", &["max-rest-speed", "smash"]),
        ("stack:3 --max-penetration 1mm --lanes 3", &["lanes", "3"]),
        ("stack:3 --max-penetration 1mm --solvers pgz", &["'pgz'", "'pgs'"]),
        ("stack:3 --max-penetration 1mm --steps 0", &["steps", "0"]),
        ("stack:3 --max-penetration 1mm --repeats 0", &["repeats", "0"]),
    ];
    for (words, parts) in table {
        refused(folder.path(), &format!("advise {words}"), parts);
    }
}
