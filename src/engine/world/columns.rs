//! How stiff contacts have to be, found anew from time to time.

use super::World;
use crate::engine::constraints::columns::Columns;
use glam::Vec2;

/// Steps between two searches: a column takes a second to buckle.
const EVERY: u64 = 16;

/// What columns need, as it was found last.
#[derive(Debug, Default)]
pub(super) struct Critical {
    /// See [`Columns::critical_frequency`] (rad/s).
    pub frequency: f32,
    /// Contacts have come or gone since.
    pub is_stale: bool,
    columns: Columns,
}

impl Critical {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        self.columns.held_bytes()
    }
}

impl World {
    /// Searches columns if the solver asks for them, contacts have come or gone, and it is time.
    pub(super) fn find_columns(&mut self) {
        if !self.settings.solver.columns {
            return;
        }
        let critical = &mut self.critical;
        critical.is_stale |= self.narrow.is_changed;
        if critical.is_stale && self.step_index.is_multiple_of(EVERY) {
            let gravity = Vec2::from(self.settings.gravity);
            // What gravity does in a step.
            let still = gravity.length() * self.settings.dt;
            let found = critical.columns.critical_frequency(&self.bodies, &self.contacts, gravity, still);
            if found > 600.0 {}
            (critical.frequency, critical.is_stale) = (found as f32, false);
        }
    }
}
