//! The block tridiagonal system of all chains, in lanes.
//!
//! # Partition
//!
//! The n links of a scene, chain after chain, are divided into eight runs of m links, one for each lane. The
//! blocks of a link are D (diagonal, K_ii), C (to the next link) and E (to the last link of the lane before).
//! E is at first that of the lane's first link; elimination fills in the others. Each lane eliminates all of
//! its links but the last, in the order of their run (`wang1981`):
//!
//! ```text
//! X = D⁻¹ C,   Y = D⁻¹ E,   z = D⁻¹ b
//! D' ← D' − Cᵀ X,     E' = −Cᵀ Y,     b' ← b' − Cᵀ z         of the next link
//! D'' ← D'' − Eᵀ Y,                   b'' ← b'' − Eᵀ z       of the last link of the lane before
//! ```
//!
//! and, once the last links are known, λ = z − X λ' − Y λ''.
//!
//! # Last links
//!
//! The remaining system has one link per lane. It is solved by cyclic reduction in three steps
//! (`hockney1965`). With F the block to the lane d after, which is the transposed E of that lane, and p, q
//! the lanes d before and d after,
//!
//! ```text
//! D ← D − E D_p⁻¹ Eᵀ − F D_q⁻¹ Fᵀ,     b ← b − E D_p⁻¹ b_p − F D_q⁻¹ b_q,     E ← −E D_p⁻¹ E_p       d = 1, 2, 4
//! ```
//!
//! Both need an invertible D. K is positive definite, and so are its Schur complements. The order of
//! operations is that of the links, so the result has the same bits at any width of the step. A row that
//! moves nothing, or is not in use, has 1 on the diagonal and no impulse.
//!
//! A link of two rows takes about 110 multiplications, eight of them at a time. The longest chain of
//! dependent operations is m inverses of D.

mod apparent;
mod blocks;

use crate::constraints::joints::rows::dot;
use crate::constraints::kernels::frame::{VX, VY, W};
use crate::constraints::records::links::{LINK_LANES, LinkGroups, LinkImpulses, LinkRows};
use crate::lanes::{BodyRow, Indices, LaneIndex, Lanes};
use apparent::Apparent;
use blocks::{Factor, LaneMatrix, LaneVector, down, each, less, minus, reduce, transposed, up};
use std::collections::BTreeMap;
use wide::f32x8;

/// The links of all chains.
#[derive(Clone, Debug, Default)]
pub struct ChainSystem {
    /// Number of links of all chains.
    links: usize,
    /// Links per lane, m.
    groups: usize,
    /// Rows per link.
    size: usize,
    rows: LinkRows,
    impulses: LinkImpulses,
    /// Body R of each slot, or the inert one. `[groups × lanes]`
    bodies: Indices,
    /// Velocity of body R when its chain was last solved (m/s, rad/s). `[groups]`
    velocities: Vec<[f32x8; 3]>,
    /// I⁻¹ Σ r·λ over the hinges of body R in this substep (1/s). `[groups]`
    pulls: Vec<f32x8>,
    /// 1 + e of body R. `[groups]`
    slowing: Vec<f32x8>,
    /// Whether some of them are above 1.
    any_slowed: bool,
    apparent: Apparent,
    /// Chain of each slot. `[groups × lanes]`
    chains: Vec<u32>,
    /// Whether a chain has been moved since it was solved. `[chains]`
    moved: Vec<bool>,
    any_moved: bool,
    /// 1 for links that are their whole chain, otherwise 0. `[groups]`
    alone: Vec<f32x8>,
    /// ¼ h ω² of the bodies R of these links (1/s), otherwise 0. `[groups]`
    turning: Vec<f32x8>,
    /// 1 for links that are solved now, otherwise 0. `[groups]`
    taken: Vec<f32x8>,
    /// X, Y and z of each link: 2 size² + size numbers.
    eliminated: LinkGroups<f32x8>,
}

/// γ (1).
const GIVE: f32 = 3e-5;

/// Which solve of a substep; see `chains`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChainStage {
    /// Before the sweeps: all chains.
    Begin,
    /// After the sweeps: chains that they have moved.
    Again,
    /// After the relaxing sweeps: the same chains, without errors.
    Relax,
}

