//! The sticky sweep: friction holds points at a position instead of at zero velocity.
//!
//! Each point stores its drift d along the surface since it began to stick (m). Its friction row aims at v_t
//! = −β_t d/h, which brings a creeping point back. If this exceeds the cone, the point slides and begins to
//! stick again at its current position. Normal rows are those of
//! [`crate::constraints::kernels::velocity::rules::Baumgarte`] without slop. The cone of each point
//! uses its share of the manifold's normal impulse, Σ λn/points, so a load that shifts from point to point
//! unsticks neither.
//!
//! Within a step a point at R r has drifted by
//!
//! ```text
//! t·(Δx_b − Δx_a) + σ_b (r_b × t) − κ_b (r_b × n) − σ_a (r_a × t) + κ_a (r_a × n)
//! ```
//!
//! with σ = sin Δθ and κ = 1 − cos Δθ, since t·r = r × n. The drift from earlier steps is stored per point.
//!
//! Drifts follow contacts from step to step in [`SolverState`]. Within a step they are in lane order, in the
//! tangential entries of a vector laid out as a
//! [`crate::constraints::records::point_vector::PointVector`], so a sweep reads and writes them
//! without gathering.
//!
//! Source: `catto2024solver2d` (`solve_tgs_sticky`).
//!
//! # Patches
//!
//! With [`Sticky::patch`], friction is that of PhysX (`nvidia2026physx`): a contact that slides at one of its
//! points releases both, but only for the next step; until then the rows aim at the positions of the last
//! step. A flag per point marks sliding contacts, in the normal entry of the vector. A point that has a gap
//! at the start of the step uses the rate 1/h of gaps for the whole step.

use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, INV_INERTIA, INV_MASS, TURN, VX, VY, W, apply, arms, spin, to_frame, turn, with_arms,
};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::stages::over_segments;
use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::numerics::cone;
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, LayoutOf, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::constraints::records::kept::SolverState;
use crate::constraints::records::point_vector::places;
use crate::lanes::{Block, BodyRow, Lanes, RowStore};

/// Parameters of a sweep; see the [module](self). The solver keeps one float per contact point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sticky {
    /// Substep (s).
    pub h: f32,
    /// Fraction of an overlap removed per substep (1); 0 leaves positions alone.
    pub fraction: f32,
    /// Largest push-apart speed of overlap (m/s).
    pub push_speed: f32,
    /// β_t: fraction of a drift corrected per substep (1).
    pub stick: f32,
    /// Points farther apart than this (m) do not stick.
    pub reach: f32,
    /// See the [module](self).
    pub patch: Option<Patch>,
}

/// Additional parameters of a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// Factor on the increments of friction rows (1).
    pub ease: f32,
    /// Lower bound of separations (m).
    pub shallowest: f32,
}

/// One sweep.
pub(crate) struct StickySweep<'a> {
    pub sticky: Sticky,
    /// Drifts of the colored and of the serial batches.
    pub drifts: [&'a mut [Block]; 2],
}

/// Copies drifts from [`SolverState`] into lane order.
pub(crate) struct LoadDrift<'a> {
    /// As in [`StickySweep`].
    pub drifts: [&'a mut [Block]; 2],
}

/// Stores the drifts at the end of the step in [`SolverState`]; see the [module](self).
pub(crate) struct StoreDrift<'a> {
    /// As in [`Sticky`].
    pub reach: f32,
    /// As in [`StickySweep`].
    pub drifts: [&'a mut [Block]; 2],
}

impl Pass for StickySweep<'_> {
    fn law(&self) -> Softness {
        let Sticky { h, fraction, push_speed, .. } = self.sticky;
        Softness { bias_rate: fraction / h, push_speed, ..Softness::RIGID }
    }

    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        over_segments!(sweep, L, F; on.rows, on.batches, self.drifts[on.part as usize], self.sticky);
    }
}

impl Pass for LoadDrift<'_> {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        load::<L>(on.batches, on.kept, self.drifts[on.part as usize], F::layout);
    }
}

impl Pass for StoreDrift<'_> {
    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        over_segments!(store, L, F; on.rows, on.batches, on.kept, self.drifts[on.part as usize], self.reach);
    }
}

