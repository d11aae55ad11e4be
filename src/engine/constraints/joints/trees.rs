//! Joints that hang from what does not move, solved at once: chains, bridges, cranes.
//!
//! # Problem
//!
//! Gauss–Seidel needs n² sweeps along a chain of n links, times the ratio of masses. But bodies and rigid rows that form a
//! tree are solved exactly by elimination from the leaves, in a time that grows with n. Per substep of h, with J, C and v at its
//! start, the increments δ of velocities and impulses obey
//!
//! ```text
//! M δv = Jᵀ δλ,      J (v + δv) + C/h = 0
//! ```
//!
//! The errors are gone at the end of the substep to first order.
//!
//! # Elimination
//!
//! Bodies come after all that hangs from them. Let a body c with all of that eliminated obey A δv = g + J_cᵀ δλ, where δλ is of
//! its joint toward the root and p is the body there. Then
//!
//! ```text
//! S = J_c A⁻¹ J_cᵀ,    s = −(J v + C/h) − J_c A⁻¹ g,    δλ = S⁻¹ (s − J_p δv_p)
//! A_p ← A_p + J_pᵀ S⁻¹ J_p,    g_p ← g_p + J_pᵀ S⁻¹ s
//! ```
//!
//! and back from the root, δv_c = A⁻¹ (g + J_cᵀ δλ). This is Featherstone's articulated-body algorithm in the coordinates of
//! bodies (`featherstone1987`). Of hinges, whose rows are J = ±(1 | p) with p = (−r_y, r_x), most products are with 0 and 1, and are left out; and
//! with A⁻¹ = B/a, S = T/a and T⁻¹ = U/t, where B and U are of cofactors, S⁻¹ = (a/t) U takes one division.
//!
//! A second joint to what does not move closes a loop through it: rows may contradict each other, as those of a straight bridge,
//! whose tension has no bound. Such a joint gives way a little. It has no body c, and
//!
//! ```text
//! S = γ K,   s = −(J v + C/h + γ K λ),   K = J M⁻¹ Jᵀ
//! ```
//!
//! so that at rest C = γ K λ h.
//!
//! Trees are those of two joints or more that are connected to a body that no impulse moves, without other loops. All else is
//! left to sweeps: the bodies of ragdolls differ little in mass, and a loop has no leaf. It runs in `f64`, one body after the
//! other: the same bits at any width.

use crate::engine::constraints::kernels::types::{Joined, Placed};
use crate::engine::constraints::records::rows::{ROWS, RigidRows};
use crate::engine::lanes::{BodyRow, held};
use crate::engine::narrowphase::lanes::PoseRow;

/// γ (1), of joints that close a loop through what does not move.
const GIVE: f64 = 1e-3;

/// Fastest speed at which errors of a joint are removed (m/s or rad/s).
const MOST_SPEED: f64 = 10.0;

/// No body.
const NONE: u32 = u32::MAX;

/// Trees of joints, and room to solve them.
#[derive(Clone, Debug, Default)]
pub struct Trees {
    /// Ends of all joints as they were when the trees were found. `[joints]`
    ends: Vec<[u32; 2]>,
    /// Whether bodies move by impulses, as they did then. `[rows]`
    moves: Vec<bool>,
    /// Whether a joint is part of a tree, by type. `[types][joints]`
    aside: Vec<Vec<bool>>,
    /// From the leaves to the roots.
    joints: Vec<TreeJoint>,
    nodes: Vec<TreeBody>,
    found: TreeSearch,
}

/// A joint of a tree.
#[derive(Clone, Copy, Debug)]
struct TreeJoint {
    /// Its type and number there.
    place: [u32; 2],
    /// Nodes of the body that hangs and of the one toward the root, or [`NONE`].
    nodes: [u32; 2],
    rows: EliminatedRows,
}

/// Rows of a joint and what is left of them after elimination: J of the child and of the parent, S⁻¹ and s.
#[derive(Clone, Copy, Debug)]
enum EliminatedRows {
    /// Rows ±(1 | p), the child's with `sign`.
    Point { sign: f64, child: [f64; 2], parent: [f64; 2], inverse: [f64; 3], s: [f64; 2] },
    /// Any.
    Many { size: usize, j: [[[f64; 3]; ROWS]; 2], inverse: [[f64; ROWS]; ROWS], s: [f64; ROWS] },
}

