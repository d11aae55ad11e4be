//! A 2D rigid-body engine in SIMD lanes, and a laboratory that compares contact solvers: how many iterations
//! each needs, how fast it is, and how large its errors are.
//!
//! ```
//! use simpulse::engine::bodies::{BodyDef, ShapeDef};
//! use simpulse::engine::{solvers, world::{Settings, World}};
//!
//! let mut world = World::new(Settings::new(solvers::find("shim")?));
//! world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(20.0, 1.0)?))?;
//! let ball = world.add_body(&BodyDef::dynamic([0.0, 3.0]).with(ShapeDef::circle(0.5)?))?;
//! for _ in 0..120 {
//!     world.step()?;
//! }
//! println!("{:?}", world.bodies.origin(ball.index()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! **As a library:** start with [`engine`]: how to build for your CPU, which results are bit-identical, and
//! how to add, move, query and remove bodies. [`changelog`] lists changes.
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
//! Imports point downward only. [`engine`] alone depends on `wide`, `bytemuck` and `glam`;
//! `default-features = false` leaves just that.
//!
//! # The pipeline
//!
//! ```text
//! scenes ──► bodies, shapes                          lab::scenes, engine::{bodies, shapes}
//!               │
//!               ▼  every step
//!            bounds ──► candidate pairs              engine::broadphase
//!               │
//!               ▼
//!            manifolds with kept impulses            engine::{narrowphase, contacts}
//!               │
//!               ▼
//!            colors: no body twice in one            engine::coloring
//!               │
//!               ▼
//!            records: W contacts per vector          engine::{constraints, lanes}
//!               │
//!               ▼
//!            a solver's schedule of passes           engine::solvers
//!               │
//!               ▼
//!            impulses and poses written back         engine::world
//!               │
//!               ▼
//!            errors, times, tables                   lab::{metrics, study, report}
//! ```
//!
//! # Reading order
//!
//! [`engine::world`] is the step. [`engine::solvers::pgs`] explains the method.
//! [`engine::constraints::kernels::velocity::sweep`] is the kernel that solvers share, built on
//! [`engine::lanes`].
//! `lab::scenes` has the scenes and their known values. `lab::metrics` measures errors.

// `println!` panics if the reader of the pipe is gone, so the program prints through `cli::output`.
#![deny(clippy::print_stdout, clippy::print_stderr)]

#[doc(inline)]
pub use simpulse_engine as engine;

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
