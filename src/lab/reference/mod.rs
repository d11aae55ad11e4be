//! Exact and certified solutions of a contact problem.
//!
//! Reading order: [`problem`] states the problem, [`residual`] the law and how far from it an
//! answer is. [`stewart_trinkle`] solves small problems exactly by Lemke's method
//! ([`crate::engine::constraints::numerics::lemke`]);
//! [`sweeps`], [`nncg`] and [`newton`], through [`sparse`], solve large ones. [`certify`] accepts
//! an answer only with a certificate. [`statics`] asks without any time step whether rest is possible
//! at all, through [`nnls`]. [`frozen`] keeps problems in files, [`gallery`] holds problems solved by
//! hand, [`rates`] measures convergence in iterations and in the step size, [`baseline`] that of
//! Gauss–Seidel.
//!
//! Nothing here knows the simulation's own solvers, so that it can judge them; it shares Lemke's method with
//! `direct`, and certifies what that finds.

pub mod baseline;
pub mod certify;
pub mod frozen;
pub mod gallery;
pub mod newton;
pub mod nncg;
pub mod nnls;
pub mod problem;
pub mod rates;
pub mod residual;
mod scale;
pub mod sparse;
pub mod statics;
pub mod stewart_trinkle;
pub mod sweeps;
mod validate;

pub use problem::{ContactProblem, Pair, ProblemBody, ProblemContact, Velocity};
