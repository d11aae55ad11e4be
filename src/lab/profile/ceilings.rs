//! Limits of the machine: bytes per second from each level of cache, operations per second.
//!
//! Three loops measure one resource each, on one thread: *read* sums a buffer, *update* reads it and writes
//! it back, *multiply-add* keeps twelve independent chains in registers. The first two use the widest
//! available lanes, since they measure memory; the third uses the lane width of the run.

use crate::engine::lanes::{Block, LaneWidth, Lanes};
use crate::lab::study::sample::median;
use std::hint::black_box;
use std::time::{Duration, Instant};
use wide::{f32x4, f32x8, f32x16};

/// A level of the memory hierarchy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MemoryLevel {
    /// `L1`, `L2`, `L3`, `DRAM`
    pub name: String,
    /// Size of the buffer that measures it (bytes).
    pub bytes: usize,
}

/// Largest buffer (bytes): larger than any cache of a desktop, but small compared with its memory.
const LARGEST: usize = 256 << 20;

/// Default cache sizes if the system does not report them (bytes).
const USUAL: [(&str, usize); 3] = [("L1", 32 << 10), ("L2", 1 << 20), ("L3", 16 << 20)];

/// The caches of the first processor and the memory behind them, each with a working set that fits: half of a
/// cache, and four times the largest cache for memory.
pub fn levels() -> Vec<MemoryLevel> {
    let mut caches = system_caches();
    if caches.is_empty() {
        caches = USUAL.map(|(name, bytes)| (name.to_string(), bytes)).to_vec();
    }
    let last = caches.iter().map(|c| c.1).max().unwrap_or(0);
    let mut levels: Vec<MemoryLevel> = caches
        .into_iter()
        .map(|(name, bytes)| MemoryLevel { name, bytes: (bytes / 2).min(LARGEST / 2) })
        .collect();
    levels.push(MemoryLevel { name: "DRAM".into(), bytes: (4 * last).min(LARGEST) });
    levels
}

/// Data and unified caches as reported by Linux; empty on other systems.
fn system_caches() -> Vec<(String, usize)> {
    let mut caches = Vec::new();
    for index in 0..8 {
        let read = |name: &str| {
            let path = format!("/sys/devices/system/cpu/cpu0/cache/index{index}/{name}");
            std::fs::read_to_string(path).ok().map(|text| text.trim().to_string())
        };
        let (Some(level), Some(kind), Some(size)) = (read("level"), read("type"), read("size")) else {
            break;
        };
        if kind != "Instruction"
            && let Some(bytes) = parse_size(&size)
        {
            caches.push((format!("L{level}"), bytes));
        }
    }
    caches.sort_by_key(|c| c.1);
    caches
}

/// Parses `48K` or `16M` (bytes).
fn parse_size(text: &str) -> Option<usize> {
    let split = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let scale = match unit {
        "" => 1,
        "K" => 1 << 10,
        "M" => 1 << 20,
        "G" => 1 << 30,
        _ => return None,
    };
    number.parse::<usize>().ok()?.checked_mul(scale).filter(|&bytes| bytes > 0)
}

/// A buffer on which bandwidth is measured.
pub struct Buffer {
    blocks: Vec<Block>,
}

impl Buffer {
    /// A buffer at least as large as every level and `bytes`, but at most a quarter gigabyte.
    pub fn new(levels: &[MemoryLevel], bytes: usize) -> Self {
        let most = levels.iter().map(|l| l.bytes).max().unwrap_or(0).max(bytes);
        // This touches every page, and no number is subnormal.
        Buffer { blocks: vec![Block([1.0; 16]); blocks_of(most.min(LARGEST))] }
    }

    fn part(&mut self, bytes: usize) -> &mut [Block] {
        let count = blocks_of(bytes).clamp(1, self.blocks.len());
        &mut self.blocks[..count]
    }

