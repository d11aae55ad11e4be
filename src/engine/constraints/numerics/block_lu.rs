//! A sparse factorisation in blocks of 3 × 3 in `f64`: one block row per body, one off-diagonal pair per two bodies that touch.
//!
//! A = L U without exchanges, which a matrix allows that is near to symmetric and positive definite, as mass matrices with
//! penalties are. The pattern is symmetric, values need not be: where friction slips, it follows the normal
//! impulse and not the other way round. Rows are eliminated in the order of least degree: the row that
//! touches the fewest others that are left goes next, and those others then touch each other. Chains and trees fill nothing.
//! [`BlockLu::analyse`] finds the pattern and lists, once for as long as no contact comes or goes, which block each product
//! goes to; a factorisation is then a walk over that list. Parts that do not touch do not fill each other, so that
//! islands need no treatment of their own.
//!
//! **Source**: Tinney & Walker 1967 (least degree); Davis 2006 (`davis2006`), chapters 4 and 7.
//! **Cost**: 27 multiply-adds per product, and d² products for a row with d later neighbours, fill included.

use crate::engine::lanes::held;

/// A 3 × 3 block, by rows.
pub type Block3 = [[f64; 3]; 3];

/// A vector's part of one body.
pub type Part3 = [f64; 3];

/// The factorisation; see the [module](self).
#[derive(Clone, Debug, Default)]
pub struct BlockLu {
    /// What the pattern is of.
    rows: usize,
    edges: Vec<[u32; 2]>,
    /// Rows in the order of elimination, and the place of each row in it.
    order: Vec<u32>,
    place: Vec<u32>,
    /// By place: where its later neighbours begin in `later`; one more at the end.
    first: Vec<u32>,
    /// Places of later neighbours, ascending within a row.
    later: Vec<u32>,
    /// Targets of the products of each row in turn, see [`Self::factorise`].
    targets: Vec<u32>,
    /// Diagonal blocks, then for each entry of `later` the one above the diagonal, then the ones below.
    blocks: Vec<Block3>,
    /// Inverses of the pivots.
    pivots: Vec<Block3>,
    scratch: Vec<Part3>,
}

