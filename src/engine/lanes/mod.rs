//! Lanes: the vector operations that kernels need, at widths 1, 4, 8 and 16.
//!
//! One private-looking trait, [`Lanes`], holds only what the kernels use, so
//! that a kernel is written once and compiled at every width. Its promise:
//! every operation gives, lane by lane, the same bits at every width.
//!
//! * `+ − × ÷` are IEEE operations and agree by themselves.
//! * [`Lanes::mul_add`] is fused at every width or at none ([`FUSED`]).
//! * [`Lanes::max`] and [`Lanes::min`] return the *second* operand when the two
//!   compare equal (so for ±0) or are unordered: the rule of the x86 instructions.
//! * No reciprocal estimates.
//!
//! Kernels gather and scatter by [`LaneIndex`], indices with a bound, and no index of theirs is out of
//! place: it panics instead. What is unsafe in that is in `quads.rs` and `rows.rs`, and nothing of
//! it depends on who implements [`Lanes`].
//!
//! Which instructions a width becomes is decided at build time by the target
//! CPU; [`native_width`] tells the widest that is not emulated.

mod aligned;
mod counted;
mod index;
mod quads;
mod rows;
mod store;

pub use aligned::{Block, LaneVec, held};
pub use counted::{Counted, Operations};
pub use index::{IndexList, Indices, LaneIndex, MOST_LANES};
pub use quads::{Quad, prefetch, prefetch_records};
pub use rows::BodyRow;
pub use store::{RowColumns, RowStore};

use bytemuck::Pod;
use std::ops::{Add, Div, Mul, Neg, Sub};
use wide::{f32x4, f32x8, f32x16};

/// Whether [`Lanes::mul_add`] rounds once (a fused instruction) or twice.
pub const FUSED: bool = cfg!(any(
    all(target_arch = "x86_64", target_feature = "fma"),
    all(target_arch = "aarch64", target_feature = "neon")
));

/// How many contacts one instruction processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LaneWidth {
    /// Scalar code.
    W1,
    /// 128-bit lanes.
    W4,
    /// 256-bit lanes.
    W8,
    /// 512-bit lanes.
    W16,
}

impl LaneWidth {
    /// Every width, narrowest first.
    pub const ALL: [LaneWidth; 4] = [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8, LaneWidth::W16];

    /// The number of lanes.
    pub const fn lanes(self) -> usize {
        match self {
            LaneWidth::W1 => 1,
            LaneWidth::W4 => 4,
            LaneWidth::W8 => 8,
            LaneWidth::W16 => 16,
        }
    }

    /// The width with that many lanes, if there is one.
    pub fn from_lanes(lanes: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|w| w.lanes() == lanes)
    }
}

/// The widest lanes that this build has instructions for; wider ones are emulated.
pub const fn native_width() -> LaneWidth {
    if cfg!(target_feature = "avx512f") {
        LaneWidth::W16
    } else if cfg!(target_feature = "avx") {
        LaneWidth::W8
    } else if cfg!(any(target_feature = "sse2", target_feature = "neon", target_feature = "simd128")) {
        LaneWidth::W4
    } else {
        LaneWidth::W1
    }
}

/// The vector extensions that this build uses, for records.
pub fn target_features() -> &'static str {
    if cfg!(target_feature = "avx512f") {
        "avx512f+fma"
    } else if cfg!(all(target_feature = "avx2", target_feature = "fma")) {
        "avx2+fma"
    } else if cfg!(target_feature = "avx") {
        "avx"
    } else if cfg!(target_feature = "sse2") {
        "sse2"
    } else if cfg!(target_feature = "neon") {
        "neon"
    } else {
        "scalar"
    }
}

