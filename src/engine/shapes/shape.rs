//! A convex core (point, segment or polygon) grown by a radius.

use super::check::{
    MIN_LENGTH, MIN_RELATIVE_AREA, MIN_RELATIVE_TURN, check_length, check_point, check_rounding,
    check_segment,
};
use super::mass::{MassProperties, outward, rounded_hull_mass};
use super::pose::{Aabb, Pose};
use crate::error::Error;
use crate::params::MAX_POLYGON_VERTICES;
use glam::{DVec2, Vec2};
use std::f64::consts::PI;

/// A convex polygon of 3 to 8 vertices, counter-clockwise, grown by `radius`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Polygon {
    /// The first `count` are used (m); the others repeat the last one, so that fixed-width code may read all
    /// eight.
    pub vertices: [Vec2; MAX_POLYGON_VERTICES],
    /// Outward unit normal of the edge from vertex i to vertex i + 1; padded like `vertices`.
    pub normals: [Vec2; MAX_POLYGON_VERTICES],
    /// Number of vertices.
    pub count: u32,
    /// Rounding radius (m), ≥ 0.
    pub radius: f32,
}

impl Polygon {
    /// The vertices in use.
    pub fn vertices(&self) -> &[Vec2] {
        &self.vertices[..self.count as usize]
    }

    fn padded(vertices: &[Vec2], normals: &[Vec2], radius: f32) -> Self {
        let last = vertices.len() - 1;
        let pad = |from: &[Vec2]| std::array::from_fn(|i| from[i.min(last)]);
        Self { vertices: pad(vertices), normals: pad(normals), count: vertices.len() as u32, radius }
    }
}

/// A convex shape, in its body's frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Shape {
    /// All points within `radius` of `center`.
    Circle {
        /// Center (m).
        center: Vec2,
        /// Radius (m), > 0.
        radius: f32,
    },
    /// All points within `radius` of the segment a–b.
    Capsule {
        /// First end of the axis (m).
        a: Vec2,
        /// Second end of the axis (m).
        b: Vec2,
        /// Radius (m), > 0.
        radius: f32,
    },
    /// A rounded convex polygon.
    Polygon(Polygon),
    /// A two-sided line without mass.
    Segment {
        /// First end (m).
        a: Vec2,
        /// Second end (m).
        b: Vec2,
    },
}

impl Shape {
    /// A circle. `place` identifies the shape in errors, here and below.
    ///
    /// Errors: a value that is not finite or out of range, `radius` ≤ 0.
    pub fn circle(place: &str, center: Vec2, radius: f32) -> Result<Shape, Error> {
        check_point(place, "center", center)?;
        check_length(place, "radius", radius)?;
        Ok(Shape::Circle { center, radius })
    }

    /// A capsule around the segment a–b.
    ///
    /// Errors: as [`Shape::circle`], and a segment shorter than [`MIN_LENGTH`]
    /// or than the rounding of its own coordinates (use a circle instead).
    pub fn capsule(place: &str, a: Vec2, b: Vec2, radius: f32) -> Result<Shape, Error> {
        check_segment(place, a, b)?;
        check_length(place, "radius", radius)?;
        Ok(Shape::Capsule { a, b, radius })
    }

    /// A massless two-sided line from a to b. Errors: as [`Shape::capsule`].
    pub fn segment(place: &str, a: Vec2, b: Vec2) -> Result<Shape, Error> {
        check_segment(place, a, b)?;
        Ok(Shape::Segment { a, b })
    }

    /// A rectangle with half extents hx × hy, turned by `angle` (rad) about its
    /// `center`, then grown by `radius` ≥ 0.
    ///
    /// Errors: a value that is not finite or out of range, a half extent ≤ 0, `radius` < 0.
    /// There is no sliver limit, since the normals are not computed from the vertices.
    pub fn rectangle(place: &str, half: Vec2, center: Vec2, angle: f32, radius: f32) -> Result<Shape, Error> {
        check_length(place, "half_width", half.x)?;
        check_length(place, "half_height", half.y)?;
        check_point(place, "center", center)?;
        check_rounding(place, radius)?;
        if !angle.is_finite() {
            return Err(Error::invalid(place, format!("angle {angle} is not finite")));
        }
        let turn = DVec2::from_angle(f64::from(angle));
        let corner = |x: f32, y: f32| center + turn.rotate(Vec2::new(x, y).as_dvec2()).as_vec2();
        let vertices = [
            corner(-half.x, -half.y),
            corner(half.x, -half.y),
            corner(half.x, half.y),
            corner(-half.x, half.y),
        ];
        let right = turn.as_vec2();
        let normals = [-right.perp(), right, right.perp(), -right];
        Ok(Shape::Polygon(Polygon::padded(&vertices, &normals, radius)))
    }

