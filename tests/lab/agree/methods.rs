//! The methods as described by their sources, a function each. They include the departures of the solver
//! here, except the one with index [`Run::undo`] in sources.md, which is done as the source
//! does it.

use super::rules::{ScalarRule, ScalarSpring, positions, positions_in_pairs};
use super::{Model, vectors};
use simpulse::engine::constraints::numerics::matrix::solve_in_place;
use simpulse::engine::params::Budget;
use simpulse::engine::solvers::{Variant, xpbd as displacements};
use simpulse::lab::reference::oracle::{RowOrder, ScalarSweep};
use simpulse::lab::reference::{DPair, ProblemBody, Velocity};
use std::cell::RefCell;

/// Uncorrected overlap (m), push speed limit (m/s), largest correction of a position sweep (m).
const SLOP: f64 = 0.005;
pub(super) const CAP: f64 = 3.0;
const MOST: f64 = 0.2;

/// Parameters of a schedule.
#[derive(Clone, Debug)]
pub struct Run {
    /// The solver that is compared.
    pub variant: &'static Variant,
    /// Budget of the run.
    pub budget: Budget,
    /// Index of the departure to undo.
    pub undo: Option<usize>,
    /// A mistake to make.
    pub fault: Option<Fault>,
    /// What the method keeps from step to step, in addition to impulses.
    pub kept: RefCell<KeptState>,
}

/// A mistake in the method in `f64`, which the comparison must detect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The coupling between points is left out of the linear problem.
    Uncoupled,
    /// Every step of a descent is as long as the first.
    FixedLength,
    /// Half of the impulses are stored for the next step.
    HalfStored,
    /// Anchors of friction are forgotten between steps.
    NoAnchors,
    /// Rebounds have the wrong sign.
    Inward,
}

/// What a method keeps from step to step.
#[derive(Clone, Debug, Default)]
pub struct KeptState {
    /// How far each point has drifted since it began to stick (m).
    pub drifts: Vec<f64>,
    /// L of `apgd` (1).
    pub steepness: f64,
}

impl Run {
    /// Default of a parameter of the solver; `None` if it has no such parameter.
    pub fn find(&self, name: &str) -> Option<f64> {
        self.variant.parameters.iter().find(|p| p.name == name).map(|p| f64::from(p.default))
    }

    /// The same; zero if the solver has no such parameter.
    pub fn get(&self, name: &str) -> f64 {
        self.find(name).unwrap_or(0.0)
    }

    /// Whether departure `place` is undone.
    pub fn undoes(&self, place: usize) -> bool {
        self.undo == Some(place)
    }

    /// Whether it makes this mistake.
    pub fn makes(&self, fault: Fault) -> bool {
        self.fault == Some(fault)
    }

    pub fn baumgarte(&self) -> ScalarRule {
        ScalarRule::Baumgarte(self.get("baumgarte"), SLOP, CAP)
    }

    /// Springs with a frequency of at most `share` of the substep rate.
    fn spring(&self, share: f64, h: f64) -> ScalarSpring {
        let damping = self.find("damping_ratio").unwrap_or(10.0);
        ScalarSpring::new(self.get("contact_hertz"), share, damping, self.get("push_speed"), h)
    }
}

/// Runs the substeps: forces, warm start, `solve` in every iteration, motion, `after`.
fn substeps(
    model: &mut Model,
    run: &Run,
    turned: bool,
    solve: impl Fn(&mut Model),
    after: impl Fn(&mut Model),
) {
    for _ in 0..run.budget.substeps {
        model.accelerate();
        model.warm_start(turned);
        for _ in 0..run.budget.velocity_iterations {
            solve(model);
            rebound(model);
        }
        model.advance();
        after(model);
    }
}

/// The rows of points that bounce, after a sweep over the others (`catto2007box2d`).
pub(super) fn rebound(model: &mut Model) {
    for i in (0..model.l.len()).filter(|&i| model.problem.contacts.get(i).is_some_and(|c| c.rebound != 0.0)) {
        model.normal_row(i, &ScalarSweep::new(ScalarRule::Rebound));
    }
}

