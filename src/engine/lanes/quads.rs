//! Gather and scatter of quads: 16 aligned bytes from records anywhere in memory.
//!
//! A record has `STRIDE` quads. Quad `OFFSET` of `W` records is loaded and transposed in registers. The
//! transposes stay inside 128-bit lanes: 128-bit lane `q` of vector `k` is loaded from record `4q + k`. One 4
//! × 4 transpose of each 128-bit lane (8 shuffles for any width) then puts component `c` of records `0..W`,
//! in order, into vector `c`.

#![allow(
    unsafe_code,
    reason = "loads and stores by index, which `index` keeps in bounds; vector instructions"
)]

use super::index::{LaneIndex, assert_fits};
use bytemuck::{Pod, Zeroable};
use std::marker::PhantomData;
use wide::{f32x4, f32x8, f32x16};

/// Four floats, aligned for a single load.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Quad(pub [f32; 4]);

/// Quads in memory: those of a slice, or of rows that threads share.
#[derive(Clone, Copy)]
pub struct QuadsAt<'a> {
    first: *mut Quad,
    len: usize,
    of: PhantomData<&'a Quad>,
}

impl QuadsAt<'_> {
    /// `len` quads from `first` on.
    ///
    /// # Safety
    /// They exist for `'a`, and meanwhile no other thread writes those that are gathered or accesses those that are
    /// scattered.
    #[inline(always)]
    pub unsafe fn new(first: *mut Quad, len: usize) -> Self {
        QuadsAt { first, len, of: PhantomData }
    }
}

/// For gathers; a scatter needs a mutable slice.
impl<'a> From<&'a [Quad]> for QuadsAt<'a> {
    #[inline(always)]
    fn from(quads: &'a [Quad]) -> Self {
        QuadsAt { first: quads.as_ptr().cast_mut(), len: quads.len(), of: PhantomData }
    }
}

impl<'a> From<&'a mut [Quad]> for QuadsAt<'a> {
    #[inline(always)]
    fn from(quads: &'a mut [Quad]) -> Self {
        QuadsAt { first: quads.as_mut_ptr(), len: quads.len(), of: PhantomData }
    }
}

/// Quad `OFFSET` of record `i`.
///
/// # Safety
/// `i * STRIDE + OFFSET < quads.len`.
#[inline(always)]
unsafe fn at<const STRIDE: usize, const OFFSET: usize>(quads: QuadsAt<'_>, i: u32) -> *mut f32 {
    debug_assert!(i as usize * STRIDE + OFFSET < quads.len);
    // SAFETY: the caller's promise.
    unsafe { quads.first.add(i as usize * STRIDE + OFFSET).cast() }
}

/// Checks that every record in `index` has quad `OFFSET`; returns the indices.
#[inline(always)]
fn checked<'a, I: Pod, const STRIDE: usize, const OFFSET: usize>(
    quads: QuadsAt<'_>,
    index: LaneIndex<'a, I>,
) -> &'a I {
    const { assert!(OFFSET < STRIDE) };
    assert_fits(index.bound(), quads.len, STRIDE);
    index.array()
}

