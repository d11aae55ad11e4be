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
//! diagonal: whoever asks checks what he gets.

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
        for values in [&mut self.lower, &mut self.upper] {
            values.clear();
            values.resize(length, 0.0);
        }
        self.diagonal.clear();
        self.diagonal.resize(n, 0.0);
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

/// Orders rows by breadth, island by island, each from the row that a search from its first one finds last; `order` is that,
/// `place` its inverse.
pub fn by_breadth<I: Iterator<Item = usize>>(
    n: usize,
    neighbors: &impl Fn(usize) -> I,
    [order, place]: [&mut Vec<usize>; 2],
) {
    let take = |row: usize, order: &mut Vec<usize>, place: &mut [usize]| {
        if place[row] == NONE {
            place[row] = order.len();
            order.push(row);
        }
    };
    order.clear();
    place.clear();
    place.resize(n, NONE);
    for seed in 0..n {
        if place[seed] != NONE {
            continue;
        }
        let (begun, mut first) = (order.len(), seed);
        for pass in 0..2 {
            order[begun..].iter().for_each(|&row| place[row] = NONE);
            order.truncate(begun);
            take(first, order, place);
            let mut at = begun;
            while let Some(&row) = order.get(at) {
                at += 1;
                for other in neighbors(row) {
                    take(other, order, place);
                }
            }
            if pass == 0 {
                first = *order.last().expect("the seed");
            }
        }
    }
}

/// x·y, in four parts.
pub(super) fn dot(x: &[f64], y: &[f64]) -> f64 {
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
}
