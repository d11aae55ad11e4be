//! Penetration depth of two convex cores, using only their support functions.
//!
//! The depth is the distance of the origin from the boundary of M = B ⊖ A. Keep a convex polygon of vertices
//! of M, counter-clockwise. Take its edge nearest to the origin (by signed distance) and compute the support
//! of M along that edge's normal. If M does not extend past the edge, the edge lies on the boundary and is
//! the result. Otherwise insert the support and repeat.
//!
//! The initial polygon consists of the supports along ±x and ±y. It need not contain the origin or have an
//! area: an edge with the origin outside has a negative distance and is expanded first.
//!
//! Source: van den Bergen, Game Developers Conference 2001.

use super::gjk::Cores;
use crate::shapes::{Pose, Shape};
use glam::DVec2;

/// Depth of the overlap of two cores (the shapes without their radii).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Penetration {
    /// Length of the shortest translation that separates the cores (m). Negative if they are separate; its
    /// magnitude is then the largest separation of any face, at most the distance.
    pub depth: f64,
    /// Unit vector from a to b: moving b along it by `depth` separates the cores.
    pub normal: DVec2,
    /// Number of supports evaluated after the first four.
    pub iterations: u32,
}

/// Progress below which an edge counts as on the boundary, relative to the size of M: rounding.
const TOLERANCE: f64 = 1.0e-14;

/// M has at most 16 vertices, and each iteration except the last finds one.
const MAX_ITERATIONS: u32 = 64;

/// Penetration of the cores of `a` and `b`. The normal is (0, 1) if both are the same point.
pub fn penetration(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> Penetration {
    let cores = Cores::new(a, pose_a, b, pose_b);
    let mut border: Vec<DVec2> = Vec::with_capacity(16);
    for direction in [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y] {
        let vertex = cores.support(direction).position;
        if !border.contains(&vertex) {
            border.push(vertex);
        }
    }
    if border.len() == 1 {
        return Penetration {
            depth: -border[0].length(),
            normal: border[0].normalize_or(DVec2::Y),
            iterations: 0,
        };
    }
    let size = border.iter().map(|v| v.abs().max_element()).fold(0.0, f64::max);

    let mut iterations = 0;
    loop {
        let n = border.len();
        // Distance of the edge that starts at vertex i from the origin, positive if the origin is inside.
        let edge = |i: usize| {
            let outward = -(border[(i + 1) % n] - border[i]).perp().normalize();
            (i, outward, outward.dot(border[i]))
        };
        let (i, outward, distance) =
            (1..n).map(edge).fold(edge(0), |best, e| if e.2 < best.2 { e } else { best });
        let vertex = cores.support(outward).position;
        iterations += 1;
        let progress = outward.dot(vertex) - distance;
        if progress <= TOLERANCE * size || border.contains(&vertex) || iterations >= MAX_ITERATIONS {
            // M is b minus a: moving b along the inward normal moves the origin out of M.
            return Penetration { depth: distance, normal: -outward, iterations };
        }
        border.insert(i + 1, vertex);
    }
}
