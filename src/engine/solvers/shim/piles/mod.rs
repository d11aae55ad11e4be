//! Piles: what bodies at rest need, and when it is searched.

mod equilibrium;
pub mod modes;
mod when;

pub(super) use when::Found;
