//! `simpulse growth`: the cost per contact, from a thousand contacts to a million.

use super::output::{note, print, print_json};
use super::progress::Bar;
use super::settled;
use super::values::{self, LaneArgs, SettingArgs};
use crate::engine::world::{Settings, World};
use crate::lab::error::Error;
use crate::lab::estimate::{self, Estimate, free_memory};
use crate::lab::files;
use crate::lab::profile::growth::{GrowthWorld, Measurement, measure, size_for, verdicts};
use crate::lab::profile::growth_report;
use crate::lab::profile::islands::islands;
use crate::lab::profile::records::growth_json;
use crate::lab::profile::waiting;
use crate::lab::report::units::lanes;
use crate::lab::scenes::{CATALOG, MAX_BODIES, Scene, Size};
use crate::lab::study::cost::sweeps;
use crate::lab::study::{is_path, open_scene};
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measure the cost of a contact from a thousand contacts to a million
///
/// Builds the scene in several sizes, settles each for some steps, freezes them and times whole steps of all of them,
/// interleaved. A scene that has a size is built larger; a scene with a given size, or without one, is copied side by
/// side into many small islands. Prints time per contact and phase with the errors, memory per contact and per body,
/// and whether each phase stays flat (latency- or compute-bound), steps where its data leave a cache
/// (bandwidth-bound), or grows faster than n log n. Writes growth.csv and growth.svg.
///
/// From one size to the next, the cost per contact may grow by as much as memory of the phase's
/// working set is read more slowly (measured), and by ln n₂/ln n₁; 15 % and twice the spread are
/// allowed on top. Phases that grow faster are named.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse growth
  simpulse growth --scene pyramid:10 --contacts 1e3,1e4,1e5
      Copies of a pyramid of 55 boxes: as many contacts, in small islands.
  simpulse growth --scene circle_pile --solver pgs --lanes 16 --out results/growth")]
pub struct GrowthArgs {
    /// A scene of `simpulse list scenes`: without a size it is grown, with one it is copied
    #[arg(long, default_value = "pyramid", value_name = "SCENE", value_parser = values::scene())]
    pub scene: String,
    /// Numbers of contacts to aim at
    #[arg(long, value_delimiter = ',', value_name = "N,…", default_value = "1e3,3e3,1e4,3e4,1e5,3e5,1e6")]
    pub contacts: Vec<String>,
    /// Solver, budget and parameters
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Lanes
    #[command(flatten)]
    pub lanes: LaneArgs,
    /// Steps before a scene is frozen
    #[arg(long, default_value_t = 8, value_name = "STEPS")]
    pub settle: u32,
    /// Timing runs per size
    #[arg(long, default_value_t = 7, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub repeats: u32,
    /// Folder for growth.csv and growth.svg
    #[arg(long, default_value = "results", value_name = "FOLDER")]
    pub out: PathBuf,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Steps at the end of settling whose errors are printed.
const OBSERVED_STEPS: u32 = 2;

/// Fraction of the free memory that worlds may use.
const MEMORY_SHARE: f64 = 0.6;

/// A scene that can be built with a given number of contacts.
enum GrowthFamily {
    /// Built larger. `size`: the allowed sizes; `known`: two sizes, each with its number of contacts.
    Sized { name: String, size: Size, known: [(f64, f64); 2] },
    /// Copied side by side: the scene and its number of contacts.
    Copied { scene: Scene, contacts: usize },
}

impl GrowthFamily {
    fn new(name: &str, settings: &Settings, settle: u32) -> Result<Self, Error> {
        let count = |scene: &Scene| -> Result<usize, Error> {
            let mut world = scene.build(settings.clone())?;
            settled(&mut world, settle, 0)?;
            world.find_contacts();
            match world.contacts.len() {
                0 => Err(Error::invalid(
                    "scene",
                    format!("{} has no contacts after {settle} steps", scene.name),
                )),
                contacts => Ok(contacts),
            }
        };
        let entry = CATALOG.iter().find(|e| e.name == name);
        let Some(size) = entry.and_then(|e| e.size) else {
            let scene = named(name)?;
            let contacts = count(&scene)?;
            return Ok(GrowthFamily::Copied { scene, contacts });
        };
        let at = |size: u32| -> Result<(f64, f64), Error> {
            Ok((f64::from(size), count(&named(&format!("{name}:{size}"))?)? as f64))
        };
        let first = 20.clamp(size.min, size.max);
        let known = [at(first)?, at((2 * first).clamp(size.min, size.max))?];
        if size_for(1e4, known).is_none() {
            let message = format!("the contacts of {name} do not grow with its size; give one to copy it");
            return Err(Error::invalid("scene", message));
        }
        Ok(GrowthFamily::Sized { name: name.into(), size, known })
    }

