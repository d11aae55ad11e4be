//! Four, eight and sixteen lanes: the vector types of `wide`.

use super::index::LaneIndex;
use super::quads::{self, Quad};
use super::rows::{self, BodyRow};
use super::shared::{Shared, SharedRows};
use super::vector::{INTEGERS, Lanes, MANTISSA};
use bytemuck::{Pod, Zeroable};
use wide::{f32x4, f32x8, f32x16, i32x4, i32x8, i32x16};

macro_rules! wide_lanes {
    ($type:ty, $width:literal, bits: $bits:ty, quads: $gather_quads:ident, $scatter:ident, $halves:ident
     $(, rows: $gather:ident)? $(, whole: $whole:ident)?) => {
        impl Lanes for $type {
            const WIDTH: usize = $width;

            type Index = [u32; $width];

            $(
                #[inline(always)]
                fn gather(rows: &[BodyRow], index: LaneIndex<Self::Index>) -> [Self; 8] {
                    rows::$gather(rows.into(), index)
                }

                #[inline(always)]
                fn gather_shared_rows(rows: SharedRows<'_>, index: LaneIndex<Self::Index>) -> [Self; 8] {
                    rows::$gather(rows.rows(), index)
                }

                #[inline(always)]
                fn gather_whole_shared_rows(rows: SharedRows<'_>, index: LaneIndex<Self::Index>) -> [Self; 8] {
                    rows::$gather(rows.rows(), index)
                }
            )?

            $(
                #[inline(always)]
                fn gather_whole(rows: &[BodyRow], index: LaneIndex<Self::Index>) -> [Self; 8] {
                    rows::$whole(rows.into(), index)
                }

                #[inline(always)]
                fn gather_whole_shared_rows(rows: SharedRows<'_>, index: LaneIndex<Self::Index>) -> [Self; 8] {
                    rows::$whole(rows.rows(), index)
                }
            )?

            #[inline(always)]
            fn gather_shared<T: Pod + Send, const S: usize, const O: usize>(
                records: Shared<'_, T>,
                index: LaneIndex<Self::Index>,
            ) -> [Self; 4] {
                quads::$gather_quads::<S, O>(records.quads(), index)
            }

            #[inline(always)]
            fn scatter_shared<T: Pod + Send, const S: usize, const O: usize>(
                records: Shared<'_, T>,
                index: LaneIndex<Self::Index>,
                v: [Self; 4],
            ) {
                quads::$scatter::<S, O>(records.quads(), index, v)
            }

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
                quads::$gather_quads::<S, O>(quads.into(), index)
            }

            #[inline(always)]
            fn scatter_quads<const S: usize, const O: usize>(
                quads: &mut [Quad],
                index: LaneIndex<Self::Index>,
                v: [Self; 4],
            ) {
                quads::$scatter::<S, O>(quads.into(), index, v)
            }

            #[inline(always)]
            fn scatter_halves<const S: usize, const O: usize, const P: usize>(
                quads: &mut [Quad],
                index: LaneIndex<Self::Index>,
                v: [Self; 4],
            ) {
                quads::$halves::<S, O, P>(quads.into(), index, v)
            }

            #[inline(always)]
            fn select_equal(self, other: Self, yes: Self, no: Self) -> Self {
                let [bits, other]: [$bits; 2] = [bytemuck::cast(self), bytemuck::cast(other)];
                wide::Select::select(bytemuck::cast::<$bits, Self>(bits.simd_eq(other)), yes, no)
            }

            #[inline(always)]
            fn integer_bits(self) -> Self {
                (self + <$type>::splat(INTEGERS)) & <$type>::splat(f32::from_bits(MANTISSA))
            }
        }
    };
}

wide_lanes!(f32x4, 4, bits: i32x4, quads: gather_4, scatter_4, scatter_halves_4);
wide_lanes!(f32x8, 8, bits: i32x8, quads: gather_8, scatter_8, scatter_halves_8, whole: gather_8);
wide_lanes!(f32x16, 16, bits: i32x16, quads: gather_16, scatter_16, scatter_halves_16, rows: gather_16);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{IndexList, MOST_LANES};
    use proptest::prelude::*;

    /// Awkward values, as often as ordinary ones.
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

    /// Compares every operation of one width with the same operation on scalars.
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

    /// Compares a gather and a scatter of changed halves with plain indexing.
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
        prop_assert_eq!(L::gather_whole(&rows, at).map(floats), v.map(floats));
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
