//! The step's problem in the velocities of bodies, in `f64`: what methods with a factorisation work on.
//!
//! With v_f the velocities without contact impulses and u = J v + b the relative velocities of points, b being what the
//! law adds along n, every such method solves
//!
//! ```text
//! M (v − v_f) = Jᵀ λ(u),   (M + Jᵀ G J) Δv = …,   G = −∂λ/∂u, a 2 × 2 block per point
//! ```
//!
//! whose matrix couples two bodies where they touch: three unknowns a body, however many points there are.

use crate::engine::constraints::numerics::block_lu::{BlockLu, Part3};
use crate::engine::constraints::vectors::system::{Pair, System};
use crate::engine::lanes::{BodyRow, held};

/// `[normal, tangential]` of one contact point.
pub type Point2 = [f64; 2];

/// One contact point.
#[derive(Clone, Copy, Debug)]
pub struct BodyPoint {
    /// Its place in vectors of [`System`].
    pub at: usize,
    /// Nodes of bodies a and b, [`FIXED`] for what no impulse moves.
    pub nodes: [u32; 2],
    /// J of n and t (first index) on bodies a and b (second).
    pub jacobian: [[Part3; 2]; 2],
    /// u where all nodes are at rest: b, and what moves without being pushed (m/s).
    pub rest: Point2,
    /// µ
    pub friction: f64,
    /// 1/(J M⁻¹ Jᵀ) of both rows (kg).
    pub mass: Point2,
    /// Places of the blocks (a, a), (a, b), (b, a), (b, b) in the factorisation.
    slots: [usize; 4],
}

/// A body that no impulse moves.
pub const FIXED: u32 = u32::MAX;

/// The problem; keeps its memory, and the pattern of its factorisation, from step to step.
#[derive(Clone, Debug, Default)]
pub struct BodySpace {
    /// In contact order.
    pub points: Vec<BodyPoint>,
    /// Inertia of each node (kg, kg, kg·m²).
    pub inertia: Vec<Part3>,
    /// v_f (m/s, m/s, rad/s)
    pub free: Vec<Part3>,
    /// The impulses that the step began with (N·s), a pair per point.
    pub warm: Vec<Point2>,
    /// M + Jᵀ G J.
    pub factor: BlockLu,
    node_of: Vec<u32>,
    rows_of: Vec<u32>,
    edges: Vec<[u32; 2]>,
    rows: Vec<BodyRow>,
    written: Vec<Pair>,
    pushed: Vec<Part3>,
    surfaces: Vec<Pair>,
}

