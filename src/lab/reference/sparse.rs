//! Sparse linear systems, by LU factorization.
//!
//! Columns are eliminated in an approximate minimum degree order of A + Aᵀ, which suits matrices with a
//! nearly symmetric pattern. A diagonal entry stays the pivot of its column if it is at least `DIAGONAL`
//! times the largest entry, which preserves the order and so limits the fill. One step of refinement recovers
//! the lost accuracy, with its remainder summed to twice the working precision.
//!
//! **Source**: Davis 2006 (`davis2006`), §6.2 (left-looking LU) and §7.1 (ordering), as implemented in Rust
//! by the crate `rsparse`.

use rsparse::data::Sprs;

/// Smallest ratio of a column's diagonal entry to its largest one at which the diagonal entry is the pivot.
/// Rounding errors grow by at most 1 + 1/fraction per elimination.
const DIAGONAL: f64 = 0.1;

/// An entry of a matrix: column, row, value.
pub type Triplet = (usize, usize, f64);

/// x of A x = `right`. Entries of A at the same position are summed. `None` if A is singular to working
/// precision. All row and column indices must be less than the length of `right`.
pub fn solve(entries: Vec<Triplet>, right: &[f64]) -> Option<Vec<f64>> {
    let n = right.len();
    let matrix = compressed(entries, n);
    // Ordering of the library: 0 for A + Aᵀ, which needs at least two columns; −1 for none.
    let mut symbolic = rsparse::sqr(&matrix, if n < 2 { -1 } else { 0 }, false);
    let factors = rsparse::lu(&matrix, &mut symbolic, DIAGONAL).ok()?;
    let place = factors.pinv.as_ref()?;
    let solve = |right: &[f64]| {
        // L U Qᵀ x = P r; row i of A is row `place[i]` of L U, column k of L U is column q_k of A.
        let mut permuted = vec![0.0; n];
        place.iter().zip(right).for_each(|(&k, &r)| permuted[k as usize] = r);
        rsparse::lsolve(&factors.l, &mut permuted);
        rsparse::usolve(&factors.u, &mut permuted);
        let Some(q) = &symbolic.q else { return permuted };
        let mut x = vec![0.0; n];
        q.iter().zip(permuted).for_each(|(&column, value)| x[column as usize] = value);
        x
    };
    let mut x = solve(right);
    let rest = remainder(&matrix, &x, right);
    x.iter_mut().zip(solve(&rest)).for_each(|(x, correction)| *x += correction);
    x.iter().all(|x| x.is_finite()).then_some(x)
}

/// right − A x to twice the working precision: every sum is stored with its accumulated rounding error. The
/// errors of products are computed by fused multiply-adds (Ogita, Rump and Oishi 2005, `ogita2005`).
fn remainder(matrix: &Sprs<f64>, x: &[f64], right: &[f64]) -> Vec<f64> {
    let mut sums: Vec<(f64, f64)> = right.iter().map(|&r| (r, 0.0)).collect();
    for (column, range) in matrix.p.windows(2).enumerate() {
        for k in range[0] as usize..range[1] as usize {
            let (sum, lost) = &mut sums[matrix.i[k]];
            let term = -matrix.x[k] * x[column];
            let next = *sum + term;
            let added = next - *sum;
            *lost += (*sum - (next - added)) + (term - added) - matrix.x[k].mul_add(x[column], term);
            *sum = next;
        }
    }
    sums.into_iter().map(|(sum, lost)| sum + lost).collect()
}

/// Compressed columns of a square matrix, with ascending rows.
fn compressed(mut entries: Vec<Triplet>, n: usize) -> Sprs<f64> {
    entries.sort_by_key(|&(column, row, _)| (column, row));
    entries.dedup_by(|next, kept| {
        let same = (next.0, next.1) == (kept.0, kept.1);
        if same {
            kept.2 += next.2;
        }
        same
    });
    let mut matrix = Sprs::zeros(n, n, entries.len());
    for (k, &(column, row, value)) in entries.iter().enumerate() {
        matrix.p[column + 1] = k as isize + 1;
        (matrix.i[k], matrix.x[k]) = (row, value);
    }
    // An empty column starts where the previous one ends.
    for column in 0..n {
        matrix.p[column + 1] = matrix.p[column + 1].max(matrix.p[column]);
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_systems_by_hand() {
        assert_eq!(solve(Vec::new(), &[]), Some(vec![]));
        assert_eq!(solve(vec![(0, 0, 1.0), (0, 0, 3.0)], &[2.0]), Some(vec![0.5]));
        // 2y = 4, x + y = 5.
        assert_eq!(solve(vec![(1, 0, 2.0), (0, 1, 1.0), (1, 1, 1.0)], &[4.0, 5.0]), Some(vec![3.0, 2.0]));
    }

    #[test]
    fn singular_matrices_are_refused() {
        assert_eq!(solve(vec![(0, 0, 1.0)], &[1.0, 1.0]), None);
        assert_eq!(solve(vec![(0, 0, 0.0)], &[1.0]), None);
        let ones = (0..4).map(|k| (k / 2, k % 2, 1.0)).collect();
        assert_eq!(solve(ones, &[1.0, 0.0]), None);
    }

    #[test]
    fn a_grid_with_a_drift_is_solved_to_rounding() {
        // Unsymmetric 5-point Laplacian of a 30 × 30 grid, with weak diagonals that must not become pivots.
        let side = 30usize;
        let n = side * side;
        let mut entries = Vec::new();
        for u in 0..n {
            entries.push((u, u, if u % 7 == 0 { 1e-9 } else { 4.0 }));
            let (x, y) = (u % side, u / side);
            for (ok, v, value) in [
                (x > 0, u.wrapping_sub(1), -1.3),
                (x + 1 < side, u + 1, -0.7),
                (y > 0, u.wrapping_sub(side), -1.0),
                (y + 1 < side, u + side, -1.0),
            ] {
                if ok {
                    entries.push((v, u, value));
                }
            }
        }
        let truth: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut right = vec![0.0; n];
        entries.iter().for_each(|&(column, row, value)| right[row] += value * truth[column]);
        let x = solve(entries, &right).unwrap();
        let error = x.iter().zip(&truth).map(|(x, t)| (x - t).abs()).fold(0.0, f64::max);
        assert!(error < 1e-12, "{error:e}");
    }
}
