//! Human-readable tables, and rows of `peers.csv`.

use crate::check::Errors;
use crate::race::{Outcome, Steps};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};

const NONE: &str = "–";

/// A mean up to this factor above Box2D's counts as no larger, because chaotic scenes scatter by that much.
const ALLOWED: f64 = 1.1;

/// Times and errors, one row per contender. `ms/step` is the mean over the run, and `× simpulse` is the ratio
/// of whole runs. `lost` pairs overlap past the middle of a body.
pub fn comparison(outcomes: &[Outcome]) -> Table {
    let mut table = head(&[
        "engine",
        "setting",
        "ms/step",
        "median",
        "spread",
        "longest",
        "× simpulse",
        "pen. mean mm",
        "pen. max mm",
        "lost %",
        "rms v mm/s",
        "gap rms, max mm",
        "top m",
        "pairs",
        "points",
        "off by",
    ]);
    for o in outcomes {
        let mut row = vec![
            o.contender.name(),
            o.contender.setting(),
            ms(o, |s| s.mean),
            ms(o, |s| s.quartiles[1]),
            o.step.map_or(NONE.into(), |s| {
                format!("{}–{}", significant(s.quartiles[0]), significant(s.quartiles[2]))
            }),
            ms(o, |s| s.longest),
            o.ratio.map_or(NONE.into(), |ratio| format!("{ratio:.2}")),
        ];
        if let Some(e) = &o.errors {
            let truth = |(_, unit, error)| format!("{} {unit}", significant(error));
            row.extend([
                significant(e.penetration_mean * 1e3),
                significant(e.penetration_max * 1e3),
                significant(e.lost * 1e2),
                significant(e.rms_velocity * 1e3),
                e.gap.map_or(NONE.into(), |gap| gap.map(|gap| significant(gap * 1e3)).join(", ")),
                format!("{:.3}", e.top),
                e.pairs.to_string(),
                o.counts.1.to_string(),
                e.truth.map_or(NONE.into(), truth),
            ]);
        }
        if let Some(message) = &o.failed {
            row.resize(table.column_count() - 1, NONE.into());
            row.push(format!("FAILED: {message}"));
        }
        table.add_row(row);
    }
    table
}

/// The outcome of an engine at its defaults, whose name begins with `family`.
fn default<'o>(outcomes: &'o [Outcome], family: &str) -> Option<&'o Outcome> {
    outcomes.iter().find(|o| o.contender.is_default() && o.contender.name().starts_with(family))
}

/// The fastest setting of every engine whose errors are no larger than those of Box2D at its defaults: the
/// mean overlap, the joint gap and, in scenes that stand, the residual velocity.
pub fn equal_errors(outcomes: &[Outcome], stands: bool) -> Vec<String> {
    let Some(bound) = default(outcomes, "Box2D").and_then(|o| o.errors.as_ref()) else {
        return Vec::new();
    };
    let mut lines = Vec::new();
    for family in ["Box2D", "rapier", "simpulse"] {
        let fits = |o: &&Outcome| {
            o.contender.name().starts_with(family)
                && o.failed.is_none()
                && o.errors.as_ref().is_some_and(|e| {
                    e.penetration_mean <= ALLOWED * bound.penetration_mean
                        && e.gap.zip(bound.gap).is_none_or(|(gap, bound)| gap[0] <= ALLOWED * bound[0])
                        && (!stands || e.rms_velocity <= ALLOWED * bound.rms_velocity)
                })
        };
        let fitting: Vec<&Outcome> = outcomes.iter().filter(fits).collect();
        let timed = fitting.iter().filter_map(|o| Some((o, o.step.as_ref()?.mean)));
        lines.push(match timed.min_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((o, mean)) => {
                format!("{}, {}: {} ms", o.contender.name(), o.contender.setting(), significant(mean))
            }
            None if fitting.is_empty() => format!("{family}: no setting"),
            None => format!("{family}: no time, the machine was busy"),
        });
    }
    lines
}

