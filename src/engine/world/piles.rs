//! What piles ask of soft contacts, found anew from time to time.

use super::World;
use crate::engine::constraints::piles::PileModes;
use glam::Vec2;

/// Steps between two searches: columns take a second to buckle, and preload is slow.
const EVERY: u64 = 32;

/// What was found last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Found {
    /// What the piles ask for.
    pub modes: PileModes,
    /// Contacts then.
    contacts: usize,
    /// Contacts have come or gone since.
    is_stale: bool,
    /// Contacts have come or gone in this step.
    pub contacts_changed: bool,
}

impl World {
    /// Searches the piles if the solver asks for it and contacts have come or gone: every so many steps, and
    /// when a quarter more contacts are there than the last time.
    pub(super) fn find_piles(&mut self) {
        if !self.settings.solver.piles {
            return;
        }
        let found = &mut self.found;
        self.work.weights.clear();
        found.contacts_changed = self.narrow.is_changed;
        found.is_stale |= found.contacts_changed;
        let grown = 4 * self.contacts.len() > 5 * found.contacts;
        if found.is_stale && (grown || self.step_index.is_multiple_of(EVERY)) {
            let gravity = Vec2::from(self.settings.gravity);
            let modes = self.piles.modes(
                &self.bodies,
                &mut self.contacts,
                gravity,
                [self.settings.dt, self.settings.h()],
            );
            self.work.weights.extend_from_slice(self.piles.weights());
            *found = Found { modes, contacts: self.contacts.len(), is_stale: false, ..*found };
        }
    }
}
