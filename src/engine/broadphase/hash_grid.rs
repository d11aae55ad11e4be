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
//! **Buckets.** Sixteen neighboring cells of a row form a block, and blocks are hashed. A row of two or three
//! cells is then one contiguous run of entries, or two if it crosses a block. Hashing whole rows would always
//! give one run, but proxies spaced by the table's size would all share a bucket.
//!
//! **Source:** cells hashed into a table, Teschner et al. 2003
//! (`teschner2003`); a grid per size class, Mirtich 1996 (`mirtich1996`).

use super::Proxy;
use super::sort::PairSort;
use crate::lanes::held;
use glam::Vec2;
use std::ops::Range;

/// Cells in a block: large enough that a run seldom crosses a block. At least 4, so that the cells left open
/// by (1) never share a bucket.
const BLOCK: usize = 1 << BLOCK_BITS;
const BLOCK_BITS: u32 = 4;

/// Buckets per proxy of a level. More buckets mean fewer collisions but a longer prefix sum.
const BUCKETS_PER_PROXY: usize = 2;

/// Levels with at most this many proxies, such as the ground and walls, are tested proxy by proxy, without
/// their grid.
const SCAN: usize = 8;

/// A cell index has at most this many bits (and sign), so that it is exact in `f32`.
const CELL_BITS: i32 = 22;

/// Cell sizes 2^(k − 127) for k in 0..CLASSES; the last one means "infinite".
const CLASSES: usize = 257;

/// Finds candidate pairs. Buffers are reused between calls.
#[derive(Clone, Debug, Default)]
pub struct HashGrid {
    /// Finest first.
    levels: Vec<GridLevel>,
    /// Size class of each proxy, `[proxies]`.
    class: Vec<u16>,
    /// Bucket of each proxy, `[proxies]`.
    bucket: Vec<u32>,
    /// First entry of each bucket, `[buckets + 2]`.
    starts: Vec<u32>,
    /// Proxies by bucket: a run of cells is a contiguous range.
    entries: Vec<GridEntry>,
    /// Pairs in the order found; only a prefix is used.
    found: Vec<[u32; 2]>,
    sort: PairSort,
}

#[derive(Clone, Copy, Debug)]
struct GridEntry {
    proxy: Proxy,
    index: u32,
}

#[derive(Clone, Debug)]
struct GridLevel {
    /// 1/h, zero for the infinite cell (1/m).
    inv_cell: f32,
    /// First bucket of the level.
    base: u32,
    /// Number of blocks of the level.
    blocks: u32,
    /// Entries of the level.
    entries: Range<usize>,
}

impl GridLevel {
    /// Index of the cell that contains coordinate `x`.
    #[inline]
    fn cell(&self, x: f32) -> i32 {
        // NaN becomes 0. |x|/h < 2^23 by the choice of class.
        (x * self.inv_cell).floor() as i32
    }

    /// Row of the cell that contains the proxy.
    #[inline]
    fn row(&self, proxy: &Proxy) -> i32 {
        self.cell(proxy.aabb.min.y)
    }

    /// Cells of the two corners. A proxy smaller than a cell extends at most into the next cell (the minimum
    /// only limits the effect of NaN).
    #[inline]
    fn cells(&self, proxy: &Proxy) -> ([i32; 2], [i32; 2]) {
        let Vec2 { x, y } = proxy.aabb.min;
        let low = [self.cell(x), self.cell(y)];
        let Vec2 { x, y } = proxy.aabb.max;
        (low, [self.cell(x).min(low[0] + 1), self.cell(y).min(low[1] + 1)])
    }

    /// Bucket of cell (x, y).
    #[inline]
    fn bucket(&self, x: i32, y: i32) -> usize {
        // Multiples of 1/φ and √2 − 1 modulo one: rationally independent, and each distributes consecutive
        // integers evenly.
        let block = ((x >> BLOCK_BITS) as u32)
            .wrapping_mul(0x6A09_E667)
            .wrapping_add((y as u32).wrapping_mul(0x9E37_79B1));
        let slot = (u64::from(block) * u64::from(self.blocks)) >> 32;
        self.base as usize + slot as usize * BLOCK + offset(x)
    }
}

