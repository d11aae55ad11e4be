//! A [`ConvergeReport`] as tables, CSV and JSON.

use super::warm::{OFF, WarmStartSource};
use super::{ConvergeReport, CurvePoint, Reached, ReplayCurve, TOLERANCES};
use crate::lab::error::Error;
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

/// Shown for a tolerance that is not reached.
const NEVER: &str = "—";

/// Human-readable tables: iterations to each tolerance and, if measured, times.
pub fn text(report: &ConvergeReport) -> String {
    let mut out = format!(
        "{}: {} bodies, {} contact points{}; residuals in units of {:.4e} N·s\n{}\n",
        report.problem,
        report.bodies,
        report.contacts,
        if report.joint_rows > 0 { format!(", {} rows of joints", report.joint_rows) } else { String::new() },
        report.impulse_unit,
        reference_line(report)
    );
    out += &starts(report);
    out += "\nIterations to a residual (iterations/sweeps where they differ), by law:\n";
    let mut table = table(&["rate", "smallest", "v error"]);
    let each = || report.curves.iter().flat_map(laws);
    for (curve, law, reached) in each() {
        let mut row = head(curve, law);
        row.extend(reached.first.map(|i| i.map_or(NEVER.into(), |i| count(&curve.points[i]))));
        row.push(reached.rate.map_or(NEVER.into(), |r| format!("{r:.4}")));
        row.push(format!("{:.1e}", reached.smallest));
        let error = curve.points.last().and_then(|p| p.velocity_error);
        row.push(error.map_or(NEVER.into(), |e| format!("{e:.1e}")));
        table.add_row(row);
    }
    align(&mut table);
    out += &format!("{table}\n");
    if report.curves.iter().any(|c| c.iteration.is_some()) {
        out +=
            "\nTime to a residual, set-up excluded; an iteration: median over the rounds, and quartiles:\n";
        let mut table = self::table(&["per iteration", "quartiles"]);
        for (curve, law, reached) in each() {
            let Some(each) = curve.iteration else { continue };
            let mut row = head(curve, law);
            let time = |i: usize| duration(each.median_ns * f64::from(curve.points[i].iterations));
            row.extend(reached.first.map(|i| i.map_or(NEVER.into(), time)));
            let [low, high] = each.quartiles_ns.map(duration);
            row.extend([duration(each.median_ns), format!("{low} to {high}")]);
            table.add_row(row);
        }
        align(&mut table);
        out += &format!("{table}\n");
    }
    out
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
    let mut unobserved: Vec<&str> = Vec::new();
    for curve in &report.curves {
        let is_new = !unobserved.contains(&curve.solver.as_str());
        if is_new && curve.points.iter().all(|p| p.own.is_none()) {
            unobserved.push(&curve.solver);
        }
    }
    if !unobserved.is_empty() {
        text += &format!(
            "No curve under the solver's own law (it has none in terms of bias and compliance of normal rows): {}.\n",
            unobserved.join(", ")
        );
    }
    text
}

fn reference_line(report: &ConvergeReport) -> String {
    match &report.certificate {
        Some(c) => format!(
            "Reference: {}, natural-map residual {:.1e}, velocities {}",
            c.method,
            c.natural_map,
            match c.uniqueness {
                crate::lab::reference::certify::Uniqueness::Proven => "unique (no friction)",
                crate::lab::reference::certify::Uniqueness::Agreed => "agreed on by two families",
                crate::lab::reference::certify::Uniqueness::Multiple =>
                    "NOT unique: use the residual instead of their error",
                crate::lab::reference::certify::Uniqueness::Unknown => "found by one family only",
            }
        ),
        None => "Reference: none, so no velocity errors".into(),
    }
}

/// One row per curve, or two if the solver's own law differs from the rigid one.
fn laws(curve: &ReplayCurve) -> impl Iterator<Item = (&ReplayCurve, &'static str, &Reached)> {
    let own = (!curve.own_is_rigid).then_some((curve, "own", &curve.own));
    [(curve, "rigid", &curve.rigid)].into_iter().chain(own)
}

fn table(last: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    let mut header: Vec<String> = ["solver", "order", "start", "law"].map(String::from).to_vec();
    header.extend(TOLERANCES.map(|t| format!("{t:.0e}")));
    header.extend(last.iter().map(|s| s.to_string()));
    table.set_header(header);
    table
}

fn align(table: &mut Table) {
    for column in table.column_iter_mut().skip(4) {
        column.set_cell_alignment(CellAlignment::Right);
    }
}

fn head(curve: &ReplayCurve, law: &str) -> Vec<String> {
    let solver = match curve.arithmetic {
        "f32" => curve.solver.clone(),
        other => format!("{} ({other})", curve.solver),
    };
    vec![solver, curve.order.to_string(), curve.start.to_string(), law.into()]
}

fn count(point: &CurvePoint) -> String {
    if point.iterations as usize == point.sweeps {
        point.sweeps.to_string()
    } else {
        format!("{}/{}", point.iterations, point.sweeps)
    }
}

/// A time (ns) with a suitable unit and three digits.
fn duration(ns: f64) -> String {
    let (value, unit) = match ns {
        0.0 => return "0".into(),
        ns if ns < 1e3 => (ns, "ns"),
        ns if ns < 1e6 => (ns / 1e3, "µs"),
        ns if ns < 1e9 => (ns / 1e6, "ms"),
        ns => (ns / 1e9, "s"),
    };
    let digits = if value < 10.0 { 2 } else { usize::from(value < 100.0) };
    format!("{value:.digits$} {unit}")
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
    for curve in &report.curves {
        for p in &curve.points {
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
    }
    let bytes = writer.into_inner().map_err(|e| refuse(e.to_string()))?;
    String::from_utf8(bytes).map_err(|e| refuse(e.to_string()))
}

/// The whole report. Non-finite numbers become null.
pub fn json(report: &ConvergeReport) -> Result<String, Error> {
    let text = serde_json::to_string(report);
    Ok(text.map_err(|e| Error::invalid("converge.json", e.to_string()))? + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_three_digits() {
        let texts = [0.0, 1.234, 12.34, 123.4, 1234.0, 2.5e6, 7e9].map(duration);
        assert_eq!(texts, ["0", "1.23 ns", "12.3 ns", "123 ns", "1.23 µs", "2.50 ms", "7.00 s"]);
    }
}
