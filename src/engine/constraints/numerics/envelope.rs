//! Symmetric systems whose entries are close to the diagonal once their rows are in the right order, as in
//! [`super::block_lu`]. Row i of their factor has no entry before the first one of the matrix. The factor
//! takes half the work and the memory of L and U.

/// Not yet ordered.
const NONE: usize = usize::MAX;

/// A system and its factors; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct Envelope {
    /// The row of A at each place, and its inverse: the place of each row.
    order: Vec<usize>,
    place: Vec<usize>,
    /// First entry of row i, and where the row begins in `lower`.
    first: Vec<usize>,
    start: Vec<usize>,
    lower: Vec<f64>,
    diagonal: Vec<f64>,
    solution: Vec<f64>,
}

impl Envelope {
    /// Begins a system of zeros with `n` blocks of B rows each, in which block i couples with the blocks
    /// `neighbors(i)`. These may include i itself.
    pub fn begin<const B: usize, I: Iterator<Item = usize>>(
        &mut self,
        n: usize,
        neighbors: impl Fn(usize) -> I,
    ) {
        by_breadth(n, &neighbors, [&mut self.order, &mut self.place]);
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
            self.order.resize(B * n, 0);
            self.place.resize(B * n, 0);
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

    /// Number of entries below the diagonal.
    pub fn entries(&self) -> usize {
        self.lower.len()
    }

    /// Number of multiplications in a factorization.
    pub fn work(&self) -> f64 {
        let rows = self.first.iter().enumerate();
        rows.map(|(i, first)| 0.5 * (i - first).pow(2) as f64).sum()
    }

    /// Sets all entries to zero; the pattern remains.
    pub fn clear(&mut self) {
        for values in [&mut self.lower, &mut self.diagonal] {
            values.fill(0.0);
        }
    }

    /// Adds to a block of a symmetric A, and to its mirror image. Only the lower half of a diagonal block is
    /// used.
    ///
    /// # Panics
    /// If the row and the column do not couple.
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

    /// Cholesky factorization of a symmetric A, L Lᵀ. Rows of L are as long as those of A:
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

    /// Solves L Lᵀ x = b after [`Self::factorize`]; b becomes x.
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
}

/// Which rows of a system couple, besides with themselves; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct Couplings {
    /// In both orders and sorted; and where the pairs of each row begin.
    pairs: Vec<[usize; 2]>,
    begins: Vec<usize>,
}

impl Couplings {
    /// The couplings of `n` rows. A pair may be listed more than once.
    pub fn begin(&mut self, n: usize, pairs: impl Iterator<Item = [usize; 2]>) {
        self.pairs.clear();
        for [a, b] in pairs {
            // Points of one contact follow each other.
            if self.pairs.last() != Some(&[b, a]) {
                self.pairs.extend([[a, b], [b, a]]);
            }
        }
        self.pairs.sort_unstable();
        self.pairs.dedup();
        self.begins.clear();
        self.begins.extend((0..=n).map(|i| self.pairs.partition_point(|pair| pair[0] < i)));
    }

    /// The rows that couple with this one, ascending.
    pub fn of(&self, row: usize) -> impl Iterator<Item = usize> {
        self.pairs[self.begins[row]..self.begins[row + 1]].iter().map(|pair| pair[1])
    }
}

/// Orders rows by breadth, island by island. Each island starts from the row that a search from its first row
/// finds last. `order` becomes that order, `place` its inverse.
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

/// x·y, summed in four parts.
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
    fn symmetric_systems_of_blocks_are_solved_again_and_again() {
        // Blocks in a loop with a tail, and a single one; A = Σ j jᵀ + 1 over rows j of pairs of blocks.
        let edges = [(4usize, 0usize), (0, 2), (2, 4), (4, 1)];
        let (n, mut system) = (6, Envelope::default());
        for round in 0..2 {
            let neighbors = |i: usize| {
                edges.iter().filter(move |e| e.0 == i || e.1 == i).flat_map(|e| [e.0, e.1]).chain([i])
            };
            system.begin::<3, _>(n, neighbors);
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
