//! Shortens springs by the sag of their loads.
//!
//! # Loads that rise
//!
//! A spring that bears F does the work F dδ when it is shortened by a further dδ. Over a cycle of rocking or
//! swaying that is
//!
//! ```text
//! ∮ F dδ > 0   if δ follows F late,        0   if δ stays or is a function of F
//! ```
//!
//! so shortening a spring while its body moves drives the motion. If δ stays, the deflection is lost to the
//! damper.
//!
//! Let the preload F be the load for which a spring is shortened, and N its load. The preload follows a
//! falling load at once, which does no work that the load has not done. It follows a rising load only if the
//! contact is calm ([`super::closed`]), within τ = 3 s, a few periods of a swaying column, and only up to the
//! force λ/h of the spring in the last substep:
//!
//! ```text
//! F ← min(N, F + max(0, min(N, λ/h) − F) dt/(τ + dt))
//! ```
//!
//! At rest λ/h = N. Where a body rocks or several bodies are caught in each other, N and λ/h differ, and a spring
//! shortened for more than it carries pushes.
//!
//! Calm contacts whose preload is nearly their whole load follow at once, so leaning columns get the moment
//! that they need. So do contacts found in the first step of one of their bodies.
//!
//! # Preload that finds no room
//!
//! A shortened spring lifts what it bears. If friction holds that down, as the wall of a silo does, the separation s < 0
//! stays, and the spring carries F more than before: λ/h = F − k s > N. So a preload falls by what its spring carries beyond
//! the load:
//!
//! ```text
//! F ← F − max(0, 0.99 λ/h − N) dt/(τ_c + dt)
//! ```
//!
//! with τ_c the time after which a slow contact is calm, so that the impulses of an instant hardly count. (Without
//! the factor 0.99 rounding errors wear preloads down: columns of discs sank by 100 nm in fifteen seconds.)
//! A preload that moves nothing goes back to zero, and what was in equilibrium without preload is so again.
//! Where bodies are free, the spring carries N while it lifts them, and F stays.
//!
//! # Crushed bodies
//!
//! A contact is a spring along a fixed normal only while its bodies turn little. If the load F on the other side of a body goes,
//! F moves it by F dt²/2m in the step. So a preload is at most
//!
//! ```text
//! F ≤ 50 m ρ/dt²
//! ```
//!
//! with m the effective mass and ρ the smaller radius of gyration. At 14 substeps this shortens springs, of k = m ω², by ρ/4.
//! (A bound of the shortening itself would depend on the substeps: with one, a disc of a hundredth of the mass above it was crushed.)
//! A body of mass m on which a mass M rests reaches this bound at M/m = 50 ρ/(g dt²), 1800 with ρ = 10 cm at 60 Hz.
//! It then sinks as it would without preload. Without the bound the impulses F h of a box of 0.05 kg under one of 320 kg
//! threw it out at 104 m/s as soon as its normals turned, and a capsule under 3·10⁶ kg was spun at 10⁵ rad/s.
//!
//! # Contacts that roll
//!
//! Shortening a spring moves bodies apart, and bodies that touch at one point then roll. In a pile of discs
//! some contact slips, loads change, and the pile swells and settles forever. So a contact of one point is
//! shortened for its load once, when it is calm for the first time. After that its preload only falls.

use super::closed::{CALM_TIME, NEARLY};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::kernels::velocity::rules::{Soft, Softness};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{KernelFeatures, Layout, PartnerKind};
use crate::lanes::{LaneIndex, Lanes, Quad, prefetch_quad};

/// See the [module](self).
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct ApplyPreload {
    /// The springs.
    pub springs: Soft,
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Preloads rise slowly, and only at calm contacts.
    pub rises: bool,
    /// Contacts of one point are shortened once.
    pub once: bool,
}

/// Preload of a point that has borne more and now bears nothing (N): it is not that of a new contact, zero.
const LEAST: f32 = f32::MIN_POSITIVE;

/// τ: time constant of rising preloads at calm contacts (s).
const RISE: f32 = 3.0;

/// Prefetch distance of contacts (batches).
const AHEAD: usize = 3;

impl Pass for ApplyPreload {
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
    &ApplyPreload { springs, h, dt, rises, once }: &ApplyPreload,
) {
    let Softness { bias_rate, mass_scale, impulse_scale } = match segment.partner {
        PartnerKind::Dynamic => springs.dynamic,
        _ => springs.against_static,
    };
    // Sag per load and effective mass (s²).
    let compliance = L::splat(h * impulse_scale / (mass_scale * bias_rate));
    let [rises_in, falls_in] = [RISE, CALM_TIME].map(|tau| L::splat(dt / (tau + dt)));
    let (zero, one, nearly) = (L::zero(), L::splat(1.0), L::splat(NEARLY));
    let (h_lanes, per_substep) = (L::splat(h), L::splat(1.0 / h));
    let SegmentRecords { records, contact, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride);
    let quads: &mut [Quad] = bytemuck::cast_slice_mut(kept);
    for (batch, (record, index)) in records.zip(contact.batches::<L::Index>()).enumerate() {
        let index: LaneIndex<L::Index> = index;
        for &coming in contact.entries_of(batch + AHEAD, L::WIDTH) {
            prefetch_quad::<2, 0>(quads, coming);
        }
        let loads: [L; 4] = L::gather_quads::<2, 0>(quads, index);
        let [calm, most, borne_0, borne_1]: [L; 4] = L::gather_quads::<2, 1>(quads, index);
        let mut borne = [borne_0, borne_1];
        let rises_once = match layout.points {
            _ if !once => zero,
            2 => record[layout.at(1, layout.normal_mass)].select_positive(zero, one),
            _ => one,
        };
        let is_calm = calm - L::splat(CALM_TIME);
        let risen = |borne: L, load: L, spring: L| {
            let rise = is_calm.select_positive((load.min(spring) - borne).max(zero), zero);
            let grows = rises_once.select_positive(borne.select_positive(zero, one), rises_in);
            let grown = grows.mul_add(rise, borne).min(load);
            let grown = falls_in.neg_mul_add((nearly * spring - load).max(zero), grown).max(zero);
            (borne + L::splat(0.5)).select_positive(grown, load)
        };
        for p in 0..layout.points {
            let mass = record[layout.at(p, layout.normal_mass)];
            let mass = mass.select_positive(mass, one);
            let load = loads[2 * p].max(zero);
            let before = borne[p];
            // The preload has been subtracted from the impulse.
            let at = layout.at(p, layout.normal_impulse);
            let spring = record[at].mul_add(per_substep, before.max(zero));
            let risen = if rises { risen(before, load, spring) } else { load };
            borne[p] = risen.min(most * mass).max(before.min(L::splat(LEAST)));
            let sag = compliance * borne[p] / mass;
            // A rise is already in the impulse: the spring has deflected under it.
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
        super::closed::store::<L, 1>(quads, index, filled, [calm, most, borne[0], borne[1]]);
    }
}
