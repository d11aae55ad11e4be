//! The tables of one scene, of performance profiles and of the order of contacts.

use super::doc::{DocCell, DocTable, Tone};
use super::units::{bodies, digits, is_emulated, ratio, si};
use crate::engine::world::Order;
use crate::lab::metrics::Errors;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::curve::{ErrorAxis, distinct, solvers_of};
use crate::lab::study::profile::Profile;
use crate::lab::study::{Fronts, Record, TruthError, answer};

/// Description of the columns of [`scene_table`], printed once per study.
pub const LEGEND: &str = "\
budget: substeps; then velocity (vel), relaxation (rel) and position (pos) sweeps per substep.
lanes: natural means one contact after the other in natural order; a number means colored order in so many lanes.
The errors are the same for all lane widths of a budget.
µs/step: mean over the run, its median and its longest step, ± median deviation of a repeat.  ns/row: time of a sweep per constraint row.
speed-up: over 1 lane.
penetration: as judged (99 % of contact points, and the maximum at rest), and maximum.  residual: rms of the
contact law, in the weight of the lighter body × step, and in the mean weight of a body × step.
energy, momentum: relative change.  rest speed: rms over the last second.
reference: distance to the scene's reference value; missed if the run never reached it, – if none is known.
sweeps: per step.  colors: of contacts.  occupancy: share of lanes that hold a contact.
Pareto: on the Pareto front of time against p penetration, l contact-law residual, t reference value.  verdict: good enough, or what exceeds its tolerance most, or what happened.
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

/// Table of the records of one scene, and notes on those that failed.
pub fn scene_table(records: &[Record]) -> (DocTable, String) {
    let mut rows = DocTable::new(
        records.first().map_or(String::new(), |r| format!("{} · {}", r.scene, scene_line(records))),
        2,
        &[
            "solver",
            "budget",
            "lanes",
            "µs/step",
            "median",
            "longest",
            "±",
            "ns/row",
            "speed-up",
            "penetration\njudged",
            "\nmax",
            "residual\nlighter",
            "\nbody",
            "energy",
            "momentum",
            "rest speed",
            "reference",
            "sweeps",
            "colors",
            "occupancy",
            "Pareto",
            "verdict",
        ],
    );
    let mut notes = String::new();
    let mut previous: Option<&Record> = None;
    for record in records {
        rows.row(row(record));
        let key = |r: &Record| (r.solver, r.budget_text.clone(), r.order);
        let same_order = previous.is_some_and(|p| key(p) == key(record));
        if let (Some(failure), false) = (record.failure, same_order) {
            notes += &format!(
                "  failed: {}, {}, {}: {failure}\n",
                record.solver,
                record.budget_text,
                lanes(record)
            );
        }
        if record.bits_equal == Some(false) {
            notes += &format!(
                "  state differs from the error run: {}, {}, {}\n",
                record.solver,
                record.budget_text,
                lanes(record)
            );
        }
        previous = Some(record);
    }
    (DocTable { wide: true, ..rows }, notes)
}

fn lanes(record: &Record) -> String {
    match record.order {
        Order::Colored if is_emulated(record.lanes) => format!("{} emulated", record.lanes),
        Order::Colored => record.lanes.to_string(),
        order => order.name().to_string(),
    }
}

