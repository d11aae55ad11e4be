//! `simpulse converge`: every solver on exactly the same contact problem.

use super::capture::freeze;
use super::output::{note, print};
use super::progress::Bar;
use super::values::{self, LaneArgs, SettingArgs, Solvers};
use crate::lab::converge::{ConvergeOptions, converge_watched, plot, summary, table};
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::overrides::{self, Override};
use crate::lab::reference::frozen::Frozen;
use crate::lab::report::style::Style;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Count the iterations every solver needs on one frozen problem
///
/// Runs every solver on exactly the same contact problem, with 1, 2, 3, … iterations, in natural, colored and
/// shuffled order, from zero and warm. Warm starts are the impulses of the step before, if the problem has them;
/// otherwise those of its certified reference, each changed by up to 10 %. Solvers with internal state first run 60
/// steps on the previous step's problem. The output says which solver has no warm curve, and why.
///
/// Prints the iterations, sweeps and times to residuals 1e-1 to 1e-6, the asymptotic rate, and the
/// distance of the velocities from the certified reference. A dash means that a tolerance was not
/// reached. Ends with a summary: sweeps per solver, next to the f64 Gauss–Seidel rate.
///
/// The residual is measured against two laws: the rigid contact law, which is the same for all, and
/// the law that the solver itself set out to solve (soft contacts, position feedback, no friction).
/// Where the two differ, a solver has two rows. Methods in f64 follow for comparison.
///
/// Writes converge.csv (every point), converge.json (everything) and converge.svg (curves).
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse converge tests/frozen/disc-column-10.frozen
      A column of ten discs: the rate of Gauss-Seidel is cos²(π/20) = 0.9755.
  simpulse converge pyramid:10 --step 120 --solvers pgs,soft_step
      Freezes the step itself; only two solvers.
  simpulse converge pyramid.frozen --repeats 0 --out results
      No timing, so that the output is the same on every run.")]
pub struct ConvergeArgs {
    /// Frozen problem (a file, not ending in .json), or a scene as for `simpulse capture`
    #[arg(value_name = "FILE|SCENE", value_parser = values::scene())]
    pub problem: String,
    /// Step to freeze if a scene is given, counted from 1
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    pub step: u64,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Maximum iterations
    #[arg(long, value_name = "K", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub max_iterations: u32,
    /// Lanes in colored order
    #[command(flatten)]
    pub lanes: LaneArgs,
    /// Solver parameters, such as `contact_hertz=60` (`simpulse list solvers` lists them)
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
    /// Seed of the shuffled order
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Timing runs per curve; 0 skips timing
    #[arg(long, value_name = "N", default_value_t = 15)]
    pub repeats: u32,
    /// Folder for converge.csv, converge.json and converge.svg
    #[arg(long, value_name = "FOLDER", default_value = "results")]
    pub out: PathBuf,
    /// Print JSON instead of text: what converge.json holds
    #[arg(long)]
    pub json: bool,
}

impl ConvergeArgs {
    fn options(&self) -> Result<ConvergeOptions, Error> {
        let solvers = self.solvers.chosen();
        overrides::check(&solvers, &self.set)?;
        note(&overrides::partly(&solvers, &self.set));
        Ok(ConvergeOptions {
            solvers,
            max_iterations: self.max_iterations,
            seed: self.seed,
            width: self.lanes.or_native(),
            overrides: self.set.clone(),
            rounds: self.repeats,
            baseline: true,
        })
    }
}

/// Runs the command.
pub fn run(args: &ConvergeArgs) -> Result<ExitCode, Error> {
    let options = args.options()?;
    let path = files::path_of(&args.problem);
    let is_frozen = args.problem.ends_with(".frozen") || path.is_file() && !args.problem.ends_with(".json");
    let frozen = if is_frozen {
        Frozen::read(&path)?
    } else {
        let (frozen, why_not) = freeze(&args.problem, args.step, &SettingArgs::standard()?)?;
        if let Some(why) = why_not {
            note(&format!("{why}\n"));
        }
        frozen
    };
    // Fail before the long computation, not after it.
    files::prepare_folder(&args.out)?;
    let bar = Bar::new();
    let tell = |done: usize, parts: usize, what: &str| bar.show(done, parts, what);
    let report = converge_watched(&frozen.problem, frozen.reference.as_ref(), &options, &tell)?;
    drop(bar);
    let json = table::json(&report)?;
    let files = [
        ("converge.csv", table::csv(&report)?),
        ("converge.json", json.clone()),
        ("converge.svg", plot::svg(&report, &Style::of)),
    ];
    for (name, text) in &files {
        files::write(&args.out.join(name), text.as_bytes())?;
    }
    if args.json {
        return print(&json);
    }
    let names = files.map(|f| f.0).join(", ");
    let text = table::text(&report) + "\n" + &summary::text(&report) + &values::left_out(&options.solvers);
    print(&format!("{text}wrote {names} in {}\n", args.out.display()))
}
