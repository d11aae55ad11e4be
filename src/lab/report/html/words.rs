//! The answer in words: what to use on each scene, and a ranking over all of them.

use super::precision::shown;
use super::scale::number;
use super::study::{Axis, Study, Verdict};
use crate::lab::picture::svg::escaped;
use crate::lab::report::style::Style;
use crate::lab::study::ranking::CLOSE;
use crate::lab::units::si;

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
    let steps = study.settings["steps"].as_u64();
    let cut = steps.map_or(String::new(), |n| format!(" Runs end after {n} steps: what fails later is not seen."));
    let mut text = format!(
        "<p class=\"lead\">{}{cut}</p>\n<table class=\"numbers\"><caption>Over all scenes</caption><thead><tr><th>solver\
         <th>score<th>holds on<th>good enough on<th>fastest or tied<th>within {CLOSE}×</tr></thead><tbody>\n",
        sentences(study, scenes)
    );
    for own in &study.ranking {
        text += &format!("<tr><th>{}<td>{:.2}", named(&own.solver), own.score);
        for count in [own.holds, own.good, own.fastest, own.close] {
            text += &format!("<td>{count} of {scenes}");
        }
        text += "</tr>\n";
    }
    text += "</tbody></table>\n<p class=\"soft\">A setting is good enough if the scene holds (nothing falls, slides, \
             tunnels or blows up) and three errors keep the tolerances of the scene. Score: mean speed of the \
             cheapest good setting, in that of the fastest solver’s; 0 where none is good enough.</p>\n\
             <table class=\"numbers answer\"><caption>The cheapest setting that is good enough, by scene</caption>\
             <thead><tr><th>scene<th>solver<th>setting<th>time<th>penetration<th>residual<th>to reference\
             <th>runner-up</tr></thead><tbody>\n";
    for verdict in &study.answers {
        text += &row(study, verdict);
    }
    text + "</tbody></table>\n"
}

/// Who wins, and where nobody does.
fn sentences(study: &Study, scenes: usize) -> String {
    let mut text = String::new();
    if let Some(first) = study.ranking.first().filter(|s| s.good > 0) {
        text += &format!(
            "<b>{}</b> ranks first: it is good enough on {} of {scenes} scenes, and the fastest or tied with it on {}. ",
            escaped(&first.solver),
            first.good,
            first.fastest
        );
        let most = study.ranking.iter().max_by_key(|s| s.good).filter(|s| s.good > first.good);
        if let Some(most) = most {
            text += &format!("<b>{}</b> is good enough on most, {}. ", escaped(&most.solver), most.good);
        }
    }
    let none: Vec<&str> =
        study.answers.iter().filter(|v| v.best.is_none()).map(|v| v.scene.as_str()).collect();
    match none[..] {
        [] => text += "Every scene has a setting that is good enough.",
        [one] => text += &format!("Nothing that ran is good enough on {}.", escaped(one)),
        _ => text += &format!("Nothing that ran is good enough on {} scenes: {}.", none.len(), escaped(&none.join(", "))),
    }
    text
}

fn row(study: &Study, verdict: &Verdict) -> String {
    let get = |i: usize| study.records.get(i);
    let scene =
        format!("<tr><th><a href=\"#{}\">{}</a>", anchor(&verdict.scene), escaped(&verdict.scene));
    let best = verdict.best.and_then(get);
    let Some(entry) = best.or(verdict.nearest.and_then(get)) else {
        return format!("{scene}<td colspan=\"7\" class=\"bad\">nothing holds</tr>\n");
    };
    let unit = entry.truth.as_ref().map_or("", |t| t.unit.as_str());
    let error = |axis, unit: &str| entry.error(axis).map_or("–".into(), |e| shown(e, unit));
    let behind = match (best, verdict.runner_up.and_then(get)) {
        (None, _) => {
            let over = entry.excess().map_or("∞".into(), number);
            format!("<td class=\"bad\">none is good enough: the nearest, {over} times over")
        }
        _ if !verdict.tied.is_empty() => format!("<td>tied with {}", escaped(&verdict.tied.join(", "))),
        (_, None) => "<td>no other solver".into(),
        (_, Some(next)) => {
            let slower = verdict.slower.map_or(String::new(), |s| format!(": {s:.2}×"));
            format!("<td>{}, {}{slower}", escaped(&next.solver), escaped(&next.setting()))
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
