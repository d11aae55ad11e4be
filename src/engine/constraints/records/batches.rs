//! Assignment of contacts to lanes: batches, segments, and the buffer of records.

use crate::constraints::records::features::{Features, Layout, LayoutOf, PartnerKind};
use crate::constraints::records::order::SweepOrder;
pub use crate::constraints::records::segment::Segment;
use crate::lanes::{Block, IndexList, Indices, LaneIndex, Lanes};
use crate::workers::Workers;
use std::ops::Range;

/// Attributes of a new [`Segment`] besides its records.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub partner: PartnerKind,
    pub stage: u32,
    pub level: u32,
    pub disjoint: bool,
}

/// Constraint records of one width, and the contact in each lane.
///
/// Lanes without a contact repeat the first contact of their batch and use the inert row. So all indices
/// are valid if the contacts and rows exist.
#[derive(Clone, Debug, Default)]
pub struct Batches {
    width: usize,
    segments: Vec<Segment>,
    /// `segments` in the order of their lanes.
    by_lane: Vec<Segment>,
    /// `segments` in the order of a sweep. Passes run over those in `focus`.
    visits: Vec<Segment>,
    focus: Range<usize>,
    order: SweepOrder,
    contact: Indices,
    row_a: Indices,
    row_b: Indices,
    /// Records, `stride × width` floats each.
    buffer: Vec<Block>,
    /// Lane vectors of the buffer that are in use.
    vectors: usize,
    /// Slots in vectors over contact points.
    slots: usize,
    /// Whether [`Self::check_disjoint`] has checked the rows.
    is_checked: bool,
}

/// The records of a segment or of a part of it, and the indices by which its lanes gather.
pub struct SegmentRecords<'a, L> {
    /// What they are records of.
    pub segment: Segment,
    /// `[batches × stride]`
    pub records: &'a mut [L],
    /// `[batches × width]`
    pub contact: IndexList<'a>,
    /// `[batches × width]`
    pub row_a: IndexList<'a>,
    /// `[batches × width]`
    pub row_b: IndexList<'a>,
}

impl<'a, L: Lanes> SegmentRecords<'a, L> {
    /// The records in `parts` parts of whole batches; fewer if there are not as many.
    pub(crate) fn into_parts(self, parts: usize) -> impl Iterator<Item = Self> {
        let SegmentRecords { segment, mut records, contact, row_a, row_b } = self;
        let whole = if L::WIDTH < 16 { TOGETHER } else { 1 };
        let each = segment.batches.div_ceil(parts).next_multiple_of(whole).max(1);
        (0..segment.batches).step_by(each).map(move |first| {
            let batches = each.min(segment.batches - first);
            let (own, rest) = std::mem::take(&mut records).split_at_mut(batches * segment.stride);
            records = rest;
            let lanes = first * L::WIDTH..(first + batches) * L::WIDTH;
            SegmentRecords {
                segment: Segment {
                    first_lane: segment.first_lane + lanes.start,
                    contacts: segment.contacts.saturating_sub(lanes.start).min(lanes.len()),
                    batches,
                    first_slot: segment.first_slot + lanes.start,
                    first_vector: segment.first_vector + first * segment.stride,
                    ..segment
                },
                records: own,
                contact: contact.part(lanes.clone()),
                row_a: row_a.part(lanes.clone()),
                row_b: row_b.part(lanes),
            }
        })
    }
}

/// A record of constraints of any type.
pub(crate) struct VisitedRecord<'a, L: Lanes> {
    /// `[stride]`
    pub record: &'a mut [L],
    /// The constraint in each lane.
    pub names: LaneIndex<'a, L::Index>,
    /// Number of lanes that hold a constraint.
    pub filled: usize,
    /// Rows of bodies a and b.
    pub rows: [LaneIndex<'a, L::Index>; 2],
    /// Whether impulses push bodies a and b.
    pub pushes: [bool; 2],
    /// Slot of the first lane in vectors over constraints.
    pub slot: usize,
}

impl<L: Lanes> VisitedRecord<'_, L> {
    /// The record with bodies a and b exchanged if `swapped`.
    #[inline(always)]
    pub fn with_ends(mut self, swapped: bool) -> Self {
        if swapped {
            self.rows.reverse();
            self.pushes.reverse();
        }
        self
    }
}

/// The two sets of batches in a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Colored batches, at the width of the step.
    Lanes,
    /// Batches of contacts that are solved one after the other.
    Serial,
}

impl Part {
    /// Selects the batches of this part.
    pub(crate) fn of<'b>(self, lanes: &'b mut Batches, serial: &'b mut Batches) -> &'b mut Batches {
        match self {
            Part::Lanes => lanes,
            Part::Serial => serial,
        }
    }
}

/// Number of batches of fewer than 16 lanes that kernels process together.
pub(crate) const TOGETHER: usize = 8;

