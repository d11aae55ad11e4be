//! Assignment of constraints to lanes: by colors, or one after the other.

use super::Workspace;
use crate::coloring::{Coloring, EXEMPT, OVERFLOW};
use crate::constraints::records::batches::Place;
use crate::constraints::records::features::{Features, Layout, PartnerKind};
use crate::constraints::records::graph::{Graph, UNSUPPORTED};
use crate::constraints::records::order::mixed;
use crate::contacts::Contact;
use crate::lanes::LaneWidth;

/// A constraint that gets a lane.
#[derive(Clone, Copy, Debug)]
struct Assigned {
    /// Level in the contact graph; 0 unless constraints are grouped by level.
    level: u32,
    /// Type: 0 for contacts, k for type k − 1 of [`Workspace::types`].
    kind: u32,
    index: u32,
    /// Rows of bodies a and b.
    rows: [u32; 2],
}

impl Assigned {
    /// Key that all entries of a segment share.
    fn place(&self) -> (u32, u32) {
        (self.level, self.kind)
    }
}

/// Constraints with one kind of body a, and their colors.
#[derive(Clone, Debug, Default)]
struct Group {
    entries: Vec<Assigned>,
    /// Rows of their bodies. a is exempt unless it is dynamic.
    edges: Vec<[u32; 2]>,
    coloring: Coloring,
}

/// Assigns lanes to constraints; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub struct Assignment {
    /// One group per [`PartnerKind`].
    groups: [Group; 3],
    /// Entries of one color.
    color: Vec<Assigned>,
    /// Contacts in a shuffled order.
    places: Vec<u32>,
    /// Number of colors in use.
    pub colors: usize,
    /// Number of constraints that got no color and are solved one by one.
    pub overflow: usize,
}

/// Inputs of the assignment of lanes.
pub struct Sides<'a, F> {
    /// Number of bodies. The row with this index is the inert one.
    pub bodies: usize,
    /// Kind of body a. The other body of the constraint, b, is dynamic.
    pub partner: F,
    /// The graph by whose levels contacts are grouped, if they are.
    pub levels: Option<&'a Graph>,
    /// Which bodies sleep; may be empty. Their constraints get no lane. `[bodies]`
    pub asleep: &'a [bool],
}

impl<F> Sides<'_, F> {
    /// Level of a contact: the higher one of its two bodies; 0 for contacts without support.
    fn level(&self, rows: [u32; 2]) -> u32 {
        let Some(graph) = self.levels else { return 0 };
        let of = |body: u32| graph.levels().get(body as usize).copied().unwrap_or(0);
        let level = of(rows[0]).max(of(rows[1]));
        if level == UNSUPPORTED { 0 } else { level }
    }

    /// Whether a constraint of these bodies gets no lane.
    fn sleeps(&self, rows: [u32; 2]) -> bool {
        self.asleep.get(rows[1] as usize).copied().unwrap_or(false)
    }
}

/// Cost of a batch's arithmetic, relative to the cost of gathering one lane.
const BATCH_COST: usize = 12;

/// Upper bound of the number of colors of all groups.
const STAGES_PER_LEVEL: u32 = 256;

impl Assignment {
    /// Assigns lanes color by color, at the cheapest width within the two `widths`. Constraints without a
    /// color are solved one after the other.
    pub fn colored(
        &mut self,
        work: &mut Workspace,
        widths: [LaneWidth; 2],
        features: &Features,
        contacts: &[Contact],
        sides: &Sides<'_, impl Fn(u32) -> PartnerKind>,
    ) {
        (self.colors, self.overflow) = (0, 0);
        for group in &mut self.groups {
            group.entries.clear();
            group.edges.clear();
        }
        let all = contacts.iter().map(|c| [c.body_a, c.body_b]).enumerate().map(|(i, rows)| (0, i, rows));
        let types = work.types.iter().enumerate().flat_map(|(k, joined)| {
            joined.kind.ends().iter().enumerate().map(move |(i, &rows)| (k as u32 + 1, i, rows))
        });
        for (kind, index, rows) in all.chain(types).filter(|&(.., rows)| !sides.sleeps(rows)) {
            let partner = (sides.partner)(rows[0]);
            let group = &mut self.groups[partner as usize];
            group.entries.push(Assigned { level: sides.level(rows), kind, index: index as u32, rows });
            let a = if partner == PartnerKind::Dynamic { rows[0] } else { EXEMPT };
            group.edges.push([a, rows[1]]);
        }
        for Group { edges, coloring, .. } in &mut self.groups {
            coloring.assign(edges, sides.bodies);
        }
        work.clear_lanes(self.fitting(widths).lanes());
        let is_simple = sides.levels.is_none() && work.types.is_empty();
        let inert = sides.bodies as u32;
        let color = &mut self.color;
        let mut stage = 0;
        for (Group { entries, coloring, .. }, partner) in self.groups.iter_mut().zip(PartnerKind::ALL) {
            for of_color in 0..=coloring.colors() {
                let serial = of_color == coloring.colors();
                let edges = if serial { coloring.overflow() } else { coloring.color(of_color) };
                color.clear();
                color.extend(edges.iter().map(|&edge| entries[edge as usize]));
                if !is_simple {
                    color.sort_unstable_by_key(|e| (e.place(), e.index));
                }
                for run in color.chunk_by(|a, b| a.place() == b.place()) {
                    let Assigned { level, kind, .. } = run[0];
                    let place =
                        Place { partner, stage: level * STAGES_PER_LEVEL + stage, level, disjoint: !serial };
                    work.push(kind, place, features, run.iter().map(|e| (e.index, e.rows)), inert);
                }
                self.overflow += if serial { edges.len() } else { 0 };
                stage += 1;
            }
            self.colors += coloring.colors();
        }
        work.finish_lanes();
    }