/// Velocity sweeps only.
fn sweeps(model: &mut Model, run: &Run, sweep: ScalarSweep<ScalarRule>) {
    substeps(model, run, false, |m| m.sweep(&sweep), |_| ());
}

/// Velocity sweeps and, after motion, relaxing sweeps.
fn relaxed(model: &mut Model, run: &Run, sweep: ScalarSweep<ScalarRule>, relax: ScalarSweep<ScalarRule>) {
    let after = |m: &mut Model| (0..run.budget.relax_iterations).for_each(|_| m.sweep(&relax));
    substeps(model, run, sweep.turned, |m| m.sweep(&sweep), after);
}

/// Velocity sweeps and, after motion, position sweeps.
fn placed(model: &mut Model, run: &Run, sweep: ScalarSweep<ScalarRule>, position: impl Fn(&mut Model)) {
    let after = |m: &mut Model| (0..run.budget.position_iterations).for_each(|_| position(m));
    substeps(model, run, sweep.turned, |m| m.sweep(&sweep), after);
}

/// The reference of a comparison.
#[derive(Clone, Copy)]
pub enum Against {
    /// The source's method in `f64`, state by state: after each iteration or substep.
    Method(fn(&mut Model, &Run)),
    /// The solution of the solver's law, compared after many iterations.
    Solution(fn(&mut Model, &Run)),
}

/// The reference of this solver.
pub fn against(solver: &str) -> Option<Against> {
    use Against::{Method, Solution};
    Some(match solver {
        "projection" => Method(projection),
        "pgs" => Method(pgs),
        "pgs_ngs" => Method(pgs_ngs),
        "pgs_ngs_block" => Method(pgs_ngs_block),
        "pgs_soft" => Method(|m, r| soft(m, r, 1.0 / 3.0, false)),
        "pgs_substeps" => Method(pgs_substeps),
        "symmetric_gs" => Method(symmetric),
        "sor" => Method(sor),
        "local_gs" => Method(local),
        "nsgs" => Method(nsgs),
        "nncg" => Method(vectors::nncg),
        "anderson" => Method(vectors::anderson),
        "apgd" => Method(vectors::apgd),
        "barzilai_borwein" => Method(vectors::barzilai_borwein),
        "staggered" => Method(vectors::staggered),
        "admm" => Method(vectors::admm),
        "sap" => Method(vectors::sap),
        "random_order" | "direct" => Solution(solution),
        "shock" => Method(shock),
        "split_impulse" => Method(split_impulse),
        "jacobi" => Method(|m, r| all_at_once(m, r, false)),
        "mass_splitting" => Method(|m, r| all_at_once(m, r, true)),
        "tgs_ngs" => Method(tgs_ngs),
        "tgs_soft" => Method(|m, r| soft(m, r, 0.125, true)),
        "tgs_sticky" => Method(tgs_sticky),
        "xpbd" => Method(xpbd),
        "avbd" => Method(avbd),
        "soft_step" => Method(|m, r| soft(m, r, 0.125, false)),
        "shim" => Method(stiff_blocks),
        "box2d" => Method(|m, r| without_first_friction(m, r, RowOrder::NormalsFirst)),
        "rapier" => Method(|m, r| {
            without_first_friction(m, r, RowOrder::BlockFirst(if r.undoes(0) { 1e-2 } else { 1e-3 }))
        }),
        "physx" => Method(physx),
        "jolt" => Method(jolt),
        _ => return None,
    })
}

/// A point that bounces has a given load in the sweep, and its friction row alone is solved.
fn nsgs(model: &mut Model, run: &Run) {
    let sweep = ScalarSweep::new(run.baumgarte());
    let solve = |m: &mut Model| {
        for range in m.manifolds.clone() {
            let bounces = m.problem.contacts[range.clone()].iter().any(|c| c.rebound != 0.0);
            let rows = if bounces { RowOrder::NormalsFirst } else { RowOrder::Cone };
            m.contact(range, &ScalarSweep { rows, ..sweep });
        }
    };
    substeps(model, run, false, solve, |_| ());
}

