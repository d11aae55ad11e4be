//! Lemke's method for a dense linear complementarity problem.
//!
//! Given A and q, find w = A z + q with 0 ≤ w ⊥ z ≥ 0. Lemke adds an artificial variable z₀,
//! w = A z + q + d z₀ with a covering vector d > 0, starts at the smallest z₀ that makes z = 0 feasible, and
//! then walks along edges: whenever a variable leaves the basis, its complement enters. The walk
//! ends when z₀ leaves (a solution) or when no row blocks (a ray).
//!
//! **Source**: Cottle, Pang & Stone, *The Linear Complementarity Problem*, §4.4 (the method) and
//! §4.9 (lexicographic ties). **Kept exact by**: rebuilding the tableau from A and q by an LU
//! factorization every [`REBUILD`] pivots, and computing the final basic solution by LU with
//! iterative refinement. So pivot errors do not add up.
//!
//! With `x_B` the basic and `x_N` the other variables, the tableau holds T = B⁻¹ N and q̄ = B⁻¹ q of
//! `x_B + T x_N = q̄`. The lexicographic rule compares rows of (q̄ | B⁻¹) / T_·c; the columns of B⁻¹
//! are those of w₁ … w_n: unit vectors while basic, columns of T otherwise.

use crate::constraints::numerics::matrix::{Lu, Matrix};
use std::cmp::Ordering;

/// Pivots between two rebuilds of the tableau. A rebuild costs about as much as n/2 pivots.
pub const REBUILD: usize = 50;

/// Outcome of Lemke's method.
#[derive(Clone, Debug, PartialEq)]
pub enum LemkeOutcome {
    /// z, where w = A z + q. Refined by LU for the final complementarity pattern.
    Solution(Vec<f64>),
    /// No row blocks the entering variable: the method has no answer. For the matrices of frictional
    /// contact this means that the data are inconsistent.
    Ray,
    /// More pivots than allowed.
    IterationLimit,
    /// A basis was singular to working precision.
    Singular,
}

/// The outcome and the number of pivots.
#[derive(Clone, Debug, PartialEq)]
pub struct Lemke {
    /// How the method ended.
    pub outcome: LemkeOutcome,
    /// Number of pivots.
    pub pivots: usize,
}

/// Entries of the entering column below this, relative to its largest entry, do not block.
const PIVOT_TOLERANCE: f64 = 1e-9;
/// Ratios this close, relative to the larger one, are ties.
const TIE_TOLERANCE: f64 = 1e-11;
/// Basic values below this are zero, for q of order 1. A z₀ this small counts as having left the basis:
/// waiting until it blocks, as in exact arithmetic, ends on spurious rays where rows are degenerate.
const ZERO: f64 = 1e-13;

/// Solves w = A z + q, 0 ≤ w ⊥ z ≥ 0 by at most `limit` pivots.
///
/// A, q and the covering vector d > 0 should be scaled so that their largest entries are of order 1.
/// In exact arithmetic any d works. If rounding spoils one path, another d takes a different one.
/// `a` must be square, with as many rows as `q` and `d` have entries.
pub fn lemke(a: &Matrix, q: &[f64], d: &[f64], limit: usize) -> Lemke {
    let n = q.len();
    let end = |outcome, pivots| Lemke { outcome, pivots };
    if q.iter().all(|&x| x >= 0.0) {
        return end(LemkeOutcome::Solution(vec![0.0; n]), 0);
    }
    let mut t = Tableau::new(a, q, d);
    // z₀ enters at the row of the lexicographically smallest (q_i, e_i)/d_i: the last row among equals.
    let ratio = |i: usize| q[i] / d[i];
    let first =
        (0..n).min_by(|&i, &k| ratio(i).total_cmp(&ratio(k)).then(k.cmp(&i))).expect("q is not empty");
    let mut entering = complement(t.pivot(first, n), n);
    for pivots in 1..=limit {
        if pivots % REBUILD == 0 && !t.rebuild(a, q, d) {
            return end(LemkeOutcome::Singular, pivots);
        }
        let column = t.nonbasic.iter().position(|&v| v == entering).expect("complements are nonbasic");
        let Some(row) = t.blocking_row(column) else { return end(LemkeOutcome::Ray, pivots) };
        let leaving = t.pivot(row, column);
        if leaving == artificial(n) || t.value(artificial(n)) <= ZERO {
            return match t.rebuild(a, q, d) {
                true => end(LemkeOutcome::Solution(t.solution()), pivots + 1),
                false => end(LemkeOutcome::Singular, pivots + 1),
            };
        }
        entering = complement(leaving, n);
    }
    end(LemkeOutcome::IterationLimit, limit)
}

