//! `simpulse advise`: finds the cheapest setting that is good enough, and shows the evidence.

use super::output::{print, print_json};
use super::progress::Bar;
use super::values::{self, ImpactArgs, Solvers, scene_help};
use crate::engine::constraints::Impacts;
use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::world::Order;
use crate::lab::advise::limits::Limits;
use crate::lab::advise::{Advice, FoundTime, SearchPlan, SearchSetting, Trial, advise};
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::profile::waiting;
use crate::lab::report::environment::Environment;
use crate::lab::report::table::{error_list, finish, table};
use crate::lab::report::units::{self, digits, quantity, ratio, si, si_short};
use crate::lab::study::open_scene;
use crate::lab::study::record::Later;
use clap::Args;
use serde_json::{Value, json};
use std::process::ExitCode;

/// Find the cheapest setting within given tolerances on a scene
///
/// Tries solvers, constraint orders, budgets and, where contacts are soft, their stiffness: a grid of doublings
/// first, then values between them. Settings that can only be slower than one already found are skipped. The best few
/// are timed again, interleaved, and the fastest setting that meets every limit is printed with all its errors, the
/// runners-up, and the command that runs it.
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
    /// Largest median time of a step allowed, such as 500us
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
    /// Timing runs per setting in the final comparison
    #[arg(long, value_name = "N", default_value_t = 5)]
    pub repeats: u32,
    /// Time limit of the search (s)
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    pub seconds: f64,
    /// Random seed: of scenes that have one, and of the order of timing runs
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print JSON instead of text: everything that was tried
    #[arg(long)]
    pub json: bool,
}

impl AdviseArgs {
    fn plan(&self) -> Result<SearchPlan, Error> {
        let loaded = open_scene(&self.scene, Some(self.seed), self.steps, None)?;
        let truth = loaded.truth.as_ref().map_or("", |t| t.unit);
        let read = |option: &str, text: &Option<String>, unit: &str| {
            text.as_deref().map(|text| quantity(option, text, unit)).transpose()
        };
        let limits = Limits {
            penetration: read("max-penetration", &self.max_penetration, "m")?,
            time_ns: read("max-time", &self.max_time, "s")?.map(|s| 1e9 * s),
            residual: read("max-residual", &self.max_residual, "")?,
            rest: match (loaded.tolerances.rest, &self.max_rest_speed) {
                (None, Some(text)) => {
                    let message = format!("{text}, but nothing of '{}' has to rest", self.scene);
                    return Err(Error::invalid("max-rest-speed", message));
                }
                (own, text) => read("max-rest-speed", text, "m/s")?.or(own.map(|t| t.value)),
            },
            truth: match (&self.max_reference, &loaded.truth) {
                (Some(text), None) => {
                    let message = format!("{text}, but no reference value of '{}' is known", self.scene);
                    return Err(Error::invalid("max-reference", message));
                }
                (text, _) => read("max-reference", text, truth)?,
            },
        };
        if (limits.penetration, limits.residual, limits.truth) == (None, None, None) {
            let message = "set at least one limit: --max-penetration, --max-residual or --max-reference";
            return Err(Error::invalid("advise", message));
        }
        if !(self.seconds > 0.0 && self.seconds.is_finite()) {
            return Err(Error::invalid("seconds", format!("{} is not a positive number", self.seconds)));
        }
        Ok(SearchPlan {
            scene: self.scene.clone(),
            limits,
            impacts: self.impacts.impacts,
            solvers: self.solvers.chosen(),
            widths: values::widths(&self.lanes, vec![native_width()]),
            steps: self.steps,
            repeats: self.repeats,
            seed: self.seed,
            seconds: self.seconds,
        })
    }
}

