//! Newton's method on the contact law itself: the impulses of a step are solved exactly instead of iterated.
//!
//! **Source.** `alart1991` (the natural map and Newton's method on it), `acary2018` (line search,
//! proximal outer loop); with `lemke` set, `cottle1992` (Lemke's method on the law as a linear complementarity
//! problem).
//!
//! **Departures.** Contacts with more supports than a body needs make the linear problem singular. So Newton solves
//! a proximal problem: ε D (λ − λ₀) is added to the relative velocities, λ₀ being the impulses
//! that the sweeps left, which makes it definite and keeps what the law leaves open where it was.
//! Rows of joints are in the same system: a row holds, or has the impulse at its bound. Overlap is pushed apart as in
//! [`super::pgs`]. Sweeps of [`super::pgs`] come first; a scene of more than `largest` points is left to them, and runs and studies say so.
//! Where a step of Newton's finds nothing better, eight sweeps in `f64` take its place (not in scenes with joints).
//!
//! **Agreement.** The source at its best: until a residual is reached. Here: 20 iterations, baumgarte 0.3, sweeps
//! 8, largest 4000, lemke 0. Apart from the solution in `f64` after 2000 iterations by less than 6e-5 (Newton's
//! method ends at the solution of the same law, or with the sweeps that it began with): `simpulse agree --solvers
//! direct`.
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `sweeps` sweeps; then up to `velocity_iterations` factorizations
//! of a matrix of 3 × 3 blocks, one row of blocks per body, ordered by breadth (`numerics/block_lu.rs`): n b² products of blocks in `f64` for
//! n bodies in a band of b, one lane. Whole steps take 30 and 58 µs on
//! `stack:10` and `stack:20`, 0.6 and 4 ms on `pyramid:10` and `pyramid:20` (AMD EPYC, AVX-512, 2026-11-24). Lemke's method goes through a
//! tableau of 16m² entries for m points at each pivot, and there are more pivots than points: it loses to Newton's from the first
//! point on. Sweeps of a step request 7766 B per contact.
//!
//! **Fails when** bands are wide, and where friction lets a point
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
use crate::engine::constraints::numerics::block_lu::{BlockLu, inverse};
use crate::engine::constraints::numerics::coulomb_lcp::CoulombLcp;
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
            default: 4000.0,
            range: [0.0, 100_000.0],
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
/// Solves of a linear problem: one, and two for what it leaves.
const PASSES: usize = 3;
/// Halvings of a step before Newton gives up.
const HALVINGS: usize = 8;
/// Sweeps in `f64` where a step of Newton's finds nothing better.
const SWEEPS: usize = 8;
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
        if newton.is_none() {
            passes.count_unsolved();
        }
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
    /// Of the bodies' matrix, in its order.
    factors: BlockLu<3>,
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
        let mut problem = Problem::new(points, system.rows(), &written, &velocities, &surfaces);
        for block in &joints.blocks {
            problem.join(system.rows(), block, rule.of_errors().bias_rate, h);
        }
        problem.couple();
        let mut factors = BlockLu::default();
        factors.begin(problem.neighbors.len(), |body| problem.neighbors[body].iter().copied());
        let impulses = problem.start.clone();
        let arguments = problem.arguments(&impulses);
        let merit = problem.merit(&impulses, &arguments);
        let delta = vec![[0.0; 2]; written.len()];
        Newton { problem, factors, impulses, arguments, merit, done: false, written, surfaces, delta, joints }
    }

    /// One step as far as the residual falls; impulses and velocities follow.
    fn step(&mut self, system: &mut System<'_>) {
        let problem = &self.problem;
        self.done |= self.merit <= problem.goal(&self.impulses);
        if self.done {
            return;
        }
        let target = problem.solve_states(&problem.states(&self.arguments), &mut self.factors);
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
        let Some(better) = better.or_else(|| self.swept()) else {
            self.done = true;
            return;
        };
        (self.impulses, self.arguments, self.merit) = better;
        self.write(system);
    }

    /// Some more sweeps where Newton's states lead nowhere, if they come nearer: then states are others.
    fn swept(&self) -> Option<(Vec<f64>, Vec<f64>, f64)> {
        let problem = &self.problem;
        if !problem.bounds.is_empty() {
            return None;
        }
        let mut impulses = self.impulses.clone();
        (0..SWEEPS).for_each(|_| problem.sweep(&mut impulses));
        let arguments = problem.arguments(&impulses);
        let merit = problem.merit(&impulses, &arguments);
        (merit < self.merit).then_some((impulses, arguments, merit))
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
                    let roots = [on.velocity[3], on.velocity[3], on.delta[3]].map(f32::sqrt);
                    (0..3).for_each(|c| on.velocity[c] += roots[c] * j[c] as f32 * change);
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

/// One row of the Jacobian, scaled to unit masses: J M^(-½).
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Rows of bodies a and b.
    bodies: [u32; 2],
    /// The same among the bodies that can move; [`IMMOVABLE`] for others.
    movable: [usize; 2],
    /// Of a and b.
    jacobian: [[f64; 3]; 2],
}