impl BlockLu {
    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        let lists = [&self.order, &self.place, &self.first, &self.later, &self.targets];
        let blocks = held(&self.blocks) + held(&self.pivots) + held(&self.scratch);
        held(&self.edges) + lists.into_iter().map(held).sum::<usize>() + blocks
    }

    /// Finds the pattern of a matrix of so many block rows whose `edges` couple; returns at once if it is that of the last
    /// call. All entries are zero then.
    ///
    /// # Panics
    /// If an edge names a row that is not there.
    pub fn analyse(&mut self, rows: usize, edges: &[[u32; 2]]) {
        if self.rows != rows || self.edges != edges || self.first.is_empty() {
            self.rows = rows;
            self.edges.clear();
            self.edges.extend_from_slice(edges);
            self.eliminate();
            self.find_targets();
        }
        self.blocks.fill([[0.0; 3]; 3]);
    }

    /// Order and pattern by least degree.
    fn eliminate(&mut self) {
        let n = self.rows;
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); n];
        for &[a, b] in self.edges.iter().filter(|[a, b]| a != b) {
            neighbours[a as usize].push(b);
            neighbours[b as usize].push(a);
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        // Entries of rows that have changed their degree since are out of date.
        let mut queue: std::collections::BinaryHeap<_> =
            (0..n).map(|i| std::cmp::Reverse((neighbours[i].len(), i as u32))).collect();
        self.place.clear();
        self.place.resize(n, u32::MAX);
        self.order.clear();
        let mut lists = Vec::with_capacity(n);
        while let Some(std::cmp::Reverse((degree, row))) = queue.pop() {
            if self.place[row as usize] != u32::MAX || neighbours[row as usize].len() != degree {
                continue;
            }
            self.place[row as usize] = self.order.len() as u32;
            self.order.push(row);
            let list = std::mem::take(&mut neighbours[row as usize]);
            for &i in &list {
                let own = std::mem::take(&mut neighbours[i as usize]);
                let mut joined: Vec<u32> =
                    own.into_iter().chain(list.iter().copied()).filter(|&j| j != row && j != i).collect();
                joined.sort_unstable();
                joined.dedup();
                queue.push(std::cmp::Reverse((joined.len(), i)));
                neighbours[i as usize] = joined;
            }
            lists.push(list);
        }
        self.first.clear();
        self.later.clear();
        for list in lists {
            self.first.push(self.later.len() as u32);
            let from = self.later.len();
            self.later.extend(list.iter().map(|&row| self.place[row as usize]));
            self.later[from..].sort_unstable();
        }
        self.first.push(self.later.len() as u32);
        self.blocks.resize(n + 2 * self.later.len(), [[0.0; 3]; 3]);
        self.pivots.resize(n, [[0.0; 3]; 3]);
        self.scratch.resize(n, [0.0; 3]);
    }

    /// For each row, each pair of its later neighbours (i, j) in turn: the block (i, j).
    fn find_targets(&mut self) {
        self.targets.clear();
        for k in 0..self.rows {
            let list = self.later_of(k);
            for i in list.clone() {
                for j in list.clone() {
                    let target = self.block_at(self.later[i] as usize, self.later[j] as usize);
                    self.targets.push(target as u32);
                }
            }
        }
    }

    fn later_of(&self, place: usize) -> std::ops::Range<usize> {
        self.first[place] as usize..self.first[place + 1] as usize
    }

    /// Where the block of these places is.
    fn block_at(&self, i: usize, j: usize) -> usize {
        if i == j {
            return i;
        }
        let (row, column) = (i.min(j), i.max(j));
        let list = &self.later[self.later_of(row)];
        let at = list.binary_search(&(column as u32)).expect("the pattern has every product");
        let above = self.rows + self.first[row] as usize + at;
        if i < j { above } else { above + self.later.len() }
    }

    /// Where [`Self::add`] finds the block of these two rows, which an edge couples or which are the same.
    pub fn slot(&self, row: u32, column: u32) -> usize {
        self.block_at(self.place[row as usize] as usize, self.place[column as usize] as usize)
    }

    /// Adds to a block.
    pub fn add(&mut self, slot: usize, block: &Block3) {
        for (to, from) in self.blocks[slot].iter_mut().zip(block) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to += from);
        }
    }

    /// Replaces the entries by the factors. False if a pivot is singular; then the factors mean nothing.
    pub fn factorise(&mut self) -> bool {
        let upper = self.rows;
        let lower = upper + self.later.len();
        let mut target = 0;
        for k in 0..self.rows {
            let Some(pivot) = inverse(&self.blocks[k]) else { return false };
            self.pivots[k] = pivot;
            let list = self.later_of(k);
            for i in list.clone() {
                let factor = product(&self.blocks[lower + i], &pivot);
                self.blocks[lower + i] = factor;
                for j in list.clone() {
                    let above = self.blocks[upper + j];
                    subtract(&mut self.blocks[self.targets[target] as usize], &factor, &above);
                    target += 1;
                }
            }
        }
        true
    }

    /// Solves A x = b with the factors; `b`, one part per row, becomes x.
    pub fn solve(&mut self, b: &mut [Part3]) {
        let (upper, lower) = (self.rows, self.rows + self.later.len());
        for (x, &row) in self.scratch.iter_mut().zip(&self.order) {
            *x = b[row as usize];
        }
        for k in 0..self.rows {
            let x = self.scratch[k];
            for i in self.first[k] as usize..self.first[k + 1] as usize {
                minus(&mut self.scratch[self.later[i] as usize], &self.blocks[lower + i], &x);
            }
        }
        for k in (0..self.rows).rev() {
            let mut x = self.scratch[k];
            for i in self.first[k] as usize..self.first[k + 1] as usize {
                minus(&mut x, &self.blocks[upper + i], &self.scratch[self.later[i] as usize]);
            }
            self.scratch[k] = times(&self.pivots[k], &x);
        }
        for (x, &row) in self.scratch.iter().zip(&self.order) {
            b[row as usize] = *x;
        }
    }
}

