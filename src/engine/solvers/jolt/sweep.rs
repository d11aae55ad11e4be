//! The velocity sweep: the friction row of a contact, then its normal rows. See the [solver](super).

use crate::constraints::kernels::frame::{
    BodyPair, DX, DY, INV_INERTIA, INV_MASS, TURN, VX, VY, W, apply, arms, separation, spin, to_frame, turn,
    with_arms,
};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::stages::{for_each_batch, over_colors};
use crate::constraints::kernels::velocity::rules::{NormalRule, Rigid};
use crate::constraints::numerics::cone;
use crate::constraints::records::batches::SegmentRecords;
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::lanes::{Lanes, SharedRows};

/// One sweep. Normal rows follow the rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactFriction(pub Rigid);

impl Pass for ContactFriction {
    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        over_colors!(sweep, L, F; SharedRows::among(on.rows, on.workers), on.batches, self.0);
    }
}

#[inline(always)]
fn sweep<L: Lanes, N: KernelFeatures, O: Partner>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    rule: Rigid,
) {
    let layout = const { Layout::of::<N, O>() };
    let pushes_a = of.segment.pushes_a();
    let zero = L::zero();
    for_each_batch::<L, N, O, _>(&mut rows, of, |rows, record, row_a, row_b| {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather::<O, _>(rows, row_a, row_b);
        let n = [record[0], record[1]];
        let mass_sum = if O::HAS_ROW { a[INV_MASS] + b[INV_MASS] } else { b[INV_MASS] };
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let [mut along_n, along_t] = to_frame::<L, O>([a[VX], a[VY]], [b[VX], b[VY]], n);
        let mut w = [a[W], b[W]];
        let mut sum = [zero; 2];
        if N::FRICTION {
            let (mut arm, mut load, mut old, mut points) = ([zero; 2], zero, zero, zero);
            let mut is_point = [zero; 2];
            for p in 0..N::POINTS {
                is_point[p] = record[layout.at(p, layout.tangent_mass)].select_positive(L::splat(1.0), zero);
                let of = arms::<L, N, O>(record, &layout, p, 1);
                arm = [0, 1].map(|side| is_point[p].mul_add(of[side], arm[side]));
                load = load + record[layout.at(p, layout.normal_impulse)];
                old = old + record[layout.at(p, layout.tangent_impulse)];
                points = points + is_point[p];
            }
            let share = L::splat(1.0) / points.max(L::splat(1.0));
            arm = arm.map(|arm| arm * share);
            let mut k = (inertia[1] * arm[1]).mul_add(arm[1], mass_sum);
            if O::HAS_ROW {
                k = (inertia[0] * arm[0]).mul_add(arm[0], k);
            }
            // Bodies of empty lanes have no mass.
            let mass = k.select_positive(L::splat(1.0) / k, zero);
            let bound = record[layout.friction] * load;
            let vt = with_arms::<L, N, O>(along_t, w, arm);
            let new = cone::friction(mass.neg_mul_add(vt, old), bound);
            for p in 0..N::POINTS {
                record[layout.at(p, layout.tangent_impulse)] = new * share * is_point[p];
            }
            let delta = new - old;
            sum[1] = delta;
            spin::<L, N, O>(&mut w, inertia, arm, delta);
        }
        let moved = to_frame::<L, O>([a[DX], a[DY]], [b[DX], b[DY]], n)[0];
        let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
        for p in 0..N::POINTS {
            let gap = separation::<L, N, O>(record, p, moved, [sine_a, sine_b], [versine_a, versine_b]);
            let mass = record[layout.at(p, layout.normal_mass)];
            let arm = arms::<L, N, O>(record, &layout, p, 0);
            let vn = with_arms::<L, N, O>(along_n, w, arm);
            let at = layout.at(p, layout.normal_impulse);
            let old = record[at];
            let new = rule.normal_impulse(!pushes_a, vn, gap, mass, old);
            record[at] = new;
            let delta = new - old;
            sum[0] = sum[0] + delta;
            along_n = mass_sum.mul_add(delta, along_n);
            spin::<L, N, O>(&mut w, inertia, arm, delta);
        }
        apply::<L, O>(&mut a, &mut b, n, sum, w);
        BodyPair { a, b }.scatter_velocities::<O, _>(rows, row_a, row_b, pushes_a);
    });
}