    /// A convex polygon of 3 to 8 vertices in either winding, grown by `radius` ≥ 0.
    ///
    /// Errors, naming the vertex by its index in `vertices`: not finite or out of range; coincident with
    /// another vertex; collinear with its neighbors ([`MIN_RELATIVE_TURN`]); not convex; a sliver
    /// ([`MIN_RELATIVE_AREA`]); `radius` < 0.
    pub fn polygon(place: &str, vertices: &[Vec2], radius: f32) -> Result<Shape, Error> {
        let n = vertices.len();
        if !(3..=MAX_POLYGON_VERTICES).contains(&n) {
            let message = format!("{n} vertices, where 3 to {MAX_POLYGON_VERTICES} are possible");
            return Err(Error::invalid(place, message));
        }
        for (i, &v) in vertices.iter().enumerate() {
            check_point(place, &format!("vertices[{i}]"), v)?;
        }
        check_rounding(place, radius)?;

        // Twice the signed area; clockwise input is negative and read backward.
        let given: Vec<DVec2> = vertices.iter().map(|v| v.as_dvec2()).collect();
        let area2: f64 = (1..n - 1).map(|i| (given[i] - given[0]).perp_dot(given[i + 1] - given[0])).sum();
        let index = |i: usize| if area2 < 0.0 { n - 1 - i % n } else { i % n };
        let at = |i: usize| given[index(i)];
        let fail = |i: usize, what: &str| {
            let i = index(i);
            Err(Error::invalid(place, format!("vertices[{i}] = {} {what}", vertices[i])))
        };

        let pairs = || (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        let diameter = pairs().map(|(i, j)| at(i).distance(at(j))).fold(0.0, f64::max);
        if diameter < f64::from(MIN_LENGTH) {
            return fail(0, "coincides with all others");
        }
        if let Some((i, j)) = pairs().find(|&(i, j)| at(i).distance(at(j)) < MIN_RELATIVE_TURN * diameter) {
            return fail(j, &format!("coincides with vertices[{}]", index(i)));
        }
        for i in 0..n {
            let (edge, next) = (at(i + 1) - at(i), at(i + 2) - at(i + 1));
            let turn = edge.perp_dot(next) / (edge.length() * next.length());
            if turn.abs() < MIN_RELATIVE_TURN {
                return fail(i + 1, "is collinear with its neighbors");
            }
            // Left turns alone would also accept a star that winds twice, so every vertex must lie to the
            // left of every edge.
            if turn < 0.0 {
                return fail(i + 1, "makes the polygon concave");
            }
            if let Some(j) = (i + 2..i + n).find(|&j| edge.perp_dot(at(j) - at(i)) < 0.0) {
                return fail(j, "makes the polygon cross itself");
            }
        }
        let relative_area = 0.5 * area2.abs() / (diameter * diameter);
        if relative_area < MIN_RELATIVE_AREA {
            let message =
                format!("a sliver: area is {relative_area:e} of diameter², less than {MIN_RELATIVE_AREA:e}");
            return Err(Error::invalid(place, message));
        }

        let ordered: Vec<Vec2> = (0..n).map(|i| at(i).as_vec2()).collect();
        let normals: Vec<Vec2> = (0..n).map(|i| outward(at(i), at(i + 1)).as_vec2()).collect();
        Ok(Shape::Polygon(Polygon::padded(&ordered, &normals, radius)))
    }

    /// Checks that coordinates and radius are in range: the fields are public, and shapes may have been
    /// translated.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let mut result = Ok(());
        self.for_each_vertex(|v| {
            if result.is_ok() {
                result = check_point("shape", "vertex", v);
            }
        });
        result?;
        match self {
            Shape::Circle { radius, .. } | Shape::Capsule { radius, .. } => {
                check_length("shape", "radius", *radius)
            }
            _ => check_rounding("shape", self.radius()),
        }
    }