/// Prefetches the cache lines of `values[range]`. Does nothing if the range exceeds `values`, or if the
/// target has no such instruction. A hint that changes no value.
#[inline(always)]
pub fn prefetch<T>(values: &[T], range: std::ops::Range<usize>) {
    #[cfg(target_arch = "x86_64")]
    if range.end <= values.len() {
        let bytes = range.len() * size_of::<T>();
        for line in 0..bytes.div_ceil(64) {
            let address = values.as_ptr().wrapping_add(range.start).cast::<i8>().wrapping_add(64 * line);
            // SAFETY: a hint; it faults at no address.
            unsafe { std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(address) };
        }
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (values, range);
}

/// Prefetches records of `STRIDE` quads, up to two cache lines each.
#[inline(always)]
pub fn prefetch_records<const STRIDE: usize>(quads: &[Quad], index: impl Iterator<Item = u32>) {
    for i in index {
        prefetch_quad::<STRIDE, 0>(quads, i);
        prefetch_quad::<STRIDE, 4>(quads, i);
    }
}

/// Prefetches the cache line of quad `OFFSET` of record `i` of `STRIDE` quads.
#[inline(always)]
pub fn prefetch_quad<const STRIDE: usize, const OFFSET: usize>(quads: &[Quad], i: u32) {
    prefetch_line(quads.as_ptr().wrapping_add(i as usize * STRIDE + OFFSET));
}

/// Prefetches the cache line of a quad.
#[inline(always)]
pub fn prefetch_line(quad: *const Quad) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a hint; it faults at no address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(quad.cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = quad;
}

#[inline(always)]
pub fn gather_1<const S: usize, const O: usize>(quads: QuadsAt<'_>, index: LaneIndex<[u32; 1]>) -> [f32; 4] {
    let [i] = *checked::<_, S, O>(quads, index);
    // SAFETY: `checked`; a quad is four floats.
    unsafe { *at::<S, O>(quads, i).cast::<[f32; 4]>() }
}

#[inline(always)]
pub fn scatter_1<const S: usize, const O: usize>(
    quads: QuadsAt<'_>,
    index: LaneIndex<[u32; 1]>,
    v: [f32; 4],
) {
    let [i] = *checked::<_, S, O>(quads, index);
    // SAFETY: `checked`; a quad is four floats.
    unsafe { *at::<S, O>(quads, i).cast::<[f32; 4]>() = v }
}

#[inline(always)]
pub fn scatter_halves_1<const S: usize, const O: usize, const P: usize>(
    quads: QuadsAt<'_>,
    index: LaneIndex<[u32; 1]>,
    v: [f32; 4],
) {
    let [i] = *checked::<_, S, O>(quads, index);
    checked::<_, S, P>(quads, index);
    // SAFETY: `checked`.
    unsafe { store_halves::<S, O, P>(quads, i, v) }
}

/// Writes `v[..2]` to the second half of quad `O` of record `i`, and `v[2..]` to that of quad `P`.
///
/// # Safety
/// `i * S + max(O, P) < quads.len`.
#[inline(always)]
unsafe fn store_halves<const S: usize, const O: usize, const P: usize>(
    quads: QuadsAt<'_>,
    i: u32,
    v: [f32; 4],
) {
    // SAFETY: the caller's promise; the second half of a quad is two floats.
    unsafe {
        *at::<S, O>(quads, i).add(2).cast::<[f32; 2]>() = [v[0], v[1]];
        *at::<S, P>(quads, i).add(2).cast::<[f32; 2]>() = [v[2], v[3]];
    }
}

#[inline(always)]
pub fn gather_4<const S: usize, const O: usize>(
    quads: QuadsAt<'_>,
    index: LaneIndex<[u32; 4]>,
) -> [f32x4; 4] {
    let index = checked::<_, S, O>(quads, index);
    // SAFETY: `checked`; quads are aligned as `f32x4` is.
    f32x4::transpose(unsafe {
        [
            *at::<S, O>(quads, index[0]).cast::<f32x4>(),
            *at::<S, O>(quads, index[1]).cast::<f32x4>(),
            *at::<S, O>(quads, index[2]).cast::<f32x4>(),
            *at::<S, O>(quads, index[3]).cast::<f32x4>(),
        ]
    })
}

#[inline(always)]
pub fn scatter_4<const S: usize, const O: usize>(
    quads: QuadsAt<'_>,
    index: LaneIndex<[u32; 4]>,
    v: [f32x4; 4],
) {
    let index = checked::<_, S, O>(quads, index);
    for (lane, quad) in f32x4::transpose(v).into_iter().enumerate() {
        // SAFETY: `checked`; quads are aligned as `f32x4` is.
        unsafe { *at::<S, O>(quads, index[lane]).cast::<f32x4>() = quad }
    }
}

#[inline(always)]
pub fn scatter_halves_4<const S: usize, const O: usize, const P: usize>(
    quads: QuadsAt<'_>,
    index: LaneIndex<[u32; 4]>,
    v: [f32x4; 4],
) {
    checked::<_, S, P>(quads, index);
    let index = checked::<_, S, O>(quads, index);
    for (lane, quad) in f32x4::transpose(v).into_iter().enumerate() {
        // SAFETY: `checked`.
        unsafe { store_halves::<S, O, P>(quads, index[lane], quad.to_array()) }
    }
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
pub use avx::{gather_8, scatter_8, scatter_halves_8};
#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
pub use avx512::{gather_16, scatter_16, scatter_halves_16};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx")))]
pub use halves::{gather_8, scatter_8, scatter_halves_8};
#[cfg(not(all(target_arch = "x86_64", target_feature = "avx512f")))]
pub use halves::{gather_16, scatter_16, scatter_halves_16};

/// The module of one register width, with `$lanes` 128-bit lanes per register.
#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
macro_rules! registers {
    ($module:ident, $register:ident, $float:ident, $class:ident, $lanes:literal, $unpacklo:ident, $unpackhi:ident,
     $shuffle:ident, $gather:ident, $scatter:ident, $halves:ident, |$quads:ident| $join:expr, |$row:ident| $split:expr) => {
        pub(super) mod $module {
            use super::*;
            use std::arch::x86_64::*;

            /// Transposes the 4 × 4 block in each 128-bit lane.
            #[inline(always)]
            pub fn transpose(r: [$register; 4]) -> [$register; 4] {
                // SAFETY: the instructions are target features of this build.
                unsafe {
                    let ab_lo = $unpacklo(r[0], r[1]);
                    let cd_lo = $unpacklo(r[2], r[3]);
                    let ab_hi = $unpackhi(r[0], r[1]);
                    let cd_hi = $unpackhi(r[2], r[3]);
                    [
                        $shuffle::<0b01_00_01_00>(ab_lo, cd_lo),
                        $shuffle::<0b11_10_11_10>(ab_lo, cd_lo),
                        $shuffle::<0b01_00_01_00>(ab_hi, cd_hi),
                        $shuffle::<0b11_10_11_10>(ab_hi, cd_hi),
                    ]
                }
            }

            /// Quads of records `k`, `4 + k`, …, one per 128-bit lane.
            ///
            /// # Safety
            /// Every record in `index` has quad `O`.
            #[inline(always)]
            unsafe fn load<const S: usize, const O: usize>(
                quads: QuadsAt<'_>,
                index: &[u32; 4 * $lanes],
                k: usize,
            ) -> $register {
                // SAFETY: SSE is a target feature of this build.
                let mut $quads = [unsafe { _mm_setzero_ps() }; $lanes];
                for (q, quad) in $quads.iter_mut().enumerate() {
                    // SAFETY: the caller's promise; quads are aligned.
                    *quad = unsafe { _mm_load_ps(at::<S, O>(quads, index[4 * q + k])) };
                }
                // SAFETY: the instructions are target features of this build.
                unsafe { $join }
            }

            #[inline(always)]
            pub fn $gather<const S: usize, const O: usize>(
                quads: QuadsAt<'_>,
                index: LaneIndex<[u32; 4 * $lanes]>,
            ) -> [$float; 4] {
                let index = checked::<_, S, O>(quads, index);
                // SAFETY: `checked`. Calls written out, because a closure under `map` is not
                // always inlined.
                let t = transpose(unsafe {
                    [
                        load::<S, O>(quads, index, 0),
                        load::<S, O>(quads, index, 1),
                        load::<S, O>(quads, index, 2),
                        load::<S, O>(quads, index, 3),
                    ]
                });
                [from(t[0]), from(t[1]), from(t[2]), from(t[3])]
            }

            /// The quads of records `k`, `4 + k`, … for k in 0..4.
            #[inline(always)]
            fn rows(v: [$float; 4]) -> [[__m128; $lanes]; 4] {
                let t = transpose([into(v[0]), into(v[1]), into(v[2]), into(v[3])]);
                let row = |$row: $register| {
                    let $row = barrier($row);
                    // SAFETY: the instructions are target features of this build.
                    unsafe { $split }
                };
                [row(t[0]), row(t[1]), row(t[2]), row(t[3])]
            }

            #[inline(always)]
            pub fn $scatter<const S: usize, const O: usize>(
                quads: QuadsAt<'_>,
                index: LaneIndex<[u32; 4 * $lanes]>,
                v: [$float; 4],
            ) {
                let index = checked::<_, S, O>(quads, index);
                for (k, row) in rows(v).into_iter().enumerate() {
                    for (q, quad) in row.into_iter().enumerate() {
                        // SAFETY: `checked`; quads are aligned.
                        unsafe { _mm_store_ps(at::<S, O>(quads, index[4 * q + k]), quad) }
                    }
                }
            }

            #[inline(always)]
            pub fn $halves<const S: usize, const O: usize, const P: usize>(
                quads: QuadsAt<'_>,
                index: LaneIndex<[u32; 4 * $lanes]>,
                v: [$float; 4],
            ) {
                checked::<_, S, P>(quads, index);
                let index = checked::<_, S, O>(quads, index);
                for (k, row) in rows(v).into_iter().enumerate() {
                    for (q, quad) in row.into_iter().enumerate() {
                        // SAFETY: `checked`; the second half of a quad is the two floats that
                        // each instruction stores.
                        unsafe {
                            let quad = _mm_castps_pd(quad);
                            _mm_storel_pd(at::<S, O>(quads, index[4 * q + k]).add(2).cast(), quad);
                            _mm_storeh_pd(at::<S, P>(quads, index[4 * q + k]).add(2).cast(), quad);
                        }
                    }
                }
            }

            /// Keeps a transposed register whole. Otherwise the optimizer splits the transpose into 128-bit
            /// shuffles, one set per extracted lane.
            #[inline(always)]
            fn barrier(mut v: $register) -> $register {
                // SAFETY: an empty instruction that claims to read and write one register.
                unsafe {
                    std::arch::asm!("/* {0} */", inout($class) v, options(pure, nomem, nostack, preserves_flags))
                };
                v
            }

            #[inline(always)]
            pub fn from(v: $register) -> $float {
                // SAFETY: both are the same number of plain floats.
                unsafe { std::mem::transmute(v) }
            }

            #[inline(always)]
            pub fn into(v: $float) -> $register {
                // SAFETY: both are the same number of plain floats.
                unsafe { std::mem::transmute(v) }
            }
        }
    };
}

#[cfg(all(target_arch = "x86_64", target_feature = "avx"))]
registers!(
    avx,
    __m256,
    f32x8,
    ymm_reg,
    2,
    _mm256_unpacklo_ps,
    _mm256_unpackhi_ps,
    _mm256_shuffle_ps,
    gather_8,
    scatter_8,
    scatter_halves_8,
    |quads| _mm256_insertf128_ps::<1>(_mm256_castps128_ps256(quads[0]), quads[1]),
    |row| [_mm256_castps256_ps128(row), _mm256_extractf128_ps::<1>(row)]
);

#[cfg(all(target_arch = "x86_64", target_feature = "avx512f"))]
registers!(
    avx512,
    __m512,
    f32x16,
    zmm_reg,
    4,
    _mm512_unpacklo_ps,
    _mm512_unpackhi_ps,
    _mm512_shuffle_ps,
    gather_16,
    scatter_16,
    scatter_halves_16,
    |quads| {
        let v = _mm512_insertf32x4::<1>(_mm512_castps128_ps512(quads[0]), quads[1]);
        _mm512_insertf32x4::<3>(_mm512_insertf32x4::<2>(v, quads[2]), quads[3])
    },
    |row| [
        _mm512_castps512_ps128(row),
        _mm512_extractf32x4_ps::<1>(row),
        _mm512_extractf32x4_ps::<2>(row),
        _mm512_extractf32x4_ps::<3>(row),
    ]
);

/// Widths without native instructions: two vectors of half the width, joined.
#[allow(dead_code)]
mod halves {
    use super::*;

    macro_rules! halves {
        ($whole:ident, $half:ident, $width:literal, $gather:ident, $scatter:ident, $halves:ident,
         $gather_half:ident, $scatter_half:ident, $halves_half:ident) => {
            #[inline(always)]
            pub fn $gather<const S: usize, const O: usize>(
                quads: QuadsAt<'_>,
                index: LaneIndex<[u32; $width]>,
            ) -> [$whole; 4] {
                let [low, high] = index.halves();
                let (a, b) =
                    (super::$gather_half::<S, O>(quads, low), super::$gather_half::<S, O>(quads, high));
                std::array::from_fn(|c| bytemuck::cast([a[c], b[c]]))
            }

            #[inline(always)]
            pub fn $scatter<const S: usize, const O: usize>(
                quads: QuadsAt<'_>,
                index: LaneIndex<[u32; $width]>,
                v: [$whole; 4],
            ) {
                let v: [[$half; 2]; 4] = bytemuck::cast(v);
                let [low, high] = index.halves();
                super::$scatter_half::<S, O>(quads, low, v.map(|v| v[0]));
                super::$scatter_half::<S, O>(quads, high, v.map(|v| v[1]));
            }

            #[inline(always)]
            pub fn $halves<const S: usize, const O: usize, const P: usize>(
                quads: QuadsAt<'_>,
                index: LaneIndex<[u32; $width]>,
                v: [$whole; 4],
            ) {
                let v: [[$half; 2]; 4] = bytemuck::cast(v);
                let [low, high] = index.halves();
                super::$halves_half::<S, O, P>(quads, low, v.map(|v| v[0]));
                super::$halves_half::<S, O, P>(quads, high, v.map(|v| v[1]));
            }
        };
    }

    halves!(f32x8, f32x4, 8, gather_8, scatter_8, scatter_halves_8, gather_4, scatter_4, scatter_halves_4);
    halves!(
        f32x16,
        f32x8,
        16,
        gather_16,
        scatter_16,
        scatter_halves_16,
        gather_8,
        scatter_8,
        scatter_halves_8
    );
}
