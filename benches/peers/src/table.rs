//! Human-readable tables, and rows of `peers.csv`.

use crate::engine::{Maker, Stage};
use crate::race::{Outcome, Quartiles, Steps};
use comfy_table::{Table, presets::UTF8_FULL_CONDENSED};
use serde::{Deserialize, Serialize};

const NONE: &str = "–";

/// A mean up to this factor above Box2D's counts as no larger, because chaotic scenes scatter by that much.
const ALLOWED: f64 = 1.1;

/// Times and errors, one row per contender. `ms/step` is the mean over the run, and `× simpulse` is the ratio
/// of whole runs. `stages ×` is the ratio of blocks, with quartiles. `lost` pairs overlap past the middle of
/// a body.
pub fn comparison(outcomes: &[Outcome]) -> Table {
    let mut table = head(&[
        "engine",
        "setting",
        "ms/step",
        "median",
        "spread",
        "longest",
        "× simpulse",
        "stages ×",
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
            ms(o, |s| s.quartiles.median),
            o.step.map_or(NONE.into(), |s| {
                format!("{}–{}", significant(s.quartiles.low), significant(s.quartiles.high))
            }),
            ms(o, |s| s.longest),
            o.ratio.map_or(NONE.into(), |ratio| format!("{ratio:.2}")),
            factor(&o.stages_ratio),
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

/// Time by stage at four substeps (ms per step).
pub fn stages(outcomes: &[Outcome]) -> Table {
    let names: Vec<&str> = Stage::ALL.iter().map(|s| s.name()).collect();
    let mut table = head(&[&["engine"], &names[..], &["rest", "step"]].concat());
    for o in outcomes.iter().filter(|o| o.contender.substeps == 4) {
        let Some(b) = &o.stages else { continue };
        let anew = if o.contender.recycling { "" } else { ", no recycling" };
        let mut row = vec![o.contender.name() + anew];
        row.extend(b.stages.map(|ms| ms.map_or(NONE.into(), significant)));
        // The stages from warm start to integrate add up to `Stages`, which is in the list itself.
        let apart = [Stage::WarmStart, Stage::Solve, Stage::Relax, Stage::Integrate];
        let counted = Stage::ALL.iter().filter(|s| !apart.contains(s));
        let told: f64 = counted.filter_map(|&s| b.stages[s as usize]).sum();
        let tells = b.stages[Stage::Stages as usize].is_some();
        row.push(if tells { significant(b.step - told) } else { NONE.into() });
        row.push(significant(b.step));
        table.add_row(row);
    }
    table
}

/// The fastest setting of every engine whose errors are no larger than those of Box2D at its defaults: the
/// mean overlap, the joint gap and, in scenes that stand, the residual velocity.
pub fn equal_errors(outcomes: &[Outcome], stands: bool) -> Vec<String> {
    let default = |o: &&Outcome| {
        let c = &o.contender;
        c.maker == Maker::Box2d && c.substeps == 4 && c.hertz == 30.0 && c.recycling
    };
    let Some(bound) = outcomes.iter().find(default).and_then(|o| o.errors.as_ref()) else {
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
    let of = |family: &str| {
        outcomes.iter().find(|o| {
            let c = &o.contender;
            o.contender.name().starts_with(family) && c.substeps == 4 && c.hertz == 30.0 && c.recycling
        })
    };
    let engines = ["simpulse", "Box2D", "rapier"].map(of);
    let [ours, box2d, rapier] = engines;
    let cell = |o: Option<&Outcome>, of: fn(&Outcome) -> String| o.map_or(NONE.into(), of);
    let errors = |of: fn(&crate::check::Errors) -> f64| {
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
        cell(box2d, |o| factor(&o.stages_ratio)),
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
| scene | simpulse ms | Box2D × | its stages × | rapier × | longest step ms s / B / r | mean overlap mm s / B / r | max overlap mm s / B / r | rms velocity mm/s s / B / r | gap of joints mm s / B / r |
|---|---|---|---|---|---|---|---|---|---|";

/// A row of `peers.csv`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Row {
    pub scene: String,
    pub engine: String,
    pub substeps: u32,
    pub contact_hertz: f32,
    pub recycling: bool,
    pub failed: String,
    pub mean_step_ms: Option<f64>,
    median_step_ms: Option<f64>,
    quartile_1_ms: Option<f64>,
    quartile_3_ms: Option<f64>,
    longest_step_ms: Option<f64>,
    waited_share: f64,
    whole_run_ratio: Option<f64>,
    stages_ratio: Option<f64>,
    clocked_step_ms: Option<f64>,
    pairs_ms: Option<f64>,
    collide_ms: Option<f64>,
    color_ms: Option<f64>,
    prepare_ms: Option<f64>,
    warm_start_ms: Option<f64>,
    solve_ms: Option<f64>,
    relax_ms: Option<f64>,
    integrate_ms: Option<f64>,
    stages_ms: Option<f64>,
    store_ms: Option<f64>,
    bodies: usize,
    points: usize,
    pairs: Option<usize>,
    pub penetration_mean_m: Option<f64>,
    penetration_max_m: Option<f64>,
    lost_pairs: Option<f64>,
    rms_velocity_m_s: Option<f64>,
    #[serde(default)]
    gap_rms_m: Option<f64>,
    #[serde(default)]
    gap_max_m: Option<f64>,
    top_m: Option<f64>,
    reference: String,
    reference_unit: String,
    reference_error: Option<f64>,
}

impl Row {
    /// All values of an outcome; no times if the check failed.
    pub fn new(scene: &str, o: &Outcome) -> Self {
        let e = o.errors.as_ref();
        let [pairs, collide, color, prepare, warm_start, solve, relax, integrate, stages, store] =
            o.stages.map_or([None; Stage::ALL.len()], |b| b.stages);
        let truth = e.and_then(|e| e.truth);
        Row {
            scene: scene.into(),
            engine: o.contender.name(),
            substeps: o.contender.substeps,
            contact_hertz: o.contender.hertz,
            recycling: o.contender.recycling,
            failed: o.failed.clone().unwrap_or_default(),
            mean_step_ms: o.step.map(|s| s.mean),
            median_step_ms: o.step.map(|s| s.quartiles.median),
            quartile_1_ms: o.step.map(|s| s.quartiles.low),
            quartile_3_ms: o.step.map(|s| s.quartiles.high),
            longest_step_ms: o.step.map(|s| s.longest),
            waited_share: o.waited,
            whole_run_ratio: o.ratio,
            stages_ratio: o.stages_ratio.map(|q| q.median),
            clocked_step_ms: o.stages.map(|b| b.step),
            pairs_ms: pairs,
            collide_ms: collide,
            color_ms: color,
            prepare_ms: prepare,
            warm_start_ms: warm_start,
            solve_ms: solve,
            relax_ms: relax,
            integrate_ms: integrate,
            stages_ms: stages,
            store_ms: store,
            bodies: o.counts.0,
            points: o.counts.1,
            pairs: e.map(|e| e.pairs),
            penetration_mean_m: e.map(|e| e.penetration_mean),
            penetration_max_m: e.map(|e| e.penetration_max),
            lost_pairs: e.map(|e| e.lost),
            rms_velocity_m_s: e.map(|e| e.rms_velocity),
            gap_rms_m: e.and_then(|e| Some(e.gap?[0])),
            gap_max_m: e.and_then(|e| Some(e.gap?[1])),
            top_m: e.map(|e| e.top),
            reference: truth.map_or("", |t| t.0).into(),
            reference_unit: truth.map_or("", |t| t.1).into(),
            reference_error: truth.map(|t| t.2),
        }
    }
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

fn factor(q: &Option<Quartiles>) -> String {
    q.map_or(NONE.into(), |q| format!("{:.2} [{:.2}, {:.2}]", q.median, q.low, q.high))
}
