//! Fat boxes: bounds with a margin, and a cheap test whether a body may have left its own.
//!
//! **The guarantee.** The fat box of a shape contains the shape's bounds grown by [`SPECULATIVE_DISTANCE`],
//! up to the rounding of coordinates. So two shapes with separate fat boxes are further apart than the
//! look-ahead distance of the narrow phase.
//!
//! **The test.** Let a shape be the core points c in its body's frame, grown by a radius; x the body's center
//! of mass, and R its rotation as a unit complex number. From a reference pose (x₀, R₀) to (x, R) a core
//! point moves by (x − x₀) + (R − R₀)c, and multiplying by R − R₀ scales lengths by |R − R₀|. With reach
//! r = max |c|, the bounds therefore move on every side by no more than
//!
//! ```text
//! max(|x − x₀|, |y − y₀|) + r |R − R₀|                                     (1)
//! ```
//!
//! The radius moves with its core and adds nothing. Suppose that at the reference pose the grown bounds were
//! at least `slack` inside the fat box on all sides. Then they still are inside while (1) is no more than
//! `slack`. This takes six numbers per body and no access to its shapes. Only if (1) is larger, bounds are
//! computed. They may still be inside, for example after a rotation; the reference then moves to the current
//! pose.
//!
//! **Rounding.** x − x₀ is exact if the two are within a factor of two (Sterbenz); otherwise its error is
//! half a unit in the last place of the larger. The error of R is a few ε, and that of bounds a few ε of
//! their coordinates. To cover all of them, `slack` is reduced by 16 ε of the largest coordinate and by a
//! thousandth of itself.
//!
//! **The margin.** A margin saves searches while a body stays inside it, and adds a candidate for every
//! neighbor that is near but does not touch. So it is a fraction of the shape's size and at most
//! [`AABB_MARGIN`]. It is zero for a shape that would cross it within [`LASTS`] steps, which would be
//! searched anyway, and for static bodies.
//!
//! **Source:** boxes with a margin, Catto 2019 (`catto2019`). **Departure:** the test of (1).

use super::Proxy;
use crate::bodies::{Bodies, BodyKind};
use crate::lanes::LaneVec;
use crate::params::{AABB_MARGIN, MAX_POLYGON_VERTICES, SPECULATIVE_DISTANCE};
use crate::shapes::{Aabb, Pose, Shape};
use crate::workers::{Apart, Workers};
use glam::Vec2;
use wide::{f32x8, f32x16};

/// Margin as a fraction of the larger side of a shape's bounds (1).
const MARGIN_FRACTION: f32 = 0.1;

/// Least number of bodies that are worth a thread.
const LEAST_BODIES: usize = 256;

/// Minimum number of steps that a margin must last; otherwise there is no margin (1).
const LASTS: f32 = 2.0;

/// Poses of bodies when their bounds were last computed; arrays of `[bodies]`.
#[derive(Clone, Debug, Default)]
pub struct FatBoxes {
    x: LaneVec,
    y: LaneVec,
    cos: LaneVec,
    sin: LaneVec,
    /// r of (1), the largest of the body's shapes (m).
    reach: LaneVec,
    /// The smallest slack of the body's shapes (m); infinite if it has none.
    slack: LaneVec,
    /// Core points of each shape, for lanes, `[shapes]`.
    outlines: Vec<CoreOutline>,
    /// First shape of each body; the shapes of a body are consecutive.
    first_shape: Vec<u32>,
    /// Bodies that fail the test.
    failed: Vec<u32>,
    /// Shapes with a new fat box, as each thread found them, ascending from list to list.
    found: Vec<Apart<Vec<u32>>>,
    /// All of them.
    moved: Vec<u32>,
}

/// What boxes are computed from.
#[derive(Clone, Copy)]
struct Sight<'a> {
    bodies: &'a Bodies,
    reach: &'a [f32],
    outlines: &'a [CoreOutline],
    first_shape: &'a [u32],
    /// Time step (s) and length unit (m).
    dt: f32,
    unit: f32,
}

impl Sight<'_> {
    /// First shape of a body, or of those after the last one.
    fn first_shape(self, body: usize) -> usize {
        self.first_shape.get(body).map_or(self.outlines.len(), |&first| first as usize)
    }
}

/// Boxes and reference poses of consecutive bodies.
struct Section<'a> {
    /// First body and first shape.
    body: usize,
    shape: usize,
    /// x, y, cos, sin, slack. `[bodies]`
    columns: [&'a mut [f32]; 5],
    /// `[shapes]`
    proxies: &'a mut [Proxy],
}