impl ChainSystem {
    /// Allocates memory for `links` links of at most `size` rows.
    pub fn begin(&mut self, links: usize, size: usize) {
        // A single row is solved as two.
        let size = size.max(2);
        let groups = links.div_ceil(LINK_LANES);
        (self.links, self.groups, self.size) = (links, groups, size);
        self.apparent.begin(groups);
        self.rows.begin(5 * size + 4, groups);
        self.impulses.begin(size, groups);
        self.velocities.clear();
        self.velocities.resize(groups, [f32x8::ZERO; 3]);
        let zeros = [&mut self.pulls, &mut self.alone, &mut self.turning].map(|list| (list, 0.0));
        let ones = [&mut self.slowing, &mut self.taken].map(|list| (list, 1.0));
        for (list, value) in zeros.into_iter().chain(ones) {
            list.clear();
            list.resize(groups, f32x8::splat(value));
        }
        self.chains.clear();
        self.chains.resize(groups * LINK_LANES, 0);
        self.moved.clear();
        self.eliminated.begin(2 * size * size + size, groups);
    }

    /// Slot of link `i`.
    pub fn slot(&self, i: usize) -> usize {
        i % self.groups * LINK_LANES + i / self.groups
    }

    /// Sets the number of links of each chain, from the first link on.
    pub fn set_chains(&mut self, counts: impl Iterator<Item = usize>) {
        let mut i = 0;
        for (chain, count) in counts.enumerate() {
            for _ in 0..count {
                let slot = self.slot(i);
                self.chains[slot] = chain as u32;
                let alone = if count == 1 { 1.0 } else { 0.0 };
                self.alone[slot / LINK_LANES].as_mut_array()[slot % LINK_LANES] = alone;
                i += 1;
            }
            self.moved.push(false);
        }
    }

    /// Sets body R of each slot.
    pub fn set_bodies(&mut self, bodies: &[u32]) {
        self.bodies.clear();
        self.bodies.extend(bodies);
    }

    /// Notes the present velocities as those after a solve.
    pub fn note(&mut self, rows: &[BodyRow]) {
        for k in 0..self.groups {
            let velocity = velocity_of(rows, self.bodies_of(k));
            self.velocities[k] = [velocity[VX], velocity[VY], velocity[W]];
        }
    }

    /// Bodies R that move, with their pull and their spin after the last solve.
    pub fn kept(&self, moves: impl Fn(usize) -> bool) -> Vec<[f64; 3]> {
        let of = |(slot, &body): (usize, &u32)| {
            let (k, lane) = (slot / LINK_LANES, slot % LINK_LANES);
            [
                body.into(),
                self.pulls[k].as_array()[lane].into(),
                self.velocities[k][2].as_array()[lane].into(),
            ]
        };
        self.bodies.iter().enumerate().filter(|&(_, &body)| moves(body as usize)).map(of).collect()
    }

    /// Takes the numbers of [`Self::kept`] for the bodies that are in both systems.
    pub fn set_kept(&mut self, kept: &[[f64; 3]]) {
        let kept: BTreeMap<u32, [f64; 2]> =
            kept.iter().map(|&[body, pull, spin]| (body as u32, [pull, spin])).collect();
        for (slot, body) in self.bodies.iter().enumerate() {
            if let Some(&[pull, spin]) = kept.get(body) {
                let (k, lane) = (slot / LINK_LANES, slot % LINK_LANES);
                self.pulls[k].as_mut_array()[lane] = pull as f32;
                self.velocities[k][2].as_mut_array()[lane] = spin as f32;
            }
        }
    }

    /// Number of slots: links, and lanes without one.
    pub fn slots(&self) -> usize {
        self.groups * LINK_LANES
    }

    /// Whether there are no links.
    pub fn is_empty(&self) -> bool {
        self.groups == 0
    }

    /// The rows, which the joint types fill.
    pub fn rows(&mut self) -> &mut LinkRows {
        &mut self.rows
    }

    /// The impulses after [`Self::solve`].
    pub fn impulses(&self) -> &LinkImpulses {
        &self.impulses
    }

