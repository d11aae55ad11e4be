//! What contacts keep for bouncing, beside their records: only scenes in which something bounces
//! have it.

use super::batches::Segment;
use crate::engine::lanes::{Block, Lanes, held};
use std::slice::ChunksExactMut;

/// Side records: per batch four vectors, then seven per point. What they hold, [`super::impact`] says, and
/// after it [`super::restitution`]: the acceleration a of approach (m/s²), then per point the energy e² E₀
/// (m²/s²; zero where it shall not bounce) and the largest normal impulse so far (N·s).
#[derive(Debug, Default)]
pub struct Bounces {
    buffer: Vec<Block>,
}

/// Vectors per side record.
const fn stride(points: usize) -> usize {
    4 + 7 * points
}

impl Bounces {
    /// The side records of a segment, batch by batch.
    ///
    /// # Panics
    /// If they were not prepared.
    pub(super) fn of<L: Lanes>(&mut self, segment: &Segment, points: usize) -> ChunksExactMut<'_, L> {
        let (first, stride) = (segment.first_lane / L::WIDTH, stride(points));
        let range = first * stride..(first + segment.batches) * stride;
        let records = bytemuck::cast_slice_mut(&mut self.buffer).get_mut(range);
        records.expect("bounces of these batches: `prepare` makes them").chunks_exact_mut(stride)
    }

    /// Makes room for `lanes` lanes of `points`-point contacts.
    pub(super) fn reserve(&mut self, lanes: usize, points: usize) {
        self.buffer.resize((lanes * stride(points)).div_ceil(16), Block::default());
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.buffer)
    }

    /// Bytes in use for `lanes` lanes of `points`-point contacts.
    pub fn bytes(lanes: usize, points: usize) -> usize {
        4 * lanes * stride(points)
    }
}
