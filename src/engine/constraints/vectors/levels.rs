//! A coarse contact problem: the total load on each level of the contact graph, solved exactly.
//!
//! # Derivation
//!
//! A sweep passes a load on by one contact, so a column of n bodies takes about n² sweeps. But the weight
//! of all bodies above a level is one force and one moment, which the contacts of that level share. So
//! let the bodies of an island above level l move as one, with the velocity field of a rigid motion U_m:
//! along x, along y, or turning. The impulses that resist it are
//!
//! ```text
//! δλ = Σ_m α_lm p_lm,   p_lm = J U_m   in the rows of level l that are at work,   0 elsewhere
//! ```
//!
//! Rows at work are normal rows with an impulse or an approaching velocity, and tangential rows inside
//! their cone. The best α of all levels together minimizes the energy ½ δλᵀ K δλ + δλᵀ u (Galerkin):
//!
//! ```text
//! (Pᵀ K P) α = −Pᵀ u,   K = J M⁻¹ Jᵀ
//! ```
//!
//! Impulses of level l act on bodies of levels l and l − 1, so the matrix is block tridiagonal with three
//! rows per level. Factorizing it takes time linear in the number of levels. In a column, it is the whole
//! problem. The change is clamped to the cones, and skipped if it would not lower the energy.
//!
//! # Places
//!
//! Relative positions of contacts follow from their arms, r = (r × n) t − (r × t) n, from body to body.
//! Places are positions within an island, whose bodies touch each other. The ground is not part of any
//! island.

use crate::constraints::numerics::envelope::Envelope;
use crate::constraints::records::graph::{Graph, UNSUPPORTED};
use crate::constraints::vectors::system::{Pair, PointRows, System};
use crate::lanes::held;

/// Rigid motions in the plane.
const MODES: usize = 3;
/// Relative shift of the diagonal: motions that no contact of a level resists are not corrected.
const SHIFT: f64 = 1e-9;
/// Fraction of its bound at which a tangential impulse counts as sliding (1).
const STICKS: f32 = 1.0 - 1e-6;

/// The coarse problem of a step. Keeps its memory between steps.
#[derive(Clone, Debug, Default)]
pub struct Levels {
    points: Vec<LevelPoint>,
    /// Rows of all points, and the index of the first one of each contact.
    rows: Vec<PointRows>,
    first: Vec<usize>,
    /// Level below each body, numbered across all islands, and position of each body in its island (m).
    own: Vec<usize>,
    places: Vec<[f64; 2]>,
    queue: Vec<u32>,
    /// First level of each island, then the number of levels.
    begins: Vec<usize>,
    inverse: Vec<[f64; 3]>,
    envelope: Envelope,
    /// Right-hand side of the levels, then α.
    right: Vec<f64>,
    /// Jᵀ p on each body, for the modes of the level below it and of the level above it.
    pushes: Vec<[[[f64; 3]; MODES]; 2]>,
    moved: Vec<[f64; 3]>,
    impulses: Vec<Pair>,
    velocities: Vec<Pair>,
    surfaces: Vec<Pair>,
    delta: Vec<Pair>,
}

/// A contact point between two levels.
#[derive(Clone, Copy, Debug)]
struct LevelPoint {
    rows: PointRows,
    /// Its level, numbered across all islands.
    level: usize,
    /// Side of the upper body.
    above: usize,
    /// p of its two rows.
    weights: [[f64; MODES]; 2],
}

/// A body in no island, or a contact without points.
const NONE: usize = usize::MAX;

impl Levels {
    /// Finds the levels of a step. `bias` maps a separation (m) to a bias velocity (m/s).
    pub fn begin(&mut self, system: &mut System<'_>, graph: &Graph, bias: impl Fn(f32) -> f32) {
        self.inverse.clear();
        self.inverse
            .extend(system.rows().iter().map(|r| [r.velocity[3], r.velocity[3], r.delta[3]].map(f64::from)));
        system.gaps_and_friction(&mut self.surfaces);
        self.surfaces.iter_mut().for_each(|surface| surface[0] = bias(surface[0]));
        self.rows.clear();
        self.rows.extend(system.point_rows());
        self.first.clear();
        self.first.resize(graph.len(), NONE);
        for (i, row) in self.rows.iter().enumerate().rev() {
            self.first[row.at / 2] = i;
        }
        self.find_islands(graph);
        self.find_points(graph);
        self.delta.clear();
        self.delta.resize(system.len(), [0.0; 2]);
    }

