//! The answer of a study on one page: which solver to use and when, the drawbacks, the best setting on each
//! scene, which solvers fail, and what was left out.

use super::by_scene::verdict;
use super::doc::{self, DocBlock, DocCell, DocTable, Tone};
use super::environment::Environment;
use super::units::{count as number, digits, is_emulated, order as order_name};
use crate::engine::solvers::DEFAULT;
use crate::engine::world::Order;
use crate::lab::scenes::kind::SceneKind;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::answer::{Answer, each_setting, fails_last, order};
use crate::lab::study::compare::{Ratio, TIE};
use crate::lab::study::curve::{ErrorAxis, distinct, solvers_of};
use crate::lab::study::ranking::{Ranking, Standing, ranking};
use crate::lab::study::sample::BUSY;
use crate::lab::study::{self, Record};

const MOST_RANKED: usize = 8;
const MOST_NOTES: usize = 7;

/// More scenes that are not in the catalog share a sentence.
const MOST_OWN: usize = 3;

/// A study of scenes of at least so many kinds says which kinds it lacks.
const BROAD: usize = 3;

/// Description of the columns of the answer.
const LEGEND: &str = "\
Good enough: the scene holds, stands for a minute if it has to rest, and its errors are within the tolerances of the scene \
(`simpulse list SCENE`). Overlap: what the solver left at 99 % of contact points, and the largest at rest (1 cm for bodies of \
1 m). Force error: how far contact impulses are from the contact law (no pull, no push across a gap, Coulomb friction), root \
mean square, in % of the weight of the lighter body (10 %). Reference: distance to the known value. Rest: speed at rest. 10 × \
and 100 × tighter: within 10 % and 1 % of the tolerances. A setting is substeps × sweeps in each. µs/step: mean over the run, \
and its longest step. next: the cheapest setting of another solver, and how much slower it is; tie: too close to call.";

/// The answer of a study as text, from its records alone; `steps` if runs were limited to that many steps.
pub fn text(records: &[Record], environment: &Environment, steps: Option<u32>) -> String {
    doc::text(&blocks(records, environment, steps)) + &doc::lines(&left_out(records)) + &differing(records)
}

/// The answer of a study.
pub fn blocks(records: &[Record], environment: &Environment, steps: Option<u32>) -> Vec<DocBlock> {
    let scenes: Vec<Answer> = records.chunk_by(|a, b| a.scene == b.scene).filter_map(Answer::of).collect();
    let ranking = ranking(records);
    let (cheapest, unsolved) = cheapest(&scenes, records, "FILE.json");
    let plain = |text: String| DocBlock::Text(Tone::Plain, text);
    vec![
        DocBlock::Text(Tone::Lead, recommendation(&ranking, scenes.len(), steps)),
        DocBlock::Points(by_kind(records)),
        DocBlock::Text(Tone::Bad, warnings(records, steps)),
        DocBlock::Table(cheapest),
        plain(unsolved),
        DocBlock::Table(DocTable { most: MOST_NOTES, ..fail_later(records) }),
        plain(poked(records)),
        DocBlock::Table(accuracies(&scenes, records)),
        DocBlock::Table(standings(&ranking, scenes.len())),
        DocBlock::Text(Tone::Soft, LEGEND.to_string()),
        DocBlock::Text(Tone::Soft, head(records, environment, scenes.len())),
    ]
}

/// Mean speed of a solver relative to each scene's fastest, over those of `scenes` on which it is good enough.
fn speed(standing: &Standing, scenes: usize) -> String {
    format!("{:.0} %", 100.0 * standing.score * scenes as f64 / standing.good[0].max(1) as f64)
}

/// The solver that is good enough on most scenes; of several, the fastest.
fn widest(ranking: &Ranking) -> Option<&Standing> {
    let most = ranking.standings.iter().map(|s| s.good[0]).max().filter(|most| *most > 0)?;
    // The standings are sorted by score.
    ranking.standings.iter().find(|s| s.good[0] == most)
}

