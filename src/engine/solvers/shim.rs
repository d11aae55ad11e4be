//! Soft contacts that do not sag: each contact is shimmed by what its springs give way under the load it
//! bears, so that they are stiff enough to move with and rigid to stand on.
//!
//! **Source.** `papers/shim.md` (*derived*), on the schedule of `catto2024solver2d`.
//!
//! **Departures.** Other than in [`super::soft_step`], springs are as stiff as the substep rate allows, a
//! fixed part of it; each contact has a preload that follows its load
//! ([`crate::engine::constraints::Passes::preload`]), as fast as the slowest mode of the pile allows; contacts at
//! rest begin with what statics says they bear, each point with the preload of its own load, and a column that would
//! buckle gets stiffer springs and the sweeps that these need (both [`crate::engine::constraints::piles`]); springs
//! bear a load however deep its contact is; what rolls or is carried has the frame of the middle of the step
//! ([`crate::engine::narrowphase::frames`]); the two normal rows of a contact are solved together, friction rows after them; where contacts have come or
//! gone, the first substep relaxes once more, since its impulses come from contacts as they were a step ago; what comes
//! in without restitution is stopped before the step ([`crate::engine::constraints::Passes::plastic_impacts`]); and
//! relaxing takes the angular momentum that pushing bodies apart has made from their spins
//! ([`crate::engine::constraints::Passes::parting_sweep`]).
//!
//! **Cost.** Per step 1 warm start, 1 pass that shortens springs and, if something moves, 1 pass that looks for
//! impacts; per substep 2 body passes, `velocity_iterations` soft block sweeps and `relax_iterations` rigid ones. In
//! steps in which contacts come or go 1 rigid sweep more, and at most every 32 steps, if they have, a search of the
//! contact graph. Sweeps of a step request 5736 B per contact.
//!
//! **Fails when** a column needs more than `column_sweeps`: 100 unit boxes stand for a minute, 150 do not. Where bodies
//! slide past each other, angular momentum is conserved to rounding only in impacts that are seen before the step: arms
//! are those of its beginning, which matters to impacts within it. And where impacts without restitution are many: only
//! 32 contacts at once are followed, and the sweeps of a substep spread what is left by two bodies each. A load that
//! goes or wanders to a new contact within a step is followed by one sweep more: what stood on it comes apart a little
//! (B23.release), and what bears hundreds of times its mass sinks (B23.rolling).

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::Passes;
use crate::engine::constraints::kept::KeptSize;
use crate::engine::constraints::rules::{Bearing, Rigid, Soft};
use crate::engine::params::{Budget, Parameter};
use std::f32::consts::TAU;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "shim",
    source: "shim",
    summary: "substeps, and soft contacts whose springs are preloaded until they do not sag",
    budget: Budget { substeps: 14, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..SOLVER.budget },
    parameters: &[
        Parameter {
            name: "stiffness",
            unit: "",
            default: 0.16,
            range: [1e-6, 0.2],
            meaning: "frequency of contacts, as a part of the substep rate",
            trials: &[],
        },
        Parameter::DAMPING_RATIO,
        Parameter::PUSH_SPEED,
        Parameter {
            name: "patience",
            unit: "",
            default: 4.0,
            range: [1e-3, 1e6],
            meaning: "time in which preload follows the load, over what the slowest mode of the pile needs",
            trials: &[],
        },
        Parameter {
            name: "preload",
            unit: "",
            default: 0.95,
            range: [0.0, 1.0],
            meaning: "part of its sag that a contact is preloaded by; 0 is none",
            trials: &[],
        },
        Parameter {
            name: "column_sweeps",
            unit: "",
            default: 64.0,
            range: [0.0, 1000.0],
            meaning: "most rigid sweeps per substep added for stiffer springs, where a column would buckle on these",
            trials: &[],
        },
    ],
    softness: None,
    by_levels: false,
    piles: true,
    turning_frames: true,
    kept: KeptSize { per_point: 0, per_body: 0 },
    breaks: &[(Law::Converges, "preload is part of its law, and comes from the steps before")],
    step,
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [stiffness, damping_ratio, push_speed, patience, share, most] =
        [0, 1, 2, 3, 4, 5].map(|i| passes.parameter(i));
    let (usual, piles) = (TAU * stiffness / h, passes.pile_modes());
    let added = added_sweeps(piles.critical_frequency / usual, budget, most);
    let sweeps = (budget.velocity_iterations + budget.relax_iterations).max(1) as f32;
    let omega = usual * (1.0 + added as f32 / sweeps).sqrt();
    let springs = Soft::new([omega, 2.0 * omega], damping_ratio, push_speed, h);
    let rigid = Rigid::new(h);
    let dt = passes.dt();
    let time = patience * piles.slowness / (2.0 * damping_ratio * omega);
    passes.plastic_impacts();
    passes.preload(springs, share, dt / (dt + time));
    for substep in 0..budget.substeps {
        if substep == 0 {
            passes.integrate_velocities();
            passes.warm_start();
        } else {
            passes.integrate_and_warm_start();
        }
        for _ in 0..budget.velocity_iterations {
            passes.block_sweep_normal_first(Phase::Solve, Bearing(springs));
            passes.iteration_done();
        }
        passes.integrate_positions();
        // Impulses of the step before meet contacts that came, or miss some that went: one sweep more.
        let settling = u32::from(substep == 0 && passes.contacts_changed());
        for _ in 0..budget.relax_iterations + added + settling {
            passes.parting_sweep(Phase::Relax, rigid, substep);
        }
        passes.end_substep(substep);
    }
}

/// Rigid sweeps per substep for springs `ratio` times as fast as the usual ones: (h ω)² < q, the number of sweeps
/// (`papers/shim.md`), which so has to grow with ω².
fn added_sweeps(ratio: f32, budget: Budget, most: f32) -> u32 {
    let sweeps = (budget.velocity_iterations + budget.relax_iterations) as f32;
    (sweeps * (ratio * ratio - 1.0)).ceil().clamp(0.0, most) as u32
}
