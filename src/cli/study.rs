//! `simpulse study`: compares solvers, whole or in parts.

use super::interrupt;
use super::output::{note, print};
use super::progress::Bar;
use super::values::{self, Solvers};
use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::chart::figure::FigureStyle;
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::overrides::{self, Override};
use crate::lab::report::doc::{self, DocBlock};
use crate::lab::report::study_file::{StudyFile, differing_settings, settings};
use crate::lab::report::{self, answer, by_scene, ensemble, html, sweep};
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::study::budget::BudgetGrid;
use crate::lab::study::curve::distinct;
use crate::lab::study::found::{self, Found, FoundSetting};
use crate::lab::study::record::quoted;
use crate::lab::study::sweep::QuantitySweep;
use crate::lab::study::{self, Progress, Record, StudyPlan, telling};
use crate::lab::units::{count, quantity};
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::Arc;

/// Examples printed below the help.
pub const EXAMPLES: &str = "\
Without budget options, a solver runs on each scene of the default study at up to five settings.
They come from a search by errors, with the same rule and effort for all solvers (--thorough
repeats it). On other scenes it runs at half, once and twice its standard budget. With budget
options, every combination runs; values that a solver ignores are dropped.
A folder keeps every study: what it holds is moved to FOLDER/previous/N when the first scene of another study
is finished. Each scene is written as soon as it is finished; --resume runs those that are missing.
A sweep runs at each solver's standard budget, in parallel order at the widest native lanes, unless
other options say otherwise.

Examples:
  simpulse study --quick
  simpulse study --solvers all --out results/all
  simpulse study --scenes pyramid:40 --solvers soft_step --lanes 1,4,8,16 --substeps 4,8
  simpulse study --scenes stack:10,arch --sweep contact-hertz=15,30,60 --out results/hertz
  simpulse study --scenes mass_ratio --sweep mass-ratio=1,10,100,1000 --out results/ratio
  simpulse study --scenes pyramid --solvers soft_step --sweep size=10,20,40,80 --out results/size
  simpulse study --scenes pyramid:40,circle_pile:500 --solvers soft_step --features all --out results/features
  simpulse study --shard 1/2 --out part-1            on one machine, 2/2 on another, and then
  simpulse study --merge part-1,part-2 --out results
  simpulse study --from results                      the page again, with verify.json of the folder
  simpulse study --scenes stack:20,my.json --velocity-iterations 4,16,64 --out results/stack
  simpulse study --scenes my.json --solvers all --thorough --out results/my
  simpulse study --scenes stack:20,arch --frozen off --frozen own --frozen 1mm,0.004,loaded --out results/frozen
  simpulse study --scenes pyramid:20 --standard --orders file,reversed,shuffled,parallel --out results/orders";

