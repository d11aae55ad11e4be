//! A [`ConvergeReport`] as text, CSV and JSON.

use super::replay::{Sequence, Start};
use super::warm::{OFF, WarmStartSource};
use super::{ConvergeReport, CurvePoint, Reached, ReplayCurve, TOLERANCES};
use crate::lab::error::Error;
use crate::lab::reference::certify::Uniqueness;
use crate::lab::units::{is_emulated, si};
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

/// Shown for a tolerance that is not reached.
const NEVER: &str = "—";
/// Indices in [`TOLERANCES`] of the two tolerances in the answer.
const TOLD: [usize; 2] = [1, 3];
/// Maximum number of rows of the table; the CSV has all.
const MOST_ROWS: usize = 20;

/// The answer in sentences: sweeps that each solver needs to 1e-2 and to 1e-4, cold and warm, next to the
/// rate of Gauss–Seidel. Then a table of iterations to each tolerance.
pub fn text(report: &ConvergeReport) -> String {
    let joints =
        if report.joint_rows > 0 { format!(", {} rows of joints", report.joint_rows) } else { String::new() };
    format!(
        "{}: {} bodies, {} contact points{joints}; residuals in units of {:.4e} N·s\n{}\n{}\n{}\n{}",
        report.problem,
        report.bodies,
        report.contacts,
        report.impulse_unit,
        reference_line(report),
        answer(report),
        starts(report),
        rows(report)
    )
}

fn reference_line(report: &ConvergeReport) -> String {
    let Some(c) = &report.certificate else { return "Reference: none, so no velocity errors".into() };
    let unique = match c.uniqueness {
        Uniqueness::Proven => "unique (no friction)",
        Uniqueness::Agreed => "agreed on by two methods",
        Uniqueness::Multiple => "NOT unique: use the residual instead of their error",
        Uniqueness::Unknown => "found by one method only",
    };
    format!("Reference: {}, natural-map residual {:.1e}, velocities {unique}", c.method, c.natural_map)
}

/// Whole schedules in colored order.
fn answer(report: &ConvergeReport) -> String {
    let is_whole = |c: &&ReplayCurve| c.arithmetic == "f32" && c.order == Sequence::Colored && !c.is_part;
    let whole: Vec<&ReplayCurve> = report.curves.iter().filter(is_whole).collect();
    let emulated = if is_emulated(report.lanes) { ", emulated" } else { "" };
    let mut text =
        format!("In colored order ({} lanes{emulated}), against the rigid contact law:\n", report.lanes);
    for (at, start) in TOLD.into_iter().flat_map(|at| [(at, Start::Cold), (at, Start::Warm)]) {
        let own: Vec<_> =
            whole.iter().filter(|c| c.start == start).map(|c| (&c.solver, to(c, &c.rigid, at))).collect();
        if own.is_empty() {
            continue;
        }
        let mut reached: Vec<_> = own.iter().filter_map(|(name, n)| n.map(|n| (n, name))).collect();
        reached.sort();
        let each: Vec<String> = reached.iter().map(|(n, name)| format!("{name} {n}")).collect();
        let never: Vec<&str> =
            own.iter().filter(|(_, n)| n.is_none()).map(|(name, _)| name.as_str()).collect();
        text += &format!("Sweeps to {:.0e}, {start}: ", TOLERANCES[at]);
        text += &match (each.is_empty(), never.is_empty()) {
            (true, _) => "no solver reaches it".into(),
            (false, true) => each.join(", "),
            (false, false) => format!("{}; never {}", each.join(", "), never.join(", ")),
        };
        text += ".\n";
    }
    let changed: Vec<String> = (whole.iter().filter(|c| !c.own_is_rigid && c.start == Start::Cold))
        .map(|c| {
            let sweeps = TOLD.map(|at| {
                let n = to(c, &c.own, at).map_or("none".into(), |n| n.to_string());
                format!("{n} to {:.0e}", TOLERANCES[at])
            });
            format!("{} {}", c.solver, sweeps.join(", "))
        })
        .collect();
    if !changed.is_empty() {
        let list = changed.join("; ");
        text += &format!("Sweeps to a solver's own law, if it differs from the rigid law, cold: {list}.\n");
    }
    text + &baseline(report, &whole)
}

/// Sweeps to a tolerance.
fn to(curve: &ReplayCurve, law: &Reached, at: usize) -> Option<usize> {
    law.first[at].map(|i| curve.points[i].sweeps)
}

/// Measured rates, compared with that of Gauss–Seidel.
fn baseline(report: &ConvergeReport, curves: &[&ReplayCurve]) -> String {
    let Some(rate) = report.gauss_seidel_rate else {
        return "Gauss–Seidel in f64 has no rate here: it never converges, or at once.\n".into();
    };
    let sweeps = |tolerance: f64| (tolerance.ln() / rate.ln()).ceil();
    let mut text = format!(
        "Gauss–Seidel in f64, in the problem's order and from zero, has an asymptotic rate of {rate:.4} per sweep"
    );
    if rate < 1.0 {
        text += &format!(", {:.0} sweeps to 1e-2 and {:.0} to 1e-4", sweeps(1e-2), sweeps(1e-4));
    }
    let is_rigid = |c: &&&ReplayCurve| c.start == Start::Cold && c.own_is_rigid;
    let measured =
        curves.iter().filter(is_rigid).filter_map(|c| Some(format!("{} {:.4}", c.solver, c.rigid.rate?)));
    match measured.collect::<Vec<_>>().as_slice() {
        [] => text + ".\n",
        list => format!("{text}; measured per iteration: {}.\n", list.join(", ")),
    }
}

