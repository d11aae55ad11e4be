//! The random scenes of `simpulse verify --random` under the other engines: how many fail the same checks, and how
//! long the longest steps take relative to those of Box2D in the same scene.

use crate::engine::{Contender, Engine, Maker};
use crate::table::head;
use comfy_table::Table;
use simpulse::engine::clock::timed;
use simpulse::lab::study::pace::keep_least;
use simpulse::lab::study::sample::quantile;
use simpulse::lab::torture::families::Family;
use simpulse::lab::torture::{self, Campaign, CaseOutcome, TortureCase, TortureRow, table};
use std::io::IsTerminal;

/// Another engine, behind the interface of the checks.
struct Judged(Box<dyn Engine>);

impl torture::Engine for Judged {
    fn step(&mut self) -> Result<(), String> {
        self.0.step()
    }

    fn pose(&self, body: usize) -> [[f64; 2]; 2] {
        let state = self.0.state(body);
        [state.position.map(f64::from), state.rotation.map(f64::from)]
    }
}

/// Every engine at its defaults, and with the opposite setting of continuous collision.
const JUDGED: [(&str, Contender); 4] = [
    ("Box2D", Contender::new(Maker::Box2d, 4, true)),
    ("Box2D, not continuous", Contender::new(Maker::Box2d, 4, false)),
    ("rapier", Contender::new(Maker::Rapier, 4, false)),
    ("rapier, continuous", Contender::new(Maker::Rapier, 4, true)),
];

/// Engines at their defaults, which are timed. The first is the reference.
const TIMED: [(&str, Contender); 4] = [
    JUDGED[0],
    JUDGED[2],
    ("soft_step", Contender::new(Maker::Solver("soft_step"), 4, false)),
    ("shim", Contender::new(Maker::Solver("shim"), 14, true)),
];

/// The engine with the scene and the number of substeps of a case. Errors: a part of the scene that the engine does
/// not support.
fn start(case: &TortureCase, contender: &Contender) -> Result<Box<dyn Engine>, String> {
    let substeps = case.substeps.unwrap_or(contender.substeps);
    Contender { substeps, ..*contender }.build(&case.scene)
}

/// Prints the table of failures by family. Runs on one thread, because Box2D keeps its worlds in a list without a
/// lock. Errors: none from an engine; scenes that it does not support are counted.
pub fn run(campaign: &Campaign) -> Result<(), String> {
    let (seed, mut rows, mut refused) = (campaign.seed, Vec::new(), 0);
    for (family, number) in campaign.list() {
        let case = family.case(seed, number);
        for (name, contender) in &JUDGED {
            let judged = |engine| torture::run(&case, &mut Judged(engine)).map_err(|e| e.to_string());
            let outcome: Result<CaseOutcome, String> = start(&case, contender).and_then(judged);
            let (family, solver) = (family.name.to_string(), name.to_string());
            match outcome {
                Ok(outcome) => rows.push(TortureRow { seed, family, number, solver, outcome }),
                Err(message) => {
                    eprintln!("{}, {name}: {message}", case.scene.name);
                    refused += 1;
                }
            }
        }
    }
    let names: Vec<String> = JUDGED.iter().map(|(name, _)| name.to_string()).collect();
    println!("{}{refused} runs refused", table::text(&table::lines(&rows, &names)));
    Ok(())
}

/// Limit on the longest step, as a multiple of Box2D's in the same scene (1).
const LIMIT: f64 = 2.0;

/// Times of the steps of a scene in an engine (µs).
struct StepTimes {
    family: &'static str,
    longest: f64,
    mean: f64,
}

/// Runs a case to its end, or until the engine reports that it diverged. Keeps the shorter time of each step (µs):
/// runs are deterministic. Errors: a part of the scene that the engine does not support.
fn time(case: &TortureCase, contender: &Contender, least: &mut Vec<f64>) -> Result<(), String> {
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

/// Times the scenes of a campaign `repeats` times in each engine, in turns, and prints a table.
pub fn compare(campaign: &Campaign, repeats: u32) {
    let (mut rows, mut refused) = (Vec::new(), 0);
    let scenes = campaign.list();
    for (k, &(family, number)) in scenes.iter().enumerate() {
        if std::io::stderr().is_terminal() {
            eprint!("\r{} of {} scenes ", k + 1, scenes.len());
        }
        let case = family.case(campaign.seed, number);
        let mut steps = TIMED.map(|_| Vec::new());
        let mut all = (0..repeats).flat_map(|_| 0..TIMED.len());
        if all.try_for_each(|i| time(&case, &TIMED[i].1, &mut steps[i])).is_err() {
            refused += 1;
            continue;
        }
        rows.push(steps.each_ref().map(|steps| StepTimes {
            family: family.name,
            longest: quantile(steps, 1.0),
            mean: steps.iter().sum::<f64>() / steps.len().max(1) as f64,
        }));
    }
    let reference = TIMED[0].0;
    println!("Step times ÷ those of {reference} in the same scene, on one thread; {refused} scenes refused");
    println!("{}", ratios(&campaign.families, &rows));
}

/// One line per family and engine, then all families together.
fn ratios(families: &[&'static Family], rows: &[[StepTimes; TIMED.len()]]) -> Table {
    let over = format!("over {LIMIT}");
    let mut table = head(&["family", "engine", "scenes", "longest", "99 %", "most", &over, "mean", "most"]);
    for family in families.iter().map(|f| f.name).chain(["all"]) {
        for engine in 1..TIMED.len() {
            let own = || rows.iter().filter(|scene| scene[0].family == family || family == "all");
            let ratios = |get: fn(&StepTimes) -> f64| -> Vec<f64> {
                own().map(|scene| get(&scene[engine]) / get(&scene[0])).collect()
            };
            let (longest, mean) = (ratios(|row| row.longest), ratios(|row| row.mean));
            if longest.is_empty() {
                continue;
            }
            let mut cells = vec![family.to_string(), TIMED[engine].0.to_string(), longest.len().to_string()];
            cells.extend([0.5, 0.99, 1.0].map(|p| format!("{:.2}", quantile(&longest, p))));
            cells.push(longest.iter().filter(|&&ratio| ratio > LIMIT).count().to_string());
            cells.extend([0.5, 1.0].map(|p| format!("{:.2}", quantile(&mean, p))));
            table.add_row(cells);
        }
    }
    table
}
