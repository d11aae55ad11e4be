//! Distance of two convex cores, using only their support functions.
//!
//! The distance is that of the origin from M = B ⊖ A. Keep a simplex of one or two vertices of M and its
//! point v nearest to the origin. The support w of M in direction −v bounds the distance from below by
//! v·w/|v|. Stop if |v| meets the bound. Otherwise add w and drop the vertex that the new nearest point does
//! not need.
//!
//! Everything is `f64`, so the result serves as a reference for `f32` shapes.
//!
//! Source: Gilbert, Johnson, Keerthi, IEEE J. Robot. Autom. 4(2), 1988.

use crate::shapes::{Pose, Shape};
use glam::DVec2;

/// Nearest points of two cores (the shapes without their radii). If the cores overlap, the points are
/// arbitrary vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoreDistance {
    /// Distance (m); 0 if the cores share a point.
    pub distance: f64,
    /// Nearest point of a, relative to a's center of mass, world axes (m).
    pub point_a: DVec2,
    /// Nearest point of b, relative to a's center of mass, world axes (m).
    pub point_b: DVec2,
    /// Unit vector from a to b; zero if the distance is zero.
    pub normal: DVec2,
    /// Number of supports evaluated after the first.
    pub iterations: u32,
}

/// Relative progress below which the distance is final: rounding in `f64`, with a reserve.
const TOLERANCE: f64 = 1.0e-14;

/// Every step of a convergent run finds a new vertex of M, which has at most 16.
const MAX_ITERATIONS: u32 = 64;

/// Distance of the cores of `a` and `b`.
pub fn distance(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> CoreDistance {
    let cores = Cores::new(a, pose_a, b, pose_b);
    let mut simplex = Simplex { support: [cores.support(DVec2::X); 2], weight: [1.0, 0.0] };
    let mut iterations = 0;
    loop {
        let v = simplex.nearest();
        let w = cores.support(-v);
        iterations += 1;
        let gap = v.length_squared() - v.dot(w.position);
        if gap <= TOLERANCE * v.length_squared() || iterations >= MAX_ITERATIONS {
            return simplex.distance(iterations);
        }
        match simplex.extended(w) {
            Some(next) if next.nearest().length_squared() < v.length_squared() => simplex = next,
            Some(_) => return simplex.distance(iterations),
            None => {
                let zero = Simplex { support: [simplex.support[0]; 2], weight: [1.0, 0.0] };
                return CoreDistance { distance: 0.0, normal: DVec2::ZERO, ..zero.distance(iterations) };
            }
        }
    }
}

/// A vertex of M, and the points of a and b whose difference it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct SupportVertex {
    pub position: DVec2,
    point_a: DVec2,
    point_b: DVec2,
}

/// The vertices of both cores, world axes, relative to a's center of mass.
pub(super) struct Cores {
    a: Vec<DVec2>,
    b: Vec<DVec2>,
}

impl Cores {
    pub fn new(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> Self {
        let place = |shape: &Shape, rotation: DVec2, offset: DVec2| {
            let mut vertices = Vec::new();
            shape.for_each_vertex(|v| vertices.push(offset + rotation.rotate(v.as_dvec2())));
            vertices
        };
        let centers = pose_b.position.as_dvec2() - pose_a.position.as_dvec2();
        Self {
            a: place(a, pose_a.rotation.as_dvec2(), DVec2::ZERO),
            b: place(b, pose_b.rotation.as_dvec2(), centers),
        }
    }

    /// The vertex of M = B ⊖ A farthest along `direction`.
    pub fn support(&self, direction: DVec2) -> SupportVertex {
        let farthest = |vertices: &[DVec2], direction: DVec2| {
            let mut best = vertices[0];
            for &v in vertices {
                if v.dot(direction) > best.dot(direction) {
                    best = v;
                }
            }
            best
        };
        let (point_a, point_b) = (farthest(&self.a, -direction), farthest(&self.b, direction));
        SupportVertex { position: point_b - point_a, point_a, point_b }
    }
}

/// One or two vertices of M (the second unused if its weight is 0) and the barycentric weights of the nearest
/// point.
#[derive(Clone, Copy, Debug)]
struct Simplex {
    support: [SupportVertex; 2],
    weight: [f64; 2],
}

impl Simplex {
    fn nearest(&self) -> DVec2 {
        self.weight[0] * self.support[0].position + self.weight[1] * self.support[1].position
    }

    /// The point of the segment p–q nearest to the origin.
    fn segment(p: SupportVertex, q: SupportVertex) -> Simplex {
        let edge = q.position - p.position;
        let t = -p.position.dot(edge) / edge.length_squared();
        // NaN if p = q.
        if t.is_nan() || t <= 0.0 {
            Simplex { support: [p, q], weight: [1.0, 0.0] }
        } else if t >= 1.0 {
            Simplex { support: [q, p], weight: [1.0, 0.0] }
        } else {
            Simplex { support: [p, q], weight: [1.0 - t, t] }
        }
    }

    /// The nearest simplex formed by this one and `w`; `None` if the three vertices surround the origin.
    fn extended(&self, w: SupportVertex) -> Option<Simplex> {
        let [p, q] = self.support;
        if self.weight[1] == 0.0 {
            return Some(Simplex::segment(p, w));
        }
        // The origin is inside if it is on the same side of all three edges.
        let side = |u: SupportVertex, v: SupportVertex| u.position.perp_dot(v.position);
        let (s0, s1, s2) = (side(p, q), side(q, w), side(w, p));
        if (s0 >= 0.0 && s1 >= 0.0 && s2 >= 0.0) || (s0 <= 0.0 && s1 <= 0.0 && s2 <= 0.0) {
            return None;
        }
        // Outside, the nearest point is on an edge at w, since v was nearest on p–q.
        let (first, second) = (Simplex::segment(p, w), Simplex::segment(q, w));
        Some(if first.nearest().length_squared() <= second.nearest().length_squared() {
            first
        } else {
            second
        })
    }

    fn distance(&self, iterations: u32) -> CoreDistance {
        let mix = |of: fn(&SupportVertex) -> DVec2| {
            self.weight[0] * of(&self.support[0]) + self.weight[1] * of(&self.support[1])
        };
        let v = self.nearest();
        CoreDistance {
            distance: v.length(),
            point_a: mix(|s| s.point_a),
            point_b: mix(|s| s.point_b),
            normal: v.normalize_or_zero(),
            iterations,
        }
    }
}
