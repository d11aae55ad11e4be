//! `simpulse advise`: a thorough study of one scene with limits instead of the scene's tolerances.

use super::output::{print, print_json, value};
use super::progress::Bar;
use super::values::{self, ImpactArgs, Solvers, scene_help};
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::world::Order;
use crate::lab::error::Error;
use crate::lab::profile::waiting;
use crate::lab::report::answer::{setting, worst, wrapped};
use crate::lab::report::environment::Environment;
use crate::lab::report::table::{error_list, finish, table};
use crate::lab::report::units::{digits, quantity, ratio, si, si_short};
use crate::lab::scenes::tolerance::GivenTolerances;
use crate::lab::study::answer::{Answer, fails_last, order};
use crate::lab::study::{self, Record, StudyPlan, open_scene};
use clap::Args;
use serde_json::json;
use std::process::ExitCode;

/// Find the cheapest setting within given tolerances on a scene
///
/// Searches the settings of each solver as `simpulse study --thorough` does, with these limits instead of the scene's
/// tolerances, and times up to three of each solver interleaved. If the scene has to rest, the settings in question run
/// for a minute. A file that says nothing about what must hold is run under the default solver first: if it comes to
/// rest there, rest is required. Prints the fastest setting that meets every limit with all its errors, faster ones
/// that do not and why, the runners-up, and the command that runs it.
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
    /// Largest penetration allowed, such as 1mm: of 99 % of all contact points, and of every point in the last second
    /// where the scene has to rest
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub max_penetration: Option<String>,
    /// Largest mean time of a step allowed, such as 500us
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub max_time: Option<String>,
    /// Largest distance to the scene's reference value allowed
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    pub max_reference: Option<String>,
    /// Largest contact-law residual allowed: root mean square, in units of the lighter body's weight × step
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    pub max_residual: Option<String>,
    /// Largest rms speed allowed after one minute, where the scene has to rest [default: 0.5 % of a body size per
    /// second]
    #[arg(long, value_name = "SPEED", allow_hyphen_values = true)]
    pub max_rest_speed: Option<String>,
    /// Solvers
    #[command(flatten)]
    pub solvers: Solvers,
    /// Impacts
    #[command(flatten)]
    pub impacts: ImpactArgs,
    /// Lanes per instruction; with 1 also natural order [default: the widest that this build has
    /// instructions for; wider ones are emulated]
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = values::lanes())]
    pub lanes: Vec<LaneWidth>,
    /// Steps of the runs that measure errors [default: those of the scene]
    #[arg(long, value_name = "N")]
    pub steps: Option<u32>,
    /// Timing runs per setting
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub repeats: u32,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print JSON instead of text: everything that was timed
    #[arg(long)]
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
            let text = text(&request, &answer, &records, best, nearest);
            print(&(text + &values::left_out(&request.plan.solvers)))?
        }
    };
    Ok(if best.is_some() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn text(
    request: &Request,
    answer: &Answer,
    records: &[Record],
    best: Option<&Record>,
    nearest: Option<&Record>,
) -> String {
    let scene = &request.plan.scenes[0];
    let mut text: String = request.found_out.iter().map(|line| wrapped(&format!("{line}\n"))).collect();
    let limits = format!("limits on {scene}: {}\n\n", limits(request, &records[0]));
    if let Some(best) = best {
        text += &format!("{}\n\n{}", sentence(best), faster(records, best, request.max_ns));
        text += &match answer.good.get(1) {
            Some(next) => format!("runner-up: {}, {}\n", name(next), behind(next, best)),
            None => "no other setting that was timed meets the limits\n".to_string(),
        };
        text += &limits;
    } else if let Some(nearest) = nearest {
        text +=
            &format!("{limits}none of the settings tried meets the limits\n\nnearest: {}\n", name(nearest));
        text += &format!("it {}\n\n", why_not(nearest, request.max_ns));
    } else {
        text += &format!("{limits}no setting holds\n");
        if let Some(last) = fails_last(records) {
            text += &format!("longest: {}: {}\n", name(last), why_not(last, request.max_ns));
            text += &format!("to see it: {}\n\n", last.command_to_see(scene));
        }
    }
    if let Some(shown) = best.or(nearest) {
        text += &evidence(shown);
        text += &format!("\n{}", compared(answer, records, request.max_ns));
        let waited = records.iter().filter_map(|r| Some(r.sample.as_ref()?.waited)).fold(0.0, f64::max);
        text += &waiting::note(Some(waited));
        let steps = request.plan.steps.map_or(String::new(), |n| format!(" --steps {n}"));
        let seed = request.plan.seed;
        text += &format!("\nto run it: {}{steps} --seed {seed}\n", shown.command(scene));
    }
    text
}

/// The limits as text.
fn limits(request: &Request, record: &Record) -> String {
    let (given, unit) = (&request.plan.tolerances, record.truth.map_or("", |t| t.unit));
    let rest = record.tolerances.rest.map(|t| t.value);
    let parts = [
        given.penetration.map(|p| format!("penetration ≤ {}", si_short(p, "m"))),
        given.residual.map(|r| format!("residual ≤ {}", ratio(r))),
        given.truth.map(|t| format!("distance to reference value ≤ {}", si_short(t, unit))),
        rest.map(|v| format!("stands for a minute, rest speed ≤ {}", si_short(v, "m/s"))),
        Some(request.max_ns)
            .filter(|ns| ns.is_finite())
            .map(|ns| format!("time ≤ {}", si_short(1e-9 * ns, "s"))),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The advice: its cost, and its errors.
fn sentence(best: &Record) -> String {
    let [mean, longest] = [best.cost_ns(), best.sample.as_ref().map_or(0.0, |s| s.worst_ns)];
    let mut text = format!(
        "{}: {} a step (mean; longest {}).",
        name(best),
        si(1e-9 * mean, "s"),
        si(1e-9 * longest, "s")
    );
    if let Some(errors) = &best.errors {
        let depth = si(errors.penetration(best.tolerances.rest.is_some()), "m");
        text += &match best.later.and_then(|later| Some((later.seconds, later.rest_speed_m_s?))) {
            Some((seconds, speed)) => {
                let speed = si(speed, "m/s");
                format!(" Stands for {seconds:.0} s (checked), {depth} of penetration, {speed} at rest.")
            }
            None => format!(" {depth} of penetration."),
        };
    }
    text
}

/// Settings that are faster but not good enough, the slowest of each solver, with the reason.
fn faster(records: &[Record], best: &Record, max_ns: f64) -> String {
    let mut faster: Vec<&Record> =
        records.iter().filter(|r| r.excess() > 1.0 && r.cost_ns() < best.cost_ns()).collect();
    faster
        .sort_by(|a, b| b.later.is_some().cmp(&a.later.is_some()).then(b.cost_ns().total_cmp(&a.cost_ns())));
    let mut rows = table(&["  rejected although faster", "µs/step", "why"]);
    let mut solvers: Vec<&str> = Vec::new();
    for record in faster {
        if !solvers.contains(&record.solver) {
            solvers.push(record.solver);
            rows.add_row([
                format!("  {}", name(record)),
                digits(1e-3 * record.cost_ns()),
                why_not(record, max_ns),
            ]);
        }
    }
    if solvers.is_empty() { String::new() } else { finish(rows, 1) + "\n" }
}

/// `soft_step, 4 sub 1 vel 1 rel @8`
fn name(record: &Record) -> String {
    let [solver, budget, ..] = setting(record);
    format!("{solver}, {budget}")
}

/// Why a setting does not meet the limits.
fn why_not(record: &Record, max_ns: f64) -> String {
    record.why_failed().unwrap_or_else(|| match record.excess() <= 1.0 && record.cost_ns() > max_ns {
        true => format!("takes {} a step", si(1e-9 * record.cost_ns(), "s")),
        false => worst(record),
    })
}

/// How much slower a setting is than the best one.
fn behind(next: &Record, best: &Record) -> String {
    let percent = 100.0 * (next.cost_ns() / best.cost_ns() - 1.0);
    match order(next, best).is_eq() {
        true => format!("tied: {percent:.1} % slower, within the noise"),
        false => format!("{percent:.1} % slower"),
    }
}

/// Time and errors of a setting.
fn evidence(record: &Record) -> String {
    let mut text = String::new();
    if let Some(time) = &record.sample {
        let value = format!("{} ± {} µs", digits(1e-3 * time.median_ns), digits(1e-3 * time.spread_ns));
        text += &format!("  {:<36}{value:>12} ({} rounds)\n", "time of a step, median", time.rounds);
    }
    if let Some(errors) = &record.errors {
        text += &error_list(errors);
    }
    if let Some(truth) = &record.truth {
        let error = truth.error.map_or("not reached".to_string(), |e| si(e, truth.unit));
        let known = format!("{} = {}", truth.quantity, si(truth.expected, truth.unit));
        text += &format!("  {:<36}{error:>12} ({known})\n", "distance to reference value");
    }
    text
}

/// The cheapest good setting of each solver or, if it has none, its nearest one.
fn compared(answer: &Answer, records: &[Record], max_ns: f64) -> String {
    let good = answer.of_each_solver();
    let mut others: Vec<&Record> = Vec::new();
    let mut rest: Vec<&Record> =
        records.iter().filter(|r| good.iter().all(|g| g.solver != r.solver)).collect();
    rest.sort_by(|a, b| a.excess().total_cmp(&b.excess()));
    for record in rest {
        if others.iter().all(|r| r.solver != record.solver) {
            others.push(record);
        }
    }
    let mut rows = table(&[
        "compared",
        "µs/step",
        "median",
        "longest",
        "slower",
        "penetration",
        "residual",
        "reference",
        "limits",
    ]);
    let first = good.first().copied();
    for record in good.into_iter().chain(others) {
        let [.., mean, median, longest] = setting(record);
        let slower = match first {
            Some(first) if !std::ptr::eq(first, record) && record.sample.is_some() => {
                match order(record, first).is_eq() {
                    true => "tie".to_string(),
                    false => format!("{:.1} %", 100.0 * (record.cost_ns() / first.cost_ns() - 1.0)),
                }
            }
            _ => "–".to_string(),
        };
        let is_met = record.excess() <= 1.0 && record.cost_ns() <= max_ns;
        let nothing = || "–".to_string();
        let rests = record.tolerances.rest.is_some();
        rows.add_row([
            name(record),
            mean,
            median,
            longest,
            slower,
            record.errors.map_or_else(nothing, |e| si(e.penetration(rests), "m")),
            record.errors.map_or_else(nothing, |e| ratio(e.law_rms_lighter())),
            record.truth.map_or_else(nothing, |t| t.error.map_or("missed".into(), |e| si(e, t.unit))),
            if is_met { "met".into() } else { why_not(record, max_ns) },
        ]);
    }
    finish(rows, 1)
}
