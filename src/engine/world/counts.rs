//! Counts of a step, and divergence.

use crate::error::Error;
use crate::params::DIVERGED_SPEED;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Counts of the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct StepCounts {
    /// Candidate pairs of the broad phase.
    pub pairs: usize,
    /// Contacts with at least one point.
    pub contacts: usize,
    /// Contact points of bodies that are awake.
    pub points: usize,
    /// Constraint rows (normal, and tangential where the scene has friction).
    pub rows: usize,
    /// Sweeps over the constraints, of every kind.
    pub sweeps: usize,
    /// Rows solved in all sweeps of the step.
    pub row_updates: usize,
    /// Colors in use.
    pub colors: usize,
    /// Contacts solved serially because colors ran out.
    pub overflow: usize,
    /// Groups of islands that were solved one by one; 0 if the world was solved as a whole, see
    /// [`Settings::group_size`](super::Settings::group_size).
    pub groups: usize,
    /// Bodies that sleep, see [`Settings::sleep`](super::Settings::sleep).
    pub asleep: usize,
    /// Lanes in all batches; occupancy is `contacts / lane_slots` while no body sleeps.
    pub lane_slots: usize,
    /// Bodies that moved farther than half their width; counted only with continuous collision.
    pub fast: usize,
    /// Bytes of prepared constraint records.
    pub constraint_bytes: usize,
    /// Points solved by impacts before the step; repeated visits count again.
    pub impact_visits: usize,
    /// Islands whose impacts reached their limit of visits; sweeps then stop the remaining approach.
    pub cut_impacts: usize,
    /// Substeps whose problem was too large for the solver's own method, so that sweeps alone solved them.
    pub unsolved: usize,
}

/// Which quantity of a body is out of bounds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[non_exhaustive]
pub enum Quantity {
    /// Its speed (m/s).
    #[default]
    Speed,
    /// Its spin (rad/s).
    Spin,
    /// Its position, if not finite.
    Position,
    /// Its angle, if not finite.
    Angle,
}

/// The criterion that a diverged simulation violated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[non_exhaustive]
pub enum Criterion {
    /// Speeds within bounds, finite positions and angles.
    #[default]
    Bounds,
    /// Kinetic energy explained by its sources.
    Energy,
}

/// The body and the step at which a simulation diverged.
///
/// ```
/// # use simpulse_engine::prelude::*;
/// let mut world = World::new(Settings::new(solvers::PGS));
/// let fast = BodyDef::dynamic([0.0, 0.0]).with_velocity([2e5, 0.0]);
/// world.add_body(&fast.with(ShapeDef::circle(0.5)?))?;
/// let error = world.step().unwrap_err();
/// assert!(error.to_string().starts_with("diverged at step 1: body 0 moves at 2.000e5 m/s"));
/// # Ok::<(), simpulse_engine::error::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Divergence {
    /// Step number, from 1.
    pub step: u64,
    /// Body index.
    pub body: usize,
    /// Which quantity is out of bounds.
    pub quantity: Quantity,
    /// Its value (m/s or rad/s); NaN if it is not finite.
    pub speed: f32,
    /// The violated criterion.
    pub criterion: Criterion,
}

impl Divergence {
    /// The divergence of body `body` in step `step`: the value of this quantity is `speed`.
    pub fn new(step: u64, body: usize, quantity: Quantity, speed: f32, criterion: Criterion) -> Self {
        Divergence { step, body, quantity, speed, criterion }
    }
}

impl std::error::Error for Divergence {}

/// Why a step failed.
///
/// ```
/// # use simpulse_engine::{solvers, world::{Settings, World}};
/// let mut world = World::new(Settings { dt: 0.0, ..Settings::default() });
/// assert_eq!(world.step().unwrap_err().to_string(), "dt: must be positive and finite, is 0.0");
/// # Ok::<(), simpulse_engine::error::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// A setting out of its range; the world is unchanged.
    Settings(Error),
    /// A body diverged.
    Diverged(Divergence),
    /// A part of the step panicked, with several threads: what it said. The world is in no defined state.
    Panicked(String),
}

impl StepError {
    /// Runs a part of a step. Errors: it panicked.
    pub(super) fn caught<T>(part: impl FnOnce() -> T) -> Result<T, StepError> {
        catch_unwind(AssertUnwindSafe(part)).map_err(|panic| {
            let text = panic.downcast_ref::<&str>().copied();
            let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
            StepError::Panicked(text.unwrap_or("no message").into())
        })
    }

    /// The divergence; `None` for a setting out of its range.
    ///
    /// # Panics
    /// If a part of the step did.
    pub fn divergence(self) -> Option<Divergence> {
        match self {
            StepError::Settings(_) => None,
            StepError::Diverged(divergence) => Some(divergence),
            StepError::Panicked(message) => panic!("{message}"),
        }
    }
}

impl std::error::Error for StepError {}

impl std::fmt::Display for StepError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            StepError::Settings(error) => error.fmt(f),
            StepError::Diverged(divergence) => divergence.fmt(f),
            StepError::Panicked(message) => write!(f, "a thread panicked: {message}"),
        }
    }
}

impl std::fmt::Display for Divergence {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Divergence { step, body, quantity, speed, criterion } = self;
        write!(f, "diverged at step {step}: ")?;
        if *criterion == Criterion::Energy {
            let fastest =
                "kinetic energy beyond 100 times what start, weight and kinematic bodies give; the fastest, ";
            write!(f, "{fastest}")?;
        }
        write!(f, "body {body} ")?;
        match quantity {
            Quantity::Speed if speed.is_finite() => write!(f, "moves at {speed:.3e} m/s"),
            Quantity::Spin if speed.is_finite() => write!(f, "spins at {speed:.3e} rad/s"),
            Quantity::Speed => write!(f, "has no finite speed"),
            Quantity::Spin => write!(f, "has no finite spin"),
            Quantity::Position => write!(f, "has no finite position"),
            Quantity::Angle => write!(f, "has no finite angle"),
        }?;
        if *criterion == Criterion::Bounds && speed.is_finite() {
            let unit = if *quantity == Quantity::Speed { " length units per second" } else { "" };
            write!(f, ", more than {DIVERGED_SPEED:e}{unit}")?;
        }
        write!(f, "; try more substeps, a shorter step or another solver")
    }
}
