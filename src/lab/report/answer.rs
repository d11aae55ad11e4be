//! The study in a page: what to use on each scene, one ranking, what was left out.

use super::environment::Environment;
use super::table::{finish, table};
use super::units::{digits, is_emulated, ratio, si};
use crate::engine::world::Order;
use crate::lab::study::answer::{Answer, order};
use crate::lab::study::compare::Ratio;
use crate::lab::study::curve::{ErrorAxis, solvers_of};
use crate::lab::study::ranking::{CLOSE, ranking};
use crate::lab::study::{self, Record};

/// Names in a line.
const PER_LINE: usize = 10;

/// What the columns of the answer are.
const LEGEND: &str = "\
A setting is good enough if the scene holds (nothing falls, slides, tunnels or blows up) and three errors
keep the tolerances of the scene (`simpulse scene NAME` lists them with their reasons): the greatest
penetration; the contact-law residual, rms, in body weights; the distance to the scene's reference value
(– none is known).  budget: substeps, and in each so many velocity, relaxation and position sweeps.
µs/step: median, ± median deviation of a repeat.  runner-up: the cheapest setting of another solver;
slower: how much longer its steps take, over paired blocks; tie: no difference can be told.
";

/// The answer of a study, from its records alone; `steps` if runs were cut to so many.
pub fn text(records: &[Record], environment: &Environment, steps: Option<u32>) -> String {
    let scenes: Vec<Answer> = records.chunk_by(|a, b| a.scene == b.scene).filter_map(Answer::of).collect();
    let mut text = head(records, environment, scenes.len());
    if let Some(steps) = steps {
        text += &format!("Runs end after {steps} steps: what fails later is not seen.\n");
    }
    text += &format!("\n{LEGEND}\nThe cheapest setting that is good enough\n{}", cheapest(&scenes));
    text += &format!("\n{}", standings(records, scenes.len()));
    text + &left_out(records) + &differing(records)
}

/// What was tried, and where.
fn head(records: &[Record], environment: &Environment, scenes: usize) -> String {
    let mut lanes: Vec<usize> =
        records.iter().filter(|r| r.order == Order::Colored).map(|r| r.lanes).collect();
    lanes.sort_unstable();
    lanes.dedup();
    let mut ways: Vec<String> = Vec::new();
    if records.iter().any(|r| r.order == Order::Natural) {
        ways.push("natural order".to_string());
    }
    if let Some(widest) = lanes.last() {
        let list: Vec<String> = lanes.iter().map(usize::to_string).collect();
        let emulated = if is_emulated(*widest) { " (emulated above the native width)" } else { "" };
        let plural = if lanes == [1] { "" } else { "s" };
        ways.push(format!("coloured order at {} lane{plural}{emulated}", list.join(", ")));
    }
    let holding = records.iter().filter(|r| r.holds()).count();
    let good = records.iter().filter(|r| r.excess() <= 1.0).count();
    format!(
        "{scenes} scene{}, {} solver{}; {}\n{} settings: {holding} hold, {good} are good enough\n{}; {}: {} lanes per instruction\n",
        if scenes == 1 { "" } else { "s" },
        solvers_of(records).len(),
        if solvers_of(records).len() == 1 { "" } else { "s" },
        ways.join(", "),
        records.len(),
        environment.cpu,
        environment.instructions(),
        environment.native_lanes,
    )
}

/// A line per scene.
fn cheapest(scenes: &[Answer]) -> String {
    let mut rows = table(&[
        "scene",
        "solver",
        "budget",
        "lanes",
        "µs/step",
        "±",
        "penetration",
        "residual",
        "reference",
        "runner-up",
        "slower",
    ]);
    let mut notes = String::new();
    for answer in scenes {
        match (answer.best(), answer.nearest) {
            (Some(best), _) => {
                let mut cells = vec![answer.scene.to_string()];
                cells.extend(setting(best));
                cells.extend(runner_up(answer, best));
                rows.add_row(cells);
            }
            (None, Some(nearest)) => {
                let [solver, budget, lanes, time, ..] = setting(nearest);
                let (over, what) = worst(nearest);
                notes += &format!(
                    "{}: none is good enough; nearest is {solver}, {budget}, {lanes} lanes, {time} µs: \
                     {over} times its tolerance of {what}\n",
                    answer.scene
                );
            }
            (None, None) => notes += &format!("{}: no setting holds\n", answer.scene),
        }
    }
    let table = if scenes.iter().any(|a| a.best().is_some()) { finish(rows, 4) } else { String::new() };
    table + &notes
}

