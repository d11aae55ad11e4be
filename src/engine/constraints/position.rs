//! The position sweep: overlap is removed by moving bodies, velocities are left alone.
//!
//! Every overlapping point is pushed apart by the impulse-like p = −C m_eff, which moves bodies as
//! an impulse changes velocities, Δx = m⁻¹ p n and Δθ = I⁻¹ (r × n) p, with
//!
//! ```text
//! C = max(β (s + slop), −C_max)   where s < −slop,   0 elsewhere
//! ```
//!
//! (`catto2024solver2d`, `solve_pgs_ngs`). Positions are updated at once and the next point sees
//! them: nonlinear Gauss–Seidel.
//!
//! # Anchors that turn
//!
//! With frozen arms the Jacobian is that of the start of the step. With turned ones it follows the
//! body: an anchor r = −(r × t) n + (r × n) t that has turned by Δθ has
//!
//! ```text
//! R r × n = cos Δθ (r × n) + sin Δθ (r × t)
//! ```
//!
//! because R n = cos Δθ n − sin Δθ t and R t = cos Δθ t + sin Δθ n; n itself stays. So the two
//! arms in the record are enough, and 1/m_eff = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (R r_a × n)² + I_b⁻¹ (R r_b × n)².

use super::features::KernelFeatures;
use super::pass::{Pass, PassInput};
use super::sweep;
use crate::engine::lanes::Lanes;

/// One sweep; see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionSweep {
    /// β: share of the overlap that a sweep removes (1).
    pub fraction: f32,
    /// Overlap that is left alone (m).
    pub slop: f32,
    /// C_max (m): more would turn bodies further than a linearised contact can follow.
    pub max_correction: f32,
    /// Arms follow the bodies' turn within the step.
    pub turned: bool,
}

impl Pass for PositionSweep {
    fn run<L: Lanes, F: KernelFeatures>(&self, on: PassInput<'_>) {
        sweep::position_sweep::<L, F>(on.rows, on.batches, *self);
    }
}
