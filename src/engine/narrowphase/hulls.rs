//! Two rounded hulls, in lanes: separating axis test, then two faces or a pair of vertices.
//!
//! **Axis.** Let M be the Minkowski difference of the cores. Its edges are the faces of both, and the
//! distance of the origin from the line of a face is that face's separation, nᵢ·(nearest vertex − vᵢ). If the
//! cores overlap, the face with the largest (least negative) separation gives the depth exactly. If they are
//! separate, that face contains the point of M closest to the origin, in its interior or at one of its ends.
//! Proof: let V be the closest vertex. A face whose line is no farther than that of a face at V has its
//! normal farther from V's direction, and then lies behind V.
//!
//! **Features.** With that reference face v₁v₂ and the deepest vertex q of the other hull, the closest pair
//! is (face, q) if q projects between v₁ and v₂. Otherwise it is the face's end and the nearest point of the
//! other hull. [`super::clip`] computes the points from the two faces.
//!
//! **Coordinates** are along a's axes, relative to b's center of mass, so only b's corners are rotated.
//!
//! Source: Gottschalk, Lin, Manocha 1996 (separating axes).

use super::Margins;
use super::clip::{self, FLUSH, Faces, REFERENCE_TOLERANCE};
use super::hull::{Hull, HullRow};
use super::lanes::{Poses, Touch, dot, perp, rotate, unrotate};
use crate::lanes::{LaneIndex, Lanes, MOST_LANES};

/// Hulls a and b and the incident one of the two, along a's axes, relative to b's center of mass.
pub struct Hulls<L> {
    hulls: [Hull<L>; 2],
    incident: Hull<L>,
    /// Slots in use: the largest number of any hull of the batch.
    count: usize,
}

impl<L: Lanes> Hulls<L> {
    /// Empty buffers for `L::WIDTH` pairs.
    pub fn empty() -> Self {
        Hulls { hulls: [Hull::empty(), Hull::empty()], incident: Hull::empty(), count: 0 }
    }

    /// Reads `L::WIDTH` pairs at `poses`.
    #[inline(always)]
    pub fn gather(&mut self, poses: &Poses<L>, rows: &[HullRow], [a, b]: [LaneIndex<L::Index>; 2]) {
        let [rotation_a, rotation_b] = poses.rotation;
        let offset = unrotate(rotation_a, poses.centers);
        let relative = unrotate(rotation_a, rotation_b);
        let [hull_a, hull_b] = &mut self.hulls;
        self.count = hull_a.gather_heads(rows, a).max(hull_b.gather_heads(rows, b));
        hull_a.gather_corners(rows, a, self.count, |[x, y, nx, ny]| [x - offset[0], y - offset[1], nx, ny]);
        hull_b.gather_corners(rows, b, self.count, |[x, y, nx, ny]| {
            let ([x, y], [nx, ny]) = (rotate(relative, [x, y]), rotate(relative, [nx, ny]));
            [x, y, nx, ny]
        });
    }

    /// Contacts of the pairs; points farther apart than `margins.speculative` (m) are omitted.
    #[inline(always)]
    pub fn collide(&mut self, poses: &Poses<L>, margins: Margins) -> Touch<L> {
        let (zero, count) = (L::zero(), self.count);
        let [a, b] = &self.hulls;
        let (corners_a, corners_b) = (&a.corners[..count], &b.corners[..count]);
        let (face_a, face_b) = (HullFace::best(corners_a, corners_b), HullFace::best(corners_b, corners_a));
        let flush = L::splat(FLUSH) - dot(face_a.normal, face_b.normal);
        let preference = flush.select_positive(L::splat(REFERENCE_TOLERANCE * margins.slop), zero);
        // If positive, b's face is the reference.
        let flip = face_b.gap - (face_a.gap + preference);
        let pick = |b: L, a: L| flip.select_positive(b, a);
        let both = |b: [L; 2], a: [L; 2]| [pick(b[0], a[0]), pick(b[1], a[1])];
        let n = both(face_b.normal, face_a.normal);
        let t = perp(n);
        let (v_1, v_2) = (both(face_b.first, face_a.first), both(face_b.second, face_a.second));
        let head = |k: usize| [pick(b.head[k], a.head[k]), pick(a.head[k], b.head[k])];
        let (radii, last, flat) = (head(0), head(1), head(2));

        let incident = &mut self.incident.corners[..count];
        for (incident, (a, b)) in incident.iter_mut().zip(corners_a.iter().zip(corners_b)) {
            *incident = std::array::from_fn(|k| pick(a[k], b[k]));
        }
        let face_i = HullFace::opposed(incident, n);
        let [left, right] = [face_i.first, face_i.second].map(|v| [dot(v, n), dot(v, t)]);
        let faces = Faces {
            normal: rotate(poses.rotation[0], n),
            origin: [zero; 2],
            centers: poses.centers,
            flip,
            beyond: face_a.gap.max(face_b.gap) - (L::splat(margins.speculative) + (radii[0] + radii[1])),
            top: dot(v_1, n),
            range: [dot(v_1, t), dot(v_2, t)],
            ends: [left, right],
            opposed: -face_i.gap,
            names: [
                names(pick(face_b.slot, face_a.slot), last[0], flat[0]),
                names(face_i.slot, last[1], flat[1]),
            ],
            radii,
        };
        clip::touch(&faces, margins, |end, wanted| {
            if !wanted.any_positive() {
                return [zero; 2];
            }
            let e = [n[0].mul_add(end[0], t[0] * end[1]), n[1].mul_add(end[0], t[1] * end[1])];
            let g = nearest(incident, e);
            [dot(g, n), dot(g, t)]
        })
    }
}

