//! A sweep as text: the values at which each solver is good enough, and a table of times and errors.

use super::environment::Environment;
use super::table::{finish, table};
use super::units::{bodies, count, digits, ratio, si};
use crate::lab::study::Record;
use crate::lab::study::curve::solvers_of;
use crate::lab::study::sweep::Swept;

const LEGEND: &str = "\
A setting is good enough if the scene holds (nothing falls, slides, tunnels or blows up) and its errors are within
the tolerances of a plausible run (`simpulse list NAME` lists them with their reasons): penetration, of 99 % of
contact points and at rest; the contact-law residual, rms, in weights of the lighter body × step; the distance to
the scene's reference value (– if none is known); the speed at rest.  Runs were not extended to a minute: later
failures do not show.  budget: substeps; then velocity, relaxation and position sweeps per substep.
µs/step: mean over the run, its median, its longest step, ± median deviation of a repeat; all settings of a scene
were timed interleaved.  ns/contact: mean step ÷ mean number of contacts; B/contact: size of prepared records.
";

/// Whether these are records of a sweep.
pub fn is_sweep(records: &[Record]) -> bool {
    records.iter().any(|r| r.swept.is_some())
}

/// All scenes, with a legend and a description of the machine.
pub fn text(records: &[Record], environment: &Environment) -> String {
    let Some(swept) = records.iter().find_map(|r| r.swept) else { return String::new() };
    let mut text = format!(
        "Sweep of {}: {}, {}, {} settings\n{}; {}: {} lanes per instruction\n\n{LEGEND}",
        swept.name,
        count(records.chunk_by(|a, b| a.scene == b.scene).count(), "scene"),
        count(solvers_of(records).len(), "solver"),
        records.len(),
        environment.cpu,
        environment.instructions(),
        environment.native_lanes,
    );
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        text += &format!("\n{}", scene_text(scene, swept));
    }
    text
}

/// The tables of all scenes, for a file.
pub fn tables(records: &[Record]) -> String {
    let Some(swept) = records.iter().find_map(|r| r.swept) else { return String::new() };
    let scenes = records.chunk_by(|a, b| a.scene == b.scene).map(|scene| scene_text(scene, swept));
    LEGEND.to_string() + &scenes.map(|text| format!("\n{text}")).collect::<String>()
}

fn value(record: &Record) -> f64 {
    record.swept.map_or(0.0, |s| s.value)
}

/// The values at which each solver is good enough on a scene, and the scene's table.
fn scene_text(scene: &[Record], swept: Swept) -> String {
    let mut text = format!("{} · {}\n", scene[0].scene, bodies(scene[0].bodies));
    let unit = if swept.unit.is_empty() { String::new() } else { format!(" ({})", swept.unit) };
    let heading = format!("{}{unit}", swept.name);
    let width = solvers_of(scene).iter().map(|s| s.len()).max().unwrap_or(0);
    for solver in solvers_of(scene) {
        text += &format!("  {solver:<width$}  {}\n", reach(scene, solver, swept));
        for values in alike(scene, solver) {
            let list = words(&values, swept);
            text += &format!(
                "  {:<width$}  {list} give the same run: the solver limits this quantity, or it has no effect here\n",
                ""
            );
        }
    }
    let mut rows = table(&[
        "solver",
        &heading,
        "budget",
        "lanes",
        "µs/step",
        "median",
        "longest",
        "±",
        "ns/contact",
        "B/contact",
        "penetration",
        "residual",
        "reference",
        "verdict",
    ]);
    for solver in solvers_of(scene) {
        let mut own: Vec<&Record> = scene.iter().filter(|r| r.solver == solver).collect();
        own.sort_by(|a, b| value(a).total_cmp(&value(b)));
        own.into_iter().for_each(|record| {
            rows.add_row(row(record));
        });
    }
    text + &finish(rows, 1)
}

