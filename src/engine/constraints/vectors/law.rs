//! The contact law of an island around given impulses: the natural map and its norm, the linear problem for
//! fixed states, a sweep, Lemke's method. See [`crate::solvers::direct`].

use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::numerics::block_lu::{BlockLu, inverse};
use crate::constraints::numerics::cone;
use crate::constraints::numerics::coulomb_lcp::CoulombLcp;
use crate::constraints::numerics::envelope::Couplings;
use crate::constraints::records::rows::{RowBlock, RowLaw};
use crate::constraints::vectors::system::{Pair, PointRows};
use crate::lanes::BodyRow;

/// ε: shift added to the unit diagonal (1).
const SHIFT: f64 = 1e-7;
/// Most pivots of Lemke's method per unknown.
const PIVOTS: usize = 10;
/// Solves of a linear problem: one, and two refinements on the residual.
const PASSES: usize = 3;

/// State of a row in a linear problem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum State {
    /// u = 0.
    Holds,
    /// λ has this value.
    Fixed(f64),
    /// λ is this multiple of the λ of the previous row.
    Slips(f64),
}

/// One row of the Jacobian, scaled to unit masses: J M^(-½).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row {
    /// Rows of bodies a and b.
    pub bodies: [u32; 2],
    /// Indices of the bodies among the movable ones; [`IMMOVABLE`] for others.
    movable: [usize; 2],
    /// Parts of a and b.
    pub jacobian: [[f64; 3]; 2],
}

/// Index of immovable bodies in [`Row::movable`].
const IMMOVABLE: usize = usize::MAX;

impl Row {
    #[inline]
    fn dot(&self, velocities: &[[f64; 3]]) -> f64 {
        self.sides().map(|(body, j)| dot(j, velocities[body])).sum()
    }

    /// Adds the effect of an impulse.
    #[inline]
    fn push(&self, velocities: &mut [[f64; 3]], impulse: f64) {
        self.sides().for_each(|(body, j)| (0..3).for_each(|c| velocities[body][c] += j[c] * impulse));
    }

    /// The movable bodies, with their part of this row.
    #[inline]
    fn sides(&self) -> impl Iterator<Item = (usize, [f64; 3])> {
        self.movable.into_iter().zip(self.jacobian).filter(|side| side.0 != IMMOVABLE)
    }

    /// J M⁻¹ Jᵀ of two rows.
    #[inline]
    fn coupling(&self, other: &Row) -> f64 {
        self.sides()
            .flat_map(|(a, j)| other.sides().filter(move |s| s.0 == a).map(move |s| dot(j, s.1)))
            .sum()
    }
}

#[inline]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Bounds of the rows of a joint.
#[derive(Clone, Copy, Debug)]
enum Bound {
    Free,
    NotNegative,
    /// Bound on the norm of this row and the rows after it, `size` in all.
    Norm {
        cap: f64,
        size: usize,
    },
    /// A later row of the same bound.
    Same,
}

/// The row of the Jacobian for these bodies.
fn row(bodies: &[BodyRow], of: [u32; 2], jacobian: [[f64; 3]; 2]) -> Row {
    let side = |side: usize| {
        let mass = bodies.get(of[side] as usize).copied().unwrap_or_default();
        let inverse = [mass.velocity[3], mass.velocity[3], mass.delta[3]].map(f64::from);
        let moves = inverse != [0.0; 3];
        let scaled = [0, 1, 2].map(|c| jacobian[side][c] * inverse[c].sqrt());
        (if moves { of[side] as usize } else { IMMOVABLE }, scaled)
    };
    let [a, b] = [side(0), side(1)];
    Row { bodies: of, movable: [a.0, b.0], jacobian: [a.1, b.1] }
}

/// A row that holds.
struct HeldRow {
    /// Its index.
    at: usize,
    /// s µ for a slipping point, else 0.
    slope: f64,
    /// Inverse square root of its diagonal (kg^½).
    scale: f64,
    /// Rows of P and Q.
    seen: Row,
    acts: Row,
    b: f64,
}

/// Holding rows that share a block of T.
struct HeldGroup {
    first: usize,
    size: usize,
    softness: [[f64; 3]; 3],
    inverse: [[f64; 3]; 3],
}

/// Rows of a joint that share their softness R.
#[derive(Clone, Copy, Debug)]
struct JointSoftness {
    first: usize,
    size: usize,
    /// 1/kg
    r: [[f64; 3]; 3],
}

