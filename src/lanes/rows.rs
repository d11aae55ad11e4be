//! Gather and scatter of body rows: the only unsafe code of the crate.
//!
//! A row is 32 bytes, so a body is one aligned load. Rows are loaded whole and
//! transposed in registers. The transposes stay inside 128-bit lanes, except where whole rows
//! are read (16 lanes): 128-bit
//! lane `q` of vector `k` is loaded with half a row of body `4q + k`, so that one
//! 4 × 4 transpose of each 128-bit lane (8 shuffles for any width) puts component
//! `c` of bodies `0..W`, in order, into vector `c`.

use bytemuck::{Pod, Zeroable};
use wide::{f32x4, f32x8, f32x16};

/// What sweeps read and write of a body: its velocity and its motion since the step began.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(32))]
pub struct BodyRow {
    /// `[vx (m/s), vy (m/s), ω (rad/s), m⁻¹ (1/kg)]`
    pub velocity: [f32; 4],
    /// `[Δx (m), Δy (m), Δθ (rad), I⁻¹ (1/(kg·m²))]`
    pub delta: [f32; 4],
}

/// The four floats of half `HALF` (0: velocity, 1: delta) of the row of `index[lane]`.
///
/// # Safety
/// `lane < index.len()` and `index[lane] < rows.len()`.
#[inline(always)]
unsafe fn half<const HALF: usize>(rows: &[BodyRow], index: &[u32], lane: usize) -> *const f32 {
    debug_assert!(lane < index.len() && (index[lane] as usize) < rows.len());
    // SAFETY: both bounds are the caller's promise; a row is eight floats.
    unsafe { rows.as_ptr().add(*index.get_unchecked(lane) as usize).cast::<f32>().add(4 * HALF) }
}

/// As [`half`], to write.
///
/// # Safety
/// `lane < index.len()` and `index[lane] < rows.len()`.
#[inline(always)]
unsafe fn half_mut<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], lane: usize) -> *mut f32 {
    debug_assert!(lane < index.len() && (index[lane] as usize) < rows.len());
    // SAFETY: both bounds are the caller's promise; a row is eight floats.
    unsafe { rows.as_mut_ptr().add(*index.get_unchecked(lane) as usize).cast::<f32>().add(4 * HALF) }
}

/// # Safety
/// `index` holds at least 1 entry, less than `rows.len()`.
#[inline(always)]
pub unsafe fn gather_1(rows: &[BodyRow], index: &[u32]) -> [f32; 8] {
    // SAFETY: the caller keeps `index` in bounds; a row is eight floats.
    unsafe { *half::<0>(rows, index, 0).cast::<[f32; 8]>() }
}

/// # Safety
/// `index` holds at least 1 entry, less than `rows.len()`.
#[inline(always)]
pub unsafe fn scatter_1<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], v: [f32; 4]) {
    // SAFETY: the caller keeps `index` in bounds; half a row is four floats.
    unsafe { *half_mut::<HALF>(rows, index, 0).cast::<[f32; 4]>() = v }
}

/// # Safety
/// `index` holds at least 4 entries, each less than `rows.len()`.
#[inline(always)]
unsafe fn load_transposed_4<const HALF: usize>(rows: &[BodyRow], index: &[u32]) -> [f32x4; 4] {
    // SAFETY: the caller keeps `index` in bounds; half rows are 16-byte aligned as `f32x4` is.
    f32x4::transpose(unsafe {
        [
            *half::<HALF>(rows, index, 0).cast::<f32x4>(),
            *half::<HALF>(rows, index, 1).cast::<f32x4>(),
            *half::<HALF>(rows, index, 2).cast::<f32x4>(),
            *half::<HALF>(rows, index, 3).cast::<f32x4>(),
        ]
    })
}

