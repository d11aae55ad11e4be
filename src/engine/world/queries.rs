//! Queries: rays, points and boxes against the bodies of a world.
//!
//! The tree of the broad phase finds shapes nearby; their distances are computed in `f64` ([`distance`]).
//!
//! **Rays.** At a point p of the ray, let d be the distance to the shape and n the direction to its nearest
//! point. The whole shape lies behind the plane at distance d with normal n. The ray may therefore advance to
//! that plane, by d / (n·u) along its direction u; if n·u ≤ 0, it misses. For a polygon this ends after a few
//! faces. For round shapes it is Newton's method on a convex function, from the side where it converges.
//! Source: `vandenbergen2004`.

use super::World;
use crate::bodies::BodyHandle;
use crate::bodies::def::finite_pair;
use crate::broadphase::Region;
use crate::error::Error;
use crate::narrowphase::gjk::distance;
use crate::shapes::{Aabb, Pose, Shape};
use glam::{DVec2, Vec2};

/// The first point where a ray meets a shape. Distances have a relative accuracy of 10⁻⁷.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RayHit {
    /// The body.
    pub body: BodyHandle,
    /// Index of the shape in [`World::shapes`].
    pub shape: usize,
    /// Hit point (m).
    pub point: [f64; 2],
    /// Outward unit normal of the shape; opposite to the ray if the ray starts inside.
    pub normal: [f64; 2],
    /// Distance from the start of the ray (m); 0 if the ray starts inside.
    pub distance: f64,
}

/// Distances below this (m) count as touching.
const TOUCH: f64 = 1e-9;

/// Maximum advances of a ray toward one shape: a polygon has at most eight faces, and Newton's method needs
/// few.
const MOST_ADVANCES: u32 = 64;

/// Bounds are `f32`: a query's region is enlarged by this fraction of its coordinates.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// Queries on the current positions. [`World::queries`] prepares many of them at once.
///
/// The tree has the bounds of the last step. Bodies that have left theirs since are tested one by one.
#[derive(Debug)]
pub struct Queries<'w> {
    world: &'w World,
    /// Shapes of bodies that may have left their bounds, with their current ones.
    strays: Vec<(u32, Aabb)>,
}

impl World {
    /// Prepares queries on the current positions. They do not change the bits of later steps.
    ///
    /// ```
    /// use simpulse_engine::prelude::*;
    ///
    /// let mut world = World::default();
    /// let ball = world.add_body(&BodyDef::dynamic([0.0, 2.0]).with(ShapeDef::circle(0.5)?))?;
    /// let queries = world.queries();
    /// let hit = queries.ray_cast([0.0, 10.0], [0.0, -1.0])?.expect("the ball is below");
    /// assert_eq!((hit.body, hit.distance), (ball, 7.5));
    /// assert_eq!(queries.bodies_at([0.4, 2.0])?, [ball]);
    /// assert_eq!(queries.bodies_in([0.45, 0.0], [3.0, 1.8])?, [ball]);
    /// // Its bounds reach into this box, but the ball does not.
    /// assert_eq!(queries.bodies_in([0.45, 0.0], [3.0, 1.6])?, []);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn queries(&self) -> Queries<'_> {
        let mut strays = Vec::new();
        self.fat_boxes.failing(&self.bodies, |body| {
            let first = self.slots.first_shape[body] as usize;
            let shapes = first..first + self.slots.shapes[body] as usize;
            let pose = self.bodies.pose(body);
            strays.extend(shapes.map(|i| (i as u32, self.shapes[i].aabb(&pose))));
        });
        Queries { world: self, strays }
    }

    /// One ray cast, see [`Queries::ray_cast`].
    pub fn ray_cast(&self, from: [f64; 2], direction: [f64; 2]) -> Result<Option<RayHit>, Error> {
        self.queries().ray_cast(from, direction)
    }
}