    /// Begins a substep of `h` (s) with zero impulses. Slows the bodies that the impulses of the last substep
    /// pull straight.
    pub fn begin_substep(&mut self, rows: &mut [BodyRow], h: f32) {
        self.impulses.clear();
        if std::mem::replace(&mut self.any_moved, false) {
            self.taken.fill(f32x8::ONE);
            self.moved.fill(false);
        }
        self.any_slowed = false;
        for k in 0..self.groups {
            let x = f32x8::splat(h) * std::mem::replace(&mut self.pulls[k], f32x8::ZERO);
            self.slowing[k] = x.max(f32x8::ONE);
            let (is_slowed, alone) = (x.simd_gt(f32x8::ONE).any(), self.alone[k]);
            if !is_slowed && !alone.simd_gt(f32x8::ZERO).any() {
                continue;
            }
            let bodies = self.bodies.list().batch(k);
            let mut velocity = velocity_of(rows, bodies);
            // Contacts or callers may have stopped the body since.
            let [.., before] = self.velocities[k];
            let slower = before.abs().min(velocity[W].abs());
            self.turning[k] = alone * f32x8::splat(0.25 * h) * slower * slower;
            if !is_slowed {
                continue;
            }
            self.any_slowed = true;
            velocity[W] /= self.slowing[k];
            f32x8::scatter_velocity(rows, bodies, velocity);
        }
    }

    /// Finds the chains in which a body has changed its velocity since they were solved. Only these are
    /// solved in the rest of this substep.
    pub fn find_moved(&mut self, rows: &[BodyRow]) {
        for k in 0..self.groups {
            let velocity = velocity_of(rows, self.bodies_of(k));
            let [x, y, w] = self.velocities[k];
            let same = velocity[VX].simd_eq(x) & velocity[VY].simd_eq(y) & velocity[W].simd_eq(w);
            if same.all() {
                continue;
            }
            self.any_moved = true;
            for lane in (0..LINK_LANES).filter(|lane| (same.to_bitmask() >> lane) & 1 == 0) {
                self.moved[self.chains[k * LINK_LANES + lane] as usize] = true;
            }
        }
        if self.any_moved {
            for (taken, chains) in self.taken.iter_mut().zip(self.chains.as_chunks::<LINK_LANES>().0) {
                *taken = f32x8::new(chains.map(|chain| if self.moved[chain as usize] { 1.0 } else { 0.0 }));
            }
        }
    }

    /// Whether [`Self::find_moved`] has found any.
    pub fn any_moved(&self) -> bool {
        self.any_moved
    }

    /// Finds the missing impulses and applies them to bodies.
    pub fn solve(&mut self, rows: &mut [BodyRow], stage: ChainStage) {
        match self.size {
            2 => self.solve_rows::<2>(rows, stage),
            _ => self.solve_rows::<3>(rows, stage),
        }
    }

    /// Divides the inverse inertias of bodies by 1 + e.
    fn slow<const N: usize>(&mut self) {
        let (last, [of_left, of_right]) = (self.groups - 1, [5 * N + 2, 5 * N + 3]);
        for (k, &slowing) in self.slowing.iter().enumerate() {
            self.rows.group_mut(k)[of_right] /= slowing;
            // 1 where there is no lane before.
            let of_first = || f32x8::ONE + up::<1>(slowing - f32x8::ONE);
            let (next, slowing) = if k < last { (k + 1, slowing) } else { (0, of_first()) };
            self.rows.group_mut(next)[of_left] /= slowing;
        }
    }

    /// Diagonal block and right side of a link.
    #[inline(always)]
    fn diagonal<const N: usize>(
        &self,
        k: usize,
        link: &Link<N>,
        stage: ChainStage,
    ) -> (LaneMatrix<N>, LaneVector<N>) {
        let (matrix, mut b) = link.diagonal();
        let turning = self.turning[k];
        if stage != ChainStage::Relax && turning.simd_gt(f32x8::ZERO).any() {
            let [x, y] = link.arm(1);
            (b[0], b[1]) = (turning.mul_add(x, b[0]), turning.mul_add(y, b[1]));
        }
        if stage == ChainStage::Again {
            // γ K_ii λ; the block is (1 + γ) K_ii.
            let share = f32x8::splat(GIVE / (1.0 + GIVE));
            for (b, row) in b.iter_mut().zip(&matrix) {
                for (&k_rc, &impulse) in row.iter().zip(self.impulses.group(k)) {
                    *b = (share * k_rc).mul_neg_add(impulse, *b);
                }
            }
        }
        (matrix, each(b, |b| b * self.taken[k]))
    }