/// The law of an island around the impulses left by the sweeps. Rows 2i and 2i + 1 are the normal and the
/// tangential row of point i; joint rows follow after the points.
pub(crate) struct IslandLaw {
    pub points: Vec<PointRows>,
    friction: Vec<f64>,
    pub rows: Vec<Row>,
    /// Bounds of the joint rows.
    bounds: Vec<Bound>,
    joints: Vec<JointSoftness>,
    /// λ₀ (N·s)
    pub start: Vec<f64>,
    /// u at λ₀, including the bias (m/s).
    velocity: Vec<f64>,
    /// Diagonal of K + R (1/kg).
    diagonal: Vec<f64>,
    /// Number of movable bodies, and which of them are connected by a row.
    pub movable: usize,
    pub couplings: Couplings,
}

impl IslandLaw {
    /// The law of contact points, without joints.
    pub fn new(
        points: Vec<PointRows>,
        bodies: &[BodyRow],
        impulses: &[Pair],
        velocities: &[Pair],
        surfaces: &[Pair],
    ) -> Self {
        let flat = |v: &[Pair]| points.iter().flat_map(|p| v[p.at].map(f64::from)).collect::<Vec<_>>();
        let friction = points.iter().map(|p| f64::from(surfaces[p.at][1])).collect();
        let rows = points
            .iter()
            .flat_map(|p| [0, 1].map(|axis| row(bodies, p.bodies, [p.on(0, axis), p.on(1, axis)])));
        let rows = rows.collect();
        let (start, velocity) = (flat(impulses), flat(velocities));
        let (bounds, joints, diagonal) = (vec![], vec![], vec![]);
        let (movable, couplings) = (0, Couplings::default());
        IslandLaw { friction, start, velocity, rows, bounds, joints, diagonal, movable, couplings, points }
    }

    /// Adds the rows of a joint block.
    pub fn join(&mut self, bodies: &[BodyRow], block: &RowBlock, rigid: Softness, h: f32) {
        let (bias, softness) = (block.bias(rigid, h), f64::from(block.softness()));
        let first = self.rows.len();
        let mut r = block.response.map(|row| row.map(|x| softness * f64::from(x)));
        for (k, bias) in bias.into_iter().enumerate().take(block.size) {
            let jacobian = [block.on(0, k), block.on(1, k)];
            let speed = |side: usize| {
                let body = bodies.get(block.bodies[side] as usize).copied().unwrap_or_default();
                (0..3).map(|c| jacobian[side][c] * f64::from(body.velocity[c])).sum::<f64>()
            };
            let soft = (0..block.size).map(|c| r[k][c] * f64::from(block.impulses[c])).sum::<f64>();
            self.velocity.push(speed(0) + speed(1) + f64::from(bias) + soft);
            self.start.push(f64::from(block.impulses[k]));
            self.rows.push(row(bodies, block.bodies, jacobian));
            self.bounds.push(match (block.law, block.cap()) {
                (RowLaw::Limit, _) => Bound::NotNegative,
                (_, Some(_)) if k > 0 => Bound::Same,
                (_, Some(cap)) => Bound::Norm { cap: f64::from(cap), size: block.size },
                _ => Bound::Free,
            });
            // A row with no movable body and no softness keeps its impulse.
            if self.rows[first + k].coupling(&self.rows[first + k]) + r[k][k] <= 0.0 {
                self.velocity[first + k] = 0.0;
                r[k][k] = 1.0;
            }
        }
        self.joints.push(JointSoftness { first, size: block.size, r });
    }

    /// Numbers the movable bodies. All rows must have been added.
    pub fn couple(&mut self) {
        let mut numbers = std::collections::BTreeMap::new();
        for side in self.rows.iter_mut().flat_map(|row| &mut row.movable).filter(|side| **side != IMMOVABLE) {
            let next = numbers.len();
            *side = *numbers.entry(*side).or_insert(next);
        }
        self.movable = numbers.len();
        let pairs = self.rows.iter().map(|row| row.movable).filter(|pair| !pair.contains(&IMMOVABLE));
        self.couplings.begin(self.movable, pairs);
        self.diagonal = self.rows.iter().map(|row| row.coupling(row)).collect();
        for joint in &self.joints {
            (0..joint.size).for_each(|k| self.diagonal[joint.first + k] += joint.r[k][k]);
        }
    }

    /// Velocity changes by impulses, scaled to unit masses.
    fn moved(&self, x: &[f64]) -> Vec<[f64; 3]> {
        let mut moved = vec![[0.0; 3]; self.movable];
        self.rows.iter().zip(x).filter(|(_, x)| **x != 0.0).for_each(|(row, x)| row.push(&mut moved, *x));
        moved
    }

