//! A pass over all contacts: what it needs to run, and how it finds its instance.
//!
//! A pass is compiled for every lane width and every set of features; the schedule of a solver
//! is compiled once. [`Pass`] is the generic side, which kernels implement; [`AnyPass`] the side
//! that schedules see. Which instance runs is decided once per pass, outside of all loops.

use crate::engine::constraints::kernels::velocity::rules::Softness;
use crate::engine::constraints::records::batches::{Batches, Part};
use crate::engine::constraints::records::bounces::Bounces;
use crate::engine::constraints::records::features::{Features, Kernel, KernelFeatures, Layout, OppositeKind};
use crate::engine::constraints::records::kept::Kept;
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneWidth, Lanes};

/// Input of a pass: the rows of all bodies and one set of batches.
pub struct PassInput<'a> {
    /// One row per body, and an inert one at the end.
    pub rows: &'a mut [BodyRow],
    /// Colored batches, or serial ones.
    pub batches: &'a mut Batches,
    /// Which of both.
    pub part: Part,
    /// Side records for restitution; empty in scenes without it.
    pub bounces: &'a mut Bounces,
    /// All contacts.
    pub contacts: &'a mut [Contact],
    /// Numbers that the solver keeps per contact, per contact point and per body.
    pub kept: &'a mut Kept,
    /// Changes of velocity in free flight per substep, `[h aₓ, h a_y, h α, 0]` per row.
    pub increments: &'a [[f32; 4]],
}

/// Memory requests of a pass per contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerLane {
    /// Floats of records that are read.
    pub floats_read: usize,
    /// Floats of records that are written.
    pub floats_written: usize,
    /// Rows of bodies that are gathered (32 B each).
    pub rows: usize,
    /// Halves of rows that are written back (16 B each).
    pub halves: usize,
}

impl PerLane {
    /// A pass that gathers the bodies of a contact once and writes back a half row of each that moves.
    pub fn of_bodies(floats_read: usize, floats_written: usize, opposite: OppositeKind) -> Self {
        let rows = 1 + usize::from(opposite != OppositeKind::Static);
        let halves = 1 + usize::from(opposite == OppositeKind::Dynamic);
        PerLane { floats_read, floats_written, rows, halves }
    }

    /// A velocity sweep: normal and friction; arms, separation, masses and impulses of each point.
    pub fn of_sweep(layout: &Layout, friction: bool, opposite: OppositeKind) -> Self {
        let friction = layout.has_friction && friction;
        let impulses = if friction { 2 } else { 1 };
        let read = 2 + usize::from(friction) + layout.points * (layout.arms() + 1 + 2 * impulses);
        Self::of_bodies(read, layout.points * impulses, opposite)
    }
}

/// Body access of a pass, for constraint types with their own kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PassMode {
    /// Each constraint sees what those before it have done to its bodies.
    #[default]
    InTurn,
    /// Each constraint sees the bodies from before the pass. What all of them add to a body is summed up.
    Jacobi {
        /// Factor on the increments of velocities and impulses (1).
        relaxation: f32,
    },
    /// Inverse masses have changed: only effective masses are recomputed.
    Masses,
    /// Bodies are moved until errors are gone.
    Position {
        /// Largest correction of a length (m), and of an angle (rad).
        max_correction: [f32; 2],
        /// Whether displacements count as impulses of h.
        impulses: bool,
    },
    /// Between impulses and vectors, [`TypeInput::vectors`](super::types::TypeInput::vectors); no row is solved.
    Vector(VectorTask),
    /// Only springs and motors act.
    Drive,
    /// Accumulated impulses are added to those of the step, for metrics.
    Book,
    /// Records take up the impulses of rigid rows that sweeps leave alone.
    TakeUp,
    /// The solver does not start warm: only accumulated impulses are set to zero.
    Forget,
}

/// What a pass between impulses λ and a vector x does, and where it needs one, a second vector y. See
/// [`rows`](crate::engine::constraints::joints::rows) for b and R.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VectorTask {
    /// x = λ
    Impulses,
    /// λ = x
    SetImpulses,
    /// x = 1/(J M⁻¹ Jᵀ + R), row by row.
    Masses,
    /// x = J v
    Velocities,
    /// v ← v + M⁻¹ Jᵀ x
    Push,
    /// x = b
    Bias,
    /// x ← x + R y
    Soften,
    /// x ← (1 + y R)⁻¹ x, y diagonal
    Yield,
    /// x becomes the nearest impulses within their bounds.
    Bound,
}