/// `WIDTH` floats that are worked on together.
pub trait Lanes:
    Pod + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
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

    /// The rows of `WIDTH` bodies, transposed: `[vx, vy, ω, m⁻¹, Δx, Δy, Δθ, I⁻¹]`.
    ///
    /// # Panics
    /// If there are fewer rows than the bound of `index`.
    #[inline(always)]
    fn gather(rows: &[BodyRow], index: LaneIndex<Self::Index>) -> [Self; 8] {
        gather_halves(rows, index)
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

    /// `self == other ? yes : no`, as floats: −0 equals 0.
    fn select_equal(self, other: Self, yes: Self, no: Self) -> Self;

    /// The whole number n in [0, 2²³) that `self` holds, as the bits of the integer n.
    fn integer_bits(self) -> Self;

    /// `values[index[lane]]` in every lane.
    ///
    /// # Panics
    /// If there are fewer values than the bound of `index`.
    fn load_at(values: &[f32], index: LaneIndex<Self::Index>) -> Self;

    /// `values[index[lane]] = v[lane]`, in lane order.
    ///
    /// # Panics
    /// As [`Self::load_at`].
    fn store_at(values: &mut [f32], index: LaneIndex<Self::Index>, v: Self);

    /// Zero in every lane.
    #[inline(always)]
    fn zero() -> Self {
        Self::zeroed()
    }
}

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
    fn gather_quads<const S: usize, const O: usize>(
        quads: &[Quad],
        index: LaneIndex<Self::Index>,
    ) -> [Self; 4] {
        quads::gather_1::<S, O>(quads, index)
    }

    #[inline(always)]
    fn scatter_quads<const S: usize, const O: usize>(
        quads: &mut [Quad],
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    ) {
        quads::scatter_1::<S, O>(quads, index, v)
    }

    #[inline(always)]
    fn scatter_halves<const S: usize, const O: usize, const P: usize>(
        quads: &mut [Quad],
        index: LaneIndex<Self::Index>,
        v: [Self; 4],
    ) {
        quads::scatter_halves_1::<S, O, P>(quads, index, v)
    }

    #[inline(always)]
    fn select_equal(self, other: Self, yes: Self, no: Self) -> Self {
        if self == other { yes } else { no }
    }

    #[inline(always)]
    fn integer_bits(self) -> Self {
        f32::from_bits((self + INTEGERS).to_bits() & MANTISSA)
    }

    #[inline(always)]
    fn load_at(values: &[f32], index: LaneIndex<Self::Index>) -> Self {
        rows::load_each(values, index)
    }

    #[inline(always)]
    fn store_at(values: &mut [f32], index: LaneIndex<Self::Index>, v: Self) {
        rows::store_each(values, index, v)
    }
}

/// Floats from 2²³ on are the integers, and their last 23 bits count from there.
const INTEGERS: f32 = 8_388_608.0;
const MANTISSA: u32 = 0x007F_FFFF;

