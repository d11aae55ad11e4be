//! The view of a polygon, capsule or segment that the separating axis test reads.

use crate::shapes::{Polygon, Shape};
use glam::Vec2;

/// A rounded convex hull of at most `N` vertices, counter-clockwise, by coordinates.
///
/// Slots past the last vertex repeat it and its face. A repeated vertex changes no
/// minimum over vertices and a repeated face no maximum over faces, so the loops
/// below run over all `N` without asking for a count, and become vector code.
///
/// A capsule or segment is the rectangle a, b, b, a of no width. Its two end faces
/// have no length but a normal along the axis; without them the test could not see
/// that two collinear capsules are apart.
#[derive(Clone, Copy)]
pub(super) struct Hull<const N: usize> {
    pub x: [f32; N],
    pub y: [f32; N],
    pub nx: [f32; N],
    pub ny: [f32; N],
    pub radius: f32,
    /// Index of the last vertex.
    last: usize,
    /// Whether vertices 1 and 2, and 3 and 0, are one.
    flat: bool,
}

impl<const N: usize> Hull<N> {
    /// The hull of a shape that is no circle and has at most `N` vertices.
    pub fn of(shape: &Shape) -> Option<Self> {
        match shape {
            Shape::Polygon(polygon) if polygon.count as usize <= N => Some(Self::polygon(polygon)),
            Shape::Capsule { a, b, radius } => Some(Self::capsule(*a, *b, *radius)),
            Shape::Segment { a, b } => Some(Self::capsule(*a, *b, 0.0)),
            _ => None,
        }
    }

    /// The hull of a polygon of at most `N` vertices.
    #[inline(always)]
    pub fn polygon(polygon: &Polygon) -> Self {
        let (v, n) = (&polygon.vertices, &polygon.normals);
        Self {
            x: std::array::from_fn(|i| v[i].x),
            y: std::array::from_fn(|i| v[i].y),
            nx: std::array::from_fn(|i| n[i].x),
            ny: std::array::from_fn(|i| n[i].y),
            radius: polygon.radius,
            last: polygon.count as usize - 1,
            flat: false,
        }
    }

    fn capsule(a: Vec2, b: Vec2, radius: f32) -> Self {
        let along = (b - a).normalize_or(Vec2::X);
        let v: [Vec2; N] = std::array::from_fn(|i| if i == 1 || i == 2 { b } else { a });
        let normals = [-along.perp(), along, along.perp(), -along];
        let n: [Vec2; N] = std::array::from_fn(|i| normals[i.min(3)]);
        Self {
            x: v.map(|v| v.x),
            y: v.map(|v| v.y),
            nx: n.map(|n| n.x),
            ny: n.map(|n| n.y),
            radius,
            last: 3,
            flat: true,
        }
    }

    /// The hull moved by `offset`.
    #[inline(always)]
    pub fn moved(mut self, offset: Vec2) -> Self {
        for i in 0..N {
            self.x[i] += offset.x;
            self.y[i] += offset.y;
        }
        self
    }

    /// The hull turned by `rotation` (cos, sin) about the origin.
    #[inline(always)]
    pub fn turned(&self, rotation: Vec2) -> Self {
        let (c, s) = (rotation.x, rotation.y);
        let mut turned = *self;
        for i in 0..N {
            turned.x[i] = c * self.x[i] - s * self.y[i];
            turned.y[i] = s * self.x[i] + c * self.y[i];
            turned.nx[i] = c * self.nx[i] - s * self.ny[i];
            turned.ny[i] = s * self.nx[i] + c * self.ny[i];
        }
        turned
    }

    #[inline(always)]
    pub fn vertex(&self, i: usize) -> Vec2 {
        Vec2::new(self.x[i], self.y[i])
    }

    #[inline(always)]
    pub fn normal(&self, i: usize) -> Vec2 {
        Vec2::new(self.nx[i], self.ny[i])
    }

    #[inline(always)]
    pub fn next(&self, i: usize) -> usize {
        if i >= self.last { 0 } else { i + 1 }
    }

    #[inline(always)]
    pub fn previous(&self, i: usize) -> usize {
        if i == 0 { self.last } else { i - 1 }
    }

    /// What feature ids call vertex `i`: both copies of a capsule's end are one.
    #[inline(always)]
    pub fn name(&self, i: usize) -> u32 {
        (if self.flat { (i + 1) >> 1 & 1 } else { i }) as u32
    }

    /// The face of `self` from which `other` is farthest, and how far that is (m):
    /// max over faces i of min over vertices j of nᵢ·(wⱼ − vᵢ).
    #[inline(always)]
    pub fn best_face(&self, other: &Self) -> (usize, f32) {
        let mut nearest = [f32::INFINITY; N];
        for (&x, &y) in other.x.iter().zip(&other.y) {
            nearest = std::array::from_fn(|i| {
                let height = self.nx[i] * x + self.ny[i] * y;
                if height < nearest[i] { height } else { nearest[i] }
            });
        }
        nearest = std::array::from_fn(|i| nearest[i] - (self.nx[i] * self.x[i] + self.ny[i] * self.y[i]));
        self.first_max(nearest)
    }

    /// The face whose normal is most opposed to `direction`.
    #[inline(always)]
    pub fn opposing_face(&self, direction: Vec2) -> usize {
        self.first_max(std::array::from_fn(|i| -(self.nx[i] * direction.x + self.ny[i] * direction.y))).0
    }

    /// Largest value and its slot, by halving: a chain of log₂ N comparisons.
    #[inline(always)]
    fn first_max(&self, mut values: [f32; N]) -> (usize, f32) {
        let mut slots: [u32; N] = std::array::from_fn(|i| i as u32);
        let mut width = N / 2;
        while width > 0 {
            for i in 0..width {
                let upper = values[i + width] > values[i];
                slots[i] = if upper { slots[i + width] } else { slots[i] };
                values[i] = if upper { values[i + width] } else { values[i] };
            }
            width /= 2;
        }
        ((slots[0] as usize).min(self.last), values[0])
    }
}