fn pgs(model: &mut Model, run: &Run) {
    let mut sweep = ScalarSweep::new(run.baumgarte());
    match run.undo {
        Some(0) => sweep.rows = RowOrder::PointByPoint,
        Some(1) => sweep.rule = ScalarRule::Baumgarte(0.2, 0.01, CAP),
        Some(2) => sweep.rule = ScalarRule::Baumgarte(run.get("baumgarte"), SLOP, f64::INFINITY),
        _ => {}
    }
    sweeps(model, run, sweep);
}

/// Its source displaces bodies, as [`xpbd`] does.
fn pgs_substeps(model: &mut Model, run: &Run) {
    if run.undo.is_none() {
        return pgs(model, run);
    }
    let budget = Budget { position_iterations: 1, ..run.budget };
    xpbd(model, &Run { variant: &displacements::SOLVER, undo: None, budget, ..run.clone() });
}

fn sor(model: &mut Model, run: &Run) {
    let rows = if run.undoes(0) { RowOrder::PointByPoint } else { RowOrder::NormalsFirst };
    let sweep = ScalarSweep { relax: run.get("relaxation"), rows, ..ScalarSweep::new(run.baumgarte()) };
    sweeps(model, run, sweep);
}

fn symmetric(model: &mut Model, run: &Run) {
    let sweep = ScalarSweep::new(run.baumgarte());
    let back = ScalarSweep { reversed: run.undoes(0), ..sweep };
    let pair = |m: &mut Model| {
        m.sweep(&sweep);
        rebound(m);
        m.sweep_in(&back, (0..m.manifolds.len()).rev());
    };
    substeps(model, run, false, pair, |_| ());
}

fn local(model: &mut Model, run: &Run) {
    let times = if run.undoes(0) { 1000 } else { run.get("local_iterations") as usize };
    let sweep = ScalarSweep::new(run.baumgarte());
    let solve = |m: &mut Model| {
        m.sweep_in(&sweep, (0..m.manifolds.len()).flat_map(|i| std::iter::repeat_n(i, times)));
    };
    substeps(model, run, false, solve, |_| ());
}

/// Level of each body: number of contacts between it and the nearest static body.
fn levels(model: &Model) -> Vec<usize> {
    let mut level = vec![usize::MAX; model.v.len()];
    for next in 1.. {
        let below = |b: Option<u32>, level: &[usize]| b.map_or(0, |b| level[b as usize]);
        let found: Vec<usize> = (model.problem.contacts.iter())
            .flat_map(|c| [(c.body_a, c.body_b), (c.body_b, c.body_a)])
            .filter(|&(body, other)| below(body, &level) == usize::MAX && below(other, &level) == next - 1)
            .filter_map(|(body, _)| body.map(|b| b as usize))
            .collect();
        if found.is_empty() {
            break;
        }
        found.into_iter().for_each(|b| level[b] = next);
    }
    level
}

fn shock(model: &mut Model, run: &Run) {
    let level = levels(model);
    let of = |m: &std::ops::Range<usize>| {
        let sides = model.problem.contacts[m.start].sides();
        sides.map(|(b, _)| level[b]).filter(|&l| l < usize::MAX).max().unwrap_or(0)
    };
    let of: Vec<usize> = model.manifolds.iter().map(of).collect();
    let mut order: Vec<usize> = (0..of.len()).collect();
    order.sort_by_key(|&i| of[i]);
    let (inverse, sweep) = (model.inverse.clone(), ScalarSweep::new(run.baumgarte()));
    for _ in 0..run.budget.substeps {
        model.accelerate();
        model.warm_start(false);
        for _ in 0..run.budget.velocity_iterations {
            model.sweep_in(&sweep, order.iter().copied());
            rebound(model);
        }
        for of_level in order.chunk_by(|&i, &j| of[i] == of[j]) {
            let here = of[of_level[0]];
            for (b, m) in model.inverse.iter_mut().enumerate() {
                *m = if level[b] < here { [0.0; 3] } else { inverse[b] };
            }
            model.sweep_in(&sweep, of_level.iter().copied());
            rebound(model);
        }
        model.inverse.clone_from(&inverse);
        model.advance();
    }
}

