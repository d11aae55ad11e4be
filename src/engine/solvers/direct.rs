//! Newton's method on the contact law itself: the impulses of a step are solved exactly instead of iterated. For
//! scenes of a few dozen contact points.
//!
//! **Source.** `alart1991` (the natural map and Newton's method on it), `acary2018` (line search,
//! proximal outer loop); with `lemke` set, `cottle1992` (Lemke's method on the law as a linear complementarity
//! problem).
//!
//! **Departures.** Contacts with more supports than a body needs make the linear problem singular. So Newton solves
//! a proximal problem: ε D (λ − λ₀) is added to the relative velocities, λ₀ being the impulses
//! that the sweeps left, which makes it definite and keeps what the law leaves open where it was.
//! Rows of joints are in the same system: a row holds, or has the impulse at its bound. Overlap is pushed apart as in
//! [`super::pgs`]. Sweeps of [`super::pgs`] come first; where Newton
//! finds nothing better, and in scenes with more than `largest` points, they are the answer.
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `sweeps` sweeps; then up to `velocity_iterations` factorizations
//! within the envelope of the matrix (`numerics/envelope.rs`), n b² operations in `f64` for n rows in a band of b, one lane.
//! Whole steps of stacks of 10, 20, 30 and 50 boxes (two points each) take 31, 48, 72 and 121 µs where eight sweeps take 4
//! to 13 µs and fall from 20 boxes on (AMD EPYC, AVX2, 2026-11-23). Bands of pyramids are wide: with `largest` at 2000,
//! `pyramid:10` takes 5.6 ms and `pyramid:20` 72 ms. Lemke's method takes 79 and 520 µs for stacks of 5 and 10 boxes: a
//! pivot goes through a tableau of 16m² entries for m points, and there are more pivots than points. A box on an incline takes 8.3 µs by Lemke's method and 4.6 by Newton's, so that it
//! loses from the first point on. Sweeps of a step request 1750 B per contact.
//!
//! **Fails when** there are many points in wide bands, and where friction lets a point
//! neither stick nor slip consistently (Painlevé): then states go in circles and the sweeps remain.
//!
//! # The method
//!
//! Each point is open, sticking or slipping by the sign of what its natural map clips, with ρ = 1/K_ii:
//!
//! ```text
//! open   λn − ρn un ≤ 0                           λn = λt = 0
//! stick  |λt − ρt ut| < µ (λn − ρn un)            un = 0, ut = 0
//! slip   otherwise, s = sign(λt − ρt ut)          un = 0, λt = s µ λn
//! ```
//!
//! In fixed states the law is linear, u = K λ + b. A step goes toward the solution of those states as
//! far as the residual of the natural map falls.

use super::{Law, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::kernels::velocity::rules::NormalRule;
use crate::engine::constraints::numerics::coulomb_lcp::CoulombLcp;
use crate::engine::constraints::numerics::envelope::Envelope;
use crate::engine::constraints::records::rows::{RowBlock, RowLaw};
use crate::engine::constraints::vectors::blocks::JointBlocks;
use crate::engine::constraints::vectors::system::{Pair, PointRows};
use crate::engine::constraints::{ImpactLaw, Passes, Schedule, System};
use crate::engine::lanes::BodyRow;
use crate::engine::params::{Budget, LINEAR_SLOP, MAX_PUSH_SPEED, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "direct",
    source: "alart1991",
    summary: "Newton's or Lemke's method on the contact law in small scenes; sweeps otherwise",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "sweeps",
            unit: "",
            default: 8.0,
            range: [0.0, 1000.0],
            meaning: "sweeps before Newton's method",
            trials: &[],
        },
        Parameter {
            name: "largest",
            unit: "",
            default: 100.0,
            range: [0.0, 2000.0],
            meaning: "contact points, and pairs of rows of joints, up to which Newton's method, or Lemke's, is tried",
            trials: &[],
        },
        Parameter {
            name: "lemke",
            unit: "",
            default: 0.0,
            range: [0.0, 1.0],
            meaning: "1: Lemke's method instead of Newton's",
            trials: &[],
        },
    ],
    breaks: &[
        (Law::NoAllocation, "matrices are as large as the scene"),
        (Law::Rest, "large scenes have 8 sweeps, too few for tall stacks"),
    ],
    impacts: ImpactLaw::None,
    make: || Schedule::boxed(step),
    ..Variant::BASE
};

