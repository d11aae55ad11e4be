//! Lanes: the vector operations that kernels need, at widths 1, 4, 8 and 16.
//!
//! One trait, [`Lanes`], holds what the kernels use and nothing else, so that a kernel is written
//! once and compiled at every width, with the same bits lane by lane.
//!
//! Kernels gather and scatter by [`LaneIndex`], indices with a bound, and no index of theirs is out of
//! place: it panics instead. What is unsafe in that is in `quads.rs` and `rows.rs`, and nothing of
//! it depends on who implements [`Lanes`].
//!
//! Which instructions a width becomes is decided at build time by the target
//! CPU; [`native_width`] tells the widest that is not emulated.

mod aligned;
mod counted;
mod frame;
mod index;
mod quads;
mod rows;
mod scalar;
mod store;
mod unused;
mod vector;
mod wide_lanes;
mod width;

pub use aligned::{Block, LaneVec, held};
pub use counted::{Counted, Operations};
pub use frame::align_frame;
pub use index::{IndexList, Indices, LaneIndex, MOST_LANES};
pub use quads::{Quad, prefetch, prefetch_quad, prefetch_records};
pub use rows::BodyRow;
pub use store::{RowColumns, RowStore};
pub use unused::unused_cpu_features;
pub use vector::{FUSED, Lanes};
pub use width::{LaneWidth, native_width, target_features};
