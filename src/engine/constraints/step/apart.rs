//! Bodies of joints that are farther apart than a solver pushes at once.
//!
//! A substep pushes the bodies of a joint together by impulses Jᵀ λ, moves them with the velocities that these give, and takes
//! the impulses back in a relaxing pass. If that has the rows J' of the new poses, what it leaves of a push from rest is
//!
//! ```text
//! v = (1 − M⁻¹ J'ᵀ K'⁻¹ J') M⁻¹ Jᵀ λ = P' M⁻¹ (J − J')ᵀ λ
//! ```
//!
//! the velocity u of the push times the angle by which it turns the rows. The sum over all substeps is u Δθ, however short they
//! are: two boxes whose hinge closes half a meter fly away at 1.4 m/s. With the rows of the push nothing is left.
//!
//! An error that a load causes is small, and so are u and its Δθ. If it is so large at the start of a step that the push is bounded,
//! the bodies begin apart: all joints of bodies that it is connected to by joints, which transmit the push, are relaxed with the rows
//! with which they were solved. Their motion is then relaxed one substep late. Rows of contacts keep their arms within a step
//! anyway; they see the present gaps.

use crate::constraints::kernels::types::ConstraintSet;
use crate::disjoint::DisjointSets;
use crate::lanes::BodyRow;

/// The bodies of a step, with their displacements before the last motion, and what finds them.
#[derive(Debug, Default)]
pub struct Apart {
    bodies: Vec<(u32, [f32; 3])>,
    /// Whether they have been searched for in this step.
    searched: bool,
    joined: DisjointSets,
    /// Whether a set of joined bodies is relaxed so, at its least body.
    found: Vec<bool>,
}

impl Apart {
    /// Whether there are no such bodies.
    pub(crate) fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }

    /// Whether a body is one of them.
    pub(crate) fn has(&self, body: u32) -> bool {
        self.bodies.binary_search_by_key(&body, |of| of.0).is_ok()
    }

    /// Forgets the bodies of the last step.
    pub(crate) fn clear(&mut self) {
        self.bodies.clear();
        self.searched = false;
    }

    /// Keeps the displacements of the bodies before they move; finds the bodies in the first substep of a step.
    pub(crate) fn keep(&mut self, types: &[ConstraintSet], rows: &[BodyRow]) {
        if !std::mem::replace(&mut self.searched, true) {
            self.find(types, rows);
        }
        for (body, kept) in &mut self.bodies {
            kept.copy_from_slice(&rows[*body as usize].delta[..3]);
        }
    }

    /// Bodies that impulses do not move connect nothing.
    fn find(&mut self, types: &[ConstraintSet], rows: &[BodyRow]) {
        let Apart { bodies, joined, found, .. } = self;
        if types.iter().all(|set| set.kind.apart().is_empty()) {
            return;
        }
        let moves = |body: u32| {
            let BodyRow { velocity, delta } = rows[body as usize];
            velocity[3] > 0.0 || delta[3] > 0.0
        };
        joined.begin(rows.len());
        for &[a, b] in types.iter().flat_map(|set| set.kind.ends()) {
            if moves(a) && moves(b) {
                joined.join(a, b);
            }
        }
        found.clear();
        found.resize(rows.len(), false);
        for set in types {
            let apart = set.kind.ends().iter().zip(set.kind.apart()).filter(|&(_, &is_apart)| is_apart);
            for &body in apart.flat_map(|(ends, _)| ends).filter(|&&body| moves(body)) {
                found[joined.least(body) as usize] = true;
            }
        }
        let is_found = |body: &u32| found[joined.least(*body) as usize];
        bodies.extend((0..rows.len() as u32).filter(is_found).map(|body| (body, [0.0; 3])));
    }

    /// Exchanges the displacements of the bodies with those that are kept.
    pub(crate) fn swap_poses(&mut self, rows: &mut [BodyRow]) {
        for (body, kept) in &mut self.bodies {
            rows[*body as usize].delta[..3].swap_with_slice(kept);
        }
    }
}