    /// Whether no contact connects two levels.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Finds islands, places, and the first level of each island.
    fn find_islands(&mut self, graph: &Graph) {
        let levels = graph.levels();
        let stands = |body: u32| levels.get(body as usize).is_some_and(|&l| l != 0 && l != UNSUPPORTED);
        self.own.clear();
        self.own.resize(levels.len(), NONE);
        self.places.clear();
        self.places.resize(levels.len(), [0.0; 2]);
        self.begins.clear();
        self.begins.push(0);
        for &seed in graph.upwards() {
            if self.own[seed as usize] != NONE {
                continue;
            }
            let begin = *self.begins.last().expect("the first one");
            let level_of = |body: u32| begin + levels[body as usize] as usize - 1;
            self.own[seed as usize] = level_of(seed);
            self.queue.clear();
            self.queue.push(seed);
            let (mut next, mut highest) = (0, 0);
            while let Some(&body) = self.queue.get(next) {
                next += 1;
                highest = highest.max(levels[body as usize] as usize);
                for &edge in graph.edges_of(body as usize) {
                    let ends = graph.ends(edge as usize);
                    let side = usize::from(ends[1] == body);
                    let other = ends[1 - side];
                    let first = self.first[edge as usize];
                    if first != NONE && stands(other) && self.own[other as usize] == NONE {
                        let [here, there] = [side, 1 - side].map(|side| arm(&self.rows[first], side));
                        let place = self.places[body as usize];
                        self.places[other as usize] = [0, 1].map(|k| place[k] + here[k] - there[k]);
                        self.own[other as usize] = level_of(other);
                        self.queue.push(other);
                    }
                }
            }
            self.begins.push(begin + highest);
        }
    }

    /// Finds the points between two levels, and their rows of P.
    fn find_points(&mut self, graph: &Graph) {
        let level_of = |body: u32| graph.levels().get(body as usize).map_or(0, |&level| level);
        let count = *self.begins.last().unwrap_or(&0);
        // Sum of the places of the points of each level, and their number.
        let mut sums = std::mem::take(&mut self.moved);
        sums.clear();
        sums.resize(count, [0.0; 3]);
        self.points.clear();
        for row in &self.rows {
            let at = row.bodies.map(level_of);
            let above = usize::from(at[1] > at[0]);
            if at.contains(&UNSUPPORTED) || at[above] != at[1 - above] + 1 {
                continue;
            }
            let body = row.bodies[above] as usize;
            let level = self.own[body];
            let (place, arm) = (self.places[body], arm(row, above));
            let place = [place[0] + arm[0], place[1] + arm[1]];
            sums[level] = [sums[level][0] + place[0], sums[level][1] + place[1], sums[level][2] + 1.0];
            let weights = [[place[0], place[1], 0.0], [0.0; MODES]];
            self.points.push(LevelPoint { rows: *row, level, above, weights });
        }
        for point in &mut self.points {
            let [x, y, number] = sums[point.level];
            let [px, py, _] = point.weights[0];
            let from = [px - x / number, py - y / number];
            let sign = if point.above == 1 { 1.0 } else { -1.0 };
            point.weights = point.rows.axes.map(|axis| {
                let axis = axis.map(f64::from);
                [axis[0], axis[1], from[0] * axis[1] - from[1] * axis[0]].map(|w| sign * w)
            });
        }
        self.moved = sums;
    }

    /// Corrects all levels once, and updates impulses and velocities.
    pub fn correct(&mut self, system: &mut System<'_>) {
        system.impulses(&mut self.impulses);
        system.relative_velocities(&mut self.velocities);
        self.velocities.iter_mut().zip(&self.surfaces).for_each(|(u, surface)| u[0] += surface[0]);
        if !self.assemble() {
            return;
        }
        self.moved.clear();
        self.moved.resize(self.inverse.len(), [0.0; 3]);
        self.delta.fill([0.0; 2]);
        let mut energy = 0.0;
        for point in &self.points {
            let at = point.rows.at;
            let ([old_n, old_t], friction) = (self.impulses[at], self.surfaces[at][1]);
            let alpha = &self.right[MODES * point.level..][..MODES];
            let along =
                |axis: usize| (0..MODES).map(|m| alpha[m] * point.weights[axis][m]).sum::<f64>() as f32;
            let works = self.works(at);
            let normal = if works[0] { (old_n + along(0)).max(0.0) } else { old_n };
            let bound = friction * normal;
            let tangent = if works[1] { old_t + along(1) } else { old_t };
            let new = [normal, tangent.min(bound).max(-bound)];
            let delta = [new[0] - old_n, new[1] - old_t];
            self.delta[at] = delta;
            self.impulses[at] = new;
            for (axis, delta) in delta.map(f64::from).into_iter().enumerate() {
                energy += delta * f64::from(self.velocities[at][axis]);
                for side in 0..2 {
                    let j = point.rows.on(side, axis);
                    if let Some(moved) = self.moved.get_mut(point.rows.bodies[side] as usize) {
                        (0..3).for_each(|k| moved[k] += j[k] * delta);
                    }
                }
            }
        }
        for (moved, inverse) in self.moved.iter().zip(&self.inverse) {
            energy += 0.5 * (0..3).map(|k| inverse[k] * moved[k] * moved[k]).sum::<f64>();
        }
        if energy < 0.0 {
            system.set_impulses(&self.impulses);
            system.apply(&self.delta);
        }
    }

