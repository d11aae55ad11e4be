//! The command line: what can be asked for.

use crate::cli::advise::AdviseArgs;
use crate::cli::capture::CaptureArgs;
use crate::cli::converge::ConvergeArgs;
use crate::cli::growth::GrowthArgs;
use crate::cli::profile::ProfileArgs;
use crate::cli::replay::ReplayArgs;
use crate::cli::report::ReportArgs;
use crate::cli::setting::SettingArgs;
use crate::cli::snapshot::SnapshotArgs;
use crate::cli::verify::VerifyArgs;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::solvers::{VARIANTS, Variant, find};
use crate::engine::world::Order;
use crate::lab::advise::limits::quantity;
use crate::lab::error::Error;
use crate::lab::overrides::Override;
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::study::StudyPlan;
use crate::lab::study::budget::BudgetGrid;
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  simpulse                                       the default study, into results/
  simpulse --quick                               a look at everything, in seconds
  simpulse study --scenes stack:40,arch --solvers soft_step,pgs --lanes 1,8 --substeps 2,4,8
  simpulse run pyramid:50 --solver soft_step --lanes 16
  simpulse scene arch --json > my.json           a scene to edit …
  simpulse run my.json --state out.csv --every 10     … and to run";

const STUDY_EXAMPLES: &str = "\
Without any budget option, each solver runs at half its standard budget, at that budget,
and at its double. With some, every combination runs; what a solver ignores is left out.

Examples:
  simpulse study --quick
  simpulse study --scenes pyramid:40 --solvers soft_step --lanes 1,4,8,16 --substeps 4,8
  simpulse study --scenes stack:20,my.json --velocity-iterations 4,16,64 --out results/stack";

/// A laboratory for 2D contact solvers: how fast are they, and how wrong?
///
/// Without a command, runs the default study: every solver on scenes whose truth is known
/// or that are hard, at lane widths 1, 4, 8 and 16 and three budgets each. It prints a table
/// per scene and writes report.html, study.csv, study.json, speed_vs_error.svg and
/// profiles.svg.
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
    /// Draw one frame of a scene as SVG or PNG
    Snapshot(SnapshotArgs),
    /// Make a page that plays recordings side by side
    Replay(ReplayArgs),
    /// Make the page of a study again, from its records
    Report(ReportArgs),
    /// Run one scene; print the time of each phase and the errors
    Run(RunArgs),
    /// Find the cheapest setting within given tolerances on a scene
    Advise(AdviseArgs),
    /// Freeze the contact problem of one step in a file
    Capture(CaptureArgs),
    /// Count the iterations every solver needs on one frozen problem
    Converge(ConvergeArgs),
    /// Run the hard cases whose truth is known
    Verify(VerifyArgs),
    /// Repeat one phase of a step and compare it with the roofline
    Profile(ProfileArgs),
    /// Measure the cost of a contact from a thousand contacts to a million
    Growth(GrowthArgs),
    /// List the scenes
    Scenes,
    /// List the solvers
    Solvers,
    /// Describe a scene, or print it as a file to edit
    Scene(SceneArgs),
}

/// Lists are separated by commas.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// Scenes (`simpulse scenes` lists them), with a size after a colon, or .json files
    #[arg(long, value_delimiter = ',', value_name = "SCENE,…")]
    pub scenes: Vec<String>,
    /// Solvers (`simpulse solvers` lists them)
    #[arg(long, value_delimiter = ',', value_name = "SOLVER,…")]
    pub solvers: Vec<String>,
    /// Lane widths: 1, 4, 8, 16 [default: 1, 4, 8, and 16 where this build has instructions for it]
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub lanes: Vec<usize>,
    /// Constraint orders: natural, colored
    #[arg(long, value_delimiter = ',', value_name = "ORDER,…")]
    pub orders: Vec<String>,
    /// Substeps to try
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub substeps: Vec<u32>,
    /// Velocity sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub velocity_iterations: Vec<u32>,
    /// Relaxing sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub relax_iterations: Vec<u32>,
    /// Position sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub position_iterations: Vec<u32>,
    /// Parameters of solvers, as `contact_hertz=60` (`simpulse solvers` lists them)
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
    /// Tolerances in the place of each scene's own, as penetration=5mm,residual=0.05,truth=0.1
    /// (`simpulse scene NAME` lists them; a truth in its own unit)
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
    /// Folder for the results
    #[arg(long, default_value = "results", value_name = "FOLDER")]
    pub out: PathBuf,
}

