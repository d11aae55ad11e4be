//! A [`ConvergeReport`] as text, CSV and JSON.

use super::replay::{Sequence, Start};
use super::warm::{OFF, WarmStartSource};
use super::{ConvergeReport, Reached, ReplayCurve, TOLERANCES};
use crate::lab::error::Error;
use crate::lab::reference::certify::Uniqueness;
use crate::lab::units::{lanes, percent, si};
use comfy_table::{CellAlignment, Table, presets};
use serde::Serialize;

/// Shown for a force error that is not reached.
const NEVER: &str = "never";
/// Shown for what does not exist.
const NONE: &str = "–";
/// Indices in [`TOLERANCES`] of the two force errors in the table: 1 % and 0.01 %.
const TOLD: [usize; 2] = [1, 3];
/// Maximum number of rows of the table; the CSV has all.
const MOST_ROWS: usize = 20;

/// Which solver needs the fewest sweeps, a table of the sweeps of each, the problem, and what the table leaves out.
pub fn text(report: &ConvergeReport) -> String {
    let joints =
        if report.joint_rows > 0 { format!(", {} rows of joints", report.joint_rows) } else { String::new() };
    let rows = rows(report);
    let shown = rows.len().min(MOST_ROWS);
    let more = match rows.len() - shown {
        0 => String::new(),
        more => {
            format!("{more} more rows in converge.csv and converge.json, which also have other orders.\n")
        }
    };
    format!(
        "{}{}{more}\n{}: {} bodies, {} contact points{joints}; {}.\n\
         Force error: how far impulses are from the contact law, at most, in % of {:.4e} N·s: the impulse of the heaviest \
         body's weight, or of its change of velocity if that is larger. Sweeps in parallel order ({}); f64 methods in file \
         order. Own law: that of soft contacts or of position feedback, where it differs. v error: distance of the \
         velocities from the reference.\n{}{}",
        answer(&rows),
        table_of(&rows[..shown]),
        report.problem,
        report.bodies,
        report.contacts,
        reference_line(report),
        report.impulse_unit,
        lanes(report.lanes),
        baseline(report),
        starts(report),
    )
}

fn reference_line(report: &ConvergeReport) -> String {
    let Some(c) = &report.certificate else { return "no reference, so no velocity errors".into() };
    let unique = match c.uniqueness {
        Uniqueness::Proven => "unique (no friction)",
        Uniqueness::Agreed => "agreed on by two methods",
        Uniqueness::Multiple => "NOT unique: compare force errors instead of velocities",
        Uniqueness::Unknown => "found by one method only",
    };
    format!("reference by {} with a force error of {}, velocities {unique}", c.method, percent(c.natural_map))
}

/// A solver under a law.
struct SolverRow<'a> {
    name: String,
    /// Whether it is code of the simulation, under the rigid law.
    competes: bool,
    /// The curves from the previous impulses and from zero; their results under the law.
    starts: [Option<(&'a ReplayCurve, &'a Reached)>; 2],
}

impl SolverRow<'_> {
    /// Sweeps to [`TOLERANCES`]`[at]` from a start; `None` if that start did not run, `Some(None)` if never.
    fn sweeps(&self, at: usize, start: usize) -> Option<Option<usize>> {
        self.starts[start].map(|(curve, reached)| reached.first[at].map(|i| curve.points[i].sweeps))
    }
}

/// The whole schedules in parallel order, and the f64 methods: those first that need the fewest sweeps.
fn rows(report: &ConvergeReport) -> Vec<SolverRow<'_>> {
    let order = |c: &ReplayCurve| {
        if c.arithmetic == "f32" { Sequence::Colored } else { Sequence::Natural }
    };
    let is_whole = |c: &&ReplayCurve| !c.is_part && c.order == order(c);
    let whole: Vec<&ReplayCurve> = report.curves.iter().filter(is_whole).collect();
    let mut rows: Vec<SolverRow> = Vec::new();
    for curve in &whole {
        let is_f32 = curve.arithmetic == "f32";
        for own in [false, true].into_iter().take(if curve.own_is_rigid { 1 } else { 2 }) {
            let suffix = match (is_f32, own) {
                (false, _) => " (f64)",
                (true, true) => ", own law",
                (true, false) => "",
            };
            let name = format!("{}{suffix}", curve.solver);
            if rows.iter().any(|row| row.name == name) {
                continue;
            }
            let starts = [Start::Warm, Start::Cold].map(|start| {
                let mut same =
                    whole.iter().filter(|c| c.solver == curve.solver && c.arithmetic == curve.arithmetic);
                let found = same.find(|c| c.start == start)?;
                Some((*found, if own { &found.own } else { &found.rigid }))
            });
            rows.push(SolverRow { name, competes: is_f32 && !own, starts });
        }
    }
    let key = |row: &SolverRow| {
        let needs = |at, start| row.sweeps(at, start).flatten().unwrap_or(usize::MAX);
        (!row.competes, needs(TOLD[1], 0), needs(TOLD[1], 1), needs(TOLD[0], 0), needs(TOLD[0], 1))
    };
    rows.sort_by_key(key);
    rows
}

