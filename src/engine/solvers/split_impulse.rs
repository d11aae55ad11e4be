//! Split impulses: overlap is removed by pseudo-velocities of its own, which move bodies once and are
//! forgotten, so that it never becomes momentum.
//!
//! **Source.** `guendelman2003`, section 5 (velocities for contact apart from those for positions), in
//! the form of `coumans2015` (a second set of impulses without warm start).
//!
//! **Departures.** Overlap is removed without a slop: what adds no energy need not spare any.
//!
//! **Cost.** Per substep 3 body passes, 1 warm start, `velocity_iterations` rigid sweeps and
//! `position_iterations` sweeps without friction for pseudo-velocities; impulses and velocities are
//! put aside and brought back, 4 passes over vectors, in lanes. Sweeps of a step request 2581 B per contact.
//!
//! **Fails when** [`super::pgs`] does, except that it does not throw overlapping bodies apart: what the
//! velocity sweeps leave over is kept as velocity, and pseudo-velocities start cold in each step.

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::Passes;
use crate::engine::constraints::kept::KeptSize;
use crate::engine::constraints::rules::{Rigid, Soft};
use crate::engine::params::{Budget, MAX_PUSH_SPEED, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "split_impulse",
    source: "coumans2015",
    summary: "sequential impulses; overlap by pseudo-velocities that are forgotten",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 4 },
    uses: Uses { velocity: true, relax: false, position: true },
    iterations: |k| Budget { velocity_iterations: k, ..SOLVER.budget },
    parameters: &[Parameter {
        meaning: "share of the overlap that pseudo-velocities remove per step",
        ..Parameter::CORRECTION
    }],
    softness: None,
    by_levels: false,
    piles: false,
    turning_frames: false,
    kept: KeptSize { per_point: 0, per_body: 0 },
    breaks: &[(Law::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    step,
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let rigid = Rigid::rule(h);
    let push = Soft::baumgarte(passes.parameter(0), MAX_PUSH_SPEED, h).frictionless();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rigid);
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.with_pseudo_velocities(Phase::Position, |passes| {
            for _ in 0..budget.position_iterations {
                passes.push_sweep(Phase::Position, &push);
            }
        });
        passes.end_substep(substep);
    }
}
