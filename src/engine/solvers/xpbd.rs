//! Position-based dynamics: bodies move first, contacts displace them, and velocities are what
//! the displacements made of them.
//!
//! **Source.** `muller2020`; `macklin2016` (compliance, zero by default); `catto2024solver2d`, `solve_xpbd`.
//!
//! **Departures.** Velocities are corrected by (x − x_before contacts)/h, which is (x − x₀)/h in exact
//! arithmetic, so that contacts without overlap change no bit. Friction holds places of the start of the
//! step (`catto2024solver2d`), not of the substep. Bounces are this crate's pass at the end of the step.
//!
//! **Cost.** Per substep 4 body passes, `position_iterations` displacing sweeps, which gather bodies
//! twice, and 1 velocity sweep. Sweeps of a step request 1873 B per contact.
//!
//! **Fails when** stacks are tall or loads heavy: there is no warm start, so each substep begins
//! cold, and what a sweep leaves over sinks in. Overlap deeper than the limit is pushed apart at
//! the limit's speed, and that speed stays. With compliance a load sinks in by α times its weight only
//! while that is less than the limit's speed times h.

use super::{Law, Uses, Variant};
use crate::engine::constraints::Passes;
use crate::engine::constraints::kept::KeptSize;
use crate::engine::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "xpbd",
    source: "muller2020",
    summary: "substeps of displacements; velocities follow positions",
    budget: Budget { substeps: 4, velocity_iterations: 0, relax_iterations: 0, position_iterations: 1 },
    uses: Uses { velocity: false, relax: false, position: true },
    iterations: |k| Budget { substeps: 1, position_iterations: k, ..SOLVER.budget },
    parameters: &[
        Parameter::push_speed(4.0),
        Parameter {
            name: "compliance",
            unit: "m/N",
            default: 0.0,
            range: [0.0, 1.0],
            meaning: "how far a contact point gives way to a force; 0 is rigid",
            trials: &[],
        },
    ],
    softness: None,
    by_levels: false,
    piles: false,
    turning_frames: false,
    kept: KeptSize { per_point: 0, per_body: 0 },
    breaks: &[
        (Law::Cone, "friction of positions and of velocities have a cone each"),
        (Law::Momentum, "corrections of velocities are in no impulse that it reports"),
        (Law::Converges, "the law that it solves is one of positions"),
        (Law::Rest, "no warm start"),
    ],
    step,
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let [push_speed, compliance] = [0, 1].map(|i| passes.parameter(i));
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.integrate_positions();
        passes.begin_displacing();
        for k in 0..budget.position_iterations {
            passes.displacing_sweep(push_speed, compliance, k == 0);
            passes.iteration_done();
        }
        passes.velocities_from_displacements();
        passes.displaced_velocity_sweep();
        passes.end_substep(substep);
    }
}
