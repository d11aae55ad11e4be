//! The answer of a study on one page: which solver to use and when, the drawbacks, the best setting on each
//! scene, which solvers fail, and what was left out.

use super::by_scene::{self, verdict};
use super::doc::{self, DocBlock, DocCell, DocTable, Tone};
use super::environment::Environment;
use super::units::{count as number, digits, is_emulated};
use crate::engine::solvers::DEFAULT;
use crate::engine::world::Order;
use crate::lab::scenes::CATALOG;
use crate::lab::scenes::class::SceneClass;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::answer::{Answer, each_setting, fails_last, order};
use crate::lab::study::compare::Ratio;
use crate::lab::study::curve::{ErrorAxis, distinct, solvers_of};
use crate::lab::study::ranking::{FirstPlaces, Ranking, Standing, ranking};
use crate::lab::study::{self, Record};

const MOST_RANKED: usize = 8;
const MOST_NOTES: usize = 7;

/// Waiting beyond this fraction of the time causes a warning (1).
const BUSY: f64 = 0.02;

/// Description of the columns of the answer.
const LEGEND: &str = "\
Good enough (plausible): the scene holds, stands for a minute if it has to rest, and its errors are within the tolerances \
of the scene (`simpulse list SCENE`): pen., penetration (1 cm for bodies of 1 m); res., contact-law residual (10 % of the \
lighter body's weight); ref., distance to the reference value; rest, speed at rest. tight: within 10 % of them; exact: \
within 1 %. µs/step: mean over the run, its median, its longest step. next: the cheapest setting of another solver, and \
how much slower it is; tie: too close to call.";

/// The answer of a study as text, from its records alone; `steps` if runs were limited to that many steps.
pub fn text(records: &[Record], environment: &Environment, steps: Option<u32>) -> String {
    doc::text(&blocks(records, environment, steps)) + &doc::lines(&left_out(records)) + &differing(records)
}

/// The answer of a study.
pub fn blocks(records: &[Record], environment: &Environment, steps: Option<u32>) -> Vec<DocBlock> {
    let scenes: Vec<Answer> = records.chunk_by(|a, b| a.scene == b.scene).filter_map(Answer::of).collect();
    let ranking = ranking(records);
    let (cheapest, without) = cheapest(&scenes, records, "FILE.json");
    let plain = |text: String| DocBlock::Text(Tone::Plain, text);
    vec![
        DocBlock::Text(Tone::Lead, recommendation(&ranking, scenes.len(), steps)),
        DocBlock::Text(Tone::Bad, warnings(records, steps)),
        plain(head(records, environment, scenes.len())),
        DocBlock::Table(cheapest),
        plain(without),
        DocBlock::Table(DocTable { most: MOST_NOTES, ..fail_later(records) }),
        DocBlock::Table(accuracies(&scenes, records)),
        DocBlock::Table(standings(&ranking, scenes.len())),
        DocBlock::Text(Tone::Soft, LEGEND.to_string()),
    ]
}

/// The recommendation with its conditions, and the rank of the default solver.
fn recommendation(ranking: &Ranking, scenes: usize, steps: Option<u32>) -> String {
    let standings = &ranking.standings;
    let all: Vec<&Standing> = standings.iter().filter(|s| s.good[0] == scenes).collect();
    let only = if let [only] = all[..] { Some(only) } else { None };
    let speed = |s: &Standing| format!("{:.0} % of the speed of each scene's fastest", 100.0 * s.score);
    let (mut text, usage) = match steps {
        Some(n) => (format!("Not a recommendation: runs end after {n} steps.  "), "First is"),
        None => (String::new(), "Use"),
    };
    text += &match (ranking.leader(), only) {
        (Some(first), _) => format!(
            "{usage} {}: good enough on {} of {scenes} scenes, at {}. This also holds with any one scene or class of scenes left out, and with half or twice the tolerances.",
            first.solver,
            first.good[0],
            speed(first)
        ),
        (None, Some(only)) => format!(
            "{usage} {} if you need one solver for all {scenes} scenes: no other is good enough on every one. It runs at {}.",
            only.solver,
            speed(only)
        ),
        (None, None) if ranking.first.solvers.is_empty() => "No setting is good enough on any scene.".into(),
        (None, None) if all.is_empty() => "No solver is good enough on all scenes: choose by scene.".into(),
        (None, None) => format!(
            "{} solvers are good enough on all scenes; which is fastest depends on the scene.",
            all.len()
        ),
    };
    match (ranking.leader(), only) {
        (Some(first), Some(only)) if only.solver != first.solver => {
            text += &format!(" Only {} is good enough on all of them, at {}.", only.solver, speed(only));
        }
        (None, _) if ranking.first.solvers.len() > 1 => {
            let first = first_places(&ranking.first, 6);
            text += &format!(
                "  No solver is the fastest throughout: with a scene or class left out or other tolerances, first is {first}."
            );
        }
        _ => {}
    }
    let words = ["stay where they are placed at rest", "arrive at rest", "need not come to rest"];
    let classes = words.iter().zip(&ranking.first_in).filter(|(_, first)| !first.solvers.is_empty());
    let classes = classes.map(|(words, first)| format!("{} where bodies {words}", first_places(first, 3)));
    let classes: Vec<String> = classes.collect();
    if classes.len() > 1 {
        text += &format!("  First by class of scenes: {}.", classes.join("; "));
    }
    if let Some(place) = standings.iter().position(|s| s.solver == DEFAULT) {
        let Standing { good, fails_on, .. } = &standings[place];
        let not =
            if fails_on.is_empty() { String::new() } else { format!(", not on {}", short_list(fails_on, 4)) };
        text += &format!(
            "\n{DEFAULT}, the default, is number {} of {} by score: good enough on {} of {scenes} scenes{not}.",
            place + 1,
            standings.len(),
            good[0]
        );
    }
    text + "\n"
}

