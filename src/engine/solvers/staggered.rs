//! Staggered projections: normal impulses at fixed friction, and friction at fixed normal impulses, are
//! solved in turn until they agree. Each of the two is a convex problem and is solved well. The result obeys
//! Coulomb's law, not a relaxation of it.
//!
//! **Source.** `kaufman2008`, sections 4 and 7.
//!
//! **Departures.** Each of the two quadratic programs is solved in lanes by spectral projected gradients
//! ([`spectral`]), for `inner` iterations or until nothing changes; the source uses a dense active-set
//! method. In 2D a friction cone is an interval and needs no facets. Overlap is pushed apart as in
//! [`super::pgs`]. Joint rows are in both programs, with their bounds. Points bounce as in
//! [`super::pgs`]: their rebound speed is part of b.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and in each of `velocity_iterations` rounds up to 2 `inner` times 3 passes
//! over vectors in lanes.
//!
//! **Fails when** the load and the friction of a point depend strongly on each other, as under a leaning rod:
//! a round then gains no more than a sweep. Also when `inner` is too small for the height of a pile.
//!
//! # The method
//!
//! ```text
//! λn ← argmin f(λn, λt) over λn ≥ 0,   λt ← argmin f(λn, λt) over |λt| ≤ µ λn
//! f(λ) = ½ λᵀ (K + R) λ + λᵀ (J v* + b)
//! ```
//!
//! At a fixed point, λn is complementary to un, and λt dissipates the most energy.
//!
//! [`spectral`]: crate::constraints::vectors::spectral

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::kernels::velocity::sweep::Sweep;
use crate::constraints::records::point_vector::{PointEntry, Wide};
use crate::constraints::vectors::spectral::{Axes, ImpulseProblem, SpectralDescent};
use crate::constraints::{Passes, Schedule};
use crate::lanes::Lanes;
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "staggered",
    source: "kaufman2008",
    summary: "loads and friction solved in turn, each as a convex problem",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "inner",
            unit: "",
            default: 10.0,
            range: [1.0, 10000.0],
            meaning: "iterations of each of the two projections in a round",
            trials: &[5.0, 20.0],
        },
    ],
    exceptions: &[(
        Guarantee::Converges,
        "to the law of `pgs` where rounds settle, but roundings grow in its inner iterations",
    )],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::new(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    let inner = passes.parameter(1) as usize;
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let rebounds = passes.rebounds();
        let mut problem = ImpulseProblem { bias: passes.vector(), mass: passes.vector() };
        let mut descent = SpectralDescent::new([(); 6].map(|_| passes.vector()));
        passes.with_system(Phase::Solve, |system| problem.begin(system, &rule, rebounds.as_ref(), false));
        for _ in 0..budget.velocity_iterations {
            solve(passes, &problem, &mut descent, inner, Axes::Normal, pushing);
            solve(passes, &problem, &mut descent, inner, Axes::Tangent, within_friction);
            passes.iteration_done();
        }
        passes.solves(&Sweep(rule));
        passes.give_back(descent.vectors());
        passes.give_back(rebounds);
        passes.give_back([problem.bias, problem.mass]);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}

/// One of the two projections.
fn solve(
    passes: &mut Passes<'_>,
    problem: &ImpulseProblem,
    descent: &mut SpectralDescent,
    inner: usize,
    axes: Axes,
    project: impl Fn(PointEntry, Wide) -> PointEntry + Copy,
) {
    let count = passes.with_system(Phase::Solve, |system| {
        descent.begin(system, problem, axes, project);
        let mut count = 0;
        while count < inner {
            count += 1;
            if !descent.advance(system, problem, project) {
                break;
            }
        }
        descent.end(system);
        count
    });
    (0..count).for_each(|_| passes.count_sweep(1));
}

/// Projection on λn ≥ 0. A negative µ marks entries that are not contacts; they stay unchanged.
fn pushing([normal, tangent]: PointEntry, friction: Wide) -> PointEntry {
    [(-friction).select_positive(normal, Lanes::max(normal, Wide::zero())), tangent]
}

/// Projection on |λt| ≤ µ λn.
fn within_friction([normal, tangent]: PointEntry, friction: Wide) -> PointEntry {
    let bound = friction * normal;
    [normal, (-friction).select_positive(tangent, Lanes::max(Lanes::min(tangent, bound), -bound))]
}
