//! What a step works on, what it is given, and what it counts.

use crate::engine::clock::PhaseFilter;
use crate::engine::constraints::impacts::{ImpactLaw, ImpactRecords};
use crate::engine::constraints::kernels::motion::Motion;
use crate::engine::constraints::kernels::observe::ObservedRule;
use crate::engine::constraints::kernels::types::Joined;
use crate::engine::constraints::records::batches::Batches;
use crate::engine::constraints::records::features::Features;
use crate::engine::constraints::records::kept::Kept;
use crate::engine::constraints::records::point_vector::PointVector;
use crate::engine::constraints::vectors::system::System;
use crate::engine::lanes::BodyRow;
use crate::engine::narrowphase::lanes::PoseRow;
use crate::engine::params::{Budget, Parameters, Without};
use std::fmt;

/// Everything a step works on, kept from step to step so that nothing is allocated.
#[derive(Debug, Default)]
pub struct Workspace {
    /// One row per body, and an inert one at the end.
    pub rows: Vec<BodyRow>,
    /// Forces, damping, integration.
    pub motion: Motion,
    /// Colored batches at the chosen width.
    pub lanes: Batches,
    /// Contacts that are solved one after the other: all of them in natural order, else the overflow.
    pub serial: Batches,
    /// Constraints of other types than contacts.
    pub types: Vec<Joined>,
    /// Poses at the start of the step, where there are such constraints; one per row.
    pub poses: Vec<PoseRow>,
    /// Numbers that a solver keeps per contact, per contact point and per body.
    pub kept: Kept,
    /// Side records of what bounces; empty in scenes without restitution.
    pub impacts: ImpactRecords,
    /// Vectors that solvers have given back.
    pub vectors: Vec<PointVector>,
    /// Called after each iteration of a solver.
    pub watch: Option<Watch>,
    /// Keep the rule of the last velocity sweep in `last_rule`.
    pub observe: bool,
    /// See `observe`.
    pub last_rule: Option<ObservedRule>,
}

/// Is shown the problem after each of a solver's iterations, which are counted from 1 in each step.
pub struct Watch(pub Box<IterationObserver>);

/// Is given the number of an iteration and the problem after it.
pub type IterationObserver = dyn FnMut(u32, &mut System<'_>) + Send;

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Watch")
    }
}

/// A copy is not watched: a closure cannot be copied.
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
            vectors: self.vectors.clone(),
            watch: None,
            observe: self.observe,
            last_rule: self.last_rule.clone(),
        }
    }
}

impl Workspace {
    /// Bytes held by what only some solvers have.
    pub fn own_bytes(&self) -> usize {
        self.kept.held_bytes() + self.vectors.iter().map(PointVector::held_bytes).sum::<usize>()
    }
}

/// Counts of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorkCount {
    /// Passes over all constraints that solve something; warm starts are not counted.
    pub sweeps: usize,
    /// Rows solved in all sweeps: a normal row per point, and a tangential one where the
    /// sweep has friction.
    pub row_updates: usize,
    /// Points solved by impacts before the step.
    pub impact_visits: usize,
    /// Islands whose impacts were not followed to their end.
    pub cut_impacts: usize,
    /// Substeps that were too large for the solver's own method, so that sweeps alone solved them.
    pub unsolved: usize,
}

/// Inputs of a step besides the workspace.
#[derive(Clone, Copy, Debug)]
pub struct StepInput {
    /// Features of the scene.
    pub features: Features,
    /// Work per step.
    pub budget: Budget,
    /// Substep (s).
    pub h: f32,
    /// Size of typical bodies (m).
    pub length_unit: f32,
    /// The solver's own parameters.
    pub parameters: Parameters,
    /// Mechanisms of the solver that are left out.
    pub without: Without,
    /// Which phases run.
    pub phases: PhaseFilter,
    /// Sum impulses into [`crate::engine::contacts::Contact::step_impulse`].
    pub record_impulses: bool,
    /// Where bodies hit each other.
    pub impacts: ImpactLaw,
    /// Points of all contacts, to count rows by.
    pub points: usize,
}