/// `a in 9 of 12, b in 4`: first places, which may be shared.
fn first_places(first: &FirstPlaces, most: usize) -> String {
    let place = |(i, (solver, count)): (usize, &(&str, usize))| match i {
        0 => format!("{solver} in {count} of {}", first.variations),
        _ => format!("{solver} in {count}"),
    };
    short_list(&first.solvers.iter().enumerate().map(place).collect::<Vec<_>>(), most)
}

/// The first few of a list.
fn short_list(names: &[impl AsRef<str>], most: usize) -> String {
    let shown = names.iter().take(most).map(AsRef::as_ref).collect::<Vec<&str>>().join(", ");
    if names.len() > most { format!("{shown} and {} more", names.len() - most) } else { shown }
}

/// Warnings about the quality of the figures.
fn warnings(records: &[Record], steps: Option<u32>) -> String {
    let mut text = String::new();
    let samples = || records.iter().filter_map(|r| r.sample.as_ref());
    let timed = samples().count().max(1) as f64;
    let waited = samples().map(|s| s.waited).sum::<f64>() / timed;
    if waited > BUSY {
        text += &format!(
            "WARNING: this machine was busy: the timed thread waited for a processor {:.0} % of the time. That is taken \
             out of the times. Fewer blocks remain to compare, so more differences are ties. Run again on an idle machine.\n",
            100.0 * waited
        );
    }
    let rounds = samples().map(|s| s.rounds).min().unwrap_or(0);
    if rounds < 3 && timed > 1.0 {
        text += &format!(
            "WARNING: {}: spikes of a solver cannot be told from those of the machine, so costs are medians.\n",
            number(rounds as usize, "round")
        );
    }
    if steps.is_some() && records.iter().all(|r| r.later.is_none()) {
        text += "WARNING: runs were not extended to a minute, so later failures were not looked for.\n";
    }
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        let mut unsolved: Vec<&str> = scene.iter().filter(|r| r.is_unsolved()).map(|r| r.solver).collect();
        unsolved.dedup();
        if !unsolved.is_empty() {
            let solvers = unsolved.join(", ");
            text += &format!(
                "NOT SCORED: {}: too many contact points for the method of {solvers}\n",
                scene[0].scene
            );
        }
        for what in &scene[0].unchecked {
            text += &format!("NOT CHECKED: {}: {what}\n", scene[0].scene);
        }
    }
    text
}

