//! Continuous collision: fast bodies stop where they would pass through a surface.
//!
//! A contact exists only once two shapes are [near](crate::params::SPECULATIVE_DISTANCE) each other.
//! A body that moves farther in a step than half its own width may get past the middle of another body, or
//! completely past it, before there is a contact. So after the solver has moved the bodies, and before their
//! poses are written, the path of each such body is traced and cut where its center would pass a surface; the
//! next step finds a contact there. The velocity is unchanged, so restitution and friction act as usual.
//!
//! Static and kinematic shapes stop every fast body; dynamic shapes stop bullets only
//! ([`BodyDef::bullet`](crate::bodies::BodyDef::bullet)). Rotation of dynamic bodies is not traced: a spinning rod
//! whose center does not move may pass through a thin wall. In addition, the center of a slow body never
//! enters a static shape, even under pressure.
//!
//! Nothing stops a kinematic body. If one would pass through a dynamic body, it takes that body along from where they meet, so
//! that the next step finds a contact. The path of the body, thus prolonged, is cut at static shapes. Bodies connected by joints
//! are not taken along.
//!
//! Bodies connected by joints take the same fraction of their step: a body that stopped alone would tear its
//! joints.
//!
//! **Cost.** One comparison per body. For a fast body also a search of the broad phase, a test of its bounds
//! against those of all kinematic shapes, and a few distance computations for the shapes that it may hit; for a kinematic
//! shape that moves farther than half the smallest width of all dynamic bodies, a search. The code is scalar, so the bits are
//! the same at every width.
//!
//! **Source.** Conservative advancement: `mirtich1996`.

mod advance;
mod press;

use crate::bodies::{Bodies, BodyKind};
use crate::broadphase::Proxy;
use crate::contacts::Contact;
use crate::disjoint::DisjointSets;
use crate::lanes::BodyRow;
use crate::shapes::{Aabb, Pose, Shape};
use crate::workers::Workers;
use advance::{Mover, impact, taken_along};
use glam::Vec2;
use std::cmp::Ordering;
use std::ops::Range;

/// The bodies of a world, and the fast ones of the last step.
#[derive(Clone, Debug, Default)]
#[doc(hidden)]
pub struct Continuous {
    /// Square of the distance that a body may move in a step without a test (m²). The distance is half its
    /// smallest width; infinite for bodies that are not dynamic.
    safe_squared: Vec<f32>,
    /// First shape of each body, followed by the total number of shapes.
    first_shape: Vec<u32>,
    /// Shapes of kinematic bodies.
    kinematic: Vec<u32>,
    /// Half the smallest width of all dynamic bodies (m).
    least_safe: f32,
    /// Dynamic bodies that kinematic ones would pass through, each with the fraction of the step until they meet and its
    /// displacement over the step `[x, y, θ]` (m and rad).
    taken: Vec<(u32, f32, [f32; 3])>,
    /// Bodies that move farther than is safe in this step, each with the fraction of the step that it takes.
    fast: Vec<(u32, f32)>,
    /// Sets of bodies connected by joints. `[bodies]`
    together: DisjointSets,
    /// Fraction of the step of each set, stored at its lowest body. `[bodies]`
    parts: Vec<f32>,
}

/// Least number of fast bodies that are worth a thread.
const LEAST_FAST: usize = 32;

/// Calls back with the proxies whose bounds overlap a box, and that a shape may meet.
#[doc(hidden)]
pub type Near<'w> = dyn Fn(u32, Aabb, &mut dyn FnMut(u32)) + Sync + 'w;

/// Calls back with the two bodies of every joint that has rigid rows.
#[doc(hidden)]
pub type EachJoined<'w> = dyn Fn(&mut dyn FnMut([u32; 2])) + Sync + 'w;

/// Input of [`Continuous::shorten`].
#[derive(Clone, Copy)]
#[doc(hidden)]
pub struct Moving<'w> {
    /// State at the start of the step.
    pub bodies: &'w Bodies,
    /// Shapes, in the order of their bodies.
    pub shapes: &'w [Shape],
    /// Proxies, one per shape.
    pub proxies: &'w [Proxy],
    /// Contacts of the step.
    pub contacts: &'w [Contact],
    /// Overlap that position correction leaves uncorrected (m).
    pub slop: f32,
    /// Returns whether collisions between two shapes are disabled.
    pub apart: &'w (dyn Fn([u32; 2]) -> bool + Sync),
    /// Visits shapes near an area that a shape may meet.
    pub near: &'w Near<'w>,
    pub joined: &'w EachJoined<'w>,
}

