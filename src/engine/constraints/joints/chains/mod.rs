//! Chains of joints that hang from what does not move, solved at once: ropes, bridges, pendulums.
//!
//! # Problem
//!
//! Gauss–Seidel needs n² sweeps along a chain of n links, times the ratio of masses. But the rigid rows of a chain couple each link
//! to the one before and the one after alone: they are a block tridiagonal system, which is solved in a time that grows with n. Per
//! substep of h, with J, C and v at its start and K = J M⁻¹ Jᵀ,
//!
//! ```text
//! K λ = −(J v + C/h),      v ← v + M⁻¹ Jᵀ λ
//! ```
//!
//! The errors are gone at the end of the substep to first order. The impulses λ are whole: these rows need no warm start.
//!
//! # Chains
//!
//! Rows are oriented along the chain: L is the body toward the place where the chain hangs, R the one away from it, and
//! J v = d·(v_R − v_L) + s_R ω_R − s_L ω_L. Of link i and the next one, j, which share the body R,
//!
//! ```text
//! K_ii = (m_L⁻¹ + m_R⁻¹) d dᵀ + I_L⁻¹ s_L s_Lᵀ + I_R⁻¹ s_R s_Rᵀ,     K_ij = −(m_R⁻¹ d_i d_jᵀ + I_R⁻¹ s_R,i s_L,jᵀ)
//! ```
//!
//! # Chains that hang at both ends
//!
//! A straight bridge has a tension T without bound. Links of mass m and length l swing across it at up to ω² = 4 T/(m l), which
//! an explicit step bears up to ω h = 2. So the joints of such a chain give way, C = γ K_ii λ h: K_ii is multiplied by 1 + γ. With
//! K ≈ 2/m, λ = T h and n links, a sag of δ n l has T = n m g/(8 δ) and stretches each link by 8 δ² l/3, so that
//!
//! ```text
//! δ³ = (3/32) γ G,      (ω h)² = G/(2 δ) = 1.1 G^⅔ γ^−⅓,      G = n g h²/l
//! ```
//!
//! and ω h = 1 asks for γ = (4/3) G²; with (4/3) (2 G)² a chain may bear as much again. A bridge of 160 links of a meter gives way by
//! 1.4 mm a joint at h = 1/240 s. To that γ 3·10⁻⁵ are added: rows of a straight chain contradict each other without gravity, too, and
//! a load that hits a chain has to be caught.
//!
//! Chains have two links or more, and no body of theirs has a third rigid joint. All else is left to sweeps: the bodies of ragdolls
//! differ little in mass. `system` solves the chains of a scene as one system, whose blocks between two chains are zero.

pub(super) mod records;
mod system;

use crate::engine::constraints::joints::ANCHORS;
use crate::engine::constraints::kernels::types::Joined;
use crate::engine::constraints::records::links::{ChainLink, LinkRule};
use crate::engine::lanes::{BodyRow, held};
use crate::engine::narrowphase::lanes::PoseRow;
pub use system::Stage;
use system::ChainSystem;

/// No body.
const NONE: u32 = u32::MAX;

/// Chains of joints, and room to solve them.
#[derive(Clone, Debug, Default)]
pub struct Chains {
    /// Ends of all joints as they were when the chains were found. `[joints]`
    ends: Vec<[u32; 2]>,
    /// Whether bodies move by impulses, as they did then. `[rows]`
    moves: Vec<bool>,
    /// By type, in the order of their slots.
    links: Vec<Vec<ChainLink>>,
    system: ChainSystem,
    search: ChainSearch,
}

/// Room to find chains.
#[derive(Clone, Debug, Default)]
struct ChainSearch {
    /// Where joints of a body begin in `joined`. `[bodies + 1]`
    starts: Vec<u32>,
    /// Joints by body.
    joined: Vec<u32>,
    /// Type and number of each joint.
    places: Vec<[u32; 2]>,
    /// Its ends; [`NONE`] for what does not move.
    ends: Vec<[u32; 2]>,
    /// Links of all chains, one after the other: joint, body away from where it hangs, and links of the chain if it hangs at
    /// both ends.
    found: Vec<(u32, u32, usize, usize)>,
}

impl Chains {
    /// Finds the chains among the joints of these types, where joints or bodies have changed.
    pub fn find(&mut self, types: &[Joined], rows: &[BodyRow]) {
        let is_same = self.moves.len() == rows.len()
            && self.moves.iter().zip(rows).all(|(&moves, row)| moves == moves_by_impulses(row))
            && self.ends.iter().eq(types.iter().flat_map(|t| t.kind.ends()));
        if is_same && self.links.len() == types.len() {
            return;
        }
        self.moves.clear();
        self.moves.extend(rows.iter().map(moves_by_impulses));
        self.ends.clear();
        self.ends.extend(types.iter().flat_map(|t| t.kind.ends()));
        self.search.list(types, &self.moves);
        self.search.find();
        self.lay_out(types);
    }