fn row(record: &Record) -> Vec<DocCell> {
    const NOTHING: &str = "–";
    let mut cells: Vec<DocCell> =
        vec![DocCell::solver(record.solver), record.budget_text.as_str().into(), lanes(record).into()];
    let Some(sample) = &record.sample else {
        cells.resize(21, NOTHING.into());
        cells.push(DocCell::from(verdict(record)).tone(Tone::Bad));
        return cells;
    };
    let mut texts = vec![
        digits(sample.mean_ns / 1e3),
        digits(sample.median_ns / 1e3),
        digits(sample.worst_ns / 1e3),
        digits(sample.spread_ns / 1e3),
        digits(sample.row_sweep_ns),
        record.speed_up.map_or(NOTHING.to_string(), digits),
    ];
    let errors = record.errors.as_ref();
    let error = |show: &dyn Fn(&Errors) -> String| errors.map_or(NOTHING.to_string(), show);
    texts.extend([
        error(&|e| si(e.penetration(record.tolerances.rest.is_some()), "m")),
        error(&|e| si(e.penetration_max(), "m")),
        error(&|e| ratio(e.law_rms_lighter())),
        error(&|e| ratio(e.law_rms_body())),
        error(&|e| ratio(e.get("energy_change").unwrap_or_default())),
        error(&|e| ratio(e.get("momentum").unwrap_or_default())),
        error(&|e| si(e.rest_velocity(), "m/s")),
    ]);
    let reference = |t: TruthError| t.error.map_or("missed".to_string(), |e| si(e, t.unit));
    texts.push(record.truth.map_or(NOTHING.to_string(), reference));
    texts.extend([
        format!("{:.0}", sample.load.sweeps),
        sample.load.colors.to_string(),
        format!("{:.0} %", 100.0 * sample.load.occupancy),
        front(&record.front),
        verdict(record),
    ]);
    cells.extend(texts.into_iter().map(DocCell::from));
    if let Some(last) = cells.last_mut() {
        last.tone = match (record.excess() <= 1.0, record.holds()) {
            (true, _) => Tone::Good,
            (_, true) => Tone::Plain,
            (_, false) => Tone::Bad,
        };
    }
    cells
}

/// `good enough`, the distance from it, or the failure.
pub fn verdict(record: &Record) -> String {
    let broke = record.broken.map(|b| b.step).or(record.failure.map(|f| f.step));
    if let Some(mark) = record.mark() {
        return broke.map_or(mark.word().to_string(), |step| format!("{} at step {step}", mark.word()));
    }
    match record.excess() {
        x if x <= 1.0 => "good enough".to_string(),
        x if x.is_finite() => format!("{} × tolerance", digits(x)),
        _ => record.fails_later().unwrap_or("missed its reference".to_string()),
    }
}

fn front(fronts: &Fronts) -> String {
    let marks = [(fronts.penetration, 'p'), (fronts.law, 'l'), (fronts.truth, 't')];
    let on: String = marks.iter().filter(|m| m.0).map(|m| m.1).collect();
    if on.is_empty() { "–".to_string() } else { on }
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

/// What treatments of impacts and of frozen contacts gain and cost each solver: a table for each that took several
/// values.
pub fn treatment_tables(records: &[Record]) -> Vec<DocTable> {
    let impacts = treatments("impacts", records, |r| r.impacts.name().to_string());
    impacts.into_iter().chain(frozen_table(records)).collect()
}

/// That of frozen contacts.
pub fn frozen_table(records: &[Record]) -> Option<DocTable> {
    treatments("frozen contacts", records, |r| r.frozen.to_string().replace("off", "fresh"))
}

/// Such a table; a line per solver and value. Scenes on which a solver ran with one value only are left out.
fn treatments(name: &str, records: &[Record], of: impl Fn(&Record) -> String) -> Option<DocTable> {
    let caption = format!(
        "What {name} gain and cost: numbers of scenes on which a setting of the solver holds in its run, is plausible and tight; time \
         of its cheapest plausible setting over that of its first line, geometric mean; scenes that are better (+) or \
         worse (−) than in its first line"
    );
    let head = ["solver", name, "holds", "plausible", "tight", "time", "+", "−"];
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
            let cells = [value.clone(), count(1), count(2), count(3), mean, names(true), names(false)];
            rows.row(std::iter::once(DocCell::solver(solver)).chain(cells.map(DocCell::from)));
        }
    }
    (!rows.rows.is_empty()).then_some(rows)
}

/// Stability against the order of contacts: a table per scene with a line per solver. Empty unless orders other than
/// natural and colored ran.
pub fn order_tables(records: &[Record]) -> Vec<DocTable> {
    let orders: Vec<Order> =
        Order::ALL.into_iter().filter(|order| records.iter().any(|r| r.order == *order)).collect();
    if !orders.iter().any(|order| matches!(order, Order::Reversed | Order::Shuffled)) {
        return Vec::new();
    }
    let mut tables = Vec::new();
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        let caption = match tables.is_empty() {
            true => ORDERS,
            false => "",
        };
        let head: Vec<&str> =
            std::iter::once(scene[0].scene.as_str()).chain(orders.iter().map(|order| order.name())).collect();
        let mut rows = DocTable { wide: true, ..DocTable::new(caption, 1, &head) };
        for solver in solvers_of(scene) {
            let cells = orders.iter().map(|&order| in_order(scene, solver, order).into());
            rows.row(std::iter::once(DocCell::solver(solver)).chain(cells));
        }
        tables.push(rows);
    }
    tables
}

