//! Blocks of a system in lanes: a small matrix or vector per lane.

use crate::constraints::records::links::LINK_LANES;
use wide::f32x8;

/// One vector per lane.
pub(super) type LaneVector<const N: usize> = [f32x8; N];
/// One matrix per lane, row by row.
pub(super) type LaneMatrix<const N: usize> = [[f32x8; N]; N];

/// Value of the lane `D` before, or 0.
#[inline(always)]
pub(super) fn up<const D: usize>(x: f32x8) -> f32x8 {
    let x = x.to_array();
    f32x8::new(std::array::from_fn(|lane| if lane < D { 0.0 } else { x[lane - D] }))
}

/// Value of the lane `D` after, or 0.
#[inline(always)]
pub(super) fn down<const D: usize>(x: f32x8) -> f32x8 {
    let x = x.to_array();
    f32x8::new(std::array::from_fn(|lane| if lane + D < LINK_LANES { x[lane + D] } else { 0.0 }))
}

#[inline(always)]
pub(super) fn transposed<const N: usize>(m: LaneMatrix<N>) -> LaneMatrix<N> {
    let mut to = m;
    for r in 0..N {
        for c in 0..N {
            to[r][c] = m[c][r];
        }
    }
    to
}

/// M − A B
#[inline(always)]
pub(super) fn minus<const N: usize>(
    mut m: LaneMatrix<N>,
    a: &LaneMatrix<N>,
    b: &LaneMatrix<N>,
) -> LaneMatrix<N> {
    for r in 0..N {
        for c in 0..N {
            for k in 0..N {
                m[r][c] = a[r][k].mul_neg_add(b[k][c], m[r][c]);
            }
        }
    }
    m
}

/// x − A y
#[inline(always)]
pub(super) fn less<const N: usize>(
    mut x: LaneVector<N>,
    a: &LaneMatrix<N>,
    y: &LaneVector<N>,
) -> LaneVector<N> {
    for r in 0..N {
        for k in 0..N {
            x[r] = a[r][k].mul_neg_add(y[k], x[r]);
        }
    }
    x
}

#[inline(always)]
pub(super) fn each<const N: usize>(mut x: LaneVector<N>, by: impl Fn(f32x8) -> f32x8) -> LaneVector<N> {
    x.iter_mut().for_each(|x| *x = by(*x));
    x
}

#[inline(always)]
fn each_of<const N: usize>(mut m: LaneMatrix<N>, by: impl Fn(f32x8) -> f32x8) -> LaneMatrix<N> {
    m.as_flattened_mut().iter_mut().for_each(|x| *x = by(*x));
    m
}

/// One step of cyclic reduction, between lanes `D` apart.
#[inline(always)]
pub(super) fn reduce<const D: usize, const N: usize>(
    d: &mut LaneMatrix<N>,
    e: &mut LaneMatrix<N>,
    b: &mut LaneVector<N>,
) {
    let factor = Factor::of(*d);
    let z = factor.solve(*b);
    let (f, e_p) = (transposed(each_of(*e, down::<D>)), each_of(*e, up::<D>));
    // D is symmetric.
    let to_p = transposed(factor.shifted(up::<D>).solve_each(transposed(*e)));
    let to_q = transposed(factor.shifted(down::<D>).solve_each(transposed(f)));
    *d = minus(minus(*d, &to_p, &transposed(*e)), &to_q, &transposed(f));
    *b = less(less(*b, e, &each(z, up::<D>)), &f, &each(z, down::<D>));
    *e = minus([[f32x8::ZERO; N]; N], &to_p, &e_p);
}

/// L D Lᵀ of a symmetric, positive definite matrix. Unlike with the inverse, rounding errors do not grow with
/// the condition number.
#[derive(Clone, Copy)]
pub(super) struct Factor<const N: usize> {
    /// Below the diagonal.
    lower: LaneMatrix<N>,
    /// D⁻¹; 0 where rounding has left no positive pivot.
    inverse: LaneVector<N>,
}

impl<const N: usize> Factor<N> {
    #[inline(always)]
    pub(super) fn of(m: LaneMatrix<N>) -> Self {
        let (mut lower, mut inverse) = (m, [f32x8::ZERO; N]);
        for j in 0..N {
            let column = lower.map(|row| row[j]);
            inverse[j] = column[j].simd_gt(f32x8::ZERO).select(f32x8::ONE / column[j], f32x8::ZERO);
            for i in j + 1..N {
                lower[i][j] = column[i] * inverse[j];
                for k in j + 1..=i {
                    lower[i][k] = lower[i][j].mul_neg_add(column[k], lower[i][k]);
                }
            }
        }
        Factor { lower, inverse }
    }

    /// M⁻¹ x
    #[inline(always)]
    pub(super) fn solve(&self, mut x: LaneVector<N>) -> LaneVector<N> {
        for i in 0..N {
            for j in 0..i {
                x[i] = self.lower[i][j].mul_neg_add(x[j], x[i]);
            }
        }
        for i in (0..N).rev() {
            x[i] *= self.inverse[i];
            for j in i + 1..N {
                x[i] = self.lower[j][i].mul_neg_add(x[j], x[i]);
            }
        }
        x
    }

    /// M⁻¹ A
    #[inline(always)]
    pub(super) fn solve_each(&self, a: LaneMatrix<N>) -> LaneMatrix<N> {
        transposed(transposed(a).map(|column| self.solve(column)))
    }

    /// The factor of the lane before, or after.
    #[inline(always)]
    fn shifted(self, by: impl Fn(f32x8) -> f32x8) -> Self {
        Factor { lower: each_of(self.lower, &by), inverse: each(self.inverse, &by) }
    }
}
