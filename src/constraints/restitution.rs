//! Bouncing: one pass at the end of a step, and its own side records.
//!
//! Newton's law wants v_n⁺ = −e v_n⁻ for a point that came in faster than the
//! threshold. The approach speed v_n⁻ is read when the step begins; at its end, when
//! the sweeps have stopped the approach, every point that pushed at all is given the
//! impulse λ = −m_eff (v_n + e v_n⁻), clamped on the accumulated impulse.
//!
//! Scenes in which nothing bounces have neither the pass nor the side records.
//! Source: `catto2024solver2d` for the placement after the sweeps.

use super::batches::{Batches, PADDING, Segment};
use super::needs::{KernelNeeds, Layout, OnDynamic, OnKinematic, OnStatic, Opposite, OppositeKind};
use super::sweep::over_segments;
use crate::contacts::Contact;
use crate::lanes::{Block, BodyRow, Lanes};
use crate::params::RESTITUTION_THRESHOLD;

/// Side records: per batch, restitution e, then per point the approach velocity v_n⁻
/// (m/s) and the largest normal impulse so far (N·s).
#[derive(Debug, Default)]
pub struct Bounces {
    slab: Vec<Block>,
}

const fn stride<N: KernelNeeds>() -> usize {
    1 + 2 * N::POINTS
}

impl Bounces {
    fn records<L: Lanes>(&mut self) -> &mut [L] {
        bytemuck::cast_slice_mut(&mut self.slab)
    }

    /// Bytes in use for `lanes` lanes of `points`-point contacts.
    pub fn bytes(lanes: usize, points: usize) -> usize {
        4 * lanes * (1 + 2 * points)
    }
}

/// Reads the approach velocities before anything moves.
#[inline(never)]
pub fn prepare<L: Lanes, N: KernelNeeds>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    bounces: &mut Bounces,
    contacts: &[Contact],
) {
    let floats = batches.contact.len() * stride::<N>();
    bounces.slab.resize(floats.div_ceil(16), Block::default());
    over_segments!(prepare_segment, L, N; rows, batches, bounces, contacts);
}

fn prepare_segment<L: Lanes, N: KernelNeeds, O: Opposite>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    bounces: &mut Bounces,
    contacts: &[Contact],
) {
    let first = segment.first_lane / L::WIDTH;
    for batch in 0..segment.batches {
        let lanes = segment.first_lane + batch * L::WIDTH..segment.first_lane + (batch + 1) * L::WIDTH;
        let record = &mut bounces.records::<L>()[(first + batch) * stride::<N>()..][..stride::<N>()];
        let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
        for (lane, &contact) in batches.contact[lanes].iter().enumerate() {
            floats[lane] = if contact == PADDING { 0.0 } else { contacts[contact as usize].restitution };
        }
        let vn = normal_velocities::<L, N, O>(rows, batches, segment, batch);
        for p in 0..N::POINTS {
            record[1 + 2 * p] = vn[p];
            record[2 + 2 * p] = L::zero();
        }
    }
}

/// Normal velocity of each point of a batch.
#[inline(always)]
fn normal_velocities<L: Lanes, N: KernelNeeds, O: Opposite>(
    rows: &[BodyRow],
    batches: &Batches,
    segment: &Segment,
    batch: usize,
) -> [L; 2] {
    let layout = const { Layout::of::<N, O>() };
    let lanes = segment.first_lane + batch * L::WIDTH..segment.first_lane + (batch + 1) * L::WIDTH;
    let slab: &[L] = bytemuck::cast_slice(&batches.slab);
    let record = &slab[segment.first_vector + batch * layout.stride..][..layout.stride];
    // SAFETY: `Problem::new` checked every row index against the rows.
    let b = unsafe { L::gather(rows, &batches.row_b[lanes.clone()]) };
    let a = if O::HAS_ROW {
        // SAFETY: as above.
        unsafe { L::gather(rows, &batches.row_a[lanes]) }
    } else {
        [L::zero(); 8]
    };
    let along_n = record[0].mul_add(b[0] - a[0], record[1] * (b[1] - a[1]));
    std::array::from_fn(|p| {
        if p >= N::POINTS || !N::ROTATION {
            return along_n;
        }
        let v = b[2].mul_add(record[layout.at(p, layout.arm_b)], along_n);
        if O::HAS_ROW { a[2].neg_mul_add(record[layout.at(p, layout.arm_a)], v) } else { v }
    })
}

/// Notes the largest impulse of each point so far.
#[inline(never)]
pub fn track<L: Lanes, N: KernelNeeds>(rows: &mut [BodyRow], batches: &mut Batches, bounces: &mut Bounces) {
    over_segments!(track_segment, L, N; rows, batches, bounces);
}