/// Calls a function that is compiled per width alone, at the lanes of `$width`.
macro_rules! at_width {
    ($width:expr, $($pass:ident)::+($($arg:expr),*)) => {
        match $width {
            LaneWidth::W1 => $($pass)::+::<f32>($($arg),*),
            LaneWidth::W4 => $($pass)::+::<wide::f32x4>($($arg),*),
            LaneWidth::W8 => $($pass)::+::<wide::f32x8>($($arg),*),
            LaneWidth::W16 => $($pass)::+::<wide::f32x16>($($arg),*),
        }
    };
}
pub(crate) use at_width;

/// As [`at_width`], on the lanes of a [`PassWidth`].
macro_rules! at_pass_width {
    ($width:expr, $($pass:ident)::+($($arg:expr),*)) => {
        match $width {
            #[cfg(feature = "count")]
            PassWidth { counted: true, width: LaneWidth::W1 } => {
                $($pass)::+::<$crate::engine::lanes::Counted>($($arg),*)
            }
            PassWidth { width, .. } => at_width!(width, $($pass)::+($($arg),*)),
        }
    };
}
pub(crate) use at_pass_width;

/// A pass over contacts, compiled per width and features.
///
/// To add one, implement this; [`crate::engine::constraints::kernels::velocity::sweep::Sweep`] is the example.
pub trait Pass {
    /// Memory requests per contact with records of this layout.
    fn traffic(&self, layout: &Layout, opposite: OppositeKind) -> PerLane;

    /// Participation of constraints of other types.
    fn mode(&self) -> PassMode {
        PassMode::InTurn
    }

    /// Its treatment of position errors of equality rows, which constraints of other types follow.
    fn law(&self) -> Softness {
        Softness::RIGID
    }

    /// Sums of velocity increments, a row each, of a Jacobi sweep.
    fn sums(&mut self) -> &mut [BodyRow] {
        &mut []
    }

    /// Runs over all segments of `on.batches`, in order.
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>);

    /// Runs the instance for these features.
    fn run_with<L: Lanes>(&mut self, features: &Features, on: PassInput<'_>) {
        match (features.rotation, features.friction, features.two_points) {
            (false, false, false) => self.run::<L, Kernel<false, false, 1>>(on),
            (true, false, false) => self.run::<L, Kernel<true, false, 1>>(on),
            (true, true, false) => self.run::<L, Kernel<true, true, 1>>(on),
            (true, false, true) => self.run::<L, Kernel<true, false, 2>>(on),
            (true, true, true) => self.run::<L, Kernel<true, true, 2>>(on),
            // Friction and a second point act through rotation.
            (false, ..) => unreachable!("friction or a second point without rotation"),
        }
    }
}

/// The lanes that a pass runs at: a width, or one lane that counts its operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassWidth {
    /// Lanes per instruction.
    pub width: LaneWidth,
    /// Whether operations are counted; then the width is 1.
    pub counted: bool,
}

/// A [`Pass`] behind a pointer: what [`crate::engine::constraints::step::Passes::run`] takes.
pub trait AnyPass {
    /// [`Pass::traffic`]
    fn traffic_of(&self, layout: &Layout, opposite: OppositeKind) -> PerLane;

    /// [`Pass::mode`]
    fn mode_of(&self) -> PassMode;

    /// [`Pass::law`]
    fn law_of(&self) -> Softness;

    /// [`Pass::sums`]
    fn sums_of(&mut self) -> &mut [BodyRow];

    /// Runs the instance for this width and these features.
    fn run_at(&mut self, width: PassWidth, features: &Features, on: PassInput<'_>);
}

impl<P: Pass> AnyPass for P {
    fn traffic_of(&self, layout: &Layout, opposite: OppositeKind) -> PerLane {
        self.traffic(layout, opposite)
    }

    fn mode_of(&self) -> PassMode {
        self.mode()
    }

    fn law_of(&self) -> Softness {
        self.law()
    }

    fn sums_of(&mut self) -> &mut [BodyRow] {
        self.sums()
    }

    fn run_at(&mut self, width: PassWidth, features: &Features, on: PassInput<'_>) {
        at_pass_width!(width, Self::run_with(self, features, on))
    }
}
