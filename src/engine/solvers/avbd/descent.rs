//! Block descent: color by color, bodies move to where their inertia and the penalties of their contacts are
//! in balance. `solvers/avbd.rs` describes the method.
//!
//! # A contact as seen from a body
//!
//! Rows are linear in the motion of a step. With x = (Δx, Δy, Δθ) of the own body and o of the other, and
//! signs such that an increasing separation is positive,
//!
//! ```text
//! C_n = s + ε + n·(x − o) + A_n Δθ + B_n Δθ_o − α C_n⁰,   C_t = (1 − α) d + t·(x − o) + A_t Δθ + B_t Δθ_o − C_t⁰
//! ```
//!
//! with ±n for body b and a, arms A and B of the own and the other body, the margin ε, the drift d of the
//! point since it began to stick, and C⁰ at the start of the substep. For a gap, C_n⁰ is 0, so that it may
//! close. A contact thus has one record for each of its bodies, and nothing in it is recomputed during
//! iterations.
//!
//! # Where bodies begin
//!
//! A resting body is held against its weight; its best start is its current position. The best start of a
//! falling body is its inertial position. So a body starts at x + h v + w h² a, where w is the fraction of a
//! that accelerated it in the last substep: w = (v − v_last)·h a/|h a|², from 0 to 1.
//!
//! # One body
//!
//! The system of a body is 3 × 3, symmetric and positive definite: M/h² on its diagonal, and k JᵀJ for each
//! row. It is solved as L D Lᵀ in the order x, y, θ, in lanes and in `f32`. Rounding errors in the step of a
//! body are corrected in its next step, because forces are recomputed from positions.

use super::input::{DescentInput, PENALTY};
use super::joints::JointDescent;
use super::lanes::{BodyLanes, Ends};
use crate::constraints::kernels::pass::at_width;
use crate::constraints::records::graph::Graph;
use crate::contacts::{Contact, quad};
use crate::lanes::{Block, BodyRow, LaneIndex, LaneWidth, Lanes, Quad, held};

/// Overlap that does not count as an error (m): `COLLISION_MARGIN` of the source.
const MARGIN: f32 = 5e-4;
/// Largest drift of a sticking point (m): `STICK_THRESH` of the source.
const REACH: f32 = 0.01;

/// Index of λn among the numbers kept per point: λn, λt (N), kn, kt (N/m), and the drift since the point
/// began to stick (m).
pub const NORMAL: usize = 0;
/// See [`NORMAL`].
pub const TANGENT: usize = 1;
const NORMAL_PENALTY: usize = 2;
const TANGENT_PENALTY: usize = 3;
/// Numbers kept per point: two groups of four for gathers; the last three are unused.
pub const PER_POINT: usize = 8;
/// Numbers kept per body: its velocity before the forces of the last substep, and an unused one.
pub const PER_BODY: usize = 4;

/// Lane vectors of a contact: ±n and µ, then those of [`POINT`] for each point.
const RECORD: usize = 3 + 2 * POINT;
/// A_n, A_t, B_n, B_t, s + ε, C_n⁰, d − C_t⁰, d, and 1 if the point exists.
const POINT: usize = 9;
const IS_THERE: usize = 8;
/// Lane vectors of a body: its inertial position, M/h² (kg/s²), I/h², and 1 if it can turn, else 0.
const BODY: usize = 6;

/// Buffers of block descent, kept from step to step to avoid allocation.
#[derive(Clone, Debug, Default)]
pub struct Descent {
    lanes: BodyLanes,
    /// Records of bodies, and of their contacts.
    bodies: Vec<Block>,
    ends: Vec<Block>,
    /// Records of contacts, seen from body b.
    contacts: Vec<Block>,
    pub(super) joints: JointDescent,
}

