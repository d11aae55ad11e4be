//! `simpulse advise`: a thorough study of one scene with limits instead of the scene's tolerances.

use super::output::{print, print_json, value};
use super::progress::Bar;
use super::values::{self, ImpactArgs, Solvers, scene_help};
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::profile::waiting;
use crate::lab::report::answer;
use crate::lab::report::by_scene::brief_table;
use crate::lab::report::doc::{self, DocBlock, DocTable, Tone, lines};
use crate::lab::report::environment::Environment;
use crate::lab::report::units::{percent, quantity, si, si_short};
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::study::answer::Answer;
use crate::lab::study::{self, Record, StudyPlan, open_scene};
use clap::Args;
use serde_json::json;
use std::process::ExitCode;

/// Find the cheapest setting within given tolerances on a scene
///
/// Searches the settings of each solver as `simpulse study --thorough` does, with these limits instead of the scene's
/// tolerances, and times up to three of each solver interleaved. If the scene has to rest, the settings in question run
/// for a minute. A file that says nothing about what must hold is run under the default solver first: if it comes to
/// rest there, rest is required. Prints the fastest setting that meets every limit, the next solver, faster settings
/// that do not and why, and the command that runs it and prints all its errors.
///
/// Exit code 0: a setting meets all limits; 1: none does, and the nearest is printed; 2: the request is invalid.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Lengths are in nm, um, mm, cm or m, times in ns, us, ms or s; a distance to the
reference value is in the unit of that value (`simpulse list SCENE` tells it).

Examples:
  simpulse advise stack:20 --max-penetration 10mm
  simpulse advise arch --max-penetration 5mm --max-time 50us --max-residual 1e-3
  simpulse advise incline_slip --max-reference 1mm --solvers soft_step,pgs --lanes 8 --json > advice.json")]
pub struct AdviseArgs {
    /// Scene
    #[arg(value_name = "SCENE", value_parser = values::scene(), help = scene_help())]
    pub scene: String,
    /// Largest overlap allowed, such as 1mm: of 99 % of all contact points, and of every point in the last second
    /// where the scene has to rest
    #[arg(help_heading = "Limits", long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub max_penetration: Option<String>,
    /// Largest mean time of a step allowed, such as 500us
    #[arg(help_heading = "Limits", long, value_name = "TIME", allow_hyphen_values = true)]
    pub max_time: Option<String>,
    /// Largest distance to the scene's reference value allowed
    #[arg(help_heading = "Limits", long, value_name = "VALUE", allow_hyphen_values = true)]
    pub max_reference: Option<String>,
    /// Largest force error allowed (how far contact impulses are from the contact law): root mean square, as a fraction of
    /// the lighter body's weight
    #[arg(help_heading = "Limits", long, value_name = "NUMBER", allow_hyphen_values = true)]
    pub max_residual: Option<String>,
    /// Largest rms speed allowed after one minute, where the scene has to rest [default: 0.5 % of a body size per
    /// second]
    #[arg(help_heading = "Limits", long, value_name = "SPEED", allow_hyphen_values = true)]
    pub max_rest_speed: Option<String>,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Impacts
    #[command(flatten)]
    pub impacts: ImpactArgs,
    /// Lanes per instruction; with 1 also file order [default: the widest that this build has
    /// instructions for; wider ones are emulated]
    #[arg(help_heading = "Solver and setting", long, value_delimiter = ',', value_name = "N,…", value_parser = values::lanes())]
    pub lanes: Vec<LaneWidth>,
    /// Steps of the runs that measure errors [default: those of the scene]
    #[arg(help_heading = "Scene and time", long, value_name = "N")]
    pub steps: Option<u32>,
    /// Timing runs per setting
    #[arg(help_heading = "Measuring", long, value_name = "N", default_value_t = 5)]
    pub repeats: u32,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(help_heading = "Scene and time", long, default_value_t = 1)]
    pub seed: u64,
    /// Print JSON instead of text: everything that was timed
    #[arg(help_heading = "Output", long)]
    pub json: bool,
}

/// A plan, the largest time of a step (ns) and what was found out about the scene.
struct Request {
    plan: StudyPlan,
    max_ns: f64,
    found_out: Vec<String>,
}

impl AdviseArgs {
    fn request(&self) -> Result<Request, Error> {
        let loaded = open_scene(&self.scene, Some(self.seed), self.steps, None)?;
        let truth = loaded.truth.as_ref().map_or("", |t| t.unit);
        let read = |option: &str, text: &Option<String>, unit: &str| {
            text.as_deref().map(|text| quantity(option, text, unit)).transpose()
        };
        let tolerances = GivenTolerances {
            penetration: read("max-penetration", &self.max_penetration, "m")?,
            residual: read("max-residual", &self.max_residual, "")?,
            rest: read("max-rest-speed", &self.max_rest_speed, "m/s")?,
            truth: match (&self.max_reference, &loaded.truth) {
                (Some(text), None) => {
                    let message = format!("{text}, but no reference value of '{}' is known", self.scene);
                    return Err(Error::invalid("max-reference", message));
                }
                (text, _) => read("max-reference", text, truth)?,
            },
        };
        let max_ns = read("max-time", &self.max_time, "s")?.map_or(f64::INFINITY, |s| 1e9 * s);
        if (tolerances.penetration, tolerances.residual, tolerances.truth) == (None, None, None) {
            let message = "set at least one limit: --max-penetration, --max-residual or --max-reference";
            return Err(Error::invalid("advise", message));
        }
        let widths = values::widths(&self.lanes, vec![native_width()]);
        let natural = widths.contains(&LaneWidth::W1).then_some(Order::Natural);
        let mut plan = StudyPlan {
            scenes: vec![self.scene.clone()],
            solvers: self.solvers.chosen(),
            orders: natural.into_iter().chain([Order::Colored]).collect(),
            widths,
            impacts: vec![self.impacts.impacts],
            thorough: true,
            tolerances,
            only_given: true,
            steps: self.steps,
            repeats: self.repeats,
            seed: self.seed,
            ..StudyPlan::default()
        };
        plan.check()?;
        let found_out = plan.find_out()?;
        if self.max_rest_speed.is_some() && !loaded.rests() && plan.rests.is_empty() {
            let message = format!("given, but nothing of '{}' has to rest", self.scene);
            return Err(Error::invalid("max-rest-speed", message));
        }
        Ok(Request { plan, max_ns, found_out })
    }
}

