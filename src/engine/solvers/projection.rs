//! Projection: move overlapping bodies apart, then remove the velocity with which they
//! approach. This is the founding article's ground constraint
//! (`pos += penetration; velocity = 0`), extended to contacts between bodies.
//!
//! **Source.** `article`, section "Constraints".
//!
//! **Departures.** The push is shared between two bodies by their masses and inertias,
//! λ = −s/k; the velocity is only projected along the normal and only while approaching.
//!
//! **Cost.** Per substep 2 body passes, `position_iterations` position sweeps and
//! `velocity_iterations` velocity sweeps.
//!
//! **Fails when** anything should slide, roll or lean: there is no friction. There is no
//! memory either, so every step starts cold and tall stacks sink and spread.

use super::Solver;
use crate::engine::clock::Phase;
use crate::engine::constraints::{KernelFeatures, NormalRule, Problem};
use crate::engine::lanes::Lanes;
use crate::engine::params::LINEAR_SLOP;

/// See the [module](self).
pub struct Projection;

impl Solver for Projection {
    fn step<L: Lanes, N: KernelFeatures>(problem: &mut Problem<'_, L, N>) {
        let budget = problem.budget();
        for substep in 0..budget.substeps {
            problem.forget_impulses();
            problem.integrate_velocities();
            problem.integrate_positions();
            for _ in 0..budget.position_iterations {
                problem.position_sweep(1.0);
            }
            for _ in 0..budget.velocity_iterations {
                problem.sweep(Phase::Solve, ProjectionRule);
            }
            problem.end_substep(substep);
        }
    }
}

/// λ ← max(0, λ − m_eff v_n) at points that touch once positions are projected.
#[derive(Clone, Copy)]
struct ProjectionRule;

impl NormalRule for ProjectionRule {
    const FRICTION: bool = false;

    #[inline(always)]
    fn line<L: Lanes>(&self, _stiff: bool, separation: L, mass: L, old: L) -> [L; 2] {
        [old, (L::splat(LINEAR_SLOP) - separation).select_positive(mass, L::zero())]
    }
}
