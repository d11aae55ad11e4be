//! The main job: solvers × scenes × budgets × lane widths → [`Record`]s of speed and error.
//!
//! Every setting runs twice over. *Errors* come from one run with impulses recorded, on
//! all cores at once, because no clock is read. *Times* come from a [race](mod@race) of the same
//! setting in natural order and at every lane width, alone on the machine. All coloured
//! widths and the error run must agree to the last bit; [`Record::bits_equal`] says so.

pub mod ablation;
pub mod budget;
pub mod pareto;
pub mod race;

use crate::error::Error;
use crate::lanes::LaneWidth;
use crate::metrics::{Errors, Observation};
use crate::params::Budget;
use crate::scenes::{self, Loaded, Scene, Truth};
use crate::solvers::{VARIANTS, Variant};
use crate::world::{Divergence, Order, Settings};
use budget::BudgetGrid;
use pareto::Point;
use race::{Lap, race, speed_up};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Scenes of the default study: each shows something that the others do not.
pub const DEFAULT_SCENES: [&str; 11] = [
    "incline_slip",
    "bounce",
    "disc_column:10",
    "mass_ratio:100",
    "stack:20",
    "far_stack",
    "friction_ramp",
    "arch",
    "card_house",
    "pyramid:40",
    "circle_pile:500",
];

/// What a study tries.
#[derive(Clone, Debug)]
pub struct StudyPlan {
    /// Names of the catalogue, with sizes, or `.json` files.
    pub scenes: Vec<String>,
    /// Rows of [`VARIANTS`].
    pub solvers: Vec<&'static Variant>,
    /// Lane widths of coloured runs.
    pub widths: Vec<LaneWidth>,
    /// Constraint orders; natural order has one lane.
    pub orders: Vec<Order>,
    /// Work per step.
    pub budgets: BudgetGrid,
    /// Steps of an error run; where none, the scene's own.
    pub steps: Option<u32>,
    /// Most steps of a timing run.
    pub timing_steps: u32,
    /// Timing runs of each setting.
    pub repeats: u32,
    /// Shuffles the timing runs, and lays out scenes that have chance in them.
    pub seed: u64,
}

impl Default for StudyPlan {
    fn default() -> Self {
        StudyPlan {
            scenes: DEFAULT_SCENES.map(String::from).to_vec(),
            solvers: VARIANTS.iter().collect(),
            widths: LaneWidth::ALL.to_vec(),
            orders: vec![Order::Natural, Order::Colored],
            budgets: BudgetGrid::default(),
            steps: None,
            timing_steps: 200,
            repeats: 3,
            seed: 1,
        }
    }
}

impl StudyPlan {
    /// A look at everything, in seconds: short runs, nothing repeated.
    pub fn quick() -> Self {
        StudyPlan { steps: Some(60), timing_steps: 20, repeats: 1, ..StudyPlan::default() }
    }

    /// Refuses what cannot be run, before anything is.
    pub fn check(&self) -> Result<(), Error> {
        let empty = [
            ("scenes", self.scenes.is_empty()),
            ("solvers", self.solvers.is_empty()),
            ("lanes", self.widths.is_empty()),
            ("orders", self.orders.is_empty()),
        ];
        if let Some((name, _)) = empty.into_iter().find(|e| e.1) {
            return Err(Error::invalid(name, "none given"));
        }
        let counts = [("steps", self.steps.unwrap_or(1)), ("repeats", self.repeats)];
        if let Some((name, _)) = counts.into_iter().find(|c| c.1 == 0) {
            return Err(Error::invalid(name, "0 is too few: at least 1 is needed"));
        }
        for solver in &self.solvers {
            self.budgets.budgets(solver)?;
        }
        let mut names = Vec::new();
        for name in &self.scenes {
            let scene = self.open(name)?.scene;
            scene.validate()?;
            if names.contains(&scene.name) {
                return Err(Error::invalid("scenes", format!("two are called '{}'", scene.name)));
            }
            names.push(scene.name);
        }
        Ok(())
    }

    fn open(&self, name: &str) -> Result<Loaded, Error> {
        open_scene(name, Some(self.seed), self.steps, None)
    }
}