/// Lists are separated by commas.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// Scenes
    #[arg(help_heading = "Scene and time", long, value_delimiter = ',', value_name = "SCENE,…", value_parser = values::scene(), help = values::scenes_help())]
    pub scenes: Vec<String>,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Lanes per instruction [default: 1, 4, 8, and 16 where this build has instructions for it;
    /// wider ones are emulated]
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "N,…", value_parser = values::lanes())]
    pub lanes: Vec<LaneWidth>,
    /// Orders of constraints: file (one after the other, as they are found), reversed, shuffled, and parallel (by
    /// colors, in lanes) [default: file,parallel]
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "ORDER,…", value_parser = values::order())]
    pub orders: Vec<Order>,
    /// Impact laws: own is the solver's, waves solves impacts in waves before the step, none turns bouncing off.
    /// Scenes where nothing bounces run the first one only [default: own,waves; in a sweep own]
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "TREATMENT,…", value_parser = values::impacts())]
    pub impacts: Vec<Impacts>,
    /// Frozen contacts, the option once for each: own is the solver's, off is never, DISTANCE,TURN within such a motion
    /// (1mm,0.004), and DISTANCE,TURN,loaded only where both points of a contact bear load [default: own]
    #[arg(help_heading = "Solver and setting", long, value_name = "LIMITS", value_parser = values::frozen)]
    pub frozen: Vec<Freezing>,
    /// Substeps to try
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "N,…")]
    pub substeps: Vec<u32>,
    /// Velocity sweeps to try, per substep
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "N,…")]
    pub velocity_iterations: Vec<u32>,
    /// Relaxation sweeps to try, per substep
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "N,…")]
    pub relax_iterations: Vec<u32>,
    /// Position sweeps to try, per substep
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "N,…")]
    pub position_iterations: Vec<u32>,
    /// Solver parameters, such as `contact_hertz=60` (`simpulse list solvers` lists them)
    #[arg(help_heading = "Solver and setting", long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
    /// A curve per solver: one quantity takes several values, all else stays fixed. It is a solver parameter
    /// (contact-hertz), substeps, iterations (velocity sweeps; position sweeps if a solver has no others),
    /// velocity-iterations, relax-iterations, position-iterations, dt (s), friction (of every shape), mass-ratio
    /// (scene mass_ratio), or size (of scenes that have one; the table has the time per contact)
    #[arg(help_heading = "Measuring", long, value_name = "NAME=VALUE,VALUE,…")]
    pub sweep: Option<QuantitySweep>,
    /// Compare kernels for the features of the scenes (0) with kernels for all features (1), which take the time of
    /// friction, second points, rotation and restitution where a scene has none
    #[arg(help_heading = "Measuring", long, value_name = "all", value_parser = ["all"], conflicts_with = "sweep")]
    pub features: Option<String>,
    /// Override the scenes' tolerances, such as penetration=5mm,residual=0.05 (overlap, force error),reference=0.1
    /// (`simpulse list NAME` lists them; that of the reference value has the value's unit)
    #[arg(help_heading = "Measuring", long, value_delimiter = ',', value_name = "NAME=VALUE,…", value_parser = NonEmptyStringValueParser::new())]
    pub tolerance: Vec<String>,
    /// Steps of the runs that measure errors [default: those of each scene]
    #[arg(help_heading = "Scene and time", long)]
    pub steps: Option<u32>,
    /// Rounds of timing, common to all settings of a scene [default: 3]
    #[arg(help_heading = "Measuring", long)]
    pub repeats: Option<u32>,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(help_heading = "Scene and time", long, default_value_t = 1)]
    pub seed: u64,
    /// Run every scene from each of these seeds, and report means with 95 % confidence intervals; scenes without a random
    /// element start with random speeds of up to 1 mm/s instead. SCENE@SEED is one of them
    #[arg(help_heading = "Measuring", long, value_name = "FIRST-LAST", conflicts_with = "sweep")]
    pub seeds: Option<SeedRange>,
    /// Short runs without repeats: an overview in seconds
    #[arg(help_heading = "Measuring", long)]
    pub quick: bool,
    /// First search the settings of each solver on each scene, by errors alone. Writes them to budgets.csv in the
    /// folder
    #[arg(help_heading = "Solver and setting", long, conflicts_with_all = ["sweep", "features", "substeps", "velocity_iterations", "relax_iterations", "position_iterations"])]
    pub thorough: bool,
    /// Each solver at half, once and twice its standard budget, whatever was found
    #[arg(help_heading = "Solver and setting", long, conflicts_with = "thorough")]
    pub standard: bool,
    /// Print JSON instead of text: what study.json holds
    #[arg(help_heading = "Output", long)]
    pub json: bool,
    /// Push the advised settings of scenes that must rest at random, as a player would: do they survive?
    #[arg(help_heading = "Measuring", long, value_name = "SEED", conflicts_with = "sweep")]
    pub poke: Option<u64>,
    /// Measure errors only, for many machines: --shard then takes every N-th pair of scene and solver
    #[arg(help_heading = "Parts", long, conflicts_with_all = ["sweep", "features", "resume", "poke", "thorough"])]
    pub errors: bool,
    /// Time the settings of a merged study of errors, on one quiet machine; give the other options again
    #[arg(help_heading = "Parts", long, value_name = "DIR", conflicts_with_all = ["errors", "shard", "resume", "merge", "sweep", "features", "thorough"])]
    pub times: Option<PathBuf>,
    /// Run part I of N: every N-th scene; --merge joins the parts
    #[arg(help_heading = "Parts", long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Go on with the study in the folder: run the scenes that it lacks. It must be the same study
    #[arg(help_heading = "Parts", long)]
    pub resume: bool,
    /// Run nothing: merge these parts, folders or study.json files. All times of a scene come from one machine
    #[arg(help_heading = "Parts", long, value_delimiter = ',', num_args = 1.., value_name = "DIR", conflicts_with_all = ["shard", "resume", "from"])]
    pub merge: Vec<PathBuf>,
    /// Merge even if scenes are missing
    #[arg(help_heading = "Parts", long, requires = "merge")]
    pub partial: bool,
    /// Run nothing: write the page of the study in this folder again, with the folder's verify.json (`simpulse verify
    /// --json > DIR/verify.json`) and recordings if it has them
    #[arg(help_heading = "Output", long, value_name = "DIR", conflicts_with_all = ["shard", "resume"])]
    pub from: Option<PathBuf>,
    /// Also write every chart as an SVG of this size into figures/, such as 85mm or 85mmx60mm (mm, cm or in)
    #[arg(help_heading = "Output", long, value_name = "WIDTH[xHEIGHT]")]
    pub figure: Option<String>,
    /// Font of the figures
    #[arg(
        help_heading = "Output",
        long,
        value_name = "NAME",
        default_value = "sans-serif",
        requires = "figure"
    )]
    pub font: String,
    /// Size of the type in the figures (pt)
    #[arg(help_heading = "Output", long, value_name = "POINTS", default_value_t = 8.0, requires = "figure")]
    pub font_size: f64,
    /// Folder for the results
    #[arg(help_heading = "Output", long, default_value = "results", value_name = "FOLDER")]
    pub out: PathBuf,
}

