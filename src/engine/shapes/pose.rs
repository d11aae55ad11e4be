//! Poses and bounding boxes.

use glam::Vec2;

/// Position of a body's center of mass (m) and its rotation as (cos, sin).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Center of mass in the world (m).
    pub position: Vec2,
    /// Unit complex number (cos θ, sin θ).
    pub rotation: Vec2,
}

impl Pose {
    /// A pose from a position (m) and an angle (rad).
    pub fn new(position: Vec2, angle: f32) -> Self {
        Self { position, rotation: Vec2::from_angle(angle) }
    }

    /// World coordinates of a point given in the body's frame (m).
    #[inline]
    pub fn apply(&self, point: Vec2) -> Vec2 {
        self.position + self.rotation.rotate(point)
    }
}

/// Axis-aligned bounds (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: Vec2,
    /// Upper corner.
    pub max: Vec2,
}

impl Aabb {
    /// Whether the two overlap; touching counts.
    #[inline]
    pub fn overlaps(&self, other: &Aabb) -> bool {
        // Not short-circuited: four predictable comparisons beat four branches.
        (self.min.x <= other.max.x)
            & (other.min.x <= self.max.x)
            & (self.min.y <= other.max.y)
            & (other.min.y <= self.max.y)
    }

    /// The smallest bounds around both.
    #[inline]
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// These bounds expanded by `margin` (m) on every side.
    #[inline]
    pub fn grown(&self, margin: f32) -> Aabb {
        Aabb { min: self.min - Vec2::splat(margin), max: self.max + Vec2::splat(margin) }
    }

    /// Whether `other` lies inside; shared borders count.
    #[inline]
    pub fn contains(&self, other: &Aabb) -> bool {
        (self.min.x <= other.min.x)
            & (self.min.y <= other.min.y)
            & (other.max.x <= self.max.x)
            & (other.max.y <= self.max.y)
    }
}
