//! Counts the iterations that every solver needs on exactly the same problem.
//!
//! A frozen problem is solved by the simulation's own code ([`replay`]): one step without substeps, with a
//! budget of k iterations, for k = 0, 1, 2, … After each, the natural-map residual is measured in `f64` on
//! the `f32` velocities and impulses, as a multiple of [`ContactProblem::impulse_unit`], against two laws
//! that are never mixed:
//!
//! - the *rigid* law, the same for all;
//! - the solver's *own* law, that of its last velocity sweep. Position feedback, softness and missing
//!   friction define other laws. A solver may solve its own law to the last bit and never approach the rigid
//!   one.
//!
//! An *iteration* is defined by the solver ([`Variant::iterations`]): usually one velocity sweep, plus one
//! relaxing sweep if the solver relaxes. *Sweeps* are counted by the solver itself. Residuals are limited by
//! `f32` to about 1e-6 times the largest impulse. A tolerance that is not reached within the maximum number
//! of iterations has no number.
//!
//! Iterations to a tolerance are exact: k takes every value up to 128 and then grows by 1/64, and the first k
//! that reaches a tolerance is searched between two such values.
//!
//! Methods in `f64` that share no code with the solvers ([`crate::lab::reference`]) are run for comparison.

#[doc(hidden)]
pub mod plot;
pub mod replay;
mod rows;
mod setup;
pub mod table;
pub mod warm;

use crate::engine::lanes::{LaneWidth, native_width};
use crate::engine::params::Budget;
use crate::engine::solvers::{VARIANTS, Variant};
use crate::lab::error::Error;
use crate::lab::overrides::{self, Override};
use crate::lab::reference::certify::{Certificate, Reference};
use crate::lab::reference::iterate::{Iteration, Stop, gauss_seidel_rate, iterate, rate_at};
use crate::lab::reference::residual::{LawMeasure, natural_map};
use crate::lab::reference::{ContactProblem, Target};
use replay::{Replay, Replayed, Sequence, Start};
use serde::Serialize;
use std::cell::Cell;
use std::collections::BTreeMap;
use warm::{WarmStartSource, Warmed};

/// Residuals for which the first iteration that reaches them is reported (1).
pub const TOLERANCES: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Solvers and options of a run.
#[derive(Clone, Debug)]
pub struct ConvergeOptions {
    /// Solvers, in this order.
    pub solvers: Vec<&'static Variant>,
    /// Maximum iterations.
    pub max_iterations: u32,
    /// Seed of the shuffled order.
    pub seed: u64,
    /// Lanes in colored order; the other orders are serial.
    pub width: LaneWidth,
    /// Parameters of solvers, by name.
    pub overrides: Vec<Override>,
    /// Rounds of timing; 0 skips timing.
    pub rounds: u32,
    /// Whether to measure the rate of Gauss–Seidel in `f64`, which may take seconds.
    pub baseline: bool,
}

impl Default for ConvergeOptions {
    fn default() -> Self {
        ConvergeOptions {
            solvers: VARIANTS.to_vec(),
            max_iterations: 1000,
            seed: 1,
            width: native_width(),
            overrides: Vec::new(),
            rounds: 15,
            baseline: true,
        }
    }
}

/// State after some iterations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurvePoint {
    /// Budget k.
    pub iterations: u32,
    /// Constraint sweeps made.
    pub sweeps: usize,
    /// Residual of the rigid law (1).
    pub rigid: f64,
    /// Residual of the solver's own law (1); `None` before the first velocity sweep.
    pub own: Option<f64>,
    /// Relative mass-norm distance of the velocities from the reference (1); `None` without a reference.
    pub velocity_error: Option<f64>,
}

/// The result of a curve under one law.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Reached {
    /// Index into [`ReplayCurve::points`] of the first point within each of [`TOLERANCES`].
    pub first: [Option<usize>; TOLERANCES.len()],
    /// Iterations of those points.
    pub iterations: [Option<u32>; TOLERANCES.len()],
    /// Smallest residual after at least one iteration (1), because the start is not the solver's work.
    /// Infinite if there is no such residual.
    pub smallest: f64,
    /// Asymptotic factor per iteration, fitted above the rounding floor; `None` if the curve falls too fast
    /// or is too short for a fit.
    pub rate: Option<f64>,
}