/// Solver, budget, lanes, time with its deviation, and the three errors.
fn setting(record: &Record) -> [String; 8] {
    let time = |ns: fn(&crate::lab::study::interleave::Sample) -> f64| {
        record.sample.as_ref().map_or("–".to_string(), |sample| digits(ns(sample) / 1e3))
    };
    let error = |axis: ErrorAxis, show: &dyn Fn(f64) -> String| axis.of(record).map_or("–".to_string(), show);
    [
        record.solver.to_string(),
        record.budget_text.clone(),
        match record.order {
            Order::Natural => "natural".to_string(),
            Order::Colored if is_emulated(record.lanes) => format!("{} emulated", record.lanes),
            Order::Colored => record.lanes.to_string(),
        },
        time(|sample| sample.median_ns),
        time(|sample| sample.spread_ns),
        error(ErrorAxis::Penetration, &|e| si(e, "m")),
        error(ErrorAxis::Law, &ratio),
        error(ErrorAxis::Truth, &|e| si(e, record.truth.map_or("", |t| t.unit))),
    ]
}

/// The error that is farthest over its tolerance, and how far.
fn worst(record: &Record) -> (String, &'static str) {
    let over = |axis: &ErrorAxis| record.in_tolerance(*axis).unwrap_or(0.0);
    let axis = ErrorAxis::ALL.into_iter().max_by(|a, b| over(a).total_cmp(&over(b)));
    let axis = axis.unwrap_or(ErrorAxis::Penetration);
    match record.excess() {
        excess if excess.is_finite() => (digits(excess), axis.name()),
        _ => ("infinitely many".to_string(), ErrorAxis::Truth.name()),
    }
}

/// The other solvers that tie, or the next one, and how much slower it is.
fn runner_up(answer: &Answer, best: &Record) -> [String; 2] {
    let tied = answer.tied_solvers();
    if let Some(first) = tied.first() {
        let others = match tied.len() {
            1 => String::new(),
            count => format!(" and {} more", count - 1),
        };
        return [format!("{first}{others}"), "tie".to_string()];
    }
    let Some(next) = answer.runner_up() else {
        return ["no other solver".to_string(), "–".to_string()];
    };
    let name = format!("{}, {}", next.solver, next.budget_text);
    let ratio = next.sample.as_ref().zip(best.sample.as_ref()).and_then(|(next, best)| Ratio::of(next, best));
    let by = match ratio {
        _ if order(next, best).is_eq() => "tie".to_string(),
        Some(ratio) if ratio.median < 2.0 => format!("{:.0} %", 100.0 * (ratio.median - 1.0)),
        Some(ratio) => format!("{}×", digits(ratio.median)),
        None => "–".to_string(),
    };
    [name, by]
}

/// All solvers over all scenes.
fn standings(records: &[Record], scenes: usize) -> String {
    let close = format!("within {CLOSE}×");
    let mut rows = table(&["solver", "score", "holds on", "good enough on", "fastest or tied", &close]);
    for own in ranking(records) {
        let mut cells = vec![own.solver.to_string(), format!("{:.2}", own.score)];
        cells.extend([own.holds, own.good, own.fastest, own.close].map(|n| format!("{n} of {scenes}")));
        rows.add_row(cells);
    }
    format!(
        "Ranking over all scenes.  score: mean speed of the cheapest good setting in that of the fastest solver's,\n\
         0 where none is good enough; 1 would be the fastest on every scene\n{}",
        finish(rows, 1)
    )
}

