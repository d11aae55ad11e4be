//! The tables of one scene, of performance profiles and of treatments of contacts.

use super::doc::{DocCell, DocTable, Tone};
use super::units::{bodies, digits, is_emulated, lanes_or_order, order, percent, ratio, si};
use crate::engine::world::Order;
use crate::lab::metrics::Errors;
use crate::lab::scenes::kind::SceneKind;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::curve::{ErrorAxis, distinct, solvers_of};
use crate::lab::study::profile::Profile;
use crate::lab::study::sample::Sample;
use crate::lab::study::{Record, answer};

/// Description of the columns of [`scene_table`], printed once per study.
pub const LEGEND: &str = "\
setting: substeps × the velocity, relax and position sweeps in each.
lanes: file order means one contact after the other; a number means parallel order (colors of contacts) in so many lanes.
The errors are the same for all lane widths of a budget.
µs/step: mean over the run, its median and its longest step, ± median deviation of a repeat.  ns/contact: mean step ÷ mean
number of contacts.  ns/row: time of a sweep per constraint row.
speed-up: over 1 lane.
overlap: as judged (what the solver left at 99 % of contact points, and the largest at rest), and largest.
force error: how far contact impulses are from the contact law (no pull, no push across a gap, Coulomb friction), root
mean square, in % of the weight of the lighter body, and of the mean weight of a body.
energy, momentum: relative change.  rest speed: rms over the last second.
reference: distance to the scene's reference value; missed if the run never reached it, – if none is known.
sweeps: per step.  colors: of contacts.  occupancy: share of lanes that hold a contact.
verdict: good enough, or what exceeds its tolerance most, or what happened.
";

/// A line about the scene of these records.
pub fn scene_line(records: &[Record]) -> String {
    let Some(first) = records.first() else { return String::new() };
    let mut text = format!("{} · dt {}", bodies(first.bodies), si(first.dt, "s"));
    if let Some(steps) = records.iter().find_map(|r| Some(r.errors?.steps)) {
        text += &format!(" · {steps} steps");
    }
    if let Some(truth) = records.iter().find_map(|r| r.truth) {
        text += &format!(" · reference value: {} = {}", truth.quantity, si(truth.expected, truth.unit));
    }
    text
}

