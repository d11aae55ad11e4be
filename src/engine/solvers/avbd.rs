//! Augmented vertex block descent: each body in turn goes where its inertia and the penalties of its
//! contacts are in balance; multipliers and penalties grow until contacts hold.
//!
//! **Source.** `giles2025`, algorithm 1, with the contact rows of its two-dimensional demonstration.
//!
//! **Departures.** Bodies go colour by colour; in natural order one by one, as the contacts name them. They begin
//! at their inertial place. Friction anchors are those of the start of the step; what has crept before is not
//! taken back. There is no geometric stiffness: rows are linear in the motion of a step. The last iterations without a
//! share of old error, which take overlap out of positions after velocities are known, are `position_iterations`.
//! There are rows of contacts alone: constraints of other types do nothing.
//!
//! **Cost.** Per substep 3 body passes, and `velocity_iterations` + `position_iterations` times a pass over
//! bodies with their contacts, each seen from both sides, and one over contacts, in lanes over the bodies of
//! a colour ([`crate::engine::constraints::descent`]). Sweeps of a step request 6874 B per contact.
//!
//! **Fails when** iterations are few for the height of a stack: a penalty needs them to grow, and
//! descent carries a change by one body per iteration. In `f32` a body is lost where penalties exceed
//! its inertia M/h² by more than seven digits. From zero, orders hardly matter: penalties begin at 1 N/m, M/h² of a
//! unit box is 3600 N/m at 60 Hz, and while they are that soft a body does not feel in one iteration what its
//! neighbours do in the same. Cold curves of all orders on the frozen pyramid of five differ by 2·10⁻⁵ after 100
//! iterations and by 6·10⁻⁴ at most.
//!
//! # The method
//!
//! With y = x + h v + h² a, each body minimises |x − y|²_M/(2h²) + the energy of its rows:
//!
//! ```text
//! (M/h² + Σ k JᵀJ) Δx = −M (x − y)/h² + Σ Jᵀ f,   f = λ − k C within its bounds
//! ```
//!
//! where C = (1 − α) C₀ + J (x − x₀): the share α of what was wrong at the start is left alone. Bounds:
//! f ≥ 0 along n, |f| ≤ µ f_n along t. Then λ ← f and, where f is within its bounds, k ← k + β |C|.
//! From step to step λ keeps the share α γ and k the share γ.

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::Passes;
use crate::engine::constraints::descent::{NORMAL, PER_POINT, TANGENT};
use crate::engine::constraints::kept::KeptSize;
use crate::engine::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "avbd",
    source: "giles2025",
    summary: "descent body by body on penalties that grow, with multipliers",
    budget: Budget { substeps: 1, velocity_iterations: 10, relax_iterations: 0, position_iterations: 1 },
    uses: Uses { velocity: true, relax: false, position: true },
    iterations: |k| Budget { velocity_iterations: k, ..SOLVER.budget },
    parameters: &[
        Parameter {
            name: "alpha",
            unit: "",
            default: 0.99,
            range: [0.0, 1.0],
            meaning: "share of old error that is left alone in a step",
            trials: &[],
        },
        Parameter {
            name: "beta",
            unit: "N/m²",
            default: 1e5,
            range: [0.0, 1e9],
            meaning: "growth of penalties by error",
            trials: &[],
        },
        Parameter {
            name: "gamma",
            unit: "",
            default: 0.99,
            range: [0.0, 1.0],
            meaning: "share of penalties and multipliers that a step begins with",
            trials: &[],
        },
    ],
    softness: None,
    by_levels: false,
    piles: false,
    turning_frames: false,
    kept: KeptSize { per_point: PER_POINT, per_body: 0 },
    breaks: &[
        (Law::Momentum, "bodies are moved one at a time and meet only in the limit"),
        (Law::Converges, "the law that it solves is one of positions"),
        (Law::Rest, "pyramid:4 creeps at 9.6 mm/s: friction holds places of the substep's start alone"),
    ],
    step,
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [alpha, beta, gamma] = [0, 1, 2].map(|i| passes.parameter(i));
    passes.assign_descent();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.begin_descent(alpha * gamma, gamma);
        for _ in 0..budget.velocity_iterations {
            passes.descend(Phase::Solve, alpha);
            passes.raise_penalties(Phase::Solve, alpha, beta);
            passes.iteration_done();
        }
        passes.velocities_of_descent();
        for _ in 0..budget.position_iterations {
            passes.descend(Phase::Position, 0.0);
        }
        passes.keep_impulses(Phase::Solve, |kept| [h * kept[NORMAL], h * kept[TANGENT]]);
        passes.hide_turns();
        passes.end_substep(substep);
    }
}