impl StudyArgs {
    /// Size and type of figures; `None` if none are wanted. Errors: a size that cannot be drawn.
    fn figure_style(&self) -> Result<Option<FigureStyle>, Error> {
        self.figure.as_ref().map(|size| FigureStyle::new(size, &self.font, self.font_size)).transpose()
    }

    /// Writes the figures into a folder, if they are wanted; returns words about them.
    fn figures(&self, folder: &Path, records: &[Record]) -> Result<String, Error> {
        let Some(style) = self.figure_style()? else { return Ok(String::new()) };
        let paths = html::write_figures(folder, records, &style)?;
        Ok(format!(", {} in {}", count(paths.len(), "figure"), folder.join("figures").display()))
    }

    /// The plan for these arguments. Errors: unknown names, invalid widths.
    pub fn plan(&self) -> Result<StudyPlan, Error> {
        let mut base = if self.quick { StudyPlan::quick() } else { StudyPlan::default() };
        let sweep = self.sweep.clone().or(self.features.is_some().then(QuantitySweep::of_features));
        if sweep.is_some() {
            // A sweep draws one curve per solver, so it needs one width and one order.
            (base.widths, base.orders) = (vec![native_width()], vec![Order::Colored]);
        }
        let or = |given: &[String], own: Vec<String>| {
            if given.is_empty() { own } else { distinct(given.iter().cloned()) }
        };
        let scenes = or(&self.scenes, base.scenes);
        Ok(StudyPlan {
            scenes: self.seeds.map_or(scenes.clone(), |seeds| seeds.of(&scenes)),
            solvers: self.solvers.chosen(),
            widths: values::widths(&self.lanes, base.widths),
            orders: if self.orders.is_empty() { base.orders } else { distinct(self.orders.clone()) },
            impacts: match (self.impacts.is_empty(), sweep.is_some()) {
                (false, _) => distinct(self.impacts.clone()),
                (true, true) => vec![Impacts::Own],
                (true, false) => base.impacts,
            },
            frozen: if self.frozen.is_empty() { base.frozen } else { distinct(self.frozen.clone()) },
            budgets: BudgetGrid {
                substeps: self.substeps.clone(),
                velocity_iterations: self.velocity_iterations.clone(),
                relax_iterations: self.relax_iterations.clone(),
                position_iterations: self.position_iterations.clone(),
            },
            overrides: self.set.clone(),
            sweep,
            found: if self.standard { Arc::default() } else { base.found },
            thorough: self.thorough,
            tolerances: tolerances(&self.tolerance)?,
            steps: self.steps.or(base.steps),
            timing_steps: base.timing_steps,
            repeats: self.repeats.unwrap_or(base.repeats),
            seed: self.seed,
            poke: self.poke,
            errors_only: self.errors,
            share: self.shard.filter(|_| self.errors).map(|shard| [shard.index, shard.count]),
            ..base
        })
    }
}