/// A column of the table of a scene: its heading, and the cell of a record; empty where it has no value.
type TableColumn = (&'static str, fn(&Record) -> String);

const COLUMNS: [TableColumn; 21] = [
    ("setting", |r| r.budget_text.clone()),
    ("lanes", lanes),
    ("µs/step", |r| timed(r, |s| digits(s.mean_ns / 1e3))),
    ("median", |r| timed(r, |s| digits(s.median_ns / 1e3))),
    ("longest", |r| timed(r, |s| digits(s.worst_ns / 1e3))),
    ("±", |r| timed(r, |s| digits(s.spread_ns / 1e3))),
    ("ns/contact", |r| {
        timed(r, |s| if s.load.contacts > 0.0 { digits(s.mean_ns / s.load.contacts) } else { String::new() })
    }),
    ("ns/row", |r| timed(r, |s| digits(s.row_sweep_ns))),
    ("speed-up", |r| r.speed_up.map_or(String::new(), digits)),
    ("overlap\njudged", |r| measured(r, |e| si(e.penetration(r.tolerances.rest.is_some()), "m"))),
    ("\nmax", |r| measured(r, |e| si(e.penetration_max(), "m"))),
    ("force error\nlighter", |r| measured(r, |e| percent(e.law_rms_lighter()))),
    ("\nmean", |r| measured(r, |e| percent(e.law_rms_body()))),
    ("energy", |r| measured(r, |e| ratio(e.get("energy_change").unwrap_or_default()))),
    ("momentum", |r| measured(r, |e| ratio(e.get("momentum").unwrap_or_default()))),
    ("rest speed", |r| measured(r, |e| si(e.rest_velocity(), "m/s"))),
    ("reference", |r| r.truth.map_or(String::new(), |t| t.error.map_or("missed".into(), |e| si(e, t.unit)))),
    ("sweeps", |r| timed(r, |s| format!("{:.0}", s.load.sweeps))),
    ("colors", |r| timed(r, |s| s.load.colors.to_string())),
    ("occupancy", |r| timed(r, |s| format!("{:.0} %", 100.0 * s.load.occupancy))),
    ("verdict", verdict),
];

fn timed(record: &Record, show: impl Fn(&Sample) -> String) -> String {
    record.sample.as_ref().map_or(String::new(), show)
}

fn measured(record: &Record, show: impl Fn(&Errors) -> String) -> String {
    record.errors.as_ref().map_or(String::new(), show)
}

/// The columns of a brief table.
const BRIEF: [&str; 10] = [
    "setting",
    "lanes",
    "µs/step",
    "longest",
    "±",
    "ns/contact",
    "overlap\njudged",
    "force error\nlighter",
    "reference",
    "verdict",
];

/// The records of a scene in the order of its table: in a sweep, by solver and swept value.
pub fn in_order(records: &[Record]) -> Vec<&Record> {
    let mut lines: Vec<&Record> = records.iter().collect();
    if lines.iter().any(|r| r.swept.is_some()) {
        let value = |r: &Record| r.swept.map_or(0.0, |s| s.value);
        let place = |r: &Record| records.iter().position(|other| other.solver == r.solver);
        lines.sort_by(|a, b| place(a).cmp(&place(b)).then(value(a).total_cmp(&value(b))));
    }
    lines
}

/// Table of the records of one scene, and notes on those that failed.
pub fn scene_table(records: &[Record]) -> (DocTable, String) {
    let lines = in_order(records);
    let mut notes = String::new();
    let mut previous: Option<&Record> = None;
    for &record in &lines {
        let name = format!("{}, {}", record.solver, record.setting_text());
        let key = |r: &Record| (r.solver, r.budget_text.clone(), r.order);
        let same_order = previous.is_some_and(|p| key(p) == key(record));
        if let (Some(failure), false) = (record.failure, same_order) {
            notes += &format!("  failed: {name}: {failure}\n");
        }
        if record.bits_equal == Some(false) {
            notes += &format!("  state differs from the error run: {name}\n");
        }
        previous = Some(record);
    }
    let caption = records.first().map_or(String::new(), |r| format!("{} · {}", r.scene, scene_line(records)));
    (DocTable { caption, wide: true, ..table_of(&lines, |_| true) }, notes)
}

/// Table of these records with the most important columns.
pub fn brief_table(lines: &[&Record]) -> DocTable {
    table_of(lines, |name| BRIEF.contains(&name))
}

/// Table of these records with the columns of these names. In a sweep, the swept value has a column.
fn table_of(lines: &[&Record], keep: impl Fn(&str) -> bool) -> DocTable {
    let swept = lines.iter().find_map(|r| r.swept).map(|s| match s.unit {
        "" => s.name.to_string(),
        unit => format!("{} ({unit})", s.name),
    });
    let columns: Vec<TableColumn> = COLUMNS.into_iter().filter(|(name, _)| keep(name)).collect();
    let names = columns.iter().map(|(name, _)| *name);
    let head: Vec<&str> = std::iter::once("solver").chain(swept.as_deref()).chain(names).collect();
    let mut rows = DocTable::new("", 2, &head);
    for record in lines {
        let value = record.swept.map(|s| s.value.to_string());
        let texts = value.into_iter().chain(columns.iter().map(|(_, of)| of(record)));
        let cells = texts.map(|text| if text.is_empty() { "–".into() } else { DocCell::from(text) });
        let mut cells: Vec<DocCell> = std::iter::once(DocCell::solver(record.solver)).chain(cells).collect();
        if let Some(last) = cells.last_mut() {
            last.tone = match (record.excess() <= 1.0, record.holds()) {
                (true, _) => Tone::Good,
                (_, true) => Tone::Plain,
                (_, false) => Tone::Bad,
            };
        }
        rows.row(cells);
    }
    rows
}

fn lanes(record: &Record) -> String {
    match record.order {
        Order::Colored if is_emulated(record.lanes) => format!("{} emulated", record.lanes),
        Order::Colored => record.lanes.to_string(),
        serial => lanes_or_order(serial, 1),
    }
}

/// The cheapest good setting of every solver on every scene or, if it has none, its nearest one or a failure.
pub fn every_solver(records: &[Record]) -> DocTable {
    let head = [
        "kind",
        "scene",
        "solver",
        "setting",
        "µs/step",
        "× fastest",
        "overlap",
        "force error",
        "reference",
        "verdict",
    ];
    let mut rows = DocTable { class: "filtered", ..DocTable::new("Every solver on every scene", 4, &head) };
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        let least =
            scene.iter().filter(|r| r.excess() <= 1.0).map(Record::cost_ns).fold(f64::INFINITY, f64::min);
        for solver in solvers_of(scene) {
            let own: Vec<Record> = scene.iter().filter(|r| r.solver == solver).cloned().collect();
            let Some(answer) = answer::Answer::of(&own) else { continue };
            let Some(record) = answer.best().or(answer.nearest).or(answer::fails_last(&own)) else {
                continue;
            };
            let good = answer.best().is_some();
            let slower = if good { format!("{}×", digits(record.cost_ns() / least)) } else { String::new() };
            let cells = [
                SceneKind::of(&record.scene).map_or("", SceneKind::words).into(),
                DocCell::scene(&record.scene),
                DocCell::solver(solver),
                record.setting_text().into(),
                timed(record, |s| digits(s.mean_ns / 1e3)).into(),
                slower.into(),
                measured(record, |e| si(e.penetration(record.tolerances.rest.is_some()), "m")).into(),
                measured(record, |e| percent(e.law_rms_lighter())).into(),
                record
                    .truth
                    .map_or(String::new(), |t| t.error.map_or("missed".into(), |e| si(e, t.unit)))
                    .into(),
                DocCell::from(verdict(record)).tone(if good { Tone::Good } else { Tone::Bad }),
            ];
            rows.row(cells.map(|cell| match cell.text.as_str() {
                "" => DocCell::from("–"),
                _ => cell,
            }));
        }
    }
    rows
}

