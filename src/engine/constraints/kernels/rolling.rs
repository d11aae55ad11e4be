//! The frame of a round contact in the middle of a step.
//!
//! A substep solver keeps the normal and the arms of a contact for all n substeps of a step. If a round shape
//! rolls, they turn during the step:
//!
//! ```text
//! n(t) = d(t)/|d(t)|,    d(t) = d + u t
//! ```
//!
//! with d from the center (or the corner) of one shape to the center of the other, and u their relative
//! velocity. A force that keeps the direction of the start of the step lags behind this by
//!
//! ```text
//! τ = (1 − 1/n) dt/2
//! ```
//!
//! on average over the substeps. For a mode of frequency ω, a restoring force that lags acts as negative damping with
//! the growth rate ω² τ/2: a plank that rocks on a disc swings 2.6 times as far after ten seconds. So rolling
//! contacts use the frame at t = τ, which removes the lag. With one substep that is the start of the step: symplectic
//! Euler has no lag.
//!
//! A contact rolls if its gap changes by less than a fifth of the slop s in the step, |v_n| ≤ s/(5 dt). Contacts that close or open
//! use the frame of the start of the step. Only the record turns; the contact itself keeps that frame.
//!
//! # Arms
//!
//! In the directions n and t of the beginning, an arm r is (r·n, r·t) = (−r × t, r × n). The center of a shape, c = r ± ρ n with
//! ρ its distance from the contact point, turns by τ ω, and the normal by φ toward t,
//!
//! ```text
//! φ = τ (t·u)/|d|   between two centers,   φ = −τ ω   on a face of a body with the spin ω
//! ```
//!
//! The arm of a round shape is then c′ ∓ ρ n′; that of a face ends where the other one does.

use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{KernelFeatures, Layout};
use crate::contacts::{Contact, quad};
use crate::lanes::{BodyRow, LaneIndex, Lanes, Quad};
use crate::params::LINEAR_SLOP;

/// Largest change of the gap of a rolling contact (m): a fifth of the slop.
pub(crate) const STEADY: f32 = 0.2 * LINEAR_SLOP;

/// Radius above which a shape is a face (m).
const FLAT: f32 = 1e30;

/// Turns the records of rolling contacts.
pub(crate) struct Roll {
    /// τ (s)
    pub middle: f32,
    /// Step (s).
    pub dt: f32,
    /// See [`STEADY`] (m).
    pub steady: f32,
}

impl Pass for Roll {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            roll::<L>(on.rows, batches, segment, layout, on.contacts, self);
        });
    }
}

#[inline(never)]
fn roll<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    contacts: &[Contact],
    &Roll { middle, dt, steady }: &Roll,
) {
    let contacts: &[Quad] = bytemuck::cast_slice(contacts);
    let (zero, one) = (L::zero(), L::splat(1.0));
    let (tau, steady) = (L::splat(middle), L::splat(steady / dt));
    // The point is on b's surface if a is held, else in the middle of the gap.
    let of_gap = L::splat(if segment.pushes_a() { 0.5 } else { 0.0 });
    let SegmentRecords { records, contact, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let indices = contact.batches::<L::Index>().zip(row_a.batches::<L::Index>().zip(row_b.batches()));
    let records = records.chunks_exact_mut(layout.stride).zip(indices);
    for (record, (contact, (row_a, row_b))) in records {
        let row_b: LaneIndex<L::Index> = row_b;
        let [_, radius_a, radius_b, _] =
            L::gather_quads::<{ quad::STRIDE }, { quad::RADII }>(contacts, contact);
        let is_round = radius_a + radius_b;
        if !is_round.any_positive() {
            continue;
        }
        let b = L::gather(rows, row_b);
        let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
        let place = |first: usize, has: bool| {
            if has { [-record[layout.at(0, first) + 1], record[layout.at(0, first)]] } else { [zero; 2] }
        };
        let (place_b, place_a) =
            (place(layout.arm_b, layout.has_arms[0]), place(layout.arm_a, layout.has_arms[1]));
        let [face_a, face_b] = [radius_a, radius_b].map(|radius| radius - L::splat(FLAT));
        let gap = record[layout.at(0, layout.separation)];
        let to_a = (one - of_gap).mul_add(gap, face_a.select_positive(zero, radius_a));
        let to_b = of_gap.mul_add(gap, face_b.select_positive(zero, radius_b));
        let (center_a, center_b) = ([place_a[0] - to_a, place_a[1]], [place_b[0] + to_b, place_b[1]]);
        let [nx, ny] = [record[0], record[1]];
        let (x, y) = (b[0] - a[0], b[1] - a[1]);
        let straight = [nx.mul_add(x, ny * y), ny.mul_add(x, -(nx * y))];
        // ω × c = ω (c·t, −c·n) in these directions.
        let approach = a[2].neg_mul_add(center_a[1], b[2].mul_add(center_b[1], straight[0]));
        let slide = a[2].mul_add(center_a[0], b[2].neg_mul_add(center_b[0], straight[1]));
        let distance = to_a + to_b;
        let between = slide / distance.select_positive(distance, one);
        let angle = tau * face_a.select_positive(-a[2], face_b.select_positive(-b[2], between));
        let rolls = is_round.select_positive(steady - approach.max(-approach), zero);
        if !rolls.any_positive() {
            continue;
        }
        let unit = |[n, t]: [L; 2], length: L| {
            let inverse = one / length.mul_add(length, one).sqrt();
            [n * inverse, t * inverse]
        };
        let normal = unit([one, angle], angle);
        let turned = |[n, t]: [L; 2], spin: L| {
            let turn = tau * spin;
            unit([turn.mul_add(t, n), turn.neg_mul_add(n, t)], turn)
        };
        let (turned_a, turned_b) = (turned(center_a, a[2]), turned(center_b, b[2]));
        let on_a = [0, 1].map(|k| to_a.mul_add(normal[k], turned_a[k]));
        let on_b = [0, 1].map(|k| to_b.neg_mul_add(normal[k], turned_b[k]));
        let with_b = [0, 1].map(|k| tau.mul_add(straight[k], place_a[k] + (on_b[k] - place_b[k])));
        let with_a = [0, 1].map(|k| tau.neg_mul_add(straight[k], place_b[k] + (on_a[k] - place_a[k])));
        let arm =
            |[n, t]: [L; 2]| [normal[0].mul_add(t, -(normal[1] * n)), -normal[0].mul_add(n, normal[1] * t)];
        let arm_a = arm([0, 1].map(|k| face_a.select_positive(with_b[k], on_a[k])));
        let arm_b = arm([0, 1].map(|k| face_b.select_positive(with_a[k], on_b[k])));
        let mut put = |at: usize, value: L| record[at] = rolls.select_positive(value, record[at]);
        put(0, nx.mul_add(normal[0], ny * normal[1]));
        put(1, ny.mul_add(normal[0], -(nx * normal[1])));
        let mut k = [a[3] + b[3]; 2];
        for (first, has, arm, inertia) in
            [(layout.arm_b, layout.has_arms[0], arm_b, b[7]), (layout.arm_a, layout.has_arms[1], arm_a, a[7])]
        {
            if has {
                for axis in 0..2 {
                    put(layout.at(0, first) + axis, arm[axis]);
                    k[axis] = (inertia * arm[axis]).mul_add(arm[axis], k[axis]);
                }
            }
        }
        put(layout.at(0, layout.normal_mass), one / rolls.select_positive(k[0], one));
        if layout.has_friction {
            put(layout.at(0, layout.tangent_mass), one / rolls.select_positive(k[1], one));
        }
    }
}
