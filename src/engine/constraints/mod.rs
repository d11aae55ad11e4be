//! Constraints: contacts as lane batches, and the row arithmetic that solvers share.
//!
//! Reading order: [`needs`] (what is compiled in, where a record keeps what),
//! [`batches`] and [`assign`] (which contact stands in which lane), [`sweep`] (the kernel),
//! [`prepare`], [`restitution`], [`motion`], and [`problem`], which is all that a
//! solver sees.

pub mod assign;
pub mod batches;
pub mod features;
pub mod motion;
pub mod observe;
pub mod prepare;
pub mod problem;
pub mod restitution;
pub mod sweep;

pub use batches::Batches;
pub use features::{Features, Kernel, KernelFeatures, Layout, OppositeKind};
pub use problem::{Problem, StepInput, WorkCount, Workspace};
pub use sweep::NormalRule;
