//! Lane data read and written by the narrow phase.

use crate::contacts::{Manifold, ManifoldPoint};
use crate::lanes::{LaneIndex, Lanes, Quad};
use crate::shapes::{Polygon, Pose, Shape};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// A body's pose as two quads.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct PoseRow {
    /// Center of mass and its low part: `[x, y, x_lo, y_lo]` (m).
    pub position: [f32; 4],
    /// `[cos θ, sin θ, 1 if impulses do not move it, extent]`: the extent is the distance of the farthest point from the
    /// center of mass (m), 0 if the body is static.
    pub rotation: [f32; 4],
}

impl PoseRow {
    /// A pose with zero low part.
    pub fn new(pose: &Pose) -> Self {
        let (p, q) = (pose.position, pose.rotation);
        PoseRow { position: [p.x, p.y, 0.0, 0.0], rotation: [q.x, q.y, 0.0, 0.0] }
    }
}

/// Shape classes that kernels distinguish.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Class {
    /// A polygon with four right angles.
    #[default]
    Rectangle,
    /// A circle.
    Circle,
    /// Any other polygon, or a capsule.
    Hull,
    /// A segment.
    Segment,
}

/// A rectangle or circle, as two quads in its body's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct ShapeRow {
    /// `[center x, center y, axis x, axis y]` (m, 1): the axis is the outward normal of face 1.
    pub place: [f32; 4],
    /// Half extents along and across the axis, rounding radius (m), and 0. For a circle only the radius is
    /// non-zero.
    pub size: [f32; 4],
}

/// Largest distance of corners from those of the fitted rectangle, relative to its size (1): a few roundings.
const RECTANGLE_TOLERANCE: f32 = 1e-6;

impl ShapeRow {
    /// The class of a shape and its row. A shape that is neither rectangle nor circle gets the default row.
    pub fn new(shape: &Shape) -> (Class, Self) {
        match *shape {
            Shape::Circle { center, radius } => {
                let place = [center.x, center.y, 1.0, 0.0];
                (Class::Circle, ShapeRow { place, size: [0.0, 0.0, radius, 0.0] })
            }
            Shape::Segment { .. } => (Class::Segment, ShapeRow::default()),
            Shape::Capsule { .. } => (Class::Hull, ShapeRow::default()),
            Shape::Polygon(ref polygon) => match Self::rectangle(polygon) {
                Some(row) => (Class::Rectangle, row),
                None => (Class::Hull, ShapeRow::default()),
            },
        }
    }

    /// The row of a rectangle, rounded or not; `None` for other polygons.
    fn rectangle(polygon: &Polygon) -> Option<Self> {
        let v @ [_, _, _, _] = polygon.vertices() else { return None };
        let axis = polygon.normals[1];
        let center = 0.25 * ((v[0] + v[2]) + (v[1] + v[3]));
        let half = Vec2::new(0.5 * axis.dot(v[1] - v[0]), 0.5 * axis.perp_dot(v[2] - v[1]));
        let (x, y) = (half.x * axis, half.y * axis.perp());
        let corners = [center - x - y, center + x - y, center + x + y, center - x + y];
        // Rounding is relative to the coordinates, which may be larger than the shape.
        let size = half.max_element() + center.abs().max_element();
        let fits = |(corner, v): (&Vec2, &Vec2)| corner.distance(*v) <= RECTANGLE_TOLERANCE * size;
        let row = ShapeRow {
            place: [center.x, center.y, axis.x, axis.y],
            size: [half.x, half.y, polygon.radius, 0.0],
        };
        corners.iter().zip(v).all(fits).then_some(row)
    }
}

impl ShapeRow {
    /// `place` and `size` of `L::WIDTH` rows.
    #[inline(always)]
    pub fn gather<L: Lanes>(rows: &[ShapeRow], index: LaneIndex<L::Index>) -> [[L; 4]; 2] {
        let rows: &[Quad] = bytemuck::cast_slice(rows);
        [L::gather_quads::<2, 0>(rows, index), L::gather_quads::<2, 1>(rows, index)]
    }
}