/// One scene in the summary of all scenes, in Markdown. All three engines are at their defaults (n = 4),
/// simpulse at the width of the CPU. Columns: ratios of whole runs, longest steps, and errors of the last
/// second.
pub fn summary_line(scene: &str, outcomes: &[Outcome]) -> String {
    let engines = ["simpulse", "Box2D", "rapier"].map(|family| default(outcomes, family));
    let [ours, box2d, rapier] = engines;
    let cell = |o: Option<&Outcome>, of: fn(&Outcome) -> String| o.map_or(NONE.into(), of);
    let errors = |of: fn(&Errors) -> f64| {
        let one = |o: Option<&Outcome>| {
            let errors = o.filter(|o| o.failed.is_none()).and_then(|o| o.errors.as_ref());
            errors.map_or("fails".into(), |e| significant(1e3 * of(e)))
        };
        engines.map(one).join(" / ")
    };
    let cells = [
        scene.to_string(),
        cell(ours, |o| ms(o, |s| s.mean)),
        cell(box2d, |o| o.ratio.map_or(NONE.into(), |ratio| format!("{ratio:.2}"))),
        cell(rapier, |o| o.ratio.map_or(NONE.into(), |ratio| format!("{ratio:.2}"))),
        engines.map(|o| cell(o, |o| ms(o, |s| s.longest))).join(" / "),
        errors(|e| e.penetration_mean),
        errors(|e| e.penetration_max),
        errors(|e| e.rms_velocity),
        errors(|e| e.gap.map_or(f64::NAN, |gap| gap[0])),
    ];
    format!("| {} |", cells.join(" | "))
}

/// Header of the summary.
pub const SUMMARY: &str = "\
| scene | simpulse ms | Box2D × | rapier × | longest step ms s / B / r | mean overlap mm s / B / r | max overlap mm s / B / r | rms velocity mm/s s / B / r | gap of joints mm s / B / r |
|---|---|---|---|---|---|---|---|---|";

/// A row of `peers.csv`: every column with its value, empty if there is none. No times if the check failed.
pub fn row(scene: &str, o: &Outcome) -> Vec<(&'static str, String)> {
    let number = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
    let step = |of: fn(&Steps) -> f64| number(o.step.as_ref().map(of));
    let error = |of: fn(&Errors) -> Option<f64>| number(o.errors.as_ref().and_then(of));
    let truth = o.errors.as_ref().and_then(|e| e.truth);
    let c = &o.contender;
    vec![
        ("scene", scene.to_string()),
        ("engine", c.name()),
        ("substeps", c.substeps.to_string()),
        ("contact_hertz", format!("{:?}", c.hertz)),
        ("recycling", c.recycling.to_string()),
        ("failed", o.failed.clone().unwrap_or_default()),
        ("mean_step_ms", step(|s| s.mean)),
        ("median_step_ms", step(|s| s.quartiles[1])),
        ("quartile_1_ms", step(|s| s.quartiles[0])),
        ("quartile_3_ms", step(|s| s.quartiles[2])),
        ("longest_step_ms", step(|s| s.longest)),
        ("waited_share", o.waited.to_string()),
        ("whole_run_ratio", number(o.ratio)),
        ("bodies", o.counts.0.to_string()),
        ("points", o.counts.1.to_string()),
        ("pairs", error(|e| Some(e.pairs as f64))),
        ("penetration_mean_m", error(|e| Some(e.penetration_mean))),
        ("penetration_max_m", error(|e| Some(e.penetration_max))),
        ("lost_pairs", error(|e| Some(e.lost))),
        ("rms_velocity_m_s", error(|e| Some(e.rms_velocity))),
        ("gap_rms_m", error(|e| Some(e.gap?[0]))),
        ("gap_max_m", error(|e| Some(e.gap?[1]))),
        ("top_m", error(|e| Some(e.top))),
        ("reference", truth.map_or(String::new(), |t| t.0.into())),
        ("reference_unit", truth.map_or(String::new(), |t| t.1.into())),
        ("reference_error", number(truth.map(|t| t.2))),
    ]
}

/// An empty table with these columns.
pub fn head(names: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED).set_header(names.to_vec());
    table
}

/// A time of a step (ms), as text.
fn ms(o: &Outcome, of: fn(&Steps) -> f64) -> String {
    o.step.as_ref().map_or(NONE.into(), |steps| significant(of(steps)))
}

/// Three digits; a dash for NaN.
fn significant(x: f64) -> String {
    if x.is_nan() {
        return NONE.into();
    }
    let digits = if x == 0.0 { 0 } else { (2 - x.abs().log10().floor() as i32).clamp(0, 5) };
    format!("{x:.*}", digits as usize)
}