/// A scene of the catalogue or of a file (a name that ends in `.json`), for so many steps
/// of length `dt` (s) if these are given; what is known about it is for that run.
pub fn open_scene(
    name: &str,
    seed: Option<u64>,
    steps: Option<u32>,
    dt: Option<f64>,
) -> Result<Loaded, Error> {
    let mut loaded = if name.ends_with(".json") {
        Loaded { scene: Scene::from_file(name)?, truth: None }
    } else {
        match seed {
            Some(seed) => scenes::load_with_seed(name, seed)?,
            None => scenes::load(name)?,
        }
    };
    let scene = &mut loaded.scene;
    let (own_steps, own_dt) = (scene.steps, scene.dt);
    scene.steps = steps.unwrap_or(own_steps);
    scene.dt = dt.unwrap_or(own_dt);
    scene.validate()?;
    if loaded.truth.is_some() && (scene.steps, scene.dt) != (own_steps, own_dt) {
        let (stem, size) = name.split_once(':').unwrap_or((name, ""));
        let entry = scenes::CATALOG.iter().find(|e| e.name == stem);
        let size = size.parse().ok().or(entry.and_then(|e| e.size).map(|s| s.default));
        loaded.truth = entry.and_then(|e| e.truth).map(|truth| truth(scene, size.unwrap_or(0)));
    }
    Ok(loaded)
}

/// One row of the study: a scene, a solver, a budget, an order and a lane width.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Record {
    /// Name with size.
    pub scene: String,
    /// Bodies in it.
    pub bodies: usize,
    /// Step (s).
    pub dt: f64,
    /// Name of the solver.
    pub solver: &'static str,
    /// Constraint order.
    pub order: Order,
    /// Lanes per instruction.
    pub lanes: usize,
    /// Work per step.
    pub budget: Budget,
    /// The same, for tables.
    pub budget_text: String,
    /// Times and counts; none if the run failed.
    pub lap: Option<Lap>,
    /// Times faster than one coloured lane; none without that run.
    pub speed_up: Option<f64>,
    /// Errors, the same for all widths; none if the run failed.
    pub errors: Option<Errors>,
    /// Distance to what is known about the scene.
    pub truth: Option<TruthError>,
    /// Whether this width ended in the same bits as the error run.
    pub bits_equal: Option<bool>,
    /// Fronts that the setting is on; only its fastest width is.
    pub front: Fronts,
    /// Why there is no result.
    pub failure: Option<Failure>,
}

/// How far a run was from a known truth.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct TruthError {
    /// What is known.
    pub quantity: &'static str,
    /// Of both numbers.
    pub unit: &'static str,
    /// The truth.
    pub expected: f64,
    /// Distance to it; none where the run never came to it.
    pub error: Option<f64>,
}

impl TruthError {
    /// What the observer found; an infinite distance is none.
    pub fn of(truth: &Truth) -> Self {
        let error = truth.observer.error().filter(|e| e.is_finite());
        TruthError { quantity: truth.quantity, unit: truth.unit, expected: truth.expected, error }
    }
}

/// Membership in the fronts of time against three errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Fronts {
    /// Against the deepest penetration.
    pub penetration: bool,
    /// Against the contact-law residual (root mean square).
    pub law: bool,
    /// Against the distance to the truth.
    pub truth: bool,
}

/// Where and when a run left all bounds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Failure {
    /// Step, from 1.
    pub step: u64,
    /// Body index.
    pub body: usize,
    /// m/s or rad/s; none where it is not a finite number.
    pub speed: Option<f32>,
}

impl From<Divergence> for Failure {
    fn from(d: Divergence) -> Self {
        Failure { step: d.step, body: d.body, speed: Some(d.speed).filter(|s| s.is_finite()) }
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "diverged at step {}: body {} ", self.step, self.body)?;
        match self.speed {
            Some(speed) => write!(f, "moves at {speed:.3e} m/s"),
            None => write!(f, "has no finite speed"),
        }
    }
}

/// What a study is at, for a progress bar.
#[derive(Clone, Debug)]
pub struct Progress {
    /// Runs finished.
    pub done: usize,
    /// Runs in all.
    pub total: usize,
    /// What has just been finished.
    pub what: String,
}

/// The settings that share an error run and a race.
struct Cell<'a> {
    scene: usize,
    name: &'a str,
    solver: &'static Variant,
    budget: Budget,
}

