//! Side records for restitution. Scenes in which nothing bounces have none.

use crate::constraints::records::segment::Segment;
use crate::lanes::{Block, Lanes, held};
use std::slice::ChunksExactMut;

/// Side records. The law of impacts defines their contents ([`crate::constraints::impacts`]).
#[derive(Clone, Debug, Default)]
pub struct Bounces {
    /// Lane vectors per record.
    stride: usize,
    buffer: Vec<Block>,
}

impl Bounces {
    /// The side records of a segment, batch by batch.
    ///
    /// # Panics
    /// If they were not prepared.
    pub(crate) fn of<L: Lanes>(&mut self, segment: &Segment) -> ChunksExactMut<'_, L> {
        let (first, stride) = (segment.first_lane / L::WIDTH, self.stride);
        let range = first * stride..(first + segment.batches) * stride;
        let records = bytemuck::cast_slice_mut(&mut self.buffer).get_mut(range).filter(|_| stride > 0);
        records.expect("bounces of these batches: `prepare` makes them").chunks_exact_mut(stride)
    }

    /// Whether there are side records.
    pub(crate) fn are_prepared(&self) -> bool {
        self.stride > 0
    }

    /// Discards the side records.
    pub(crate) fn forget(&mut self) {
        self.stride = 0;
    }

    /// Allocates the records of `lanes` lanes, with `stride` lane vectors per batch.
    pub(crate) fn reserve(&mut self, lanes: usize, stride: usize) {
        self.stride = stride;
        self.buffer.resize((lanes * stride).div_ceil(16), Block::default());
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.buffer)
    }
}
