//! Hard cases: set-ups whose truth is known on paper, run against every solver.
//!
//! A case runs a scene, reads one number from the state in `f64` and compares it with the
//! truth. It does not know which solver ran. A new case is one function in the file of its
//! family and one row in [`CASES`]; ids such as A5 or B12 are those of the list of hard cases.
//!
//! # Tolerances
//!
//! They come from the list of hard cases or from a derivation that stands in the row, never from
//! what passes. What fails is shown as failing.
//!
//! # What is required
//!
//! Each row says whether the default solver ([`crate::solvers::DEFAULT`], soft contacts in
//! substeps) is required to pass, and which promise of its mathematics that rests on, or which it
//! lacks. The exit code of `simpulse verify` asks for exactly those.
//!
//! | promise | because |
//! |---|---|
//! | free motion is exact on its discrete formula | semi-implicit Euler |
//! | one body slides, sticks and rolls by Coulomb's law | friction rows are rigid, warm started, solved last |
//! | overlap at rest is at most F/(m ω²) | the spring's fixed point, for any number of iterations |
//! | piles whose Gauss–Seidel rate leaves no error within the run come to rest | cos²(π/2N) and R/(1+R) per sweep |
//! | overlap is pushed apart no faster than 3 m/s | the cap |
//!
//! It does not promise: bounces within a step, heavy loads on light bodies (the depth F/(m ω²)
//! itself exceeds the body), positions finer than an `f32` of the distance from the origin, one
//! solution where the sweeps of one step have not converged.

mod far;
mod impacts;
mod lab;
mod motion;
mod overlap;
mod paradox;
mod ratios;
mod runner;
mod sliding;
mod stacks;
mod table;

pub use lab::Lab;
pub use runner::{Cell, Matrix, Progress, run, select};
pub use table::{CASES, NEEDS_JOINTS};

use crate::error::Error;
use crate::world::Divergence;

/// A row of [`CASES`].
pub struct Case {
    /// Family and name: `A1.stick`.
    pub id: &'static str,
    /// What is measured.
    pub summary: &'static str,
    /// Of the measured value, the truth and the tolerance.
    pub unit: &'static str,
    /// Where the tolerance is from.
    pub tolerance: &'static str,
    /// Whether the default solver must pass, and why.
    pub required: Required,
    /// The solvers whose own law the truth is; empty where it is everyone's.
    pub law_of: &'static [&'static str],
    /// Runs it.
    pub measure: fn(&Lab) -> Result<Finding, Failure>,
}

/// Whether the mathematics of the default solver promises a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Required {
    /// It does, because …
    Yes(&'static str),
    /// It does not, because …
    No(&'static str),
}

impl Required {
    /// Whether the exit code asks for it.
    pub fn is_required(self) -> bool {
        matches!(self, Required::Yes(_))
    }
}

/// What a case measured.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Finding {
    /// As read from the run.
    pub measured: f64,
    /// What it should have been.
    pub truth: f64,
    /// How far off it may be, ≥ 0.
    pub tolerance: f64,
    /// What else is worth knowing; often empty.
    pub note: String,
    /// Of a threshold: the parameter's name, and per value what was measured and whether it was good enough.
    pub sweep: Option<(&'static str, Vec<(f64, f64, bool)>)>,
}

impl Finding {
    /// A number beside its truth.
    pub fn new(measured: f64, truth: f64, tolerance: f64) -> Self {
        Finding { measured, truth, tolerance, note: String::new(), sweep: None }
    }

    /// The same with a remark.
    pub fn note(self, note: impl Into<String>) -> Self {
        Finding { note: note.into(), ..self }
    }

    /// Distance to the truth; infinite if the measured value is not a number.
    pub fn error(&self) -> f64 {
        let error = (self.measured - self.truth).abs();
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Error in tolerances: 0 is exact, up to 1 passes. Where nothing is tolerated, 0 or infinite.
    pub fn margin(&self) -> f64 {
        match (self.error(), self.tolerance) {
            (0.0, _) => 0.0,
            (error, tolerance) => error / tolerance,
        }
    }

    /// Whether the error is within the tolerance.
    pub fn passed(&self) -> bool {
        self.margin() <= 1.0
    }
}

/// Why a case has no number.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The simulation left all bounds.
    #[error("{0}")]
    Diverged(Divergence),
    /// What should have been measured never happened.
    #[error("not measured: {0}")]
    Unmeasured(String),
    /// The case itself is wrong.
    #[error(transparent)]
    Refused(#[from] Error),
}

impl From<Divergence> for Failure {
    fn from(divergence: Divergence) -> Self {
        Failure::Diverged(divergence)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn margins_are_errors_in_tolerances() {
        let margin = |measured, truth, tolerance| Finding::new(measured, truth, tolerance).margin();
        assert_eq!(margin(1.5, 1.0, 2.0), 0.25);
        assert_eq!(margin(0.5, 1.0, 0.5), 1.0);
        assert_eq!(margin(1.0, 1.0, 0.0), 0.0);
        assert_eq!(margin(1.1, 1.0, 0.0), f64::INFINITY);
        assert_eq!(margin(f64::NAN, 1.0, 1.0), f64::INFINITY);
        assert_eq!(margin(f64::INFINITY, 1.0, 1.0), f64::INFINITY);
        assert!(Finding::new(0.5, 1.0, 0.5).passed() && !Finding::new(0.4, 1.0, 0.5).passed());
        assert!(!Finding::new(f64::NAN, 0.0, 1e9).passed());
    }
}
