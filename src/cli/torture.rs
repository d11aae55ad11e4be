//! `simpulse torture`: random scenes, by family and seed, with checks that every solver has to pass.

use super::output::{note, print, print_json, value};
use super::progress::Bar;
use super::values::{Solvers, WithoutArgs};
use crate::engine::solvers::{DEFAULT, Variant, find};
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::files::Pending;
use crate::lab::report::environment::Environment;
use crate::lab::torture::families::{FAMILIES, Family};
use crate::lab::torture::minimize::minimize;
use crate::lab::torture::table::{lines, text};
use crate::lab::torture::{Campaign, TortureRow, family, pace, run_solver};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use serde_json::json;
use std::collections::HashSet;
use std::fs::{File, OpenOptions, create_dir_all, read_to_string};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Run random scenes and count failures that no solver may have
///
/// Twelve families of hard scenes: drops, stacks of large mass ratios, fast bodies, mixed surfaces, pistons
/// and stirrers, overlaps, extreme steps, centimeters beside a hundred meters, plates and needles, far from
/// the origin, walls that are hit, ropes and beams with loads. Every scene runs under every given solver, on
/// all cores. Only poses are checked, in double precision. A scene fails if it diverges, gains energy, flings
/// a body, lets one escape from its walls, ends with bodies inside each other or joints apart, or does not
/// come to rest when it should. The same seed gives the same scenes.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse torture                                     a thousand scenes
  simpulse torture --scenes 10000 --log torture.jsonl  ten thousand; run again, it continues
  simpulse torture --families driven,fast --solvers soft_step,box2d,rapier --keep failed/
  simpulse torture --pace 3 --solvers shim,soft_step   how long the longest step is, over the median
  simpulse torture --only driven:17 --keep failed/     one scene again, and its minimized file")]
pub struct TortureArgs {
    /// Scenes, over all families
    #[arg(long, default_value_t = 1000, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub scenes: u32,
    /// Random seed of all scenes
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Families of scenes [default: all]
    #[arg(long, value_delimiter = ',', value_name = "FAMILY,…", value_parser = family_value())]
    pub families: Vec<&'static Family>,
    /// One scene, as FAMILY:NUMBER
    #[arg(long, value_name = "FAMILY:NUMBER", conflicts_with_all = ["scenes", "families"])]
    pub only: Option<String>,
    /// Solvers; the default solver if none are given
    #[command(flatten)]
    pub solvers: Solvers,
    /// Continuous collision: stop fast bodies at the surfaces that they would pass through [default: the solver's]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub continuous: Option<bool>,
    /// Mechanisms
    #[command(flatten)]
    pub without: WithoutArgs,
    /// Write every scene that fails, minimized, into this folder
    #[arg(long, value_name = "DIR")]
    pub keep: Option<PathBuf>,
    /// Write one line of JSON per scene and solver; scenes already in the file are not run again
    #[arg(long, value_name = "FILE")]
    pub log: Option<PathBuf>,
    /// Also time the steps of each scene, N times: the longest step ÷ the median at the same number of
    /// contacts. Runs on one thread unless `--threads` is given
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    pub pace: Option<u32>,
    /// Exit with code 1 if a solver fails more scenes than this
    #[arg(long, value_name = "N")]
    pub allow: Option<u32>,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

impl TortureArgs {
    fn settings(&self, solver: &'static Variant) -> Result<Settings, Error> {
        let (own, without) = (Settings::new(solver), self.without.of(solver)?);
        Ok(Settings { continuous: self.continuous.unwrap_or(own.continuous), without, ..own })
    }

    /// Name of a solver in rows, with the options that differ from its defaults.
    fn name(&self, solver: &Variant) -> String {
        let mut name = solver.name.to_string();
        match self.continuous {
            Some(true) if !solver.continuous => name += ", continuous",
            Some(false) if solver.continuous => name += ", not continuous",
            _ => {}
        }
        if !self.without.without.is_empty() {
            name += &format!(", without {}", self.without.without.join(" "));
        }
        name
    }
}

fn family_value() -> impl TypedValueParser<Value = &'static Family> {
    PossibleValuesParser::new(FAMILIES.iter().map(|f| f.name)).try_map(|name| family(&name))
}

/// A queued scene: family, number, solver.
type TortureJob = (&'static Family, u32, &'static Variant);