/// What an error run found.
#[derive(Clone)]
struct Outcome {
    errors: Result<Errors, Divergence>,
    truth: Option<TruthError>,
    /// Hash after the steps of a timing run.
    hash: u64,
}

/// Runs the plan; one record per scene, solver, budget, order and width, in that order.
///
/// Errors: what [`StudyPlan::check`] refuses. A run that diverges is a record, not an error.
pub fn run(plan: &StudyPlan, progress: &(dyn Fn(Progress) + Sync)) -> Result<Vec<Record>, Error> {
    plan.check()?;
    let scenes: Vec<Scene> =
        plan.scenes.iter().map(|n| Ok(plan.open(n)?.scene)).collect::<Result<_, Error>>()?;
    let mut cells = Vec::new();
    for (scene, name) in plan.scenes.iter().enumerate() {
        for &solver in &plan.solvers {
            for budget in plan.budgets.budgets(solver)? {
                cells.push(Cell { scene, name, solver, budget });
            }
        }
    }
    let done = AtomicUsize::new(0);
    let total = cells.len() * (plan.orders.len() + 1);
    let tell = |verb: &str, cell: &Cell| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        let budget = budget::brief(&cell.budget, cell.solver);
        progress(Progress {
            done,
            total,
            what: format!("{verb} {} · {} · {budget}", cell.name, cell.solver.name),
        });
    };
    let outcomes = error_runs(plan, &cells, &tell)?;
    let mut records = Vec::new();
    for (cell, outcomes) in cells.iter().zip(&outcomes) {
        records.extend(timed_records(plan, &scenes[cell.scene], cell, outcomes)?);
        tell("times", cell);
    }
    mark_fronts(&mut records);
    Ok(records)
}

/// Settings of a cell in one order at one width.
fn settings(cell: &Cell, order: Order, width: LaneWidth) -> Settings {
    Settings { width, order, budget: cell.budget, ..Settings::new(cell.solver) }
}

/// Steps of a timing run.
fn timing_steps(plan: &StudyPlan, scene: &Scene) -> u32 {
    scene.steps.min(plan.timing_steps)
}

/// Every cell in every order, on all cores; `[cell][order]`.
fn error_runs(
    plan: &StudyPlan,
    cells: &[Cell],
    tell: &(dyn Fn(&str, &Cell) + Sync),
) -> Result<Vec<Vec<Outcome>>, Error> {
    let jobs: Vec<(usize, Order)> =
        (0..cells.len()).flat_map(|cell| plan.orders.iter().map(move |&order| (cell, order))).collect();
    let next = AtomicUsize::new(0);
    let found = Mutex::new(vec![None; jobs.len()]);
    let work = || {
        loop {
            let job = next.fetch_add(1, Ordering::Relaxed);
            let Some(&(cell, order)) = jobs.get(job) else { return Ok(()) };
            let outcome = error_run(plan, &cells[cell], order)?;
            if let Ok(mut found) = found.lock() {
                found[job] = Some(outcome);
            }
            tell("errors", &cells[cell]);
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get()).min(jobs.len());
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        workers
            .into_iter()
            .try_for_each(|w| w.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })?;
    let found = found.into_inner().unwrap_or_default();
    let outcomes: Vec<Outcome> = found.into_iter().flatten().collect();
    Ok(outcomes.chunks(plan.orders.len()).map(<[Outcome]>::to_vec).collect())
}

fn error_run(plan: &StudyPlan, cell: &Cell, order: Order) -> Result<Outcome, Error> {
    let Loaded { scene, mut truth } = plan.open(cell.name)?;
    let width = match order {
        Order::Natural => LaneWidth::W1,
        Order::Colored => plan.widths.iter().copied().max().unwrap_or(LaneWidth::W1),
    };
    let mut world = scene.build(Settings { record_impulses: true, ..settings(cell, order, width) })?;
    let mut observation = Observation::new(&world);
    let (mut hash, timed) = (0, timing_steps(plan, &scene));
    for step in 1..=scene.steps {
        if let Err(divergence) = world.step() {
            return Ok(Outcome { errors: Err(divergence), truth: None, hash });
        }
        observation.observe(&world);
        if let Some(truth) = &mut truth {
            truth.observer.observe(&world);
        }
        if step == timed {
            hash = world.state_hash();
        }
    }
    Ok(Outcome { errors: Ok(observation.errors()), truth: truth.as_ref().map(TruthError::of), hash })
}