impl Descent {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let records = [&self.bodies, &self.ends, &self.contacts];
        self.lanes.held_bytes() + self.joints.held_bytes() + records.into_iter().map(held).sum::<usize>()
    }

    /// Assigns bodies to lanes: by colors, or one by one in the `sequence` of contacts.
    pub(crate) fn assign(
        &mut self,
        rows: &[BodyRow],
        contacts: &[Contact],
        graph: &Graph,
        width: LaneWidth,
        sequence: Option<&[u32]>,
    ) {
        let inert = rows.len() as u32 - 1;
        let is_dynamic = |body: u32| rows[body as usize].velocity[3] > 0.0;
        let width = if sequence.is_some() { LaneWidth::W1 } else { width };
        self.lanes.assign(width, graph, contacts, inert, is_dynamic, sequence);
        let BodyLanes { batches, ends, contacts, .. } = &self.lanes;
        for (records, vectors) in [
            (&mut self.bodies, BODY * batches.len()),
            (&mut self.ends, RECORD * ends.contact.len() / width.lanes()),
            (&mut self.contacts, RECORD * contacts.contact.len() / width.lanes()),
        ] {
            records.clear();
            records.resize((vectors * width.lanes()).div_ceil(16), Block::default());
        }
    }

    /// Begins a substep of `h` (s): fills the records of all contacts, then moves bodies to where they start,
    /// by their velocities over `motion` (s). Multipliers and penalties are multiplied by `keep`.
    pub(crate) fn begin(&mut self, on: &mut DescentInput<'_>, h: f32, motion: f32, keep: [f32; 2]) {
        let Descent { lanes, bodies, ends, contacts, joints } = self;
        joints.begin(on, h, keep);
        at_width!(lanes.width, fill(&lanes.ends, ends, on));
        at_width!(lanes.width, fill(&lanes.contacts, contacts, on));
        for row in on.rows.iter_mut() {
            for k in 0..3 {
                row.delta[k] = motion.mul_add(row.velocity[k], row.delta[k]);
            }
        }
        at_width!(lanes.width, begin_bodies(lanes, bodies, on, h));
        // A body without contacts takes no descent step: it stays at its inertial position.
        for body in lanes.solved() {
            let (row, force) = (&mut on.rows[body], &on.increments[body]);
            let held = 1.0 - share(force, row, on.kept.body(body));
            (0..3).for_each(|k| row.delta[k] -= held * motion * force[k]);
        }
        for (body, (row, force)) in on.rows.iter().zip(on.increments).enumerate().take(on.bodies) {
            let last = on.kept.body(body);
            (0..3).for_each(|k| last[k] = row.velocity[k] - force[k]);
        }
        for point in on.kept.points().chunks_exact_mut(PER_POINT) {
            for k in [NORMAL, TANGENT] {
                point[k] *= keep[0];
            }
            for k in [NORMAL_PENALTY, TANGENT_PENALTY] {
                point[k] = (point[k] * keep[1]).clamp(PENALTY[0], PENALTY[1]);
            }
        }
    }

    /// Every body takes one step. The fraction `alpha` of the errors at the start of the substep is left
    /// alone.
    pub(crate) fn descend(&mut self, on: &mut DescentInput<'_>, alpha: f32) {
        at_width!(
            self.lanes.width,
            descend(&self.lanes, [&self.bodies, &self.ends], &mut self.joints, on, alpha)
        );
    }

    /// Multipliers become the forces. Penalties of rows within their bounds grow by `beta` (N/m²).
    pub(crate) fn raise(&mut self, on: &mut DescentInput<'_>, alpha: f32, beta: f32) {
        at_width!(self.lanes.width, raise(&self.lanes.contacts, &self.contacts, on, alpha, beta));
        self.joints.raise(on, alpha, beta);
    }

    /// Sticking points store their drift; other points reset it. Joints get their impulses.
    pub(crate) fn hold(&mut self, on: &mut DescentInput<'_>) {
        at_width!(self.lanes.width, hold(&self.lanes.contacts, &self.contacts, on));
        self.joints.store(on);
    }

    /// v ← v + (x − y)/h, which is (x − x_begin)/h.
    pub(crate) fn velocities(&mut self, on: &mut DescentInput<'_>, h: f32) {
        at_width!(self.lanes.width, velocities(&self.lanes, &self.bodies, on, h));
    }
}

