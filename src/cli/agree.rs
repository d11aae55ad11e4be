//! `simpulse agree`: every solver against its source's method in `f64`.

use super::output::{note, print, print_json, value};
use super::values::{Choice, choice};
use crate::engine::solvers::{VARIANTS, Variant};
use crate::lab::agree::{self, Agreement};
use crate::lab::error::Error;
use crate::lab::files;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare every solver with an independent f64 implementation of its source's method
///
/// Runs both on three small contact problems for 1 to 10 iterations (solvers with substeps: substeps) from
/// the same start, and prints the largest distance of velocities, positions and impulses. Each departure from
/// the source is undone alone in f64, which shows how much it changes the result. Exit code 1: a solver is
/// farther from its source than its entry allows.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse agree
  simpulse agree --solvers nncg,anderson --out results
      Writes curves: agree.csv, agree.json and agree.svg.")]
pub struct AgreeArgs {
    /// Solvers [default: all]
    #[arg(long, value_delimiter = ',', value_name = "SOLVER,…", value_parser = choice())]
    pub solvers: Vec<Choice>,
    /// Folder for agree.csv, agree.json and agree.svg
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Print JSON instead of text: what agree.json holds
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
pub fn run(args: &AgreeArgs) -> Result<ExitCode, Error> {
    let is_asked = |v: &&&'static Variant| {
        let names = |choice: &Choice| match choice {
            Choice::All => true,
            Choice::One(variant) => variant.name == v.name,
        };
        args.solvers.is_empty() || args.solvers.iter().any(names)
    };
    let all: Vec<Agreement> =
        VARIANTS.iter().filter(is_asked).map(|v| agree::agreement(v)).collect::<Result<_, _>>()?;
    let json = value(&all)?;
    if let Some(folder) = &args.out {
        files::prepare_folder(folder)?;
        for (name, text) in [
            ("agree.csv", agree::csv(&all)),
            ("agree.json", format!("{json:#}\n")),
            ("agree.svg", agree::svg(&all)?),
        ] {
            files::write(&folder.join(name), text.as_bytes())?;
        }
        note(&format!("wrote agree.csv, agree.json, agree.svg in {}\n", folder.display()));
    }
    match args.json {
        true => print_json(&json)?,
        false => print(&agree::text(&all))?,
    };
    let within = all.iter().all(|a| a.apart <= a.bound);
    Ok(if within { ExitCode::SUCCESS } else { ExitCode::from(1) })
}
