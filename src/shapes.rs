//! Convex shapes in their body's frame: mass properties, bounds, validation.

use crate::error::Error;
use crate::params::MAX_POLYGON_VERTICES;
use glam::Vec2;

/// Position of a body's centre of mass (m) and its rotation as (cos, sin).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Centre of mass in the world (m).
    pub position: Vec2,
    /// Unit complex number (cos θ, sin θ).
    pub rotation: Vec2,
}

/// Axis-aligned bounds (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec2,
    /// Upper corner.
    pub max: Vec2,
}

/// Mass (kg), centre of mass (m) and inertia about that centre (kg·m²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// kg
    pub mass: f64,
    /// m, in the frame the shape is given in
    pub center: [f64; 2],
    /// kg·m², about `center`
    pub inertia: f64,
}

/// A convex polygon of 3 to 8 vertices, counter-clockwise, grown by `radius`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Polygon {
    /// The first `count` are used (m).
    pub vertices: [Vec2; MAX_POLYGON_VERTICES],
    /// Outward unit normal of the edge from vertex i to vertex i + 1.
    pub normals: [Vec2; MAX_POLYGON_VERTICES],
    /// Number of vertices.
    pub count: u32,
    /// Rounding radius (m), ≥ 0.
    pub radius: f32,
}

/// A convex shape, in its body's frame (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// All points within `radius` of `center`.
    Circle {
        /// m
        center: Vec2,
        /// m, > 0
        radius: f32,
    },
    /// All points within `radius` of the segment a–b.
    Capsule {
        /// m
        a: Vec2,
        /// m
        b: Vec2,
        /// m, > 0
        radius: f32,
    },
    /// A rounded convex polygon.
    Polygon(Polygon),
    /// A two-sided line without mass.
    Segment {
        /// m
        a: Vec2,
        /// m
        b: Vec2,
    },
}