/// A body of a tree.
#[derive(Clone, Copy, Debug)]
struct TreeBody {
    body: u32,
    /// Velocity (m/s, m/s, rad/s).
    v: [f64; 3],
    /// A, and then its inverse.
    a: Symmetric,
    /// g, and then δv.
    g: [f64; 3],
}

/// Room to find trees.
#[derive(Clone, Debug, Default)]
struct TreeSearch {
    /// Where joints of a body begin in `joined`. `[bodies + 1]`
    starts: Vec<u32>,
    /// Joints by body.
    joined: Vec<u32>,
    /// Place of each joint.
    places: Vec<[u32; 2]>,
    /// Its ends; [`NONE`] for what does not move.
    ends: Vec<[u32; 2]>,
    /// Visited bodies.
    visited: Vec<bool>,
    /// Bodies of a component from its root on, and the joint toward the root.
    order: Vec<[u32; 2]>,
    /// TreeBody of each body.
    nodes: Vec<u32>,
}

/// xx, xy, yy, xw, yw, ww
type Symmetric = [f64; 6];

impl Trees {
    /// Finds the trees among the joints of these types, where joints or bodies have changed.
    pub fn find(&mut self, types: &[Joined], rows: &[BodyRow]) {
        let is_same = self.moves.len() == rows.len()
            && self.moves.iter().zip(rows).all(|(&moves, row)| moves == moves_by_impulses(row))
            && self.ends.iter().eq(types.iter().flat_map(|t| t.kind.ends()));
        if is_same && self.aside.len() == types.len() {
            return;
        }
        self.moves.clear();
        self.moves.extend(rows.iter().map(moves_by_impulses));
        self.ends.clear();
        self.ends.extend(types.iter().flat_map(|t| t.kind.ends()));
        self.aside.clear();
        self.aside.extend(types.iter().map(|t| vec![false; t.kind.ends().len()]));
        self.joints.clear();
        self.nodes.clear();
        self.found.list(types, &self.moves);
        for body in 0..rows.len() as u32 {
            if self.moves[body as usize] && !self.found.visited[body as usize] {
                self.plant(body);
            }
        }
    }

