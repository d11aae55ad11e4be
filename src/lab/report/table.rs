//! Tables for a terminal of 160 columns.

use super::units::{bodies, digits, is_emulated, ratio, si};
use crate::engine::world::Order;
use crate::lab::metrics::Errors;
use crate::lab::study::{self, Fronts, Record, TruthError};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// Description of the columns of [`scene_table`], printed once per study.
pub const LEGEND: &str = "\
budget: substeps; then velocity (vel), relaxation (rel) and position (pos) sweeps per substep.
lanes: natural means one contact after the other in natural order; a number means colored order in so many lanes.
The errors are the same for all lane widths of a budget.
µs/step: mean over the run, its median and its longest step, ± median deviation of a repeat.  ns/row: time of a sweep per constraint row.
speed-up: over 1 lane.  holds: yes, or what happened (fell, slid, tunneled, blew up).
penetration: as judged (99 % of contact points, and the maximum at rest), and maximum.  residual: rms of the
contact law, in the weight of the lighter body × step, and in the mean weight of a body × step.
energy, momentum: relative change.  rest speed: rms over the last second.
reference: distance to the scene's reference value; missed if the run never reached it, – if none is known.
sweeps: per step.  colors: of contacts.  occupancy: share of lanes that hold a contact.
Pareto: on the Pareto front of time against p penetration, l contact-law residual, t reference value.
";

/// A table without a frame.
pub(crate) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(header.to_vec());
    table
}

/// Maximum line length of the page printed by a study (characters).
pub const PAGE_WIDTH: usize = 120;

/// The same table with at most `width` characters per line; long cells are wrapped.
pub(crate) fn narrow(mut table: Table, width: usize) -> Table {
    table.set_content_arrangement(ContentArrangement::Dynamic);
    // Two of these are the blanks after the last column.
    table.set_width(width as u16 + 2);
    table
}

