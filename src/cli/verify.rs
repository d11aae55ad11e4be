//! `simpulse verify`: hard cases with known answers, for every solver; the same without mechanisms; random scenes.

use super::output::{self, finite, print_json, value};
use super::progress::Bar;
use super::random::{self, RandomArgs};
use super::values::{self, BudgetArgs, FrozenArgs, ImpactArgs, SettingArgs, Solvers, WithoutArgs};
use crate::engine::solvers::{DEFAULT, VARIANTS, Variant};
use crate::engine::world::Settings;
use crate::lab::ablate;
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::study::budget;
use crate::lab::units::number;
use crate::lab::verify::{self, CASES, Case, Cell, Finding, Lab, LawOf, Required, VerifyMatrix};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use comfy_table::{ContentArrangement, Table, presets};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::process::ExitCode;

/// Run the hard test cases with known analytic answers, or random scenes
///
/// Every case runs with every solver and compares one number with its reference value. Cases that set their own
/// substeps keep them. Failures are shown as failures. `--without all` leaves out each mechanism of the solvers
/// in turn and lists the cases that are then lost. `--random N` runs random scenes instead of the cases and
/// counts failures that no solver may have.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
A cell is 'pass' or 'FAIL', the measured value and, in brackets, the margin: error over tolerance,
so that up to 1 passes. '*' marks the cases that the default solver is required to pass; --list says why.
Exit code 0: it passed all of those that ran; 1: it did not; 2: a request that cannot be met.

Random scenes come from twelve families of hard scenes: drops, stacks of large mass ratios, fast bodies,
mixed surfaces, pistons and stirrers, overlaps, extreme steps, centimeters beside a hundred meters, plates and
needles, far from the origin, walls that are hit, ropes and beams with loads. Only poses are checked. A scene
fails if it diverges, gains energy, flings a body, lets one escape from its walls, ends with bodies inside
each other or joints apart, or does not come to rest when it should. The same seed gives the same scenes.

Examples:
  simpulse verify
  simpulse verify --cases A1,B4.heavy --solvers pgs,soft_step
  simpulse verify --solvers all --json > verify.json
  simpulse verify --list
  simpulse verify --solvers shim --substeps 8              what fewer substeps cost
  simpulse verify --solvers shim --without all             what each mechanism is for
  simpulse verify --random 10000 --log random.jsonl        ten thousand scenes; run again, it continues
  simpulse verify --random 200 --families driven,fast --solvers soft_step,shim --keep failed/
  simpulse verify --random 100 --pace 3                    how long the longest step is, over the median
  simpulse verify --random driven:17 --keep failed/        one scene again, and its minimized file")]
pub struct VerifyArgs {
    /// Cases (B4.heavy) or families of cases (B4) [default: all]
    #[arg(help_heading = "Cases", long, value_delimiter = ',', value_name = "ID,…", value_parser = NonEmptyStringValueParser::new(), conflicts_with = random::OPTIONS)]
    pub cases: Vec<String>,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Impacts
    #[command(flatten)]
    pub impacts: ImpactArgs,
    /// Mechanisms
    #[command(flatten)]
    pub without: WithoutArgs,
    /// Continuous collision: stop fast bodies at the surfaces that they would pass through [default: the solver's]
    #[arg(help_heading = "Solver and setting", long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub continuous: Option<bool>,
    /// Budget and parameters
    #[command(flatten)]
    pub work: BudgetArgs,
    /// Frozen contacts
    #[command(flatten)]
    pub frozen: FrozenArgs,
    /// Print JSON instead of text: everything that was measured
    #[arg(help_heading = "Output", long)]
    pub json: bool,
    /// List the cases with their tolerances and what is required of the default solver, without running them
    #[arg(help_heading = "Cases", long, conflicts_with_all = NOT_LISTED)]
    pub list: bool,
    /// Threads; the results do not depend on them [default: 2; all cores for random scenes, 1 with --pace]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Random scenes
    #[command(flatten)]
    pub random: RandomArgs,
}

/// Name in rows and settings, by solver.
type EachSetting = HashMap<&'static str, (String, Settings)>;

/// Options that say how cases run, or that need random scenes: a list depends on none of them.
const NOT_LISTED: [&str; 8] = [
    random::OPTIONS,
    "continuous",
    "substeps",
    "velocity_iterations",
    "relax_iterations",
    "position_iterations",
    "set",
    "frozen",
];

