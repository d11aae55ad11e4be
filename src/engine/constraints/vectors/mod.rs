//! A step's problem as vectors: impulses λ, velocities v and the Jacobian J.

pub(crate) mod passes;
pub mod system;