/// w: the fraction of its forces, `force` = h a, that accelerated a body in the last substep.
fn share(force: &[f32; 4], row: &BodyRow, last: &[f32]) -> f32 {
    let square = force[0] * force[0] + force[1] * force[1];
    let along = |k: usize| (row.velocity[k] - force[k] - last[k]) * force[k];
    if square > 0.0 { ((along(0) + along(1)) / square).clamp(0.0, 1.0) } else { 1.0 }
}

/// Δx, Δy, Δθ and the inverse inertia of bodies.
#[inline(always)]
fn moved<L: Lanes>(rows: &[BodyRow], index: LaneIndex<L::Index>) -> [L; 4] {
    L::gather_quads::<2, 1>(bytemuck::cast_slice(rows), index)
}

/// Fills the records of contacts at the current positions of the bodies.
#[inline(never)]
fn fill<L: Lanes>(ends: &Ends, records: &mut [Block], on: &mut DescentInput<'_>) {
    use quad::*;
    let quads: &[Quad] = bytemuck::cast_slice(on.contacts);
    let kept = on.kept.by_point().map(|points| bytemuck::cast_slice::<f32, Quad>(points));
    let margin = L::splat(MARGIN * on.length_unit);
    let records: &mut [L] = bytemuck::cast_slice_mut(records);
    let sides: &[f32] = &ends.side;
    let bodies = ends.own.list().batches().zip(ends.other.list().batches());
    let batches = ends.contact.list().batches().zip(bodies).zip(sides.chunks_exact(L::WIDTH));
    let (zero, one, two) = (L::zero(), L::splat(1.0), L::splat(2.0).integer_bits());
    let turns = L::splat(if on.rotation { 1.0 } else { 0.0 });
    for (record, ((contact, (own, other)), sides)) in records.chunks_exact_mut(RECORD).zip(batches) {
        let mut side = zero;
        bytemuck::cast_slice_mut::<L, f32>(std::slice::from_mut(&mut side)).copy_from_slice(sides);
        let [nx, ny, count, friction] = L::gather_quads::<STRIDE, HEADER>(quads, contact);
        let n = [side * nx, side * ny];
        let (x, o) = (moved::<L>(on.rows, own), moved::<L>(on.rows, other));
        record[..3].copy_from_slice(&[n[0], n[1], if on.friction { friction } else { zero }]);
        for p in 0..2 {
            let ([ax, ay, bx, by], [separation, ..]) = if p == 0 {
                (
                    L::gather_quads::<STRIDE, ANCHORS_0>(quads, contact),
                    L::gather_quads::<STRIDE, STATE_0>(quads, contact),
                )
            } else {
                (
                    L::gather_quads::<STRIDE, ANCHORS_1>(quads, contact),
                    L::gather_quads::<STRIDE, STATE_1>(quads, contact),
                )
            };
            // An empty lane has side 0 and therefore n = 0.
            let is_there = side * side * if p == 0 { one } else { count.select_equal(two, one, zero) };
            let from = |b: L, a: L| side.select_positive(b, a);
            let own_arm = [from(bx, ax), from(by, ay)];
            let other_arm = [from(ax, bx), from(ay, by)];
            // r × n and r × t = −(r·n).
            let arms =
                |r: [L; 2]| [turns * (r[0] * n[1] - r[1] * n[0]), -(turns * (r[0] * n[0] + r[1] * n[1]))];
            let (a, b) = (arms(own_arm), arms(other_arm).map(|arm| -arm));
            let d = [x[0] - o[0], x[1] - o[1]];
            let along = |u: [L; 2], axis: usize| u[0] * d[0] + u[1] * d[1] + a[axis] * x[2] + b[axis] * o[2];
            let first_n = separation + along(n, 0);
            let first_n = first_n.select_positive(zero, first_n + margin);
            let first_t = along([n[1], -n[0]], 1);
            let [drift, ..] = L::gather_quads::<2, 1>(kept[p], contact);
            let point = &mut record[3 + POINT * p..][..POINT];
            let offset = drift - first_t;
            let separation = separation + margin;
            point.copy_from_slice(&[a[0], a[1], b[0], b[1], separation, first_n, offset, drift, is_there]);
        }
    }
}