/// A curve: one solver in one order from one start.
#[derive(Clone, Debug, Serialize)]
pub struct ReplayCurve {
    /// Name of the solver; if the curve is of a part of its schedule, the name says so.
    pub solver: String,
    /// Whether it is only a part of the solver's schedule.
    pub is_part: bool,
    /// `f32` for code of the simulation, `f64` for the methods run for comparison.
    pub arithmetic: &'static str,
    /// Order of the contacts.
    pub order: Sequence,
    /// Impulses at the start.
    pub start: Start,
    /// States, in ascending order of iterations.
    pub points: Vec<CurvePoint>,
    /// Result under the rigid law.
    pub rigid: Reached,
    /// Result under the solver's own law.
    pub own: Reached,
    /// Whether the two laws were the same in all states.
    pub own_is_rigid: bool,
    /// Time of an iteration; `None` if not measured.
    pub iteration: Option<IterationTime>,
}

/// Time of an iteration (ns), without set-up, over identical rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct IterationTime {
    /// Median over the rounds.
    pub median_ns: f64,
    /// Quartiles over the rounds. There is no mean: each round is a difference of two runs, and interruptions
    /// would dominate it.
    pub quartiles_ns: [f64; 2],
}

/// All curves of one problem.
#[derive(Clone, Debug, Serialize)]
pub struct ConvergeReport {
    /// Name of the problem.
    pub problem: String,
    /// Bodies that are not static.
    pub bodies: usize,
    /// Number of contact points.
    pub contacts: usize,
    /// Number of rows of joints.
    #[serde(skip_serializing_if = "is_zero")]
    pub joint_rows: usize,
    /// Unit of residuals (N·s).
    pub impulse_unit: f64,
    /// The reference's certificate; `None` without a reference.
    pub certificate: Option<Certificate>,
    /// Where warm starts come from. Without warm starts there are no warm curves.
    pub warm_start: WarmStartSource,
    /// Solvers without warm starting, which have no warm curves. Empty if there are no warm starts at all.
    pub forgetful: Vec<String>,
    /// Lanes in colored order.
    pub lanes: usize,
    /// Factor per sweep of Gauss–Seidel in `f64` ([`gauss_seidel_rate`]); `None` if it does not converge, or
    /// converges too fast to fit.
    pub gauss_seidel_rate: Option<f64>,
    /// See [`TOLERANCES`].
    pub tolerances: [f64; TOLERANCES.len()],
    /// Curves, solver by solver.
    pub curves: Vec<ReplayCurve>,
}

fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// A solver's schedule, parameterized by the number of iterations.
struct IteratedSchedule {
    variant: &'static Variant,
    name: String,
    relaxes: bool,
}

impl IteratedSchedule {
    /// The whole schedule and, if it has relaxing sweeps, the one without them: relaxing sweeps hide what the
    /// sweeps before them converge to.
    fn of(variant: &'static Variant) -> Vec<IteratedSchedule> {
        let whole = IteratedSchedule { variant, name: variant.name.into(), relaxes: variant.uses.relax };
        let name = format!("{} without relaxing", variant.name);
        let bare = IteratedSchedule { variant, name, relaxes: false };
        if variant.uses.relax { vec![whole, bare] } else { vec![whole] }
    }

    fn budget(&self, iterations: u32) -> Budget {
        let whole = self.variant.of_iterations(iterations);
        Budget { relax_iterations: if self.relaxes { whole.relax_iterations } else { 0 }, ..whole }
    }
}

/// Runs every solver of `options` on `problem`.
///
/// Errors: a problem that is not valid, exceeds the range of `f32`, or has neither contacts nor joints; a
/// reference that is not a solution.
///
/// ```
/// use simpulse::solvers::find;
/// use simpulse::lab::converge::{ConvergeOptions, converge};
/// use simpulse::lab::reference::gallery;
///
/// let problem = gallery::disc_column(4);
/// let options = ConvergeOptions {
///     solvers: vec![find("pgs")?],
///     max_iterations: 100,
///     rounds: 0,
///     baseline: false,
///     ..ConvergeOptions::default()
/// };
/// let report = converge(&problem, None, &options)?;
/// let curve = &report.curves[0];
/// // Index of the first point with a residual below 1e-3.
/// let reached = curve.rigid.first[2].ok_or("not within 100 sweeps")?;
/// println!("{}: {} sweeps to 1e-3", curve.solver, curve.points[reached].sweeps);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn converge(
    problem: &ContactProblem,
    reference: Option<&Reference>,
    options: &ConvergeOptions,
) -> Result<ConvergeReport, Error> {
    converge_watched(problem, reference, options, &|_, _, _| ())
}

