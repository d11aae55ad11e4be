//! Exact and certified solutions of a contact problem.
//!
//! Reading order: [`problem`] states the problem, [`residual`] the law and its residual, [`joints`] those of
//! joints. [`stewart_trinkle`] solves small problems exactly by Lemke's method
//! ([`crate::engine::constraints::numerics::lemke`]). [`oracle`] sweeps over rows; [`iterate`] repeats sweeps
//! to the solution, and measures their rate. [`certify`] accepts a solution only with a certificate.
//! [`frozen`] stores problems in files, [`gallery`] contains problems solved by hand.
//!
//! The literature compares with PATH. On a linear complementarity problem PATH pivots along the path of one
//! covering vector, as Lemke's method does, so Lemke's method represents it.
//!
//! Nothing here depends on the solvers of the simulation, so it can judge them. The exception is Lemke's
//! method, which is shared with `direct`; its results are certified.

pub mod certify;
pub mod frozen;
pub mod gallery;
pub mod iterate;
pub mod joints;
pub mod oracle;
pub mod problem;
pub mod residual;
pub mod rows;
pub mod stewart_trinkle;
pub(crate) mod validate;

pub use problem::{ContactProblem, DPair, ProblemBody, ProblemContact, Target, Velocity};
pub use rows::{BlockLaw, ProblemBlock, ProblemJoint, ProblemRow};