/// Jacobi. `split`: on bodies that are split among their contacts.
fn all_at_once(model: &mut Model, run: &Run, split: bool) {
    let (by_rows, relax) = (split && run.undoes(0), run.find("relaxation").unwrap_or(1.0));
    let mut spring = run.spring(1.0 / 3.0, model.h);
    spring.scaled = split || !run.undoes(0);
    let [soft, rigid] = [ScalarRule::Soft(spring), ScalarRule::Rigid]
        .map(|rule| ScalarSweep { relax, ..ScalarSweep::new(rule) });
    let after =
        |m: &mut Model| (0..run.budget.relax_iterations).for_each(|_| m.jacobi(&rigid, split, by_rows));
    substeps(model, run, false, |m| m.jacobi(&soft, split, by_rows), after);
}

fn pgs_ngs(model: &mut Model, run: &Run) {
    let mut sweep = ScalarSweep::new(if run.undoes(1) { ScalarRule::Closed } else { ScalarRule::Rigid });
    if run.undoes(0) {
        sweep.rows = RowOrder::FrictionFirst;
    }
    placed(model, run, sweep, |m| positions(m, run.get("correction"), SLOP, MOST, true));
}

fn pgs_ngs_block(model: &mut Model, run: &Run) {
    let rule = if run.undoes(0) { ScalarRule::Closed } else { ScalarRule::Rigid };
    placed(model, run, ScalarSweep { rows: RowOrder::BlockLast(1e-3), ..ScalarSweep::new(rule) }, |m| {
        if run.undoes(1) {
            positions_in_pairs(m, run.get("correction"), SLOP, MOST);
        } else {
            positions(m, run.get("correction"), SLOP, MOST, true);
        }
    });
}

fn tgs_ngs(model: &mut Model, run: &Run) {
    let sweep = ScalarSweep { turned: run.undoes(0), ..ScalarSweep::new(ScalarRule::Rigid) };
    placed(model, run, sweep, |m| positions(m, run.get("correction"), SLOP, MOST, true));
}

/// Soft sweeps, then rigid relaxing sweeps. `share`: largest spring frequency, as a fraction of the substep
/// rate.
fn soft(model: &mut Model, run: &Run, share: f64, turned: bool) {
    let mut spring = run.spring(share, model.h);
    spring.scaled = !run.undoes(0);
    if run.undoes(1) {
        (spring.omega, spring.cap) = (ScalarSpring::new(30.0, 0.25, 10.0, 0.0, model.h).omega, 2.0);
    }
    let [soft, rigid] = [ScalarRule::Soft(spring), ScalarRule::Rigid]
        .map(|rule| ScalarSweep { turned, ..ScalarSweep::new(rule) });
    relaxed(model, run, soft, rigid);
}

/// Soft sweeps without friction, then rigid ones with it.
fn without_first_friction(model: &mut Model, run: &Run, rows: RowOrder) {
    let spring = ScalarRule::Soft(run.spring(0.125, model.h));
    let soft = ScalarSweep { friction: false, rows, ..ScalarSweep::new(spring) };
    relaxed(model, run, soft, ScalarSweep { rows, ..ScalarSweep::new(ScalarRule::Rigid) });
}

/// Springs at a share of the substep rate, and blocks: `shim` without [`super::WITHOUT`].
fn stiff_blocks(model: &mut Model, run: &Run) {
    let rate = run.get("stiffness") / model.h;
    let spring = ScalarSpring {
        carries: true,
        ..ScalarSpring::new(rate, 1.0, run.get("damping_ratio"), run.get("push_speed"), model.h)
    };
    let [soft, rigid] = [ScalarRule::Soft(spring), ScalarRule::Rigid]
        .map(|rule| ScalarSweep { rows: RowOrder::BlockFirst(1e-3), ..ScalarSweep::new(rule) });
    relaxed(model, run, soft, rigid);
}

