//! Sequential impulses: Gauss–Seidel on velocities, one contact row after the other.
//! Each row applies the impulse that makes its own velocity right; sweeping over all
//! rows again and again makes all of them right.
//!
//! **Source.** `catto2005` (projected Gauss–Seidel on J M⁻¹ Jᵀ λ = b, warm starting),
//! `catto2006` (impulses applied at once, accumulated clamping), `baumgarte1972`, and
//! `article`, whose factor 0.3 this uses.
//!
//! **Departures.** A slop is left uncorrected, so that resting contacts stay contacts;
//! points that do not touch yet may close their gap but no more (speculative contacts);
//! the push is capped. The article has none of the three. Restitution is a pass at the
//! end of the step instead of a term of b.
//!
//! **Cost.** Per substep 2 body passes, 1 warm start and `velocity_iterations` sweeps.
//!
//! **Fails when** a heavy body rests on a light one (the error shrinks by R/(1+R) per
//! sweep for the mass ratio R) and in tall stacks (by cos²(π/2N) for N bodies): overlap
//! grows faster than the few sweeps of a frame remove it. Baumgarte's push also adds
//! energy when deep overlap resolves.
//!
//! # The method
//!
//! A contact row with Jacobian J wants J v + b ≥ 0, λ ≥ 0, and one of the two zero. With
//! every other impulse fixed, λ alone changes its velocity by k = J M⁻¹ Jᵀ, so the
//! impulse that gives J v + b = 0 is Δλ = −(J v + b)/k. What must not become negative
//! is the *accumulated* impulse, not the increment:
//!
//! ```text
//! λ ← max(0, λ − (J v + b)/k)
//! ```
//!
//! so that a later row's push can be taken back. Friction clamps its own accumulated
//! impulse to ±µλ. The accumulated impulses are kept, and the next step starts from them.

use super::Solver;
use crate::engine::clock::Phase;
use crate::engine::constraints::{KernelFeatures, NormalRule, Problem};
use crate::engine::lanes::Lanes;
use crate::engine::params::{BAUMGARTE, LINEAR_SLOP, MAX_PUSH_SPEED};

/// See the [module](self).
pub struct Pgs;

impl Solver for Pgs {
    fn step<L: Lanes, N: KernelFeatures>(problem: &mut Problem<'_, L, N>) {
        let budget = problem.budget();
        let rule = BaumgarteRule { inv_h: 1.0 / problem.h() };
        for substep in 0..budget.substeps {
            problem.integrate_velocities();
            problem.warm_start();
            for _ in 0..budget.velocity_iterations {
                problem.sweep(Phase::Solve, rule);
            }
            problem.integrate_positions();
            problem.end_substep(substep);
        }
    }
}

/// λ ← max(0, λ − m_eff (v_n + b)) with the bias velocity
///
/// ```text
/// b = s/h                           s > 0   close the gap, no more
/// b = max(β (s + slop)/h, −v_max)   s < −slop
/// b = 0                             between
/// ```
#[derive(Clone, Copy)]
struct BaumgarteRule {
    inv_h: f32,
}

impl NormalRule for BaumgarteRule {
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, _stiff: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let gap = separation.max(L::zero()) * L::splat(self.inv_h);
        let overlap = (separation + L::splat(LINEAR_SLOP)).min(L::zero());
        let push = (overlap * L::splat(BAUMGARTE * self.inv_h)).max(L::splat(-MAX_PUSH_SPEED));
        [mass.neg_mul_add(gap + push, old), mass]
    }
}
