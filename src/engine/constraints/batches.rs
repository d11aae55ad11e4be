//! Which contact is in which lane: batches, segments, and the buffer that holds records.

use super::features::{Features, Layout, OppositeKind};
use crate::engine::lanes::{Block, IndexList, Indices, Lanes, held};
use std::mem::size_of_val;

/// Batches of one colour and one kind of body a: one kernel runs over them.
///
/// No dynamic body occurs twice in a segment, unless the segment is serial (width 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// What stands opposite body b.
    pub opposite: OppositeKind,
    /// First lane slot (a multiple of the width).
    pub first_lane: usize,
    /// Lanes that hold a contact: the first ones. What the last batch has beyond is padding.
    pub contacts: usize,
    /// Batches of `width` lanes.
    pub batches: usize,
    /// Where the first record starts in the buffer, in lane vectors.
    pub first_vector: usize,
    /// Lane vectors of a record ([`Layout::stride`]).
    pub stride: usize,
}

impl Segment {
    /// How many lanes of a batch hold a contact.
    #[inline(always)]
    pub fn filled(&self, batch: usize, width: usize) -> usize {
        self.contacts.saturating_sub(batch * width).min(width)
    }
}

/// Constraint records of one width, with the lane each contact has.
///
/// Lanes without a contact repeat the first contact of their batch, and their rows are the inert one:
/// whatever is gathered by these indices exists if contacts and rows do.
#[derive(Clone, Debug, Default)]
pub struct Batches {
    width: usize,
    segments: Vec<Segment>,
    contact: Indices,
    row_a: Indices,
    row_b: Indices,
    /// Records, `stride × width` floats each.
    buffer: Vec<Block>,
    /// Lane vectors in use of the buffer.
    vectors: usize,
}

/// The records of a segment, and by what they gather.
pub struct SegmentRecords<'a, L> {
    /// `[batches × stride]`
    pub records: &'a mut [L],
    /// `[batches × width]`
    pub contact: IndexList<'a>,
    /// `[batches × width]`
    pub row_a: IndexList<'a>,
    /// `[batches × width]`
    pub row_b: IndexList<'a>,
}

/// Contacts are added by so many at a time, since the bound of a list is found in lanes.
const PART: usize = 64;

impl Batches {
    /// Lanes per batch.
    pub fn width(&self) -> usize {
        self.width
    }

    /// What runs, in order.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
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

    /// As [`Self::records`], to write.
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
        self.contact.clear();
        self.row_a.clear();
        self.row_b.clear();
        self.vectors = 0;
    }

    /// Appends one segment of contacts, each with the rows of its a and b, padded to whole
    /// batches with lanes that point at the `inert` row.
    ///
    /// # Panics
    /// If the batches have no width yet ([`Self::clear`]).
    pub fn push_segment(
        &mut self,
        opposite: OppositeKind,
        layout: &Layout,
        contacts: impl Iterator<Item = (u32, [u32; 2])>,
        inert: u32,
    ) {
        assert!(self.width > 0, "batches without lanes: `clear` gives them their width");
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
        let (first_vector, stride) = (self.vectors, layout.stride);
        self.segments.push(Segment { opposite, first_lane, contacts, batches, first_vector, stride });
        self.vectors += batches * stride;
    }

    /// Makes room in the buffer for the records of all segments.
    pub fn reserve_buffer(&mut self) {
        let blocks = self.blocks();
        if self.buffer.len() < blocks {
            self.buffer.resize(blocks, Block::default());
        }
    }

    /// Whether these are batches for kernels of `width` lanes, and all their rows and contacts exist.
    ///
    /// Gathers and scatters see to that themselves; this says it before a step has begun.
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

    /// The records of a segment of these batches for a kernel of as many lanes and of the same layout.
    ///
    /// # Panics
    /// If the batches are of another width or layout, or have no buffer ([`Self::reserve_buffer`]).
    #[inline(always)]
    pub fn records_of<L: Lanes>(&mut self, segment: &Segment, layout: &Layout) -> SegmentRecords<'_, L> {
        assert!(self.width == L::WIDTH, "batches of {} lanes for a kernel of {}", self.width, L::WIDTH);
        assert!(segment.stride == layout.stride, "records of another kernel's layout");
        let lanes = segment.first_lane..segment.first_lane + segment.batches * L::WIDTH;
        let vectors = segment.first_vector..segment.first_vector + segment.batches * segment.stride;
        let buffer: &mut [L] = bytemuck::cast_slice_mut(&mut self.buffer);
        assert!(vectors.end <= buffer.len(), "no room for records: `reserve_buffer` makes it");
        SegmentRecords {
            records: &mut buffer[vectors],
            contact: self.contact.list().part(lanes.clone()),
            row_a: self.row_a.list().part(lanes.clone()),
            row_b: self.row_b.list().part(lanes),
        }
    }

    /// Bytes of records and indices, padding included.
    pub fn bytes(&self) -> usize {
        let static_lanes: usize = self
            .segments
            .iter()
            .filter(|s| s.opposite == OppositeKind::Static)
            .map(|s| s.batches * self.width)
            .sum();
        4 * (self.vectors * self.width + 2 * self.contact.len() - static_lanes)
    }

    /// Per array, bytes held and bytes in use.
    pub fn memory(&self) -> [(usize, usize); 5] {
        let of = |list: &Indices| (list.held_bytes(), size_of_val::<[u32]>(list));
        [
            (held(&self.segments), size_of_val(self.segments.as_slice())),
            of(&self.contact),
            of(&self.row_a),
            of(&self.row_b),
            (held(&self.buffer), 4 * self.vectors * self.width),
        ]
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
            let layout = Layout::for_features(features, segment.opposite);
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
