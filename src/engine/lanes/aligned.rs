//! A growable array of `f32` with 64-byte alignment, castable to lanes of any width.

use bytemuck::{Pod, Zeroable};
use std::ops::{Deref, DerefMut};

/// Sixteen floats on a cache line.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Block(pub [f32; 16]);

/// `len` floats in 64-byte blocks; floats past `len` in the last block are zero.
#[derive(Clone, Debug, Default)]
pub struct LaneVec {
    blocks: Vec<Block>,
    len: usize,
}

impl LaneVec {
    /// Number of floats.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether the array is empty.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Appends one float.
    pub fn push(&mut self, value: f32) {
        if self.len == self.blocks.len() * 16 {
            self.blocks.push(Block::default());
        }
        self.blocks[self.len / 16].0[self.len % 16] = value;
        self.len += 1;
    }

    /// Sets the length. New floats are zero; capacity is kept.
    pub fn resize(&mut self, len: usize) {
        if len < self.len {
            self[len..].fill(0.0);
        }
        self.blocks.resize(len.div_ceil(16), Block::default());
        self.len = len;
    }

    /// The floats as lanes; the last vectors are padded with zeros.
    pub fn lanes<L: Pod>(&self) -> &[L] {
        bytemuck::cast_slice(&self.blocks)
    }

    /// The floats as lanes; the tail past `len` must stay zero.
    pub fn lanes_mut<L: Pod>(&mut self) -> &mut [L] {
        bytemuck::cast_slice_mut(&mut self.blocks)
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for LaneVec {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        self[..].serialize(to)
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for LaneVec {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut array = LaneVec::default();
        Vec::deserialize(from)?.into_iter().for_each(|value| array.push(value));
        Ok(array)
    }
}

impl Deref for LaneVec {
    type Target = [f32];
    fn deref(&self) -> &[f32] {
        &bytemuck::cast_slice(&self.blocks)[..self.len]
    }
}

impl DerefMut for LaneVec {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut bytemuck::cast_slice_mut(&mut self.blocks)[..self.len]
    }
}