/// ε: shift of the unit diagonal (1).
const SHIFT: f64 = 1e-7;
/// Pivots of Lemke's method per unknown before it gives up.
const PIVOTS: usize = 10;
/// Halvings of a step before Newton gives up.
const HALVINGS: usize = 8;
/// Residual, relative to the largest impulse, at which the law is solved.
const TOLERANCE: f64 = 1e-10;

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let rule = Baumgarte::new(passes.parameter(0), LINEAR_SLOP, MAX_PUSH_SPEED, h);
    let sweep = Baumgarte::rule(passes.parameter(0), LINEAR_SLOP, MAX_PUSH_SPEED, h);
    let [sweeps, largest] = [1, 2].map(|i| passes.parameter(i) as usize);
    let by_pivots = passes.parameter(3) >= 0.5;
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..sweeps {
            passes.sweep(Phase::Solve, &sweep);
        }
        let points = passes.points();
        let is_small = points <= largest;
        let begin = |system: &mut System<'_>| {
            let joints =
                if is_small && system.has_joints() { system.joint_blocks() } else { JointBlocks::default() };
            let rows = joints.blocks.iter().map(|block| block.size).sum::<usize>();
            (is_small && points + rows / 2 <= largest).then(|| Newton::new(system, &rule, joints, h))
        };
        let mut newton = passes.with_system(Phase::Solve, begin);
        for _ in 0..budget.velocity_iterations {
            if let Some(newton) = &mut newton {
                let step = if by_pivots { Newton::pivot } else { Newton::step };
                passes.with_system(Phase::Solve, |system| step(newton, system));
            }
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}

/// Newton's method on its way.
struct Newton {
    problem: Problem,
    impulses: Vec<f64>,
    arguments: Vec<f64>,
    merit: f64,
    /// Nothing better is found any more.
    done: bool,
    /// The records' values, and the friction of each point.
    written: Vec<Pair>,
    surfaces: Vec<Pair>,
    delta: Vec<Pair>,
    joints: JointBlocks,
}

impl Newton {
    fn new(system: &mut System<'_>, rule: &Baumgarte, joints: JointBlocks, h: f32) -> Self {
        let [mut written, mut velocities, mut surfaces] = [(); 3].map(|_| Vec::new());
        system.impulses(&mut written);
        system.relative_velocities(&mut velocities);
        system.gaps_and_friction(&mut surfaces);
        velocities.iter_mut().zip(&surfaces).for_each(|(v, [gap, _])| v[0] += rule.bias(*gap));
        let points: Vec<PointRows> = system.point_rows().collect();
        let mut problem = Problem::new(points, &written, &velocities, &surfaces);
        for block in &joints.blocks {
            problem.join(system.rows(), block, rule.of_errors().bias_rate, h);
        }
        problem.couple(system.rows(), &joints.blocks);
        let impulses = problem.start.clone();
        let arguments = problem.arguments(&impulses);
        let merit = problem.merit(&impulses, &arguments);
        let delta = vec![[0.0; 2]; written.len()];
        Newton { problem, impulses, arguments, merit, done: false, written, surfaces, delta, joints }
    }

    /// One step as far as the residual falls; impulses and velocities follow.
    fn step(&mut self, system: &mut System<'_>) {
        let problem = &self.problem;
        self.done |= self.merit <= problem.goal(&self.impulses);
        let target = if self.done { None } else { problem.solve_states(&problem.states(&self.arguments)) };
        let mut fraction = 1.0;
        let better = target.and_then(|target| {
            (0..HALVINGS).find_map(|_| {
                let blend = |(l, t): (&f64, &f64)| l + fraction * (t - l);
                let trial: Vec<f64> = self.impulses.iter().zip(&target).map(blend).collect();
                let arguments = problem.arguments(&trial);
                let merit = problem.merit(&trial, &arguments);
                // The directional derivative of the merit along a Newton step is −2 merit.
                let accepted = merit <= (1.0 - 2e-4 * fraction) * self.merit;
                fraction *= 0.5;
                accepted.then_some((trial, arguments, merit))
            })
        });
        let Some(better) = better else {
            self.done = true;
            return;
        };
        (self.impulses, self.arguments, self.merit) = better;
        self.write(system);
    }