/// In [`Row::movable`].
const IMMOVABLE: usize = usize::MAX;

impl Row {
    #[inline]
    fn dot(&self, velocities: &[[f64; 3]]) -> f64 {
        self.sides().map(|(body, j)| dot(j, velocities[body])).sum()
    }

    /// Adds the effect of an impulse.
    #[inline]
    fn push(&self, velocities: &mut [[f64; 3]], impulse: f64) {
        self.sides().for_each(|(body, j)| (0..3).for_each(|c| velocities[body][c] += j[c] * impulse));
    }

    /// The bodies that can move, with this row on them.
    #[inline]
    fn sides(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.movable.into_iter().zip(self.jacobian).filter(|side| side.0 != IMMOVABLE)
    }

    /// J M⁻¹ Jᵀ of two rows.
    #[inline]
    fn coupling(&self, other: &Row) -> f64 {
        self.sides()
            .flat_map(|(a, j)| other.sides().filter(move |s| s.0 == a).map(move |s| dot(j, s.1)))
            .sum()
    }
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
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

/// The row of the Jacobian on bodies with these rows.
fn row(bodies: &[BodyRow], of: [u32; 2], jacobian: [[f64; 3]; 2]) -> Row {
    let side = |side: usize| {
        let mass = bodies.get(of[side] as usize).copied().unwrap_or_default();
        let inverse = [mass.velocity[3], mass.velocity[3], mass.delta[3]].map(f64::from);
        let moves = inverse != [0.0; 3];
        let scaled = [0, 1, 2].map(|c| jacobian[side][c] * inverse[c].sqrt());
        (if moves { of[side] as usize } else { IMMOVABLE }, scaled)
    };
    let [a, b] = [side(0), side(1)];
    Row { bodies: of, movable: [a.0, b.0], jacobian: [a.1, b.1] }
}

/// A row that holds.
struct HeldRow {
    /// Its number.
    at: usize,
    /// s µ of a point that slips, 0 of others.
    slope: f64,
    /// Inverse root of its diagonal (kg^½).
    scale: f64,
    /// Rows of P and Q.
    seen: Row,
    acts: Row,
    b: f64,
}

/// Rows that hold and share a block of T.
struct HeldGroup {
    first: usize,
    size: usize,
    softness: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
}

/// Rows of a joint that share their softness R.
#[derive(Clone, Copy, Debug)]
struct JointSoftness {
    first: usize,
    size: usize,
    /// 1/kg
    r: [[f64; 3]; 3],
}

/// The law of a step around the impulses that the sweeps left. Rows 2i and 2i + 1 are the normal and the tangential one of
/// point i; behind the points come rows of joints.
struct Problem {
    points: Vec<PointRows>,
    friction: Vec<f64>,
    rows: Vec<Row>,
    /// Of the rows of joints.
    bounds: Vec<Bound>,
    joints: Vec<JointSoftness>,
    /// λ₀ (N·s)
    start: Vec<f64>,
    /// u there, the bias included (m/s).
    velocity: Vec<f64>,
    /// Of K + R (1/kg).
    diagonal: Vec<f64>,
    /// Of each body that can move: those that a row ties to it, and it.
    neighbors: Vec<Vec<usize>>,
}

impl Problem {
    /// Of contact points alone.
    fn new(
        points: Vec<PointRows>,
        bodies: &[BodyRow],
        impulses: &[Pair],
        velocities: &[Pair],
        surfaces: &[Pair],
    ) -> Self {
        let flat = |v: &[Pair]| points.iter().flat_map(|p| v[p.at].map(f64::from)).collect::<Vec<_>>();
        let friction = points.iter().map(|p| f64::from(surfaces[p.at][1])).collect();
        let rows = points
            .iter()
            .flat_map(|p| [0, 1].map(|axis| row(bodies, p.bodies, [p.on(0, axis), p.on(1, axis)])));
        let rows = rows.collect();
        let (start, velocity) = (flat(impulses), flat(velocities));
        let (bounds, joints, diagonal, neighbors) = (vec![], vec![], vec![], vec![]);
        Problem { friction, start, velocity, rows, bounds, joints, diagonal, neighbors, points }
    }

