//! Impacts: bodies that are about to hit each other, or have, bounce before the step is solved.
//!
//! # Newton's law with Coulomb's friction
//!
//! A point that comes in at the normal velocity v < 0 shall leave at the rebound v⁺ of
//! [`crate::engine::constraints::impacts::restitution`], e |v| but for the acceleration of flight. Its impulses N along n and T along t
//! are those of the whole impact, so that friction is bounded by all of N:
//!
//! ```text
//! k_nn N + k_nt T = v⁺ − v_n       k_nt = I_a⁻¹ (r_a × n)(r_a × t) + I_b⁻¹ (r_b × n)(r_b × t)
//! k_nt N + k_tt T = −v_t           if |T| ≤ µ N: the point sticks
//!               T = ±µ N           else, with the sign of the T that would stop it
//! ```
//!
//! A disc has k_nt = 0; a corner does not, and is turned by both. Both rows are solved at once.
//!
//! # Friction takes energy
//!
//! Both laws together may make energy: a rod at 45° that comes in along its normal is turned so that its end would slip back, and the
//! impulse that keeps it from slipping pushes it off (Kane). The work of a point's impulses, from v⁻ before the wave to v⁺ after it, is
//!
//! ```text
//! W = ½ N (v_n⁻ + v_n⁺) + ½ T (v_t⁻ + v_t⁺),      Σ W = K⁺ − K⁻
//! ```
//!
//! so that a wave makes none if W ≤ 0 at each of its points. The first part is −½ N L with L = |v_n⁻| − v⁺, or what height makes of it.
//! With v_n⁺ as Newton has it, W is a convex function of T, and T = 0 is no gain. So T is bounded to where W ≤ 0, between both roots of
//!
//! ```text
//! d T² + (k_nn (v_t⁻ + u) + L k_nt) T − L w ≤ 0,      d = k_nn k_tt − k_nt²
//! ```
//!
//! with w the v_n that the point has to gain from neither of its impulses, and u the v_t that it leaves at with T = 0. Impulses stay within the
//! cone, which is convex. Where Newton and Coulomb take energy, they stay as they are. See also `rebounds.rs`.
//!
//! # When in the step
//!
//! In flight, semi-implicit Euler follows a parabola with w = v − a h/2 in the place of v. From the gap s it is at the surface
//! after t, with the speed w₁, bounces, and is from then on on the parabola that has at the beginning of the step
//!
//! ```text
//! w₁ = √(w² + 2 a s)   t = 2 s/(w₁ − w)   v⁺ = e w₁ + a t + a h/2   s⁺ = s − t (v⁺ − v)
//! ```
//!
//! So bodies that are given v⁺ and put back by t Δv fly as if hit at t, in the coming step or (t < 0, an overlap) in the
//! last one: a bounce is no shorter for being seen early, and none is too low to be one. Without it, a ball at 20 mm that
//! rises to 8 does not bounce. Beyond the end of the step, and deeper than a step, it is at the end and at the beginning, with as
//! much of the energy of height. Bodies that are both free would be put back by what arms of the beginning do not know of, which
//! changes angular momentum: there only round shapes are hit at t, whose arms are those of that time. Solvers that find
//! velocities from positions, or that are rivals, bounce at the beginning: `timed`.
//!
//! # Waves
//!
//! Which points bounce, and how fast, is decided at the beginning of a wave: those that come in. All of
//! them are solved together, by Gauss–Seidel on accumulated impulses, so that a box that lands flat bounces
//! flat. What comes in then makes the next wave: through a row of balls an impact runs ball by ball.
//!
//! # What comes in
//!
//! A point is an impact if it closes its gap within the step, and faster than what forces alone make
//! of rest in one step, dt (|n·a_a| + |n·a_b|): a slower one cannot be told from one that rests. Where something round
//! comes in, n is that of the moment of touch (`touch.rs`).

use crate::engine::constraints::impacts::restitution::{largest, point, rebound};
use crate::engine::constraints::impacts::touch::Round;
use crate::engine::constraints::kernels::pass::{Pass, PassInput, PerLane};
use crate::engine::constraints::records::batches::{Batches, Segment, SegmentRecords};
use crate::engine::constraints::records::bounces::Bounces;
use crate::engine::constraints::records::features::{KernelFeatures, Layout, OppositeKind};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneIndex, Lanes};
use glam::Vec2;

/// Reads what impacts need of contacts and bodies, once per step.
pub(crate) struct Load {
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Impacts are at their times.
    pub timed: bool,
}

