//! The command line, a file per command: arguments in, files and text out.
//!
//! Exit code 0 is success, 1 a simulation that diverged, 2 a request that cannot be met.

pub mod advise;
pub mod args;
pub mod capture;
pub mod converge;
pub mod growth;
pub mod profile;
pub mod run;
pub mod verify;

use crate::engine::solvers::{VARIANTS, Variant};
use crate::engine::world::World;
use crate::lab::error::Error;
use crate::lab::metrics::{Errors, Observation};
use crate::lab::report;
use crate::lab::scenes::CATALOG;
use crate::lab::scenes::tolerance::Tolerance;
use crate::lab::study::{self, Progress, ablation, budget, open_scene};
use args::{Cli, Command, SceneArgs, StudyArgs};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::process::ExitCode;
use std::sync::Mutex;

/// Parses the command line, runs the command, reports; see the [module](self) for exit codes.
pub fn main() -> ExitCode {
    let result = match Cli::try_parse() {
        Ok(cli) => execute(cli),
        // Help and version are answers; clap's advice on the rest goes on one line.
        Err(error) if !error.use_stderr() => {
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprintln!("error: {}", one_line(&error.to_string()));
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {}", one_line(&error.to_string()));
            ExitCode::from(2)
        }
    }
}

fn execute(cli: Cli) -> Result<ExitCode, Error> {
    match cli.command {
        None => study(&cli.study),
        Some(Command::Study(args)) => study(&args),
        Some(Command::Run(args)) => match run::run(&args)? {
            run::Ending::Finished(text) => print(&text),
            run::Ending::Diverged(failure) => {
                eprintln!("failed: {} {failure}; nothing written", args.scene);
                Ok(ExitCode::FAILURE)
            }
        },
        Some(Command::Advise(args)) => advise::run(&args),
        Some(Command::Capture(args)) => capture::run(&args),
        Some(Command::Converge(args)) => converge::run(&args),
        Some(Command::Verify(args)) => verify::run(&args),
        Some(Command::Profile(args)) => profile::run(&args),
        Some(Command::Growth(args)) => growth::run(&args),
        Some(Command::Scenes) => print(&scenes()),
        Some(Command::Solvers) => print(&solvers()),
        Some(Command::Scene(args)) => print(&scene(&args)?),
    }
}

/// To standard output; a reader that has left is not an error.
fn print(text: &str) -> Result<ExitCode, Error> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output")(e)),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// A message without its own prefix and without advice on usage, on one line.
fn one_line(message: &str) -> String {
    let message = message.strip_prefix("error: ").unwrap_or(message);
    let message = message.split("\nUsage:").next().unwrap_or(message);
    let message = message.split("\nFor more information").next().unwrap_or(message);
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn study(args: &StudyArgs) -> Result<ExitCode, Error> {
    let plan = args.plan()?;
    plan.check()?;
    // Before the long wait, not after it.
    crate::lab::files::prepare_folder(&args.out)?;
    let records = match std::io::stderr().is_terminal() {
        true => with_bar(|tell| study::run(&plan, tell))?,
        false => with_lines(&plan.scenes, |tell| study::run(&plan, tell))?,
    };
    let costs = ablation::ablation(&plan)?;
    let paths = report::write_study(&args.out, &plan, &records, &costs)?;
    let mut text = report::text(&records, &costs) + "\n";
    for path in paths {
        text += &format!("wrote {}\n", path.display());
    }
    print(&text)
}

/// A bar that says what runs.
fn with_bar<T>(work: impl FnOnce(&(dyn Fn(Progress) + Sync)) -> T) -> T {
    let bar = ProgressBar::new(1);
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} {elapsed} {wide_msg}");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let result = work(&|progress: Progress| {
        bar.set_length(progress.total as u64);
        bar.set_position(progress.done as u64);
        bar.set_message(progress.what);
    });
    bar.finish_and_clear();
    result
}

/// Where there is no terminal, a line when the times of a scene are begun.
fn with_lines<T>(scenes: &[String], work: impl FnOnce(&(dyn Fn(Progress) + Sync)) -> T) -> T {
    eprintln!("measuring errors of {} scenes, then times", scenes.len());
    let last = Mutex::new(String::new());
    work(&|progress: Progress| {
        let Progress { done, total, what } = progress;
        let scene = what.strip_prefix("times ").and_then(|w| w.split(" · ").next());
        if let (Some(scene), Ok(mut last)) = (scene, last.lock())
            && *last != scene
        {
            *last = scene.to_string();
            eprintln!("{done}/{total} times of {scene}");
        }
    })
}

fn scenes() -> String {
    let mut text = String::new();
    for entry in CATALOG {
        let name = match entry.size {
            Some(size) => format!("{}:{}", entry.name, size.default),
            None => entry.name.to_string(),
        };
        let known = if entry.truth.is_some() { " [truth known]" } else { "" };
        let size = entry.size.map_or(String::new(), |s| format!(" ({} to {} {})", s.min, s.max, s.meaning));
        text += &format!("{name:<22}{}{size}{known}\n", entry.summary);
    }
    text
}

fn solvers() -> String {
    let line = |v: &&Variant| {
        let standard = budget::brief(&v.budget, v);
        format!("{:<16}{} [{}; standard {standard}]\n", v.name, v.summary, v.source)
    };
    VARIANTS.iter().map(line).collect()
}

fn scene(args: &SceneArgs) -> Result<String, Error> {
    let loaded = open_scene(&args.name, args.seed, None, None)?;
    let scene = loaded.scene;
    if args.json {
        return Ok(scene.to_json());
    }
    let [gx, gy] = scene.gravity;
    let mut text = format!(
        "{}: {} bodies, {} steps of {} s, gravity ({gx}, {gy})\n",
        scene.name,
        scene.bodies.len(),
        scene.steps,
        scene.dt
    );
    if let Some(truth) = &loaded.truth {
        text += &format!("known: {} = {} {}\n", truth.quantity, truth.expected, truth.unit);
    }
    text += "holds if nothing blows up and no body passes through a static one";
    for demand in loaded.demands {
        text += &format!("; {}", demand.meaning());
    }
    text += "\ntolerances\n";
    let (own, unit) = (loaded.tolerances, loaded.truth.as_ref().map_or("", |t| t.unit));
    let lines = [
        ("penetration", Some((own.penetration, "m"))),
        ("residual", Some((own.residual, "body weights"))),
        ("truth", own.truth.map(|t| (t, unit))),
    ];
    for (name, line) in lines {
        let Some((Tolerance { value, reason }, unit)) = line else { continue };
        text += &format!("  {name:<12} {:>10.4} {unit}: {reason}\n", value);
    }
    Ok(text)
}

/// Runs `steps` steps; the errors of the last `observed` of them, none without steps.
fn settled(world: &mut World, steps: u32, observed: u32) -> Result<Option<Errors>, Error> {
    let mut observation = None;
    for step in 0..steps {
        if step + observed >= steps {
            world.settings.record_impulses = true;
            observation.get_or_insert_with(|| Observation::new(world));
        }
        world.step().map_err(|divergence| Error::invalid("settle", divergence.to_string()))?;
        if let Some(observation) = &mut observation {
            observation.observe(world);
        }
    }
    world.settings.record_impulses = false;
    Ok(observation.map(|o| o.errors()))
}
