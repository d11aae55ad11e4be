//! Sixteen boxes that are tested at once.

use crate::lanes::Block;
use wide::f32x16;

/// Number of children of a node.
pub const FAN: usize = 1 << BITS_OF_FAN;
/// Binary logarithm of [`FAN`].
pub const BITS_OF_FAN: usize = 4;

/// Sixteen boxes. Lanes without a box hold NaN, which overlaps nothing.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// min x, min y, max x, max y.
    pub sides: [Block; 4],
}

impl Node {
    /// A node without boxes.
    pub const EMPTY: Node = Node { sides: [Block([f32::NAN; FAN]); 4] };

    /// Sets the box of a lane. A box with a NaN counts as no box.
    #[inline]
    pub fn set(&mut self, lane: usize, sides: [f32; 4]) {
        let sides = if sides.iter().any(|side| side.is_nan()) { [f32::NAN; 4] } else { sides };
        for (side, value) in self.sides.iter_mut().zip(sides) {
            side.0[lane] = value;
        }
    }

    /// Bit mask of the lanes whose boxes overlap the query's (closed).
    #[inline]
    pub fn hits(&self, query: &[f32x16; 4]) -> u32 {
        let [min_x, min_y, max_x, max_y] = self.sides.map(|side| f32x16::new(side.0));
        let x = min_x.simd_le(query[2]) & query[0].simd_le(max_x);
        let y = min_y.simd_le(query[3]) & query[1].simd_le(max_y);
        (x & y).to_bitmask() & 0xFFFF
    }

    /// The box of a lane, copied to all lanes.
    #[inline]
    pub fn query(&self, lane: usize) -> [f32x16; 4] {
        [0, 1, 2, 3].map(|side: usize| f32x16::splat(self.sides[side].0[lane]))
    }

    /// Bounds of all lanes. Lanes without a box are ignored, since the minimum of a number and NaN is the
    /// number.
    #[inline]
    pub fn bounds(&self) -> [f32; 4] {
        let fold = |side: &Block, pick: fn(f32, f32) -> f32| {
            let mut v = side.0;
            for half in [8, 4, 2, 1] {
                for i in 0..half {
                    v[i] = pick(v[i], v[i + half]);
                }
            }
            v[0]
        };
        let [a, b, c, d] = &self.sides;
        [fold(a, f32::min), fold(b, f32::min), fold(c, f32::max), fold(d, f32::max)]
    }
}
