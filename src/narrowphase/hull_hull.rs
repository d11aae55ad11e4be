//! Two rounded hulls: separating axis test, then clipping or a pair of vertices.
//!
//! **Axis.** Let M be the Minkowski difference of the cores. Its edges are the faces
//! of both, and the distance of the origin from the line of a face is that face's
//! separation, nᵢ·(nearest vertex − vᵢ). If the cores overlap, the face of largest
//! (least negative) separation gives the depth exactly. If they are apart, that face
//! carries the point of M closest to the origin, inside it or at one of its ends:
//! for any face whose line is no farther than that of a face at the closest vertex V
//! has its normal farther from V's direction, and then lies behind V.
//!
//! **Features.** So with reference face v₁v₂ and deepest vertex q of the other hull,
//! the closest pair is (face, q) if q projects between v₁ and v₂, else (end, q). In the
//! second case the normal is that of the vertex pair, and there is one point.
//!
//! **Clipping.** In the first case the incident edge — of the two at q, the one most
//! opposed to the face — is cut to the part between v₁ and v₂; its ends are the points.
//!
//! Source: Gottschalk, Lin, Manocha 1996 (separating axes); Sutherland, Hodgman 1974 (clipping).

use super::hull::Hull;
use super::{Frame, unrotate};
use crate::contacts::{Manifold, ManifoldPoint};
use crate::params::LINEAR_SLOP;
use glam::Vec2;

/// Between flush faces, b's becomes the reference only if it is better
/// by this much (m). They tie in exact arithmetic; without a preference their
/// roles, and with them normal and separations, would follow the rounding.
pub(super) const REFERENCE_TOLERANCE: f32 = 0.1 * LINEAR_SLOP;

/// Faces are flush if the cosine between their normals is below this (1): 0.01 rad, by
/// which the preference above then turns the normal at most.
pub(super) const FLUSH: f32 = -0.99995;

/// Vertices closer than this (m) do not define a normal: its rounding, about 1e-7 of
/// the coordinates over this length, would show. Points closer than this are one.
pub(super) const VERTEX_TOLERANCE: f32 = 0.01 * LINEAR_SLOP;

/// Contact of two hulls, each in its body's frame.
#[inline(always)]
pub(super) fn collide<const N: usize>(a: Hull<N>, b: Hull<N>, frame: &Frame, speculative: f32) -> Manifold {
    // Axes of a, origin at b's centre of mass.
    let offset = unrotate(frame.rotation_a, -frame.centers);
    let relative = unrotate(frame.rotation_a, frame.rotation_b);
    let a = a.moved(offset);
    let b = b.turned(relative);
    let reach = speculative + a.radius + b.radius;

    let (face_a, separation_a) = a.best_face(&b);
    if separation_a > reach {
        return Manifold::default();
    }
    let (face_b, separation_b) = b.best_face(&a);
    if separation_b > reach {
        return Manifold::default();
    }
    let flush = a.normal(face_a).dot(b.normal(face_b)) < FLUSH;
    let preference = if flush { REFERENCE_TOLERANCE } else { 0.0 };
    let flip = separation_b > separation_a + preference;
    let local = if flip { touch(&b, face_b, &a, speculative) } else { touch(&a, face_a, &b, speculative) };
    local.into_world(frame, flip)
}

/// A manifold in a's axes from b's centre of mass, its normal out of the reference hull.
struct Local {
    normal: Vec2,
    count: usize,
    points: [LocalPoint; 2],
}

#[derive(Clone, Copy, Default)]
struct LocalPoint {
    position: Vec2,
    separation: f32,
    /// Name of the vertex of the reference hull and of the incident hull.
    reference: u32,
    incident: u32,
}

impl Local {
    #[inline(always)]
    fn into_world(self, frame: &Frame, flip: bool) -> Manifold {
        let mut manifold = Manifold { count: self.count as u32, ..Manifold::default() };
        if self.count == 0 {
            return manifold;
        }
        let normal = frame.rotation_a.rotate(self.normal);
        manifold.normal = if flip { -normal } else { normal };
        for k in 0..self.count {
            let point = self.points[k];
            let (a, b) =
                if flip { (point.incident, point.reference) } else { (point.reference, point.incident) };
            let anchor_b = frame.rotation_a.rotate(point.position);
            // Seen from the other hull the two ends come in the other order.
            let slot = if flip { self.count - 1 - k } else { k };
            manifold.points[slot] = ManifoldPoint {
                anchor_a: anchor_b + frame.centers,
                anchor_b,
                separation: point.separation,
                feature_id: a | b << 8,
                ..ManifoldPoint::default()
            };
        }
        manifold
    }
}