    /// Adds the rows of a block of a joint.
    fn join(&mut self, bodies: &[BodyRow], block: &RowBlock, rate: f32, h: f32) {
        let (bias, softness) = (block.bias(rate, h), f64::from(block.softness()));
        let first = self.rows.len();
        let mut r = block.response.map(|row| row.map(|x| softness * f64::from(x)));
        for (k, bias) in bias.into_iter().enumerate().take(block.size) {
            let jacobian = [block.on(0, k), block.on(1, k)];
            let speed = |side: usize| {
                let body = bodies.get(block.bodies[side] as usize).copied().unwrap_or_default();
                (0..3).map(|c| jacobian[side][c] * f64::from(body.velocity[c])).sum::<f64>()
            };
            let soft = (0..block.size).map(|c| r[k][c] * f64::from(block.impulses[c])).sum::<f64>();
            self.velocity.push(speed(0) + speed(1) + f64::from(bias) + soft);
            self.start.push(f64::from(block.impulses[k]));
            self.rows.push(row(bodies, block.bodies, jacobian));
            self.bounds.push(match (block.law, block.cap()) {
                (RowLaw::Limit, _) => Bound::NotNegative,
                (_, Some(_)) if k > 0 => Bound::Same,
                (_, Some(cap)) => Bound::Norm { cap: f64::from(cap), size: block.size },
                _ => Bound::Free,
            });
            // What nothing can move keeps its impulse.
            if self.rows[first + k].coupling(&self.rows[first + k]) + r[k][k] <= 0.0 {
                self.velocity[first + k] = 0.0;
                r[k][k] = 1.0;
            }
        }
        self.joints.push(JointSoftness { first, size: block.size, r });
    }

    /// Numbers the bodies that can move; with all rows in place.
    fn couple(&mut self) {
        let mut numbers = std::collections::BTreeMap::new();
        for side in self.rows.iter_mut().flat_map(|row| &mut row.movable).filter(|side| **side != IMMOVABLE) {
            let next = numbers.len();
            *side = *numbers.entry(*side).or_insert(next);
        }
        self.neighbors = (0..numbers.len()).map(|body| vec![body]).collect();
        for row in self.rows.iter().filter(|row| !row.movable.contains(&IMMOVABLE)) {
            let [a, b] = row.movable;
            self.neighbors[a].push(b);
            self.neighbors[b].push(a);
        }
        for list in &mut self.neighbors {
            list.sort_unstable();
            list.dedup();
        }
        self.diagonal = self.rows.iter().map(|row| row.coupling(row)).collect();
        for joint in &self.joints {
            (0..joint.size).for_each(|k| self.diagonal[joint.first + k] += joint.r[k][k]);
        }
    }

    /// Changes of velocities by impulses, scaled to unit masses.
    fn moved(&self, x: &[f64]) -> Vec<[f64; 3]> {
        let mut moved = vec![[0.0; 3]; self.neighbors.len()];
        self.rows.iter().zip(x).filter(|(_, x)| **x != 0.0).for_each(|(row, x)| row.push(&mut moved, *x));
        moved
    }

    /// (K + R) x
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let moved = self.moved(x);
        let mut product: Vec<f64> = self.rows.iter().map(|row| row.dot(&moved)).collect();
        for joint in &self.joints {
            for k in 0..joint.size {
                product[joint.first + k] +=
                    (0..joint.size).map(|c| joint.r[k][c] * x[joint.first + c]).sum::<f64>();
            }
        }
        product
    }

