//! Which contact stands in which lane: batches, segments, and the slab that holds records.

use super::features::{Features, Layout, OppositeKind};
use crate::engine::lanes::Block;

/// Marks a lane without a contact.
pub const PADDING: u32 = u32::MAX;

/// Batches of one colour and one kind of body a: one kernel runs over them.
///
/// No dynamic body occurs twice in a segment, unless the segment is serial (width 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// What stands opposite body b.
    pub opposite: OppositeKind,
    /// First lane slot (a multiple of the width).
    pub first_lane: usize,
    /// Batches of `width` lanes.
    pub batches: usize,
    /// Where the first record starts in the slab, in lane vectors.
    pub first_vector: usize,
}

/// Constraint records of one width, with the lane each contact has.
#[derive(Clone, Debug, Default)]
pub struct Batches {
    /// Lanes per batch.
    pub width: usize,
    /// What runs, in order.
    pub segments: Vec<Segment>,
    /// Contact in each lane, or [`PADDING`]. `[lanes]`
    pub contact: Vec<u32>,
    /// Row of body a in each lane; the inert row where there is no contact. `[lanes]`
    pub row_a: Vec<u32>,
    /// Row of body b in each lane; the inert row where there is no contact. `[lanes]`
    pub row_b: Vec<u32>,
    /// Records, `stride × width` floats each.
    pub buffer: Vec<Block>,
    /// Lane vectors in use of the slab.
    pub vectors: usize,
}

impl Batches {
    /// Empties the batches for a new step.
    pub fn clear(&mut self, width: usize) {
        self.width = width;
        self.segments.clear();
        self.contact.clear();
        self.row_a.clear();
        self.row_b.clear();
        self.vectors = 0;
    }

    /// Appends one segment of contacts, each with the rows of its a and b, padded to whole
    /// batches with lanes that point at the `inert` row.
    pub fn push_segment(
        &mut self,
        opposite: OppositeKind,
        layout: &Layout,
        contacts: impl ExactSizeIterator<Item = (u32, [u32; 2])>,
        inert: u32,
    ) {
        if contacts.len() == 0 {
            return;
        }
        let batches = contacts.len().div_ceil(self.width);
        let first_lane = self.contact.len();
        self.segments.push(Segment { opposite, first_lane, batches, first_vector: self.vectors });
        for (contact, [a, b]) in contacts {
            self.contact.push(contact);
            self.row_a.push(a);
            self.row_b.push(b);
        }
        let end = first_lane + batches * self.width;
        self.contact.resize(end, PADDING);
        self.row_a.resize(end, inert);
        self.row_b.resize(end, inert);
        self.vectors += batches * layout.stride;
    }

    /// Makes room in the slab for the records of all segments.
    pub fn reserve_buffer(&mut self) {
        let blocks = (self.vectors * self.width).div_ceil(16);
        if self.buffer.len() < blocks {
            self.buffer.resize(blocks, Block::default());
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

    /// Calls `visit(contact, record, lane)` for every lane that holds a contact, where
    /// quantity `q` of the contact is `record[q · width + lane]`.
    pub fn for_each_lane(
        &mut self,
        features: &Features,
        mut visit: impl FnMut(u32, &Layout, &mut [f32], usize),
    ) {
        let floats: &mut [f32] = bytemuck::cast_slice_mut(&mut self.buffer);
        for segment in &self.segments {
            let layout = Layout::for_features(features, segment.opposite);
            let record_floats = layout.stride * self.width;
            let start = segment.first_vector * self.width;
            for batch in 0..segment.batches {
                let record = &mut floats[start + batch * record_floats..][..record_floats];
                let lanes = &self.contact[segment.first_lane + batch * self.width..][..self.width];
                for (lane, &contact) in lanes.iter().enumerate() {
                    if contact != PADDING {
                        visit(contact, &layout, record, lane);
                    }
                }
            }
        }
    }
}
