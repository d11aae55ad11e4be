//! From candidate pairs to contacts that remember their impulses.

use super::World;
use crate::contacts::Contact;
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
            let key = candidate.key();
            while last.next_if(|old| old.key() < key).is_some() {}
            if let Some(old) = last.next_if(|old| old.key() == key) {
                manifold.take_impulses(&old.manifold);
            }
            self.contacts.push(Contact { manifold, ..*candidate });
        }
        self.counts.pairs = self.candidates.len();
        self.counts.contacts = self.contacts.len();
        self.counts.points = points;
        self.counts.rows = if self.needs.friction { 2 * points } else { points };
    }
}
