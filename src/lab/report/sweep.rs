//! A sweep as text: the values at which each solver is good enough.

use super::by_scene::{brief_table, in_order, scene_line};
use super::doc::{self, DocTable};
use super::environment::Environment;
use super::units::count;
use crate::lab::study::Record;
use crate::lab::study::curve::solvers_of;
use crate::lab::study::sweep::Swept;

/// Whether these are records of a sweep.
pub fn is_sweep(records: &[Record]) -> bool {
    records.iter().any(|r| r.swept.is_some())
}

const LEGEND: &str = "\
A setting is good enough if the scene holds and its errors are within its tolerances (`simpulse list \
SCENE` lists them with their reasons). Runs were not extended to a minute: later failures do not show. setting: substeps × the \
velocity, relax and position sweeps in each. µs/step: mean over the run, its longest step, ± median \
deviation of a repeat; all settings of a scene were timed interleaved. ns/contact: mean step ÷ mean number of contacts. \
tables.txt has every column.";

/// What was swept, on which machine, and per scene where it is good enough, with a table.
pub fn text(records: &[Record], environment: &Environment) -> String {
    let scenes: Vec<&[Record]> = records.chunk_by(|a, b| a.scene == b.scene).collect();
    let head = format!(
        "Sweep of {}: {}, {}, {} settings\n{}; {}: {} lanes per instruction\n",
        records.iter().find_map(|r| r.swept).map_or("", |s| s.name),
        count(scenes.len(), "scene"),
        count(solvers_of(records).len(), "solver"),
        records.len(),
        environment.cpu,
        environment.instructions(),
        environment.native_lanes,
    );
    let one = |scene: &[Record]| {
        let table = DocTable { wide: true, ..brief_table(&in_order(scene)) };
        format!("\n{} · {}\n{}\n{}", scene[0].scene, scene_line(scene), reached(scene), table.text())
    };
    format!("{head}\n{}{}", doc::lines(LEGEND), scenes.into_iter().map(one).collect::<String>())
}

fn value(record: &Record) -> f64 {
    record.swept.map_or(0.0, |s| s.value)
}

/// The values at which each solver is good enough on a scene, a line each; empty unless it is a sweep.
pub fn reached(scene: &[Record]) -> String {
    let mut text = String::new();
    let Some(swept) = scene.iter().find_map(|r| r.swept) else { return text };
    let width = solvers_of(scene).iter().map(|s| s.len()).max().unwrap_or(0);
    for solver in solvers_of(scene) {
        text += &format!("  {solver:<width$}  {}\n", reach(scene, solver, swept));
        // Kernels for other features give the same bits: that is what makes their times comparable.
        for values in alike(scene, solver).into_iter().filter(|_| swept.name != "features") {
            let list = words(&values, swept);
            text += &format!(
                "  {:<width$}  {list} give the same run: the solver limits this quantity, or it has no effect here\n",
                ""
            );
        }
    }
    text
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::report::tables;
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
        assert!(lines.iter().all(|line| cells(line) == 23), "{text}");
    }
}