    /// Lemke's answer, if it is better than what is there; nothing is left to do after it.
    fn pivot(&mut self, system: &mut System<'_>) {
        if std::mem::replace(&mut self.done, true) {
            return;
        }
        let Some(found) = self.problem.by_lemke() else { return };
        let arguments = self.problem.arguments(&found);
        let merit = self.problem.merit(&found, &arguments);
        if merit < self.merit {
            (self.impulses, self.arguments, self.merit) = (found, arguments, merit);
            self.write(system);
        }
    }

    /// Makes the impulses those of the records, and velocities follow.
    fn write(&mut self, system: &mut System<'_>) {
        for (i, point) in self.problem.points.iter().enumerate() {
            let (at, normal) = (point.at, self.impulses[2 * i].max(0.0) as f32);
            let bound = self.surfaces[at][1] * normal;
            let new = [normal, (self.impulses[2 * i + 1] as f32).min(bound).max(-bound)];
            self.delta[at] = [0, 1].map(|axis| new[axis] - self.written[at][axis]);
            self.written[at] = new;
        }
        system.set_impulses(&self.written);
        system.apply(&self.delta);
        if self.joints.blocks.is_empty() {
            return;
        }
        let new = &self.impulses[2 * self.problem.points.len()..];
        let mut new = new.iter().zip(&self.problem.rows[2 * self.problem.points.len()..]);
        for block in &mut self.joints.blocks {
            for (r, (&impulse, row)) in (0..block.size).zip(&mut new) {
                let change = impulse as f32 - std::mem::replace(&mut block.impulses[r], impulse as f32);
                for (body, j) in row.bodies.into_iter().zip(row.jacobian) {
                    let Some(on) = system.rows().get_mut(body as usize) else { continue };
                    let inverse = [on.velocity[3], on.velocity[3], on.delta[3]];
                    (0..3).for_each(|c| on.velocity[c] += inverse[c] * j[c] as f32 * change);
                }
            }
        }
        system.set_joint_impulses(&self.joints);
    }
}

/// What a row does in a linear problem.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// u = 0.
    Holds,
    /// λ is this.
    Fixed(f64),
    /// λ is this times that of the row before it.
    Slips(f64),
}

/// One row of the Jacobian.
#[derive(Clone, Copy, Debug)]
struct Row {
    bodies: [u32; 2],
    /// Of a and b.
    jacobian: [[f64; 3]; 2],
}

/// Bounds of the rows of a joint.
#[derive(Clone, Copy, Debug)]
enum Bound {
    Free,
    NotNegative,
    /// The norm of this row and of those that follow, so many in all.
    Norm {
        cap: f64,
        size: usize,
    },
    /// One that follows.
    Same,
}

/// Body, row and side of each row of a body, and its inverse masses (1/kg, 1/kg, 1/(kg·m²)).
type RowsOfBody<'a> = (&'a [(u32, usize, usize)], [f64; 3]);

/// The law of a step around the impulses that the sweeps left. Rows 2i and 2i + 1 are the normal and the tangential one of
/// point i; behind the points come rows of joints.
struct Problem {
    points: Vec<PointRows>,
    friction: Vec<f64>,
    rows: Vec<Row>,
    /// Of the rows of joints.
    bounds: Vec<Bound>,
    /// λ₀ (N·s)
    start: Vec<f64>,
    /// u there, the bias included (m/s).
    velocity: Vec<f64>,
    /// K + R: its entries (1/kg) by rows, columns ascending, and where each row begins. `[rows + 1]`
    entries: Vec<(usize, f64)>,
    begins: Vec<usize>,
    /// Its diagonal (1/kg).
    diagonal: Vec<f64>,
}