fn track_segment<L: Lanes, N: KernelNeeds, O: Opposite>(
    _rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    bounces: &mut Bounces,
) {
    let layout = const { Layout::of::<N, O>() };
    let first = segment.first_lane / L::WIDTH;
    let slab: &[L] = bytemuck::cast_slice(&batches.slab);
    for batch in 0..segment.batches {
        let record = &slab[segment.first_vector + batch * layout.stride..][..layout.stride];
        let bounce = &mut bounces.records::<L>()[(first + batch) * stride::<N>()..][..stride::<N>()];
        for p in 0..N::POINTS {
            bounce[2 + 2 * p] = bounce[2 + 2 * p].max(record[layout.at(p, layout.normal_impulse)]);
        }
    }
}

/// The bounce itself, contact after contact in sweep order.
#[inline(never)]
pub fn apply<L: Lanes, N: KernelNeeds>(rows: &mut [BodyRow], batches: &mut Batches, bounces: &mut Bounces) {
    over_segments!(apply_segment, L, N; rows, batches, bounces);
}

fn apply_segment<L: Lanes, N: KernelNeeds, O: Opposite>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    bounces: &mut Bounces,
) {
    let layout = const { Layout::of::<N, O>() };
    let first = segment.first_lane / L::WIDTH;
    for batch in 0..segment.batches {
        let lanes = segment.first_lane + batch * L::WIDTH..segment.first_lane + (batch + 1) * L::WIDTH;
        let bounce = &bounces.records::<L>()[(first + batch) * stride::<N>()..][..stride::<N>()];
        for p in 0..N::POINTS {
            let vn = normal_velocities::<L, N, O>(rows, batches, segment, batch)[p];
            let slab: &mut [L] = bytemuck::cast_slice_mut(&mut batches.slab);
            let record = &mut slab[segment.first_vector + batch * layout.stride..][..layout.stride];
            let (e, approach, peak) = (bounce[0], bounce[1 + 2 * p], bounce[2 + 2 * p]);
            let old = record[layout.at(p, layout.normal_impulse)];
            let mass = record[layout.at(p, layout.normal_mass)];
            let target = mass.neg_mul_add(e.mul_add(approach, vn), old).max(L::zero());
            let new = bounced(e, approach, peak, target, old);
            record[layout.at(p, layout.normal_impulse)] = new;
            let delta = new - old;
            let n = [record[0], record[1]];
            let arms = |at: usize| record[layout.at(p, at)];
            let (x, y) = (n[0] * delta, n[1] * delta);
            // SAFETY: `Problem::new` checked every row index against the rows.
            unsafe {
                let index = &batches.row_b[lanes.clone()];
                let b = L::gather(rows, index);
                let w = if N::ROTATION { (b[7] * arms(layout.arm_b)).mul_add(delta, b[2]) } else { b[2] };
                L::scatter_velocity(rows, index, [b[3].mul_add(x, b[0]), b[3].mul_add(y, b[1]), w, b[3]]);
                if O::MOVES {
                    let index = &batches.row_a[lanes.clone()];
                    let a = L::gather(rows, index);
                    let w =
                        if N::ROTATION { (a[7] * arms(layout.arm_a)).neg_mul_add(delta, a[2]) } else { a[2] };
                    let v = [a[3].neg_mul_add(x, a[0]), a[3].neg_mul_add(y, a[1]), w, a[3]];
                    L::scatter_velocity(rows, index, v);
                }
            }
        }
    }
}

/// `yes` where a point with these values bounces, else `no`.
#[inline(always)]
fn bounced<L: Lanes>(e: L, approach: L, peak: L, yes: L, no: L) -> L {
    let fast = (L::splat(-RESTITUTION_THRESHOLD) - approach).select_positive(yes, no);
    e.select_positive(peak.select_positive(fast, no), no)
}

/// Forgets the impulses of points that bounced: they say nothing about the next step.
#[inline(never)]
pub fn forget<L: Lanes, N: KernelNeeds>(rows: &mut [BodyRow], batches: &mut Batches, bounces: &mut Bounces) {
    over_segments!(forget_segment, L, N; rows, batches, bounces);
}

fn forget_segment<L: Lanes, N: KernelNeeds, O: Opposite>(
    _rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    bounces: &mut Bounces,
) {
    let layout = const { Layout::of::<N, O>() };
    let first = segment.first_lane / L::WIDTH;
    let slab: &mut [L] = bytemuck::cast_slice_mut(&mut batches.slab);
    for batch in 0..segment.batches {
        let record = &mut slab[segment.first_vector + batch * layout.stride..][..layout.stride];
        let bounce = &bounces.records::<L>()[(first + batch) * stride::<N>()..][..stride::<N>()];
        for p in 0..N::POINTS {
            let mut forget = |at: usize| {
                let at = layout.at(p, at);
                record[at] = bounced(bounce[0], bounce[1 + 2 * p], bounce[2 + 2 * p], L::zero(), record[at]);
            };
            forget(layout.normal_impulse);
            if N::FRICTION {
                forget(layout.tangent_impulse);
            }
        }
    }
}
