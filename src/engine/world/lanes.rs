//! Assignment of contacts to lanes.

use super::{Order, World};
use crate::constraints::step::assign::Sides;
use crate::constraints::{Features, PartnerKind};
use crate::lanes::LaneWidth;

/// What an assignment of lanes depends on besides the contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LanesFor {
    solver: &'static str,
    widths: [LaneWidth; 2],
    order: Order,
    features: Features,
    /// `None` if the world is not divided into groups.
    group_size: Option<usize>,
}

impl World {
    /// Assigns every contact to a lane. The last step's lanes are reused while the set of contacts is the
    /// same.
    pub(super) fn assign_lanes(&mut self, features: &Features) {
        let widths = self.settings.widths();
        let group_size = self.may_divide().then_some(self.settings.group_size);
        let choice = Some(LanesFor {
            solver: self.solver_is.name,
            widths,
            order: self.settings.order,
            features: *features,
            group_size,
        });
        if !self.narrow.is_changed && self.lanes_are_for == choice {
            return;
        }
        (self.narrow.is_changed, self.lanes_are_for) = (false, choice);
        if group_size.is_some() && self.group_islands(features) {
            return;
        }
        self.groups.leave();
        self.counts.groups = 0;
        let kinds = &self.bodies.kind;
        let partner = |body: u32| PartnerKind::of(kinds[body as usize]);
        let (work, contacts) = (&mut self.work, &self.contacts);
        let levels = self.solver.levels(&self.bodies, contacts);
        let sides = Sides { bodies: kinds.len(), partner, levels, asleep: self.sleep.asleep() };
        match self.settings.order {
            Order::Natural => {
                self.assignment.serial(work, features, contacts, 0..contacts.len() as u32, &sides);
            }
            Order::Reversed => {
                self.assignment.serial(work, features, contacts, (0..contacts.len() as u32).rev(), &sides);
            }
            Order::Shuffled => self.assignment.shuffled(work, features, contacts, &sides),
            Order::Colored => self.assignment.colored(work, widths, features, contacts, &sides),
        }
        self.counts.colors = self.assignment.colors;
        self.counts.overflow = self.assignment.overflow;
        self.counts.lane_slots = work.lanes.lanes() + work.serial.lanes();
        self.counts.constraint_bytes = work.lanes.bytes() + work.serial.bytes();
        if features.restitution {
            let points = if features.two_points { 2 } else { 1 };
            let stride = self.settings.impact_law().stride(points);
            self.counts.constraint_bytes += 4 * self.counts.lane_slots * stride;
        }
    }

    /// Color of each contact of the last step, numbered in the solving order of its island; contacts of a color are solved
    /// at the same time. `None` for contacts that are solved one by one.
    ///
    /// ```
    /// use simpulse_engine::prelude::*;
    ///
    /// let mut world = World::new(Settings::new(solvers::SOFT_STEP));
    /// world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(9.0, 1.0)?))?;
    /// for y in [0.5, 1.5, 2.5] {
    ///     world.add_body(&BodyDef::dynamic([0.0, y]).with(ShapeDef::rectangle(0.5, 0.5)?))?;
    /// }
    /// world.step()?;
    /// // Contacts with the ground are colored on their own, after those between two boxes, which share the middle one.
    /// assert_eq!(world.contact_colors(), [Some(2), Some(0), Some(1)]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn contact_colors(&self) -> Vec<Option<u16>> {
        match self.settings.order {
            Order::Colored if self.groups.are_in_use() => self.groups.contact_colors(self.contacts.len()),
            Order::Colored => self.assignment.contact_colors(self.contacts.len()),
            _ => vec![None; self.contacts.len()],
        }
    }
}