/// The values at which a solver is good enough, and those at which it holds.
fn reach(scene: &[Record], solver: &str, swept: Swept) -> String {
    let values = |keep: &dyn Fn(&Record) -> bool| -> Vec<f64> {
        let mut values: Vec<f64> =
            scene.iter().filter(|r| r.solver == solver && keep(r)).map(value).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let all = values(&|_| true);
    let list = |chosen: Vec<f64>| match chosen.len() {
        0 => "no value".to_string(),
        n if n == all.len() => "every value".to_string(),
        _ => words(&chosen, swept),
    };
    let (holds, good) = (list(values(&|r| r.holds())), list(values(&|r| r.excess() <= 1.0)));
    format!("holds at {holds}; good enough at {good}")
}

/// `15, 30 Hz`
fn words(values: &[f64], swept: Swept) -> String {
    let words: Vec<String> = values.iter().map(f64::to_string).collect();
    format!("{} {}", words.join(", "), swept.unit).trim_end().to_string()
}

/// Groups of swept values at which a solver has exactly the same errors. The solver may limit the quantity,
/// as soft contacts limit their stiffness.
fn alike(scene: &[Record], solver: &str) -> Vec<Vec<f64>> {
    let mut own: Vec<&Record> = scene.iter().filter(|r| r.solver == solver && r.errors.is_some()).collect();
    own.sort_by(|a, b| value(a).total_cmp(&value(b)));
    let same = |a: &&Record, b: &&Record| {
        (a.budget, a.order, a.lanes, a.impacts) == (b.budget, b.order, b.lanes, b.impacts)
            && (a.dt, a.errors, a.broken) == (b.dt, b.errors, b.broken)
    };
    let groups = own.chunk_by(same).map(|group| group.iter().map(|r| value(r)).collect::<Vec<f64>>());
    groups.filter(|values| values.len() > 1).collect()
}

fn row(record: &Record) -> Vec<String> {
    const NOTHING: &str = "–";
    let sample = record.sample.as_ref();
    let errors = record.errors.as_ref();
    let nothing = || NOTHING.to_string();
    vec![
        record.solver.to_string(),
        value(record).to_string(),
        record.budget_text.clone(),
        if record.order.is_serial() { record.order.name().into() } else { record.lanes.to_string() },
        sample.map_or_else(nothing, |l| digits(l.mean_ns / 1e3)),
        sample.map_or_else(nothing, |l| digits(l.median_ns / 1e3)),
        sample.map_or_else(nothing, |l| digits(l.worst_ns / 1e3)),
        sample.map_or_else(nothing, |l| digits(l.spread_ns / 1e3)),
        sample
            .filter(|l| l.load.contacts > 0.0)
            .map_or_else(nothing, |l| digits(l.mean_ns / l.load.contacts)),
        sample.map_or_else(nothing, |l| digits(l.load.bytes_per_contact)),
        errors.map_or_else(nothing, |e| si(e.penetration(record.tolerances.rest.is_some()), "m")),
        errors.map_or_else(nothing, |e| ratio(e.law_rms_lighter())),
        match record.truth {
            None => nothing(),
            Some(t) => t.error.map_or("missed".to_string(), |e| si(e, t.unit)),
        },
        verdict(record),
    ]
}

/// `good enough`, the distance from it, or the failure.
fn verdict(record: &Record) -> String {
    if let Some(mark) = record.mark() {
        let step = record.broken.map(|b| b.step).or(record.failure.map(|f| f.step));
        return step.map_or(mark.word().to_string(), |step| format!("{} at step {step}", mark.word()));
    }
    match record.excess() {
        x if x <= 1.0 => "good enough".to_string(),
        x if x.is_finite() => format!("{} × tolerance", digits(x)),
        _ => "missed its reference".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn every_value_has_a_line_that_stands_alone() {
        let at = |value: f64, r: Record| Record {
            swept: Some(Swept { name: "contact_hertz", unit: "Hz", value }),
            ..r
        };
        let records = [
            at(15.0, fell(8, 1, 10.0, 0.5)),
            at(30.0, record(8, 1, 10.0, 0.5)),
            at(60.0, record(8, 1, 11.0, 1e-3)),
            at(120.0, failed(8)),
        ];
        assert!(is_sweep(&records) && !is_sweep(&[record(8, 1, 1.0, 0.0)]));
        let text = tables(&records);
        assert!(text.contains("holds at 30, 60 Hz; good enough at 60 Hz"), "{text}");
        for part in ["contact_hertz (Hz)", "fell at step 100", "50.0 × tolerance", "blew up at step 7"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains("the same run"), "{text}");
        let [mut clamped, other] = [records[2].clone(), records[2].clone()];
        clamped.swept = Some(Swept { value: 90.0, ..clamped.swept.unwrap() });
        let told = tables(&[records[1].clone(), other, clamped]);
        assert!(told.contains("60, 90 Hz give the same run"), "{told}");
        let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("pgs")).collect();
        assert_eq!(lines.len(), 4);
        let cells = |line: &&str| line.split("  ").filter(|cell| !cell.trim().is_empty()).count();
        assert!(lines.iter().all(|line| cells(line) == 14), "{text}");
    }
}
