//! The engine of simpulse as its own crate, so that its kernels are compiled once, independently of the
//! laboratory. `simpulse` re-exports its one module, [`engine`]; start there.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[path = "mod.rs"]
pub mod engine;
