//! The columns of every CSV file, in one place. Tests check that no file has another header.
//!
//! A cell is empty if there is no value: a run that failed has no errors, a scene without a reference value
//! has no distance to it.

use super::environment::Environment;
use crate::engine::clock::Phase;
use crate::lab::error::Error;
use crate::lab::metrics::METRICS;
use crate::lab::overrides::decimal;
use crate::lab::scenes::tolerance::Accuracy;
use crate::lab::study::Record;
use crate::lab::study::curve::ErrorAxis;
use crate::lab::study::sample::Sample;
use crate::lab::units::is_emulated;
use serde_json::Value;

/// Version of `study.csv` and `study.json`. It is increased with every change that an older program cannot
/// read.
pub const SCHEMA: u32 = 4;

/// The oldest version that this program reads.
pub const OLDEST_SCHEMA: u32 = 3;

/// A column.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Name in the header. `<phase>_ns` stands for one column per phase, and so on.
    pub name: &'static str,
    /// Unit; empty for words and counts, 1 for ratios.
    pub unit: &'static str,
    /// Its content.
    pub meaning: &'static str,
}

/// A kind of CSV file.
#[derive(Clone, Copy, Debug)]
pub struct Sheet {
    /// Usual name of the file.
    pub file: &'static str,
    /// The command that writes it.
    pub command: &'static str,
    /// What a line describes.
    pub line: &'static str,
    /// Columns, in order.
    pub columns: fn() -> Vec<Column>,
}