/// Tolerances from `NAME=VALUE`. Errors: an unknown name, a value that is not a valid limit.
fn tolerances(given: &[String]) -> Result<GivenTolerances, Error> {
    let mut tolerances = GivenTolerances::default();
    for text in given {
        let refused = || Error::invalid("tolerance", format!("'{text}' is not NAME=VALUE"));
        let (name, value) = text.split_once('=').ok_or_else(refused)?;
        let (place, unit) = match name.trim() {
            "penetration" => (&mut tolerances.penetration, "m"),
            "residual" => (&mut tolerances.residual, ""),
            "reference" => (&mut tolerances.truth, ""),
            "rest-speed" => (&mut tolerances.rest, "m/s"),
            other => {
                let known = ["penetration", "residual", "reference", "rest-speed"].into_iter();
                return Err(Error::unknown("tolerance", other, known));
            }
        };
        *place = Some(quantity("tolerance", value, unit)?);
    }
    Ok(tolerances)
}

/// Most seeds of an ensemble.
const MOST_SEEDS: u64 = 1000;

/// Seeds of an ensemble, both ends included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeedRange {
    first: u64,
    last: u64,
}

impl FromStr for SeedRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = text.split_once('-').and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
        let found = found.filter(|(first, last)| first < last && last - first < MOST_SEEDS);
        let (first, last) =
            found.ok_or_else(|| format!("'{text}' is not FIRST-LAST, for example 1-20, of at most 1000"))?;
        Ok(SeedRange { first, last })
    }
}

impl SeedRange {
    /// Each scene from each seed.
    fn of(self, scenes: &[String]) -> Vec<String> {
        scenes
            .iter()
            .flat_map(|name| (self.first..=self.last).map(move |seed| format!("{name}@{seed}")))
            .collect()
    }
}

/// A part of a study. It consists of whole scenes, so that all times of a scene come from one machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Counted from 1.
    index: usize,
    count: usize,
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refused = || format!("'{text}' is not I/N with 1 ≤ I ≤ N, for example 2/8");
        let (index, count) = text.split_once('/').ok_or_else(refused)?;
        let (index, count) = (index.parse().map_err(|_| refused())?, count.parse().map_err(|_| refused())?);
        if (1..=count).contains(&index) { Ok(Shard { index, count }) } else { Err(refused()) }
    }
}

impl Shard {
    /// The scenes of this part, and those of the others. Errors: a part without scenes.
    fn split(self, scenes: Vec<String>) -> Result<(Vec<String>, Vec<String>), Error> {
        let total = scenes.len();
        let (own, others): (Vec<_>, Vec<_>) =
            scenes.into_iter().enumerate().partition(|(i, _)| i % self.count == self.index - 1);
        if own.is_empty() {
            let message = format!("{}/{} has no scene: there are {total}", self.index, self.count);
            return Err(Error::invalid("--shard", message));
        }
        let names = |list: Vec<(usize, String)>| list.into_iter().map(|(_, name)| name).collect();
        Ok((names(own), names(others)))
    }
}