impl Hulls<f32> {
    /// A single pair at `poses`.
    pub fn new(poses: &Poses<f32>, rows: &[HullRow; 2]) -> Self {
        let mut hulls = Self::empty();
        hulls.gather(poses, rows, [LaneIndex::new(&[0; MOST_LANES]), LaneIndex::new(&[1; MOST_LANES])]);
        hulls
    }
}

/// The face of a hull with the largest value of some measure, `gap`.
struct HullFace<L> {
    gap: L,
    normal: [L; 2],
    first: [L; 2],
    second: [L; 2],
    /// Slot of the first vertex.
    slot: L,
}

impl<L: Lanes> HullFace<L> {
    /// The face of `hull` with the largest separation from `other` (m): max over faces i of min over vertices
    /// j of nᵢ·(wⱼ − vᵢ).
    #[inline(always)]
    fn best(hull: &[[L; 4]], other: &[[L; 4]]) -> Self {
        Self::largest(hull, |[x, y, nx, ny]| {
            let height = |v: &[L; 4]| nx.mul_add(v[0], ny * v[1]);
            let mut nearest = L::splat(f32::INFINITY);
            for v in other {
                nearest = height(v).min(nearest);
            }
            nearest - nx.mul_add(x, ny * y)
        })
    }

    /// The face whose normal is most opposed to `direction`.
    #[inline(always)]
    fn opposed(hull: &[[L; 4]], direction: [L; 2]) -> Self {
        Self::largest(hull, |[_, _, nx, ny]| -dot(direction, [nx, ny]))
    }

    /// The face with the largest `gap`; the last of them in a tie.
    #[inline(always)]
    fn largest(hull: &[[L; 4]], gap: impl Fn([L; 4]) -> L) -> Self {
        let zero = [L::zero(); 2];
        let gap_0 = L::splat(f32::NEG_INFINITY);
        let mut best = HullFace { gap: gap_0, normal: zero, first: zero, second: zero, slot: L::zero() };
        for (i, &[x, y, nx, ny]) in hull.iter().enumerate() {
            let [next_x, next_y, ..] = hull[if i + 1 == hull.len() { 0 } else { i + 1 }];
            let gap = gap([x, y, nx, ny]);
            let worse = best.gap - gap;
            let keep = |old: L, new: L| worse.select_positive(old, new);
            best = HullFace {
                gap: keep(best.gap, gap),
                normal: [keep(best.normal[0], nx), keep(best.normal[1], ny)],
                first: [keep(best.first[0], x), keep(best.first[1], y)],
                second: [keep(best.second[0], next_x), keep(best.second[1], next_y)],
                slot: keep(best.slot, L::splat(i as f32)),
            };
        }
        best
    }
}

/// Vertex numbers of the two ends of the face at `slot`: its number and the next. For a capsule or segment
/// (`flat` positive): 0 at a and 1 at b.
#[inline(always)]
fn names<L: Lanes>(slot: L, last: L, flat: L) -> [L; 2] {
    let one = L::splat(1.0);
    let slot = slot.min(last);
    let next = (last - slot).select_positive(slot + one, L::zero());
    [slot, next].map(|i| flat.select_positive((i - L::splat(1.5)).select_positive(one, L::zero()), i))
}

/// The vector from `e` to the nearest point of the boundary of `hull`.
///
/// For the face at v it is −(h n + o n⊥), where h is the height of e over the face's line, and o the distance
/// of e past one of its ends. A repeated vertex is a face with o = (e − v)·n⊥, and so never nearer than the
/// next face, which it repeats.
#[cold]
#[inline(never)]
fn nearest<L: Lanes>(hull: &[[L; 4]], e: [L; 2]) -> [L; 2] {
    let (zero, far) = (L::zero(), L::splat(f32::INFINITY));
    let mut best = [far, zero, zero];
    for (i, &[x, y, nx, ny]) in hull.iter().enumerate() {
        let [next_x, next_y, ..] = hull[if i + 1 == hull.len() { 0 } else { i + 1 }];
        let (n, d) = ([nx, ny], [e[0] - x, e[1] - y]);
        let t = perp(n);
        let (height, along, length) = (dot(n, d), dot(t, d), dot(t, [next_x - x, next_y - y]));
        let past = along - along.min(length).max(zero);
        let squared = height.mul_add(height, past * past);
        let way = [-height.mul_add(nx, past * t[0]), -height.mul_add(ny, past * t[1])];
        let farther = squared - best[0];
        best = std::array::from_fn(|k| farther.select_positive(best[k], [squared, way[0], way[1]][k]));
    }
    [best[1], best[2]]
}