/// The poses of two bodies, in lanes.
#[derive(Clone, Copy)]
pub struct Poses<L> {
    /// From the center of mass of a to that of b (m).
    pub centers: [L; 2],
    /// Rotations of a and b, (cos, sin).
    pub rotation: [[L; 2]; 2],
    /// 1 if impulses do not move the body (a, b), else 0.
    pub immovable: [L; 2],
    /// The larger extent of both bodies ([`PoseRow::rotation`]) (m).
    pub extent: L,
}

impl<L: Lanes> Poses<L> {
    /// Reads the poses of `L::WIDTH` pairs of bodies.
    #[inline(always)]
    pub fn gather(poses: &[PoseRow], [a, b]: [LaneIndex<L::Index>; 2]) -> Self {
        let poses: &[Quad] = bytemuck::cast_slice(poses);
        let (p, q) = (L::gather_quads::<2, 0>(poses, a), L::gather_quads::<2, 0>(poses, b));
        let (r, s) = (L::gather_quads::<2, 1>(poses, a), L::gather_quads::<2, 1>(poses, b));
        Poses {
            // As `Bodies::relative_poses`: the low parts make it as accurate far from the origin as near it.
            centers: [(q[0] - p[0]) + (q[2] - p[2]), (q[1] - p[1]) + (q[3] - p[3])],
            rotation: [[r[0], r[1]], [s[0], s[1]]],
            immovable: [r[2], s[2]],
            extent: r[3].max(s[3]),
        }
    }

    /// The same poses with a and b exchanged.
    #[inline(always)]
    pub fn swapped(self) -> Self {
        let ([a, b], [immovable_a, immovable_b]) = (self.rotation, self.immovable);
        let immovable = [immovable_b, immovable_a];
        Poses { centers: self.centers.map(|x| -x), rotation: [b, a], immovable, ..self }
    }
}

impl Poses<f32> {
    /// Poses of two bodies that impulses move, without extents.
    pub fn new(a: &Pose, b: &Pose) -> Self {
        let rotation = [a.rotation.into(), b.rotation.into()];
        Poses { centers: (b.position - a.position).into(), rotation, immovable: [0.0; 2], extent: 0.0 }
    }
}

/// Two shapes fully described by a [`ShapeRow`] each, and the poses of their bodies, in lanes.
pub struct ShapePair<L> {
    /// Poses.
    pub poses: Poses<L>,
    /// [`ShapeRow::place`] of a and b.
    pub place: [[L; 4]; 2],
    /// [`ShapeRow::size`] of a and b.
    pub size: [[L; 4]; 2],
}

impl<L: Lanes> ShapePair<L> {
    /// Reads `L::WIDTH` pairs of shapes.
    #[inline(always)]
    pub fn gather(poses: Poses<L>, rows: &[ShapeRow], [a, b]: [LaneIndex<L::Index>; 2]) -> Self {
        let [place_a, size_a] = ShapeRow::gather(rows, a);
        let [place_b, size_b] = ShapeRow::gather(rows, b);
        ShapePair { poses, place: [place_a, place_b], size: [size_a, size_b] }
    }
}

impl<L: Lanes> ShapePair<L> {
    /// Relative displacement of the shapes' centers when bodies move by `[x, y, θ, 0]` (m, rad).
    #[inline(always)]
    pub fn displacement(&self, displacements: [[L; 4]; 2]) -> [L; 2] {
        let center = |k: usize| rotate(self.poses.rotation[k], [self.place[k][0], self.place[k][1]]);
        displacement_between(displacements, [center(0), center(1)])
    }
}

/// Displacement of the point at `r[1]` from b's center relative to the point at `r[0]` from a's, in world
/// axes (m).
#[inline(always)]
pub fn displacement_between<L: Lanes>(displacements: [[L; 4]; 2], r: [[L; 2]; 2]) -> [L; 2] {
    let of = |k: usize| {
        [
            displacements[k][2].neg_mul_add(r[k][1], displacements[k][0]),
            displacements[k][2].mul_add(r[k][0], displacements[k][1]),
        ]
    };
    let ([ax, ay], [bx, by]) = (of(0), of(1));
    [bx - ax, by - ay]
}

