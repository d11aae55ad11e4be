//! A hash grid with one level per size class, rebuilt from scratch each step.
//!
//! **Cells.** A proxy lies in exactly one cell, that of its lower corner, on a grid with cells larger than
//! the proxy. Memory is therefore linear in the number of proxies whatever their sizes, and a pair can be
//! found only once.
//!
//! Let h be the cell size and c(x) = ⌊x/h⌋. If a and b overlap on an axis, then b.min ≤ a.max, and a.min ≤
//! b.max < b.min + h, hence
//!
//! ```text
//! c(a.min) − 1 ≤ c(b.min) ≤ c(a.max)                                   (1)
//! ```
//!
//! Cell sizes are powers of two, so x/h is exact, and (1) holds in floating point as in exact arithmetic:
//! rounding is monotone, so if a rounded extent is below h (itself a float), so is the true one.
//!
//! **Levels.** With a single cell size, one boulder would put thousands of grains into one cell. Sizes are
//! therefore divided into classes of two octaves, each with its own grid. A proxy looks for partners on its
//! own level and on all coarser ones, where (1) holds with the coarser h.
//!
//! **Source:** cells hashed into a table, Teschner et al. 2003
//! (`teschner2003`); a grid per size class, Mirtich 1996 (`mirtich1996`).

use super::Proxy;
use super::sort::{ByLower, merge};
use crate::workers::Workers;
use glam::Vec2;

/// Buckets per proxy of a level. More buckets mean fewer collisions but a longer prefix sum.
const BUCKETS_PER_PROXY: u32 = 2;

/// A cell index has at most this many bits (and sign), so that it is exact in `f32`.
const CELL_BITS: i32 = 22;

/// Cell sizes 4^k · 2^(−126) for k in 0..CLASSES; the last one means "infinite".
const CLASSES: usize = 129;

/// Finds candidate pairs. Buffers are reused between calls.
#[derive(Clone, Debug, Default)]
pub struct HashGrid {
    /// Finest first.
    levels: Vec<GridLevel>,
    /// First entry of each bucket, `[buckets + 2]`.
    starts: Vec<u32>,
    /// Proxies in their own order and by bucket, `[proxies]`.
    unsorted: Vec<GridEntry>,
    entries: Vec<GridEntry>,
    /// Pairs in the order found.
    found: Vec<[u32; 2]>,
    sorted: ByLower,
}

#[derive(Clone, Copy, Debug)]
struct GridEntry {
    proxy: Proxy,
    index: u32,
    /// Index of the size class at first, then of the level.
    level: u8,
    cell: [i32; 2],
}

#[derive(Clone, Debug)]
struct GridLevel {
    /// 1/h, zero for the infinite cell (1/m).
    inv_cell: f32,
    /// First bucket of the level.
    base: u32,
    /// Number of buckets of the level.
    buckets: u32,
}

impl GridLevel {
    /// The cell that contains a point. NaN becomes 0; |x|/h < 2^23 by the choice of class.
    #[inline]
    fn cell(&self, point: Vec2) -> [i32; 2] {
        [point.x, point.y].map(|x| (x * self.inv_cell).floor() as i32)
    }

    #[inline]
    fn bucket(&self, [x, y]: [i32; 2]) -> usize {
        // Multiples of 1/φ and √2 − 1 modulo one: rationally independent, and each distributes consecutive
        // integers evenly.
        let hash = (x as u32).wrapping_mul(0x6A09_E667).wrapping_add((y as u32).wrapping_mul(0x9E37_79B1));
        self.base as usize + ((u64::from(hash) * u64::from(self.buckets)) >> 32) as usize
    }
}

/// The class with the smallest cell larger than the proxy and no finer than the spacing of floats at its
/// position: |x|/h < 2^(CELL_BITS + 1).
fn size_class(proxy: &Proxy) -> u8 {
    // Biased exponent: 2^(e − 127) ≤ |x| < 2^(e − 126), and 255 for ∞ and NaN.
    let exponent = |x: f32| (x.abs().to_bits() >> 23) as i32;
    let (min, max) = (proxy.aabb.min, proxy.aabb.max);
    let extent = (max - min).abs();
    let reach = min.abs().max(max.abs());
    let by_size = exponent(extent.x).max(exponent(extent.y)) + 1;
    let by_place = exponent(reach.x).max(exponent(reach.y)) - CELL_BITS;
    (by_size.max(by_place) / 2) as u8
}

