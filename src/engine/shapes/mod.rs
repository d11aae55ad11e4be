//! Convex shapes in their body's frame: mass properties, bounds, validation.
//!
//! Every shape is a convex *core* (point, segment or polygon) grown by a
//! *radius*. The constructors of [`Shape`] are the only checked way in; what
//! they accept never makes the code behind them produce a NaN.

mod check;
mod mass;
mod pose;
mod shape;

pub use check::{MAX_COORDINATE, MIN_LENGTH, MIN_RELATIVE_AREA, MIN_RELATIVE_TURN};
pub use mass::{MassProperties, combine};
pub use pose::{Aabb, Pose};
pub use shape::{Polygon, Shape};
