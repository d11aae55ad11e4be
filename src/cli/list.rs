//! `simpulse list`: scenes, solvers, columns of CSV files, one scene, the schema of scene files.

use super::output::{print, print_json};
use super::values;
use crate::engine::solvers::{VARIANTS, Variant};
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::report::columns::{self, Column, SHEETS, Sheet};
use crate::lab::scenes::tolerance::Tolerance;
use crate::lab::scenes::{self, CATALOG, Loaded};
use crate::lab::study::{DEFAULT_SOLVERS, budget, check_seed, open_scene};
use crate::lab::units::{bodies, count, percent, si};
use clap::Args;
use serde_json::{Value, json};
use std::process::ExitCode;

/// List scenes, solvers and columns, or describe a scene
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  simpulse list                      what there is
  simpulse list scenes
  simpulse list solvers              with their parameters
  simpulse list columns              of every CSV file
  simpulse list arch                 when it holds, and its tolerances
  simpulse list arch --json > my.json     a scene to edit
  simpulse list schema               the JSON schema of scene files")]
pub struct ListArgs {
    /// scenes, solvers, columns, schema, or a scene [default: what there is]
    #[arg(value_name = "WHAT", value_parser = values::scene())]
    pub what: Option<String>,
    /// Print JSON instead of text; a scene in the file format
    #[arg(long)]
    pub json: bool,
    /// Random seed, for a scene that has one
    #[arg(long, requires = "what")]
    pub seed: Option<u64>,
}

/// Prints the list.
pub fn run(args: &ListArgs) -> Result<ExitCode, Error> {
    let what = args.what.as_deref().unwrap_or_default();
    if args.seed.is_some() && ["scenes", "solvers", "columns", "schema"].contains(&what) {
        return Err(Error::invalid("seed", format!("needs a scene, not {what}")));
    }
    match what {
        "" => print(&overview()),
        "scenes" => scenes(args),
        "solvers" => solvers(args),
        "columns" => columns(args),
        "schema" => print(&scenes::schema()),
        name => scene(name, args),
    }
}

/// What can be listed, a line each.
fn overview() -> String {
    let files = count(SHEETS.len(), "CSV file");
    format!(
        "simpulse list scenes     {}\n\
         simpulse list solvers    {}, with their parameters\n\
         simpulse list columns    the columns of {files}\n\
         simpulse list SCENE      when a scene holds, and its tolerances; --json prints its file to edit\n\
         simpulse list schema     the JSON schema of scene files\n",
        count(CATALOG.len(), "scene"),
        count(VARIANTS.len(), "solver"),
    )
}

fn scenes(args: &ListArgs) -> Result<ExitCode, Error> {
    if args.json {
        let entry = |e: &crate::lab::scenes::Entry| {
            json!({
                "name": e.name, "summary": e.summary, "reference_value_known": e.truth.is_some(),
                "size": e.size.map(|s| json!({
                    "meaning": s.meaning, "default": s.default, "min": s.min, "max": s.max,
                })),
            })
        };
        return print_json(&CATALOG.iter().map(entry).collect());
    }
    let mut text = String::new();
    for entry in CATALOG {
        let name = match entry.size {
            Some(size) => format!("{}:{}", entry.name, size.default),
            None => entry.name.to_string(),
        };
        let known = if entry.truth.is_some() { " [reference value known]" } else { "" };
        let size = entry.size.map_or(String::new(), |s| format!(" ({} to {} {})", s.min, s.max, s.meaning));
        text += &format!("{name:<22}{}{size}{known}\n", entry.summary);
    }
    print(&text)
}

