//! Joints in scene files: which are rejected and how, and what is read back.

use crate::common::settings;
use simpulse::engine::solvers::{VARIANTS, find};
use simpulse::lab::scenes::{self, Scene};
use std::path::Path;

/// A static and two dynamic discs with these joints.
fn read(joints: &str) -> Result<Scene, String> {
    let body = |kind: &str, x: f64| {
        format!(r#"{{"type":"{kind}","position":[{x},0],"shapes":[{{"circle":{{"radius":0.2}}}}]}}"#)
    };
    let bodies =
        [body("static", 0.0), body("dynamic", 1.0), body("dynamic", 2.0), body("static", 3.0)].join(",");
    let text = format!(r#"{{"name":"test","bodies":[{bodies}],"joints":[{joints}]}}"#);
    Scene::from_json(&text, Path::new("test.json")).map_err(|e| e.to_string())
}

#[test]
fn bad_joints_are_refused_in_one_line_with_place_and_value() {
    // The joint, the position of the error, and what the message must contain.
    let table = [
        (r#"{"revolute": {"a": 0, "b": 7}}"#, "joints[0].revolute.b: ", "no body 7 among 4"),
        (r#"{"revolute": {"a": 1, "b": 1}}"#, "joints[0].revolute.b: ", "body 1 has no joint to itself"),
        (r#"{"weld": {"a": 0, "b": 3}}"#, "joints[0].weld.b: ", "neither body 0 nor body 3"),
        (r#"{"revolute": {"a": 0, "b": 1, "limits": [1, -1]}}"#, "joints[0].revolute.limits: ", "[1, -1]"),
        (r#"{"revolute": {"a": 0, "b": 1, "limits": [1, 1e39]}}"#, "joints[0].revolute.limits", "1e39"),
        (r#"{"distance": {"a": 0, "b": 1, "length": -2}}"#, "joints[0].distance.length: ", "-2"),
        (r#"{"distance": {"a": 0, "b": 1, "limits": [-1, 2]}}"#, "joints[0].distance.limits[0]: ", "-1"),
        (r#"{"prismatic": {"a": 0, "b": 1, "axis": [0, 0]}}"#, "joints[0].prismatic.axis: ", "direction"),
        (
            r#"{"wheel": {"a": 0, "b": 1, "motor": {"speed": 1, "max": -3}}}"#,
            "joints[0].wheel.motor.max: ",
            "-3",
        ),
        (
            r#"{"wheel": {"a": 0, "b": 1, "spring": {"hertz": -4, "damping_ratio": 1}}}"#,
            "joints[0].wheel.spring.hertz: ",
            "-4",
        ),
        (r#"{"mouse": {"a": 0, "b": 1, "max_force": -1}}"#, "joints[0].mouse.max_force: ", "-1"),
        (r#"{"motor": {"a": 0, "b": 1, "max_torque": 1e39}}"#, "joints[0].motor.max_torque: ", "1e39"),
        (r#"{"revolute": {"a": 0, "b": 1, "anchor_a": [1e39, 0]}}"#, "joints[0].revolute.anchor_a", "1e39"),
        (r#"{"weld": {"a": 0, "b": 1, "break_load": [1, -5]}}"#, "joints[0].weld.break_load[1]: ", "-5"),
        (
            r#"{"hinge": {"a": 0, "b": 1}}"#,
            "joints[0]",
            "unknown variant `hinge`, expected one of `revolute`, `prismatic`",
        ),
        (r#"{"revolute": {"a": 0, "b": 1, "limit": [0, 1]}}"#, "joints[0]", "unknown field `limit`"),
        (r#"{"filter": {"a": 0, "b": 1, "limits": [0, 1]}}"#, "joints[0]", "unknown field `limits`"),
        (r#"{"revolute": {"b": 1}}"#, "joints[0]", "missing field `a`"),
        (r#"{"revolute": {"a": -1, "b": 1}}"#, "joints[0]", "-1"),
        (r#"{"revolute": {"a": 0, "b": 1}, "weld": {"a": 0, "b": 1}}"#, "joints[0]", "expected"),
        ("{}", "joints[0]", "expected"),
        (r#"{"revolute": {"a": 0, "b": 1}}, {"weld": {"a": 1, "b": 9}}"#, "joints[1].weld.b: ", "no body 9"),
    ];
    for (joint, place, words) in table {
        let error = read(joint).expect_err(joint);
        println!("{error}");
        assert!(error.starts_with("test.json: ") && !error.contains('\n'), "{joint}: {error}");
        assert!(error.contains(place) && error.contains(words), "{joint}: {error}");
    }
}

#[test]
fn every_kind_comes_back_and_runs() {
    let kinds = r#"
        {"revolute": {"a": 0, "b": 1, "anchor_a": [0.5, 0], "anchor_b": [-0.5, 0], "limits": [-1, 1]}},
        {"prismatic": {"a": 1, "b": 2, "axis": [1, 0], "motor": {"speed": 1, "max": 2}}},
        {"distance": {"a": 0, "b": 2, "length": 2, "spring": {"hertz": 3, "damping_ratio": 0.5}}},
        {"weld": {"a": 3, "b": 2, "anchor_a": [-1, 0], "linear": {"hertz": 9, "damping_ratio": 1}}},
        {"wheel": {"a": 1, "b": 2, "spring": {"hertz": 3, "damping_ratio": 0.5}, "limits": [-9, 9]}},
        {"motor": {"a": 0, "b": 1, "anchor_a": [1, 0], "max_force": 5}},
        {"mouse": {"a": 0, "b": 2, "target": [2, 1], "break_load": [3, 0]}},
        {"filter": {"a": 1, "b": 3, "collide_connected": true}}"#;
    let scene = read(kinds).unwrap();
    assert_eq!(scene.joints.len(), 8);
    let back = Scene::from_json(&scene.to_json(), Path::new("x.json")).unwrap();
    assert_eq!((&back, back.to_json()), (&scene, scene.to_json()));
    // Six joints on body 2 pull against each other. A Jacobi sweep adds up the corrections of all of them.
    let mut diverged = vec![];
    for solver in VARIANTS.iter().filter(|solver| scene.runs_on(solver).is_ok()) {
        let mut world = scene.build(settings(solver)).unwrap();
        if (0..60).any(|_| world.step().is_err()) {
            diverged.push(solver.name);
        }
    }
    assert_eq!(diverged, ["jacobi"]);
}

#[test]
fn a_solver_that_holds_no_joints_says_so_in_one_line() {
    let scene = scenes::load("pendulum").unwrap().scene;
    let without: Vec<_> = VARIANTS.iter().filter(|v| v.joints_unsupported.is_some()).collect();
    for solver in &without {
        let error = scene.runs_on(solver).unwrap_err().to_string();
        assert!(error.starts_with(&format!("pendulum: {} holds no joints: ", solver.name)), "{error}");
        assert!(scene.build(settings(solver)).is_err());
    }
    assert!(scene.runs_on(find("shim").unwrap()).is_ok());
    // Joints that only prevent collisions have no rows.
    let filter = read(r#"{"filter": {"a": 1, "b": 2}}"#).unwrap();
    assert!(without.iter().all(|solver| filter.runs_on(solver).is_ok()));
}
