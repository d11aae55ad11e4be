//! `simpulse capture`: freezes the contact problem of one step.

use super::output::{print_beside, print_json, value};
use super::progress::Bar;
use super::values::{self, SettingArgs, scene_help};
use crate::engine::world::World;
use crate::lab::capture::capture;
use crate::lab::error::Error;
use crate::lab::reference::ContactProblem;
use crate::lab::reference::certify::reference;
use crate::lab::reference::frozen::Frozen;
use crate::lab::study::open_scene;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;

/// Freeze the contact problem of one step of a scene, joints included
///
/// Runs the scene up to the given step and writes the contact problem that this step is about to solve:
/// masses, velocities, Jacobians, gaps, friction and warm-start impulses; and the rows of joints with their
/// errors, springs, motors and bounds. Values stored in f32 are written exactly. If a reference solution can
/// be found and certified, it is written too; otherwise the problem is written without one.
///
/// `simpulse converge` reads the file and runs every solver on exactly this problem.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse capture pyramid:10 --step 120 -o pyramid.frozen
      A pyramid that has come to rest after two seconds.
  simpulse capture my_scene.json --step 30 -o impact.frozen --solver pgs --velocity-iterations 50
      The same, but with the steps before it solved more accurately.")]
pub struct CaptureArgs {
    /// Scene
    #[arg(value_name = "SCENE", value_parser = values::scene(), help = scene_help())]
    pub scene: String,
    /// Step whose problem to freeze, from 1; the steps before it are run
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    pub step: u64,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// How the steps before are solved
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// The problem of step `step` of a scene, with its reference solution; if there is none, the reason why.
///
/// Errors: an unknown scene or solver, an invalid scene file, step 0, a run that diverges before the step, a
/// step without contacts and joints.
pub fn freeze(name: &str, step: u64, setting: &SettingArgs) -> Result<(Frozen, Option<String>), Error> {
    let mut world = open_scene(name, None, None, None)?.scene.build(setting.settings()?)?;
    let bar = Bar::new();
    advance(&mut world, step, &bar)?;
    let problem = capture(&mut world, format!("{name}, step {step}"));
    if problem.unknowns() == 0 {
        return Err(Error::invalid(
            "--step",
            format!("step {step} of '{name}' has no contacts and no joints"),
        ));
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

/// Runs the steps before `step`.
fn advance(world: &mut World, step: u64, bar: &Bar) -> Result<(), Error> {
    if step == 0 {
        return Err(Error::invalid("--step", "steps are counted from 1, is 0"));
    }
    for done in 1..step {
        bar.step(done as usize, step as usize, "steps before");
        world.step().map_err(|divergence| Error::invalid("--step", divergence.to_string()))?;
    }
    Ok(())
}

/// Runs the command.
pub fn run(args: &CaptureArgs) -> Result<ExitCode, Error> {
    let (frozen, why_not) = freeze(&args.scene, args.step, &args.setting)?;
    frozen.write(&args.out)?;
    let Frozen { problem, reference } = &frozen;
    if args.json {
        let certificate = reference.as_ref().map(|r| value(&r.certificate)).transpose()?;
        return print_json(&json!({
            "problem": problem.name,
            "bodies": problem.bodies.len(),
            "contact_points": problem.contacts.len(),
            "joints": problem.joints.len(),
            "joint_rows": problem.joint_rows(),
            "file": args.out.display().to_string(),
            "certificate": certificate,
            "no_reference_because": why_not,
        }));
    }
    let mut text = format!(
        "{}: {} bodies, {}, written to {}\n",
        problem.name,
        problem.bodies.len(),
        sizes(problem),
        args.out.display()
    );
    text += &match (reference, why_not) {
        (Some(reference), _) => {
            let c = &reference.certificate;
            format!("reference: {}, natural-map residual {:.1e}\n", c.method, c.natural_map)
        }
        (None, Some(why)) => format!("written without a reference: {why}\n"),
        (None, None) => String::new(),
    };
    print_beside([args.out.as_path()], &text)
}