/// A line on the settings that ran and on the machine.
fn head(records: &[Record], environment: &Environment, scenes: usize) -> String {
    let ran = |order: &Order| records.iter().any(|r| r.order == *order);
    let mut ways: Vec<String> =
        Order::ALL.into_iter().filter(ran).map(|order| format!("{} order", order.name())).collect();
    let mut widths = distinct(records.iter().filter(|r| r.order == Order::Colored).map(|r| r.lanes));
    widths.sort_unstable();
    if let (Some(last), Some(widest)) = (ways.last_mut(), widths.last()) {
        let list: Vec<String> = widths.iter().map(usize::to_string).collect();
        let emulated = if is_emulated(*widest) { " (emulated above the native width)" } else { "" };
        *last += &format!(" at {} lane{}{emulated}", list.join(", "), if widths == [1] { "" } else { "s" });
    }
    let holding = records.iter().filter(|r| r.holds()).count();
    let [plausible, tight, exact] = Accuracy::ALL.map(|a| records.iter().filter(|r| r.is_good(a)).count());
    let rounds = records.iter().filter_map(|r| Some(r.sample.as_ref()?.rounds)).max().unwrap_or(0);
    format!(
        "{}, {}; {}; {} common to all settings\n\
         {} settings: {holding} hold, {plausible} are plausible, {tight} tight, {exact} exact · {}; {}: {} lanes per instruction\n",
        number(scenes, "scene"),
        number(solvers_of(records).len(), "solver"),
        ways.join(", "),
        number(rounds as usize, "round"),
        records.len(),
        environment.cpu,
        environment.instructions(),
        environment.native_lanes,
    )
}

/// A table with the cheapest setting of each scene, and a line for each scene without one; `file` is the path of a
/// scene that is not in the catalog.
pub fn cheapest(scenes: &[Answer], records: &[Record], file: &str) -> (DocTable, String) {
    let head = ["scene", "solver", "budget", "µs/step", "median", "longest", "next", "slower"];
    let mut rows = DocTable::new("The cheapest setting that is good enough", 3, &head);
    let mut notes = String::new();
    for answer in scenes {
        match (answer.best(), answer.nearest) {
            (Some(best), _) => {
                let [solver, others @ ..] = setting(best);
                let mut cells = vec![DocCell::scene(answer.scene), DocCell::solver(&solver)];
                cells.extend(others.map(DocCell::from));
                cells.extend(runner_up(answer, best).map(DocCell::from));
                rows.row(cells);
            }
            (None, Some(nearest)) => {
                let [solver, budget, time, ..] = setting(nearest);
                let why = verdict(nearest);
                notes += &format!(
                    "{}: none is good enough; nearest is {solver}, {budget}, {time} µs: {why}\n",
                    answer.scene
                );
            }
            (None, None) => {
                notes += &format!("{}: no setting holds\n", answer.scene);
                if let Some(last) = fails_last(records.iter().filter(|r| r.scene == answer.scene)) {
                    let stem = answer.scene.split(':').next();
                    let is_known = CATALOG.iter().any(|entry| Some(entry.name) == stem);
                    notes += &format!(
                        "  longest is {}, {}: {}; to see it: {}\n",
                        last.solver,
                        by_scene::setting(last),
                        last.why_failed().unwrap_or_default(),
                        last.command_to_see(if is_known { answer.scene } else { file })
                    );
                }
            }
        }
    }
    (rows, notes)
}

/// Solver, budget with lanes, mean, median and longest step.
fn setting(record: &Record) -> [String; 5] {
    let time = |ns: fn(&crate::lab::study::sample::Sample) -> f64| {
        record.sample.as_ref().map_or("–".to_string(), |sample| digits(ns(sample) / 1e3))
    };
    [
        record.solver.to_string(),
        by_scene::setting(record),
        time(|sample| sample.mean_ns),
        time(|sample| sample.median_ns),
        time(|sample| sample.worst_ns),
    ]
}

fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent > 0.0 && percent < 0.1 {
        "0".to_string()
    } else if percent < 10.0 {
        format!("{percent:.1}")
    } else {
        format!("{percent:.0}")
    }
}

/// The other solvers that tie or, if none does, the next solver and how much slower it is.
fn runner_up(answer: &Answer, best: &Record) -> [String; 2] {
    let tied = answer.tied_solvers();
    if let Some(first) = tied.first() {
        let others = match tied.len() {
            1 => String::new(),
            count => format!(" + {}", count - 1),
        };
        return [format!("{first}{others}"), "tie".to_string()];
    }
    let Some(next) = answer.runner_up() else {
        return ["no other solver".to_string(), "–".to_string()];
    };
    let ratio = next.sample.as_ref().zip(best.sample.as_ref()).and_then(|(next, best)| Ratio::of(next, best));
    let by = match ratio {
        _ if order(next, best).is_eq() => "tie".to_string(),
        Some(ratio) if ratio.median < 2.0 => format!("{:.0} %", 100.0 * (ratio.median - 1.0)),
        Some(ratio) => format!("{}×", digits(ratio.median)),
        None => "–".to_string(),
    };
    [next.solver.to_string(), by]
}

