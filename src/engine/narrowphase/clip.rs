//! Contact points of a reference face and an incident face, in lanes.
//!
//! Coordinates (N, T) are along the outward normal n of the reference face and along t = n⊥. Their origin is
//! near b's center of mass, so that small quantities keep their digits when a is the large ground. The
//! reference face runs from `low` to `high` along T at height `top`. The incident face is the face of the
//! other hull most opposed to n; it runs from its left end (large T) to its right one.
//!
//! *Clipped.* The incident face is cut to the range of T that the reference face covers. Cut ends take their
//! T exactly from the reference face, not from an interpolation.
//!
//! *Past an end.* If the deepest incident end q lies above and beside the reference face, the nearest point
//! of the reference hull is that end of the face, whatever the other shape is. The caller provides the
//! nearest point of the other shape to it. The normal is along the line between the two, and there is one
//! point. If faces are flush, rounding alone decides which end is deepest. Then q is the end nearer to the
//! face, and an edge over the face does not need q, so aligned boxes keep both points when they jitter. The
//! error of the distance is at most 1 in 10⁴.
//!
//! Source: Sutherland, Hodgman 1974 (clipping).

use super::Margins;
use super::lanes::{Touch, perp};
use crate::lanes::Lanes;

/// Between flush faces, b's becomes the reference only if it is better by this fraction of the slop (1).
/// Flush faces tie in exact arithmetic. Without a preference, rounding would decide their roles, and with
/// them the normal and the separations.
pub const REFERENCE_TOLERANCE: f32 = 0.1;

/// Faces are flush if the cosine between their normals is below this (1). This is 0.01 rad, the most that the
/// preference above can turn the normal.
pub const FLUSH: f32 = -0.99995;

/// Vertices closer than this fraction of the slop (1) do not define a normal: its rounding error, about 1e-7
/// of the coordinates divided by this length, would be noticeable. Points closer than this are merged.
const VERTEX_TOLERANCE: f32 = 0.01;

/// Largest overlap of two faces along T that is a graze, as a fraction of the shorter face (1), if this is
/// below the slop; see [`Touch::without_grazes`].
const GRAZE: f32 = 0.25;

/// The two faces that bound a contact.
pub struct Faces<L> {
    /// n, in world axes.
    pub normal: [L; 2],
    /// From the center of mass of b to the point N = T = 0, in world axes (m).
    pub origin: [L; 2],
    /// From the center of mass of a to that of b, in world axes (m).
    pub centers: [L; 2],
    /// Positive if the reference face is b's.
    pub flip: L,
    /// Positive if the shapes are farther apart than the speculative distance.
    pub beyond: L,
    /// Height of the reference face (m).
    pub top: L,
    /// T at its two ends (m).
    pub range: [L; 2],
    /// Ends of the incident face: left and right, each (N, T) (m).
    pub ends: [[L; 2]; 2],
    /// Component along n of the incident face's normal.
    pub opposed: L,
    /// Vertex numbers of the ends of `range`, and of those of `ends`.
    pub names: [[L; 2]; 2],
    /// Rounding radii of the reference hull and the incident one (m).
    pub radii: [L; 2],
}

