//! The answer in words: what to use on each scene, and a ranking over all of them.

use super::precision::shown;
use super::scale::number;
use super::setting::{Setting, scenes};
use crate::lab::picture::svg::escaped;
use crate::lab::report::style::Style;
use crate::lab::study::Record;
use crate::lab::study::answer::Answer;
use crate::lab::study::compare::Ratio;
use crate::lab::study::curve::ErrorAxis as Axis;
use crate::lab::study::ranking::{CLOSE, Standing, ranking};
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
    let cut =
        steps.map_or(String::new(), |n| format!(" Runs end after {n} steps: what fails later is not seen."));
    let mut text = format!(
        "<p class=\"lead\">{}{cut}</p>\n<table class=\"numbers ranking\"><caption>Over all scenes</caption><thead><tr><th>solver\
         <th>score<th>holds on<th>good enough on<th>fastest or tied<th>within {CLOSE}×</tr></thead><tbody>\n",
        sentences(&ranking, &answers)
    );
    for own in &ranking {
        text += &format!("<tr><th>{}<td>{:.2}", named(own.solver), own.score);
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
    for answer in &answers {
        text += &row(answer);
    }
    text + "</tbody></table>\n"
}

/// Who wins, and where nobody does.
fn sentences(ranking: &[Standing], answers: &[Answer]) -> String {
    let scenes = answers.len();
    let mut text = String::new();
    if let Some(first) = ranking.first().filter(|s| s.good > 0) {
        text += &format!(
            "<b>{}</b> ranks first: it is good enough on {} of {scenes} scenes, and the fastest or tied with it on {}. ",
            escaped(first.solver),
            first.good,
            first.fastest
        );
        let most = ranking.iter().max_by_key(|s| s.good).filter(|s| s.good > first.good);
        if let Some(most) = most {
            text += &format!("<b>{}</b> is good enough on most, {}. ", escaped(most.solver), most.good);
        }
    }
    let none: Vec<&str> = answers.iter().filter(|a| a.best().is_none()).map(|a| a.scene).collect();
    match none[..] {
        [] => text += "Every scene has a setting that is good enough.",
        [one] => text += &format!("Nothing that ran is good enough on {}.", escaped(one)),
        _ => {
            text += &format!(
                "Nothing that ran is good enough on {} scenes: {}.",
                none.len(),
                escaped(&none.join(", "))
            )
        }
    }
    text
}

fn row(answer: &Answer) -> String {
    let scene = format!("<tr><th><a href=\"#{}\">{}</a>", anchor(answer.scene), escaped(answer.scene));
    let Some(entry) = answer.best().or(answer.nearest) else {
        return format!("{scene}<td colspan=\"7\" class=\"bad\">nothing holds</tr>\n");
    };
    let unit = entry.truth.map_or("", |t| t.unit);
    let error = |axis: Axis, unit: &str| axis.of(entry).map_or("–".into(), |e| shown(e, unit));
    let tied = answer.tied_solvers();
    let behind = match (answer.best(), answer.runner_up()) {
        (None, _) => {
            let over = entry.worst().map_or("∞".into(), number);
            format!("<td class=\"bad\">none is good enough: the nearest, {over} times over")
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
    format!(
        "{scene}<td>{}<td>{}<td>{}<td>{}<td>{}<td>{}{behind}</tr>\n",
        named(entry.solver),
        escaped(&entry.words()),
        entry.time().map_or("–".into(), |t| si(t, "s")),
        error(Axis::Penetration, "m"),
        error(Axis::Law, ""),
        error(Axis::Truth, unit),
    )
}

/// Where a scene's plots are on the page.
pub fn anchor(scene: &str) -> String {
    let safe = scene.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' });
    format!("scene-{}", safe.collect::<String>())
}
