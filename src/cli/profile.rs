//! `simpulse profile`: repeats one phase of a step.

use super::output::{note, print, print_json};
use super::settled;
use super::values::{self, LaneArgs, SettingArgs, scene_help};
use crate::engine::clock::Phase;
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::files::Pending;
use crate::lab::profile::{ProfileOptions, profile, records, roofline, text};
use crate::lab::report::table::error_line;
use crate::lab::study::open_scene;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Repeat one phase of a step and compare it with the roofline
///
/// Settles the scene, freezes its state and repeats one phase on it, or all phases in turn. Between repeats, it
/// measures with the same clock how fast memory can be read and updated in a working set of the same size, and how
/// many multiply-adds a core does at this lane width.
///
/// Bytes are those that the code requests: 4 per float of a record read and again per impulse written, 4 per index,
/// 32 per body row gathered, 16 per body written back; for pairs, collide and color, each input and output once.
/// Operations are counted, by running the same kernel on a lane that counts: a multiply-add is two, a division or
/// root one, minima, maxima and selections none. Counts follow the source; the compiler removes about 2 % as dead
/// code. In prepare and restitution only operations in lanes are counted.
///
/// Velocities and impulses that repeats change are restored every 100 repeats, outside the measured time. In pairs
/// and color every repeat searches all pairs and recomputes colors; a step does so only when many shapes left their
/// bounds, or contacts appeared or disappeared.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse profile large_pyramid --phase solve
  simpulse profile pyramid:30 --phase all --roofline roofline.svg
  simpulse profile large_pyramid --solver pgs --lanes 16 --phase solve --seconds 2

With perf, which then sees the phase and nothing else; build with frame pointers for call graphs:
  RUSTFLAGS='-C target-cpu=native -C force-frame-pointers=yes' cargo build --release
  perf record -g -- target/release/simpulse profile large_pyramid --phase relax --no-ceilings
  perf stat -e cycles:u,instructions:u -- target/release/simpulse profile pyramid:30 --phase solve --no-ceilings
The steps that settle the scene are in it too: --settle 5 and a long --seconds make them small.")]
pub struct ProfileArgs {
    /// Scene
    #[arg(value_name = "SCENE", value_parser = values::scene(), help = scene_help())]
    pub scene: String,
    /// The phase to repeat, or `all` in turn
    #[arg(long, default_value = "all", value_name = "PHASE", value_parser = phase())]
    pub phase: Which,
    /// Duration of the measurement (s)
    #[arg(long, default_value_t = 5.0, value_name = "S", allow_negative_numbers = true)]
    pub seconds: f64,
    /// Solver, budget and parameters
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Lanes
    #[command(flatten)]
    pub lanes: LaneArgs,
    /// Steps before the state is frozen
    #[arg(long, default_value_t = 60, value_name = "STEPS")]
    pub settle: u32,
    /// Random seed of scenes that have one
    #[arg(long)]
    pub seed: Option<u64>,
    /// Skip the measurement of memory bandwidth and arithmetic
    #[arg(long)]
    pub no_ceilings: bool,
    /// Write the roofline plot (SVG): operations per byte against operations per second
    #[arg(long, value_name = "FILE.svg")]
    pub roofline: Option<PathBuf>,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Steps at the end of settling whose errors are printed.
const OBSERVED_STEPS: u32 = 10;

/// Longest allowed measurement (s).
const MAX_SECONDS: f64 = 86_400.0;

/// Names of all phases, as `--phase` accepts them.
fn names(phases: impl Iterator<Item = Phase>) -> String {
    phases.map(key).chain(["all".to_string()]).collect::<Vec<_>>().join(", ")
}

/// Name of a phase on the command line: `warm-start` for the phase that tables call `warm start`.
fn key(phase: Phase) -> String {
    phase.name().replace(' ', "-")
}

/// Which phases to repeat.
#[derive(Clone, Copy, Debug)]
pub enum Which {
    /// Every phase, in turn.
    All,
    /// One alone.
    One(Phase),
}

/// The parser of `--phase`.
fn phase() -> impl TypedValueParser<Value = Which> {
    let names = Phase::ALL.into_iter().map(|p| PossibleValue::new(key(p)));
    let all = [PossibleValue::new("all")];
    PossibleValuesParser::new(names.chain(all))
        .map(|name| Phase::ALL.into_iter().find(|&p| key(p) == name).map_or(Which::All, Which::One))
}

fn settings(args: &ProfileArgs) -> Result<Settings, Error> {
    Ok(args.setting.settings()?.exactly(args.lanes.or_native()))
}

/// Runs the command.
pub fn run(args: &ProfileArgs) -> Result<ExitCode, Error> {
    let phases = match args.phase {
        Which::All => Phase::ALL.to_vec(),
        Which::One(phase) => vec![phase],
    };
    if !(args.seconds > 0.0 && args.seconds <= MAX_SECONDS) {
        let message = format!("is {}, must be above 0 and at most {MAX_SECONDS}", args.seconds);
        return Err(Error::invalid("seconds", message));
    }
    if args.roofline.is_some() && args.no_ceilings {
        return Err(Error::invalid("roofline", "needs the ceilings that --no-ceilings skips"));
    }
    let settings = settings(args)?;
    let scene = open_scene(&args.scene, args.seed, None, None)?.scene;
    // Fail before the long measurement, not after it.
    let file = args.roofline.as_deref().map(Pending::new).transpose()?;
    note(&format!("settling {}: {} steps\n", scene.name, args.settle));
    let mut world = scene.build(settings)?;
    let errors = settled(&mut world, args.settle, OBSERVED_STEPS)?;
    let mut frozen = world.hold();
    let probes = frozen.probes();
    let missing = |phase: &&Phase| probes.iter().all(|p| p.phase != **phase);
    if let [phase] = phases.as_slice()
        && missing(&phase)
    {
        let has = names(probes.iter().map(|p| p.phase));
        let message = format!(
            "'{}' is none of what {} does on {}: {has}",
            key(*phase),
            args.setting.solver.name,
            scene.name
        );
        return Err(Error::invalid("phase", message));
    }
    let what = if let [phase] = phases.as_slice() { phase.name() } else { "every phase in turn" };
    let rest = if args.no_ceilings { "nothing else" } else { "the machine's ceilings between" };
    note(&format!("repeating {what} for {} s, {rest} (process {})\n", args.seconds, std::process::id()));
    let options = ProfileOptions { phases, seconds: args.seconds, ceilings: !args.no_ceilings };
    let report = profile(&mut frozen, &probes, &scene.name, &options);
    let json = args.json.then(|| records::json(&report, errors.as_ref()));
    let mut out = text::head(&report) + &error_line(errors.as_ref()) + "\n" + &text::text(&report);
    if let (Some(mut file), Some(path)) = (file, &args.roofline) {
        file.write_all(roofline::svg(&report)?.as_bytes()).map_err(Error::io(path))?;
        file.commit()?;
        out += &format!("\nwrote {}\n", path.display());
    }
    match json {
        Some(json) => print_json(&json),
        None => print(&out),
    }
}
