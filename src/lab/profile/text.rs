//! The output of `simpulse profile`.

use super::limit::Limit;
use super::{PhaseReport, ProfileReport, waiting};
use crate::engine::clock::Phase;
use crate::lab::report::table::{finish, table};
use crate::lab::report::units::digits;
use crate::lab::report::units::lanes;

/// Phases with arithmetic outside of lanes: their counted operations are a lower bound.
fn is_partly_scalar(phase: Phase) -> bool {
    matches!(phase, Phase::Prepare | Phase::Restitution)
}

/// Bytes with a binary prefix.
pub fn bytes(value: f64) -> String {
    match value {
        v if v < 1024.0 => format!("{v:.0} B"),
        v if v < 1024.0 * 1024.0 => format!("{} KiB", digits(v / 1024.0)),
        v => format!("{} MiB", digits(v / (1024.0 * 1024.0))),
    }
}

/// The whole report: one phase in detail, several phases as a table.
pub fn text(report: &ProfileReport) -> String {
    let mut text = match report.phases.as_slice() {
        [phase] => single(report, phase),
        phases => several(report, phases),
    };
    text += &waiting::note(report.waiting);
    if let Some(rate) = report.multiply_adds {
        text += &ceilings(report, rate);
        for phase in &report.phases {
            text += &reading(report, phase);
        }
    }
    text
}

/// Description of the frozen state.
pub fn head(report: &ProfileReport) -> String {
    let c = &report.counts;
    format!(
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
    )
}

fn per(total: f64, count: usize) -> String {
    if count == 0 { "–".to_string() } else { digits(total / count as f64) }
}

fn single(report: &ProfileReport, phase: &PhaseReport) -> String {
    let probe = &phase.probe;
    let mut text = format!(
        "{}: {} µs a pass, ± {} (mean {}, longest {}); {} in a step; median of {} timed passes; {:.1} % of the time was spent \
         restoring the state\n",
        probe.phase.name(),
        digits(1e-3 * phase.pass_ns),
        digits(1e-3 * phase.spread_ns),
        digits(1e-3 * phase.mean_ns),
        digits(1e-3 * phase.longest_ns),
        probe.passes,
        phase.passes,
        100.0 * report.reset_share,
    );
    let mut rows = table(&["", "count", "ns", "bytes", "flop"]);
    let units =
        [("row", probe.rows), ("contact", report.counts.contacts), ("body", report.bodies), ("pass", 1)];
    for (name, count) in units {
        if count == 0 {
            continue;
        }
        let flops = phase.flops.map_or("–".to_string(), |f| at_least(probe.phase, &per(f, count)));
        let cells = [per(phase.pass_ns, count), per(phase.traffic.total(), count), flops];
        let mut row = vec![format!("  per {name}"), count.to_string()];
        row.extend(cells);
        rows.add_row(row);
    }
    text += &finish(rows, 1);
    text += &format!(
        "  {} read, {} written, working set {}\n",
        bytes(phase.traffic.read),
        bytes(phase.traffic.written),
        bytes(phase.traffic.working_set)
    );
    if let Some(o) = phase.probe.operations {
        let (of, times) = match phase.probe.counted_contacts {
            0 => ("pass", 1),
            contacts => ("contact", contacts),
        };
        let each = |count: u64| digits(count as f64 / times as f64 / f64::from(phase.probe.passes));
        text += &format!(
            "  per {of} on lanes: {} additions, {} multiplications, {} multiply-adds, {} divisions or roots; \
             {} minima, maxima and selections, which do not count as flop\n",
            each(o.adds),
            each(o.multiplies),
            each(o.multiply_adds),
            each(o.divisions),
            each(o.choices)
        );
    }
    text
}

fn at_least(phase: Phase, number: &str) -> String {
    format!("{}{number}", if is_partly_scalar(phase) { "≥ " } else { "" })
}

const LEGEND: &str = "\
passes: per step.  µs/pass: median, beside it mean and longest of the pieces that were timed, ± median deviation.
working set: bytes that a pass touches.  GB/s: bytes that
the source names over time; % of peak: of what memory that holds the working set, or multiply-adds at this
width, reached in the same run.  limit: bandwidth- or compute-bound from half of the lower ceiling on, else
latency-bound (dependent operations, gathers, branches); where noise decides, cannot tell.  – not counted or not measured.
";

