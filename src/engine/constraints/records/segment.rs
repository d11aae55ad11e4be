//! Segments: the batches that one kernel runs over.

use crate::constraints::records::features::PartnerKind;

/// Batches of one color and one kind of body a, which one kernel runs over.
///
/// No dynamic body occurs twice in a segment, unless the segment is serial (width 1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Kind of body a.
    pub partner: PartnerKind,
    /// First lane slot (a multiple of the width).
    pub first_lane: usize,
    /// Number of lanes that hold a contact. They come first; the rest of the last batch is padding.
    pub contacts: usize,
    /// Number of batches of `width` lanes.
    pub batches: usize,
    /// Slot of its first contact in vectors over contact points
    /// ([`crate::constraints::records::point_vector`]).
    pub first_slot: usize,
    /// Where the first record starts in the buffer, in lane vectors.
    pub first_vector: usize,
    /// Lane vectors of a record ([`crate::constraints::records::features::Layout::stride`]).
    pub stride: usize,
    /// Its place in a sweep: stages are solved one after the other. Constraints of other types with the same
    /// stage share its color.
    pub stage: u32,
    /// Level of its contacts in the contact graph; 0 unless contacts are grouped by level.
    pub level: u32,
    /// Whether no two of its contacts push the same body.
    pub disjoint: bool,
}

impl Segment {
    /// Whether impulses change body a as well, so that its row is written back.
    #[inline(always)]
    pub fn pushes_a(&self) -> bool {
        self.partner == PartnerKind::Dynamic
    }

    /// Number of lanes of a batch that hold a contact.
    #[inline(always)]
    pub fn filled(&self, batch: usize, width: usize) -> usize {
        self.contacts.saturating_sub(batch * width).min(width)
    }
}