/// Runs the command.
pub fn run(args: &StudyArgs) -> Result<ExitCode, Error> {
    args.figure_style()?;
    if let Some(folder) = &args.from {
        let study = StudyFile::read(folder)?;
        let page = html::write(folder, &study)?;
        let figures = args.figures(folder, &study.records)?;
        return match args.json {
            true => print(&String::from_utf8_lossy(&study.to_json()?)),
            false => print(&format!("wrote {}{figures}\n", page.display())),
        };
    }
    if !args.merge.is_empty() {
        return merge(args);
    }
    let mut plan = args.plan()?;
    let without = match plan.sweep.clone() {
        Some(sweep) => keep_concerned(&sweep, &mut plan.solvers),
        None => String::new(),
    };
    let mut elsewhere = Vec::new();
    if let Some(shard) = args.shard.filter(|_| !args.errors) {
        (plan.scenes, elsewhere) = shard.split(plan.scenes)?;
    }
    plan.check()?;
    if let Some(folder) = &args.times {
        return times(args, &plan, folder);
    }
    let not_held: String = plan.not_held()?.iter().map(|line| format!("skipped: {line}\n")).collect();
    note(&(without + &overrides::partly(&plan.solvers, &plan.overrides) + &not_held));
    // Fail before the long computation, not after it.
    let earlier = if args.resume { Some(StudyFile::read(&args.out)?) } else { None };
    files::prepare_folder(&args.out)?;
    let lock = files::Lock::of(&args.out)?;
    let found_out: String = plan.find_out()?.iter().map(|line| doc::lines(line)).collect();
    let earlier = earlier.map(|earlier| resumed(earlier, &args.out, &plan)).transpose()?;
    let list = args.out.join(found::NAME);
    let found = match earlier.is_some() && plan.thorough && list.is_file() {
        true => Found::of_csv(&std::fs::read_to_string(&list).map_err(Error::io(&list))?)?,
        false => Found::default(),
    };
    let mut results =
        StudyResults { out: &args.out, plan, elsewhere, earlier, records: Vec::new(), found, kept: None };
    // Before the folder is in use, so that a signal always has an answer.
    results.say(&results.plan.scenes);
    let bar = Bar::new();
    let study = results.run(&|p| bar.show(p.done, p.total, p.what))?;
    drop(bar);
    let replays = telling::recordings(&results.plan, &study.records)?;
    let writing = interrupt::writing();
    let replays = html::write_recordings(&args.out, &replays)?;
    let mut paths = report::write_study(&args.out, &study)?;
    paths.extend(replays);
    drop(writing);
    drop(lock);
    finish(args, &study, &paths, found_out, &results.kept)
}

/// The folder of a running study.
struct StudyResults<'a> {
    out: &'a Path,
    plan: StudyPlan,
    /// Scenes of other parts.
    elsewhere: Vec<String>,
    /// The study to go on with.
    earlier: Option<StudyFile>,
    records: Vec<Record>,
    found: Found,
    /// Where the study is that the folder held before.
    kept: Option<PathBuf>,
}

