//! Apparent masses: the masses that contacts use for the bodies of a beam.
//!
//! A push p on bodies of a chain changes their velocities by M⁻¹ p. The next solve removes the part that
//! joints do not allow, and A p remains. Contacts that expect M⁻¹ p treat a plank of a stiff beam as too
//! light: each sweep stops a small part of a heavy box, the impulse keeps growing until the box has turned
//! around, and then throws it. So contacts are solved with masses W⁻¹ instead of M.
//!
//! # Answers
//!
//! A body of inverse mass W (3 × 3) responds to pushes by W. If a joint of rows J attaches it to a body that
//! responds by S through its rows J_S, it responds by
//!
//! ```text
//! W' = W − W Jᵀ (J W Jᵀ + J_S S J_Sᵀ)⁻¹ J W
//! ```
//!
//! So one pass along a chain and one back give A_ii of all bodies (`featherstone1983`, with inverse
//! inertias).
//!
//! # Shares
//!
//! Contacts use the share W_i = α_i M_i⁻¹. For n loaded bodies of a chain, and a push p = a + b on those with
//! α = 1 (a) and with α < 1 (b),
//!
//! ```text
//! pᵀ A p ≤ 2 aᵀ A a + 2 bᵀ A b,     aᵀ A a ≤ aᵀ M⁻¹ a,     bᵀ A b ≤ n Σ b_iᵀ A_ii b_i,     α_i = min(1, n ‖M_i^½ A_ii M_i^½‖)
//! ```
//!
//! So A ≤ 2 W, which is the condition for the convergence of sweeps with W if A follows after each (2 W − A
//! positive definite).
//!
//! A is that of the start of the step. Beams do not bend. But a chain of hinges that is straight and stiff
//! then may be slack a substep later, and bodies that α makes too heavy diverge. So α = 1 where bodies of a
//! chain can move relative to each other: with two hinges or more, or with three or more if it hangs at both
//! ends.

use super::{ChainSystem, GIVE, up, velocity_of};
use crate::constraints::records::links::LINK_LANES;
use crate::lanes::{BodyRow, Lanes};
use glam::{DMat3, DVec3};
use std::ops::Range;
use wide::f32x8;

/// Smallest α. Velocity changes by contacts are divided by it, and so are their rounding errors.
const LEAST: f64 = 1.0 / 64.0;

/// The shares of all chains, and the memory to find them.
#[derive(Clone, Debug, Default)]
pub(super) struct Apparent {
    /// α of bodies R. `[groups]`
    shares: Vec<f32x8>,
    /// Whether some α is below 1.
    pub(super) lends: bool,
    /// Joints of one chain.
    joints: Vec<LinkJoint>,
    /// Responses of its bodies R, together with everything that hangs beyond them.
    beyond: Vec<DMat3>,
}

/// The rows between two bodies.
#[derive(Clone, Copy, Debug)]
struct LinkJoint {
    /// Jᵀ of L and R, with a column of zeros where there is no row.
    rows: [DMat3; 2],
    /// M⁻¹ of L and R.
    masses: [DMat3; 2],
    /// Added to J W Jᵀ: γ J M⁻¹ Jᵀ, and 1 where there is no row.
    gives: DMat3,
}

impl LinkJoint {
    fn is_hinge(&self) -> bool {
        self.rows[1].z_axis == DVec3::ZERO
    }

    /// Response of the body on `side`, given its free response `own` and the response `other` of the body
    /// that it is attached to.
    fn hung(&self, side: usize, own: DMat3, other: DMat3) -> DMat3 {
        let [near, far] = [self.rows[side], self.rows[1 - side]];
        let k = near.transpose() * own * near + far.transpose() * other * far + self.gives;
        let moved = own * near;
        own - moved * k.inverse() * moved.transpose()
    }
}

impl Apparent {
    pub(super) fn begin(&mut self, groups: usize) {
        self.shares.clear();
        self.shares.resize(groups, f32x8::ONE);
        self.lends = false;
    }
}

impl ChainSystem {
    /// Finds the shares of the `loaded` bodies from the present rows. The shares of other bodies are 1.
    pub fn find_shares(&mut self, loaded: &[bool], shares: &mut Vec<f32>) {
        self.apparent.begin(self.groups);
        let mut from = 0;
        while from < self.links {
            let chain = self.chains[self.slot(from)];
            let to = (from..self.links).find(|&i| self.chains[self.slot(i)] != chain).unwrap_or(self.links);
            let count = (from..to).filter(|&i| loaded[self.body(i)]).count();
            if count > 0 {
                self.find_shares_of(from..to, count as f64, loaded);
            }
            from = to;
        }
        shares.clear();
        shares.resize(loaded.len(), 1.0);
        if self.apparent.lends {
            for (slot, &body) in self.bodies.iter().enumerate() {
                let share = self.apparent.shares[slot / LINK_LANES].as_array()[slot % LINK_LANES];
                shares[body as usize] = share;
            }
        }
    }

