//! Chains of joints that hang from immovable bodies, solved directly: pendulums, ropes, bridges, beams.
//!
//! # Problem
//!
//! Gauss–Seidel needs n² sweeps for a chain of n links, times the mass ratio. But the rigid rows of a chain
//! couple each link only to the one before and the one after. They form a block tridiagonal system, which is
//! solved in a time proportional to n. Per substep of h, with J, C and v at its start and K = J M⁻¹ Jᵀ,
//!
//! ```text
//! K λ = −(J v + C/h),      v ← v + M⁻¹ Jᵀ λ
//! ```
//!
//! The errors are gone at the end of the substep, to first order. λ are the whole impulses: these rows need
//! no warm start.
//!
//! Sweeps over contacts, motors and limits move the links after that. Chains that these sweeps have moved are
//! solved again before positions are integrated, and once more without errors, K λ' = −J v, after the
//! relaxing sweeps. Otherwise the next substep would find the effects of the sweeps as errors, and remove
//! them at the rate 1/h against the same contacts and motors. A chain whose velocities the first sweeps have
//! left bit-identical is solved once. Contacts with a beam do not use the mass of one plank but its apparent
//! mass as a part of the beam; see `system/apparent.rs`.
//!
//! # Chains
//!
//! Rows are oriented along the chain: L is the body toward the place where the chain hangs, R the one away
//! from it, and J v = d·(v_R − v_L) + s_R ω_R − s_L ω_L. For link i and the next one, j, which share the body
//! R,
//!
//! ```text
//! K_ii = (m_L⁻¹ + m_R⁻¹) d dᵀ + I_L⁻¹ s_L s_Lᵀ + I_R⁻¹ s_R s_Rᵀ,     K_ij = −(m_R⁻¹ d_i d_jᵀ + I_R⁻¹ s_R,i s_L,jᵀ)
//! ```
//!
//! # Tension
//!
//! A force F on the arm r of a body exerts a torque r × F, which falls by r·F per radian. So a chain under a
//! tension T swings sideways. Its links of mass m and length l reach up to ω² = 4 T/(m l), and T has no bound
//! if a chain is straight between two pins. An explicit step is stable for ω h < 2. Implicit Euler is always
//! stable: with the torque τ at the start of the substep and the stiffness Σ r·F of all hinges of the body,
//!
//! ```text
//! I (ω⁺ − ω) = h (τ − h ω⁺ Σ r·F),      (1 + x) I ω⁺ = I ω + h τ,      x = (h²/I) Σ r·F
//! ```
//!
//! But it damps the motion that it slows. So only the part beyond x = 1 is implicit, e = max(0, x − 1): ω at
//! the start of the substep and I⁻¹ in these rows are divided by 1 + e. F is that of the substep before.
//! Links that are rods have x = 3 (ω h)², and x = 1 at ω h = 0.58; slower swings keep their energy.
//!
//! A straight chain between two pins has one more row along it than its bodies have coordinates, so K has no
//! inverse. Therefore the joints of all chains yield, C = −γ K_ii λ h with γ = 3·10⁻⁵: K_ii is multiplied by
//! 1 + γ, and a second solve has γ K_ii λ of the first on its right side.
//!
//! # A joint alone
//!
//! With an arm r that turns at ω, C grows by h J v − ½ h² ω² r in a substep. The second term remains, and C/h
//! removes it one substep later. So at t_n, between the substeps with ω_n−1 and ω_n, rows hold
//! J v = ½ h ω²_n−1 r, half a substep too late. This costs energy: a pendulum that starts at 120° loses 1 %
//! in a minute, with two substeps. With half of the term on the right side,
//!
//! ```text
//! J v = −C/h + ¼ h ω²_n−1 r = ½ h (1.5 ω²_n−1 − 0.5 ω²_n−2) r
//! ```
//!
//! J v is that of ω² at t_n to first order: symmetric in time, and half of the gap remains. ω is the value
//! after the last substep, or the present value of the body if that is slower: contacts turn a welded plank
//! until its weld is solved. This applies to chains of one link. Longer ones would keep more of their energy
//! as well, but some gain energy (`papers/shim.md`).
//!
//! No body of a chain has a third rigid joint. One joint to an immovable body is a chain. Everything else is
//! left to sweeps: the bodies of ragdolls differ little in mass. `system` solves the chains of a scene as one
//! system, in which the blocks between two chains are zero.

pub(super) mod records;
mod system;

use super::graph::{JointGraph, NONE};
use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::kernels::velocity::masses::ScaledMasses;
use crate::constraints::records::links::{ChainLink, LinkRule};
use crate::lanes::BodyRow;
use crate::narrowphase::lanes::PoseRow;
pub use system::ChainStage;
use system::ChainSystem;

