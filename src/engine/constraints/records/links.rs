//! Rigid rows of joints that are links of chains, in lanes; see `constraints/joints/chains`.

use crate::lanes::held;
use bytemuck::Pod;
use wide::f32x8;

/// Links per group. Independent of the width of the step.
pub const LINK_LANES: usize = 8;

/// A joint that is a link of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChainLink {
    /// Its index among the joints of its type.
    pub joint: u32,
    /// Group and lane: [`LINK_LANES`] times the group, plus the lane.
    pub slot: u32,
    /// Whether the second of the joint's ends is body R, the one away from where the chain hangs.
    pub forward: bool,
}

/// How the errors of links are corrected.
#[derive(Clone, Copy, Debug)]
pub struct LinkRule {
    /// 1/h (1/s); 0 if errors are not corrected.
    pub inv_h: f32,
    /// Size of typical bodies (m).
    pub length_unit: f32,
}

/// Numbers of links: `stride` lane vectors per group.
#[derive(Clone, Debug, Default)]
pub struct LinkGroups<V> {
    stride: usize,
    values: Vec<V>,
}

/// Rows of all links. `[d_x, d_y, s_L, s_R, b]` per row, then `[m_L⁻¹, m_R⁻¹, I_L⁻¹, I_R⁻¹]` per link. The
/// right side is b = −(J v + C/h) in m/s or rad/s. Lanes without a link are 0.
pub type LinkRows = LinkGroups<f32x8>;

/// Impulses of all links, one lane vector per row (N·s or N·m·s).
pub type LinkImpulses = LinkGroups<f32x8>;

impl<V: Pod> LinkGroups<V> {
    /// Sets the numbers of `groups` groups, `stride` each, to zero.
    pub fn begin(&mut self, stride: usize, groups: usize) {
        self.stride = stride;
        self.values.clear();
        self.values.resize(groups * stride, V::zeroed());
    }

    /// Sets all numbers to zero.
    pub fn clear(&mut self) {
        self.values.fill(V::zeroed());
    }

    /// The numbers of a group. `[stride]`
    #[inline(always)]
    pub fn group(&self, group: usize) -> &[V] {
        &self.values[group * self.stride..][..self.stride]
    }

    /// As [`Self::group`], mutable.
    #[inline(always)]
    pub fn group_mut(&mut self, group: usize) -> &mut [V] {
        &mut self.values[group * self.stride..][..self.stride]
    }

    /// Bytes held.
    pub fn held_bytes(&self) -> usize {
        held(&self.values)
    }
}

impl LinkImpulses {
    /// Adds `more` to the impulses of a group.
    #[inline(always)]
    pub fn add(&mut self, group: usize, more: &[f32x8]) {
        self.group_mut(group).iter_mut().zip(more).for_each(|(sum, &more)| *sum += more);
    }
}
