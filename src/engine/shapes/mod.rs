//! Convex shapes in their body's frame: mass properties, bounds, validation.
//!
//! Every shape is a convex *core* (point, segment or polygon) grown by a *radius*. The constructors of
//! [`Shape`] are the only checked way to create one. Shapes that they accept never cause a NaN in later
//! computations.

mod check;
mod mass;
mod pose;
mod shape;

pub use check::{MAX_COORDINATE, MIN_LENGTH, MIN_RELATIVE_AREA, MIN_RELATIVE_TURN};
pub use mass::{MassProperties, combine};
pub use pose::{Aabb, Pose};
pub use shape::{Polygon, Shape};
