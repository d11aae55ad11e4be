//! Which contact goes to which lane: by colours, or one after the other.

use super::{Features, Layout, OppositeKind, Workspace};
use crate::engine::coloring::{Coloring, EXEMPT};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{LaneWidth, held};

/// Contacts against one kind of body, and their colours.
#[derive(Debug, Default)]
struct Group {
    contacts: Vec<u32>,
    /// Rows of a and b.
    rows: Vec<[u32; 2]>,
    /// The same, with a exempt unless it is dynamic.
    edges: Vec<[u32; 2]>,
    coloring: Coloring,
}

/// Gives contacts their lanes; keeps its memory from call to call.
#[derive(Debug, Default)]
pub struct Assignment {
    /// By [`OppositeKind`].
    groups: [Group; 3],
    /// Colours in use.
    pub colors: usize,
    /// Contacts that got no colour and are solved one by one.
    pub overflow: usize,
}

/// What lanes are assigned for.
pub struct Sides<F> {
    /// Number of bodies; the row of this number is the inert one.
    pub bodies: usize,
    /// What stands opposite the dynamic body of a contact.
    pub opposite: F,
}

impl Assignment {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let one = |g: &Group| held(&g.contacts) + held(&g.rows) + held(&g.edges) + g.coloring.held_bytes();
        self.groups.iter().map(one).sum()
    }

    /// Forgets all colours, so that the next call recomputes them even for the same contacts.
    pub fn forget(&mut self) {
        self.groups.iter_mut().for_each(|group| group.coloring.forget());
    }

    /// Lanes of `width` colour by colour; what gets no colour goes one after the other.
    pub fn colored(
        &mut self,
        work: &mut Workspace,
        width: LaneWidth,
        features: &Features,
        contacts: &[Contact],
        sides: &Sides<impl Fn(&Contact) -> OppositeKind>,
    ) {
        let Workspace { lanes, serial, .. } = work;
        lanes.clear(width.lanes());
        serial.clear(1);
        (self.colors, self.overflow) = (0, 0);
        for group in &mut self.groups {
            group.contacts.clear();
            group.rows.clear();
            group.edges.clear();
        }
        for (i, contact) in contacts.iter().enumerate() {
            let kind = (sides.opposite)(contact);
            let group = &mut self.groups[kind as usize];
            group.contacts.push(i as u32);
            group.rows.push([contact.body_a, contact.body_b]);
            let a = if kind == OppositeKind::Dynamic { contact.body_a } else { EXEMPT };
            group.edges.push([a, contact.body_b]);
        }
        let inert = sides.bodies as u32;
        for (Group { contacts: list, rows, edges, coloring }, kind) in
            self.groups.iter_mut().zip(OppositeKind::ALL)
        {
            let layout = Layout::for_features(features, kind);
            coloring.assign(edges, sides.bodies);
            let contact = |&edge: &u32| (list[edge as usize], rows[edge as usize]);
            for color in 0..coloring.colors() {
                let edges = coloring.color(color).iter().map(contact);
                lanes.push_segment(kind, &layout, edges, inert);
            }
            let rest = coloring.overflow().iter().map(contact);
            self.overflow += rest.len();
            serial.push_segment(kind, &layout, rest, inert);
            self.colors += coloring.colors();
        }
        lanes.reserve_buffer();
        serial.reserve_buffer();
    }

    /// One after the other, in `order`.
    pub fn serial(
        &mut self,
        work: &mut Workspace,
        features: &Features,
        contacts: &[Contact],
        order: impl Iterator<Item = u32>,
        sides: &Sides<impl Fn(&Contact) -> OppositeKind>,
    ) {
        let Workspace { lanes, serial, .. } = work;
        lanes.clear(1);
        serial.clear(1);
        (self.colors, self.overflow) = (0, 0);
        let list = &mut self.groups[0].contacts;
        list.clear();
        list.extend(order);
        let kind_of = |&i: &u32| (sides.opposite)(&contacts[i as usize]);
        for run in list.chunk_by(|i, j| kind_of(i) == kind_of(j)) {
            let kind = kind_of(&run[0]);
            let layout = Layout::for_features(features, kind);
            let contact = |&i: &u32| (i, [contacts[i as usize].body_a, contacts[i as usize].body_b]);
            serial.push_segment(kind, &layout, run.iter().map(contact), sides.bodies as u32);
        }
        serial.reserve_buffer();
    }
}
