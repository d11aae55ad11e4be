//! Passes between contact records and [`PointVector`](crate::constraints::PointVector)s: impulses in and out, J v, and M⁻¹ Jᵀ.
//!
//! A pass is compiled once per width. Which quantities a record has is checked at run time, per batch,
//! since passes are memory-bound. Impulses are applied color by color, in the order of warm starting.

use crate::constraints::kernels::frame::{INV_INERTIA, INV_MASS, VX, VY, W};
use crate::constraints::records::batches::{Batches, SegmentRecords};
use crate::constraints::records::features::{Features, Layout};
use crate::constraints::records::point_vector::places;
use crate::constraints::records::segment::Segment;
use crate::lanes::{Block, BodyRow, LaneIndex, Lanes, prefetch};

/// Input of a pass: the bodies, and one set of batches with its part of a vector.
pub(crate) struct VectorInput<'a> {
    pub rows: &'a mut [BodyRow],
    pub batches: &'a mut Batches,
    pub features: &'a Features,
    pub vector: &'a mut [Block],
}

/// Reads two quantities of each point into the vector. `of` gives their indices in a record. Without
/// friction, the second is zero.
#[inline(never)]
pub(crate) fn read<L: Lanes>(on: VectorInput<'_>, of: impl Fn(&Layout) -> [usize; 2]) {
    each_batch::<L>(on, |_, layout, _, record, _, vector, slot| {
        let [first, second] = of(layout);
        for p in 0..layout.points {
            let [n, t] = places::<L>(slot, p);
            vector[n] = record[layout.at(p, first)];
            vector[t] = if layout.has_friction { record[layout.at(p, second)] } else { L::zero() };
        }
    });
}

/// Reads separations into the normal entries, and Coulomb coefficients into the tangential ones.
#[inline(never)]
pub(crate) fn read_surfaces<L: Lanes>(on: VectorInput<'_>) {
    each_batch::<L>(on, |_, layout, _, record, _, vector, slot| {
        for p in 0..layout.points {
            let [n, t] = places::<L>(slot, p);
            let mass = record[layout.at(p, layout.normal_mass)];
            let friction = if layout.has_friction { record[layout.friction] } else { L::zero() };
            vector[n] = record[layout.at(p, layout.separation)];
            vector[t] = mass.select_positive(friction, L::zero());
        }
    });
}

/// Copies the vector into the accumulated impulses.
#[inline(never)]
pub(crate) fn write_impulses<L: Lanes>(on: VectorInput<'_>) {
    each_batch::<L>(on, |_, layout, _, record, _, vector, slot| {
        for p in 0..layout.points {
            let [n, t] = places::<L>(slot, p);
            record[layout.at(p, layout.normal_impulse)] = vector[n];
            if layout.has_friction {
                record[layout.at(p, layout.tangent_impulse)] = vector[t];
            }
        }
    });
}

/// Sets the vector to J v.
#[inline(never)]
pub(crate) fn read_velocities<L: Lanes>(on: VectorInput<'_>) {
    each_batch::<L>(on, |rows, layout, _, record, [row_a, row_b], vector, slot| {
        let b = L::gather(rows, row_b);
        let a = if layout.a_has_row { L::gather(rows, row_a) } else { [L::zero(); 8] };
        let (x, y) = (b[VX] - a[VX], b[VY] - a[VY]);
        let n = [record[0], record[1]];
        let along = [n[0].mul_add(x, n[1] * y), n[1].mul_add(x, -(n[0] * y))];
        for p in 0..layout.points {
            let mass = record[layout.at(p, layout.normal_mass)];
            for (axis, place) in places::<L>(slot, p).into_iter().enumerate() {
                let [arm_a, arm_b] = arms(record, layout, p, axis);
                let v = a[W].neg_mul_add(arm_a, b[W].mul_add(arm_b, along[axis]));
                // An absent point has no mass.
                vector[place] = mass.select_positive(v, L::zero());
            }
        }
    });
}

/// v ← v + M⁻¹ Jᵀ Δλ, where the vector is Δλ.
#[inline(never)]
pub(crate) fn push<L: Lanes>(on: VectorInput<'_>) {
    each_batch::<L>(on, |rows, layout, segment, record, [row_a, row_b], vector, slot| {
        let b = L::gather(rows, row_b);
        let a = if layout.a_has_row { L::gather(rows, row_a) } else { [L::zero(); 8] };
        let (mut total, mut turn_a, mut turn_b) = ([L::zero(); 2], L::zero(), L::zero());
        for p in 0..layout.points {
            for (axis, place) in places::<L>(slot, p).into_iter().enumerate() {
                let [arm_a, arm_b] = arms(record, layout, p, axis);
                total[axis] = total[axis] + vector[place];
                turn_a = arm_a.mul_add(vector[place], turn_a);
                turn_b = arm_b.mul_add(vector[place], turn_b);
            }
        }
        let n = [record[0], record[1]];
        let x = n[0].mul_add(total[0], n[1] * total[1]);
        let y = n[1].mul_add(total[0], -(n[0] * total[1]));
        let pushed = [
            b[INV_MASS].mul_add(x, b[VX]),
            b[INV_MASS].mul_add(y, b[VY]),
            b[INV_INERTIA].mul_add(turn_b, b[W]),
            b[INV_MASS],
        ];
        L::scatter_velocity(rows, row_b, pushed);
        if segment.pushes_a() {
            let pushed = [
                a[INV_MASS].neg_mul_add(x, a[VX]),
                a[INV_MASS].neg_mul_add(y, a[VY]),
                a[INV_INERTIA].neg_mul_add(turn_a, a[W]),
                a[INV_MASS],
            ];
            L::scatter_velocity(rows, row_a, pushed);
        }
    });
}

/// Arms r × u of bodies a and b, u = n or t. Zero for a body that does not turn.
#[inline(always)]
fn arms<L: Lanes>(record: &[L], layout: &Layout, p: usize, axis: usize) -> [L; 2] {
    let [turns_b, turns_a] = layout.has_arms;
    let at = |has: bool, arm: usize| if has { record[layout.at(p, arm) + axis] } else { L::zero() };
    [at(turns_a, layout.arm_a), at(turns_b, layout.arm_b)]
}

/// Prefetch distance, in batches.
const AHEAD: usize = 3;

/// Calls `visit(rows, layout, segment, record, [row_a, row_b], vector, slot)` for every batch.
#[inline(always)]
fn each_batch<L: Lanes>(
    VectorInput { rows, batches, features, vector }: VectorInput<'_>,
    mut visit: impl FnMut(
        &mut [BodyRow],
        &Layout,
        &Segment,
        &mut [L],
        [LaneIndex<'_, L::Index>; 2],
        &mut [L],
        usize,
    ),
) {
    let vector: &mut [L] = bytemuck::cast_slice_mut(vector);
    for i in 0..batches.segments().len() {
        let segment = batches.segments()[i];
        let layout = Layout::for_features(features, segment.partner);
        let SegmentRecords { mut records, row_a, row_b, .. } = batches.records_of::<L>(&segment, &layout);
        let mut slot = segment.first_slot;
        for (row_a, row_b) in row_a.batches().zip(row_b.batches()) {
            let (record, later) = records.split_at_mut(layout.stride);
            prefetch(later, AHEAD * layout.stride..(AHEAD + 1) * layout.stride);
            visit(rows, &layout, &segment, record, [row_a, row_b], vector, slot);
            records = later;
            slot += L::WIDTH;
        }
    }
}
