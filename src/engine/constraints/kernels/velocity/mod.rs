//! Velocity sweeps (row by row, both points at once, or all contacts at once), and the rules that they solve.

pub mod block;
pub mod jacobi;
pub mod masses;
pub mod rules;
pub(crate) mod sticky;
pub mod sweep;
pub mod warm_start;
