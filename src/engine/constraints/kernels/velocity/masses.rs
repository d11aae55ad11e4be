//! Effective masses of bodies whose masses are temporarily scaled.
//!
//! Mass splitting gives each contact a part of its bodies' masses. Shock propagation treats the body below a
//! contact as immovable. Both scale the inverse masses in the rows, and the effective masses 1/k in the
//! records must follow, with k = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (r_a × u)² + I_b⁻¹ (r_b × u)².

use crate::constraints::kernels::frame::{BodyPair, INV_INERTIA, INV_MASS, arms};
use crate::constraints::kernels::pass::{Pass, PassInput, PassMode};
use crate::constraints::kernels::stages::{for_each_batch, over_segments};
use crate::constraints::records::batches::SegmentRecords;
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::lanes::{BodyRow, LaneIndex, Lanes};

/// Inverse masses and inertias of bodies while they are scaled.
#[derive(Clone, Debug, Default)]
pub struct ScaledMasses {
    /// Unscaled values; empty while masses are not scaled. `[bodies]`
    whole: Vec<[f32; 2]>,
}

impl ScaledMasses {
    /// Sets the inverse masses and inertias in the rows to `factor(body)` times their unscaled values.
    pub(crate) fn scale(&mut self, rows: &mut [BodyRow], factor: impl Fn(usize) -> f32) {
        if self.whole.is_empty() {
            self.whole.extend(rows.iter().map(|row| [row.velocity[3], row.delta[3]]));
        }
        let bodies = rows.len() - 1;
        for (i, (row, whole)) in rows[..bodies].iter_mut().zip(&self.whole).enumerate() {
            let factor = factor(i);
            (row.velocity[3], row.delta[3]) = (factor * whole[0], factor * whole[1]);
        }
    }

    /// Ends the scaling and discards the unscaled values.
    pub(crate) fn forget(&mut self) {
        self.whole.clear();
    }

    /// Unscaled values; empty while masses are not scaled. `[bodies]`
    pub(crate) fn whole(&self) -> &[[f32; 2]] {
        &self.whole
    }
}

/// Recomputes effective masses in the records from the rows.
pub(crate) struct EffectiveMasses<'a> {
    /// Factors of bodies. Records of pairs in which both factors are 1 are left unchanged to the bit. If
    /// empty, all are recomputed. `[bodies]`
    pub factors: &'a [f32],
}

impl EffectiveMasses<'_> {
    /// 1 in lanes to recompute, otherwise 0.
    #[inline(always)]
    fn changed<L: Lanes>(&self, [a, b]: [LaneIndex<L::Index>; 2]) -> L {
        if self.factors.is_empty() {
            return L::splat(1.0);
        }
        let mut changed = L::zero();
        let lanes: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut changed));
        for (lane, (&a, &b)) in lanes.iter_mut().zip(a.entries().iter().zip(b.entries())) {
            let is_whole = self.factors[a as usize] == 1.0 && self.factors[b as usize] == 1.0;
            *lane = if is_whole { 0.0 } else { 1.0 };
        }
        changed
    }
}

impl Pass for EffectiveMasses<'_> {
    fn mode(&self) -> PassMode {
        PassMode::Masses
    }

    #[inline(never)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        over_segments!(segment, L, F; on.rows, on.batches, self);
    }
}

#[inline(always)]
fn segment<L: Lanes, N: KernelFeatures, O: Partner>(
    rows: &mut [BodyRow],
    of: SegmentRecords<'_, L>,
    masses: &EffectiveMasses<'_>,
) {
    let layout = const { Layout::of::<N, O>() };
    for_each_batch::<L, N, O, _>(rows, of, |rows, record, row_a, row_b| {
        let changed: L = masses.changed([row_a, row_b]);
        if !changed.any_positive() {
            return;
        }
        let BodyPair { a, b } = BodyPair::<L>::gather::<O, _>(rows, row_a, row_b);
        let mass_sum = if O::HAS_ROW { a[INV_MASS] + b[INV_MASS] } else { b[INV_MASS] };
        for p in 0..N::POINTS {
            for (axis, at) in [layout.normal_mass, layout.tangent_mass].into_iter().enumerate() {
                if axis == 1 && !N::FRICTION {
                    continue;
                }
                let arm = arms::<L, N, O>(record, &layout, p, axis);
                let mut k = mass_sum;
                if N::ROTATION {
                    k = (b[INV_INERTIA] * arm[1]).mul_add(arm[1], k);
                    if O::HAS_ROW {
                        k = (a[INV_INERTIA] * arm[0]).mul_add(arm[0], k);
                    }
                }
                // A missing point has zero mass, and keeps it.
                let at = layout.at(p, at);
                let mass = record[at].select_positive(L::splat(1.0) / k, L::zero());
                record[at] = changed.select_positive(mass, record[at]);
            }
        }
    });
}
