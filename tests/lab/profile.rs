//! Profiling: bytes and operations match the layout, every solver can be profiled, and the world is not
//! affected.

use crate::common::{scene, settings, with_width};
use simpulse::engine::clock::Phase;
use simpulse::engine::constraints::{Layout, PartnerKind};
use simpulse::engine::lanes::LaneWidth;
use simpulse::engine::solvers::{VARIANTS, find};
use simpulse::lab::profile::{model, profile};
use std::process::Command;

#[test]
fn bytes_and_operations_are_those_of_the_layout() {
    let solver = find("soft_step").unwrap();
    for (width, lanes) in [(LaneWidth::W1, 1.0), (LaneWidth::W8, 8.0)] {
        let mut world = crate::common::run(&scene("stack:2"), with_width(solver, width), 5);
        let features = world.features();
        let [on_ground, on_box] = [PartnerKind::Static, PartnerKind::Dynamic]
            .map(|kind| Layout::for_features(&features, kind).bytes(kind) as f64);
        let solve = model::of(&mut world, Phase::Solve).unwrap();
        // Reads: a whole record and its indices, one row or two. Writes: four impulses, and one half row or
        // two. A batch has all its lanes, filled or not.
        assert_eq!(solve.read, lanes * (on_ground + 32.0 + on_box + 64.0));
        assert_eq!(solve.written, lanes * (16.0 + 16.0 + 16.0 + 32.0));
        // Records and indices once, three bodies and the inert row.
        assert_eq!(solve.working_set, lanes * (on_ground + on_box) + 4.0 * 32.0);
        // One contact with the ground and one between boxes.
        assert_eq!(solve.flops, Some(132.0 + 187.0));
        // Without separation, friction coefficient and masses: 1 + 2 · 3 floats less.
        let warm = model::of(&mut world, Phase::WarmStart).unwrap();
        assert_eq!(warm.read, solve.read - lanes * 2.0 * 4.0 * 7.0);
    }
}

#[test]
fn every_solver_has_its_phases_and_goes_on_as_before() {
    for solver in &VARIANTS {
        let mut world = crate::common::run(&scene("pyramid:6"), settings(solver), 5);
        let before = world.state_hash();
        let report = profile(&world, "pyramid:6", 1e-6, false).unwrap();
        assert_eq!(world.state_hash(), before, "{}", solver.name);
        let passes = |phase: Phase| report.phases.iter().find(|p| p.phase == phase).map_or(0.0, |p| p.passes);
        assert!(passes(Phase::Solve) > 0.0 && passes(Phase::Collide) == 1.0, "{}", solver.name);
        for phase in &report.phases {
            assert!(phase.pass_ns > 0.0 && phase.longest_ns >= phase.pass_ns, "{}: {phase:?}", solver.name);
            assert!(phase.work.is_none_or(|work| work.read > 0.0 && work.working_set > 0.0), "{phase:?}");
        }
        assert!(world.step().is_ok(), "{}", solver.name);
    }
    let soft_step = find("soft_step").unwrap();
    let world = crate::common::run(&scene("pyramid:4"), settings(soft_step), 3);
    let report = profile(&world, "pyramid:4", 1e-6, true).unwrap();
    let solve = report.phases.iter().find(|p| p.phase == Phase::Solve).unwrap();
    assert_eq!(solve.passes, f64::from(soft_step.budget.substeps * soft_step.budget.velocity_iterations));
    assert!(solve.limit(report.multiply_adds).is_some());
    assert!(report.phases.iter().all(|p| p.phase != Phase::Position && p.phase != Phase::Restitution));
}

#[test]
fn the_command_prints_a_table_and_json() {
    let run = |args: &[&str]| {
        let out = Command::new(env!("CARGO_BIN_EXE_simpulse")).arg("profile").args(args).output().unwrap();
        (out.status.code(), String::from_utf8(out.stdout).unwrap(), String::from_utf8(out.stderr).unwrap())
    };
    let quick = ["--seconds", "0.01", "--settle", "3"];
    let (code, text, _) = run(&[&["pyramid:3", "pyramid:4"], &quick[..]].concat());
    assert!(code == Some(0) && text.contains("pyramid:4 · shim") && text.contains("ns/contact"), "{text}");
    let (code, text, _) = run(&[&["stack:3", "--json", "--no-ceilings"], &quick[..]].concat());
    let json: serde_json::Value = serde_json::from_str(&text).unwrap();
    let phases = json["phases"].as_array().unwrap();
    assert!(
        code == Some(0) && phases.iter().any(|p| p["phase"] == "solve" && p["flops"].is_number()),
        "{text}"
    );
    let (code, _, error) = run(&["stack:3", "--seconds", "0"]);
    assert!(code == Some(2) && error.contains("seconds: is 0"), "{error}");
}