    fn solve_rows<const N: usize>(&mut self, rows: &mut [BodyRow], stage: ChainStage) {
        if self.has_effective_mass_scaling() {
            self.take_whole_masses();
        }
        if self.any_slowed {
            self.slow::<N>();
        }
        // No chain has a second link.
        if self.moved.len() == self.links {
            for k in 0..self.groups {
                let here = Link::<N>::of(self.rows.group(k));
                let (matrix, b) = self.diagonal(k, &here, stage);
                let impulse = Factor::of(matrix).solve(b);
                self.impulses.add(k, &impulse);
                self.give(k, [&here, &Link::none()], [&impulse, &[f32x8::ZERO; N]], rows);
            }
            return;
        }
        let last = self.groups - 1;
        let first = Link::<N>::of(self.rows.group(0));
        let end = Link::<N>::of(self.rows.group(last));
        let mut here = first;
        let (mut pivot, mut b) = self.diagonal(0, &here, stage);
        let mut e = transposed(end.shifted(up::<1>).coupling(&first));
        let (mut d_before, mut b_before) = ([[f32x8::ZERO; N]; N], [f32x8::ZERO; N]);
        for k in 0..last {
            let next = Link::<N>::of(self.rows.group(k + 1));
            let c = here.coupling(&next);
            let factor = Factor::of(pivot);
            let (x, y, z) = (factor.solve_each(c), factor.solve_each(e), factor.solve(b));
            let to = self.eliminated.group_mut(k);
            to[..N * N].copy_from_slice(x.as_flattened());
            to[N * N..2 * N * N].copy_from_slice(y.as_flattened());
            to[2 * N * N..].copy_from_slice(&z);
            let e_transposed = transposed(e);
            d_before = minus(d_before, &e_transposed, &y);
            b_before = less(b_before, &e_transposed, &z);
            let c = transposed(c);
            (pivot, b) = self.diagonal(k + 1, &next, stage);
            pivot = minus(pivot, &c, &x);
            b = less(b, &c, &z);
            e = minus([[f32x8::ZERO; N]; N], &c, &y);
            here = next;
        }
        for r in 0..N {
            b[r] += down::<1>(b_before[r]);
            for c in 0..N {
                pivot[r][c] += down::<1>(d_before[r][c]);
            }
        }
        reduce::<1, N>(&mut pivot, &mut e, &mut b);
        reduce::<2, N>(&mut pivot, &mut e, &mut b);
        reduce::<4, N>(&mut pivot, &mut e, &mut b);
        let of_end = Factor::of(pivot).solve(b);
        self.impulses.add(last, &of_end);
        let of_lane_before = each(of_end, up::<1>);
        let (mut next, mut impulse) = (end, of_end);
        for k in (0..last).rev() {
            let from = self.eliminated.group(k);
            let of_next = impulse;
            for r in 0..N {
                impulse[r] = from[2 * N * N + r];
                for c in 0..N {
                    impulse[r] = from[r * N + c].mul_neg_add(of_next[c], impulse[r]);
                    impulse[r] = from[N * N + r * N + c].mul_neg_add(of_lane_before[c], impulse[r]);
                }
            }
            self.impulses.add(k, &impulse);
            let here = Link::<N>::of(self.rows.group(k));
            self.give(k, [&here, &next], [&impulse, &of_next], rows);
            next = here;
        }
        // After the last links of the lanes come the first links of the next lanes.
        let (next, of_next) = (first.shifted(down::<1>), each(impulse, down::<1>));
        self.give(last, [&end, &next], [&of_end, &of_next], rows);
    }

    /// Applies the impulses of links, and of the links after them, to the bodies R of a group.
    #[inline(always)]
    fn give<const N: usize>(
        &mut self,
        k: usize,
        links: [&Link<N>; 2],
        given: [&LaneVector<N>; 2],
        rows: &mut [BodyRow],
    ) {
        self.velocities[k] = push(links, given, self.bodies_of(k), rows);
        let [here, next] = links;
        // No mass: an immovable body, or one of another chain.
        let hangs = next.mass[0].simd_gt(f32x8::ZERO);
        let pull = here.pull(1, given[0]) - hangs.select(next.pull(0, given[1]), f32x8::ZERO);
        self.pulls[k] += pull * here.inertia[1] * self.slowing[k];
    }

    fn bodies_of(&self, group: usize) -> LaneIndex<'_, [u32; LINK_LANES]> {
        self.bodies.list().batch(group)
    }
}

/// The links of a group.
#[derive(Clone, Copy)]
struct Link<const N: usize> {
    axis: [[f32x8; 2]; N],
    /// s_L and s_R.
    arms: [LaneVector<N>; 2],
    b: LaneVector<N>,
    /// Inverse masses and inertias of L and R.
    mass: [f32x8; 2],
    inertia: [f32x8; 2],
}