impl StudyResults<'_> {
    /// Runs the scenes that are missing, and writes the study after each of them.
    fn run(&mut self, progress: &(dyn Fn(Progress) + Sync)) -> Result<StudyFile, Error> {
        let mut plan = self.plan.clone();
        if let Some(earlier) = &self.earlier {
            plan.scenes.retain(|name| earlier.missing_scenes.contains(name));
        }
        let mut missing = plan.scenes.clone();
        self.say(&missing);
        if !plan.scenes.is_empty() {
            study::run(&plan, progress, &mut |records, found| {
                missing.remove(0);
                self.write(records, found, &missing)
            })?;
        }
        interrupt::say(String::new());
        self.study(&missing)
    }

    /// Adds the records of a scene and writes the study.
    fn write(&mut self, records: &[Record], found: &[FoundSetting], missing: &[String]) -> Result<(), Error> {
        let _writing = interrupt::writing();
        if self.records.is_empty() && self.earlier.is_none() {
            self.kept = report::keep_previous(self.out)?;
        }
        self.records.extend_from_slice(records);
        self.found.entries.extend_from_slice(found);
        if self.plan.thorough {
            files::write(&self.out.join(found::NAME), &self.found.to_csv()?)?;
        }
        report::write_study(self.out, &self.study(missing)?)?;
        self.say(missing);
        Ok(())
    }

    /// The study so far.
    fn study(&self, missing: &[String]) -> Result<StudyFile, Error> {
        let missing = missing.iter().chain(&self.elsewhere).cloned().collect();
        let own = StudyFile::new(&self.plan, self.records.clone(), missing);
        match &self.earlier {
            Some(earlier) => StudyFile::merged(
                vec![earlier.clone(), own],
                &["what was there", "what is added"].map(String::from),
            ),
            None => Ok(StudyFile { command: command_line(), ..own }),
        }
    }

    /// Sets what an interrupt says.
    fn say(&self, missing: &[String]) {
        let (all, out) = (self.plan.scenes.len(), self.out.display());
        interrupt::say(match all - missing.len() {
            0 => format!("interrupted before the first of {all} scenes was finished; nothing written\n"),
            done => format!("interrupted; {done} of {all} scenes are in {out}, --resume goes on\n"),
        });
    }
}

/// The command as it was given, for a shell.
fn command_line() -> String {
    let given = std::env::args_os().skip(1).map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("simpulse".to_string()).chain(given).collect::<Vec<_>>().join(" ")
}

/// The study of a folder, to go on with. Errors: a study with other settings.
fn resumed(earlier: StudyFile, out: &Path, plan: &StudyPlan) -> Result<StudyFile, Error> {
    let list: Vec<String> = differing_settings(&earlier.settings, &settings(plan))
        .into_iter()
        .filter(|(name, _)| name != "budget_search")
        .map(|(name, [there, here])| format!("{name} is {there} there, {here} here"))
        .collect();
    match list.is_empty() {
        true => Ok(earlier),
        false => Err(Error::invalid(
            "--resume",
            format!("{} holds another study: {}", out.display(), list.join("; ")),
        )),
    }
}

/// Times the settings of a study of errors.
fn times(args: &StudyArgs, plan: &StudyPlan, folder: &Path) -> Result<ExitCode, Error> {
    let errors = StudyFile::read(folder)?;
    let refused = |why: String| Error::invalid("--times", format!("{} {why}", folder.display()));
    if !errors.errors_only() {
        return Err(refused("is no study with --errors".to_string()));
    }
    let differing = differing_settings(&errors.settings, &settings(plan)).into_iter();
    let own = ["errors_only", "poke", "repeats", "scenes", "budget_search"];
    let list: Vec<String> = differing
        .filter(|(name, _)| !own.contains(&&**name))
        .map(|(name, [there, here])| format!("{name} is {there} there, {here} here"))
        .collect();
    if !list.is_empty() {
        return Err(refused(format!("holds another study: {}", list.join("; "))));
    }
    files::prepare_folder(&args.out)?;
    let _lock = files::Lock::of(&args.out)?;
    let bar = Bar::new();
    let records = study::run_times(plan, &errors.records, &|p| bar.show(p.done, p.total, p.what))?;
    drop(bar);
    let replays = telling::recordings(plan, &records)?;
    let study = StudyFile { command: command_line(), ..StudyFile::new(plan, records, errors.missing_scenes) };
    let _writing = interrupt::writing();
    let kept = report::keep_previous(&args.out)?;
    let replays = html::write_recordings(&args.out, &replays)?;
    let mut paths = report::write_study(&args.out, &study)?;
    paths.extend(replays);
    finish(args, &study, &paths, String::new(), &kept)
}

