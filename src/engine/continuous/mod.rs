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
//! **Cost.** One comparison per body; for a fast body, a test of its bounds against those of all fixed shapes, and a
//! few distance computations for those that it may hit. Scalar code, so the bits are the same at every width.
//!
//! **Source.** Conservative advancement: `mirtich1996`.

mod advance;
mod press;

use crate::engine::bodies::Bodies;
use crate::engine::broadphase::Proxy;
use crate::engine::contacts::Contact;
use crate::engine::lanes::BodyRow;
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
    /// Shapes of bodies that nothing moves.
    fixed: Vec<u32>,
    /// Bodies that move farther than is safe in this step, and the part of the step that they take.
    fast: Vec<(u32, f32)>,
}

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
    /// Whether two bodies do not collide.
    pub apart: &'w dyn Fn([u32; 2]) -> bool,
}

impl Continuous {
    /// Takes in all bodies of a world, each by whether it is dynamic and the shapes that it has, none if it was removed. `shapes`:
    /// those of all bodies, in their order.
    pub fn build(&mut self, bodies: impl Iterator<Item = (bool, Range<u32>)>, shapes: &[Shape]) {
        self.safe_squared.clear();
        self.first_shape.clear();
        self.fixed.clear();
        self.first_shape.push(0);
        for (is_dynamic, own) in bodies {
            let half = shapes[own.start as usize..own.end as usize].iter().map(Shape::min_half_extent);
            let half = half.fold(f32::INFINITY, f32::min);
            self.safe_squared.push(if is_dynamic { half * half } else { f32::INFINITY });
            self.first_shape.push(own.end);
            if !is_dynamic {
                self.fixed.extend(own);
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        4 * (self.safe_squared.capacity() + self.first_shape.capacity() + self.fixed.capacity())
            + 8 * self.fast.capacity()
    }

    /// Shortens the motions of fast bodies to where they meet what they would pass; returns how many are fast.
    pub fn shorten(&mut self, moving: Moving<'_>, rows: &mut [BodyRow]) -> usize {
        press::hold(moving.bodies, moving.contacts, &self.safe_squared, rows);
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
        for &(body, part) in &self.fast {
            let delta = &mut rows[body as usize].delta;
            [delta[0], delta[1], delta[2]] = [part * delta[0], part * delta[1], part * delta[2]];
        }
        self.fast.len()
    }

    /// The part of the step after which `body` meets something fixed; 1 if it does not.
    fn part(&self, moving: Moving<'_>, rows: &[BodyRow], body: usize) -> f32 {
        let own = self.first_shape[body]..self.first_shape[body + 1];
        let mut part = 1.0_f32;
        for shape in own {
            let swept = swept(moving, rows, shape as usize);
            for &other in &self.fixed {
                let proxy = &moving.proxies[other as usize];
                let [x, y, ..] = rows[proxy.body as usize].delta;
                let near = overlap(&proxy.aabb.grown(x.abs().max(y.abs())), &swept);
                let may_meet = proxy.may_meet(&moving.proxies[shape as usize]);
                if near && may_meet && !(moving.apart)([proxy.body, body as u32]) {
                    part = part.min(pair(moving, rows, [other, shape], part));
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
    let [body_a, body_b] = [a, b].map(|s| moving.proxies[s as usize].body as usize);
    let [pose_a, pose_b] = moving.bodies.relative_poses(body_a, body_b);
    let mover = |shape: u32, body: usize, pose: Pose| Mover {
        shape: &moving.shapes[shape as usize],
        pose,
        way: Vec2::new(rows[body].delta[0], rows[body].delta[1]),
        turn: rows[body].delta[2],
    };
    impact(&mover(a, body_a, pose_a), &mover(b, body_b, pose_b), limit)
}

/// Bounds of a shape over the step: those of the disc about its center of mass that holds it however it turns.
fn swept(moving: Moving<'_>, rows: &[BodyRow], shape: usize) -> Aabb {
    let body = moving.proxies[shape].body as usize;
    let reach = advance::reach(&moving.shapes[shape]);
    let start = moving.bodies.pose(body).position;
    let end = start + Vec2::new(rows[body].delta[0], rows[body].delta[1]);
    Aabb { min: start.min(end), max: start.max(end) }.grown(reach)
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    a.min.cmple(b.max).all() && b.min.cmple(a.max).all()
}
