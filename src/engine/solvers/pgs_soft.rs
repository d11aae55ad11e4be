//! Sequential impulses on soft contacts; after the positions are integrated, relaxing sweeps without the
//! springs.
//!
//! **Source.** `catto2024solver2d`, `solve_pgs_soft`; the rows are those of [`super::soft_step`].
//!
//! **Departures.** None in the schedule. Contacts with static and kinematic bodies are twice as stiff,
//! as in the source.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start, `velocity_iterations` soft sweeps and, after
//! the positions, `relax_iterations` rigid ones.
//!
//! **Fails when** stacks are tall: the sweeps of one step do not carry a load through them. At a third of the
//! step rate, a spring is only as stiff as 20 Hz.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Rigid, Soft, angular_frequencies};
use crate::constraints::{ImpactLaw, Passes, Schedule};
use crate::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION_OF_STEP, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "pgs_soft",
    source: "catto2024solver2d",
    summary: "sequential impulses on soft contacts, then relaxing sweeps, without substeps",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 2, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[Parameter::CONTACT_HERTZ_OF_STEP, Parameter::push_speed(2.0)],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION_OF_STEP, h)),
    exceptions: &[(Guarantee::Rest, "6 sweeps without substeps are too few for stacks")],
    impacts: ImpactLaw::BOX2D,
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, push_speed] = [0, 1].map(|i| passes.parameter(i));
    let soft = Soft::rule(
        angular_frequencies(hertz, CONTACT_HERTZ_FRACTION_OF_STEP, h),
        CONTACT_DAMPING_RATIO,
        push_speed,
        h,
    );
    let rigid = Rigid::rule(h);
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &soft);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.relax_iterations {
            passes.sweep(Phase::Relax, &rigid);
        }
        passes.end_substep(substep);
    }
}