/// A run of one scene with one solver.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  simpulse run stack:20
  simpulse run arch --solver pgs --velocity-iterations 32
  simpulse run my.json --steps 600 --state out.csv --contacts contacts.csv --every 60")]
pub struct RunArgs {
    /// A scene of `simpulse scenes`, or a .json file
    pub scene: String,
    /// How it runs
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Steps [default: those of the scene]
    #[arg(long, value_name = "N")]
    pub steps: Option<u32>,
    /// Write step,time,body,x,y,angle,vx,vy,omega; angles count whole turns
    #[arg(long, value_name = "FILE.csv")]
    pub state: Option<PathBuf>,
    /// Write contact points with their impulses (N·s over the step)
    #[arg(long, value_name = "FILE.csv")]
    pub contacts: Option<PathBuf>,
    /// Write a recording for `simpulse replay`
    #[arg(long, value_name = "FILE")]
    pub record: Option<PathBuf>,
    /// Keep contact points and impulses in the recording, too
    #[arg(long, requires = "record")]
    pub record_contacts: bool,
    /// Write every K-th step [default: of CSV files the last step only, of a recording all]
    #[arg(long, value_name = "K")]
    pub every: Option<u32>,
}

/// A scene to look at.
#[derive(Args, Debug)]
pub struct SceneArgs {
    /// A scene of `simpulse scenes`, or a .json file
    pub name: String,
    /// Print it in the file format
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
        let names = or(&self.solvers, VARIANTS.iter().map(|v| v.name.to_string()).collect());
        let orders = or(&self.orders, vec!["natural".into(), "colored".into()]);
        let widths = if self.lanes.is_empty() { base.widths } else { widths(&self.lanes)? };
        Ok(StudyPlan {
            scenes: or(&self.scenes, base.scenes),
            solvers: names.iter().map(|n| find(n)).collect::<Result<Vec<&'static Variant>, _>>()?,
            widths,
            orders: orders.iter().map(|o| order(o)).collect::<Result<_, _>>()?,
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
            "truth" => (&mut tolerances.truth, ""),
            other => {
                let known = ["penetration", "residual", "truth"].into_iter();
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

fn widths(lanes: &[usize]) -> Result<Vec<LaneWidth>, Error> {
    let mut widths = lanes.iter().map(|&n| width(n)).collect::<Result<Vec<_>, _>>()?;
    widths.sort();
    widths.dedup();
    Ok(widths)
}

/// The width of `lanes` lanes.
pub fn width(lanes: usize) -> Result<LaneWidth, Error> {
    let refused = || Error::invalid("lanes", format!("{lanes} is none of 1, 4, 8, 16"));
    LaneWidth::from_lanes(lanes).ok_or_else(refused)
}

/// The width of `lanes` lanes; where none are given, the widest that this build has instructions for.
pub fn width_or_native(lanes: Option<usize>) -> Result<LaneWidth, Error> {
    lanes.map_or(Ok(native_width()), width)
}

/// The constraint order of that name.
pub fn order(name: &str) -> Result<Order, Error> {
    match name {
        "natural" => Ok(Order::Natural),
        "colored" | "coloured" => Ok(Order::Colored),
        _ => Err(Error::unknown("order", name, ["natural", "colored"].into_iter())),
    }
}
