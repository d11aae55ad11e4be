//! Split impulses: overlap is removed by separate pseudo-velocities. They move the bodies once and are then
//! discarded, so the correction never becomes momentum.
//!
//! **Source.** `guendelman2003`, section 5 (separate velocities for contacts and for positions), in the form
//! of `coumans2015` (a second set of impulses without warm starting).
//!
//! **Departures.** Overlap is removed completely, without a slop: the correction adds no energy, so nothing
//! is gained by leaving some overlap.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 3 body passes, 1 warm start, `velocity_iterations` rigid sweeps and
//! `position_iterations` sweeps without friction for pseudo-velocities; impulses and velocities are
//! put aside and brought back, 4 passes over vectors, in lanes.
//!
//! **Fails when** [`super::pgs`] does, except that it does not throw overlapping bodies apart. The residual
//! of the velocity sweeps stays in the velocities, and pseudo-velocities start at zero in each step.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Rigid, Soft};
use crate::constraints::{Passes, Solver};
use crate::lanes::BodyRow;
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "split_impulse",
    source: "coumans2015",
    summary: "sequential impulses; overlap removed by temporary pseudo-velocities",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 4 },
    uses: Uses { velocity: true, relax: false, position: true },
    parameters: &[Parameter {
        meaning: "share of the overlap that pseudo-velocities remove per step",
        ..Parameter::CORRECTION
    }],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Apart,
    make: Variant::made_by(|| Box::new(SplitImpulse::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct SplitImpulse {
    /// Rows before the pseudo-velocities move the bodies.
    before: Vec<BodyRow>,
}

impl Solver for SplitImpulse {
    fn step(&mut self, passes: &mut Passes<'_>) {
        step(passes, &mut self.before);
    }
}

fn step(passes: &mut Passes<'_>, before: &mut Vec<BodyRow>) {
    let (budget, h) = (passes.budget(), passes.h());
    let rigid = Rigid::rule(h);
    let push = Soft::baumgarte(passes.parameter(0), passes.push_speed(), h).frictionless();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rigid);
            passes.iteration_done();
        }
        passes.integrate_positions();
        with_pseudo_velocities(passes, before, |passes| {
            for _ in 0..budget.position_iterations {
                passes.push_sweep(Phase::Position, &push);
            }
        });
        passes.end_substep(substep);
    }
}

/// Saves velocities and impulses, lets `solve` find a second set that starts at zero, moves the bodies with
/// it for one substep, and restores the saved ones.
fn with_pseudo_velocities(
    passes: &mut Passes<'_>,
    before: &mut Vec<BodyRow>,
    solve: impl FnOnce(&mut Passes<'_>),
) {
    let (mut impulses, mut zero) = (passes.vector(), passes.vector());
    let mut system = passes.system();
    system.lane_impulses(&mut impulses);
    system.set_lane_impulses(&mut zero);
    let rows = &mut passes.parts().work.rows;
    before.clone_from(rows);
    rows.iter_mut().for_each(|row| row.velocity[..3].fill(0.0));
    solve(passes);
    passes.over_bodies(Phase::Position, |rows, motion, workers| {
        motion.advance(rows, workers);
        for (row, before) in rows.iter_mut().zip(before.iter()) {
            row.velocity = before.velocity;
        }
    });
    passes.with_system(Phase::Position, |system| system.set_lane_impulses(&mut impulses));
    passes.give_back([impulses, zero]);
}
