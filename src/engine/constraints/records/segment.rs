//! Batches that one kernel runs over.

use crate::engine::constraints::records::features::OppositeKind;

/// Batches of one color and one kind of body a: one kernel runs over them.
///
/// No dynamic body occurs twice in a segment, unless the segment is serial (width 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Kind of the other body, a.
    pub opposite: OppositeKind,
    /// First lane slot (a multiple of the width).
    pub first_lane: usize,
    /// Lanes that hold a contact: the first ones. What the last batch has beyond is padding.
    pub contacts: usize,
    /// Batches of `width` lanes.
    pub batches: usize,
    /// Place of its first contact in vectors over contact points ([`crate::engine::constraints::records::point_vector`]).
    pub first_slot: usize,
    /// Where the first record starts in the buffer, in lane vectors.
    pub first_vector: usize,
    /// Lane vectors of a record ([`crate::engine::constraints::records::features::Layout::stride`]).
    pub stride: usize,
    /// When it is solved: stages follow each other, and constraints of other types with the same
    /// stage share its color.
    pub stage: u32,
    /// Which level of the contact graph it is of; 0 unless contacts are grouped by level.
    pub level: u32,
    /// No two of its contacts push the same body.
    pub disjoint: bool,
}

impl Segment {
    /// Impulses change body a as well: its row is written back.
    #[inline(always)]
    pub fn pushes_a(&self) -> bool {
        self.opposite == OppositeKind::Dynamic
    }

    /// Number of lanes of a batch that hold a contact.
    #[inline(always)]
    pub fn filled(&self, batch: usize, width: usize) -> usize {
        self.contacts.saturating_sub(batch * width).min(width)
    }
}