    /// Bytes read per nanosecond (GB/s) from a working set of `bytes`, in about `time`.
    pub fn read(&mut self, bytes: usize, time: Duration) -> f64 {
        let part = &*self.part(bytes);
        // Which of the two is faster depends on the level: few streams suit the prefetcher, while close to
        // the core the latency of additions is the limit.
        let few = repeated(time / 2, || {
            black_box(read::<2>(black_box(part)));
        });
        let many = repeated(time / 2, || {
            black_box(read::<8>(black_box(part)));
        });
        size_of_val(part) as f64 / few.min(many)
    }

    /// Bytes read and written per nanosecond (GB/s), in place, in a working set of `bytes`.
    pub fn update(&mut self, bytes: usize, time: Duration) -> f64 {
        let part = self.part(bytes);
        let size = 2 * size_of_val(part);
        let ns = repeated(time, || update(black_box(part)));
        size as f64 / ns
    }
}

/// Read bandwidth as a function of the size of the working set.
pub struct ReadCurve {
    buffer: Buffer,
    /// Sizes (bytes), each twice the previous one, with the measured rates (GB/s).
    sizes: Vec<(usize, Vec<f64>)>,
}

impl ReadCurve {
    /// For sizes from 16 KiB up to `largest`, at most a quarter gigabyte.
    pub fn new(largest: usize) -> Self {
        let buffer = Buffer::new(&[], largest.max(16 << 10));
        let most = size_of_val(buffer.blocks.as_slice());
        let doubled = std::iter::successors(Some(16 << 10), |&bytes: &usize| bytes.checked_mul(2));
        ReadCurve {
            buffer,
            sizes: doubled.take_while(|&bytes| bytes <= most).map(|b| (b, Vec::new())).collect(),
        }
    }

    /// Measures every size once more.
    pub fn sample(&mut self, time: Duration) {
        for (bytes, rates) in &mut self.sizes {
            rates.push(self.buffer.read(*bytes, time));
        }
    }

    /// Rate at which a working set of `bytes` is read (GB/s): medians, interpolated on the logarithm of the
    /// size, and never faster than a smaller set.
    pub fn at(&self, bytes: usize) -> f64 {
        let mut least = f64::INFINITY;
        let rates: Vec<(f64, f64)> = self
            .sizes
            .iter()
            .map(|(size, rates)| {
                least = least.min(median(rates));
                ((*size as f64).ln(), least)
            })
            .collect();
        let x = (bytes.max(1) as f64).ln();
        let after = rates.partition_point(|r| r.0 < x);
        match (after.checked_sub(1).and_then(|i| rates.get(i)), rates.get(after)) {
            (Some(a), Some(b)) => a.1 + (x - a.0) / (b.0 - a.0) * (b.1 - a.1),
            (Some(one), None) | (None, Some(one)) => one.1,
            (None, None) => f64::NAN,
        }
    }
}

fn blocks_of(bytes: usize) -> usize {
    bytes.div_ceil(size_of::<Block>())
}

/// Floating-point operations per nanosecond (GFLOP/s) of multiply-adds at this width.
pub fn multiply_adds(width: LaneWidth, time: Duration) -> f64 {
    match width {
        LaneWidth::W1 => multiply_adds_of::<f32>(time),
        LaneWidth::W4 => multiply_adds_of::<f32x4>(time),
        LaneWidth::W8 => multiply_adds_of::<f32x8>(time),
        LaneWidth::W16 => multiply_adds_of::<f32x16>(time),
    }
}

/// Independent chains: latency 4 × 2 units needs 8; twice as many would not fit in the registers at any
/// width.
const CHAINS: usize = 12;
/// Operations of each chain per call.
const LINKS: usize = 256;

fn multiply_adds_of<L: Lanes>(time: Duration) -> f64 {
    let ns = repeated(time, || {
        black_box(chains::<L>(black_box(L::splat(0.5))));
    });
    (2 * L::WIDTH * CHAINS * LINKS) as f64 / ns
}

/// x ← x/2 + 1/2 tends to one; it neither overflows nor becomes subnormal.
#[inline(never)]
fn chains<L: Lanes>(half: L) -> [L; CHAINS] {
    let mut x = [L::splat(1.5); CHAINS];
    for _ in 0..LINKS {
        for chain in &mut x {
            *chain = chain.mul_add(half, half);
        }
    }
    x
}