impl Continuous {
    /// Registers all bodies of a world by kind and range of shapes (empty if the body was removed).
    /// `half_width` returns half the smallest width of a shape (m).
    pub fn build(
        &mut self,
        bodies: impl Iterator<Item = (BodyKind, Range<u32>)>,
        half_width: impl Fn(usize) -> f32,
    ) {
        self.safe_squared.clear();
        self.first_shape.clear();
        self.kinematic.clear();
        self.least_safe = f32::INFINITY;
        self.first_shape.push(0);
        let count = bodies.size_hint().0;
        self.safe_squared.reserve(count);
        self.first_shape.reserve(count);
        for (kind, own) in bodies {
            let half = own.clone().map(|shape| half_width(shape as usize)).fold(f32::INFINITY, f32::min);
            let is_dynamic = kind == BodyKind::Dynamic;
            self.safe_squared.push(if is_dynamic { half * half } else { f32::INFINITY });
            self.least_safe = if is_dynamic { self.least_safe.min(half) } else { self.least_safe };
            self.first_shape.push(own.end);
            if kind == BodyKind::Kinematic {
                self.kinematic.extend(own);
            }
        }
    }

    /// Shortens the motion of fast bodies up to the surfaces that they would pass; returns the number of fast
    /// bodies. Fast kinematic bodies take along what they would pass through. Threads take some of the fast bodies each.
    pub fn shorten(&mut self, moving: Moving<'_>, rows: &mut [BodyRow], workers: &Workers) -> usize {
        press::hold(moving.bodies, moving.contacts, &self.safe_squared, moving.slop, rows);
        self.list_fast(rows);
        if self.take_along(moving, rows) {
            self.list_fast(rows);
        }
        let mut fast = std::mem::take(&mut self.fast);
        let size = workers.part(fast.len(), LEAST_FAST);
        workers.each(fast.chunks_mut(size), |fast| {
            fast.iter_mut().for_each(|(body, part)| *part = self.part(moving, rows, *body as usize));
        });
        self.fast = fast;
        for k in 0..self.fast.len() {
            if moving.bodies.bullet[self.fast[k].0 as usize] {
                self.meet_dynamic(moving, rows, k);
            }
        }
        if self.fast.iter().any(|&(_, part)| part < 1.0) {
            self.stop_together(moving, rows);
        }
        self.fast.len()
    }

    /// Lists the bodies that move farther than is safe.
    fn list_fast(&mut self, rows: &[BodyRow]) {
        self.fast.clear();
        for (i, (row, safe)) in rows.iter().zip(&self.safe_squared).enumerate() {
            let [x, y, ..] = row.delta;
            if x * x + y * y > *safe {
                self.fast.push((i as u32, 1.0));
            }
        }
    }

    /// Moves the bodies that kinematic ones would pass through to where these take them; returns whether there are any.
    fn take_along(&mut self, moving: Moving<'_>, rows: &mut [BodyRow]) -> bool {
        let Continuous { safe_squared, first_shape, kinematic, least_safe, taken, fast, .. } = self;
        taken.clear();
        for &shape in &*kinematic {
            let mine = &moving.proxies[shape as usize];
            let [x, y, turn, _] = rows[mine.body as usize].delta;
            let way = turn.abs().mul_add(moving.shapes[shape as usize].reach(), x.hypot(y));
            if way <= *least_safe {
                continue;
            }
            let mut meet = |other: u32| {
                let proxy = &moving.proxies[other as usize];
                let is_passed = proxy.dynamic && way * way > safe_squared[proxy.body as usize];
                if !is_passed || !proxy.may_meet(mine) || (moving.apart)([shape, other]) {
                    return;
                }
                let (shapes, movers) = pair_of(moving, rows, [shape, other]);
                // What moves no farther against the shape than is safe does not pass through it.
                let way = movers[1].against(&movers[0]).displacement;
                if way.length_squared() <= safe_squared[proxy.body as usize] {
                    return;
                }
                if let Some((part, displacement)) = taken_along(shapes, movers.each_ref(), moving.slop) {
                    taken.push((proxy.body, part, displacement));
                }
            };
            // None of its points moves farther, nor do most bodies that it would pass through.
            (moving.near)(shape, mine.aabb.grown(2.0 * way), &mut meet);
            let area = mine.aabb.grown(way);
            for &(body, _) in &*fast {
                let [x, y, ..] = rows[body as usize].delta;
                if x * x + y * y > way * way {
                    let own = first_shape[body as usize]..first_shape[body as usize + 1];
                    let bounds = |other: u32| moving.proxies[other as usize].aabb.grown(x.abs().max(y.abs()));
                    own.filter(|&other| overlap(&bounds(other), &area)).for_each(&mut meet);
                }
            }
        }
        if taken.is_empty() {
            return false;
        }
        // Of each body the first meeting, whatever the order in which they were found.
        taken.sort_by(|(a, t, x), (b, u, y)| (a, t, x).partial_cmp(&(b, u, y)).unwrap_or(Ordering::Equal));
        taken.dedup_by_key(|taken| taken.0);
        (moving.joined)(&mut |ends| taken.retain(|(body, ..)| !ends.contains(body)));
        for (body, _, displacement) in taken {
            rows[*body as usize].delta[..3].copy_from_slice(displacement);
        }
        true
    }

