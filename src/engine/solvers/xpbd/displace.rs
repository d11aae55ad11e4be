//! The two passes of position-based dynamics with contacts. The first displaces bodies until no point
//! overlaps and sticking points are back in place; the second corrects velocities once.
//!
//! # Displacing
//!
//! A substep has moved the bodies by h v. Each overlapping point takes the displacement impulse Δλ = −(C + α̃
//! λ)/(k + α̃) (kg·m) along n, with C = max(s, −v_max h), on turned arms. α̃ = α/h² is the compliance α (m/N)
//! in these units (`macklin2016`, equation 18). Then the point takes the impulse along t that reverses its
//! slide d since the step began, if that impulse is within the cone of its λ:
//!
//! ```text
//! d = t·(Δx_b − Δx_a) + σ_b (r_b × t) − κ_b (r_b × n) − σ_a (r_a × t) + κ_a (r_a × n)
//! ```
//!
//! with σ = sin Δθ and κ = 1 − cos Δθ, since t·r = r × n. The contact point of a disc stays on the line of
//! centers, so the rotation of a disc counts as Δθ (r × t). Slides since the substep began, as in
//! `muller2020`, let stacks of three boxes rock with growing energy; `catto2024solver2d` measures them since
//! the step began. Bodies move at once, Δx = m⁻¹ Δλ, Δθ = I⁻¹ (r × u) Δλ, and the next point uses the new
//! positions. Records hold λ/h, an impulse (N·s).
//!
//! # Velocities
//!
//! Afterward v is the velocity that moved the bodies, displacements included. Points that pushed lose their
//! normal velocity, and as much of their sliding velocity as kinetic friction removes, at most µ λ/h.
//!
//! Source: `muller2020` (sections 3.5 and 3.6), `catto2024solver2d` (`solve_xpbd`: the limit of C).

use crate::constraints::impacts::restitution::{point, restitution_of};
use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, INV_INERTIA, INV_MASS, TURN, VX, VY, W, apply, arms, spin, to_frame, turn, turned,
    with_arms,
};
use crate::constraints::kernels::pass::{Pass, PassInput, PassMode};
use crate::constraints::kernels::stages::{for_each_batch, over_colors};
use crate::constraints::numerics::cone;
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::constraints::records::point_vector::places;
use crate::lanes::{Block, BodyRow, LaneIndex, Lanes, RowStore, SharedRows};
use crate::params::MAX_PUSH_SPEED;

/// Displaces bodies; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Displace<'a> {
    /// Substep (s).
    pub h: f32,
    /// v_max (m/s)
    pub push_speed: f32,
    /// α (m/N)
    pub compliance: f32,
    /// The first sweep of a substep: λ starts at zero.
    pub first: bool,
    /// Rows before the substep displaced them.
    pub before: &'a [BodyRow],
}

/// Corrects velocities; see the [module](self).
pub(crate) struct AfterDisplacing<'a> {
    /// Rebound speeds of points (m/s) in the colored and the serial batches; empty if nothing bounces.
    pub rebounds: [&'a mut [Block]; 2],
}

/// Finds the rebound speed of points: e times the approach speed, if that approach is faster than what
/// gravity adds in two substeps (`muller2020`).
pub(crate) struct Approach<'a> {
    /// See [`AfterDisplacing::rebounds`].
    pub to: [&'a mut [Block]; 2],
}

impl Pass for Approach<'_> {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        let (to, increments): (&mut [L], _) =
            (bytemuck::cast_slice_mut(self.to[on.part as usize]), on.increments);
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            let SegmentRecords { records, contact, row_a, row_b, .. } =
                batches.records_of::<L>(segment, layout);
            let indices = contact.batches::<L::Index>().zip(row_a.batches().zip(row_b.batches()));
            let each = records.chunks_exact(layout.stride).zip(indices).enumerate();
            for (batch, (record, (contact, (row_a, row_b)))) in each {
                let filled = &contact.entries()[..segment.filled(batch, L::WIDTH)];
                let e = restitution_of::<L>(on.contacts, filled);
                let mut least = L::zero();
                let lanes: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut least));
                let rows: LaneIndex<L::Index> = row_b;
                for (least, &row) in lanes.iter_mut().zip(rows.entries()) {
                    let [x, y, ..] = increments[row as usize];
                    *least = 2.0 * x.hypot(y);
                }
                for p in 0..layout.points {
                    let [v, _] = point::<L>(on.rows, record, layout, p, row_a, row_b);
                    let [normal, _] = places::<L>(segment.first_slot + batch * L::WIDTH, p);
                    to[normal] = (-least - v).select_positive(-(e * v), L::zero());
                }
            }
        });
    }
}