/// Errors of the cheapest plausible setting (% of their tolerances), and the cheapest settings at the
/// stricter levels.
fn accuracies(scenes: &[Answer], records: &[Record]) -> DocTable {
    let caption = "Its errors in % of the tolerances, and the cheapest settings that are tight and exact";
    let mut rows = DocTable::new(
        caption,
        1,
        &["scene", "pen.", "res.", "ref.", "rest", "tight: solver, budget", "µs", "exact", "µs"],
    );
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        let best = scenes.iter().find(|a| a.scene == scene[0].scene).and_then(Answer::best);
        let share = |axis: ErrorAxis| best.and_then(|r| r.in_tolerance(axis)).map_or("–".into(), percent);
        let mut cells = vec![scene[0].scene.clone()];
        cells.extend(ErrorAxis::JUDGED.map(share));
        let [tight, exact] =
            [Accuracy::Tight, Accuracy::Exact].map(|a| Answer::at(scene, a.share()).and_then(|a| a.best()));
        for (found, known) in [(tight, None), (exact, tight)] {
            match found {
                Some(best) if known.is_some_and(|k| std::ptr::eq(k, best)) => {
                    cells.extend(["the same".to_string(), String::new()]);
                }
                Some(best) => cells.extend([
                    format!("{}, {}", best.solver, by_scene::setting(best)),
                    digits(best.cost_ns() / 1e3),
                ]),
                None => cells.extend(["none".to_string(), "–".to_string()]),
            }
        }
        rows.row(cells);
    }
    rows
}

/// A table of all solvers over all scenes.
fn standings(ranking: &Ranking, scenes: usize) -> DocTable {
    const CAPTION: &str = "\
Ranking over all scenes. score: time of the fastest solver ÷ time of this one, each at its cheapest good-enough setting, \
averaged over scenes (0 where it is not good enough); range: with any scene or class left out, and with half or twice the \
tolerances; placed, arrives, moves: score where bodies start at rest, come to rest, or need not; then numbers of scenes";
    let [placed, arrives, moves] = SceneClass::ALL.map(SceneClass::word);
    let [plausible, tight, exact] = Accuracy::ALL.map(Accuracy::word);
    let head =
        ["solver", "score", "range", placed, arrives, moves, plausible, tight, exact, "fastest", "fails on"];
    let caption = format!("{CAPTION}, of {scenes}");
    let mut rows = DocTable { most: MOST_RANKED, ..DocTable::new(caption, 1, &head) };
    for own in &ranking.standings {
        let [low, high] = own.range;
        let mut cells = vec![DocCell::solver(own.solver)];
        cells.extend([format!("{:.2}", own.score), format!("{low:.2}–{high:.2}")].map(DocCell::from));
        cells.extend(own.by_class.map(|score| score.map_or("–".into(), |s| format!("{s:.2}")).into()));
        cells.extend(own.good.into_iter().chain([own.fastest]).map(|n| n.to_string().into()));
        let fails = if own.fails_on.is_empty() { "–".into() } else { short_list(&own.fails_on, 2) };
        cells.push(DocCell { title: own.fails_on.join(", "), ..fails.into() });
        rows.row(cells);
    }
    rows
}

/// A line on the solvers that the default list leaves out.
fn left_out(records: &[Record]) -> String {
    match study::left_out(&solvers_of(records)).as_slice() {
        [] => String::new(),
        others => {
            format!("not run, {} solvers (--solvers all): {}", others.len(), others.join(", "))
        }
    }
}

/// A warning on settings with invalid times: their timed runs gave other results.
fn differing(records: &[Record]) -> String {
    match records.iter().filter(|r| r.bits_equal == Some(false)).count() {
        0 => String::new(),
        count => {
            format!("\n{count} settings did NOT reproduce the state of their error run: see tables.txt\n")
        }
    }
}