impl Section<'_> {
    /// Splits off what comes before a body.
    fn split_off(&mut self, body: usize, shape: usize) -> Self {
        let bodies = body - std::mem::replace(&mut self.body, body);
        let shapes = shape - std::mem::replace(&mut self.shape, shape);
        let columns =
            self.columns.each_mut().map(|column| column.split_off_mut(..bodies).expect("as many bodies"));
        let proxies = self.proxies.split_off_mut(..shapes).expect("as many shapes");
        Section { body: body - bodies, shape: shape - shapes, columns, proxies }
    }

    /// Recomputes the boxes of one body if needed, and makes its pose the reference. Appends shapes with a new box.
    #[inline]
    fn look_at(&mut self, body: usize, sight: &Sight<'_>, moved: &mut Vec<u32>) {
        let Sight { bodies, reach, outlines, dt, unit, .. } = *sight;
        let pose = bodies.pose(body);
        let (first, last) = (sight.first_shape(body), sight.first_shape(body + 1));
        let speed = bodies.velocity(body).length();
        let spin = bodies.angular_velocity[body].abs();
        let [x, y, cos, sin, slack] = self.columns.each_mut().map(|column| &mut column[body - self.body]);
        let mut least = f32::INFINITY;
        for (i, proxy) in (first..last).zip(&mut self.proxies[first - self.shape..last - self.shape]) {
            let tight = outlines[i].bounds(&pose).grown(unit * SPECULATIVE_DISTANCE);
            if *slack < 0.0 || !proxy.aabb.contains(&tight) {
                let extent = tight.max - tight.min;
                let margin = (unit * AABB_MARGIN).min(MARGIN_FRACTION * extent.max_element());
                let path = (speed + spin * reach[body]) * dt;
                let lasts = path * LASTS <= margin && bodies.kind[body] != BodyKind::Static;
                proxy.aabb = if lasts { tight.grown(margin) } else { tight };
                moved.push(i as u32);
            }
            least = least.min(inset(&proxy.aabb, &tight));
        }
        (*slack, *x, *y) = (least, pose.position.x, pose.position.y);
        (*cos, *sin) = (pose.rotation.x, pose.rotation.y);
    }
}

impl FatBoxes {
    /// Adds or replaces a body. Its first shape is shape `first`.
    pub fn set(&mut self, body: usize, first: usize, shapes: &[Shape]) {
        if body == self.first_shape.len() {
            self.first_shape.push(first as u32);
            for column in [&mut self.x, &mut self.y, &mut self.cos, &mut self.sin] {
                column.push(0.0);
            }
            self.reach.push(0.0);
            self.slack.push(0.0);
        }
        for (i, shape) in (first..).zip(shapes) {
            match self.outlines.get_mut(i) {
                Some(outline) => *outline = CoreOutline::new(shape),
                None => self.outlines.push(CoreOutline::new(shape)),
            }
        }
        let outlines = &self.outlines[first..first + shapes.len()];
        self.reach[body] = outlines.iter().map(CoreOutline::reach).fold(0.0, f32::max);
        self.forget(body);
    }

    /// Recomputes the body's boxes in the next update, even if it does not move.
    pub fn forget(&mut self, body: usize) {
        // Less than any distance.
        self.slack[body] = -1.0;
    }

    /// Excludes the body from all later updates.
    pub fn remove(&mut self, body: usize) {
        self.slack[body] = f32::INFINITY;
    }

    /// Recomputes the fat boxes that shapes have left; returns those shapes, ascending.
    ///
    /// `dt` (s) is the time step over which velocities are assumed constant; `unit` is the length unit that
    /// lengths of the parameters are multiplied by.
    pub fn update(
        &mut self,
        bodies: &Bodies,
        [dt, unit]: [f32; 2],
        proxies: &mut [Proxy],
        workers: &Workers,
    ) -> &[u32] {
        self.find_failed(bodies);
        let FatBoxes { x, y, cos, sin, reach, slack, outlines, first_shape, failed, found, moved } = self;
        let sight = Sight { bodies, reach, outlines, first_shape, dt, unit };
        let size = workers.part(failed.len(), LEAST_BODIES);
        let count = failed.len().div_ceil(size);
        found.resize_with(count.max(found.len()), Apart::default);
        let columns = [x, y, cos, sin, slack].map(|column| &mut **column);
        let mut rest = Section { body: 0, shape: 0, columns, proxies };
        let parts = failed.chunks(size).zip(&mut *found).map(|(failed, found)| {
            let end = failed.last().map_or(0, |&body| body as usize + 1);
            (failed, rest.split_off(end, sight.first_shape(end)), found)
        });
        workers.each(parts, |(failed, mut section, Apart(found))| {
            found.clear();
            failed.iter().for_each(|&body| section.look_at(body as usize, &sight, found));
        });
        moved.clear();
        moved.reserve(outlines.len());
        found[..count].iter().for_each(|Apart(found)| moved.extend_from_slice(found));
        moved
    }