/// Index of column x within its block.
#[inline]
fn offset(x: i32) -> usize {
    x as usize % BLOCK
}

/// k such that the cell size h = 2^(k − 127) is larger than the proxy and no finer than the spacing of floats
/// at its position: |x|/h < 2^(CELL_BITS + 1).
fn size_class(proxy: &Proxy) -> u16 {
    // Biased exponent: 2^(e − 127) ≤ |x| < 2^(e − 126), and 255 for ∞ and NaN.
    let exponent = |x: f32| (x.abs().to_bits() >> 23) as i32;
    let (min, max) = (proxy.aabb.min, proxy.aabb.max);
    let extent = (max - min).abs();
    let reach = min.abs().max(max.abs());
    let by_size = exponent(extent.x).max(exponent(extent.y)) + 1;
    let by_place = exponent(reach.x).max(exponent(reach.y)) - CELL_BITS;
    by_size.max(by_place) as u16
}

impl HashGrid {
    /// Allocated bytes.
    pub fn held_bytes(&self) -> usize {
        self.bytes() + held(&self.found)
    }

    /// An empty grid.
    pub fn new() -> Self {
        Self::default()
    }

    /// See [`super::BroadPhase::pairs`].
    pub fn pairs(&mut self, proxies: &[Proxy], out: &mut Vec<[u32; 2]>) {
        self.fill(proxies);
        let found = self.search();
        self.sort.sort(proxies.len(), &self.found[..found], out);
    }

    /// Bytes of memory that depend on the proxies but not on the pairs: at most 64 per proxy plus 16 KiB, on
    /// a grid that has not shrunk.
    pub fn bytes(&self) -> usize {
        self.levels.capacity() * size_of::<GridLevel>()
            + self.class.capacity() * size_of::<u16>()
            + (self.bucket.capacity() + self.starts.capacity()) * size_of::<u32>()
            + self.sort.bytes()
            + self.entries.capacity() * size_of::<GridEntry>()
    }

    /// Counting sort of the proxies by bucket.
    fn fill(&mut self, proxies: &[Proxy]) {
        let mut population = [0u32; CLASSES];
        self.class.clear();
        self.class.extend(proxies.iter().map(size_class));
        for &class in &self.class {
            population[class as usize] += 1;
        }
        let level_of = self.cut_levels(&population);

        let buckets: usize = self.levels.iter().map(|l| l.blocks as usize * BLOCK).sum();
        self.starts.clear();
        self.starts.resize(buckets + 2, 0);
        self.bucket.clear();
        for (proxy, &class) in proxies.iter().zip(&self.class) {
            let level = &self.levels[level_of[class as usize] as usize];
            let Vec2 { x, y } = proxy.aabb.min;
            let bucket = level.bucket(level.cell(x), level.cell(y));
            self.bucket.push(bucket as u32);
            self.starts[bucket + 2] += 1;
        }
        // After this sum, bucket b starts at starts[b + 1]. The scatter advances this entry to the end of the
        // bucket, where b + 1 starts.
        let mut sum = 0;
        for start in &mut self.starts {
            sum += *start;
            *start = sum;
        }
        let Some(&proxy) = proxies.first() else {
            self.entries.clear();
            return;
        };
        self.entries.resize(proxies.len(), GridEntry { proxy, index: 0 });
        for (index, (&proxy, &bucket)) in proxies.iter().zip(&self.bucket).enumerate() {
            let next = &mut self.starts[bucket as usize + 1];
            self.entries[*next as usize] = GridEntry { proxy, index: index as u32 };
            *next += 1;
        }
    }

