//! Symmetric systems of two or three rows, in lanes.

use crate::lanes::Lanes;

/// The solution of K x = r. By LDLᵀ, except for two rows, which take one division. Unknowns without a
/// positive pivot are zero.
#[inline(always)]
pub fn solve<L: Lanes, const N: usize>(mut k: [[L; N]; N], mut x: [L; N]) -> [L; N] {
    if N == 2 {
        let determinant = k[0][0].mul_add(k[1][1], -(k[1][0] * k[1][0]));
        let scale = determinant.select_positive(L::splat(1.0) / determinant, L::zero());
        let y = k[1][1].mul_add(x[0], -(k[1][0] * x[1]));
        x[1] = k[0][0].mul_add(x[1], -(k[1][0] * x[0])) * scale;
        x[0] = y * scale;
        return x;
    }
    let mut inverse = [L::zero(); N];
    for j in 0..N {
        inverse[j] = k[j][j].select_positive(L::splat(1.0) / k[j][j], L::zero());
        for i in j + 1..N {
            let factor = k[i][j] * inverse[j];
            let column = k.map(|row| row[j]);
            for (entry, &above) in k[i][..=i].iter_mut().zip(&column).skip(j + 1) {
                *entry = factor.neg_mul_add(above, *entry);
            }
            x[i] = factor.neg_mul_add(x[j], x[i]);
        }
    }
    for j in (0..N).rev() {
        x[j] = x[j] * inverse[j];
        for i in j + 1..N {
            x[j] = (k[i][j] * inverse[j]).neg_mul_add(x[i], x[j]);
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symmetric_systems_are_solved_and_what_cannot_move_stays() {
        let k = [[4.0f32, 0.0, 0.0], [1.0, 3.0, 0.0], [0.5, -1.0, 2.0]];
        let x = solve(k, [1.0, 2.0, 3.0]);
        let full = [[4.0, 1.0, 0.5], [1.0, 3.0, -1.0], [0.5, -1.0, 2.0]];
        for (row, expected) in full.iter().zip([1.0, 2.0, 3.0]) {
            let sum: f32 = row.iter().zip(x).map(|(k, x)| k * x).sum();
            assert!((sum - expected).abs() < 1e-5, "{x:?}");
        }
        assert_eq!(solve([[0.0f32; 2]; 2], [1.0, 1.0]), [0.0, 0.0]);
    }
}
