//! Law: every solver matches its source's method, reimplemented in `f64`, up to departures named in its docs.

use simpulse::engine::solvers::VARIANTS;
use simpulse::lab::agree::table::TABLE;
use simpulse::lab::agree::{self, Agreement};
use std::path::Path;

/// Every row of the table of solvers has an entry.
#[test]
fn every_solver_has_an_entry() {
    let missing: Vec<&str> =
        VARIANTS.iter().map(|v| v.name).filter(|name| TABLE.iter().all(|e| e.solver != *name)).collect();
    assert!(missing.is_empty(), "src/lab/agree/table.rs has no entry for {missing:?}");
    for entry in TABLE {
        assert!(VARIANTS.iter().any(|v| v.name == entry.solver), "{} is no solver", entry.solver);
        assert!(entry.bound < 1.0, "{}", entry.solver);
        // A bound beyond rounding has a reason.
        assert!(entry.bound <= agree::table::ROUNDING || !entry.why.is_empty(), "{}", entry.solver);
    }
}

/// Distances are within their bounds, and the docs match the table and the measurement.
#[test]
fn solvers_agree_with_their_sources() {
    let (mut wrong, mut all) = (String::new(), Vec::new());
    for variant in VARIANTS.iter() {
        let a: Agreement = agree::agreement(variant).unwrap();
        if a.apart.is_nan() || a.apart > a.bound {
            wrong += &format!("{} is {:.1e} apart, {:.0e} allowed\n", a.solver, a.apart, a.bound);
        }
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("src/engine/solvers/{}.rs", a.solver));
        let docs: Vec<String> = std::fs::read_to_string(path).unwrap().lines().map_while(docs).collect();
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        if !words(&docs.join(" ")).contains(&words(&a.docs)) {
            wrong += &format!("docs of {} do not say:\n{}\n", a.solver, a.docs);
        }
        all.push(a);
    }
    let svg = agree::svg(&all).unwrap();
    assert!(svg.trim_end().ends_with("</svg>") && !svg.contains("NaN"));
    assert!(agree::csv(&all).lines().count() > 500 && agree::text(&all).contains("pgs"));
    assert!(wrong.is_empty(), "{wrong}");
}

fn docs(line: &str) -> Option<String> {
    line.strip_prefix("//!").map(String::from)
}

/// A difference in method is detected: one extra substep, or a departure undone.
#[test]
fn a_departure_shows() {
    let pgs = agree::agreement(simpulse::engine::solvers::find("pgs").unwrap()).unwrap();
    assert!(pgs.departures.iter().all(|d| d.apart > 100.0 * pgs.bound), "{:?}", pgs.departures);
}
