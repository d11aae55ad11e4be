//! Linear systems whose entries are near the diagonal, once their rows are in the right order.
//!
//! Rows that share a body couple: chains, stacks and bridges have narrow bands, and islands do not couple at all. Rows are
//! ordered by breadth (`cuthill1969`). Then L has in row i, and U in column i, no entry before the first one f_i of the
//! matrix there, and for f = max(f_i, f_j)
//!
//! ```text
//! L_ij = (A_ij − Σ_{k=f..j} L_ik U_kj)/U_jj,   U_ji = A_ji − Σ_{k=f..j} L_jk U_ki,   j < i
//! U_ii = A_ii − Σ_k L_ik U_ki
//! ```
//!
//! in n b² operations for n rows of b entries. The pattern of A is symmetric, its values need not be. Pivots stay on the
//! diagonal: whoever asks checks what he gets. A symmetric system has half the work and half the memory
//! ([`Envelope::factorize`]).

/// A system and its factors; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct Envelope {
    /// The row of A that is the i-th, and the other way round.
    order: Vec<usize>,
    place: Vec<usize>,
    /// f_i, and where row i begins in `lower` and `upper`.
    first: Vec<usize>,
    start: Vec<usize>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    diagonal: Vec<f64>,
    solution: Vec<f64>,
}

/// Not yet ordered.
const NONE: usize = usize::MAX;

impl Envelope {
    /// Begins a system of zeros in which row i couples with `neighbors(i)`, of which some may be i itself.
    pub fn begin<I: Iterator<Item = usize>>(&mut self, n: usize, neighbors: impl Fn(usize) -> I) {
        self.arrange::<1, I>(n, neighbors);
        self.upper.clear();
        self.upper.resize(self.lower.len(), 0.0);
    }

    /// As [`Self::begin`], of a symmetric system of `n` blocks of B rows each: block i couples with the blocks
    /// `neighbors(i)`.
    pub fn begin_symmetric<const B: usize, I: Iterator<Item = usize>>(
        &mut self,
        n: usize,
        neighbors: impl Fn(usize) -> I,
    ) {
        self.arrange::<B, I>(n, neighbors);
        self.upper.clear();
    }

    /// Orders n blocks of B rows, and makes their lower half zero.
    fn arrange<const B: usize, I: Iterator<Item = usize>>(
        &mut self,
        n: usize,
        neighbors: impl Fn(usize) -> I,
    ) {
        self.order.clear();
        self.place.clear();
        self.place.resize(n, NONE);
        for seed in 0..n {
            let mut next = self.order.len();
            if self.place[seed] != NONE {
                continue;
            }
            // From the row that a search from the seed finds last.
            let mut last = seed;
            for pass in 0..2 {
                let begun = next;
                self.order[begun..].iter().for_each(|&row| self.place[row] = NONE);
                self.order.truncate(begun);
                self.take(last);
                let mut at = begun;
                while let Some(&row) = self.order.get(at) {
                    at += 1;
                    for other in neighbors(row) {
                        self.take(other);
                    }
                }
                if pass == 0 {
                    last = *self.order.last().expect("the seed");
                }
                next = begun;
            }
        }
        self.first.clear();
        self.start.clear();
        let mut length = 0;
        for (i, &block) in self.order.iter().enumerate() {
            let first = neighbors(block).map(|other| self.place[other]).min().unwrap_or(i).min(i);
            for row in B * i..B * (i + 1) {
                self.first.push(B * first);
                self.start.push(length);
                length += row - B * first;
            }
        }
        if B > 1 {
            // Rows of a block stay together.
            self.order.resize(B * n, NONE);
            self.place.resize(B * n, NONE);
            for i in (0..B * n).rev() {
                self.order[i] = B * self.order[i / B] + i % B;
            }
            for (i, &row) in self.order.iter().enumerate() {
                self.place[row] = i;
            }
        }
        self.lower.clear();
        self.lower.resize(length, 0.0);
        self.diagonal.clear();
        self.diagonal.resize(B * n, 0.0);
    }

    fn take(&mut self, row: usize) {
        if self.place[row] == NONE {
            self.place[row] = self.order.len();
            self.order.push(row);
        }
    }

