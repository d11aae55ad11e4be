//! The answer as text: what to use on each scene, and a ranking over all scenes.

use super::precision::shown;
use super::scale::number;
use super::setting::{Setting, scenes};
use crate::lab::picture::svg::escaped;
use crate::lab::report::answer::{fails_later, later_line, recommendation, warnings};
use crate::lab::report::style::Style;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::Record;
use crate::lab::study::answer::Answer;
use crate::lab::study::compare::Ratio;
use crate::lab::study::curve::ErrorAxis as Axis;
use crate::lab::study::ranking::{CLOSE, Ranking, ranking};
use crate::lab::study::sample::Sample;
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
pub fn answer(records: &[Record], steps: Option<u64>) -> String {
    let answers: Vec<Answer> = scenes(records).into_iter().filter_map(Answer::of).collect();
    let (scenes, ranking) = (answers.len(), ranking(records));
    let steps = steps.map(|n| n as u32);
    let mut text = format!(
        "<p class=\"lead\">{}</p>\n<table class=\"numbers ranking\"><caption>Over all scenes</caption><thead><tr><th>solver\
         <th>score<th>range<th>plausible<th>tight<th>exact<th>fastest or tied<th>within {CLOSE}×<th>fails on</tr></thead><tbody>\n",
        sentences(&ranking, &answers, records, steps)
    );
    for own in &ranking.standings {
        let [low, high] = own.range;
        text += &format!("<tr><th>{}<td>{:.2}<td>{low:.2}–{high:.2}", named(own.solver), own.score);
        for count in own.good.into_iter().chain([own.fastest, own.close]) {
            text += &format!("<td>{count} of {scenes}");
        }
        text += &format!("<td>{}</tr>\n", escaped(&own.fails_on.join(", ")));
    }
    text += "</tbody></table>\n<p class=\"soft\">A plausible run holds, stands for a minute if it has to rest, and its errors are within the tolerances of the scene: 1 cm of penetration for bodies of 1 m, 10 % of the lighter body’s weight for the contact-law residual, the scene’s reference value, the speed at rest. A tight run is within 10 % of them, an exact run within 1 %. Score: time of the fastest solver ÷ time of this one, each at its cheapest good-enough setting, averaged over scenes (0 where it is not good enough). Range: with any scene left out, and with half or twice the tolerances.</p>\n\
             <table class=\"numbers answer\"><caption>The cheapest setting that is good enough, by scene</caption>\
             <thead><tr><th>scene<th>solver<th>setting<th>mean step<th>median<th>longest<th>penetration<th>residual\
             <th>to reference<th>at rest<th>tight<th>exact<th>next</tr></thead><tbody>\n";
    for answer in &answers {
        text += &row(answer, records);
    }
    text + "</tbody></table>\n"
}

/// The recommendation, warnings, and scenes on which nothing is good enough.
fn sentences(ranking: &Ranking, answers: &[Answer], records: &[Record], steps: Option<u32>) -> String {
    let said = recommendation(ranking, answers.len(), steps);
    let mut text = said.lines().map(escaped).collect::<Vec<_>>().join("<br/>\n");
    let none: Vec<&str> = answers.iter().filter(|a| a.best().is_none()).map(|a| a.scene).collect();
    if !none.is_empty() {
        text += &format!("<br/>\nNothing that ran is good enough on {}.", escaped(&none.join(", ")));
    }
    // A line that begins with a small letter continues the previous one.
    let mut lines: Vec<String> = Vec::new();
    for line in warnings(records, steps).lines() {
        match lines.last_mut() {
            Some(last) if line.starts_with(char::is_lowercase) => *last += &format!(" {line}"),
            _ => lines.push(line.to_string()),
        }
    }
    for line in lines.into_iter().chain(later_lines(records)) {
        text += &format!("</p>\n<p class=\"bad\">{}", escaped(&line));
    }
    text
}

/// Settings that are good enough in their run but fail later.
fn later_lines(records: &[Record]) -> Vec<String> {
    fails_later(records).iter().map(|(r, why)| later_line(r, why) + ".").collect()
}

fn row(answer: &Answer, records: &[Record]) -> String {
    let scene = format!("<tr><th><a href=\"#{}\">{}</a>", anchor(answer.scene), escaped(answer.scene));
    let Some(entry) = answer.best().or(answer.nearest) else {
        return format!("{scene}<td colspan=\"12\" class=\"bad\">nothing holds</tr>\n");
    };
    let unit = entry.truth.map_or("", |t| t.unit);
    let error = |axis: Axis, unit: &str| axis.of(entry).map_or("–".into(), |e| shown(e, unit));
    let tied = answer.tied_solvers();
    let behind = match (answer.best(), answer.runner_up()) {
        (None, _) => {
            let over = entry.worst().map_or("∞".into(), number);
            format!("<td class=\"bad\">none is good enough: the nearest exceeds a tolerance {over} times")
        }
        _ if !tied.is_empty() => format!("<td>tied with {}", escaped(&tied.join(", "))),
        (_, None) => "<td>no other solver".into(),
        (Some(best), Some(next)) => {
            let ratio =
                next.sample.as_ref().zip(best.sample.as_ref()).and_then(|(next, best)| Ratio::of(next, best));
            let slower = ratio.map_or(String::new(), |r| format!(": {:.2}×", r.median));
            format!("<td>{}, {}{slower}", escaped(next.solver), escaped(&next.words()))
        }
    };
    let scene_records = records.chunk_by(|a, b| a.scene == b.scene).find(|s| s[0].scene == answer.scene);
    let stricter = |accuracy: Accuracy| {
        let best = scene_records.and_then(|s| Answer::at(s, accuracy)?.best());
        best.map_or("none".into(), |r| {
            let (words, cost) = (escaped(&r.words()), si(1e-9 * r.cost_ns(), "s"));
            format!("<span title=\"{words}\">{} {cost}</span>", escaped(r.solver))
        })
    };
    let time = |ns: fn(&Sample) -> f64| entry.sample.as_ref().map_or("–".into(), |s| si(1e-9 * ns(s), "s"));
    format!(
        "{scene}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}{behind}</tr>\n",
        named(entry.solver),
        escaped(&entry.words()),
        time(|s| s.mean_ns),
        time(|s| s.median_ns),
        time(|s| s.worst_ns),
        error(Axis::Penetration, "m"),
        error(Axis::Law, ""),
        error(Axis::Truth, unit),
        if entry.tolerances.rest.is_some() { error(Axis::Rest, "m/s") } else { "–".into() },
        stricter(Accuracy::Tight),
        stricter(Accuracy::Exact),
    )
}

/// Anchor of a scene's plots on the page.
pub fn anchor(scene: &str) -> String {
    let safe = scene.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("scene-{}", safe.collect::<String>())
}