fn projection(model: &mut Model, run: &Run) {
    let touching = ScalarSweep { friction: false, ..ScalarSweep::new(ScalarRule::Touching(SLOP)) };
    for _ in 0..run.budget.substeps {
        model.l.fill([0.0; 2]);
        model.accelerate();
        model.advance();
        (0..run.budget.position_iterations).for_each(|_| positions(model, 1.0, 0.0, MOST, false));
        (0..run.budget.velocity_iterations).for_each(|_| model.sweep(&touching));
    }
}

fn split_impulse(model: &mut Model, run: &Run) {
    let share = run.get("correction");
    let (rigid, push) = match run.undoes(0) {
        true => (ScalarRule::Shallow(share, 0.04), ScalarRule::Deep(share, 0.04)),
        false => (ScalarRule::Rigid, ScalarRule::Baumgarte(share, 0.0, CAP)),
    };
    let push = ScalarSweep { friction: false, ..ScalarSweep::new(push) };
    substeps(
        model,
        run,
        false,
        |m| m.sweep(&ScalarSweep::new(rigid)),
        |m| {
            let kept = (m.v.clone(), m.l.clone());
            m.v.fill([0.0; 3]);
            m.l.fill([0.0; 2]);
            (0..run.budget.position_iterations).for_each(|_| m.sweep(&push));
            m.advance();
            (m.v, m.l) = kept;
        },
    );
}

fn tgs_sticky(model: &mut Model, run: &Run) {
    let drifts = &mut run.kept.borrow_mut().drifts;
    drifts.resize(model.l.len(), 0.0);
    model.l.fill([0.0; 2]);
    let turned = run.undoes(2);
    let mut sweep = |m: &mut Model, fraction: f64, stick: f64| {
        let rule = match run.undoes(1) && fraction == 0.0 {
            true => ScalarRule::Closed,
            false => ScalarRule::Baumgarte(fraction, 0.0, run.get("push_speed")),
        };
        for range in m.manifolds.clone() {
            m.contact(range.clone(), &ScalarSweep { friction: false, turned, ..ScalarSweep::new(rule) });
            let total: f64 = range.clone().map(|i| m.l[i][0]).sum();
            let share = if run.undoes(0) { 2.0 } else { range.len() as f64 };
            for i in range {
                let (rows, mass, [s, drift]) = (m.rows(i, turned), m.mass(&m.rows(i, false), 1), m.place(i));
                let drifted = drifts[i] + drift;
                let back = if s < 2.0 * SLOP { stick * drifted / m.h } else { 0.0 };
                let bound = m.problem.contacts[i].friction * total / share;
                let wanted = m.l[i][1] - mass * (m.speed(&rows, 1) + back);
                let new = wanted.clamp(-bound, bound);
                m.set(i, 1, &rows, new);
                // A point that slides starts to stick again at its current position.
                if wanted.abs() > bound && !run.undoes(3) {
                    drifts[i] = -drift;
                }
            }
        }
    };
    for substep in 0..run.budget.substeps {
        model.accelerate();
        (0..run.budget.velocity_iterations)
            .for_each(|_| sweep(model, run.get("baumgarte"), run.get("stick")));
        model.advance();
        if substep + 1 == run.budget.substeps {
            (0..run.budget.relax_iterations).for_each(|_| sweep(model, 0.0, 0.0));
        }
    }
    book_drifts(model, drifts, 2.0 * SLOP, |_| false);
}

/// Adds the drifts of the step, and forgets those of points that slide or are not within `reach` (m).
fn book_drifts(model: &Model, drifts: &mut [f64], reach: f64, slides: impl Fn(usize) -> bool) {
    for (i, drift) in drifts.iter_mut().enumerate() {
        let [s, moved] = model.place(i);
        *drift = if s < reach && !slides(i) { *drift + moved } else { 0.0 };
    }
}

