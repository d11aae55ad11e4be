//! `simpulse savings`: measures what kernels gain from specialization.

use super::output::{print, print_json, value};
use super::progress::Bar;
use super::values::{self, ImpactArgs, LaneArgs, solver};
use crate::engine::solvers::{DEFAULT, Variant};
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::report::environment::Environment;
use crate::lab::report::savings::savings_table;
use crate::lab::study::StudyPlan;
use crate::lab::study::savings::savings;
use clap::Args;
use serde_json::json;
use std::process::ExitCode;

/// Measure what kernels save by dropping features that a scene does not use
///
/// Kernels are specialized at compile time by the features of a scene: friction, a second contact point, rotation,
/// restitution. Each feature that a scene does not use is forced on, alone and all together, and timed interleaved
/// with the kernel that the scene gets. Scenes with fewer than 100 contacts are skipped: there the start of a sweep
/// costs more than the sweep.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse savings
  simpulse savings --scenes circle_pile:2000,pyramid:60 --solver pgs --lanes 8")]
pub struct SavingsArgs {
    /// Scenes, with a size after a colon where they have one, or .json files
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "SCENE,…",
        value_parser = values::scene(),
        default_value = "card_house,pyramid:40,circle_pile:500"
    )]
    pub scenes: Vec<String>,
    /// Solver
    #[arg(long, default_value = DEFAULT, value_name = "SOLVER", value_parser = solver())]
    pub solver: &'static Variant,
    /// Lanes
    #[command(flatten)]
    pub lanes: LaneArgs,
    /// Impacts
    #[command(flatten)]
    pub impacts: ImpactArgs,
    /// Timing runs per setting
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub repeats: u32,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Runs the command.
pub fn run(args: &SavingsArgs) -> Result<ExitCode, Error> {
    let plan = StudyPlan {
        scenes: args.scenes.clone(),
        solvers: vec![args.solver],
        widths: vec![args.lanes.or_native()],
        orders: vec![Order::Colored],
        impacts: vec![args.impacts.impacts],
        repeats: args.repeats,
        seed: args.seed,
        ..StudyPlan::default()
    };
    let bar = Bar::new();
    let found = savings(&plan, &|p| bar.show(p.done, p.total, p.what))?;
    drop(bar);
    match args.json {
        true => print_json(&json!({ "environment": Environment::current(), "savings": value(&found)? })),
        false => print(&savings_table(&found)),
    }
}