/// Manifolds without impulses, in lanes. Points from `count` on have no meaning.
pub struct Touch<L> {
    /// Unit normal from a to b.
    pub normal: [L; 2],
    /// Points in use: 0, 1 or 2.
    pub count: L,
    /// Anchor of each point, from the center of mass of a (m).
    pub anchor_a: [[L; 2]; 2],
    /// Anchor of each point, from the center of mass of b (m).
    pub anchor_b: [[L; 2]; 2],
    /// Signed gap of each point (m).
    pub separation: [L; 2],
    /// Feature id of each point, as a float.
    pub feature: [L; 2],
    /// Positive if flush faces are separate, and their overlap along the faces is no more than a graze.
    pub passes: L,
}

impl<L: Lanes> Touch<L> {
    /// The same contacts with a and b exchanged, for points whose ids are all 0.
    #[inline(always)]
    pub fn swapped(self) -> Self {
        let normal = self.normal.map(|x| -x);
        Touch { normal, anchor_a: self.anchor_b, anchor_b: self.anchor_a, ..self }
    }

    /// Removes contacts of separate flush faces that only graze each other. In a step contacts look ahead. A
    /// box sliding over a floor of tiles overlaps the side of the next tile by micrometers, and such a
    /// contact would stop it.
    #[inline(always)]
    pub fn without_grazes(self) -> Self {
        Touch { count: self.passes.select_positive(L::zero(), self.count), ..self }
    }

    /// The same contacts with points on the surface of b if `immovable` is 1, and midway between both surfaces if
    /// it is 0.
    ///
    /// Two moving bodies must share the point, or impulses would change their angular momentum. A body on a
    /// immovable one has friction at its own surface: a disc that overlaps the ground by s and slides at v rolls
    /// away at v/(1 + I/(m r a)) with the arm a. That is 2/3 v for a = r, and 2/9 s/r v less for a = r − s/2.
    #[inline(always)]
    pub fn against_immovable(self, immovable: L) -> Self {
        let [nx, ny] = self.normal;
        let half = L::splat(0.5) * immovable;
        let moved = |anchors: [[L; 2]; 2]| {
            std::array::from_fn(|p| {
                let to_surface = half * self.separation[p];
                [to_surface.mul_add(nx, anchors[p][0]), to_surface.mul_add(ny, anchors[p][1])]
            })
        };
        Touch { anchor_a: moved(self.anchor_a), anchor_b: moved(self.anchor_b), ..self }
    }
}

impl<L: Lanes> Touch<L> {
    /// The same one-point contact with another gap (m).
    #[inline(always)]
    pub fn with_gap(self, gap: L) -> Self {
        Touch { separation: [gap, self.separation[1]], ..self }
    }
}

impl Touch<f32> {
    /// The manifold of a single lane.
    pub fn manifold(&self) -> Manifold {
        let count = self.count as u32;
        if count == 0 {
            return Manifold::default();
        }
        let mut points = [ManifoldPoint::default(); 2];
        for (p, point) in points.iter_mut().enumerate().take(count as usize) {
            *point = ManifoldPoint {
                anchor_a: self.anchor_a[p].into(),
                anchor_b: self.anchor_b[p].into(),
                separation: self.separation[p],
                feature_id: self.feature[p] as u32,
                ..ManifoldPoint::default()
            };
        }
        Manifold { normal: self.normal.into(), count, points }
    }
}

/// v rotated by (cos, sin).
#[inline(always)]
pub fn rotate<L: Lanes>(q: [L; 2], v: [L; 2]) -> [L; 2] {
    [q[0] * v[0] - q[1] * v[1], q[1] * v[0] + q[0] * v[1]]
}

/// v rotated by the inverse of (cos, sin).
#[inline(always)]
pub fn unrotate<L: Lanes>(q: [L; 2], v: [L; 2]) -> [L; 2] {
    [q[0] * v[0] + q[1] * v[1], q[0] * v[1] - q[1] * v[0]]
}

/// a·b
#[inline(always)]
pub fn dot<L: Lanes>(a: [L; 2], b: [L; 2]) -> L {
    a[0].mul_add(b[0], a[1] * b[1])
}

/// v rotated left by a right angle.
#[inline(always)]
pub fn perp<L: Lanes>(v: [L; 2]) -> [L; 2] {
    [-v[1], v[0]]
}

/// |x|
#[inline(always)]
pub fn abs<L: Lanes>(x: L) -> L {
    x.max(-x)
}
