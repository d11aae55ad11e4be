//! `simpulse capture`: freezes the contact problem of one step.

use super::terminal::{note, print_beside};
use crate::engine::params::Budget;
use crate::engine::solvers::{self, DEFAULT};
use crate::engine::world::{Settings, World};
use crate::lab::capture::capture;
use crate::lab::error::Error;
use crate::lab::reference::certify::reference;
use crate::lab::reference::frozen::Frozen;
use crate::lab::study::open_scene;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Freeze the contact problem of one step of a scene
///
/// Runs the scene up to the given step and writes the contact problem that this step is about to
/// solve: masses, velocities, Jacobians, gaps, friction and warm-start impulses. What the
/// simulation stores in f32 is kept to the last bit. If a reference solution can be found and
/// certified, it is written too; if not, the problem is written without it.
///
/// The file is for `simpulse converge`, which runs every solver on exactly this problem.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse capture pyramid:10 --step 120 -o pyramid.frozen
      A pyramid that has come to rest in two seconds.
  simpulse capture my_scene.json --step 30 -o impact.frozen --solver pgs --velocity-iterations 50
      The same, but with the steps before it solved more accurately.")]
pub struct CaptureArgs {
    /// Scene of the catalogue, with its size after a colon (`pyramid:10`), or a JSON file
    #[arg(value_name = "SCENE")]
    pub scene: String,
    /// Step whose problem to freeze, from 1; the steps before it are run
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = clap::value_parser!(u64).range(1..))]
    pub step: u64,
    /// File to write
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// How the steps before are solved
    #[command(flatten)]
    pub run: RunArgs,
}

/// How the steps before the captured one are solved.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// Solver of the steps before
    #[arg(long, value_name = "NAME", default_value = DEFAULT)]
    pub solver: String,
    /// Substeps per step, instead of the solver's standard
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    pub substeps: Option<u32>,
    /// Velocity sweeps per substep, instead of the solver's standard
    #[arg(long, value_name = "K")]
    pub velocity_iterations: Option<u32>,
    /// Relaxing sweeps per substep, instead of the solver's standard
    #[arg(long, value_name = "K")]
    pub relax_iterations: Option<u32>,
    /// Position sweeps per substep, instead of the solver's standard
    #[arg(long, value_name = "K")]
    pub position_iterations: Option<u32>,
}

impl Default for RunArgs {
    fn default() -> Self {
        RunArgs {
            solver: DEFAULT.into(),
            substeps: None,
            velocity_iterations: None,
            relax_iterations: None,
            position_iterations: None,
        }
    }
}

impl RunArgs {
    fn settings(&self) -> Result<Settings, Error> {
        let solver = solvers::find(&self.solver)?;
        let standard = solver.budget;
        let budget = Budget {
            substeps: self.substeps.unwrap_or(standard.substeps),
            velocity_iterations: self.velocity_iterations.unwrap_or(standard.velocity_iterations),
            relax_iterations: self.relax_iterations.unwrap_or(standard.relax_iterations),
            position_iterations: self.position_iterations.unwrap_or(standard.position_iterations),
        };
        Ok(Settings { budget, ..Settings::new(solver) })
    }
}

/// Contact points from which on a reference may take seconds.
const PATIENCE: usize = 300;

/// The problem of step `step` of a scene, with its reference if there is one, and if not, why.
///
/// Errors: an unknown scene or solver, a file that is no scene, step 0, a run that diverges before
/// the step, a step without contacts.
pub fn freeze(name: &str, step: u64, run: &RunArgs) -> Result<(Frozen, Option<String>), Error> {
    let mut world = open_scene(name, None, None, None)?.scene.build(run.settings()?)?;
    advance(&mut world, step)?;
    let problem = capture(&mut world, format!("{name}, step {step}"));
    if problem.contacts.is_empty() {
        return Err(Error::invalid("--step", format!("step {step} of '{name}' has no contacts")));
    }
    if problem.contacts.len() > PATIENCE {
        note(&format!("looking for a reference of {} contact points\n", problem.contacts.len()));
    }
    Ok(match reference(&problem) {
        Ok(reference) => (Frozen { problem, reference: Some(reference) }, None),
        Err(why) => (Frozen { problem, reference: None }, Some(why.to_string())),
    })
}

/// Runs the steps before `step`.
fn advance(world: &mut World, step: u64) -> Result<(), Error> {
    if step == 0 {
        return Err(Error::invalid("--step", "steps are counted from 1, is 0"));
    }
    for _ in 1..step {
        world.step().map_err(|divergence| Error::invalid("--step", divergence.to_string()))?;
    }
    Ok(())
}

/// Runs the command.
pub fn run(args: &CaptureArgs) -> Result<ExitCode, Error> {
    let (frozen, why_not) = freeze(&args.scene, args.step, &args.run)?;
    frozen.write(&args.output)?;
    let Frozen { problem, reference } = &frozen;
    let mut text = format!(
        "{}: {} bodies, {} contact points, written to {}\n",
        problem.name,
        problem.bodies.len(),
        problem.contacts.len(),
        args.output.display()
    );
    match (reference, why_not) {
        (Some(reference), _) => {
            let c = &reference.certificate;
            text += &format!("reference: {}, natural-map residual {:.1e}\n", c.method, c.natural_map);
        }
        (None, Some(why)) => text += &format!("written without a reference: {why}\n"),
        (None, None) => {}
    }
    print_beside([args.output.as_path()], &text)
}