/// Text of a table. All columns except the first `left` are right-aligned; columns are separated by two
/// blanks.
pub(crate) fn finish(mut table: Table, left: usize) -> String {
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        if i >= left {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let text = table.to_string();
    text.lines().map(|line| line.trim_end().to_string() + "\n").collect()
}

/// Table of the records of one scene; errors appear once per solver, budget and order.
pub fn scene_table(records: &[Record]) -> String {
    let Some(first) = records.first() else { return String::new() };
    let mut text = format!("{} · {} · dt {}", first.scene, bodies(first.bodies), si(first.dt, "s"));
    if let Some(steps) = records.iter().find_map(|r| Some(r.errors?.steps)) {
        text += &format!(" · {steps} steps");
    }
    if let Some(truth) = records.iter().find_map(|r| r.truth) {
        text += &format!(" · reference value: {} = {}", truth.quantity, si(truth.expected, truth.unit));
    }
    text += "\n";
    let mut rows = table(&[
        "solver",
        "budget",
        "lanes",
        "µs/step",
        "median",
        "longest",
        "±",
        "ns/row",
        "speed-up",
        "holds",
        "penetration\njudged",
        "\nmax",
        "residual\nlighter",
        "\nbody",
        "energy",
        "momentum",
        "rest speed",
        "reference",
        "sweeps",
        "colors",
        "occupancy",
        "Pareto",
    ]);
    let mut notes = String::new();
    let mut previous: Option<&Record> = None;
    for record in records {
        rows.add_row(row(record));
        let key = |r: &Record| (r.solver, r.budget_text.clone(), r.order);
        let same_order = previous.is_some_and(|p| key(p) == key(record));
        if let (Some(failure), false) = (record.failure, same_order) {
            notes += &format!(
                "  failed: {}, {}, {}: {failure}\n",
                record.solver,
                record.budget_text,
                lanes(record)
            );
        }
        if record.bits_equal == Some(false) {
            notes += &format!(
                "  state differs from the error run: {}, {}, {}\n",
                record.solver,
                record.budget_text,
                lanes(record)
            );
        }
        previous = Some(record);
    }
    text + &finish(rows, 2) + &notes
}

fn lanes(record: &Record) -> String {
    match record.order {
        Order::Colored if is_emulated(record.lanes) => format!("{} emulated", record.lanes),
        Order::Colored => record.lanes.to_string(),
        order => order.name().to_string(),
    }
}

fn row(record: &Record) -> Vec<String> {
    const NOTHING: &str = "–";
    let mut cells = vec![record.solver.to_string(), record.budget_text.clone(), lanes(record)];
    let Some(sample) = &record.sample else {
        cells.resize(9, NOTHING.to_string());
        cells.push(record.mark().map_or("failed", |mark| mark.word()).to_string());
        cells.resize(22, NOTHING.to_string());
        return cells;
    };
    cells.extend([
        digits(sample.mean_ns / 1e3),
        digits(sample.median_ns / 1e3),
        digits(sample.worst_ns / 1e3),
        digits(sample.spread_ns / 1e3),
        digits(sample.row_sweep_ns),
        record.speed_up.map_or(NOTHING.to_string(), digits),
    ]);
    let errors = record.errors.as_ref();
    let error = |show: &dyn Fn(&Errors) -> String| errors.map_or(NOTHING.to_string(), show);
    cells.extend([
        record.mark().map_or("yes", |mark| mark.word()).to_string(),
        error(&|e| si(e.penetration(record.tolerances.rest.is_some()), "m")),
        error(&|e| si(e.penetration_max(), "m")),
        error(&|e| ratio(e.law_rms_lighter())),
        error(&|e| ratio(e.law_rms_body())),
        error(&|e| ratio(e.get("energy_change").unwrap_or_default())),
        error(&|e| ratio(e.get("momentum").unwrap_or_default())),
        error(&|e| si(e.rest_velocity(), "m/s")),
    ]);
    let reference = |t: TruthError| t.error.map_or("missed".to_string(), |e| si(e, t.unit));
    cells.push(record.truth.map_or(NOTHING.to_string(), reference));
    cells.extend([
        format!("{:.0}", sample.load.sweeps),
        sample.load.colors.to_string(),
        format!("{:.0} %", 100.0 * sample.load.occupancy),
        front(&record.front),
    ]);
    cells
}

fn front(fronts: &Fronts) -> String {
    let marks = [(fronts.penetration, 'p'), (fronts.law, 'l'), (fronts.truth, 't')];
    let on: String = marks.iter().filter(|m| m.0).map(|m| m.1).collect();
    if on.is_empty() { "–".to_string() } else { on }
}

/// Table of what solving impacts in waves gains and costs; empty unless both treatments ran.
pub fn impacts_table(records: &[Record]) -> String {
    let found = study::impacts::gains(records);
    if found.is_empty() {
        return String::new();
    }
    let mut rows =
        table(&["scene", "solver", "settings", "hold", "with waves", "residual", "reference", "time"]);
    for g in found {
        let times = |x: Option<f64>| x.map_or("–".to_string(), |x| format!("{}×", digits(x)));
        let counts = [g.settings, g.holds[0], g.holds[1]].map(|n| n.to_string());
        let ratios = [times(Some(g.residual)), times(g.reference), times(g.time)];
        rows.add_row([g.scene, g.solver.into()].into_iter().chain(counts).chain(ratios));
    }
    format!(
        "--impacts waves, relative to the solver's own impact law (median over settings)\n{}\n",
        finish(rows, 2)
    )
}

/// The errors printed next to a time, on one line.
pub fn error_line(errors: Option<&Errors>) -> String {
    match errors {
        Some(e) => format!(
            "errors of the last {} steps: penetration {} maximum, {} mean; law residual {} of the scene's weight, {} of a body's\n",
            e.steps,
            si(e.penetration_max(), "m"),
            si(e.penetration_mean(), "m"),
            ratio(e.get("residual_rms_scene_weights").unwrap_or_default()),
            ratio(e.law_rms_body())
        ),
        None => "errors: none observed, since no step was taken\n".to_string(),
    }
}

/// The errors of one run, a line each with name, value and meaning. Errors that do not exist are left out.
pub fn error_list(errors: &Errors) -> String {
    let shown = errors.iter().filter_map(|(metric, value)| Some((metric, si(value?, metric.unit))));
    shown.map(|(metric, value)| format!("  {:<36}{value:>12}  {}\n", metric.name, metric.meaning)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn every_line_stands_alone_and_failures_below() {
        let mut wrong = record(8, 1, 10.0, 1.234e-3);
        wrong.bits_equal = Some(false);
        let text = scene_table(&[record(1, 1, 20.0, 1.234e-3), wrong, failed(1), fell(8, 3, 5.0, 0.1)]);
        assert!(text.contains(" fell ") && text.contains(" yes "), "{text}");
        assert_eq!(text.matches("1.23 mm").count(), 4, "{text}");
        assert_eq!(text.matches(" blew up ").count(), 1, "{text}");
        assert!(text.contains("failed: pgs, 9 sub, 1: diverged at step 7: body 2 has no finite speed"));
        assert!(text.contains("state differs from the error run: pgs, 1 sub, 8"));
        // No cell is empty.
        let columns = |line: &str| line.split("  ").filter(|cell| !cell.trim().is_empty()).count();
        let lines: Vec<usize> = text.lines().skip(3).take(4).map(columns).collect();
        assert_eq!(lines, [22; 4], "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 200), "{text}");
        assert!(scene_table(&[]).is_empty());
    }
}
