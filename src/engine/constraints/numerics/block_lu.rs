//! Systems of B × B blocks whose entries are close to the diagonal once their rows are in the right order.
//!
//! Bodies that touch or are joined couple. Chains, stacks and pyramids have narrow bands, and islands do not
//! couple at all. Blocks are ordered by breadth (`cuthill1969`). Then row i of L, and column i of U, have no
//! block before the first one f_i of A there, and for f = max(f_i, f_j)
//!
//! ```text
//! L_ij = (A_ij − Σ_{k=f..j} L_ik U_kj) U_jj⁻¹,   U_ji = A_ji − Σ_{k=f..j} L_jk U_ki,   j < i
//! U_ii = A_ii − Σ_k L_ik U_ki
//! ```
//!
//! in n b² products of blocks for n rows of b blocks. The pattern of A is symmetric, its values need not be.
//! Pivots stay on the diagonal, so callers must check their results.

use super::envelope::by_breadth;

type LuBlock<const B: usize> = [[f64; B]; B];

/// A system and its factors; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct BlockLu<const B: usize> {
    /// The block row of A at each place, and its inverse: the place of each block row.
    order: Vec<usize>,
    place: Vec<usize>,
    /// f_i, and where row i of L and column i of U begin.
    first: Vec<usize>,
    start: Vec<usize>,
    lower: Vec<LuBlock<B>>,
    upper: Vec<LuBlock<B>>,
    /// A_ii, then U_ii⁻¹.
    diagonal: Vec<LuBlock<B>>,
}

impl<const B: usize> BlockLu<B> {
    /// Begins a system of zeros with `n` rows, in which row i couples with `neighbors(i)`. These may include
    /// i itself.
    pub fn begin<I: Iterator<Item = usize>>(&mut self, n: usize, neighbors: impl Fn(usize) -> I) {
        by_breadth(n, &neighbors, [&mut self.order, &mut self.place]);
        self.first.clear();
        self.start.clear();
        let mut length = 0;
        for (i, &row) in self.order.iter().enumerate() {
            let first = neighbors(row).map(|other| self.place[other]).min().unwrap_or(i).min(i);
            self.first.push(first);
            self.start.push(length);
            length += i - first;
        }
        for (values, length) in
            [(&mut self.lower, length), (&mut self.upper, length), (&mut self.diagonal, n)]
        {
            values.clear();
            values.resize(length, [[0.0; B]; B]);
        }
    }

    /// Sets all blocks to zero; the pattern remains.
    pub fn clear(&mut self) {
        for values in [&mut self.lower, &mut self.upper, &mut self.diagonal] {
            values.fill([[0.0; B]; B]);
        }
    }

    /// Adds to a block of A.
    ///
    /// # Panics
    /// If the row and the column do not couple.
    #[inline]
    pub fn add(&mut self, row: usize, column: usize, values: LuBlock<B>) {
        let [i, j] = [row, column].map(|k| self.place[k]);
        let at = |i: usize, j: usize| self.start[i] + j - self.first[i];
        let block = match i.cmp(&j) {
            std::cmp::Ordering::Equal => &mut self.diagonal[i],
            std::cmp::Ordering::Greater => &mut self.lower[at(i, j)],
            std::cmp::Ordering::Less => &mut self.upper[at(j, i)],
        };
        for (row, values) in block.iter_mut().zip(values) {
            (0..B).for_each(|c| row[c] += values[c]);
        }
    }

    /// Computes L and U of A. False if one of the U_ii is singular.
    pub fn factorize(&mut self) -> bool {
        for i in 0..self.diagonal.len() {
            let (start, first) = (self.start[i], self.first[i]);
            for j in first..i {
                let from = first.max(self.first[j]);
                let (own, other) = (start + from - first, self.start[j] + from - self.first[j]);
                let at = start + j - first;
                let (mut below, mut above) = (self.lower[at], self.upper[at]);
                for k in 0..j - from {
                    subtract(&mut below, &self.lower[own + k], &self.upper[other + k]);
                    subtract(&mut above, &self.lower[other + k], &self.upper[own + k]);
                }
                self.lower[at] = [[0.0; B]; B];
                subtract(&mut self.lower[at], &below.map(|row| row.map(|x| -x)), &self.diagonal[j]);
                self.upper[at] = above;
            }
            let mut diagonal = self.diagonal[i];
            for at in start..start + i - first {
                subtract(&mut diagonal, &self.lower[at], &self.upper[at]);
            }
            let Some(inverse) = inverse(diagonal) else { return false };
            self.diagonal[i] = inverse;
        }
        true
    }

