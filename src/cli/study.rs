//! `simpulse study`: compares solvers, whole or in parts.

use super::interrupt::on_interrupt;
use super::output::{note, print};
use super::progress::Bar;
use super::values::{self, Solvers};
use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::solvers::Variant;
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::estimate::free_memory;
use crate::lab::files;
use crate::lab::overrides::{self, Override};
use crate::lab::report::study_file::StudyFile;
use crate::lab::report::{self, answer, by_scene, html, sweep};
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::study::budget::BudgetGrid;
use crate::lab::study::sweep::QuantitySweep;
use crate::lab::study::{self, Record, StudyPlan, telling};
use crate::lab::units::quantity;
use clap::Args;
use clap::builder::NonEmptyStringValueParser;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

/// Examples printed below the help.
pub const EXAMPLES: &str = "\
Without budget options, a solver runs on each scene of the default study at up to three settings.
They come from a search by errors, with the same rule and effort for all solvers (--thorough
repeats it). On other scenes it runs at half, once and twice its standard budget. With budget
options, every combination runs; values that a solver ignores are dropped.
A sweep runs at each solver's standard budget, in colored order at the widest native lanes, unless
other options say otherwise.

Examples:
  simpulse study --quick
  simpulse study --solvers all --out results/all
  simpulse study --scenes pyramid:40 --solvers soft_step --lanes 1,4,8,16 --substeps 4,8
  simpulse study --scenes stack:10,arch --sweep contact-hertz=15,30,60 --out results/hertz
  simpulse study --scenes mass_ratio --sweep mass-ratio=1,10,100,1000 --out results/ratio
  simpulse study --scenes stack:20,my.json --velocity-iterations 4,16,64 --out results/stack
  simpulse study --scenes my.json --solvers all --thorough --out results/my
  simpulse study --scenes pyramid:20 --standard --orders natural,reversed,shuffled,colored --out results/orders";

/// Lists are separated by commas.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// Scenes
    #[arg(long, value_delimiter = ',', value_name = "SCENE,…", value_parser = values::scene(), help = values::scenes_help())]
    pub scenes: Vec<String>,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Lanes per instruction [default: 1, 4, 8, and 16 where this build has instructions for it;
    /// wider ones are emulated]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = values::lanes())]
    pub lanes: Vec<LaneWidth>,
    /// Constraint orders [default: natural,colored]
    #[arg(long, value_delimiter = ',', value_name = "ORDER,…", value_parser = values::order())]
    pub orders: Vec<Order>,
    /// Impact laws: own is the solver's, waves solves impacts in waves before the step, none turns bouncing off.
    /// Scenes where nothing bounces run the first one only [default: own,waves; in a sweep own]
    #[arg(long, value_delimiter = ',', value_name = "TREATMENT,…", value_parser = values::impacts())]
    pub impacts: Vec<Impacts>,
    /// Substeps to try
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub substeps: Vec<u32>,
    /// Velocity sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub velocity_iterations: Vec<u32>,
    /// Relaxation sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub relax_iterations: Vec<u32>,
    /// Position sweeps to try, per substep
    #[arg(long, value_delimiter = ',', value_name = "N,…")]
    pub position_iterations: Vec<u32>,
    /// Solver parameters, such as `contact_hertz=60` (`simpulse list solvers` lists them)
    #[arg(long, value_name = "NAME=VALUE,…", value_delimiter = ',')]
    pub set: Vec<Override>,
    /// A curve per solver: one quantity takes several values, all else stays fixed. It is a solver parameter
    /// (contact-hertz), substeps, iterations (velocity sweeps; position sweeps if a solver has no others),
    /// velocity-iterations, relax-iterations, position-iterations, dt (s), friction (of every shape), or mass-ratio
    /// (scene mass_ratio)
    #[arg(long, value_name = "NAME=VALUE,VALUE,…")]
    pub sweep: Option<QuantitySweep>,
    /// Override the scenes' tolerances, such as penetration=5mm,residual=0.05,reference=0.1 (`simpulse list SCENE`
    /// lists them; that of the reference value has the value's unit)
    #[arg(long, value_delimiter = ',', value_name = "NAME=VALUE,…", value_parser = NonEmptyStringValueParser::new())]
    pub tolerance: Vec<String>,
    /// Steps of the runs that measure errors [default: those of each scene]
    #[arg(long)]
    pub steps: Option<u32>,
    /// Rounds of timing, common to all settings of a scene [default: 3]
    #[arg(long)]
    pub repeats: Option<u32>,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Short runs without repeats: an overview in seconds
    #[arg(long)]
    pub quick: bool,
    /// First search the settings of each solver on each scene, by errors alone: minutes for the default study, an hour
    /// for all solvers. Writes them to budgets.csv in the folder
    #[arg(long, conflicts_with_all = ["sweep", "substeps", "velocity_iterations", "relax_iterations", "position_iterations"])]
    pub thorough: bool,
    /// Each solver at half, once and twice its standard budget, whatever was found
    #[arg(long, conflicts_with = "thorough")]
    pub standard: bool,
    /// Print the tables of every scene after the answer
    #[arg(long)]
    pub verbose: bool,
    /// Print JSON instead of text: what study.json holds
    #[arg(long)]
    pub json: bool,
    /// Run part I of N: every N-th scene; `simpulse merge` joins the parts
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Folder for the results
    #[arg(long, default_value = "results", value_name = "FOLDER")]
    pub out: PathBuf,
}