/// The contact of reference hull `r`, at its face `face`, with incident hull `i`.
#[inline(always)]
fn touch<const N: usize>(r: &Hull<N>, face: usize, i: &Hull<N>, speculative: f32) -> Local {
    let normal = r.normal(face);
    // Along the face, from its first to its second vertex: counter-clockwise is left of the normal.
    let tangent = normal.perp();
    let (first, second) = (face, r.next(face));
    let v1 = r.vertex(first);
    let length = tangent.dot(r.vertex(second) - v1);

    // The incident edge runs against the face, from `left` (large s) to `right` (small s).
    let mut left = i.opposing_face(normal);
    let mut right = i.next(left);
    let height = |j: usize| normal.dot(i.vertex(j) - v1);
    let along = |j: usize| tangent.dot(i.vertex(j) - v1);
    let (mut h_left, mut h_right) = (height(left), height(right));
    let (mut s_left, mut s_right) = (along(left), along(right));

    // The deepest vertex q. A flush edge has no deepest end but by rounding: there, q is
    // the end nearer to the face, and an edge over the face needs no q, so that aligned
    // boxes keep both points however they tremble. The distance is off by 1 in 10⁴ at most.
    let flush = normal.dot(i.normal(left)) < FLUSH;
    let q_is_left = if flush { s_left < 0.0 } else { h_left < h_right };
    let (q, s, h) = if q_is_left { (left, s_left, h_left) } else { (right, s_right, h_right) };
    let over = flush && s_left >= 0.0 && s_right <= length;
    if h > 0.0 && (s < 0.0 || s > length) && !over {
        match past_end(r, face, s < 0.0, i, q, speculative) {
            Past::Apart(local) => return local,
            Past::Over(edge) => (left, right) = edge,
        }
        (h_left, h_right) = (height(left), height(right));
        (s_left, s_right) = (along(left), along(right));
    }

    // Cut the edge to 0 ≤ s ≤ length. Fractions are clamped, so an edge that misses the
    // range leaves its nearer end, and one without extent leaves both of its (equal) ends.
    let extent = s_left - s_right;
    let wide = extent > f32::MIN_POSITIVE;
    let per_extent = if wide { extent.recip() } else { 0.0 };
    let from = ((s_left - length) * per_extent).clamp(0.0, 1.0);
    let to = if wide { (s_left * per_extent).clamp(0.0, 1.0) } else { 1.0 };

    let radii = r.radius + i.radius;
    let edge = i.vertex(right) - i.vertex(left);
    let point = |fraction: f32, reference: usize, incident: usize| {
        let core = i.vertex(left) + fraction * edge;
        let height = h_left + fraction * (h_right - h_left);
        // The surfaces along the normal: incident at −r_i from its core point, reference
        // at −height + r_r from it. Midway between them:
        let position = core - 0.5 * (height + i.radius - r.radius) * normal;
        LocalPoint {
            position,
            separation: height - radii,
            reference: r.name(reference),
            incident: i.name(incident),
        }
    };
    let mut points = [point(from, second, left), point(to, first, right)];
    let mut count = 2;
    if (to - from) * extent < VERTEX_TOLERANCE {
        // The two are one: keep the deeper.
        count = 1;
        if points[1].separation < points[0].separation {
            points[0] = points[1];
        }
    } else if points[1].separation > speculative {
        count = 1;
    }
    if points[0].separation > speculative {
        points[0] = points[1];
        count -= 1;
    }
    Local { normal, count, points }
}

/// What is closest to an end of the reference face when the deepest vertex is past it.
enum Past {
    /// A point past the end, too: the whole contact.
    Apart(Local),
    /// An incident edge that leads back over the face.
    Over((usize, usize)),
}

/// Walks from vertex `q` of the incident hull, which is past the first or else the second
/// end of the face, back over the face, for as long as that comes closer to the end.
///
/// In exact arithmetic the first look decides. Rounding, where one hull is 10⁵ times as
/// large as the other, may start the walk at a neighbour of the closest vertex.
#[cold]
#[inline(never)]
fn past_end<const N: usize>(
    r: &Hull<N>,
    face: usize,
    past_first: bool,
    i: &Hull<N>,
    mut q: usize,
    speculative: f32,
) -> Past {
    let tangent = r.normal(face).perp();
    let (end, inward) = if past_first { (face, tangent) } else { (r.next(face), -tangent) };
    let p = r.vertex(end);
    let mut nearest = i.vertex(q);
    for _ in 0..N {
        let neighbor = if past_first { i.previous(q) } else { i.next(q) };
        let edge = i.vertex(neighbor) - i.vertex(q);
        let approach = edge.dot(p - i.vertex(q));
        nearest = i.vertex(q);
        if approach <= 0.0 && edge != Vec2::ZERO {
            break;
        }
        if inward.dot(i.vertex(neighbor) - p) > 0.0 {
            return Past::Over(if past_first { (neighbor, q) } else { (q, neighbor) });
        }
        if approach < edge.length_squared() {
            nearest += approach / edge.length_squared() * edge;
            break;
        }
        q = neighbor;
    }
    let apart = nearest - p;
    let distance = apart.length();
    let normal = if distance > VERTEX_TOLERANCE { apart / distance } else { r.normal(face) };
    let separation = distance - r.radius - i.radius;
    let point = LocalPoint {
        position: p + (r.radius + 0.5 * separation) * normal,
        separation,
        reference: r.name(end),
        incident: i.name(q),
    };
    let count = usize::from(separation <= speculative);
    Past::Apart(Local { normal, count, points: [point, LocalPoint::default()] })
}