    /// Whether some joint has three rows, as those of beams do.
    pub fn may_have_beams(&self) -> bool {
        self.size == 3
    }

    /// Forgets all shares.
    pub fn forget_shares(&mut self) {
        self.apparent.lends = false;
    }

    /// Whether some body has less than its whole inverse mass for contacts.
    pub fn has_effective_mass_scaling(&self) -> bool {
        self.apparent.lends
    }

    fn find_shares_of(&mut self, links: Range<usize>, count: f64, loaded: &[bool]) {
        let Apparent { joints, beyond, .. } = &mut self.apparent;
        let (mut joints, mut beyond) = (std::mem::take(joints), std::mem::take(beyond));
        joints.clear();
        joints.extend(links.clone().map(|i| self.joint(i)));
        let hangs_twice = joints.last().is_some_and(|joint| joint.masses[1] == DMat3::ZERO);
        if joints.iter().filter(|joint| joint.is_hinge()).count() < 2 + usize::from(hangs_twice) {
            beyond.clear();
            beyond.extend(joints.iter().map(|joint| joint.masses[1]));
            for k in (1..joints.len()).rev() {
                beyond[k - 1] = joints[k].hung(0, joints[k].masses[0], beyond[k]);
            }
            let mut before = DMat3::ZERO;
            for ((i, joint), &beyond) in links.zip(&joints).zip(&beyond) {
                let mass = joint.masses[1];
                if loaded[self.body(i)] {
                    let root = mass.diagonal().map(|w| if w > 0.0 { 1.0 / w.sqrt() } else { 0.0 });
                    let root = DMat3::from_diagonal(root);
                    let answer = root * joint.hung(1, beyond, before) * root;
                    let norm = answer.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt();
                    // NaN becomes 1.
                    let share = (count * norm).min(1.0);
                    self.set_share(i, share.max(LEAST) as f32);
                }
                before = joint.hung(1, mass, before);
            }
        }
        (self.apparent.joints, self.apparent.beyond) = (joints, beyond);
    }

    fn set_share(&mut self, link: usize, share: f32) {
        let slot = self.slot(link);
        self.apparent.shares[slot / LINK_LANES].as_mut_array()[slot % LINK_LANES] = share;
        self.apparent.lends |= share < 1.0;
    }

    /// Body R of a link.
    fn body(&self, link: usize) -> usize {
        self.bodies[self.slot(link)] as usize
    }

    fn joint(&self, link: usize) -> LinkJoint {
        let (slot, size) = (self.slot(link), self.size);
        let numbers = self.rows.group(slot / LINK_LANES);
        let at = |k: usize| f64::from(numbers[k].as_array()[slot % LINK_LANES]);
        let row = |side: usize, r: usize| {
            let way = DVec3::new(at(5 * r), at(5 * r + 1), at(5 * r + 2 + side));
            if side == 0 { -way } else { way }
        };
        let rows = [0, 1].map(|side| DMat3::from_cols(row(side, 0), row(side, 1), row(side, 2)));
        let masses = [0, 1].map(|side| {
            let mass = at(5 * size + side);
            DMat3::from_diagonal(DVec3::new(mass, mass, at(5 * size + 2 + side)))
        });
        let k = rows[0].transpose() * masses[0] * rows[0] + rows[1].transpose() * masses[1] * rows[1];
        let missing = k.diagonal().map(|k| if k > 0.0 { 0.0 } else { 1.0 });
        LinkJoint { rows, masses, gives: f64::from(GIVE) * k + DMat3::from_diagonal(missing) }
    }

    /// Replaces the velocity changes W p by contacts with M⁻¹ p.
    pub fn push_masses(&self, rows: &mut [BodyRow]) {
        for (k, &share) in self.apparent.shares.iter().enumerate() {
            if !share.simd_lt(f32x8::ONE).any() {
                continue;
            }
            let bodies = self.bodies.list().batch(k);
            let mut velocity = velocity_of(rows, bodies);
            for (v, &before) in velocity[..3].iter_mut().zip(&self.velocities[k]) {
                *v += (*v - before) * (f32x8::ONE / share - f32x8::ONE);
            }
            f32x8::scatter_velocity(rows, bodies, velocity);
        }
    }

