//! `simpulse run SCENE --record FILE.html`: a page that plays runs of several solvers side by side.

use super::output::print_beside;
use super::progress::Bar;
use super::run::{RunArgs, how, settings};
use super::values::{self, SettingArgs};
use crate::engine::solvers::Variant;
use crate::engine::world::World;
use crate::lab::error::Error;
use crate::lab::files::Pending;
use crate::lab::recording::page::{MOST, RecordingPanel, page};
use crate::lab::recording::record::{Caption, record_trial};
use crate::lab::report::style::Style;
use crate::lab::study::{check_seed, open_scene};
use crate::lab::trial::Trial;
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Options of a recording.
#[derive(Args, Debug)]
pub struct RecordArgs {
    /// Write a page that plays the run, instead of measuring: play, pause, step, zoom with the wheel, drag; error
    /// curves below; one file that needs no network
    #[arg(help_heading = "Output", long, value_name = "FILE.html", conflicts_with_all = ["state", "contacts", "joints", "all", "json"])]
    pub record: Option<PathBuf>,
    /// Solvers that are played side by side, at most four
    #[arg(help_heading = "Output", long, value_name = "SOLVER,…", value_delimiter = ',', value_parser = values::solver(), requires = "record", conflicts_with = "solver")]
    pub solvers: Vec<&'static Variant>,
    /// Also record contact points and impulses
    #[arg(help_heading = "Output", long, requires = "record")]
    pub record_contacts: bool,
}

/// Records a run of every solver and writes the page.
pub fn run(args: &RunArgs, path: &Path) -> Result<ExitCode, Error> {
    let RecordArgs { solvers, record_contacts, .. } = &args.record;
    let own = [args.setting.solver];
    let solvers = if solvers.is_empty() { &own[..] } else { solvers };
    if solvers.len() > MOST {
        return Err(Error::invalid("--solvers", format!("{} solvers, at most {MOST} fit", solvers.len())));
    }
    let of = |solver| settings(args, SettingArgs { solver, ..args.setting.clone() }.settings()?);
    let chosen = solvers.iter().map(|solver| of(*solver)).collect::<Result<Vec<_>, Error>>()?;
    check_seed(&args.scene, args.seed)?;
    let loaded = open_scene(&args.scene, args.seed, args.steps, args.dt)?;
    let scene = &loaded.scene;
    // Created now, so that a file that cannot be written is reported before the runs.
    let mut file = Pending::new(path)?;
    let (mut panels, mut text) = (Vec::new(), String::new());
    for own in chosen {
        let solver = own.solver.name;
        let name = &scene.name;
        let caption =
            |world: &World| Caption { scene: name.clone(), solver: solver.into(), setting: how(world) };
        let bar = Bar::new();
        let mut after = |step: u64| bar.step(step as usize, scene.steps as usize, "steps");
        let trial = Trial { demands: loaded.demands.clone(), ..Trial::new(scene, own) };
        let every = args.every.unwrap_or(1);
        let (bytes, header) = record_trial(trial, &caption, every, *record_contacts, &mut after)?;
        text += &format!("{}: {solver}, {}: {}\n", header.scene, header.setting, header.outcome);
        panels.push(RecordingPanel { bytes, header, color: Style::of(solver).color.to_string() });
    }
    let page = page(&panels);
    file.write_all(page.as_bytes()).map_err(Error::io(path))?;
    file.commit()?;
    text += &format!("wrote {} ({} KiB)\n", path.display(), page.len().div_ceil(1024));
    print_beside([path], &text)
}
