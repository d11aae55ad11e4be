//! Bounds and candidate pairs.

use super::World;

impl World {
    /// Updates the bounds of shapes that left theirs; if any did, updates the pairs.
    pub(super) fn update_pairs(&mut self) {
        let World { bodies, proxies, pairs, settings, work, .. } = self;
        let moved = self.fat_boxes.update(bodies, [settings.dt, settings.length_unit], proxies);
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
