//! Bounds and candidate pairs.

use super::World;
use crate::bodies::BodyKind;

impl World {
    /// Updates the bounds of shapes that left theirs; if any did, updates the pairs.
    pub(super) fn update_pairs(&mut self) {
        let World { bodies, proxies, pairs, settings, work, .. } = self;
        let moved = self.fat_boxes.update(bodies, [settings.dt, settings.length_unit], proxies);
        let is_ground = |&shape: &u32| bodies.kind[proxies[shape as usize].body as usize] == BodyKind::Static;
        self.seams_are_stale |= moved.iter().any(is_ground);
        if self.pairs_are_stale {
            self.broadphase.pairs(proxies, pairs, &work.workers);
        } else if !moved.is_empty() {
            self.broadphase.update(proxies, moved, pairs, &work.workers);
        } else {
            return;
        }
        self.pairs_are_stale = false;
        self.update_candidates();
    }
}