    /// (K + R) x
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let moved = self.moved(x);
        let mut product: Vec<f64> = self.rows.iter().map(|row| row.dot(&moved)).collect();
        for joint in &self.joints {
            for k in 0..joint.size {
                product[joint.first + k] +=
                    (0..joint.size).map(|c| joint.r[k][c] * x[joint.first + c]).sum::<f64>();
            }
        }
        product
    }

    fn diagonal(&self, i: usize) -> f64 {
        self.diagonal[i]
    }

    /// λ − (u + ε D (λ − λ₀))/D, row by row.
    pub fn arguments(&self, impulses: &[f64]) -> Vec<f64> {
        let change: Vec<f64> = impulses.iter().zip(&self.start).map(|(l, s)| l - s).collect();
        let pushed = self.times(&change);
        let argument =
            |i: usize| impulses[i] - (self.velocity[i] + pushed[i]) / self.diagonal(i) - SHIFT * change[i];
        (0..impulses.len()).map(argument).collect()
    }

    /// One projected Gauss–Seidel sweep.
    pub fn sweep(&self, impulses: &mut [f64]) {
        let mut change: Vec<f64> = impulses.iter().zip(&self.start).map(|(l, s)| l - s).collect();
        let mut moved = self.moved(&change);
        let argument = |i: usize, impulses: &[f64], change: &[f64], moved: &[[f64; 3]], soft: f64| {
            let u = self.velocity[i] + self.rows[i].dot(moved) + soft;
            impulses[i] - u / self.diagonal(i) - SHIFT * change[i]
        };
        let put = |i: usize, new: f64, impulses: &mut [f64], change: &mut [f64], moved: &mut [[f64; 3]]| {
            self.rows[i].push(moved, new - impulses[i]);
            (impulses[i], change[i]) = (new, new - self.start[i]);
        };
        for i in 0..2 * self.points.len() {
            let argument = argument(i, impulses, &change, &moved, 0.0);
            let new = match i % 2 {
                0 => argument.max(0.0),
                _ => cone::friction_f64(argument, self.friction[i / 2] * impulses[i - 1]),
            };
            put(i, new, impulses, &mut change, &mut moved);
        }
        let first = 2 * self.points.len();
        for joint in &self.joints {
            for k in 0..joint.size {
                let i = joint.first + k;
                let soft = (0..joint.size).map(|c| joint.r[k][c] * change[joint.first + c]).sum();
                let argument = argument(i, impulses, &change, &moved, soft);
                let new = match self.bounds[i - first] {
                    Bound::NotNegative => argument.max(0.0),
                    _ => argument,
                };
                put(i, new, impulses, &mut change, &mut moved);
            }
            if let Bound::Norm { cap, .. } = self.bounds[joint.first - first] {
                let members = joint.first..joint.first + joint.size;
                let norm = impulses[members.clone()].iter().map(|x| x * x).sum::<f64>().sqrt();
                if norm > cap {
                    members.for_each(|i| put(i, cap / norm * impulses[i], impulses, &mut change, &mut moved));
                }
            }
        }
    }

    /// Energy-weighted square of the natural map, Σ K_ii r_i² (J).
    pub fn merit(&self, impulses: &[f64], arguments: &[f64]) -> f64 {
        let one = |i: usize| {
            let (normal, tangent) = (arguments[2 * i].max(0.0), arguments[2 * i + 1]);
            let tangent = cone::friction_f64(tangent, self.friction[i] * normal);
            let r = [impulses[2 * i] - normal, impulses[2 * i + 1] - tangent];
            self.diagonal(2 * i) * r[0] * r[0] + self.diagonal(2 * i + 1) * r[1] * r[1]
        };
        let contacts = (0..self.points.len()).map(one).sum::<f64>();
        let joint = |(i, state): (usize, State)| {
            let within = if let State::Fixed(value) = state { value } else { arguments[i] };
            self.diagonal(i) * (impulses[i] - within).powi(2)
        };
        contacts + self.joint_states(arguments).map(joint).sum::<f64>()
    }

    /// The merit at which residuals are this fraction of the impulses.
    pub fn goal(&self, impulses: &[f64], tolerance: f64) -> f64 {
        let one = |(i, l): (usize, &f64)| self.diagonal(i) * l * l;
        tolerance * tolerance * impulses.iter().enumerate().map(one).sum::<f64>()
    }

    /// States of all rows.
    pub fn states(&self, arguments: &[f64]) -> Vec<State> {
        let one = |i: usize| {
            let (normal, tangent, friction) = (arguments[2 * i], arguments[2 * i + 1], self.friction[i]);
            if normal <= 0.0 {
                [State::Fixed(0.0); 2]
            } else if tangent.abs() < friction * normal {
                [State::Holds; 2]
            } else {
                [State::Holds, State::Slips(friction.copysign(tangent))]
            }
        };
        let joints = self.joint_states(arguments).map(|(_, state)| state);
        (0..self.points.len()).flat_map(one).chain(joints).collect()
    }

    /// Joint rows and their states: holding, or fixed at the nearest impulse within the bounds.
    fn joint_states(&self, arguments: &[f64]) -> impl Iterator<Item = (usize, State)> {
        let first = 2 * self.points.len();
        let mut scale = 1.0;
        self.bounds.iter().enumerate().map(move |(k, bound)| {
            let i = first + k;
            if let Bound::Norm { cap, size } = *bound {
                let norm = arguments[i..i + size].iter().map(|x| x * x).sum::<f64>().sqrt();
                scale = if norm > cap { cap / norm } else { 1.0 };
            }
            let state = match bound {
                Bound::NotNegative if arguments[i] <= 0.0 => State::Fixed(0.0),
                Bound::Norm { .. } | Bound::Same if scale < 1.0 => State::Fixed(scale * arguments[i]),
                _ => State::Holds,
            };
            (i, state)
        })
    }

    /// The impulses at which the holding rows are at rest. `None` if the system is singular.
    ///
    /// Let P be the holding rows and Q the directions in which their impulses act (a slipping point acts
    /// along n + s µ t), both scaled to unit masses and a unit diagonal. Let T = R + ε be their own softness.
    /// Then (P Qᵀ + T) y = b, and with the velocity change z = Qᵀ y,
    ///
    /// ```text
    /// y = T⁻¹ (b − P z)        (1 + Qᵀ T⁻¹ P) z = Qᵀ T⁻¹ b
    /// ```
    ///
    /// The second system has three rows per body, however many points the body has, and couples bodies that
    /// touch. T⁻¹ magnifies rounding errors by 1/ε, so the system is solved again for the residual,
    /// b − (P Qᵀ + T) y.
    pub fn solve_states(&self, states: &[State], system: &mut BlockLu<3>) -> Option<Vec<f64>> {
        let mut impulses: Vec<f64> =
            states.iter().map(|state| if let State::Fixed(value) = state { *value } else { 0.0 }).collect();
        let change: Vec<f64> = self.start.iter().zip(&impulses).map(|(l, fixed)| l - fixed).collect();
        let pushed = self.times(&change);
        let held: Vec<HeldRow> = (0..states.len())
            .filter(|&i| states[i] == State::Holds)
            .map(|i| {
                let scale = 1.0 / self.diagonal(i).sqrt();
                let row = self.rows[i];
                let slope = if let Some(State::Slips(slope)) = states.get(i + 1) { *slope } else { 0.0 };
                let along = |side: usize, c: usize| {
                    row.jacobian[side][c]
                        + if slope == 0.0 { 0.0 } else { slope * self.rows[i + 1].jacobian[side][c] }
                };
                HeldRow {
                    at: i,
                    slope,
                    scale,
                    seen: Row { jacobian: row.jacobian.map(|j| j.map(|x| scale * x)), ..row },
                    acts: Row { jacobian: [0, 1].map(|s| [0, 1, 2].map(|c| scale * along(s, c))), ..row },
                    b: scale * (pushed[i] - self.velocity[i]) + SHIFT * self.start[i] / scale,
                }
            })
            .collect();
        let groups = self.groups(&held)?;
        system.clear();
        let one = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        (0..self.movable).for_each(|body| system.add(body, body, one));
        for group in &groups {
            // Rows of a group share their bodies.
            let (members, movable) = (&held[group.first..][..group.size], held[group.first].seen.movable);
            for (to, from) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                if movable[to] == IMMOVABLE || movable[from] == IMMOVABLE {
                    continue;
                }
                let mut block = [[0.0; 3]; 3];
                for (q, weights) in members.iter().zip(&group.inverse) {
                    let mut softened = [0.0; 3];
                    for (p, t) in members.iter().zip(weights) {
                        (0..3).for_each(|c| softened[c] += t * p.seen.jacobian[from][c]);
                    }
                    for (row, q) in block.iter_mut().zip(q.acts.jacobian[to]) {
                        (0..3).for_each(|c| row[c] += q * softened[c]);
                    }
                }
                system.add(movable[to], movable[from], block);
            }
        }
        if !system.factorize() {
            return None;
        }
        // T⁻¹ x or T x
        let soften = |x: &[f64], of: fn(&HeldGroup) -> &[[f64; 3]; 3]| {
            let mut y = vec![0.0; x.len()];
            for group in &groups {
                let members = group.first..group.first + group.size;
                for (y, t) in y[members.clone()].iter_mut().zip(of(group)) {
                    *y = t.iter().zip(&x[members.clone()]).map(|(t, x)| t * x).sum();
                }
            }
            y
        };
        // Qᵀ x
        let act = |x: &[f64]| {
            let mut z = vec![[0.0; 3]; self.movable];
            held.iter().zip(x).for_each(|(row, x)| row.acts.push(&mut z, *x));
            z
        };
        let mut y = vec![0.0; held.len()];
        let mut left: Vec<f64> = held.iter().map(|row| row.b).collect();
        for _ in 0..PASSES {
            let mut z = act(&soften(&left, |group| &group.inverse));
            system.solve(&mut z);
            let rest: Vec<f64> = held.iter().zip(&left).map(|(row, b)| b - row.seen.dot(&z)).collect();
            y.iter_mut().zip(soften(&rest, |group| &group.inverse)).for_each(|(y, dy)| *y += dy);
            let (moved, given) = (act(&y), soften(&y, |group| &group.softness));
            let remains = |(row, t): (&HeldRow, f64)| row.b - row.seen.dot(&moved) - t;
            left = held.iter().zip(given).map(remains).collect();
        }
        for (row, y) in held.iter().zip(&y) {
            impulses[row.at] = y * row.scale;
            if row.slope != 0.0 {
                impulses[row.at + 1] = row.slope * impulses[row.at];
            }
        }
        Some(impulses)
    }

    /// T of the holding rows: ε, and R of joints. `None` if it is singular.
    fn groups(&self, held: &[HeldRow]) -> Option<Vec<HeldGroup>> {
        let mut groups = vec![];
        let (mut first, mut joints) = (0, self.joints.iter());
        while let Some(row) = held.get(first) {
            let joint = if row.at < 2 * self.points.len() {
                JointSoftness { first: row.at, size: 1, r: [[0.0; 3]; 3] }
            } else {
                *joints.find(|joint| row.at < joint.first + joint.size)?
            };
            let members = &held[first..];
            let size = members.iter().take_while(|row| row.at < joint.first + joint.size).count();
            let mut group = HeldGroup { first, size, softness: [[0.0; 3]; 3], inverse: [[0.0; 3]; 3] };
            for (r, c) in (0..size).flat_map(|r| (0..size).map(move |c| (r, c))) {
                let entry = joint.r[members[r].at - joint.first][members[c].at - joint.first];
                let shift = if r == c { SHIFT } else { 0.0 };
                group.softness[r][c] = shift + members[r].scale * entry * members[c].scale;
            }
            if size == 1 {
                group.inverse[0][0] = 1.0 / group.softness[0][0];
            } else {
                let mut padded = group.softness;
                (size..3).for_each(|k| padded[k][k] = 1.0);
                group.inverse = inverse(padded)?;
            }
            first += size;
            groups.push(group);
        }
        Some(groups)
    }

    /// The impulses of the same law by Lemke's method, see
    /// [`crate::constraints::numerics::coulomb_lcp`]. Only for islands without joints.
    pub fn by_lemke(&self) -> Option<Vec<f64>> {
        if !self.bounds.is_empty() {
            return None;
        }
        let n = self.start.len();
        let pair = |f: &dyn Fn(usize) -> f64| (0..n).step_by(2).map(|i| [f(i), f(i + 1)]).collect::<Vec<_>>();
        // u without impulses, shifted toward λ₀ as in Newton's problem.
        let pushed = self.times(&self.start);
        let free = |i: usize| self.velocity[i] - pushed[i] - SHIFT * self.diagonal(i) * self.start[i];
        let entry = |i: usize, j: usize| {
            let shift = if i == j { 1.0 + SHIFT } else { 1.0 };
            shift * self.rows[i].coupling(&self.rows[j])
        };
        let lcp = CoulombLcp::new(&self.friction, &pair(&|i| self.diagonal(i)), &pair(&free), entry);
        let found = lcp.solve(&vec![1.0; lcp.rows()], PIVOTS * lcp.rows()).ok()?;
        Some(found.into_flattened())
    }
}
