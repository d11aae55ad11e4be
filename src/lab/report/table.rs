//! Tables for the terminal, to be read at 160 columns.

use super::units::{digits, is_emulated, ratio, si};
use crate::engine::world::Order;
use crate::lab::metrics::Errors;
use crate::lab::study::ablation::NeedCost;
use crate::lab::study::{Fronts, Record};
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// What the columns of [`scene_table`] are, once for the whole study.
pub const LEGEND: &str = "\
lanes: nat is one after the other in natural order, numbers are lanes in coloured order.  ± is the median
deviation of a repeat.  ns/row: a sweep, per row that it solves.  ×: times faster than 1 lane.
law: contact-law residual in the scene's weight × step, and in a body's.  energy, moment.: gained or lost, relative.  rest:
rms speed of the last second.  occ.: lanes that hold a contact.  front: on the front of time against
p penetration, l law residual, t truth; errors are the same for all coloured widths of a budget.
";

/// Lines of a table without the frame.
pub(crate) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(header.to_vec());
    table
}

/// Every column but the first `left` to the right, and two blanks between columns.
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

/// The records of one scene, errors once per solver, budget and order.
pub fn scene_table(records: &[Record]) -> String {
    let Some(first) = records.first() else { return String::new() };
    let mut text = format!("{} · {} bodies · dt {}", first.scene, first.bodies, si(first.dt, "s"));
    if let Some(steps) = records.iter().find_map(|r| Some(r.errors?.steps)) {
        text += &format!(" · {steps} steps");
    }
    if let Some(truth) = records.iter().find_map(|r| r.truth) {
        text += &format!(" · truth: {} = {}", truth.quantity, si(truth.expected, truth.unit));
    }
    text += "\n";
    let mut rows = table(&[
        "solver", "budget", "lanes", "µs/step", "±", "ns/row", "×", "holds", "pen.max", "mean", "law",
        "/body", "energy", "moment.", "rest", "truth", "sweeps", "col.", "occ.", "front",
    ]);
    let mut notes = String::new();
    let mut previous: Option<&Record> = None;
    for record in records {
        let same_budget = previous.is_some_and(|p| (p.solver, p.budget) == (record.solver, record.budget));
        let same_order = same_budget && previous.is_some_and(|p| p.order == record.order);
        rows.add_row(row(record, same_budget, same_order));
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
                "  NOT the same bits as the error run: {}, {}, {}\n",
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
        Order::Natural => "nat".to_string(),
        Order::Colored if is_emulated(record.lanes) => format!("{} emulated", record.lanes),
        Order::Colored => record.lanes.to_string(),
    }
}

fn row(record: &Record, same_budget: bool, same_order: bool) -> Vec<String> {
    let unless = |same: bool, text: &str| if same { String::new() } else { text.to_string() };
    let mut cells =
        vec![unless(same_budget, record.solver), unless(same_budget, &record.budget_text), lanes(record)];
    let Some(lap) = &record.lap else {
        cells.push("failed".to_string());
        cells.resize(20, String::new());
        return cells;
    };
    cells.extend([
        digits(lap.median_ns / 1e3),
        digits(lap.spread_ns / 1e3),
        digits(lap.row_sweep_ns),
        record.speed_up.map_or(String::new(), digits),
    ]);
    let errors = record.errors.filter(|_| !same_order);
    let error = |show: &dyn Fn(&Errors) -> String| errors.as_ref().map_or(String::new(), show);
    cells.extend([
        record.mark().map_or("yes", |mark| mark.word()).to_string(),
        error(&|e| si(e.penetration_max, "m")),
        error(&|e| si(e.penetration_mean, "m")),
        error(&|e| ratio(e.law_rms)),
        error(&|e| ratio(e.law_rms_body)),
        error(&|e| ratio(e.energy_change)),
        error(&|e| ratio(e.momentum)),
        error(&|e| si(e.rest_velocity, "m/s")),
    ]);
    let truth = record.truth.filter(|_| !same_order);
    cells.push(truth.map_or(String::new(), |t| t.error.map_or("missed".to_string(), |e| si(e, t.unit))));
    cells.extend([
        format!("{:.0}", lap.load.sweeps),
        lap.load.colors.to_string(),
        format!("{:.0}%", 100.0 * lap.load.occupancy),
        front(&record.front),
    ]);
    cells
}

fn front(fronts: &Fronts) -> String {
    let marks = [(fronts.penetration, 'p'), (fronts.law, 'l'), (fronts.truth, 't')];
    marks.iter().filter(|m| m.0).map(|m| m.1).collect()
}