/// Merges the parts of a study.
fn merge(args: &StudyArgs) -> Result<ExitCode, Error> {
    let parts = args.merge.iter().map(|path| StudyFile::read(path)).collect::<Result<Vec<_>, _>>()?;
    let names: Vec<String> = args.merge.iter().map(|path| path.display().to_string()).collect();
    let commands: Vec<String> = parts.iter().map(|part| part.command.clone()).collect();
    let whole = StudyFile { command: command_line(), ..StudyFile::merged(parts, &names)? };
    let lacks = whole.errors_only() && !missing_shards(&commands).is_empty();
    if lacks && !args.partial {
        let message = format!(
            "parts are missing; to make them: {}; --partial merges without them",
            missing_shards(&commands).join("; ")
        );
        return Err(Error::invalid("merge", message));
    }
    if !whole.missing_scenes.is_empty() && !args.partial {
        let missing = whole.missing_scenes.join(", ");
        let made_by = missing_parts(&commands).join("; ");
        let message = format!("no part has {missing}; to make it: {made_by}; --partial merges without it");
        return Err(Error::invalid("merge", message));
    }
    files::prepare_folder(&args.out)?;
    let _lock = files::Lock::of(&args.out)?;
    let _writing = interrupt::writing();
    let replays = replays_of(&args.merge, &whole)?;
    let kept = report::keep_previous(&args.out)?;
    let replays = html::write_recordings(&args.out, &replays)?;
    let mut paths = report::write_study(&args.out, &whole)?;
    paths.extend(replays);
    finish(args, &whole, &paths, String::new(), &kept)
}

/// The recordings of the parts: those of the scene where the solvers differ most, or of the first scene that has some.
fn replays_of(parts: &[PathBuf], whole: &StudyFile) -> Result<Vec<Vec<u8>>, Error> {
    let mut all = Vec::new();
    for folder in parts.iter().filter(|path| path.is_dir()) {
        all.extend(html::recordings_of(folder)?);
    }
    let told = telling::telling(&whole.records).first().map(|record| record.scene.clone());
    let has = |scene: &String| all.iter().any(|(_, header)| header.scene == *scene);
    let scene = told.filter(has).or(all.first().map(|(_, header)| header.scene.clone()));
    all.retain(|(_, header)| Some(&header.scene) == scene.as_ref());
    Ok(all.into_iter().map(|(bytes, _)| bytes).collect())
}

/// Commands that make the parts that are missing, from those of the others: the shards that none of them ran, or else
/// each of them again with --resume.
fn missing_parts(commands: &[String]) -> Vec<String> {
    let shards = missing_shards(commands);
    if !shards.is_empty() {
        return shards;
    }
    commands
        .iter()
        .filter(|command| !command.is_empty())
        .map(|command| format!("{command} --resume"))
        .collect()
}

/// Commands that make the shards that none of these commands made.
fn missing_shards(commands: &[String]) -> Vec<String> {
    let shard = |command: &String| -> Option<Shard> {
        let mut words = command.split([' ', '=']).skip_while(|word| *word != "--shard");
        words.nth(1)?.parse().ok()
    };
    let present: Vec<Shard> = commands.iter().filter_map(shard).collect();
    let command = commands.iter().find(|command| shard(command).is_some());
    if let (Some(first), Some(command)) = (present.first(), command) {
        let base: Vec<&str> = command.split(' ').collect();
        let missing = (1..=first.count).filter(|index| present.iter().all(|own| own.index != *index));
        let of = |index: usize| {
            let (mut text, mut skip) = (Vec::new(), false);
            for word in &base {
                let is_option = ["--shard", "--out"].into_iter().any(|name| word.starts_with(name));
                if !skip && !is_option {
                    text.push(*word);
                }
                skip = is_option && !word.contains('=');
            }
            format!("{} --shard {index}/{} --out part-{index}", text.join(" "), first.count)
        };
        return missing.map(of).collect();
    }
    Vec::new()
}

