//! Augmented vertex block descent: each body in turn goes where its inertia and the penalties of its
//! contacts are in balance; multipliers and penalties grow until contacts hold.
//!
//! **Source.** `giles2025`, algorithm 1, with the contact rows of its two-dimensional demonstration.
//!
//! **Departures.** Bodies begin at their inertial place. Friction anchors are those of the start of
//! the step; what has crept before is not taken back. There is no geometric stiffness: rows are
//! linear in the motion of a step. The last iterations without a share of old error, which take overlap
//! out of positions after velocities are known, are `position_iterations`.
//!
//! **Cost.** Per substep 3 body passes, and `velocity_iterations` + `position_iterations` times a pass over
//! bodies with their contacts, each seen from both sides, and one over contacts. Body after body,
//! not in lanes.
//!
//! **Fails when** iterations are few for the height of a stack: a penalty needs them to grow, and
//! descent carries a change by one body per iteration. In `f32` a body is lost where penalties exceed
//! its inertia M/h² by more than seven digits.
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
use crate::engine::constraints::descent::Blocks;
use crate::engine::constraints::kept::KeptSize;
use crate::engine::constraints::{Passes, dense};
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
    kept: KeptSize { per_point: 4, per_body: 6 },
    breaks: &[
        (Law::Momentum, "bodies are moved one at a time and meet only in the limit"),
        (Law::Converges, "the law that it solves is one of positions"),
    ],
    step,
};

/// Least and greatest penalty (N/m).
const PENALTY: [f32; 2] = [1.0, 1e9];

/// Kept per point: λn, λt (N), kn, kt (N/m).
const NORMAL: usize = 0;
const TANGENT: usize = 1;
const NORMAL_PENALTY: usize = 2;
const TANGENT_PENALTY: usize = 3;

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [alpha, beta, gamma] = [0, 1, 2].map(|i| passes.parameter(i));
    passes.build_graph();
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        let motion = passes.motion_after_velocities();
        passes.with_blocks(Phase::Solve, |blocks| begin(blocks, motion, alpha * gamma, gamma));
        for _ in 0..budget.velocity_iterations {
            passes.with_blocks(Phase::Solve, |blocks| {
                descend(blocks, h, alpha);
                raise(blocks, alpha, beta);
            });
            passes.count_sweep(2);
            passes.iteration_done();
        }
        passes.with_blocks(Phase::Solve, |blocks| velocities(blocks, h));
        for _ in 0..budget.position_iterations {
            passes.with_blocks(Phase::Position, |blocks| descend(blocks, h, 0.0));
            passes.count_sweep(2);
        }
        passes.keep_impulses(Phase::Solve, |kept| [h * kept[NORMAL], h * kept[TANGENT]]);
        passes.hide_turns();
        passes.end_substep(substep);
    }
}

/// Kept per body: where inertia takes it, then where the substep began, both since the step began.
fn place(blocks: &mut Blocks<'_>, body: usize, which: usize) -> [f32; 3] {
    let kept = &blocks.kept.body(body)[3 * which..];
    [kept[0], kept[1], kept[2]]
}

/// Bodies go to their inertial place; multipliers and penalties begin with a share of what they were.
fn begin(blocks: &mut Blocks<'_>, h: f32, keep: f32, keep_penalty: f32) {
    for body in 0..blocks.rows.len() - 1 {
        let start = blocks.moved(body as u32);
        let row = &mut blocks.rows[body];
        let goal = [0, 1, 2].map(|k| h.mul_add(row.velocity[k], row.delta[k]));
        row.delta[..3].copy_from_slice(&goal);
        let kept = blocks.kept.body(body);
        kept[..3].copy_from_slice(&goal);
        kept[3..].copy_from_slice(&start);
    }
    for contact in 0..blocks.contacts.len() {
        for p in 0..2 {
            let kept = blocks.kept.point(contact, p);
            kept[NORMAL] *= keep;
            kept[TANGENT] *= keep;
            for k in [NORMAL_PENALTY, TANGENT_PENALTY] {
                kept[k] = (kept[k] * keep_penalty).clamp(PENALTY[0], PENALTY[1]);
            }
        }
    }
}

/// Errors and forces of a point's two rows.
struct Rows {
    jacobian: [[[f32; 3]; 2]; 2],
    error: [f32; 2],
    force: [f32; 2],
    bound: f32,
}

