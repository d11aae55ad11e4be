//! The matrix of `simpulse verify`, colored by margin.

use crate::lab::chart::scale::number;
use crate::lab::picture::Color;
use crate::lab::report::doc::{DocBlock, DocCell, DocTable, Tone};
use crate::lab::study::curve::distinct;
use serde::Deserialize;
use serde_json::Value;

/// The parts of `verify.json` that the page needs.
#[derive(Debug, Deserialize)]
pub struct VerifyFile {
    cases: Vec<MatrixCase>,
    results: Vec<MatrixCell>,
}

#[derive(Debug, Deserialize)]
struct MatrixCase {
    case: String,
    what: String,
    required: bool,
}

#[derive(Debug, Deserialize)]
struct MatrixCell {
    case: String,
    solver: String,
    passed: Option<bool>,
    /// A number, or the word for an infinite one.
    #[serde(default)]
    margin: Value,
    #[serde(default)]
    reason: Option<String>,
    #[serde(default)]
    measured: Value,
    #[serde(default)]
    reference: Value,
    #[serde(default)]
    tolerance: Value,
}

/// Blue within the tolerance, red beyond it, pale at the limit: distinct with any color vision.
const WITHIN: [Color; 2] = [Color::rgb(0x4393c3), Color::rgb(0xe3eff6)];
const BEYOND: [Color; 2] = [Color::rgb(0xfde0d0), Color::rgb(0xb2182b)];

/// The color of a margin, and whether white text is more readable on it.
fn shade(margin: f64, passed: bool) -> (String, bool) {
    let ([from, to], share) = match passed {
        true => (WITHIN, margin.clamp(0.0, 1.0)),
        // The darkest color is reached at a thousand times the tolerance.
        false => (BEYOND, margin.max(1.0).log10() / 3.0),
    };
    let Color(r, g, b, _) = from.toward(to, share);
    let light = 0.3 * f64::from(r) + 0.6 * f64::from(g) + 0.1 * f64::from(b);
    (format!("#{r:02x}{g:02x}{b:02x}"), light < 130.0)
}

fn word(value: &Value) -> String {
    value.as_f64().map_or_else(|| value.as_str().unwrap_or("–").to_string(), number)
}

/// The matrix as a table.
pub fn matrix(matrix: &VerifyFile) -> Vec<DocBlock> {
    let solvers = distinct(matrix.results.iter().map(|outcome| outcome.solver.as_str()));
    let head: Vec<&str> = ["case", "what"].into_iter().chain(solvers.iter().copied()).collect();
    let mut rows = DocTable { class: "matrix", ..DocTable::new("", 2, &head) };
    for case in &matrix.cases {
        let star = if case.required { "*" } else { "" };
        let cell = |solver: &&str| {
            let found = matrix.results.iter().find(|o| o.case == case.case && o.solver == **solver);
            found.map_or_else(|| "n/a".into(), cell_of)
        };
        let names = [DocCell::from(format!("{}{star}", case.case)), case.what.as_str().into()];
        rows.row(names.into_iter().chain(solvers.iter().map(cell)));
    }
    let legend = "A cell is error ÷ tolerance: up to 1 passes, ✗ fails. *: required of the default solver.";
    vec![DocBlock::Table(rows), DocBlock::Text(Tone::Soft, legend.into())]
}

fn cell_of(outcome: &MatrixCell) -> DocCell {
    let Some(passed) = outcome.passed else { return "n/a".into() };
    let margin = outcome.margin.as_f64().unwrap_or(f64::INFINITY);
    let (color, white) = shade(margin, passed);
    let sign = if passed { "" } else { "✗ " };
    let shown = if margin.is_finite() { number(margin) } else { "∞".into() };
    let [measured, reference, tolerance] =
        [&outcome.measured, &outcome.reference, &outcome.tolerance].map(word);
    let numbers = format!("measured {measured}, reference {reference} ± {tolerance}");
    let css = format!("background:{color};color:{}", if white { "#fff" } else { "#1f2933" });
    DocCell { css, title: outcome.reason.clone().unwrap_or(numbers), ..format!("{sign}{shown}").into() }
}