impl Problem {
    /// Of contact points alone, without the matrix.
    fn new(points: Vec<PointRows>, impulses: &[Pair], velocities: &[Pair], surfaces: &[Pair]) -> Self {
        let flat = |v: &[Pair]| points.iter().flat_map(|p| v[p.at].map(f64::from)).collect::<Vec<_>>();
        let row =
            |p: &PointRows, axis: usize| Row { bodies: p.bodies, jacobian: [p.on(0, axis), p.on(1, axis)] };
        let rows = points.iter().flat_map(|p| [row(p, 0), row(p, 1)]).collect();
        let friction = points.iter().map(|p| f64::from(surfaces[p.at][1])).collect();
        let (start, velocity) = (flat(impulses), flat(velocities));
        Problem {
            friction,
            start,
            velocity,
            rows,
            bounds: vec![],
            entries: vec![],
            begins: vec![],
            diagonal: vec![],
            points,
        }
    }

    /// Adds the rows of a block of a joint.
    fn join(&mut self, bodies: &[BodyRow], block: &RowBlock, rate: f32, h: f32) {
        let (bias, softness) = (block.bias(rate, h), f64::from(block.softness()));
        for (r, bias) in bias.into_iter().enumerate().take(block.size) {
            let row = Row { bodies: block.bodies, jacobian: [block.on(0, r), block.on(1, r)] };
            let speed = |side: usize| {
                let body = bodies.get(row.bodies[side] as usize).copied().unwrap_or_default();
                (0..3).map(|c| row.jacobian[side][c] * f64::from(body.velocity[c])).sum::<f64>()
            };
            let soft = (0..block.size)
                .map(|c| softness * f64::from(block.response[r][c]) * f64::from(block.impulses[c]))
                .sum::<f64>();
            self.velocity.push(speed(0) + speed(1) + f64::from(bias) + soft);
            self.start.push(f64::from(block.impulses[r]));
            self.rows.push(row);
            self.bounds.push(match (block.law, block.cap()) {
                (RowLaw::Limit, _) => Bound::NotNegative,
                (_, Some(_)) if r > 0 => Bound::Same,
                (_, Some(cap)) => Bound::Norm { cap: f64::from(cap), size: block.size },
                _ => Bound::Free,
            });
        }
    }

    /// The matrix K + R of all rows, R of `joints`.
    fn couple(&mut self, bodies: &[BodyRow], joints: &[RowBlock]) {
        let n = self.rows.len();
        // Rows of each body, ascending: those that a row couples with are in the lists of its two bodies.
        let mut sides: Vec<(u32, usize, usize)> = vec![];
        for (i, row) in self.rows.iter().enumerate() {
            sides.extend(row.bodies.into_iter().enumerate().map(|(side, body)| (body, i, side)));
        }
        sides.sort_unstable();
        let mut lists: Vec<[RowsOfBody; 2]> = vec![[(&[], [0.0; 3]); 2]; n];
        for of_body in sides.chunk_by(|one, other| one.0 == other.0) {
            let Some(mass) = bodies.get(of_body[0].0 as usize) else { continue };
            let inverse = [mass.velocity[3], mass.velocity[3], mass.delta[3]].map(f64::from);
            if inverse != [0.0; 3] {
                of_body.iter().for_each(|&(_, i, side)| lists[i][side] = (of_body, inverse));
            }
        }
        for (i, [(mut of_a, mass_a), (mut of_b, mass_b)]) in lists.into_iter().enumerate() {
            self.begins.push(self.entries.len());
            let product = |side: usize, inverse: [f64; 3], j: usize, other: usize| {
                let (a, b) = (self.rows[i].jacobian[side], self.rows[j].jacobian[other]);
                (0..3).map(|c| a[c] * inverse[c] * b[c]).sum::<f64>()
            };
            let mut diagonal = 0.0;
            while let Some(j) = of_a.first().into_iter().chain(of_b.first()).map(|entry| entry.1).min() {
                let mut sum = 0.0;
                for (side, list, mass) in [(0, &mut of_a, mass_a), (1, &mut of_b, mass_b)] {
                    if let Some((&(_, at, other), rest)) = list.split_first()
                        && at == j
                    {
                        sum += product(side, mass, j, other);
                        *list = rest;
                    }
                }
                self.entries.push((j, sum));
                diagonal = if i == j { sum } else { diagonal };
            }
            if self.begins[i] == self.entries.len() {
                self.entries.push((i, 0.0));
            }
            self.diagonal.push(diagonal);
        }
        self.begins.push(self.entries.len());
        let mut first = 2 * self.points.len();
        for block in joints.iter() {
            let softness = f64::from(block.softness());
            for r in (0..block.size).filter(|_| softness > 0.0).map(|r| first + r) {
                let row = self.begins[r]..self.begins[r + 1];
                for (j, value) in &mut self.entries[row] {
                    if (first..first + block.size).contains(j) {
                        *value += softness * f64::from(block.response[r - first][*j - first]);
                    }
                    self.diagonal[r] = if *j == r { *value } else { self.diagonal[r] };
                }
            }
            first += block.size;
        }
        // What nothing can move keeps its impulse.
        for i in (2 * self.points.len()..n).filter(|&i| self.diagonal[i] <= 0.0).collect::<Vec<_>>() {
            (self.diagonal[i], self.velocity[i]) = (1.0, 0.0);
            let row = self.begins[i]..self.begins[i + 1];
            self.entries[row].iter_mut().for_each(|(j, value)| *value = f64::from(*j == i));
        }
    }

