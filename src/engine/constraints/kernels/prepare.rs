//! Fills constraint records from contacts at the start of a step, and stores impulses in the contacts at its
//! end.

use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::stages::over_colors;
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{
    KernelFeatures, Layout, OnMoving, OnStatic, Partner, PartnerKind,
};
use crate::contacts::{Contact, quad};
use crate::lanes::{Lanes, Quad, SharedRows, prefetch_records};

const INV_MASS: usize = 3;
const INV_INERTIA: usize = 7;

/// Prefetch distance of contacts, in batches.
const AHEAD: usize = 2;

/// Fills the records of a segment, in lanes throughout. Contacts are gathered by quads.
///
/// The arms are r × n and r × t = −(r·n); the effective masses 1/k with
/// k = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (r_a × u)² + I_b⁻¹ (r_b × u)², u = n and t.
///
/// Lanes without a contact, and points that a contact does not have, get zero effective mass and zero
/// impulse. Their impulse stays zero at any velocity.
#[inline(always)]
fn prepare_segment<L: Lanes, N: KernelFeatures, O: Partner>(
    rows: SharedRows<'_>,
    of: SegmentRecords<'_, L>,
    contacts: &[Contact],
) {
    use quad::*;
    let layout = const { Layout::of::<N, O>() };
    let quads: &[Quad] = bytemuck::cast_slice(contacts);
    let SegmentRecords { segment, records, contact, row_a, row_b } = of;
    let records = records.chunks_exact_mut(layout.stride);
    let indices = contact.batches().zip(row_a.batches().zip(row_b.batches()));
    for (batch, (record, (index, (row_a, row_b)))) in records.zip(indices).enumerate() {
        // Contacts of a color lie far apart in memory, so the hardware does not prefetch them.
        let coming = contact.entries_of(batch + AHEAD, L::WIDTH);
        prefetch_records::<STRIDE>(quads, coming.iter().copied());
        // Only a segment's last batch has empty lanes. Their contact is read and then masked out.
        let mut present = L::splat(1.0);
        let filled = segment.filled(batch, L::WIDTH);
        if filled < L::WIDTH {
            let floats: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut present));
            floats[filled..].fill(0.0);
        }
        let [nx, ny, count, friction] = L::gather_quads::<STRIDE, HEADER>(quads, index);
        let a = if O::HAS_ROW { L::gather_shared_rows(rows, row_a) } else { [L::zero(); 8] };
        let b = L::gather_shared_rows(rows, row_b);
        let filled = |value: L| present.select_positive(value, L::zero());
        (record[0], record[1]) = (filled(nx), filled(ny));
        if N::FRICTION {
            record[layout.friction] = filled(friction);
        }
        let two = L::splat(2.0).integer_bits();
        for p in 0..N::POINTS {
            let ([ax, ay, bx, by], [separation, _, normal, tangent]) = if p == 0 {
                (
                    L::gather_quads::<STRIDE, ANCHORS_0>(quads, index),
                    L::gather_quads::<STRIDE, STATE_0>(quads, index),
                )
            } else {
                (
                    L::gather_quads::<STRIDE, ANCHORS_1>(quads, index),
                    L::gather_quads::<STRIDE, STATE_1>(quads, index),
                )
            };
            // Counts are integers.
            let active = if p == 0 {
                count.select_equal(L::zero(), L::zero(), present)
            } else {
                count.select_equal(two, present, L::zero())
            };
            let only = |value: L| active.select_positive(value, L::zero());
            let arms = |x: L, y: L| [only(x.mul_add(ny, -(y * nx))), only(-(x.mul_add(nx, y * ny)))];
            let (arms_a, arms_b) = (arms(ax, ay), arms(bx, by));
            let k = |axis: usize| {
                let mut k = a[INV_MASS] + b[INV_MASS];
                if N::ROTATION {
                    k = (b[INV_INERTIA] * arms_b[axis]).mul_add(arms_b[axis], k);
                    if O::HAS_ROW {
                        k = (a[INV_INERTIA] * arms_a[axis]).mul_add(arms_a[axis], k);
                    }
                }
                k
            };
            if N::ROTATION {
                let at = layout.at(p, layout.arm_b);
                [record[at], record[at + 1]] = arms_b;
                if O::HAS_ROW {
                    let at = layout.at(p, layout.arm_a);
                    [record[at], record[at + 1]] = arms_a;
                }
            }
            record[layout.at(p, layout.separation)] = only(separation);
            record[layout.at(p, layout.normal_mass)] = only(L::splat(1.0) / k(0));
            record[layout.at(p, layout.normal_impulse)] = only(normal);
            if N::FRICTION {
                record[layout.at(p, layout.tangent_mass)] = only(L::splat(1.0) / k(1));
                record[layout.at(p, layout.tangent_impulse)] = only(tangent);
            }
        }
    }
}

/// Fills the records of all batches from the contacts.
pub struct Prepare;

impl Pass for Prepare {
    #[inline(always)]
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        prepare::<L, F>(SharedRows::among(on.rows, on.workers), on.batches, on.contacts);
    }
}

/// Fills the records of all segments.
#[inline(never)]
pub fn prepare<L: Lanes, N: KernelFeatures>(
    rows: SharedRows<'_>,
    batches: &mut Batches,
    contacts: &[Contact],
) {
    over_colors!(prepare_segment, L, N; rows, batches, contacts);
}

/// Writes accumulated impulses back to the contacts.
pub struct Store;

impl Pass for Store {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        store::<L, F>(on.batches, on.contacts);
    }
}

/// Writes the accumulated impulses of all segments back to their contacts.
pub fn store<L: Lanes, N: KernelFeatures>(batches: &mut Batches, contacts: &mut [Contact]) {
    batches.each_segment(N::layout, |batches, segment, layout| {
        store_segment::<L>(batches, segment, layout, contacts);
    });
}

/// Writes the accumulated impulses of a segment back to its contacts, in lanes. Compiled per width only: this
/// pass is memory-bound, so a branch on the layout per batch costs nothing.
#[inline(never)]
fn store_segment<L: Lanes>(
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    contacts: &mut [Contact],
) {
    use quad::*;
    let SegmentRecords { records, contact, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride);
    for (batch, (record, index)) in records.zip(contact.batches()).enumerate() {
        let impulses = |p: usize| {
            let tangent =
                if layout.has_friction { record[layout.at(p, layout.tangent_impulse)] } else { L::zero() };
            [record[layout.at(p, layout.normal_impulse)], tangent]
        };
        let ([n0, t0], [n1, t1]) =
            (impulses(0), if layout.points == 2 { impulses(1) } else { [L::zero(); 2] });
        let filled = segment.filled(batch, L::WIDTH);
        if filled == L::WIDTH {
            let quads = bytemuck::cast_slice_mut(contacts);
            L::scatter_halves::<STRIDE, STATE_0, STATE_1>(quads, index, [n0, t0, n1, t1]);
            continue;
        }
        let floats = [n0, t0, n1, t1];
        let floats: &[f32] = bytemuck::cast_slice(&floats);
        for (lane, &contact) in index.entries()[..filled].iter().enumerate() {
            let at = |k: usize| floats[k * L::WIDTH + lane];
            let [first, second] = &mut contacts[contact as usize].manifold.points;
            (first.normal_impulse, first.tangent_impulse) = (at(0), at(1));
            (second.normal_impulse, second.tangent_impulse) = (at(2), at(3));
        }
    }
}