impl VerifyArgs {
    /// The settings of a solver in every scene. Errors: as [`SettingArgs::settings`].
    pub fn settings(&self, solver: &'static Variant) -> Result<Settings, Error> {
        let (work, frozen) = (self.work.clone(), self.frozen);
        let (impacts, without) = (self.impacts, self.without.clone());
        let own = SettingArgs { solver, work, impacts, frozen, without };
        let own = own.settings()?;
        Ok(Settings { continuous: self.continuous.unwrap_or(own.continuous), ..own })
    }

    /// Name of a solver in rows, with the options that differ from its defaults.
    ///
    /// Errors: those of its settings.
    pub fn name(&self, solver: &'static Variant) -> Result<String, Error> {
        let (mut name, own) = (solver.name.to_string(), self.settings(solver)?);
        if own.budget != solver.budget {
            name += &format!(", {}", budget::brief(&own.budget, solver));
        }
        let changed = overrides::changed(solver, &own.parameters);
        if !changed.is_empty() {
            name += &format!(", {changed}");
        }
        if own.frozen != Default::default() {
            name += &format!(", frozen {}", own.frozen);
        }
        match self.continuous {
            Some(true) if !solver.continuous => name += ", continuous",
            Some(false) if solver.continuous => name += ", not continuous",
            _ => {}
        }
        if self.impacts.impacts != Default::default() {
            name += &format!(", impacts {}", self.impacts.impacts.name());
        }
        if !self.without.without.is_empty() {
            name += &format!(", without {}", self.without.without.join(" "));
        }
        Ok(name)
    }

