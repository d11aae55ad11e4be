//! The command line: what can be asked for.

use super::advise::AdviseArgs;
use super::capture::CaptureArgs;
use super::compare::CompareArgs;
use super::converge::ConvergeArgs;
use super::growth::GrowthArgs;
use super::merge::MergeArgs;
use super::profile::ProfileArgs;
use super::replay::ReplayArgs;
use super::report::ReportArgs;
use super::run::RunArgs;
use super::savings::SavingsArgs;
use super::snapshot::SnapshotArgs;
use super::study::Shard;
use super::values::{self, Solvers};
use super::verify::VerifyArgs;
use crate::engine::lanes::LaneWidth;
use crate::engine::world::Order;
use crate::lab::advise::limits::quantity;
use crate::lab::error::Error;
use crate::lab::overrides::Override;
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::study::StudyPlan;
use crate::lab::study::budget::BudgetGrid;
use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  simpulse                                       the default study, into results/
  simpulse --quick                               a look at everything, in seconds
  simpulse study --scenes stack:40,arch --solvers soft_step,pgs --lanes 1,8 --substeps 2,4,8
  simpulse run pyramid:50 --solver soft_step --lanes 16
  simpulse scene arch --json > my.json           a scene to edit …
  simpulse run my.json --state out.csv --every 10     … and to run";

const COMPLETION_EXAMPLES: &str = "\
Examples:
  simpulse completions bash > ~/.local/share/bash-completion/completions/simpulse
  simpulse completions zsh > ~/.zfunc/_simpulse
  simpulse completions fish > ~/.config/fish/completions/simpulse.fish";

const STUDY_EXAMPLES: &str = "\
Without any budget option, each solver runs at half its standard budget, at that budget,
and at its double. With some, every combination runs; what a solver ignores is left out.

Examples:
  simpulse study --quick
  simpulse study --solvers all --out results/all
  simpulse study --scenes pyramid:40 --solvers soft_step --lanes 1,4,8,16 --substeps 4,8
  simpulse study --scenes stack:20,my.json --velocity-iterations 4,16,64 --out results/stack";

/// A laboratory for 2D contact solvers: how fast are they, and how wrong?
///
/// Without a command, runs the default study: a solver of every family on scenes that are hard or
/// whose reference value is known, at lane widths 1, 4, 8 and 16 and three budgets each. It prints
/// the cheapest setting that is good enough on each scene and a ranking, and writes report.html,
/// tables.txt, study.csv, study.json, speed_vs_error.svg and profiles.svg.
#[derive(Parser, Debug)]
#[command(version, after_help = EXAMPLES, max_term_width = 100, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// What to do; a study where none is given.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Choices for the study that runs without a command.
    #[command(flatten)]
    pub study: StudyArgs,
}

/// What to do.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Compare solvers, budgets and lane widths by time and by error
    #[command(after_help = STUDY_EXAMPLES)]
    Study(StudyArgs),
    Compare(CompareArgs),
    Merge(MergeArgs),
    Run(RunArgs),
    Snapshot(SnapshotArgs),
    Replay(ReplayArgs),
    Report(ReportArgs),
    Advise(AdviseArgs),
    Capture(CaptureArgs),
    Converge(ConvergeArgs),
    Verify(VerifyArgs),
    Profile(ProfileArgs),
    Growth(GrowthArgs),
    Savings(SavingsArgs),
    /// List the scenes
    Scenes(ListArgs),
    /// List the solvers
    Solvers(ListArgs),
    /// Describe a scene, or print it as a file to edit
    Scene(SceneArgs),
    /// Describe the columns of every CSV file
    Columns(ListArgs),
    /// Print completions for a shell
    #[command(after_help = COMPLETION_EXAMPLES)]
    Completions(CompletionArgs),
}