/// Runs the command.
pub fn run(args: &AdviseArgs) -> Result<ExitCode, Error> {
    let request = args.request()?;
    let bar = Bar::new();
    let records = study::run(&request.plan, &|p| bar.show(p.done, p.total, p.what), &mut |_, _| Ok(()))?;
    drop(bar);
    let Some(answer) = Answer::of(&records) else {
        return Err(Error::invalid("advise", "no solver runs this scene"));
    };
    let best = answer.best().filter(|r| r.cost_ns() <= request.max_ns);
    let nearest = answer.best().or(answer.nearest).filter(|_| best.is_none());
    match args.json {
        true => print_json(&json!({
            "environment": Environment::current(),
            "scene": args.scene,
            "found_out": request.found_out,
            "limits": request.plan.tolerances,
            "max_step_ns": Some(request.max_ns).filter(|ns| ns.is_finite()),
            "best": value(&best)?,
            "runner_up": value(&answer.good.get(1).filter(|_| best.is_some()))?,
            "nearest": value(&nearest)?,
            "trials": value(&records)?,
        }))?,
        false => {
            let text = text(&request, &answer, &records, best);
            print(&(text + &values::left_out(&request.plan.solvers)))?
        }
    };
    Ok(if best.is_some() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn text(request: &Request, answer: &Answer, records: &[Record], best: Option<&Record>) -> String {
    let scene = &request.plan.scenes[0];
    let mut text: String = request.found_out.iter().map(|line| lines(line)).collect();
    text += &lines(&format!("limits on {scene}: {}", limits(request, &records[0])));
    if let (Some(fastest), None) = (answer.best(), best) {
        let time = si(1e-9 * fastest.cost_ns(), "s");
        text += &format!("none of the settings tried meets the limits: the fastest takes {time} a step\n");
    }
    let (cheapest, without) = answer::cheapest(std::slice::from_ref(answer), records, scene);
    text += &doc::text(&[DocBlock::Table(cheapest), DocBlock::Text(Tone::Plain, without)]);
    let compared = DocTable { caption: COMPARED.into(), ..brief_table(&compared(answer, records)) };
    text += &doc::text(&[DocBlock::Table(compared)]);
    let waited = records.iter().filter_map(|r| Some(r.sample.as_ref()?.waited)).fold(0.0, f64::max);
    text += &waiting::note(Some(waited));
    if let Some(shown) = answer.best().or(answer.nearest) {
        let steps = request.plan.steps.map_or(String::new(), |n| format!(" --steps {n}"));
        text += &format!("\nto run it: {}{steps} --seed {}\n", shown.command(scene), request.plan.seed);
    }
    text
}

/// The limits as text.
fn limits(request: &Request, record: &Record) -> String {
    let (given, unit) = (&request.plan.tolerances, record.truth.map_or("", |t| t.unit));
    let rest = record.tolerances.rest.map(|t| t.value);
    let max_ns = Some(request.max_ns).filter(|ns| ns.is_finite());
    let parts = [
        given.penetration.map(|p| format!("overlap ≤ {}", si_short(p, "m"))),
        given.residual.map(|r| format!("force error ≤ {}", percent(r))),
        given.truth.map(|t| format!("distance to reference value ≤ {}", si_short(t, unit))),
        rest.map(|v| format!("stands for a minute, rest speed ≤ {}", si_short(v, "m/s"))),
        max_ns.map(|ns| format!("time ≤ {}", si_short(1e-9 * ns, "s"))),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

const COMPARED: &str = "\
The cheapest good setting of each solver, or its nearest one; before them what is faster and not good enough, the slowest \
of each solver";

/// The settings of [`COMPARED`].
fn compared<'a>(answer: &Answer<'a>, records: &'a [Record]) -> Vec<&'a Record> {
    let one_each = |list: Vec<&'a Record>, but: &[&Record]| {
        let mut kept: Vec<&Record> = Vec::new();
        for record in list {
            if kept.iter().chain(but).all(|k| k.solver != record.solver) {
                kept.push(record);
            }
        }
        kept
    };
    let good = answer.of_each_solver();
    let least = answer.best().map_or(0.0, Record::cost_ns);
    let mut faster: Vec<&Record> =
        records.iter().filter(|r| r.excess() > 1.0 && r.cost_ns() < least).collect();
    faster
        .sort_by(|a, b| b.later.is_some().cmp(&a.later.is_some()).then(b.cost_ns().total_cmp(&a.cost_ns())));
    let mut others: Vec<&Record> = records.iter().collect();
    others.sort_by(|a, b| a.excess().total_cmp(&b.excess()));
    let (faster, others) = (one_each(faster, &[]), one_each(others, &good));
    faster.into_iter().chain(good).chain(others).collect()
}