macro_rules! wide_lanes {
    ($type:ty, $width:literal, quads: $gather_quads:ident, $scatter:ident, $halves:ident,
     columns: $load:ident, $store:ident $(, rows: $gather:ident)?) => {
        impl Lanes for $type {
            const WIDTH: usize = $width;

            type Index = [u32; $width];

            $(
                #[inline(always)]
                fn gather(rows: &[BodyRow], index: LaneIndex<Self::Index>) -> [Self; 8] {
                    rows::$gather(rows, index)
                }
            )?

            #[inline(always)]
            fn splat(value: f32) -> Self {
                <$type>::splat(value)
            }

            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                <$type>::mul_add(self, factor, term)
            }

            #[inline(always)]
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                <$type>::mul_neg_add(self, factor, term)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.fast_max(other)
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.fast_min(other)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                <$type>::sqrt(self)
            }

            #[inline(always)]
            fn select_positive(self, positive: Self, otherwise: Self) -> Self {
                wide::Select::select(self.simd_gt(Self::zeroed()), positive, otherwise)
            }

            #[inline(always)]
            fn any_positive(self) -> bool {
                self.simd_gt(Self::zeroed()).any()
            }

            #[inline(always)]
            fn gather_quads<const S: usize, const O: usize>(
                quads: &[Quad],
                index: LaneIndex<Self::Index>,
            ) -> [Self; 4] {
                quads::$gather_quads::<S, O>(quads, index)
            }

            #[inline(always)]
            fn scatter_quads<const S: usize, const O: usize>(
                quads: &mut [Quad],
                index: LaneIndex<Self::Index>,
                v: [Self; 4],
            ) {
                quads::$scatter::<S, O>(quads, index, v)
            }

            #[inline(always)]
            fn scatter_halves<const S: usize, const O: usize, const P: usize>(
                quads: &mut [Quad],
                index: LaneIndex<Self::Index>,
                v: [Self; 4],
            ) {
                quads::$halves::<S, O, P>(quads, index, v)
            }

            #[inline(always)]
            fn select_equal(self, other: Self, yes: Self, no: Self) -> Self {
                wide::Select::select(self.simd_eq(other), yes, no)
            }

            #[inline(always)]
            fn integer_bits(self) -> Self {
                (self + <$type>::splat(INTEGERS)) & <$type>::splat(f32::from_bits(MANTISSA))
            }

            #[inline(always)]
            fn load_at(values: &[f32], index: LaneIndex<Self::Index>) -> Self {
                rows::$load(values, index)
            }

            #[inline(always)]
            fn store_at(values: &mut [f32], index: LaneIndex<Self::Index>, v: Self) {
                rows::$store(values, index, v)
            }
        }
    };
}

use bytemuck::Zeroable;
wide_lanes!(f32x4, 4, quads: gather_4, scatter_4, scatter_halves_4, columns: load_each, store_each);
wide_lanes!(f32x8, 8, quads: gather_8, scatter_8, scatter_halves_8, columns: load_each, store_each);
wide_lanes!(f32x16, 16, quads: gather_16, scatter_16, scatter_halves_16,
    columns: load_at_16, store_at_16, rows: gather_16);

