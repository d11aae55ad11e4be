//! `simpulse verify --random`: random scenes, by family and seed, with checks that every solver has to pass.

use super::output::{note, print, print_json, value};
use super::progress::Bar;
use super::verify::VerifyArgs;
use crate::engine::solvers::{DEFAULT, Variant, find};
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::parallel::{in_parallel, processors};
use crate::lab::report::environment::Environment;
use crate::lab::torture::families::{FAMILIES, Family};
use crate::lab::torture::minimize::minimize;
use crate::lab::torture::table::{lines, text};
use crate::lab::torture::{Campaign, TortureRow, family, pace, run_solver};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{ArgGroup, Args};
use serde_json::json;
use std::collections::HashSet;
use std::fs::{File, OpenOptions, read_to_string};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Random scenes.
#[derive(Clone, Copy, Debug)]
pub enum RandomScenes {
    /// So many, over all families.
    Count(u32),
    /// Scene of a family, by its number.
    One(&'static Family, u32),
}

impl FromStr for RandomScenes {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let invalid = || {
            let message =
                format!("'{text}' is neither a number from 1 to 1000000 nor FAMILY:NUMBER (drops:17)");
            Error::invalid("--random", message)
        };
        match text.split_once(':') {
            Some((name, number)) => Ok(Self::One(family(name)?, number.parse().map_err(|_| invalid())?)),
            None => match text.parse() {
                Ok(count @ 1..=1_000_000) => Ok(Self::Count(count)),
                _ => Err(invalid()),
            },
        }
    }
}

/// The group of all options that need `--random`: without it, nothing would come of them.
pub const OPTIONS: &str = "random_options";

const NEED_RANDOM: [&str; 6] = ["seed", "families", "keep", "log", "pace", "allow"];

/// Options of random scenes.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Random scenes")]
#[command(group = ArgGroup::new(OPTIONS).args(NEED_RANDOM).multiple(true).requires("random"))]
pub struct RandomArgs {
    /// Random scenes instead of the cases: their number over all families, or one scene as FAMILY:NUMBER. Scenes that
    /// set their own substeps keep them
    #[arg(long, value_name = "N", conflicts_with_all = ["cases", "list"])]
    pub random: Option<RandomScenes>,
    /// Random seed of all scenes
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Families of scenes [default: all]
    #[arg(long, value_delimiter = ',', value_name = "FAMILY,…", value_parser = family_value())]
    pub families: Vec<&'static Family>,
    /// Write every scene that fails, minimized, into this folder
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
    /// Write one line of JSON per scene and solver; scenes already in the file are not run again
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
    /// Also time the steps of each scene, N times: the longest step ÷ the median at the same number of
    /// contacts
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    pub pace: Option<u32>,
    /// Exit with code 1 if a solver fails more scenes than this
    #[arg(long, value_name = "N")]
    pub allow: Option<u32>,
}

impl VerifyArgs {
    /// The wanted scenes.
    fn scenes(&self) -> Vec<(&'static Family, u32)> {
        match self.random.random {
            Some(RandomScenes::One(family, number)) => vec![(family, number)],
            Some(RandomScenes::Count(count)) => {
                Campaign::new(self.random.seed, &self.random.families, count).list()
            }
            None => Vec::new(),
        }
    }
}

fn family_value() -> impl TypedValueParser<Value = &'static Family> {
    PossibleValuesParser::new(FAMILIES.iter().map(|f| f.name)).try_map(|name| family(&name))
}

/// A queued scene: family, number, solver.
type TortureJob = (&'static Family, u32, &'static Variant);

