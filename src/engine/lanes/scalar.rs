//! One lane: a float.

use super::index::LaneIndex;
use super::quads::{self, Quad};
use super::shared::Shared;
use super::vector::{FUSED, INTEGERS, Lanes, MANTISSA};
use bytemuck::Pod;

impl Lanes for f32 {
    const WIDTH: usize = 1;

    type Index = [u32; 1];

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }

    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        if FUSED { f32::mul_add(self, factor, term) } else { self * factor + term }
    }

    #[inline(always)]
    fn neg_mul_add(self, factor: Self, term: Self) -> Self {
        if FUSED { f32::mul_add(-self, factor, term) } else { term - self * factor }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }

    #[inline(always)]
    fn select_positive(self, positive: Self, otherwise: Self) -> Self {
        if self > 0.0 { positive } else { otherwise }
    }

    #[inline(always)]
    fn any_positive(self) -> bool {
        self > 0.0
    }

    #[inline(always)]
    fn gather_shared<T: Pod + Send, const S: usize, const O: usize>(
        records: Shared<'_, T>,
        index: LaneIndex<Self::Index>,
    ) -> [Self; 4] {
        quads::gather_1::<S, O>(records.quads(), index)
    }

    #[inline(always)]
    fn scatter_shared<T: Pod + Send, const S: usize, const O: usize>(
        records: Shared<'_, T>,
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    ) {
        quads::scatter_1::<S, O>(records.quads(), index, v)
    }

    #[inline(always)]
    fn gather_quads<const S: usize, const O: usize>(
        quads: &[Quad],
        index: LaneIndex<Self::Index>,
    ) -> [Self; 4] {
        quads::gather_1::<S, O>(quads.into(), index)
    }

    #[inline(always)]
    fn scatter_quads<const S: usize, const O: usize>(
        quads: &mut [Quad],
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    ) {
        quads::scatter_1::<S, O>(quads.into(), index, v)
    }

    #[inline(always)]
    fn scatter_halves<const S: usize, const O: usize, const P: usize>(
        quads: &mut [Quad],
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    ) {
        quads::scatter_halves_1::<S, O, P>(quads.into(), index, v)
    }

    #[inline(always)]
    fn select_equal(self, other: Self, yes: Self, no: Self) -> Self {
        if self.to_bits() == other.to_bits() { yes } else { no }
    }

    #[inline(always)]
    fn integer_bits(self) -> Self {
        f32::from_bits((self + INTEGERS).to_bits() & MANTISSA)
    }
}