fn physx(model: &mut Model, run: &Run) {
    let substeps = run.budget.substeps;
    let fraction = run.get("baumgarte").min(2.0 / f64::from(substeps).sqrt());
    let drifts = &mut run.kept.borrow_mut().drifts;
    drifts.resize(model.l.len(), 0.0);
    // Manifolds that slid at one of their points in the last sweep.
    let mut slid = vec![false; model.l.len()];
    model.l.fill([0.0; 2]);
    let mut sweep = |m: &mut Model, relaxing: bool| {
        for range in m.manifolds.clone() {
            for i in range.clone().filter(|&i| m.problem.contacts[i].rebound == 0.0) {
                let (rows, s) = (m.rows(i, false), m.place(i)[0]);
                let s = if relaxing { s.max(0.0) } else { s };
                let began_apart = m.problem.contacts[i].gap > 0.0;
                let rate =
                    if began_apart { s / m.h } else { (fraction * s / m.h).max(-run.get("push_speed")) };
                let new = (m.l[i][0] - m.mass(&rows, 0) * (m.speed(&rows, 0) + rate)).max(0.0);
                m.set(i, 0, &rows, new);
            }
            let total: f64 = range.clone().map(|i| m.l[i][0]).sum();
            let share = range.len() as f64;
            slid[range.clone()].fill(false);
            for i in range.clone() {
                let (rows, [s, drift]) = (m.rows(i, false), m.place(i));
                let back = if s < 8.0 * SLOP { fraction * (drifts[i] + drift) / m.h } else { 0.0 };
                let bound = m.problem.contacts[i].friction * total / share;
                let wanted = m.l[i][1] - fraction * m.mass(&rows, 1) * (m.speed(&rows, 1) + back);
                let new = wanted.clamp(-bound, bound);
                m.set(i, 1, &rows, new);
                if wanted.abs() > bound {
                    slid[range.clone()].fill(true);
                }
            }
        }
        rebound(m);
    };
    for substep in 0..substeps {
        match run.undoes(0) {
            true if substep == 0 => (0..substeps).for_each(|_| model.accelerate()),
            true => {}
            false => model.accelerate(),
        }
        (0..run.budget.velocity_iterations).for_each(|_| sweep(model, false));
        model.advance();
    }
    (0..run.budget.relax_iterations).for_each(|_| sweep(model, true));
    book_drifts(model, drifts, 8.0 * SLOP, |i| slid[i]);
}

fn jolt(model: &mut Model, run: &Run) {
    let normals = ScalarSweep { friction: false, ..ScalarSweep::new(ScalarRule::Rigid) };
    let sweep = |m: &mut Model| {
        for range in m.manifolds.clone() {
            // One friction row, at the mean of the points.
            let share = 1.0 / range.len() as f64;
            let mut rows = m.rows(range.start, false);
            for i in range.start + 1..range.end {
                for ((_, mean), (_, j)) in rows.iter_mut().flatten().zip(m.rows(i, false).iter().flatten()) {
                    mean[1][2] += j[1][2];
                }
            }
            rows.iter_mut().flatten().for_each(|(_, mean)| mean[1][2] *= share);
            let sum = |axis: usize| range.clone().map(|i| m.l[i][axis]).sum::<f64>();
            let (bound, old) = (m.problem.contacts[range.start].friction * sum(0), sum(1));
            let new = (old - m.mass(&rows, 1) * m.speed(&rows, 1)).clamp(-bound, bound);
            m.push(&rows, 1, new - old);
            range.clone().for_each(|i| m.l[i][1] = share * new);
            m.contact(range, &normals);
        }
    };
    let (share, slop) = (run.get("correction"), run.get("slop"));
    let after = |m: &mut Model| {
        (0..run.budget.position_iterations).for_each(|_| positions(m, share, slop, share * MOST, true));
    };
    substeps(model, run, false, sweep, after);
}

