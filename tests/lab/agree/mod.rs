//! Law: every solver matches its source's method, reimplemented in `f64` and without lanes on the sweeps of
//! [`oracle`](simpulse::lab::reference::oracle), up to departures that are named and measured.
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
//! over iterations and problems, where t is the elapsed time; also |M⁻¹ Jᵀ Δλ|_M / V, the net impulses of the bodies.
//! Impulses of single points are left out where the solution does not determine them. The method in `f64` also makes
//! the solver's departures from its source. Each departure is undone alone, to measure how much it changes the
//! result. The problems are small and resemble piles in the middle of a step that is not at rest: gaps and overlaps,
//! one of them deep, and loads that are only roughly right.
//!
//! [`stories`] compare steps of a world in the same way: impulses and anchors that are kept, an impact, a joint, and
//! frozen contacts. Five mistakes, made by the method, are detected.
//!
//! `cargo test --release --test lab agree -- --nocapture` prints each solver's source, distances and departures.

mod methods;
mod rules;
mod stories;
mod vectors;

use methods::{Against, Fault, KeptState, Run, against};
use simpulse::engine::constraints::numerics::matrix::solve_in_place;
use simpulse::engine::constraints::records::kept::StateSize;
use simpulse::engine::params::{Budget, Without};
use simpulse::engine::solvers::{VARIANTS, Variant, find};
use simpulse::lab::converge::replay::{Replay, Start};
use simpulse::lab::reference::oracle::Oracle;
use simpulse::lab::reference::problem::minus;
use simpulse::lab::reference::{ContactProblem, DPair, Target, Velocity, gallery};

/// State of a source's method.
type Model<'a> = Oracle<'a>;

/// Number of iterations or substeps that are compared.
const COUNT: u32 = 10;
/// Iterations after which a solver has reached its solution.
const MANY: u32 = 2000;

/// Iterations in which rounding does not grow beyond the bound. Spectral step lengths are quotients of differences, and
/// steps of up to 10⁴ multiply the rounding of the gradient.
fn most(solver: &str) -> u32 {
    match solver {
        "barzilai_borwein" => 6,
        "staggered" => 2,
        _ => u32::MAX,
    }
}

/// Largest distance that is allowed: single precision in ten iterations. Each of their 10³ operations rounds
/// by 6·10⁻⁸, and in the worst case the errors add up.
const ROUNDING: f64 = 6e-5;

/// Mechanisms of `shim` that are left out in the comparison.
const WITHOUT: [&str; 3] = ["frames", "impacts", "jams"];

