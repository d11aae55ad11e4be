//! Exact and certified solutions of a contact problem.
//!
//! Reading order: [`problem`] states the problem, [`residual`] the law and its residual, [`joints`] those of joints. [`stewart_trinkle`] solves
//! small problems exactly by Lemke's method ([`crate::engine::constraints::numerics::lemke`]); [`sweeps`], [`nncg`]
//! and [`newton`], through [`sparse`], solve large ones. [`certify`] accepts a solution only with a certificate.
//! [`statics`] decides without a time step whether rest is possible, through [`nnls`]. [`frozen`] stores problems in
//! files, [`gallery`] has problems solved by hand, [`rates`] measures convergence in iterations and in the step size,
//! [`baseline`] that of Gauss–Seidel.
//!
//! On a linear complementarity problem PATH, with which the literature compares, pivots along the path of one covering vector as Lemke's
//! method does, so that stands for it. There is no interior-point method: one was built, and certified no problem that Newton's and
//! Lemke's methods had left.
//!
//! Nothing here depends on the simulation's solvers, so that it can judge them, except that it shares Lemke's method
//! with `direct` and certifies the result.

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