impl Pass for Displace<'_> {
    fn mode(&self) -> PassMode {
        let max_correction = [self.push_speed, MAX_PUSH_SPEED].map(|speed| speed * self.h);
        PassMode::Position { max_correction, impulses: true }
    }

    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        let displace_by = *self;
        over_colors!(displace, L, F; SharedRows::among(on.rows, on.workers), on.batches, &displace_by);
    }
}

impl Pass for AfterDisplacing<'_> {
    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        match &*self.rebounds[on.part as usize] {
            [] => correct_all::<L, F, false>(SharedRows::among(on.rows, on.workers), on.batches, &[]),
            rebounds => {
                correct_all::<L, F, true>(SharedRows::among(on.rows, on.workers), on.batches, rebounds);
            }
        }
    }
}

/// Current bodies, and the bodies before, whose spins hold the rotation of round bodies (not part of the
/// rows).
struct Displaced<'a> {
    rows: SharedRows<'a>,
    before: &'a [BodyRow],
}

impl RowStore for Displaced<'_> {
    #[inline(always)]
    fn assert_rows(&self, index: crate::lanes::IndexList) {
        self.rows.assert_rows(index);
        self.before.assert_rows(index);
    }

    #[inline(always)]
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        L::gather_shared_rows(self.rows, index)
    }

    #[inline(always)]
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]) {
        self.rows.scatter_velocity(index, velocity);
    }
}

#[inline(always)]
fn displace<L: Lanes, N: KernelFeatures, O: Partner>(
    rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    &Displace { h, push_speed, compliance, first, before }: &Displace<'_>,
) {
    let layout = const { Layout::of::<N, O>() };
    let (mut store, pushes_a) = (Displaced { rows, before }, of.segment.pushes_a());
    let inv_h = L::splat(1.0 / h);
    let deepest = L::splat(-push_speed * h);
    // α̃ (1/kg), and α̃ h, because records hold λ/h.
    let (compliance, of_impulse) = (L::splat(compliance / (h * h)), L::splat(compliance / h));
    let zero = L::zero();
    for_each_batch::<L, N, O, _>(&mut store, of, |store, record, row_a, row_b| {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather::<O, _>(store, row_a, row_b);
        let before = BodyPair::<L>::gather::<O, _>(store.before, row_a, row_b);
        let n = [record[0], record[1]];
        let mass_sum = if O::HAS_ROW { a[INV_MASS] + b[INV_MASS] } else { b[INV_MASS] };
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        // Motion of the centers since the step began.
        let [mut moved, mut slide] = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], n);
        let mut angle = [a[TURN], b[TURN]];
        let hidden = [before.a[W], before.b[W]];
        let answer = |arm: [L; 2]| {
            let mut k = mass_sum;
            if N::ROTATION {
                k = (inertia[1] * arm[1]).mul_add(arm[1], k);
                if O::HAS_ROW && pushes_a {
                    k = (inertia[0] * arm[0]).mul_add(arm[0], k);
                }
            }
            k
        };
        let mut sum = [zero; 2];
        for p in 0..N::POINTS {
            let (arm_n, arm_t) =
                (arms::<L, N, O>(record, &layout, p, 0), arms::<L, N, O>(record, &layout, p, 1));
            let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(angle[0]), turn(angle[1]));
            let mut separation = record[layout.at(p, layout.separation)] + moved;
            separation = with_arms::<L, N, O>(separation, [sine_a, sine_b], arm_n);
            separation = with_arms::<L, N, O>(separation, [versine_a, versine_b], arm_t);
            let [arm_n, _] = turned(arm_n, arm_t, [sine_a, sine_b], [versine_a, versine_b]);
            // A missing point has no mass.
            let is_there = record[layout.at(p, layout.normal_mass)];
            let overlap = is_there.select_positive(-separation.max(deepest).min(zero), zero);
            let at = layout.at(p, layout.normal_impulse);
            let old = if first { zero } else { record[at] };
            let wanted = of_impulse.neg_mul_add(old, overlap);
            let push = is_there.select_positive(wanted / (answer(arm_n) + compliance), zero);
            // With compliance, a push can be reversed; `max` removes the rounding error that remains.
            record[at] = inv_h.mul_add(push, old).max(zero);
            sum[0] = sum[0] + push;
            moved = mass_sum.mul_add(push, moved);
            spin::<L, N, O>(&mut angle, inertia, arm_n, push);
        }
        if N::FRICTION {
            for p in 0..N::POINTS {
                let (arm_n, arm_t) =
                    (arms::<L, N, O>(record, &layout, p, 0), arms::<L, N, O>(record, &layout, p, 1));
                let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(angle[0]), turn(angle[1]));
                let turns = [sine_a + hidden[0], sine_b + hidden[1]];
                let drift = with_arms::<L, N, O>(slide, turns, arm_t);
                let drift = with_arms::<L, N, O>(drift, [-versine_a, -versine_b], arm_n);
                let [_, arm_t] = turned(arm_n, arm_t, [sine_a, sine_b], [versine_a, versine_b]);
                let is_there = record[layout.at(p, layout.normal_mass)];
                let wanted = is_there.select_positive(-(drift / answer(arm_t)), zero);
                let at = layout.at(p, layout.tangent_impulse);
                let old = if first { zero } else { record[at] };
                let new = inv_h.mul_add(wanted, old);
                let normal = record[layout.at(p, layout.normal_impulse)];
                let bound = record[layout.friction] * normal;
                // Within the cone if bound − |λt| is not negative.
                let over = new.max(-new) - bound;
                let held = over.select_positive(zero, normal.select_positive(wanted, zero));
                record[at] = inv_h.mul_add(held, old);
                sum[1] = sum[1] + held;
                slide = mass_sum.mul_add(held, slide);
                spin::<L, N, O>(&mut angle, inertia, arm_t, held);
            }
        }
        let x = n[0].mul_add(sum[0], n[1] * sum[1]);
        let y = n[1].mul_add(sum[0], -(n[0] * sum[1]));
        b[DX] = b[INV_MASS].mul_add(x, b[DX]);
        b[DY] = b[INV_MASS].mul_add(y, b[DY]);
        L::scatter_shared::<_, 2, 1>(store.rows, row_b, [b[DX], b[DY], angle[1], b[INV_INERTIA]]);
        if O::HAS_ROW && pushes_a {
            a[DX] = a[INV_MASS].neg_mul_add(x, a[DX]);
            a[DY] = a[INV_MASS].neg_mul_add(y, a[DY]);
            L::scatter_shared::<_, 2, 1>(store.rows, row_a, [a[DX], a[DY], angle[0], a[INV_INERTIA]]);
        }
    });
}

