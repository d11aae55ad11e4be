//! One time step of the whole pipeline, every phase timed.

use crate::bodies::{Bodies, BodyDef};
use crate::contacts::Contact;
use crate::lanes::LaneWidth;
use crate::params::Budget;
use crate::shapes::Shape;
use crate::solvers::Variant;

/// The order in which constraints are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Order {
    /// One after the other, sorted by shape pair (width 1 only).
    Natural,
    /// Colour by colour.
    Colored,
}

/// Everything a run can choose.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Row of [`crate::solvers::VARIANTS`].
    pub solver: &'static Variant,
    /// Lanes per instruction.
    pub width: LaneWidth,
    /// Constraint order.
    pub order: Order,
    /// Work per step.
    pub budget: Budget,
    /// m/s²
    pub gravity: [f32; 2],
    /// Step (s).
    pub dt: f32,
    /// Stiffness of soft contacts (Hz), for solvers that have them.
    pub contact_hertz: f32,
    /// Sum impulses over the substeps into [`Contact::step_impulse`].
    pub record_impulses: bool,
    /// Read the clock around every phase.
    pub timed: bool,
}

impl Settings {
    /// Standard settings of `solver`: its budget, 8 lanes, coloured, gravity (0, −10), 1/60 s.
    pub fn new(_solver: &'static Variant) -> Self {
        todo!()
    }
}

/// Phases of a step; `Timings` has one time for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Phase {
    /// Bounds and broad phase.
    Pairs,
    /// Narrow phase and impulse matching.
    Collide,
    /// Colouring.
    Color,
    /// Constraint preparation.
    Prepare,
    /// Warm starting.
    WarmStart,
    /// Velocity sweeps with position feedback.
    Solve,
    /// Velocity sweeps without.
    Relax,
    /// Position sweeps.
    Position,
    /// Restitution.
    Restitution,
    /// Body integration.
    Integrate,
    /// Impulses and poses written back.
    Store,
}

/// Time of each phase of the last step, and of the whole step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timings {
    /// Nanoseconds per phase, indexed by `Phase as usize`.
    pub phase_ns: [u64; 11],
    /// Nanoseconds of the whole step.
    pub step_ns: u64,
}

/// Counts of the last step.
#[derive(Clone, Copy, Debug, Default)]
pub struct StepCounts {
    /// Candidate pairs of the broad phase.
    pub pairs: usize,
    /// Contacts with at least one point.
    pub contacts: usize,
    /// Contact points.
    pub points: usize,
    /// Constraint rows (normal, and tangential where the scene has friction).
    pub rows: usize,
    /// Sweeps over the constraints, of every kind.
    pub sweeps: usize,
    /// Colours in use.
    pub colors: usize,
    /// Contacts solved serially because colours ran out.
    pub overflow: usize,
    /// Lanes in all batches; occupancy is `contacts / lane_slots`.
    pub lane_slots: usize,
    /// Bytes of prepared constraint records.
    pub constraint_bytes: usize,
}

/// Where and when a simulation left all bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divergence {
    /// Step number, from 1.
    pub step: u64,
    /// Body index.
    pub body: usize,
    /// Its speed (m/s), or NaN.
    pub speed: f32,
}

/// Bodies, shapes, contacts and the settings that move them.
pub struct World {
    /// Body state.
    pub bodies: Bodies,
    /// Shapes, in the frame of their body's centre of mass.
    pub shapes: Vec<Shape>,
    /// Body of each shape.
    pub shape_body: Vec<u32>,
    /// Contacts of the last step with at least one point, sorted by shape pair.
    pub contacts: Vec<Contact>,
    /// What the run chose.
    pub settings: Settings,
    /// Times of the last step.
    pub timings: Timings,
    /// Counts of the last step.
    pub counts: StepCounts,
    /// Steps taken.
    pub step_index: u64,
}

impl World {
    /// An empty world.
    pub fn new(_settings: Settings) -> Self {
        todo!()
    }

    /// Adds a body whose shapes are valid; returns its index.
    pub fn add_body(&mut self, _body: &BodyDef) -> usize {
        todo!()
    }

    /// Advances by `settings.dt`.
    pub fn step(&mut self) -> Result<(), Divergence> {
        todo!()
    }

    /// Hash of every bit of the body state.
    pub fn state_hash(&self) -> u64 {
        todo!()
    }
}
