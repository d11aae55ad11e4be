//! Seams of the ground: corners that static shapes share.
//!
//! The end of a piece of ground is no surface where the next piece goes on. But two shapes alone do not know that: a box
//! that slides from one piece to the next, or comes within reach of it, finds the end of a segment, or the side of a tile,
//! in its way, and bounces back or hops (a *ghost collision*). So a contact at a shared corner P must fit all pieces that
//! meet there. With its normal n, from the ground to the body, and the directions d of the edges of the other piece from P,
//!
//! ```text
//! n·d ≤ 0
//! ```
//!
//! has to hold, or the other piece is in the way of the normal: n is then outside the region that belongs to P among the
//! points outside both pieces (their Voronoi region). The other piece has the contact in that case.
//!
//! A face of the ground has its contacts in its own region, up to P, also where the other piece rises from there. Between a
//! floor and the wall at its end n·d > 0 for contacts of the floor, which are real. Contacts within reach of P on a face
//! from P to Q are ghosts only if the body is on the other side of the edge than Q: a body on the floor has the side of a
//! tile below.
//!
//! Corners are shared if they are closer than a tenth of the slop. Contacts of shapes without shared corners are not looked
//! at.

use super::Margins;
use crate::bodies::Bodies;
use crate::contacts::Contact;
use crate::params::MAX_POLYGON_VERTICES;
use crate::shapes::Shape;
use glam::Vec2;
use std::collections::HashMap;

/// n·d above which the other piece is in the way (1): more than rounding.
const IN_THE_WAY: f32 = 1e-3;

/// Slope below which two corners are at the same height (1).
const LEVEL: f32 = 1e-3;

/// Distance at which corners are the same, in slops (1).
const SAME: f32 = 0.1;

/// A corner that a shape shares with another one.
#[derive(Clone, Copy, Debug)]
struct Seam {
    /// P, from the center of mass of the body, world axes (m).
    corner: Vec2,
    /// d, along an edge of the other shape.
    way: Vec2,
}

/// Space and shape of a corner, the corner as in a [`Seam`], its position (m), and the directions of both edges.
type End = ([usize; 2], Vec2, [f64; 2], [Vec2; 2]);

/// The shared corners of all static shapes; see the [module](self).
#[derive(Clone, Debug, Default)]
pub struct Seams {
    /// Where the seams of each shape begin. `[shapes + 1]`, or empty if there are none.
    starts: Vec<u32>,
    seams: Vec<Seam>,
}

/// Corners of a shape, from the center of mass of its body, world axes (m); none for a circle.
fn corners(shape: &Shape, rotation: Vec2) -> ([Vec2; MAX_POLYGON_VERTICES], usize) {
    let (mut all, mut count) = ([Vec2::ZERO; MAX_POLYGON_VERTICES], 0);
    if !matches!(shape, Shape::Circle { .. }) {
        shape.for_each_vertex(|v| {
            all[count] = rotation.rotate(v);
            count += 1;
        });
    }
    (all, count)
}

impl Seams {
    /// Finds the corners that shapes of one space share. `ground` gives the space of a shape of the ground. `bodies` and
    /// `shape_body` are those of the world.
    pub fn build(
        &mut self,
        bodies: &Bodies,
        shapes: &[Shape],
        shape_body: &[u32],
        ground: impl Fn(usize) -> Option<usize>,
        margins: Margins,
    ) {
        let tolerance = f64::from(SAME * margins.slop);
        let cell = |at: [f64; 2]| at.map(|x| (x / tolerance).floor() as i64);
        // By space and cell.
        let mut places: HashMap<(usize, [i64; 2]), Vec<usize>> = HashMap::new();
        let mut ends: Vec<End> = Vec::new();
        for (shape, space) in (0..shapes.len()).filter_map(|shape| Some((shape, ground(shape)?))) {
            let body = shape_body[shape] as usize;
            let ([x, y], (all, count)) =
                (bodies.center(body), corners(&shapes[shape], bodies.pose(body).rotation));
            for (i, &corner) in all[..count].iter().enumerate() {
                let at = [x + f64::from(corner.x), y + f64::from(corner.y)];
                let way = |other: usize| (all[other % count] - corner).normalize_or_zero();
                places.entry((space, cell(at))).or_default().push(ends.len());
                ends.push(([space, shape], corner, at, [way(i + 1), way(i + count - 1)]));
            }
        }
        self.starts.clear();
        self.seams.clear();
        for (e, &([space, shape], corner, at, _)) in ends.iter().enumerate() {
            self.starts.resize(shape + 1, self.seams.len() as u32);
            let [column, row] = cell(at);
            let near = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [column + i, row + j]));
            for &other in near.filter_map(|cell| places.get(&(space, cell))).flatten() {
                let ([_, of], _, to, ways) = ends[other];
                if e != other && of != shape && (0..2).all(|k| (to[k] - at[k]).abs() <= tolerance) {
                    self.seams.extend(ways.map(|way| Seam { corner, way }));
                }
            }
        }
        self.starts.resize(shapes.len() + 1, self.seams.len() as u32);
        if self.seams.is_empty() {
            self.starts.clear();
        }
    }

    /// Whether no shape shares a corner.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// Whether a shape shares a corner.
    pub fn has(&self, shape: u32) -> bool {
        !self.of(shape).is_empty()
    }

    /// The seams of a shape.
    fn of(&self, shape: u32) -> &[Seam] {
        match self.starts.get(shape as usize..shape as usize + 2) {
            Some(&[first, end]) => &self.seams[first as usize..end as usize],
            _ => &[],
        }
    }

    /// Whether a contact meets an end of the ground where another piece goes on.
    pub fn is_ghost(&self, contact: &Contact, bodies: &Bodies, shapes: &[Shape], margins: Margins) -> bool {
        let n = contact.manifold.normal;
        let mut seams =
            self.of(contact.shape_a).iter().filter(|seam| n.dot(seam.way) > IN_THE_WAY).peekable();
        if seams.peek().is_none() {
            return false;
        }
        let [a, b] = [contact.shape_a, contact.shape_b].map(|shape| &shapes[shape as usize]);
        let poses = bodies.relative_poses(contact.body_a as usize, contact.body_b as usize);
        let (all, count) = corners(a, poses[0].rotation);
        let all = &all[..count];
        let first = all.iter().copied().reduce(|best, v| if v.dot(n) > best.dot(n) { v } else { best });
        let Some(first) = first else { return false };
        let is_level = |v: Vec2| n.dot(first - v) <= LEVEL * first.distance(v);
        // The middle of b.
        let (mut sum, mut corners_of_b) = (Vec2::ZERO, 0.0_f32);
        b.for_each_vertex(|v| (sum, corners_of_b) = (sum + v, corners_of_b + 1.0));
        let middle = poses[1].position + poses[1].rotation.rotate(sum / corners_of_b);
        let reach = 2.0 * margins.speculative + a.radius();
        seams.any(|&Seam { corner, way }| {
            if !is_level(corner) {
                return false;
            }
            let tolerance = SAME * margins.slop;
            let Some(&end) = all.iter().find(|v| v.distance(corner) > tolerance && is_level(**v)) else {
                return true;
            };
            let sides = way.perp_dot(end - corner) * way.perp_dot(middle - corner);
            let is_near = |anchor: Vec2| anchor.distance(corner) <= reach;
            sides < 0.0 && contact.manifold.points().iter().all(|point| is_near(point.anchor_a))
        })
    }
}
