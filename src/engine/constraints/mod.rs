//! Constraints: contacts as lane batches, and the passes from which solvers are built.
//!
//! Submodules, in reading order; each imports only from those before it:
//!
//! | module | contents |
//! |---|---|
//! | [`numerics`] | pure mathematics: matrices, complementarity problems, cones |
//! | [`records`] | storage of the numbers of each constraint; no arithmetic on bodies |
//! | [`kernels`] | passes over bodies and contacts, compiled per width and features |
//! | [`joints`] | joints as rows, defined once for all passes |
//! | [`vectors`] | a step's problem as λ, v and J |
//! | [`impacts`] | laws of impacts between bodies |
//! | [`step`] | [`Passes`]: the whole interface of a solver |

pub mod impacts;
pub mod joints;
pub mod kernels;
#[doc(hidden)]
pub mod numerics;
pub mod records;
pub mod step;
pub mod vectors;

pub use impacts::{ImpactLaw, Impacts};
pub use kernels::pass::{AnyPass, Pass, PassInput};
pub use kernels::position::PositionSweep;
pub use kernels::velocity::rules::{self, NormalRule, Rule};
pub use records::batches::Batches;
pub use records::features::{Features, Kernel, KernelFeatures, Layout, PartnerKind};
pub use records::kept;
pub use records::order::SweepOrder;
pub use records::point_vector::PointVector;
pub use step::{Passes, Schedule, Solver, StepInput, WorkCount, Workspace};
pub use vectors::system::System;
