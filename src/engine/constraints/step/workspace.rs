//! Working data, inputs and counts of a step.

use crate::constraints::impacts::{ImpactLaw, ImpactRecords};
use crate::constraints::kernels::motion::Motion;
use crate::constraints::kernels::observe::ObservedRule;
use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::records::batches::Batches;
use crate::constraints::records::features::Features;
use crate::constraints::records::kept::SolverState;
use crate::constraints::records::point_vector::PointVector;
use crate::constraints::vectors::system::System;
use crate::lanes::BodyRow;
use crate::narrowphase::lanes::PoseRow;
use crate::params::{Budget, Parameters, Without};
use crate::workers::Workers;
use std::fmt;

/// Working data of a step. Kept from step to step, so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    /// One row per body, and an inert one at the end.
    pub rows: Vec<BodyRow>,
    /// Forces, damping, integration.
    pub motion: Motion,
    /// Colored batches at the chosen width.
    pub lanes: Batches,
    /// Contacts that are solved one after the other: all of them in natural order, otherwise the overflow.
    pub serial: Batches,
    /// Constraints of other types than contacts.
    pub types: Vec<ConstraintSet>,
    /// Poses at the start of the step, one per row, if there are such constraints.
    pub poses: Vec<PoseRow>,
    /// Numbers that a solver keeps per contact, per contact point and per body.
    pub kept: SolverState,
    /// Side records for restitution; empty in scenes without restitution.
    pub impacts: ImpactRecords,
    /// Bodies that [`Passes::limit_speeds`](super::Passes::limit_speeds) slows down, in ascending order, each with the largest
    /// √(v² + ρ²ω²) that it may have (m/s); ρ is its radius of gyration.
    pub speed_limits: Vec<(u32, f32)>,
    /// Vectors that solvers have returned, for reuse.
    pub vectors: Vec<PointVector>,
    /// Called after each iteration of a solver.
    pub watch: Option<Watch>,
    /// Whether to keep the rule of the last velocity sweep in `last_rule`.
    pub observe: bool,
    /// Rule of the last velocity sweep; see `observe`.
    pub last_rule: Option<ObservedRule>,
    /// Threads that share the passes.
    pub workers: Workers,
}

/// Receives the problem after each iteration of a solver. Iterations are counted from 1 in each step.
pub struct Watch(pub Box<IterationObserver>);

/// Receives the number of an iteration, and the problem after it.
pub type IterationObserver = dyn FnMut(u32, &mut System<'_>) + Send + Sync;

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Watch")
    }
}

/// The copy has no `watch`, because a closure cannot be copied.
impl Clone for Workspace {
    fn clone(&self) -> Self {
        Workspace {
            rows: self.rows.clone(),
            motion: self.motion.clone(),
            lanes: self.lanes.clone(),
            serial: self.serial.clone(),
            types: self.types.clone(),
            poses: self.poses.clone(),
            kept: self.kept.clone(),
            impacts: self.impacts.clone(),
            speed_limits: self.speed_limits.clone(),
            vectors: self.vectors.clone(),
            watch: None,
            observe: self.observe,
            last_rule: self.last_rule.clone(),
            workers: Workers::default(),
        }
    }
}

/// Work counts of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct WorkCount {
    /// Passes over all constraints that solve rows. Warm starts are not counted.
    pub sweeps: usize,
    /// Rows solved in all sweeps: a normal row per point, and a tangential one where the
    /// sweep has friction.
    pub row_updates: usize,
    /// Visits of points in the solution of impacts before the step.
    pub impact_visits: usize,
    /// Islands whose impacts were cut off by a limit.
    pub cut_impacts: usize,
    /// Substeps that were too large for the solver's own method and were solved by sweeps alone.
    pub unsolved: usize,
}

/// Inputs of a step besides the workspace.
#[derive(Clone, Copy, Debug)]
pub struct StepInput {
    /// Features of the scene.
    pub features: Features,
    /// Work allowed per step.
    pub budget: Budget,
    /// Substep (s).
    pub h: f32,
    /// Size of typical bodies (m).
    pub length_unit: f32,
    /// The solver's own parameters.
    pub parameters: Parameters,
    /// Mechanisms of the solver that are left out.
    pub without: Without,
    /// Whether to sum impulses into [`crate::contacts::Contact::step_impulse`].
    pub record_impulses: bool,
    /// Impact law of the run.
    pub impacts: ImpactLaw,
    /// Number of points of all contacts, to count rows.
    pub points: usize,
    /// Whether a pair of shapes that may touch has a disc.
    pub has_discs: bool,
}