    fn diagonal(&self, i: usize) -> f64 {
        self.diagonal[i]
    }

    /// λ − (u + ε D (λ − λ₀))/D, row by row.
    fn arguments(&self, impulses: &[f64]) -> Vec<f64> {
        let change: Vec<f64> = impulses.iter().zip(&self.start).map(|(l, s)| l - s).collect();
        let pushed = self.times(&change);
        let argument =
            |i: usize| impulses[i] - (self.velocity[i] + pushed[i]) / self.diagonal(i) - SHIFT * change[i];
        (0..impulses.len()).map(argument).collect()
    }

    /// One projected Gauss–Seidel sweep over the rows of points.
    fn sweep(&self, impulses: &mut [f64]) {
        let mut change: Vec<f64> = impulses.iter().zip(&self.start).map(|(l, s)| l - s).collect();
        let mut moved = self.moved(&change);
        for i in 0..2 * self.points.len() {
            let u = self.velocity[i] + self.rows[i].dot(&moved);
            let argument = impulses[i] - u / self.diagonal(i) - SHIFT * change[i];
            impulses[i] = match i % 2 {
                0 => argument.max(0.0),
                _ => {
                    let bound = self.friction[i / 2] * impulses[i - 1];
                    argument.max(-bound).min(bound)
                }
            };
            let by =
                impulses[i] - self.start[i] - std::mem::replace(&mut change[i], impulses[i] - self.start[i]);
            self.rows[i].push(&mut moved, by);
        }
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
    ///
    /// Let P be the rows that hold and Q what acts along them (a slipping point acts along n + s µ t), both scaled to
    /// unit masses and a unit diagonal, and T = R + ε their own softness. Then (P Qᵀ + T) y = b, and with z = Qᵀ y, the change
    /// of velocities,
    ///
    /// ```text
    /// y = T⁻¹ (b − P z)        (1 + Qᵀ T⁻¹ P) z = Qᵀ T⁻¹ b
    /// ```
    ///
    /// The second system has three rows per body, however many points it has, and couples bodies that touch. Since T⁻¹
    /// magnifies rounding by 1/ε, it is solved again for what b − (P Qᵀ + T) y leaves.
    fn solve_states(&self, states: &[State], system: &mut BlockLu<3>) -> Option<Vec<f64>> {
        let mut impulses: Vec<f64> =
            states.iter().map(|state| if let State::Fixed(value) = state { *value } else { 0.0 }).collect();
        let change: Vec<f64> = self.start.iter().zip(&impulses).map(|(l, fixed)| l - fixed).collect();
        let pushed = self.times(&change);
        let held: Vec<HeldRow> = (0..states.len())
            .filter(|&i| states[i] == State::Holds)
            .map(|i| {
                let scale = 1.0 / self.diagonal(i).sqrt();
                let row = self.rows[i];
                let slope = if let Some(State::Slips(slope)) = states.get(i + 1) { *slope } else { 0.0 };
                let along = |side: usize, c: usize| {
                    row.jacobian[side][c]
                        + if slope == 0.0 { 0.0 } else { slope * self.rows[i + 1].jacobian[side][c] }
                };
                HeldRow {
                    at: i,
                    slope,
                    scale,
                    seen: Row { jacobian: row.jacobian.map(|j| j.map(|x| scale * x)), ..row },
                    acts: Row { jacobian: [0, 1].map(|s| [0, 1, 2].map(|c| scale * along(s, c))), ..row },
                    b: scale * (pushed[i] - self.velocity[i]) + SHIFT * self.start[i] / scale,
                }
            })
            .collect();
        let groups = self.groups(&held)?;
        system.clear();
        let one = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        (0..self.neighbors.len()).for_each(|body| system.add(body, body, one));
        for group in &groups {
            // Rows of a group share their bodies.
            let (members, movable) = (&held[group.first..][..group.size], held[group.first].seen.movable);
            for (to, from) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                if movable[to] == IMMOVABLE || movable[from] == IMMOVABLE {
                    continue;
                }
                let mut block = [[0.0; 3]; 3];
                for (q, weights) in members.iter().zip(&group.inverse) {
                    let mut softened = [0.0; 3];
                    for (p, t) in members.iter().zip(weights) {
                        (0..3).for_each(|c| softened[c] += t * p.seen.jacobian[from][c]);
                    }
                    for (row, q) in block.iter_mut().zip(q.acts.jacobian[to]) {
                        (0..3).for_each(|c| row[c] += q * softened[c]);
                    }
                }
                system.add(movable[to], movable[from], block);
            }
        }
        if !system.factorize() {
            return None;
        }
        // T⁻¹ x or T x
        let soften = |x: &[f64], of: fn(&HeldGroup) -> &[[f64; 3]; 3]| {
            let mut y = vec![0.0; x.len()];
            for group in &groups {
                let members = group.first..group.first + group.size;
                for (y, t) in y[members.clone()].iter_mut().zip(of(group)) {
                    *y = t.iter().zip(&x[members.clone()]).map(|(t, x)| t * x).sum();
                }
            }
            y
        };
        // Qᵀ x
        let act = |x: &[f64]| {
            let mut z = vec![[0.0; 3]; self.neighbors.len()];
            held.iter().zip(x).for_each(|(row, x)| row.acts.push(&mut z, *x));
            z
        };
        let mut y = vec![0.0; held.len()];
        let mut left: Vec<f64> = held.iter().map(|row| row.b).collect();
        for _ in 0..PASSES {
            let mut z = act(&soften(&left, |group| &group.inverse));
            system.solve(&mut z);
            let rest: Vec<f64> = held.iter().zip(&left).map(|(row, b)| b - row.seen.dot(&z)).collect();
            y.iter_mut().zip(soften(&rest, |group| &group.inverse)).for_each(|(y, dy)| *y += dy);
            let (moved, given) = (act(&y), soften(&y, |group| &group.softness));
            let remains = |(row, t): (&HeldRow, f64)| row.b - row.seen.dot(&moved) - t;
            left = held.iter().zip(given).map(remains).collect();
        }
        for (row, y) in held.iter().zip(&y) {
            impulses[row.at] = y * row.scale;
            if row.slope != 0.0 {
                impulses[row.at + 1] = row.slope * impulses[row.at];
            }
        }
        Some(impulses)
    }