/// `good enough`, the failure, or what exceeds its tolerance most, and by how much.
pub fn verdict(record: &Record) -> String {
    if let (Some(mark), Some(step)) = (record.mark(), record.failed_step()) {
        return format!("{} at step {step}", mark.word());
    }
    let over = |axis: &ErrorAxis| record.in_tolerance(*axis).unwrap_or(0.0);
    let most = ErrorAxis::JUDGED.into_iter().max_by(|a, b| over(a).total_cmp(&over(b)));
    match record.excess() {
        x if x <= 1.0 => "good enough".to_string(),
        x => record.fails_later().unwrap_or_else(|| match most {
            Some(axis) if x.is_finite() => format!("{} × tolerance of {}", digits(x), axis.word()),
            _ if record.is_unsolved() => "too many points for its method".to_string(),
            _ => "missed its reference".to_string(),
        }),
    }
}

/// Factors of the table of profiles. The last column is the share of scenes that the solver solves at all.
const FACTORS: [f64; 4] = [1.0, 1.5, 4.0, f64::INFINITY];

/// The performance profiles of the errors that are known.
pub fn profiles(records: &[Record]) -> Vec<Profile> {
    ErrorAxis::ALL.into_iter().map(|axis| Profile::of(records, axis)).filter(|p| p.scenes > 0).collect()
}

/// The profiles as a table: shares of scenes, a line per solver and error.
pub fn profile_table(records: &[Record]) -> DocTable {
    const CAPTION: &str = "\
Performance profiles: share of scenes that each solver solves within a factor of the fastest; scenes: how many of them at \
least one solver solves";
    let head =
        ["solved if", "scenes", "solver", "fastest or tied", "within 1.5×", "within 4×", "in any time"];
    let mut rows = DocTable { wide: true, ..DocTable::new(CAPTION, 3, &head) };
    for profile in &profiles(records) {
        for (i, (solver, _)) in profile.ratios.iter().enumerate() {
            let solved = format!("{} in tolerance", profile.axis.name());
            let scenes = format!("{} of {}", profile.solvable, profile.scenes);
            let shares = FACTORS.map(|factor| format!("{:.0} %", 100.0 * profile.share(i, factor)).into());
            rows.row([solved.into(), scenes.into(), DocCell::solver(solver)].into_iter().chain(shares));
        }
    }
    rows
}

