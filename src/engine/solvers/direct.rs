//! Newton's method on the contact law itself, with sparse factors, and Lemke's behind it: the impulses of a step are solved
//! for, not approached.
//!
//! **Source.** `alart1991` (the natural map and Newton's method on it), `acary2018` (line search, proximal outer loop),
//! `lee2025` (centres that move); behind them `cottle1992` (Lemke's method on the law as a linear complementarity problem).
//!
//! **Departures.** Newton's method works on the velocities of bodies, three unknowns each, instead of on impulses: contacts
//! with more supports than a body needs are no singular matrix there, as each point gives way by `regularization` around the
//! impulse that it is centred on, and what the law leaves open stays where the step before had it. Where no step makes the
//! residual fall, points give way more, and their centres move instead. An island of touching bodies that Newton's method
//! leaves unsolved goes to Lemke's, if it has `largest` points at most. Overlap is pushed apart as in [`super::pgs`].
//!
//! What an island ends with is Newton's, or Lemke's, or unsolved, and then the last that Newton's method had: no sweep of another
//! solver takes part. `simpulse run` tells how many islands each of them answered.
//!
//! **Cost.** Per substep 2 body passes and 1 warm start, and up to `velocity_iterations` times a few passes over points and a
//! factorisation of 3 × 3 blocks, one per body and two per pair of bodies that touch, fill included, in `f64`, one lane.
//! Lemke's method goes through a tableau of 16m² entries per pivot for the m points of an island. Sweeps of a step
//! request 0 B per contact.
//!
//! **Fails when** friction lets a point neither stick nor slip consistently (Painlevé): there the law has no solution
//! or several. And in time, where piles are so wide that factors fill.
//!
//! The method is told in [`crate::engine::constraints::vectors::proximal`].

use super::{Law, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::numerics::coulomb_lcp::CoulombLcp;
use crate::engine::constraints::vectors::body_space::{BodyPoint, BodySpace, FIXED, Point2};
use crate::engine::constraints::vectors::proximal::{PointLaw, Proximal};
use crate::engine::constraints::{ImpactLaw, Passes, Solver};
use crate::engine::params::{Budget, LINEAR_SLOP, MAX_PUSH_SPEED, Parameter};
use std::collections::BTreeMap;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "direct",
    source: "alart1991",
    summary: "Newton's method on the contact law with sparse factors, Lemke's behind it",
    budget: Budget { substeps: 1, velocity_iterations: 30, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "regularization",
            unit: "",
            default: 1e-5,
            range: [1e-9, 1.0],
            meaning: "ε: how far points give way, as a share of their effective mass",
            trials: &[],
        },
        Parameter {
            name: "largest",
            unit: "",
            default: 100.0,
            range: [0.0, 2000.0],
            meaning: "contact points of an island up to which Lemke's method is tried",
            trials: &[],
        },
        Parameter {
            name: "lemke",
            unit: "",
            default: 0.0,
            range: [0.0, 1.0],
            meaning: "1: Lemke's method in place of Newton's",
            trials: &[],
        },
    ],
    breaks: &[(Law::NoAllocation, "islands and their tableaux are as large as the scene")],
    impacts: ImpactLaw::None,
    make: || Box::new(Direct::default()),
    ..Variant::BASE
};

/// Residual, relative to the greatest impulse, at which an island is solved.
const SOLVED: f64 = 1e-6;
/// ε of Lemke's problem, as Newton's has one: without it points that share their load without need make it singular.
const SHIFT: f64 = 1e-7;
/// Pivots of Lemke's method per unknown before it gives up.
const PIVOTS: usize = 10;

/// What it keeps.
#[derive(Clone, Debug, Default)]
struct Direct {
    newton: Proximal,
    answers: Answers,
}

/// Islands that were answered by each method.
#[derive(Clone, Copy, Debug, Default)]
struct Answers {
    newton: u64,
    lemke: u64,
    none: u64,
}

