//! A comparison as text.

use super::{Comparison, SettingPair, Verdict};
use crate::lab::report::table::{finish, table};
use crate::lab::report::units::{digits, lanes_or_order, percent, ratio, si};
use crate::lab::study::curve::ErrorAxis;

/// Rows of each list, unless `--all` is given.
const ROWS: usize = 10;

/// One change, with its ratio (1).
struct ChangeLine {
    cells: [String; 7],
    growth: f64,
    verdict: Verdict,
}

/// The changes as text, regressions first; with `all`, every change.
pub fn text(found: &Comparison, all: bool) -> String {
    let [only_before, only_after] = found.alone;
    let mut text = format!("{} settings in both", found.pairs.len());
    if only_before + only_after > 0 {
        text += &format!(", {only_before} only in the first, {only_after} only in the second");
    }
    text += "\n";
    for difference in &found.differences {
        text += &format!("  {difference}\n");
    }
    let threshold = 100.0 * found.threshold;
    text += &format!(
        "worse, better: by more than {} % and beyond the noise; errors below 1 % of a scene's tolerance count as none;\n\
         step: mean over the run, or the median of studies with fewer than three rounds\n",
        digits(threshold)
    );
    let n = found.noise;
    text += &format!(
        "noise between two runs of one program: {:.1} % (settings scatter by {:.1} %, and {} are compared; a fixed loop took {:.3} times as long, which is divided out; threads waited {:.1} % of the time, which is not counted)\n",
        100.0 * n.allowed[0].exp_m1(),
        100.0 * n.scatter,
        found.pairs.len(),
        n.machine,
        100.0 * n.waited
    );
    if found.relative_to_scenes {
        text += "other programs slow all settings of a scene alike, as a change of the scene would: times are relative to the median of their scene\n";
    }
    text += "\n";
    // All widths of a setting end in the same bits, so one of them is enough.
    let own = |p: &SettingPair| (p.scene.clone(), p.solver, p.budget.clone(), p.order);
    let mut once: Vec<&SettingPair> = found.pairs.iter().collect();
    once.dedup_by_key(|p| own(p));
    text += &section("Scenes that hold", once.iter().filter_map(|p| holding(p)).collect(), all);
    let errors: Vec<ChangeLine> = once.iter().flat_map(|p| errors(p, found.threshold)).collect();
    let changed = once.iter().flat_map(|p| &p.errors).filter(|e| e.changed()).count();
    let count = once.iter().map(|p| p.errors.len()).sum::<usize>();
    text += &section(&format!("Errors: {changed} of {count} are not bit-identical"), errors, all);
    let times: Vec<ChangeLine> = found.pairs.iter().filter_map(|p| times(p, found.threshold)).collect();
    let common = match (found.common, found.relative) {
        (None, _) => String::new(),
        (Some(common), false) => format!(": median {} times as long", digits(common)),
        (Some(common), true) => format!(": relative to the median, {} times as long", digits(common)),
    };
    text += &section(&format!("Times{common}"), times, all);
    let changed = found.solvers.iter().filter(|s| s.verdict(found.threshold) != Verdict::Same || all);
    for s in changed {
        let [low, high] = s.interval.map(digits);
        text += &format!(
            "{}: {} times as long [{low}, {high}], relative to the other solvers on the same scenes ({} settings)\n",
            s.solver,
            digits(s.ratio),
            s.settings
        );
    }
    text + if found.regressed() { "regression: yes\n" } else { "regression: no\n" }
}

/// A list: how many entries became better and worse, and the largest changes.
fn section(title: &str, mut lines: Vec<ChangeLine>, all: bool) -> String {
    let count = |verdict| lines.iter().filter(|l| l.verdict == verdict).count();
    let mut text = format!("{title}; {} worse, {} better\n", count(Verdict::Worse), count(Verdict::Better));
    lines.retain(|l| l.verdict != Verdict::Same || all);
    lines.sort_by(|a, b| b.growth.ln().abs().total_cmp(&a.growth.ln().abs()));
    // Worse entries first, then better, then the rest.
    lines.sort_by_key(|l| {
        [Verdict::Worse, Verdict::Better, Verdict::Same].iter().position(|v| *v == l.verdict)
    });
    let shown = if all { lines.len() } else { lines.len().min(ROWS) };
    if shown > 0 {
        let mut rows =
            table(&["scene", "solver", "budget", "lanes", "what", "before", "after", "growth", ""]);
        for line in &lines[..shown] {
            let growth = if line.growth.is_finite() { digits(line.growth) } else { "–".into() };
            let word = match line.verdict {
                Verdict::Worse => "worse",
                Verdict::Better => "better",
                Verdict::Same => "",
            };
            let cells = line.cells.iter().cloned().chain([growth, word.to_string()]);
            rows.add_row(cells.collect::<Vec<_>>());
        }
        text += &finish(rows, 5);
    }
    if shown < lines.len() {
        text += &format!("… and {} more (--all)\n", lines.len() - shown);
    }
    text + "\n"
}

fn cells(pair: &SettingPair, what: &str, before: String, after: String) -> [String; 7] {
    let width = lanes_or_order(pair.order, pair.lanes);
    [pair.scene.clone(), pair.solver.into(), pair.budget.clone(), width, what.into(), before, after]
}

fn holding(pair: &SettingPair) -> Option<ChangeLine> {
    let [before, after] = pair.marks.map(|m| m.map_or("holds", |m| m.word()).to_string());
    (before != after).then(|| ChangeLine {
        verdict: pair.holding(),
        growth: f64::INFINITY,
        cells: cells(pair, "holds", before, after),
    })
}

fn errors(pair: &SettingPair, threshold: f64) -> Vec<ChangeLine> {
    // All widths of a setting have the same errors, so one of them is enough.
    let line = |e: &super::ErrorChange| {
        let [before, after] = e.values.map(|v| match (e.error == ErrorAxis::Law.word(), e.unit) {
            (true, _) => percent(v),
            (_, "") => ratio(v),
            (_, unit) => si(v, unit),
        });
        ChangeLine {
            cells: cells(pair, e.error, before, after),
            growth: e.growth(),
            verdict: e.verdict(threshold),
        }
    };
    pair.errors.iter().filter(|e| e.changed()).map(line).collect()
}

fn times(pair: &SettingPair, threshold: f64) -> Option<ChangeLine> {
    let time = pair.time?;
    let [before, after] = time.cost_ns.map(|ns| si(1e-9 * ns, "s"));
    Some(ChangeLine {
        cells: cells(pair, "step", before, after),
        growth: time.ratio,
        verdict: time.verdict(threshold),
    })
}
