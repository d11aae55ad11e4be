//! Symmetric positive definite systems of 3 × 3 blocks, one row of blocks per body, by LDLᵀ.
//!
//! Bodies couple where they touch. They are ordered by breadth as rows of [`super::envelope`] are, and L has no entry before
//! the first one f_i of the matrix in its row:
//!
//! ```text
//! w_ij = A_ij − Σ_{k=f..j} w_ik L_jk,   L_ij = w_ij/D_j,   D_i = A_ii − Σ_k w_ik L_ik
//! ```
//!
//! with f = max(f_i, f_j): half of the operations and of the memory of a system that is not symmetric.

use super::envelope::{by_breadth, dot};

/// A block of the matrix.
pub type Block3 = [[f64; 3]; 3];

/// A system and its factors; keeps its memory.
#[derive(Clone, Debug, Default)]
pub struct BlockEnvelope {
    /// The body that is the i-th, and the other way round.
    order: Vec<usize>,
    place: Vec<usize>,
    /// First block of each row of blocks, and where each row of numbers begins. `[bodies]`, `[3 bodies + 1]`
    first: Vec<usize>,
    start: Vec<usize>,
    /// Rows without their diagonal.
    values: Vec<f64>,
    diagonal: Vec<f64>,
    solution: Vec<f64>,
}

impl BlockEnvelope {
    /// Begins a system of zeros in which body i couples with `neighbors(i)`, of which some may be i itself.
    pub fn begin<I: Iterator<Item = usize>>(&mut self, n: usize, neighbors: impl Fn(usize) -> I) {
        by_breadth(n, &neighbors, [&mut self.order, &mut self.place]);
        self.first.clear();
        self.start.clear();
        let mut length = 0;
        for (i, &body) in self.order.iter().enumerate() {
            let first = neighbors(body).map(|other| self.place[other]).min().unwrap_or(i).min(i);
            self.first.push(first);
            for r in 0..3 {
                self.start.push(length);
                length += 3 * (i - first) + r;
            }
        }
        self.start.push(length);
        self.values.clear();
        self.values.resize(length, 0.0);
        self.diagonal.clear();
        self.diagonal.resize(3 * n, 0.0);
    }

    /// All entries become zero again.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
        self.diagonal.fill(0.0);
    }

    /// Multiplications of a factorization.
    pub fn work(&self) -> f64 {
        self.start.windows(2).map(|row| 0.5 * (row[1] - row[0]).pow(2) as f64).sum()
    }

    /// Numbers held of L.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Adds to the block of two bodies, and its transpose to the block on the other side of the diagonal.
    ///
    /// # Panics
    /// If the two do not couple.
    pub fn add(&mut self, row: usize, column: usize, block: &Block3) {
        let [i, j] = [row, column].map(|body| self.place[body]);
        let (i, j, turned) = if i < j { (j, i, true) } else { (i, j, false) };
        for r in 0..3 {
            let begin = self.start[3 * i + r] + 3 * (j - self.first[i]);
            let columns = if i == j { r } else { 3 };
            for (c, value) in self.values[begin..begin + columns].iter_mut().enumerate() {
                *value += if turned { block[c][r] } else { block[r][c] };
            }
            if i == j {
                self.diagonal[3 * i + r] += block[r][r];
            }
        }
    }

    /// Replaces A by its factors. False if it is not positive definite.
    pub fn factor(&mut self) -> bool {
        for i in 0..self.diagonal.len() {
            let (start, first) = (self.start[i], 3 * self.first[i / 3]);
            let (above, row) = self.values.split_at_mut(start);
            for j in first..i {
                let first_other = 3 * self.first[j / 3];
                let from = first.max(first_other);
                let other = &above[self.start[j] + from - first_other..self.start[j + 1]];
                row[j - first] -= dot(&row[from - first..j - first], other);
            }
            for j in first..i {
                let w = row[j - first];
                row[j - first] = w / self.diagonal[j];
                self.diagonal[i] -= w * row[j - first];
            }
            if self.diagonal[i] <= 0.0 || !self.diagonal[i].is_finite() {
                return false;
            }
        }
        true
    }

    /// Solves A x = b by the factors; b becomes x. `[bodies]`
    pub fn solve(&mut self, b: &mut [[f64; 3]]) {
        let n = self.diagonal.len();
        self.solution.clear();
        self.solution.extend(self.order.iter().flat_map(|&body| b[body]));
        let row = |i: usize| (self.start[i]..self.start[i + 1], 3 * self.first[i / 3]);
        for i in 0..n {
            let (entries, first) = row(i);
            self.solution[i] -= dot(&self.values[entries], &self.solution[first..i]);
        }
        self.solution.iter_mut().zip(&self.diagonal).for_each(|(x, d)| *x /= d);
        for i in (0..n).rev() {
            let (entries, first) = row(i);
            let (before, x) = self.solution.split_at_mut(i);
            before[first..].iter_mut().zip(&self.values[entries]).for_each(|(to, l)| *to -= l * x[0]);
        }
        for (&body, x) in self.order.iter().zip(self.solution.chunks_exact(3)) {
            b[body].copy_from_slice(x);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_loops_and_islands_of_bodies_are_solved() {
        // A chain of five in a mixed order, a loop of three, and a body alone.
        let edges = [(3, 0), (0, 4), (4, 1), (1, 2), (5, 6), (6, 7), (7, 5)];
        let n = 9;
        let mut full = vec![vec![0.0; 3 * n]; 3 * n];
        let mut system = BlockEnvelope::default();
        let near = |i: usize| {
            let of = move |&(a, b): &(usize, usize)| (a == i).then_some(b).or((b == i).then_some(a));
            edges.iter().filter_map(of)
        };
        system.begin(n, near);
        // Four coupled pairs of the chain, three of the loop, nine numbers each, and three below each diagonal.
        assert_eq!(system.len(), 9 * 7 + 3 * n);
        for _ in 0..2 {
            system.clear();
            full.iter_mut().flatten().for_each(|x| *x = 0.0);
            let mut add = |i: usize, j: usize, block: Block3| {
                system.add(i, j, &block);
                for r in 0..3 {
                    for c in 0..3 {
                        full[3 * i + r][3 * j + c] += block[r][c];
                        if i != j {
                            full[3 * j + c][3 * i + r] += block[r][c];
                        }
                    }
                }
            };
            for i in 0..n {
                add(i, i, [[4.0, 0.5, -0.3], [0.5, 5.0, 0.2], [-0.3, 0.2, 3.0 + 0.1 * i as f64]]);
            }
            for (k, &(i, j)) in edges.iter().enumerate() {
                let x = 0.1 * k as f64;
                add(i, j, [[0.3 - x, 0.1, -0.2], [0.4, x, 0.1], [-0.1, 0.2, 0.3]]);
            }
            let expected: Vec<f64> = (0..3 * n).map(|i| 1.0 - 0.3 * i as f64).collect();
            let of = |row: &Vec<f64>| row.iter().zip(&expected).map(|(a, x)| a * x).sum::<f64>();
            let flat: Vec<f64> = full.iter().map(of).collect();
            let mut b: Vec<[f64; 3]> = flat.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect();
            assert!(system.factor());
            system.solve(&mut b);
            let worst = b.iter().flatten().zip(&expected).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{worst}");
        }
        system.clear();
        assert!(!system.factor());
    }
}
