//! `simpulse converge`: every solver on exactly the same contact problem.

use super::output::{note, print, print_beside, print_json, value};
use super::progress::Bar;
use super::values::{self, LaneArgs, SettingArgs, Solvers};
use crate::lab::capture::capture;
use crate::lab::converge::{ConvergeOptions, converge_watched, plot, table};
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::overrides;
use crate::lab::reference::ContactProblem;
use crate::lab::reference::certify::{Reference, reference};
use crate::lab::reference::frozen::Frozen;
use crate::lab::report::style::Style;
use crate::lab::study::open_scene;
use crate::lab::units::percent;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Count the iterations every solver needs on one frozen problem
///
/// Runs every solver on exactly the same contact problem, with 1, 2, 3, … iterations, in file, parallel and
/// shuffled order, from zero and warm. Warm starts are the impulses of the step before, if the problem has them;
/// otherwise those of its certified reference, each changed by up to 10 %. Solvers with internal state first run 60
/// steps on the previous step's problem. The output says which solver has no warm curve, and why.
///
/// The problem is that of one step of a scene: masses, velocities, Jacobians, gaps, friction and warm-start
/// impulses; and the rows of joints with their errors, springs, motors and bounds. Values stored in f32 are taken
/// exactly. --freeze writes it to a file, with a reference solution if one can be found and certified. With --freeze,
/// --solver, its budget, --set, --impacts and --without say how the steps before are solved; without it, --set
/// applies to the compared solvers.
///
/// Prints which solver needs the fewest sweeps, then a table of at most 20 rows: the sweeps of each to a force error
/// of 1 % and 0.01 %, the factor per iteration at the end, the smallest force error, the distance of the velocities from
/// the certified reference, and the time of an iteration.
///
/// The force error is how far impulses are from the contact law. It is measured against two laws: that of rigid
/// contacts, which is the same for all, and the one that the solver itself set out to solve (soft contacts, position
/// feedback, no friction). Where the two differ, a solver has two rows. Methods in f64 follow for comparison.
///
/// Writes converge.csv (every point), converge.json (everything) and converge.svg (curves).
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse converge tests/frozen/disc-column-10.frozen
      A column of ten discs: the rate of Gauss-Seidel is cos²(π/20) = 0.9755.
  simpulse converge double_domino --step 60 --solvers pgs,soft_step
      Dominoes that fall: freezes the step itself; only two solvers.
  simpulse converge pyramid:10 --step 120 --freeze pyramid.frozen
      Writes the problem of a pyramid that has come to rest after two seconds.
  simpulse converge my_scene.json --step 30 --freeze impact.frozen --solver pgs --velocity-iterations 50
      The same, but with the steps before it solved more accurately.
  simpulse converge pyramid.frozen --repeats 0 --out results
      No timing, so that the output is the same on every run.")]
pub struct ConvergeArgs {
    /// Frozen problem (a file, not ending in .json), or a scene as for `simpulse run`
    #[arg(value_name = "FILE|SCENE", value_parser = values::scene())]
    pub problem: String,
    /// Step to freeze if a scene is given, from 1; the steps before it are run
    #[arg(help_heading = "Scene and time", long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    pub step: u64,
    /// Write the frozen problem of a scene to this file and run no solver on it
    #[arg(help_heading = "Scene and time", long, value_name = "FILE", conflicts_with_all = ["solvers", "max_iterations", "lanes", "seed", "repeats", "out"])]
    pub freeze: Option<PathBuf>,
    /// How the steps before are solved
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Maximum iterations
    #[arg(help_heading = "Measuring", long, value_name = "K", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub max_iterations: u32,
    /// Lanes in parallel order
    #[command(flatten)]
    pub lanes: LaneArgs,
    /// Seed of the shuffled order
    #[arg(help_heading = "Measuring", long, default_value_t = 1)]
    pub seed: u64,
    /// Timing runs per curve; 0 skips timing
    #[arg(help_heading = "Measuring", long, value_name = "N", default_value_t = 15)]
    pub repeats: u32,
    /// Folder for converge.csv, converge.json and converge.svg
    #[arg(help_heading = "Output", long, value_name = "FOLDER", default_value = "results")]
    pub out: PathBuf,
    /// Print JSON instead of text: what converge.json holds, or what --freeze found
    #[arg(help_heading = "Output", long)]
    pub json: bool,
}