/// Begins a wave: finds what comes in, and how fast it shall leave.
pub(crate) struct Wave {
    /// Substep (s).
    pub h: f32,
    /// Step (s).
    pub dt: f32,
    /// Nothing has bounced yet.
    pub is_first: bool,
    /// Whether something comes in: greater than zero.
    pub found: f32,
}

/// One Gauss–Seidel sweep over the points of a wave.
pub(crate) struct Solve {
    /// Impacts are at their times.
    pub timed: bool,
    /// The fastest that something shall leave at (m/s).
    pub fastest: f32,
    /// There are no impulses so far.
    pub is_first: bool,
    /// Else as if nothing had any.
    pub with_friction: bool,
    /// Greatest change of a velocity, as a part of that (1).
    pub change: f32,
}

/// Adds the impulses of a wave to those of the step.
pub(crate) struct Book;

/// Puts bodies back to where they come from, had they always flown as they leave.
pub(crate) struct PutBack;

/// What has bounced leaves by itself: it is not pushed out as well.
pub(crate) struct Leave;

/// Notes the contacts that have bounced.
pub(crate) struct Bounced<'a> {
    /// Whether it has. `[contacts]`
    pub found: &'a mut [bool],
}

/// Side record of an impact: a (m/s²), e (1), threshold (m/s), whether it is at its time (1, [`TURNED_ONCE`] if in the frame of then); then per point target (m/s; zero where
/// nothing comes in), N and T (N·s), its time (s), whether it has bounced in any wave (1), and before the wave v_t and
/// what of |v_n| it shall lose (m/s). See [`Bounces`].
pub(crate) const FIRST: usize = 4;
/// See [`FIRST`].
pub(crate) const PER_POINT: usize = 7;

/// Lane vectors of a side record.
pub(super) const fn stride(points: usize) -> usize {
    FIRST + PER_POINT * points
}

/// Of an impact that has the frame of its time.
const TURNED_ONCE: f32 = 2.0;

/// Part of v⁺ that friction may gain by rounding (1).
const ROUNDING: f32 = 1e-6;

/// A point is looked at for a tenth of its way further than it gets in the step (1).
pub(crate) const AHEAD: f32 = 1.1;

/// Round shapes that come in along the normal of the beginning, but touch later, have the frame of then up to so many steps (1).
pub(crate) const TURNED: f32 = 2.0;

impl Pass for Load {
    fn traffic(&self, _: &Layout, opposite: OppositeKind) -> PerLane {
        PerLane { halves: 0, ..PerLane::of_bodies(1, FIRST, opposite) }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.bounces.reserve(on.batches.lanes(), stride(F::POINTS));
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            load::<L>(batches, segment, layout, on.bounces, on.contacts, on.increments, self);
        });
    }
}

impl Pass for Wave {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        let read = 2 + FIRST + layout.points * (layout.arms() + 1);
        PerLane { halves: 0, ..PerLane::of_bodies(read, PER_POINT * layout.points, opposite) }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            wave::<L>(on.rows, batches, segment, layout, on.bounces, on.contacts, on.increments, self);
        });
    }
}

impl Pass for Solve {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        let read = 3 + layout.points * (layout.arms() + 2 + PER_POINT);
        let once = PerLane::of_bodies(read, 2 * layout.points, opposite);
        PerLane { rows: layout.points * once.rows, halves: layout.points * once.halves, ..once }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            solve::<L>(on.rows, batches, segment, layout, on.bounces, self);
        });
    }
}

impl Pass for Book {
    fn traffic(&self, layout: &Layout, _: OppositeKind) -> PerLane {
        let impulses = 2 * layout.points;
        PerLane { floats_read: 1 + impulses, floats_written: impulses, ..PerLane::default() }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            let contact = batches.records_of::<L>(segment, layout).contact;
            let sides = on.bounces.of::<L>(segment);
            for (batch, (side, contact)) in sides.zip(contact.batches::<L::Index>()).enumerate() {
                let floats: &[f32] = bytemuck::cast_slice(side);
                let filled = &contact.entries()[..segment.filled(batch, L::WIDTH)];
                for (lane, &contact) in filled.iter().enumerate() {
                    for p in 0..layout.points {
                        let of =
                            |quantity: usize| floats[(FIRST + PER_POINT * p + quantity) * L::WIDTH + lane];
                        let [normal, tangent] = &mut on.contacts[contact as usize].step_impulse[p];
                        (*normal, *tangent) = (*normal + of(1), *tangent + of(2));
                    }
                }
            }
        });
    }
}