#[inline(never)]
fn load<L: Lanes>(batches: &mut Batches, kept: &mut SolverState, drifts: &mut [Block], layout: LayoutOf) {
    let (kept, drifts): (_, &mut [L]) = (kept.by_point(), bytemuck::cast_slice_mut(drifts));
    for i in 0..batches.segments().len() {
        let segment = batches.segments()[i];
        let layout = layout(segment.partner);
        let SegmentRecords { contact, .. } = batches.records_of::<L>(&segment, &layout);
        for (batch, contact) in contact.batches().enumerate() {
            for (p, kept) in kept.iter().enumerate().take(layout.points) {
                drifts[drift_at::<L>(&segment, batch, p)] = L::load_at(kept, contact);
            }
        }
    }
}

/// Index of the drifts of point `p` of a batch.
#[inline(always)]
fn drift_at<L: Lanes>(segment: &Segment, batch: usize, p: usize) -> usize {
    let [_, tangential] = places::<L>(segment.first_slot + batch * L::WIDTH, p);
    tangential
}

/// Index of the sliding flags of point `p` of a batch.
#[inline(always)]
fn flag_at<L: Lanes>(segment: &Segment, batch: usize, p: usize) -> usize {
    let [normal, _] = places::<L>(segment.first_slot + batch * L::WIDTH, p);
    normal
}

/// Separations and drifts within the step of a batch's points.
#[inline(always)]
fn motion<L: Lanes, N: KernelFeatures, O: Partner>(
    record: &[L],
    layout: &Layout,
    a: &[L; 8],
    b: &[L; 8],
) -> [[L; 2]; 2] {
    let [moved_n, moved_t] = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], [record[0], record[1]]);
    let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
    let mut motion = [[L::zero(); 2]; 2];
    for (p, motion) in motion.iter_mut().enumerate().take(N::POINTS) {
        let (arm_n, arm_t) = (arms::<L, N, O>(record, layout, p, 0), arms::<L, N, O>(record, layout, p, 1));
        let mut separation = record[layout.at(p, layout.separation)] + moved_n;
        separation = with_arms::<L, N, O>(separation, [sine_a, sine_b], arm_n);
        separation = with_arms::<L, N, O>(separation, [versine_a, versine_b], arm_t);
        let drift = with_arms::<L, N, O>(moved_t, [sine_a, sine_b], arm_t);
        let drift = with_arms::<L, N, O>(drift, [-versine_a, -versine_b], arm_n);
        *motion = [separation, drift];
    }
    motion
}