/// What it would cost to model what scenes do not need.
pub fn ablation_table(costs: &[NeedCost]) -> String {
    let Some(first) = costs.first() else { return String::new() };
    let mut text = format!(
        "What leaving out what a scene does not need saves ({}, {} lanes)\n",
        first.solver, first.lanes
    );
    let mut rows =
        table(&["scene", "left out", "bytes/contact", "saved", "ns/contact/sweep", "saved", "same bits"]);
    let mut previous = "";
    for cost in costs {
        let scene = if cost.scene == previous { "" } else { &cost.scene };
        previous = &cost.scene;
        rows.add_row(vec![
            scene.to_string(),
            cost.need.to_string(),
            format!("{:.0}", cost.bytes),
            format!("{:.0}", cost.bytes_saved),
            digits(cost.ns),
            digits(cost.ns_saved),
            if cost.bits_equal { "yes" } else { "NO" }.to_string(),
        ]);
    }
    text += &finish(rows, 2);
    text
}

/// The errors that stand beside a time, on one line.
pub fn error_line(errors: Option<&Errors>) -> String {
    match errors {
        Some(e) => format!(
            "errors of the last {} steps: penetration {} at most, {} in the mean; law residual {} of the \
             scene's weight, {} of a body's\n",
            e.steps,
            si(e.penetration_max, "m"),
            si(e.penetration_mean, "m"),
            ratio(e.law_rms),
            ratio(e.law_rms_body)
        ),
        None => "errors: none observed, since no step was taken\n".to_string(),
    }
}

/// The errors of one run, a line each; what is absent has none.
pub fn error_list(errors: &Errors) -> String {
    let e = errors;
    let length = |value: f64| si(value, "m");
    let lines = [
        ("penetration max", Some(length(e.penetration_max))),
        ("penetration mean", Some(length(e.penetration_mean))),
        ("penetration rms", Some(length(e.penetration_rms))),
        ("penetration 99 %", Some(length(e.penetration_p99))),
        ("penetration max / half-extent", Some(ratio(e.penetration_relative))),
        ("soft contacts give way, last second", e.soft_floor.map(length)),
        ("penetration beyond that", e.penetration_excess.map(length)),
        ("law residual, rms, body weights", Some(ratio(e.law_rms_body))),
        ("law residual, normal, rms", Some(ratio(e.law_normal_rms))),
        ("law residual, normal, max", Some(ratio(e.law_normal_max))),
        ("law residual, tangential, rms", Some(ratio(e.law_tangent_rms))),
        ("law residual, tangential, max", Some(ratio(e.law_tangent_max))),
        ("complementarity violated, max", Some(ratio(e.complementarity))),
        ("friction cone violated, max", Some(ratio(e.cone))),
        ("gap to maximal dissipation, max", Some(ratio(e.dissipation))),
        ("residual of its own law, rms", e.own_rms.map(ratio)),
        ("residual of its own law, max", e.own_max.map(ratio)),
        ("momentum out of balance", Some(ratio(e.momentum))),
        ("angular momentum out of balance", Some(ratio(e.angular_momentum))),
        ("energy change", Some(ratio(e.energy_change))),
        ("energy created, worst step", Some(ratio(e.energy_created))),
        ("energy unexplained, worst step", Some(ratio(e.energy_unexplained))),
        ("energy taken by friction", Some(ratio(e.friction_loss))),
        ("energy taken by normal impulses", Some(ratio(e.impact_loss))),
        ("rest velocity, last second", Some(si(e.rest_velocity, "m/s"))),
        (
            "creep, last second, with 95 %",
            Some(format!("{} ± {}", si(e.creep, "m/s"), si(e.creep_half_width, "m/s"))),
        ),
        ("settled after", Some(e.settled.map_or("never".to_string(), |t| si(t, "s")))),
    ];
    let shown = lines.into_iter().filter_map(|(name, value)| Some((name, value?)));
    shown.map(|(name, value)| format!("  {name:<36}{value:>12}\n")).collect()
}
#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn errors_stand_once_per_budget_and_failures_below() {
        let mut wrong = record(8, 1, 10.0, 1.234e-3);
        wrong.bits_equal = Some(false);
        let text = scene_table(&[record(1, 1, 20.0, 1.234e-3), wrong, failed(1), fell(8, 3, 5.0, 0.1)]);
        assert!(text.contains(" fell ") && text.contains(" yes "), "{text}");
        assert_eq!(text.matches("1.23 mm").count(), 1, "{text}");
        assert!(text.contains("failed: pgs, 9 sub, 1: diverged at step 7: body 2 has no finite speed"));
        assert!(text.contains("NOT the same bits as the error run: pgs, 1 sub, 8"));
        assert!(text.lines().all(|line| line.chars().count() <= 160));
        assert!(scene_table(&[]).is_empty());
    }
}