/// Fills the records of bodies, which are at their inertial positions.
#[inline(never)]
fn begin_bodies<L: Lanes>(lanes: &BodyLanes, records: &mut [Block], on: &DescentInput<'_>, h: f32) {
    let records: &mut [L] = bytemuck::cast_slice_mut(records);
    let (zero, one, square) = (L::zero(), L::splat(1.0), L::splat(h * h));
    for (record, index) in records.chunks_exact_mut(BODY).zip(lanes.bodies.list().batches()) {
        let row = L::gather(on.rows, index);
        let (inv_mass, inv_inertia) = (row[3], row[7]);
        // The inert row, and bodies that cannot turn, get the identity.
        let over = |inverse: L| inverse.select_positive(one / (inverse * square), one);
        let does_turn = inv_inertia.select_positive(one, zero);
        record.copy_from_slice(&[row[4], row[5], row[6], over(inv_mass), over(inv_inertia), does_turn]);
    }
}

/// The two rows of a point.
struct BlockRows<L> {
    /// Jacobians of the own body, along n and t.
    jacobian: [[L; 3]; 2],
    error: [L; 2],
    force: [L; 2],
    bound: L,
}

#[inline(always)]
fn rows<L: Lanes>(record: &[L], p: usize, x: [L; 4], o: [L; 4], kept: [L; 4], alpha: L) -> BlockRows<L> {
    let n = [record[0], record[1]];
    let t = [n[1], -n[0]];
    let [a_n, a_t, b_n, b_t, separation, first_n, offset, drift, is_there] =
        std::array::from_fn(|k| record[3 + POINT * p + k]);
    let d = [x[0] - o[0], x[1] - o[1]];
    let along = |u: [L; 2], a: L, b: L, c: L| {
        u[0].mul_add(d[0], u[1].mul_add(d[1], a.mul_add(x[2], b.mul_add(o[2], c))))
    };
    let error = [
        along(n, a_n, b_n, alpha.neg_mul_add(first_n, separation)),
        along(t, a_t, b_t, alpha.neg_mul_add(drift, offset)),
    ];
    let normal = kept[NORMAL_PENALTY].neg_mul_add(error[0], kept[NORMAL]).max(L::zero());
    let normal = is_there.select_positive(normal, L::zero());
    let bound = record[2] * normal;
    let tangent = kept[TANGENT_PENALTY].neg_mul_add(error[1], kept[TANGENT]).max(-bound).min(bound);
    BlockRows { jacobian: [[n[0], n[1], a_n], [t[0], t[1], a_t]], error, force: [normal, tangent], bound }
}

/// The kept numbers of both points of contacts.
#[inline(always)]
fn kept_of<L: Lanes>([first, second]: [&[Quad]; 2], contact: LaneIndex<L::Index>) -> [[L; 4]; 2] {
    [L::gather_quads::<2, 0>(first, contact), L::gather_quads::<2, 0>(second, contact)]
}