impl<const N: usize> Link<N> {
    #[inline(always)]
    fn none() -> Self {
        let (zero, none) = ([f32x8::ZERO; N], [f32x8::ZERO; 2]);
        Link { axis: [none; N], arms: [zero; 2], b: zero, mass: none, inertia: none }
    }

    #[inline(always)]
    fn of(numbers: &[f32x8]) -> Self {
        let mut link = Self::none();
        for r in 0..N {
            let at = |i: usize| numbers[5 * r + i];
            link.axis[r] = [at(0), at(1)];
            (link.arms[0][r], link.arms[1][r], link.b[r]) = (at(2), at(3), at(4));
        }
        let at = |i: usize| numbers[5 * N + i];
        (link.mass, link.inertia) = ([at(0), at(1)], [at(2), at(3)]);
        link
    }

    /// The links of the lane before, or after.
    #[inline(always)]
    fn shifted(mut self, by: impl Fn(f32x8) -> f32x8) -> Self {
        for r in 0..N {
            self.axis[r] = [by(self.axis[r][0]), by(self.axis[r][1])];
            (self.arms[0][r], self.arms[1][r]) = (by(self.arms[0][r]), by(self.arms[1][r]));
        }
        for side in 0..2 {
            (self.mass[side], self.inertia[side]) = (by(self.mass[side]), by(self.inertia[side]));
        }
        self
    }

    /// (1 + γ) K_ii and b.
    #[inline(always)]
    fn diagonal(&self) -> (LaneMatrix<N>, LaneVector<N>) {
        let gives = f32x8::splat(1.0 + GIVE);
        let ([left, right], mass) = (self.arms, self.mass[0] + self.mass[1]);
        let mut k = [[f32x8::ZERO; N]; N];
        let mut b = self.b;
        for r in 0..N {
            for c in 0..=r {
                let turning =
                    (self.inertia[0] * left[r]).mul_add(left[c], (self.inertia[1] * right[r]) * right[c]);
                k[r][c] = gives * mass.mul_add(dot(self.axis[r], self.axis[c]), turning);
                k[c][r] = k[r][c];
            }
            let moves = k[r][r].simd_gt(f32x8::ZERO);
            k[r][r] = moves.select(k[r][r], f32x8::ONE);
            b[r] = moves.select(b[r], f32x8::ZERO);
        }
        (k, b)
    }

    /// The arm r = (s_2, −s_1) of a side, in the frame of two perpendicular rows; 0 if there are none.
    #[inline(always)]
    fn arm(&self, side: usize) -> [f32x8; 2] {
        let ([d, e], arms) = ([self.axis[0], self.axis[1]], &self.arms[side]);
        let across = d[0].mul_add(e[1], -(d[1] * e[0]));
        [across * arms[1], -(across * arms[0])]
    }

    /// r·λ of a side.
    #[inline(always)]
    fn pull(&self, side: usize, given: &LaneVector<N>) -> f32x8 {
        dot(self.arm(side), [given[0], given[1]])
    }

    /// C, the block to the next link.
    #[inline(always)]
    fn coupling(&self, next: &Self) -> LaneMatrix<N> {
        let mut block = [[f32x8::ZERO; N]; N];
        for (r, row) in block.iter_mut().enumerate() {
            let turn = -(next.inertia[0] * self.arms[1][r]);
            for (c, entry) in row.iter_mut().enumerate() {
                let turning = turn * next.arms[0][c];
                *entry = next.mass[0].mul_neg_add(dot(self.axis[r], next.axis[c]), turning);
            }
        }
        block
    }
}

/// Velocities and inverse masses of bodies.
#[inline(always)]
fn velocity_of(rows: &[BodyRow], bodies: LaneIndex<[u32; LINK_LANES]>) -> [f32x8; 4] {
    f32x8::gather_quads::<2, 0>(bytemuck::cast_slice(rows), bodies)
}