/// Races a cell's orders and widths, those that did not diverge.
fn timed_records(
    plan: &StudyPlan,
    scene: &Scene,
    cell: &Cell,
    outcomes: &[Outcome],
) -> Result<Vec<Record>, Error> {
    let mut rows = Vec::new();
    for (&order, outcome) in plan.orders.iter().zip(outcomes) {
        match order {
            Order::Natural => rows.push((order, LaneWidth::W1, outcome)),
            Order::Colored => rows.extend(plan.widths.iter().map(|&w| (order, w, outcome))),
        }
    }
    let racing: Vec<Settings> = rows
        .iter()
        .filter(|row| row.2.errors.is_ok())
        .map(|&(order, width, _)| settings(cell, order, width))
        .collect();
    let mut laps = race(scene, &racing, timing_steps(plan, scene), plan.repeats, plan.seed)?.into_iter();
    let mut records: Vec<Record> = Vec::new();
    for (order, width, outcome) in rows {
        let lap = match outcome.errors {
            Ok(_) => laps.next().unwrap_or(Err(Divergence { step: 0, body: 0, speed: 0.0 })),
            Err(divergence) => Err(divergence),
        };
        let failure = lap.as_ref().err().map(|&d| Failure::from(d));
        let lap = lap.ok();
        records.push(Record {
            scene: scene.name.clone(),
            bodies: scene.bodies.len(),
            dt: scene.dt,
            solver: cell.solver.name,
            order,
            lanes: width.lanes(),
            budget: cell.budget,
            budget_text: budget::brief(&cell.budget, cell.solver),
            speed_up: None,
            errors: outcome.errors.ok().filter(|_| failure.is_none()),
            truth: outcome.truth,
            bits_equal: lap.as_ref().map(|lap| lap.hash == outcome.hash),
            front: Fronts::default(),
            lap,
            failure,
        });
    }
    let one_lane = records.iter().find(|r| r.order == Order::Colored && r.lanes == 1);
    if let Some(one_lane) = one_lane.and_then(|r| r.lap.clone()) {
        for record in &mut records {
            record.speed_up = record.lap.as_ref().and_then(|lap| speed_up(lap, &one_lane));
        }
    }
    Ok(records)
}

/// Marks, scene by scene, the settings on each front. A setting is a solver, a budget and
/// an order, at its fastest width.
pub fn mark_fronts(records: &mut [Record]) {
    for group in records.chunk_by_mut(|a, b| a.scene == b.scene) {
        let fastest: Vec<usize> = (0..group.len()).filter(|&i| is_fastest(group, i)).collect();
        let mut mark = |error: fn(&Record) -> Option<f64>, flag: fn(&mut Fronts) -> &mut bool| {
            let (indices, points): (Vec<usize>, Vec<Point>) = fastest
                .iter()
                .filter_map(|&i| {
                    let (lap, error) = (group[i].lap.as_ref()?, error(&group[i])?);
                    Some((i, Point { time: lap.median_ns, spread: lap.spread_ns, error }))
                })
                .unzip();
            for (i, on_front) in indices.into_iter().zip(pareto::front(&points)) {
                *flag(&mut group[i].front) = on_front;
            }
        };
        mark(|r| Some(r.errors?.penetration_max), |f| &mut f.penetration);
        mark(|r| Some(r.errors?.law_rms), |f| &mut f.law);
        mark(|r| r.truth?.error, |f| &mut f.truth);
    }
}

/// Whether record `i` is the fastest width of its setting.
fn is_fastest(group: &[Record], i: usize) -> bool {
    let own = &group[i];
    let time = |r: &Record| r.lap.as_ref().map(|lap| lap.median_ns);
    let Some(own_time) = time(own) else { return false };
    let same = |r: &Record| (r.solver, r.budget, r.order) == (own.solver, own.budget, own.order);
    group.iter().enumerate().all(|(j, r)| {
        let faster = time(r).is_some_and(|t| t < own_time || (t == own_time && j < i));
        !(same(r) && faster)
    })
}