/// Table of the settings that hold in their run and fail in the extended one.
pub fn fail_later(records: &[Record]) -> DocTable {
    let head = ["scene", "solver", "budget", "µs/step", "within a minute"];
    let mut rows = DocTable::new("Settings that pass their run, and then fail", 3, &head);
    for record in each_setting(records) {
        if let Some(why) = record.fails_later() {
            let [solver, budget, time, ..] = setting(record);
            let names = [DocCell::scene(&record.scene), DocCell::solver(&solver)];
            let texts = [budget.into(), time.into(), DocCell::from(why).tone(Tone::Bad)];
            rows.row(names.into_iter().chain(texts));
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::VARIANTS;
    use crate::lab::report::table::PAGE_WIDTH;
    use crate::lab::scenes::holds::{Broken, Mark};
    use crate::lab::study::record::Later;
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
        // A build with narrower instructions emulates eight lanes and says so.
        let lanes = if is_emulated(8) { "@8 emulated" } else { "@8" };
        let expected = format!("stack:2 pgs 2 sub {lanes} 41.0 41.0 41.0 no other solver –");
        assert_eq!(line(&records), expected);
        let with = |time| [&records[..], &[other(time)]].concat();
        assert!(line(&with(61.5)).ends_with("soft_step 50 %"), "{}", line(&with(61.5)));
        assert!(line(&with(41.8)).ends_with(" soft_step tie"), "{}", line(&with(41.8)));
        assert!(line(&with(410.0)).ends_with(" 10.0×"), "{}", line(&with(410.0)));
    }

    #[test]
    fn a_scene_without_an_answer_says_why() {
        let over = page(&[record(1, 1, 20.0, 14e-3)]);
        assert!(
            over.contains(
                "stack:2: none is good enough; nearest is pgs, 1 sub @1, 20.0 µs: 1.40 × tolerance of"
            ),
            "{over}"
        );
        let text = page(&[failed(1), fell(8, 1, 1.0, 0.0)]);
        assert!(text.contains("stack:2: no setting holds\n"), "{text}");
        assert!(text.contains("2 settings: 0 hold, 0 are plausible"), "{text}");
    }

    #[test]
    fn the_recommendation_comes_first_and_names_nobody_who_leads_by_one_scene() {
        let on =
            |scene: &str, solver, time| Record { scene: scene.into(), solver, ..record(8, 1, time, 1e-3) };
        let steady = [
            on("x", "shim", 10.0),
            on("x", "soft_step", 15.0),
            on("y", "shim", 5.0),
            on("y", "soft_step", 9.0),
        ];
        let text = page(&steady);
        assert!(text.starts_with("Use shim: good enough on 2 of 2 scenes"), "{text}");
        assert!(text.contains("shim, the default, is number 1 of 2"), "{text}");
        let mut torn = steady.clone();
        torn[3] = on("y", "soft_step", 1.0);
        let text = page(&torn);
        assert!(
            text.starts_with("2 solvers are good enough on all scenes")
                && text.replace('\n', " ").contains("first is soft_step in 4 of 5, shim in 1"),
            "{text}"
        );
    }

    #[test]
    fn what_falls_later_stands_beside_the_winner_with_its_step() {
        let later = |mark: bool| {
            let broken = mark.then_some(Broken { mark: Mark::Fell, step: 800, body: None });
            Some(Later { steps: 3600, seconds: 60.0, broken, rest_speed_m_s: None })
        };
        let records = [
            Record { later: later(true), ..record(8, 1, 5.0, 1e-3) },
            Record { later: later(false), ..record(8, 2, 9.0, 1e-3) },
        ];
        let text = page(&records);
        let line = |part: &str| text.lines().any(|l| l.starts_with("stack:2") && l.contains(part));
        assert!(line("fell at step 800") && line("2 sub @8"), "{text}");
        assert_eq!(fail_later(&records).rows.len(), 1);
    }

    #[test]
    fn a_busy_machine_and_what_nobody_checked_are_said() {
        let mut records = vec![record(8, 1, 5.0, 1e-3)];
        records[0].sample.as_mut().unwrap().waited = 0.31;
        records[0].unchecked = vec!["what must hold".into()];
        let text = page(&records);
        assert!(
            text.contains("31 % of the time") && text.contains("NOT CHECKED: stack:2: what must hold"),
            "{text}"
        );
    }

    #[test]
    fn the_page_stays_a_page_and_says_what_did_not_run() {
        let of = |scene: &str, solver| Record { scene: scene.to_string(), solver, ..record(8, 1, 5.0, 1e-3) };
        let all = |solvers: &[&'static str]| -> Vec<Record> {
            (0..study::DEFAULT_SCENES.len())
                .flat_map(|i| solvers.iter().map(move |s| of(&format!("scene:{i}"), *s)))
                .collect()
        };
        let every: Vec<&'static str> = VARIANTS.iter().map(|v| v.name).collect();
        for solvers in [&study::DEFAULT_SOLVERS[..], &every] {
            let text = page(&all(solvers));
            // A study adds two lines: the list of files.
            assert!(text.lines().count() <= 66, "{text}");
            assert!(text.lines().all(|l| l.chars().count() <= PAGE_WIDTH), "{text}");
            let left_out = text.split_once("left out").map_or("", |(_, names)| names);
            for name in every.iter().filter(|name| !solvers.contains(name)) {
                assert!(left_out.split([',', ' ', '\n']).any(|word| word == *name), "{name}: {text}");
            }
        }
    }
}
