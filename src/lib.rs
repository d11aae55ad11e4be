//! A SIMD structure-of-arrays 2D rigid-body laboratory for contact solvers.

pub mod bodies;
pub mod broadphase;
pub mod clock;
pub mod coloring;
pub mod constraints;
pub mod contacts;
pub mod error;
pub mod lanes;
pub mod metrics;
pub mod narrowphase;
pub mod params;
pub mod report;
pub mod scenes;
pub mod shapes;
pub mod solvers;
pub mod study;
pub mod world;
