//! `simpulse run`: one scene, one solver; times per phase, errors, and trajectories as CSV.

use super::copies;
use super::output::{note, print_beside, print_json, value};
use super::picture::{self, PictureArgs};
use super::progress::Bar;
use super::record::{self, RecordArgs};
use super::sheets::Sheets;
use super::times::Times;
use super::trace;
use super::values::{self, SettingArgs, scene_help};
use crate::engine::lanes::LaneWidth;
use crate::engine::world::{Order, Settings, World};
use crate::lab::error::Error;
use crate::lab::files::{Pending, same_file};
use crate::lab::memory;
use crate::lab::metrics::Errors;
use crate::lab::overrides;
use crate::lab::pokes;
use crate::lab::report::environment::Environment;
use crate::lab::report::table::error_list;
use crate::lab::report::units::{self, bodies, lanes_or_order, percent, ratio, si};
use crate::lab::scenes::holds::Broken;
use crate::lab::scenes::{Loaded, Scene};
use crate::lab::study::{FailedAt, TruthError, budget, check_seed, open_scene};
use crate::lab::trial::{Trial, TrialOutcome};
use clap::Args;
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Run one scene with one solver; print its time and its errors
///
/// Prints the key figures: the time of a step and of its longest phase, the overlap, the force error, the distance to
/// the scene's reference value, the speed that remains at rest, the change of energy, and whether the scene holds. `--all` prints the rest.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  simpulse run stack:20
  simpulse run arch --solver pgs --velocity-iterations 32 --all
  simpulse run my.json --steps 600 --state out.csv --contacts contacts.csv --every 60
  simpulse run crane --joints joints.csv --every 1
  simpulse run pyramid:20 --picture pyramid.svg --step 120
  simpulse run smash --trace smash.json                    which step is the longest, and why? (ui.perfetto.dev)
  simpulse run circle_pile:100 --copies 64 --threads 2     is that error an accident of one pile?
  simpulse run stack:20 --steps 1200 --poke 1              does it survive a player?
  simpulse run stack:12 --solvers pgs,soft_step --record replay.html --record-contacts")]
pub struct RunArgs {
    /// Scene
    #[arg(value_name = "SCENE", value_parser = values::scene(), help = scene_help())]
    pub scene: String,
    /// Solver, budget and parameters
    #[command(flatten)]
    pub setting: SettingArgs,
    /// Lanes per instruction [default: as many as the colors fill and the build has instructions for, 1 in file
    /// order; wider ones are emulated]
    #[arg(help_heading = "Solver and setting", long, value_name = "N", value_parser = values::lanes())]
    pub lanes: Option<LaneWidth>,
    /// Constraint order
    #[arg(help_heading = "Solver and setting", long, default_value = "parallel", value_name = "ORDER", value_parser = values::order())]
    pub order: Order,
    /// Threads that share each step; every number gives the same bits
    #[arg(long, default_value_t = 1, value_name = "N", value_parser = values::threads())]
    pub threads: usize,
    /// Steps [default: those of the scene]
    #[arg(help_heading = "Scene and time", long, value_name = "N")]
    pub steps: Option<u32>,
    /// Run this many copies from consecutive seeds as one batch, and print means of their errors. Scenes without a random
    /// element differ by small speeds at the start
    #[arg(help_heading = "Scene and time", long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536),
        conflicts_with_all = ["state", "contacts", "joints", "trace", "picture", "record", "poke", "every", "all"])]
    pub copies: Option<u32>,
    /// Step in seconds [default: that of the scene]
    #[arg(help_heading = "Scene and time", long, value_name = "SECONDS", allow_negative_numbers = true)]
    pub dt: Option<f64>,
    /// Random seed of scenes that have one
    #[arg(help_heading = "Scene and time", long)]
    pub seed: Option<u64>,
    /// Write a CSV of step,time,body,x,y,angle,vx,vy,omega; angles include whole turns
    #[arg(help_heading = "Output", long, value_name = "FILE.csv")]
    pub state: Option<PathBuf>,
    /// Write a CSV of contact points with their impulses (N·s over the step)
    #[arg(help_heading = "Output", long, value_name = "FILE.csv")]
    pub contacts: Option<PathBuf>,
    /// Write a CSV of joints with their gaps, angles, impulses by row (N·s over the step) and loads
    #[arg(help_heading = "Output", long, value_name = "FILE.csv")]
    pub joints: Option<PathBuf>,
    /// Write the phases of every step as a Chrome trace (JSON), for Perfetto and similar viewers
    #[arg(help_heading = "Output", long, value_name = "FILE.json", conflicts_with_all = ["picture", "record"])]
    pub trace: Option<PathBuf>,
    /// Picture of a frame
    #[command(flatten)]
    pub picture: PictureArgs,
    /// Recording
    #[command(flatten)]
    pub record: RecordArgs,
    /// Write every K-th step [default: the last step only in CSV files, every step in a recording]
    #[arg(help_heading = "Output", long, value_name = "K")]
    pub every: Option<u32>,
    /// Continuous collision: stop fast bodies at the surfaces that they would pass through [default: the solver's]
    #[arg(help_heading = "Solver and setting", long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub continuous: Option<bool>,
    /// Let islands sleep that have rested for half a second, until something touches them
    #[arg(help_heading = "Solver and setting", long)]
    pub sleep: bool,
    /// Push random bodies at random times in the first half of the run, as a player would; the seed decides which and
    /// when. The figures are those of the poked run, and bodies are compared with an unpoked one
    #[arg(help_heading = "Scene and time", long, value_name = "SEED", conflicts_with_all = ["picture", "record"])]
    pub poke: Option<u64>,
    /// Print all phases, counts and errors
    #[arg(help_heading = "Output", long)]
    pub all: bool,
    /// Print JSON instead of text: everything
    #[arg(help_heading = "Output", long)]
    pub json: bool,
}