// Variables are numbered w: 0..n, z: n..2n, z₀: 2n.
fn complement(variable: usize, n: usize) -> usize {
    if variable < n { variable + n } else { variable - n }
}

fn artificial(n: usize) -> usize {
    2 * n
}

struct Tableau {
    n: usize,
    /// Variable of each row.
    basic: Vec<usize>,
    /// Variable of each column.
    nonbasic: Vec<usize>,
    /// Row-major T with q̄ as last column: n rows of n + 2.
    cells: Vec<f64>,
}

impl Tableau {
    /// w is basic, z and z₀ are not: T = (−A | −d), q̄ = q.
    fn new(a: &Matrix, q: &[f64], d: &[f64]) -> Self {
        let n = q.len();
        let mut t = Tableau {
            n,
            basic: (0..n).collect(),
            nonbasic: (n..=2 * n).collect(),
            cells: Vec::with_capacity(n * (n + 2)),
        };
        for (i, &qi) in q.iter().enumerate() {
            t.cells.extend((0..n).map(|j| -a[(i, j)]));
            t.cells.extend([-d[i], qi]);
        }
        t
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.cells[i * (self.n + 2)..][..self.n + 2]
    }

    /// Exchanges the variables of a row and a column; returns the one that leaves the basis.
    fn pivot(&mut self, row: usize, column: usize) -> usize {
        let width = self.n + 2;
        let inverse = 1.0 / self.row(row)[column];
        let mut pivot_row = self.row(row).to_vec();
        pivot_row.iter_mut().for_each(|x| *x *= inverse);
        pivot_row[column] = inverse;
        for (i, cells) in self.cells.chunks_exact_mut(width).enumerate() {
            let factor = cells[column];
            if i == row {
                cells.copy_from_slice(&pivot_row);
            } else if factor != 0.0 {
                cells[column] = 0.0;
                cells.iter_mut().zip(&pivot_row).for_each(|(x, p)| *x -= factor * p);
            }
        }
        std::mem::swap(&mut self.basic[row], &mut self.nonbasic[column]);
        self.nonbasic[column]
    }

    /// The row that blocks the variable of `column` first, if any. Among ties, z₀ leaves if it can, otherwise
    /// the lexicographically smallest row.
    fn blocking_row(&self, column: usize) -> Option<usize> {
        let entry = |i: usize| self.row(i)[column];
        let largest = (0..self.n).map(|i| entry(i).abs()).fold(0.0, f64::max);
        let candidates: Vec<usize> = (0..self.n).filter(|&i| entry(i) > PIVOT_TOLERANCE * largest).collect();
        // Rounding may make a degenerate q̄ negative.
        let ratio = |i: usize| self.row(i)[self.n + 1].max(0.0) / entry(i);
        let smallest = candidates.iter().map(|&i| ratio(i)).min_by(f64::total_cmp)?;
        let ties: Vec<usize> = candidates
            .into_iter()
            .filter(|&i| ratio(i) - smallest <= (TIE_TOLERANCE * ratio(i)).max(ZERO))
            .collect();
        let artificial_row = ties.iter().copied().find(|&i| self.basic[i] == artificial(self.n));
        artificial_row.or_else(|| ties.into_iter().reduce(|i, k| self.lexicographic_min(i, k, column)))
    }

    /// The smaller of rows i < k of B⁻¹ / T_·c; the larger pivot if rounding hides the difference.
    fn lexicographic_min(&self, i: usize, k: usize, column: usize) -> usize {
        let (ti, tk) = (self.row(i)[column], self.row(k)[column]);
        let mut place = vec![None; 2 * self.n + 1];
        self.nonbasic.iter().enumerate().for_each(|(j, &v)| place[v] = Some(j));
        for (w, &place) in place.iter().enumerate().take(self.n) {
            let inverse_entry = |row: usize| match place {
                Some(j) => self.row(row)[j],
                None => f64::from(u8::from(self.basic[row] == w)),
            };
            let (x, y) = (inverse_entry(i) / ti, inverse_entry(k) / tk);
            if (x - y).abs() > TIE_TOLERANCE * x.abs().max(y.abs()).max(1.0) {
                return if x < y { i } else { k };
            }
        }
        if ti.abs().total_cmp(&tk.abs()) == Ordering::Less { k } else { i }
    }

