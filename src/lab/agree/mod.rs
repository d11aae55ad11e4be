//! Comparison of every solver with an independent implementation of its source's method, in `f64` and without
//! lanes.
//!
//! Both run on the same frozen problems, in natural order, from the same start: 1, 2, 3, … iterations of one
//! step (solvers without substeps) or 1, 2, 3, … substeps, each as long as the problem's step (solvers with
//! substeps). After each, velocities, positions and impulses are compared. With Δ the difference and index 0
//! the state without contacts, the distance is the largest of
//!
//! ```text
//! |Δv|_M / V      |Δx|_M / (t V)      max |Δλ| / L,      V = max(|v − v₀|_M, |v₀|_M), L = max(max |λ|, the problem's unit)
//! ```
//!
//! over iterations and problems, where t is the elapsed time. The method in `f64` also makes the solver's
//! departures from its source. Each departure is undone alone, to measure how much it changes the result. The
//! problems are small and resemble piles in the middle of a step that is not at rest: gaps and overlaps, one
//! of them deep, and loads that are only roughly right.

pub mod model;
mod picture;
mod schedules;
pub mod table;
mod vectors;

use crate::engine::constraints::records::kept::KeptSize;
use crate::engine::params::{Budget, Without};
use crate::engine::solvers::Variant;
use crate::lab::converge::replay::{Replay, Start};
use crate::lab::error::Error;
use crate::lab::reference::residual::{Target, natural_map};
use crate::lab::reference::{ContactProblem, DPair, Velocity, gallery};
use model::Model;
pub use picture::svg;
use schedules::Run;
use serde::Serialize;
use table::{Against, AgreementEntry};

/// Number of iterations or substeps that are compared.
pub const COUNT: u32 = 10;
/// Iterations after which a solver has reached its solution.
const MANY: u32 = 2000;

/// A solver compared with its source's method.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// Name of the solver.
    pub solver: &'static str,
    /// Key of its source in `papers/README.md`.
    pub source: &'static str,
    /// Best settings, as the source recommends them.
    pub best: &'static str,
    /// Settings of the solver.
    pub ours: String,
    /// What is counted: `iterations` or `substeps`.
    pub unit: &'static str,
    /// Largest distance (1).
    pub apart: f64,
    /// Largest distance that a test allows (1), and the reason if it is more than rounding.
    pub bound: f64,
    pub why: &'static str,
    /// Departures from the source, each with its effect (1).
    pub departures: Vec<Departure>,
    /// A curve for each problem.
    pub curves: Vec<AgreementCurve>,
    /// The **Agreement** paragraph of its docs, which a test compares.
    pub docs: String,
}

/// A departure of a solver from its source.
#[derive(Clone, Debug, Serialize)]
pub struct Departure {
    pub what: &'static str,
    /// Distance between the methods in `f64` with and without it (1).
    pub apart: f64,
}

/// Residuals of the rigid law on one problem.
#[derive(Clone, Debug, Serialize)]
pub struct AgreementCurve {
    pub problem: String,
    /// Numbers of iterations or substeps.
    pub counts: Vec<u32>,
    /// Residuals of the solver (1).
    pub ours: Vec<f64>,
    /// Residuals of the method in `f64` (1).
    pub theirs: Vec<f64>,
    /// Distances of the states (1).
    pub apart: Vec<f64>,
}

/// Velocities, positions and impulses.
struct ModelState {
    v: Vec<Velocity>,
    x: Vec<Velocity>,
    l: Vec<DPair>,
}

/// A column of discs, a pyramid of boxes, and a box deep in the ground.
fn problems() -> [ContactProblem; 3] {
    let mut deep = gallery::sliding_box();
    deep.contacts.iter_mut().for_each(|c| c.gap = -0.3);
    let all = [gallery::disc_column(6), gallery::box_pyramid(3, 0.5), deep];
    let mut seed = 0;
    all.map(|problem| {
        seed += 1;
        let depth = problem.contacts[0].gap;
        let mut shaken = gallery::shaken(problem.clone(), seed, 0.1);
        for (i, (c, before)) in shaken.contacts.iter_mut().zip(&problem.contacts).enumerate() {
            // Points of a manifold share one friction coefficient.
            c.friction = before.friction;
            // From 11 mm of overlap to 5 mm of gap.
            c.gap = depth + 8.0 * c.gap;
            let load = 5.0 * shaken.h * (1.0 + 0.3 * (i as f64).sin());
            c.warm_impulse = [load, 0.3 * c.friction * load * (i as f64).cos()];
        }
        shaken
    })
}