/// Rows by their two halves.
#[inline(always)]
fn gather_halves<L: Lanes>(rows: &[BodyRow], index: LaneIndex<L::Index>) -> [L; 8] {
    let quads: &[Quad] = bytemuck::cast_slice(rows);
    let (v, d) = (L::gather_quads::<2, 0>(quads, index), L::gather_quads::<2, 1>(quads, index));
    [v[0], v[1], v[2], v[3], d[0], d[1], d[2], d[3]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Awkward values are drawn as often as ordinary ones.
    fn awkward() -> impl Strategy<Value = f32> {
        prop_oneof![
            prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, f32::MIN_POSITIVE, 1e-40, 3e38, -3e38, 1e-7]),
            -1e3_f32..1e3,
            any::<f32>().prop_filter("not NaN", |x| !x.is_nan()),
        ]
    }

    fn floats<L: Lanes>(v: L) -> Vec<f32> {
        bytemuck::cast_slice(&[v]).to_vec()
    }

    fn load<L: Lanes>(values: &[f32]) -> L {
        let mut v = L::zero();
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut v)).copy_from_slice(&values[..L::WIDTH]);
        v
    }

    fn same_bits(a: f32, b: f32) -> bool {
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    }

    /// Every operation of one width against the same operation on scalars.
    fn agrees_with_scalar<L: Lanes>(x: &[f32], y: &[f32], z: &[f32]) -> Result<(), TestCaseError> {
        let (a, b, c) = (load::<L>(x), load::<L>(y), load::<L>(z));
        type Scalar = fn(f32, f32, f32) -> f32;
        let cases: [(&str, L, Scalar); 10] = [
            ("sqrt", Lanes::sqrt(a), |a, _, _| Lanes::sqrt(a)),
            ("add", a + b, |a, b, _| a + b),
            ("sub", a - b, |a, b, _| a - b),
            ("mul", a * b, |a, b, _| a * b),
            ("div", a / b, |a, b, _| a / b),
            ("mul_add", a.mul_add(b, c), |a, b, c| Lanes::mul_add(a, b, c)),
            ("neg_mul_add", a.neg_mul_add(b, c), |a, b, c| Lanes::neg_mul_add(a, b, c)),
            ("max", Lanes::max(a, b), |a, b, _| Lanes::max(a, b)),
            ("min", Lanes::min(a, b), |a, b, _| Lanes::min(a, b)),
            ("select", a.select_positive(b, c), |a, b, c| Lanes::select_positive(a, b, c)),
        ];
        for (name, wide, scalar) in cases {
            for (lane, got) in floats(wide).into_iter().enumerate() {
                let want = scalar(x[lane], y[lane], z[lane]);
                prop_assert!(
                    same_bits(got, want),
                    "{name} width {} lane {lane}: {got} for {want}; {} {} {}",
                    L::WIDTH,
                    x[lane],
                    y[lane],
                    z[lane]
                );
            }
        }
        Ok(())
    }

    /// Gather, then scatter changed halves, against plain indexing.
    fn moves_rows<L: Lanes>(index: &[u32]) -> Result<(), TestCaseError> {
        let row = |i: usize| BodyRow {
            velocity: std::array::from_fn(|k| (10 * i + k) as f32),
            delta: std::array::from_fn(|k| (10 * i + 4 + k) as f32),
        };
        let rows: Vec<BodyRow> = (0..40).map(row).collect();
        let mut room = [0; MOST_LANES];
        let at = IndexList::new(index).batch_at::<L::Index>(0, &mut room);
        let v = L::gather(&rows, at);
        for (c, v) in v.iter().enumerate() {
            for (lane, got) in floats(*v).into_iter().enumerate() {
                prop_assert_eq!(got, (10 * index[lane] as usize + c) as f32);
            }
        }
        let plus = |v: L| v + L::splat(0.5);
        let (mut velocities, mut deltas) = (rows.clone(), rows.clone());
        L::scatter_velocity(&mut velocities, at, [plus(v[0]), plus(v[1]), plus(v[2]), plus(v[3])]);
        L::scatter_delta(&mut deltas, at, [plus(v[4]), plus(v[5]), plus(v[6]), plus(v[7])]);
        for i in 0..rows.len() {
            let hit = index[..L::WIDTH].contains(&(i as u32));
            let add = if hit { 0.5 } else { 0.0 };
            prop_assert_eq!(velocities[i].velocity, rows[i].velocity.map(|x| x + add));
            prop_assert_eq!(velocities[i].delta, rows[i].delta);
            prop_assert_eq!(deltas[i].delta, rows[i].delta.map(|x| x + add));
            prop_assert_eq!(deltas[i].velocity, rows[i].velocity);
        }
        let mut columns = RowColumns::from_rows(&rows);
        prop_assert_eq!(columns.gather::<L>(at).map(floats), v.map(floats));
        columns.scatter_velocity(at, [plus(v[0]), plus(v[1]), plus(v[2]), v[3]]);
        for (got, row) in velocities.iter_mut().zip(&rows) {
            got.velocity[3] = row.velocity[3];
        }
        prop_assert_eq!(columns.to_rows(), velocities);
        Ok(())
    }

    proptest! {
        #[test]
        fn every_width_computes_what_scalars_do(
            x in prop::collection::vec(awkward(), 16),
            y in prop::collection::vec(awkward(), 16),
            z in prop::collection::vec(awkward(), 16),
        ) {
            agrees_with_scalar::<f32>(&x, &y, &z)?;
            agrees_with_scalar::<f32x4>(&x, &y, &z)?;
            agrees_with_scalar::<f32x8>(&x, &y, &z)?;
            agrees_with_scalar::<f32x16>(&x, &y, &z)?;
        }

        #[test]
        fn every_width_gathers_and_scatters(index in Just((0..40_u32).collect::<Vec<_>>()).prop_shuffle()) {
            moves_rows::<f32>(&index)?;
            moves_rows::<f32x4>(&index)?;
            moves_rows::<f32x8>(&index)?;
            moves_rows::<f32x16>(&index)?;
        }
    }
}
