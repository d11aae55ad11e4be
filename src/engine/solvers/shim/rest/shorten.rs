//! Shortens springs by the sag of their loads.
//!
//! # What is left
//!
//! Points at rest have to stay in contact, so a share (1 − φ) of each sag remains, at most 20 µm.
//!
//! Contacts found in the first step of one of their bodies start with their whole sag removed and approach that
//! overlap within a second: otherwise piles that start at rest would sink by it within a step and rebound.
//!
//! # Contacts that roll
//!
//! Shortening a spring pushes bodies apart, and on one point they roll: in a pile of discs some contact slips, loads
//! change, and the pile swells and settles endlessly. So a contact of one point keeps its shortening as long as that
//! is between 0.5 and 1.1 times the one that its load calls for.
//!
//! # Overlap that was placed
//!
//! Bodies may be placed so that they overlap. No load has caused that overlap, and springs that see it throw bodies
//! apart in the first step: a house of cards 2 mm in each other loses its top. So a contact that is found in the
//! first step of one of its bodies has springs that are longer by d₀ = s < 0, and shorter from then on:
//!
//! ```text
//! d₀ ← min(max(d₀, s) τ/(τ + dt) + 20 µm, 0)
//! ```
//!
//! # How deep springs see it
//!
//! Springs carry their load at any depth ([`crate::engine::constraints::kernels::velocity::rules::Bearing`]). Overlap
//! that no load has made is pushed out at the push speed alone: at the beginning of a step springs see a contact no
//! deeper than
//!
//! ```text
//! u/(γ_m β) + 20 sag
//! ```
//!
//! the depth at which they reach the push speed u, plus a depth that grows with their load. So a body thrown into
//! another is not thrown back.

use super::{HELD, LESS, PLACED};
use crate::engine::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::engine::constraints::kernels::velocity::rules::{Soft, Softness};
use crate::engine::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::engine::constraints::records::features::{KernelFeatures, Layout, OppositeKind};
use crate::engine::lanes::{LaneIndex, Lanes, Quad, prefetch_quad};
use crate::engine::params::SPECULATIVE_DISTANCE;

/// See the [module](self).
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Shorten {
    /// The springs.
    pub springs: Soft,
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
}

/// φ: share of a sag that is removed (1).
const SHARE: f32 = 0.95;

/// Largest overlap that remains of a sag (m): 1/250 of the slop, and far more than the rounding of a separation.
pub(in super::super) const LEFT: f32 = 2e-5;

/// Time in which that comes where a contact began without it (s).
const GIVING: f32 = 1.0;

/// Largest sag that is removed (m).
const LARGEST: f32 = 5.0 * SPECULATIVE_DISTANCE;

/// Least and most that a contact of one point keeps of what its load calls for (1).
const LEAST: f32 = 0.5;

/// See [`LEAST`].
const MOST: f32 = 1.1;

/// Depth that springs see beyond that of the push speed, per sag (1).
const EARNED: f32 = 20.0;

/// τ: time in which overlap goes that a contact was placed with (s). Longer, the card house falls at 30 steps a
/// second; shorter, it is thrown over at 240.
const PLACED_TIME: f32 = 0.1;

/// Prefetch distance of contacts (batches).
const AHEAD: usize = 3;

impl Pass for Shorten {
    fn traffic(&self, layout: &Layout, _: OppositeKind) -> PerLane {
        // Loads, separation and mass of each point, and the index of the contact.
        PerLane { floats_read: 9 + 2 * layout.points, floats_written: layout.points, ..PerLane::default() }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            shorten::<L>(batches, segment, layout, on.kept.contacts(), self);
        });
    }
}