#[inline(never)]
fn read<const SUMS: usize>(blocks: &[Block]) -> f32x16 {
    let vectors: &[f32x16] = bytemuck::cast_slice(blocks);
    let mut sums = [f32x16::splat(0.0); SUMS];
    let (chunks, rest) = vectors.as_chunks::<SUMS>();
    for chunk in chunks {
        for (sum, vector) in sums.iter_mut().zip(chunk) {
            *sum += *vector;
        }
    }
    rest.iter().chain(&sums).fold(f32x16::splat(0.0), |sum, vector| sum + *vector)
}

/// Changes signs, which needs no floating-point arithmetic.
#[inline(never)]
fn update(blocks: &mut [Block]) {
    let vectors: &mut [f32x16] = bytemuck::cast_slice_mut(blocks);
    for vector in vectors {
        *vector = -*vector;
    }
}

/// Time of one call (ns): the mean of as many calls as fit into `time`, after two calls to estimate that
/// number.
fn repeated(time: Duration, mut call: impl FnMut()) -> f64 {
    let mut once = |times: u32| {
        let start = Instant::now();
        (0..times).for_each(|_| call());
        start.elapsed()
    };
    let first = once(1).min(once(1)).as_nanos().max(20) as f64;
    let times = (time.as_nanos() as f64 / first).clamp(1.0, 1e6) as u32;
    (once(times).as_nanos() as f64 / f64::from(times)).max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_as_the_system_writes_them() {
        assert_eq!(
            ["48K", "1024K", "32M", "512", "", "K", "0K", "3T"].map(parse_size),
            [Some(49152), Some(1 << 20), Some(32 << 20), Some(512), None, None, None, None]
        );
    }

    #[test]
    fn levels_grow_and_end_in_memory() {
        let levels = levels();
        assert!(levels.len() >= 2 && levels.last().unwrap().name == "DRAM");
        assert!(levels.windows(2).all(|w| w[0].bytes <= w[1].bytes), "{levels:?}");
        assert!(levels.iter().all(|l| l.bytes <= LARGEST));
    }

    #[test]
    fn a_curve_is_interpolated_and_never_rises() {
        let mut curve = ReadCurve::new(70 << 10);
        assert_eq!(curve.sizes.iter().map(|s| s.0 >> 10).collect::<Vec<_>>(), [16, 32, 64]);
        curve.sizes[0].1 = vec![80.0, 100.0, 900.0];
        curve.sizes[1].1 = vec![50.0];
        curve.sizes[2].1 = vec![70.0];
        let at = |kib: f64| curve.at((kib * 1024.0) as usize);
        assert_eq!([at(1.0), at(16.0), at(32.0), at(64.0), at(1e6)], [100.0, 100.0, 50.0, 50.0, 50.0]);
        assert!((at(16.0 * 2.0_f64.sqrt()) - 75.0).abs() < 0.01);
        assert!(ReadCurve::new(0).at(0).is_nan() || ReadCurve::new(0).at(0) >= 0.0);
    }

    #[test]
    fn loops_do_what_they_are_timed_for() {
        let mut buffer = Buffer { blocks: vec![Block([1.0; 16]); 13] };
        assert_eq!(read::<8>(&buffer.blocks).to_array(), [13.0; 16]);
        update(buffer.part(64 * 2));
        assert_eq!(read::<2>(&buffer.blocks).to_array(), [9.0; 16]);
        // More than the buffer holds: all of it.
        assert_eq!(buffer.part(usize::MAX / 2).len(), 13);
        assert!(chains(0.5_f32).iter().all(|&x| x == 1.0));
        let rates = [
            buffer.read(64, Duration::ZERO),
            buffer.update(64, Duration::ZERO),
            multiply_adds(LaneWidth::W4, Duration::ZERO),
        ];
        assert!(rates.iter().all(|r| r.is_finite() && *r > 0.0));
    }
}
