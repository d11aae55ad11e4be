//! Storage of body rows for sweeps.

use super::index::{IndexList, LaneIndex, assert_fits};
use super::rows::BodyRow;
use super::shared::SharedRows;
use super::vector::Lanes;

/// Rows of bodies that a sweep gathers from and scatters to.
pub trait RowStore {
    /// Checks once, before a loop over batches, that no row of `index` is missing. The compiler can then
    /// remove the checks of gathers and scatters inside the loop.
    ///
    /// # Panics
    /// If a row is missing.
    fn assert_rows(&self, index: IndexList);

    /// `[vx, vy, ω, m⁻¹, Δx, Δy, Δθ, I⁻¹]` of the rows in `index`.
    ///
    /// # Panics
    /// If the store has fewer rows than the bound of `index`.
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8];

    /// As [`Self::gather`], for rows that were not written just before; see [`Lanes::gather_whole`].
    #[inline(always)]
    fn gather_whole<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        self.gather::<L>(index)
    }

    /// Writes back `[vx, vy, ω, m⁻¹]`, in lane order.
    ///
    /// # Panics
    /// As [`Self::gather`].
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]);
}

impl RowStore for [BodyRow] {
    #[inline(always)]
    fn assert_rows(&self, index: IndexList) {
        assert_fits(index.bound(), self.len(), 1);
    }

    #[inline(always)]
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        L::gather(self, index)
    }

    #[inline(always)]
    fn gather_whole<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        L::gather_whole(self, index)
    }

    #[inline(always)]
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]) {
        L::scatter_velocity(self, index, velocity)
    }
}

impl RowStore for SharedRows<'_> {
    #[inline(always)]
    fn assert_rows(&self, index: IndexList) {
        assert_fits(index.bound(), self.len(), 1);
    }

    #[inline(always)]
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        L::gather_shared_rows(*self, index)
    }

    #[inline(always)]
    fn gather_whole<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        L::gather_whole_shared_rows(*self, index)
    }

    #[inline(always)]
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]) {
        L::scatter_shared::<_, 2, 0>(*self, index, velocity)
    }
}
