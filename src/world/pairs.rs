//! Bounds and candidate pairs.

use super::World;
use crate::bodies::BodyKind;
use crate::contacts::Contact;
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
        self.candidates.clear();
        for &[i, j] in &self.pairs {
            let dynamic = |shape: u32| self.proxies[shape as usize].dynamic;
            let (a, b) = if dynamic(j) { (i, j) } else { (j, i) };
            let (surface_a, surface_b) = (self.surfaces[a as usize], self.surfaces[b as usize]);
            self.candidates.push(Contact {
                shape_a: a,
                shape_b: b,
                body_a: self.shape_body[a as usize],
                body_b: self.shape_body[b as usize],
                friction: (surface_a.friction * surface_b.friction).sqrt(),
                restitution: surface_a.restitution.max(surface_b.restitution),
                ..Contact::default()
            });
        }
    }
}
