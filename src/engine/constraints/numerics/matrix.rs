//! Dense matrices in `f64`, and the one elimination of the engine.
//!
//! Plain Gaussian elimination P A = L U. P brings the largest remaining entry of each column to the diagonal.
//! [`solve_in_place`] solves one small system in its own memory. [`Lu`] keeps the factors, for the bases of
//! Lemke's method. It solves A·X = R for `STRIP` columns of R at a time, so that a row of the unknowns stays
//! in registers while it runs over the rows that it depends on. A second solve for the remainder R − A X
//! reduces the error of every column to the rounding of its own residual.
//!
//! **Source**: Golub and Van Loan 2013 (`golub2013`), §3.4 (pivoting), §3.5.3 (refinement).
//! **Cost**: 2n³/3 for the factors and 6n² for a column of R, less where entries are zero: multipliers of
//! zero are skipped, so unit columns that come first are almost free.
//!

use std::ops::{Index, IndexMut};

/// Columns of the right-hand side that are solved together: four vectors of four `f64`.
const STRIP: usize = 16;

type Strip = [f64; STRIP];

/// A dense matrix, stored row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Matrix {
    columns: usize,
    cells: Vec<f64>,
}

impl Matrix {
    /// The matrix whose entry (row, column) is `entry(row, column)`.
    pub fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let entry = &entry;
        Matrix { columns, cells: (0..rows).flat_map(|i| (0..columns).map(move |j| entry(i, j))).collect() }
    }

    /// A matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Matrix { columns, cells: vec![0.0; rows * columns] }
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One row.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.cells[row * self.columns..][..self.columns]
    }

    /// All entries, row by row.
    pub fn into_cells(self) -> Vec<f64> {
        self.cells
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (row, column): (usize, usize)) -> &f64 {
        &self.cells[row * self.columns + column]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (row, column): (usize, usize)) -> &mut f64 {
        &mut self.cells[row * self.columns + column]
    }
}

/// Replaces a square matrix of `n` columns, stored row by row, by its factors: U on and above the diagonal, L
/// below. Calls `exchange` with each pair of rows that P exchanges, in order. False if a column has no finite
/// pivot above `floor`.
fn factorize(cells: &mut [f64], n: usize, floor: f64, mut exchange: impl FnMut(usize, usize)) -> bool {
    for k in 0..n {
        let size = |i: usize| cells[i * n + k].abs();
        let pivot = (k..n).max_by(|&i, &j| size(i).total_cmp(&size(j))).filter(|&i| size(i) > floor);
        let Some(pivot) = pivot else { return false };
        if pivot != k {
            exchange(k, pivot);
            let (above, below) = cells.split_at_mut(pivot * n);
            above[k * n..][..n].swap_with_slice(&mut below[..n]);
        }
        let (above, below) = cells.split_at_mut((k + 1) * n);
        let pivot_row = &above[k * n + k..];
        let inverse = 1.0 / pivot_row[0];
        if !inverse.is_finite() || inverse == 0.0 {
            return false;
        }
        for row in below.chunks_exact_mut(n).filter(|row| row[k] != 0.0) {
            let factor = row[k] * inverse;
            row[k] = factor;
            row[k + 1..].iter_mut().zip(&pivot_row[1..]).for_each(|(x, p)| *x -= factor * p);
        }
    }
    true
}

/// Solves A x = b without allocations. A has `b.len()` rows and columns, stored row by row, and is
/// overwritten; b becomes x. False if a pivot is not above `least` times the largest entry of A; b is then
/// undefined.
pub fn solve_in_place(a: &mut [f64], b: &mut [f64], least: f64) -> bool {
    let n = b.len();
    let floor = least * a.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    if !factorize(a, n, floor, |k, pivot| b.swap(k, pivot)) {
        return false;
    }
    for i in 1..n {
        b[i] -= (0..i).map(|j| a[i * n + j] * b[j]).sum::<f64>();
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| a[i * n + j] * b[j]).sum();
        b[i] = (b[i] - known) / a[i * n + i];
    }
    true
}

/// A square matrix A and its factors, P A = L U.
pub struct Lu {
    matrix: Matrix,
    /// U on and above the diagonal, L below; the diagonal of L is 1.
    factors: Matrix,
    /// The row of A that P moves to place i.
    order: Vec<usize>,
}

impl Lu {
    /// Factorizes a square matrix. `None` if a column has no pivot that is finite and not zero.
    pub fn new(matrix: Matrix) -> Option<Self> {
        let n = matrix.columns;
        let mut factors = matrix.clone();
        let mut order: Vec<usize> = (0..n).collect();
        let is_regular = factorize(&mut factors.cells, n, 0.0, |k, pivot| order.swap(k, pivot));
        is_regular.then_some(Lu { matrix, factors, order })
    }

