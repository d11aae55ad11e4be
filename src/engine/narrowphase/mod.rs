//! Contact geometry: takes two shapes at two poses, returns one [`Manifold`].
//!
//! Every shape is a convex core grown by a radius, so a signed distance is that of the cores minus both
//! radii. Two circles ([`circles`]) need one square root. A circle against any other shape ([`hull_circle`])
//! needs the closest point of a core. All other pairs are two hulls (polygon, capsule, segment) and use the
//! separating axis test ([`hulls`]), which has a closed form for two [`rectangles`]. Each kernel is written
//! in lanes; [`batch`] runs it over the pairs of a step.
//!
//! Only the difference of the positions enters, so far from the origin a scene loses no precision beyond the
//! rounding of that difference. Coordinates are then relative to b's center of mass: a large body is usually
//! the ground, which is a, so the small quantities of the contact keep their digits.
//!
//! [`gjk`] and [`epa`] compute the same quantities independently, in `f64`, to check this module.

pub mod batch;
pub mod candidate;
pub mod circles;
pub mod clip;
pub mod epa;
pub mod frozen;
pub mod gjk;
pub mod hull;
pub mod hull_circle;
pub mod hulls;
pub mod lanes;
pub mod rectangles;
pub mod seams;

use crate::contacts::Manifold;
use crate::params::{LINEAR_SLOP, SPECULATIVE_DISTANCE};
use crate::shapes::{Pose, Shape};
use batch::PairKind;
use hull::HullRow;
use hull_circle::HullCircle;
use hulls::Hulls;
use lanes::{Poses, ShapePair, ShapeRow, Touch};

/// Contact of shape `a` with shape `b`, each in the frame of its body's center of mass.
///
/// The normal points from a to b, in world axes. Points farther apart than `speculative_distance` (m, ≥ 0)
/// are omitted; without points the manifold is the default one. Each point lies midway between the two
/// surfaces; `anchor_a − anchor_b` is the difference of the centers of mass, up to rounding.
///
/// `feature_id` is `vertex of a | vertex of b << 8` for two hulls: each end of the contact is identified by
/// the vertex of a and the vertex of b that bound it, so the id stays the same when the reference face
/// changes from one shape to the other. With a circle there is only one point, and its id is always 0.
///
/// If the geometry does not define a normal, the normal is still a unit vector: (0, 1) for coincident circle
/// centers, the left side of a → b for a circle centered on a segment or capsule axis, the nearest face for a
/// circle centered in a polygon.
///
/// Two segments never touch: neither has mass.
pub fn collide(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, speculative_distance: f32) -> Manifold {
    Collider::new(a, b)
        .map_or_else(Manifold::default, |pair| pair.collide([pose_a, pose_b], speculative_distance))
}

/// As [`collide`], for the coming step. Unhindered bodies would move by `displacements` (`[x, y, θ, 0]`, m and rad).
/// If `a_is_immovable`, the body of `a` is not moved by impulses, and points lie on the surface of `b`. Grazes,
/// which bodies slide over, are omitted.
pub fn collide_in_step(
    [a, b]: [&Shape; 2],
    poses: [&Pose; 2],
    displacements: [[f32; 4]; 2],
    a_is_immovable: bool,
    margins: Margins,
) -> Manifold {
    Collider::new(a, b).map_or_else(Manifold::default, |pair| {
        pair.touch(poses, displacements, a_is_immovable, margins).without_grazes().manifold()
    })
}

/// Distance thresholds of a collision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Points farther apart are omitted (m).
    pub speculative: f32,
    /// Overlap that position correction leaves uncorrected (m).
    pub slop: f32,
}

impl Margins {
    /// For bodies of a typical size of `length_unit` (m).
    pub fn of(length_unit: f32) -> Self {
        Margins { speculative: SPECULATIVE_DISTANCE * length_unit, slop: LINEAR_SLOP * length_unit }
    }

    /// For bodies of a typical size of 1 m, with points up to `speculative` apart (m).
    pub fn within(speculative: f32) -> Self {
        Margins { speculative, slop: LINEAR_SLOP }
    }
}

/// Two shapes in kernel form, for collisions at several poses.
pub(crate) struct Collider {
    kind: PairKind,
    rows: [ShapeRow; 2],
    /// Rows of shapes that are neither rectangles nor circles.
    hulls: [HullRow; 2],
}

impl Collider {
    /// `None` for two segments.
    pub(crate) fn new(a: &Shape, b: &Shape) -> Option<Self> {
        let ((class_a, row_a), (class_b, row_b)) = (ShapeRow::new(a), ShapeRow::new(b));
        let kind = PairKind::of(class_a, class_b)?;
        let none = HullRow::default();
        let hulls = match kind {
            PairKind::Rectangles | PairKind::Circles => [none; 2],
            PairKind::Hulls => [HullRow::new(a), HullRow::new(b)],
            PairKind::HullCircle => [HullRow::new(a), none],
            PairKind::CircleHull => [none, HullRow::new(b)],
        };
        Some(Collider { kind, rows: [row_a, row_b], hulls })
    }

    /// As [`collide`].
    pub(crate) fn collide(&self, poses: [&Pose; 2], speculative_distance: f32) -> Manifold {
        self.touch(poses, [[0.0; 4]; 2], false, Margins::within(speculative_distance)).manifold()
    }

    /// As [`collide_in_step`], including grazes. Uses one lane, with the same bits as the lanes of a step.
    fn touch(
        &self,
        [pose_a, pose_b]: [&Pose; 2],
        displacements: [[f32; 4]; 2],
        a_is_immovable: bool,
        margins: Margins,
    ) -> Touch<f32> {
        let [row_a, row_b] = self.rows;
        let poses = Poses::<f32>::new(pose_a, pose_b);
        let immovable = f32::from(u8::from(a_is_immovable));
        let pair = ShapePair { poses, place: [row_a.place, row_b.place], size: [row_a.size, row_b.size] };
        match self.kind {
            PairKind::Rectangles => rectangles::collide(&pair, margins).against_immovable(immovable),
            PairKind::Circles => {
                let pair = ShapePair { poses: Poses { immovable: [immovable, 0.0], ..poses }, ..pair };
                circles::in_step(&pair, displacements, None, margins).0
            }
            PairKind::Hulls => {
                Hulls::new(&poses, &self.hulls).collide(&poses, margins).against_immovable(immovable)
            }
            PairKind::HullCircle => {
                let (touch, gap, _) =
                    HullCircle::new(self.hulls[0], row_b).in_step(&poses, displacements, None, margins);
                touch.against_immovable(immovable).with_gap(gap)
            }
            PairKind::CircleHull => {
                let (pair, poses) = (HullCircle::new(self.hulls[1], row_a), poses.swapped());
                let (touch, gap, _) =
                    pair.in_step(&poses, [displacements[1], displacements[0]], None, margins);
                touch.swapped().against_immovable(immovable).with_gap(gap)
            }
        }
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
}
