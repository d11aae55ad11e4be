//! Bounds and candidate pairs.

use super::World;
use crate::bodies::BodyKind;
use crate::params::{AABB_MARGIN, SPECULATIVE_DISTANCE};

impl World {
    /// Grows the bounds of shapes that left theirs; if any did, finds the pairs anew.
    pub(super) fn update_pairs(&mut self) {
        for (i, shape) in self.shapes.iter().enumerate() {
            let body = self.shape_body[i] as usize;
            if self.bodies.kind[body] == BodyKind::Static {
                continue;
            }
            let aabb = shape.aabb(&self.bodies.pose(body)).grown(SPECULATIVE_DISTANCE);
            if !self.proxies[i].aabb.contains(&aabb) {
                self.proxies[i].aabb = aabb.grown(AABB_MARGIN);
                self.pairs_are_stale = true;
            }
        }
        if !self.pairs_are_stale {
            return;
        }
        self.pairs_are_stale = false;
        self.broadphase.pairs(&self.proxies, &mut self.pairs);
        self.update_candidates();
    }
}