    /// Lists the tree of a body, if it is one.
    fn plant(&mut self, body: u32) {
        let found = &mut self.found;
        let (links, holder) = found.reach([body, NONE]);
        let Some(root) = holder else { return };
        let held = found.order.iter().flat_map(|&[body, _]| found.joints_of(body));
        let held = held.filter(|&&joint| found.ends[joint as usize].contains(&NONE)).count();
        // A tree has one joint fewer than bodies, besides those to what does not move.
        if links < 2 || links - held + 1 != found.order.len() {
            return;
        }
        for &[body, _] in &found.order {
            found.visited[body as usize] = false;
        }
        found.reach(root);
        for (i, &[body, _]) in found.order.iter().rev().enumerate() {
            found.nodes[body as usize] = (self.nodes.len() + i) as u32;
        }
        for &[body, toward] in found.order.iter().rev() {
            let node = found.nodes[body as usize];
            let others = found.joints_of(body).iter().filter(|&&joint| joint != toward);
            let held = others.filter(|&&joint| found.ends[joint as usize].contains(&NONE));
            let other = found.other_end(toward, body);
            let parent = if other == NONE { NONE } else { found.nodes[other as usize] };
            for (joint, nodes) in held.map(|&joint| (joint, [NONE, node])).chain([(toward, [node, parent])]) {
                let place = found.places[joint as usize];
                self.aside[place[0] as usize][place[1] as usize] = true;
                self.joints.push(TreeJoint { place, nodes, rows: EliminatedRows::NONE });
            }
            self.nodes.push(TreeBody { body, v: [0.0; 3], a: [0.0; 6], g: [0.0; 3] });
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Says to types which joints sweeps leave alone.
    pub fn set_aside(&self, types: &mut [Joined]) {
        for (joined, aside) in types.iter_mut().zip(&self.aside) {
            joined.kind.set_aside(if aside.contains(&true) { aside } else { &[] });
        }
    }

    /// Changes velocities and impulses so that the rows hold at the end of the substep of `h` (s).
    pub fn solve(&mut self, types: &mut [Joined], rows: &mut [BodyRow], poses: &[PoseRow], h: f32) {
        let Trees { joints, nodes, .. } = self;
        for node in nodes.iter_mut() {
            let BodyRow { velocity: [x, y, w, inv_mass], delta: [.., inv_inertia] } =
                rows[node.body as usize];
            let [mass, inertia] = [inv_mass, inv_inertia].map(|inverse| {
                // What does not turn has an inertia beyond all others.
                if inverse > 0.0 { 1.0 / f64::from(inverse) } else { 1e30 }
            });
            node.v = [x, y, w].map(f64::from);
            (node.a, node.g) = ([mass, 0.0, mass, 0.0, 0.0, inertia], [0.0; 3]);
        }
        let inv_h = 1.0 / f64::from(h);
        for joint in joints.iter_mut() {
            let [t, i] = joint.place;
            let found = types[t as usize].kind.rigid_rows(i as usize, Placed { rows, poses });
            if found.is_point() {
                joint.rows = eliminate_point(joint.nodes, &found, nodes, rows, inv_h);
            } else {
                joint.rows = match found.size {
                    1 => eliminate::<1>(joint.nodes, &found, nodes, rows, inv_h),
                    2 => eliminate::<2>(joint.nodes, &found, nodes, rows, inv_h),
                    _ => eliminate::<3>(joint.nodes, &found, nodes, rows, inv_h),
                };
            }
        }
        for joint in joints.iter().rev() {
            let increments = joint.substitute(nodes);
            let [t, i] = joint.place;
            types[t as usize].kind.add_to_rigid(i as usize, increments);
        }
        for node in nodes.iter() {
            let velocity = &mut rows[node.body as usize].velocity;
            for (k, v) in velocity[..3].iter_mut().enumerate() {
                *v = (node.v[k] + node.g[k]) as f32;
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let TreeSearch { starts, joined, places, ends, visited, order, nodes } = &self.found;
        held(&self.ends)
            + held(&self.moves)
            + self.aside.iter().map(held).sum::<usize>()
            + held(&self.joints)
            + held(&self.nodes)
            + held(starts)
            + held(joined)
            + held(places)
            + held(ends)
            + held(visited)
            + held(order)
            + held(nodes)
    }
}

fn moves_by_impulses(row: &BodyRow) -> bool {
    row.velocity[3] > 0.0
}

impl TreeSearch {
    fn joints_of(&self, body: u32) -> &[u32] {
        let [from, to] = [self.starts[body as usize], self.starts[body as usize + 1]].map(|i| i as usize);
        &self.joined[from..to]
    }

    fn other_end(&self, joint: u32, body: u32) -> u32 {
        let [a, b] = self.ends[joint as usize];
        if a == body { b } else { a }
    }

    /// Lists what hangs together with a body, from there on, and the joint toward it; returns how many joints there are, and
    /// a body that is held by what does not move with the joint that does.
    fn reach(&mut self, from: [u32; 2]) -> (usize, Option<[u32; 2]>) {
        self.order.clear();
        self.order.push(from);
        self.visited[from[0] as usize] = true;
        let (mut next, mut ends, mut holder) = (0, 0, None);
        while let Some(&[body, toward]) = self.order.get(next) {
            next += 1;
            for k in self.starts[body as usize]..self.starts[body as usize + 1] {
                let joint = self.joined[k as usize];
                let other = self.other_end(joint, body);
                if other == NONE {
                    ends += 2;
                    holder = holder.or(Some([body, joint]));
                    continue;
                }
                ends += 1;
                if joint != toward && !self.visited[other as usize] {
                    self.visited[other as usize] = true;
                    self.order.push([other, joint]);
                }
            }
        }
        (ends / 2, holder)
    }

    /// Lists the joints of each body.
    fn list(&mut self, types: &[Joined], moves: &[bool]) {
        let TreeSearch { starts, joined, places, ends, visited, nodes, .. } = self;
        places.clear();
        ends.clear();
        starts.clear();
        starts.resize(moves.len() + 1, 0);
        for (t, joined) in types.iter().enumerate() {
            if !joined.kind.is_rigid() {
                continue;
            }
            for (i, pair) in joined.kind.ends().iter().enumerate() {
                let pair = pair.map(|body| if moves[body as usize] { body } else { NONE });
                places.push([t as u32, i as u32]);
                ends.push(pair);
                pair.iter().filter(|&&body| body != NONE).for_each(|&body| starts[body as usize + 1] += 1);
            }
        }
        for body in 0..moves.len() {
            starts[body + 1] += starts[body];
        }
        joined.clear();
        joined.resize(starts[moves.len()] as usize, 0);
        // Filled from behind, so that starts end where they began.
        let mut next: Vec<u32> = starts[1..].to_vec();
        for (joint, pair) in ends.iter().enumerate().rev() {
            for &body in pair.iter().filter(|&&body| body != NONE) {
                next[body as usize] -= 1;
                joined[next[body as usize] as usize] = joint as u32;
            }
        }
        visited.clear();
        visited.resize(moves.len(), false);
        nodes.clear();
        nodes.resize(moves.len(), NONE);
    }
}

impl EliminatedRows {
    const NONE: Self = EliminatedRows::Point {
        sign: 0.0,
        child: [0.0; 2],
        parent: [0.0; 2],
        inverse: [0.0; 3],
        s: [0.0; 2],
    };
}

/// Whether the child is body b, which J has positive.
#[inline(always)]
fn child_is_b([child, parent]: [u32; 2], bodies: [u32; 2], nodes: &[TreeBody]) -> bool {
    match nodes.get(child as usize) {
        Some(node) => node.body == bodies[1],
        None => nodes[parent as usize].body != bodies[1],
    }
}

/// Velocity of a node, or of a body that is none.
#[inline(always)]
fn velocity(node: u32, body: u32, nodes: &[TreeBody], rows: &[BodyRow]) -> [f64; 3] {
    nodes.get(node as usize).map_or_else(
        || {
            let [x, y, w, _] = rows[body as usize].velocity;
            [x, y, w].map(f64::from)
        },
        |node| node.v,
    )
}

/// Rate at which the errors of a block are removed (1/s).
#[inline(always)]
fn rate_of(errors: &[f32], inv_h: f64) -> f64 {
    let square = errors.iter().map(|&c| f64::from(c) * f64::from(c)).sum::<f64>() * inv_h * inv_h;
    if square > MOST_SPEED * MOST_SPEED { inv_h * MOST_SPEED / square.sqrt() } else { inv_h }
}

/// Eliminates a hinge and the body that hangs from it.
#[inline(always)]
fn eliminate_point(
    at: [u32; 2],
    found: &RigidRows,
    nodes: &mut [TreeBody],
    rows: &[BodyRow],
    inv_h: f64,
) -> EliminatedRows {
    let is_b = child_is_b(at, found.bodies, nodes);
    let (sign, [body_p, body_c]) =
        if is_b { (1.0, found.bodies) } else { (-1.0, [found.bodies[1], found.bodies[0]]) };
    let arms = |k: usize| [f64::from(found.jacobians[0].arms[k]), f64::from(found.jacobians[1].arms[k])];
    let (p, q) = if is_b { (arms(1), arms(0)) } else { (arms(0), arms(1)) };
    let (vc, vp) = (velocity(at[0], body_c, nodes, rows), velocity(at[1], body_p, nodes, rows));
    let rate = sign * rate_of(&found.errors[..2], inv_h);
    let mut s =
        [0, 1].map(|k| (vp[k] + q[k] * vp[2]) - (vc[k] + p[k] * vc[2]) - rate * f64::from(found.errors[k]));
    let inverse = match nodes.get_mut(at[0] as usize) {
        Some(node) => {
            let [xx, xy, yy, xw, yw, ww] = cofactors(&node.a);
            let a = node.a[0] * xx + node.a[1] * xy + node.a[3] * xw;
            let first = [xx + p[0] * xw, xy + p[0] * yw, xw + p[0] * ww];
            let second = [yy + p[1] * yw, yw + p[1] * ww];
            let t = [first[0] + p[0] * first[2], first[1] + p[1] * first[2], second[0] + p[1] * second[1]];
            let determinant = t[0] * t[2] - t[1] * t[1];
            let scale = if determinant > 0.0 { a / determinant } else { 0.0 };
            let inv_a = 1.0 / a;
            node.a = [xx, xy, yy, xw, yw, ww].map(|x| x * inv_a);
            let moved = times(&node.a, node.g);
            for k in 0..2 {
                s[k] -= moved[k] + p[k] * moved[2];
            }
            [t[2] * scale, -t[1] * scale, t[0] * scale]
        }
        None => {
            let row = &rows[body_p as usize];
            let [mass, inertia] = [row.velocity[3], row.delta[3]].map(f64::from);
            let k = [mass + inertia * (q[0] * q[0]), inertia * (q[0] * q[1]), mass + inertia * (q[1] * q[1])];
            let l = [0, 1].map(|k| sign * GIVE * f64::from(found.impulses[k]));
            s = [s[0] - (k[0] * l[0] + k[1] * l[1]), s[1] - (k[1] * l[0] + k[2] * l[1])];
            let scale = reciprocal(GIVE * (k[0] * k[2] - k[1] * k[1]));
            [k[2] * scale, -k[1] * scale, k[0] * scale]
        }
    };
    if let Some(node) = nodes.get_mut(at[1] as usize) {
        let [xx, xy, yy] = inverse;
        let force = [xx * s[0] + xy * s[1], xy * s[0] + yy * s[1]];
        let turning = [xx * q[0] + xy * q[1], xy * q[0] + yy * q[1]];
        let more = [xx, xy, yy, turning[0], turning[1], q[0] * turning[0] + q[1] * turning[1]];
        node.a.iter_mut().zip(more).for_each(|(a, more)| *a += more);
        let force = [force[0], force[1], q[0] * force[0] + q[1] * force[1]];
        node.g.iter_mut().zip(force).for_each(|(g, force)| *g -= force);
    }
    EliminatedRows::Point { sign, child: p, parent: q, inverse, s }
}

/// Eliminates a joint of any rows and the body that hangs from it.
#[inline(never)]
fn eliminate<const N: usize>(
    at: [u32; 2],
    found: &RigidRows,
    nodes: &mut [TreeBody],
    rows: &[BodyRow],
    inv_h: f64,
) -> EliminatedRows {
    let side = |k: usize, sign: f64| -> [[f64; 3]; N] {
        std::array::from_fn(|r| {
            let of = &found.jacobians[r];
            [of.axis[0], of.axis[1], of.arms[k]].map(|x| sign * f64::from(x))
        })
    };
    let (of_a, of_b, [a, b]) = (side(0, -1.0), side(1, 1.0), found.bodies);
    let is_b = child_is_b(at, found.bodies, nodes);
    let (of_parent, of_child) = if is_b { (of_a, of_b) } else { (of_b, of_a) };
    let bodies = if is_b { [a, b] } else { [b, a] };
    let (vc, vp) = (velocity(at[0], bodies[1], nodes, rows), velocity(at[1], bodies[0], nodes, rows));
    let rate = rate_of(&found.errors[..N], inv_h);
    let (mut s, mut s_matrix) = ([0.0; N], [[0.0; N]; N]);
    for r in 0..N {
        s[r] = -(dot(of_child[r], vc) + dot(of_parent[r], vp) + rate * f64::from(found.errors[r]));
    }
    match nodes.get_mut(at[0] as usize) {
        Some(node) => {
            let of = cofactors(&node.a);
            let inv_a = 1.0 / (node.a[0] * of[0] + node.a[1] * of[1] + node.a[3] * of[3]);
            node.a = of.map(|x| x * inv_a);
            let moved = times(&node.a, node.g);
            for r in 0..N {
                let along = times(&node.a, of_child[r]);
                s[r] -= dot(of_child[r], moved);
                s_matrix[r] = of_child.map(|j| dot(along, j));
            }
        }
        None => {
            let row = &rows[bodies[0] as usize];
            let [mass, inertia] = [row.velocity[3], row.delta[3]].map(f64::from);
            for r in 0..N {
                for c in 0..N {
                    let (p, q) = (of_parent[r], of_parent[c]);
                    let k = mass * (p[0] * q[0] + p[1] * q[1]) + inertia * (p[2] * q[2]);
                    s_matrix[r][c] = GIVE * k;
                    s[r] -= s_matrix[r][c] * f64::from(found.impulses[c]);
                }
            }
        }
    }
    let inverse = inverse_of(s_matrix);
    if let Some(node) = nodes.get_mut(at[1] as usize) {
        let force = product(&inverse, s);
        for r in 0..N {
            let mut along = [0.0; 3];
            for k in 0..3 {
                node.g[k] += of_parent[r][k] * force[r];
                along[k] = (0..N).map(|c| inverse[r][c] * of_parent[c][k]).sum();
            }
            let of = of_parent[r];
            let more = [
                of[0] * along[0],
                of[0] * along[1],
                of[1] * along[1],
                of[0] * along[2],
                of[1] * along[2],
                of[2] * along[2],
            ];
            node.a.iter_mut().zip(more).for_each(|(a, more)| *a += more);
        }
    }
    let (mut kept_j, mut kept_inverse, mut kept_s) =
        ([[[0.0; 3]; ROWS]; 2], [[0.0; ROWS]; ROWS], [0.0; ROWS]);
    for r in 0..N {
        (kept_j[0][r], kept_j[1][r], kept_s[r]) = (of_child[r], of_parent[r], s[r]);
        kept_inverse[r][..N].copy_from_slice(&inverse[r]);
    }
    EliminatedRows::Many { size: N, j: kept_j, inverse: kept_inverse, s: kept_s }
}

impl TreeJoint {
    /// Its impulses, once the parent's change of velocity stands in its g; the child's comes to stand there.
    #[inline(always)]
    fn substitute(&self, nodes: &mut [TreeBody]) -> [f32; ROWS] {
        let [child, parent] = self.nodes.map(|node| node as usize);
        let of_parent = nodes.get(parent).map_or([0.0; 3], |node| node.g);
        let (force, increments) = match &self.rows {
            EliminatedRows::Point { sign, child: p, parent: q, inverse: [xx, xy, yy], s } => {
                let s = [0, 1].map(|k| s[k] + (of_parent[k] + q[k] * of_parent[2]));
                let [x, y] = [xx * s[0] + xy * s[1], xy * s[0] + yy * s[1]];
                ([x, y, p[0] * x + p[1] * y], [(sign * x) as f32, (sign * y) as f32, 0.0])
            }
            EliminatedRows::Many { size, j, inverse, s } => {
                let (mut force, mut increments) = ([0.0; 3], [0.0; ROWS]);
                let lacking = [0, 1, 2].map(|r| s[r] - dot(j[1][r], of_parent));
                for r in 0..*size {
                    let impulse = dot(inverse[r], lacking);
                    increments[r] = impulse as f32;
                    for k in 0..3 {
                        force[k] += j[0][r][k] * impulse;
                    }
                }
                (force, increments)
            }
        };
        if let Some(node) = nodes.get_mut(child) {
            node.g = times(&node.a, [node.g[0] + force[0], node.g[1] + force[1], node.g[2] + force[2]]);
        }
        increments
    }
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn times(&[xx, xy, yy, xw, yw, ww]: &Symmetric, [x, y, w]: [f64; 3]) -> [f64; 3] {
    [xx * x + xy * y + xw * w, xy * x + yy * y + yw * w, xw * x + yw * y + ww * w]
}

/// 1/x; 0 of rows that move nothing, such as that of a rod without length.
#[inline(always)]
fn reciprocal(x: f64) -> f64 {
    if x > 0.0 { 1.0 / x } else { 0.0 }
}

/// The determinant times the inverse.
#[inline(always)]
fn cofactors(&[xx, xy, yy, xw, yw, ww]: &Symmetric) -> Symmetric {
    [
        yy * ww - yw * yw,
        xw * yw - xy * ww,
        xx * ww - xw * xw,
        xy * yw - xw * yy,
        xy * xw - xx * yw,
        xx * yy - xy * xy,
    ]
}

/// The inverse of a symmetric matrix of one to three rows.
#[inline(always)]
fn inverse_of<const N: usize>(m: [[f64; N]; N]) -> [[f64; N]; N] {
    let mut inverse = [[0.0; N]; N];
    match N {
        1 => inverse[0][0] = reciprocal(m[0][0]),
        2 => {
            let scale = reciprocal(m[0][0] * m[1][1] - m[0][1] * m[0][1]);
            (inverse[0][0], inverse[1][1]) = (m[1][1] * scale, m[0][0] * scale);
            inverse[0][1] = -m[0][1] * scale;
            inverse[1][0] = inverse[0][1];
        }
        _ => {
            let of = [m[0][0], m[0][1], m[1][1], m[0][2], m[1][2], m[2][2]];
            let [xx, xy, yy, xw, yw, ww] = cofactors(&of);
            let scale = reciprocal(of[0] * xx + of[1] * xy + of[3] * xw);
            let [xx, xy, yy, xw, yw, ww] = [xx, xy, yy, xw, yw, ww].map(|x| x * scale);
            let full = [[xx, xy, xw], [xy, yy, yw], [xw, yw, ww]];
            for (to, from) in inverse.iter_mut().zip(full) {
                to.copy_from_slice(&from[..N]);
            }
        }
    }
    inverse
}

#[inline(always)]
fn product<const N: usize>(m: &[[f64; N]; N], x: [f64; N]) -> [f64; N] {
    m.map(|row| row.iter().zip(x).map(|(m, x)| m * x).sum())
}