/// Runs the command.
pub fn run(args: &TortureArgs) -> Result<ExitCode, Error> {
    let solvers = match args.solvers.solvers.is_empty() {
        true => vec![find(DEFAULT)?],
        false => args.solvers.chosen(),
    };
    let names: Vec<String> = solvers.iter().map(|v| args.name(v)).collect();
    if let Some(folder) = &args.keep {
        create_dir_all(folder).map_err(Error::io(folder))?;
    }
    let scenes = chosen(args)?;
    let wanted: HashSet<(&str, u32)> = scenes.iter().map(|(f, n)| (f.name, *n)).collect();
    let (mut rows, log) = match &args.log {
        Some(path) => opened(path)?,
        None => (Vec::new(), None),
    };
    rows.retain(|row| {
        row.seed == args.seed
            && names.contains(&row.solver)
            && wanted.contains(&(row.family.as_str(), row.number))
    });
    let done: HashSet<(String, u32, String)> =
        rows.iter().map(|r| (r.family.clone(), r.number, r.solver.clone())).collect();
    let jobs: Vec<TortureJob> = scenes
        .iter()
        .flat_map(|&(family, number)| solvers.iter().map(move |&solver| (family, number, solver)))
        .filter(|(family, number, solver)| {
            !done.contains(&(family.name.to_string(), *number, args.name(solver)))
        })
        .collect();
    if jobs.len() < scenes.len() * solvers.len() {
        note(&format!("{} of {} runs are in the log\n", rows.len(), scenes.len() * solvers.len()));
    }
    rows.extend(run_all(args, &jobs, log)?);
    let lines = lines(&rows, &names);
    let worst = lines.iter().filter(|l| l.family == "all").map(|l| l.failed).max().unwrap_or(0);
    if args.json {
        let rows = if args.only.is_some() { Some(value(&rows)?) } else { None };
        let environment = Environment::current();
        let found =
            json!({ "environment": environment, "seed": args.seed, "lines": value(&lines)?, "rows": rows });
        print_json(&found)?;
    } else {
        print(&text(&lines))?;
    }
    Ok(match args.allow {
        Some(allowed) if worst > allowed => ExitCode::FAILURE,
        _ => ExitCode::SUCCESS,
    })
}

fn chosen(args: &TortureArgs) -> Result<Vec<(&'static Family, u32)>, Error> {
    let Some(only) = &args.only else {
        return Ok(Campaign::new(args.seed, &args.families, args.scenes).list());
    };
    let invalid = || Error::invalid("--only", format!("'{only}' is not FAMILY:NUMBER, such as 'drops:17'"));
    let (name, number) = only.split_once(':').ok_or_else(invalid)?;
    Ok(vec![(family(name)?, number.parse().map_err(|_| invalid())?)])
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
            message: format!("line {} was not written by `torture --log`: {e}", k + 1),
        })?;
        rows.push(row);
    }
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(Error::io(path))?;
    file.set_len(whole as u64).map_err(Error::io(path))?;
    Ok((rows, Some(file)))
}

/// Runs all jobs on `--threads` threads (by default one per core, or one with `--pace`). Rows are in the
/// order of the jobs.
fn run_all(args: &TortureArgs, jobs: &[TortureJob], log: Option<File>) -> Result<Vec<TortureRow>, Error> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let cores = if args.pace.is_some() { 1 } else { cores };
    let threads = args.threads.map_or(cores, usize::from).min(jobs.len()).max(1);
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let (found, log, bar) = (Mutex::new(Vec::new()), Mutex::new(log), Bar::new());
    let work = || -> Result<(), Error> {
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(family, number, solver)) = jobs.get(k) else { return Ok(()) };
            let row = one(args, family, number, solver)?;
            if let Some(log) = lock(&log).as_mut() {
                let line = serde_json::to_string(&row).map_err(|e| Error::invalid("--log", e.to_string()))?;
                writeln!(log, "{line}").map_err(Error::io(args.log.clone().unwrap_or_default()))?;
            }
            lock(&found).push((k, row));
            bar.step(done.fetch_add(1, Ordering::Relaxed) + 1, jobs.len(), "runs");
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = workers.into_iter().map(|w| w.join().unwrap_or_else(|e| std::panic::resume_unwind(e)));
        joined.collect::<Result<Vec<()>, Error>>()
    })?;
    drop(bar);
    let mut rows = found.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    rows.sort_by_key(|(k, _)| *k);
    Ok(rows.into_iter().map(|(_, row)| row).collect())
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Runs one scene under one solver. If it fails and a folder is given, the scene is minimized and written
/// there.
fn one(
    args: &TortureArgs,
    family: &'static Family,
    number: u32,
    solver: &'static Variant,
) -> Result<TortureRow, Error> {
    let case = family.case(args.seed, number);
    let settings = args.settings(solver)?;
    let mut outcome = run_solver(&case, &settings)?;
    if let Some(repeats) = args.pace {
        outcome.pace = Some(pace(&case, &settings, repeats)?);
    }
    if let (Some(folder), Some(fault)) = (&args.keep, outcome.faults.first()) {
        let mut least = minimize(&case, fault.verdict, |case| run_solver(case, &settings))?;
        let (verdict, name) = (fault.verdict.word(), solver.name);
        least.scene.name = format!("{}, {verdict} under {name}", least.scene.name);
        let path = folder.join(format!("{}_{number}_{}_{name}_{verdict}.json", family.name, args.seed));
        let mut file = Pending::new(&path)?;
        file.write_all(least.scene.to_json().as_bytes()).map_err(Error::io(&path))?;
        file.commit()?;
    }
    let (family, solver) = (family.name.to_string(), args.name(solver));
    Ok(TortureRow { seed: args.seed, family, number, solver, outcome })
}