/// Runs the scenes and prints a line per family and solver.
pub fn run(args: &VerifyArgs) -> Result<ExitCode, Error> {
    let solvers = match args.solvers.solvers.is_empty() {
        true => vec![find(DEFAULT)?],
        false => args.solvers.chosen(),
    };
    let own = &args.random;
    let names = solvers.iter().map(|v| args.name(v)).collect::<Result<Vec<String>, Error>>()?;
    if let Some(folder) = &own.keep {
        files::prepare_folder(folder)?;
    }
    let scenes = args.scenes();
    let wanted: HashSet<(&str, u32)> = scenes.iter().map(|(f, n)| (f.name, *n)).collect();
    let (mut rows, log) = match &own.log {
        Some(path) => opened(path)?,
        None => (Vec::new(), None),
    };
    rows.retain(|row| {
        let scene = (row.family.as_str(), row.number);
        row.seed == own.seed && names.contains(&row.solver) && wanted.contains(&scene)
    });
    let done: HashSet<(&str, u32, &str)> =
        rows.iter().map(|r| (r.family.as_str(), r.number, r.solver.as_str())).collect();
    let each = |&(family, number): &(&'static Family, u32)| {
        let solvers = solvers.iter().zip(&names);
        let left = solvers.filter(|(_, name)| !done.contains(&(family.name, number, name.as_str())));
        left.map(|(&solver, _)| (family, number, solver)).collect::<Vec<_>>()
    };
    let jobs: Vec<TortureJob> = scenes.iter().flat_map(each).collect();
    if jobs.len() < scenes.len() * solvers.len() {
        note(&format!("{} of {} runs are in the log\n", rows.len(), scenes.len() * solvers.len()));
    }
    rows.extend(run_all(args, &jobs, log)?);
    let lines = lines(&rows, &names);
    let worst = lines.iter().filter(|l| l.family == "all").map(|l| l.failed).max().unwrap_or(0);
    if args.json {
        let rows = matches!(own.random, Some(RandomScenes::One(..))).then(|| value(&rows)).transpose()?;
        let environment = Environment::current();
        print_json(
            &json!({ "environment": environment, "seed": own.seed, "lines": value(&lines)?, "rows": rows }),
        )?;
    } else {
        print(&text(&lines))?;
    }
    Ok(if own.allow.is_some_and(|allowed| worst > allowed) { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// Opens a log: its rows, and the file to append to. A truncated last line is dropped.
fn opened(path: &Path) -> Result<(Vec<TortureRow>, Option<File>), Error> {
    let text = match path.exists() {
        true => read_to_string(path).map_err(Error::io(path))?,
        false => String::new(),
    };
    let mut rows = Vec::new();
    let whole = text.rfind('\n').map_or(0, |end| end + 1);
    for (k, line) in text[..whole].lines().enumerate() {
        let row = serde_json::from_str(line).map_err(|e| Error::Format {
            path: path.to_path_buf(),
            message: format!("line {} was not written by `verify --random --log`: {e}", k + 1),
        })?;
        rows.push(row);
    }
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(Error::io(path))?;
    file.set_len(whole as u64).map_err(Error::io(path))?;
    Ok((rows, Some(file)))
}

/// Runs all jobs on `--threads` threads (by default one per core, or one with `--pace`). Rows are in the
/// order of the jobs.
fn run_all(args: &VerifyArgs, jobs: &[TortureJob], log: Option<File>) -> Result<Vec<TortureRow>, Error> {
    let cores = if args.random.pace.is_some() { 1 } else { processors() };
    let (done, log, bar) = (AtomicUsize::new(0), Mutex::new(log), Bar::new());
    in_parallel(jobs, args.threads.map_or(cores, usize::from), |&(family, number, solver)| {
        let row = one(args, family, number, solver)?;
        if let Some(log) = log.lock().unwrap_or_else(PoisonError::into_inner).as_mut() {
            let line = serde_json::to_string(&row).map_err(|e| Error::invalid("--log", e.to_string()))?;
            writeln!(log, "{line}").map_err(Error::io(args.random.log.clone().unwrap_or_default()))?;
        }
        bar.step(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len(), "runs");
        Ok(row)
    })
}

/// Runs one scene under one solver. If it fails and a folder is given, the scene is minimized and written
/// there.
fn one(
    args: &VerifyArgs,
    family: &'static Family,
    number: u32,
    solver: &'static Variant,
) -> Result<TortureRow, Error> {
    let case = family.case(args.random.seed, number);
    let settings = args.settings(solver)?;
    let mut outcome = run_solver(&case, &settings)?;
    if let Some(repeats) = args.random.pace {
        outcome.pace = Some(pace(&case, &settings, repeats)?);
    }
    if let (Some(folder), Some(fault)) = (&args.random.keep, outcome.faults.first()) {
        let mut least = minimize(&case, fault.verdict, |case| run_solver(case, &settings))?;
        let (verdict, name) = (fault.verdict.word(), solver.name);
        least.scene.name = format!("{}, {verdict} under {name}", least.scene.name);
        let path =
            folder.join(format!("{}_{number}_{}_{name}_{verdict}.json", family.name, args.random.seed));
        files::write(&path, least.scene.to_json().as_bytes())?;
    }
    let (family, solver) = (family.name.to_string(), args.name(solver)?);
    Ok(TortureRow { seed: args.random.seed, family, number, solver, outcome })
}
