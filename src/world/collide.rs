//! From candidate pairs to contacts that remember their impulses.

use super::World;
use crate::contacts::{Contact, pair_key};
use crate::narrowphase::collide;
use crate::params::SPECULATIVE_DISTANCE;

impl World {
    /// Collides every candidate and hands the last step's impulses on by feature id.
    ///
    /// Both lists are sorted by shape pair, so that matching is one walk along both.
    pub(super) fn update_contacts(&mut self) {
        std::mem::swap(&mut self.contacts, &mut self.last_contacts);
        self.contacts.clear();
        let mut last = self.last_contacts.iter().peekable();
        let mut points = 0;
        for candidate in &self.candidates {
            let (a, b) = (candidate.shape_a as usize, candidate.shape_b as usize);
            let [pose_a, pose_b] =
                self.bodies.relative_poses(candidate.body_a as usize, candidate.body_b as usize);
            let mut manifold =
                collide(&self.shapes[a], &pose_a, &self.shapes[b], &pose_b, SPECULATIVE_DISTANCE);
            if manifold.count == 0 {
                continue;
            }
            points += manifold.count as usize;
            let key = pair_key(candidate.shape_a, candidate.shape_b);
            while last.next_if(|old| old.key() < key).is_some() {}
            if let Some(old) = last.next_if(|old| old.key() == key) {
                manifold.take_impulses(&old.manifold);
            }
            let (surface_a, surface_b) = (self.surfaces[a], self.surfaces[b]);
            self.contacts.push(Contact {
                shape_a: candidate.shape_a,
                shape_b: candidate.shape_b,
                body_a: candidate.body_a,
                body_b: candidate.body_b,
                friction: (surface_a.friction * surface_b.friction).sqrt(),
                restitution: surface_a.restitution.max(surface_b.restitution),
                manifold,
                step_impulse: Default::default(),
            });
        }
        self.counts.pairs = self.candidates.len();
        self.counts.contacts = self.contacts.len();
        self.counts.points = points;
        self.counts.rows = if self.needs.friction { 2 * points } else { points };
    }
}
