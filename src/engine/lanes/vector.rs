//! The [`Lanes`] trait that kernels use, and its guarantees.
//!
//! Every operation gives, lane by lane, the same bits at every width:
//!
//! * `+ − × ÷` are IEEE operations and agree anyway.
//! * [`Lanes::mul_add`] is fused at every width or at none ([`FUSED`]).
//! * [`Lanes::max`] and [`Lanes::min`] return the *second* operand if the two compare equal (so for ±0) or
//!   are unordered, as the x86 instructions do.
//! * No reciprocal estimates.

use super::index::{LaneIndex, assert_fits};
use super::quads::Quad;
use super::rows::BodyRow;
use super::shared::{Shared, SharedRows};
use bytemuck::Pod;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Whether [`Lanes::mul_add`] rounds once (a fused instruction) or twice.
pub const FUSED: bool = cfg!(any(
    all(target_arch = "x86_64", target_feature = "fma"),
    all(target_arch = "aarch64", target_feature = "neon")
));
/// `WIDTH` floats that are processed together.
pub trait Lanes:
    Pod
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The number of lanes.
    const WIDTH: usize;

    /// An index per lane: `[u32; WIDTH]`.
    type Index: Pod;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;

    /// `self · factor + term`.
    fn mul_add(self, factor: Self, term: Self) -> Self;

    /// `term − self · factor`.
    fn neg_mul_add(self, factor: Self, term: Self) -> Self;

    /// `self > other ? self : other`.
    fn max(self, other: Self) -> Self;

    /// `self < other ? self : other`.
    fn min(self, other: Self) -> Self;

    /// Square root (an IEEE operation).
    fn sqrt(self) -> Self;

    /// `self > 0 ? positive : otherwise`.
    fn select_positive(self, positive: Self, otherwise: Self) -> Self;

    /// Whether any lane is above 0.
    fn any_positive(self) -> bool;

    /// The rows of `WIDTH` bodies, transposed: `[vx, vy, ω, m⁻¹, Δx, Δy, Δθ, I⁻¹]`. Loaded by half rows by
    /// default.
    ///
    /// # Panics
    /// If there are fewer rows than the bound of `index`.
    #[inline(always)]
    fn gather(rows: &[BodyRow], index: LaneIndex<Self::Index>) -> [Self; 8] {
        let quads: &[Quad] = bytemuck::cast_slice(rows);
        let (v, d) = (Self::gather_quads::<2, 0>(quads, index), Self::gather_quads::<2, 1>(quads, index));
        [v[0], v[1], v[2], v[3], d[0], d[1], d[2], d[3]]
    }

    /// As [`Self::gather`], but loads whole rows at widths where this takes fewer loads, such as eight lanes.
    /// A row with a half that was just written cannot be loaded whole before that half is in the cache.
    ///
    /// # Panics
    /// As [`Self::gather`].
    #[inline(always)]
    fn gather_whole(rows: &[BodyRow], index: LaneIndex<Self::Index>) -> [Self; 8] {
        Self::gather(rows, index)
    }

    /// Writes back the first half `[vx, vy, ω, m⁻¹]` of `WIDTH` rows, in lane order.
    ///
    /// # Panics
    /// If there are fewer rows than the bound of `index`.
    #[inline(always)]
    fn scatter_velocity(rows: &mut [BodyRow], index: LaneIndex<Self::Index>, velocity: [Self; 4]) {
        Self::scatter_quads::<2, 0>(bytemuck::cast_slice_mut(rows), index, velocity)
    }

    /// Writes back the second half `[Δx, Δy, Δθ, I⁻¹]` of `WIDTH` rows, in lane order.
    ///
    /// # Panics
    /// If there are fewer rows than the bound of `index`.
    #[inline(always)]
    fn scatter_delta(rows: &mut [BodyRow], index: LaneIndex<Self::Index>, delta: [Self; 4]) {
        Self::scatter_quads::<2, 1>(bytemuck::cast_slice_mut(rows), index, delta)
    }

    /// As [`Self::gather`], from rows that threads may share.
    ///
    /// # Panics
    /// As [`Self::gather`].
    #[inline(always)]
    fn gather_shared_rows(rows: SharedRows<'_>, index: LaneIndex<Self::Index>) -> [Self; 8] {
        let v = Self::gather_shared::<_, 2, 0>(rows, index);
        let d = Self::gather_shared::<_, 2, 1>(rows, index);
        [v[0], v[1], v[2], v[3], d[0], d[1], d[2], d[3]]
    }

    /// As [`Self::gather_whole`], from rows that threads may share.
    ///
    /// # Panics
    /// As [`Self::gather`].
    #[inline(always)]
    fn gather_whole_shared_rows(rows: SharedRows<'_>, index: LaneIndex<Self::Index>) -> [Self; 8] {
        Self::gather_shared_rows(rows, index)
    }

    /// As [`Self::gather_quads`], from records that threads may share.
    ///
    /// # Panics
    /// As [`Self::gather_quads`].
    fn gather_shared<T: Pod + Send, const S: usize, const O: usize>(
        records: Shared<'_, T>,
        index: LaneIndex<Self::Index>,
    ) -> [Self; 4];

    /// As [`Self::scatter_quads`], to records that threads may share.
    ///
    /// # Panics
    /// As [`Self::gather_quads`].
    fn scatter_shared<T: Pod + Send, const S: usize, const O: usize>(
        records: Shared<'_, T>,
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    );

    /// Quad `O` of `WIDTH` records of `S` quads each, transposed.
    ///
    /// # Panics
    /// If there are fewer records than the bound of `index`.
    fn gather_quads<const S: usize, const O: usize>(
        quads: &[Quad],
        index: LaneIndex<Self::Index>,
    ) -> [Self; 4];

    /// Writes quad `O` of `WIDTH` records of `S` quads each, in lane order.
    ///
    /// # Panics
    /// If there are fewer records than the bound of `index`.
    fn scatter_quads<const S: usize, const O: usize>(
        quads: &mut [Quad],
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    );

    /// Writes the second half of quad `O` (`v[0]`, `v[1]`) and of quad `P` (`v[2]`, `v[3]`) of
    /// `WIDTH` records of `S` quads each, in lane order.
    ///
    /// # Panics
    /// If there are fewer records than the bound of `index`.
    fn scatter_halves<const S: usize, const O: usize, const P: usize>(
        quads: &mut [Quad],
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    );

    /// `self == other ? yes : no`, as the bits of integers. As floats, small integers are subnormal, and threads that
    /// treat subnormal numbers as zero could not tell them apart.
    fn select_equal(self, other: Self, yes: Self, no: Self) -> Self;

    /// `self`, an integer n in [0, 2²³), converted to the bits of the integer n.
    fn integer_bits(self) -> Self;

    /// `values[index[lane]]` in every lane.
    ///
    /// # Panics
    /// If there are fewer values than the bound of `index`.
    #[inline(always)]
    fn load_at(values: &[f32], index: LaneIndex<Self::Index>) -> Self {
        assert_fits(index.bound(), values.len(), 1);
        let mut v = Self::zero();
        let floats: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut v));
        floats.iter_mut().zip(index.entries()).for_each(|(float, &i)| *float = values[i as usize]);
        v
    }

    /// `values[index[lane]] = v[lane]`, in lane order.
    ///
    /// # Panics
    /// As [`Self::load_at`].
    #[inline(always)]
    fn store_at(values: &mut [f32], index: LaneIndex<Self::Index>, v: Self) {
        assert_fits(index.bound(), values.len(), 1);
        let floats: &[f32] = bytemuck::cast_slice(std::slice::from_ref(&v));
        floats.iter().zip(index.entries()).for_each(|(float, &i)| values[i as usize] = *float);
    }

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::zeroed()
    }
}

/// Floats from 2²³ to 2²⁴ are the integers, and their last 23 bits count from 2²³.
pub(super) const INTEGERS: f32 = 8_388_608.0;
pub(super) const MANTISSA: u32 = 0x007F_FFFF;