#[inline(never)]
fn shorten<L: Lanes>(
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    kept: &mut [f32],
    &Shorten { springs, h, dt }: &Shorten,
) {
    let Softness { bias_rate, mass_scale, impulse_scale } = match segment.opposite {
        OppositeKind::Dynamic => springs.dynamic,
        _ => springs.against_static,
    };
    // Sag per load and effective mass (s²).
    let compliance = L::splat(h * impulse_scale / (mass_scale * bias_rate));
    let per_impulse = L::splat(impulse_scale / (mass_scale * bias_rate));
    // Depth at which springs reach the push speed (m).
    let deepest = L::splat(springs.push_speed / (mass_scale * bias_rate));
    let keeps = L::splat(PLACED_TIME / (PLACED_TIME + dt));
    let (zero, one, h_lanes) = (L::zero(), L::splat(1.0), L::splat(h));
    let SegmentRecords { records, contact, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride);
    let quads: &mut [Quad] = bytemuck::cast_slice_mut(kept);
    for (batch, (record, index)) in records.zip(contact.batches::<L::Index>()).enumerate() {
        let index: LaneIndex<L::Index> = index;
        for &coming in contact.entries_of(batch + AHEAD, L::WIDTH) {
            prefetch_quad::<2, 0>(quads, coming);
        }
        let loads: [L; 4] = L::gather_quads::<2, 0>(quads, index);
        let [mut placed, mut less, held, _]: [L; 4] = L::gather_quads::<2, 1>(quads, index);
        let is_single = if layout.points == 2 {
            record[layout.at(1, layout.normal_mass)].select_positive(zero, one)
        } else {
            one
        };
        if (-placed - less).any_positive() {
            let lowest = (0..layout.points)
                .fold(zero, |lowest, p| lowest.min(record[layout.at(p, layout.separation)]));
            placed = keeps.mul_add(placed.max(lowest), L::splat(LEFT)).min(zero);
            less = (less + L::splat(LEFT * dt / GIVING)).min(zero);
            let of = |x: &L, lane: usize| bytemuck::cast_slice::<L, f32>(std::slice::from_ref(x))[lane];
            let filled = &index.entries()[..segment.filled(batch, L::WIDTH)];
            for (lane, &contact) in filled.iter().enumerate() {
                let kept = &mut quads[2 * contact as usize + 1].0;
                (kept[PLACED - 4], kept[LESS - 4]) = (of(&placed, lane), of(&less, lane));
            }
        }
        for p in 0..layout.points {
            let mass = record[layout.at(p, layout.normal_mass)];
            let mass = mass.select_positive(mass, one);
            let sag = (compliance * loads[2 * p].max(zero) / mass).min(L::splat(LARGEST));
            let mut shorter = sag - (L::splat(1.0 - SHARE) * sag).min(L::splat(LEFT) + less);
            if p == 0 && is_single.any_positive() {
                let kept = held.max(L::splat(LEAST) * shorter).min(L::splat(MOST) * shorter);
                let kept = held.select_positive(kept, shorter);
                shorter = is_single.select_positive(kept, shorter);
                let of = |x: &L, lane: usize| bytemuck::cast_slice::<L, f32>(std::slice::from_ref(x))[lane];
                let filled = &index.entries()[..segment.filled(batch, L::WIDTH)];
                for (lane, &contact) in
                    filled.iter().enumerate().filter(|&(lane, _)| of(&is_single, lane) > 0.0)
                {
                    quads[2 * contact as usize + 1].0[HELD - 4] = of(&shorter, lane);
                }
            }
            let at = layout.at(p, layout.normal_impulse);
            let impulse = loads[2 * p].max(zero).mul_add(h_lanes, record[at]).max(zero);
            record[at] = impulse;
            let borne = (per_impulse * impulse / mass).min(L::splat(LARGEST));
            let depth = L::splat(EARNED).mul_add(borne, deepest);
            let at = layout.at(p, layout.separation);
            record[at] = (record[at] - placed).max(-depth) - shorter;
            if layout.has_friction {
                let at = layout.at(p, layout.tangent_impulse);
                record[at] = loads[2 * p + 1].mul_add(h_lanes, record[at]);
            }
        }
    }
}
