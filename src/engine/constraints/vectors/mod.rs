//! A step's problem as vectors: impulses λ, velocities v and the Jacobian J.

pub mod blocks;
pub mod body_matrix;
pub mod conjugate;
pub(crate) mod law;
pub(crate) mod newton;
pub(crate) mod passes;
pub mod spectral;
pub mod system;
