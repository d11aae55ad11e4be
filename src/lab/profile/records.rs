//! Profiles and growth as JSON.

use super::ProfileReport;
use super::growth::{GrowthVerdict, SizeRow};
use super::growth_report::sentence;
use super::limit::Limit;
use crate::engine::clock::Phase;
use crate::lab::metrics::Errors;
use crate::lab::report::environment::Environment;
use serde_json::{Value, json};

/// All measurements of `simpulse profile`.
pub fn json(report: &ProfileReport, errors: Option<&Errors>) -> Value {
    let phase = |p: &super::PhaseReport| {
        json!({
            "phase": p.probe.phase.name(),
            "passes_per_step": p.probe.passes,
            "rows": p.probe.rows,
            "median_pass_ns": p.pass_ns,
            "mean_pass_ns": p.mean_ns,
            "longest_pass_ns": p.longest_ns,
            "spread_pass_ns": p.spread_ns,
            "timed_passes": p.passes,
            "bytes_read": p.traffic.read,
            "bytes_written": p.traffic.written,
            "working_set_bytes": p.traffic.working_set,
            "gb_per_s": p.bytes_rate(),
            "peak_gb_per_s": p.bandwidth.map(|b| b.of_mix(&p.traffic)),
            "flops": p.flops,
            "gflop_per_s": p.flops_rate(),
            "limit": Limit::of(p, report.multiply_adds).map(Limit::word),
        })
    };
    let level = |(level, b): &(super::ceilings::MemoryLevel, super::Bandwidth)| json!({ "level": level.name, "bytes": level.bytes, "read_gb_per_s": b.read, "update_gb_per_s": b.update });
    json!({
        "environment": Environment::current(),
        "scene": report.scene,
        "solver": report.solver,
        "impacts": report.impacts.name(),
        "lanes": report.lanes,
        "substeps": report.substeps,
        "bodies": report.bodies,
        "contacts": report.counts.contacts,
        "points": report.counts.points,
        "colors": report.counts.colors,
        "errors": errors,
        "phases": report.phases.iter().map(phase).collect::<Vec<_>>(),
        "levels": report.levels.iter().map(level).collect::<Vec<_>>(),
        "peak_gflop_per_s": report.multiply_adds,
        "reset_share": report.reset_share,
        "waited_share": report.waiting,
    })
}

/// All measurements of `simpulse growth`.
pub fn growth_json(rows: &[SizeRow], verdicts: &[GrowthVerdict], waited: Option<f64>) -> Value {
    let row = |row: &SizeRow| {
        let phases: serde_json::Map<String, Value> = Phase::ALL
            .into_iter()
            .filter(|p| row.phases[*p as usize].ns > 0.0)
            .map(|p| (p.name().to_string(), row.phases[p as usize].ns.into()))
            .collect();
        let memory: serde_json::Map<String, Value> = row
            .memory
            .components
            .iter()
            .map(|c| (c.name.to_string(), json!({ "held_bytes": c.held, "used_bytes": c.used })))
            .collect();
        json!({
            "scene": row.scene,
            "bodies": row.bodies,
            "pairs": row.counts.pairs,
            "contacts": row.counts.contacts,
            "points": row.counts.points,
            "median_step_ns": row.step.ns,
            "mean_step_ns": row.step.mean_ns,
            "longest_step_ns": row.step.longest_ns,
            "spread_step_ns": row.step.spread_ns,
            "phase_ns": phases,
            "memory": memory,
            "errors": row.errors,
        })
    };
    let verdict = |v: &GrowthVerdict| {
        json!({
            "phase": v.phase.map_or("whole step", Phase::name),
            "ns_per_contact": v.range,
            "exponent": v.exponent,
            "text": sentence(v).trim_end(),
        })
    };
    json!({
        "environment": Environment::current(),
        "waited_share": waited,
        "sizes": rows.iter().map(row).collect::<Vec<_>>(),
        "verdicts": verdicts.iter().map(verdict).collect::<Vec<_>>(),
    })
}
