//! `simpulse run --copies`: copies of a scene from different seeds, as one batch.

use super::output::{note, print, print_json, value};
use super::progress::Bar;
use super::run::{RunArgs, settings};
use crate::engine::world::Settings;
use crate::lab::copies::{self, Copies};
use crate::lab::error::Error;
use crate::lab::memory;
use crate::lab::report::ensemble::Interval;
use crate::lab::report::environment::Environment;
use crate::lab::report::units::{bodies, percent, si};
use crate::lab::scenes::Loaded;
use crate::lab::study::{budget, open_scene, seed_of};
use serde_json::{Value, json};
use std::process::ExitCode;

/// A figure of all copies: name, values, and how to write one.
struct Figure<'a> {
    name: &'a str,
    values: Vec<f64>,
    show: Box<dyn Fn(f64) -> String + 'a>,
}

/// Metrics that the JSON has, by their names in [`METRICS`](crate::lab::metrics::METRICS).
const ERRORS: [&str; 5] = [
    "held_depth_p99_m",
    "rest_depth_max_m",
    "penetration_max_m",
    "residual_rms_lighter_weights",
    "rest_speed_m_s",
];

/// Runs the copies, from as many seeds.
pub fn run(args: &RunArgs, count: u32) -> Result<ExitCode, Error> {
    let settings = settings(args, args.setting.settings()?)?;
    let first = args.seed.unwrap_or(1);
    let last = first
        .checked_add(u64::from(count) - 1)
        .ok_or_else(|| Error::invalid("seed", "is too large for as many copies"))?;
    if let Some((whole, _)) = seed_of(&args.scene) {
        let message = format!("have a seed each: name the scene '{whole}', and the first seed with --seed");
        return Err(Error::invalid("copies", message));
    }
    let open = |seed: u64| open_scene(&format!("{}@{seed}", args.scene), None, args.steps, args.dt);
    let one = open(first)?;
    memory::check("run", one.scene.bodies.len(), 0, 2 * count as usize)?;
    let mut loaded = (first..=last).map(open).collect::<Result<Vec<Loaded>, _>>()?;
    let (bar, steps) = (Bar::new(), one.scene.steps as usize);
    let found = copies::run(&mut loaded, &settings, &|step| bar.step(step as usize, steps, "steps"))?;
    drop(bar);
    if !found.same_bits {
        note("note: the timed run had other bits than the measured one\n");
    }
    let lost = found.outcomes.iter().filter(|copy| copy.errors.is_none()).count();
    let held = found.outcomes.iter().filter(|copy| copy.errors.is_some() && copy.broken.is_none()).count();
    if args.json {
        return print_json(&json(args, &one, &settings, &found, [held, lost])?);
    }
    let copies = if count == 1 { "1 copy".into() } else { format!("{count} copies") };
    let mut text = format!(
        "{}: {copies} from seeds {first} to {last}, {} each, {steps} steps of {} · {}, {}\n\ncost\n",
        args.scene,
        bodies(one.scene.bodies.len()),
        si(one.scene.dt, "s"),
        settings.solver.name,
        budget::with_treatments(
            budget::brief(&settings.budget, settings.solver),
            settings.impacts,
            settings.frozen
        )
    );
    let threads =
        if settings.threads > 1 { format!("{} threads", settings.threads) } else { "one thread".into() };
    let time = si(1e-9 * found.copy_step_ns, "s");
    text += &format!("  {:<34}{time:>12}  mean of the whole run, {threads}\n", "time of a step of one copy");
    let figures = figures(&one, &found);
    text += "error, mean over copies ± half of its 95 % interval\n";
    for Figure { name, values, show, .. } in &figures {
        let (mean, rest) = match Interval::of(values) {
            None => ("–".into(), String::new()),
            Some(interval) => {
                let [least, most] = [f64::min, f64::max]
                    .map(|pick| values.iter().copied().reduce(pick).map_or(String::new(), show));
                let half = interval.half().map_or(String::new(), |half| format!("± {}; ", show(half)));
                (show(interval.mean), format!("{half}least {least}, greatest {most}"))
            }
        };
        text += &format!("  {name:<34}{mean:>12}  {rest}\n");
    }
    text += &format!("behavior\n  {:<34}{:>12}  {lost} diverged\n", "holds", format!("{held} of {count}"));
    text += &one.unchecked.iter().map(|what| format!("not checked: {what}\n")).collect::<String>();
    if !one.scene.joints.is_empty() {
        text += "not checked: joints, energy\n";
    }
    print(&text)
}

fn figures<'a>(one: &Loaded, found: &'a Copies) -> Vec<Figure<'a>> {
    let rests = one.rests();
    let errors = || found.outcomes.iter().filter_map(|copy| copy.errors.as_ref());
    let in_unit = |unit| Box::new(move |v| si(v, unit));
    let mut list = vec![
        Figure {
            name: if rests { "overlap, 99 % and at rest" } else { "overlap that the solver left, 99 %" },
            values: errors().map(|e| e.penetration(rests)).collect(),
            show: in_unit("m"),
        },
        Figure {
            name: "greatest overlap",
            values: errors().map(|e| e.penetration_max()).collect(),
            show: in_unit("m"),
        },
        Figure {
            name: "force error, rms",
            values: errors().map(|e| e.law_rms_lighter()).collect(),
            show: Box::new(percent),
        },
        Figure {
            name: "speed at rest, last second",
            values: errors().map(|e| e.rest_velocity()).collect(),
            show: in_unit("m/s"),
        },
    ];
    if let Some(truth) = &one.truth {
        let truths = || found.outcomes.iter().filter_map(|copy| copy.truth);
        list.push(Figure {
            name: "distance to reference value",
            values: truths().filter_map(|truth| truth.error).collect(),
            show: in_unit(truth.unit),
        });
    }
    list
}

/// Everything as JSON.
fn json(
    args: &RunArgs,
    one: &Loaded,
    settings: &Settings,
    found: &Copies,
    [held, lost]: [usize; 2],
) -> Result<Value, Error> {
    let summary = |values: Vec<f64>| {
        let interval = Interval::of(&values);
        let ends = interval.and_then(|interval| interval.ends);
        json!({ "mean": interval.map(|i| i.mean), "interval": ends, "copies": values })
    };
    let errors = |name: &str| {
        let copies = found.outcomes.iter().filter_map(|copy| copy.errors.as_ref());
        summary(copies.filter_map(|errors| errors.get(name)).collect())
    };
    let errors: serde_json::Map<_, _> = ERRORS.iter().map(|&name| (name.into(), errors(name))).collect();
    let reference = one
        .truth
        .as_ref()
        .map(|_| summary(found.outcomes.iter().filter_map(|copy| copy.truth?.error).collect()));
    Ok(json!({
        "environment": Environment::current(),
        "scene": args.scene,
        "bodies": one.scene.bodies.len(),
        "steps": one.scene.steps,
        "copies": found.outcomes.len(),
        "first_seed": args.seed.unwrap_or(1),
        "solver": settings.solver.name,
        "budget": value(&settings.budget)?,
        "threads": settings.threads,
        "copy_step_ns": found.copy_step_ns,
        "bits_equal": found.same_bits,
        "errors": errors,
        "reference_error": reference,
        "hold": held,
        "diverged": lost,
    }))
}
