//! A step's problem as vectors: impulses λ, velocities v and the Jacobian J.

pub mod body_space;
pub(crate) mod passes;
pub mod proximal;
pub mod system;