fn several(report: &ProfileReport, phases: &[PhaseReport]) -> String {
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
        "flop/B",
        "limit",
    ]);
    let (contacts, mut sum) = (report.counts.contacts, 0.0);
    for phase in phases {
        let (probe, ns) = (&phase.probe, phase.pass_ns);
        let optional = |value: Option<f64>| value.map_or("–".to_string(), digits);
        let share = |of: Option<f64>| of.map_or("–".to_string(), |s| format!("{:.0}", 100.0 * s));
        let ceiling = phase.bandwidth.map(|b| b.of_mix(&phase.traffic));
        sum += ns * f64::from(probe.passes);
        rows.add_row([
            probe.phase.name().to_string(),
            probe.passes.to_string(),
            digits(1e-3 * ns),
            digits(1e-3 * phase.mean_ns),
            digits(1e-3 * phase.longest_ns),
            digits(1e-3 * phase.spread_ns),
            digits(1e-3 * ns * f64::from(probe.passes)),
            per(ns, probe.rows),
            per(ns, contacts),
            per(ns, report.bodies),
            per(phase.traffic.total(), contacts),
            bytes(phase.traffic.working_set),
            digits(phase.bytes_rate()),
            share(ceiling.map(|peak| phase.bytes_rate() / peak)),
            phase.flops.map_or("–".to_string(), |f| at_least(probe.phase, &per(f, contacts))),
            optional(phase.flops_rate()),
            share(phase.flops_rate().zip(report.multiply_adds).map(|(rate, peak)| rate / peak)),
            optional(phase.intensity()),
            Limit::of(phase, report.multiply_adds).map_or("–", Limit::word).to_string(),
        ]);
    }
    let mut text = format!("{LEGEND}\n{}", finish(rows, 1));
    text += &format!(
        "  all phases: {} µs a step, pairs searched again; {:.1} % of the time was spent restoring the state\n",
        digits(1e-3 * sum),
        100.0 * report.reset_share
    );
    text
}

/// Limits of this machine, measured in the same run.
fn ceilings(report: &ProfileReport, multiply_adds: f64) -> String {
    let mut rows = table(&["level", "working set", "read GB/s", "update GB/s"]);
    for (level, bandwidth) in &report.levels {
        rows.add_row([
            format!("  {}", level.name),
            bytes(level.bytes as f64),
            digits(bandwidth.read),
            digits(bandwidth.update),
        ]);
    }
    format!(
        "\nthis machine, one thread, measured in turn with the above\n{}  multiply-adds, {}: {} GFLOP/s\n\n",
        finish(rows, 1),
        lanes(report.lanes),
        digits(multiply_adds)
    )
}

/// The comparison with the roofline in sentences.
fn reading(report: &ProfileReport, phase: &PhaseReport) -> String {
    let (Some(peak), Some(bandwidth)) = (report.multiply_adds, phase.bandwidth) else {
        return String::new();
    };
    let bandwidth = bandwidth.of_mix(&phase.traffic);
    let set = bytes(phase.traffic.working_set);
    let name = phase.probe.phase.name();
    let memory_ns = phase.traffic.total() / bandwidth;
    if phase.pass_ns <= 0.0 || phase.traffic.total() <= 0.0 {
        return format!("{name}: nothing to do\n");
    }
    let share = 100.0 * memory_ns / phase.pass_ns;
    let limit = Limit::of(phase, report.multiply_adds).map_or("not limited", Limit::word);
    let memory = format!(
        "{share:.0} % of peak bandwidth ({} of {} GB/s, working set {set} in {})",
        digits(phase.bytes_rate()),
        digits(bandwidth),
        level_of(report, phase.traffic.working_set),
    );
    let Some((flops, rate)) = phase.flops.zip(phase.flops_rate()) else {
        return format!("{name} is {limit}: {memory}; operations are not counted here\n");
    };
    let arithmetic_ns = flops / peak;
    let times = phase.pass_ns / memory_ns.max(arithmetic_ns);
    format!(
        "{name} is {limit}: {memory}, {:.0} % of peak arithmetic ({} of {} GFLOP/s), {} flop/B; a pass takes {} \
         times what the lower ceiling allows\n",
        100.0 * arithmetic_ns / phase.pass_ns,
        digits(rate),
        digits(peak),
        digits(phase.intensity().unwrap_or(0.0)),
        digits(times),
    )
}

/// The level of memory that holds a working set. Levels are measured at half of their size.
fn level_of(report: &ProfileReport, bytes: f64) -> &str {
    let last = report.levels.last().map_or("memory", |l| l.0.name.as_str());
    let caches = report.levels.split_last().map_or(&[][..], |(_, caches)| caches);
    caches.iter().find(|(level, _)| bytes <= 2.0 * level.bytes as f64).map_or(last, |(level, _)| &level.name)
}