/// The same with progress: `tell` receives the number of finished parts, the total, and the name of the next
/// part.
pub fn converge_watched(
    problem: &ContactProblem,
    reference: Option<&Reference>,
    options: &ConvergeOptions,
    tell: &dyn Fn(usize, usize, &str),
) -> Result<ConvergeReport, Error> {
    problem.validate()?;
    if problem.unknowns() == 0 {
        return Err(Error::invalid("contacts", format!("'{}' has none, and no joints", problem.name)));
    }
    if let Some(reference) = reference {
        reference.check(problem).map_err(|why| Error::invalid("reference", why))?;
    }
    let Warmed { origin, problem: warmed, before } = warm::warmed(problem, reference);
    let problem = &warmed;
    let orders = [Sequence::Natural, Sequence::Colored, Sequence::Shuffled(options.seed)];
    let schedules: Vec<IteratedSchedule> =
        options.solvers.iter().flat_map(|v| IteratedSchedule::of(v)).collect();
    let mut curves = Vec::new();
    let mut timers = Vec::new();
    // One part for each order of each schedule, one for times, one for methods in f64.
    let parts = schedules.len() * orders.len() + 2;
    for schedule in &schedules {
        for order in orders {
            tell(timers.len(), parts, &schedule.name);
            let parameters = overrides::values(schedule.variant, &options.overrides)?;
            let mut replay = Replay::new(problem, order, options.width, parameters)?;
            replay.follow(&before)?;
            let first = curves.len();
            curves.push(curve(problem, reference, schedule, order, Start::Cold, &mut replay, options));
            if origin != WarmStartSource::None && remembers(schedule, &mut replay) {
                curves.push(curve(problem, reference, schedule, order, Start::Warm, &mut replay, options));
            }
            timers.push((schedule, replay, first..curves.len()));
        }
    }
    if options.rounds > 0 {
        tell(parts - 2, parts, "times");
        // Every round times every solver once, so a slow spell of the machine affects all alike.
        let ranges: Vec<TimedRange> =
            timers.iter_mut().map(|(s, replay, _)| TimedRange::of(s, replay)).collect();
        let mut samples = vec![Vec::new(); timers.len()];
        for _ in 0..options.rounds {
            for (((schedule, replay, _), range), samples) in timers.iter_mut().zip(&ranges).zip(&mut samples)
            {
                samples.push(range.time(schedule, replay));
            }
        }
        for (mut s, (_, _, range)) in samples.into_iter().zip(&timers) {
            s.sort_by(f64::total_cmp);
            let quartiles_ns = [s[s.len() / 4], s[3 * s.len() / 4]];
            let time = IterationTime { median_ns: s[s.len() / 2], quartiles_ns };
            curves[range.clone()].iter_mut().for_each(|curve| curve.iteration = Some(time));
        }
    }
    let has_warm =
        |name: &str| curves.iter().any(|c: &ReplayCurve| c.solver == name && c.start == Start::Warm);
    let names = schedules.iter().filter(|s| origin != WarmStartSource::None && !has_warm(&s.name));
    let forgetful = names.map(|s| s.name.clone()).collect();
    tell(parts - 1, parts, "methods in f64");
    curves.extend(sweeps_in_f64(problem, reference, origin != WarmStartSource::None, options));
    Ok(ConvergeReport {
        problem: problem.name.clone(),
        bodies: problem.bodies.len(),
        contacts: problem.contacts.len(),
        joint_rows: problem.joint_rows(),
        impulse_unit: problem.impulse_unit(),
        certificate: reference.map(|r| r.certificate),
        warm_start: origin,
        forgetful,
        lanes: options.width.lanes(),
        gauss_seidel_rate: options.baseline.then(|| gauss_seidel_rate(problem)).flatten(),
        tolerances: TOLERANCES,
        curves,
    })
}

/// Whether this solver's result depends on warm-start impulses.
fn remembers(schedule: &IteratedSchedule, replay: &mut Replay) -> bool {
    let [cold, warm] =
        [Start::Cold, Start::Warm].map(|start| replay.run(schedule.variant, schedule.budget(1), start));
    cold.velocities != warm.velocities || cold.impulses != warm.impulses
}

