//! Two rounded rectangles, in lanes: the same as [`super::hulls`], in closed form and without branches.
//!
//! A rectangle is given by its center, an axis u, and half extents along u and u⊥. All its faces are normal
//! to ±u or ±u⊥. With d from the center of a to that of b, the separation of b from the face of a toward b
//! along axis w is
//!
//! ```text
//! |d·w| − h_w − (|w·u_b| h_bx + |w·u_b⊥| h_by)                                          (1)
//! ```
//!
//! The face with the largest (1) over both rectangles is the reference face (see [`super::hulls`] for the
//! reason). If the faces are flush, b's is chosen only if it is better by a tolerance. The incident face is
//! the face of the other rectangle most opposed to the normal of the reference face. [`super::clip`] computes
//! their contact.
//!
//! Source: Gottschalk, Lin, Manocha 1996 (separating axes).

use super::Margins;
use super::clip::{self, FLUSH, Faces, REFERENCE_TOLERANCE};
use super::lanes::{Poses, ShapePair, Touch, abs, dot, perp, rotate};
use crate::lanes::Lanes;

/// Contacts of the rectangles of `pair`; points farther apart than `margins.speculative` (m) are omitted.
#[inline(always)]
pub fn collide<L: Lanes>(pair: &ShapePair<L>, margins: Margins) -> Touch<L> {
    let (zero, one) = (L::zero(), L::splat(1.0));
    let [[place_a, place_b], [size_a, size_b]] = [pair.place, pair.size];
    let Poses { centers, rotation: [rotation_a, rotation_b], .. } = pair.poses;
    let u_a = rotate(rotation_a, [place_a[2], place_a[3]]);
    let u_b = rotate(rotation_b, [place_b[2], place_b[3]]);
    let offset_a = rotate(rotation_a, [place_a[0], place_a[1]]);
    let offset_b = rotate(rotation_b, [place_b[0], place_b[1]]);
    let d = [centers[0] + (offset_b[0] - offset_a[0]), centers[1] + (offset_b[1] - offset_a[1])];
    let [h_a, h_b] = [[size_a[0], size_a[1]], [size_b[0], size_b[1]]];
    let radii = size_a[2] + size_b[2];
    let reach = L::splat(margins.speculative) + radii;

    // (1) for every axis. |u_a·u_b| and |u_a·u_b⊥| are all the projections needed.
    let (c, s) = (abs(dot(u_a, u_b)), abs(dot(perp(u_a), u_b)));
    let gap = |along: L, own: L, x: L, y: L| abs(along) - (own + c.mul_add(x, s * y));
    let [ax, ay] = [dot(d, u_a), dot(d, perp(u_a))];
    let [bx, by] = [dot(d, u_b), dot(d, perp(u_b))];
    let (gap_ax, gap_ay) = (gap(ax, h_a[0], h_b[0], h_b[1]), gap(ay, h_a[1], h_b[1], h_b[0]));
    let (gap_bx, gap_by) = (gap(bx, h_b[0], h_a[0], h_a[1]), gap(by, h_b[1], h_a[1], h_a[0]));
    let (a_is_x, b_is_x) = (gap_ax - gap_ay, gap_bx - gap_by);
    let face_a = RectangleFace::new(a_is_x, u_a, [ax, ay], h_a);
    // The face of b toward a faces against d.
    let face_b = RectangleFace::new(b_is_x, u_b, [-bx, -by], h_b);
    let (gap_a, gap_b) = (gap_ax.max(gap_ay), gap_bx.max(gap_by));

    let flush = L::splat(FLUSH) - dot(face_a.normal, face_b.normal);
    let preference = flush.select_positive(L::splat(REFERENCE_TOLERANCE * margins.slop), zero);
    // If positive, b's face is the reference.
    let flip = gap_b - (gap_a + preference);
    let pick = |b: L, a: L| flip.select_positive(b, a);
    let n = [pick(face_b.normal[0], face_a.normal[0]), pick(face_b.normal[1], face_a.normal[1])];
    let t = perp(n);
    let (h_n, h_t) = (pick(face_b.across, face_a.across), pick(face_b.along, face_a.along));
    let first = pick(face_b.index, face_a.index);
    let (r_radius, i_radius) = (pick(size_b[2], size_a[2]), pick(size_a[2], size_b[2]));

    // The incident rectangle: its axis in (N, T) and its half extents.
    let u_i = [pick(u_a[0], u_b[0]), pick(u_a[1], u_b[1])];
    let u = [dot(u_i, n), dot(u_i, t)];
    let h_i = [pick(h_a[0], h_b[0]), pick(h_a[1], h_b[1])];
    // The center of a relative to that of b.
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

    let second = next(first);
    let faces = Faces {
        normal: n,
        origin: offset_b,
        centers,
        flip,
        beyond: gap_a.max(gap_b) - reach,
        top: r_center[0] + h_n,
        range: [r_center[1] - h_t, r_center[1] + h_t],
        ends: [left, right],
        opposed: f[0],
        names: [[first, second], [left_index, right_index]],
        radii: [r_radius, i_radius],
    };
    // The nearest point of a rectangle to a point e is e clamped to it.
    clip::touch(&faces, margins, |end, _| {
        let e = [end[0] - i_center[0], end[1] - i_center[1]];
        let e = [dot(e, u), dot(e, perp(u))];
        let clamp = |x: L, h: L| x.min(h).max(-h) - x;
        rotate(u, [clamp(e[0], h_i[0]), clamp(e[1], h_i[1])])
    })
}

/// The face of a rectangle in the direction `toward`, given by its components along u and u⊥.
struct RectangleFace<L> {
    normal: [L; 2],
    /// Half extent along the normal.
    across: L,
    /// Half extent along the face.
    along: L,
    /// Index of the face and of its first vertex.
    index: L,
}

impl<L: Lanes> RectangleFace<L> {
    #[inline(always)]
    fn new(is_x: L, u: [L; 2], toward: [L; 2], h: [L; 2]) -> Self {
        let one = L::splat(1.0);
        let sign = |x: L| x.select_positive(one, -one);
        let (x, y) = (sign(toward[0]), sign(toward[1]));
        RectangleFace {
            normal: [is_x.select_positive(x * u[0], -(y * u[1])), is_x.select_positive(x * u[1], y * u[0])],
            across: is_x.select_positive(h[0], h[1]),
            along: is_x.select_positive(h[1], h[0]),
            index: index(is_x, x, y),
        }
    }
}

/// Faces are numbered −u⊥, u, u⊥, −u. Each runs from the vertex with its number to the next.
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
