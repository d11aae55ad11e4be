//! Constraints: contacts as lane batches, and the passes that solvers are made of.
//!
//! Rooms, in the order in which to read them; each imports from those before it only:
//!
//! | room | what is in it |
//! |---|---|
//! | [`numerics`] | pure mathematics: matrices, complementarity problems, cones |
//! | [`records`] | where each number of each constraint is stored; no arithmetic on bodies |
//! | [`kernels`] | passes over bodies and contacts, compiled per width and features |
//! | [`joints`] | joints as rows, stated once for all passes |
//! | [`vectors`] | a step's problem as λ, v and J |
//! | [`impacts`] | what happens when bodies hit each other |
//! | [`step`] | [`Passes`]: all that a solver sees |

pub mod impacts;
pub mod joints;
pub mod kernels;
#[doc(hidden)]
pub mod numerics;
pub mod records;
pub mod step;
pub mod vectors;

pub use impacts::{ImpactLaw, Impacts};
pub use kernels::pass::{AnyPass, Pass, PassInput, PerLane};
pub use kernels::position::PositionSweep;
pub use kernels::velocity::rules::{self, NormalRule, Rule};
pub use records::batches::Batches;
pub use records::features::{Features, Kernel, KernelFeatures, Layout, OppositeKind};
pub use records::kept;
pub use records::order::SweepOrder;
pub use records::point_vector::PointVector;
pub(crate) use step::Spreading;
pub use step::{Passes, Schedule, Solver, StepInput, WorkCount, Workspace};
pub use vectors::system::System;