/// The cells of a solver in sources.md: its source at its best, departures that the method in `f64` can undo,
/// of which [`Run::undo`] is the index, and why the solution is compared, if it is.
fn source(solver: &str) -> (&'static str, Vec<&'static str>, &'static str) {
    let rows = include_str!("sources.md").lines().filter_map(|line| line.strip_prefix("| `"));
    let cells = |row: &'static str| row.split(" | ").map(|cell| cell.trim_matches(['|', ' ', '`']));
    let row = rows.map(|row| cells(row).collect::<Vec<_>>()).find(|row| row[0] == solver);
    let row = row.unwrap_or_else(|| panic!("tests/lab/agree/sources.md has no row for {solver}"));
    (row[1], row[2].split("; ").filter(|departure| !departure.is_empty()).collect(), row[3])
}

/// A solver compared with its source's method.
struct Agreement {
    variant: &'static Variant,
    against: Against,
    /// Largest distance in the problems, and in each story (1).
    apart: f64,
    stories: Vec<f64>,
    /// Distance between the methods in `f64` with and without each departure (1).
    departures: Vec<f64>,
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

/// Mechanisms of a solver that are left out in the comparison.
fn left_out(variant: &Variant) -> Without {
    WITHOUT.iter().filter_map(|name| variant.mechanism(name).ok()).fold(Without::default(), Without::and)
}

/// Compares one solver with its method, which makes the mistake `fault`.
fn agreement(variant: &'static Variant, fault: Option<Fault>) -> Agreement {
    let against = against(variant.name).unwrap_or_else(|| panic!("no method for {}", variant.name));
    let (method, counts) = match against {
        Against::Method(method) => (method, (1..=COUNT.min(most(variant.name))).collect::<Vec<_>>()),
        Against::Solution(method) => (method, vec![MANY]),
    };
    let budget = |k: u32| match variant.budget.substeps > 1 {
        true => Budget { substeps: k, ..variant.budget },
        false => variant.of_iterations(k),
    };
    // Solvers with internal state start without any.
    let warm = variant.kept == StateSize::NONE;
    let (mut apart, mut departures) = (0.0, vec![0.0; source(variant.name).1.len()]);
    for problem in problems() {
        let mut replay = Replay::in_substeps(&problem, variant.defaults(), left_out(variant)).unwrap();
        let there = |k: u32, undo: Option<usize>| {
            let start = if warm { problem.warm_impulses() } else { problem.no_impulses() };
            let mut model = Model::new(&problem, Target::Rigid, start);
            method(
                &mut model,
                &Run { variant, budget: budget(k), undo, fault, kept: KeptState::default().into() },
            );
            ModelState { v: model.v, x: model.x, l: model.l }
        };
        let determined = determined(&problem, variant.name, against);
        for &k in &counts {
            let here = replay.run(variant, budget(k), if warm { Start::Warm } else { Start::Cold });
            let (source, time) = (there(k, None), problem.h * f64::from(budget(k).substeps));
            for (place, most) in departures.iter_mut().enumerate() {
                *most = worse(*most, distance(&problem, time, &there(k, Some(place)), &source, &determined));
            }
            let here = ModelState { v: here.velocities, x: here.moves, l: here.impulses };
            apart = worse(apart, distance(&problem, time, &here, &source, &determined));
        }
    }
    let stories = stories::ALL.iter().map(|story| story.apart(variant, fault)).collect();
    Agreement { variant, against, apart, stories, departures }
}

/// The larger of the two; NaN counts as larger.
fn worse(a: f64, b: f64) -> f64 {
    if b > a || b.is_nan() { b } else { a }
}

/// For each impulse, whether its value can be compared. A method determines all; a solution those whose unit vector
/// is in the range of K, which is what ε (K + ε)⁻¹ leaves nothing of.
fn determined(problem: &ContactProblem, solver: &str, against: Against) -> Vec<bool> {
    let k = vectors::couplings(problem);
    // Impulses of `sap` are nearly undetermined: 10⁵ times the rounding of the rows.
    if matches!(against, Against::Method(_)) && solver != "sap" {
        return vec![true; k.len()];
    }
    let least = 1e-9 * k.iter().flatten().fold(0.0, |m: f64, x| m.max(*x));
    let stays = |at: usize| {
        let mut unit: Vec<f64> = (0..k.len()).map(|i| if i == at { 1.0 } else { 0.0 }).collect();
        let entry = |i: usize, j: usize| k[i][j] + if i == j { least } else { 0.0 };
        let mut a: Vec<f64> = (0..k.len() * k.len()).map(|at| entry(at / k.len(), at % k.len())).collect();
        solve_in_place(&mut a, &mut unit, 0.0) && unit.iter().all(|x| (least * x).abs() < 1e-3)
    };
    (0..k.len()).map(stays).collect()
}

/// The distance of two states after `time` (s), see the [module](self).
fn distance(
    problem: &ContactProblem,
    time: f64,
    one: &ModelState,
    other: &ModelState,
    determined: &[bool],
) -> f64 {
    let free: Vec<Velocity> = problem.bodies.iter().map(|b| b.free_velocity).collect();
    let scale = problem.mass_norm(&minus(&other.v, &free)).max(problem.mass_norm(&free));
    let largest = other.l.iter().flatten().fold(problem.impulse_unit(), |m, l| m.max(l.abs()));
    let impulses = one.l.iter().flatten().zip(other.l.iter().flatten()).zip(determined);
    let pushed = minus(&problem.velocities(&one.l), &problem.velocities(&other.l));
    let parts = [
        problem.mass_norm(&minus(&one.v, &other.v)) / scale,
        problem.mass_norm(&minus(&one.x, &other.x)) / (time * scale),
        problem.mass_norm(&pushed) / scale,
        impulses.filter(|(_, is)| **is).map(|((a, b), _)| (a - b).abs()).fold(0.0, worse) / largest,
    ];
    parts.into_iter().fold(0.0, worse)
}

impl Agreement {
    /// What the docs of the solver leave to this test.
    fn text(&self) -> String {
        let Agreement { variant, against, apart, stories, departures } = self;
        let (best, departs, why) = source(variant.name);
        let of = match (against, variant.budget.substeps > 1) {
            (Against::Solution(_), _) => format!("the solution in f64 after {MANY} iterations ({why})"),
            (_, false) => {
                format!("the source's method in f64 over {} iterations", COUNT.min(most(variant.name)))
            }
            (_, true) => format!("the source's method in f64 over {COUNT} substeps"),
        };
        let (name, key) = (variant.name, variant.source);
        let mut out = format!("{name}: {apart:.1e} from {of}, {ROUNDING:.0e} allowed\n");
        out += &format!("  source [{key}] at its best: {best}\n");
        for (story, apart) in stories::ALL.iter().zip(stories) {
            out += &format!("  {apart:.1e} in the story of {}\n", story.name);
        }
        for (what, apart) in departs.iter().zip(departures) {
            out += &format!("  departs by {:>6.1} %: {what}\n", 100.0 * apart);
        }
        out
    }
}

/// Distances are within rounding, and the docs of each solver name the bound and this test.
#[test]
fn solvers_agree_with_their_sources() {
    let mut wrong = String::new();
    let rows = include_str!("sources.md").lines().filter(|line| line.starts_with("| `")).count();
    assert_eq!(rows, VARIANTS.len(), "rows of tests/lab/agree/sources.md");
    for variant in &VARIANTS {
        let a = agreement(variant, None);
        println!("{}", a.text());
        let parts = [a.apart].into_iter().chain(a.stories.iter().copied());
        if parts.clone().any(|apart| apart.is_nan() || apart > ROUNDING) {
            let parts: Vec<String> = parts.map(|apart| format!("{apart:.1e}")).collect();
            wrong += &format!("{} is {} apart, {ROUNDING:.0e} allowed\n", variant.name, parts.join(", "));
        }
        let of = if matches!(a.against, Against::Method(_)) { "its source's method" } else { "the solution" };
        let line = format!("//! **Agreement.** Within {ROUNDING:.0e} of {of} in `f64` (`tests/lab/agree`).");
        let path = format!("{}/src/engine/solvers/{}.rs", env!("CARGO_MANIFEST_DIR"), variant.name);
        if !std::fs::read_to_string(path).unwrap().lines().any(|l| l == line) {
            wrong += &format!("docs of {} do not say: {line}\n", variant.name);
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// A difference in method is detected: a departure undone.
#[test]
fn a_departure_shows() {
    let pgs = agreement(find("pgs").unwrap(), None);
    assert!(pgs.departures.iter().all(|apart| *apart > 100.0 * ROUNDING), "{:?}", pgs.departures);
}

/// Each mistake, made by the method in `f64`, is detected.
#[test]
fn a_mistake_shows() {
    for (fault, solver) in [
        (Fault::Uncoupled, "admm"),
        (Fault::FixedLength, "barzilai_borwein"),
        (Fault::HalfStored, "pgs"),
        (Fault::NoAnchors, "physx"),
        (Fault::Inward, "staggered"),
    ] {
        let a = agreement(find(solver).unwrap(), Some(fault));
        let apart = a.stories.iter().copied().fold(a.apart, worse);
        println!("{fault:?} in {solver}: {apart:.1e}");
        assert!(apart > 100.0 * ROUNDING, "{fault:?} in {solver}: {apart:.1e}");
    }
}
