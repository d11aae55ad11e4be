//! Hard test cases with known analytic answers, run against every solver.
//!
//! A case runs a scene, reads one number from the state in `f64` and compares it with the known answer,
//! independently of the solver. A new case is one row in the file of its group, and [`CASES`] lists them all: what
//! is measured, the tolerance with its reason, what is required with its reason, and how it is measured. Most
//! rows share a few shapes of `lab.rs`: a scene of the catalog with its observer (`catalog`), a reading of the
//! last state (`after`), the largest value of a window (`most`), the worst of a list of parameters (`worst_of`),
//! a threshold (`threshold`) and a sweep (`sweep`). An id consists of a family (A: few bodies, B: many) and a
//! name.
//!
//! # Tolerances
//!
//! A tolerance is a requirement or follows from the derivation in its row. It is never fitted to the results,
//! and failures are reported as failures.
//!
//! # What is required
//!
//! Each row states whether the default solver ([`crate::engine::solvers::DEFAULT`]: soft contacts in
//! substeps, frozen at rest) must pass, and which promise implies this or which promise is
//! missing. The exit code of `simpulse verify` depends on exactly the required cases. A required case that
//! fails stays required.
//!
//! | promise | because |
//! |---|---|
//! | free motion follows its discrete formula exactly | semi-implicit Euler |
//! | one body slides, sticks and rolls by Coulomb's law once contacts are warm-started | friction rows are rigid, solved last |
//! | columns stand | contacts whose points bear load are frozen while nothing moves, so a lean does not grow |
//! | overlap at rest is at most F/(m ω²) | the spring's fixed point, for any number of iterations |
//! | a pile comes to rest if the Gauss–Seidel rate leaves no error within the run | cos²(π/2N) and R/(1+R) per sweep |
//! | overlap is pushed apart at 3 m/s at most | the push speed is limited |
//! | the distance from the origin and the step length do not matter | positions keep their rounding error in a second float |
//! | a ball returns to e² of its height | the rebound keeps the discrete energy of flight |
//! | impacts spread from body to body, with friction up to µ times their total impulse | waves before the step; a plastic impact spreads from each pushed body to those that it touches |
//! | impacts and pushes conserve angular momentum | spins are corrected for the displacement of the arms |
//! | discs roll without lifting off | their contact points do not turn with them |
//! | on a static body friction acts at the moving body's surface, at any depth | contact points lie there, and midway between two dynamic bodies |
//! | discs react only to bodies that they touch | gaps of circles are taken at their closest approach |
//! | scale does not matter | stiffness follows from the substep, not from a length |
//!
//! Not promised:
//!
//! - A unique solution before the sweeps of a step have converged.
//! - Heavy loads on light bodies: the depth F/(m ω²) itself may exceed the size of the body.
//! - **High stacks of soft contacts.** A contact between unit boxes has the effective mass 1/5 kg at each
//!   corner. Its stiffness is k = ω²/5 = 7106 N/m at 30 Hz, and K = 2 k (½)² = 3553 N m/rad against rotation.
//!   A column of N links of 1 m with such joints and a weight of q = 10 N/m buckles like Greenhill's beam, at
//!   q N³ = 7.837 K: N = 14.1, and N ∝ f^⅔. More iterations do not help; frozen contacts do (`papers/frozen.md`).
//! - **Friction in the first substep.** A box on a slope has its contact points ½ m below its center: k = 1 +
//!   (½)²·6 = 2.5, so the impulse that stops the points is 1/2.5 of the one that stops the box. The rest
//!   rotates the box. Two sweeps with friction leave a speed of up to 0.6² g h sin θ once. If µ exceeds tan θ
//!   only slightly, friction takes long to stop it.
//! - **Plastic impacts of many bodies.** If an impact needs more visits than its bound, and has too many
//!   points to be solved as a whole, sweeps do the rest: two in each substep, starting from the impulses of the previous one.
//! - **Rotating frames.** Within a step, bodies move along tangents and contacts keep their normals, so a
//!   body on a turntable creeps outward (A26.turntable). Round contacts roll without lag under `shim` only.
//! - **Sudden loads.** The first substep starts from the impulses of the previous step, even if their load
//!   was removed or moved to another contact (B23).
//! - **The time of an impact.** Elastic impacts between free bodies other than discs are resolved at the
//!   start of the step.
//! - **Rolling polygons and capsules.** Within a step, contact points rotate with their body, as corners do.
//!   A rounded body other than a disc that rolls by φ appears to lift off by r (1 − cos φ).

mod balance;
mod columns;
mod impacts;
mod lab;
mod linkages;
mod motion;
mod overlap;
mod pairs;
mod pendulums;
mod piles;
mod rocking;
mod runner;
mod sliding;
mod springs;

pub use lab::Lab;
pub use runner::{Cell, VerifyMatrix, run, select};

use crate::engine::solvers::Variant;
use crate::engine::world::{Divergence, StepError};
use crate::lab::error::Error;
use std::sync::LazyLock;

/// The solvers to whose contact law a reference value applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LawOf {
    /// All solvers.
    Everyone,
    /// Solvers whose resting contacts are springs.
    Springs,
    /// Solvers that sweep such contacts once per substep; the reference value holds for each of their steps.
    SpringsSweptOnce,
}