    /// Adds to an entry of A.
    ///
    /// # Panics
    /// If the two do not couple.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let [i, j] = [row, column].map(|k| self.place[k]);
        let at = |i: usize, j: usize| self.start[i] + j - self.first[i];
        match i.cmp(&j) {
            std::cmp::Ordering::Equal => self.diagonal[i] += value,
            std::cmp::Ordering::Greater => {
                let at = at(i, j);
                self.lower[at] += value;
            }
            std::cmp::Ordering::Less => {
                let at = at(j, i);
                self.upper[at] += value;
            }
        }
    }

    /// Entries of the lower half, without the diagonal.
    pub fn entries(&self) -> usize {
        self.lower.len()
    }

    /// Zeros of the same pattern.
    pub fn clear(&mut self) {
        for values in [&mut self.lower, &mut self.upper, &mut self.diagonal] {
            values.fill(0.0);
        }
    }

    /// Adds to a block of a symmetric A, and to its mirror image; of a block on the diagonal the lower half counts.
    ///
    /// # Panics
    /// If the two do not couple.
    pub fn add_block<const B: usize>(&mut self, row: usize, column: usize, values: [[f64; B]; B]) {
        let [i, j] = [row, column].map(|block| self.place[B * block]);
        for (r, row) in values.iter().enumerate() {
            if i == j {
                let at = self.start[i + r] + i - self.first[i];
                (0..r).for_each(|c| self.lower[at + c] += row[c]);
                self.diagonal[i + r] += row[r];
            } else {
                let (low, high) = (i.min(j), i.max(j));
                let at = self.start[high + r] + low - self.first[high];
                (0..B).for_each(|c| self.lower[at + c] += if i > j { row[c] } else { values[c][r] });
            }
        }
    }

    /// Cholesky's factor of a symmetric A, L Lᵀ with rows as long as those of A:
    ///
    /// ```text
    /// L_ij = (A_ij − Σ_{k=f..j} L_ik L_jk)/L_jj,   L_ii = √(A_ii − Σ_k L_ik²)
    /// ```
    ///
    /// False if a square is below `least`.
    pub fn factorize(&mut self, least: f64) -> bool {
        for i in 0..self.diagonal.len() {
            let (before, own) = self.lower.split_at_mut(self.start[i]);
            let first = self.first[i];
            for j in first..i {
                let from = first.max(self.first[j]);
                let other = &before[self.start[j] + from - self.first[j]..self.start[j] + j - self.first[j]];
                let below = dot(&own[from - first..j - first], other);
                // Diagonals are kept as reciprocals.
                own[j - first] = (own[j - first] - below) * self.diagonal[j];
            }
            let square = self.diagonal[i] - dot(&own[..i - first], &own[..i - first]);
            if square < least || !square.is_finite() {
                return false;
            }
            self.diagonal[i] = 1.0 / square.sqrt();
        }
        true
    }

    /// x of L Lᵀ x = b after [`Self::factorize`], in the place of b.
    pub fn substitute(&mut self, b: &mut [f64]) {
        self.solution.clear();
        self.solution.extend(self.order.iter().map(|&row| b[row]));
        for i in 0..self.diagonal.len() {
            let (start, first) = (self.start[i], self.first[i]);
            let below = dot(&self.lower[start..start + i - first], &self.solution[first..i]);
            self.solution[i] = (self.solution[i] - below) * self.diagonal[i];
        }
        for i in (0..self.diagonal.len()).rev() {
            let (start, first) = (self.start[i], self.first[i]);
            let x = self.solution[i] * self.diagonal[i];
            self.solution[i] = x;
            for (to, l) in self.solution[first..i].iter_mut().zip(&self.lower[start..]) {
                *to -= l * x;
            }
        }
        for (&row, &x) in self.order.iter().zip(&self.solution) {
            b[row] = x;
        }
    }

    /// Factorizes A and solves A x = b, which becomes x. False if a pivot is below `least`; then b is as it was.
    pub fn solve(&mut self, b: &mut [f64], least: f64) -> bool {
        let n = self.diagonal.len();
        let row =
            |values: &[f64], start: usize, from: usize, to: usize, first: usize| -> std::ops::Range<usize> {
                debug_assert!(to >= from && from >= first && values.len() >= start + to - first);
                start + from - first..start + to - first
            };
        for i in 0..n {
            let (start, first) = (self.start[i], self.first[i]);
            for j in first..i {
                let from = first.max(self.first[j]);
                let own = row(&self.lower, start, from, j, first);
                let other = row(&self.lower, self.start[j], from, j, self.first[j]);
                let at = start + j - first;
                let below = dot(&self.lower[own.clone()], &self.upper[other.clone()]);
                self.lower[at] = (self.lower[at] - below) / self.diagonal[j];
                self.upper[at] -= dot(&self.lower[other], &self.upper[own]);
            }
            let all = start..start + i - first;
            self.diagonal[i] -= dot(&self.lower[all.clone()], &self.upper[all]);
            if self.diagonal[i].abs() < least || !self.diagonal[i].is_finite() {
                return false;
            }
        }
        self.solution.clear();
        self.solution.extend(self.order.iter().map(|&row| b[row]));
        for i in 0..n {
            let (start, first) = (self.start[i], self.first[i]);
            self.solution[i] -= dot(&self.lower[start..start + i - first], &self.solution[first..i]);
        }
        for i in (0..n).rev() {
            let (start, first) = (self.start[i], self.first[i]);
            let x = self.solution[i] / self.diagonal[i];
            self.solution[i] = x;
            for (to, u) in self.solution[first..i].iter_mut().zip(&self.upper[start..]) {
                *to -= u * x;
            }
        }
        for (&row, &x) in self.order.iter().zip(&self.solution) {
            b[row] = x;
        }
        true
    }
}

