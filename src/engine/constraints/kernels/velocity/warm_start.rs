//! The warm start: the impulses of the previous step serve as the initial guess of this one.

use crate::constraints::kernels::frame::{BodyPair, INV_INERTIA, TURN, W, apply, arms, spin, turn, turned};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::stages::{for_each_batch, over_colors};
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::lanes::{Lanes, SharedRows};

/// The warm start: applies the accumulated impulses, with the arms at the start of the step or with arms that
/// turn with their bodies.
pub struct WarmStart {
    /// Whether arms turn with their bodies.
    pub turned: bool,
}

impl Pass for WarmStart {
    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        if self.turned {
            warm_start_with::<L, F, true>(SharedRows::among(on.rows, on.workers), on.batches);
        } else {
            warm_start_with::<L, F, false>(SharedRows::among(on.rows, on.workers), on.batches);
        }
    }
}

/// Applies all accumulated impulses, with the arms at the start of the step.
pub fn warm_start<L: Lanes, N: KernelFeatures>(rows: SharedRows<'_>, batches: &mut Batches) {
    warm_start_with::<L, N, false>(rows, batches);
}

#[inline(never)]
fn warm_start_with<L: Lanes, N: KernelFeatures, const TURNED: bool>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
) {
    over_colors!(warm_start_segment, L, N, TURNED; rows, batches);
}

/// Applies the accumulated impulses of a segment.
#[inline(always)]
fn warm_start_segment<L: Lanes, N: KernelFeatures, O: Partner, const TURNED: bool>(
    mut rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
) {
    let layout = const { Layout::of::<N, O>() };
    let pushes_a = of.segment.pushes_a();
    for_each_batch::<L, N, O, _>(&mut rows, of, |rows, record, row_a, row_b| {
        let BodyPair { mut a, mut b } = BodyPair::<L>::gather_whole::<O, _>(rows, row_a, row_b);
        let n = [record[0], record[1]];
        let inertia = [a[INV_INERTIA], b[INV_INERTIA]];
        let mut w = [a[W], b[W]];
        let (mut sum_n, mut sum_t) = (L::zero(), L::zero());
        for p in 0..N::POINTS {
            let mut arm_n = arms::<L, N, O>(record, &layout, p, 0);
            let mut arm_t = arms::<L, N, O>(record, &layout, p, 1);
            if TURNED && N::ROTATION {
                let ((sine_a, versine_a), (sine_b, versine_b)) = (turn(a[TURN]), turn(b[TURN]));
                [arm_n, arm_t] = turned(arm_n, arm_t, [sine_a, sine_b], [versine_a, versine_b]);
            }
            let normal = record[layout.at(p, layout.normal_impulse)];
            sum_n = sum_n + normal;
            spin::<L, N, O>(&mut w, inertia, arm_n, normal);
            if N::FRICTION {
                let tangent = record[layout.at(p, layout.tangent_impulse)];
                sum_t = sum_t + tangent;
                spin::<L, N, O>(&mut w, inertia, arm_t, tangent);
            }
        }
        apply::<L, O>(&mut a, &mut b, n, [sum_n, sum_t], w);
        BodyPair { a, b }.scatter_velocities::<O, _>(rows, row_a, row_b, pushes_a);
    });
}
