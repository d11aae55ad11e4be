//! Contacts that are hit in the coming step.
//!
//! A point is hit if it closes its gap within the step and approaches faster than resting bodies can. Forces
//! alone give a speed of dt |a| in a step. A point that bounces has to approach faster than dt (|n·a_a| +
//! |n·a_b|), and than a hundredth of dt |a_b|, and leave faster than a tenth of that. A point that only stops
//! has to approach at twice the speed: 2 dt (|a_a| + |a_b|) between two bodies that others may push in any
//! direction, and 2 dt |n·a_b| against a body that nothing pushes, so that a wall that starts to move is
//! detected.

use super::{AHEAD, BOUNCES};
use crate::constraints::kernels::pass::{Pass, PassInput};
use crate::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::constraints::records::features::{KernelFeatures, Layout};
use crate::contacts::Contact;
use crate::lanes::{BodyRow, LaneIndex, Lanes, Quad};

/// Finds contacts that are hit; see the [module](self).
pub(crate) struct Find<'a> {
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Smallest speed that forces add to a dynamic body in a step (m/s).
    pub least_gain: f32,
    /// Upper bound of the speed of all points (m/s).
    pub fastest: f32,
    /// Whether contacts may bounce.
    pub bounces: bool,
    /// Whether points that do not bounce are stopped.
    pub stops: bool,
    /// Lanes of the contacts that are hit, in order.
    pub found: &'a mut Vec<u32>,
}

impl Pass for Find<'_> {
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            find::<L>(on.rows, batches, segment, layout, on.contacts, on.increments, self);
        });
    }
}

/// Slowest approach that is stopped, as a multiple of the speed that forces give in a step (1). Slower ones are left to soft
/// contacts, as loads are: a house of cards that is built with air below its cards comes down on them in its first steps.
const FASTER: f32 = 2.0;

/// Speed that no resting body has in any direction, as a multiple of the speed that forces give body b in a step (1): faces
/// along gravity have no other threshold.
pub(super) const SLOW: f32 = 0.01;

#[inline(never)]
fn find<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    contacts: &[Contact],
    increments: &[[f32; 4]],
    &mut Find { h, dt, least_gain, fastest, bounces, stops, ref mut found }: &mut Find<'_>,
) {
    let between_dynamic = segment.pushes_a();
    let least = if between_dynamic && !bounces { 2.0 * FASTER * least_gain } else { SLOW * least_gain };
    if 2.0 * fastest <= least {
        return;
    }
    let SegmentRecords { records, contact, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride).zip(row_a.batches().zip(row_b.batches()));
    let quads: &[Quad] = bytemuck::cast_slice(increments);
    let (zero, per_step) = (L::zero(), L::splat(dt / h));
    for (batch, (record, (row_a, row_b))) in records.enumerate() {
        let (row_a, row_b): (LaneIndex<L::Index>, LaneIndex<L::Index>) = (row_a, row_b);
        // No body has moved yet.
        let b = L::gather(rows, row_b);
        let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
        let along = |x: L, y: L| record[0].mul_add(x, record[1] * y);
        let straight = along(b[0] - a[0], b[1] - a[1]);
        let velocity = |p: usize| {
            let arm = |of: usize, has: bool| if has { record[layout.at(p, of)] } else { zero };
            let (of_a, of_b) = (arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0]));
            a[2].neg_mul_add(of_a, b[2].mul_add(of_b, straight))
        };
        let fastest = (0..layout.points).fold(zero, |most, p| most.max(-velocity(p)));
        if !(fastest - L::splat(least)).any_positive() {
            continue;
        }
        let [bx, by, ..] = L::gather_quads::<1, 0>(quads, row_b);
        // Approach velocity that forces add in a substep, its bound along n, and its bound in any direction
        // (m/s).
        let size = |x: L, y: L| x.mul_add(x, y * y).sqrt();
        let positive = |x: L| x.max(-x);
        let of_b = along(bx, by);
        let (gained, along_n, most) = if between_dynamic {
            let [ax, ay, ..] = L::gather_quads::<1, 0>(quads, row_a);
            let of_a = along(ax, ay);
            (of_a - of_b, positive(of_a) + positive(of_b), size(ax, ay) + size(bx, by))
        } else {
            (-of_b, positive(of_b), positive(of_b))
        };
        let slow = per_step * L::splat(SLOW) * size(bx, by);
        let stops_at = (per_step * L::splat(FASTER) * most).max(slow);
        let bounces_at = (per_step * along_n).max(slow);
        let threshold = if bounces { bounces_at } else { stops_at };
        let fall = gained * L::splat((0.5 * dt + 0.5 * h) / h);
        let mut any = zero;
        for p in 0..layout.points {
            let (v, s) = (velocity(p), record[layout.at(p, layout.separation)]);
            let closes = (v - fall).mul_add(L::splat(AHEAD * dt), s);
            let fast = (-threshold - v).select_positive(-v, zero);
            let fast = record[layout.at(p, layout.normal_mass)].select_positive(fast, zero);
            any = any.max((-closes).select_positive(fast, zero));
        }
        if !any.any_positive() {
            continue;
        }
        let first = batch * L::WIDTH;
        let of = |x: &L, lane: usize| bytemuck::cast_slice::<L, f32>(std::slice::from_ref(x))[lane];
        for lane in (0..segment.filled(batch, L::WIDTH)).filter(|&lane| of(&any, lane) > 0.0) {
            let speed = of(&any, lane);
            let hit = &contacts[contact.entries()[first + lane] as usize];
            let e = if bounces { hit.restitution } else { 0.0 };
            let is_stopped = stops && speed > of(&stops_at, lane);
            if is_stopped || e * speed > BOUNCES * of(&bounces_at, lane) && e > 0.0 {
                found.push((segment.first_lane + first + lane) as u32);
            }
        }
    }
}

/// The smallest speed that forces add to a dynamic body in a step, and an upper bound of the speed of all
/// points (m/s); `None` if the bound is slower than any impact.
pub(crate) fn impact_speeds(rows: &[BodyRow], increments: &[[f32; 4]], h: f32, dt: f32) -> Option<[f32; 2]> {
    /// Distance of the farthest point of a body ÷ its radius of gyration (1): √3 for a rod, 2.8 for the
    /// slimmest triangle.
    const REACH: f32 = 3.0;
    let square = |v: &[f32; 4]| v[0].mul_add(v[0], v[1] * v[1]);
    let (mut fastest, mut least) = (0.0_f32, f32::INFINITY);
    for (BodyRow { velocity, delta }, increment) in rows.iter().zip(increments) {
        let [inv_mass, inv_inertia] = [velocity[3], delta[3]];
        // (ω R)²: infinite for a kinematic body that turns, NaN, which is never the maximum, for one that does not.
        let (top, turning) = (REACH.mul_add(REACH * inv_mass, f32::MIN_POSITIVE), velocity[2] * velocity[2]);
        let straight = square(velocity);
        fastest = fastest.max(straight);
        // Multiplied out, since few bodies are the fastest so far: a division for each takes twice the time of this loop.
        if turning * top > (fastest - straight) * inv_inertia {
            fastest = fastest.max(turning.mul_add(top / inv_inertia, straight));
        }
        least = least.min(if inv_mass > 0.0 { square(increment) } else { f32::INFINITY });
    }
    let least = least.sqrt() * dt / h;
    // |v| + |ω| R ≤ √2 √(v² + ω² R²)
    let fastest = (2.0 * fastest).sqrt();
    // Two points approach at most at twice that speed. No contact excluded here would pass the test in
    // `find`.
    (2.0 * fastest > SLOW * least).then_some([least, fastest])
}
