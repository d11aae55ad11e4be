//! Rigid rows of joints that are links of chains, in lanes; see `constraints/joints/chains`.

use crate::engine::lanes::held;
use wide::{f32x8, f64x8};

/// Links that are worked on together: the same at any width of the step.
pub const LINK_LANES: usize = 8;

/// A joint that is a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChainLink {
    /// Its number in its type.
    pub joint: u32,
    /// Group and lane: [`LINK_LANES`] times the group, plus the lane.
    pub slot: u32,
    /// The second of the joint's ends is the body away from where the chain hangs.
    pub forward: bool,
}

/// The rows of all links, group by group. Of a lane without a link all is 0.
#[derive(Clone, Debug, Default)]
pub struct LinkRows {
    size: usize,
    numbers: Vec<f32x8>,
}

impl LinkRows {
    /// Links of `size` rows at most, in so many groups.
    pub fn begin(&mut self, size: usize, groups: usize) {
        self.size = size;
        self.numbers.clear();
        self.numbers.resize(groups * self.stride(), f32x8::ZERO);
    }

    fn stride(&self) -> usize {
        5 * self.size + 4
    }

    /// Rows of the largest link.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Numbers of a group: for each row `[d_x, d_y, s_L, s_R, b]`, then `[m_L⁻¹, m_R⁻¹, I_L⁻¹, I_R⁻¹]`. The right side b = −(J v + C/h)
    /// in m/s or rad/s.
    #[inline(always)]
    pub fn group(&self, group: usize) -> &[f32x8] {
        &self.numbers[group * self.stride()..][..self.stride()]
    }

    /// As [`Self::group`].
    #[inline(always)]
    pub fn group_mut(&mut self, group: usize) -> &mut [f32x8] {
        let stride = self.stride();
        &mut self.numbers[group * stride..][..stride]
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.numbers)
    }
}

/// Impulses of all links, group by group, one lane vector per row (N·s or N·m·s).
#[derive(Clone, Debug, Default)]
pub struct LinkImpulses {
    size: usize,
    values: Vec<f64x8>,
}

impl LinkImpulses {
    /// Zeros of links of `size` rows at most, in so many groups.
    pub fn begin(&mut self, size: usize, groups: usize) {
        self.size = size;
        self.values.clear();
        self.values.resize(groups * size, f64x8::ZERO);
    }

    /// Of a group. `[size]`
    #[inline(always)]
    pub fn group(&self, group: usize) -> &[f64x8] {
        &self.values[group * self.size..][..self.size]
    }

    /// As [`Self::group`].
    #[inline(always)]
    pub fn group_mut(&mut self, group: usize) -> &mut [f64x8] {
        &mut self.values[group * self.size..][..self.size]
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.values)
    }
}