/// Contacts are appended in chunks of this size, because the bound of an index list is computed in lanes.
const PART: usize = 64;

impl Batches {
    /// Lanes per batch.
    pub fn width(&self) -> usize {
        self.width
    }

    /// All segments, in the order of their stages.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// The segment of a lane.
    ///
    /// # Panics
    /// If there is no such lane.
    pub(crate) fn segment_of(&self, lane: usize) -> &Segment {
        &self.by_lane[self.by_lane.partition_point(|segment| segment.first_lane <= lane) - 1]
    }

    /// Segments that a pass runs over, in order. All of them, unless [`Self::arrange`] selected others.
    pub fn visits(&self) -> &[Segment] {
        &self.visits[self.focus.clone()]
    }

    /// Calls `visit` with each segment that a pass runs over, in order, and with the layout of its records.
    #[inline(always)]
    pub(crate) fn each_segment(
        &mut self,
        layout_of: LayoutOf,
        mut visit: impl FnMut(&mut Self, &Segment, &Layout),
    ) {
        for i in 0..self.visits().len() {
            let segment = self.visits()[i];
            visit(self, &segment, &layout_of(segment.partner));
        }
    }

    /// Sets the order of the segments that passes run over.
    pub fn arrange(&mut self, order: SweepOrder) {
        if order != self.order {
            order.arrange(&self.segments, self.width, &mut self.visits);
            self.order = order;
        }
        self.focus = 0..self.visits.len();
    }

    /// Rank of the first visit after the focused ones; `None` if there is none.
    pub(crate) fn next_rank(&self) -> Option<u64> {
        self.visits.get(self.focus.end).map(|s| self.order.rank(s.stage))
    }

    /// Makes passes run over nothing. [`Self::focus_on`] then starts from the beginning.
    pub(crate) fn unfocus(&mut self) {
        self.focus = 0..0;
    }

    /// Makes passes run over the next visits, as long as they have this rank.
    pub(crate) fn focus_on(&mut self, rank: u64) {
        let start = self.focus.end;
        let of_rank = |s: &&Segment| self.order.rank(s.stage) == rank;
        let count = self.visits[start..].iter().take_while(of_rank).count();
        self.focus = start..start + count;
    }

    /// Contact in each lane; padding repeats one. `[lanes]`
    pub fn contact(&self) -> &[u32] {
        &self.contact
    }

    /// Row of body a in each lane; the inert row where there is no contact. `[lanes]`
    pub fn row_a(&self) -> &[u32] {
        &self.row_a
    }

    /// Row of body b in each lane; the inert row where there is no contact. `[lanes]`
    pub fn row_b(&self) -> &[u32] {
        &self.row_b
    }

    /// Lanes of all segments, padding included.
    pub fn lanes(&self) -> usize {
        self.contact.len()
    }

    /// The part of the buffer that holds records, in whole blocks.
    ///
    /// # Panics
    /// As [`Self::records_of`] without a buffer.
    pub fn records(&self) -> &[Block] {
        &self.buffer[..self.blocks()]
    }

    /// As [`Self::records`], mutable.
    pub fn records_mut(&mut self) -> &mut [Block] {
        let blocks = self.blocks();
        &mut self.buffer[..blocks]
    }

    fn blocks(&self) -> usize {
        (self.vectors * self.width).div_ceil(16)
    }

    /// Empties the batches for a new step.
    ///
    /// # Panics
    /// If the width is 0.
    pub fn clear(&mut self, width: usize) {
        assert!(width > 0, "batches without lanes");
        self.width = width;
        self.segments.clear();
        self.by_lane.clear();
        self.visits.clear();
        (self.focus, self.order) = (0..0, SweepOrder::Forward);
        self.contact.clear();
        self.row_a.clear();
        self.row_b.clear();
        (self.vectors, self.slots) = (0, 0);
        self.is_checked = false;
    }

    /// Checks that no two lanes of a disjoint segment push the same row, apart from the `inert` one. Parts of the segments
    /// may then run in several threads ([`Self::is_checked`]). `seen` is scratch memory.
    ///
    /// # Panics
    /// If they do.
    pub(crate) fn check_disjoint(&mut self, inert: u32, seen: &mut Vec<Vec<u32>>, workers: &Workers) {
        let Batches { segments, row_a, row_b, .. } = self;
        seen.resize_with(workers.count().max(seen.len()), Vec::new);
        let seen = &mut seen[..workers.count()];
        seen.iter_mut().for_each(|seen| {
            seen.clear();
            seen.resize(inert as usize + 1, 0);
        });
        workers.in_turn(segments, seen, |segment, seen| {
            if !segment.disjoint {
                return;
            }
            let lanes = segment.first_lane..segment.first_lane + segment.contacts;
            let (pushed_a, mark) =
                (if segment.pushes_a() { lanes.clone() } else { 0..0 }, lanes.start as u32 + 1);
            for &row in row_a[pushed_a].iter().chain(&row_b[lanes]) {
                let last = std::mem::replace(&mut seen[row as usize], mark);
                assert!(last != mark, "row {row} twice in one color");
            }
        });
        self.is_checked = true;
    }

