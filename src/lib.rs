//! A SIMD structure-of-arrays 2D rigid-body laboratory: which contact solver, how many
//! iterations, how fast, and how wrong?
//!
//! # The pipeline
//!
//! ```text
//! scenes ──► bodies, shapes                          scenes, bodies, shapes
//!               │
//!               ▼  every step
//!            bounds ──► candidate pairs              broadphase
//!               │
//!               ▼
//!            manifolds with kept impulses            narrowphase, contacts
//!               │
//!               ▼
//!            colours: no body twice in one           coloring
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
//!            errors, times, tables                   metrics, study, report
//! ```
//!
//! # Reading order
//!
//! [`world`] is the step. [`solvers::pgs`] explains the method, [`constraints::sweep`] is
//! the kernel that all solvers share, [`lanes`] what it is made of. [`scenes`] says what is
//! simulated and what is known about it, [`metrics`] how wrong a run is.
//!
//! # Example
//!
//! ```
//! use simpulse::{scenes, solvers, world::Settings};
//!
//! let scene = scenes::load("stack:5")?.scene;
//! let mut world = scene.build(Settings::new(solvers::find("soft_step")?))?;
//! for _ in 0..60 {
//!     world.step().expect("a stack of five does not diverge");
//! }
//! assert_eq!(world.counts.contacts, 5);
//! # Ok::<(), simpulse::error::Error>(())
//! ```

pub mod advise;
pub mod bodies;
pub mod broadphase;
pub mod capture;
pub mod clock;
pub mod coloring;
pub mod commands;
pub mod constraints;
pub mod contacts;
pub mod converge;
pub mod error;
pub mod files;
pub mod lanes;
pub mod metrics;
pub mod narrowphase;
pub mod params;
pub mod profile;
pub mod report;
pub mod scenes;
pub mod shapes;
pub mod solvers;
pub mod study;
pub mod truth;
pub mod verify;
pub mod world;
