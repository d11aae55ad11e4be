//! Two rounded rectangles, in lanes: what `hull_hull` does, in closed form and without branches.
//!
//! A rectangle is its centre, an axis u, and half extents along u and u⊥. All four of its faces
//! face along ±u or ±u⊥, so with d from the centre of a to that of b, the face of a toward b
//! along axis w is farthest from b by
//!
//! ```text
//! |d·w| − h_w − (|w·u_b| h_bx + |w·u_b⊥| h_by)                                          (1)
//! ```
//!
//! The face of largest (1) over both rectangles is the reference face (why, see `hull_hull`); b's
//! only if it is better by a tolerance where both are flush. From here on coordinates (N, T) are
//! along its outward normal n and t = n⊥, with their origin at the centre of b, so that what is
//! small keeps its digits where a is the large ground. The incident face is the one of the other
//! rectangle most opposed to n: its outward normal f has f_N < 0, and it runs from its left end
//! (large T) to its right one (small T).
//!
//! *Clipped.* The incident face, cut to the range of T that the reference face covers. Ends that
//! are cut take their T from the reference face exactly, not from an interpolation.
//!
//! *Past an end.* If the deepest incident end lies above and beside the reference face, the nearest
//! point of the reference rectangle is that end of the face, whatever the other shape is; and the
//! nearest point of a rectangle to a point e is e clamped to it.
//!
//! Sources: Gottschalk, Lin, Manocha 1996 (separating axes); Sutherland, Hodgman 1974 (clipping).

use super::hull_hull::{FLUSH, REFERENCE_TOLERANCE, VERTEX_TOLERANCE};
use super::lanes::{Pair, Touch, dot, perp, rotate};
use crate::lanes::Lanes;