fn xpbd(model: &mut Model, run: &Run) {
    let compliance = run.get("compliance") / (model.h * model.h);
    for _ in 0..run.budget.substeps {
        model.accelerate();
        let begin = model.x.clone();
        model.advance();
        // λ as impulses × time, which displace bodies (kg·m).
        let mut l = vec![[0.0; 2]; model.l.len()];
        for _ in 0..run.budget.position_iterations {
            for range in model.manifolds.clone() {
                for (i, axis) in range.clone().map(|i| (i, 0)).chain(range.map(|i| (i, 1))) {
                    let (rows, place) = (model.rows(i, true), model.place(i));
                    let change = if axis == 0 {
                        let error = place[0].clamp(-run.get("push_speed") * model.h, 0.0);
                        // Without compliance, a point that does not overlap gives back nothing.
                        let wanted = -(error + compliance * l[i][0]);
                        wanted / (1.0 / model.mass(&rows, 0) + compliance)
                    } else {
                        let wanted = -place[1] * model.mass(&rows, 1);
                        let bound = model.problem.contacts[i].friction * l[i][0];
                        if l[i][0] > 0.0 && (l[i][1] + wanted).abs() <= bound { wanted } else { 0.0 }
                    };
                    l[i][axis] += change;
                    model.displace(&rows, axis, change);
                }
            }
        }
        for (v, (x, begin)) in model.v.iter_mut().zip(model.x.iter().zip(&begin)) {
            *v = [0, 1, 2].map(|k| (x[k] - begin[k]) / model.h);
        }
        model.l = l.iter().map(|l| l.map(|l| l / model.h)).collect();
        for range in model.manifolds.clone() {
            for (axis, i) in [0, 1].into_iter().flat_map(|axis| range.clone().map(move |i| (axis, i))) {
                let rows = model.rows(i, run.undoes(0));
                let bound = model.problem.contacts[i].friction * model.l[i][0];
                let stop = -model.mass(&rows, axis) * model.speed(&rows, axis);
                let change = if axis == 0 { stop } else { stop.clamp(-bound, bound) };
                if model.l[i][0] > 0.0 {
                    model.push(&rows, axis, change);
                }
            }
        }
    }
}

/// Bodies in the order in which the contacts list them.
fn bodies_in_order(model: &Model) -> Vec<usize> {
    let mut order = Vec::new();
    for body in model.problem.contacts.iter().flat_map(|c| c.sides().map(|(b, _)| b)) {
        if !order.contains(&body) && model.inverse[body][0] > 0.0 {
            order.push(body);
        }
    }
    order
}