impl LawOf {
    /// Whether the reference value applies to this solver.
    pub fn includes(self, solver: &Variant) -> bool {
        let springs = solver.softness.is_some();
        match self {
            LawOf::Everyone => true,
            LawOf::Springs => springs,
            LawOf::SpringsSweptOnce => springs && solver.budget.velocity_iterations == 1,
        }
    }

    /// Text for lists; empty for all solvers.
    pub fn text(self) -> &'static str {
        match self {
            LawOf::Everyone => "",
            LawOf::Springs => "soft contacts only",
            LawOf::SpringsSweptOnce => "soft contacts swept once per substep only",
        }
    }
}

/// One test case, a row of [`CASES`].
pub struct Case {
    /// Family and name: `A1.stick`.
    pub id: &'static str,
    /// The measured quantity.
    pub summary: &'static str,
    /// Unit of the measured value, the reference value and the tolerance.
    pub unit: &'static str,
    /// Source of the tolerance.
    pub tolerance: &'static str,
    /// Whether the default solver must pass, with the reason.
    pub required: Required,
    /// The solvers to whose contact law the reference value applies.
    pub law_of: LawOf,
    /// Runs the case.
    pub measure: MeasureFn,
}

type MeasureFn = fn(&Lab) -> Result<Finding, Failure>;

impl Case {
    /// A case of every solver that is not yet measured: tolerance and requirement follow.
    const fn new(id: &'static str, summary: &'static str, unit: &'static str) -> Self {
        let required = Required::No("");
        let measure: MeasureFn = |_| Err(Failure::Unmeasured(String::new()));
        Case { id, summary, unit, tolerance: "", required, law_of: LawOf::Everyone, measure }
    }

    const fn within(self, tolerance: &'static str) -> Self {
        Case { tolerance, ..self }
    }

    const fn springs(self) -> Self {
        Case { law_of: LawOf::Springs, ..self }
    }

    const fn swept_once(self) -> Self {
        Case { law_of: LawOf::SpringsSweptOnce, ..self }
    }

    const fn required(self, why: &'static str) -> Self {
        Case { required: Required::Yes(why), ..self }
    }

    const fn not_required(self, why: &'static str) -> Self {
        Case { required: Required::No(why), ..self }
    }

    const fn by(self, measure: MeasureFn) -> Self {
        Case { measure, ..self }
    }
}

/// Every case, sorted by family. The rows of a group are in its own file.
pub static CASES: LazyLock<Vec<&'static Case>> = LazyLock::new(|| {
    let groups = [
        balance::CASES,
        columns::CASES,
        impacts::CASES,
        linkages::CASES,
        motion::CASES,
        overlap::CASES,
        pairs::CASES,
        pendulums::CASES,
        piles::CASES,
        rocking::CASES,
        sliding::CASES,
        springs::CASES,
    ];
    let mut cases: Vec<&Case> = groups.into_iter().flatten().collect();
    cases.sort_by_key(|case| family(case.id));
    cases
});

/// The letter and the number before the dot of an id.
fn family(id: &str) -> (&str, u32) {
    let (family, _) = id.split_once('.').expect("an id is a family and a name");
    let (letter, number) = family.split_at(1);
    (letter, number.parse().expect("a family is a letter and a number"))
}

/// Whether the mathematics of the default solver promises that a case passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Required {
    /// Promised, for this reason.
    Yes(&'static str),
    /// Not promised, for this reason.
    No(&'static str),
}

impl Required {
    /// Whether the exit code depends on the case.
    pub fn is_required(self) -> bool {
        matches!(self, Required::Yes(_))
    }
}

/// Result of a case.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Finding {
    /// The measured value.
    pub measured: f64,
    /// The reference value.
    pub truth: f64,
    /// The tolerance, ≥ 0.
    pub tolerance: f64,
    /// Further remarks, often empty. If the reference value is a threshold: what was measured at each value tried.
    pub note: String,
}

impl Finding {
    /// A measured value with its reference value and tolerance.
    pub fn new(measured: f64, truth: f64, tolerance: f64) -> Self {
        Finding { measured, truth, tolerance, note: String::new() }
    }

    /// Adds a remark.
    pub fn note(self, note: impl Into<String>) -> Self {
        Finding { note: note.into(), ..self }
    }

    /// Distance to the reference value; infinite if the measured value is not a number.
    pub fn error(&self) -> f64 {
        let error = (self.measured - self.truth).abs();
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Error ÷ tolerance: 0 is exact, values up to 1 pass. With a tolerance of 0, the margin is 0 or
    /// infinite.
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

/// Reason why a case yields no number.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The simulation diverged.
    #[error("{0}")]
    Diverged(Divergence),
    /// The event to be measured did not happen.
    #[error("not measured: {0}")]
    Unmeasured(String),
    /// The scene has joints, which the solver does not support.
    #[error("{0}")]
    NotHeld(Error),
    /// The case itself is invalid.
    #[error(transparent)]
    Refused(#[from] Error),
}

impl From<StepError> for Failure {
    fn from(error: StepError) -> Self {
        match error {
            StepError::Settings(error) => Failure::Refused(error.into()),
            StepError::Diverged(divergence) => Failure::Diverged(divergence),
            error => panic!("{error}"),
        }
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
