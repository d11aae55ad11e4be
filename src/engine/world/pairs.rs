//! Bounds and candidate pairs.

use super::World;
use super::candidates::reach_squared;
use crate::bodies::BodyKind;
use crate::broadphase::BroadPhase;
use crate::narrowphase::Margins;

impl World {
    /// Updates the bounds of shapes that left theirs; if any did, updates the pairs.
    pub(super) fn update_pairs(&mut self) {
        self.follow_settings();
        let World { bodies, proxies, pairs, settings, work, .. } = self;
        let moved =
            self.fat_boxes.update(bodies, [settings.dt, settings.length_unit], proxies, &work.workers);
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
        if std::mem::take(&mut self.seams_are_stale) {
            let ground = |shape: usize| {
                let body = self.shape_body[shape] as usize;
                let is_ground = self.bodies.kind[body] == BodyKind::Static && self.slots.lives[body];
                is_ground.then(|| self.broadphase.space_of(shape as u32))
            };
            let margins = Margins::of(self.settings.length_unit);
            self.seams.build(&self.bodies, &self.shapes, &self.shape_body, ground, margins);
        }
        self.update_candidates();
    }

    /// Starts anew with another broad phase, or with bounds and candidates of another length unit.
    fn follow_settings(&mut self) {
        let (kind, unit) = (self.settings.broadphase, self.settings.length_unit);
        let (old_kind, old_unit) = std::mem::replace(&mut self.bounds_are_for, (kind, unit));
        if kind != old_kind && !matches!(self.broadphase, BroadPhase::Spaces(_)) {
            self.broadphase = BroadPhase::new(kind);
            self.pairs_are_stale = true;
        }
        if unit != old_unit {
            (0..self.bodies.len()).filter(|&i| self.slots.lives[i]).for_each(|i| self.fat_boxes.forget(i));
            (self.pairs_are_stale, self.seams_are_stale) = (true, true);
            for candidate in &mut self.narrow.candidates {
                candidate.reach_squared =
                    reach_squared(candidate.shapes.map(|shape| self.surfaces[shape as usize].reach), unit);
            }
        }
    }
}
