//! Index lists with a bound, used by gathers and scatters.
//!
//! A gather reads `rows[index[lane]]` in all lanes at once and does not check single lanes. It checks that
//! the **bound** of the indices does not exceed the number of rows: one comparison, the same for all batches
//! of a list. This suffices because of an invariant of the types below: *every entry is less than the
//! bound*. Their fields are private, adding entries also raises the bound, and no entry can be modified from
//! outside. This file is safe code; the unsafe code of [`super::quads`] and [`super::rows`] relies on this
//! invariant alone.

use bytemuck::Pod;
use std::ops::{Deref, Range};

/// The bound of `list`: one more than its largest entry. If the bound of `u32::MAX` saturates (32-bit
/// addresses), no slice is long enough to satisfy it.
fn bound_of(list: &[u32]) -> usize {
    // This fold vectorizes; a search for the first bad entry would not.
    let largest = list.iter().fold(0, |most, &i| i.max(most));
    if list.is_empty() { 0 } else { (largest as usize).saturating_add(1) }
}

/// A growable list of indices.
#[derive(Clone, Debug, Default)]
pub struct Indices {
    entries: Vec<u32>,
    bound: usize,
}

impl Indices {
    /// Empties the list but keeps its memory.
    pub fn clear(&mut self) {
        self.entries.clear();
        self.bound = 0;
    }

    /// Appends entries.
    pub fn extend(&mut self, entries: &[u32]) {
        self.bound = self.bound.max(bound_of(entries));
        self.entries.extend_from_slice(entries);
    }

    /// Appends `index` until there are `len` entries. A longer list is unchanged.
    pub fn fill_to(&mut self, len: usize, index: u32) {
        if len > self.entries.len() {
            self.bound = self.bound.max(bound_of(&[index]));
            self.entries.resize(len, index);
        }
    }

    /// The entries with their bound.
    pub fn list(&self) -> IndexList<'_> {
        IndexList { entries: &self.entries, bound: self.bound }
    }
}

impl Deref for Indices {
    type Target = [u32];
    fn deref(&self) -> &[u32] {
        &self.entries
    }
}

/// A borrowed list of indices, or a part of one.
#[derive(Clone, Copy, Debug)]
pub struct IndexList<'a> {
    entries: &'a [u32],
    bound: usize,
}

impl<'a> IndexList<'a> {
    /// A list with the bound of `entries`.
    pub fn new(entries: &'a [u32]) -> Self {
        IndexList { entries, bound: bound_of(entries) }
    }

    /// Upper bound: every entry is less.
    #[inline(always)]
    pub fn bound(self) -> usize {
        self.bound
    }

    /// The entries.
    #[inline(always)]
    pub fn entries(self) -> &'a [u32] {
        self.entries
    }

    /// A part of the list.
    ///
    /// # Panics
    /// If the range exceeds the list.
    #[inline(always)]
    pub fn part(self, range: Range<usize>) -> Self {
        IndexList { entries: &self.entries[range], bound: self.bound }
    }

    /// The entries of batch `batch` of `width` lanes. Shorter or empty at the end of the list.
    #[inline(always)]
    pub fn entries_of(self, batch: usize, width: usize) -> &'a [u32] {
        let (first, len) = (batch * width, self.entries.len());
        self.entries.get(first..(first + width).min(len)).unwrap_or(&[])
    }

    /// The list, batch by batch.
    ///
    /// # Panics
    /// If the last batch is incomplete.
    #[inline(always)]
    pub fn batches<I: Pod>(self) -> impl ExactSizeIterator<Item = LaneIndex<'a, I>> {
        let bound = self.bound;
        bytemuck::cast_slice(self.entries).iter().map(move |entries| LaneIndex { entries, bound })
    }

    /// One batch of the list.
    ///
    /// # Panics
    /// If the last batch is incomplete, or the list has no such batch.
    #[inline(always)]
    pub fn batch<I: Pod>(self, batch: usize) -> LaneIndex<'a, I> {
        LaneIndex { entries: &bytemuck::cast_slice(self.entries)[batch], bound: self.bound }
    }

    /// The batch that begins at entry `first`. If the list ends within the batch, the batch is built in
    /// `room` and padded with entry `first`.
    ///
    /// # Panics
    /// If there is no entry `first`.
    #[inline(always)]
    pub fn batch_at<'b, I: Pod>(self, first: usize, room: &'b mut [u32; MOST_LANES]) -> LaneIndex<'b, I>
    where
        'a: 'b,
    {
        let (rest, bound) = (&self.entries[first..], self.bound);
        let lanes = size_of::<I>() / size_of::<u32>();
        if let Some(whole) = rest.get(..lanes) {
            return LaneIndex { entries: first_of(whole), bound };
        }
        room.fill(rest[0]);
        room[..rest.len()].copy_from_slice(rest);
        LaneIndex { entries: first_of(room), bound }
    }
}

