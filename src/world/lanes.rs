//! Which contact goes to which lane.

use super::{Order, World};
use crate::bodies::BodyKind;
use crate::constraints::assign::Sides;
use crate::constraints::restitution::Bounces;
use crate::constraints::{Needs, OppositeKind};
use crate::contacts::Contact;

impl World {
    /// Gives every contact its lane. The lanes of the last step hold while the set of contacts does.
    pub(super) fn assign_lanes(&mut self, needs: &Needs) {
        let choice = Some((self.settings.width, self.settings.order, *needs));
        if !self.narrow.is_changed && self.lanes_are_for == choice {
            return;
        }
        (self.narrow.is_changed, self.lanes_are_for) = (false, choice);
        let kinds = &self.bodies.kind;
        let opposite = |contact: &Contact| match kinds[contact.body_a as usize] {
            BodyKind::Dynamic => OppositeKind::Dynamic,
            BodyKind::Kinematic => OppositeKind::Kinematic,
            BodyKind::Static => OppositeKind::Static,
        };
        let sides = Sides { bodies: kinds.len(), opposite };
        let (work, contacts) = (&mut self.work, &self.contacts);
        match self.settings.order {
            Order::Natural => {
                self.assignment.serial(work, needs, contacts, 0..contacts.len() as u32, &sides);
            }
            Order::Colored => self.assignment.colored(work, self.settings.width, needs, contacts, &sides),
        }
        self.counts.colors = self.assignment.colors;
        self.counts.overflow = self.assignment.overflow;
        self.counts.lane_slots = work.lanes.contact.len() + work.serial.contact.len();
        self.counts.constraint_bytes = work.lanes.bytes() + work.serial.bytes();
        if needs.restitution {
            let points = if needs.two_points { 2 } else { 1 };
            self.counts.constraint_bytes += Bounces::bytes(self.counts.lane_slots, points);
        }
    }
}