/// Runs the command.
pub fn run(args: &AdviseArgs) -> Result<ExitCode, Error> {
    let plan = args.plan()?;
    let bar = Bar::new();
    let advice = advise(&plan, &|p| bar.show(p.done, p.total, p.what))?;
    drop(bar);
    match args.json {
        true => print_json(&json(&plan, &advice))?,
        false => print(&(text(&plan, &advice) + &values::left_out(&plan.solvers) + &repeat(&plan, &advice)))?,
    };
    Ok(if advice.best().is_some() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The command that runs the chosen setting.
fn repeat(plan: &SearchPlan, advice: &Advice) -> String {
    let Some(chosen) = advice.best().or(advice.nearest()) else { return String::new() };
    let SearchSetting { solver, order, budget, parameters, impacts } = &chosen.setting;
    let mut words = vec!["simpulse run".to_string(), quoted(&plan.scene)];
    words.push(format!("--solver {}", solver.name));
    match order {
        Order::Colored => words.push(format!("--lanes {}", chosen.time.map_or(1, |t| t.lanes))),
        order => words.push(format!("--order {}", order.name())),
    }
    words.push(format!("--substeps {}", budget.substeps));
    let fields = [
        ("velocity", budget.velocity_iterations, solver.uses.velocity),
        ("relax", budget.relax_iterations, solver.uses.relax),
        ("position", budget.position_iterations, solver.uses.position),
    ];
    words.extend(fields.iter().filter(|f| f.2).map(|(name, n, _)| format!("--{name}-iterations {n}")));
    let changed = solver.parameters.iter().zip(parameters).filter(|(p, value)| p.default != **value);
    words.extend(changed.map(|(p, value)| format!("--set {}={value}", p.name)));
    words.extend((*impacts != Impacts::Own).then(|| format!("--impacts {}", impacts.name())));
    words.extend(plan.steps.map(|n| format!("--steps {n}")));
    words.push(format!("--seed {}", plan.seed));
    format!("\nto run it: {}\n", words.join(" "))
}

/// A word, quoted for a shell if necessary.
fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.:/".contains(c);
    match word.chars().all(is_plain) && !word.is_empty() {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// The limits as text.
fn limits(plan: &SearchPlan, unit: &str) -> String {
    let l = &plan.limits;
    let parts = [
        l.penetration.map(|p| format!("penetration ≤ {}", si_short(p, "m"))),
        l.residual.map(|r| format!("residual ≤ {}", ratio(r))),
        l.truth.map(|t| format!("distance to reference value ≤ {}", si_short(t, unit))),
        l.rest.map(|v| format!("stands for a minute, rest speed ≤ {}", si_short(v, "m/s"))),
        l.time_ns.map(|t| format!("time ≤ {}", si_short(1e-9 * t, "s"))),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

fn text(plan: &SearchPlan, advice: &Advice) -> String {
    let unit = advice.trials.iter().find_map(|t| t.truth).map_or("", |t| t.unit);
    let mut text = String::new();
    match (advice.best(), advice.nearest()) {
        (Some(best), _) => {
            text += &format!("{}\n\n", sentence(plan, best));
            text += &rejected(plan, advice);
            text += &match advice.runner_up() {
                Some(next) => format!("runner-up: {}, {}\n", name(next), loses(next, best)),
                None => "no other setting in the final comparison meets the limits\n".to_string(),
            };
            text +=
                &format!("limits on {}: {}\n\n{}", plan.scene, limits(plan, unit), evidence(best, advice));
        }
        (None, Some(nearest)) => {
            text += &format!("{}: {}\n", plan.scene, limits(plan, unit));
            text += "none of the settings tried meets the limits\n\nnearest: ";
            text += &format!("{}\n{}\n", name(nearest), evidence(nearest, advice));
            let over = match nearest.excess.is_finite() {
                true => format!("it exceeds its worst limit by a factor of {}", digits(nearest.excess)),
                false => format!("it {}", nearest.fails(&plan.limits).unwrap_or("failed".into())),
            };
            text += &format!("{over}\n");
        }
        (None, None) => text += "nothing was tried: the time limit was reached\n",
    }
    text += &format!("\n{}", finalists(plan, advice));
    let waited = advice.finalists.iter().filter_map(|t| Some(t.sample.as_ref()?.waited)).fold(0.0, f64::max);
    text += &waiting::note(Some(waited));
    text += &format!(
        "\ntried {} settings; skipped {} that cannot be cheaper{}\n",
        advice.trials.len(),
        advice.left_out,
        if advice.is_cut_short { "; the time limit was reached before the rest" } else { "" }
    );
    text
}

/// The advice: its cost, and its errors.
fn sentence(plan: &SearchPlan, best: &Trial) -> String {
    let mut text = format!("{}: ", name(best));
    if let Some(time) = best.time {
        text += &format!(
            "{} a step (mean; longest {}).",
            si(1e-9 * time.mean_ns, "s"),
            si(1e-9 * time.worst_ns, "s")
        );
    }
    let errors = best.errors.unwrap_or_default();
    let penetration = si(errors.penetration(plan.limits.rest.is_some()), "m");
    match best.later {
        Some(Later { seconds, rest_speed_m_s: Some(speed), .. }) => {
            let speed = si(speed, "m/s");
            text += &format!(
                " Stands for {seconds:.0} s (checked), {penetration} of penetration, {speed} at rest."
            );
        }
        _ => text += &format!(" {penetration} of penetration."),
    }
    text
}

/// Settings that are faster but were rejected, with the reason.
fn rejected(plan: &SearchPlan, advice: &Advice) -> String {
    let mut rows = table(&["  rejected although faster", "µs/step", "longest", "why"]);
    for trial in &advice.rejected {
        let [mean, longest] = [|t: FoundTime| t.mean_ns, |t: FoundTime| t.worst_ns]
            .map(|of| trial.time.map_or("–".into(), |t| digits(1e-3 * of(t))));
        let why = trial.fails(&plan.limits).unwrap_or_default();
        rows.add_row([format!("  {}", trial.setting.text()), mean, longest, why]);
    }
    if advice.rejected.is_empty() { String::new() } else { finish(rows, 1) + "\n" }
}

/// Name of the setting, with its lanes.
fn name(trial: &Trial) -> String {
    format!("{}, {}", trial.setting.text(), lanes(trial))
}

fn lanes(trial: &Trial) -> String {
    match trial.setting.order {
        Order::Colored => units::lanes(trial.time.map_or(1, |t| t.lanes)),
        order => format!("{} order", order.name()),
    }
}

/// How much slower a setting is than the best one.
fn loses(next: &Trial, best: &Trial) -> String {
    let Some((next_time, best_time)) = next.time.zip(best.time) else { return String::new() };
    let percent = 100.0 * (next_time.mean_ns / best_time.mean_ns - 1.0);
    if next.ties(best) {
        format!("tied: {percent:.1} % slower, within the noise")
    } else {
        format!("{percent:.1} % slower")
    }
}

/// Time and errors of a setting.
fn evidence(trial: &Trial, advice: &Advice) -> String {
    let mut text = String::new();
    if let Some(time) = trial.time {
        let value = format!("{} ± {} µs", digits(1e-3 * time.median_ns), digits(1e-3 * time.spread_ns));
        let [repeats, steps] = advice.timing;
        text += &format!("  {:<36}{value:>12} ({repeats} × {steps} steps)\n", "time of a step, median");
    }
    if let Some(failure) = trial.failure {
        text += &format!("  {failure}\n");
    }
    if let Some(errors) = &trial.errors {
        text += &error_list(errors);
    }
    if let Some(truth) = &trial.truth {
        let error = truth.error.map_or("not reached".to_string(), |e| si(e, truth.unit));
        let known = format!("{} = {}", truth.quantity, si(truth.expected, truth.unit));
        text += &format!("  {:<36}{error:>12} ({known})\n", "distance to reference value");
    }
    text
}

/// All settings of the final timing, one line each.
fn finalists(plan: &SearchPlan, advice: &Advice) -> String {
    let rests = plan.limits.rest.is_some();
    let mut rows = table(&[
        "compared",
        "lanes",
        "µs/step",
        "median",
        "longest",
        "±",
        "slower",
        "penetration",
        "residual",
        "reference",
        "limits",
    ]);
    let first = advice.finalists.first();
    for trial in &advice.finalists {
        let time =
            |of: fn(FoundTime) -> f64| trial.time.map_or("failed".to_string(), |t| digits(1e-3 * of(t)));
        let slower = |f: &Trial| Some((f.ties(trial), trial.time?.mean_ns / f.time?.mean_ns - 1.0));
        let slower = first.filter(|f| !std::ptr::eq(*f, trial)).and_then(slower);
        let error = |of: &dyn Fn(&crate::lab::metrics::Errors) -> String| {
            trial.errors.as_ref().map_or("–".to_string(), of)
        };
        rows.add_row([
            trial.setting.text(),
            lanes(trial),
            time(|t| t.mean_ns),
            time(|t| t.median_ns),
            time(|t| t.worst_ns),
            time(|t| t.spread_ns),
            slower.map_or("–".to_string(), |(tied, by)| match tied {
                true => "tie".to_string(),
                false => format!("{:.1} %", 100.0 * by),
            }),
            error(&|e| si(e.penetration(rests), "m")),
            error(&|e| ratio(e.law_rms_lighter())),
            trial
                .truth
                .map_or("–".to_string(), |t| t.error.map_or("missed".to_string(), |e| si(e, t.unit))),
            trial.fails(&plan.limits).unwrap_or("met".into()),
        ]);
    }
    finish(rows, 2)
}

fn json(plan: &SearchPlan, advice: &Advice) -> Value {
    let setting = |s: &SearchSetting| {
        json!({
            "solver": s.solver.name,
            "order": s.order,
            "budget": s.budget,
            "parameters": overrides::by_name(s.solver, &s.parameters),
            "impacts": s.impacts.name(),
        })
    };
    let trial = |t: &Trial| {
        json!({
            "setting": setting(&t.setting),
            "time": t.time,
            "errors": t.errors,
            "reference": t.truth,
            "failure": t.failure,
            "holds": t.broken.map_or("yes", |b| b.mark.word()),
            "failed_step": t.broken.map(|b| b.step),
            "later": t.later,
            "why_not": t.fails(&plan.limits),
            "in_limits": Some(t.excess).filter(|e| e.is_finite()),
            "keeps_limits": t.is_good(),
        })
    };
    json!({
        "environment": Environment::current(),
        "scene": plan.scene,
        "limits": plan.limits,
        "repeats": advice.timing[0],
        "timing_steps": advice.timing[1],
        "steps": plan.steps,
        "seed": plan.seed,
        "best": advice.best().map(trial),
        "runner_up": advice.runner_up().map(trial),
        "nearest": advice.nearest().map(trial),
        "finalists": advice.finalists.iter().map(trial).collect::<Vec<_>>(),
        "trials": advice.trials.iter().map(trial).collect::<Vec<_>>(),
        "left_out": advice.left_out,
        "cut_short": advice.is_cut_short,
    })
}