/// What lists have in common.
#[derive(Args, Debug)]
pub struct ListArgs {
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// A shell.
#[derive(Args, Debug)]
pub struct CompletionArgs {
    /// Which one
    pub shell: Shell,
}

/// Lists are separated by commas.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// Scenes
    #[arg(long, value_delimiter = ',', value_name = "SCENE,…", help = values::scenes_help())]
    pub scenes: Vec<String>,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Lanes per instruction [default: 1, 4, 8, and 16 where this build has instructions for it;
    /// wider ones are emulated]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = values::lanes())]
    pub lanes: Vec<LaneWidth>,
    /// Constraint orders [default: both]
    #[arg(long, value_delimiter = ',', value_name = "ORDER,…", value_parser = values::order())]
    pub orders: Vec<Order>,
    /// Substeps to try
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub substeps: Vec<u32>,
    /// Velocity sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub velocity_iterations: Vec<u32>,
    /// Relaxation sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub relax_iterations: Vec<u32>,
    /// Position sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub position_iterations: Vec<u32>,
    /// Parameters of solvers, as `contact_hertz=60` (`simpulse solvers` lists them)
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
    /// Tolerances in the place of each scene's own, as penetration=5mm,residual=0.05,reference=0.1
    /// (`simpulse scene NAME` lists them; the reference value's in its own unit)
    #[arg(long, value_delimiter = ',', value_name = "NAME=VALUE,…")]
    pub tolerance: Vec<String>,
    /// Steps of the runs that measure errors [default: those of each scene]
    #[arg(long)]
    pub steps: Option<u32>,
    /// Timing runs of each setting; the best of a scene run twice as often again [default: 3]
    #[arg(long)]
    pub repeats: Option<u32>,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Short runs, nothing repeated: a look at everything in seconds
    #[arg(long)]
    pub quick: bool,
    /// Print the tables of every scene after the answer
    #[arg(long)]
    pub verbose: bool,
    /// Print JSON instead of text: what study.json holds
    #[arg(long)]
    pub json: bool,
    /// Run part I of N: every N-th scene; `simpulse merge` puts the parts together
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Folder for the results
    #[arg(long, default_value = "results", value_name = "FOLDER")]
    pub out: PathBuf,
}

/// A scene to look at.
#[derive(Args, Debug)]
pub struct SceneArgs {
    /// Scene
    #[arg(value_name = "SCENE", help = values::scene_help(), required_unless_present = "schema")]
    pub name: Option<String>,
    /// Print the JSON schema of scene files
    #[arg(long, exclusive = true)]
    pub schema: bool,
    /// Print JSON instead of text: the scene in the file format
    #[arg(long)]
    pub json: bool,
    /// Random seed of scenes that have one
    #[arg(long)]
    pub seed: Option<u64>,
}

impl StudyArgs {
    /// The plan that was asked for. Errors: unknown names, widths that do not exist.
    pub fn plan(&self) -> Result<StudyPlan, Error> {
        let base = if self.quick { StudyPlan::quick() } else { StudyPlan::default() };
        let or = |given: &[String], own: Vec<String>| if given.is_empty() { own } else { unique(given) };
        Ok(StudyPlan {
            scenes: or(&self.scenes, base.scenes),
            solvers: self.solvers.chosen(),
            widths: values::widths(&self.lanes, base.widths),
            orders: if self.orders.is_empty() { base.orders } else { unique(&self.orders) },
            budgets: BudgetGrid {
                substeps: self.substeps.clone(),
                velocity_iterations: self.velocity_iterations.clone(),
                relax_iterations: self.relax_iterations.clone(),
                position_iterations: self.position_iterations.clone(),
            },
            overrides: self.set.clone(),
            tolerances: tolerances(&self.tolerance)?,
            steps: self.steps.or(base.steps),
            timing_steps: base.timing_steps,
            repeats: self.repeats.unwrap_or(base.repeats),
            seed: self.seed,
        })
    }
}

/// Tolerances from `NAME=VALUE`. Errors: an unknown name, a value that is no limit.
fn tolerances(given: &[String]) -> Result<GivenTolerances, Error> {
    let mut tolerances = GivenTolerances::default();
    for text in given {
        let refused = || Error::invalid("tolerance", format!("'{text}' is not NAME=VALUE"));
        let (name, value) = text.split_once('=').ok_or_else(refused)?;
        let (place, unit) = match name.trim() {
            "penetration" => (&mut tolerances.penetration, "m"),
            "residual" => (&mut tolerances.residual, ""),
            "reference" => (&mut tolerances.truth, ""),
            other => {
                let known = ["penetration", "residual", "reference"].into_iter();
                return Err(Error::unknown("tolerance", other, known));
            }
        };
        *place = Some(quantity("tolerance", value, unit)?);
    }
    Ok(tolerances)
}

/// Each value once, in the order given.
fn unique<T: PartialEq + Clone>(values: &[T]) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for value in values {
        if !kept.contains(value) {
            kept.push(value.clone());
        }
    }
    kept
}