    /// Gives links their places in the system.
    fn lay_out(&mut self, types: &[Joined]) {
        let Chains { links, system, search, .. } = self;
        let type_of = |joint: u32| &types[search.places[joint as usize][0] as usize].kind;
        let size = search.found.iter().map(|&(joint, ..)| type_of(joint).rigid_size()).max().unwrap_or(0);
        links.clear();
        links.resize(types.len(), vec![]);
        let inert = self.moves.len() as u32 - 1;
        system.begin(search.found.len(), size);
        let mut bodies = vec![inert; system.slots()];
        for (i, &(joint, right, span, chain)) in search.found.iter().enumerate() {
            let [t, number] = search.places[joint as usize];
            let slot = system.slot(i);
            let forward = search.ends[joint as usize][1] == right;
            system.set_chain(slot, chain, span);
            if right != NONE {
                bodies[slot] = right;
            }
            links[t as usize].push(ChainLink { joint: number, slot: slot as u32, forward });
        }
        system.set_bodies(&bodies);
        links.iter_mut().for_each(|links| links.sort_unstable_by_key(|link| link.slot));
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.system.is_empty()
    }

    /// Says to types which joints are links, which sweeps leave alone.
    pub fn set_aside(&self, types: &mut [Joined], poses: &[PoseRow]) {
        for (joined, links) in types.iter_mut().zip(&self.links) {
            joined.kind.link(links, poses);
        }
    }

    /// Changes velocities so that the rows hold at the end of the substep of `h` (s), under `gravity` (m/s²), of bodies of
    /// about `length_unit` (m).
    pub fn solve(
        &mut self,
        types: &mut [Joined],
        rows: &mut [BodyRow],
        [h, gravity, length_unit]: [f32; 3],
        stage: Stage,
    ) -> bool {
        if stage != Stage::First && !self.system.find_moved(rows) {
            return false;
        }
        self.system.h = h;
        if stage == Stage::First {
            self.system.damp(rows);
        }
        let by = LinkRule { inv_h: if stage == Stage::Relaxed { 0.0 } else { 1.0 / h }, length_unit };
        for (joined, links) in types.iter_mut().zip(&self.links) {
            if !links.is_empty() {
                joined.kind.link_rows(rows, by, self.system.rows());
            }
        }
        self.system.solve(rows, gravity * h * h, stage);
        true
    }

    /// Bytes that [`Self::solve`] reads and writes, without numbers of types.
    pub fn traffic(&self) -> [f64; 2] {
        // Anchors, two indices and both bodies make rows.
        let [read, written] = self.system.traffic();
        let rows = 4 * (ANCHORS + 2) + 2 * size_of::<BodyRow>();
        [read + (self.system.slots() * rows) as f64, written]
    }

    /// Types take over the impulses.
    pub fn give_impulses(&self, types: &mut [Joined]) {
        for (joined, links) in types.iter_mut().zip(&self.links) {
            if !links.is_empty() {
                joined.kind.set_linked(self.system.impulses());
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let ChainSearch { starts, joined, places, ends, found } = &self.search;
        held(&self.ends)
            + held(&self.moves)
            + self.links.iter().map(held).sum::<usize>()
            + self.system.held_bytes()
            + held(starts)
            + held(joined)
            + held(places)
            + held(ends)
            + held(found)
    }
}

fn moves_by_impulses(row: &BodyRow) -> bool {
    row.velocity[3] > 0.0
}

impl ChainSearch {
    fn joints_of(&self, body: u32) -> &[u32] {
        let [from, to] = [self.starts[body as usize], self.starts[body as usize + 1]].map(|i| i as usize);
        &self.joined[from..to]
    }

    /// Finds all chains, from the first joint of each that hangs from what does not move.
    fn find(&mut self) {
        self.found.clear();
        for joint in 0..self.ends.len() as u32 {
            let [a, b] = self.ends[joint as usize];
            // A chain that hangs at both ends is found from the joint that comes first.
            if (a == NONE) != (b == NONE) {
                let from = self.found.len();
                let last = self.follow(joint, if a == NONE { b } else { a });
                if !last.is_some_and(|last| self.found.len() > from + 1 && last >= joint) {
                    self.found.truncate(from);
                }
            }
        }
    }

    /// Lists the links from `joint` and its `body` on; the last joint if it hangs from what does not move, else the first; none
    /// where there is no chain.
    fn follow(&mut self, first: u32, mut body: u32) -> Option<u32> {
        let (from, mut joint) = (self.found.len(), first);
        loop {
            self.found.push((joint, body, 0, from));
            if body == NONE {
                let links = self.found.len() - from;
                self.found[from..].iter_mut().for_each(|link| link.2 = links);
                return Some(joint);
            }
            joint = match *self.joints_of(body) {
                [_] => return Some(first),
                // The other one.
                [one, other] => one ^ other ^ joint,
                _ => return None,
            };
            let [a, b] = self.ends[joint as usize];
            body = if a == body { b } else { a };
        }
    }

    /// Lists the joints of each body.
    fn list(&mut self, types: &[Joined], moves: &[bool]) {
        let ChainSearch { starts, joined, places, ends, .. } = self;
        places.clear();
        ends.clear();
        starts.clear();
        starts.resize(moves.len() + 1, 0);
        for (t, joined) in types.iter().enumerate().filter(|(_, joined)| joined.kind.rigid_size() > 0) {
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
    }
}
