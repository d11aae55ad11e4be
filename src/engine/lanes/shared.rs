//! Records that several threads gather and scatter at the same time.

#![allow(
    unsafe_code,
    reason = "memory that threads share, each for other records, as the caller of `share` promises"
)]

use super::quads::{Quad, QuadsAt, prefetch_line};
use super::rows::{BodyRow, RowsAt};
use crate::workers::Workers;
use bytemuck::Pod;
use std::marker::PhantomData;

/// Least number of lanes that are worth a thread: a microsecond of a sweep, more than it takes to hand them over.
const LEAST_PART: usize = 256;

/// Records that may be shared by threads, each of which gathers and scatters records of its own.
///
/// They come from a mutable slice, so there is no other access to them. Copies stay in their thread, unless `share` sends them.
pub struct Shared<'a, T> {
    first: *mut T,
    len: usize,
    workers: Option<&'a Workers>,
    of: PhantomData<&'a mut [T]>,
}

/// Rows of bodies.
pub type SharedRows<'a> = Shared<'a, BodyRow>;

impl<T> Clone for Shared<'_, T> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Shared<'_, T> {}

/// Records of one thread.
impl<'a, T> From<&'a mut [T]> for Shared<'a, T> {
    #[inline(always)]
    fn from(records: &'a mut [T]) -> Self {
        Shared { first: records.as_mut_ptr(), len: records.len(), workers: None, of: PhantomData }
    }
}

impl<'a, T: Pod + Send> Shared<'a, T> {
    /// Records that these threads may share.
    #[inline(always)]
    pub fn among(records: &'a mut [T], workers: &'a Workers) -> Self {
        Shared { workers: (workers.count() > 1).then_some(workers), ..records.into() }
    }

    /// Number of records.
    #[inline(always)]
    pub fn len(self) -> usize {
        self.len
    }

    /// Whether there are no records.
    #[inline(always)]
    pub fn is_empty(self) -> bool {
        self.len == 0
    }

    /// A copy of a record.
    ///
    /// # Panics
    /// If there is no such record.
    #[inline(always)]
    pub fn get(self, i: usize) -> T {
        assert!(i < self.len, "record {i} of {}", self.len);
        // SAFETY: it exists; no other thread writes it (`share`).
        unsafe { *self.first.add(i) }
    }

    /// Replaces a record.
    ///
    /// # Panics
    /// If there is no such record.
    #[inline(always)]
    pub(crate) fn set(self, i: usize, record: T) {
        assert!(i < self.len, "record {i} of {}", self.len);
        // SAFETY: it exists; no other thread accesses it (`share`).
        unsafe { *self.first.add(i) = record };
    }

    /// Fetches the first quad of a record into the cache, and its second cache line if it has two.
    #[inline(always)]
    pub(crate) fn prefetch(self, i: u32) {
        let first = self.first.wrapping_add(i as usize).cast::<Quad>();
        prefetch_line(first);
        if size_of::<T>() > 64 {
            prefetch_line(first.wrapping_add(4));
        }
    }

    /// Number of parts for `work` lanes: as many as there are threads, but none that is too small to be worth it.
    #[inline(always)]
    pub(crate) fn parts(self, work: usize) -> usize {
        self.workers.map_or(1, |workers| workers.count().min(work / LEAST_PART).max(1))
    }

    /// The records as quads.
    #[inline(always)]
    pub(super) fn quads(self) -> QuadsAt<'a> {
        const { assert!(size_of::<T>().is_multiple_of(16) && align_of::<T>().is_multiple_of(16)) };
        // SAFETY: a record is whole quads and aligned as they are; other threads keep to other records (`share`).
        unsafe { QuadsAt::new(self.first.cast::<Quad>(), self.len * (size_of::<T>() / 16)) }
    }

    /// Runs `each` on every part, one in each thread.
    ///
    /// # Safety
    /// A record that the run on one part scatters to is neither gathered nor scattered by the run on another.
    pub(crate) unsafe fn share<P: Send>(
        self,
        parts: impl Iterator<Item = P>,
        each: impl Fn(Shared<'a, T>, P) + Sync,
    ) {
        let sent = Sent(Shared { workers: None, ..self });
        match self.workers {
            Some(workers) => workers.each(parts, |part| each(sent.get(), part)),
            None => parts.for_each(|part| each(self, part)),
        }
    }

    /// The records for a task that runs in several threads, besides those that it shares itself.
    ///
    /// # Safety
    /// As [`Self::share`].
    pub(crate) unsafe fn sent(self) -> Sent<'a, T> {
        Sent(Shared { workers: None, ..self })
    }
}

impl<'a> SharedRows<'a> {
    /// Rows to gather from.
    #[inline(always)]
    pub(super) fn rows(self) -> RowsAt<'a> {
        // SAFETY: as in `quads`.
        unsafe { RowsAt::new(self.first, self.len) }
    }
}

/// Records that go to other threads.
pub(crate) struct Sent<'a, T>(Shared<'a, T>);

// SAFETY: who made it has promised that threads do not access the same record if one of them writes it.
unsafe impl<T: Send> Sync for Sent<'_, T> {}

impl<'a, T> Sent<'a, T> {
    /// The records, in the thread that runs.
    pub fn get(&self) -> Shared<'a, T> {
        self.0
    }
}
