//! Shortens springs by the sag of their loads.
//!
//! # Loads that rise
//!
//! A spring that bears F and is shortened by another dδ does the work F dδ. Over a cycle of what rocks or sways that is
//!
//! ```text
//! ∮ F dδ > 0   if δ follows F late,        0   if δ stays or is a function of F
//! ```
//!
//! so shortening a spring while its body moves drives the motion, and where δ stays, what the spring gives way is lost to its damper. The
//! load that a spring is shortened for follows its load at once downwards, which does no work that the load has not done. Upwards it follows
//! where the contact is calm alone ([`super::closed`]), within τ = 3 s, a few periods of a column that sways:
//!
//! ```text
//! F ← min(N, F + (N − F) dt/(τ + dt))
//! ```
//!
//! Calm contacts that bear nearly all of it follow at once, so that columns that lean get the moment that they need; and so do
//! those that are found in the first step of one of their bodies.
//!
//! # Contacts that roll
//!
//! What shortens a spring moves bodies apart, and on one point they roll: in a pile of discs some contact slips, loads change, and the pile
//! swells and settles without an end. So a contact of one point keeps the load that it was shortened for while that is at least half of what it
//! bears, and no more than that and a tenth.

use super::closed::CALM_TIME;
use crate::engine::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::engine::constraints::kernels::velocity::rules::{Soft, Softness};
use crate::engine::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::engine::constraints::records::features::{KernelFeatures, Layout, OppositeKind};
use crate::engine::lanes::{LaneIndex, Lanes, Quad, prefetch_quad};

/// See the [module](self).
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct Shorten {
    /// The springs.
    pub springs: Soft,
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Loads rise slowly, and only where nothing moves.
    pub rises: bool,
    /// Contacts of one point keep what they were shortened by.
    pub holds: bool,
}

/// Least and most that a contact of one point keeps of its load (1).
const LEAST: f32 = 0.5;

/// See [`LEAST`].
const MOST: f32 = 1.1;

/// τ: time in which loads rise on what is calm (s).
const RISE: f32 = 3.0;

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
    &Shorten { springs, h, dt, rises, holds }: &Shorten,
) {
    let Softness { bias_rate, mass_scale, impulse_scale } = match segment.opposite {
        OppositeKind::Dynamic => springs.dynamic,
        _ => springs.against_static,
    };
    // Sag per load and effective mass (s²).
    let compliance = L::splat(h * impulse_scale / (mass_scale * bias_rate));
    let grows = L::splat(dt / (RISE + dt));
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
        let [calm, _, borne_0, borne_1]: [L; 4] = L::gather_quads::<2, 1>(quads, index);
        let mut borne = [borne_0, borne_1];
        let is_single = if layout.points == 2 {
            record[layout.at(1, layout.normal_mass)].select_positive(zero, one)
        } else {
            one
        };
        let grows = (calm - L::splat(CALM_TIME)).select_positive(grows, zero);
        let risen = |borne: L, load: L| {
            let grown = grows.mul_add(load - borne, borne).min(load);
            (borne + L::splat(0.5)).select_positive(grown, load)
        };
        for p in 0..layout.points {
            let mass = record[layout.at(p, layout.normal_mass)];
            let mass = mass.select_positive(mass, one);
            let load = loads[2 * p].max(zero);
            let before = borne[p];
            if holds && p == 0 && is_single.any_positive() {
                let kept = borne[0].max(L::splat(LEAST) * load).min(L::splat(MOST) * load);
                let kept = borne[0].select_positive(kept, load);
                borne[0] = is_single.select_positive(kept, risen(borne[0], load));
            } else if rises {
                borne[p] = risen(borne[p], load);
            } else {
                borne[p] = load;
            }
            let sag = compliance * borne[p] / mass;
            let at = layout.at(p, layout.normal_impulse);
            // What rises is in the impulse already: the spring gave way for it.
            let known = (before + L::splat(0.5)).select_positive(borne[p].min(before), borne[p]);
            record[at] = known.mul_add(h_lanes, record[at]).max(zero);
            let at = layout.at(p, layout.separation);
            record[at] = record[at] - sag;
            if layout.has_friction {
                let at = layout.at(p, layout.tangent_impulse);
                let part = load.select_positive(borne[p] / load, zero);
                record[at] = (part * loads[2 * p + 1]).mul_add(h_lanes, record[at]);
            }
        }
        let filled = segment.filled(batch, L::WIDTH);
        super::closed::store::<L, 1>(quads, index, filled, [calm, zero, borne[0], borne[1]]);
    }
}