#[inline(never)]
fn descend<L: Lanes>(
    lanes: &BodyLanes,
    [bodies, ends]: [&[Block]; 2],
    joints: &mut JointDescent,
    on: &mut DescentInput<'_>,
    alpha: f32,
) {
    let (bodies, ends): (&[L], &[L]) = (bytemuck::cast_slice(bodies), bytemuck::cast_slice(ends));
    let share = alpha;
    let (contact, other) = (lanes.ends.contact.list(), lanes.ends.other.list());
    let (alpha, zero) = (L::splat(alpha), L::zero());
    let each = lanes.batches.iter().zip(bodies.chunks_exact(BODY)).zip(lanes.bodies.list().batches());
    for ((batch, body), index) in each {
        let x = moved::<L>(on.rows, index);
        let (mass, inertia, does_turn) = (body[3], body[4], body[5]);
        // The upper half of the matrix, row by row, and the right-hand side.
        let mut k = [mass, zero, zero, mass, zero, inertia];
        let mut f = [0, 1, 2].map(|i| (if i == 2 { inertia } else { mass }) * (body[i] - x[i]));
        if !joints.is_empty() {
            let added = joint_systems::<L>(joints, index, on, share);
            k = [0, 1, 2, 3, 4, 5].map(|i| k[i] + added[i]);
            f = [0, 1, 2].map(|i| f[i] + added[6 + i]);
        }
        let kept = on.kept.by_point().map(|points| bytemuck::cast_slice::<f32, Quad>(points));
        let range = batch.first * L::WIDTH..(batch.first + batch.ranks) * L::WIDTH;
        let ranks = contact.part(range.clone()).batches().zip(other.part(range).batches());
        let records = ends[batch.first * RECORD..].chunks_exact(RECORD);
        for (record, (contact, other)) in records.zip(ranks) {
            let o = moved::<L>(on.rows, other);
            for (p, kept) in kept_of::<L>(kept, contact).into_iter().enumerate() {
                let rows = rows(record, p, x, o, kept, alpha);
                let is_there = record[3 + POINT * p + IS_THERE];
                // A row at its bound keeps its stiffness. Without it, a body would overshoot the place where
                // the row takes hold again, and oscillate forever.
                let rubs = record[2].select_positive(kept[TANGENT_PENALTY], zero);
                for (axis, penalty) in [kept[NORMAL_PENALTY], rubs].into_iter().enumerate() {
                    let [jx, jy, jw] = rows.jacobian[axis];
                    let jw = does_turn * jw;
                    let force = rows.force[axis];
                    f = [jx.mul_add(force, f[0]), jy.mul_add(force, f[1]), jw.mul_add(force, f[2])];
                    let penalty = is_there * penalty;
                    let [px, py, pw] = [penalty * jx, penalty * jy, penalty * jw];
                    k[0] = px.mul_add(jx, k[0]);
                    k[1] = px.mul_add(jy, k[1]);
                    k[2] = px.mul_add(jw, k[2]);
                    k[3] = py.mul_add(jy, k[3]);
                    k[4] = py.mul_add(jw, k[4]);
                    k[5] = pw.mul_add(jw, k[5]);
                }
            }
        }
        let change = solve(k, f);
        let delta = [x[0] + change[0], x[1] + change[1], x[2] + change[2], x[3]];
        L::scatter_delta(on.rows, index, delta);
    }
}

/// Contributions of joints to the systems of a batch of bodies.
#[inline(never)]
fn joint_systems<L: Lanes>(
    joints: &mut JointDescent,
    bodies: LaneIndex<L::Index>,
    on: &mut DescentInput<'_>,
    alpha: f32,
) -> [L; 9] {
    let (graph, first, count) = (on.graph, on.contacts.len(), on.bodies);
    let mut sums = [L::zero(); 9];
    for (lane, &body) in bodies.entries().iter().enumerate().filter(|&(_, &body)| (body as usize) < count) {
        let edges = graph.edges_of(body as usize).iter().map(|&edge| edge as usize);
        let own = joints.system(body, edges.filter_map(|edge| edge.checked_sub(first)), on, alpha);
        for (sum, value) in sums.iter_mut().zip(own) {
            bytemuck::cast_slice_mut::<L, f32>(std::slice::from_mut(sum))[lane] = value;
        }
    }
    sums
}

/// Solves K x = f for a symmetric positive definite K, given by its upper half, as L D Lᵀ.
#[inline(always)]
fn solve<L: Lanes>([xx, xy, xw, yy, yw, ww]: [L; 6], [fx, fy, fw]: [L; 3]) -> [L; 3] {
    let one = L::splat(1.0);
    let inv_x = one / xx;
    let (lxy, lxw) = (xy * inv_x, xw * inv_x);
    let inv_y = one / lxy.neg_mul_add(xy, yy);
    let yw = lxy.neg_mul_add(xw, yw);
    let lyw = yw * inv_y;
    let inv_w = one / lyw.neg_mul_add(yw, lxw.neg_mul_add(xw, ww));
    let y = lxy.neg_mul_add(fx, fy);
    let w = lyw.neg_mul_add(y, lxw.neg_mul_add(fx, fw)) * inv_w;
    let y = lyw.neg_mul_add(w, y * inv_y);
    [lxy.neg_mul_add(y, lxw.neg_mul_add(w, fx * inv_x)), y, w]
}