    /// Solves A x = b after [`Self::factorize`]; b becomes x.
    pub fn solve(&self, b: &mut [[f64; B]]) {
        let mut x: Vec<[f64; B]> = self.order.iter().map(|&row| b[row]).collect();
        for i in 0..x.len() {
            let (done, rest) = x.split_at_mut(i);
            for (l, x) in self.lower[self.start[i]..].iter().zip(&done[self.first[i]..]) {
                for r in 0..B {
                    rest[0][r] -= (0..B).map(|c| l[r][c] * x[c]).sum::<f64>();
                }
            }
        }
        for i in (0..x.len()).rev() {
            let (before, rest) = x.split_at_mut(i);
            rest[0] = self.diagonal[i].map(|row| (0..B).map(|c| row[c] * rest[0][c]).sum::<f64>());
            for (u, to) in self.upper[self.start[i]..].iter().zip(&mut before[self.first[i]..]) {
                for r in 0..B {
                    to[r] -= (0..B).map(|c| u[r][c] * rest[0][c]).sum::<f64>();
                }
            }
        }
        self.order.iter().zip(x).for_each(|(&row, x)| b[row] = x);
    }
}

/// a −= l u
#[inline]
fn subtract<const B: usize>(a: &mut LuBlock<B>, l: &LuBlock<B>, u: &LuBlock<B>) {
    for (a, l) in a.iter_mut().zip(l) {
        for (l, u) in l.iter().zip(u) {
            (0..B).for_each(|c| a[c] -= l * u[c]);
        }
    }
}

/// Inverse of a small matrix, by elimination with the largest entry of a column as its pivot. `None` if it is
/// singular.
pub fn inverse<const B: usize>(mut a: LuBlock<B>) -> Option<LuBlock<B>> {
    let mut x: LuBlock<B> = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
    for k in 0..B {
        let pivot = (k..B).max_by(|&r, &s| a[r][k].abs().total_cmp(&a[s][k].abs()))?;
        a.swap(k, pivot);
        x.swap(k, pivot);
        let factor = 1.0 / a[k][k];
        if !factor.is_finite() {
            return None;
        }
        (a[k], x[k]) = (a[k].map(|v| factor * v), x[k].map(|v| factor * v));
        let (row, inverse) = (a[k], x[k]);
        for r in (0..B).filter(|&r| r != k) {
            let factor = a[r][k];
            (0..B).for_each(|c| {
                a[r][c] -= factor * row[c];
                x[r][c] -= factor * inverse[c];
            });
        }
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chain of six in a mixed order, a loop of three, and a single row.
    const EDGES: [(usize, usize); 8] = [(3, 0), (0, 5), (5, 1), (1, 4), (4, 2), (6, 7), (7, 8), (8, 6)];
    const ROWS: usize = 10;

    fn solves<const B: usize>() {
        let entry = |i: usize, j: usize, r: usize, c: usize| {
            let near = i == j || EDGES.contains(&(i, j)) || EDGES.contains(&(j, i));
            let off = 0.313 - 0.1 * ((3 * i + 5 * j + 2 * r + 7 * c) % 11) as f64 / B as f64;
            if i == j && r == c {
                3.0 + 0.1 * i as f64
            } else if near {
                off
            } else {
                0.0
            }
        };
        let mut system = BlockLu::<B>::default();
        for _ in 0..2 {
            system.begin(ROWS, |i| (0..ROWS).filter(move |&j| entry(i, j, 0, B - 1) != 0.0));
            // The band of the chain is one block wide, that of the loop two.
            assert!(system.lower.len() <= 5 + 3, "{}", system.lower.len());
            system.clear();
            for (i, j) in (0..ROWS).flat_map(|i| (0..ROWS).map(move |j| (i, j))) {
                if entry(i, j, 0, B - 1) != 0.0 {
                    system.add(i, j, std::array::from_fn(|r| std::array::from_fn(|c| entry(i, j, r, c))));
                }
            }
            assert!(system.factorize());
            let expected = |j: usize, c: usize| 1.0 - 0.3 * (j + 2 * c) as f64;
            let row = |i: usize, r: usize| {
                (0..ROWS * B).map(|k| entry(i, k / B, r, k % B) * expected(k / B, k % B)).sum::<f64>()
            };
            let mut b: Vec<[f64; B]> = (0..ROWS).map(|i| std::array::from_fn(|r| row(i, r))).collect();
            system.solve(&mut b);
            for (j, x) in b.iter().enumerate() {
                (0..B).for_each(|c| assert!((x[c] - expected(j, c)).abs() < 1e-11, "{b:?}"));
            }
        }
        system.begin(2, |_| [0, 1].into_iter());
        assert!(!system.factorize());
    }

    #[test]
    fn systems_of_chains_loops_and_islands_are_solved() {
        solves::<1>();
        solves::<2>();
        solves::<3>();
    }
}