/// Measures an outcome; also returns whether its own law was the rigid one.
fn measure(
    problem: &ContactProblem,
    reference: Option<&Reference>,
    iterations: u32,
    outcome: &Replayed,
) -> (CurvePoint, bool) {
    let Replayed { velocities, impulses, .. } = outcome;
    let unit = problem.impulse_unit();
    let rigid = natural_map(problem, Target::Rigid, velocities, impulses) / unit;
    let mut own_is_rigid = true;
    let own = outcome.own.as_ref().map(|own| {
        let mut law = LawMeasure::new(problem, Target::Own(&own.rows));
        law.friction = own.friction;
        let has_friction = problem.contacts.iter().any(|c| c.friction > 0.0);
        own_is_rigid = own.friction || !has_friction;
        let contacts = (0..problem.contacts.len()).map(|i| Target::Rigid.row(problem, i));
        for (row, rigid) in own.rows.iter().zip(contacts.chain(problem.rigid_rows())) {
            // Gaps ÷ h, in f32.
            let rounding = 1e-6 * (1.0 + rigid.bias.abs());
            own_is_rigid &= (row.bias - rigid.bias).abs() <= rounding && row.compliance == 0.0;
        }
        law.natural_map(velocities, impulses) / unit
    });
    let velocity_error = reference.map(|r| problem.velocity_error(velocities, &r.velocities));
    (CurvePoint { iterations, sweeps: outcome.sweeps, rigid, own, velocity_error }, own_is_rigid)
}

/// A curve that stagnates within this many times the rounding floor has reached the floor.
const NEAR_FLOOR: f64 = 20.0;

fn curve(
    problem: &ContactProblem,
    reference: Option<&Reference>,
    schedule: &IteratedSchedule,
    order: Sequence,
    start: Start,
    replay: &mut Replay,
    options: &ConvergeOptions,
) -> ReplayCurve {
    let mut own_is_rigid = true;
    let mut points = BTreeMap::new();
    // Changes below half a unit in the last place of the largest impulse are lost to rounding.
    let unit = problem.impulse_unit();
    let floor = Cell::new(0.0_f64);
    let mut visit = |k: u32, points: &mut BTreeMap<u32, CurvePoint>| {
        let outcome = replay.run(schedule.variant, schedule.budget(k), start);
        let largest = outcome.impulses.iter().flatten().fold(0.0_f64, |m, l| m.max(l.abs()));
        floor.set(floor.get().max(0.5 * f64::from(f32::EPSILON) * largest / unit));
        let (point, same) = measure(problem, reference, k, &outcome);
        own_is_rigid &= same;
        points.insert(k, point);
        point
    };
    let (mut k, mut best, mut best_at) = (0, f64::INFINITY, 0);
    while k <= options.max_iterations {
        let point = visit(k, &mut points);
        let own = point.own.unwrap_or(f64::INFINITY);
        if own < 0.9 * best {
            (best, best_at) = (own, k);
        }
        let at_floor = best == 0.0 || best < NEAR_FLOOR * floor.get() && k > 64 + 2 * best_at;
        if !point.rigid.is_finite() || at_floor {
            break;
        }
        k += if k < 128 { 1 } else { k / 64 };
    }
    for law in LAWS {
        for tolerance in TOLERANCES {
            let within = |p: &&CurvePoint| law(p).is_some_and(|r| r <= tolerance);
            let Some(reached) = points.values().find(within).map(|p| p.iterations) else { break };
            let before = points.range(..reached).next_back().map_or(reached, |(&k, _)| k);
            for k in before + 1..reached {
                if within(&&visit(k, &mut points)) {
                    break;
                }
            }
        }
    }
    let points: Vec<CurvePoint> = points.into_values().collect();
    let [rigid, own] = LAWS.map(|law| reached(&points, law, floor.get()));
    ReplayCurve {
        solver: schedule.name.clone(),
        is_part: schedule.variant.uses.relax && !schedule.relaxes,
        arithmetic: "f32",
        order,
        start,
        points,
        rigid,
        own,
        own_is_rigid,
        iteration: None,
    }
}