#[inline(never)]
fn raise<L: Lanes>(ends: &Ends, records: &[Block], on: &mut DescentInput<'_>, alpha: f32, beta: f32) {
    let records: &[L] = bytemuck::cast_slice(records);
    let [first, second] = on.kept.by_point().map(bytemuck::cast_slice_mut::<f32, Quad>);
    let (alpha, beta, most) = (L::splat(alpha), L::splat(beta), L::splat(PENALTY[1]));
    let bodies = ends.own.list().batches().zip(ends.other.list().batches());
    let batches = ends.contact.list().batches().zip(bodies);
    for (record, (contact, (own, other))) in records.chunks_exact(RECORD).zip(batches) {
        let (x, o) = (moved::<L>(on.rows, own), moved::<L>(on.rows, other));
        let new = kept_of::<L>([first, second], contact);
        let new: [[L; 4]; 2] = std::array::from_fn(|p| {
            let [.., normal_penalty, tangent_penalty] = new[p];
            let BlockRows { error, force: [normal, tangent], bound, .. } =
                rows(record, p, x, o, new[p], alpha);
            let grown = |k: L, error: L| beta.mul_add(error.max(-error), k).min(most);
            let slack = bound - tangent.max(-tangent);
            [
                normal,
                tangent,
                normal.select_positive(grown(normal_penalty, error[0]), normal_penalty),
                slack.select_positive(grown(tangent_penalty, error[1]), tangent_penalty),
            ]
        });
        L::scatter_quads::<2, 0>(first, contact, new[0]);
        L::scatter_quads::<2, 0>(second, contact, new[1]);
    }
}

#[inline(never)]
fn hold<L: Lanes>(ends: &Ends, records: &[Block], on: &mut DescentInput<'_>) {
    let records: &[L] = bytemuck::cast_slice(records);
    let mut kept = on.kept.by_point().map(bytemuck::cast_slice_mut::<f32, Quad>);
    let (zero, reach) = (L::zero(), L::splat(REACH * on.length_unit));
    let bodies = ends.own.list().batches().zip(ends.other.list().batches());
    let batches = ends.contact.list().batches().zip(bodies);
    for (record, (contact, (own, other))) in records.chunks_exact(RECORD).zip(batches) {
        let (x, o) = (moved::<L>(on.rows, own), moved::<L>(on.rows, other));
        for (p, kept) in kept.iter_mut().enumerate() {
            let forces = L::gather_quads::<2, 0>(kept, contact);
            // With α = 0 the tangential error is the drift.
            let drift = rows(record, p, x, o, forces, zero).error[1];
            let slack = record[2] * forces[NORMAL] - forces[TANGENT].max(-forces[TANGENT]);
            let near = (reach - drift.max(-drift)).select_positive(drift, zero);
            L::scatter_quads::<2, 1>(kept, contact, [slack.select_positive(near, zero), zero, zero, zero]);
        }
    }
}

#[inline(never)]
fn velocities<L: Lanes>(lanes: &BodyLanes, records: &[Block], on: &mut DescentInput<'_>, h: f32) {
    let records: &[L] = bytemuck::cast_slice(records);
    let inv_h = L::splat(1.0 / h);
    for (record, index) in records.chunks_exact(BODY).zip(lanes.bodies.list().batches()) {
        let row = L::gather(on.rows, index);
        let v = [0, 1, 2].map(|k| (row[4 + k] - record[k]).mul_add(inv_h, row[k]));
        L::scatter_velocity(on.rows, index, [v[0], v[1], v[2], row[3]]);
    }
}
