//! Continuous collision: a fast body stops where it would pass through a surface.
//!
//! A contact exists once two shapes are [near](crate::engine::params::SPECULATIVE_DISTANCE) each other. A body that
//! moves farther in a step than half its own width may be past the middle of another body, or completely past it,
//! before there is a contact. So after the solver has moved the bodies, and before their poses are written, the path
//! of each such body is traced and cut where its center would pass a surface; the next step finds a contact there.
//! The velocity stays, so restitution and friction act as usual.
//!
//! Static and kinematic shapes stop every fast body; dynamic shapes stop bullets only
//! ([`BodyDef::bullet`](crate::engine::bodies::BodyDef::bullet)). Rotation is not traced: a spinning rod, whose
//! center does not move, may pass through a thin wall. In addition, the center of a slow body never enters a static
//! shape, whatever presses it.
//!
//! Bodies that joints hold together take the same part of their step: one that stopped alone would tear its joints.
//!
//! **Cost.** One comparison per body; for a fast body, a search of the broad phase, a test of its bounds against those of all
//! kinematic shapes, and a few distance computations for those that it may hit. Scalar code, so the bits are the same at
//! every width.
//!
//! **Source.** Conservative advancement: `mirtich1996`.

mod advance;
mod press;

use crate::engine::bodies::{Bodies, BodyKind};
use crate::engine::broadphase::Proxy;
use crate::engine::contacts::Contact;
use crate::engine::disjoint::DisjointSets;
use crate::engine::lanes::{BodyRow, held};
use crate::engine::shapes::{Aabb, Pose, Shape};
use advance::{Mover, impact};
use glam::Vec2;
use std::ops::Range;

/// The bodies of a world, and the fast ones of the last step.
#[derive(Clone, Debug, Default)]
#[doc(hidden)]
pub struct Continuous {
    /// Squared distance that a body may move in a step without a test (m²): half its smallest width. Infinite unless
    /// dynamic.
    safe_squared: Vec<f32>,
    /// First shape of each body, and one more.
    first_shape: Vec<u32>,
    /// Shapes of kinematic bodies.
    kinematic: Vec<u32>,
    /// Bodies that move farther than is safe in this step, and the part of the step that they take.
    fast: Vec<(u32, f32)>,
    /// Bodies that joints hold together. `[bodies]`
    together: DisjointSets,
    /// Parts of the step, by the least of such bodies. `[bodies]`
    parts: Vec<f32>,
}

/// Finds the proxies whose bounds meet a box, and calls with each.
#[doc(hidden)]
pub type Near<'w> = dyn Fn(Aabb, &mut dyn FnMut(u32)) + 'w;

/// Calls with the bodies of every joint with rigid rows.
#[doc(hidden)]
pub type EachJoined<'w> = dyn Fn(&mut dyn FnMut([u32; 2])) + 'w;

/// Moving bodies, in the form that [`Continuous::shorten`] needs.
#[derive(Clone, Copy)]
#[doc(hidden)]
pub struct Moving<'w> {
    /// At the start of the step.
    pub bodies: &'w Bodies,
    /// Of the bodies, in their order.
    pub shapes: &'w [Shape],
    /// One per shape.
    pub proxies: &'w [Proxy],
    /// Of the step.
    pub contacts: &'w [Contact],
    /// Overlap that position correction leaves alone (m).
    pub slop: f32,
    /// Whether two bodies do not collide.
    pub apart: &'w dyn Fn([u32; 2]) -> bool,
    pub near: &'w Near<'w>,
    pub joined: &'w EachJoined<'w>,
}