/// Compares one solver.
pub fn agreement(variant: &'static Variant) -> Result<Agreement, Error> {
    let missing = || Error::invalid(variant.name, "has no entry in src/lab/agree/table.rs");
    let entry = table::find(variant.name).ok_or_else(missing)?;
    let AgreementEntry { against, best, bound, why, .. } = entry;
    let in_substeps = variant.budget.substeps > 1;
    let mut result = Agreement {
        solver: variant.name,
        source: variant.source,
        best,
        ours: settings(variant),
        unit: if in_substeps { "substeps" } else { "iterations" },
        apart: 0.0,
        bound,
        why,
        departures: Vec::new(),
        curves: Vec::new(),
        docs: String::new(),
    };
    let (method, counts) = match against {
        Against::Method(method) => (method, (1..=COUNT).collect::<Vec<_>>()),
        Against::Solution(method) => (method, vec![MANY]),
    };
    let budget = |k: u32| match in_substeps {
        true => Budget { substeps: k, ..variant.budget },
        false => variant.of_iterations(k),
    };
    let mut without = Without::default();
    for name in entry.without {
        without = without.and(variant.mechanism(name)?);
    }
    // Solvers with internal state start without any.
    let warm = variant.kept == KeptSize::NONE;
    let mut departs = vec![0.0_f64; entry.departs.len()];
    for problem in problems() {
        let mut replay = Replay::in_substeps(&problem, variant.defaults(), without)?;
        let there = |k: u32, undo: Option<usize>| {
            let mut model = Model::new(&problem, warm);
            method(&mut model, &Run { variant, budget: budget(k), undo });
            ModelState { v: model.v, x: model.x, l: model.l }
        };
        let [mut ours, mut theirs, mut apart] = [(); 3].map(|_| Vec::new());
        for &k in &counts {
            let here = replay.run(variant, budget(k), if warm { Start::Warm } else { Start::Cold });
            let here = ModelState { v: here.velocities, x: here.moves, l: here.impulses };
            let (source, time) = (there(k, None), problem.h * f64::from(budget(k).substeps));
            for (place, most) in departs.iter_mut().enumerate() {
                *most = most.max(distance(&problem, time, &there(k, Some(place)), &source));
            }
            let residual =
                |s: &ModelState| natural_map(&problem, Target::Rigid, &s.v, &s.l) / problem.impulse_unit();
            ours.push(residual(&here));
            theirs.push(residual(&source));
            // At the solution, multipliers of redundant contacts are not determined.
            let here = ModelState {
                l: if matches!(against, Against::Solution(_)) { source.l.clone() } else { here.l },
                ..here
            };
            apart.push(distance(&problem, time, &here, &source));
        }
        let name = problem.name.clone();
        result.curves.push(AgreementCurve { problem: name, counts: counts.clone(), ours, theirs, apart });
    }
    result.apart = result.curves.iter().flat_map(|c| &c.apart).copied().fold(0.0, worse);
    let departures = entry.departs.iter().zip(departs).map(|(&what, apart)| Departure { what, apart });
    result.departures = departures.collect();
    result.docs = result.section(entry.without);
    Ok(result)
}

/// Standard settings as text.
fn settings(variant: &Variant) -> String {
    let (b, uses) = (&variant.budget, &variant.uses);
    let mut parts: Vec<String> = [
        (b.velocity_iterations, "iteration", uses.velocity),
        (b.relax_iterations, "relaxing sweep", uses.relax),
        (b.position_iterations, "position sweep", uses.position),
    ]
    .iter()
    .filter(|part| part.2)
    .map(|&(count, what, _)| format!("{count} {what}{}", if count == 1 { "" } else { "s" }))
    .collect();
    if b.substeps > 1 {
        parts[0] = format!("{} substeps of {}", b.substeps, parts[0]);
    }
    let six_digits = |x: f32| (f64::from(x) * 1e6).round() / 1e6;
    parts.extend(variant.parameters.iter().map(|p| format!("{} {}", p.name, six_digits(p.default))));
    parts.join(", ")
}