fn rows(blocks: &mut Blocks<'_>, contact: usize, p: usize, alpha: f32) -> Rows {
    let row = blocks.row(contact, p);
    let c = &blocks.contacts[contact];
    let (bodies, separation, friction) = ([c.body_a, c.body_b], c.manifold.points[p].separation, c.friction);
    let jacobian = [row.on_a, row.on_b];
    // C₀ is that of the start of the substep.
    let (mut error, mut first) = ([separation, 0.0], [separation, 0.0]);
    for (side, body) in bodies.into_iter().enumerate() {
        let now = blocks.moved(body);
        let then =
            if (body as usize) < blocks.rows.len() - 1 { place(blocks, body as usize, 1) } else { now };
        for axis in 0..2 {
            for k in 0..3 {
                error[axis] += jacobian[side][axis][k] * now[k];
                first[axis] += jacobian[side][axis][k] * then[k];
            }
        }
    }
    // Friction holds against the start of the substep.
    error = [error[0] - alpha * first[0].min(0.0), error[1] - first[1]];
    let kept = blocks.kept.point(contact, p);
    let normal = (kept[NORMAL] - kept[NORMAL_PENALTY] * error[0]).max(0.0);
    let bound = if blocks.friction { friction * normal } else { 0.0 };
    let tangent = (kept[TANGENT] - kept[TANGENT_PENALTY] * error[1]).max(-bound).min(bound);
    Rows { jacobian, error, force: [normal, tangent], bound }
}

/// One body after the other.
fn descend(blocks: &mut Blocks<'_>, h: f32, alpha: f32) {
    for body in 0..blocks.rows.len() - 1 {
        let [inv_mass, inv_inertia] = blocks.inverse_masses(body);
        if inv_mass <= 0.0 {
            continue;
        }
        let (x, y) = (blocks.moved(body as u32), place(blocks, body, 0));
        // What does not turn has no row for it.
        let inertia = if inv_inertia > 0.0 { 1.0 / inv_inertia } else { 0.0 };
        let masses = [1.0 / inv_mass, 1.0 / inv_mass, inertia].map(|m| f64::from(m) / f64::from(h * h));
        let mut matrix = [0.0_f64; 9];
        let mut right = [0.0_f64; 3];
        for k in 0..3 {
            matrix[4 * k] = masses[k];
            right[k] = -masses[k] * f64::from(x[k] - y[k]);
        }
        if inv_inertia <= 0.0 {
            matrix[8] = 1.0;
        }
        let edges = blocks.graph.edges_of(body);
        for &contact in edges {
            let side = usize::from(blocks.graph.ends(contact as usize)[1] as usize == body);
            let has_friction = blocks.friction && blocks.contacts[contact as usize].friction > 0.0;
            for p in 0..blocks.contacts[contact as usize].manifold.count as usize {
                let rows = rows(blocks, contact as usize, p, alpha);
                let kept = blocks.kept.point(contact as usize, p);
                let penalties = [kept[NORMAL_PENALTY], kept[TANGENT_PENALTY]];
                // A row at its bound keeps its stiffness: without it a body would go past where the row
                // takes hold again, and back, for ever.
                for (axis, penalty) in
                    penalties.into_iter().enumerate().take(if has_friction { 2 } else { 1 })
                {
                    let mut jacobian = rows.jacobian[side][axis].map(f64::from);
                    if inv_inertia <= 0.0 {
                        jacobian[2] = 0.0;
                    }
                    let (force, penalty) = (f64::from(rows.force[axis]), f64::from(penalty));
                    for i in 0..3 {
                        right[i] += jacobian[i] * force;
                        for j in 0..3 {
                            matrix[3 * i + j] += penalty * jacobian[i] * jacobian[j];
                        }
                    }
                }
            }
        }
        if dense::solve(&mut matrix, &mut right, 0.0) {
            let row = &mut blocks.rows[body];
            row.delta.iter_mut().zip(right).for_each(|(delta, change)| *delta += change as f32);
        }
    }
}

/// Multipliers take the forces over; penalties of rows within their bounds grow.
fn raise(blocks: &mut Blocks<'_>, alpha: f32, beta: f32) {
    for contact in 0..blocks.contacts.len() {
        for p in 0..blocks.contacts[contact].manifold.count as usize {
            let Rows { error, force: [normal, tangent], bound, .. } = rows(blocks, contact, p, alpha);
            let kept = blocks.kept.point(contact, p);
            (kept[NORMAL], kept[TANGENT]) = (normal, tangent);
            let grown = |k: f32, error: f32| beta.mul_add(error.abs(), k).min(PENALTY[1]);
            if normal > 0.0 {
                kept[NORMAL_PENALTY] = grown(kept[NORMAL_PENALTY], error[0]);
            }
            if tangent.abs() < bound {
                kept[TANGENT_PENALTY] = grown(kept[TANGENT_PENALTY], error[1]);
            }
        }
    }
}

/// v ← v + (x − y)/h, which is (x − x_begin)/h.
fn velocities(blocks: &mut Blocks<'_>, h: f32) {
    for body in 0..blocks.rows.len() - 1 {
        if blocks.inverse_masses(body)[0] <= 0.0 {
            continue;
        }
        let (now, goal) = (blocks.moved(body as u32), place(blocks, body, 0));
        for k in 0..3 {
            blocks.rows[body].velocity[k] += (now[k] - goal[k]) / h;
        }
    }
}
