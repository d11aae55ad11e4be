//! What piles ask of soft contacts, searched from time to time.

use super::modes::{PileModes, Piles};
use crate::engine::bodies::Bodies;
use crate::engine::constraints::step::Scene;
use glam::Vec2;

/// Steps between two searches: columns take a second to buckle, and preload is slow.
const EVERY: u64 = 32;

/// Part by which gravity may change before piles are searched at once (1).
const SAME: f32 = 0.1;

/// What was found last.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    /// What the piles ask for.
    pub modes: PileModes,
    /// Contacts then.
    contacts: usize,
    /// Gravity then (m/s²).
    gravity: Vec2,
    /// Σ |F| + |M| of what users push bodies with (N, N·m), and Σ of factors on gravity (1).
    pushes: [f32; 2],
    /// Contacts have come or gone since, or loads have changed.
    is_stale: bool,
    /// Contacts have come or gone in this step.
    pub contacts_changed: bool,
}

impl Default for Found {
    fn default() -> Self {
        let (modes, gravity) = (PileModes::default(), Vec2::ZERO);
        // Until a collision says otherwise.
        let contacts_changed = true;
        Found { modes, contacts: 0, gravity, pushes: [0.0; 2], is_stale: false, contacts_changed }
    }
}

impl Found {
    /// Searches the piles if contacts have come or gone, or gravity or what users push with has
    /// changed: every so many steps, and at once if there are a quarter more contacts than the last time, bodies were put where they
    /// touch (`is_placed`), or gravity is another. What contacts bear then goes to `weights`, which is else empty.
    pub fn update(
        &mut self,
        piles: &mut Piles,
        weights: &mut Vec<f32>,
        scene: &mut Scene<'_>,
        is_placed: bool,
    ) {
        let (h, gravity) = (scene.h(), scene.gravity);
        let Scene { bodies, contacts, kept, dt, .. } = scene;
        weights.clear();
        self.contacts_changed = scene.contacts_changed;
        let turn = scene.step_index.is_multiple_of(EVERY);
        let pushes = if turn { pushes(bodies) } else { self.pushes };
        self.is_stale |= self.contacts_changed || gravity != self.gravity || pushes != self.pushes;
        let grown = 4 * contacts.len() > 5 * self.contacts;
        let other = gravity.distance(self.gravity) > SAME * self.gravity.length();
        if self.is_stale && (grown || other || turn || is_placed) {
            let modes = piles.modes(bodies, contacts, kept, gravity, [*dt, h]);
            weights.extend_from_slice(piles.weights());
            *self = Found { modes, contacts: contacts.len(), gravity, pushes, is_stale: false, ..*self };
        }
    }
}

/// [`Found::pushes`] of all bodies.
fn pushes(bodies: &Bodies) -> [f32; 2] {
    let forces = [&bodies.force_x, &bodies.force_y, &bodies.torque];
    let size = forces.map(|force| force.iter().map(|f| f.abs()).sum::<f32>());
    [size.iter().sum(), bodies.gravity_scale.iter().sum()]
}
