//! The effect of each mechanism of a solver: the cases that runs without it lose and win.

use crate::engine::params::Without;
use crate::engine::solvers::Variant;
use crate::lab::report::table::{finish, table};
use crate::lab::verify::{self, Case, Lab};

/// A mechanism, and the effect of leaving it out.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Ablated {
    /// The solver.
    pub solver: &'static str,
    /// Name of the mechanism.
    pub mechanism: &'static str,
    /// Purpose of the mechanism.
    pub meaning: &'static str,
    /// The check that needs it: a case, a family of random scenes, or a test.
    pub needed_for: &'static str,
    /// Cases that pass with the mechanism and fail without it.
    pub lost: Vec<&'static str>,
    /// Cases that fail with the mechanism and pass without it.
    pub won: Vec<&'static str>,
}

/// Leaves out each mechanism of `solver` in turn. `lab` builds the whole solver's laboratory; `tell` receives
/// the number of finished parts, the total, and the name of the next part.
pub fn run(
    solver: &'static Variant,
    cases: &[&'static Case],
    threads: usize,
    lab: impl Fn(&'static Variant) -> Lab + Sync,
    tell: &(dyn Fn(usize, usize, &str) + Sync),
) -> Vec<Ablated> {
    let total = solver.mechanisms.len() + 1;
    let passed = |without: Without, done: usize, name: &str| -> Vec<Option<bool>> {
        let tell = |_, _, what: &str| tell(done, total, &format!("{name}: {what}"));
        let lab = |solver| lab(solver).without(without);
        let found = verify::run(cases.to_vec(), vec![solver], threads, lab, &tell);
        found.cells.iter().map(|cells| cells[0].passed()).collect()
    };
    let whole = passed(Without::default(), 0, "whole");
    let each = solver.mechanisms.iter().enumerate().map(|(place, mechanism)| {
        let found = passed(Without::default().and(place), place + 1, mechanism.name);
        let turned = |before: bool| {
            let cases = cases.iter().zip(whole.iter().zip(&found));
            let turned = cases.filter(|(_, now)| *now == (&Some(before), &Some(!before)));
            turned.map(|(case, _)| case.id).collect()
        };
        Ablated {
            solver: solver.name,
            mechanism: mechanism.name,
            meaning: mechanism.meaning,
            needed_for: mechanism.case,
            lost: turned(true),
            won: turned(false),
        }
    });
    each.collect()
}

/// The results as a table.
pub fn text(rows: &[Ablated]) -> String {
    let mut cases = table(&["solver", "without", "needed for", "cases won", "cases lost"]);
    let list = |cases: &[&str]| if cases.is_empty() { "–".to_string() } else { cases.join(" ") };
    for row in rows {
        let [solver, mechanism, needed_for] = [row.solver, row.mechanism, row.needed_for].map(String::from);
        cases.add_row([solver, mechanism, needed_for, list(&row.won), list(&row.lost)]);
    }
    finish(cases, 5)
}
