//! Preload: soft contacts that do not sag at rest.
//!
//! A spring bears a load by giving way. Each contact keeps a preload d (m), by which its springs are
//! shortened: they see the separation s − d instead of s. With d the sag of the present load, s = 0 at rest.
//!
//! # The sag
//!
//! At rest a soft row (see [`crate::engine::constraints::kernels::velocity::rules::Soft`]) neither gains nor loses impulse: γ_i λ = −m γ_m β s.
//! Both points of a contact share one d, so what they bear together decides, and
//!
//! ```text
//! sag = γ_i Σλ / (γ_m β Σm)
//! ```
//!
//! One d per contact and not per point: a preload carries force along the normal and no moment. Rocking
//! of a slender column is a mode so slow and so little damped that an integral in it grows.
//!
//! # How it follows the load
//!
//! At the start of each step
//!
//! ```text
//! d ← min(d + (goal − d) · rate, (1 + ε) goal),    goal = sag − min((1 − φ) sag, 20 µm)
//! ```
//!
//! slowly upwards, and down at once: a preload that the load does not call for would push bodies apart. The
//! part φ < 1 leaves some overlap, 20 µm at most, so that points at rest stay points. Falls by less than ε, which loads of
//! a pile make in its first steps, change nothing.
//! A contact that comes has none, and none has more than the distance within which points are contacts:
//! what sinks deeper is squeezed by more than its load.
//!
//! # Loads that come and go
//!
//! A body that rocks takes the load from one of its sides, and brings it back. A preload that falls with the load and
//! is raised under it does the work F Δd in each period: a box of 300 times the mass went on rocking for minutes on a
//! pyramid. So a contact of two points whose load has fallen waits for `WAIT` before its preload is raised again.
//!
//! # Contacts that roll
//!
//! Raised preload moves bodies apart, and on one point they roll: in a pile of discs some contact slips, loads change, d
//! falls at once where they do and is raised again, so that the pile swells and settles without an end. A contact
//! of one point is left alone once it has `HELD` of its goal,
//!
//! ```text
//! d ← min(d + max(0, ½ goal − d) · rate, (1 + ε) goal)
//! ```
//!
//! What is held is a spring as others are, which makes nothing swing. The sooner it is held the better: its rate is
//! `QUICKER` times as high. Waiting does not help there, some load always falls.
//!
//! # Where it begins
//!
//! What statics says of the load ([`Preload::weights`], from time to time) follows no motion, so that a preload taken
//! from it makes nothing swing: a contact that bears as much at least has its goal at once.
//!
//! A contact that is found in the first step of one of its bodies has all of its sag at once. If it had its goal, piles that
//! begin at rest would sink by the 20 µm that this leaves within a step, and rebound: 2.4e-4 of energy from nowhere
//! on `large_pyramid`, for 3.8e-6, which is what positions are rounded to. What is to be left comes in [`GIVING`], in
//! which preload is no more than the sag, falls by 20 µm/s and is not raised. Not in piles of bodies that were placed in
//! each other: these are not as statics has them, and a house of cards comes down.
//!
//! For the same reason two points may differ in it. Where a contact begins with impulses of statics, its points have
//! d ∓ e with
//!
//! ```text
//! e = (sag₁ − sag₀)/2,    |e| ≤ d + 20 µm
//! ```
//!
//! of their own loads, from then on: else what stands beside its middle is turned by its own weight, and bricks that
//! overhang to the limit fall (the tilt).
//!
//! # How slowly
//!
//! The rate has to be that of the slowest mode (`papers/shim.md`), of which [`crate::engine::solvers::shim::piles::modes`] has a bound. Loads do
//! not tell it: boxes in a row along the ground that are pressed against a wall by a tenth of their weight swing as
//! a column of as many does.
//!
//! # Overlap that was placed
//!
//! Bodies may be put into a world where they overlap. No load has made that overlap, and springs that see it throw
//! bodies apart in the first step: a house of cards 2 mm in each other loses its top. So a contact that is found in
//! the first step of one of its bodies begins with d = s < 0: its springs are as long as they find room for, and grow:
//!
//! ```text
//! d ← min(max(d, s) τ/(τ + dt) + 20 µm, 0)
//! ```
//!
//! with τ = 0.1 s, in which time alone they push. Under a load of statics d is the sum of that and of the sag.
//!
//! # How deep springs see it
//!
//! Springs bear a load however deep its contact is ([`crate::engine::constraints::kernels::velocity::rules::Bearing`]). Overlap that no load has made is
//! pushed out at the push speed alone: at the beginning of a step springs see a contact no deeper than
//!
//! ```text
//! u/(γ_m β) + 20 d
//! ```
//!
//! the depth from which the push speed u is all they give, and more as it has borne a load. So what is
//! thrown into another body is not thrown back.