/// The contact of two faces; points farther apart than `margins.speculative` (m) are omitted.
///
/// `nearest(end, wanted)` returns the vector from `end` to the nearest point of the incident hull, in (N, T).
/// Its value is used only if `wanted` is positive.
#[inline(always)]
pub fn touch<L: Lanes>(
    faces: &Faces<L>,
    margins: Margins,
    nearest: impl FnOnce([L; 2], L) -> [L; 2],
) -> Touch<L> {
    let (zero, one, half) = (L::zero(), L::splat(1.0), L::splat(0.5));
    let (none, speculative) = (-one, L::splat(margins.speculative));
    let same = L::splat(VERTEX_TOLERANCE * margins.slop);
    let Faces { normal: n, flip, top, range: [low, high], ends: [left, right], .. } = *faces;
    let [[first, second], [left_name, right_name]] = faces.names;
    let [r_radius, i_radius] = faces.radii;
    let radii = r_radius + i_radius;
    let (height_left, height_right) = (left[0] - top, right[0] - top);

    // The deepest end q, and whether it is past an end of the reference face.
    let parallel = L::splat(FLUSH) - faces.opposed;
    let left_is_past = low - left[1];
    let q_is_left = parallel.select_positive(left_is_past, height_right - height_left);
    let q = q_is_left.select_positive(left[1], right[1]);
    let q_height = q_is_left.select_positive(height_left, height_right);
    let (past_low, past_high) = (low - q, q - high);
    let outside = past_low.max(past_high);
    // Flush and within the range: clipped, whatever rounding does to q.
    let sticks_out = left_is_past.max(right[1] - high);
    let beside = parallel.select_positive(sticks_out.max(zero), one);
    let apart = q_height.min(outside).min(beside);

    // Clipped. An edge outside the range keeps its nearer end; an edge without extent (the end of a capsule,
    // the side of a needle) keeps both ends.
    let t_left = left[1].min(high).max(right[1]);
    let t_right = right[1].max(low).min(left[1]);
    let extent = left[1] - right[1];
    let wide = extent - L::splat(f32::MIN_POSITIVE);
    let slope = (height_right - height_left) / wide.select_positive(extent, one);
    let height_0 = wide.select_positive((left[1] - t_left).mul_add(slope, height_left), height_left);
    let height_1 = wide.select_positive((left[1] - t_right).mul_add(slope, height_left), height_right);
    // Surfaces along n: the incident one at −r_i from its core point, the reference one at −height + r_r from
    // it. Midway between them:
    let level = half * (r_radius - i_radius);
    let clipped = |height: L, t: L| [half.mul_add(height, top + level), t];
    let (p_0, p_1) = (clipped(height_0, t_left), clipped(height_1, t_right));
    let (s_0, s_1) = (height_0 - radii, height_1 - radii);
    let pick = |b: L, a: L| flip.select_positive(b, a);
    let name = |reference: L, incident: L| {
        let bits = L::splat(256.0);
        pick(bits.mul_add(reference, incident), bits.mul_add(incident, reference))
    };
    let (id_0, id_1) = (name(second, left_name), name(first, right_name));

    // Past an end: the nearest point of the incident hull.
    let end = [top, past_low.select_positive(low, high)];
    let g = nearest(end, apart.min(-faces.beyond));
    let distance = g[0].mul_add(g[0], g[1] * g[1]).sqrt();
    let away = distance - same;
    let inverse = one / away.select_positive(distance, one);
    let g = [away.select_positive(g[0] * inverse, one), away.select_positive(g[1] * inverse, zero)];
    let s_past = distance - radii;
    let out = half.mul_add(s_past, r_radius);
    let p_past = [out.mul_add(g[0], end[0]), out.mul_add(g[1], end[1])];
    let id_past =
        name(past_low.select_positive(first, second), q_is_left.select_positive(left_name, right_name));

    // Flush faces that overlap along T by less than a graze.
    let width = t_left - t_right;
    let graze = L::splat(margins.slop).min(L::splat(GRAZE) * extent.min(high - low));
    let passes = parallel.min(graze - width).min(s_0.min(s_1));

    // Selection of points. If almost nothing is left of the clipped face, only the deeper end is kept.
    let one_point = same - width;
    let near = |s: L| (s - speculative).select_positive(none, one);
    let keep_0 = one_point.select_positive((s_0 - s_1).select_positive(none, one), one).min(near(s_0));
    let keep_1 = one_point.select_positive((s_0 - s_1).select_positive(one, none), one).min(near(s_1));
    let choose = |past: L, clipped: L| apart.select_positive(past, clipped);
    let touching = faces.beyond.select_positive(none, one);
    let keep_0 = choose(near(s_past), keep_0).min(touching);
    let keep_1 = choose(none, keep_1).min(touching);
    let point_0 =
        [choose(p_past[0], p_0[0]), choose(p_past[1], p_0[1]), choose(s_past, s_0), choose(id_past, id_0)];
    let point_1 = [p_1[0], p_1[1], s_1, id_1];

    // In the order of a's face, and without holes. Relative to b the order is reversed.
    let both = keep_0.min(keep_1);
    let second_first = flip.min(both).max(-keep_0);
    let points = [
        std::array::from_fn::<L, 4, _>(|k| second_first.select_positive(point_1[k], point_0[k])),
        std::array::from_fn::<L, 4, _>(|k| second_first.select_positive(point_0[k], point_1[k])),
    ];
    let count = keep_0.max(zero) + keep_1.max(zero);
    let t = perp(n);
    let world = |v: [L; 2]| [n[0].mul_add(v[0], t[0] * v[1]), n[1].mul_add(v[0], t[1] * v[1])];
    let normal = world([choose(g[0], one), choose(g[1], zero)]);
    let anchor_b = points.map(|p| {
        let p = world([p[0], p[1]]);
        [p[0] + faces.origin[0], p[1] + faces.origin[1]]
    });
    Touch {
        normal: [pick(-normal[0], normal[0]), pick(-normal[1], normal[1])],
        count,
        anchor_a: anchor_b.map(|p| [p[0] + faces.centers[0], p[1] + faces.centers[1]]),
        anchor_b,
        separation: points.map(|p| p[2]),
        feature: points.map(|p| p[3]),
        passes,
    }
}
