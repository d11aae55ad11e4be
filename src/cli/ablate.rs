//! `simpulse ablate`: the effect of leaving out each mechanism of a solver.

use super::output::{print, print_json, value};
use super::progress::Bar;
use super::values;
use crate::engine::solvers::{DEFAULT, VARIANTS, Variant};
use crate::lab::ablate::{self, AblationPlan};
use crate::lab::error::Error;
use crate::lab::verify;
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use std::process::ExitCode;

/// Leave out each mechanism of a solver in turn, and show what is lost
///
/// The entry of a solver lists its mechanisms. Each is left out alone. The output lists the hard cases that
/// then fail, and the lines of code of the mechanism. On some scenes it compares overlap, speed at rest and
/// time with those of the whole solver; both are stepped interleaved.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse ablate shim
  simpulse ablate shim --mechanisms frames,jams --scenes disc_column:30 --steps 900
  simpulse verify --solvers shim --without frames     the cases in full")]
pub struct AblateArgs {
    /// Solver
    #[arg(default_value = DEFAULT, value_name = "SOLVER", value_parser = values::solver())]
    pub solver: &'static Variant,
    /// Mechanisms [default: all]
    #[arg(long, value_delimiter = ',', value_name = "NAME,…", value_parser = NonEmptyStringValueParser::new())]
    pub mechanisms: Vec<String>,
    /// Cases (B4.heavy) or families of cases (B4) [default: all]
    #[arg(long, value_delimiter = ',', value_name = "ID,…", value_parser = NonEmptyStringValueParser::new())]
    pub cases: Vec<String>,
    /// Scenes on which errors and times are compared
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "SCENE,…",
        default_value = "stack:20,pyramid:20,card_house,arch,circle_pile:200"
    )]
    pub scenes: Vec<String>,
    /// Steps of each scene
    #[arg(long, default_value_t = 300, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub steps: u32,
    /// Threads; results other than times do not depend on them
    #[arg(long, default_value_t = 2, value_name = "N", value_parser = clap::value_parser!(u8).range(1..))]
    pub threads: u8,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
pub fn run(args: &AblateArgs) -> Result<ExitCode, Error> {
    let solver = args.solver;
    if solver.mechanisms.is_empty() {
        let having = VARIANTS.iter().filter(|v| !v.mechanisms.is_empty()).map(|v| v.name).collect::<Vec<_>>();
        let message = format!("{} names no mechanisms; solvers that do: {}", solver.name, having.join(", "));
        return Err(Error::invalid("ablate", message));
    }
    let mechanisms = match args.mechanisms.is_empty() {
        true => (0..solver.mechanisms.len()).collect(),
        false => args.mechanisms.iter().map(|name| solver.mechanism(name)).collect::<Result<Vec<_>, _>>()?,
    };
    let plan = AblationPlan {
        solver,
        mechanisms,
        cases: verify::select(&args.cases)?,
        scenes: args.scenes.clone(),
        steps: args.steps,
        threads: args.threads.into(),
    };
    let bar = Bar::new();
    let rows = ablate::run(&plan, &|done, total, what: &str| bar.show(done, total, what))?;
    drop(bar);
    if args.json {
        return print_json(&value(&rows)?).map(|_| ExitCode::SUCCESS);
    }
    print(&ablate::text(&rows))
}