use crate::engine::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::engine::constraints::kernels::velocity::rules::{Soft, Softness};
use crate::engine::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::engine::constraints::records::features::{KernelFeatures, Layout, OppositeKind};
use crate::engine::lanes::{Lanes, Quad, prefetch_quad};
use crate::engine::params::SPECULATIVE_DISTANCE;

/// Follows the load and shortens the springs; see the [module](self).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Preload<'a> {
    /// The springs.
    pub springs: Soft,
    /// φ: part of the sag that is taken away (1).
    pub share: f32,
    /// Share of the way to the sag per step (1).
    pub rate: f32,
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// What contacts bear in statics (N), where that has just been found; else empty. `[contacts]`
    pub weights: &'a [f32],
}

/// Depth that springs see beyond that of the push speed, per preload (1).
const EARNED: f32 = 20.0;

/// Part of its goal from which on the preload of a contact of one point stays as it is (1). In a pile of 2000 discs 0.9
/// leaves less overlap and twice the speed after 500 steps.
const HELD: f32 = 0.5;

/// Time in which preload follows the load on two points over that on one (1).
const QUICKER: f32 = 4.0;

/// Most overlap that is left of a sag (m): 1/250 of the slop, and far more than a separation is rounded to.
pub(crate) const LEFT: f32 = 2e-5;

/// Time in which 20 µm of overlap come where preload began with all of the sag (s). Four times as long, and raised
/// meanwhile, creates two to three times the energy.
pub const GIVING: f32 = 1.0;

/// τ: time in which overlap goes that a contact was placed with (s). Longer, the card house falls at 30 steps a
/// second; shorter, it is thrown over at 240.
const PLACED_TIME: f32 = 0.1;

/// ε: part by which a load may fall without being one that comes and goes (1).
const STEADY: f32 = 0.005;

/// Time after the fall of a load in which preload is not raised (s). Twice as long overlaps more, and rests little sooner.
const WAIT: f32 = 1.0;

/// Batches between asking for contacts and reading them.
const AHEAD: usize = 3;

/// Part by which an impulse may be short of another by rounding (1).
const ROUNDED: f32 = 1e-5;

impl Pass for Preload<'_> {
    fn traffic(&self, layout: &Layout, _: OppositeKind) -> PerLane {
        // Separation, mass, impulse and preload of each point, and the index of the contact.
        let (read, written) = (1 + 4 * layout.points, 2 * layout.points);
        PerLane { floats_read: read, floats_written: written, ..PerLane::default() }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            preload_segment::<L>(batches, segment, layout, on.kept.contacts(), self);
        });
    }
}