/// # Safety
/// `index` holds at least 4 entries, each less than `rows.len()`.
#[inline(always)]
pub unsafe fn gather_4(rows: &[BodyRow], index: &[u32]) -> [f32x4; 8] {
    // SAFETY: the caller keeps `index` in bounds.
    let (l, h) = unsafe { (load_transposed_4::<0>(rows, index), load_transposed_4::<1>(rows, index)) };
    [l[0], l[1], l[2], l[3], h[0], h[1], h[2], h[3]]
}

/// # Safety
/// `index` holds at least 4 entries, each less than `rows.len()`.
#[inline(always)]
pub unsafe fn scatter_4<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], v: [f32x4; 4]) {
    for (lane, row) in f32x4::transpose(v).into_iter().enumerate() {
        // SAFETY: the caller keeps `index` in bounds; half rows are 16-byte aligned.
        unsafe { *half_mut::<HALF>(rows, index, lane).cast::<f32x4>() = row }
    }
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
#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
pub use avx::{gather_8, scatter_8};
#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
pub use avx512::{gather_16, load_at_16, scatter_16, store_at_16};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx")))]
pub use halves::{gather_8, scatter_8};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx512f")))]
pub use halves::{gather_16, scatter_16};

#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
mod avx {
    use super::*;
    use std::arch::x86_64::*;

    /// Transposes the 4 × 4 block in each 128-bit lane.
    #[inline(always)]
    fn transpose(r: [__m256; 4]) -> [__m256; 4] {
        // SAFETY: AVX is a target feature of this build.
        unsafe {
            let ab_lo = _mm256_unpacklo_ps(r[0], r[1]);
            let cd_lo = _mm256_unpacklo_ps(r[2], r[3]);
            let ab_hi = _mm256_unpackhi_ps(r[0], r[1]);
            let cd_hi = _mm256_unpackhi_ps(r[2], r[3]);
            [
                _mm256_shuffle_ps::<0b01_00_01_00>(ab_lo, cd_lo),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab_lo, cd_lo),
                _mm256_shuffle_ps::<0b01_00_01_00>(ab_hi, cd_hi),
                _mm256_shuffle_ps::<0b11_10_11_10>(ab_hi, cd_hi),
            ]
        }
    }

    /// Half rows of bodies `k` and `4 + k`, one per 128-bit lane.
    ///
    /// # Safety
    /// `index` holds at least 8 entries, each less than `rows.len()`.
    #[inline(always)]
    unsafe fn load<const HALF: usize>(rows: &[BodyRow], index: &[u32], k: usize) -> __m256 {
        // SAFETY: the caller keeps the 8 indices in bounds; half a row is four floats.
        unsafe {
            let low = _mm_load_ps(half::<HALF>(rows, index, k));
            let high = _mm_load_ps(half::<HALF>(rows, index, 4 + k));
            _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(low), high)
        }
    }

    /// # Safety
    /// `index` holds at least 8 entries, each less than `rows.len()`.
    #[inline(always)]
    unsafe fn load_transposed<const HALF: usize>(rows: &[BodyRow], index: &[u32]) -> [f32x8; 4] {
        // SAFETY: the caller keeps the indices in bounds. Calls written out, because a
        // closure under `map` is not always inlined.
        let t = transpose(unsafe {
            [
                load::<HALF>(rows, index, 0),
                load::<HALF>(rows, index, 1),
                load::<HALF>(rows, index, 2),
                load::<HALF>(rows, index, 3),
            ]
        });
        [from_m256(t[0]), from_m256(t[1]), from_m256(t[2]), from_m256(t[3])]
    }

    /// # Safety
    /// `index` holds at least 8 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn gather_8(rows: &[BodyRow], index: &[u32]) -> [f32x8; 8] {
        // SAFETY: the caller keeps `index` in bounds.
        let (l, h) = unsafe { (load_transposed::<0>(rows, index), load_transposed::<1>(rows, index)) };
        [l[0], l[1], l[2], l[3], h[0], h[1], h[2], h[3]]
    }

    /// # Safety
    /// `index` holds at least 8 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn scatter_8<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], v: [f32x8; 4]) {
        let t = transpose([into_m256(v[0]), into_m256(v[1]), into_m256(v[2]), into_m256(v[3])]);
        for (k, row) in t.into_iter().enumerate() {
            let row = wide_barrier(row);
            // SAFETY: the caller keeps the 8 indices in bounds; half rows are 16-byte aligned.
            unsafe {
                _mm_store_ps(half_mut::<HALF>(rows, index, k), _mm256_castps256_ps128(row));
                _mm_store_ps(half_mut::<HALF>(rows, index, 4 + k), _mm256_extractf128_ps::<1>(row));
            }
        }
    }

    /// Keeps a transposed register whole: without it the optimiser splits the
    /// transpose into 128-bit shuffles, one set per extracted lane.
    #[inline(always)]
    fn wide_barrier(mut v: __m256) -> __m256 {
        // SAFETY: an empty instruction that claims to read and write one register.
        unsafe {
            std::arch::asm!("/* {0} */", inout(ymm_reg) v, options(pure, nomem, nostack, preserves_flags))
        };
        v
    }

    #[inline(always)]
    fn from_m256(v: __m256) -> f32x8 {
        // SAFETY: both are 32 bytes of plain floats.
        unsafe { std::mem::transmute(v) }
    }

    #[inline(always)]
    fn into_m256(v: f32x8) -> __m256 {
        // SAFETY: both are 32 bytes of plain floats.
        unsafe { std::mem::transmute(v) }
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
mod avx512 {
    use super::*;
    use std::arch::x86_64::*;

    /// Transposes the 4 × 4 block in each 128-bit lane.
    #[inline(always)]
    fn transpose(r: [__m512; 4]) -> [__m512; 4] {
        // SAFETY: AVX-512F is a target feature of this build.
        unsafe {
            let ab_lo = _mm512_unpacklo_ps(r[0], r[1]);
            let cd_lo = _mm512_unpacklo_ps(r[2], r[3]);
            let ab_hi = _mm512_unpackhi_ps(r[0], r[1]);
            let cd_hi = _mm512_unpackhi_ps(r[2], r[3]);
            [
                _mm512_shuffle_ps::<0b01_00_01_00>(ab_lo, cd_lo),
                _mm512_shuffle_ps::<0b11_10_11_10>(ab_lo, cd_lo),
                _mm512_shuffle_ps::<0b01_00_01_00>(ab_hi, cd_hi),
                _mm512_shuffle_ps::<0b11_10_11_10>(ab_hi, cd_hi),
            ]
        }
    }

    /// Whole rows of bodies `i` and `i + 4`, one per 256-bit half.
    ///
    /// # Safety
    /// `index` holds at least `i + 5` entries, each less than `rows.len()`.
    #[inline(always)]
    unsafe fn load(rows: &[BodyRow], index: &[u32], i: usize) -> __m512 {
        // SAFETY: the caller keeps the indices in bounds; a row is eight floats, aligned to 32 bytes.
        unsafe {
            let low = _mm512_castps256_ps512(_mm256_load_ps(half::<0>(rows, index, i)));
            _mm512_insertf32x8::<1>(low, _mm256_load_ps(half::<0>(rows, index, i + 4)))
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
            let velocity = |c: usize| from_m512(_mm512_shuffle_f32x4::<0b10_00_10_00>(p[c], q[c]));
            let delta = |c: usize| from_m512(_mm512_shuffle_f32x4::<0b11_01_11_01>(p[c], q[c]));
            [velocity(0), velocity(1), velocity(2), velocity(3), delta(0), delta(1), delta(2), delta(3)]
        }
    }

    /// # Safety
    /// `index` holds at least 16 entries, each less than `values.len()` and than 2³¹.
    #[inline(always)]
    pub unsafe fn load_at_16(values: &[f32], index: &[u32]) -> f32x16 {
        // SAFETY: the caller keeps the 16 indices in bounds; the load of indices is unaligned.
        from_m512(unsafe {
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
            _mm512_i32scatter_ps::<4>(values.as_mut_ptr(), index, into_m512(v));
        }
    }

    /// # Safety
    /// `index` holds at least 16 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn scatter_16<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], v: [f32x16; 4]) {
        let t = transpose([into_m512(v[0]), into_m512(v[1]), into_m512(v[2]), into_m512(v[3])]);
        for (k, row) in t.into_iter().enumerate() {
            let row = wide_barrier(row);
            // SAFETY: the caller keeps the 16 indices in bounds; half rows are 16-byte aligned.
            unsafe {
                _mm_store_ps(half_mut::<HALF>(rows, index, k), _mm512_castps512_ps128(row));
                _mm_store_ps(half_mut::<HALF>(rows, index, 4 + k), _mm512_extractf32x4_ps::<1>(row));
                _mm_store_ps(half_mut::<HALF>(rows, index, 8 + k), _mm512_extractf32x4_ps::<2>(row));
                _mm_store_ps(half_mut::<HALF>(rows, index, 12 + k), _mm512_extractf32x4_ps::<3>(row));
            }
        }
    }

    /// Keeps a transposed register whole: without it the optimiser splits the
    /// transpose into 128-bit shuffles, one set per extracted lane.
    #[inline(always)]
    fn wide_barrier(mut v: __m512) -> __m512 {
        // SAFETY: an empty instruction that claims to read and write one register.
        unsafe {
            std::arch::asm!("/* {0} */", inout(zmm_reg) v, options(pure, nomem, nostack, preserves_flags))
        };
        v
    }

    #[inline(always)]
    fn from_m512(v: __m512) -> f32x16 {
        // SAFETY: both are 64 bytes of plain floats.
        unsafe { std::mem::transmute(v) }
    }

    #[inline(always)]
    fn into_m512(v: f32x16) -> __m512 {
        // SAFETY: both are 64 bytes of plain floats.
        unsafe { std::mem::transmute(v) }
    }
}

/// Widths without instructions of their own: two gathers of half the width, joined.
#[allow(dead_code)]
mod halves {
    use super::*;

    fn join_8(a: f32x4, b: f32x4) -> f32x8 {
        bytemuck::cast([a, b])
    }

    /// # Safety
    /// `index` holds at least 8 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn gather_8(rows: &[BodyRow], index: &[u32]) -> [f32x8; 8] {
        // SAFETY: the caller keeps the 8 indices in bounds.
        let (a, b) = unsafe { (gather_4(rows, index), gather_4(rows, &index[4..])) };
        std::array::from_fn(|c| join_8(a[c], b[c]))
    }

    /// # Safety
    /// `index` holds at least 8 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn scatter_8<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], v: [f32x8; 4]) {
        let v: [[f32x4; 2]; 4] = bytemuck::cast(v);
        // SAFETY: the caller keeps the 8 indices in bounds.
        unsafe {
            scatter_4::<HALF>(rows, index, v.map(|v| v[0]));
            scatter_4::<HALF>(rows, &index[4..], v.map(|v| v[1]));
        }
    }

    /// # Safety
    /// `index` holds at least 16 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn gather_16(rows: &[BodyRow], index: &[u32]) -> [f32x16; 8] {
        // SAFETY: the caller keeps the 16 indices in bounds.
        let (a, b) = unsafe { (super::gather_8(rows, index), super::gather_8(rows, &index[8..])) };
        std::array::from_fn(|c| bytemuck::cast([a[c], b[c]]))
    }

    /// # Safety
    /// `index` holds at least 16 entries, each less than `rows.len()`.
    #[inline(always)]
    pub unsafe fn scatter_16<const HALF: usize>(rows: &mut [BodyRow], index: &[u32], v: [f32x16; 4]) {
        let v: [[f32x8; 2]; 4] = bytemuck::cast(v);
        // SAFETY: the caller keeps the 16 indices in bounds.
        unsafe {
            super::scatter_8::<HALF>(rows, index, v.map(|v| v[0]));
            super::scatter_8::<HALF>(rows, &index[8..], v.map(|v| v[1]));
        }
    }
}