    /// Shortens the motion of each fast body and of the bodies connected to it by joints.
    fn stop_together(&mut self, moving: Moving<'_>, rows: &mut [BodyRow]) {
        let Continuous { fast, together, parts, .. } = self;
        let count = moving.bodies.len();
        together.begin(count);
        (moving.joined)(&mut |[a, b]| {
            if [a, b].iter().all(|&body| moving.bodies.is_dynamic(body as usize)) {
                together.join(a, b);
            }
        });
        parts.clear();
        parts.resize(count, 1.0);
        for &(body, part) in &*fast {
            let least = &mut parts[together.least(body) as usize];
            *least = least.min(part);
        }
        for (body, row) in rows[..count].iter_mut().enumerate() {
            let part = parts[together.least(body as u32) as usize];
            if part < 1.0 {
                row.delta[..3].iter_mut().for_each(|way| *way *= part);
            }
        }
    }

    /// The fraction of the step after which `body` hits a static or kinematic shape; 1 if it does not.
    fn part(&self, moving: Moving<'_>, rows: &[BodyRow], body: usize) -> f32 {
        let own = self.first_shape[body]..self.first_shape[body + 1];
        let mut part = 1.0_f32;
        for shape in own {
            let swept = swept(moving, rows, shape as usize);
            let mine = &moving.proxies[shape as usize];
            let mut meet = |other: u32, proxy: &Proxy| {
                if proxy.may_meet(mine) && !(moving.apart)([other, shape]) {
                    part = part.min(pair(moving, rows, [other, shape], part));
                }
            };
            (moving.near)(shape, swept, &mut |other| {
                let proxy = &moving.proxies[other as usize];
                if moving.bodies.kind[proxy.body as usize] == BodyKind::Static {
                    meet(other, proxy);
                }
            });
            for &other in &self.kinematic {
                let proxy = &moving.proxies[other as usize];
                let [x, y, ..] = rows[proxy.body as usize].delta;
                if overlap(&proxy.aabb.grown(x.abs().max(y.abs())), &swept) {
                    meet(other, proxy);
                }
            }
        }
        part
    }

    /// As [`Self::part`] for other dynamic bodies. A fast body hit by a bullet stops as well, so that neither
    /// passes the other.
    fn meet_dynamic(&mut self, moving: Moving<'_>, rows: &[BodyRow], bullet: usize) {
        let body = self.fast[bullet].0;
        for shape in self.first_shape[body as usize]..self.first_shape[body as usize + 1] {
            let own = swept(moving, rows, shape as usize);
            for (other, proxy) in moving.proxies.iter().enumerate() {
                let mine = &moving.proxies[shape as usize];
                if !proxy.dynamic || proxy.body == body || !proxy.may_meet(mine) {
                    continue;
                }
                if !overlap(&swept(moving, rows, other), &own) || (moving.apart)([other as u32, shape]) {
                    continue;
                }
                let part = pair(moving, rows, [other as u32, shape], 1.0);
                let rival = self.fast.binary_search_by_key(&proxy.body, |f| f.0);
                for k in [Some(bullet), rival.ok()].into_iter().flatten() {
                    self.fast[k].1 = self.fast[k].1.min(part);
                }
            }
        }
    }
}

/// The fraction of the step at which shape b hits shape a, at most `limit`.
fn pair(moving: Moving<'_>, rows: &[BodyRow], pair: [u32; 2], limit: f32) -> f32 {
    let (shapes, movers) = pair_of(moving, rows, pair);
    impact(shapes, movers.each_ref(), moving.slop, limit)
}

/// Two shapes and the motions of their bodies.
fn pair_of<'w>(moving: Moving<'w>, rows: &[BodyRow], [a, b]: [u32; 2]) -> ([&'w Shape; 2], [Mover; 2]) {
    let [body_a, body_b] = [a, b].map(|shape| moving.proxies[shape as usize].body as usize);
    let [pose_a, pose_b] = moving.bodies.relative_poses(body_a, body_b);
    let mover = |pose: Pose, body: usize| {
        let [x, y, turn, _] = rows[body].delta;
        Mover { pose, displacement: Vec2::new(x, y), turn }
    };
    let shapes = [a, b].map(|shape| &moving.shapes[shape as usize]);
    (shapes, [mover(pose_a, body_a), mover(pose_b, body_b)])
}

/// Bounds of a shape over the step: those of the disc about its center of mass that contains it at any
/// rotation.
fn swept(moving: Moving<'_>, rows: &[BodyRow], shape: usize) -> Aabb {
    let body = moving.proxies[shape].body as usize;
    let reach = moving.shapes[shape].reach();
    let start = moving.bodies.pose(body).position;
    let end = start + Vec2::new(rows[body].delta[0], rows[body].delta[1]);
    Aabb { min: start.min(end), max: start.max(end) }.grown(reach)
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}