    /// The scene whose number of contacts is nearest to `target`; `None` if the scene cannot be that large.
    fn scene(&self, target: f64) -> Result<Option<Scene>, Error> {
        let made = match self {
            GrowthFamily::Sized { name, size, known } => {
                let wanted = size_for(target, *known).unwrap_or(0.0).round();
                if !(f64::from(size.min)..=f64::from(size.max)).contains(&wanted) {
                    return Ok(None);
                }
                named(&format!("{name}:{wanted}"))?
            }
            GrowthFamily::Copied { scene, contacts } => {
                let copies = (target / *contacts as f64).round().max(1.0) as usize;
                if copies.saturating_mul(scene.bodies.len()) > MAX_BODIES {
                    return Ok(None);
                }
                islands(scene, copies)?
            }
        };
        Ok((made.bodies.len() <= MAX_BODIES).then_some(made))
    }
}

/// Largest number of contacts that may be requested.
const MAX_CONTACTS: f64 = 1e8;

/// The requested numbers of contacts, in ascending order and without duplicates.
fn targets(texts: &[String]) -> Result<Vec<f64>, Error> {
    let mut targets = Vec::new();
    for text in texts {
        match text.trim().parse::<f64>() {
            Ok(value) if (1.0..=MAX_CONTACTS).contains(&value) => targets.push(value),
            _ => {
                let message = format!("'{text}' is not a number from 1 to {MAX_CONTACTS:e}");
                return Err(Error::invalid("contacts", message));
            }
        }
    }
    targets.sort_by(f64::total_cmp);
    targets.dedup();
    Ok(targets)
}

/// Contacts per body in a pile of boxes, and memory of a world per contact (B).
const CONTACTS_PER_BODY: f64 = 3.0;
const BYTES_PER_CONTACT: f64 = 1250.0;

/// Steps of one timing run of a size, including those that restore the state.
const STEPS_PER_REPEAT: u32 = 4;

/// Estimate of the whole command. Sizes with too many bodies are left out.
fn estimate(targets: &[f64], args: &GrowthArgs, settings: &Settings) -> Estimate {
    let possible = |target: &&f64| **target <= CONTACTS_PER_BODY * MAX_BODIES as f64;
    let contacts: f64 = targets.iter().filter(possible).sum();
    let sweeps = sweeps(&settings.budget, settings.solver);
    let bodies = (contacts / CONTACTS_PER_BODY) as usize;
    let steps = args.settle.saturating_add(args.repeats.saturating_mul(STEPS_PER_REPEAT));
    let seconds = f64::from(steps) * estimate::step(bodies, sweeps, settings.width.lanes());
    Estimate { seconds, bytes: contacts * BYTES_PER_CONTACT }
}

/// Runs the command.
pub fn run(args: &GrowthArgs) -> Result<ExitCode, Error> {
    let (solver, width) = (args.setting.solver, args.lanes.or_native());
    let settings = args.setting.settings()?.exactly(width);
    let targets = targets(&args.contacts)?;
    // Report unknown names first. A path is read when it is opened.
    if !is_path(&args.scene) && CATALOG.iter().all(|e| e.name != args.scene) {
        named(&args.scene)?;
    }
    let family = GrowthFamily::new(&args.scene, &settings, args.settle)?;
    let estimate = estimate(&targets, args, &settings);
    note(&estimate.note("growth", None)?);
    files::prepare_folder(&args.out)?;
    let mut entries: Vec<GrowthWorld> = Vec::new();
    let mut notes = String::new();
    let bar = Bar::new();
    let parts = targets.len() + args.repeats as usize;
    for (done, target) in targets.into_iter().enumerate() {
        bar.show(done, parts, format!("settling {target} contacts"));
        let Some(scene) = family.scene(target)? else {
            notes += &format!("skipped: {target} contacts is outside what {} can have\n", args.scene);
            continue;
        };
        // Twice the memory per contact of the previous world: one part for the world and one for settling and
        // the scene.
        let bytes =
            |e: &GrowthWorld| 2.0 * e.world.memory().held() as f64 / e.world.counts.contacts.max(1) as f64;
        let expected = entries.last().map_or(0.0, bytes) * target;
        if free_memory().is_some_and(|free| expected > MEMORY_SHARE * free) {
            notes +=
                &format!("skipped: {target} contacts would take about {:.0} MB of memory\n", 1e-6 * expected);
            continue;
        }
        let what = format!("settling {}: {} bodies, {} steps", scene.name, scene.bodies.len(), args.settle);
        bar.show(done, parts, what);
        let mut world: World = scene.build(settings.clone())?;
        match settled(&mut world, args.settle, OBSERVED_STEPS) {
            Ok(errors) => entries.push(GrowthWorld { scene: scene.name, world, errors }),
            Err(failure) => notes += &format!("skipped: {}: {failure}\n", scene.name),
        }
    }
    let Measurement { rows, memory, waiting } = measure(&mut entries, args.repeats, &|round| {
        bar.show(parts - (args.repeats - round) as usize, parts, "whole steps on frozen states");
    });
    drop(bar);
    drop(entries);
    let title = format!("{} · {}, {}: cost of a contact", args.scene, solver.name, lanes(width.lanes()));
    let verdicts = verdicts(&rows, &memory);
    let mut out = format!("{title}\n\n{}", growth_report::text(&rows, &verdicts));
    out += &notes;
    out += &waiting::note(waiting);
    let contents = [
        ("growth.csv", growth_report::csv(&rows)?),
        ("growth.svg", growth_report::svg(&rows, &title)?.into_bytes()),
    ];
    for (name, bytes) in contents {
        let path = args.out.join(name);
        files::write(&path, &bytes)?;
        out += &format!("wrote {}\n", path.display());
    }
    match args.json {
        true => print_json(&growth_json(&rows, &verdicts, waiting)),
        false => print(&out),
    }
}

/// The scene of this name or file, unchanged.
fn named(name: &str) -> Result<Scene, Error> {
    Ok(open_scene(name, None, None, None)?.scene)
}
