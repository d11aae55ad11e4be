//! The hard cases: the list is complete and documented, wrong physics fails, results repeat, and the exit
//! code reflects required cases only.

use simpulse::engine::constraints::Impacts;
use simpulse::engine::solvers::{self, DEFAULT, VARIANTS, Variant};
use simpulse::lab::scenes::Scene;
use simpulse::lab::verify::{self, CASES, Case, Cell, Finding, Lab, LawOf, Required, VerifyMatrix};
use std::collections::BTreeSet;

fn family(id: &str) -> &str {
    id.split('.').next().unwrap()
}

fn run(
    ids: &[&str],
    solvers: &[&'static Variant],
    threads: usize,
    lab: impl Fn(&'static Variant) -> Lab + Sync,
) -> VerifyMatrix {
    let ids: Vec<String> = ids.iter().map(|id| id.to_string()).collect();
    let cases = if ids.is_empty() { Vec::new() } else { verify::select(&ids).unwrap() };
    verify::run(cases, solvers.to_vec(), threads, lab, &|_, _, _| ())
}

fn failed(matrix: &VerifyMatrix) -> Vec<&'static str> {
    let column = |(_, cells): &(&&Case, &Vec<Cell>)| cells[0].passed() == Some(false);
    matrix.cases.iter().zip(&matrix.cells).filter(column).map(|(case, _)| case.id).collect()
}

#[test]
fn every_case_of_the_list_is_there_once_and_documented() {
    let ids: BTreeSet<_> = CASES.iter().map(|case| case.id).collect();
    assert_eq!(ids.len(), CASES.len(), "an id stands twice");
    for case in CASES.iter() {
        let (family, name) = case.id.split_once('.').unwrap_or_else(|| panic!("{} has no family", case.id));
        assert!(family.len() >= 2 && !name.is_empty(), "{}", case.id);
        let (Required::Yes(why) | Required::No(why)) = case.required;
        for text in [case.summary, case.unit, case.tolerance, why] {
            assert!(!text.trim().is_empty(), "{}", case.id);
        }
        assert!(VARIANTS.iter().any(|v| case.law_of.includes(v)), "{}: the law of no solver", case.id);
    }
    // Sections A and B of the list. It has no A11, A12, B11 or B18.
    let a = (0..=18).filter(|n| ![11, 12].contains(n)).map(|n| format!("A{n}"));
    let b = (1..=22).filter(|n| ![11, 18].contains(n)).map(|n| format!("B{n}"));
    for id in a.chain(b) {
        assert!(CASES.iter().any(|case| family(case.id) == id), "{id} must run");
    }
}

#[test]
fn names_select_cases_and_families() {
    let ids = |names: &[&str]| -> Vec<&str> {
        let names: Vec<String> = names.iter().map(|name| name.to_string()).collect();
        verify::select(&names).unwrap().iter().map(|case| case.id).collect()
    };
    assert_eq!(ids(&["b9.gap", "A0"]), ["A0.fall", "B9.gap"]);
    // B1 does not select B10.
    assert_eq!(ids(&["B1"]), ["B1.loads"]);
    assert_eq!(ids(&[]).len(), CASES.len());
    let error = verify::select(&["B9.gapp".to_string()]).err().unwrap().to_string();
    assert!(error.contains("'B9.gapp'") && error.contains("'B9.gap'"), "{error}");
}

/// With wrong physics all of `ids` fail; with correct physics they pass.
fn fails_if(change: fn(&mut Scene), ids: &str) {
    fails_under("pgs", change, ids);
}

fn fails_under(solver: &str, change: fn(&mut Scene), ids: &str) {
    let ids: Vec<&str> = ids.split(' ').collect();
    // Waves, since several cases test impacts.
    let lab = |solver| Lab::new(solver).impacts(Impacts::Waves);
    let right = run(&ids, &[solvers::find(solver).unwrap()], 2, lab);
    assert_eq!(failed(&right), [""; 0], "must pass unchanged");
    let cases = right.cases.clone();
    let wrong =
        verify::run(cases, right.solvers.clone(), 2, |solver| lab(solver).changing(change), &|_, _, _| ());
    let passing: Vec<_> = ids.iter().filter(|id| !failed(&wrong).contains(id)).collect();
    assert!(passing.is_empty(), "pass in wrong physics: {passing:?}");
}

#[test]
fn doubled_gravity_fails() {
    fails_if(
        |scene| scene.gravity[1] *= 2.0,
        "A0.fall A1.slip A1.split A2.stop A3.roll A3.slip A8.conveyor B1.loads B3.pile B7.pyramid B8.plank B14.order B14.freeze A21.wedge A22.box A23.lift A23.slip A25.groove A26.corner A26.rollers B24.shaft",
    );
}

#[test]
fn missing_friction_fails() {
    let smooth = |scene: &mut Scene| {
        scene.bodies.iter_mut().flat_map(|b| &mut b.shapes).for_each(|shape| shape.friction = 0.0);
    };
    fails_if(
        smooth,
        "A1.stick A1.slip A1.threshold A1.split A2.stop A3.roll A3.contact A3.threshold A4.roll A4.back A8.conveyor B10.cards B14.large A4.deep A4.dropped A19.fallen A19.caught A20.discs A20.corner A22.box A22.disc A23.slip A24.belt A25.ladder A26.corner A26.rollers B24.logs",
    );
}

#[test]
fn other_wrong_physics_fails() {
    let plastic = |scene: &mut Scene| {
        scene.bodies.iter_mut().flat_map(|b| &mut b.shapes).for_each(|shape| shape.restitution = 0.0);
    };
    fails_if(plastic, "A5.bounce A7.oblique A20.chain A23.paddle A6.flat");
    let wide = |scene: &mut Scene| scene.bodies.iter_mut().for_each(|body| body.position[0] *= 1.01);
    fails_if(wide, "A25.overhang");
    let fast = |scene: &mut Scene| scene.bodies.iter_mut().for_each(|body| body.angular_velocity *= 1.001);
    fails_if(fast, "A16.spin");
    // Heavier bodies: loads no longer match the masses computed by hand.
    let heavy = |scene: &mut Scene| {
        scene.bodies.iter_mut().flat_map(|b| &mut b.shapes).for_each(|shape| shape.density *= 1.02);
    };
    fails_if(heavy, "A1.split B1.loads B7.pyramid B8.plank");
    // A bounce that adds energy.
    let hop = |scene: &mut Scene| scene.bodies[1].velocity[1] = 1.0;
    fails_if(hop, "B13.hop");
}

/// Sag and recovery of soft contacts.
#[test]
fn soft_truths_fail_without_their_load() {
    let light = |scene: &mut Scene| scene.gravity[1] *= 0.9;
    fails_under("soft_step", light, "B2.depths B2.box B3.recovery");
}

/// Cheap cases for every family of arithmetic.
const FAST: &[&str] =
    &["A0", "A1.slip", "A2", "A3.roll", "A7", "A8", "A16", "A18", "B3.recovery", "B9", "B12", "B13"];

#[test]
fn results_repeat_for_every_solver_and_any_number_of_threads() {
    let solvers: Vec<&Variant> = VARIANTS.to_vec();
    let numbers = |threads| -> Vec<String> {
        let matrix = run(FAST, &solvers, threads, Lab::new);
        matrix.cells.iter().flatten().map(|cell| format!("{cell:?}")).collect()
    };
    let one = numbers(1);
    assert_eq!(one, numbers(3));
    // Only B3.recovery does not apply to every solver.
    let others = solvers.iter().filter(|v| !LawOf::SpringsSweptOnce.includes(v)).count();
    assert!(one.iter().filter(|cell| cell.starts_with("Foreign")).count() == others, "{one:?}");
}

#[test]
fn a_diverged_run_fails_with_step_body_and_speed() {
    let wild = |scene: &mut Scene| scene.bodies[0].velocity[0] = 1e6;
    let matrix = verify::run(
        verify::select(&["A0".to_string()]).unwrap(),
        vec![solvers::find("pgs").unwrap()],
        1,
        |solver| Lab::new(solver).changing(wild),
        &|_, _, _| (),
    );
    let Cell::Failed(failure) = &matrix.cells[0][0] else { panic!("{:?}", matrix.cells) };
    let text = failure.to_string();
    assert!(text.contains("diverged at step 1: body 0") && text.contains("m/s"), "{text}");
    assert_eq!(matrix.cells[0][0].passed(), Some(false));
}

#[test]
fn only_broken_promises_of_the_solver_itself_count() {
    let required = CASES.iter().find(|case| case.required.is_required()).unwrap();
    let free = CASES.iter().find(|case| !case.required.is_required()).unwrap();
    let (good, bad) =
        (|| Cell::Found(Finding::new(1.0, 1.0, 0.0)), || Cell::Found(Finding::new(2.0, 1.0, 0.5)));
    let matrix = |cells| VerifyMatrix {
        cases: vec![required, free],
        solvers: vec![solvers::find("pgs").unwrap(), solvers::find(DEFAULT).unwrap()],
        cells,
    };
    let broken = |cells| matrix(cells).broken_promises(DEFAULT);
    assert_eq!(broken(vec![vec![bad(), good()], vec![bad(), bad()]]), Some(vec![]));
    assert_eq!(broken(vec![vec![good(), bad()], vec![good(), good()]]), Some(vec![required.id]));
    assert_eq!(broken(vec![vec![good(), Cell::Foreign], vec![good(), good()]]), Some(vec![]));
    let failed = || Cell::Failed(verify::Failure::Unmeasured("nothing".into()));
    assert_eq!(broken(vec![vec![good(), failed()], vec![good(), failed()]]), Some(vec![required.id]));
    assert_eq!(matrix(vec![vec![good(), good()], vec![good(), good()]]).broken_promises("projection"), None);
}

/// Required cases that the default solver fails. A case that joins this list is news and belongs in the
/// README.
const FAILS: &[&str] = &[];

#[test]
fn the_default_solver_keeps_its_promises_but_for_those_that_are_told() {
    let cases: Vec<&Case> = CASES.iter().copied().filter(|case| case.required.is_required()).collect();
    let matrix = verify::run(cases, vec![solvers::find(DEFAULT).unwrap()], 2, Lab::new, &|_, _, _| ());
    assert_eq!(matrix.broken_promises(DEFAULT), Some(FAILS.to_vec()));
}