/// Chains of joints, and the memory to solve them.
#[derive(Clone, Debug, Default)]
pub struct Chains {
    /// Ends of all joints when the chains were found. `[joints]`
    ends: Vec<[u32; 2]>,
    /// Number of joints of each type at that time, and of rigid rows of each joint. `[types]`
    sizes: Vec<[usize; 2]>,
    /// Whether impulses moved the bodies at that time. `[rows]`
    moves: Vec<bool>,
    /// Links by type, in the order of their slots.
    links: Vec<Vec<ChainLink>>,
    system: ChainSystem,
    search: ChainSearch,
    /// Whether contacts, or rows that are not rigid, push a body. `[rows]`
    loaded: Vec<bool>,
    /// Share of its inverse mass that a body has for these contacts and rows. `[rows]`
    shares: Vec<f32>,
    masses: ScaledMasses,
    /// [`Self::kept`] when chains are found.
    kept: Vec<[f64; 3]>,
}

/// Memory to find chains.
#[derive(Clone, Debug, Default)]
struct ChainSearch {
    /// Joints with rigid rows.
    graph: JointGraph,
    /// Links of all chains, one after the other: joint, body R (away from where the chain hangs), and number
    /// of the chain.
    found: Vec<(u32, u32, usize)>,
}

impl Chains {
    /// Finds the chains among the joints of these types, if joints or bodies have changed.
    pub fn find(&mut self, types: &[ConstraintSet], rows: &[BodyRow]) {
        let sizes = || types.iter().map(|t| [t.kind.ends().len(), t.kind.rigid_size()]);
        let is_same = self.moves.len() == rows.len()
            && self.moves.iter().zip(rows).all(|(&moves, row)| moves == moves_by_impulses(row))
            && self.ends.iter().eq(types.iter().flat_map(|t| t.kind.ends()))
            && sizes().eq(self.sizes.iter().copied());
        if is_same {
            return;
        }
        self.kept = self.kept();
        self.moves.clear();
        self.moves.extend(rows.iter().map(moves_by_impulses));
        self.ends.clear();
        self.ends.extend(types.iter().flat_map(|t| t.kind.ends()));
        self.sizes.clear();
        self.sizes.extend(sizes());
        let moves = |body: u32| self.moves[body as usize];
        self.search.graph.list(types, |kind| kind.rigid_size() > 0, self.moves.len(), moves);
        self.search.find();
        self.lay_out(types);
        self.system.note(rows);
        self.system.set_kept(&self.kept);
    }

    /// What chains keep from step to step: bodies with the pull and the spin that the last solve left.
    pub fn kept(&self) -> Vec<[f64; 3]> {
        if self.moves.is_empty() { self.kept.clone() } else { self.system.kept(|body| self.moves[body]) }
    }

    /// Takes the numbers of [`Self::kept`].
    pub fn set_kept(&mut self, kept: Vec<[f64; 3]>) {
        *self = Chains { kept, ..Chains::default() };
    }

    /// Assigns links to slots of the system.
    fn lay_out(&mut self, types: &[ConstraintSet]) {
        let Chains { links, system, search, .. } = self;
        let type_of = |joint: u32| &types[search.graph.place(joint)[0] as usize].kind;
        let size = search.found.iter().map(|&(joint, ..)| type_of(joint).rigid_size()).max().unwrap_or(0);
        links.clear();
        links.resize(types.len(), vec![]);
        let inert = self.moves.len() as u32 - 1;
        system.begin(search.found.len(), size);
        let mut bodies = vec![inert; system.slots()];
        for (i, &(joint, right, _)) in search.found.iter().enumerate() {
            let [t, number] = search.graph.place(joint);
            let slot = system.slot(i);
            let forward = search.graph.ends()[joint as usize][1] == right;
            if right != NONE {
                bodies[slot] = right;
            }
            links[t as usize].push(ChainLink { joint: number, slot: slot as u32, forward });
        }
        system.set_bodies(&bodies);
        system.set_chains(search.found.chunk_by(|one, other| one.2 == other.2).map(<[_]>::len));
        links.iter_mut().for_each(|links| links.sort_unstable_by_key(|link| link.slot));
    }

    /// Whether there are no chains.
    pub fn is_empty(&self) -> bool {
        self.system.is_empty()
    }

    /// Marks the joints that are links in their types, so that sweeps skip their rigid rows.
    pub fn disable_rows(&self, types: &mut [ConstraintSet], poses: &[PoseRow]) {
        for (joined, links) in types.iter_mut().zip(&self.links) {
            joined.kind.link(links, poses);
        }
    }

