//! Every mechanism of a solver is needed: the case named in its row fails without it.

use simpulse::engine::params::Without;
use simpulse::engine::solvers::VARIANTS;
use simpulse::engine::world::Settings;
use simpulse::lab::torture::{TortureVerdict, family, run_solver};
use simpulse::lab::verify::{self, Lab};

/// Scenes drawn per family.
const SCENES: u32 = 120;

/// Smallest ratio of failing scenes without a mechanism to failing scenes with it (1).
const MORE: f64 = 1.3;

/// Smallest difference of these numbers.
const AT_LEAST: f64 = 3.0;

#[test]
fn every_mechanism_has_a_case_that_fails_without_it() {
    for variant in VARIANTS {
        for (place, mechanism) in variant.mechanisms.iter().enumerate() {
            let (name, without) = (mechanism.name, Without::default().and(place));
            if let Some(of) = mechanism.case.strip_prefix("random ") {
                let (of, word) = of.split_once(' ').unwrap();
                let verdict = TortureVerdict::ALL.into_iter().find(|v| v.word() == word).unwrap();
                let failing = |without| {
                    let settings = Settings { without, ..Settings::new(variant) };
                    let of = family(of).unwrap();
                    let fails = |n: &u32| run_solver(&of.case(1, *n), &settings).unwrap().has(verdict);
                    (0..SCENES).filter(fails).count() as f64
                };
                let [with, without] = [Without::default(), without].map(failing);
                assert!(
                    without >= (MORE * with).max(with + AT_LEAST),
                    "{name}: {with} scenes fail, and {without} without it"
                );
            } else if mechanism.case.contains("::") {
                let (file, test) = mechanism.case.split_once("::").unwrap();
                let path = format!("{}/tests/lab/{file}.rs", env!("CARGO_MANIFEST_DIR"));
                let text = std::fs::read_to_string(&path).unwrap();
                assert!(
                    text.contains(&format!("fn {test}")) && text.contains(&format!("mechanism(\"{name}\")")),
                    "{name}"
                );
            } else {
                let cases = verify::select(&[mechanism.case.to_string()]).unwrap();
                let passed = |without| {
                    let lab = |v| Lab::new(v).without(without);
                    let found = verify::run(cases.clone(), vec![variant], 1, lab, &|_, _, _| ());
                    found.cells[0][0].passed()
                };
                assert_eq!(passed(Without::default()), Some(true), "{name}: {}", mechanism.case);
                assert_eq!(passed(without), Some(false), "{name}: {}", mechanism.case);
            }
        }
    }
}