/// A x.
fn times(a: &Block3, x: &Part3) -> Part3 {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// y ← y − A x.
fn minus(y: &mut Part3, a: &Block3, x: &Part3) {
    let ax = times(a, x);
    y.iter_mut().zip(ax).for_each(|(y, ax)| *y -= ax);
}

fn product(a: &Block3, b: &Block3) -> Block3 {
    a.map(|row| [0, 1, 2].map(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

/// C ← C − A B.
fn subtract(c: &mut Block3, a: &Block3, b: &Block3) {
    let ab = product(a, b);
    for (c, ab) in c.iter_mut().zip(ab) {
        c.iter_mut().zip(ab).for_each(|(c, ab)| *c -= ab);
    }
}

/// By cofactors; none if the determinant is zero or not finite.
fn inverse(a: &Block3) -> Option<Block3> {
    let cofactor = |i: usize, j: usize| {
        let (r, s, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        a[r][c] * a[s][d] - a[r][d] * a[s][c]
    };
    let determinant: f64 = (0..3).map(|j| a[0][j] * cofactor(0, j)).sum();
    let scale = 1.0 / determinant;
    let found = [0, 1, 2].map(|i| [0, 1, 2].map(|j| scale * cofactor(j, i)));
    scale.is_finite().then_some(found).filter(|_| determinant != 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::constraints::numerics::matrix::{Lu, Matrix};

    /// A grid of bodies, their blocks unsymmetric, against the dense factorisation.
    #[test]
    fn a_grid_is_solved_as_by_a_dense_factorisation() {
        let (side, n) = (6usize, 36usize);
        let mut edges = Vec::new();
        for i in 0..n as u32 {
            if (i as usize + 1) % side != 0 {
                edges.push([i, i + 1]);
            }
            if (i as usize) + side < n {
                edges.push([i + side as u32, i]);
            }
        }
        let mut lu = BlockLu::default();
        // A pattern that was there before leaves nothing behind.
        lu.analyse(3, &[[0, 1], [1, 2]]);
        lu.analyse(n, &edges);
        let mut dense = Matrix::zeros(3 * n, 3 * n);
        let mut add = |row: u32, column: u32, block: Block3| {
            let slot = lu.slot(row, column);
            lu.add(slot, &block);
            for (i, line) in block.iter().enumerate() {
                for (j, x) in line.iter().enumerate() {
                    dense[(3 * row as usize + i, 3 * column as usize + j)] += x;
                }
            }
        };
        let some =
            |seed: f64| [0, 1, 2].map(|i| [0, 1, 2].map(|j| (seed + 3.1 * i as f64 + 1.7 * j as f64).sin()));
        for i in 0..n as u32 {
            let mut block = some(f64::from(i));
            (0..3).for_each(|k| block[k][k] += 20.0);
            add(i, i, block);
        }
        for (k, &[a, b]) in edges.iter().enumerate() {
            add(a, b, some(100.0 + k as f64));
            add(b, a, some(200.0 + k as f64));
        }
        let right: Vec<Part3> = (0..n).map(|i| [0, 1, 2].map(|k| ((3 * i + k) as f64).cos())).collect();
        let truth = Lu::new(dense).unwrap().solve(&Matrix::from_fn(3 * n, 1, |i, _| right[i / 3][i % 3]));
        assert!(lu.factorise());
        let mut x = right.clone();
        lu.solve(&mut x);
        for (i, x) in x.iter().flatten().enumerate() {
            assert!((x - truth[(i, 0)]).abs() < 1e-13, "{i}: {x} for {}", truth[(i, 0)]);
        }
        // Ordered row by row a grid of side m fills m blocks a row; by least degree less.
        assert!(lu.later.len() < n * side, "{}", lu.later.len());
    }

    #[test]
    fn a_chain_fills_nothing_and_a_singular_pivot_is_refused() {
        let edges: Vec<[u32; 2]> = (0..99).map(|i| [i, i + 1]).collect();
        let mut lu = BlockLu::default();
        lu.analyse(100, &edges);
        assert_eq!(lu.later.len(), 99);
        assert!(!lu.factorise());
        let mut none = BlockLu::default();
        none.analyse(0, &[]);
        assert!(none.factorise());
        none.solve(&mut []);
    }
}