impl StudyArgs {
    /// The plan for these arguments. Errors: unknown names, invalid widths.
    pub fn plan(&self) -> Result<StudyPlan, Error> {
        let mut base = if self.quick { StudyPlan::quick() } else { StudyPlan::default() };
        if self.sweep.is_some() {
            // A sweep draws one curve per solver, so it needs one width and one order.
            (base.widths, base.orders) = (vec![native_width()], vec![Order::Colored]);
        }
        let or = |given: &[String], own: Vec<String>| if given.is_empty() { own } else { unique(given) };
        Ok(StudyPlan {
            scenes: or(&self.scenes, base.scenes),
            solvers: self.solvers.chosen(),
            widths: values::widths(&self.lanes, base.widths),
            orders: if self.orders.is_empty() { base.orders } else { unique(&self.orders) },
            impacts: match (self.impacts.is_empty(), self.sweep.is_some()) {
                (false, _) => unique(&self.impacts),
                (true, true) => vec![Impacts::Own],
                (true, false) => base.impacts,
            },
            budgets: BudgetGrid {
                substeps: self.substeps.clone(),
                velocity_iterations: self.velocity_iterations.clone(),
                relax_iterations: self.relax_iterations.clone(),
                position_iterations: self.position_iterations.clone(),
            },
            overrides: self.set.clone(),
            sweep: self.sweep.clone(),
            found: if self.standard { Arc::default() } else { base.found },
            tolerances: tolerances(&self.tolerance)?,
            steps: self.steps.or(base.steps),
            timing_steps: base.timing_steps,
            repeats: self.repeats.unwrap_or(base.repeats),
            seed: self.seed,
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

/// The values without duplicates, in the order given.
fn unique<T: PartialEq + Clone>(values: &[T]) -> Vec<T> {
    let mut kept: Vec<T> = Vec::new();
    for value in values {
        if !kept.contains(value) {
            kept.push(value.clone());
        }
    }
    kept
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
    let mut plan = args.plan()?;
    let without = match plan.sweep.clone() {
        Some(sweep) => keep_concerned(&sweep, &mut plan.solvers),
        None => String::new(),
    };
    let mut elsewhere = Vec::new();
    if let Some(shard) = args.shard {
        (plan.scenes, elsewhere) = shard.split(plan.scenes)?;
    }
    plan.check()?;
    let cost = study::cost::estimate(&plan)?.note("study", free_memory())?;
    let not_held: String = plan.not_held()?.iter().map(|line| format!("skipped: {line}\n")).collect();
    // Fail before the long computation, not after it.
    files::prepare_folder(&args.out)?;
    let lock = files::Lock::of(&args.out)?;
    note(&(without + &overrides::partly(&plan.solvers, &plan.overrides) + &not_held + &cost));
    if args.thorough {
        let bar = Bar::new();
        plan.found = Arc::new(study::search::search(&plan, &|p| bar.show(p.done, p.total, p.what))?);
        files::write(&args.out.join(study::found::NAME), &plan.found.to_csv()?)?;
    }
    let finished: Arc<Mutex<Vec<Record>>> = Arc::default();
    let rescue = {
        let (plan, out, finished, elsewhere) =
            (plan.clone(), args.out.clone(), Arc::clone(&finished), elsewhere.clone());
        move || {
            let records = finished.lock().unwrap_or_else(PoisonError::into_inner).clone();
            note(&keep(&plan, &out, records, elsewhere));
        }
    };
    let guard = on_interrupt(rescue);
    let bar = Bar::new();
    let records = study::run(&plan, &|p| bar.show(p.done, p.total, p.what), &|scene| {
        finished.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(scene);
    })?;
    drop(bar);
    let study = StudyFile::new(&plan, records, elsewhere);
    let replays = telling::recordings(&plan, &study.records)?;
    // Files of an earlier study are now replaced. A signal waits until that is complete.
    let guard = guard.finish();
    let replays = html::write_recordings(&args.out, &replays)?;
    let mut paths = report::write_study(&args.out, &study)?;
    paths.extend(replays);
    drop(guard);
    drop(lock);
    if args.json {
        return print(&String::from_utf8_lossy(&study.to_json()?));
    }
    print(&text(&study, plan.steps, &args.out, &paths, args.verbose))
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

/// The answer or, for a sweep, its curves as text; then the list of written files.
pub fn text(study: &StudyFile, steps: Option<u32>, out: &Path, paths: &[PathBuf], verbose: bool) -> String {
    let answer = match sweep::is_sweep(&study.records) {
        true => sweep::text(&study.records, &study.environment),
        false => answer::text(&study.records, &study.environment, steps),
    };
    let mut text = answer::wrapped(&study.caution())
        + &answer
        + &answer::wrapped(&study.budgets())
        + &by_scene::order_tables(&study.records)
            .iter()
            .map(|t| format!("\n{}", t.text()))
            .collect::<String>();
    let names: Vec<String> =
        paths.iter().filter_map(|p| Some(p.file_name()?.to_string_lossy().into_owned())).collect();
    text += &answer::wrapped(&format!("\nwrote {} in {}\n", names.join(", "), out.display()));
    if verbose {
        text += &format!("\n{}", report::tables(&study.records));
    }
    text
}

/// Writes the finished scenes of an interrupted study; returns a message.
fn keep(plan: &StudyPlan, out: &Path, records: Vec<Record>, elsewhere: Vec<String>) -> String {
    let done = records.chunk_by(|a, b| a.scene == b.scene).count();
    let all = plan.scenes.len();
    if done == 0 {
        return format!("interrupted before the first of {all} scenes was finished; nothing written\n");
    }
    // Scenes are run in the order of the plan.
    let missing = plan.scenes[done.min(all)..].iter().cloned().chain(elsewhere).collect();
    // Existing recordings belong to another study.
    if let Err(error) = html::write_recordings(out, &[]) {
        return format!("interrupted; finished scenes could not be written: {error}\n");
    }
    match report::write_study(out, &StudyFile::new(plan, records, missing)) {
        Ok(_) if done == all => format!("interrupted; all scenes are in {}\n", out.display()),
        Ok(_) => format!("interrupted; {done} of {all} scenes are in {}, marked as partial\n", out.display()),
        Err(error) => format!("interrupted; finished scenes could not be written: {error}\n"),
    }
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
        let late = Shard { index: 7, count: 8 }.split(scenes).unwrap_err().to_string();
        assert_eq!(late, "--shard: 7/8 has no scene: there are 5");
    }
}