    /// Entries of a row, columns ascending.
    fn row(&self, i: usize) -> &[(usize, f64)] {
        &self.entries[self.begins[i]..self.begins[i + 1]]
    }

    /// Product of a row and a vector.
    fn times(&self, i: usize, x: &[f64]) -> f64 {
        self.row(i).iter().map(|&(j, k)| k * x[j]).sum()
    }

    fn diagonal(&self, i: usize) -> f64 {
        self.diagonal[i]
    }

    /// λ − (u + ε D (λ − λ₀))/D, row by row.
    fn arguments(&self, impulses: &[f64]) -> Vec<f64> {
        let n = impulses.len();
        let change: Vec<f64> = impulses.iter().zip(&self.start).map(|(l, s)| l - s).collect();
        let argument = |i: usize| {
            let u = self.velocity[i] + self.times(i, &change);
            impulses[i] - u / self.diagonal(i) - SHIFT * change[i]
        };
        (0..n).map(argument).collect()
    }

    /// Energy-weighted square of the natural map, Σ K_ii r_i² (J).
    fn merit(&self, impulses: &[f64], arguments: &[f64]) -> f64 {
        let one = |i: usize| {
            let (normal, tangent) = (arguments[2 * i].max(0.0), arguments[2 * i + 1]);
            let bound = self.friction[i] * normal;
            let r = [impulses[2 * i] - normal, impulses[2 * i + 1] - tangent.max(-bound).min(bound)];
            self.diagonal(2 * i) * r[0] * r[0] + self.diagonal(2 * i + 1) * r[1] * r[1]
        };
        let contacts = (0..self.points.len()).map(one).sum::<f64>();
        let joint = |(i, state): (usize, State)| {
            let within = if let State::Fixed(value) = state { value } else { arguments[i] };
            self.diagonal(i) * (impulses[i] - within).powi(2)
        };
        contacts + self.joint_states(arguments).map(joint).sum::<f64>()
    }

    /// The merit of residuals that are rounding beside these impulses.
    fn goal(&self, impulses: &[f64]) -> f64 {
        let one = |(i, l): (usize, &f64)| self.diagonal(i) * l * l;
        TOLERANCE * TOLERANCE * impulses.iter().enumerate().map(one).sum::<f64>()
    }

    /// States of all rows.
    fn states(&self, arguments: &[f64]) -> Vec<State> {
        let one = |i: usize| {
            let (normal, tangent, friction) = (arguments[2 * i], arguments[2 * i + 1], self.friction[i]);
            if normal <= 0.0 {
                [State::Fixed(0.0); 2]
            } else if tangent.abs() < friction * normal {
                [State::Holds; 2]
            } else {
                [State::Holds, State::Slips(friction.copysign(tangent))]
            }
        };
        let joints = self.joint_states(arguments).map(|(_, state)| state);
        (0..self.points.len()).flat_map(one).chain(joints).collect()
    }

