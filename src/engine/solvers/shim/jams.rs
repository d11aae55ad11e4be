//! Two bodies that are caught in each other.
//!
//! Where two bodies overlap at several of their shapes, from opposite sides, no motion parts them: a body of two shapes
//! that was thrown half through a line, or a disc between two jaws of one body. What one contact pushes the other pushes
//! back, and no load and no law says how much: impulses that cancel may be any. Springs as stiff as the step allows
//! press, as overlaps of centimeters never become less, until they hold thousands of times the weight. As soon as a normal
//! turns by φ, as at the end of the line, sin φ of that is left in the next warm start, and shoots the
//! bodies apart.
//!
//! So contacts of the same two bodies with
//!
//! ```text
//! n₁ · n₂ < −1/2
//! ```
//!
//! that both are deeper than the slop begin a step without impulses. Within it their normals stay as they are, and
//! what cancels does so. What a wedge bears at rest is less deep by far, and is kept.

use crate::engine::contacts::Contact;
use crate::engine::lanes::held;
use crate::engine::params::LINEAR_SLOP;

/// Normals with a smaller product oppose each other (1).
const OPPOSED: f32 = -0.5;

/// Finds them; keeps its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Jams {
    /// Bodies and index of each deep contact.
    deep: Vec<[u32; 3]>,
}

impl Jams {
    /// Takes the impulses from contacts that push against each other.
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