impl HashGrid {
    /// See [`super::BroadPhase::pairs`].
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>, workers: &Workers) {
        self.fill(proxies);
        self.found.clear();
        for position in 0..self.entries.len() {
            self.search(position);
        }
        self.sorted.sort(proxies.len(), &self.found);
        merge(proxies.len(), std::iter::once(&self.sorted), out, workers);
    }

    /// Counting sort of the proxies by bucket.
    fn fill(&mut self, proxies: &[Proxy]) {
        let HashGrid { levels, starts, unsorted, entries, .. } = self;
        let mut population = [0u32; CLASSES];
        unsorted.clear();
        for (index, &proxy) in (0..).zip(proxies) {
            let level = size_class(&proxy);
            population[level as usize] += 1;
            unsorted.push(GridEntry { proxy, index, level, cell: [0; 2] });
        }
        levels.clear();
        let (mut level_of, mut base) = ([0; CLASSES], 0);
        for (class, &count) in population.iter().enumerate().filter(|(_, count)| **count > 0) {
            level_of[class] = levels.len() as u8;
            let inv_cell = if class == CLASSES - 1 { 0.0 } else { 2f64.powi(126 - 2 * class as i32) as f32 };
            let buckets = BUCKETS_PER_PROXY * count;
            levels.push(GridLevel { inv_cell, base, buckets });
            base += buckets;
        }
        starts.clear();
        starts.resize(base as usize + 2, 0);
        let bucket_of = |entry: &GridEntry| levels[entry.level as usize].bucket(entry.cell);
        for entry in unsorted.iter_mut() {
            entry.level = level_of[entry.level as usize];
            entry.cell = levels[entry.level as usize].cell(entry.proxy.aabb.min);
            starts[bucket_of(entry) + 2] += 1;
        }
        // After this sum, bucket b starts at starts[b + 1]. The scatter advances this entry to the end of the
        // bucket, where b + 1 starts.
        let mut sum = 0;
        for start in starts.iter_mut() {
            sum += *start;
            *start = sum;
        }
        entries.clone_from(unsorted);
        for entry in unsorted.iter() {
            let next = &mut starts[bucket_of(entry) + 1];
            entries[*next as usize] = *entry;
            *next += 1;
        }
    }

    /// Finds the partners of one entry: on its own level those after it in its cell and those in the cells to
    /// the right and above, so that each pair is found from one side; on coarser levels all.
    fn search(&mut self, position: usize) {
        let HashGrid { levels, starts, entries, found, .. } = self;
        let entry = &entries[position];
        let mut visit = |first: usize, level: usize, cell: [i32; 2]| {
            let bucket = levels[level].bucket(cell);
            let run = (starts[bucket] as usize).max(first)..starts[bucket + 1] as usize;
            // Cells that share a bucket are visited one by one.
            for other in entries[run].iter().filter(|other| other.cell == cell) {
                if entry.proxy.may_touch(&other.proxy) {
                    found.push([entry.index.min(other.index), entry.index.max(other.index)]);
                }
            }
        };
        for (i, level) in levels.iter().enumerate().skip(entry.level as usize) {
            let [x0, y0] = level.cell(entry.proxy.aabb.min);
            // A proxy smaller than a cell extends at most into the next one (the minimum only limits the
            // effect of NaN).
            let [x1, y1] = level.cell(entry.proxy.aabb.max);
            let (x1, y1) = (x1.min(x0 + 1), y1.min(y0 + 1));
            let is_own = i == entry.level as usize;
            for y in if is_own { y0..=y1 } else { y0 - 1..=y1 } {
                for x in if is_own && y == y0 { x0..=x1 } else { x0 - 1..=x1 } {
                    visit(if is_own && [x, y] == [x0, y0] { position + 1 } else { 0 }, i, [x, y]);
                }
            }
        }
    }
}