    /// Rows of joints and what they do: they hold, or their impulse is the nearest one within its bounds.
    fn joint_states(&self, arguments: &[f64]) -> impl Iterator<Item = (usize, State)> {
        let first = 2 * self.points.len();
        let mut scale = 1.0;
        self.bounds.iter().enumerate().map(move |(k, bound)| {
            let i = first + k;
            if let Bound::Norm { cap, size } = *bound {
                let norm = arguments[i..i + size].iter().map(|x| x * x).sum::<f64>().sqrt();
                scale = if norm > cap { cap / norm } else { 1.0 };
            }
            let state = match bound {
                Bound::NotNegative if arguments[i] <= 0.0 => State::Fixed(0.0),
                Bound::Norm { .. } | Bound::Same if scale < 1.0 => State::Fixed(scale * arguments[i]),
                _ => State::Holds,
            };
            (i, state)
        })
    }

    /// The impulses at which the rows that hold are at rest; none if that is singular.
    fn solve_states(&self, states: &[State]) -> Option<Vec<f64>> {
        let n = self.start.len();
        let unknowns: Vec<usize> = (0..n).filter(|&i| states[i] == State::Holds).collect();
        let slope = |i: usize| match states.get(i + 1) {
            Some(State::Slips(slope)) => Some(*slope),
            _ => None,
        };
        let mut impulses: Vec<f64> =
            states.iter().map(|state| if let State::Fixed(value) = state { *value } else { 0.0 }).collect();
        let scale = |i: usize| 1.0 / self.diagonal(i).sqrt();
        const KNOWN: usize = usize::MAX;
        let mut number = vec![KNOWN; n];
        unknowns.iter().enumerate().for_each(|(r, &i)| number[i] = r);
        // A slipping point acts along n + s µ t: its tangential column belongs to the normal one.
        let column = |j: usize| match states[j] {
            State::Slips(slope) => (number[j - 1], j - 1, slope),
            _ => (number[j], j, 1.0),
        };
        let coupled = |r: usize| {
            self.row(unknowns[r]).iter().map(|&(j, _)| column(j).0).filter(|&number| number != KNOWN)
        };
        let mut system = Envelope::default();
        system.begin(unknowns.len(), coupled);
        let mut b = vec![0.0; unknowns.len()];
        let change: Vec<f64> = self.start.iter().zip(&impulses).map(|(l, fixed)| l - fixed).collect();
        for (r, &i) in unknowns.iter().enumerate() {
            for &(j, k) in self.row(i) {
                let (number, j, factor) = column(j);
                if number != KNOWN {
                    system.add(r, number, scale(i) * k * factor * scale(j));
                }
            }
            system.add(r, r, SHIFT);
            b[r] = scale(i) * (self.times(i, &change) - self.velocity[i]) + SHIFT * self.start[i] / scale(i);
        }
        if !system.solve(&mut b, 1e-14) {
            return None;
        }
        for (&i, y) in unknowns.iter().zip(&b) {
            impulses[i] = y * scale(i);
            if let Some(slope) = slope(i) {
                impulses[i + 1] = slope * impulses[i];
            }
        }
        Some(impulses)
    }

    /// The impulses of the same law by Lemke's method, see [`crate::engine::constraints::numerics::coulomb_lcp`]; of scenes
    /// without joints.
    fn by_lemke(&self) -> Option<Vec<f64>> {
        if !self.bounds.is_empty() {
            return None;
        }
        let n = self.start.len();
        let pair = |f: &dyn Fn(usize) -> f64| (0..n).step_by(2).map(|i| [f(i), f(i + 1)]).collect::<Vec<_>>();
        // u without impulses, pulled toward λ₀ as in Newton's problem.
        let free = |i: usize| {
            self.velocity[i] - self.times(i, &self.start) - SHIFT * self.diagonal(i) * self.start[i]
        };
        let entry = |i: usize, j: usize| {
            let shift = if i == j { 1.0 + SHIFT } else { 1.0 };
            let row = self.row(i);
            row.binary_search_by_key(&j, |entry| entry.0).map_or(0.0, |at| shift * row[at].1)
        };
        let lcp = CoulombLcp::new(&self.friction, &pair(&|i| self.diagonal(i)), &pair(&free), entry);
        let found = lcp.solve(&vec![1.0; lcp.rows()], PIVOTS * lcp.rows()).ok()?;
        Some(found.into_flattened())
    }
}
