//! A 2D rigid-body engine in SIMD lanes, and a laboratory that compares contact solvers: how many iterations
//! each needs, how fast it is, and how large its errors are.
//!
//! ```
//! use simpulse::prelude::*;
//!
//! let mut world = World::default();
//! world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(20.0, 1.0)?))?;
//! let ball = world.add_body(&BodyDef::dynamic([0.0, 3.0]).with(ShapeDef::circle(0.5)?))?;
//! for _ in 0..120 {
//!     world.step()?;
//! }
//! println!("{:?}", world.body(ball)?.position());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **As a library:** start with [`engine_guide`]: how to build for your CPU, which results are bit-identical, and
//! how to add, move, query and remove bodies. [`prelude`] has what most programs use. [`changelog`] lists changes.
//!
//! # Three layers
//!
//! ```text
//! cli       commands: arguments in, files and text out         (feature `cli`)
//!  │
//! lab       scenes, metrics, references, studies, reports      (feature `lab`)
//!  │
//! engine    shapes, contacts, batches, solvers, world          (always)
//! ```
//!
//! Imports point downward only. The engine alone depends on `wide`, `bytemuck` and `glam`;
//! `default-features = false` leaves just that.
//!
//! # The pipeline
//!
//! ```text
//! scenes ──► bodies, shapes                          lab::scenes, bodies, shapes
//!               │
//!               ▼  every step
//!            bounds ──► candidate pairs              broadphase
//!               │
//!               ▼
//!            manifolds with kept impulses            narrowphase, contacts
//!               │
//!               ▼
//!            colors: no body twice in one            coloring
//!               │
//!               ▼
//!            records: W contacts per vector          constraints, lanes
//!               │
//!               ▼
//!            a solver's schedule of passes           solvers
//!               │
//!               ▼
//!            impulses and poses written back         world
//!               │
//!               ▼
//!            errors, times, tables                   lab::{metrics, study, report}
//! ```
//!
//! # Reading order
//!
//! [`world`] is the step. [`solvers::pgs`] explains the method.
//! [`constraints::kernels::velocity::sweep`] is the kernel that solvers share, built on
//! [`lanes`].
//! `lab::scenes` has the scenes and their known values. `lab::metrics` measures errors.

// `println!` panics if the reader of the pipe is gone, so the program prints through `cli::output`.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[doc(inline)]
pub use simpulse_engine::*;

/// The engine as a whole, as the upper layers and the tests of this repository name it.
#[doc(hidden)]
pub use simpulse_engine as engine;

#[doc = include_str!("engine/README.md")]
pub mod engine_guide {}

#[cfg(feature = "lab")]
pub mod lab;

#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod cli;

#[doc = include_str!("CHANGELOG.md")]
pub mod changelog {}

/// Runs the README's program as a doctest.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