    /// Whether rows of disjoint segments are known to be distinct; see [`Self::check_disjoint`].
    #[inline(always)]
    pub(crate) fn is_checked(&self) -> bool {
        self.is_checked
    }

    /// Appends one segment of contacts, each with the rows of its bodies a and b. Padding lanes point at the
    /// `inert` row and fill up the last batch. The segment has a stage of its own. It is a color, or with one
    /// lane per batch a list of contacts to solve one after the other.
    ///
    /// # Panics
    /// If the batches have no width yet ([`Self::clear`]).
    pub fn push_segment(
        &mut self,
        partner: PartnerKind,
        layout: &Layout,
        contacts: impl Iterator<Item = (u32, [u32; 2])>,
        inert: u32,
    ) {
        let (stage, disjoint) = (self.segments.len() as u32, self.width > 1);
        self.push(Place { partner, stage, level: 0, disjoint }, layout.stride, contacts, inert);
    }

    /// Appends one segment of constraints of any type with records of `stride` lane vectors; see
    /// [`Self::push_segment`].
    pub(crate) fn push(
        &mut self,
        Place { partner, stage, level, disjoint }: Place,
        stride: usize,
        contacts: impl Iterator<Item = (u32, [u32; 2])>,
        inert: u32,
    ) {
        assert!(self.width > 0, "batches without lanes: `clear` gives them their width");
        self.is_checked = false;
        let first_lane = self.contact.len();
        let mut contacts = contacts;
        let mut part = [[0; PART]; 3];
        loop {
            let mut count = 0;
            for (k, (contact, [a, b])) in (0..PART).zip(&mut contacts) {
                (part[0][k], part[1][k], part[2][k]) = (contact, a, b);
                count = k + 1;
            }
            let lists = [&mut self.contact, &mut self.row_a, &mut self.row_b];
            lists.into_iter().zip(&part).for_each(|(list, part)| list.extend(&part[..count]));
            if count < PART {
                break;
            }
        }
        let contacts = self.contact.len() - first_lane;
        if contacts == 0 {
            return;
        }
        let batches = contacts.div_ceil(self.width);
        let end = first_lane + batches * self.width;
        self.contact.fill_to(end, self.contact[end - self.width]);
        self.row_a.fill_to(end, inert);
        self.row_b.fill_to(end, inert);
        let first_vector = self.vectors;
        // The slot does not depend on the width: disjoint segments have any width, the others have one lane.
        let first_slot = if disjoint { self.slots.next_multiple_of(16) } else { self.slots };
        self.slots = first_slot + contacts;
        let segment = Segment {
            partner,
            first_lane,
            contacts,
            batches,
            first_slot,
            first_vector,
            stride,
            stage,
            level,
            disjoint,
        };
        self.segments.push(segment);
        self.by_lane.push(segment);
        self.visits.push(segment);
        (self.focus, self.order) = (0..self.visits.len(), SweepOrder::Forward);
        self.vectors += batches * stride;
    }

    /// Sorts segments by their stages; their records stay where they are.
    pub(crate) fn sort_by_stage(&mut self) {
        let is_later = |pair: &[Segment]| pair[0].stage > pair[1].stage;
        if self.segments.windows(2).any(is_later) {
            self.segments.sort_by_key(|s| s.stage);
            self.visits.clone_from(&self.segments);
        }
    }

    /// Allocates the buffer for the records of all segments.
    pub fn reserve_buffer(&mut self) {
        let blocks = self.blocks();
        if self.buffer.len() < blocks {
            self.buffer.resize(blocks, Block::default());
        }
    }

    /// Exchanges these batches for `other`, without the buffers of records: those stay where they are.
    pub(crate) fn exchange(&mut self, other: &mut Batches) {
        std::mem::swap(self, other);
        std::mem::swap(&mut self.buffer, &mut other.buffer);
        self.reserve_buffer();
    }

    /// Checks that these batches fit kernels of `width` lanes, and that all their rows and contacts exist.
    ///
    /// Gathers and scatters check this as well. This check runs before the step begins.
    ///
    /// # Panics
    /// If not.
    pub fn assert_fits(&self, width: usize, rows: usize, contacts: usize) {
        if self.segments.is_empty() {
            return;
        }
        assert!(self.width == width, "batches of {} lanes for kernels of {width}", self.width);
        let bound = self.row_a.list().bound().max(self.row_b.list().bound());
        assert!(bound <= rows, "batches name row {} of {rows}", bound - 1);
        let bound = self.contact.list().bound();
        assert!(bound <= contacts, "batches name contact {} of {contacts}", bound - 1);
    }