/// x·y, in four parts.
fn dot(x: &[f64], y: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (x4, y4) = (x.chunks_exact(4), y.chunks_exact(4));
    let rest = x4.remainder().iter().zip(y4.remainder()).map(|(x, y)| x * y).sum::<f64>();
    for (x, y) in x4.zip(y4) {
        (0..4).for_each(|k| sums[k] += x[k] * y[k]);
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn systems_of_chains_loops_and_islands_are_solved() {
        // A chain of six in a mixed order, a loop of three, and a row alone.
        let edges = [(3, 0), (0, 5), (5, 1), (1, 4), (4, 2), (6, 7), (7, 8), (8, 6)];
        let n = 10;
        let mut matrix = vec![vec![0.0; n]; n];
        for (k, &(i, j)) in edges.iter().enumerate() {
            (matrix[i][j], matrix[j][i]) = (0.3 + 0.1 * k as f64, -0.7 + 0.05 * k as f64);
        }
        (0..n).for_each(|i| matrix[i][i] = 2.0 + 0.1 * i as f64);
        let mut system = Envelope::default();
        for _ in 0..2 {
            let neighbors = |i: usize| {
                let row = &matrix[i];
                (0..n).filter(|&j| row[j] != 0.0).collect::<Vec<_>>().into_iter()
            };
            system.begin(n, neighbors);
            // The band of the chain is one, of the loop two.
            assert!(system.lower.len() <= 5 + 3, "{}", system.lower.len());
            for (i, row) in matrix.iter().enumerate() {
                row.iter().enumerate().filter(|(_, x)| **x != 0.0).for_each(|(j, x)| system.add(i, j, *x));
            }
            let expected: Vec<f64> = (0..n).map(|i| 1.0 - 0.3 * i as f64).collect();
            let mut b: Vec<f64> =
                matrix.iter().map(|row| row.iter().zip(&expected).map(|(a, x)| a * x).sum()).collect();
            assert!(system.solve(&mut b, 1e-12));
            assert!(b.iter().zip(&expected).all(|(x, y)| (x - y).abs() < 1e-12), "{b:?}");
        }
        system.begin(2, |_| [0, 1].into_iter());
        assert!(!system.solve(&mut [1.0, 1.0], 1e-12));
    }

    #[test]
    fn symmetric_systems_of_blocks_are_solved_again_and_again() {
        // Blocks in a loop with a tail, and one alone; A = Σ j jᵀ + 1 over rows j of pairs of blocks.
        let edges = [(4usize, 0usize), (0, 2), (2, 4), (4, 1)];
        let (n, mut system) = (6, Envelope::default());
        for round in 0..2 {
            let neighbors = |i: usize| {
                edges.iter().filter(move |e| e.0 == i || e.1 == i).flat_map(|e| [e.0, e.1]).chain([i])
            };
            system.begin_symmetric::<3, _>(n, neighbors);
            let mut matrix = vec![vec![0.0; 3 * n]; 3 * n];
            (0..3 * n).for_each(|i| matrix[i][i] = 1.0);
            let unit = std::array::from_fn(|r| std::array::from_fn(|c| f64::from(u8::from(r == c))));
            (0..n).for_each(|block| system.add_block::<3>(block, block, unit));
            for (k, &(a, b)) in edges.iter().enumerate() {
                let j = |side: usize, c: usize| (0.3 + k as f64 - 0.7 * side as f64) * (1.0 + c as f64);
                let blocks = [a, b];
                for (s, t) in [(0, 0), (1, 1), (0, 1)] {
                    let product = std::array::from_fn(|r| std::array::from_fn(|c| j(s, r) * j(t, c)));
                    system.add_block::<3>(blocks[s], blocks[t], product);
                }
                for (r, c) in (0..6).flat_map(|r| (0..6).map(move |c| (r, c))) {
                    matrix[3 * blocks[r / 3] + r % 3][3 * blocks[c / 3] + c % 3] +=
                        j(r / 3, r % 3) * j(c / 3, c % 3);
                }
            }
            assert!(system.factorize(0.5));
            for shift in 0..2 {
                let expected: Vec<f64> = (0..3 * n).map(|i| 1.0 - 0.3 * (i + shift + round) as f64).collect();
                let mut b: Vec<f64> =
                    matrix.iter().map(|row| row.iter().zip(&expected).map(|(a, x)| a * x).sum()).collect();
                system.substitute(&mut b);
                assert!(b.iter().zip(&expected).all(|(x, y)| (x - y).abs() < 1e-10), "{b:?}");
            }
        }
        system.clear();
        assert!(!system.factorize(0.5));
    }
}