/// Drops solvers that do not have the swept quantity, and returns a message about them.
fn keep_concerned(sweep: &QuantitySweep, solvers: &mut Vec<&'static Variant>) -> String {
    let (own, others): (Vec<_>, Vec<_>) = solvers.iter().copied().partition(|v| sweep.concerns(v));
    if own.is_empty() {
        // Validation reports which solvers have it.
        return String::new();
    }
    *solvers = own;
    let names: Vec<&str> = others.iter().map(|v| v.name).collect();
    match names.is_empty() {
        true => String::new(),
        false => format!("skipped, without {}: {}\n", sweep.name, names.join(", ")),
    }
}

/// Prints a study as JSON, or `first`, its answer or, for a sweep, its tables, the files that were written, and where the
/// study is that the folder held before.
fn finish(
    args: &StudyArgs,
    study: &StudyFile,
    paths: &[PathBuf],
    first: String,
    kept: &Option<PathBuf>,
) -> Result<ExitCode, Error> {
    let figures = args.figures(&args.out, &study.records)?;
    if args.json {
        return print(&String::from_utf8_lossy(&study.to_json()?));
    }
    let StudyFile { records, environment, .. } = study;
    if study.errors_only() {
        let held = records.iter().filter(|r| r.holds()).count();
        let first = format!(
            "errors of {} settings, {held} hold; `simpulse study --times DIR` times them\n",
            records.len()
        );
        return print(
            &(first
                + &doc::lines(&study.caution())
                + &format!("wrote study.json in {}\n", args.out.display())),
        );
    }
    let mut text = first + &doc::lines(&study.caution());
    text += &match sweep::is_sweep(records) {
        true => sweep::text(records, environment),
        false => answer::text(records, environment, study.steps()),
    };
    text += &doc::text(&[DocBlock::Table(ensemble::table(records))]);
    text += &doc::lines(&study.budgets());
    text +=
        &doc::text(&by_scene::chosen_tables(records).into_iter().map(DocBlock::Table).collect::<Vec<_>>());
    let names = paths.iter().filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
    let names = names.collect::<Vec<_>>().join(", ");
    text += &doc::lines(&format!("\nwrote {names} in {}{figures}\n", args.out.display()));
    if let Some(place) = kept {
        text += &format!("the study that was there is now in {}\n", place.display());
    }
    print(&text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_whole_scenes_and_make_the_whole() {
        let scenes: Vec<String> = ["a", "b", "c", "d", "e"].map(String::from).to_vec();
        let mut all = Vec::new();
        for index in 1..=3 {
            let shard: Shard = format!("{index}/3").parse().unwrap();
            let (own, others) = shard.split(scenes.clone()).unwrap();
            assert_eq!(own.len() + others.len(), 5);
            all.extend(own);
        }
        all.sort();
        assert_eq!(all, scenes);
        for bad in ["0/3", "4/3", "1", "a/b", "1/0", "-1/2", ""] {
            assert!(bad.parse::<Shard>().is_err_and(|e| e.contains(bad)), "{bad}");
        }
        let commands =
            ["simpulse study --quick --shard 1/3 --out p1", "simpulse study --quick --shard=3/3 --out=p3"];
        let commands = commands.map(String::from);
        assert_eq!(missing_parts(&commands), ["simpulse study --quick --shard 2/3 --out part-2"]);
        assert_eq!(missing_parts(&["simpulse study --out x".into()]), ["simpulse study --out x --resume"]);
        let seeds: SeedRange = "3-5".parse().unwrap();
        assert_eq!(seeds.of(&["a".into()]), ["a@3", "a@4", "a@5"]);
        for bad in ["3", "5-3", "3-3", "a-b", "1-", "0-1000", "-1-2"] {
            assert!(bad.parse::<SeedRange>().is_err_and(|e| e.contains(bad)), "{bad}");
        }
        let late = Shard { index: 7, count: 8 }.split(scenes).unwrap_err().to_string();
        assert_eq!(late, "--shard: 7/8 has no scene: there are 5");
    }
}
