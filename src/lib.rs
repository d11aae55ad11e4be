//! A SIMD structure-of-arrays 2D rigid-body laboratory for contact solvers.

pub mod contacts;
pub mod error;
pub mod params;
pub mod shapes;