#[inline(never)]
fn correct_all<L: Lanes, N: KernelFeatures, const BOUNCES: bool>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
    rebounds: &[Block],
) {
    over_colors!(correct, L, N, BOUNCES; rows, batches, rebounds);
}

#[inline(always)]
fn correct<L: Lanes, N: KernelFeatures, O: Partner, const BOUNCES: bool>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    rebounds: &[Block],
) {
    let layout = const { Layout::of::<N, O>() };
    let rebounds: &[L] = bytemuck::cast_slice(rebounds);
    let (mut slot, pushes_a) = (of.segment.first_slot, of.segment.pushes_a());
    for_each_batch::<L, N, O, _>(&mut rows, of, |rows, record, row_a, row_b| {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather::<O, _>(rows, row_a, row_b);
        let n = [record[0], record[1]];
        let mass_sum = if O::HAS_ROW { a[INV_MASS] + b[INV_MASS] } else { b[INV_MASS] };
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let [mut along_n, mut along_t] = to_frame::<L, O>([a[VX], a[VY]], [b[VX], b[VY]], n);
        let mut w = [a[W], b[W]];
        let mut sum = [L::zero(); 2];
        for p in 0..N::POINTS {
            let pushed = record[layout.at(p, layout.normal_impulse)];
            let arm = arms::<L, N, O>(record, &layout, p, 0);
            let vn = with_arms::<L, N, O>(along_n, w, arm);
            let mass = record[layout.at(p, layout.normal_mass)];
            let wanted = if BOUNCES { rebounds[places::<L>(slot, p)[0]] - vn } else { -vn };
            let delta = pushed.select_positive(mass * wanted, L::zero());
            sum[0] = sum[0] + delta;
            along_n = mass_sum.mul_add(delta, along_n);
            spin::<L, N, O>(&mut w, inertia, arm, delta);
        }
        if N::FRICTION {
            for p in 0..N::POINTS {
                let pushed = record[layout.at(p, layout.normal_impulse)];
                let arm = arms::<L, N, O>(record, &layout, p, 1);
                let vt = with_arms::<L, N, O>(along_t, w, arm);
                let bound = record[layout.friction] * pushed;
                let stop = -(record[layout.at(p, layout.tangent_mass)] * vt);
                let delta = cone::friction(stop, bound);
                sum[1] = sum[1] + delta;
                along_t = mass_sum.mul_add(delta, along_t);
                spin::<L, N, O>(&mut w, inertia, arm, delta);
            }
        }
        apply::<L, O>(&mut a, &mut b, n, sum, w);
        slot += L::WIDTH;
        BodyPair { a, b }.scatter_velocities::<O, _>(rows, row_a, row_b, pushes_a);
    });
}
