//! Joints that hang from what does not move, solved at once: chains, bridges, cranes.
//!
//! # Problem
//!
//! Gauss–Seidel needs n² sweeps along a chain of n links, times the ratio of masses. But bodies and rigid rows that form a
//! tree are solved exactly by elimination from the leaves, in a time that grows with n. Per substep of h, with J, C and v at its
//! start, the increments δ of velocities and impulses obey
//!
//! ```text
//! M δv = Jᵀ δλ,      J (v + δv) + C/h + γ K (λ + δλ) = 0,      K = J M⁻¹ Jᵀ of each joint alone
//! ```
//!
//! The errors are gone at the end of the substep to first order. [`GIVE`], γ, makes the system definite where rows contradict
//! each other: a straight bridge bears its weight with an infinite tension. At rest the joint gives way by C = γ K λ h.
//!
//! # Elimination
//!
//! Bodies come after all that hangs from them. Let a body c with all of that eliminated obey A δv = g + J_cᵀ δλ, where δλ is of
//! its joint toward the root and p is the body there. Then
//!
//! ```text
//! S = J_c A⁻¹ J_cᵀ + γ K,      s = −(J v + C/h + γ K λ) − J_c A⁻¹ g,      δλ = S⁻¹ (s − J_p δv_p)
//! A_p ← A_p + J_pᵀ S⁻¹ J_p,    g_p ← g_p + J_pᵀ S⁻¹ s
//! ```
//!
//! and back from the root, δv_c = A⁻¹ (g + J_cᵀ δλ). A second joint to what does not move has no body c: S = γ K.
//! This is Featherstone's articulated-body algorithm in the coordinates of bodies.
//!
//! Trees are those of two joints or more that are connected to a body that no impulse moves, without loops. All else is
//! left to sweeps: the bodies of ragdolls differ little in mass, and a loop has no leaf. It runs in `f64`, one body after the
//! other: the same bits at any width.

use crate::engine::constraints::kernels::types::{Joined, Placed};
use crate::engine::constraints::records::rows::{ROWS, RigidRows};
use crate::engine::lanes::{BodyRow, held};
use crate::engine::narrowphase::lanes::PoseRow;

/// γ: softness of rows (1), as a share of K. A joint under a load F gives way by γ K F h²: 2500 times less than the stiffest
/// springs that one sweep bears.
const GIVE: f64 = 1e-4;

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
    nodes: Vec<Node>,
    found: Finding,
}

/// A joint of a tree.
#[derive(Clone, Copy, Debug)]
struct TreeJoint {
    /// Its type and number there.
    place: [u32; 2],
    /// Nodes of the body that hangs and of the one toward the root, or [`NONE`].
    nodes: [u32; 2],
    size: usize,
    /// J of both.
    j: [[[f64; 3]; ROWS]; 2],
    /// S⁻¹ and s
    inverse: [[f64; ROWS]; ROWS],
    s: [f64; ROWS],
}

/// A body of a tree.
#[derive(Clone, Copy, Debug)]
struct Node {
    body: u32,
    /// A, and then its inverse.
    a: Symmetric,
    g: [f64; 3],
}