/// What treatments of contacts gain and cost each solver: a table for each that took several values.
pub fn treatment_tables(records: &[Record]) -> Vec<DocTable> {
    let impacts = treatments("impacts", records, |r| r.impacts.name().to_string());
    impacts.into_iter().chain(chosen_tables(records)).collect()
}

/// Those that take several values only if somebody asks for it: frozen contacts, and orders besides file and parallel.
pub fn chosen_tables(records: &[Record]) -> Vec<DocTable> {
    let frozen = treatments("frozen contacts", records, |r| r.frozen.to_string().replace("off", "fresh"));
    let others = records.iter().any(|r| matches!(r.order, Order::Reversed | Order::Shuffled));
    let orders = treatments("orders of contacts", records, |r| order(r.order).to_string());
    frozen.into_iter().chain(orders.filter(|_| others)).collect()
}

/// Such a table; a line per solver and value. Scenes on which a solver ran with one value only are left out.
fn treatments(name: &str, records: &[Record], of: impl Fn(&Record) -> String) -> Option<DocTable> {
    let caption = format!(
        "What {name} gain and cost: settings that hold in their run; numbers of scenes on which a setting of the solver holds, is \
         good enough and 10 × tighter; time of its cheapest good setting over that of its first line, geometric mean; scenes that \
         are better (+) or worse (−) than in its first line"
    );
    let head = ["solver", name, "settings", "holds", "good enough", "10 × tighter", "time", "+", "−"];
    let mut rows = DocTable { wide: true, ..DocTable::new(caption, 2, &head) };
    for solver in solvers_of(records) {
        let values_of = |records: &[Record]| distinct(records.iter().filter(|r| r.solver == solver).map(&of));
        let scenes: Vec<&[Record]> =
            records.chunk_by(|a, b| a.scene == b.scene).filter(|scene| values_of(scene).len() > 1).collect();
        let values = values_of(records);
        let is_own = |r: &Record, value: &String| r.solver == solver && of(r) == *value;
        let level = |scene: &[Record], value: &String| {
            let good = |r: &Record| [Accuracy::Plausible, Accuracy::Tight].map(|a| usize::from(r.is_good(a)));
            let level = |r: &Record| usize::from(r.holds()) + good(r).into_iter().sum::<usize>();
            scene.iter().filter(|r| is_own(r, value)).map(level).max().unwrap_or(0)
        };
        for value in values.iter().filter(|_| !scenes.is_empty()) {
            let levels: Vec<[usize; 2]> =
                scenes.iter().map(|s| [value, &values[0]].map(|v| level(s, v))).collect();
            let count = |least: usize| {
                format!("{} of {}", levels.iter().filter(|l| l[0] >= least).count(), scenes.len())
            };
            let names = |better: bool| {
                let chosen = scenes.iter().zip(&levels).filter(|(_, [a, b])| a != b && (a > b) == better);
                chosen.map(|(s, _)| s[0].scene.as_str()).collect::<Vec<_>>().join(", ")
            };
            let time = |scene: &[Record], value: &String| {
                let good = scene.iter().filter(|r| is_own(r, value) && r.is_good(Accuracy::Plausible));
                good.map(Record::cost_ns).fold(f64::INFINITY, f64::min)
            };
            let logs = scenes.iter().map(|s| (time(s, value) / time(s, &values[0])).ln());
            let logs: Vec<f64> = logs.filter(|log| log.is_finite()).collect();
            let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
            let mean = if mean.is_finite() { format!("{mean:.2}") } else { "–".into() };
            let own = scenes.iter().flat_map(|s| answer::each_setting(s.iter().filter(|r| is_own(r, value))));
            let (held, ran) = own.fold((0, 0), |(held, ran), r| (held + usize::from(r.holds()), ran + 1));
            let settings = format!("{held} of {ran}");
            let cells =
                [value.clone(), settings, count(1), count(2), count(3), mean, names(true), names(false)];
            rows.row(std::iter::once(DocCell::solver(solver)).chain(cells.map(DocCell::from)));
        }
    }
    (!rows.rows.is_empty()).then_some(rows)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::narrowphase::frozen::Freezing;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn every_line_stands_alone_and_failures_below() {
        let mut wrong = record(8, 1, 10.0, 1.234e-3);
        wrong.bits_equal = Some(false);
        let (rows, notes) =
            scene_table(&[record(1, 1, 20.0, 1.234e-3), wrong, failed(1), fell(8, 3, 5.0, 0.1)]);
        let text = rows.text() + &notes;
        assert!(text.contains(" fell at step 100") && text.contains(" good enough"), "{text}");
        assert_eq!(text.matches("1.23 mm").count(), 4, "{text}");
        assert_eq!(text.matches(" blew up at step 7").count(), 1, "{text}");
        assert!(
            text.contains("failed: pgs, 9 substeps, 1 lane: diverged at step 7: body 2 has no finite speed")
        );
        assert!(text.contains("state differs from the error run: pgs, 1 substeps, 8 lanes"));
        // No cell is empty.
        let columns = |line: &str| line.split("  ").filter(|cell| !cell.trim().is_empty()).count();
        let lines: Vec<usize> = text.lines().skip(3).take(4).map(columns).collect();
        assert_eq!(lines, [22; 4], "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 220), "{text}");
        assert!(scene_table(&[]).0.rows.is_empty());
    }

    #[test]
    fn orders_are_compared_if_others_than_file_and_parallel_ran() {
        let in_order = |order: Order, own: Record| Record { order, ..own };
        let mut records = vec![
            in_order(Order::Natural, record(1, 1, 9.0, 2e-3)),
            in_order(Order::Natural, record(1, 2, 9.0, 1e-3)),
            in_order(Order::Reversed, fell(1, 1, 9.0, 2e-3)),
            in_order(Order::Reversed, record(1, 2, 18.0, 4e-3)),
            record(4, 1, 9.0, 3e-3),
            record(8, 1, 9.0, 3e-3),
        ];
        let text = chosen_tables(&records)[0].text();
        for line in
            ["file 2 of 2 1 of 1 1 of 1", "reversed 1 of 2 1 of 1 1 of 1 0 of 1 2.00", "parallel 1 of 1"]
        {
            let words = |l: &str| l.split_whitespace().collect::<Vec<_>>().join(" ");
            assert!(text.lines().any(|l| words(l).contains(line)), "{line}: {text}");
        }
        records.retain(|r| r.order != Order::Reversed);
        assert!(chosen_tables(&records).is_empty());
    }

    #[test]
    fn frozen_contacts_gain_scenes_and_cost_time() {
        let on = |scene: &str, frozen, record: Record| Record { scene: scene.into(), frozen, ..record };
        let records = [
            on("x", Freezing::Off, fell(8, 1, 1.0, 0.0)),
            on("x", Freezing::Own, record(8, 1, 1.0, 9e-3)),
            on("y", Freezing::Off, record(8, 1, 10.0, 1e-4)),
            on("y", Freezing::Own, record(8, 1, 15.0, 1e-4)),
            // With one treatment only.
            on("z", Freezing::Off, record(8, 1, 10.0, 1e-4)),
        ];
        let tables = treatment_tables(&records);
        assert_eq!(tables.len(), 1);
        let text = tables[0].text();
        let line = |start: &str| {
            text.lines().find(|l| l.contains(start)).unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
        };
        assert_eq!(line(" fresh"), "pgs fresh 1 of 2 1 of 2 1 of 2 1 of 2 1.00");
        assert_eq!(line(" own"), "pgs own 2 of 2 2 of 2 2 of 2 1 of 2 1.50 x");
        assert!(treatment_tables(&records[..1]).is_empty());
    }

    #[test]
    fn the_profile_counts_scenes() {
        let soft = |substeps, time, error| Record { solver: "soft_step", ..record(8, substeps, time, error) };
        let records =
            [record(8, 1, 10.0, 0.1), record(8, 2, 20.0, 0.001), soft(1, 10.1, 0.1), soft(2, 20.2, 0.001)];
        let text = profile_table(&records).text();
        assert!(text.contains("overlap in tolerance") && text.contains("1 of 1"), "{text}");
        assert_eq!(text.matches("100 %").count(), 16, "{text}");
        assert!(profile_table(&[]).rows.is_empty());
    }
}