fn solvers(args: &ListArgs) -> Result<ExitCode, Error> {
    let is_default = |v: &Variant| DEFAULT_SOLVERS.contains(&v.name);
    if args.json {
        let entry = |v: &&'static Variant| {
            json!({
                "name": v.name, "summary": v.summary, "source": v.source, "standard_budget": v.budget,
                "uses": v.uses, "parameters": overrides::by_name(v, &v.defaults()),
                "in_default_study": is_default(v),
            })
        };
        return print_json(&VARIANTS.iter().map(entry).collect::<Value>());
    }
    let width = VARIANTS.iter().map(|v| v.name.len()).max().unwrap_or(0);
    let line = |v: &&Variant| {
        let standard = budget::brief(&v.budget, v);
        let star = if is_default(v) { "*" } else { " " };
        let own: String = v.parameters.iter().map(|p| format!("; {}={}", p.name, p.default)).collect();
        format!("{star} {:<width$}  {} [{}; standard {standard}{own}]\n", v.name, v.summary, v.source)
    };
    let lines: String = VARIANTS.iter().map(line).collect();
    print(&format!("* in the default study; --solvers all runs every solver\n{lines}\n{}", parameters()))
}

/// The parameters of `--set` and `--sweep`, each with its range and meaning; several lines for a parameter
/// that differs between solvers.
fn parameters() -> String {
    let mut lines: Vec<String> = Vec::new();
    for p in VARIANTS.iter().flat_map(|v| v.parameters) {
        let [low, high] = p.range;
        let range = format!("{low} to {high} {}", p.unit);
        let line = format!("  {:<16}  {:<22}  {}\n", p.name, range.trim_end(), p.meaning);
        if !lines.contains(&line) {
            lines.push(line);
        }
    }
    lines.sort();
    format!(
        "Parameters (--set NAME=VALUE; study --sweep NAME=VALUE,VALUE,…) with their ranges\n{}",
        lines.concat()
    )
}

fn columns(args: &ListArgs) -> Result<ExitCode, Error> {
    let column = |c: &Column| json!({ "name": c.name, "unit": c.unit, "meaning": c.meaning });
    let sheet = |s: &&Sheet| {
        json!({
            "file": s.file, "command": s.command, "line": s.line,
            "columns": (s.columns)().iter().map(column).collect::<Vec<_>>(),
        })
    };
    match args.json {
        true => print_json(&SHEETS.iter().map(sheet).collect()),
        false => print(&columns::text()),
    }
}

fn scene(name: &str, args: &ListArgs) -> Result<ExitCode, Error> {
    check_seed(name, args.seed)?;
    let loaded = open_scene(name, args.seed, None, None)?;
    match args.json {
        true => print(&loaded.scene.to_json()),
        false => print(&described(&loaded)),
    }
}

/// Description of a scene, as text.
fn described(loaded: &Loaded) -> String {
    let Loaded { scene, truth, demands, tolerances: own, unchecked } = loaded;
    let [gx, gy] = scene.gravity;
    let mut text = format!(
        "{}: {}, {} steps of {}, gravity ({gx}, {gy}) m/s²\n",
        scene.name,
        bodies(scene.bodies.len()),
        scene.steps,
        si(scene.dt, "s")
    );
    if let Some(known) = truth {
        text += &format!("reference value: {} = {}\n", known.quantity, si(known.expected, known.unit));
    }
    text += "holds if nothing blows up and no body passes through a static or kinematic one";
    for demand in demands {
        text += &format!("; {}", demand.meaning());
    }
    text += "\ngood enough within these tolerances; 10 × and 100 × tighter: within 10 % and 1 % of them\n";
    let unit = truth.as_ref().map_or("", |known| known.unit);
    let lines = [
        ("overlap", Some((own.penetration, "m"))),
        ("force error", Some((own.residual, "%"))),
        ("reference", own.truth.map(|t| (t, unit))),
        ("rest speed", own.rest.map(|t| (t, "m/s"))),
    ];
    for (name, line) in lines {
        let Some((Tolerance { value, reason, fixed }, unit)) = line else { continue };
        let value =
            if unit == "%" { format!("{} of a body's weight", percent(value)) } else { si(value, unit) };
        let fixed = if fixed { " (at every accuracy)" } else { "" };
        text += &format!("  {name:<12} {value}: {reason}{fixed}\n");
    }
    for what in unchecked {
        text += &format!("not checked: {what}\n");
    }
    text
}
