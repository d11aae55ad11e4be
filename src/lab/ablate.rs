//! The effect of each mechanism of a solver: cases, errors and time of runs that leave it out.

use crate::engine::clock::timed;
use crate::engine::params::{Mechanism, Without};
use crate::engine::solvers::Variant;
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::metrics::Observation;
use crate::lab::report::table::{finish, table};
use crate::lab::scenes;
use crate::lab::verify::{self, Case, Lab, VerifyMatrix};

/// Errors and time of a scene without a mechanism.
#[derive(Clone, Debug, serde::Serialize)]
pub struct OnScene {
    /// Name of the scene.
    pub scene: String,
    /// Mean overlap of the run (m), of the whole solver and without the mechanism; `None` if that run
    /// diverged.
    pub overlap_m: [Option<f64>; 2],
    /// Speed in the last second (m/s), in the same order.
    pub rest_speed_m_s: [Option<f64>; 2],
    /// Time of all steps ÷ that of the whole solver, stepped interleaved (1).
    pub time: f64,
}

/// A mechanism, and the effect of leaving it out.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Ablated {
    /// Name of the mechanism.
    pub mechanism: String,
    /// Purpose of the mechanism.
    pub meaning: String,
    /// Lines of code in files of its own.
    pub lines: u32,
    /// The check that needs it: a case, a family of random scenes, or a test.
    pub needed_for: &'static str,
    /// Cases that pass with the mechanism and fail without it.
    pub lost: Vec<&'static str>,
    /// Cases that fail with the mechanism and pass without it.
    pub won: Vec<&'static str>,
    /// Results by scene.
    pub scenes: Vec<OnScene>,
}

/// Mechanisms to leave out, and the cases and scenes to compare.
pub struct AblationPlan {
    /// Solver.
    pub solver: &'static Variant,
    /// Indices of mechanisms in the solver's table.
    pub mechanisms: Vec<usize>,
    /// Cases of [`verify`].
    pub cases: Vec<&'static Case>,
    /// Names of scenes.
    pub scenes: Vec<String>,
    /// Steps per scene.
    pub steps: u32,
    /// Threads for the cases; scenes run on one thread.
    pub threads: usize,
}

/// Leaves out each mechanism in turn. `tell` receives the number of finished parts, the total, and the name
/// of the next part.
pub fn run(plan: &AblationPlan, tell: &(dyn Fn(usize, usize, &str) + Sync)) -> Result<Vec<Ablated>, Error> {
    let total = plan.mechanisms.len() + 1;
    let passed = |without: Without, done: usize, name: &str| -> Vec<Option<bool>> {
        let lab = |solver| Lab::new(solver).without(without);
        let found: VerifyMatrix =
            verify::run(plan.cases.clone(), vec![plan.solver], plan.threads, lab, &|p| {
                tell(done, total, &format!("{name}: {}", p.what));
            });
        found.cells.iter().map(|cells| cells[0].passed()).collect()
    };
    let whole = passed(Without::default(), 0, "whole");
    let mut rows = Vec::new();
    for (done, &place) in plan.mechanisms.iter().enumerate() {
        let Mechanism { name, meaning, case, lines } = plan.solver.mechanisms[place];
        let without = Without::default().and(place);
        let found = passed(without, done + 1, name);
        let of = |before: bool| {
            let cases = plan.cases.iter().zip(whole.iter().zip(&found));
            let turned = cases.filter(|(_, now)| *now == (&Some(before), &Some(!before)));
            turned.map(|(case, _)| case.id).collect()
        };
        let scenes = plan.scenes.iter().map(|scene| {
            tell(done + 1, total, &format!("{name}: {scene}"));
            on_scene(plan, scene, without)
        });
        let scenes = scenes.collect::<Result<_, _>>()?;
        let (mechanism, meaning) = (name.into(), meaning.into());
        rows.push(Ablated {
            mechanism,
            meaning,
            lines,
            needed_for: case,
            lost: of(true),
            won: of(false),
            scenes,
        });
    }
    Ok(rows)
}

/// Steps a scene with all mechanisms and without some, interleaved.
fn on_scene(plan: &AblationPlan, name: &str, without: Without) -> Result<OnScene, Error> {
    let scene = scenes::load(name)?.scene;
    let build = |without, record_impulses| {
        scene.build(Settings { without, record_impulses, ..Settings::new(plan.solver) })
    };
    let pair = |record| Ok::<_, Error>([build(Without::default(), record)?, build(without, record)?]);
    let mut both = pair(true)?.map(|world| {
        let seen = Observation::new(&world);
        (world, seen)
    });
    // Times are taken on other worlds, because metrics evict the caches.
    let (mut unseen, mut times, mut diverged) = (pair(false)?, [0.0; 2], [false; 2]);
    for _ in 0..plan.steps {
        for (k, (world, seen)) in both.iter_mut().enumerate() {
            diverged[k] |= world.step().is_err();
            seen.observe(world);
        }
        if diverged != [false; 2] {
            break;
        }
    }
    let mut go_on = |_: &u32| {
        unseen.iter_mut().zip(&mut times).all(|(world, time)| {
            let (stepped, took) = timed(|| world.step());
            *time += took.as_secs_f64();
            stepped.is_ok()
        })
    };
    (0..plan.steps).take_while(&mut go_on).for_each(drop);
    let errors = both.map(|(_, seen)| seen.errors());
    let of = |k: usize, value: f64| (!diverged[k] && value.is_finite()).then_some(value);
    Ok(OnScene {
        scene: name.into(),
        overlap_m: [0, 1].map(|k| of(k, errors[k].penetration_mean())),
        rest_speed_m_s: [0, 1].map(|k| of(k, errors[k].rest_velocity())),
        time: times[1] / times[0],
    })
}

/// The results as two tables: cases, and scenes.
pub fn text(rows: &[Ablated]) -> String {
    let mut cases = table(&["without", "lines", "needed for", "cases won", "cases lost"]);
    let mut on_scenes = table(&["without", "scene", "overlap µm", "without", "rest mm/s", "without", "time"]);
    let list = |cases: &[&str]| if cases.is_empty() { "–".to_string() } else { cases.join(" ") };
    let number =
        |value: Option<f64>, scale: f64| value.map_or("diverged".into(), |v| format!("{:.3}", v * scale));
    for row in rows {
        let lines = if row.lines == 0 { "–".into() } else { row.lines.to_string() };
        let needed_for = row.needed_for.to_string();
        cases.add_row([row.mechanism.clone(), lines, needed_for, list(&row.won), list(&row.lost)]);
        for OnScene { scene, overlap_m, rest_speed_m_s, time } in &row.scenes {
            let [all, without] = overlap_m.map(|v| number(v, 1e6));
            let [rest, rest_without] = rest_speed_m_s.map(|v| number(v, 1e3));
            let name = row.mechanism.clone();
            on_scenes.add_row([name, scene.clone(), all, without, rest, rest_without, format!("{time:.2}")]);
        }
    }
    let scenes =
        if rows.iter().all(|row| row.scenes.is_empty()) { String::new() } else { finish(on_scenes, 2) };
    finish(cases, 5) + "\n" + &scenes
}