/// One solver for all scenes, and whether the default is another one.
fn recommendation(ranking: &Ranking, scenes: usize, steps: Option<u32>) -> String {
    let mut text =
        steps.map_or(String::new(), |n| format!("Not a recommendation: runs end after {n} steps.  "));
    let Some(first) = widest(ranking) else {
        return text + "No setting is good enough on any scene.\n";
    };
    let equal: Vec<&Standing> = ranking.standings.iter().filter(|s| s.good[0] == first.good[0]).collect();
    let on = match first.good[0] == scenes {
        true if scenes == 1 => "the scene".to_string(),
        true => format!("all {scenes} scenes"),
        false => format!("{} of {scenes} scenes", first.good[0]),
    };
    let rate = format!("{} of the speed of each scene's fastest", speed(first, scenes));
    text += &match (first.good[0] == scenes, &equal[..]) {
        (true, [_]) => format!("Use {}: it alone is good enough on {on}, at {rate}.", first.solver),
        (true, _) => format!("Use {}: good enough on {on}, at {rate}.", first.solver),
        (false, _) => format!(
            "No solver is good enough on all {scenes} scenes: choose by kind. {} is on {on}, at {rate}.",
            first.solver
        ),
    };
    if ranking.leader().is_some_and(|leader| leader.solver == first.solver) {
        text += " No other is faster with any one scene or class of scenes left out, or with half or twice the tolerances.";
    }
    if let Some(own) = ranking.standings.iter().find(|s| s.solver == DEFAULT && s.solver != first.solver) {
        text += &format!(" {DEFAULT}, the default, is on {}.", own.good[0]);
    }
    text + "\n"
}