    /// The records of a segment, for a kernel of the same width and layout.
    ///
    /// # Panics
    /// If the batches have another width or layout, or no buffer ([`Self::reserve_buffer`]).
    #[inline(always)]
    pub fn records_of<L: Lanes>(&mut self, segment: &Segment, layout: &Layout) -> SegmentRecords<'_, L> {
        self.records_with_stride(segment, layout.stride)
    }

    /// As [`Self::records_of`], for records of `stride` lane vectors.
    ///
    /// # Panics
    /// As [`Self::records_of`].
    #[inline(always)]
    pub fn records_with_stride<L: Lanes>(
        &mut self,
        segment: &Segment,
        stride: usize,
    ) -> SegmentRecords<'_, L> {
        assert!(self.width == L::WIDTH, "batches of {} lanes for a kernel of {}", self.width, L::WIDTH);
        assert!(segment.stride == stride, "records of another kernel's layout");
        let lanes = segment.first_lane..segment.first_lane + segment.batches * L::WIDTH;
        let vectors = segment.first_vector..segment.first_vector + segment.batches * segment.stride;
        let buffer: &mut [L] = bytemuck::cast_slice_mut(&mut self.buffer);
        assert!(vectors.end <= buffer.len(), "no room for records: `reserve_buffer` makes it");
        SegmentRecords {
            segment: *segment,
            records: &mut buffer[vectors],
            contact: self.contact.list().part(lanes.clone()),
            row_a: self.row_a.list().part(lanes.clone()),
            row_b: self.row_b.list().part(lanes),
        }
    }

    /// Calls `visit` for every record of `stride` lane vectors, in the order of the visits.
    ///
    /// # Panics
    /// As [`Self::records_of`].
    #[inline(always)]
    pub(crate) fn for_each_record<L: Lanes>(
        &mut self,
        stride: usize,
        mut visit: impl FnMut(VisitedRecord<'_, L>),
    ) {
        for i in self.focus.clone() {
            let segment = self.visits[i];
            let parts = self.records_with_stride::<L>(&segment, stride);
            let rows = parts.row_a.batches::<L::Index>().zip(parts.row_b.batches::<L::Index>());
            let lists = parts.contact.batches::<L::Index>().zip(rows).enumerate();
            for (record, (batch, (names, (a, b)))) in parts.records.chunks_exact_mut(stride).zip(lists) {
                let slot = segment.first_slot + batch * L::WIDTH;
                let filled = segment.filled(batch, L::WIDTH);
                let pushes = [segment.pushes_a(), true];
                visit(VisitedRecord { record, names, filled, rows: [a, b], pushes, slot });
            }
        }
    }

    /// Groups of sixteen slots in vectors over contact points.
    pub(crate) fn groups(&self) -> usize {
        self.slots.div_ceil(16)
    }

    /// Bytes of records and indices, padding included.
    pub fn bytes(&self) -> usize {
        let static_lanes: usize = self
            .segments
            .iter()
            .filter(|s| s.partner == PartnerKind::Static)
            .map(|s| s.batches * self.width)
            .sum();
        4 * (self.vectors * self.width + 2 * self.contact.len() - static_lanes)
    }

    /// Slot in vectors over contact points, and index, of every contact.
    pub fn slots(&self) -> impl Iterator<Item = (usize, u32)> {
        self.segments.iter().flat_map(|segment| {
            let contacts = &self.contact[segment.first_lane..][..segment.contacts];
            (segment.first_slot..).zip(contacts.iter().copied())
        })
    }

    /// Calls `visit(contact, record, lane)` for every lane that holds a contact, where
    /// quantity `q` of the contact is `record[q · width + lane]`.
    ///
    /// # Panics
    /// If the records were laid out for other features, or have no buffer ([`Self::reserve_buffer`]).
    pub fn for_each_lane(
        &mut self,
        features: &Features,
        mut visit: impl FnMut(u32, &Layout, &mut [f32], usize),
    ) {
        let floats: &mut [f32] = bytemuck::cast_slice_mut(&mut self.buffer);
        for segment in &self.segments {
            let layout = Layout::for_features(features, segment.partner);
            assert!(segment.stride == layout.stride, "records of another layout");
            let record_floats = layout.stride * self.width;
            let start = segment.first_vector * self.width;
            for batch in 0..segment.batches {
                let record = &mut floats[start + batch * record_floats..][..record_floats];
                let lanes = &self.contact[segment.first_lane + batch * self.width..];
                for (lane, &contact) in lanes[..segment.filled(batch, self.width)].iter().enumerate() {
                    visit(contact, &layout, record, lane);
                }
            }
        }
    }
}