    /// The solution X of A X = `right`, with one step of refinement.
    pub fn solve(&self, right: &Matrix) -> Matrix {
        let n = self.order.len();
        let mut solution = Matrix::zeros(n, right.columns);
        for first in (0..right.columns).step_by(STRIP) {
            let width = STRIP.min(right.columns - first);
            let mut rest: Vec<Strip> = (0..n)
                .map(|i| {
                    let mut strip = [0.0; STRIP];
                    strip[..width].copy_from_slice(&right.row(i)[first..][..width]);
                    strip
                })
                .collect();
            let mut x = self.solve_strips(&rest);
            for (i, rest) in rest.iter_mut().enumerate() {
                *rest = minus_products(*rest, self.matrix.row(i), &x);
            }
            for (x, correction) in x.iter_mut().zip(self.solve_strips(&rest)) {
                x.iter_mut().zip(correction).for_each(|(x, c)| *x += c);
            }
            for (i, x) in x.iter().enumerate() {
                solution.cells[i * right.columns + first..][..width].copy_from_slice(&x[..width]);
            }
        }
        solution
    }

    /// L Y = P R downward, then U X = Y upward.
    fn solve_strips(&self, right: &[Strip]) -> Vec<Strip> {
        let mut x: Vec<Strip> = self.order.iter().map(|&i| right[i]).collect();
        for i in 1..x.len() {
            x[i] = minus_products(x[i], &self.factors.row(i)[..i], &x);
        }
        for i in (0..x.len()).rev() {
            let row = &self.factors.row(i)[i..];
            let sum = minus_products(x[i], &row[1..], &x[i + 1..]);
            x[i] = sum.map(|s| s / row[0]);
        }
        x
    }
}

/// start − ∑ factor_k · strip_k.
fn minus_products(start: Strip, factors: &[f64], strips: &[Strip]) -> Strip {
    let mut sum = start;
    for (&factor, strip) in factors.iter().zip(strips).filter(|(factor, _)| **factor != 0.0) {
        for (s, x) in sum.iter_mut().zip(strip) {
            *s -= factor * x;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_by_hand_needs_a_swap() {
        // 2y = 4, x + y = 5; and its inverse.
        let a = Matrix::from_fn(2, 2, |i, j| [[0.0, 2.0], [1.0, 1.0]][i][j]);
        let right = Matrix::from_fn(2, 3, |i, j| [[4.0, 1.0, 0.0], [5.0, 0.0, 1.0]][i][j]);
        let x = Lu::new(a).unwrap().solve(&right);
        assert_eq!((x.row(0), x.row(1)), (&[3.0, -0.5, 1.0][..], &[2.0, 0.5, 0.0][..]));
    }

    #[test]
    fn in_place_rows_are_exchanged_and_singular_ones_refused() {
        let mut b = [5.0, 3.0, 6.0];
        assert!(solve_in_place(&mut [0.0, 2.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0], &mut b, 1e-14));
        // 2y + z = 5, x + z = 3, x + y + z = 6.
        assert_eq!(b, [4.0, 3.0, -1.0]);
        assert!(!solve_in_place(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0], 1e-14));
        assert!(solve_in_place(&mut [], &mut [], 0.0));
    }

    #[test]
    fn singular_matrices_are_refused() {
        assert!(Lu::new(Matrix::from_fn(3, 3, |i, j| (i + j) as f64)).is_none_or(|lu| {
            // Rounding may leave a last pivot near 10⁻¹⁶, but not one near 1.
            lu.factors[(2, 2)].abs() < 1e-14
        }));
        assert!(Lu::new(Matrix::zeros(2, 2)).is_none());
        assert!(Lu::new(Matrix::from_fn(1, 1, |_, _| f64::NAN)).is_none());
    }

    #[test]
    fn hilbert_matrices_leave_a_residual_of_rounding_size() {
        // Condition number 10¹³: x is known to a few digits, A x to all.
        let n = 10;
        let a = Matrix::from_fn(n, n, |i, j| 1.0 / (i + j + 1) as f64);
        // More columns than a strip, and not a multiple of one.
        let right = Matrix::from_fn(n, 2 * STRIP + 3, |i, j| ((3 * i + 7 * j) as f64).sin());
        let x = Lu::new(a.clone()).unwrap().solve(&right);
        for j in 0..right.columns() {
            let largest = (0..n).map(|i| x[(i, j)].abs()).fold(0.0, f64::max);
            for i in 0..n {
                let rest = (0..n).map(|k| a[(i, k)] * x[(k, j)]).sum::<f64>() - right[(i, j)];
                // A row sums to at most 3.
                assert!(rest.abs() < 3.0 * n as f64 * f64::EPSILON * largest, "({i}, {j}): {rest:e}");
            }
        }
    }
}