/// A sentence for each kind of scene, with the name of the kind; a few scenes that are not in the catalog have their own.
fn by_kind(records: &[Record]) -> Vec<[String; 2]> {
    let of_kind = |kind: SceneKind| -> Vec<Record> {
        records.iter().filter(|r| SceneKind::of(&r.scene) == Some(kind)).cloned().collect()
    };
    let kinds = SceneKind::ALL.map(|kind| (kind, of_kind(kind)));
    let broad = kinds.iter().filter(|(_, own)| !own.is_empty()).count() >= BROAD;
    let mut points = Vec::new();
    for (kind, own) in kinds {
        let name = kind.words();
        let scenes = own.chunk_by(|a, b| a.scene == b.scene).count();
        match scenes {
            0 if broad => points.push([
                capital(name),
                format!("not in this study; `simpulse study --scenes {}` compares solvers.", kind.examples()),
            ]),
            0 => {}
            _ => {
                points.push([format!("{}, {}", capital(name), number(scenes, "scene")), kind_sentence(&own)])
            }
        }
    }
    let others: Vec<Record> = records.iter().filter(|r| SceneKind::of(&r.scene).is_none()).cloned().collect();
    let scenes: Vec<&[Record]> = others.chunk_by(|a, b| a.scene == b.scene).collect();
    match scenes.len() {
        few if few <= MOST_OWN => {
            points.extend(scenes.iter().map(|own| [own[0].scene.clone(), kind_sentence(own)]))
        }
        many => points.push([format!("Other scenes, {many}"), kind_sentence(&others)]),
    }
    points
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Which solver to use on scenes of a kind, what is faster or the next, and what fails on all of them.
fn kind_sentence(records: &[Record]) -> String {
    let ranking = ranking(records);
    let scenes = records.chunk_by(|a, b| a.scene == b.scene).count();
    let Some(first) = widest(&ranking) else { return "no solver is good enough.".to_string() };
    let mut text = match scenes {
        1 => format!("{}, ", first.solver),
        _ if first.fails_on.is_empty() => format!("{}, good enough on all, ", first.solver),
        _ => format!("{}, good enough except on {}, ", first.solver, short_list(&first.fails_on, 3)),
    };
    text += &match first.score > (1.0 - TIE) * first.good[0] as f64 / scenes as f64 {
        true => "the fastest there".to_string(),
        false => format!("at {} of the speed of each scene's fastest", speed(first, scenes)),
    };
    let others = || ranking.standings.iter().filter(|s| s.solver != first.solver && s.score > 0.0);
    if let Some(faster) = others().find(|s| s.score > first.score * (1.0 + TIE)) {
        let not_on = short_list(&faster.fails_on, 3);
        text += &format!(
            "; {} is faster ({}), but not good enough on {not_on}",
            faster.solver,
            speed(faster, scenes)
        );
    } else if let Some(next) = others().find(|s| s.good[0] == first.good[0]) {
        text += &format!("; next is {} at {}", next.solver, speed(next, scenes));
    }
    let never: Vec<&str> = ranking.standings.iter().filter(|s| s.good[0] == 0).map(|s| s.solver).collect();
    if !never.is_empty() {
        text += &format!("; good enough on none: {}", short_list(&never, 4));
    }
    text + "."
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
    if waited >= BUSY {
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
        Order::ALL.into_iter().filter(ran).map(|order| format!("{} order", order_name(order))).collect();
    let mut widths = distinct(records.iter().filter(|r| r.order == Order::Colored).map(|r| r.lanes));
    widths.sort_unstable();
    if let (Some(last), Some(widest)) = (ways.last_mut(), widths.last()) {
        let list: Vec<String> = widths.iter().map(usize::to_string).collect();
        let emulated = if is_emulated(*widest) { " (emulated above the native width)" } else { "" };
        *last += &format!(" at {} lane{}{emulated}", list.join(", "), if widths == [1] { "" } else { "s" });
    }
    let holding = records.iter().filter(|r| r.holds()).count();
    let [good, tighter, tightest] = Accuracy::ALL.map(|a| records.iter().filter(|r| r.is_good(a)).count());
    let rounds = records.iter().filter_map(|r| Some(r.sample.as_ref()?.rounds)).max().unwrap_or(0);
    format!(
        "{}, {}; {}; {} common to all settings\n\
         {} settings: {holding} hold, {good} are good enough, {tighter} also 10 × tighter, {tightest} 100 × tighter · {}; {}: {} lanes per instruction\n",
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

/// A table with the cheapest setting of each scene or, where none is good enough, the nearest one and what it misses;
/// and lines on scenes where nothing holds. `file` is the path of a scene that is not in the catalog.
pub fn cheapest(scenes: &[Answer], records: &[Record], file: &str) -> (DocTable, String) {
    let head = ["scene", "solver", "setting", "µs/step", "longest", "next", "slower"];
    let mut rows = DocTable::new("The cheapest setting that is good enough", 3, &head);
    let mut notes = String::new();
    for answer in scenes {
        let scene = DocCell::scene(answer.scene);
        match (answer.best(), answer.nearest) {
            (Some(best), _) => {
                let [solver, others @ ..] = setting(best);
                let mut cells = vec![scene, DocCell::solver(&solver)];
                cells.extend(others.map(DocCell::from));
                cells.extend(runner_up(answer, best).map(DocCell::from));
                rows.row(cells);
            }
            (None, Some(nearest)) => {
                let [solver, words, times @ ..] = setting(nearest);
                let why = format!("nearest is {solver}, {words}: {}", verdict(nearest));
                let mut cells = vec![scene, DocCell::from("none").tone(Tone::Bad), why.into()];
                cells.extend(times.map(DocCell::from));
                cells.extend(["–", "–"].map(DocCell::from));
                rows.row(cells);
            }
            (None, None) => {
                notes += &format!("{}: no setting holds\n", answer.scene);
                if let Some(last) = fails_last(records.iter().filter(|r| r.scene == answer.scene)) {
                    let is_known = SceneKind::of(answer.scene).is_some();
                    notes += &format!(
                        "  longest is {}, {}: {}; to see it: {}\n",
                        last.solver,
                        last.setting_text(),
                        last.why_failed().unwrap_or_default(),
                        last.command_to_see(if is_known { answer.scene } else { file })
                    );
                }
            }
        }
    }
    (rows, notes)
}

/// Solver, setting, mean and longest step.
fn setting(record: &Record) -> [String; 4] {
    let time = |ns: fn(&crate::lab::study::sample::Sample) -> f64| {
        record.sample.as_ref().map_or("–".to_string(), |sample| digits(ns(sample) / 1e3))
    };
    [
        record.solver.to_string(),
        record.setting_text(),
        time(|sample| sample.mean_ns),
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

/// Errors of the cheapest setting that is good enough (% of their tolerances), and the cheapest settings at the
/// stricter levels.
fn accuracies(scenes: &[Answer], records: &[Record]) -> DocTable {
    let caption = "Its errors in % of the tolerances, and the cheapest settings within stricter ones";
    let head =
        ["scene", "overlap", "force error", "reference", "rest", "10 × tighter", "µs", "100 × tighter", "µs"];
    let mut rows = DocTable { page_only: true, ..DocTable::new(caption, 1, &head) };
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
                    format!("{}, {}", best.solver, best.setting_text()),
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
    let caption = format!(
        "Ranking over all {scenes} scenes: on how many a solver is good enough, on which it is not, and on how many it is the fastest or \
         ties. score: time of the fastest solver ÷ time of this one, each at its cheapest setting that is good enough, averaged \
         over scenes (0 where none is); range: with any scene or class left out, and with half or twice the tolerances; first: in \
         how many of these {} variations",
        ranking.first.variations
    );
    let [good, tighter, tightest] = Accuracy::ALL.map(Accuracy::word);
    let head = ["solver", good, tighter, tightest, "not on", "fastest", "score", "range", "first"];
    let mut rows = DocTable { most: MOST_RANKED, ..DocTable::new(caption, 1, &head) };
    for own in &ranking.standings {
        let fails = if own.fails_on.is_empty() { "–".into() } else { short_list(&own.fails_on, 2) };
        let first = ranking.first.solvers.iter().find(|(name, _)| *name == own.solver).map_or(0, |(_, n)| *n);
        let [low, high] = own.range;
        let mut cells = vec![DocCell::solver(own.solver)];
        cells.extend(own.good.map(|n| n.to_string().into()));
        cells.push(DocCell { title: own.fails_on.join(", "), ..fails.into() });
        let score = [format!("{:.2}", own.score), format!("{low:.2}–{high:.2}"), first.to_string()];
        cells.extend([own.fastest.to_string()].into_iter().chain(score).map(DocCell::from));
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

/// Which advised settings survive random pushes; empty if none were given.
fn poked(records: &[Record]) -> String {
    let pushed: Vec<&Record> = each_setting(records.iter().filter(|r| r.poked.is_some()));
    let fail = |r: &&Record| {
        Some(format!("  {} under {}, {}: {}\n", r.scene, r.solver, r.setting_text(), r.fails_poked()?))
    };
    let failed: Vec<String> = pushed.iter().filter_map(fail).collect();
    match pushed.len() {
        0 => String::new(),
        all => format!(
            "Pushed at random for half a minute, {} of {all} survive (the cheapest good setting of each solver on scenes that \
             must rest){}\n{}",
            all - failed.len(),
            if failed.is_empty() { "." } else { ". Not:" },
            failed.concat()
        ),
    }
}

/// Table of the settings that hold in their run and fail in the extended one.
pub fn fail_later(records: &[Record]) -> DocTable {
    let head = ["scene", "solver", "setting", "µs/step", "within a minute"];
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
        let lanes = if is_emulated(8) { "8 lanes, emulated" } else { "8 lanes" };
        let expected = format!("stack:2 pgs 2 substeps, {lanes} 41.0 41.0 no other solver –");
        assert_eq!(line(&records), expected);
        let with = |time| [&records[..], &[other(time)]].concat();
        assert!(line(&with(61.5)).ends_with("soft_step 50 %"), "{}", line(&with(61.5)));
        assert!(line(&with(41.8)).ends_with(" soft_step tie"), "{}", line(&with(41.8)));
        assert!(line(&with(410.0)).ends_with(" 10.0×"), "{}", line(&with(410.0)));
    }

    #[test]
    fn a_scene_without_an_answer_says_why() {
        let over = page(&[record(1, 1, 20.0, 14e-3)]);
        let words = over.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            words.contains("stack:2 none nearest is pgs, 1 substeps, 1 lane: 1.40 × tolerance of"),
            "{over}"
        );
        let text = page(&[failed(1), fell(8, 1, 1.0, 0.0)]);
        assert!(text.contains("stack:2: no setting holds\n"), "{text}");
        assert!(text.contains("2 settings: 0 hold, 0 are good enough"), "{text}");
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
        assert!(text.starts_with("Use shim: good enough on all 2 scenes, at 100 % of the speed"), "{text}");
        assert!(text.contains("No other is faster with any one"), "{text}");
        let mut torn = steady.clone();
        torn[3] = on("y", "soft_step", 1.0);
        let text = page(&torn);
        let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            words.starts_with("Use soft_step: good enough on all 2 scenes, at 83 % of the speed"),
            "{text}"
        );
        assert!(
            words.contains("shim, the default, is on 2.") && !text.contains("No other is faster"),
            "{text}"
        );
        assert!(words.contains("x: shim, the fastest there; next is soft_step at 67 %."), "{text}");
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
        assert!(line("fell at step 800") && line("2 substeps, 8 lanes"), "{text}");
        assert_eq!(fail_later(&records).rows.len(), 1);
    }

    #[test]
    fn what_does_not_survive_a_player_is_named() {
        let poked = |mark: bool| {
            let broken = mark.then_some(Broken { mark: Mark::Fell, step: 70, body: None });
            Some(Later { steps: 3600, seconds: 60.0, broken, rest_speed_m_s: None })
        };
        let records = [
            Record { poked: poked(true), ..record(8, 1, 5.0, 1e-3) },
            Record { poked: poked(false), solver: "shim", ..record(8, 1, 5.0, 1e-3) },
            record(8, 2, 9.0, 1e-3),
        ];
        let text = page(&records);
        assert!(
            text.contains("1 of 2 survive") && text.contains("pgs, 1 substeps, 8 lanes: fell at step 70"),
            "{text}"
        );
        assert!(!page(&records[2..]).contains("survive"));
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
