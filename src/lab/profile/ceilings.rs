//! Limits of the machine: bytes per second read from a working set, operations per second.
//!
//! Two loops measure one resource each, on one thread: *read* sums a buffer in the widest available lanes,
//! *multiply-add* keeps twelve independent chains in registers at the lane width of the run.

use crate::engine::lanes::{Block, LaneWidth, Lanes};
use std::hint::black_box;
use std::time::{Duration, Instant};
use wide::{f32x4, f32x8, f32x16};

/// Largest buffer (bytes): larger than any cache of a desktop, but small compared with its memory.
const LARGEST: usize = 256 << 20;

/// A buffer on which bandwidth is measured.
pub struct Buffer {
    blocks: Vec<Block>,
}

impl Buffer {
    /// A buffer of `bytes`, but at most a quarter gigabyte.
    pub fn new(bytes: usize) -> Self {
        // This touches every page, and no number is subnormal.
        Buffer { blocks: vec![Block([1.0; 16]); blocks_of(bytes.min(LARGEST))] }
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
    fn loops_do_what_they_are_timed_for() {
        let mut buffer = Buffer { blocks: vec![Block([1.0; 16]); 13] };
        assert_eq!(read::<8>(&buffer.blocks).to_array(), [13.0; 16]);
        // More than the buffer holds: all of it.
        assert_eq!(buffer.part(usize::MAX / 2).len(), 13);
        assert!(chains(0.5_f32).iter().all(|&x| x == 1.0));
        let rates = [buffer.read(64, Duration::ZERO), multiply_adds(LaneWidth::W4, Duration::ZERO)];
        assert!(rates.iter().all(|r| r.is_finite() && *r > 0.0));
    }
}
