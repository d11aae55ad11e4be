//! Rows of bodies, which sweeps gather and scatter.
//!
//! A row is two quads, and [`super::quads`] moves it by halves. Sixteen bodies are gathered by whole rows
//! instead, which takes half the loads.

#![allow(
    unsafe_code,
    reason = "loads and stores by index, which `index` keeps in bounds; vector instructions"
)]

use super::index::LaneIndex;
use super::quads::QuadsAt;
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;

/// A body in sweeps: its velocity and its displacement since the start of the step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct BodyRow {
    /// `[vx (m/s), vy (m/s), ω (rad/s), m⁻¹ (1/kg)]`
    pub velocity: [f32; 4],
    /// `[Δx (m), Δy (m), Δθ (rad), I⁻¹ (1/(kg·m²))]`
    pub delta: [f32; 4],
}

/// Rows in memory: those of a slice, or rows that threads share.
#[derive(Clone, Copy)]
pub struct RowsAt<'a> {
    first: *mut BodyRow,
    len: usize,
    of: PhantomData<&'a BodyRow>,
}

impl<'a> From<&'a [BodyRow]> for RowsAt<'a> {
    #[inline(always)]
    fn from(rows: &'a [BodyRow]) -> Self {
        RowsAt { first: rows.as_ptr().cast_mut(), len: rows.len(), of: PhantomData }
    }
}

impl<'a> RowsAt<'a> {
    /// `len` rows from `first` on.
    ///
    /// # Safety
    /// As [`QuadsAt::new`].
    #[inline(always)]
    pub unsafe fn new(first: *mut BodyRow, len: usize) -> Self {
        RowsAt { first, len, of: PhantomData }
    }

    /// As quads, two for each row.
    #[allow(dead_code, reason = "for builds without instructions for 8 or 16 lanes")]
    #[inline(always)]
    fn quads(self) -> QuadsAt<'a> {
        // SAFETY: a row is two quads, and aligned as they are; they exist as long as the rows.
        unsafe { QuadsAt::new(self.first.cast(), 2 * self.len) }
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
pub use avx512::gather_16;

/// By half rows, if there are no instructions for 16 lanes.
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx512f")))]
#[inline(always)]
pub fn gather_16(rows: RowsAt<'_>, index: LaneIndex<[u32; 16]>) -> [wide::f32x16; 8] {
    let quads = rows.quads();
    let (v, d) =
        (super::quads::gather_16::<2, 0>(quads, index), super::quads::gather_16::<2, 1>(quads, index));
    [v[0], v[1], v[2], v[3], d[0], d[1], d[2], d[3]]
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
pub use avx::gather_8;

/// By half rows, if there are no instructions for 8 lanes.
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx")))]
#[inline(always)]
pub fn gather_8(rows: RowsAt<'_>, index: LaneIndex<[u32; 8]>) -> [wide::f32x8; 8] {
    let quads = rows.quads();
    let (v, d) = (super::quads::gather_8::<2, 0>(quads, index), super::quads::gather_8::<2, 1>(quads, index));
    [v[0], v[1], v[2], v[3], d[0], d[1], d[2], d[3]]
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
mod avx {
    use super::super::quads::avx::{from, transpose};
    use super::{LaneIndex, RowsAt};
    use crate::lanes::index::assert_fits;
    use std::arch::x86_64::*;
    use wide::f32x8;

    /// By whole rows: 8 loads and 24 shuffles. By half rows it would be 16 loads, 8 of them with an insert,
    /// and 16 shuffles.
    #[inline(always)]
    pub fn gather_8(rows: RowsAt<'_>, index: LaneIndex<[u32; 8]>) -> [f32x8; 8] {
        assert_fits(index.bound(), rows.len, 1);
        let index = index.array();
        // SAFETY: every entry is below the bound; a row is eight floats, aligned to 32 bytes.
        unsafe {
            let row = |i: usize| _mm256_load_ps(rows.first.add(index[i] as usize).cast());
            let p = transpose([row(0), row(1), row(2), row(3)]);
            let q = transpose([row(4), row(5), row(6), row(7)]);
            let velocity = |c: usize| from(_mm256_permute2f128_ps::<0x20>(p[c], q[c]));
            let delta = |c: usize| from(_mm256_permute2f128_ps::<0x31>(p[c], q[c]));
            [velocity(0), velocity(1), velocity(2), velocity(3), delta(0), delta(1), delta(2), delta(3)]
        }
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
mod avx512 {
    use super::super::quads::avx512::{from, transpose};
    use super::{LaneIndex, RowsAt};
    use crate::lanes::index::assert_fits;
    use std::arch::x86_64::*;
    use wide::f32x16;

    /// Row `i`.
    ///
    /// # Safety
    /// `i < rows.len`.
    #[inline(always)]
    unsafe fn row(rows: RowsAt<'_>, i: u32) -> __m256 {
        debug_assert!((i as usize) < rows.len);
        // SAFETY: the caller's promise; a row is eight floats, aligned to 32 bytes.
        unsafe { _mm256_load_ps(rows.first.add(i as usize).cast()) }
    }

    /// Whole rows of bodies `i` and `i + 4`, one per 256-bit half.
    ///
    /// # Safety
    /// Every entry of `index` is less than `rows.len`.
    #[inline(always)]
    unsafe fn load(rows: RowsAt<'_>, index: &[u32; 16], i: usize) -> __m512 {
        // SAFETY: the caller's promise; the instructions are target features of this build.
        unsafe {
            let low = _mm512_castps256_ps512(row(rows, index[i]));
            _mm512_insertf32x8::<1>(low, row(rows, index[i + 4]))
        }
    }

    /// By whole rows: 16 loads, 8 of them with an insert, and 24 shuffles, fewer than by half rows.
    #[inline(always)]
    pub fn gather_16(rows: RowsAt<'_>, index: LaneIndex<[u32; 16]>) -> [f32x16; 8] {
        assert_fits(index.bound(), rows.len, 1);
        let index = index.array();
        // SAFETY: every entry is below the bound.
        unsafe {
            // 128-bit lanes: velocities of bodies 0..4, their deltas, then the same of bodies 4..8.
            let p = transpose([
                load(rows, index, 0),
                load(rows, index, 1),
                load(rows, index, 2),
                load(rows, index, 3),
            ]);
            // The same for bodies 8..16.
            let q = transpose([
                load(rows, index, 8),
                load(rows, index, 9),
                load(rows, index, 10),
                load(rows, index, 11),
            ]);
            let velocity = |c: usize| from(_mm512_shuffle_f32x4::<0b10_00_10_00>(p[c], q[c]));
            let delta = |c: usize| from(_mm512_shuffle_f32x4::<0b11_01_11_01>(p[c], q[c]));
            [velocity(0), velocity(1), velocity(2), velocity(3), delta(0), delta(1), delta(2), delta(3)]
        }
    }
}