/// Up to two batches of entries, copied from lists. Its places hold valid indices from the first copy on, whether or not
/// they were written.
#[derive(Clone, Copy, Debug, Default)]
pub struct PickedIndices {
    entries: [u32; 2 * MOST_LANES],
    bound: usize,
}

impl PickedIndices {
    /// Copies the entries of `list` to `places`, counted modulo two batches of [`MOST_LANES`].
    #[inline(always)]
    pub fn place(&mut self, places: &[u32], list: IndexList) {
        self.bound = self.bound.max(list.bound);
        for (&place, &entry) in places.iter().zip(list.entries) {
            self.entries[place as usize % (2 * MOST_LANES)] = entry;
        }
    }

    /// Removes the first `count` places.
    ///
    /// # Panics
    /// If there are fewer.
    #[inline(always)]
    pub fn drop_first(&mut self, count: usize) {
        self.entries.copy_within(count.., 0);
    }

    /// The first entries, one per lane.
    #[inline(always)]
    pub fn batch<I: Pod>(&self) -> LaneIndex<'_, I> {
        LaneIndex { entries: first_of(&self.entries), bound: self.bound }
    }

    /// All entries.
    #[inline(always)]
    pub fn entries(&self) -> &[u32] {
        &self.entries
    }
}

/// The largest number of lanes.
pub const MOST_LANES: usize = 16;

/// The beginning of `list` as one batch.
#[inline(always)]
fn first_of<I: Pod>(list: &[u32]) -> &I {
    &bytemuck::cast_slice(list)[0]
}

/// The indices of one batch. `I` is `[u32; WIDTH]` ([`super::Lanes::Index`]).
#[derive(Clone, Copy, Debug)]
pub struct LaneIndex<'a, I> {
    entries: &'a I,
    bound: usize,
}

impl<'a, I: Pod> LaneIndex<'a, I> {
    /// The first entries of `list`, one per lane, with their bound.
    #[inline(always)]
    pub fn new(list: &'a [u32; MOST_LANES]) -> Self {
        let entries = first_of::<I>(list);
        LaneIndex { entries, bound: bound_of(bytemuck::cast_slice(std::slice::from_ref(entries))) }
    }

    /// Upper bound: every entry is less.
    #[inline(always)]
    pub fn bound(self) -> usize {
        self.bound
    }

    /// The entries as an array.
    #[inline(always)]
    pub fn array(self) -> &'a I {
        self.entries
    }

    /// The entries.
    #[inline(always)]
    pub fn entries(self) -> &'a [u32] {
        bytemuck::cast_slice(std::slice::from_ref(self.entries))
    }

    /// The index shared by all lanes, or `None` if they differ.
    #[inline(always)]
    pub fn only(self) -> Option<usize> {
        let entries = self.entries();
        let different = entries.iter().fold(0, |bits, &i| bits | (i ^ entries[0]));
        (different == 0).then_some(entries[0] as usize)
    }
}

impl<'a, const W: usize> LaneIndex<'a, [u32; W]> {
    /// The first and the second half of the lanes.
    #[inline(always)]
    pub(super) fn halves<const H: usize>(self) -> [LaneIndex<'a, [u32; H]>; 2] {
        let [a, b]: &[[u32; H]; 2] = bytemuck::cast_ref(self.entries);
        [a, b].map(|entries| LaneIndex { entries, bound: self.bound })
    }
}

/// Checks that there are at least `bound` records of `stride` parts each, given `parts` in total.
///
/// # Panics
/// If there are fewer.
#[inline(always)]
pub(super) fn assert_fits(bound: usize, parts: usize, stride: usize) {
    if bound > parts / stride {
        beyond(bound, parts / stride);
    }
}

#[cold]
#[inline(never)]
fn beyond(bound: usize, rows: usize) -> ! {
    panic!("index {} where there are {rows} rows", bound - 1)
}
