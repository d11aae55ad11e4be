//! Storage of body rows for sweeps: packed, as solvers use it, or in columns, for comparison.

use super::aligned::LaneVec;
use super::index::{IndexList, LaneIndex, assert_fits};
use super::rows::BodyRow;
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

/// One column per quantity of a row: a pure structure of arrays.
///
/// Solvers do not use it. A body then takes eight cache lines instead of one, and eight gathers of one float
/// per lane instead of one aligned load per body. It exists so
/// that `benches/kernel.rs` can measure this cost.
#[derive(Clone, Debug, Default)]
pub struct RowColumns {
    columns: [LaneVec; 8],
}

impl RowColumns {
    /// The columns of `rows`.
    pub fn from_rows(rows: &[BodyRow]) -> Self {
        let mut columns: [LaneVec; 8] = Default::default();
        for row in rows {
            for (column, value) in columns.iter_mut().zip(row.velocity.iter().chain(&row.delta)) {
                column.push(*value);
            }
        }
        RowColumns { columns }
    }

    /// The same rows, packed.
    pub fn to_rows(&self) -> Vec<BodyRow> {
        let at = |i: usize, first: usize| std::array::from_fn(|k| self.columns[first + k][i]);
        (0..self.columns[0].len()).map(|i| BodyRow { velocity: at(i, 0), delta: at(i, 4) }).collect()
    }
}

impl RowStore for RowColumns {
    #[inline(always)]
    fn assert_rows(&self, index: IndexList) {
        self.columns.iter().for_each(|column| assert_fits(index.bound(), column.len(), 1));
    }

    #[inline(always)]
    fn gather<L: Lanes>(&self, index: LaneIndex<L::Index>) -> [L; 8] {
        self.columns.each_ref().map(|column| L::load_at(column, index))
    }

    #[inline(always)]
    fn scatter_velocity<L: Lanes>(&mut self, index: LaneIndex<L::Index>, velocity: [L; 4]) {
        // The inverse mass does not change. With columns it need not be written, unlike with half rows.
        for (column, v) in self.columns.iter_mut().zip(velocity).take(3) {
            L::store_at(column, index, v);
        }
    }
}