    /// Rounding radius (m); 0 for a segment.
    #[inline]
    pub fn radius(&self) -> f32 {
        match self {
            Shape::Circle { radius, .. } | Shape::Capsule { radius, .. } => *radius,
            Shape::Polygon(polygon) => polygon.radius,
            Shape::Segment { .. } => 0.0,
        }
    }

    /// Calls `visit` with each vertex of the core.
    #[inline]
    pub fn for_each_vertex(&self, mut visit: impl FnMut(Vec2)) {
        match self {
            Shape::Circle { center, .. } => visit(*center),
            Shape::Capsule { a, b, .. } | Shape::Segment { a, b } => {
                visit(*a);
                visit(*b);
            }
            Shape::Polygon(polygon) => polygon.vertices().iter().for_each(|&v| visit(v)),
        }
    }

    /// Mass, center and inertia at `density` (kg/m²), exact to `f64` rounding;
    /// zero for a segment.
    pub fn mass(&self, density: f64) -> MassProperties {
        let radius = f64::from(self.radius());
        match self {
            Shape::Circle { center, .. } => {
                let mass = density * PI * radius * radius;
                MassProperties::new(mass, center.as_dvec2(), 0.5 * mass * radius * radius)
            }
            Shape::Segment { .. } => MassProperties::ZERO,
            _ => {
                let mut core = Vec::with_capacity(MAX_POLYGON_VERTICES);
                self.for_each_vertex(|v| core.push(v.as_dvec2()));
                rounded_hull_mass(&core, radius, density)
            }
        }
    }

    /// The same shape moved by `offset` (m).
    pub fn translated(&self, offset: Vec2) -> Shape {
        match *self {
            Shape::Circle { center, radius } => Shape::Circle { center: center + offset, radius },
            Shape::Capsule { a, b, radius } => Shape::Capsule { a: a + offset, b: b + offset, radius },
            Shape::Segment { a, b } => Shape::Segment { a: a + offset, b: b + offset },
            Shape::Polygon(polygon) => {
                Shape::Polygon(Polygon { vertices: polygon.vertices.map(|v| v + offset), ..polygon })
            }
        }
    }

    /// Bounds in the world (m).
    #[inline]
    pub fn aabb(&self, pose: &Pose) -> Aabb {
        let (mut min, mut max) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        self.for_each_vertex(|v| {
            let v = pose.rotation.rotate(v);
            min = min.min(v);
            max = max.max(v);
        });
        Aabb { min: pose.position + min, max: pose.position + max }.grown(self.radius())
    }

    /// The point of the shape farthest along `direction` (m, body frame); the first core vertex, without the
    /// radius, if `direction` is zero.
    pub fn support(&self, direction: Vec2) -> Vec2 {
        let (mut best, mut height) = (Vec2::ZERO, f32::NEG_INFINITY);
        self.for_each_vertex(|v| {
            if v.dot(direction) > height {
                (best, height) = (v, v.dot(direction));
            }
        });
        best + self.radius() * direction.normalize_or_zero()
    }

    /// Distance of the farthest point from the origin, which is the body's center of mass in a world (m).
    pub fn reach(&self) -> f32 {
        let mut reach = 0.0_f32;
        self.for_each_vertex(|v| reach = reach.max(v.length()));
        reach + self.radius()
    }

    /// Half the smallest width of the shape (m); deeper overlap is past its middle. Infinite for a segment,
    /// which has no interior, so the minimum over a pair is that of the other shape.
    pub fn min_half_extent(&self) -> f32 {
        match self {
            Shape::Circle { radius, .. } | Shape::Capsule { radius, .. } => *radius,
            Shape::Segment { .. } => f32::INFINITY,
            Shape::Polygon(polygon) => {
                // The smallest width of a convex polygon is perpendicular to one of its faces.
                let width = |i: usize| {
                    let depth = |&v: &Vec2| polygon.normals[i].dot(polygon.vertices[i] - v);
                    polygon.vertices().iter().map(depth).fold(0.0, f32::max)
                };
                0.5 * (0..polygon.count as usize).map(width).fold(f32::INFINITY, f32::min) + polygon.radius
            }
        }
    }
}
