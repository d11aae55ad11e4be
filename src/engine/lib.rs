//! The engine: advances bodies and their shapes one step at a time.
//!
//! ```
//! use simpulse_engine::{lanes, prelude::*};
//!
//! if let Some(line) = lanes::unused_cpu_features() {
//!     eprintln!("{line}");
//! }
//! let mut world = World::new(Settings::new(solvers::SOFT_STEP));
//! world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(50.0, 1.0)?))?;
//! let top = world.add_body(&BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::rectangle(0.5, 0.5)?))?;
//! for _ in 0..60 {
//!     world.step()?;
//! }
//! assert!((world.body(top)?.position()[1] - 0.5).abs() < 1e-3);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crate `simpulse` re-exports the modules of this one. Being its own crate, its kernels are
//! compiled once, independently of the laboratory.
#![doc = include_str!("README.md")]
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub use world::batch;

pub mod bodies;
pub mod broadphase;
pub mod clock;
#[doc(hidden)]
pub mod coloring;
pub mod constraints;
pub mod contacts;
pub mod continuous;
#[doc(hidden)]
pub mod disjoint;
pub mod error;
pub mod joints;
pub mod lanes;
#[doc(hidden)]
pub mod narrowphase;
pub mod params;
pub mod prelude;
pub mod shapes;
pub mod solvers;
#[doc(hidden)]
pub mod workers;
pub mod world;

/// What tests, benches and the laboratory of this repository reach into: kernels and their inputs, the
/// narrow phase, coloring, numerics, the clock of a step. None of it is part of the API: it may change or go in any
/// version. The same items are hidden from these pages at their own paths.
pub mod internal {
    pub use crate::clock::{Clock, timed, waited};
    pub use crate::constraints::impacts::{bias, restitution};
    pub use crate::constraints::kernels::{motion, observe, prepare};
    pub use crate::constraints::numerics;
    pub use crate::constraints::records::{bounces, graph};
    pub use crate::constraints::step::assign;
    pub use crate::contacts::quad;
    pub use crate::continuous::{Continuous, EachJoined, Moving, Near};
    pub use crate::solvers::sap::convex;
    pub use crate::{coloring, disjoint, narrowphase};
}
