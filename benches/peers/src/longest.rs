//! The longest steps of random scenes, relative to those of Box2D in the same scene.
//!
//! Engines take turns, scene by scene and run by run. Runs are deterministic, so the time of a step is the
//! minimum over them. The answers are checked by [`crate::torture`].

use crate::engine::{Contender, Maker};
use crate::table::head;
use crate::torture::{contender, start};
use comfy_table::Table;
use serde::Serialize;
use simpulse::engine::clock::timed;
use simpulse::lab::study::pace::keep_least;
use simpulse::lab::study::sample::quantile;
use simpulse::lab::torture::families::Family;
use simpulse::lab::torture::{Campaign, TortureCase};
use std::io::IsTerminal;
use std::path::Path;

/// Limit on the longest step, as a multiple of Box2D's in the same scene (1).
const LIMIT: f64 = 2.0;

/// Engines at their defaults. The first is the reference.
const ENGINES: [(&str, Contender); 4] = [
    ("Box2D", contender(Maker::Box2d, 4, true)),
    ("rapier", contender(Maker::Rapier, 4, false)),
    ("soft_step", contender(Maker::Solver("soft_step"), 4, false)),
    ("shim", contender(Maker::Solver("shim"), 14, true)),
];

/// Times of the steps of a scene in an engine (µs).
#[derive(Serialize)]
struct Row {
    family: &'static str,
    number: u32,
    engine: &'static str,
    first: f64,
    longest: f64,
    longest_step: usize,
    mean: f64,
}

impl Row {
    fn of(family: &'static str, number: u32, engine: &'static str, steps: &[f64]) -> Self {
        let (at, longest) = steps
            .iter()
            .enumerate()
            .fold((0, 0.0), |most, (k, &us)| if us > most.1 { (k, us) } else { most });
        let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
        let first = steps.first().copied().unwrap_or(0.0);
        Row { family, number, engine, first, longest, longest_step: at + 1, mean }
    }
}

/// Runs a case to its end, or until the engine reports that it diverged. Keeps the shorter time of each step
/// (µs). Errors: a part of the scene that the engine does not support.
fn run(case: &TortureCase, contender: &Contender, least: &mut Vec<f64>) -> Result<(), String> {
    let mut engine = start(case, contender)?;
    for step in 0..case.scene.steps as usize {
        let (stepped, took) = timed(|| engine.step());
        keep_least(least, step, 1e6 * took.as_secs_f64());
        if stepped.is_err() {
            break;
        }
    }
    Ok(())
}

/// Times the scenes of a campaign `repeats` times in each engine and prints a table; writes the rows of all
/// scenes to a CSV file. Errors: the file.
pub fn compare(campaign: &Campaign, repeats: u32, log: Option<&Path>) -> Result<(), String> {
    let failed = |e: csv::Error| format!("{}: {e}", log.map_or(String::new(), |p| p.display().to_string()));
    let mut csv = log.map(csv::Writer::from_path).transpose().map_err(failed)?;
    let (mut rows, mut refused) = (Vec::new(), 0);
    let scenes = campaign.list();
    for (k, &(family, number)) in scenes.iter().enumerate() {
        if std::io::stderr().is_terminal() {
            eprint!("\r{} of {} scenes ", k + 1, scenes.len());
        }
        let case = family.case(campaign.seed, number);
        let mut steps = ENGINES.map(|_| Ok::<_, String>(Vec::new()));
        for _ in 0..repeats {
            for ((_, contender), steps) in ENGINES.iter().zip(&mut steps) {
                if let Ok(least) = steps
                    && let Err(message) = run(&case, contender, least)
                {
                    *steps = Err(message);
                }
            }
        }
        let timed: Result<Vec<_>, _> = steps.into_iter().collect();
        let Ok(timed) = timed else {
            refused += 1;
            continue;
        };
        let scene: Vec<Row> = ENGINES
            .iter()
            .zip(&timed)
            .map(|((engine, _), steps)| Row::of(family.name, number, engine, steps))
            .collect();
        if let Some(csv) = &mut csv {
            scene
                .iter()
                .try_for_each(|row| csv.serialize(row))
                .and_then(|()| Ok(csv.flush()?))
                .map_err(failed)?;
        }
        rows.push(scene);
    }
    println!(
        "Step times ÷ those of {} in the same scene, on one thread; {refused} scenes refused",
        ENGINES[0].0
    );
    println!("{}", table(&campaign.families, &rows));
    Ok(())
}

/// One line per family and engine, then all families together.
fn table(families: &[&'static Family], rows: &[Vec<Row>]) -> Table {
    let over = format!("over {LIMIT}");
    let mut table = head(&["family", "engine", "scenes", "longest", "99 %", "most", &over, "mean", "most"]);
    for family in families.iter().map(|f| f.name).chain(["all"]) {
        for engine in 1..ENGINES.len() {
            let own = || rows.iter().filter(|scene| scene[0].family == family || family == "all");
            let ratios = |get: fn(&Row) -> f64| -> Vec<f64> {
                own().map(|scene| get(&scene[engine]) / get(&scene[0])).collect()
            };
            let (longest, mean) = (ratios(|row| row.longest), ratios(|row| row.mean));
            if longest.is_empty() {
                continue;
            }
            let mut cells =
                vec![family.to_string(), ENGINES[engine].0.to_string(), longest.len().to_string()];
            cells.extend([0.5, 0.99, 1.0].map(|p| format!("{:.2}", quantile(&longest, p))));
            cells.push(longest.iter().filter(|&&ratio| ratio > LIMIT).count().to_string());
            cells.extend([0.5, 1.0].map(|p| format!("{:.2}", quantile(&mean, p))));
            table.add_row(cells);
        }
    }
    table
}
