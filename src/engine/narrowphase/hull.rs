//! Polygons, capsules and segments in the form used by the lane kernels.

use crate::lanes::{LaneIndex, Lanes, MOST_LANES, Quad};
use crate::params::MAX_POLYGON_VERTICES;
use crate::shapes::Shape;
use bytemuck::{Pod, Zeroable};
use glam::Vec2;

/// A rounded convex hull in its body's frame, counter-clockwise: nine quads.
///
/// Slots past the last vertex repeat it and its face. A repeated vertex changes no minimum over vertices, and
/// a repeated face no maximum over faces, so kernels may process more slots than a hull has. In ties they
/// prefer the later slot. So the last slot processed, which is followed by vertex 0, stands for the last
/// vertex, however many there are.
///
/// A capsule or segment is the rectangle a, a, b, b of zero width. Its two end faces have no length, but a
/// normal along the axis; without them no axis would separate collinear capsules. The side to the left of a →
/// b comes last, so it is the nearest face of a point on the axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct HullRow {
    /// Rounding radius (m), slot of the last vertex, 1 for a capsule or segment (else 0), and 0.
    pub head: [f32; 4],
    /// Each vertex with the outward normal of the face from it to the next: `[x, y, nx, ny]` (m, 1).
    pub corners: [[f32; 4]; MAX_POLYGON_VERTICES],
}

/// Number of quads in a [`HullRow`].
const STRIDE: usize = size_of::<HullRow>() / 16;

impl HullRow {
    /// The row of a shape; the default row for a circle.
    pub fn new(shape: &Shape) -> Self {
        let corner = |v: Vec2, n: Vec2| [v.x, v.y, n.x, n.y];
        let flat = |a: Vec2, b: Vec2, radius: f32| {
            let along = (b - a).normalize_or(Vec2::X);
            let [end_a, right, end_b, left] = [-along, -along.perp(), along, along.perp()];
            let corners = [corner(a, end_a), corner(a, right), corner(b, end_b), corner(b, left)];
            HullRow { head: [radius, 3.0, 1.0, 0.0], corners: std::array::from_fn(|i| corners[i.min(3)]) }
        };
        match *shape {
            Shape::Polygon(p) => HullRow {
                head: [p.radius, p.count as f32 - 1.0, 0.0, 0.0],
                corners: std::array::from_fn(|i| corner(p.vertices[i], p.normals[i])),
            },
            Shape::Capsule { a, b, radius } => flat(a, b, radius),
            Shape::Segment { a, b } => flat(a, b, 0.0),
            Shape::Circle { .. } => HullRow::default(),
        }
    }
}

/// Hulls in lanes.
pub struct Hull<L> {
    /// As [`HullRow::corners`]. Only the slots used by the batch are filled.
    pub corners: [[L; 4]; MAX_POLYGON_VERTICES],
    /// As [`HullRow::head`].
    pub head: [L; 4],
}

impl<L: Lanes> Hull<L> {
    /// Empty buffers.
    pub fn empty() -> Self {
        Hull { corners: [[L::zero(); 4]; MAX_POLYGON_VERTICES], head: [L::zero(); 4] }
    }

    /// Reads the heads of `L::WIDTH` hulls; returns the largest number of slots of any of them.
    #[inline(always)]
    pub fn gather_heads(&mut self, rows: &[HullRow], index: LaneIndex<L::Index>) -> usize {
        if let Some(row) = index.only() {
            self.head = rows[row].head.map(L::splat);
            return (rows[row].head[1] as usize + 1).min(MAX_POLYGON_VERTICES);
        }
        self.head = L::gather_quads::<STRIDE, 0>(bytemuck::cast_slice(rows), index);
        let last = bytemuck::cast_slice(std::slice::from_ref(&self.head[1]));
        let most = last.iter().fold(0.0_f32, |most, &last| if last > most { last } else { most });
        (most as usize + 1).min(MAX_POLYGON_VERTICES)
    }

    /// Reads the first `count` corners of `L::WIDTH` hulls and transforms each by `place`.
    #[inline(always)]
    pub fn gather_corners(
        &mut self,
        rows: &[HullRow],
        index: LaneIndex<L::Index>,
        count: usize,
        place: impl Fn([L; 4]) -> [L; 4],
    ) {
        if let Some(row) = index.only() {
            for (corner, from) in self.corners[..count].iter_mut().zip(&rows[row].corners) {
                *corner = place(from.map(L::splat));
            }
            return;
        }
        let quads: &[Quad] = bytemuck::cast_slice(rows);
        let mut first = [0; MOST_LANES];
        for (first, &row) in first.iter_mut().zip(index.entries()) {
            *first = row * STRIDE as u32 + 1;
        }
        let first = LaneIndex::new(&first);
        for (slot, corner) in self.corners[..count].iter_mut().enumerate() {
            *corner = place(L::gather_quads::<1, 0>(&quads[slot..], first));
        }
    }
}