/// Result of a run.
struct RunResult {
    times: Times,
    errors: Errors,
    truth: Option<TruthError>,
    broken: Option<Broken>,
    poked: Option<Poked>,
    unchecked: Vec<String>,
    /// Whether the scene must come to rest.
    rests: bool,
}

/// What random pushes did.
#[derive(serde::Serialize)]
struct Poked {
    seed: u64,
    pushes: u32,
    /// Distance at the end from the bodies of a run without pushes: root mean square, and greatest (m).
    displaced_rms_m: f64,
    displaced_max_m: f64,
}

/// A note about bodies whose size is far from the length unit.
fn size_note(world: &World) -> Option<String> {
    let dynamic = |pair: &(_, &u32)| world.bodies.is_dynamic(*pair.1 as usize);
    let shapes = world.shapes().iter().zip(world.shape_body()).filter(dynamic);
    let widths = shapes.map(|(shape, _)| 2.0 * shape.min_half_extent());
    let mut widths: Vec<f32> = widths.filter(|width| width.is_finite()).collect();
    widths.sort_by(f32::total_cmp);
    let (width, unit) = (*widths.get(widths.len() / 2)?, world.settings.length_unit);
    (!(0.02 * unit..=50.0 * unit).contains(&width)).then(|| {
        let [width, unit] = [width, unit].map(|length| si(f64::from(length), "m"));
        format!("note: bodies are about {width} wide and the length unit is {unit}: set \"length_unit\" in the scene file\n")
    })
}