/// The first quantities of a lane.
fn side_of(
    normal: Vec2,
    restitution: f32,
    increments: &[[f32; 4]],
    rows: [u32; 2],
    &Load { h, dt, timed }: &Load,
) -> [f32; FIRST] {
    let [a, b] = rows.map(|row| {
        let [x, y, ..] = increments[row as usize];
        normal.dot(Vec2::new(x, y)) / h
    });
    [a - b, restitution, dt * (a.abs() + b.abs()), if timed { 1.0 } else { 0.0 }]
}

impl Pass for PutBack {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        let read = 4 + layout.points * (layout.arms() + PER_POINT);
        PerLane { halves: 0, ..PerLane::of_bodies(read, layout.points, opposite) }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            put_back::<L>(on.rows, batches, segment, layout, on.bounces);
        });
    }
}

impl Pass for Leave {
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        let read = 2 + layout.points * (layout.arms() + 2);
        PerLane { halves: 0, ..PerLane::of_bodies(read, layout.points, opposite) }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            let SegmentRecords { records, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
            let records = records.chunks_exact_mut(layout.stride).zip(row_a.batches().zip(row_b.batches()));
            for (side, (record, (row_a, row_b))) in on.bounces.of::<L>(segment).zip(records) {
                for p in 0..layout.points {
                    let bounced = side[FIRST + PER_POINT * p + 4];
                    if largest(bounced) > 0.0 {
                        let [_, gap] = point::<L>(on.rows, record, layout, p, row_a, row_b);
                        let raised = bounced.select_positive(gap.min(L::zero()), L::zero());
                        let at = layout.at(p, layout.separation);
                        record[at] = record[at] - raised;
                    }
                }
            }
        });
    }
}

impl Pass for Bounced<'_> {
    fn traffic(&self, layout: &Layout, _: OppositeKind) -> PerLane {
        PerLane { floats_read: 1 + layout.points, ..PerLane::default() }
    }

    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>) {
        on.batches.each_segment(F::layout, |batches, segment, layout| {
            let contact = batches.records_of::<L>(segment, layout).contact;
            let sides = on.bounces.of::<L>(segment);
            for (batch, (side, contact)) in sides.zip(contact.batches::<L::Index>()).enumerate() {
                let floats: &[f32] = bytemuck::cast_slice(side);
                let filled = &contact.entries()[..segment.filled(batch, L::WIDTH)];
                for (lane, &contact) in filled.iter().enumerate() {
                    let has = |p| floats[(FIRST + PER_POINT * p + 4) * L::WIDTH + lane] > 0.0;
                    self.found[contact as usize] = (0..layout.points).any(has);
                }
            }
        });
    }
}

