//! Bounds and candidate pairs.

use super::World;

/// Two shapes that may touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    /// The static or kinematic one if there is one, else the lower index.
    pub shape_a: u32,
    /// Of a dynamic body.
    pub shape_b: u32,
    pub body_a: u32,
    pub body_b: u32,
}

impl World {
    /// Renews the bounds of shapes that left theirs; if any did, brings the pairs up to date.
    pub(super) fn update_pairs(&mut self) {
        let World { bodies, proxies, pairs, .. } = self;
        let moved = self.fat_boxes.update(bodies, self.settings.dt, proxies);
        if self.pairs_are_stale {
            self.broadphase.pairs(proxies, pairs);
        } else if !moved.is_empty() {
            self.broadphase.update(proxies, moved, pairs);
        } else {
            return;
        }
        self.pairs_are_stale = false;
        self.candidates.clear();
        self.candidates.extend(pairs.iter().map(|&[i, j]| {
            let (a, b) = if proxies[j as usize].dynamic { (i, j) } else { (j, i) };
            let body = |shape: u32| self.shape_body[shape as usize];
            Candidate { shape_a: a, shape_b: b, body_a: body(a), body_b: body(b) }
        }));
    }
}
