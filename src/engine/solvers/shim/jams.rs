//! Jammed pairs of bodies, and bodies in a squeeze.
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
//!
//! The same holds where a kinematic body leaves others no room: with the overlap s that remains and the frequency ω of
//! the springs, impulses grow to m ω² s h, which moves a body at ω² s h in one substep as soon as the squeeze ends
//! (800 m/s at 0.25 m). So for a body in a squeeze, contacts count as of one pair whatever they are with. A body is in a
//! squeeze if it touches a kinematic body, or contacts deeper than the slop connect it with one that does. Bodies under a
//! heavy one, which are as deep in each other, keep their impulses.

use crate::engine::bodies::BodyKind;
use crate::engine::contacts::Contact;
use crate::engine::lanes::held;
use crate::engine::params::LINEAR_SLOP;

/// Normals with a smaller product oppose each other (1).
const OPPOSED: f32 = -0.5;

/// Finds jams; reuses its memory from step to step.
#[derive(Clone, Debug, Default)]
pub(super) struct Jams {
    /// Deep contacts: bodies that have to be the same, index, and whether its normal counts as it is.
    deep: Vec<([u32; 2], u32, bool)>,
    /// Bodies that touch a kinematic one.
    pressed: Vec<u32>,
    /// Whether a body is in a squeeze.
    squeezed: Vec<bool>,
}

impl Jams {
    /// Zeroes the impulses of contacts that push against each other. `kinds`: of the bodies.
    pub fn release(&mut self, contacts: &mut [Contact], kinds: &[BodyKind]) {
        self.deep.clear();
        self.pressed.clear();
        for (i, contact) in contacts.iter().enumerate() {
            if contact.manifold.points().iter().any(|point| point.separation < -LINEAR_SLOP) {
                self.deep.push(([contact.body_a, contact.body_b], i as u32, true));
            }
            for (by, of) in [(contact.body_a, contact.body_b), (contact.body_b, contact.body_a)] {
                if kinds[by as usize] == BodyKind::Kinematic {
                    self.pressed.push(of);
                }
            }
        }
        self.squeeze(kinds);
        self.deep.sort_unstable();
        for group in self.deep.chunk_by(|p, q| p.0 == q.0).filter(|group| group.len() > 1) {
            let normal = |contacts: &[Contact], i: u32, is_own: bool| {
                let n = contacts[i as usize].manifold.normal;
                if is_own { n } else { -n }
            };
            for &(_, i, is_own) in group {
                let n = normal(contacts, i, is_own);
                if group.iter().any(|&(_, j, is_own)| n.dot(normal(contacts, j, is_own)) < OPPOSED) {
                    for point in &mut contacts[i as usize].manifold.points {
                        (point.normal_impulse, point.tangent_impulse) = (0.0, 0.0);
                    }
                }
            }
        }
    }

    /// Lists the contacts of bodies in a squeeze once more, by body.
    fn squeeze(&mut self, kinds: &[BodyKind]) {
        if self.deep.is_empty() || self.pressed.is_empty() {
            return;
        }
        let is = |body: u32, kind| kinds[body as usize] == kind;
        self.squeezed.clear();
        self.squeezed.resize(kinds.len(), false);
        for &body in &self.pressed {
            self.squeezed[body as usize] = true;
        }
        let mut grows = true;
        while grows {
            grows = false;
            for ([a, b], ..) in &self.deep {
                for (from, to) in [(*a, *b), (*b, *a)] {
                    if self.squeezed[from as usize]
                        && !self.squeezed[to as usize]
                        && is(to, BodyKind::Dynamic)
                    {
                        (self.squeezed[to as usize], grows) = (true, true);
                    }
                }
            }
        }
        for k in 0..self.deep.len() {
            let ([a, b], i, _) = self.deep[k];
            for (own, is_own) in [(a, false), (b, true)] {
                if self.squeezed[own as usize] && is(own, BodyKind::Dynamic) {
                    self.deep.push(([own; 2], i, is_own));
                }
            }
        }
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.deep) + held(&self.pressed) + held(&self.squeezed)
    }
}