/// Where warm starts come from, and which curves are missing.
fn starts(report: &ConvergeReport) -> String {
    let mut text = match report.warm_start {
        WarmStartSource::Captured => {
            "Warm starts: the impulses of the previous step, stored in the problem.\n".into()
        }
        WarmStartSource::Drawn => format!(
            "Warm starts: the problem stores no impulses of a previous step; these are the impulses of the reference, each changed by up to {:.0} %.\n",
            100.0 * OFF
        ),
        WarmStartSource::None => {
            "No warm starts: the problem has neither impulses of a previous step nor a certified reference.\n"
                .into()
        }
    };
    if !report.forgetful.is_empty() {
        text += &format!("No warm curve (no warm starting): {}.\n", report.forgetful.join(", "));
    }
    let unobserved = report.curves.iter().filter(|c| c.points.iter().all(|p| p.own.is_none()));
    let mut names: Vec<&str> = unobserved.map(|c| c.solver.as_str()).collect();
    names.dedup();
    if !names.is_empty() {
        text += &format!(
            "No curve under the solver's own law (it has none in terms of bias and compliance of normal rows): {}.\n",
            names.join(", ")
        );
    }
    text
}

/// One row per curve, or two if the solver's own law differs from the rigid one. If these are too many, only
/// whole schedules in colored order, and of those the first to 1e-4.
fn rows(report: &ConvergeReport) -> String {
    let laws = |c: &'_ &ReplayCurve| if c.own_is_rigid { 1 } else { 2 };
    let mut shown: Vec<&ReplayCurve> = report.curves.iter().collect();
    let count = |shown: &[&ReplayCurve]| shown.iter().map(laws).sum::<usize>();
    let all = count(&shown);
    if all > MOST_ROWS {
        shown.retain(|c| !c.is_part && (c.order == Sequence::Colored || c.arithmetic == "f64"));
        shown.retain(|c| !matches!(c.order, Sequence::Shuffled(_)));
        if count(&shown) > MOST_ROWS {
            shown.sort_by_key(|c| to(c, &c.rigid, 3).unwrap_or(usize::MAX));
        }
        while count(&shown) > MOST_ROWS {
            shown.pop();
        }
    }
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let mut header: Vec<String> = ["solver", "order", "start", "law"].map(String::from).to_vec();
    header.extend(TOLERANCES.map(|t| format!("{t:.0e}")));
    header.extend(["rate", "smallest", "v error", "iteration"].map(String::from));
    table.set_header(header);
    for curve in &shown {
        for (law, reached) in [("rigid", &curve.rigid), ("own", &curve.own)].into_iter().take(laws(curve)) {
            let name = if curve.arithmetic == "f32" { "" } else { " (f64)" };
            let mut row = vec![format!("{}{name}", curve.solver)];
            row.extend([curve.order.to_string(), curve.start.to_string(), law.into()]);
            let number = |value: Option<String>| value.unwrap_or(NEVER.into());
            row.extend(reached.first.map(|i| number(i.map(|i| iterations(&curve.points[i])))));
            row.push(number(reached.rate.map(|r| format!("{r:.4}"))));
            row.push(format!("{:.1e}", reached.smallest));
            let error = curve.points.last().and_then(|p| p.velocity_error);
            row.push(number(error.map(|e| format!("{e:.1e}"))));
            row.push(number(curve.iteration.map(|time| si(1e-9 * time.median_ns, "s"))));
            table.add_row(row);
        }
    }
    for column in table.column_iter_mut().skip(4) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let more = match all - count(&shown) {
        0 => String::new(),
        more => format!("{more} more rows: converge.csv and converge.json have all curves.\n"),
    };
    format!(
        "Iterations to a residual (iterations/sweeps where they differ), by law; time of an iteration:\n{table}\n{more}"
    )
}

fn iterations(point: &CurvePoint) -> String {
    match point.iterations as usize == point.sweeps {
        true => point.sweeps.to_string(),
        false => format!("{}/{}", point.iterations, point.sweeps),
    }
}

/// A point of a curve, as a line of CSV.
#[derive(Serialize)]
struct StateLine<'a> {
    problem: &'a str,
    solver: &'a str,
    arithmetic: &'static str,
    order: String,
    start: String,
    iterations: u32,
    sweeps: usize,
    time_ns: Option<f64>,
    rigid_residual: f64,
    own_residual: Option<f64>,
    velocity_error: Option<f64>,
}

/// Every point of every curve, one per line, with a header.
pub fn csv(report: &ConvergeReport) -> Result<String, Error> {
    let refuse = |e: String| Error::invalid("converge.csv", e);
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (curve, p) in report.curves.iter().flat_map(|c| c.points.iter().map(move |p| (c, p))) {
        let line = StateLine {
            problem: &report.problem,
            solver: &curve.solver,
            arithmetic: curve.arithmetic,
            order: curve.order.to_string(),
            start: curve.start.to_string(),
            iterations: p.iterations,
            sweeps: p.sweeps,
            time_ns: curve.iteration.map(|each| each.median_ns * f64::from(p.iterations)),
            rigid_residual: p.rigid,
            own_residual: p.own,
            velocity_error: p.velocity_error,
        };
        writer.serialize(line).map_err(|e| refuse(e.to_string()))?;
    }
    let bytes = writer.into_inner().map_err(|e| refuse(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| refuse(e.to_string()))
}

/// The whole report. Non-finite numbers become null.
pub fn json(report: &ConvergeReport) -> Result<String, Error> {
    let text = serde_json::to_string(report);
    Ok(text.map_err(|e| Error::invalid("converge.json", e.to_string()))? + "\n")
}