#[inline(never)]
fn put_back<L: Lanes>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
) {
    let pushes_a = segment.pushes_a();
    let SegmentRecords { records, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact(layout.stride);
    let rows_of = row_a.batches::<L::Index>().zip(row_b.batches::<L::Index>());
    for (side, (record, (row_a, row_b))) in bounces.of::<L>(segment).zip(records.zip(rows_of)) {
        for p in 0..layout.points {
            let at = FIRST + PER_POINT * p;
            if largest(side[at]) == 0.0 {
                continue;
            }
            side[at + 4] = side[at].select_positive(L::splat(1.0), side[at + 4]);
            let (side, record): (&[f32], &[f32]) = (bytemuck::cast_slice(side), bytemuck::cast_slice(record));
            for lane in 0..L::WIDTH {
                let of = |vector: usize| side[vector * L::WIDTH + lane];
                let [is_hit, n, t, time] = [0, 1, 2, 3].map(|k| of(at + k));
                if is_hit == 0.0 || time == 0.0 {
                    continue;
                }
                let of = |vector: usize| record[vector * L::WIDTH + lane];
                let (x, y) = (of(0).mul_add(n, of(1) * t), of(1).mul_add(n, -(of(0) * t)));
                let mut put = |row: u32, sign: f32, arm: usize, has_arm: bool| {
                    let BodyRow { velocity, delta } = &mut rows[row as usize];
                    let arm = |axis: usize| if has_arm { of(layout.at(p, arm) + axis) } else { 0.0 };
                    let turn = arm(0).mul_add(n, arm(1) * t);
                    let back = -sign * time;
                    delta[0] += back * velocity[3] * x;
                    delta[1] += back * velocity[3] * y;
                    delta[2] += back * delta[3] * turn;
                };
                put(row_b.entries()[lane], 1.0, layout.arm_b, layout.has_arms[0]);
                if pushes_a {
                    put(row_a.entries()[lane], -1.0, layout.arm_a, layout.has_arms[1]);
                }
            }
        }
    }
}

#[inline(never)]
fn load<L: Lanes>(
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    contacts: &[Contact],
    increments: &[[f32; 4]],
    load: &Load,
) {
    // Between two bodies that move, arms would have to end at one point at that time.
    let load = &Load { timed: load.timed && !segment.pushes_a(), ..*load };
    let SegmentRecords { contact, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let indices = contact.batches::<L::Index>().zip(row_a.batches::<L::Index>().zip(row_b.batches()));
    for (batch, (side, (contact, (row_a, row_b)))) in bounces.of::<L>(segment).zip(indices).enumerate() {
        let row_b: LaneIndex<L::Index> = row_b;
        let floats: &mut [f32] = bytemuck::cast_slice_mut(side);
        floats.fill(0.0);
        // Lanes without a contact have e = 0, and bounce as little as contacts that have.
        for (lane, &contact) in contact.entries()[..segment.filled(batch, L::WIDTH)].iter().enumerate() {
            let rows = [row_a.entries()[lane], row_b.entries()[lane]];
            let Contact { manifold, restitution, .. } = &contacts[contact as usize];
            let side = side_of(manifold.normal, *restitution, increments, rows, load);
            for (k, value) in side.into_iter().enumerate() {
                floats[k * L::WIDTH + lane] = value;
            }
        }
    }
}

#[allow(clippy::too_many_arguments)]
#[inline(never)]
fn wave<L: Lanes>(
    rows: &[BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    contacts: &[Contact],
    increments: &[[f32; 4]],
    times: &mut Wave,
) {
    let (h, dt) = (times.h, times.dt);
    let is_held = !segment.pushes_a();
    let SegmentRecords { records, contact, row_a, row_b } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride).zip(row_a.batches().zip(row_b.batches()));
    let records = records.zip(contact.batches::<L::Index>());
    let mut most = L::zero();
    for (batch, (side, ((record, (row_a, row_b)), contact))) in
        bounces.of::<L>(segment).zip(records).enumerate()
    {
        let (row_a, row_b): (LaneIndex<L::Index>, LaneIndex<L::Index>) = (row_a, row_b);
        let mut fastest = targets::<L>(rows, record, layout, side, [row_a, row_b], times);
        if fastest.any_positive() {
            let mut is_turned = false;
            for (lane, &index) in contact.entries()[..segment.filled(batch, L::WIDTH)].iter().enumerate() {
                let comes_in = bytemuck::cast_slice::<L, f32>(std::slice::from_ref(&fastest))[lane] > 0.0;
                let contact = &contacts[index as usize];
                let is_first = bytemuck::cast_slice::<L, f32>(&side[3..4])[lane] < TURNED_ONCE;
                let Some(round) = Round::of(contact, is_held).filter(|_| comes_in && is_first) else {
                    continue;
                };
                let ends = [row_a, row_b].map(|row| row.entries()[lane]);
                let bodies = ends.map(|row| &rows[row as usize]);
                let Some(frame) = round.frame(bodies, [-AHEAD * dt, TURNED * dt]) else { continue };
                let floats: &mut [f32] = bytemuck::cast_slice_mut(record);
                frame.write_record(layout, bodies, |vector, value| floats[vector * L::WIDTH + lane] = value);
                let floats: &mut [f32] = bytemuck::cast_slice_mut(side);
                let load = &Load { h, dt, timed: true };
                let mut values = side_of(frame.normal, contact.restitution, increments, ends, load);
                values[3] = TURNED_ONCE;
                for (k, value) in values.into_iter().enumerate() {
                    floats[k * L::WIDTH + lane] = value;
                }
                is_turned = true;
            }
            if is_turned {
                fastest = targets::<L>(rows, record, layout, side, [row_a, row_b], times);
            }
        }
        most = most.max(fastest);
    }
    times.found = largest(most).max(times.found);
}

/// Writes how fast each point of a batch shall leave, zero where nothing comes in; returns the fastest (m/s).
#[inline(always)]
fn targets<L: Lanes>(
    rows: &[BodyRow],
    record: &[L],
    layout: &Layout,
    side: &mut [L],
    [row_a, row_b]: [LaneIndex<L::Index>; 2],
    &Wave { h, dt, is_first, .. }: &Wave,
) -> L {
    let (zero, dt_lanes) = (L::zero(), L::splat(dt));
    let earliest = L::splat(if is_first { -dt } else { 0.0 });
    let (a, e, threshold) = (side[0], side[1], side[2]);
    let mut most = zero;
    for p in 0..layout.points {
        let [v, s] = point::<L>(rows, record, layout, p, row_a, row_b);
        // Where it would be at the end of the step, and further.
        let fall = a * L::splat(0.5 * (dt + h));
        let closes = (v - fall).mul_add(dt_lanes * L::splat(AHEAD), s);
        let energy = L::splat(0.5) * v * v + a * (s - v * L::splat(0.5 * h));
        let mut target = rebound(e * e * energy, a, s, h);
        let mut time = zero;
        if side[3].any_positive() {
            let w = v - a * L::splat(0.5 * h);
            let square = w.mul_add(w, L::splat(2.0) * a * s);
            let touch = L::splat(2.0) * s / (square.max(zero).sqrt() - w);
            // What is deeper has been so before, or is hit because another was.
            let touch = (touch - earliest).min(square).min(side[3]).select_positive(touch, zero);
            time = touch.min(dt_lanes);
            let half = L::splat(0.5) * a * time;
            let (gap, then) = ((w - half).mul_add(time, s), w - L::splat(2.0) * half);
            let fall = L::splat(2.0) * a * gap;
            let left = e * e * then.mul_add(then, fall) - fall;
            let timed = left.max(zero).sqrt() + L::splat(2.0) * half + a * L::splat(0.5 * h);
            target = (time * time).select_positive(timed, target);
        }
        let is_fast = (-threshold - v).select_positive(target, zero);
        let comes_in = (-closes).select_positive(is_fast, zero);
        let target = e.select_positive(comes_in, zero);
        // A point that is not there has no mass.
        let target = record[layout.at(p, layout.normal_mass)].select_positive(target, zero);
        let at = FIRST + PER_POINT * p;
        (side[at], side[at + 1], side[at + 2], side[at + 3]) = (target, zero, zero, time);
        if layout.has_friction {
            let b = L::gather(rows, row_b);
            let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
            side[at + 5] = slip(record, layout, p, [&a, &b]);
            side[at + 6] = (-v - target).max(zero) + L::splat(ROUNDING) * target;
        }
        most = most.max(target);
    }
    most
}

/// Accumulated impulses along n and t (N·s) after which a point has gained `wanted` (m/s), or as much of it along t
/// as friction lets it; see the [module](self). `k`: k_nn, k_tt, k_nt (1/kg); `mass`: 1/k_nn, zero for a point that is
/// not there; `old`: those so far.
#[inline(always)]
pub(crate) fn rough_impulses<L: Lanes>(
    [k_nn, k_tt, k_nt]: [L; 3],
    mass: L,
    mu: L,
    [old_n, old_t]: [L; 2],
    [wanted_n, wanted_t]: [L; 2],
) -> [L; 2] {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let smooth = [mass.mul_add(wanted_n, old_n).max(zero), zero];
    // Velocities that are to be made, from none of the impulses so far.
    let want_n = k_nn.mul_add(old_n, k_nt.mul_add(old_t, wanted_n));
    let want_t = k_nt.mul_add(old_n, k_tt.mul_add(old_t, wanted_t));
    let determinant = k_nn.mul_add(k_tt, -(k_nt * k_nt));
    let safe = determinant.select_positive(determinant, one);
    let stick =
        [k_tt.mul_add(want_n, -(k_nt * want_t)) / safe, k_nn.mul_add(want_t, -(k_nt * want_n)) / safe];
    let size = stick[1].max(-stick[1]);
    let slope = stick[1].select_positive(mu, -mu);
    // Along the edge of the cone N meets k_nn ± µ k_nt; where that is not positive the
    // edge leads nowhere (Painlevé), and N is that without friction.
    let along = slope.mul_add(k_nt, k_nn);
    let edge_n = (want_n / along.select_positive(along, one)).max(zero);
    let edge_n = along.select_positive(edge_n, (want_n * mass).max(zero));
    let slides = mu.neg_mul_add(stick[0], size);
    let slides = stick[0].select_positive(slides, one);
    let rough = [slides.select_positive(edge_n, stick[0]), slides.select_positive(slope * edge_n, stick[1])];
    std::array::from_fn(|axis| mu.select_positive(rough[axis], smooth[axis]))
}

/// Velocity of b against a along t (m/s).
#[inline(always)]
fn slip<L: Lanes>(record: &[L], layout: &Layout, p: usize, [a, b]: [&[L; 8]; 2]) -> L {
    let arm = |first: usize, has: bool| if has { record[layout.at(p, first) + 1] } else { L::zero() };
    let (of_a, of_b) = (arm(layout.arm_a, layout.has_arms[1]), arm(layout.arm_b, layout.has_arms[0]));
    let along = record[1].mul_add(b[0] - a[0], -(record[0] * (b[1] - a[1])));
    a[2].neg_mul_add(of_a, b[2].mul_add(of_b, along))
}

/// Impulses `rough` along n and t (N·s), with less friction where they would make energy; see the [module](self). `wanted`: what
/// is to be gained from neither impulse (m/s); `slip`: v_t⁻ (m/s); `lost`: L, if positive (m/s).
#[inline(always)]
fn lossy_impulses<L: Lanes>(
    [k_nn, k_tt, k_nt]: [L; 3],
    rough: [L; 2],
    [wanted_n, wanted_t]: [L; 2],
    [slip, lost]: [L; 2],
) -> [L; 2] {
    let (zero, half) = (L::zero(), L::splat(0.5));
    let d = k_nn.mul_add(k_tt, -(k_nt * k_nt));
    let half_b = half * lost.mul_add(k_nt, k_nt.mul_add(wanted_n, k_nn * (slip - wanted_t)));
    let c = lost * wanted_n.max(zero);
    let root = half_b.mul_add(half_b, d * c).max(zero).sqrt();
    let safe = d.select_positive(d, L::splat(1.0));
    let (least, most) = ((-(half_b + root) / safe).min(zero), ((root - half_b) / safe).max(zero));
    let tangent = rough[1].min(most).max(least);
    let less = rough[1] - tangent;
    let is_less = d.select_positive(less.max(-less), zero);
    let normal = (k_nt.neg_mul_add(tangent, wanted_n) / k_nn.select_positive(k_nn, L::splat(1.0))).max(zero);
    let lossy = [normal, normal.select_positive(tangent, zero)];
    std::array::from_fn(|axis| is_less.select_positive(lossy[axis], rough[axis]))
}

/// Accumulated impulses of both points of smooth contacts together, and where these are (positive): one after the other
/// takes hundreds of sweeps where a face is hit beside the centre.
#[inline(always)]
fn pair_impulses<L: Lanes>(
    rows: &[BodyRow],
    record: &[L],
    layout: &Layout,
    side: &[L],
    row_a: LaneIndex<L::Index>,
    row_b: LaneIndex<L::Index>,
) -> ([L; 2], L) {
    /// Points that are nearly one are solved one after the other (1).
    const APART: f32 = 1e-5;
    let (zero, one) = (L::zero(), L::splat(1.0));
    let b = L::gather(rows, row_b);
    let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
    let arm = |p: usize, first: usize, has: bool| if has { record[layout.at(p, first)] } else { zero };
    let arms =
        [0, 1].map(|p| [arm(p, layout.arm_a, layout.has_arms[1]), arm(p, layout.arm_b, layout.has_arms[0])]);
    let k = |p: usize, q: usize| {
        let turn_a = a[7] * arms[p][0] * arms[q][0];
        (b[7] * arms[p][1]).mul_add(arms[q][1], turn_a + (a[3] + b[3]))
    };
    let [k_00, k_11, k_01] = [k(0, 0), k(1, 1), k(0, 1)];
    let of = |p: usize, quantity: usize| side[FIRST + PER_POINT * p + quantity];
    let old = [of(0, 1), of(1, 1)];
    let wanted = [0, 1].map(|p| of(p, 0) - point::<L>(rows, record, layout, p, row_a, row_b)[0]);
    let w = [
        k_00.mul_add(old[0], k_01.mul_add(old[1], wanted[0])),
        k_01.mul_add(old[0], k_11.mul_add(old[1], wanted[1])),
    ];
    // Of k_pq = m + Σ i r_p r_q, as a sum of what is positive: none of it cancels.
    let apart = [0, 1].map(|body| arms[0][body] - arms[1][body]);
    let wedge = arms[0][0].mul_add(arms[1][1], -(arms[0][1] * arms[1][0]));
    let bodies = (a[7] * apart[0]).mul_add(apart[0], b[7] * apart[1] * apart[1]);
    let determinant = (a[3] + b[3]).mul_add(bodies, a[7] * b[7] * wedge * wedge);
    let is_solved = determinant - L::splat(APART) * k_00 * k_11;
    let safe = is_solved.select_positive(determinant, one);
    let n = [k_11.mul_add(w[0], -(k_01 * w[1])) / safe, k_00.mul_add(w[1], -(k_01 * w[0])) / safe];
    let positive = |yes: L, value: L| yes.select_positive(value, zero);
    let both = n[0].min(n[1]);
    // Where one would have to pull, the other acts alone: the first, if that is enough for the second.
    let alone = [w[0] / is_solved.select_positive(k_00, one), w[1] / is_solved.select_positive(k_11, one)];
    let enough = alone[0].min(k_01.mul_add(alone[0], -w[1]));
    let first = positive(enough, alone[0]);
    let second = enough.select_positive(zero, alone[1].max(zero));
    let pair = [both.select_positive(n[0], first), both.select_positive(n[1], second)];
    (pair, is_solved)
}

#[inline(never)]
fn solve<L: Lanes>(
    rows: &mut [BodyRow],
    batches: &mut Batches,
    segment: &Segment,
    layout: &Layout,
    bounces: &mut Bounces,
    &mut Solve { timed, fastest, is_first, with_friction, ref mut change }: &mut Solve,
) {
    let (pushes_a, has_friction) = (segment.pushes_a(), layout.has_friction && with_friction);
    let SegmentRecords { records, row_a, row_b, .. } = batches.records_of::<L>(segment, layout);
    let records = records.chunks_exact_mut(layout.stride).zip(row_a.batches().zip(row_b.batches()));
    let (zero, one, fastest) = (L::zero(), L::splat(1.0), L::splat(fastest));
    let mut most = zero;
    for (side, (record, (row_a, row_b))) in bounces.of::<L>(segment).zip(records) {
        let hit: [L; 2] =
            std::array::from_fn(|p| if p < layout.points { side[FIRST + PER_POINT * p] } else { zero });
        if is_first {
            for p in 0..layout.points {
                let at = FIRST + PER_POINT * p;
                (side[at + 1], side[at + 2]) = (zero, zero);
            }
        }
        let mut both = hit[0].min(hit[1]);
        if has_friction {
            both = record[layout.friction].select_positive(zero, both);
        }
        let pair = if both.any_positive() {
            let (pair, is_solved) = pair_impulses::<L>(rows, record, layout, side, row_a, row_b);
            both = is_solved.min(both);
            pair
        } else {
            [zero; 2]
        };
        for p in 0..layout.points {
            let at = FIRST + PER_POINT * p;
            let target = hit[p];
            if largest(target) == 0.0 {
                continue;
            }
            let [vn, _] = point::<L>(rows, record, layout, p, row_a, row_b);
            let b = L::gather(rows, row_b);
            let a = if layout.a_has_row { L::gather(rows, row_a) } else { [zero; 8] };
            let n = [record[0], record[1]];
            let arms = |first: usize, has: bool| {
                if has { [record[layout.at(p, first)], record[layout.at(p, first) + 1]] } else { [zero; 2] }
            };
            let (arm_b, arm_a) =
                (arms(layout.arm_b, layout.has_arms[0]), arms(layout.arm_a, layout.has_arms[1]));
            let [old_n, old_t] = [side[at + 1], side[at + 2]];
            let mass = record[layout.at(p, layout.normal_mass)];
            let k_nn = one / mass.select_positive(mass, one);
            let wanted = target - vn;
            // Without friction, whether the scene has any or not.
            let mut new = [mass.mul_add(wanted, old_n).max(zero), zero];
            if has_friction {
                let vt = slip(record, layout, p, [&a, &b]);
                let mass_t = record[layout.at(p, layout.tangent_mass)];
                let k_tt = one / mass_t.select_positive(mass_t, one);
                let answers = if pushes_a { a[7] } else { zero };
                let k_nt = (b[7] * arm_b[0]).mul_add(arm_b[1], answers * arm_a[0] * arm_a[1]);
                let k = [k_nn, k_tt, k_nt];
                new = rough_impulses(k, mass, record[layout.friction], [old_n, old_t], [wanted, -vt]);
                let from_none = [
                    k_nn.mul_add(old_n, k_nt.mul_add(old_t, wanted)),
                    k_nt.mul_add(old_n, k_tt.mul_add(old_t, -vt)),
                ];
                new = lossy_impulses(k, new, from_none, [side[at + 5], side[at + 6]]);
            }
            new[0] = both.select_positive(pair[p], new[0]);
            if !timed {
                // As in [`Leave`].
                let at_surface = record[layout.at(p, layout.separation)];
                record[layout.at(p, layout.separation)] =
                    target.select_positive(at_surface.max(zero), at_surface);
            }
            let new = new.map(|impulse| target.select_positive(impulse, zero));
            (side[at + 1], side[at + 2]) = (new[0], new[1]);
            let delta = [new[0] - old_n, new[1] - old_t];
            let size = delta[0].max(-delta[0]) + delta[1].max(-delta[1]);
            most = most.max(k_nn * size / fastest);
            let x = n[0].mul_add(delta[0], n[1] * delta[1]);
            let y = n[1].mul_add(delta[0], -(n[0] * delta[1]));
            let turn = |arm: [L; 2]| arm[0].mul_add(delta[0], arm[1] * delta[1]);
            let v = [b[3].mul_add(x, b[0]), b[3].mul_add(y, b[1]), b[7].mul_add(turn(arm_b), b[2]), b[3]];
            L::scatter_velocity(rows, row_b, v);
            if pushes_a {
                let w = a[7].neg_mul_add(turn(arm_a), a[2]);
                let v = [a[3].neg_mul_add(x, a[0]), a[3].neg_mul_add(y, a[1]), w, a[3]];
                L::scatter_velocity(rows, row_a, v);
            }
        }
    }
    *change = largest(most).max(*change);
}

#[cfg(test)]
mod tests {
    use super::{lossy_impulses, rough_impulses};

    /// Of a unit square's corner with k_nn, k_tt, k_nt that comes in at 4 m/s and slides at `vt`.
    fn corner(mu: f32, old: [f32; 2], vt: f32) -> [f32; 2] {
        rough_impulses::<f32>([2.0, 3.0, 1.0], 0.5, mu, old, [4.0, -vt])
    }

    #[test]
    fn a_corner_sticks_slides_or_is_smooth() {
        // 2 N + T = 4, N + 3 T = −1: N = 13/5, T = −6/5.
        let [n, t] = corner(1.0, [0.0; 2], 1.0);
        assert!((n - 2.6).abs() < 1e-6 && (t + 1.2).abs() < 1e-6, "{n} {t}");
        // T = −N/4 and 2 N + T = 4: N = 16/7.
        let [n, t] = corner(0.25, [0.0; 2], 1.0);
        assert!((n - 16.0 / 7.0).abs() < 1e-6 && (t + 4.0 / 7.0).abs() < 1e-6, "{n} {t}");
        assert_eq!(corner(0.0, [0.0; 2], 1.0), [2.0, 0.0]);
    }

    #[test]
    fn impulses_so_far_are_part_of_the_whole() {
        // What (2.6, −1.2) has made is done: nothing is left to gain.
        let [n, t] = rough_impulses::<f32>([2.0, 3.0, 1.0], 0.5, 1.0, [2.6, -1.2], [0.0, 0.0]);
        assert!((n - 2.6).abs() < 1e-6 && (t + 1.2).abs() < 1e-6, "{n} {t}");
        // Points that leave by themselves take all of it back.
        assert_eq!(rough_impulses::<f32>([2.0, 3.0, 1.0], 0.5, 1.0, [1.0, 0.0], [-4.0, -1.0]), [0.0, 0.0]);
    }

    /// A rod at 45° of 2 m and 1 kg that comes in at 1 m/s and slides at `slip`, e = 1: k_nn = k_tt = 5/2, k_nt = −3/2.
    fn rod(slip: f32) -> [f32; 2] {
        let (k, wanted) = ([2.5, 2.5, -1.5], [2.0, -slip]);
        let rough = rough_impulses::<f32>(k, 0.4, 1.0, [0.0; 2], wanted);
        lossy_impulses(k, rough, wanted, [slip, 0.0])
    }

    #[test]
    fn a_rod_gains_nothing_from_its_friction() {
        // Newton and Coulomb: T = 7/16, N = 17/16, W = ½ T v_t⁻ = 0.11 J. With T = 1/8 it leaves at −v_t⁻: N = 7/8.
        let [n, t] = rod(0.5);
        assert!((n - 0.875).abs() < 1e-6 && (t - 0.125).abs() < 1e-6, "{n} {t}");
        // Slides against its friction: as Newton and Coulomb have it. T = −(5 − 3)/4, N = (5 − 3)/4 … sticks with W < 0.
        let [n, t] = rod(2.0);
        assert!((n - 0.5).abs() < 1e-6 && (t + 0.5).abs() < 1e-6, "{n} {t}");
    }
}
