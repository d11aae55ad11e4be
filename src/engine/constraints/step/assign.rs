//! Assignment of constraints to lanes: by colors, or one after the other.

use super::Workspace;
use crate::coloring::{Coloring, EXEMPT, OVERFLOW};
use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::records::batches::Place;
use crate::constraints::records::features::{Features, Layout, PartnerKind};
use crate::constraints::records::graph::{Graph, UNSUPPORTED};
use crate::constraints::records::order::mixed;
use crate::contacts::Contact;
use crate::lanes::LaneWidth;
use crate::workers::{Apart, Workers};

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

/// Constraints with one kind of body a, one entry each in every list.
#[derive(Clone, Debug, Default)]
struct Entries {
    index: Vec<u32>,
    rows: Vec<[u32; 2]>,
    /// See [`Assigned::place`]; empty if all are (0, 0).
    places: Vec<(u32, u32)>,
}

impl Entries {
    fn clear(&mut self) {
        self.index.clear();
        self.rows.clear();
        self.places.clear();
    }

    fn extend(&mut self, other: &Entries) {
        self.index.extend_from_slice(&other.index);
        self.rows.extend_from_slice(&other.rows);
        self.places.extend_from_slice(&other.places);
    }

    fn place(&self, entry: usize) -> (u32, u32) {
        self.places.get(entry).copied().unwrap_or_default()
    }

    fn get(&self, entry: usize) -> Assigned {
        let (level, kind) = self.place(entry);
        Assigned { level, kind, index: self.index[entry], rows: self.rows[entry] }
    }

    /// Edges for a coloring: a is exempt unless it is dynamic.
    fn edges(&self, partner: PartnerKind) -> impl ExactSizeIterator<Item = [u32; 2]> + Clone {
        let exempt = if partner == PartnerKind::Dynamic { 0 } else { EXEMPT };
        self.rows.iter().map(move |&[a, b]| [a | exempt, b])
    }
}

/// Assigns lanes to constraints; keeps its memory from call to call.
#[derive(Clone, Debug, Default)]
pub struct Assignment {
    /// Constraints by [`PartnerKind`], as each thread lists them; in the end the first lists have all.
    lists: Vec<Apart<[Entries; 3]>>,
    colorings: [Coloring; 3],
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

/// Least number of contacts that are worth a thread.
const LEAST_CONTACTS: usize = 1024;

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
        sides: &Sides<'_, impl Fn(u32) -> PartnerKind + Sync>,
    ) {
        (self.colors, self.overflow) = (0, 0);
        let is_simple = sides.levels.is_none() && work.types.is_empty();
        self.list(&work.types, contacts, sides, is_simple, &work.workers);
        let Some(Apart(lists)) = self.lists.first() else { return };
        for ((entries, coloring), partner) in lists.iter().zip(&mut self.colorings).zip(PartnerKind::ALL) {
            coloring.assign(entries.edges(partner), sides.bodies);
        }
        work.clear_lanes(self.fitting(widths).lanes());
        let inert = sides.bodies as u32;
        let color = &mut self.color;
        let mut stage = 0;
        for ((entries, coloring), partner) in lists.iter().zip(&self.colorings).zip(PartnerKind::ALL) {
            for of_color in 0..=coloring.colors() {
                let serial = of_color == coloring.colors();
                let edges = if serial { coloring.overflow() } else { coloring.color(of_color) };
                let place = |level| Place {
                    partner,
                    stage: level * STAGES_PER_LEVEL + stage,
                    level,
                    disjoint: !serial,
                };
                if is_simple {
                    let of_edge = |&edge: &u32| (entries.index[edge as usize], entries.rows[edge as usize]);
                    work.push(0, place(0), features, edges.iter().map(of_edge), inert);
                } else {
                    color.clear();
                    color.extend(edges.iter().map(|&edge| entries.get(edge as usize)));
                    color.sort_unstable_by_key(|e| (e.place(), e.index));
                    for run in color.chunk_by(|a, b| a.place() == b.place()) {
                        let Assigned { level, kind, .. } = run[0];
                        let run = run.iter().map(|e| (e.index, e.rows));
                        work.push(kind, place(level), features, run, inert);
                    }
                }
                self.overflow += if serial { edges.len() } else { 0 };
                stage += 1;
            }
            self.colors += coloring.colors();
        }
        work.finish_lanes();
    }

    /// Lists contacts, then constraints of other `types`. Each thread lists the contacts of a part.
    fn list(
        &mut self,
        types: &[ConstraintSet],
        contacts: &[Contact],
        sides: &Sides<'_, impl Fn(u32) -> PartnerKind + Sync>,
        is_simple: bool,
        workers: &Workers,
    ) {
        let add = |lists: &mut [Entries; 3], kind: u32, index: usize, rows: [u32; 2]| {
            if sides.sleeps(rows) {
                return;
            }
            let list = &mut lists[(sides.partner)(rows[0]) as usize];
            list.index.push(index as u32);
            list.rows.push(rows);
            if !is_simple {
                list.places.push((sides.level(rows), kind));
            }
        };
        let list = |first: usize, contacts: &[Contact], lists: &mut [Entries; 3]| {
            lists.iter_mut().for_each(Entries::clear);
            for (i, contact) in (first..).zip(contacts) {
                add(lists, 0, i, [contact.body_a, contact.body_b]);
            }
        };
        let parts = workers.each_part(contacts, LEAST_CONTACTS, &mut self.lists, list);
        let Some((Apart(all), rest)) = parts.split_first_mut() else { return };
        for Apart(lists) in rest {
            all.iter_mut().zip(lists).for_each(|(all, list)| all.extend(list));
        }
        for (kind, joined) in (1..).zip(types) {
            for (i, &rows) in joined.kind.ends().iter().enumerate() {
                add(all, kind, i, rows);
            }
        }
    }

    /// The width of the cheapest sweep. A batch of W lanes costs about 12 + W: its arithmetic costs the same
    /// at every width, and its lanes are gathered one by one.
    fn fitting(&self, [narrowest, widest]: [LaneWidth; 2]) -> LaneWidth {
        let cost = |width: LaneWidth| {
            let slots: usize = self.colorings.iter().map(|c| c.lane_slots(width.lanes())).sum();
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
        let Some(Apart(lists)) = self.lists.first() else { return colors };
        for (entries, coloring) in lists.iter().zip(&self.colorings) {
            for (entry, (&index, &color)) in entries.index.iter().zip(coloring.color_of()).enumerate() {
                let place = colors.get_mut(index as usize).filter(|_| entries.place(entry).1 == 0);
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