    /// Groups size classes into levels, finest first; returns the level of each class.
    fn cut_levels(&mut self, population: &[u32; CLASSES]) -> [u8; CLASSES] {
        self.levels.clear();
        let mut level_of = [0; CLASSES];
        let (mut base, mut first) = (0, 0);
        let mut class = 0;
        while class < CLASSES {
            if population[class] == 0 {
                class += 1;
                continue;
            }
            let finer = class;
            let coarser = if class + 1 < CLASSES && population[class + 1] > 0 { class + 1 } else { class };
            let count: usize = population[finer..=coarser].iter().map(|&n| n as usize).sum();
            let blocks = (count * BUCKETS_PER_PROXY).div_ceil(BLOCK);
            let inv_cell = if coarser == CLASSES - 1 { 0.0 } else { 2f64.powi(127 - coarser as i32) as f32 };
            level_of[finer..=coarser].fill(self.levels.len() as u8);
            self.levels.push(GridLevel {
                inv_cell,
                base,
                blocks: blocks as u32,
                entries: first..first + count,
            });
            base += (blocks * BLOCK) as u32;
            first += count;
            class = coarser + 1;
        }
        level_of
    }

    /// Finds every candidate pair once; returns their number in `found`.
    fn search(&mut self) -> usize {
        let mut search =
            GridSearch { starts: &self.starts, entries: &self.entries, found: &mut self.found, len: 0 };
        for (i, level) in self.levels.iter().enumerate() {
            for position in level.entries.clone() {
                let entry = self.entries[position];
                // On its own level a proxy is tested only against cells to the right and above: later entries
                // of its cell, the next cell of its row, and the row above. Each pair is thus found from
                // exactly one side.
                let ([x0, y0], [x1, y1]) = level.cells(&entry.proxy);
                let crosses = offset(x1) < offset(x0);
                let cell = level.bucket(x0, y0);
                let last = if crosses { cell } else { cell + offset(x1) - offset(x0) };
                let end = self.starts[last + 1] as usize;
                search.run(&entry, position + 1..end, |other| level.row(other) == y0);
                if crosses {
                    search.row(&entry, level, y0, x1, x1);
                }
                if y1 > y0 {
                    search.row(&entry, level, y1, x0 - 1, x1);
                }
                for coarser in &self.levels[i + 1..] {
                    if coarser.entries.len() <= SCAN {
                        search.run(&entry, coarser.entries.clone(), |_| true);
                        continue;
                    }
                    let ([x0, y0], [x1, y1]) = coarser.cells(&entry.proxy);
                    for y in y0 - 1..=y1 {
                        search.row(&entry, coarser, y, x0 - 1, x1);
                    }
                }
            }
        }
        search.len
    }
}

struct GridSearch<'a> {
    starts: &'a [u32],
    entries: &'a [GridEntry],
    found: &'a mut Vec<[u32; 2]>,
    len: usize,
}

impl GridSearch<'_> {
    /// Tests `entry` against cells x0..=x1 of row y, at most three of them.
    ///
    /// Other rows may share the buckets; they are filtered out, and visited through their own. Cells of row y
    /// outside the range cannot appear: the cells left open by (1) are four neighbors at most, and those
    /// never share a bucket.
    #[inline]
    fn row(&mut self, entry: &GridEntry, level: &GridLevel, y: i32, x0: i32, x1: i32) {
        let (first, last) = (level.bucket(x0, y), level.bucket(x1, y));
        let (start, end) = (self.starts[first] as usize, self.starts[last + 1] as usize);
        let in_row = |other: &Proxy| level.row(other) == y;
        if offset(x0) <= offset(x1) {
            self.run(entry, start..end, in_row);
        } else {
            let block_end = self.starts[first - offset(x0) + BLOCK] as usize;
            let block_start = self.starts[last - offset(x1)] as usize;
            self.run(entry, start..block_end, in_row);
            self.run(entry, block_start..end, in_row);
        }
    }

    /// Tests `entry` against a run of entries.
    #[inline]
    fn run(&mut self, entry: &GridEntry, run: Range<usize>, accept: impl Fn(&Proxy) -> bool) {
        let run = &self.entries[run];
        if self.found.len() < self.len + run.len() {
            self.found.resize((self.len + run.len()).max(2 * self.found.len()), [0; 2]);
        }
        // Write first, then keep or discard: branch-free, see `Proxy::may_touch`.
        let free = &mut self.found[self.len..self.len + run.len()];
        let mut hits = 0;
        for other in run {
            free[hits] = [entry.index.min(other.index), entry.index.max(other.index)];
            hits += usize::from(entry.proxy.may_touch(&other.proxy) & accept(&other.proxy));
        }
        self.len += hits;
    }
}