    /// The width of the cheapest sweep. A batch of W lanes costs about 12 + W: its arithmetic costs the same
    /// at every width, and its lanes are gathered one by one.
    fn fitting(&self, [narrowest, widest]: [LaneWidth; 2]) -> LaneWidth {
        let cost = |width: LaneWidth| {
            let slots: usize = self.groups.iter().map(|g| g.coloring.lane_slots(width.lanes())).sum();
            slots / width.lanes() * (BATCH_COST + width.lanes())
        };
        let allowed = LaneWidth::ALL.into_iter().rev().filter(|w| (narrowest..=widest).contains(w));
        allowed.min_by_key(|&w| cost(w)).unwrap_or(widest)
    }

    /// Color of each of `contacts` contacts, numbered in solving order; `None` for those without a color. Valid after
    /// [`Self::colored`].
    pub fn contact_colors(&self, contacts: usize) -> Vec<Option<u16>> {
        let mut colors = vec![None; contacts];
        let mut first = 0;
        for Group { entries, coloring, .. } in &self.groups {
            for (entry, &color) in entries.iter().zip(coloring.color_of()) {
                let place = colors.get_mut(entry.index as usize).filter(|_| entry.kind == 0);
                place
                    .into_iter()
                    .for_each(|place| *place = (color != OVERFLOW).then(|| first + u16::from(color)));
            }
            first += coloring.colors() as u16;
        }
        colors
    }

    /// Assigns contacts one after the other, ordered by a hash of their shapes.
    pub fn shuffled(
        &mut self,
        work: &mut Workspace,
        features: &Features,
        contacts: &[Contact],
        sides: &Sides<'_, impl Fn(u32) -> PartnerKind>,
    ) {
        let mut places = std::mem::take(&mut self.places);
        places.clear();
        places.extend(0..contacts.len() as u32);
        let shapes = |i: u32| {
            let Contact { shape_a, shape_b, .. } = contacts[i as usize];
            u64::from(shape_a) << 32 | u64::from(shape_b)
        };
        places.sort_unstable_by_key(|&i| (mixed(shapes(i)), i));
        self.serial(work, features, contacts, places.iter().copied(), sides);
        self.places = places;
    }

    /// Assigns contacts one after the other, in `order`, after the constraints of other types.
    pub fn serial(
        &mut self,
        work: &mut Workspace,
        features: &Features,
        contacts: &[Contact],
        order: impl Iterator<Item = u32>,
        sides: &Sides<'_, impl Fn(u32) -> PartnerKind>,
    ) {
        work.clear_lanes(1);
        (self.colors, self.overflow) = (0, 0);
        let list = &mut self.color;
        list.clear();
        for (k, joined) in work.types.iter().enumerate() {
            let entry = |(i, &rows): (usize, &[u32; 2])| Assigned {
                level: sides.level(rows),
                kind: k as u32 + 1,
                index: i as u32,
                rows,
            };
            let awake = joined.kind.ends().iter().enumerate().filter(|(_, rows)| !sides.sleeps(**rows));
            list.extend(awake.map(entry));
        }
        let rows = |i: u32| [contacts[i as usize].body_a, contacts[i as usize].body_b];
        list.extend(order.filter(|&i| !sides.sleeps(rows(i))).map(|i| Assigned {
            level: sides.level(rows(i)),
            kind: 0,
            index: i,
            rows: rows(i),
        }));
        if sides.levels.is_some() {
            list.sort_by_key(|e| e.level);
        }
        let place = |e: &Assigned| (e.place(), (sides.partner)(e.rows[0]));
        for (stage, run) in list.chunk_by(|i, j| place(i) == place(j)).enumerate() {
            let ((level, kind), partner) = place(&run[0]);
            let place = Place { partner, stage: stage as u32, level, disjoint: false };
            work.push(kind, place, features, run.iter().map(|e| (e.index, e.rows)), sides.bodies as u32);
        }
        work.finish_lanes();
    }
}

impl Workspace {
    fn clear_lanes(&mut self, width: usize) {
        let types = self.types.iter_mut().map(|t| (&mut t.lanes, &mut t.serial));
        for (lanes, serial) in types.chain([(&mut self.lanes, &mut self.serial)]) {
            lanes.clear(width);
            serial.clear(1);
        }
    }

    fn push(
        &mut self,
        kind: u32,
        place: Place,
        features: &Features,
        entries: impl Iterator<Item = (u32, [u32; 2])>,
        inert: u32,
    ) {
        let (batches, stride) = match self.types.get_mut((kind as usize).wrapping_sub(1)) {
            Some(t) => ([&mut t.lanes, &mut t.serial], t.kind.stride()),
            None => {
                let layout = Layout::for_features(features, place.partner);
                ([&mut self.lanes, &mut self.serial], layout.stride)
            }
        };
        batches[usize::from(!place.disjoint)].push(place, stride, entries, inert);
    }

    fn finish_lanes(&mut self) {
        let types = self.types.iter_mut().flat_map(|t| [&mut t.lanes, &mut t.serial]);
        types.chain([&mut self.lanes, &mut self.serial]).for_each(|batches| {
            batches.sort_by_stage();
            batches.reserve_buffer();
        });
    }
}