/// Contacts of the rectangles of `pair`; points farther apart than `speculative` (m) are left out.
#[inline(always)]
pub fn collide<L: Lanes>(pair: &Pair<L>, speculative: f32) -> Touch<L> {
    let (zero, one, half) = (L::zero(), L::splat(1.0), L::splat(0.5));
    let speculative = L::splat(speculative);
    let [[place_a, place_b], [size_a, size_b]] = [pair.place, pair.size];
    let [rotation_a, rotation_b] = pair.rotation;
    let u_a = rotate(rotation_a, [place_a[2], place_a[3]]);
    let u_b = rotate(rotation_b, [place_b[2], place_b[3]]);
    let offset_a = rotate(rotation_a, [place_a[0], place_a[1]]);
    let offset_b = rotate(rotation_b, [place_b[0], place_b[1]]);
    let d = [pair.centers[0] + (offset_b[0] - offset_a[0]), pair.centers[1] + (offset_b[1] - offset_a[1])];
    let [h_a, h_b] = [[size_a[0], size_a[1]], [size_b[0], size_b[1]]];
    let radii = size_a[2] + size_b[2];
    let reach = speculative + radii;

    // (1) for every axis. |u_a·u_b| and |u_a·u_b⊥| are all the projections there are.
    let (c, s) = (abs(dot(u_a, u_b)), abs(dot(perp(u_a), u_b)));
    let gap = |along: L, own: L, x: L, y: L| abs(along) - (own + c.mul_add(x, s * y));
    let [ax, ay] = [dot(d, u_a), dot(d, perp(u_a))];
    let [bx, by] = [dot(d, u_b), dot(d, perp(u_b))];
    let (gap_ax, gap_ay) = (gap(ax, h_a[0], h_b[0], h_b[1]), gap(ay, h_a[1], h_b[1], h_b[0]));
    let (gap_bx, gap_by) = (gap(bx, h_b[0], h_a[0], h_a[1]), gap(by, h_b[1], h_a[1], h_a[0]));
    let (a_is_x, b_is_x) = (gap_ax - gap_ay, gap_bx - gap_by);
    let face_a = Face::new(a_is_x, u_a, [ax, ay], h_a);
    // The face of b toward a looks against d.
    let face_b = Face::new(b_is_x, u_b, [-bx, -by], h_b);
    let (gap_a, gap_b) = (gap_ax.max(gap_ay), gap_bx.max(gap_by));

    let flush = L::splat(FLUSH) - dot(face_a.normal, face_b.normal);
    let preference = flush.select_positive(L::splat(REFERENCE_TOLERANCE), zero);
    // Where positive, b's face is the reference.
    let flip = gap_b - (gap_a + preference);
    let pick = |b: L, a: L| flip.select_positive(b, a);
    let n = [pick(face_b.normal[0], face_a.normal[0]), pick(face_b.normal[1], face_a.normal[1])];
    let t = perp(n);
    let (h_n, h_t) = (pick(face_b.across, face_a.across), pick(face_b.along, face_a.along));
    let first = pick(face_b.index, face_a.index);
    let (r_radius, i_radius) = (pick(size_b[2], size_a[2]), pick(size_a[2], size_b[2]));

    // The incident rectangle: its axis in (N, T), its half extents.
    let u_i = [pick(u_a[0], u_b[0]), pick(u_a[1], u_b[1])];
    let u = [dot(u_i, n), dot(u_i, t)];
    let h_i = [pick(h_a[0], h_b[0]), pick(h_a[1], h_b[1])];
    // The centre of a, seen from that of b.
    let a = [-dot(d, n), -dot(d, t)];
    let (r_center, i_center) = ([pick(zero, a[0]), pick(zero, a[1])], [pick(a[0], zero), pick(a[1], zero)]);

    // Most opposed to n: ∓u, or ∓u⊥ = ±(u_T, −u_N).
    let i_is_x = abs(u[0]) - abs(u[1]);
    let sign_x = u[0].select_positive(-one, one);
    let sign_y = u[1].select_positive(one, -one);
    let f = [
        i_is_x.select_positive(sign_x * u[0], -(sign_y * u[1])),
        i_is_x.select_positive(sign_x * u[1], sign_y * u[0]),
    ];
    let (h_f, h_e) = (i_is_x.select_positive(h_i[0], h_i[1]), i_is_x.select_positive(h_i[1], h_i[0]));
    let left_index = index(i_is_x, sign_x, sign_y);
    let right_index = next(left_index);
    let face = [h_f.mul_add(f[0], i_center[0]), h_f.mul_add(f[1], i_center[1])];
    // From left to right is along f⊥ = (−f_T, f_N).
    let left = [h_e.mul_add(f[1], face[0]), h_e.neg_mul_add(f[0], face[1])];
    let right = [h_e.neg_mul_add(f[1], face[0]), h_e.mul_add(f[0], face[1])];

    let top = r_center[0] + h_n;
    let (low, high) = (r_center[1] - h_t, r_center[1] + h_t);
    let (height_left, height_right) = (left[0] - top, right[0] - top);

    // The deepest end q, and where that is past an end of the reference face: see `hull_hull`.
    let parallel = L::splat(FLUSH) - f[0];
    let left_is_past = low - left[1];
    let q_is_left = parallel.select_positive(left_is_past, height_right - height_left);
    let q = q_is_left.select_positive(left[1], right[1]);
    let q_height = q_is_left.select_positive(height_left, height_right);
    let (past_low, past_high) = (low - q, q - high);
    let outside = past_low.max(past_high);
    // Flush and within the range: clipped, whatever rounding says of q.
    let sticks_out = left_is_past.max(right[1] - high);
    let beside = parallel.select_positive(sticks_out.max(zero), one);
    let apart = q_height.min(outside).min(beside);

    // Clipped.
    let t_left = left[1].min(high).max(right[1]);
    let t_right = right[1].max(low).min(left[1]);
    let slope = (height_right - height_left) / (left[1] - right[1]);
    let height_at = |t: L, end: L| (end - t).mul_add(slope, height_left);
    let (height_0, height_1) = (height_at(t_left, left[1]), height_at(t_right, left[1]));
    let level = half * (r_radius - i_radius);
    let clipped = |height: L, t: L| [half.mul_add(height, top + level), t];
    let (p_0, p_1) = (clipped(height_0, t_left), clipped(height_1, t_right));
    let (s_0, s_1) = (height_0 - radii, height_1 - radii);
    let second = next(first);
    let name = |reference: L, incident: L| {
        let bits = L::splat(256.0);
        pick(bits.mul_add(reference, incident), bits.mul_add(incident, reference))
    };
    let (id_0, id_1) = (name(second, left_index), name(first, right_index));

    // Past an end: the incident point nearest to it.
    let end = [top, past_low.select_positive(low, high)];
    let e = [end[0] - i_center[0], end[1] - i_center[1]];
    let e = [dot(e, u), dot(e, perp(u))];
    let clamp = |x: L, h: L| x.min(h).max(-h) - x;
    let g = rotate(u, [clamp(e[0], h_i[0]), clamp(e[1], h_i[1])]);
    let distance = dot(g, g).sqrt();
    let away = distance - L::splat(VERTEX_TOLERANCE);
    let inverse = one / away.select_positive(distance, one);
    let g = [away.select_positive(g[0] * inverse, one), away.select_positive(g[1] * inverse, zero)];
    let s_past = distance - radii;
    let out = half.mul_add(s_past, r_radius);
    let p_past = [out.mul_add(g[0], end[0]), out.mul_add(g[1], end[1])];
    let id_past =
        name(past_low.select_positive(first, second), q_is_left.select_positive(left_index, right_index));

    // Which points there are. A cut that leaves next to nothing leaves the deeper end.
    let one_point = L::splat(VERTEX_TOLERANCE) - (t_left - t_right);
    let none = -one;
    let near = |s: L| (s - speculative).select_positive(none, one);
    let keep_0 = one_point.select_positive((s_0 - s_1).select_positive(none, one), one).min(near(s_0));
    let keep_1 = one_point.select_positive((s_0 - s_1).select_positive(one, none), one).min(near(s_1));
    let choose = |past: L, clipped: L| apart.select_positive(past, clipped);
    let touching = (gap_a.max(gap_b) - reach).select_positive(none, one);
    let keep_0 = choose(near(s_past), keep_0).min(touching);
    let keep_1 = choose(none, keep_1).min(touching);
    let point_0 =
        [choose(p_past[0], p_0[0]), choose(p_past[1], p_0[1]), choose(s_past, s_0), choose(id_past, id_0)];
    let point_1 = [p_1[0], p_1[1], s_1, id_1];

    // In the order of a's face, and without holes. Seen from b the two come the other way round.
    let both = keep_0.min(keep_1);
    let second_first = flip.min(both).max(-keep_0);
    let points = [
        std::array::from_fn::<L, 4, _>(|k| second_first.select_positive(point_1[k], point_0[k])),
        std::array::from_fn::<L, 4, _>(|k| second_first.select_positive(point_0[k], point_1[k])),
    ];
    let count = keep_0.max(zero) + keep_1.max(zero);
    let normal = [choose(g[0], one), choose(g[1], zero)];
    let world = |v: [L; 2]| [n[0].mul_add(v[0], t[0] * v[1]), n[1].mul_add(v[0], t[1] * v[1])];
    let normal = world(normal);
    let anchor_b = points.map(|p| {
        let p = world([p[0], p[1]]);
        [p[0] + offset_b[0], p[1] + offset_b[1]]
    });
    Touch {
        normal: [pick(-normal[0], normal[0]), pick(-normal[1], normal[1])],
        count,
        anchor_a: anchor_b.map(|p| [p[0] + pair.centers[0], p[1] + pair.centers[1]]),
        anchor_b,
        separation: points.map(|p| p[2]),
        feature: points.map(|p| p[3]),
    }
}