    /// Which rows of a point are at work.
    fn works(&self, at: usize) -> [bool; 2] {
        let ([normal, tangent], [un, _]) = (self.impulses[at], self.velocities[at]);
        [normal > 0.0 || un < 0.0, tangent.abs() < STICKS * self.surfaces[at][1] * normal]
    }

    /// Solves for α, into `right`. Returns `false` if the matrix is not positive definite.
    fn assemble(&mut self) -> bool {
        let count = *self.begins.last().unwrap_or(&0);
        self.right.clear();
        self.right.resize(MODES * count, 0.0);
        self.pushes.clear();
        self.pushes.resize(self.inverse.len(), [[[0.0; 3]; MODES]; 2]);
        for point in &self.points {
            let works = self.works(point.rows.at);
            for axis in (0..2).filter(|&axis| works[axis]) {
                let u = f64::from(self.velocities[point.rows.at][axis]);
                let weights = point.weights[axis];
                let right = &mut self.right[MODES * point.level..][..MODES];
                right.iter_mut().zip(weights).for_each(|(to, weight)| *to -= weight * u);
                for side in 0..2 {
                    // The upper body is pushed by the level below it, the lower one by the level above it.
                    let from = usize::from(side != point.above);
                    let j = point.rows.on(side, axis);
                    if let Some(pushes) = self.pushes.get_mut(point.rows.bodies[side] as usize) {
                        for m in 0..MODES {
                            (0..3).for_each(|k| pushes[from][m][k] += j[k] * weights[m]);
                        }
                    }
                }
            }
        }
        let begins = &self.begins;
        self.envelope.begin::<MODES, _>(count, |level| {
            // The levels of an island form a chain.
            let after = begins.partition_point(|&begin| begin <= level);
            let (first, end) = (begins[after - 1], begins[after]);
            level.saturating_sub(1).max(first)..(level + 2).min(end)
        });
        let mut diagonal = std::mem::take(&mut self.moved);
        diagonal.clear();
        diagonal.resize(count, [0.0; MODES]);
        for (body, (pushes, inverse)) in self.pushes.iter().zip(&self.inverse).enumerate() {
            let Some(&own) = self.own.get(body).filter(|&&own| own != NONE) else { continue };
            let product = |s: usize, t: usize| -> [[f64; MODES]; MODES] {
                pushes[s].map(|x| pushes[t].map(|y| (0..3).map(|k| x[k] * inverse[k] * y[k]).sum()))
            };
            for (from, level) in [own, own + 1].into_iter().enumerate() {
                if pushes[from] != [[0.0; 3]; MODES] {
                    let block = product(from, from);
                    self.envelope.add_block::<MODES>(level, level, block);
                    (0..MODES).for_each(|m| diagonal[level][m] += block[m][m]);
                }
            }
            if pushes.iter().all(|pushes| *pushes != [[0.0; 3]; MODES]) {
                self.envelope.add_block::<MODES>(own, own + 1, product(0, 1));
            }
        }
        for (level, diagonal) in diagonal.iter().enumerate() {
            let mut shift = [[0.0; MODES]; MODES];
            (0..MODES).for_each(|m| shift[m][m] = if diagonal[m] > 0.0 { SHIFT * diagonal[m] } else { 1.0 });
            self.envelope.add_block::<MODES>(level, level, shift);
        }
        self.moved = diagonal;
        let is_regular = self.envelope.factorize(f64::MIN_POSITIVE);
        if is_regular {
            self.envelope.substitute(&mut self.right);
        }
        is_regular
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.points) + held(&self.rows) + held(&self.pushes)
    }
}

/// r of a point on body `side` (m).
fn arm(row: &PointRows, side: usize) -> [f64; 2] {
    let [n, t] = row.axes.map(|axis| axis.map(f64::from));
    let [along_n, along_t] = row.arms.map(|arms| f64::from(arms[side]));
    [0, 1].map(|k| along_n * t[k] - along_t * n[k])
}