impl Continuous {
    /// Takes in all bodies of a world, each by its kind and the shapes that it has, none if it was removed. `half_width`: half
    /// the smallest width of a shape (m).
    pub fn build(
        &mut self,
        bodies: impl Iterator<Item = (BodyKind, Range<u32>)>,
        half_width: impl Fn(usize) -> f32,
    ) {
        self.safe_squared.clear();
        self.first_shape.clear();
        self.kinematic.clear();
        self.first_shape.push(0);
        let count = bodies.size_hint().0;
        self.safe_squared.reserve(count);
        self.first_shape.reserve(count);
        for (kind, own) in bodies {
            let half = own.clone().map(|shape| half_width(shape as usize)).fold(f32::INFINITY, f32::min);
            self.safe_squared.push(if kind == BodyKind::Dynamic { half * half } else { f32::INFINITY });
            self.first_shape.push(own.end);
            if kind == BodyKind::Kinematic {
                self.kinematic.extend(own);
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let Continuous { safe_squared, first_shape, kinematic, fast, together, parts } = self;
        held(safe_squared) + held(first_shape) + held(kinematic) + held(fast) + together.bytes() + held(parts)
    }

    /// Shortens the motions of fast bodies to where they meet what they would pass; returns how many are fast.
    pub fn shorten(&mut self, moving: Moving<'_>, rows: &mut [BodyRow]) -> usize {
        press::hold(moving.bodies, moving.contacts, &self.safe_squared, moving.slop, rows);
        self.fast.clear();
        for (i, (row, safe)) in rows.iter().zip(&self.safe_squared).enumerate() {
            let [x, y, ..] = row.delta;
            if x * x + y * y > *safe {
                self.fast.push((i as u32, 1.0));
            }
        }
        for k in 0..self.fast.len() {
            let body = self.fast[k].0 as usize;
            let part = self.part(moving, rows, body);
            self.fast[k].1 = self.fast[k].1.min(part);
            if moving.bodies.bullet[body] {
                self.meet_dynamic(moving, rows, k);
            }
        }
        if self.fast.iter().any(|&(_, part)| part < 1.0) {
            self.stop_together(moving, rows);
        }
        self.fast.len()
    }

    /// Shortens the motion of each fast body, and of what joints hold together with it.
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

    /// The part of the step after which `body` meets something that no impulse moves; 1 if it does not.
    fn part(&self, moving: Moving<'_>, rows: &[BodyRow], body: usize) -> f32 {
        let own = self.first_shape[body]..self.first_shape[body + 1];
        let mut part = 1.0_f32;
        for shape in own {
            let swept = swept(moving, rows, shape as usize);
            let mine = &moving.proxies[shape as usize];
            let mut meet = |other: u32, proxy: &Proxy| {
                if proxy.may_meet(mine) && !(moving.apart)([proxy.body, body as u32]) {
                    part = part.min(pair(moving, rows, [other, shape], part));
                }
            };
            (moving.near)(swept, &mut |other| {
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

    /// The same with other dynamic bodies; a fast one that a bullet meets stops as well, so that neither passes.
    fn meet_dynamic(&mut self, moving: Moving<'_>, rows: &[BodyRow], bullet: usize) {
        let body = self.fast[bullet].0;
        for shape in self.first_shape[body as usize]..self.first_shape[body as usize + 1] {
            let own = swept(moving, rows, shape as usize);
            for (other, proxy) in moving.proxies.iter().enumerate() {
                let mine = &moving.proxies[shape as usize];
                if !proxy.dynamic || proxy.body == body || !proxy.may_meet(mine) {
                    continue;
                }
                if !overlap(&swept(moving, rows, other), &own) || (moving.apart)([proxy.body, body]) {
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

/// When in the step shape b meets shape a, before `limit`.
fn pair(moving: Moving<'_>, rows: &[BodyRow], [a, b]: [u32; 2], limit: f32) -> f32 {
    let [body_a, body_b] = [a, b].map(|shape| moving.proxies[shape as usize].body as usize);
    let [pose_a, pose_b] = moving.bodies.relative_poses(body_a, body_b);
    let mover = |pose: Pose, body: usize| {
        let [x, y, turn, _] = rows[body].delta;
        Mover { pose, way: Vec2::new(x, y), turn }
    };
    let shapes = [a, b].map(|shape| &moving.shapes[shape as usize]);
    impact(shapes, [&mover(pose_a, body_a), &mover(pose_b, body_b)], moving.slop, limit)
}

/// Bounds of a shape over the step: those of the disc about its center of mass that holds it however it turns.
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