#[inline(never)]
fn preload_segment<L: Lanes>(
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    kept: &mut [f32],
    &Preload { springs, share, rate, h, dt, weights }: &Preload<'_>,
) {
    let Softness { bias_rate, mass_scale, impulse_scale } = match segment.opposite {
        OppositeKind::Dynamic => springs.dynamic,
        _ => springs.against_static,
    };
    // Sag per impulse and effective mass (s).
    let compliance = L::splat(impulse_scale / (mass_scale * bias_rate));
    // Depth at which springs reach the push speed (m).
    let deepest = L::splat(springs.push_speed / (mass_scale * bias_rate));
    let left = L::splat(1.0 - share);
    // Without preload, all of the sag is left.
    let most_left = L::splat(if share > 0.0 { LEFT } else { f32::INFINITY });
    // dt/(dt + T) for a time T that is shorter by the factor.
    let quick = L::splat(QUICKER * rate / (QUICKER - 1.0).mul_add(rate, 1.0));
    let kept_share = L::splat(PLACED_TIME / (PLACED_TIME + dt));
    let (h, rate, zero) = (L::splat(h), L::splat(rate), L::zero());
    let SegmentRecords { records, contact, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride);
    for (batch, (record, index)) in records.zip(contact.batches::<L::Index>()).enumerate() {
        let filled = &index.entries()[..segment.filled(batch, L::WIDTH)];
        for &coming in contact.entries_of(batch + AHEAD, L::WIDTH) {
            prefetch_quad::<1, 0>(bytemuck::cast_slice(kept), coming);
        }
        let (mut impulse, mut mass, mut lowest) = (zero, zero, zero);
        for p in 0..layout.points {
            lowest = lowest.min(record[layout.at(p, layout.separation)]);
            impulse = impulse + record[layout.at(p, layout.normal_impulse)];
            mass = mass + record[layout.at(p, layout.normal_mass)];
        }
        // A lane without a contact has no mass, nor has a point that is not there.
        let sag = |impulse: L, mass: L| {
            let mass = mass.select_positive(mass, L::splat(1.0));
            (compliance * impulse / mass).min(L::splat(SPECULATIVE_DISTANCE))
        };
        let goal = |impulse: L| {
            let sag = sag(impulse, mass);
            sag - (left * sag).min(most_left)
        };
        let second = if layout.points == 2 { record[layout.at(1, layout.normal_mass)] } else { zero };
        let quads: &mut [Quad] = bytemuck::cast_slice_mut(kept);
        let [mut last, mut wait, mut tilt, lead] = L::gather_quads::<1, 0>(quads, index);
        if !weights.is_empty() {
            let mut weight = zero;
            let lanes: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut weight));
            filled.iter().zip(lanes).for_each(|(&contact, lane)| *lane = weights[contact as usize]);
            let borne = h * weight;
            let is_borne = L::splat(ROUNDED).mul_add(borne, impulse) - borne;
            let begins_with = (-wait).select_positive(sag(borne, mass), goal(borne));
            let at_rest = begins_with + last.min(zero);
            if layout.points == 2 {
                let of = |p: usize| {
                    sag(record[layout.at(p, layout.normal_impulse)], record[layout.at(p, layout.normal_mass)])
                };
                let begins = last.select_positive(zero, weight);
                tilt = begins.select_positive(L::splat(0.5) * (of(1) - of(0)), tilt);
            }
            let is_borne = weight.select_positive(is_borne, zero);
            last = is_borne.select_positive(last.max(at_rest), last);
        }
        wait = last.select_positive(wait, wait.max(zero));
        last = last.max(lowest);
        let (placed, borne) = (last.min(zero), last.max(zero));
        let placed = kept_share.mul_add(placed, L::splat(LEFT)).min(zero);
        let most = goal(impulse);
        let gives = -wait;
        let given =
            gives.select_positive((borne - L::splat(LEFT * dt / GIVING)).min(sag(impulse, mass)), zero);
        let kept_at_most = (L::splat(1.0 + STEADY) * most).max(given);
        let falls = gives.select_positive(zero, second.select_positive(borne - kept_at_most, zero));
        let less = gives.select_positive((wait + L::splat(dt)).min(zero), (wait - L::splat(dt)).max(zero));
        let wait = falls.select_positive(L::splat(WAIT), less);
        let held = second.select_positive(most, L::splat(HELD) * most);
        let raised = gives.select_positive(zero, rate);
        let rate = second.select_positive(wait.select_positive(zero, raised), quick);
        let borne = rate.mul_add((held - borne).max(zero), borne);
        let preload = (borne + placed).min(kept_at_most);
        let (placed, borne) = (preload.min(zero), preload.max(zero));
        let widest = second.select_positive(borne.select_positive(borne + L::splat(LEFT), zero), zero);
        let tilt = tilt.min(widest).max(-widest);
        for p in 0..layout.points {
            let at = layout.at(p, layout.separation);
            let borne = if p == 0 { borne - tilt } else { borne + tilt };
            let depth = L::splat(EARNED).mul_add(borne, deepest);
            record[at] = (record[at] - placed).max(-depth) - borne;
        }
        if filled.len() == L::WIDTH {
            L::scatter_quads::<1, 0>(quads, index, [preload, wait, tilt, lead]);
            continue;
        }
        let [preload, wait, tilt] = &[preload, wait, tilt];
        let lanes = |x| bytemuck::cast_slice::<L, f32>(std::slice::from_ref(x));
        for (lane, &contact) in filled.iter().enumerate() {
            let [preload, wait, tilt] = [preload, wait, tilt].map(|x| lanes(x)[lane]);
            quads[contact as usize].0[..3].copy_from_slice(&[preload, wait, tilt]);
        }
    }
}
