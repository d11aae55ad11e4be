//! Contact geometry: two shapes at two poses in, one [`Manifold`] out.
//!
//! Every shape is a convex core grown by a radius, so a signed distance is that
//! of the cores less both radii. Two circles need one square root; a circle
//! against anything needs the closest point of a core; all other pairs are two
//! hulls (polygon, capsule, segment) under the separating axis test.
//!
//! Only the difference of the positions enters, so a scene loses nothing far
//! from the origin beyond the rounding of that difference. Coordinates are then
//! relative to b's centre of mass: where one body is large it is the ground,
//! which is a, and what is small about the contact keeps its digits.
//!
//! [`gjk`] and [`epa`] answer the same questions by another road, in `f64`,
//! to check this one.

pub mod batch;
mod circle;
pub mod circles;
pub mod epa;
pub mod gjk;
mod hull;
mod hull_hull;
pub mod lanes;
pub mod rectangles;

use crate::contacts::{Manifold, ManifoldPoint};
use crate::shapes::{Pose, Shape};
use glam::Vec2;
use hull::Hull;
use lanes::{Pair, ShapeRow};

/// Contact of shape `a` with shape `b`, each in the frame of its body's centre of mass.
///
/// The normal points from a to b, in world axes. Points farther apart than
/// `speculative_distance` (m, ≥ 0) are left out; without points the manifold is the
/// default one. Each point lies midway between the two surfaces; `anchor_a − anchor_b`
/// is the difference of the centres of mass, to rounding.
///
/// `feature_id` is `vertex of a | vertex of b << 8` for two hulls: each end of the
/// contact is named by the vertex of a and the vertex of b that bound it there, so the
/// name survives when the reference face passes from one shape to the other. With a
/// circle there is only one point, and its id is always 0.
///
/// Where the geometry does not define a normal, it is still a unit vector: (0, 1) for
/// coincident circle centres, the left side of a → b for a circle centred on a segment
/// or capsule axis, the nearest face for a circle centred in a polygon.
///
/// Two segments never touch: neither has mass.
pub fn collide(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, speculative_distance: f32) -> Manifold {
    let frame = Frame::new(pose_a, pose_b);
    // What lanes do in a step is done here with one lane: the same bits.
    if let (Some(a), Some(b)) = (ShapeRow::rectangle(a), ShapeRow::rectangle(b)) {
        return rectangles::collide(&frame.pair(a, b), speculative_distance).manifold();
    }
    if let (Some(a), Some(b)) = (ShapeRow::circle(a), ShapeRow::circle(b)) {
        return circles::collide(&frame.pair(a, b), speculative_distance).manifold();
    }
    match (a, b) {
        (Shape::Polygon(p), Shape::Polygon(q)) => {
            if p.count.max(q.count) <= 4 {
                let (p, q) = (Hull::<4>::polygon(p), Hull::<4>::polygon(q));
                hull_hull::collide(p, q, &frame, speculative_distance)
            } else {
                let (p, q) = (Hull::<8>::polygon(p), Hull::<8>::polygon(q));
                hull_hull::collide(p, q, &frame, speculative_distance)
            }
        }
        (_, Shape::Circle { center, radius }) => {
            circle::collide(a, *center, *radius, &frame, speculative_distance)
        }
        (Shape::Circle { center, radius }, _) => {
            circle::collide(b, *center, *radius, &frame.swapped(), speculative_distance).swapped()
        }
        (Shape::Segment { .. }, Shape::Segment { .. }) => Manifold::default(),
        _ => collide_capsule(a, b, &frame, speculative_distance),
    }
}

/// At least one of the two is a capsule or a segment, none is a circle.
fn collide_capsule(a: &Shape, b: &Shape, frame: &Frame, speculative_distance: f32) -> Manifold {
    if let (Some(a), Some(b)) = (Hull::<4>::of(a), Hull::<4>::of(b)) {
        hull_hull::collide(a, b, frame, speculative_distance)
    } else if let (Some(a), Some(b)) = (Hull::<8>::of(a), Hull::<8>::of(b)) {
        hull_hull::collide(a, b, frame, speculative_distance)
    } else {
        Manifold::default()
    }
}

/// What a pair of poses means to the contact between them.
struct Frame {
    /// From the centre of mass of a to that of b, world axes (m).
    centers: Vec2,
    /// Rotation of a.
    rotation_a: Vec2,
    /// Rotation of b.
    rotation_b: Vec2,
}

impl Frame {
    #[inline(always)]
    fn new(pose_a: &Pose, pose_b: &Pose) -> Self {
        Self {
            centers: pose_b.position - pose_a.position,
            rotation_a: pose_a.rotation,
            rotation_b: pose_b.rotation,
        }
    }

    fn pair(&self, a: ShapeRow, b: ShapeRow) -> Pair<f32> {
        Pair {
            centers: self.centers.into(),
            rotation: [self.rotation_a.into(), self.rotation_b.into()],
            place: [a.place, b.place],
            size: [a.size, b.size],
        }
    }

    fn swapped(&self) -> Self {
        Self { centers: -self.centers, rotation_a: self.rotation_b, rotation_b: self.rotation_a }
    }
}

impl Manifold {
    /// The manifold of the same contact with a and b exchanged.
    pub fn swapped(mut self) -> Manifold {
        if self.count > 0 {
            self.normal = -self.normal;
        }
        for point in &mut self.points[..self.count as usize] {
            std::mem::swap(&mut point.anchor_a, &mut point.anchor_b);
            point.feature_id = point.feature_id >> 8 | (point.feature_id & 0xff) << 8;
        }
        self
    }

    fn single(normal: Vec2, point: ManifoldPoint) -> Manifold {
        Manifold { normal, count: 1, points: [point, ManifoldPoint::default()] }
    }
}

/// Rotates by the inverse of `rotation`.
#[inline(always)]
fn unrotate(rotation: Vec2, v: Vec2) -> Vec2 {
    Vec2::new(rotation.x * v.x + rotation.y * v.y, rotation.x * v.y - rotation.y * v.x)
}