/// The larger of the two; NaN counts as larger.
fn worse(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// The distance of two states after `time` (s), see the [module](self).
fn distance(problem: &ContactProblem, time: f64, one: &ModelState, other: &ModelState) -> f64 {
    let difference = |a: &[Velocity], b: &[Velocity]| {
        a.iter().zip(b).map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k])).collect::<Vec<_>>()
    };
    let free: Vec<Velocity> = problem.bodies.iter().map(|b| b.free_velocity).collect();
    let scale = problem.mass_norm(&difference(&other.v, &free)).max(problem.mass_norm(&free));
    let largest = other.l.iter().flatten().fold(problem.impulse_unit(), |m, l| m.max(l.abs()));
    let impulses =
        one.l.iter().flatten().zip(other.l.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, worse);
    let parts = [
        problem.mass_norm(&difference(&one.v, &other.v)) / scale,
        problem.mass_norm(&difference(&one.x, &other.x)) / (time * scale),
        impulses / largest,
    ];
    parts.into_iter().fold(0.0, worse)
}

impl Agreement {
    /// The **Agreement** paragraph of the solver's docs. It follows from the table and the measurements in
    /// `f64` alone.
    fn section(&self, without: &[&str]) -> String {
        let Agreement { best, ours, bound, why, unit, .. } = self;
        let kind = if self.curves[0].counts.len() > 1 {
            format!("the source's method in `f64` over {COUNT} {unit}")
        } else {
            format!("the solution in `f64` after {MANY} {unit}")
        };
        let why = if why.is_empty() { String::new() } else { format!(" ({why})") };
        let departs: Vec<String> =
            self.departures.iter().map(|d| format!("{}: {}", d.what, percent(d.apart))).collect();
        let departs = if departs.is_empty() {
            String::new()
        } else {
            format!(" Departures, and how far each moves the result: {}.", departs.join("; "))
        };
        let without = match without {
            [] => String::new(),
            names => format!(", both without {}", names.join(", ")),
        };
        format!(
            "**Agreement.** The source at its best: {best}. Here: {ours}. Apart from {kind}{without} by less than {bound:.0e}{why}: \
             `cargo test --release --test lab agree`.{departs}"
        )
    }
}

/// A distance in percent, to one digit.
pub fn percent(distance: f64) -> String {
    match 100.0 * distance {
        p if p < 1e-3 => "0 %".into(),
        p if p < 1.0 => format!("{} %", format!("{p:.0e}").parse::<f64>().unwrap_or(p)),
        p if p < 200.0 => format!("{} %", format!("{p:.0e}").parse::<f64>().unwrap_or(p)),
        p => format!("{:.0} times", format!("{:.0e}", p / 100.0).parse::<f64>().unwrap_or(p)),
    }
}

/// All comparisons as a table, with the departures below it.
pub fn text(all: &[Agreement]) -> String {
    let mut out = String::from(
        "Distance from the source's method in f64 (largest of velocities, places and impulses)\n\n",
    );
    let width = all.iter().map(|a| a.solver.len()).max().unwrap_or(0);
    for a in all {
        out += &format!("{:<width$}  {:.1e} of {:.0e} allowed\n", a.solver, a.apart, a.bound);
    }
    for a in all {
        out += &format!("\n{}\n  source [{}]: {}\n  here: {}\n", a.solver, a.source, a.best, a.ours);
        if !a.why.is_empty() {
            out += &format!("  {}\n", a.why);
        }
        for Departure { what, apart } in &a.departures {
            out += &format!("  departs by {:>8}: {what}\n", percent(*apart));
        }
    }
    out
}

/// All curves, one line per point.
pub fn csv(all: &[Agreement]) -> String {
    let mut out = String::from("solver,problem,unit,count,residual_ours,residual_f64,apart\n");
    for a in all {
        for c in &a.curves {
            for (i, count) in c.counts.iter().enumerate() {
                let problem = c.problem.replace(',', ";");
                let [ours, theirs, apart] = [c.ours[i], c.theirs[i], c.apart[i]];
                out += &format!("{},{problem},{},{count},{ours:e},{theirs:e},{apart:e}\n", a.solver, a.unit);
            }
        }
    }
    out
}