    /// T of the rows that hold: ε, and R of joints. None if that is singular.
    fn groups(&self, held: &[HeldRow]) -> Option<Vec<HeldGroup>> {
        let mut groups = vec![];
        let (mut first, mut joints) = (0, self.joints.iter());
        while let Some(row) = held.get(first) {
            let joint = if row.at < 2 * self.points.len() {
                JointSoftness { first: row.at, size: 1, r: [[0.0; 3]; 3] }
            } else {
                *joints.find(|joint| row.at < joint.first + joint.size)?
            };
            let members = &held[first..];
            let size = members.iter().take_while(|row| row.at < joint.first + joint.size).count();
            let mut group = HeldGroup { first, size, softness: [[0.0; 3]; 3], inverse: [[0.0; 3]; 3] };
            for (r, c) in (0..size).flat_map(|r| (0..size).map(move |c| (r, c))) {
                let entry = joint.r[members[r].at - joint.first][members[c].at - joint.first];
                let shift = if r == c { SHIFT } else { 0.0 };
                group.softness[r][c] = shift + members[r].scale * entry * members[c].scale;
            }
            let mut padded = group.softness;
            (size..3).for_each(|k| padded[k][k] = 1.0);
            group.inverse = inverse(padded)?;
            first += size;
            groups.push(group);
        }
        Some(groups)
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
        let pushed = self.times(&self.start);
        let free = |i: usize| self.velocity[i] - pushed[i] - SHIFT * self.diagonal(i) * self.start[i];
        let entry = |i: usize, j: usize| {
            let shift = if i == j { 1.0 + SHIFT } else { 1.0 };
            shift * self.rows[i].coupling(&self.rows[j])
        };
        let lcp = CoulombLcp::new(&self.friction, &pair(&|i| self.diagonal(i)), &pair(&free), entry);
        let found = lcp.solve(&vec![1.0; lcp.rows()], PIVOTS * lcp.rows()).ok()?;
        Some(found.into_flattened())
    }
}
