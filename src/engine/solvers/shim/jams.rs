//! Jammed pairs of bodies.
//!
//! If two bodies overlap at several of their shapes, from opposite sides, no motion separates them: a body of two
//! shapes that was thrown half-way through a line, or a disc between two jaws of one body. The two contacts push
//! against each other, and neither loads nor the contact law determine how hard: any impulses that cancel are a
//! solution. Since the overlap never shrinks, stiff springs build up thousands of times the weight. As soon as a
//! normal turns by φ, for example at the end of the line, a part sin φ of that remains in the next warm start and
//! throws the bodies apart.
//!
//! So contacts of the same two bodies with
//!
//! ```text
//! n₁ · n₂ < −1/2
//! ```
//!
//! that are both deeper than the slop start a step without impulses. Within the step their normals stay fixed, so
//! impulses that cancel keep canceling. Contacts of a wedge at rest are far less deep, and keep theirs.

use crate::engine::contacts::Contact;
use crate::engine::lanes::held;
use crate::engine::params::LINEAR_SLOP;

/// Normals with a smaller product oppose each other (1).
const OPPOSED: f32 = -0.5;

/// Finds jams; reuses its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Jams {
    /// Bodies and index of each deep contact.
    deep: Vec<[u32; 3]>,
}

impl Jams {
    /// Zeroes the impulses of contacts that push against each other.
    pub fn release(&mut self, contacts: &mut [Contact]) {
        self.deep.clear();
        for (i, contact) in contacts.iter().enumerate() {
            if contact.manifold.points().iter().any(|point| point.separation < -LINEAR_SLOP) {
                self.deep.push([contact.body_a, contact.body_b, i as u32]);
            }
        }
        self.deep.sort_unstable();
        for group in self.deep.chunk_by(|p, q| p[..2] == q[..2]).filter(|group| group.len() > 1) {
            let normal = |contacts: &[Contact], i: u32| contacts[i as usize].manifold.normal;
            for &[_, _, i] in group {
                let n = normal(contacts, i);
                if group.iter().any(|&[_, _, j]| n.dot(normal(contacts, j)) < OPPOSED) {
                    for point in &mut contacts[i as usize].manifold.points {
                        (point.normal_impulse, point.tangent_impulse) = (0.0, 0.0);
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.deep)
    }
}
