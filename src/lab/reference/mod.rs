//! Exact and certified solutions of a contact problem.
//!
//! Reading order: [`problem`] states the problem, [`residual`] the law and its residual, [`joints`] those of
//! joints. [`stewart_trinkle`] solves small problems exactly by Lemke's method
//! ([`crate::engine::constraints::numerics::lemke`]). [`sweeps`], [`nncg`] and [`newton`], through
//! [`sparse`], solve large ones. [`certify`] accepts a solution only with a certificate. [`statics`] decides
//! without a time step whether rest is possible, through [`nnls`]. [`frozen`] stores problems in files,
//! [`gallery`] contains problems solved by hand, [`rates`] measures convergence in iterations and in the step
//! size, [`baseline`] that of Gauss–Seidel.
//!
//! The literature compares with PATH. On a linear complementarity problem PATH pivots along the path of one
//! covering vector, as Lemke's method does, so Lemke's method represents it. There is no interior-point
//! method: one was built, and it certified no problem that Newton's and Lemke's methods had left unsolved.
//!
//! Nothing here depends on the solvers of the simulation, so it can judge them. The exception is Lemke's
//! method, which is shared with `direct`; its results are certified.

pub mod baseline;
pub mod certify;
pub mod frozen;
pub mod gallery;
pub mod joints;
pub mod newton;
pub mod nncg;
pub mod nnls;
pub mod problem;
pub mod rates;
pub mod residual;
pub mod rows;
mod scale;
pub mod sparse;
pub mod statics;
pub mod stewart_trinkle;
pub mod sweeps;
pub mod target;
pub(crate) mod validate;

pub use problem::{ContactProblem, DPair, ProblemBody, ProblemContact, Velocity};
pub use rows::{BlockLaw, ProblemBlock, ProblemJoint, ProblemRow};