    /// Restores the inverse masses of whole bodies in the rows.
    pub(super) fn take_whole_masses(&mut self) {
        for k in 0..self.groups {
            let right = self.apparent.shares[k];
            // 1 where there is no lane before.
            let of_first = || f32x8::ONE + up::<1>(self.apparent.shares[self.groups - 1] - f32x8::ONE);
            let left = if k == 0 { of_first() } else { self.apparent.shares[k - 1] };
            let masses = &mut self.rows.group_mut(k)[5 * self.size..];
            masses.iter_mut().zip([left, right, left, right]).for_each(|(mass, share)| *mass /= share);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ChainStage;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// One body of a beam is loaded. Its share follows from the velocity changes by pushes in three
        /// directions, once the beam has been solved. Beams hang by a weld or by a hinge.
        #[test]
        fn a_share_is_what_a_beam_leaves_of_a_push(
            links in 1usize..12,
            loaded in 0usize..12,
            hinged: bool,
            numbers in prop::collection::vec(0.2f32..1.0, 12 * 4),
        ) {
            let loaded = loaded % links;
            let mut system = ChainSystem::default();
            system.begin(links, 3);
            let mut bodies = vec![links as u32; system.slots()];
            let mass = |i: usize| [numbers[4 * i], 6.0 * numbers[4 * i + 1]];
            let arms = |i: usize| [numbers[4 * i + 2], -numbers[4 * i + 3]];
            let fill = |system: &mut ChainSystem, i: usize, of_push: [[f32; 3]; 2]| {
                let [left, [of_mass, of_inertia]] = [if i == 0 { [0.0; 2] } else { mass(i - 1) }, mass(i)];
                let [a, b] = arms(i);
                let mut rows = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, a, b], [0.0, 0.0, 1.0, 1.0]];
                if hinged && i == 0 {
                    rows[2] = [0.0; 4];
                }
                let slot = system.slot(i);
                let group = system.rows.group_mut(slot / LINK_LANES);
                let mut set = |k: usize, x: f32| group[k].as_mut_array()[slot % LINK_LANES] = x;
                for (r, [x, y, left, right]) in rows.into_iter().enumerate() {
                    let speed = |[vx, vy, w]: [f32; 3], arm: f32| x * vx + y * vy + arm * w;
                    let b = speed(of_push[0], left) - speed(of_push[1], right);
                    [x, y, left, right, b].into_iter().enumerate().for_each(|(k, value)| set(5 * r + k, value));
                }
                [left[0], of_mass, left[1], of_inertia].into_iter().enumerate().for_each(|(k, m)| set(15 + k, m));
            };
            for i in 0..links {
                bodies[system.slot(i)] = i as u32;
                fill(&mut system, i, [[0.0; 3]; 2]);
            }
            system.set_bodies(&bodies);
            system.set_chains([links].into_iter());
            let (is_loaded, mut shares) = ((0..=links).map(|i| i == loaded).collect::<Vec<_>>(), vec![]);
            system.find_shares(&is_loaded, &mut shares);
            system.forget_shares();
            let [of_mass, of_inertia] = mass(loaded);
            let inverse = [of_mass, of_mass, of_inertia];
            let mut square = 0.0;
            for k in 0..3 {
                let mut pushed = [0.0; 3];
                pushed[k] = inverse[k];
                let mut rows = vec![BodyRow { velocity: [0.0; 4], delta: [0.0; 4] }; links + 1];
                rows[loaded].velocity[..3].copy_from_slice(&pushed);
                let of = |i: usize| if i == loaded { pushed } else { [0.0; 3] };
                for i in 0..links {
                    fill(&mut system, i, [if i == 0 { [0.0; 3] } else { of(i - 1) }, of(i)]);
                }
                system.impulses.clear();
                system.solve(&mut rows, ChainStage::Begin);
                let answer = rows[loaded].velocity.iter().zip(&inverse).map(|(v, w)| v * v / (w * inverse[k]));
                square += answer.sum::<f32>();
            }
            let share = square.sqrt().clamp(LEAST as f32, 1.0);
            // The rest of a push in f32 has the rounding error of the whole push. In a mode of stiffness k,
            // γ ‖K‖/(k + γ ‖K‖) of it remains, and an elimination of n links changes k by n ε ‖K‖/2, so that
            // remainder by a part of at most n ε/2γ.
            let part = links as f32 * 0.5 * f32::EPSILON / GIVE;
            let off = (shares[loaded] - share).abs();
            prop_assert!(off < part * share + 3e-4, "{} instead of {share}", shares[loaded]);
        }
    }
}
