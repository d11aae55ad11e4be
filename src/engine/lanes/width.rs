//! Lane widths, and the native width of the build.

/// Number of contacts that one instruction processes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LaneWidth {
    /// Scalar code.
    #[default]
    W1,
    /// 128-bit lanes.
    W4,
    /// 256-bit lanes.
    W8,
    /// 512-bit lanes.
    W16,
}

impl LaneWidth {
    /// Every width of this build, narrowest first: 16 lanes only with instructions for them or with the
    /// feature `emulated`, since they are slower than 8 otherwise.
    #[cfg(any(target_feature = "avx512f", feature = "emulated"))]
    pub const ALL: [LaneWidth; 4] = [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8, LaneWidth::W16];

    /// Every width of this build, narrowest first. 16 lanes need AVX-512 or the feature `emulated`.
    #[cfg(not(any(target_feature = "avx512f", feature = "emulated")))]
    pub const ALL: [LaneWidth; 3] = [LaneWidth::W1, LaneWidth::W4, LaneWidth::W8];

    /// The widest of [`Self::ALL`].
    pub const WIDEST: LaneWidth = Self::ALL[Self::ALL.len() - 1];

    /// The number of lanes.
    pub const fn lanes(self) -> usize {
        match self {
            LaneWidth::W1 => 1,
            LaneWidth::W4 => 4,
            LaneWidth::W8 => 8,
            LaneWidth::W16 => 16,
        }
    }

    /// The width with this many lanes, if any, whether or not this build has it.
    pub fn from_lanes(lanes: usize) -> Option<Self> {
        [Self::W1, Self::W4, Self::W8, Self::W16].into_iter().find(|w| w.lanes() == lanes)
    }
}

/// The widest lanes with native instructions in this build; wider ones are emulated.
pub const fn native_width() -> LaneWidth {
    if cfg!(target_feature = "avx512f") {
        LaneWidth::W16
    } else if cfg!(target_feature = "avx") {
        LaneWidth::W8
    } else if cfg!(any(target_feature = "sse2", target_feature = "neon", target_feature = "simd128")) {
        LaneWidth::W4
    } else {
        LaneWidth::W1
    }
}

/// Name of the vector extensions that this build uses, for records.
pub fn target_features() -> &'static str {
    if cfg!(target_feature = "avx512f") {
        "avx512f+fma"
    } else if cfg!(all(target_feature = "avx2", target_feature = "fma")) {
        "avx2+fma"
    } else if cfg!(target_feature = "avx") {
        "avx"
    } else if cfg!(target_feature = "sse2") {
        "sse2"
    } else if cfg!(target_feature = "neon") {
        "neon"
    } else {
        "scalar"
    }
}