/// The face of a rectangle that looks along `toward`, given by its parts along u and u⊥.
struct Face<L> {
    normal: [L; 2],
    /// Half extent along the normal.
    across: L,
    /// Half extent along the face.
    along: L,
    /// Number of the face and of its first vertex.
    index: L,
}

impl<L: Lanes> Face<L> {
    #[inline(always)]
    fn new(is_x: L, u: [L; 2], toward: [L; 2], h: [L; 2]) -> Self {
        let one = L::splat(1.0);
        let sign = |x: L| x.select_positive(one, -one);
        let (x, y) = (sign(toward[0]), sign(toward[1]));
        Face {
            normal: [is_x.select_positive(x * u[0], -(y * u[1])), is_x.select_positive(x * u[1], y * u[0])],
            across: is_x.select_positive(h[0], h[1]),
            along: is_x.select_positive(h[1], h[0]),
            index: index(is_x, x, y),
        }
    }
}

/// Faces are numbered −u⊥, u, u⊥, −u, each from the vertex of its number to the next.
#[inline(always)]
fn index<L: Lanes>(is_x: L, x: L, y: L) -> L {
    is_x.select_positive(L::splat(2.0) - x, L::splat(1.0) + y)
}

/// The vertex after vertex `i` of four.
#[inline(always)]
fn next<L: Lanes>(i: L) -> L {
    let next = i + L::splat(1.0);
    (next - L::splat(3.5)).select_positive(L::zero(), next)
}

#[inline(always)]
fn abs<L: Lanes>(x: L) -> L {
    x.max(-x)
}