/// Starts with zero multipliers and penalties of 1 N/m, as in a first step.
fn avbd(model: &mut Model, run: &Run) {
    let (h, points, order) = (model.h, model.l.len(), bodies_in_order(model));
    let forced = |b: &ProblemBody| [0, 1, 2].map(|k| b.free_velocity[k] - b.velocity[k]);
    let gained: Vec<Velocity> = model.problem.bodies.iter().map(forced).collect();
    let stabilizes = run.budget.position_iterations > 0;
    let (margin, alpha) = (5e-4, if stabilizes { 1.0 } else { run.get("alpha") });
    let keep = if stabilizes { 1.0 } else { run.get("alpha") * run.get("gamma") };
    // λ (N) and k (N/m) of normal and friction rows; velocities of the last substep.
    let (mut l, mut k) = (vec![[0.0; 2]; points], vec![[1.0; 2]; points]);
    let mut last: Vec<[f64; 3]> = vec![[0.0; 3]; model.v.len()];
    for _ in 0..run.budget.substeps {
        l.iter_mut().flatten().for_each(|l| *l *= keep);
        k.iter_mut().flatten().for_each(|k| *k = (*k * run.get("gamma")).clamp(1.0, 1e9));
        let begin = model.x.clone();
        // Errors are linear in the motion since the start of the step. C₀ is the error at the start of the
        // substep.
        let linear = |m: &Model, i: usize| {
            let mut c = [m.problem.contacts[i].gap + margin, 0.0];
            for (b, j) in m.rows(i, false).into_iter().flatten() {
                (0..2).for_each(|axis| (0..3).for_each(|k| c[axis] += j[axis][k] * m.x[b][k]));
            }
            c
        };
        let first: Vec<DPair> = (0..points).map(|i| linear(model, i)).collect();
        let share: Vec<f64> = (0..model.v.len())
            .map(|b| {
                let (v, a) = (model.v[b], gained[b]);
                let square = a[0] * a[0] + a[1] * a[1];
                let along = (v[0] - last[b][0]) * a[0] + (v[1] - last[b][1]) * a[1];
                if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 1.0 }
            })
            .collect();
        last.clone_from(&model.v);
        model.accelerate();
        model.advance();
        let inertial = model.x.clone();
        for &b in &order {
            (0..3).for_each(|c| model.x[b][c] -= (1.0 - share[b]) * h * gained[b][c]);
        }
        let forces = |m: &Model, i: usize, alpha: f64, l: &[DPair], k: &[DPair]| {
            let c = linear(m, i);
            // A gap has no error to keep.
            let old = [if first[i][0] - margin > 0.0 { 0.0 } else { first[i][0] }, 0.0];
            let c = [c[0] - alpha * old[0], c[1] - first[i][1]];
            let normal = (l[i][0] - k[i][0] * c[0]).max(0.0);
            let bound = m.problem.contacts[i].friction * if run.undoes(0) { l[i][0] } else { normal };
            (c, [normal, (l[i][1] - k[i][1] * c[1]).clamp(-bound, bound)], bound)
        };
        let descend = |m: &mut Model, alpha: f64, l: &[DPair], k: &[DPair]| {
            for &body in &order {
                let mut a = [[0.0; 3]; 3];
                let mut f = [0.0; 3];
                for c in 0..3 {
                    let inertia = 1.0 / (m.inverse[body][c] * h * h);
                    // Infinite inertia if the body does not turn.
                    (a[c][c], f[c]) = match inertia.is_finite() {
                        true => (inertia, inertia * (inertial[body][c] - m.x[body][c])),
                        false => (1.0, 0.0),
                    };
                }
                for i in 0..points {
                    let Some((_, j)) = m.rows(i, false).into_iter().flatten().find(|(b, _)| *b == body)
                    else {
                        continue;
                    };
                    let (_, force, _) = forces(m, i, alpha, l, k);
                    let rough = m.problem.contacts[i].friction > 0.0;
                    for axis in 0..if rough { 2 } else { 1 } {
                        let j =
                            if m.inverse[body][2] > 0.0 { j[axis] } else { [j[axis][0], j[axis][1], 0.0] };
                        for r in 0..3 {
                            f[r] += j[r] * force[axis];
                            (0..3).for_each(|c| a[r][c] += k[i][axis] * j[r] * j[c]);
                        }
                    }
                }
                solve_in_place(a.as_flattened_mut(), &mut f, 0.0);
                (0..3).for_each(|c| m.x[body][c] += f[c]);
            }
        };
        for _ in 0..run.budget.velocity_iterations {
            descend(model, alpha, &l, &k);
            let before = (l.clone(), k.clone());
            for i in 0..points {
                let (c, force, bound) = forces(model, i, alpha, &before.0, &before.1);
                l[i] = force;
                let within = [force[0] > 0.0, force[1].abs() < bound];
                for axis in (0..2).filter(|&axis| within[axis]) {
                    k[i][axis] = (k[i][axis] + run.get("beta") * c[axis].abs()).min(1e9);
                }
            }
        }
        for (v, (x, begin)) in model.v.iter_mut().zip(model.x.iter().zip(&begin)) {
            *v = [0, 1, 2].map(|c| (x[c] - begin[c]) / h);
        }
        (0..run.budget.position_iterations).for_each(|_| descend(model, 0.0, &l, &k));
        model.l = l.iter().map(|l| l.map(|l| h * l)).collect();
    }
}

/// The solution of the law of [`pgs`], to which Gauss–Seidel converges.
fn solution(model: &mut Model, run: &Run) {
    let budget = Budget { velocity_iterations: 5000, ..run.budget };
    pgs(model, &Run { budget, undo: None, ..run.clone() });
}
