//! Contacts into constraint records at the start of a step, impulses back at its end.

use super::batches::{Batches, PADDING, Segment};
use super::needs::{KernelNeeds, Layout, OnDynamic, OnKinematic, OnStatic, Opposite, OppositeKind};
use super::sweep::over_segments;
use crate::contacts::Contact;
use crate::lanes::{BodyRow, Lanes};

const INV_MASS: usize = 3;
const INV_INERTIA: usize = 7;

/// Fills the records of a segment.
///
/// Lane by lane the geometry is copied and the arms r × n and r × t = −(r·n) are formed;
/// then, in lanes, the effective masses 1/k with
/// k = m_a⁻¹ + m_b⁻¹ + I_a⁻¹ (r_a × u)² + I_b⁻¹ (r_b × u)², u = n and t.
///
/// Lanes without a contact, and points that a contact does not have, get effective mass
/// zero and impulse zero: whatever velocity they see, their impulse stays zero.
#[inline(always)]
fn prepare_segment<L: Lanes, N: KernelNeeds, O: Opposite>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    contacts: &[Contact],
) {
    let layout = const { Layout::of::<N, O>() };
    let stride = layout.stride;
    let slab: &mut [L] = bytemuck::cast_slice_mut(&mut batches.slab);
    let records = &mut slab[segment.first_vector..][..segment.batches * stride];
    for (batch, record) in records.chunks_exact_mut(stride).enumerate() {
        let lanes = segment.first_lane + batch * L::WIDTH..segment.first_lane + (batch + 1) * L::WIDTH;
        let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
        for (lane, &contact) in batches.contact[lanes.clone()].iter().enumerate() {
            let mut put = |quantity: usize, value: f32| floats[quantity * L::WIDTH + lane] = value;
            if contact == PADDING {
                (0..stride).for_each(|quantity| put(quantity, 0.0));
                continue;
            }
            let contact = &contacts[contact as usize];
            let n = contact.manifold.normal;
            put(0, n.x);
            put(1, n.y);
            if N::FRICTION {
                put(layout.friction, contact.friction);
            }
            for p in 0..N::POINTS {
                let point = &contact.manifold.points[p];
                let active = (p as u32) < contact.manifold.count;
                let active = if active { 1.0 } else { 0.0 };
                if N::ROTATION {
                    put(layout.at(p, layout.arm_b), active * point.anchor_b.perp_dot(n));
                    put(layout.at(p, layout.arm_b) + 1, -active * point.anchor_b.dot(n));
                    if O::HAS_ROW {
                        put(layout.at(p, layout.arm_a), active * point.anchor_a.perp_dot(n));
                        put(layout.at(p, layout.arm_a) + 1, -active * point.anchor_a.dot(n));
                    }
                }
                put(layout.at(p, layout.separation), active * point.separation);
                put(layout.at(p, layout.normal_mass), active);
                put(layout.at(p, layout.normal_impulse), active * point.normal_impulse);
                if N::FRICTION {
                    put(layout.at(p, layout.tangent_impulse), active * point.tangent_impulse);
                }
            }
        }

        // SAFETY: `Problem::new` checked every row index against the rows.
        let b = unsafe { L::gather(rows, &batches.row_b[lanes.clone()]) };
        let a = if O::MOVES {
            // SAFETY: as above.
            unsafe { L::gather(rows, &batches.row_a[lanes]) }
        } else {
            [L::zero(); 8]
        };
        for p in 0..N::POINTS {
            let k = |axis: usize| {
                let mut k = a[INV_MASS] + b[INV_MASS];
                if N::ROTATION {
                    let arm_b = record[layout.at(p, layout.arm_b) + axis];
                    k = (b[INV_INERTIA] * arm_b).mul_add(arm_b, k);
                    if O::MOVES {
                        let arm_a = record[layout.at(p, layout.arm_a) + axis];
                        k = (a[INV_INERTIA] * arm_a).mul_add(arm_a, k);
                    }
                }
                k
            };
            let active = record[layout.at(p, layout.normal_mass)];
            let mass = |k: L| active.select_positive(L::splat(1.0) / k, L::zero());
            let (normal, tangent) = (mass(k(0)), mass(k(1)));
            record[layout.at(p, layout.normal_mass)] = normal;
            if N::FRICTION {
                record[layout.at(p, layout.tangent_mass)] = tangent;
            }
        }
    }
}

/// Fills the records of all segments.
#[inline(never)]
pub fn prepare<L: Lanes, N: KernelNeeds>(rows: &mut [BodyRow], batches: &mut Batches, contacts: &[Contact]) {
    over_segments!(prepare_segment, L, N; rows, batches, contacts);
}
