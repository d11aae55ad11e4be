//! Rows of bodies: what sweeps gather and scatter.
//!
//! A row is two quads, and [`super::quads`] moves it by halves. Sixteen bodies are gathered by whole
//! rows instead, which takes half the loads. Single columns are moved to compare with rows.

use bytemuck::{Pod, Zeroable};

/// What sweeps read and write of a body: its velocity and its motion since the step began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct BodyRow {
    /// `[vx (m/s), vy (m/s), ω (rad/s), m⁻¹ (1/kg)]`
    pub velocity: [f32; 4],
    /// `[Δx (m), Δy (m), Δθ (rad), I⁻¹ (1/(kg·m²))]`
    pub delta: [f32; 4],
}

/// `values[index[lane]]` in every lane, one after the other.
///
/// # Safety
/// `index` holds at least as many entries as `V` floats, each less than `values.len()`.
#[inline(always)]
pub unsafe fn load_each<V: Pod>(values: &[f32], index: &[u32]) -> V {
    let mut v = V::zeroed();
    let floats: &mut [f32] = bytemuck::cast_slice_mut(std::slice::from_mut(&mut v));
    for (lane, float) in floats.iter_mut().enumerate() {
        // SAFETY: the caller keeps `index` in bounds.
        *float = unsafe { *values.get_unchecked(*index.get_unchecked(lane) as usize) };
    }
    v
}

/// `values[index[lane]] = v[lane]`, in lane order.
///
/// # Safety
/// `index` holds at least as many entries as `V` floats, each less than `values.len()`.
#[inline(always)]
pub unsafe fn store_each<V: Pod>(values: &mut [f32], index: &[u32], v: V) {
    for (lane, float) in bytemuck::cast_slice::<V, f32>(&[v]).iter().enumerate() {
        // SAFETY: the caller keeps `index` in bounds.
        unsafe { *values.get_unchecked_mut(*index.get_unchecked(lane) as usize) = *float };
    }
}

#[cfg(not(all(target_arch = "x86_64", target_feature = "avx512f")))]
pub use self::{load_each as load_at_16, store_each as store_at_16};
#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
pub use avx512::{gather_16, load_at_16, store_at_16};

/// Without instructions for 16 lanes, by halves.
///
/// # Safety
/// `index` holds at least 16 entries, each less than `rows.len()`.
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx512f")))]
#[inline(always)]
pub unsafe fn gather_16(rows: &[BodyRow], index: &[u32]) -> [wide::f32x16; 8] {
    // SAFETY: the caller keeps the 16 indices in bounds.
    unsafe { super::gather_halves(rows, index) }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
mod avx512 {
    use super::super::quads::avx512::{from, into, transpose};
    use super::BodyRow;
    use std::arch::x86_64::*;
    use wide::f32x16;

    /// The row of `index[lane]`.
    ///
    /// # Safety
    /// `lane < index.len()` and `index[lane] < rows.len()`.
    #[inline(always)]
    unsafe fn row(rows: &[BodyRow], index: &[u32], lane: usize) -> *const f32 {
        debug_assert!(lane < index.len() && (index[lane] as usize) < rows.len());
        // SAFETY: both bounds are the caller's promise.
        unsafe { rows.as_ptr().add(*index.get_unchecked(lane) as usize).cast() }
    }

    /// Whole rows of bodies `i` and `i + 4`, one per 256-bit half.
    ///
    /// # Safety
    /// `index` holds at least `i + 5` entries, each less than `rows.len()`.
    #[inline(always)]
    unsafe fn load(rows: &[BodyRow], index: &[u32], i: usize) -> __m512 {
        // SAFETY: the caller keeps the indices in bounds; a row is eight floats, aligned to 32 bytes.
        unsafe {
            let low = _mm512_castps256_ps512(_mm256_load_ps(row(rows, index, i)));
            _mm512_insertf32x8::<1>(low, _mm256_load_ps(row(rows, index, i + 4)))
        }
    }

    /// By whole rows: 16 loads, 8 of them with an insert, and 24 shuffles. By half rows, 32 loads,
    /// 24 of them with an insert, and 16 shuffles, sweeps are 6 % slower. Masked broadcasts in
    /// place of the inserts changed nothing.
    ///
    /// # Safety
    /// `index` holds at least 16 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn gather_16(rows: &[BodyRow], index: &[u32]) -> [f32x16; 8] {
        // SAFETY: the caller keeps the 16 indices in bounds.
        unsafe {
            // In 128-bit lanes: velocities of bodies 0..4, deltas of the same, then of 4..8.
            let p = transpose([
                load(rows, index, 0),
                load(rows, index, 1),
                load(rows, index, 2),
                load(rows, index, 3),
            ]);
            // The same of bodies 8..16.
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

    /// # Safety
    /// `index` holds at least 16 entries, each less than `values.len()` and than 2³¹.
    #[inline(always)]
    pub unsafe fn load_at_16(values: &[f32], index: &[u32]) -> f32x16 {
        // SAFETY: the caller keeps the 16 indices in bounds; the load of indices is unaligned.
        from(unsafe {
            let index = _mm512_loadu_si512(index.as_ptr().cast());
            _mm512_i32gather_ps::<4>(index, values.as_ptr())
        })
    }

    /// # Safety
    /// `index` holds at least 16 entries, each less than `values.len()` and than 2³¹.
    #[inline(always)]
    pub unsafe fn store_at_16(values: &mut [f32], index: &[u32], v: f32x16) {
        // SAFETY: as above.
        unsafe {
            let index = _mm512_loadu_si512(index.as_ptr().cast());
            _mm512_i32scatter_ps::<4>(values.as_mut_ptr(), index, into(v));
        }
    }
}