/// Runs the scene. Its files are written after the whole run.
pub fn run(args: &RunArgs) -> Result<ExitCode, Error> {
    for (name, value) in [("steps", args.steps), ("every", args.every)] {
        if value == Some(0) {
            return Err(Error::invalid(name, "0 is too few: at least 1 is needed"));
        }
    }
    check_seed(&args.scene, args.seed)?;
    if let Some(count) = args.copies {
        return copies::run(args, count);
    }
    if let Some(path) = &args.picture.picture {
        return picture::run(args, path);
    }
    if let Some(path) = &args.record.record {
        return record::run(args, path);
    }
    let settings = settings(args, args.setting.settings()?)?;
    let files = [
        ("--state", &args.state),
        ("--contacts", &args.contacts),
        ("--joints", &args.joints),
        ("--trace", &args.trace),
    ];
    let files: Vec<(&str, &Path)> =
        files.into_iter().filter_map(|(name, file)| Some((name, file.as_deref()?))).collect();
    if args.every.is_some() && !files.iter().any(|(name, _)| *name != "--trace") {
        return Err(Error::invalid("every", "needs --state, --contacts, --joints or --record"));
    }
    for (i, (name, file)) in files.iter().enumerate() {
        if let Some((other, _)) = files[..i].iter().find(|(_, other)| same_file(file, other)) {
            let message = format!("'{}' is the same file as {other}; give another name", file.display());
            return Err(Error::invalid(*name, message));
        }
    }
    let mut loaded = open_scene(&args.scene, args.seed, args.steps, args.dt)?;
    let rests = loaded.rests();
    let Loaded { scene, truth, demands, unchecked, .. } = &mut loaded;
    let scene = &*scene;
    memory::check("run", scene.bodies.len(), 0, 1)?;
    let mut sheets = Sheets::new(args)?;
    // Opened now, so that a file that cannot be written is reported before the run.
    let trace = args.trace.as_deref().map(|path| Pending::new(path).map(|file| (file, path))).transpose()?;
    let bar = Bar::new();
    let trial = Trial {
        demands: demands.clone(),
        truth: truth.as_mut(),
        poked: args.poke,
        ..Trial::new(scene, settings.clone())
    };
    let found = trial.run(&mut |world| {
        if world.step_index() == 0 {
            note(&size_note(world).unwrap_or_default());
        }
        bar.step(world.step_index() as usize, scene.steps as usize, "steps");
        sheets.add(world, scene)
    })?;
    drop(bar);
    if let Some(failure) = found.failure.map(FailedAt::from) {
        note(&format!("failed: {} {failure}; nothing written\n", args.scene));
        if args.json {
            let message = failure.to_string();
            print_json(&json!({ "scene": args.scene, "failure": value(&failure)?, "message": message }))?;
        }
        return Ok(ExitCode::FAILURE);
    }
    // Metrics evict the caches, so times come from separate runs. Equal bits show that these did the same
    // work.
    let own = Settings { record_impulses: false, ..found.world.settings.clone() };
    let (poked, hash) = match args.poke {
        Some(seed) => {
            let still = Trial { measured: 0, ..Trial::new(scene, settings) }.run(&mut |_| Ok(()))?.world;
            let [displaced_rms_m, displaced_max_m] = pokes::displacement(&found.world, &still);
            (Some(Poked { seed, pushes: found.pokes, displaced_rms_m, displaced_max_m }), still.state_hash())
        }
        None => (None, found.world.state_hash()),
    };
    let times = Times::measure(scene, own, hash)?;
    let TrialOutcome { world, errors, truth, broken, .. } = found;
    let errors = errors.ok_or_else(|| Error::invalid("run", "no step was measured"))?;
    let found = RunResult { times, errors, truth, broken, poked, unchecked: unchecked.clone(), rests };
    let mut written = sheets.commit()?;
    if let Some((mut file, path)) = trace {
        let text = trace::text(&scene.name, world.settings.solver.name, &found.times)?;
        file.write_all(text.as_bytes()).map_err(Error::io(path))?;
        file.commit()?;
        written += &format!("wrote {}\n", path.display());
    }
    if args.json {
        return print_json(&json(&world, scene, &found)?);
    }
    let text = head(&world, scene) + &found.text(&world, args.all) + &written;
    print_beside(files.into_iter().map(|(_, file)| file), &text)
}

/// The settings of a solver with the order and lanes of the command. Errors: natural order in lanes.
pub(super) fn settings(args: &RunArgs, own: Settings) -> Result<Settings, Error> {
    let continuous = args.continuous.unwrap_or(own.continuous);
    let own = Settings { continuous, threads: args.threads, sleep: args.sleep, ..own };
    let order = args.order;
    let own = match (order, args.lanes) {
        (Order::Colored, Some(width)) => own.exactly(width),
        (Order::Colored, None) => own,
        (_, None | Some(LaneWidth::W1)) => own.exactly(LaneWidth::W1),
        (order, Some(width)) => {
            let message = format!("{}, but {} order has 1 lane", width.lanes(), units::order(order));
            return Err(Error::invalid("lanes", message));
        }
    };
    Ok(Settings { order, record_impulses: true, ..own })
}

