//! Lanes: the vector operations that kernels need, at widths 1, 4, 8 and 16.
//!
//! One trait, [`Lanes`], has exactly the operations that kernels use. A kernel is written once and compiled
//! at every width, with the same bits in each lane.
//!
//! Kernels gather and scatter by [`LaneIndex`], a set of indices with a checked bound; an index out of bounds
//! panics. The unsafe code for this is in `quads.rs` and `rows.rs`. Its soundness does not depend on
//! implementations of [`Lanes`].
//!
//! The target CPU of the build decides which instructions a width uses; [`native_width`] is the widest that
//! is not emulated.

mod aligned;
mod frame;
mod index;
mod quads;
mod rows;
mod scalar;
mod shared;
mod store;
mod unused;
mod vector;
mod wide_lanes;
mod width;

pub use aligned::{Block, LaneVec};
pub use frame::align_frame;
pub use index::{IndexList, Indices, LaneIndex, MOST_LANES, PickedIndices};
pub use quads::{Quad, prefetch, prefetch_quad, prefetch_records};
pub use rows::BodyRow;
pub use shared::{Shared, SharedRows};
pub use store::RowStore;
pub use unused::unused_cpu_features;
pub use vector::{FUSED, Lanes};
pub use width::{LaneWidth, native_width, target_features};
