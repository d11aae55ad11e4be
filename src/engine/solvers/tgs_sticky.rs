//! Substeps in which friction holds points at a place: what creeps is brought back.
//!
//! **Source.** `catto2024solver2d`, `solve_tgs_sticky`.
//!
//! **Departures.** A point keeps how far it has drifted, not two anchors. It sticks anew in the sweep in
//! which it slides; the source's waits for the next step. A cone is that of the mean normal
//! impulse of the points that are there; the source takes half of the sum, also where there is one.
//!
//! **Cost.** Per substep 2 body passes and `velocity_iterations` sticky sweeps; per step
//! `relax_iterations` sticky sweeps without push, 1 pass that brings drifts into the order of the lanes and 1 that
//! books them. Sweeps of a step request 1292 B per contact.
//!
//! **Fails when** stacks are tall: without a warm start each step begins cold, and 0.8 of an
//! overlap per substep is pushed out as velocity.

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::Passes;
use crate::engine::constraints::kept::KeptSize;
use crate::engine::params::{Budget, LINEAR_SLOP, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "tgs_sticky",
    source: "catto2024solver2d",
    summary: "substeps; friction holds places instead of velocities; no warm start",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 2, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..SOLVER.budget },
    parameters: &[
        Parameter {
            name: "baumgarte",
            unit: "",
            default: 0.8,
            range: [0.0, 1.0],
            meaning: "share of the overlap that is removed per substep",
            trials: &[],
        },
        Parameter {
            name: "stick",
            unit: "",
            default: 0.5,
            range: [0.0, 1.0],
            meaning: "share of a drift that is taken back per substep",
            trials: &[],
        },
        Parameter::push_speed(4.0),
    ],
    softness: None,
    by_levels: false,
    piles: false,
    turning_frames: false,
    kept: KeptSize { per_point: 1, per_body: 0 },
    breaks: &[
        (Law::Cone, "a point may take its share of the whole manifold's load"),
        (Law::Converges, "friction solves for places, which is another law"),
        (Law::Rest, "no warm start"),
    ],
    step,
};

/// Points that are farther apart (m) do not stick.
const REACH: f32 = 2.0 * LINEAR_SLOP;

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let [fraction, stick, push_speed] = [0, 1, 2].map(|i| passes.parameter(i));
    passes.forget_impulses();
    passes.load_drift();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        for _ in 0..budget.velocity_iterations {
            passes.sticky_sweep(Phase::Solve, fraction, push_speed, stick, REACH);
            passes.iteration_done();
        }
        passes.integrate_positions();
        if substep + 1 == budget.substeps {
            for _ in 0..budget.relax_iterations {
                passes.sticky_sweep(Phase::Relax, 0.0, push_speed, 0.0, REACH);
            }
        }
        passes.bounce(substep);
    }
    // Impulses add up over the whole step, as nothing is applied twice.
    passes.book_impulses();
    passes.book_drift(REACH);
}