/// Room to find trees.
#[derive(Clone, Debug, Default)]
struct Finding {
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
    /// Node of each body.
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
        (self.joints.clear(), self.nodes.clear());
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
                self.joints.push(TreeJoint { place, nodes, ..TreeJoint::NONE });
            }
            self.nodes.push(Node { body, a: [0.0; 6], g: [0.0; 3] });
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
        for node in &mut self.nodes {
            let row = &rows[node.body as usize];
            let [mass, inertia] = [row.velocity[3], row.delta[3]].map(|inverse| {
                // What does not turn has an inertia beyond all others.
                if inverse > 0.0 { 1.0 / f64::from(inverse) } else { 1e30 }
            });
            (node.a, node.g) = ([mass, 0.0, mass, 0.0, 0.0, inertia], [0.0; 3]);
        }
        let inv_h = 1.0 / f64::from(h);
        for joint in &mut self.joints {
            let [t, i] = joint.place;
            let found = types[t as usize].kind.rigid_rows(i as usize, Placed { rows, poses });
            joint.size = found.size;
            match found.size {
                1 => joint.eliminate::<1>(&found, &mut self.nodes, rows, inv_h),
                2 => joint.eliminate::<2>(&found, &mut self.nodes, rows, inv_h),
                _ => joint.eliminate::<3>(&found, &mut self.nodes, rows, inv_h),
            }
        }
        for joint in self.joints.iter().rev() {
            let increments = match joint.size {
                1 => joint.substitute::<1>(&mut self.nodes),
                2 => joint.substitute::<2>(&mut self.nodes),
                _ => joint.substitute::<3>(&mut self.nodes),
            };
            let [t, i] = joint.place;
            types[t as usize].kind.add_to_rigid(i as usize, increments);
        }
        for node in &self.nodes {
            let velocity = &mut rows[node.body as usize].velocity;
            for (v, more) in velocity.iter_mut().zip(node.g) {
                *v = (f64::from(*v) + more) as f32;
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let Finding { starts, joined, places, ends, visited, order, nodes } = &self.found;
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

impl Finding {
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
        let Finding { starts, joined, places, ends, visited, nodes, .. } = self;
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

impl TreeJoint {
    const NONE: TreeJoint = TreeJoint {
        place: [0; 2],
        nodes: [NONE; 2],
        size: 0,
        j: [[[0.0; 3]; ROWS]; 2],
        inverse: [[0.0; ROWS]; ROWS],
        s: [0.0; ROWS],
    };

    /// Eliminates its child and itself.
    #[inline(always)]
    fn eliminate<const N: usize>(
        &mut self,
        found: &RigidRows,
        nodes: &mut [Node],
        rows: &[BodyRow],
        inv_h: f64,
    ) {
        let [child, parent] = self.nodes.map(|node| node as usize);
        // Body b is the child or a is: J_b = (d, s_b), J_a = −(d, s_a).
        let child_is_b = match nodes.get(child) {
            Some(node) => node.body == found.bodies[1],
            None => nodes[parent].body != found.bodies[1],
        };
        let ends = found.bodies.map(|body| &rows[body as usize]);
        let (mut j, mut lacking) = ([[[0.0; 3]; N]; 2], [0.0; N]);
        for r in 0..N {
            let of = &found.jacobians[r];
            let [x, y] = of.axis.map(f64::from);
            let [of_a, of_b] = of.arms.map(f64::from);
            (j[0][r], j[1][r]) = ([-x, -y, -of_a], [x, y, of_b]);
            for (j, row) in j.iter().zip(ends) {
                lacking[r] += (0..3).map(|k| j[r][k] * f64::from(row.velocity[k])).sum::<f64>();
            }
        }
        let speed = found.errors[..N].iter().map(|&c| f64::from(c).powi(2)).sum::<f64>().sqrt() * inv_h;
        let rate = if speed > MOST_SPEED { inv_h * MOST_SPEED / speed } else { inv_h };
        let mut s_matrix = [[0.0; N]; N];
        for r in 0..N {
            lacking[r] += rate * f64::from(found.errors[r]);
            for c in 0..N {
                for (j, row) in j.iter().zip(ends) {
                    let [mass, inertia] = [row.velocity[3], row.delta[3]].map(f64::from);
                    let along = j[r][0] * j[c][0] + j[r][1] * j[c][1];
                    s_matrix[r][c] += GIVE * (mass * along + inertia * (j[r][2] * j[c][2]));
                }
                lacking[r] += s_matrix[r][c] * f64::from(found.impulses[c]);
            }
        }
        if !child_is_b {
            j.swap(0, 1);
        }
        let [of_parent, of_child] = j;
        let mut s = lacking.map(|x| -x);
        if let Some(node) = nodes.get_mut(child) {
            node.a = inverted(&node.a);
            let moved = times(&node.a, node.g);
            for r in 0..N {
                let along = times(&node.a, of_child[r]);
                s[r] -= dot(of_child[r], moved);
                for c in 0..N {
                    s_matrix[r][c] += dot(along, of_child[c]);
                }
            }
        }
        let inverse = inverse_of(s_matrix);
        if let Some(node) = nodes.get_mut(parent) {
            let force = product(&inverse, s);
            for r in 0..N {
                for k in 0..3 {
                    node.g[k] += of_parent[r][k] * force[r];
                }
                let mut along = [0.0; 3];
                for c in 0..N {
                    for k in 0..3 {
                        along[k] += inverse[r][c] * of_parent[c][k];
                    }
                }
                let of = of_parent[r];
                node.a[0] += of[0] * along[0];
                node.a[1] += of[0] * along[1];
                node.a[2] += of[1] * along[1];
                node.a[3] += of[0] * along[2];
                node.a[4] += of[1] * along[2];
                node.a[5] += of[2] * along[2];
            }
        }
        for r in 0..N {
            (self.j[0][r], self.j[1][r], self.s[r]) = (of_child[r], of_parent[r], s[r]);
            self.inverse[r][..N].copy_from_slice(&inverse[r]);
        }
    }

    /// Its impulses, once the parent's change of velocity stands in its g; the child's comes to stand there.
    #[inline(always)]
    fn substitute<const N: usize>(&self, nodes: &mut [Node]) -> [f32; ROWS] {
        let [child, parent] = self.nodes.map(|node| node as usize);
        let mut s = [0.0; N];
        for r in 0..N {
            s[r] = self.s[r] - nodes.get(parent).map_or(0.0, |node| dot(self.j[1][r], node.g));
        }
        let mut increments = [0.0; N];
        for r in 0..N {
            increments[r] = (0..N).map(|c| self.inverse[r][c] * s[c]).sum();
        }
        if let Some(node) = nodes.get_mut(child) {
            let mut pushed = node.g;
            for r in 0..N {
                for k in 0..3 {
                    pushed[k] += self.j[0][r][k] * increments[r];
                }
            }
            node.g = times(&node.a, pushed);
        }
        let mut single = [0.0; ROWS];
        single.iter_mut().zip(increments).for_each(|(to, from)| *to = from as f32);
        single
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

/// The inverse by cofactors.
#[inline(always)]
fn inverted(&[xx, xy, yy, xw, yw, ww]: &Symmetric) -> Symmetric {
    let (of_xx, of_xy, of_xw) = (yy * ww - yw * yw, xw * yw - xy * ww, xy * yw - xw * yy);
    let scale = 1.0 / (xx * of_xx + xy * of_xy + xw * of_xw);
    [
        of_xx * scale,
        of_xy * scale,
        (xx * ww - xw * xw) * scale,
        of_xw * scale,
        (xy * xw - xx * yw) * scale,
        (xx * yy - xy * xy) * scale,
    ]
}

/// The inverse of a symmetric matrix of one to three rows.
#[inline(always)]
fn inverse_of<const N: usize>(m: [[f64; N]; N]) -> [[f64; N]; N] {
    let mut inverse = [[0.0; N]; N];
    match N {
        1 => inverse[0][0] = 1.0 / m[0][0],
        2 => {
            let scale = 1.0 / (m[0][0] * m[1][1] - m[0][1] * m[0][1]);
            (inverse[0][0], inverse[1][1]) = (m[1][1] * scale, m[0][0] * scale);
            inverse[0][1] = -m[0][1] * scale;
            inverse[1][0] = inverse[0][1];
        }
        _ => {
            let [xx, xy, yy, xw, yw, ww] =
                inverted(&[m[0][0], m[0][1], m[1][1], m[0][2], m[1][2], m[2][2]]);
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