/// A line of the key figures: name, value, remark. A line without a value is a heading.
type Figure = (&'static str, String, String);

impl RunResult {
    /// The key figures, and what to do about each.
    ///
    /// | figure | what to do about it |
    /// |---|---|
    /// | time of a step | whether the budget can be afforded at all |
    /// | longest phase | whether fewer sweeps, more lanes or another broad phase would help |
    /// | overlap | more substeps or stiffer contacts: it is the visible error |
    /// | force error | more sweeps: loads and friction are no more accurate than this |
    /// | distance to reference value | another solver: small errors under the wrong law are still wrong |
    /// | holds | if it does not, no other figure matters |
    /// | speed at rest | whether bodies could sleep, or jitter |
    /// | energy change | damping: a gain ends in an explosion, a loss looks viscous |
    ///
    /// `--all` prints the others, each of which explains one of these.
    fn figures(&self) -> Vec<Figure> {
        let (e, sample) = (&self.errors, &self.times.sample);
        let at = |name: &str| e.get(name).unwrap_or_default();
        let (longest, share) = self.times.longest();
        let mut lines: Vec<Figure> = vec![
            ("cost", String::new(), String::new()),
            ("time of a step, mean", si(1e-9 * sample.mean_ns, "s"), self.times.spread()),
            ("longest phase", longest.into(), format!("{:.0} % of a median step", 100.0 * share)),
        ];
        if sample.load.unsolved > 0.0 {
            let why = "of steps: too many points for the solver's own method".into();
            lines.push(("solved by sweeps alone", format!("{:.0} %", 100.0 * sample.load.unsolved), why));
        }
        let name =
            if self.rests { "overlap, 99 % and at rest" } else { "overlap that the solver left, 99 %" };
        let [most, first] = ["penetration_max_m", "flight_depth_max_m"].map(|name| si(at(name), "m"));
        lines.extend([
            ("error", String::new(), String::new()),
            (name, si(e.penetration(self.rests), "m"), format!("greatest {most}; {first} when first found")),
        ]);
        if let Some(rms) = e.get("joint_gap_rms_m") {
            let mut rest = format!("greatest {}", si(at("joint_gap_max_m"), "m"));
            for (name, column, unit) in [
                ("held angles", "joint_lean_max_rad", "rad"),
                ("beyond limits", "joint_excess_max", "m or rad"),
            ] {
                if at(column) > 0.0 {
                    rest += &format!("; {name} {}", si(at(column), unit));
                }
            }
            lines.push(("joint gap, rms", si(rms, "m"), rest));
        }
        let (distance, known) = match &self.truth {
            None => ("–".into(), "none known".into()),
            Some(t) => (
                t.error.map_or("not reached".into(), |e| si(e, t.unit)),
                format!("{} = {}", t.quantity, si(t.expected, t.unit)),
            ),
        };
        let no_condition = self.unchecked.iter().any(|what| what.contains("condition"));
        let no_value = self.truth.is_none() && !self.unchecked.is_empty();
        let yes = match (no_condition, no_value) {
            (true, _) => "not checked",
            (false, true) => "yes (no reference value to compare with)",
            (false, false) => "yes",
        };
        lines.extend([
            (
                "force error, rms",
                percent(e.law_rms_lighter()),
                "of the lighter body's weight; distance of contact impulses from the contact law".into(),
            ),
            ("distance to reference value", distance, known),
            ("behavior", String::new(), String::new()),
            (
                "holds",
                self.broken.map_or(yes.into(), |broken| broken.mark.word().into()),
                self.broken.map_or(String::new(), |broken| format!("at step {}", broken.step)),
            ),
            ("speed at rest, last second", si(e.rest_velocity(), "m/s"), "rms".into()),
            ("energy change", ratio(at("energy_change")), "relative; positive is a gain".into()),
        ]);
        if let Some(Poked { seed, pushes, displaced_rms_m, displaced_max_m }) = &self.poked {
            let rest = format!(
                "rms; greatest {}; {pushes} pushes in the first half, seed {seed}",
                si(*displaced_max_m, "m")
            );
            lines.push(("displaced by pokes", si(*displaced_rms_m, "m"), rest));
        }
        lines
    }

    /// The key figures and, with `all`, every phase, count and error.
    fn text(&self, world: &World, all: bool) -> String {
        let mut text = String::new();
        for (name, value, remark) in self.figures() {
            let line = match value.as_str() {
                "" => name.to_string(),
                value => format!("  {name:<34}{value:>12}  {remark}"),
            };
            text += &format!("{}\n", line.trim_end());
        }
        text += &self.unchecked.iter().map(|what| format!("not checked: {what}\n")).collect::<String>();
        text += &self.times.note();
        text + &match all {
            true => {
                format!("\n{}{}\nerrors\n{}", self.times.table(), counts(world), error_list(&self.errors))
            }
            false => "--all prints the rest\n".to_string(),
        }
    }
}

/// Everything that a run measured, and its settings.
fn json(world: &World, scene: &Scene, found: &RunResult) -> Result<Value, Error> {
    let s = &world.settings;
    let phases: serde_json::Map<String, Value> =
        found.times.by_phase().map(|(p, ns)| (p, ns.into())).collect();
    let sample = &found.times.sample;
    Ok(json!({
        "environment": Environment::current(),
        "scene": scene.name,
        "bodies": scene.bodies.len(),
        "steps": scene.steps,
        "dt": scene.dt,
        "length_unit": scene.length_unit,
        "solver": s.solver.name,
        "budget": s.budget,
        "parameters": overrides::by_name(s.solver, &s.parameters),
        "continuous": s.continuous,
        "impacts": s.impacts.name(),
        "order": s.order,
        "lanes": world.lane_width().lanes(),
        "mean_step_ns": sample.mean_ns,
        "median_step_ns": sample.median_ns,
        "longest_step_ns": sample.worst_ns,
        "rounds": sample.rounds,
        "waited_share": sample.waited,
        "noise_share": sample.noise,
        "bits_equal": found.times.same_bits,
        "phase_ns": phases,
        "errors": value(&found.errors)?,
        "reference": value(&found.truth)?,
        "holds": found.broken.map_or("yes", |b| b.mark.word()),
        "failed_step": found.broken.map(|b| b.step),
        "poked": found.poked,
        "not_checked": found.unchecked,
    }))
}

/// Budget, and order or lanes, as text.
pub(super) fn how(world: &World) -> String {
    let s = &world.settings;
    let order = lanes_or_order(s.order, world.lane_width().lanes());
    format!("{}, {order}", budget::with_treatments(budget::brief(&s.budget, s.solver), s.impacts, s.frozen))
}

fn head(world: &World, scene: &Scene) -> String {
    let s = &world.settings;
    format!(
        "{}: {}, {} steps of {} · {}, {}\n\n",
        scene.name,
        bodies(scene.bodies.len()),
        scene.steps,
        si(scene.dt, "s"),
        s.solver.name,
        how(world),
    )
}

fn counts(world: &World) -> String {
    let c = world.counts();
    format!(
        "\nlast step: {} pairs, {} contacts, {} points, {} rows, {} sweeps, {} colors, {} overflowing, \
         {} of lanes filled, {} bytes of records, {} visits of impacts, {} islands cut off, {} groups of islands, {} bodies asleep, {} threads\n",
        c.pairs,
        c.contacts,
        c.points,
        c.rows,
        c.sweeps,
        c.colors,
        c.overflow,
        if c.asleep > 0 { "–".into() } else { percent(c.contacts as f64 / c.lane_slots.max(1) as f64) },
        c.constraint_bytes,
        c.impact_visits,
        c.cut_impacts,
        c.groups,
        c.asleep,
        world.settings.threads.max(1)
    )
}
