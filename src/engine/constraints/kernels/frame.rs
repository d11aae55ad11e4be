//! The contact frame: how two bodies move along the rows of a contact, and what impulses do to them.
//!
//! # Contact frame
//!
//! A contact has the unit normal n (from a to b) and the tangent t = (n_y, −n_x). With
//! the velocities v, ω of the two bodies and the arms r from their centers of mass to
//! the contact point, the relative velocity of the point along an axis u is
//!
//! ```text
//! u·(v_b + ω_b × r_b − v_a − ω_a × r_a) = u·(v_b − v_a) + ω_b (r_b × u) − ω_a (r_a × u)
//! ```
//!
//! because u·(ω × r) = ω (r × u) in the plane. A row therefore stores no arm vector, only the scalar r × u.
//! All rows of one contact share n and t, so a sweep gathers the bodies once and rotates v_b − v_a into the
//! contact frame (two numbers, `along_n` and `along_t`). These and ω_a, ω_b give the velocity of every row.
//! An impulse λ along n changes
//!
//! ```text
//! along_n += (m_a⁻¹ + m_b⁻¹) λ,   ω_b += I_b⁻¹ (r_b × n) λ,   ω_a −= I_a⁻¹ (r_a × n) λ
//! ```
//!
//! and leaves `along_t` unchanged, since n ⊥ t; likewise along t. The sums of the impulses are rotated back
//! and applied to the bodies once.
//!
//! # Separation
//!
//! With the bodies moved by Δx and turned by Δθ since the step began, an anchor r becomes R(Δθ) r, and
//! n·(R(Δθ) r − r) = sin Δθ (r × n) − (1 − cos Δθ)(n·r). Since r × t = −(r·n), the rotated separation needs
//! only the two arms:
//!
//! ```text
//! s = s₀ + n·(Δx_b − Δx_a) + σ_b (r_b × n) + κ_b (r_b × t) − σ_a (r_a × n) − κ_a (r_a × t)
//! ```
//!
//! with σ = sin Δθ and κ = 1 − cos Δθ, both approximated by their Taylor series.
//!
//! # Effective mass
//!
//! A unit impulse along u changes the velocity along u by k = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (r_a × u)² + I_b⁻¹ (r_b ×
//! u)²; the effective mass is 1/k.

use crate::constraints::records::features::{KernelFeatures, Layout, Partner};
use crate::lanes::{LaneIndex, Lanes, RowStore};

pub(crate) const VX: usize = 0;
pub(crate) const VY: usize = 1;
pub(crate) const W: usize = 2;
pub(crate) const INV_MASS: usize = 3;
pub(crate) const DX: usize = 4;
pub(crate) const DY: usize = 5;
pub(crate) const TURN: usize = 6;
pub(crate) const INV_INERTIA: usize = 7;

/// The two bodies of a batch, in registers.
pub(crate) struct BodyPair<L> {
    pub(crate) a: [L; 8],
    pub(crate) b: [L; 8],
}

impl<L: Lanes> BodyPair<L> {
    #[inline(always)]
    pub(crate) fn gather<O: Partner, S: RowStore + ?Sized>(
        rows: &S,
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
    ) -> Self {
        let a = if O::HAS_ROW { rows.gather(row_a) } else { [L::zero(); 8] };
        BodyPair { a, b: rows.gather(row_b) }
    }

    /// As [`Self::gather`], for rows that were not written just before, see [`Lanes::gather_whole`].
    #[inline(always)]
    pub(crate) fn gather_whole<O: Partner, S: RowStore + ?Sized>(
        rows: &S,
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
    ) -> Self {
        let a = if O::HAS_ROW { rows.gather_whole(row_a) } else { [L::zero(); 8] };
        BodyPair { a, b: rows.gather_whole(row_b) }
    }

    /// Writes back the velocities of body b, and of body a if `pushes_a`.
    #[inline(always)]
    pub(crate) fn scatter_velocities<O: Partner, S: RowStore + ?Sized>(
        &self,
        rows: &mut S,
        row_a: LaneIndex<L::Index>,
        row_b: LaneIndex<L::Index>,
        pushes_a: bool,
    ) {
        let (a, b) = (&self.a, &self.b);
        rows.scatter_velocity(row_b, [b[VX], b[VY], b[W], b[INV_MASS]]);
        if O::HAS_ROW && pushes_a {
            rows.scatter_velocity(row_a, [a[VX], a[VY], a[W], a[INV_MASS]]);
        }
    }
}

/// Components of b − a along n and t.
#[inline(always)]
pub(crate) fn to_frame<L: Lanes, O: Partner>(a: [L; 2], b: [L; 2], n: [L; 2]) -> [L; 2] {
    let x = if O::HAS_ROW { b[0] - a[0] } else { b[0] };
    let y = if O::HAS_ROW { b[1] - a[1] } else { b[1] };
    [n[0].mul_add(x, n[1] * y), n[1].mul_add(x, -(n[0] * y))]
}