    /// The setting of each solver, by the name of the solver. Errors: as [`Self::settings`].
    fn each(&self, solvers: &[&'static Variant]) -> Result<EachSetting, Error> {
        solvers.iter().map(|v| Ok((v.name, (self.name(v)?, self.settings(v)?)))).collect()
    }

    fn threads(&self) -> usize {
        self.threads.unwrap_or(2).into()
    }
}

/// Runs the cases and prints the matrix.
pub fn run(args: &VerifyArgs) -> Result<ExitCode, Error> {
    if args.random.random.is_some() {
        return random::run(args);
    }
    let cases = verify::select(&args.cases)?;
    if args.list {
        return match args.json {
            true => print_json(&cases.iter().map(described).collect()),
            false => print(&list(&cases), ExitCode::SUCCESS),
        };
    }
    let solvers = args.solvers.chosen();
    if args.without.without == ["all"] {
        return without_each(args, &cases, &solvers);
    }
    let note = values::left_out(&solvers);
    let bar = Bar::new();
    let tell = |done, total, what: &str| bar.show(done, total, what);
    let each = args.each(&solvers)?;
    let lab = |v: &'static Variant| Lab::with(each[v.name].1.clone());
    let matrix = verify::run(cases, solvers, args.threads(), lab, &tell);
    drop(bar);
    if args.json {
        print_json(&json(&matrix, &each))?;
        return Ok(exit_code(&matrix));
    }
    let names = matrix.solvers.iter().map(|v| (v.name, &each[v.name].0));
    let changed = names.filter(|(solver, name)| name != solver);
    let changed: String = changed.map(|(_, name)| format!("settings: {name}\n")).collect();
    print(&(changed + &text(&matrix) + &note + &outcomes(&matrix) + &required(&matrix)), exit_code(&matrix))
}

/// Leaves out each mechanism of the solvers that have some.
fn without_each(
    args: &VerifyArgs,
    cases: &[&'static Case],
    solvers: &[&'static Variant],
) -> Result<ExitCode, Error> {
    let given = !args.solvers.solvers.is_empty();
    if given && let Some(none) = solvers.iter().find(|v| v.mechanisms.is_empty()) {
        let having: Vec<_> = VARIANTS.iter().filter(|v| !v.mechanisms.is_empty()).map(|v| v.name).collect();
        let message = format!("{} names no mechanisms; solvers that do: {}", none.name, having.join(", "));
        return Err(Error::invalid("--without", message));
    }
    let bar = Bar::new();
    let tell = |done, total, what: &str| bar.show(done, total, what);
    let with_all = VerifyArgs { without: WithoutArgs::default(), ..args.clone() };
    let each = with_all.each(solvers)?;
    let lab = |v: &'static Variant| Lab::with(each[v.name].1.clone());
    let rows: Vec<_> =
        solvers.iter().flat_map(|v| ablate::run(v, cases, args.threads(), lab, &tell)).collect();
    drop(bar);
    match args.json {
        true => print_json(&value(&rows)?),
        false => output::print(&ablate::text(&rows)),
    }
}

/// 1 if the default solver ran and failed a required case, otherwise 0.
fn exit_code(matrix: &VerifyMatrix) -> ExitCode {
    match matrix.broken_promises(DEFAULT) {
        Some(broken) if !broken.is_empty() => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    }
}

fn required(matrix: &VerifyMatrix) -> String {
    let required = matrix.cases.iter().filter(|case| case.required.is_required()).count();
    match matrix.broken_promises(DEFAULT) {
        None => format!("{DEFAULT}, the default solver, did not run: nothing was required\n"),
        Some(broken) if broken.is_empty() => {
            format!("{DEFAULT}, the default solver, failed none of the {required} cases required of it (*)\n")
        }
        Some(broken) => {
            let (count, ids) = (broken.len(), broken.join(", "));
            format!(
                "{DEFAULT}, the default solver, failed {count} of {required} cases required of it (*): {ids}\n"
            )
        }
    }
}

/// Per solver, the number of cases that pass, fail and do not apply, and the names of those that fail.
fn outcomes(matrix: &VerifyMatrix) -> String {
    let line = |(column, solver): (usize, &&Variant)| {
        let cells =
            || matrix.cases.iter().zip(&matrix.cells).map(|(case, cells)| (case.id, cells[column].passed()));
        let count = |passed| cells().filter(|(_, found)| *found == passed).count();
        let failing: Vec<_> = cells().filter(|(_, found)| *found == Some(false)).map(|(id, _)| id).collect();
        let names = if failing.is_empty() { String::new() } else { format!(" ({})", failing.join(", ")) };
        let foreign = match count(None) {
            0 => String::new(),
            count => format!("; {count} do not apply"),
        };
        format!("{}: {} pass, {} fail{names}{foreign}\n", solver.name, count(Some(true)), failing.len())
    };
    matrix.solvers.iter().enumerate().map(line).collect()
}

fn list(cases: &[&Case]) -> String {
    let mut text = String::new();
    for case in cases {
        let law = match case.law_of {
            LawOf::Everyone => String::new(),
            law => format!(" ({})", law.text()),
        };
        let (word, why) = match case.required {
            Required::Yes(why) => ("required", why),
            Required::No(why) => ("not required", why),
        };
        text += &format!("{}  {} [{}]{law}\n", case.id, case.summary, case.unit);
        text += &format!("    tolerance: {}\n    {word} of {DEFAULT}: {why}\n", case.tolerance);
    }
    text
}

const LEGEND: &str = "\
A cell: pass or FAIL, the measured value, and in brackets the margin, error over tolerance: up to 1 passes.
reference: what it should be.  n/a: the reference value is that of soft contacts, or the solver holds no joints.
*: required of the default solver; --list says why.
";

fn text(matrix: &VerifyMatrix) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN).set_content_arrangement(ContentArrangement::Dynamic);
    let names = matrix.solvers.iter().map(|s| s.name.to_string());
    table.set_header(["case", "what", "reference", "tolerance"].map(String::from).into_iter().chain(names));
    for (case, cells) in matrix.cases.iter().zip(&matrix.cells) {
        let star = if case.required.is_required() { "*" } else { "" };
        let (truth, tolerance) = (common(cells, |f| f.truth), common(cells, |f| f.tolerance));
        let own = truth.is_none() || tolerance.is_none();
        let shown = |value: Option<f64>| value.map_or("per solver".into(), number);
        let mut row = vec![format!("{}{star}", case.id), format!("{} ({})", case.summary, case.unit)];
        row.extend([shown(truth), shown(tolerance)]);
        row.extend(cells.iter().map(|cell| cell_text(cell, own)));
        table.add_row(row);
    }
    let mut text = format!("{LEGEND}\n{table}\n");
    for (case, cells) in matrix.cases.iter().zip(&matrix.cells) {
        for (solver, cell) in matrix.solvers.iter().zip(cells) {
            let note = match cell {
                Cell::Found(finding) => finding.note.clone(),
                Cell::Failed(failure) => failure.to_string(),
                Cell::Foreign => String::new(),
            };
            if !note.is_empty() {
                text += &format!("{} {}: {note}\n", case.id, solver.name);
            }
        }
    }
    let others = CASES.len() - matrix.cases.len();
    let left =
        if others > 0 { format!("not run: {others} of {} cases\n", CASES.len()) } else { String::new() };
    text + &left
}

/// The value that all solvers share; `None` if they differ.
fn common(cells: &[Cell], value: impl Fn(&Finding) -> f64) -> Option<f64> {
    let mut values = cells.iter().filter_map(|cell| match cell {
        Cell::Found(finding) => Some(value(finding)),
        _ => None,
    });
    let first = values.next()?;
    values.all(|v| v == first).then_some(first)
}

fn cell_text(cell: &Cell, with_truth: bool) -> String {
    match cell {
        Cell::Foreign => "n/a".into(),
        Cell::Failed(_) => "FAIL, see below".into(),
        Cell::Found(f) => {
            let word = if f.passed() { "pass" } else { "FAIL" };
            let truth = if with_truth {
                format!(", reference {} ± {}", number(f.truth), number(f.tolerance))
            } else {
                String::new()
            };
            format!("{word} {}{truth} ({})", number(f.measured), number(f.margin()))
        }
    }
}

fn json(matrix: &VerifyMatrix, each: &EachSetting) -> Value {
    let cell = |case: &Case, solver: &Variant, cell: &Cell| {
        let (name, settings) = &each[solver.name];
        let mut value = json!({
            "case": case.id, "solver": solver.name, "settings": name, "budget": settings.budget,
            "impacts": settings.impacts.name(), "unit": case.unit,
            "required": case.required.is_required() && solver.name == DEFAULT,
            "passed": cell.passed(),
        });
        match cell {
            Cell::Foreign => value["reason"] = json!("n/a"),
            Cell::Failed(failure) => value["reason"] = json!(failure.to_string()),
            Cell::Found(f) => {
                for (key, x) in [
                    ("measured", f.measured),
                    ("reference", f.truth),
                    ("tolerance", f.tolerance),
                    ("margin", f.margin()),
                ] {
                    value[key] = finite(x);
                }
                value["note"] = json!(f.note);
            }
        }
        value
    };
    let results: Vec<_> = (matrix.cases.iter().zip(&matrix.cells))
        .flat_map(|(case, cells)| matrix.solvers.iter().zip(cells).map(|(solver, c)| cell(case, solver, c)))
        .collect();
    json!({
        "version": 3,
        "default_solver": DEFAULT,
        "broken_promises": matrix.broken_promises(DEFAULT),
        "cases": matrix.cases.iter().map(described).collect::<Vec<_>>(),
        "results": results,
    })
}

/// Description of a case: its measured quantity and its requirements.
fn described(case: &&Case) -> Value {
    let (required, why) = match case.required {
        Required::Yes(why) => (true, why),
        Required::No(why) => (false, why),
    };
    json!({
        "case": case.id, "what": case.summary, "unit": case.unit, "tolerance": case.tolerance,
        "required": required, "why": why,
    })
}

/// Prints to standard output and returns this exit code.
fn print(text: &str, code: ExitCode) -> Result<ExitCode, Error> {
    output::print(text).map(|_| code)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::VARIANTS;

    #[test]
    fn a_cell_shows_verdict_value_and_margin() {
        let cell = Cell::Found(Finding::new(1.5, 1.0, 0.25));
        assert_eq!(cell_text(&cell, false), "FAIL 1.5 (2)");
        assert_eq!(cell_text(&cell, true), "FAIL 1.5, reference 1 ± 0.25 (2)");
        assert_eq!(cell_text(&Cell::Foreign, false), "n/a");
    }

    #[test]
    fn the_list_says_what_is_required() {
        let cases = verify::select(&["B2.box".to_string(), "A17".to_string(), "B19".to_string()]).unwrap();
        let text = list(&cases);
        for part in ["A17.spin", "not required of shim", "(soft contacts only)"] {
            assert!(text.contains(part), "{part} is not in\n{text}");
        }
    }

    #[test]
    fn json_holds_every_cell() {
        let cases = verify::select(&["A0".to_string(), "B2.box".to_string()]).unwrap();
        let matrix = verify::run(cases, VARIANTS.to_vec(), 1, Lab::new, &|_, _, _| ());
        let setting = |v: &&'static Variant| (v.name, (v.name.to_string(), Settings::new(v)));
        let value = json(&matrix, &VARIANTS.iter().map(setting).collect());
        assert_eq!(value["results"].as_array().unwrap().len(), 2 * VARIANTS.len());
        assert_eq!(value["broken_promises"], json!([]));
    }
}