    /// Recomputes T and q̄ from the data for the present basis. False if the basis is singular.
    fn rebuild(&mut self, a: &Matrix, q: &[f64], d: &[f64]) -> bool {
        let n = self.n;
        // Columns of (I | −A | −d), the coefficients of (w, z, z₀).
        let coefficient = |i: usize, variable: usize| {
            if variable < n {
                f64::from(u8::from(i == variable))
            } else if variable < 2 * n {
                -a[(i, variable - n)]
            } else {
                -d[i]
            }
        };
        // Unit columns come first: they cost the factorization nothing.
        self.basic.sort_unstable();
        let basis = Matrix::from_fn(n, n, |i, j| coefficient(i, self.basic[j]));
        let right = Matrix::from_fn(n, n + 2, |i, j| match self.nonbasic.get(j) {
            Some(&v) => coefficient(i, v),
            None => q[i],
        });
        let Some(lu) = Lu::new(basis) else { return false };
        let cells = lu.solve(&right).into_cells();
        if !cells.iter().all(|x| x.is_finite()) {
            return false;
        }
        self.cells = cells;
        true
    }

    /// Present value of a variable.
    fn value(&self, variable: usize) -> f64 {
        self.basic.iter().position(|&v| v == variable).map_or(0.0, |i| self.row(i)[self.n + 1])
    }

    /// z of the basic solution; negatives of rounding size become zero.
    fn solution(&self) -> Vec<f64> {
        let mut z = vec![0.0; self.n];
        for (i, &v) in self.basic.iter().enumerate() {
            if (self.n..2 * self.n).contains(&v) {
                z[v - self.n] = self.row(i)[self.n + 1].max(0.0);
            }
        }
        z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(a: &[&[f64]], q: &[f64]) -> LemkeOutcome {
        let a = Matrix::from_fn(q.len(), q.len(), |i, j| a[i][j]);
        lemke(&a, q, &vec![1.0; q.len()], 100).outcome
    }

    fn solution(a: &[&[f64]], q: &[f64]) -> Vec<f64> {
        match solve(a, q) {
            LemkeOutcome::Solution(z) => z,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn small_problems_by_hand() {
        assert_eq!(solution(&[&[1.0]], &[2.0]), [0.0]);
        assert_eq!(solution(&[&[2.0]], &[-4.0]), [2.0]);
        // z₁ + ½z₂ = 3, ½z₁ + z₂ = 3.
        let z = solution(&[&[1.0, 0.5], &[0.5, 1.0]], &[-3.0, -3.0]);
        assert!(z.iter().all(|z| (z - 2.0).abs() < 1e-15), "{z:?}");
        // Second row slack: w₂ = z₁·1 − 1 = 2 with z = (3, 0).
        assert_eq!(solution(&[&[1.0, 1.0], &[1.0, 2.0]], &[-3.0, -1.0]), [3.0, 0.0]);
    }

    #[test]
    fn infeasible_data_end_on_a_ray() {
        assert_eq!(solve(&[&[0.0]], &[-1.0]), LemkeOutcome::Ray);
        assert_eq!(solve(&[&[-1.0]], &[-1.0]), LemkeOutcome::Ray);
    }

    #[test]
    fn the_limit_is_a_status() {
        let a = Matrix::from_fn(3, 3, |i, j| if i == j { 2.0 } else { 1.0 });
        assert_eq!(lemke(&a, &[-1.0, -2.0, -3.0], &[1.0; 3], 0).outcome, LemkeOutcome::IterationLimit);
    }

    #[test]
    fn ties_do_not_cycle() {
        // All right-hand sides are equal and A has rank one: every ratio is a tie.
        let n = 30;
        let a = Matrix::from_fn(n, n, |_, _| 1.0);
        let LemkeOutcome::Solution(z) = lemke(&a, &vec![-1.0; n], &vec![1.0; n], 1000).outcome else {
            panic!("no solution")
        };
        assert!((z.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{z:?}");
    }

    #[test]
    fn random_positive_definite_problems_satisfy_the_law() {
        // A = B Bᵀ + I from a fixed linear congruence; long enough to cross rebuilds.
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        for n in [5, 40, 260] {
            let entries: Vec<f64> = (0..n * n).map(|_| next()).collect();
            let b = Matrix::from_fn(n, n, |i, j| entries[j * n + i]);
            let a = Matrix::from_fn(n, n, |i, j| {
                let product: f64 = b.row(i).iter().zip(b.row(j)).map(|(x, y)| x * y).sum();
                product + f64::from(u8::from(i == j))
            });
            let q: Vec<f64> = (0..n).map(|_| next()).collect();
            let run = lemke(&a, &q, &vec![1.0; n], 20 * n);
            let LemkeOutcome::Solution(z) = run.outcome else { panic!("{n}: no solution") };
            if n == 260 {
                assert!(run.pivots > REBUILD, "{}", run.pivots);
            }
            for i in 0..n {
                let w = q[i] + (0..n).map(|j| a[(i, j)] * z[j]).sum::<f64>();
                // |A| is about n/12 here; 1e-12 leaves room for n products of rounding size.
                assert!(w.min(z[i]).abs() < 1e-12, "n {n}, row {i}: w {w}, z {}", z[i]);
            }
        }
    }
}