    /// Finds the apparent masses of bodies for contacts of these pairs. `None` if all have their whole mass.
    /// `length_unit`: size of typical bodies (m).
    pub fn share_masses(
        &mut self,
        types: &mut [ConstraintSet],
        rows: &[BodyRow],
        length_unit: f32,
        pairs: impl Iterator<Item = [u32; 2]>,
    ) -> Option<(&mut ScaledMasses, &[f32])> {
        if !self.system.may_have_beams() {
            return None;
        }
        self.loaded.clear();
        self.loaded.resize(rows.len(), false);
        let others =
            types.iter().filter(|joined| !joined.kind.is_idle()).flat_map(|joined| joined.kind.ends());
        pairs.chain(others.copied()).flatten().for_each(|body| self.loaded[body as usize] = true);
        self.write_rows(types, rows, LinkRule { inv_h: 0.0, length_unit });
        self.system.find_shares(&self.loaded, &mut self.shares);
        self.has_effective_mass_scaling().then_some((&mut self.masses, &self.shares))
    }

    /// Whether some bodies have apparent masses for contacts.
    pub fn has_effective_mass_scaling(&self) -> bool {
        self.system.has_effective_mass_scaling()
    }

    /// Notes velocities before warm starts, if some bodies have apparent masses.
    pub fn snapshot_velocities(&mut self, rows: &[BodyRow]) {
        if self.has_effective_mass_scaling() {
            self.system.note(rows);
        }
    }

    /// Restores the masses of bodies.
    pub fn restore_masses(&mut self, rows: &mut [BodyRow]) {
        if self.has_effective_mass_scaling() {
            self.masses.scale(rows, |_| 1.0);
            self.masses.forget();
            self.system.forget_shares();
        }
    }

    fn write_rows(&mut self, types: &mut [ConstraintSet], rows: &[BodyRow], by: LinkRule) {
        for (joined, links) in types.iter_mut().zip(&self.links) {
            if !links.is_empty() {
                joined.kind.link_rows(rows, by, self.system.rows());
            }
        }
    }

    /// Changes velocities so that the rows hold at the end of the substep of `h` (s). `length_unit`: size of
    /// typical bodies (m). Returns whether there was something to solve.
    pub fn solve(
        &mut self,
        types: &mut [ConstraintSet],
        rows: &mut [BodyRow],
        [h, length_unit]: [f32; 2],
        stage: ChainStage,
    ) -> bool {
        if stage != ChainStage::Begin {
            self.system.find_moved(rows);
            if !self.system.any_moved() {
                return false;
            }
        }
        if self.has_effective_mass_scaling() {
            self.system.push_masses(rows);
        }
        if stage == ChainStage::Begin {
            self.system.begin_substep(rows, h);
        }
        let inv_h = if stage == ChainStage::Relax { 0.0 } else { 1.0 / h };
        self.write_rows(types, rows, LinkRule { inv_h, length_unit });
        self.system.solve(rows, stage);
        true
    }

    /// Copies the impulses to the types.
    pub fn give_impulses(&self, types: &mut [ConstraintSet]) {
        for (joined, links) in types.iter_mut().zip(&self.links) {
            if !links.is_empty() {
                joined.kind.set_linked(self.system.impulses());
            }
        }
    }
}

fn moves_by_impulses(row: &BodyRow) -> bool {
    row.velocity[3] > 0.0
}

impl ChainSearch {
    /// Finds all chains, each from a joint to an immovable body.
    fn find(&mut self) {
        self.found.clear();
        let mut chains = 0;
        for joint in 0..self.graph.len() as u32 {
            let [a, b] = self.graph.ends()[joint as usize];
            // A chain that hangs at both ends is found from the joint with the lower number.
            if (a == NONE) != (b == NONE) {
                let from = self.found.len();
                let last = self.follow(joint, if a == NONE { b } else { a }, chains);
                if last.is_some_and(|last| last >= joint) {
                    chains += 1;
                } else {
                    self.found.truncate(from);
                }
            }
        }
    }

    /// Lists the links of a chain, from its `first` joint and the `body` of that joint on. Returns the last
    /// joint if the chain also ends at an immovable body, otherwise the first. `None` if there is no chain.
    fn follow(&mut self, first: u32, mut body: u32, chain: usize) -> Option<u32> {
        let mut joint = first;
        loop {
            self.found.push((joint, body, chain));
            if body == NONE {
                return Some(joint);
            }
            joint = match *self.graph.of(body) {
                [_] => return Some(first),
                // The other joint.
                [one, other] => one ^ other ^ joint,
                _ => return None,
            };
            let [a, b] = self.graph.ends()[joint as usize];
            body = if a == body { b } else { a };
        }
    }
}