/// Solvers that the default list leaves out.
fn left_out(records: &[Record]) -> String {
    match study::left_out(&solvers_of(records)).as_slice() {
        [] => String::new(),
        others => {
            let mut text = "\nleft out (--solvers all runs every solver):".to_string();
            let lines: Vec<String> = others.chunks(PER_LINE).map(|line| line.join(", ")).collect();
            text += &format!("\n  {}\n", lines.join(",\n  "));
            text
        }
    }
}

/// What would make the times worthless: widths that did something else.
fn differing(records: &[Record]) -> String {
    match records.iter().filter(|r| r.bits_equal == Some(false)).count() {
        0 => String::new(),
        count => format!("\n{count} settings did NOT end in the bits of their error run: see tables.txt\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::VARIANTS;
    use crate::lab::study::record::tests::{failed, fell, record};

    fn page(records: &[Record]) -> String {
        text(records, &Environment::current(), None)
    }

    #[test]
    fn the_cheapest_is_named_with_its_errors_and_the_next_solver() {
        let other = |time| Record { solver: "soft_step", ..record(8, 4, time, 5e-4) };
        let records = [record(1, 1, 20.0, 14e-3), record(8, 2, 41.0, 9e-4), record(16, 4, 45.0, 1e-4)];
        let line = |records: &[Record]| {
            let text = page(records);
            let line = text.lines().find(|l| l.starts_with("stack:2")).unwrap();
            line.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        // Narrow builds emulate eight lanes and say so.
        let lanes = if is_emulated(8) { "8 emulated" } else { "8" };
        let expected = format!("stack:2 pgs 2 sub {lanes} 41.0 0.00 900 µm 0 – no other solver –");
        assert_eq!(line(&records), expected);
        let with = |time| [&records[..], &[other(time)]].concat();
        assert!(line(&with(61.5)).ends_with("soft_step, 4 sub 50 %"), "{}", line(&with(61.5)));
        assert!(line(&with(41.8)).ends_with(" soft_step tie"), "{}", line(&with(41.8)));
        assert!(line(&with(410.0)).ends_with(" 10.0×"), "{}", line(&with(410.0)));
    }

    #[test]
    fn a_scene_without_an_answer_says_why() {
        let over = page(&[record(1, 1, 20.0, 14e-3)]);
        assert!(
            over.contains(
                "stack:2: none is good enough; nearest is pgs, 1 sub, 1 lanes, 20.0 µs: 1.40 times its"
            ),
            "{over}"
        );
        let text = page(&[failed(1), fell(8, 1, 1.0, 0.0)]);
        assert!(text.contains("stack:2: no setting holds\n"), "{text}");
        assert!(text.contains("2 settings: 0 hold, 0 are good enough"), "{text}");
    }

    #[test]
    fn the_page_stays_a_page_and_says_what_did_not_run() {
        let of = |scene: &str, solver| Record { scene: scene.to_string(), solver, ..record(8, 1, 5.0, 1e-3) };
        let all = |solvers: &[&'static str]| -> Vec<Record> {
            (0..11).flat_map(|i| solvers.iter().map(move |s| of(&format!("scene:{i}"), *s))).collect()
        };
        let every: Vec<&'static str> = VARIANTS.iter().map(|v| v.name).collect();
        for solvers in [&study::DEFAULT_SOLVERS[..], &every] {
            let text = page(&all(solvers));
            // What a study adds are two lines: where the files are.
            assert!(text.lines().count() <= 58, "{text}");
            assert!(text.lines().all(|l| l.chars().count() <= 160), "{text}");
            let left_out = text.split_once("left out").map_or("", |(_, names)| names);
            for name in every.iter().filter(|name| !solvers.contains(name)) {
                assert!(left_out.split([',', ' ', '\n']).any(|word| word == *name), "{name}: {text}");
            }
        }
    }
}