/// Curves of sweeps in `f64`, which share no code with the solvers. They solve a contact row by row, so with
/// friction the order of rows differs slightly from the solvers' order.
fn sweeps_in_f64(
    problem: &ContactProblem,
    reference: Option<&Reference>,
    has_warm_start: bool,
    options: &ConvergeOptions,
) -> Vec<ReplayCurve> {
    let stop = Stop { tolerance: 1e-9, iterations: options.max_iterations as usize };
    let mut shuffled = problem.clone();
    let order = Sequence::Shuffled(options.seed);
    let manifolds: Vec<_> = problem.contacts.chunk_by(|p, q| p.manifold == q.manifold).collect();
    shuffled.contacts =
        order.order(manifolds.len()).iter().flat_map(|&i| manifolds[i as usize].iter().copied()).collect();
    shuffled.joints =
        order.order(problem.joints.len()).iter().map(|&i| problem.joints[i as usize].clone()).collect();
    let methods = [
        ("Gauss-Seidel", problem, Sequence::Natural, Iteration::Forward),
        ("Gauss-Seidel", &shuffled, order, Iteration::Forward),
        ("Jacobi", problem, Sequence::Natural, Iteration::Jacobi),
        ("Jacobi, mass splitting", problem, Sequence::Natural, Iteration::SplitJacobi),
        ("NNCG", problem, Sequence::Natural, Iteration::Conjugate),
    ];
    let mut curves = Vec::new();
    for (name, problem, order, method) in methods {
        for start in [Start::Cold, Start::Warm].into_iter().take(if has_warm_start { 2 } else { 1 }) {
            let impulses = if start == Start::Warm { problem.warm_impulses() } else { problem.no_impulses() };
            let run = iterate(problem, Target::Rigid, &impulses, method, stop);
            let error = reference.map(|r| problem.velocity_error(&run.velocities, &r.velocities));
            let point = |(k, &residual): (usize, &f64)| CurvePoint {
                iterations: k as u32,
                sweeps: k,
                rigid: residual,
                own: Some(residual),
                velocity_error: error.filter(|_| k + 1 == run.history.len()),
            };
            let points: Vec<CurvePoint> = run.history.iter().enumerate().map(point).collect();
            let [rigid, own] = LAWS.map(|law| reached(&points, law, 0.0));
            curves.push(ReplayCurve {
                solver: name.into(),
                is_part: false,
                arithmetic: "f64",
                order,
                start,
                points,
                rigid,
                own,
                own_is_rigid: true,
                iteration: None,
            });
        }
    }
    curves
}

const LAWS: [fn(&CurvePoint) -> Option<f64>; 2] = [|p| Some(p.rigid), |p| p.own];

/// Fits end at this many times the rounding floor, where residuals are off by 1 %.
const ABOVE_FLOOR: f64 = 100.0;

/// The result of `points` under `law`; `floor` is the rounding error of residuals.
fn reached(points: &[CurvePoint], law: fn(&CurvePoint) -> Option<f64>, floor: f64) -> Reached {
    let first =
        TOLERANCES.map(|tolerance| points.iter().position(|p| law(p).is_some_and(|r| r <= tolerance)));
    let residuals: Vec<[f64; 2]> =
        points.iter().filter_map(|p| Some([f64::from(p.iterations), law(p)?])).collect();
    let smallest = residuals.iter().filter(|p| p[0] > 0.0).map(|p| p[1]).fold(f64::INFINITY, f64::min);
    let usable = residuals.iter().position(|p| p[1] <= ABOVE_FLOOR * floor).unwrap_or(residuals.len());
    let iterations = first.map(|at| at.map(|at| points[at].iterations));
    Reached { first, iterations, smallest, rate: rate_at(&residuals[..usable]) }
}

/// Shortest time difference that is measured (ns), far above the clock's resolution.
const TIMED_NS: f64 = 50_000.0;

/// Iterations that are timed: the difference of two steps with few and with many iterations ÷ the difference
/// of their numbers, so set-up is not counted.
struct TimedRange {
    few: u32,
    more: u32,
    /// Number of repetitions.
    times: u32,
}

impl TimedRange {
    /// A solver that has reached its final state may have nothing left to do. If more iterations change no
    /// bit, the iterations up to that state are timed repeatedly instead.
    fn of(schedule: &IteratedSchedule, replay: &mut Replay) -> Self {
        const FEW: u32 = 4;
        const MOST: f64 = 4096.0;
        let mut outcome = |k: u32| {
            let outcome = replay.run(schedule.variant, schedule.budget(k), Start::Cold);
            (outcome.velocities, outcome.impulses)
        };
        let answer = outcome(FEW);
        let mut range = TimedRange { few: FEW, more: 64, times: 1 };
        if answer == outcome(FEW + range.more) {
            let last = (0..FEW).find(|&k| outcome(k) == answer).unwrap_or(FEW);
            range = TimedRange { few: 0, more: last.max(1), times: 64 };
            let estimate = range.time(schedule, replay).max(1.0);
            range.times = (TIMED_NS / (estimate * f64::from(range.more))).clamp(1.0, MOST) as u32;
        } else {
            let estimate = range.time(schedule, replay).max(1.0);
            range.more = (TIMED_NS / estimate).clamp(8.0, MOST) as u32;
        }
        range
    }

    /// Time of an iteration (ns).
    fn time(&self, schedule: &IteratedSchedule, replay: &mut Replay) -> f64 {
        let mut run = |k| replay.time(schedule.variant, schedule.budget(k), Start::Cold).as_nanos() as f64;
        let sum: f64 = (0..self.times).map(|_| run(self.few + self.more) - run(self.few)).sum();
        sum / f64::from(self.times) / f64::from(self.more)
    }
}
