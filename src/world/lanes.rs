//! Which contact goes to which lane.

use super::{Order, World};
use crate::bodies::BodyKind;
use crate::coloring::{Coloring, EXEMPT};
use crate::constraints::restitution::Bounces;
use crate::constraints::{Layout, Needs, OppositeKind, Workspace};
use crate::contacts::Contact;
use crate::lanes::held;

/// Contacts against one kind of body, and their colours.
#[derive(Default)]
pub(super) struct Group {
    contacts: Vec<u32>,
    edges: Vec<[u32; 2]>,
    coloring: Coloring,
}

impl Group {
    /// Bytes held.
    pub(super) fn held_bytes(&self) -> usize {
        held(&self.contacts) + held(&self.edges) + self.coloring.held_bytes()
    }
}

const OPPOSITES: [OppositeKind; 3] = [OppositeKind::Dynamic, OppositeKind::Kinematic, OppositeKind::Static];

impl World {
    /// Gives every contact its lane: by colours, or one after the other.
    pub(super) fn assign_lanes(&mut self, needs: &Needs) {
        let contacts = &self.contacts;
        let inert = self.bodies.len() as u32;
        let bodies = |contact: u32| {
            let contact = &contacts[contact as usize];
            [contact.body_a, contact.body_b]
        };
        let opposite = |contact: &Contact| match self.bodies.kind[contact.body_a as usize] {
            BodyKind::Dynamic => 0,
            BodyKind::Kinematic => 1,
            BodyKind::Static => 2,
        };
        let Workspace { lanes, serial, .. } = &mut self.work;
        lanes.clear(self.settings.width.lanes());
        serial.clear(1);
        let (mut colors, mut overflow) = (0, 0);
        match self.settings.order {
            Order::Natural => {
                let order = &mut self.groups[0].contacts;
                order.clear();
                order.extend(0..contacts.len() as u32);
                let kind_of = |i: u32| opposite(&contacts[i as usize]);
                for run in order.chunk_by(|&i, &j| kind_of(i) == kind_of(j)) {
                    let kind = OPPOSITES[kind_of(run[0])];
                    let layout = Layout::for_needs(needs, kind);
                    serial.push_segment(kind, &layout, run.iter().copied(), inert, bodies);
                }
            }
            Order::Colored => {
                for group in &mut self.groups {
                    group.contacts.clear();
                    group.edges.clear();
                }
                for (i, contact) in contacts.iter().enumerate() {
                    let kind = opposite(contact);
                    let group = &mut self.groups[kind];
                    group.contacts.push(i as u32);
                    group.edges.push([if kind == 0 { contact.body_a } else { EXEMPT }, contact.body_b]);
                }
                for (group, kind) in self.groups.iter_mut().zip(OPPOSITES) {
                    let layout = Layout::for_needs(needs, kind);
                    let Group { contacts, edges, coloring } = group;
                    coloring.assign(edges, self.bodies.kind.len());
                    let contact = |&edge: &u32| contacts[edge as usize];
                    for color in 0..coloring.colors() {
                        let edges = coloring.color(color).iter();
                        lanes.push_segment(kind, &layout, edges.map(contact), inert, bodies);
                    }
                    colors += coloring.colors();
                    let rest = coloring.overflow();
                    serial.push_segment(kind, &layout, rest.iter().map(contact), inert, bodies);
                    overflow += rest.len();
                }
            }
        }
        for batches in [lanes, serial] {
            batches.reserve_slab();
        }
        let w = &self.work;
        self.counts.colors = colors;
        self.counts.overflow = overflow;
        self.counts.lane_slots = w.lanes.contact.len() + w.serial.contact.len();
        self.counts.constraint_bytes = w.lanes.bytes() + w.serial.bytes();
        if needs.restitution {
            let points = if needs.two_points { 2 } else { 1 };
            self.counts.constraint_bytes += Bounces::bytes(self.counts.lane_slots, points);
        }
    }
}
