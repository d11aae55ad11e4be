//! A pair of shapes whose bounds overlap.

use crate::contacts::{Contact, pair_key};

/// A pair of shapes that may touch.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Shapes a and b, in a contact's order.
    pub shapes: [u32; 2],
    /// Their bodies.
    pub bodies: [u32; 2],
    /// Numbers of the shapes in the narrow phase.
    pub numbers: [u32; 2],
    /// Square of the distance of the centers of mass beyond which the shapes cannot touch (m²).
    pub reach_squared: f32,
    /// Mixed Coulomb coefficient.
    pub friction: f32,
    /// Mixed restitution.
    pub restitution: f32,
    /// Index of its contact, or [`super::batch::NO_CONTACT`].
    pub contact: u32,
}

impl Candidate {
    /// Room for a candidate.
    pub const NONE: Candidate = Candidate {
        shapes: [0; 2],
        bodies: [0; 2],
        numbers: [0; 2],
        reach_squared: 0.0,
        friction: 0.0,
        restitution: 0.0,
        contact: super::batch::NO_CONTACT,
    };

    /// The shape pair as a sortable number.
    pub fn pair(&self) -> u64 {
        pair_key(self.shapes[0], self.shapes[1])
    }

    /// Whether the pair has a contact.
    pub fn touches(&self) -> bool {
        self.contact != super::batch::NO_CONTACT
    }

    /// A contact of this pair without a manifold.
    pub fn without_manifold(&self) -> Contact {
        Contact {
            shape_a: self.shapes[0],
            shape_b: self.shapes[1],
            body_a: self.bodies[0],
            body_b: self.bodies[1],
            friction: self.friction,
            restitution: self.restitution,
            ..Contact::default()
        }
    }
}