#[inline(always)]
fn sweep<L: Lanes, N: KernelFeatures, O: Partner>(
    rows: &mut [BodyRow],
    of: SegmentRecords<'_, L>,
    drifts: &mut [Block],
    Sticky { h, fraction, push_speed, stick, reach, patch }: Sticky,
) {
    let layout = const { Layout::of::<N, O>() };
    let [inv_h, rate, stick] = [1.0, fraction, stick].map(|x| L::splat(x / h));
    let (deepest, reach, zero) = (L::splat(-push_speed), L::splat(reach), L::zero());
    let drifts: &mut [L] = bytemuck::cast_slice_mut(drifts);
    let SegmentRecords { segment, records, row_a, row_b, .. } = of;
    rows.assert_rows(row_b);
    rows.assert_rows(row_a);
    let indices = row_a.batches().zip(row_b.batches());
    for (batch, (record, (row_a, row_b))) in records.chunks_exact_mut(layout.stride).zip(indices).enumerate()
    {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather::<O, _>(rows, row_a, row_b);
        let n = [record[0], record[1]];
        let mass_sum = if O::HAS_ROW { a[INV_MASS] + b[INV_MASS] } else { b[INV_MASS] };
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let [mut along_n, mut along_t] = to_frame::<L, O>([a[VX], a[VY]], [b[VX], b[VY]], n);
        let mut w = [a[W], b[W]];
        let motion = motion::<L, N, O>(record, &layout, &a, &b);
        let (mut sum, mut total, mut points) = ([zero; 2], zero, zero);
        for p in 0..N::POINTS {
            let mut separation = motion[p][0];
            let mut gap = separation;
            if let Some(Patch { shallowest, .. }) = patch {
                separation = separation.max(L::splat(shallowest));
                gap = record[layout.at(p, layout.separation)];
            }
            let push = (separation * rate).max(deepest);
            let bias = gap.select_positive(separation * inv_h, push);
            let mass = record[layout.at(p, layout.normal_mass)];
            let arm = arms::<L, N, O>(record, &layout, p, 0);
            let vn = with_arms::<L, N, O>(along_n, w, arm);
            let at = layout.at(p, layout.normal_impulse);
            let old = record[at];
            let new = mass.neg_mul_add(vn + bias, old).max(zero);
            record[at] = new;
            total = total + new;
            points = points + mass.select_positive(L::splat(1.0), zero);
            let delta = new - old;
            sum[0] = sum[0] + delta;
            along_n = mass_sum.mul_add(delta, along_n);
            spin::<L, N, O>(&mut w, inertia, arm, delta);
        }
        if N::FRICTION {
            if patch.is_some() {
                // Bouncing points have zero normal mass in this sweep.
                points = zero;
                for p in 0..N::POINTS {
                    let mass = record[layout.at(p, layout.tangent_mass)];
                    points = points + mass.select_positive(L::splat(1.0), zero);
                }
            }
            let bound = record[layout.friction] * total / points.max(L::splat(1.0));
            let mut slides = zero;
            for p in 0..N::POINTS {
                let [separation, drift] = motion[p];
                let before = drift_at::<L>(&segment, batch, p);
                let drifted = drifts[before] + drift;
                let is_near = |yes: L, no: L| (reach - separation).select_positive(yes, no);
                let mut mass = record[layout.at(p, layout.tangent_mass)];
                if let Some(Patch { ease, .. }) = patch {
                    mass = mass * L::splat(ease);
                }
                let arm = arms::<L, N, O>(record, &layout, p, 1);
                let vt = with_arms::<L, N, O>(along_t, w, arm) + is_near(drifted * stick, zero);
                let at = layout.at(p, layout.tangent_impulse);
                let old = record[at];
                let wanted = mass.neg_mul_add(vt, old);
                let new = cone::friction(wanted, bound);
                record[at] = new;
                let over = wanted.max(-wanted) - bound;
                if patch.is_some() {
                    slides = slides.max(over);
                } else {
                    // A sliding point begins to stick again at its current position.
                    drifts[before] = over.select_positive(-drift, drifted - drift);
                }
                let delta = new - old;
                sum[1] = sum[1] + delta;
                along_t = mass_sum.mul_add(delta, along_t);
                spin::<L, N, O>(&mut w, inertia, arm, delta);
            }
            if patch.is_some() {
                for p in 0..N::POINTS {
                    drifts[flag_at::<L>(&segment, batch, p)] = slides.select_positive(L::splat(1.0), zero);
                }
            }
        }
        apply::<L, O>(&mut a, &mut b, n, sum, w);
        BodyPair { a, b }.scatter_velocities::<O, _>(rows, row_a, row_b, segment.pushes_a());
    }
}

#[inline(always)]
fn store<L: Lanes, N: KernelFeatures, O: Partner>(
    rows: &mut [BodyRow],
    of: SegmentRecords<'_, L>,
    kept: &mut SolverState,
    drifts: &[Block],
    reach: f32,
) {
    let layout = const { Layout::of::<N, O>() };
    let (kept, drifts): (_, &[L]) = (kept.by_point(), bytemuck::cast_slice(drifts));
    let SegmentRecords { segment, records, contact, row_a, row_b } = of;
    rows.assert_rows(row_b);
    rows.assert_rows(row_a);
    let indices = contact.batches::<L::Index>().zip(row_a.batches().zip(row_b.batches()));
    for (batch, (record, (contact, (row_a, row_b)))) in
        records.chunks_exact(layout.stride).zip(indices).enumerate()
    {
        let filled = segment.filled(batch, L::WIDTH);
        let BodyPair { a, b } = BodyPair::<L>::gather::<O, _>(rows, row_a, row_b);
        let motion = motion::<L, N, O>(record, &layout, &a, &b);
        for (p, [separation, drift]) in motion.into_iter().enumerate().take(N::POINTS) {
            let drifted = drifts[drift_at::<L>(&segment, batch, p)] + drift;
            let slides = drifts[flag_at::<L>(&segment, batch, p)];
            let drifted = slides.select_positive(L::zero(), drifted);
            let mut near = (L::splat(reach) - separation).select_positive(drifted, L::zero());
            // Empty lanes refer to the contact of the first lane, so they write its value.
            let lanes: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut near));
            let first = lanes[0];
            lanes[filled..].fill(first);
            L::store_at(kept[p], contact, near);
        }
    }
}