/// Applies impulses to the bodies R of links: those of these links, and of the next ones, which hang from R.
/// Returns the velocities of R.
#[inline(always)]
fn push<const N: usize>(
    [here, next]: [&Link<N>; 2],
    [own, others]: [&LaneVector<N>; 2],
    bodies: LaneIndex<[u32; LINK_LANES]>,
    rows: &mut [BodyRow],
) -> [f32x8; 3] {
    let (mut of_own, mut of_others) = ([f32x8::ZERO; 3], [f32x8::ZERO; 3]);
    for r in 0..N {
        let [x, y] = here.axis[r];
        for (sum, j) in of_own.iter_mut().zip([x, y, here.arms[1][r]]) {
            *sum = j.mul_add(own[r], *sum);
        }
        let [x, y] = next.axis[r];
        for (sum, j) in of_others.iter_mut().zip([x, y, next.arms[0][r]]) {
            *sum = j.mul_add(others[r], *sum);
        }
    }
    let of_side = |link: &Link<N>, side: usize| [link.mass[side], link.mass[side], link.inertia[side]];
    let (here, next) = (of_side(here, 1), of_side(next, 0));
    let mut velocity = velocity_of(rows, bodies);
    for (k, v) in velocity[..3].iter_mut().enumerate() {
        let more = here[k] * of_own[k] - next[k] * of_others[k];
        *v += more;
    }
    f32x8::scatter_velocity(rows, bodies, velocity);
    [velocity[VX], velocity[VY], velocity[W]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Bodies begin at rest; b is the target speed of each row. The impulses of a row, one by one, change
        /// its speed by K_rr |λ_r|, and the rounding error is a fraction of that.
        #[test]
        fn rows_of_all_chains_hold_afterwards(
            size in 2usize..=3,
            links in 1usize..40,
            numbers in prop::collection::vec(-1.0f32..1.0, 40 * 20),
        ) {
            let mut system = ChainSystem::default();
            system.begin(links, size);
            let mut bodies = vec![links as u32; system.slots()];
            let mut rows = vec![BodyRow { velocity: [0.0; 4], delta: [0.0; 4] }; links + 1];
            let of = |i: usize| &numbers[20 * i..][..20];
            // One link in five begins a new chain. The masses of bodies differ up to a hundredfold.
            let begins = |i: usize| i == 0 || of(i)[0] > 0.6;
            let mass = |i: usize| [of(i)[1].abs() + 0.01, of(i)[2].abs() + 0.01];
            let row = |i: usize, r: usize| {
                let at = &of(i)[3 + 5 * r..][..5];
                // Rows of a joint differ in direction.
                let axis = if r < 2 { [[1.0, 0.5 * at[0]], [0.5 * at[1], 1.0]][r] } else { [0.0; 2] };
                [axis[0], axis[1], 0.5 * at[2] + r as f32, 0.5 * at[3] + r as f32, at[4]]
            };
            for i in 0..links {
                let slot = system.slot(i);
                bodies[slot] = i as u32;
                let left = if begins(i) { [0.0; 2] } else { mass(i - 1) };
                let masses = [left[0], mass(i)[0], left[1], mass(i)[1]];
                let group = system.rows().group_mut(slot / LINK_LANES);
                for (k, x) in (0..size).flat_map(|r| row(i, r)).chain(masses).enumerate() {
                    group[k].as_mut_array()[slot % LINK_LANES] = x;
                }
            }
            system.set_bodies(&bodies);
            let firsts: Vec<usize> = (0..=links).filter(|&i| i == links || begins(i)).collect();
            system.set_chains(firsts.windows(2).map(|pair| pair[1] - pair[0]));
            system.solve(&mut rows, ChainStage::Begin);
            for i in 0..links {
                let of_left = if begins(i) { [0.0; 4] } else { rows[i - 1].velocity };
                let of_masses = if begins(i) { [0.0; 2] } else { mass(i - 1) };
                let given = system.impulses().group(system.slot(i) / LINK_LANES);
                let mut made = 1.0_f32;
                for (r, impulse) in given.iter().enumerate() {
                    let [x, y, s_left, s_right, _] = row(i, r);
                    let turning = of_masses[1] * s_left * s_left + mass(i)[1] * s_right * s_right;
                    let k = (of_masses[0] + mass(i)[0]) * (x * x + y * y) + turning;
                    made += k * impulse.as_array()[system.slot(i) % LINK_LANES].abs();
                }
                for r in 0..size {
                    let [x, y, left, right, b] = row(i, r);
                    let speed = |v: [f32; 4], arm: f32| x * v[0] + y * v[1] + arm * v[2];
                    let off = speed(rows[i].velocity, right) - speed(of_left, left) - b;
                    prop_assert!(off.abs() < 3e-4 * made, "{size} rows, link {i} of {links}: {off} of {made}");
                }
            }
            prop_assert_eq!(rows[links].velocity, [0.0; 4]);
        }
    }
}