/// Who needs the fewest sweeps.
fn answer(rows: &[SolverRow]) -> String {
    let fewest = |at: usize, start: usize| {
        let own = rows.iter().filter(|row| row.competes);
        let needs = own.filter_map(|row| Some((row.sweeps(at, start)??, row.name.as_str())));
        let least = needs.clone().map(|(sweeps, _)| sweeps).min()?;
        let names: Vec<&str> = needs.filter(|(sweeps, _)| *sweeps == least).map(|(_, name)| name).collect();
        Some(format!("{least} ({})", names.join(", ")))
    };
    let mut text = String::new();
    for at in TOLD {
        let tolerance = percent(TOLERANCES[at]);
        let from = [("from the previous impulses", 0), ("from zero", 1)].into_iter();
        let found: Vec<String> =
            from.filter_map(|(words, start)| Some(format!("{} {words}", fewest(at, start)?))).collect();
        text += &match found.is_empty() {
            true => format!("No solver reaches a force error of {tolerance}.\n"),
            false => format!("Fewest sweeps to a force error of {tolerance}: {}.\n", found.join(", ")),
        };
    }
    text + "\n"
}

fn table_of(rows: &[SolverRow]) -> String {
    let [rough, fine] = TOLD.map(|at| percent(TOLERANCES[at]));
    let head = [
        "sweeps to".to_string(),
        format!("{rough}\nwarm"),
        "\nfrom zero".to_string(),
        format!("{fine}\nwarm"),
        "\nfrom zero".to_string(),
        "factor per\niteration".to_string(),
        "smallest\nforce error".to_string(),
        "v error".to_string(),
        "time of an\niteration".to_string(),
    ];
    let mut cells = Table::new();
    cells.load_style(presets::NOTHING).set_header(head);
    for row in rows {
        let mut line = vec![row.name.clone()];
        for (at, start) in TOLD.into_iter().flat_map(|at| [(at, 0), (at, 1)]) {
            line.push(match row.sweeps(at, start) {
                None => NONE.into(),
                Some(None) => NEVER.into(),
                Some(Some(sweeps)) => sweeps.to_string(),
            });
        }
        let last = row.starts[1].or(row.starts[0]);
        let of = |value: Option<String>| value.unwrap_or(NONE.into());
        line.push(of(last.and_then(|(_, reached)| reached.rate).map(|rate| format!("{rate:.4}"))));
        line.push(of(last.map(|(_, reached)| percent(reached.smallest))));
        let error = last.and_then(|(curve, _)| curve.points.last()?.velocity_error);
        line.push(of(error.map(percent)));
        line.push(of(last.and_then(|(curve, _)| curve.iteration).map(|time| si(1e-9 * time.median_ns, "s"))));
        cells.add_row(line);
    }
    for (i, column) in cells.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        column.set_cell_alignment(if i == 0 { CellAlignment::Left } else { CellAlignment::Right });
    }
    cells.to_string().lines().map(|line| line.trim_end().to_string() + "\n").collect()
}

/// The rate of Gauss–Seidel.
fn baseline(report: &ConvergeReport) -> String {
    let Some(rate) = report.gauss_seidel_rate else {
        return "Gauss–Seidel in f64 has no rate here: it never converges, or at once.\n".into();
    };
    let sweeps = |tolerance: f64| (tolerance.ln() / rate.ln()).ceil();
    let counts = match rate < 0.99995 {
        true => format!(": {:.0} sweeps to 1 %, {:.0} to 0.01 %", sweeps(1e-2), sweeps(1e-4)),
        false => String::new(),
    };
    format!(
        "Gauss–Seidel in f64, in file order and from zero, ends at a factor of {rate:.4} per sweep{counts}.\n"
    )
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
