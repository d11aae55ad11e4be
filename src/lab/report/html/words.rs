//! The answer in words: what to use on each scene, and a ranking over all of them.

use super::precision::shown;
use super::scale::number;
use super::study::{Axis, Entry, Study, Verdict};
use crate::lab::picture::svg::escaped;
use crate::lab::report::style::Style;
use crate::lab::units::si;
use std::cmp::Reverse;

/// A solver over all scenes.
struct Rank<'a> {
    solver: &'a str,
    /// Scenes on which it is the cheapest within tolerance, or tied.
    best: usize,
    /// Scenes on which a setting of it is within tolerance.
    solved: usize,
    /// Scenes on which a setting of it holds.
    held: usize,
    /// Geometric mean of its time over that of the cheapest, where it is within tolerance.
    factor: f64,
}

fn ranks(study: &Study) -> Vec<Rank<'_>> {
    let mut ranks: Vec<Rank> = study
        .solvers()
        .into_iter()
        .map(|solver| {
            let mut rank = Rank { solver, best: 0, solved: 0, held: 0, factor: 1.0 };
            let mut logs = 0.0;
            for verdict in &study.answers {
                let good = || verdict.good.iter().filter_map(|&i| study.records.get(i));
                let Some(own) = good().find(|e| e.solver == solver) else { continue };
                rank.solved += 1;
                let first = good().next().and_then(Entry::time).unwrap_or(1.0);
                logs += (own.time().unwrap_or(first) / first).max(1.0).ln();
                let leads = verdict.good.iter().take(1).chain(&verdict.tied);
                rank.best += leads
                    .filter_map(|&i| study.records.get(i))
                    .any(|e| e.solver == solver) as usize;
            }
            let holds = |scene: &&[Entry]| scene.iter().any(|e| e.solver == solver && e.broke().is_none());
            rank.held = study.scenes().iter().filter(|s| holds(s)).count();
            rank.factor = (logs / rank.solved.max(1) as f64).exp();
            rank
        })
        .collect();
    ranks.sort_by(|a, b| (Reverse(a.solved), Reverse(a.best)).cmp(&(Reverse(b.solved), Reverse(b.best)))
        .then(a.factor.total_cmp(&b.factor)));
    ranks
}

/// A solver's name with its marker.
fn named(solver: &str) -> String {
    let Style { color, marker } = Style::of(solver);
    format!(
        "<svg class=\"mark\" viewBox=\"0 0 14 14\"><path d=\"{}\" fill=\"{color}\"/></svg>{}",
        marker.path([7.0, 7.0], 5.0),
        escaped(solver)
    )
}

/// Sentences, the ranking, and a table by scene.
pub fn answer(study: &Study) -> String {
    let scenes = study.scenes().len();
    if study.answers.is_empty() {
        return "<p>These records have no verdict: they were written by an older version. \
                A new study has one.</p>\n"
            .into();
    }
    let ranks = ranks(study);
    let none: Vec<&str> =
        study.answers.iter().filter(|v| v.good.is_empty()).map(|v| v.scene.as_str()).collect();
    let mut text = String::from("<p class=\"lead\">");
    if let Some(first) = ranks.first().filter(|r| r.solved > 0) {
        let more = if ranks.get(1).is_some_and(|r| r.solved == first.solved) { "as many as" } else { "more than" };
        text += &format!(
            "<b>{}</b> keeps every tolerance on {} of {scenes} scenes, {more} any other solver; it is the cheapest, \
             or tied with it, on {}. ",
            escaped(first.solver),
            first.solved,
            first.best
        );
        let cheapest = ranks.iter().max_by_key(|r| r.best).filter(|r| r.best > first.best);
        if let Some(cheapest) = cheapest {
            text += &format!(
                "<b>{}</b> is most often the cheapest: on {}, and within tolerance on {}. ",
                escaped(cheapest.solver),
                cheapest.best,
                cheapest.solved
            );
        }
    }
    match none[..] {
        [] => text += "Every scene has a setting within tolerance.",
        [one] => text += &format!("No setting that ran is within tolerance on {}.", escaped(one)),
        _ => {
            let names = escaped(&none.join(", "));
            text += &format!("No setting that ran is within tolerance on {} scenes: {names}.", none.len());
        }
    }
    text += "</p>\n<table class=\"numbers\"><caption>Over all scenes</caption><thead><tr><th>solver\
             <th>cheapest or tied<th>within tolerance<th>holds at all<th>time, of the cheapest</tr></thead><tbody>\n";
    for rank in &ranks {
        let factor = if rank.solved > 0 { format!("{:.2}×", rank.factor) } else { "–".into() };
        text += &format!(
            "<tr><th>{}<td>{} of {scenes}<td>{}<td>{}<td>{factor}</tr>\n",
            named(rank.solver),
            rank.best,
            rank.solved,
            rank.held
        );
    }
    text += "</tbody></table>\n<p class=\"soft\">Time, of the cheapest: geometric mean over the scenes on which \
             the solver is within tolerance.</p>\n<table class=\"numbers answer\"><caption>The cheapest setting within \
             tolerance, by scene</caption><thead><tr><th>scene<th>solver<th>setting<th>time<th>penetration\
             <th>residual<th>to truth<th>runner-up</tr></thead><tbody>\n";
    for verdict in &study.answers {
        text += &row(study, verdict);
    }
    text + "</tbody></table>\n"
}

fn row(study: &Study, verdict: &Verdict) -> String {
    let get = |i: &usize| study.records.get(*i);
    let scene = format!("<tr><th><a href=\"#{id}\">{}</a>", escaped(&verdict.scene), id = anchor(&verdict.scene));
    let best = verdict.good.first().and_then(get);
    let Some(entry) = best.or(verdict.nearest.as_ref().and_then(get)) else {
        return format!("{scene}<td colspan=\"7\" class=\"bad\">nothing holds</tr>\n");
    };
    let unit = entry.truth.as_ref().map_or("", |t| t.unit.as_str());
    let error = |axis, unit: &str| entry.error(axis).map_or("–".into(), |e| shown(e, unit));
    let behind = match (best, verdict.good.get(1).and_then(get)) {
        (None, _) => {
            let over = entry.excess().map_or("∞".into(), number);
            format!("<td class=\"bad\">none within tolerance: the nearest, {over} times over")
        }
        (_, None) => "<td>no other is within tolerance".into(),
        (Some(best), Some(next)) => {
            let mut tied: Vec<&str> =
                verdict.tied.iter().filter_map(get).map(|e| e.solver.as_str()).filter(|s| *s != best.solver).collect();
            tied.sort_unstable();
            tied.dedup();
            let ratio = next.time().zip(best.time()).map_or(1.0, |(a, b)| a / b);
            let (solver, setting) = (escaped(&next.solver), escaped(&next.setting()));
            match tied[..] {
                [] => format!("<td>{solver}, {setting}: {ratio:.2}×"),
                _ => format!("<td>tied with {}", escaped(&tied.join(", "))),
            }
        }
    };
    format!(
        "{scene}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}{behind}</tr>\n",
        named(&entry.solver),
        escaped(&entry.setting()),
        entry.time().map_or("–".into(), |t| si(t, "s")),
        error(Axis::Penetration, "m"),
        error(Axis::Residual, ""),
        error(Axis::Truth, unit),
    )
}

/// Where a scene's plots are on the page.
pub fn anchor(scene: &str) -> String {
    let safe = scene.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("scene-{}", safe.collect::<String>())
}