/// The text above the first table of orders.
const ORDERS: &str = "\
Order of contacts. Settings that hold, of those that ran; median over these of the penetration and of the contact-law \
residual (weights of the lighter body)";

/// `2 of 3, 1.2 mm, 4e-3` for the settings of a solver in an order. A setting at several lane widths counts
/// once.
fn in_order(scene: &[Record], solver: &str, order: Order) -> String {
    let own = answer::each_setting(scene.iter().filter(|r| r.solver == solver && r.order == order));
    let held: Vec<&Record> = own.iter().copied().filter(|r| r.holds()).collect();
    let median = |axis: ErrorAxis| {
        let mut values: Vec<f64> = held.iter().filter_map(|r| axis.of(r)).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied()
    };
    let mut text = format!("{} of {}", held.len(), own.len());
    if let (Some(depth), Some(residual)) = (median(ErrorAxis::Penetration), median(ErrorAxis::Law)) {
        text += &format!(", {}, {residual:.0e}", si(depth, "m"));
    }
    text
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
        assert!(text.contains("failed: pgs, 9 sub, 1: diverged at step 7: body 2 has no finite speed"));
        assert!(text.contains("state differs from the error run: pgs, 1 sub, 8"));
        // No cell is empty.
        let columns = |line: &str| line.split("  ").filter(|cell| !cell.trim().is_empty()).count();
        let lines: Vec<usize> = text.lines().skip(3).take(4).map(columns).collect();
        assert_eq!(lines, [22; 4], "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 210), "{text}");
        assert!(scene_table(&[]).0.rows.is_empty());
    }

    #[test]
    fn each_order_has_what_holds_in_it() {
        let in_order = |order: Order, own: Record| Record { order, ..own };
        let mut records = vec![
            in_order(Order::Natural, record(1, 1, 9.0, 2e-3)),
            in_order(Order::Natural, record(1, 2, 9.0, 1e-3)),
            in_order(Order::Reversed, fell(1, 1, 9.0, 2e-3)),
            in_order(Order::Reversed, record(1, 2, 9.0, 4e-3)),
            record(4, 1, 9.0, 3e-3),
            record(8, 1, 9.0, 3e-3),
        ];
        let line = |records: &[Record]| {
            let text = order_tables(records)[0].text();
            let line = text.lines().find(|l| l.starts_with("pgs")).unwrap().to_string();
            line.split_whitespace().collect::<Vec<_>>().join(" ")
        };
        let natural = "2 of 2, 2.00 mm, 0e0";
        assert_eq!(line(&records), format!("pgs {natural} 1 of 2, 4.00 mm, 0e0 1 of 1, 3.00 mm, 0e0"));
        records.retain(|r| r.order != Order::Reversed);
        assert!(order_tables(&records).is_empty());
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
        assert_eq!(line(" fresh"), "pgs fresh 1 of 2 1 of 2 1 of 2 1.00");
        assert_eq!(line(" own"), "pgs own 2 of 2 2 of 2 1 of 2 1.50 x");
        assert!(treatment_tables(&records[..1]).is_empty());
    }

    #[test]
    fn the_profile_counts_scenes() {
        let soft = |substeps, time, error| Record { solver: "soft_step", ..record(8, substeps, time, error) };
        let records =
            [record(8, 1, 10.0, 0.1), record(8, 2, 20.0, 0.001), soft(1, 10.1, 0.1), soft(2, 20.2, 0.001)];
        let text = profile_table(&records).text();
        assert!(text.contains("penetration in tolerance") && text.contains("1 of 1"), "{text}");
        assert_eq!(text.matches("100 %").count(), 16, "{text}");
        assert!(profile_table(&[]).rows.is_empty());
    }
}