/// The problem of a step, with its reference solution; if there is none, the reason why.
///
/// Errors: an unknown scene, an invalid scene file or setting, a run that diverges before the step, a step
/// without contacts and joints.
fn frozen_step(name: &str, step: u64, setting: &SettingArgs) -> Result<(Frozen, Option<String>), Error> {
    let mut world = open_scene(name, None, None, None)?.scene.build(setting.settings()?)?;
    let bar = Bar::new();
    for done in 1..step {
        bar.step(done as usize, step as usize, "steps before");
        world.step().map_err(|divergence| Error::invalid("--step", divergence.to_string()))?;
    }
    let problem = capture(&mut world, format!("{name}, step {step}"));
    if problem.unknowns() == 0 {
        let message = format!("step {step} of '{name}' has no contacts and no joints");
        return Err(Error::invalid("--step", message));
    }
    bar.show(0, 1, format!("looking for a reference of {}", sizes(&problem)));
    Ok(match reference(&problem) {
        Ok(reference) => (Frozen { problem, reference: Some(reference) }, None),
        Err(why) => (Frozen { problem, reference: None }, Some(why.to_string())),
    })
}

/// Numbers of contact points and, if there are any, of joint rows.
fn sizes(problem: &ContactProblem) -> String {
    let points = format!("{} contact points", problem.contacts.len());
    match problem.joint_rows() {
        0 => points,
        rows => format!("{points}, {rows} rows of {} joints", problem.joints.len()),
    }
}

/// Runs the command.
pub fn run(args: &ConvergeArgs) -> Result<ExitCode, Error> {
    let path = Path::new(&args.problem);
    let is_frozen = args.problem.ends_with(".frozen") || path.is_file() && !args.problem.ends_with(".json");
    if let Some(file) = &args.freeze {
        if is_frozen {
            return Err(Error::invalid(
                "--freeze",
                format!("'{}' is a frozen problem already", args.problem),
            ));
        }
        return freeze(args, file);
    }
    let standard = SettingArgs::standard()?;
    let mut before = args.setting.clone();
    let set = std::mem::take(&mut before.work.set);
    let before = before.settings()?;
    if format!("{before:?}") != format!("{:?}", standard.settings()?) {
        let message = "the setting of the steps before; give --freeze FILE, then converge FILE";
        return Err(Error::invalid("--solver, --substeps, --…-iterations, --impacts, --without", message));
    }
    let solvers = args.solvers.chosen();
    overrides::check(&solvers, &set)?;
    note(&overrides::partly(&solvers, &set));
    let frozen = if is_frozen {
        Frozen::read(path)?
    } else {
        let (frozen, why_not) = frozen_step(&args.problem, args.step, &standard)?;
        why_not.iter().for_each(|why| note(&format!("{why}\n")));
        frozen
    };
    // Fail before the long computation, not after it.
    files::prepare_folder(&args.out)?;
    let options = ConvergeOptions {
        solvers,
        max_iterations: args.max_iterations,
        seed: args.seed,
        width: args.lanes.or_native(),
        overrides: set,
        rounds: args.repeats,
        baseline: true,
    };
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
    let text = table::text(&report) + &values::left_out(&options.solvers);
    print(&format!("{text}wrote {names} in {}\n", args.out.display()))
}

fn freeze(args: &ConvergeArgs, file: &Path) -> Result<ExitCode, Error> {
    let (frozen, why_not) = frozen_step(&args.problem, args.step, &args.setting)?;
    frozen.write(file)?;
    let Frozen { problem, reference } = &frozen;
    if args.json {
        let certificate = reference.as_ref().map(|r| value(&r.certificate)).transpose()?;
        return print_json(&json!({
            "problem": problem.name,
            "bodies": problem.bodies.len(),
            "contact_points": problem.contacts.len(),
            "joints": problem.joints.len(),
            "joint_rows": problem.joint_rows(),
            "file": file.display().to_string(),
            "certificate": certificate,
            "no_reference_because": why_not,
        }));
    }
    let found = match (reference, why_not) {
        (Some(Reference { certificate: c, .. }), _) => {
            format!("reference: {}, force error {}", c.method, percent(c.natural_map))
        }
        (None, why) => format!("written without a reference: {}", why.unwrap_or_default()),
    };
    let (name, bodies, sizes) = (&problem.name, problem.bodies.len(), sizes(problem));
    let text = format!("{name}: {bodies} bodies, {sizes}, written to {}\n{found}\n", file.display());
    print_beside([file], &text)
}
