//! The engine of simpulse as a crate of its own, so that its kernels are compiled once: not again
//! for the unit tests of the laboratory, nor after a change to it. `simpulse` re-exports the one
//! module, and its path is the same from every story.

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[path = "mod.rs"]
pub mod engine;
