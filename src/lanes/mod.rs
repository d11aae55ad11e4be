//! Lanes: the vector operations that kernels need, at widths 1, 4, 8 and 16.

mod aligned;

pub use aligned::LaneVec;

/// How many contacts one instruction processes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LaneWidth {
    /// Scalar code.
    W1,
    /// 128-bit lanes.
    W4,
    /// 256-bit lanes.
    W8,
    /// 512-bit lanes.
    W16,
}

impl LaneWidth {
    /// Every width, narrowest first.
    pub const ALL: [LaneWidth; 4] = [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8, LaneWidth::W16];

    /// The number of lanes.
    pub const fn lanes(self) -> usize {
        match self {
            LaneWidth::W1 => 1,
            LaneWidth::W4 => 4,
            LaneWidth::W8 => 8,
            LaneWidth::W16 => 16,
        }
    }

    /// The width with that many lanes, if there is one.
    pub fn from_lanes(lanes: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|w| w.lanes() == lanes)
    }
}
