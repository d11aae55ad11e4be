//! The output of `simpulse profile`.

use super::{ProfileReport, waiting};
use crate::lab::report::table::{error_line, finish, table};
use crate::lab::report::units::{digits, lanes};

const LEGEND: &str = "\
passes: per step.  µs/pass: median over steps, beside it mean and longest, ± median deviation.  working set:
bytes that a pass touches.  GB/s: bytes that the source names over time; % of peak: of reading a buffer as large
as the working set, or of multiply-adds at this width, measured in the same run.  limit: bandwidth- or
compute-bound from half of a ceiling on; not bandwidth: below half of it, operations are not counted; latency-bound:
below half of both (dependent operations, gathers, branches).
flop: of contacts.  – not known for this phase or solver, or not measured.
";

/// Bytes with a binary prefix.
pub fn bytes(value: f64) -> String {
    match value {
        v if v < 1024.0 => format!("{v:.0} B"),
        v if v < 1024.0 * 1024.0 => format!("{} KiB", digits(v / 1024.0)),
        v => format!("{} MiB", digits(v / (1024.0 * 1024.0))),
    }
}

/// The whole report.
pub fn text(report: &ProfileReport) -> String {
    let c = &report.counts;
    let mut text = format!(
        "{} · {}, {} substeps, {} · {} bodies, {} contacts, {} points, {} colors, {:.0} % of lanes filled\n",
        report.scene,
        report.solver,
        report.substeps,
        lanes(report.lanes),
        report.bodies,
        c.contacts,
        c.points,
        c.colors,
        100.0 * c.contacts as f64 / c.lane_slots.max(1) as f64,
    );
    text += &format!("{}\n{LEGEND}\n", error_line(report.errors.as_ref()));
    let mut rows = table(&[
        "phase",
        "passes",
        "µs/pass",
        "mean",
        "longest",
        "±",
        "µs/step",
        "ns/row",
        "ns/contact",
        "ns/body",
        "B/contact",
        "working set",
        "GB/s",
        "% of peak",
        "flop/contact",
        "GFLOP/s",
        "% of peak",
        "limit",
    ]);
    let optional = |value: Option<f64>| value.map_or("–".to_string(), digits);
    let per = |total: f64, count: usize| optional((count > 0).then(|| total / count as f64));
    let percent = |share: Option<f64>| share.map_or("–".to_string(), |s| format!("{:.0}", 100.0 * s));
    let mut sum = 0.0;
    for p in &report.phases {
        let flops = p.work.and_then(|work| work.flops);
        let [bandwidth, arithmetic] = p.reached(report.multiply_adds);
        // Operations of joints are not counted.
        let bound = if report.has_joints { "≥ " } else { "" };
        sum += p.pass_ns * p.passes;
        rows.add_row([
            p.phase.name().to_string(),
            digits(p.passes),
            digits(1e-3 * p.pass_ns),
            digits(1e-3 * p.mean_ns),
            digits(1e-3 * p.longest_ns),
            digits(1e-3 * p.spread_ns),
            digits(1e-3 * p.pass_ns * p.passes),
            per(p.pass_ns, p.rows),
            per(p.pass_ns, c.contacts),
            per(p.pass_ns, report.bodies),
            p.work.map_or("–".to_string(), |work| per(work.bytes(), c.contacts)),
            p.work.map_or("–".to_string(), |work| bytes(work.working_set)),
            optional(p.work.map(|work| work.bytes() / p.pass_ns)),
            percent(bandwidth),
            flops.map_or("–".to_string(), |flops| format!("{bound}{}", per(flops, c.contacts))),
            optional(flops.map(|flops| flops / p.pass_ns)),
            percent(arithmetic),
            p.limit(report.multiply_adds).unwrap_or("–").to_string(),
        ]);
    }
    text += &finish(rows, 1);
    text += &format!("  all phases: {} µs a step, {} steps timed\n", digits(1e-3 * sum), report.steps);
    text += &waiting::note(report.waiting);
    if let Some(rate) = report.multiply_adds {
        text += &format!("  multiply-adds, {}: {} GFLOP/s\n", lanes(report.lanes), digits(rate));
    }
    text
}
