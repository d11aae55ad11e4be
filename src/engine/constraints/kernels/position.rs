//! The position sweep. It removes overlap by moving bodies and leaves velocities unchanged.
//!
//! Every overlapping point is pushed apart by the impulse-like p = −C m_eff. It moves bodies as an impulse
//! changes velocities, Δx = m⁻¹ p n and Δθ = I⁻¹ (r × n) p, with
//!
//! ```text
//! C = max(β (s + slop), −C_max)   where s < −slop,   0 elsewhere
//! ```
//!
//! (`catto2024solver2d`, `solve_pgs_ngs`). Positions are updated at once, and the next point uses them:
//! nonlinear Gauss–Seidel.
//!
//! # Anchors that turn
//!
//! With frozen arms the Jacobian is that of the start of the step. With turned arms it follows the body: an
//! anchor r = −(r × t) n + (r × n) t that has turned by Δθ has
//!
//! ```text
//! R r × n = cos Δθ (r × n) + sin Δθ (r × t)
//! ```
//!
//! because R n = cos Δθ n − sin Δθ t and R t = cos Δθ t + sin Δθ n; n itself is fixed. So the two arms in the
//! record suffice, and 1/m_eff = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (R r_a × n)² + I_b⁻¹ (R r_b × n)².

use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, INV_INERTIA, INV_MASS, TURN, arms, spin, to_frame, turn, with_arms,
};
use crate::constraints::kernels::pass::{Pass, PassInput, PassMode};
use crate::constraints::kernels::stages::{for_each_batch, over_colors};
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::lanes::{Lanes, SharedRows};

/// One sweep; see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositionSweep {
    /// β: fraction of the overlap that a sweep removes (1).
    pub fraction: f32,
    /// Overlap that is not corrected (m).
    pub slop: f32,
    /// C_max of overlaps (m) and of joint angles (rad). Larger corrections would turn bodies too far for a
    /// linearized contact.
    pub max_correction: [f32; 2],
    /// Whether arms turn with their bodies within the step.
    pub turned: bool,
}

impl Pass for PositionSweep {
    fn mode(&self) -> PassMode {
        PassMode::Position { max_correction: self.max_correction, impulses: false }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        position_sweep::<L, F>(SharedRows::among(on.rows, on.workers), on.batches, *self);
    }
}

/// One position sweep over a segment.
#[inline(always)]
fn position_segment<L: Lanes, N: KernelFeatures, O: Partner>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    sweep: PositionSweep,
) {
    let layout = const { Layout::of::<N, O>() };
    let pushes_a = of.segment.pushes_a();
    for_each_batch::<L, N, O, _>(&mut rows, of, |rows, record, row_a, row_b| {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather::<O, _>(rows, row_a, row_b);
        let n = [record[0], record[1]];
        let mass_sum = if O::HAS_ROW { a[INV_MASS] + b[INV_MASS] } else { b[INV_MASS] };
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let mut moved = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], n)[0];
        let mut angle = [a[TURN], b[TURN]];
        let mut sum = L::zero();
        for p in 0..N::POINTS {
            let mut arm_n = arms::<L, N, O>(record, &layout, p, 0);
            let arm_t = arms::<L, N, O>(record, &layout, p, 1);
            let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(angle[0]), turn(angle[1]));
            let mut separation = record[layout.at(p, layout.separation)] + moved;
            separation = with_arms::<L, N, O>(separation, [sine_a, sine_b], arm_n);
            separation = with_arms::<L, N, O>(separation, [versine_a, versine_b], arm_t);
            let mut mass = record[layout.at(p, layout.normal_mass)];
            if sweep.turned && N::ROTATION {
                let turned = |sine: L, versine: L, side: usize| {
                    sine.mul_add(arm_t[side], versine.neg_mul_add(arm_n[side], arm_n[side]))
                };
                arm_n = [turned(sine_a, versine_a, 0), turned(sine_b, versine_b, 1)];
                let mut k = (inertia[1] * arm_n[1]).mul_add(arm_n[1], mass_sum);
                if O::HAS_ROW {
                    k = (inertia[0] * arm_n[0]).mul_add(arm_n[0], k);
                }
                // A missing point has zero mass, and keeps it.
                mass = mass.select_positive(L::splat(1.0) / k, L::zero());
            }
            let overlap = (-(separation + L::splat(sweep.slop))).max(L::zero());
            let correction = (overlap * L::splat(sweep.fraction)).min(L::splat(sweep.max_correction[0]));
            let push = mass * correction;
            sum = sum + push;
            moved = mass_sum.mul_add(push, moved);
            spin::<L, N, O>(&mut angle, inertia, arm_n, push);
        }
        let (x, y) = (n[0] * sum, n[1] * sum);
        b[DX] = b[INV_MASS].mul_add(x, b[DX]);
        b[DY] = b[INV_MASS].mul_add(y, b[DY]);
        L::scatter_shared::<_, 2, 1>(*rows, row_b, [b[DX], b[DY], angle[1], b[INV_INERTIA]]);
        if O::HAS_ROW && pushes_a {
            a[DX] = a[INV_MASS].neg_mul_add(x, a[DX]);
            a[DY] = a[INV_MASS].neg_mul_add(y, a[DY]);
            L::scatter_shared::<_, 2, 1>(*rows, row_a, [a[DX], a[DY], angle[0], a[INV_INERTIA]]);
        }
    });
}

/// One position sweep over all segments, in order.
#[inline(never)]
pub fn position_sweep<L: Lanes, N: KernelFeatures>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
    sweep: PositionSweep,
) {
    over_colors!(position_segment, L, N; rows, batches, sweep);
}
