//! Jolt's schedule: sequential impulses with one friction row per contact, solved before its normal rows.
//! Overlap is removed by position sweeps.
//!
//! **Source.** `rouwe2026jolt`: `PhysicsSettings.h` (10 velocity iterations, 2 position iterations, Baumgarte
//! 0.2, slop 2 cm, look-ahead 2 cm, rebounds above 1 m/s), `ContactConstraintManager.cpp` (rows and their
//! order). The friction row per contact is that of commit 0f58921e (pull request 2039), which came after version 5.5;
//! up to 5.5 each point has friction rows of its own.
//!
//! **Departures.** Impulses are matched by feature id from step to step; the source looks for a point within
//! 1 cm. Friction is stored in equal parts on the points of a contact, so its arm in the warm start moves
//! when points appear or disappear. Contacts and joints are swept in the order of this crate, color by color;
//! the source sweeps all joints first. Manifolds of bodies that hardly move are recomputed; the source reuses
//! them. Sleeping is left out.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 2 body passes, 1 warm start, `velocity_iterations` velocity sweeps and `position_iterations` position
//! sweeps.
//!
//! **Fails when** stacks are tall, or heavy bodies rest on light ones: ten sweeps carry a load up ten
//! contacts. A slop of 2 cm is visible in small scenes.
//!
//! # The friction row
//!
//! The row acts at the mean of the points, r. Its bound is the sum over all points, with the normal impulses
//! of the previous iteration:
//!
//! ```text
//! 1/m = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (r_a × t)² + I_b⁻¹ (r_b × t)²,   λ ← clamp(λ − m v_t, ±µ Σ λn)
//! ```

mod sweep;

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Rigid;
use crate::constraints::kernels::velocity::sweep::Sweep;
use crate::constraints::{Passes, PositionSweep, Schedule};
use crate::params::{Budget, Parameter};
use sweep::ContactFriction;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "jolt",
    source: "rouwe2026jolt",
    summary: "sequential impulses, one friction row a contact, before its normal rows; position sweeps",
    budget: Budget { substeps: 1, velocity_iterations: 10, relax_iterations: 0, position_iterations: 2 },
    uses: Uses { velocity: true, relax: false, position: true },
    parameters: &[
        Parameter::CORRECTION,
        Parameter {
            name: "slop",
            unit: "m",
            default: 0.02,
            range: [0.0, 1.0],
            meaning: "overlap that is left alone",
            trials: &[0.005, 0.02],
        },
    ],
    exceptions: &[
        (Guarantee::Cone, "a point may take its share of the whole contact's load"),
        (Guarantee::Converges, "one friction row a contact, which is another law"),
        (Guarantee::Rest, "10 sweeps are too few for tall stacks and large mass ratios"),
    ],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

/// Largest overlap that a position sweep takes into account (m).
const DEEPEST: f32 = 0.2;

fn step(passes: &mut Passes<'_>) {
    let (budget, rigid) = (passes.budget(), Rigid::new(passes.h()));
    let [fraction, slop] = [0, 1].map(|i| passes.parameter(i));
    let max_correction = [passes.length_unit(), 1.0].map(|unit| fraction * DEEPEST * unit);
    let positions = PositionSweep { fraction, slop, max_correction, turned: true };
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep_by(Phase::Solve, &mut ContactFriction(rigid), &Sweep(rigid));
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.position_iterations {
            passes.position_sweep(positions);
        }
        passes.end_substep(substep);
    }
}