/// `base + ω_b arm_b − ω_a arm_a`, if the kernel features include rotation.
#[inline(always)]
pub(crate) fn with_arms<L: Lanes, N: KernelFeatures, O: Partner>(base: L, w: [L; 2], arm: [L; 2]) -> L {
    let mut v = base;
    if N::ROTATION {
        v = w[1].mul_add(arm[1], v);
        if O::HAS_ROW {
            v = w[0].neg_mul_add(arm[0], v);
        }
    }
    v
}

/// `ω_b += I_b⁻¹ arm_b λ`, `ω_a −= I_a⁻¹ arm_a λ`, if the kernel features include rotation.
#[inline(always)]
pub(crate) fn spin<L: Lanes, N: KernelFeatures, O: Partner>(
    w: &mut [L; 2],
    inertia: [L; 2],
    arm: [L; 2],
    impulse: L,
) {
    if N::ROTATION {
        w[1] = (inertia[1] * arm[1]).mul_add(impulse, w[1]);
        if O::HAS_ROW {
            w[0] = (inertia[0] * arm[0]).neg_mul_add(impulse, w[0]);
        }
    }
}

/// Arms of bodies a and b at point `p`: `axis` 0 is r × n, 1 is r × t.
#[inline(always)]
pub(crate) fn arms<L: Lanes, N: KernelFeatures, O: Partner>(
    record: &[L],
    layout: &Layout,
    p: usize,
    axis: usize,
) -> [L; 2] {
    if !N::ROTATION {
        return [L::zero(); 2];
    }
    let b = record[layout.at(p, layout.arm_b) + axis];
    let a = if O::HAS_ROW { record[layout.at(p, layout.arm_a) + axis] } else { L::zero() };
    [a, b]
}

/// sin θ and 1 − cos θ of the rotation within one step.
///
/// The first two Taylor terms of each. The errors are below θ⁵/120 and θ⁶/720: below 3e-8 for 0.05 rad
/// (3 rad/s at 60 Hz) and 2.6e-4 for half a radian.
#[inline(always)]
pub(crate) fn turn<L: Lanes>(angle: L) -> (L, L) {
    let square = angle * angle;
    let sine = angle * square.neg_mul_add(L::splat(1.0 / 6.0), L::splat(1.0));
    let versine = square * square.neg_mul_add(L::splat(1.0 / 24.0), L::splat(0.5));
    (sine, versine)
}

/// Arms r × n and r × t of bodies a and b, turned by Δθ (see
/// [`crate::constraints::kernels::position`]): R r × n = cos Δθ (r × n) + sin Δθ (r × t), R r × t =
/// cos Δθ (r × t) − sin Δθ (r × n).
#[inline(always)]
pub(crate) fn turned<L: Lanes>(arm_n: [L; 2], arm_t: [L; 2], sine: [L; 2], versine: [L; 2]) -> [[L; 2]; 2] {
    let n = |k: usize| sine[k].mul_add(arm_t[k], versine[k].neg_mul_add(arm_n[k], arm_n[k]));
    let t = |k: usize| sine[k].neg_mul_add(arm_n[k], versine[k].neg_mul_add(arm_t[k], arm_t[k]));
    [[n(0), n(1)], [t(0), t(1)]]
}

/// Separation at point `p` (m), see the [module](self). `moved` is n·(Δx_b − Δx_a); `sine` and `versine`
/// belong to the rotations of a and b.
#[inline(always)]
pub(crate) fn separation<L: Lanes, N: KernelFeatures, O: Partner>(
    record: &[L],
    p: usize,
    moved: L,
    sine: [L; 2],
    versine: [L; 2],
) -> L {
    let layout = const { Layout::of::<N, O>() };
    let along = |axis: usize| arms::<L, N, O>(record, &layout, p, axis);
    let s = with_arms::<L, N, O>(record[layout.at(p, layout.separation)] + moved, sine, along(0));
    with_arms::<L, N, O>(s, versine, along(1))
}

/// Rotates the impulses along n and t back into world axes and applies them; `w` are the new spins.
#[inline(always)]
pub(crate) fn apply<L: Lanes, O: Partner>(a: &mut [L; 8], b: &mut [L; 8], n: [L; 2], sum: [L; 2], w: [L; 2]) {
    let x = n[0].mul_add(sum[0], n[1] * sum[1]);
    let y = n[1].mul_add(sum[0], -(n[0] * sum[1]));
    b[VX] = b[INV_MASS].mul_add(x, b[VX]);
    b[VY] = b[INV_MASS].mul_add(y, b[VY]);
    b[W] = w[1];
    if O::HAS_ROW {
        a[VX] = a[INV_MASS].neg_mul_add(x, a[VX]);
        a[VY] = a[INV_MASS].neg_mul_add(y, a[VY]);
        a[W] = w[0];
    }
}