const fn column([name, unit, meaning]: [&'static str; 3]) -> Column {
    Column { name, unit, meaning }
}

pub(super) fn listed(columns: &[[&'static str; 3]]) -> Vec<Column> {
    columns.iter().copied().map(column).collect()
}

/// The value of a cell of `study.csv`; null leaves it empty.
type StudyCell = fn(&Record, &Environment) -> Value;

const fn cell(
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    of: StudyCell,
) -> (Column, StudyCell) {
    (Column { name, unit, meaning }, of)
}

/// A figure of the times, or null without times.
fn sample<T: Into<Value>>(record: &Record, of: fn(&Sample) -> T) -> Value {
    record.sample.as_ref().map(of).into()
}

/// Columns of `study.csv` before those of [`METRICS`]: setting and times.
const SETTING: &[(Column, StudyCell)] = &[
    cell("schema_version", "", "version of these columns", |_, _| SCHEMA.into()),
    cell("commit", "", "commit that the program was built from", |_, e| e.commit.as_str().into()),
    cell("cpu", "", "processor", |_, e| e.cpu.as_str().into()),
    cell("native_lanes", "", "widest lanes that the build has instructions for", |_, e| {
        e.native_lanes.into()
    }),
    cell("scene", "", "name with its size", |r, _| r.scene.as_str().into()),
    cell("bodies", "", "bodies of the scene", |r, _| r.bodies.into()),
    cell("class", "", "placed at rest, arrives at rest, or moves", |r, _| r.class.word().into()),
    cell("dt_s", "s", "length of a step", |r, _| r.dt.into()),
    cell("solver", "", "name of the solver", |r, _| r.solver.into()),
    cell(
        "order",
        "",
        "order of constraints: natural (that of the file), reversed, shuffled or colored (parallel)",
        |r, _| r.order.name().into(),
    ),
    cell("lanes", "", "lanes per instruction", |r, _| r.lanes.into()),
    cell("lanes_emulated", "", "whether the build has no instructions so wide", |r, _| {
        is_emulated(r.lanes).into()
    }),
    cell("substeps", "", "substeps of a step", |r, _| r.budget.substeps.into()),
    cell("velocity_iterations", "", "velocity sweeps of a substep", |r, _| {
        r.budget.velocity_iterations.into()
    }),
    cell("relax_iterations", "", "relaxation sweeps of a substep", |r, _| r.budget.relax_iterations.into()),
    cell("position_iterations", "", "position sweeps of a substep", |r, _| {
        r.budget.position_iterations.into()
    }),
    cell("impacts", "", "treatment of impacts: own, waves or none", |r, _| r.impacts.name().into()),
    cell("frozen", "", "frozen contacts: own, off, or distance (m) and turn (rad)", |r, _| {
        r.frozen.to_string().into()
    }),
    cell("parameters", "", "all parameters of the solver, name=value", |r, _| r.parameters.as_str().into()),
    cell("swept", "", "quantity that a sweep varies; empty without --sweep", |r, _| {
        r.swept.map(|s| s.name).into()
    }),
    cell("swept_unit", "", "unit of the next column; empty for a pure number", |r, _| {
        r.swept.map(|s| s.unit).into()
    }),
    cell("swept_value", "*", "value of the swept quantity", |r, _| r.swept.map(|s| s.value).into()),
    cell(
        "mean_step_us",
        "µs",
        "time of a step, mean over the run; each step: median over rounds",
        |r, _| sample(r, |s| s.mean_ns / 1e3),
    ),
    cell("median_step_us", "µs", "the same, median over the run", |r, _| sample(r, |s| s.median_ns / 1e3)),
    cell("longest_step_us", "µs", "the same, longest of the run", |r, _| sample(r, |s| s.worst_ns / 1e3)),
    cell("rounds", "", "rounds common to all settings of the scene", |r, _| sample(r, |s| s.rounds)),
    cell(
        "waited_share",
        "1",
        "share of the time that the thread waited for a processor; not counted",
        |r, _| sample(r, |s| s.waited),
    ),
    cell("noise_share", "1", "median deviation of a repeat, over its median", |r, _| sample(r, |s| s.noise)),
    cell("spread_us", "µs", "median deviation of a repeat from its block's median", |r, _| {
        sample(r, |s| s.spread_ns / 1e3)
    }),
    cell("quartile_1_us", "µs", "lower quartile of the steps", |r, _| {
        sample(r, |s| s.quartiles_ns[0] / 1e3)
    }),
    cell("quartile_3_us", "µs", "upper quartile of the steps", |r, _| {
        sample(r, |s| s.quartiles_ns[1] / 1e3)
    }),
    cell("ns_per_row_sweep", "ns", "time of a sweep per constraint row, median", |r, _| {
        sample(r, |s| s.row_sweep_ns)
    }),
    cell("speed_up", "1", "times faster than one lane in parallel order", |r, _| r.speed_up.into()),
    cell("steps", "", "steps over which errors were measured", |r, _| r.errors.map(|e| e.steps).into()),
    cell("points", "", "contact points over all steps", |r, _| r.errors.map(|e| e.points).into()),
    cell(
        "penetration_judged_m",
        "m",
        "held_depth_p99_m; where the scene has to rest, the larger of it and rest_depth_max_m",
        |r, _| ErrorAxis::Penetration.of(r).into(),
    ),
];

/// Columns of `study.csv` after those of [`METRICS`]: reference value, counts and verdict.
const VERDICT: &[(Column, StudyCell)] = &[
    cell("reference", "", "quantity of the reference value", |r, _| r.truth.map(|t| t.quantity).into()),
    cell("reference_unit", "", "unit of the next two columns", |r, _| r.truth.map(|t| t.unit).into()),
    cell("reference_value", "*", "reference value of the scene", |r, _| r.truth.map(|t| t.expected).into()),
    cell("reference_error", "*", "distance to the reference value", |r, _| {
        r.truth.and_then(|t| t.error).into()
    }),
    cell("contacts", "", "contacts of a step, mean", |r, _| sample(r, |s| s.load.contacts)),
    cell("rows", "", "constraint rows of a step, mean", |r, _| sample(r, |s| s.load.rows)),
    cell("sweeps", "", "sweeps of a step over the constraints, mean", |r, _| sample(r, |s| s.load.sweeps)),
    cell("colors", "", "colors of contacts, maximum over steps", |r, _| sample(r, |s| s.load.colors)),
    cell("overflow", "", "contacts of a step that no color had room for, mean", |r, _| {
        sample(r, |s| s.load.overflow)
    }),
    cell("occupancy", "1", "share of lanes that hold a contact", |r, _| sample(r, |s| s.load.occupancy)),
    cell("bytes_per_contact", "B", "prepared constraint records", |r, _| {
        sample(r, |s| s.load.bytes_per_contact)
    }),
    cell("bits_equal", "", "whether this width gave the same bits as the error run", |r, _| {
        r.bits_equal.into()
    }),
    cell("holds", "", "yes, or fell, slid, tunneled or blew up", |r, _| {
        r.mark().map_or("yes", |m| m.word()).into()
    }),
    cell("failed_step", "", "step at which it stopped holding", |r, _| {
        r.broken.map(|b| b.step).or(r.failure.map(|f| f.step)).into()
    }),
    cell("tolerance_penetration_m", "m", "limit of penetration_judged_m for good enough", |r, _| {
        r.tolerances.penetration.value.into()
    }),
    cell("tolerance_residual", "1", "limit of residual_rms_lighter_weights for good enough", |r, _| {
        r.tolerances.residual.value.into()
    }),
    cell("tolerance_reference", "*", "tolerance of reference_error, in reference_unit", |r, _| {
        r.tolerances.truth.map(|t| t.value).into()
    }),
    cell(
        "tolerance_rest_speed_m_s",
        "m/s",
        "tolerance of the speed at rest; empty where nothing has to rest",
        |r, _| r.tolerances.rest.map(|t| t.value).into(),
    ),
    cell(
        "plausible",
        "",
        "good enough: holds, also for a minute if it has to rest, within every tolerance",
        |r, _| r.is_good(Accuracy::Plausible).into(),
    ),
    cell("tight", "", "10 × tighter: the same within 10 % of the tolerances", |r, _| {
        r.is_good(Accuracy::Tight).into()
    }),
    cell("exact", "", "100 × tighter: the same within 1 %", |r, _| r.is_good(Accuracy::Exact).into()),
    cell("later_seconds", "s", "length of the extended run; empty without one", |r, _| {
        r.later.map(|l| l.seconds).into()
    }),
    cell("later_holds", "", "yes, or what happened in the extended run", |r, _| {
        r.later.map(|l| l.broken.map_or("yes", |b| b.mark.word())).into()
    }),
    cell("later_failed_step", "", "step at which that happened", |r, _| {
        r.later.and_then(|l| l.broken).map(|b| b.step).into()
    }),
    cell("later_rest_speed_m_s", "m/s", "speed over the last second of the extended run, rms", |r, _| {
        r.later.and_then(|l| l.rest_speed_m_s).into()
    }),
    cell(
        "poked_holds",
        "",
        "yes, or what happened in the run of a minute that was pushed at random; empty without one",
        |r, _| r.poked.map(|l| l.broken.map_or("yes", |b| b.mark.word())).into(),
    ),
    cell("not_checked", "", "conditions that were not checked, in words", |r, _| {
        r.unchecked.join("; ").into()
    }),
    cell("failed_body", "", "body that failed", |r, _| r.failure.map(|f| f.body).into()),
    cell("failed_speed", "m/s", "its speed, or rad/s, if it is a finite number", |r, _| {
        r.failure.and_then(|f| f.speed).map_or(Value::Null, decimal)
    }),
];

/// The columns of `study.csv`, in order.
fn study_columns() -> Vec<Column> {
    let metrics = METRICS.iter().map(|m| column([m.name, m.unit, m.meaning]));
    let others = |list: &'static [(Column, StudyCell)]| list.iter().map(|c| c.0);
    let phases = column(["<phase>_ns", "ns", "time of a phase of a step, median"]);
    others(SETTING).chain(metrics).chain(others(VERDICT)).chain([phases]).collect()
}

/// `study.csv`: a line per record. Every number is finite; missing values are empty.
pub fn study_csv(records: &[Record], environment: &Environment) -> Result<Vec<u8>, Error> {
    let failed = |e: csv::Error| Error::invalid("study.csv", e.to_string());
    let mut writer = csv::Writer::from_writer(Vec::new());
    if !records.is_empty() {
        let phases = Phase::ALL.map(|phase| format!("{}_ns", phase.name().replace(' ', "_")));
        let fixed = study_columns().into_iter().filter(|c| !c.name.starts_with('<'));
        writer.write_record(fixed.map(|c| c.name.to_string()).chain(phases)).map_err(failed)?;
    }
    for record in records {
        let cells = |list: &[(Column, StudyCell)]| {
            list.iter().map(|(_, of)| of(record, environment)).collect::<Vec<_>>()
        };
        let metrics = METRICS.iter().map(|m| record.errors.and_then(|e| e.get(m.name)).into());
        let phases = Phase::ALL.map(|p| record.sample.as_ref().map(|s| s.phase_ns[p as usize]).into());
        let line = cells(SETTING).into_iter().chain(metrics).chain(cells(VERDICT)).chain(phases);
        let text = line.map(|value: Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text,
            other => other.to_string(),
        });
        writer.write_record(text).map_err(failed)?;
    }
    writer.into_inner().map_err(|e| Error::invalid("study.csv", e.to_string()))
}

/// `study.csv`
pub static STUDY: Sheet = Sheet {
    file: "study.csv",
    command: "simpulse study",
    line: "a scene, value of a sweep, solver, budget, order and lane width",
    columns: study_columns,
};

/// `converge.csv`
pub static CONVERGE: Sheet = Sheet {
    file: "converge.csv",
    command: "simpulse converge",
    line: "a solver, order and start after some iterations",
    columns: || {
        listed(&[
            ["problem", "", "name of the frozen problem"],
            ["solver", "", "name of the solver, with its stage if it is only one of several"],
            ["arithmetic", "", "f32: code of the simulation; f64: methods for comparison"],
            ["order", "", "natural (that of the file), colored (parallel) or shuffled"],
            ["start", "", "impulses at the start: cold (zero) or warm (those of the previous step)"],
            ["iterations", "", "iterations of the solver"],
            ["sweeps", "", "sweeps over the constraints"],
            ["time_ns", "ns", "time of these iterations, set-up excluded"],
            [
                "rigid_residual",
                "1",
                "force error under the rigid contact law, over the problem's unit of impulse",
            ],
            ["own_residual", "1", "force error under the solver's own law"],
            [
                "velocity_error",
                "1",
                "distance of the velocities from the reference, in the mass norm, relative",
            ],
        ])
    },
};

/// Columns of `run --state`.
pub static STATE: Sheet = Sheet {
    file: "FILE of run --state",
    command: "simpulse run --state FILE",
    line: "a body after a step",
    columns: || {
        listed(&[
            ["step", "", "step, from 1"],
            ["time", "s", "time after the step"],
            ["body", "", "index in the scene, from 0"],
            ["x", "m", "origin of the body's frame"],
            ["y", "m", "the same"],
            ["angle", "rad", "including whole turns since the start"],
            ["vx", "m/s", "velocity of the center of mass"],
            ["vy", "m/s", "the same"],
            ["omega", "rad/s", "angular velocity"],
        ])
    },
};

/// Columns of `run --contacts`.
pub static CONTACTS: Sheet = Sheet {
    file: "FILE of run --contacts",
    command: "simpulse run --contacts FILE",
    line: "a contact point of a step",
    columns: || {
        listed(&[
            ["step", "", "step, from 1"],
            ["body_a", "", "index of the first body"],
            ["body_b", "", "index of the second body"],
            ["feature", "", "which corners or edges meet; the same from step to step"],
            ["px", "m", "contact point at the start of the step"],
            ["py", "m", "the same"],
            ["nx", "1", "normal, from a to b"],
            ["ny", "1", "the same"],
            ["separation", "m", "at the start of the step; negative is overlap"],
            ["normal_impulse", "N s", "on body b over the step"],
            ["tangent_impulse", "N s", "on body b over the step, along the normal turned clockwise"],
        ])
    },
};

/// Columns of `run --joints`.
pub static JOINTS: Sheet = Sheet {
    file: "FILE of run --joints",
    command: "simpulse run --joints FILE",
    line: "a joint after a step",
    columns: || {
        listed(&[
            ["step", "", "step, from 1"],
            ["joint", "", "index in the scene, from 0"],
            ["type", "", "as in files: revolute, prismatic, …"],
            ["body_a", "", "index of the first body"],
            ["body_b", "", "index of the second body"],
            ["gap", "m", "size of the error of what is held along lines"],
            ["lean", "rad", "error of the angle, where it is held"],
            ["angle", "rad", "of b against a, whole turns included"],
            ["translation", "m", "of b's anchor along the axis, or distance of the anchors"],
            ["excess", "*", "beyond limits (m or rad)"],
            [
                "rigid_1",
                "N s",
                "impulse on body b over the step: of the first rigid row along a line; empty if there is none",
            ],
            ["rigid_2", "N s", "the same of the second: x and y of the world, or across the axis"],
            ["rigid_angle", "N m s", "the same of the angle that is held"],
            ["spring_1", "N s", "the same of a spring: of x, or along the axis"],
            ["spring_2", "N s", "the same of y"],
            ["spring_angle", "N m s", "the same of the angle"],
            ["motor", "*", "the same of the motor (N s or N m s)"],
            ["lower", "*", "the same of the lower limit, ≥ 0 (N s or N m s)"],
            ["upper", "*", "the same of the upper limit, which acts the other way, ≥ 0"],
            ["force", "N", "force of the last substep"],
            ["torque", "N m", "torque of the last substep"],
            ["breaks", "", "whether they exceed the break load"],
        ])
    },
};

/// All kinds of CSV files.
pub static SHEETS: [&Sheet; 6] = [&STUDY, &super::ensemble::TIDY, &CONVERGE, &STATE, &CONTACTS, &JOINTS];

impl Sheet {
    /// Names of the columns, in order.
    pub fn names(&self) -> Vec<&'static str> {
        (self.columns)().iter().map(|c| c.name).collect()
    }

    /// Whether a header has these columns, in this order. A column with a placeholder may occur any number of
    /// times, mixed with other such columns.
    pub fn documents(&self, header: &[&str]) -> bool {
        let is_any = |c: &Column| c.name.starts_with('<');
        let suffix = |c: &Column| c.name.split_once('>').map_or("", |(_, suffix)| suffix);
        let columns = (self.columns)();
        let of_any = |name: &str| {
            columns.iter().any(|c| is_any(c) && name.len() > suffix(c).len() && name.ends_with(suffix(c)))
        };
        let plain: Vec<&str> = columns.iter().filter(|c| !is_any(c)).map(|c| c.name).collect();
        let given: Vec<&str> = header.iter().copied().filter(|n| plain.contains(n) || !of_any(n)).collect();
        given == plain
    }
}

/// Descriptions of all columns, as text.
pub fn text() -> String {
    let mut text = String::new();
    for sheet in SHEETS {
        text += &format!("{}, written by `{}`: a line is {}\n", sheet.file, sheet.command, sheet.line);
        let columns = (sheet.columns)();
        let width = |of: fn(&Column) -> usize| columns.iter().map(of).max().unwrap_or(0);
        let (name, unit) = (width(|c| c.name.chars().count()), width(|c| c.unit.chars().count()));
        for c in columns {
            let shown = if c.unit.is_empty() { "–" } else { c.unit };
            text += &format!("  {:<name$}  {shown:<unit$}  {}\n", c.name, c.meaning);
        }
        text += "\n";
    }
    text + "Units: – words and counts, 1 ratios, * in the unit that the line gives.\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::record;
    use std::collections::BTreeSet;

    #[test]
    fn every_column_is_documented() {
        let bytes = study_csv(&[record(8, 1, 1.0, 0.0)], &Environment::current()).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        assert!(STUDY.documents(&header), "{header:?}");
        assert_eq!(text.lines().nth(1).unwrap().split(',').count(), header.len());
        // Terms must be consistent with other studies, so these synonyms are not allowed.
        assert!(header.iter().all(|n| !n.contains("law") && !n.contains("truth") && !n.contains("mark")));
    }

    #[test]
    fn a_header_is_documented_or_not() {
        assert!(STATE.documents(&STATE.names()));
        assert!(!STATE.documents(&STATE.names()[1..]));
        let reversed: Vec<&str> = STATE.names().into_iter().rev().collect();
        assert!(!STATE.documents(&reversed));
    }

    #[test]
    fn every_column_stands_once_with_its_meaning() {
        for sheet in SHEETS {
            let names: BTreeSet<_> = sheet.names().into_iter().collect();
            let columns = (sheet.columns)();
            assert_eq!(names.len(), columns.len(), "{}", sheet.file);
            assert!(columns.iter().all(|c| !c.meaning.is_empty()), "{}", sheet.file);
            assert!(text().contains(sheet.file));
        }
    }
}
