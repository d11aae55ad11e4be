//! The command line, a file per command: arguments in, files and text out.
//!
//! Exit code 0 is success, 1 a simulation that diverged or a comparison that found a regression, 2 an invalid
//! request, 130 a signal.

pub mod advise;
pub mod args;
pub mod compare;
pub mod converge;
mod copies;
pub mod interrupt;
pub mod list;
pub mod output;
pub mod picture;
pub mod profile;
pub mod progress;
pub mod random;
pub mod record;
pub mod run;
mod sheets;
pub mod study;
pub mod times;
mod trace;
pub mod values;
pub mod verify;
pub mod view;

use crate::engine::lanes::unused_cpu_features;
use crate::lab::error::Error;
use args::{Cli, Command, CompletionArgs};
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser};
use output::{note, print};
use std::io::ErrorKind;
use std::process::ExitCode;

/// Commands of earlier versions, and what does the same now.
const FORMER: [(&str, &str); 16] = [
    ("merge", "study --merge DIR…"),
    ("report", "study --from DIR"),
    ("savings", "study --features all"),
    ("growth", "study --sweep size=…"),
    ("snapshot", "run SCENE --picture FILE.svg"),
    ("replay", "run SCENE --solvers A,B --record FILE.html"),
    ("capture", "converge SCENE --freeze FILE"),
    ("ablate", "verify --without all"),
    ("torture", "verify --random N"),
    ("agree", "cargo test --release --test lab agree"),
    ("papers", "cargo test --release --test lab papers"),
    ("scenes", "list scenes"),
    ("scene", "list SCENE"),
    ("solvers", "list solvers"),
    ("columns", "list columns"),
    ("schema", "list schema"),
];

/// Parses the command line, runs the command and prints the result. See the [module](self) for exit codes.
pub fn main() -> ExitCode {
    interrupt::install();
    let result = match Cli::try_parse() {
        Ok(cli) => execute(cli),
        // Help and version are regular output. For other errors, clap's message is printed on one line.
        Err(error) if !error.use_stderr() => {
            let _ = error.print();
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            let message = former(&error).or(empty(&error)).unwrap_or_else(|| error.to_string());
            note(&format!("error: {}\n", one_line(&message)));
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(code) => code,
        // A closed pipe (`| head`) is not an error.
        Err(Error::Io { source, .. }) if source.kind() == ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("error: {}\n", one_line(&error.to_string())));
            ExitCode::from(2)
        }
    }
}

fn execute(cli: Cli) -> Result<ExitCode, Error> {
    match cli.command {
        None => full_study(&cli.study),
        Some(Command::Study(args)) => full_study(&args),
        Some(Command::Compare(args)) => compare::run(&args),
        Some(Command::Run(args)) => run::run(&args),
        Some(Command::View(args)) => view::run(&args),
        Some(Command::Advise(args)) => advise::run(&args),
        Some(Command::Converge(args)) => converge::run(&args),
        Some(Command::Verify(args)) => verify::run(&args),
        Some(Command::Profile(args)) => profile::run(&args),
        Some(Command::List(args)) => list::run(&args),
        Some(Command::Completions(args)) => completions(&args),
    }
}

/// Runs a study, then lists CPU features that this build does not use.
fn full_study(args: &study::StudyArgs) -> Result<ExitCode, Error> {
    let code = study::run(args)?;
    if let Some(line) = unused_cpu_features() {
        note(&format!("{line}\n"));
    }
    Ok(code)
}

/// The message for a command of an earlier version; `None` for other errors.
fn former(error: &clap::Error) -> Option<String> {
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else { return None };
    let (name, now) = FORMER.iter().find(|(name, _)| name == word)?;
    let command = if now.starts_with("cargo") { now.to_string() } else { format!("simpulse {now}") };
    Some(format!("'{name}' is now: {command}"))
}

/// The message for an empty option value; `None` for other errors. clap has several messages for this case,
/// one of which is about the value ''.
fn empty(error: &clap::Error) -> Option<String> {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let argument = text(ContextKind::InvalidArg).filter(|_| text(ContextKind::InvalidValue) == Some(""))?;
    let (name, value) = argument.split_once(' ').unwrap_or((argument, ""));
    let given: Vec<_> = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect();
    let all =
        given.contains(&format!("{name}=")) || given.windows(2).any(|w| w[0] == name && w[1].is_empty());
    Some(match (value.contains('…'), all) {
        (true, true) => format!("{name}: the list is empty"),
        (true, false) => format!("{name}: a value between the commas is empty"),
        (false, _) => format!("{name}: the value is empty"),
    })
}

/// A message on one line, without its prefix and without advice on usage.
fn one_line(message: &str) -> String {
    let message = message.strip_prefix("error: ").unwrap_or(message);
    let message = message.split("\nUsage:").next().unwrap_or(message);
    let message = message.split("\nFor more information").next().unwrap_or(message);
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn completions(args: &CompletionArgs) -> Result<ExitCode, Error> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "simpulse", &mut script);
    print(&String::from_utf8_lossy(&script))
}