impl Solver for Direct {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [fraction, epsilon, largest, lemke] = [0, 1, 2, 3].map(|i| passes.parameter(i));
        let rule = Baumgarte::new(fraction, LINEAR_SLOP, MAX_PUSH_SPEED, h);
        let (by_pivots, epsilon) = (lemke >= 0.5, f64::from(epsilon));
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.warm_start();
            let newton = &mut self.newton;
            passes.with_system(Phase::Solve, |system| {
                newton.space.load(system, |gap| rule.bias(gap));
                newton.begin(epsilon);
            });
            let iterations = if by_pivots { 0 } else { budget.velocity_iterations };
            for k in 0..iterations {
                let done = passes.with_system(Phase::Solve, |system| {
                    let done = newton.iterate(PointLaw::Coulomb, epsilon);
                    newton.space.write(system, &newton.impulses);
                    done
                });
                passes.count_sweep(2);
                if done || k + 1 == iterations {
                    break;
                }
                passes.iteration_done();
            }
            if budget.velocity_iterations > 0 {
                passes.with_system(Phase::Solve, |system| {
                    let Proximal { space, impulses, .. } = &mut self.newton;
                    self.answers.finish(space, impulses, by_pivots, largest as usize);
                    space.write(system, impulses);
                });
                passes.iteration_done();
            }
            passes.solves(&Sweep(rule));
            passes.integrate_positions();
            passes.end_substep(substep);
        }
    }

    fn answers(&self) -> Vec<(&'static str, u64)> {
        let Answers { newton, lemke, none } = self.answers;
        vec![("Newton", newton), ("Lemke", lemke), ("unsolved", none)]
    }

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        self.newton.held_bytes()
    }
}

impl Answers {
    /// Lemke's method on the islands that are not solved, or on all; counts who answered.
    fn finish(&mut self, space: &BodySpace, impulses: &mut [Point2], all: bool, largest: usize) {
        let mut islands: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (i, label) in space.islands().into_iter().enumerate() {
            islands.entry(label).or_default().push(i);
        }
        islands.remove(&FIXED);
        let before = space.natural_map(impulses);
        let mut trial = impulses.to_vec();
        let worst = |map: &[f64], l: &[Point2], points: &[usize]| {
            let greatest = points.iter().fold(0.0_f64, |most, &i| most.max(l[i][0]));
            let residual = points.iter().fold(0.0_f64, |most, &i| most.max(map[i]));
            if residual == 0.0 { 0.0 } else { residual / greatest }
        };
        let by_newton = |points: &[usize]| !all && worst(&before, impulses, points) <= SOLVED;
        let open: Vec<&Vec<usize>> = islands.values().filter(|points| !by_newton(points)).collect();
        self.newton += (islands.len() - open.len()) as u64;
        let mut tried = vec![false; open.len()];
        for (points, tried) in open.iter().zip(&mut tried).filter(|(points, _)| points.len() <= largest) {
            if let Some(found) = by_lemke(space, points) {
                points.iter().zip(found).for_each(|(&i, l)| trial[i] = l);
                *tried = true;
            }
        }
        let after = space.natural_map(&trial);
        for (points, tried) in open.into_iter().zip(tried) {
            let left = worst(&after, &trial, points);
            let is_better = tried && (all || left < worst(&before, impulses, points));
            if is_better {
                points.iter().for_each(|&i| impulses[i] = trial[i]);
            }
            *(if is_better && left <= SOLVED { &mut self.lemke } else { &mut self.none }) += 1;
        }
    }
}

/// The impulses of an island by Lemke's method, see [`crate::engine::constraints::numerics::coulomb_lcp`]; none where it
/// does not end.
fn by_lemke(space: &BodySpace, points: &[usize]) -> Option<Vec<Point2>> {
    let at = |i: usize| &space.points[points[i]];
    // J_i M⁻¹ J_jᵀ of two rows.
    let g = |row: usize, column: usize| -> f64 {
        let (p, q): (&BodyPoint, &BodyPoint) = (at(row / 2), at(column / 2));
        let pair = |(side, other): (usize, usize)| -> f64 {
            let node = p.nodes[side];
            if node == FIXED || node != q.nodes[other] {
                return 0.0;
            }
            let (a, b) = (p.jacobian[row % 2][side], q.jacobian[column % 2][other]);
            (0..3).map(|k| a[k] * b[k] / space.inertia[node as usize][k]).sum()
        };
        [(0, 0), (0, 1), (1, 0), (1, 1)].into_iter().map(pair).sum()
    };
    let diagonal: Vec<Point2> = (0..points.len()).map(|i| at(i).mass.map(|m| 1.0 / m)).collect();
    // Pulled towards the warm start, as Newton's problem is.
    let free = |i: usize| {
        let u = space.velocity(at(i), &space.free);
        [0, 1].map(|k| u[k] - SHIFT * diagonal[i][k] * space.warm[points[i]][k])
    };
    let free: Vec<Point2> = (0..points.len()).map(free).collect();
    let friction: Vec<f64> = (0..points.len()).map(|i| at(i).friction).collect();
    let entry = |i: usize, j: usize| (if i == j { 1.0 + SHIFT } else { 1.0 }) * g(i, j);
    let lcp = CoulombLcp::new(&friction, &diagonal, &free, entry);
    lcp.solve(&vec![1.0; lcp.rows()], PIVOTS * lcp.rows()).ok()
}