    /// Lists the bodies for which (1) exceeds the slack or is NaN.
    fn find_failed(&mut self, bodies: &Bodies) {
        let mut failed = std::mem::take(&mut self.failed);
        failed.clear();
        failed.reserve(self.first_shape.len());
        self.failing(bodies, |body| failed.push(body as u32));
        self.failed = failed;
    }

    /// Calls `found` with every body for which (1) exceeds the slack or is NaN, ascending.
    pub fn failing(&self, bodies: &Bodies, mut found: impl FnMut(usize)) {
        let count = self.first_shape.len();
        let columns = [&self.x, &self.y, &self.cos, &self.sin, &self.reach, &self.slack];
        let [x0, y0, cos0, sin0, reach, slack] = columns.map(|c| c.lanes::<f32x16>());
        let columns = [&bodies.position_x, &bodies.position_y, &bodies.rotation_cos, &bodies.rotation_sin];
        let [x, y, cos, sin] = columns.map(|c| &c.lanes::<f32x16>()[..x0.len()]);
        for i in 0..x0.len() {
            let (turn_x, turn_y) = (cos[i] - cos0[i], sin[i] - sin0[i]);
            let turn = (turn_x * turn_x + turn_y * turn_y).sqrt();
            let shift = (x[i] - x0[i]).abs().fast_max((y[i] - y0[i]).abs());
            let mut failed = !(shift + reach[i] * turn).simd_le(slack[i]).to_bitmask() & 0xFFFF;
            while failed != 0 {
                let body = 16 * i + failed.trailing_zeros() as usize;
                failed &= failed - 1;
                if body < count {
                    found(body);
                }
            }
        }
    }
}

/// Smallest distance between `tight` and `fat` over all sides, minus the possible rounding error.
fn inset(fat: &Aabb, tight: &Aabb) -> f32 {
    let low = (tight.min - fat.min).min_element();
    let high = (fat.max - tight.max).min_element();
    let largest = fat.min.abs().max(fat.max.abs()).max_element();
    (low.min(high) * 0.999 - 16.0 * f32::EPSILON * largest).max(0.0)
}

/// The core points of a shape, some repeated, and its radius (m).
#[derive(Clone, Copy, Debug)]
struct CoreOutline {
    x: [f32; MAX_POLYGON_VERTICES],
    y: [f32; MAX_POLYGON_VERTICES],
    radius: f32,
}

impl CoreOutline {
    fn new(shape: &Shape) -> Self {
        let ends = |a, b| std::array::from_fn(|i| if i % 2 == 0 { a } else { b });
        let (core, radius) = match *shape {
            Shape::Circle { center, radius } => ([center; MAX_POLYGON_VERTICES], radius),
            Shape::Capsule { a, b, radius } => (ends(a, b), radius),
            Shape::Segment { a, b } => (ends(a, b), 0.0),
            Shape::Polygon(polygon) => (polygon.vertices, polygon.radius),
        };
        CoreOutline { x: core.map(|c| c.x), y: core.map(|c| c.y), radius }
    }

    /// r of (1).
    fn reach(&self) -> f32 {
        self.x.iter().zip(&self.y).map(|(&x, &y)| Vec2::new(x, y).length()).fold(0.0, f32::max)
    }

    /// [`Shape::aabb`], with the same operations on all points at once.
    #[inline]
    fn bounds(&self, pose: &Pose) -> Aabb {
        let (cos, sin) = (f32x8::splat(pose.rotation.x), f32x8::splat(pose.rotation.y));
        let (x, y) = (f32x8::new(self.x), f32x8::new(self.y));
        let (x, y) = ((cos * x - sin * y).to_array(), (sin * x + cos * y).to_array());
        let fold = |mut v: [f32; MAX_POLYGON_VERTICES], pick: fn(f32, f32) -> f32| {
            for half in [4, 2, 1] {
                for i in 0..half {
                    v[i] = pick(v[i], v[i + half]);
                }
            }
            v[0]
        };
        let low = |a: f32, b: f32| if a < b { a } else { b };
        let high = |a: f32, b: f32| if a > b { a } else { b };
        let min = pose.position + Vec2::new(fold(x, low), fold(y, low));
        let max = pose.position + Vec2::new(fold(x, high), fold(y, high));
        Aabb { min, max }.grown(self.radius)
    }
}