impl Queries<'_> {
    /// The first shape that an infinite ray hits. Errors: a value that is not finite, a direction of length
    /// zero.
    pub fn ray_cast(&self, from: [f64; 2], direction: [f64; 2]) -> Result<Option<RayHit>, Error> {
        self.ray_cast_where(from, direction, f64::INFINITY, |_| true)
    }

    /// The first shape within `reach` (m) along a ray, among bodies that pass `filter`. Errors: as
    /// [`Self::ray_cast`]; a reach that is negative or NaN.
    pub fn ray_cast_where(
        &self,
        from: [f64; 2],
        direction: [f64; 2],
        reach: f64,
        filter: impl Fn(BodyHandle) -> bool,
    ) -> Result<Option<RayHit>, Error> {
        finite_pair("from", from)?;
        finite_pair("direction", direction)?;
        if reach.is_nan() || reach < 0.0 {
            return Err(Error::invalid("reach", format!("must not be negative, is {reach:?}")));
        }
        let (origin, along) = (DVec2::from(from), DVec2::from(direction).normalize_or_zero());
        if along == DVec2::ZERO {
            return Err(Error::invalid("direction", "must not be zero"));
        }
        let mut best: Option<RayHit> = None;
        let mut region = Region::ray(origin.as_vec2(), along.as_vec2(), reach as f32);
        self.visit(&mut region, |region, shape, body| {
            let limit = best.map_or(reach, |hit| hit.distance);
            let Some((distance, normal)) = self.advance(shape, origin, along, limit) else { return };
            // At equal distances the lower index counts, whatever the order of the tree.
            let is_better = best.is_none_or(|hit| (distance, shape) < (hit.distance, hit.shape));
            if is_better && filter(body) {
                let point = (origin + distance * along).to_array();
                best = Some(RayHit { body, shape, point, normal: normal.to_array(), distance });
                region.shorten(distance as f32);
            }
        });
        Ok(best)
    }

    /// Bodies with a shape that contains a point (m), ascending. Errors: a value that is not finite.
    pub fn bodies_at(&self, point: [f64; 2]) -> Result<Vec<BodyHandle>, Error> {
        finite_pair("point", point)?;
        self.near(&Shape::Circle { center: Vec2::ZERO, radius: 0.0 }, DVec2::from(point), Vec2::ZERO)
    }

    /// Bodies with a shape that touches the box from corner `min` to corner `max` (m), ascending.
    ///
    /// Errors: a value that is not finite, a corner `max` that is not above and to the right of `min`.
    pub fn bodies_in(&self, min: [f64; 2], max: [f64; 2]) -> Result<Vec<BodyHandle>, Error> {
        finite_pair("min", min)?;
        finite_pair("max", max)?;
        let half = 0.5 * (DVec2::from(max) - DVec2::from(min));
        let shape = Shape::rectangle("box", half.as_vec2(), Vec2::ZERO, 0.0, 0.0)?;
        self.near(&shape, 0.5 * (DVec2::from(min) + DVec2::from(max)), half.as_vec2())
    }

    /// Bodies that touch a shape at `center` whose bounds extend `half` from there.
    fn near(&self, shape: &Shape, center: DVec2, half: Vec2) -> Result<Vec<BodyHandle>, Error> {
        let at = center.as_vec2();
        let margin = ROUNDING * (at.abs() + half).max_element();
        let mut region = Region::area(Aabb { min: at - half, max: at + half }.grown(margin));
        let mut found = Vec::new();
        self.visit(&mut region, |_, i, body| {
            if self.distance(i, shape, center).0 <= TOUCH {
                found.push(body);
            }
        });
        found.sort_unstable();
        found.dedup();
        Ok(found)
    }

    /// Calls `visit` with each shape whose bounds overlap the region, and with its body.
    fn visit(&self, region: &mut Region, mut visit: impl FnMut(&mut Region, usize, BodyHandle)) {
        let World { broadphase, proxies, .. } = self.world;
        let mut visit = |region: &mut Region, shape: u32| {
            if let Some(body) = self.world.handle(self.world.shape_body[shape as usize] as usize) {
                visit(region, shape as usize, body);
            }
        };
        broadphase.visit(proxies, region, &mut visit);
        for &(shape, aabb) in &self.strays {
            if region.meets(&aabb.grown(ROUNDING * aabb.min.abs().max(aabb.max.abs()).max_element())) {
                visit(region, shape);
            }
        }
    }

    /// Distance (m) of shape `i` from `other` at `center`, minus both radii, and the unit vector toward it; a
    /// zero vector where the cores overlap.
    fn distance(&self, i: usize, other: &Shape, center: DVec2) -> (f64, DVec2) {
        let bodies = &self.world.bodies;
        let body = self.world.shape_body[i] as usize;
        // Relative to the query, so that no precision is lost far from the origin.
        let offset = (DVec2::from(bodies.center(body)) - center).as_vec2();
        let pose = Pose { position: offset, ..bodies.pose(body) };
        let shape = &self.world.shapes[i];
        let found = distance(other, &Pose { position: Vec2::ZERO, rotation: Vec2::X }, shape, &pose);
        (found.distance - f64::from(shape.radius()) - f64::from(other.radius()), found.normal)
    }

    /// The first point of shape `i` along a ray, if within `limit`: distance (m) and outward normal.
    fn advance(&self, i: usize, origin: DVec2, along: DVec2, limit: f64) -> Option<(f64, DVec2)> {
        let point = Shape::Circle { center: Vec2::ZERO, radius: 0.0 };
        let (mut at, mut normal) = (0.0, -along);
        for _ in 0..MOST_ADVANCES {
            let (gap, toward) = self.distance(i, &point, origin + at * along);
            if gap <= TOUCH {
                break;
            }
            let approach = toward.dot(along);
            if approach <= 0.0 {
                return None;
            }
            normal = -toward;
            at += gap / approach;
            if at > limit {
                return None;
            }
        }
        Some((at, normal))
    }
}
