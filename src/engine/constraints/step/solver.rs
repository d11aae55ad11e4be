//! The interface of solvers: their schedule, and their hooks around collision.

use super::Passes;
use crate::bodies::Bodies;
use crate::constraints::kernels::types::ConstraintSet;
use crate::constraints::records::graph::Graph;
use crate::contacts::Contact;
use crate::narrowphase::circles::Rolling;
use crate::params::{Parameters, Without};
use crate::workers::Workers;
use std::fmt;

/// A solver in one world: its schedule, and the data that it keeps from step to step.
///
/// The world calls the hooks in the order in which they are listed. Most solvers are a [`Schedule`] and
/// nothing else.
pub trait Solver: CloneSolver + fmt::Debug + Send + Sync {
    /// Called before candidates are collided. The contacts are those of the last step.
    fn before_collision(&mut self, _scene: &mut CollisionScene<'_>, _collision: &mut Collision) {}

    /// Called before the contacts of a step are solved, when impulses have been transferred. Impulses that it changes
    /// are those that the step starts with.
    fn after_collision(&mut self, _scene: &mut CollisionScene<'_>) {}

    /// The contact graph, if contacts are to be grouped by its levels. Called before contacts get their
    /// lanes.
    fn levels(&mut self, _bodies: &Bodies, _contacts: &[Contact]) -> Option<&Graph> {
        None
    }

    /// All passes of one step.
    fn step(&mut self, passes: &mut Passes<'_>);

    /// Numbers that it keeps from step to step besides [`SolverState`](crate::constraints::records::kept::SolverState), for saved worlds.
    fn kept(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Takes the numbers of [`Self::kept`], or none. Returns whether it can; those of bodies that are gone are ignored.
    fn set_kept(&mut self, kept: &[f64]) -> bool {
        kept.is_empty()
    }
}

/// A copy of a solver, with all data that it keeps. Every solver that is `Clone` has it.
pub trait CloneSolver {
    /// The copy.
    fn boxed(&self) -> Box<dyn Solver>;
}

impl<S: Solver + Clone + 'static> CloneSolver for S {
    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }
}

impl Clone for Box<dyn Solver> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// The part of a world that a solver can access around a collision.
#[non_exhaustive]
pub struct CollisionScene<'a> {
    /// Bodies at the beginning of the step.
    pub bodies: &'a Bodies,
    /// Contacts, sorted by shape pair.
    pub contacts: &'a mut [Contact],
    /// Constraints of other types than contacts.
    pub types: &'a [ConstraintSet],
    /// Threads of the step.
    pub workers: &'a Workers,
    /// Bodies whose speed [`Passes::limit_speeds`] bounds in this step, see [`Workspace`](super::Workspace).
    pub speed_limits: &'a mut Vec<(u32, f32)>,
    /// The solver's own parameters.
    pub parameters: Parameters,
    /// Mechanisms of the solver that are left out.
    pub without: Without,
    /// Gravity (m/s²).
    pub gravity: [f32; 2],
    /// Gravity of each body instead, if not empty (m/s²). `[bodies]`
    pub gravities: &'a [[f32; 2]],
    /// Step (s).
    pub dt: f32,
    /// Size of typical bodies (m).
    pub length_unit: f32,
}

/// A solver's requests for the next collision phase.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct Collision {
    /// Which contacts roll. `None` if no radii of curvature are needed ([`Contact::radii`]).
    pub rolling: Option<Rolling>,
}

/// A solver that consists of a schedule and keeps nothing.
#[derive(Clone, Copy)]
pub struct Schedule(pub fn(&mut Passes<'_>));

impl Schedule {
    /// A solver that runs these passes.
    pub fn boxed(step: fn(&mut Passes<'_>)) -> Box<dyn Solver> {
        Box::new(Schedule(step))
    }
}

impl fmt::Debug for Schedule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Schedule")
    }
}

impl Solver for Schedule {
    fn step(&mut self, passes: &mut Passes<'_>) {
        (self.0)(passes);
    }
}
