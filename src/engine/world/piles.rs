//! What piles ask of soft contacts, found anew from time to time.

use super::World;
use crate::engine::bodies::Bodies;
use crate::engine::constraints::piles::PileModes;
use glam::Vec2;

/// Steps between two searches: columns take a second to buckle, and preload is slow.
const EVERY: u64 = 32;

/// Part by which gravity may change before piles are searched at once (1).
const SAME: f32 = 0.1;

/// What was found last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
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

impl World {
    /// Searches the piles if the solver asks for it and contacts have come or gone, or gravity or what users push with has
    /// changed: every so many steps, and at once if there are a quarter more contacts than the last time, bodies were put where they
    /// touch, or gravity is another.
    pub(super) fn find_piles(&mut self) {
        if !self.settings.solver.piles {
            return;
        }
        let (found, gravity) = (&mut self.found, Vec2::from(self.settings.gravity));
        self.work.weights.clear();
        found.contacts_changed = self.narrow.is_changed;
        let turn = self.step_index.is_multiple_of(EVERY);
        let pushes = if turn { pushes(&self.bodies) } else { found.pushes };
        found.is_stale |= found.contacts_changed || gravity != found.gravity || pushes != found.pushes;
        let grown = 4 * self.contacts.len() > 5 * found.contacts;
        let other = gravity.distance(found.gravity) > SAME * found.gravity.length();
        if found.is_stale && (grown || other || turn || self.narrow.is_placed) {
            let modes = self.piles.modes(
                &self.bodies,
                &mut self.contacts,
                gravity,
                [self.settings.dt, self.settings.h()],
            );
            self.work.weights.extend_from_slice(self.piles.weights());
            *found =
                Found { modes, contacts: self.contacts.len(), gravity, pushes, is_stale: false, ..*found };
        }
    }
}

/// [`Found::pushes`] of all bodies.
fn pushes(bodies: &Bodies) -> [f32; 2] {
    let forces = [&bodies.force_x, &bodies.force_y, &bodies.torque];
    let size = forces.map(|force| force.iter().map(|f| f.abs()).sum::<f32>());
    [size.iter().sum(), bodies.gravity_scale.iter().sum()]
}