impl BodySpace {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let pairs = held(&self.written) + held(&self.pushed) + held(&self.surfaces);
        let nodes = held(&self.inertia) + held(&self.free) + held(&self.node_of) + held(&self.rows_of);
        let pairs = pairs + held(&self.rows);
        let lists = held(&self.points) + held(&self.warm) + held(&self.edges);
        pairs + nodes + lists + self.factor.held_bytes()
    }

    /// Reads the step's problem; `bias` gives b (m/s) from a separation (m).
    pub fn load(&mut self, system: &mut System<'_>, bias: impl Fn(f32) -> f32) {
        system.impulses(&mut self.written);
        system.gaps_and_friction(&mut self.surfaces);
        self.find_nodes(system);
        self.points.clear();
        self.warm.clear();
        self.edges.clear();
        self.rows.clear();
        self.rows.extend_from_slice(system.rows());
        let rows = &self.rows;
        for p in system.point_rows() {
            let node = |side: usize| self.node_of.get(p.bodies[side] as usize).copied().unwrap_or(FIXED);
            let nodes = [node(0), node(1)];
            let of = |axis: usize, side: usize| {
                let sign = if side == 0 { -1.0 } else { 1.0 };
                [p.axes[axis][0], p.axes[axis][1], p.arms[axis][side]].map(|j| sign * f64::from(j))
            };
            let mut jacobian = [0, 1].map(|axis| [0, 1].map(|side| of(axis, side)));
            let [gap, friction] = self.surfaces[p.at].map(f64::from);
            let mut rest = [f64::from(bias(gap as f32)), 0.0];
            let mut answer = [0.0; 2];
            for side in 0..2 {
                let Some(row) = rows.get(p.bodies[side] as usize) else { continue };
                let inverse = [row.velocity[3], row.velocity[3], row.delta[3]].map(f64::from);
                for axis in 0..2 {
                    let j = jacobian[axis][side];
                    answer[axis] += (0..3).map(|k| j[k] * j[k] * inverse[k]).sum::<f64>();
                    // What no impulse moves is no unknown.
                    for k in (0..3).filter(|&k| nodes[side] == FIXED || inverse[k] <= 0.0) {
                        rest[axis] += j[k] * f64::from(row.velocity[k]);
                        jacobian[axis][side][k] = 0.0;
                    }
                }
            }
            let mass = answer.map(|k| if k > 0.0 { 1.0 / k } else { 0.0 });
            self.warm.push(self.written[p.at].map(f64::from));
            self.points.push(BodyPoint { at: p.at, nodes, jacobian, rest, friction, mass, slots: [0; 4] });
            if let [a, b] = nodes
                && a != FIXED
                && b != FIXED
            {
                self.edges.push([a.min(b), a.max(b)]);
            }
        }
        self.free.clear();
        self.free.extend(self.rows_of.iter().map(|&row| {
            let v = rows[row as usize].velocity;
            [v[0], v[1], v[2]].map(f64::from)
        }));
        // Without the impulses of the warm start.
        let BodySpace { points, inertia, free, warm, .. } = self;
        for (point, impulse) in points.iter().zip(warm.iter()) {
            point.push(inertia, free, impulse.map(|l| -l));
        }
        self.edges.dedup();
        self.factor.analyse(self.inertia.len(), &self.edges);
        for point in &mut self.points {
            let [a, b] = point.nodes;
            for (slot, [row, column]) in point.slots.iter_mut().zip([[a, a], [a, b], [b, a], [b, b]]) {
                if row != FIXED && column != FIXED {
                    *slot = self.factor.slot(row, column);
                }
            }
        }
    }

    /// Nodes are the bodies that contacts push, in the order of their rows.
    fn find_nodes(&mut self, system: &mut System<'_>) {
        self.node_of.clear();
        self.node_of.resize(system.rows().len(), FIXED);
        for p in system.point_rows() {
            for body in p.bodies {
                if let Some(node) = self.node_of.get_mut(body as usize) {
                    *node = 0;
                }
            }
        }
        self.rows_of.clear();
        self.inertia.clear();
        for (row, of) in system.rows().iter().enumerate() {
            let inverse = [row_inverse(of, 0), row_inverse(of, 1), row_inverse(of, 2)];
            let node = &mut self.node_of[row];
            if *node == FIXED || inverse[0] <= 0.0 {
                *node = FIXED;
                continue;
            }
            *node = self.rows_of.len() as u32;
            self.rows_of.push(row as u32);
            // What does not turn has no Jacobian there: any inertia will do.
            self.inertia.push(inverse.map(|i| if i > 0.0 { 1.0 / i } else { 1.0 }));
        }
    }

    /// Label of the island of each point: points that share no node, directly or by others, have different ones.
    pub fn islands(&self) -> Vec<u32> {
        let mut parent: Vec<u32> = (0..self.inertia.len() as u32).collect();
        fn root(parent: &mut [u32], mut node: u32) -> u32 {
            while parent[node as usize] != node {
                parent[node as usize] = parent[parent[node as usize] as usize];
                node = parent[node as usize];
            }
            node
        }
        for &[a, b] in &self.edges {
            let (a, b) = (root(&mut parent, a), root(&mut parent, b));
            parent[a.max(b) as usize] = a.min(b);
        }
        let of = |p: &BodyPoint| p.nodes.into_iter().find(|&node| node != FIXED);
        self.points.iter().map(|p| of(p).map_or(FIXED, |node| root(&mut parent, node))).collect()
    }

    /// How far impulses are from Coulomb's law, in N·s: the natural map of each point, at the velocities that follow from them.
    pub fn natural_map(&self, impulses: &[Point2]) -> Vec<f64> {
        let mut v = self.free.clone();
        for (point, &impulse) in self.points.iter().zip(impulses) {
            point.push(&self.inertia, &mut v, impulse);
        }
        let one = |(point, l): (&BodyPoint, &Point2)| {
            let u = self.velocity(point, &v);
            let normal = (l[0] - point.mass[0] * u[0]).max(0.0);
            let bound = point.friction * normal;
            let tangent = (l[1] - point.mass[1] * u[1]).max(-bound).min(bound);
            (l[0] - normal).abs().max((l[1] - tangent).abs())
        };
        self.points.iter().zip(impulses).map(one).collect()
    }

    /// u of a point (m/s).
    pub fn velocity(&self, point: &BodyPoint, v: &[Part3]) -> Point2 {
        let moved = point.along(v);
        [0, 1].map(|axis| point.rest[axis] + moved[axis])
    }

    /// Makes the matrix M + Jᵀ G J of these blocks G, one per point, and factorises it.
    pub fn factorise(&mut self, blocks: impl Iterator<Item = [Point2; 2]>) -> bool {
        let BodySpace { points, inertia, factor, edges, .. } = self;
        factor.analyse(inertia.len(), edges);
        for (node, m) in inertia.iter().enumerate() {
            let slot = factor.slot(node as u32, node as u32);
            factor.add(slot, &[[m[0], 0.0, 0.0], [0.0, m[1], 0.0], [0.0, 0.0, m[2]]]);
        }
        for (point, g) in points.iter().zip(blocks).filter(|(_, g)| *g != [[0.0; 2]; 2]) {
            for (k, [row, column]) in [[0, 0], [0, 1], [1, 0], [1, 1]].into_iter().enumerate() {
                if point.nodes[row] == FIXED || point.nodes[column] == FIXED {
                    continue;
                }
                let (r, c) = (
                    [0, 1].map(|axis| point.jacobian[axis][row]),
                    [0, 1].map(|axis| point.jacobian[axis][column]),
                );
                // G J of the column, then Jᵀ of the row.
                let gj = [0, 1].map(|axis| [0, 1, 2].map(|j| g[axis][0] * c[0][j] + g[axis][1] * c[1][j]));
                let block = [0, 1, 2].map(|i| [0, 1, 2].map(|j| r[0][i] * gj[0][j] + r[1][i] * gj[1][j]));
                factor.add(point.slots[k], &block);
            }
        }
        factor.factorise()
    }

    /// Makes these impulses, one pair per point, those of the records, rounded into their cones, and velocities those that
    /// follow from them.
    pub fn write(&mut self, system: &mut System<'_>, impulses: &[Point2]) {
        let BodySpace { points, inertia, free, pushed, written, surfaces, rows_of, .. } = self;
        pushed.clone_from(free);
        for (point, l) in points.iter().zip(impulses) {
            let normal = l[0].max(0.0) as f32;
            let bound = surfaces[point.at][1] * normal;
            let new = [normal, (l[1] as f32).min(bound).max(-bound)];
            written[point.at] = new;
            point.push(inertia, pushed, new.map(f64::from));
        }
        system.set_impulses(written);
        for (&row, v) in rows_of.iter().zip(pushed.iter()) {
            let velocity = &mut system.rows()[row as usize].velocity;
            (0..3).for_each(|k| velocity[k] = v[k] as f32);
        }
    }
}

