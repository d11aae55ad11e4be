//! `simpulse profile`: the time of each phase of a step, compared with the limits of the machine.

use super::output::{note, print, print_json};
use super::values::{self, LaneArgs, SettingArgs, scene_help};
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::profile::{self, profile, text};
use crate::lab::study::{check_seed, open_scene};
use crate::lab::trial::{Trial, TrialOutcome};
use clap::Args;
use serde_json::json;
use std::process::ExitCode;

/// Time each phase of a step and compare it with the limits of the machine
///
/// Settles the scene and times steps by phase, from the same state again and again. In between, it measures
/// with the same clock how fast memory is read in a working set of the same size, and how many multiply-adds a core
/// does at this lane width. Several scenes, such as one in several sizes, are profiled one after the other.
///
/// Bytes are those that the code requests, from the layout of its records: 4 per float read and again per impulse
/// written, 4 per index, 32 per body row gathered, 16 per body written back; for pairs, collide and color, each input
/// and output once. Operations per contact are those of the source: a multiply-add is two, a division or root one,
/// minima, maxima and selections none. Times of pairs and color are those of steps as they come: most steps reuse
/// pairs and colors.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse profile large_pyramid
  simpulse profile pyramid:10 pyramid:30 pyramid:100 pyramid:300 --solver soft_step
  simpulse profile large_pyramid --solver pgs --lanes 16 --seconds 2

With perf; build with frame pointers for call graphs:
  RUSTFLAGS='-C target-cpu=native -C force-frame-pointers=yes' cargo build --release
  perf record -g -- target/release/simpulse profile large_pyramid --no-ceilings
The steps that settle the scene are in it too: --settle 5 and a long --seconds make them small.")]
pub struct ProfileArgs {
    /// Scenes
    #[arg(value_name = "SCENE", num_args = 1.., required = true, value_parser = values::scene(), help = scene_help())]
    pub scenes: Vec<String>,
    /// Duration of the measurement of a scene (s)
    #[arg(
        help_heading = "Measuring",
        long,
        default_value_t = 5.0,
        value_name = "S",
        allow_negative_numbers = true
    )]
    pub seconds: f64,
    /// Solver, budget and parameters
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Lanes
    #[command(flatten)]
    pub lanes: LaneArgs,
    /// Threads that share each step
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = values::threads())]
    pub threads: usize,
    /// Steps before the state is measured
    #[arg(help_heading = "Scene and time", long, default_value_t = 60, value_name = "STEPS")]
    pub settle: u32,
    /// Random seed of scenes that have one
    #[arg(help_heading = "Scene and time", long)]
    pub seed: Option<u64>,
    /// Skip the measurement of memory bandwidth and arithmetic
    #[arg(help_heading = "Measuring", long)]
    pub no_ceilings: bool,
    /// Print JSON instead of text
    #[arg(help_heading = "Output", long)]
    pub json: bool,
}

/// Steps at the end of settling whose errors are printed.
const OBSERVED_STEPS: u64 = 10;

/// Longest allowed measurement (s).
const MAX_SECONDS: f64 = 86_400.0;

/// Runs the command.
pub fn run(args: &ProfileArgs) -> Result<ExitCode, Error> {
    if !(args.seconds > 0.0 && args.seconds <= MAX_SECONDS) {
        let message = format!("is {}, must be above 0 and at most {MAX_SECONDS}", args.seconds);
        return Err(Error::invalid("seconds", message));
    }
    let settings =
        Settings { threads: args.threads, ..args.setting.settings()?.exactly(args.lanes.or_native()) };
    let open = |name: &String| {
        check_seed(name, args.seed)?;
        Ok(open_scene(name, args.seed, None, None)?.scene)
    };
    let scenes = args.scenes.iter().map(open).collect::<Result<Vec<_>, Error>>()?;
    let mut reports = Vec::new();
    for scene in &scenes {
        note(&format!("settling {}: {} steps; then {} s\n", scene.name, args.settle, args.seconds));
        let own = Settings { record_impulses: true, ..settings.clone() };
        let (steps, measured) = (u64::from(args.settle), OBSERVED_STEPS);
        let settled = Trial { steps, measured, ..Trial::new(scene, own) }.run(&mut |_| Ok(()))?;
        if let Some(divergence) = settled.failure {
            return Err(Error::invalid("settle", divergence.to_string()));
        }
        let TrialOutcome { mut world, errors, .. } = settled;
        world.settings.record_impulses = false;
        let mut report = profile(&world, &scene.name, args.seconds, !args.no_ceilings)?;
        report.errors = errors;
        if args.json {
            reports.push(profile::json(&report));
        } else {
            print(&format!("{}\n", text::text(&report)))?;
        }
    }
    match reports.as_slice() {
        [] => Ok(ExitCode::SUCCESS),
        [report] => print_json(report),
        reports => print_json(&json!({ "profiles": reports })),
    }
}