impl BodyPoint {
    /// J v over nodes (m/s).
    pub fn along(&self, v: &[Part3]) -> Point2 {
        let of = |axis: usize| -> f64 {
            let side = |side: usize| -> f64 {
                let (j, node) = (self.jacobian[axis][side], self.nodes[side]);
                if node == FIXED { 0.0 } else { (0..3).map(|k| j[k] * v[node as usize][k]).sum() }
            };
            side(0) + side(1)
        };
        [of(0), of(1)]
    }

    /// Adds Jᵀ λ to momenta.
    pub fn pull(&self, momenta: &mut [Part3], impulse: Point2) {
        for side in 0..2 {
            if self.nodes[side] != FIXED {
                let to = &mut momenta[self.nodes[side] as usize];
                (0..3).for_each(|k| {
                    to[k] += self.jacobian[0][side][k] * impulse[0] + self.jacobian[1][side][k] * impulse[1];
                });
            }
        }
    }

    /// Adds M⁻¹ Jᵀ λ to velocities.
    pub fn push(&self, inertia: &[Part3], velocities: &mut [Part3], impulse: Point2) {
        for side in 0..2 {
            if self.nodes[side] != FIXED {
                let node = self.nodes[side] as usize;
                (0..3).for_each(|k| {
                    let pull =
                        self.jacobian[0][side][k] * impulse[0] + self.jacobian[1][side][k] * impulse[1];
                    velocities[node][k] += pull / inertia[node][k];
                });
            }
        }
    }
}

fn row_inverse(row: &BodyRow, k: usize) -> f64 {
    f64::from(if k < 2 { row.velocity[3] } else { row.delta[3] })
}
