//! A pass over all contacts: its inputs, and the choice of its compiled instance.
//!
//! A pass is compiled for every lane width and every set of features; the schedule of a solver is compiled
//! once. Kernels implement the generic [`Pass`]; schedules use [`AnyPass`]. The instance is chosen once per
//! pass, outside of all loops.

use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::records::batches::{Batches, Part};
use crate::constraints::records::bounces::Bounces;
use crate::constraints::records::features::{Features, Kernel, KernelFeatures};
use crate::constraints::records::kept::SolverState;
use crate::contacts::Contact;
use crate::lanes::{BodyRow, LaneWidth, Lanes};
use crate::workers::Workers;

/// Input of a pass: the rows of all bodies and one set of batches.
pub struct PassInput<'a> {
    /// One row per body, and an inert one at the end.
    pub rows: &'a mut [BodyRow],
    /// Either the colored or the serial batches.
    pub batches: &'a mut Batches,
    /// Which of the two `batches` are.
    pub part: Part,
    /// Side records for restitution; empty in scenes without it.
    pub bounces: &'a mut Bounces,
    /// All contacts.
    pub contacts: &'a mut [Contact],
    /// Values that the solver keeps per contact, per contact point and per body.
    pub kept: &'a mut SolverState,
    /// Threads that may share the pass.
    pub workers: &'a Workers,
    /// Velocity increments in free flight per substep, `[h aₓ, h a_y, h α, 0]` per row.
    pub increments: &'a [[f32; 4]],
}

/// How a pass accesses bodies. Kernels of other constraint types follow it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum PassMode {
    /// Each constraint sees the effect of the earlier ones on its bodies.
    #[default]
    InTurn,
    /// Each constraint sees the bodies from before the pass. All increments of a body are summed up.
    Jacobi {
        /// Factor on the increments of velocities and impulses (1).
        relaxation: f32,
    },
    /// Inverse masses have changed: only effective masses are recomputed.
    Masses,
    /// Bodies are moved to remove position errors.
    Position {
        /// Largest correction of a length (m), and of an angle (rad).
        max_correction: [f32; 2],
        /// Whether displacements also count as impulses, over the substep h.
        impulses: bool,
    },
    /// Transfers between impulses and vectors, [`TypeInput::vectors`](super::types::TypeInput::vectors); no
    /// row is solved.
    Vector(VectorTask),
    /// Only springs and motors act.
    Drive,
    /// Accumulated impulses are added to the totals of the step, for metrics.
    Record,
    /// Records take up the impulses of rigid rows that sweeps leave alone.
    LoadDirectImpulses,
    /// No warm starting: accumulated impulses are set to zero, and nothing else happens.
    Forget,
}

/// Task of a pass between impulses λ, a vector x and in some tasks a second vector y.
/// [`rows`](crate::constraints::joints::rows) defines b and R.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VectorTask {
    /// x = λ
    Impulses,
    /// λ = x
    SetImpulses,
    /// x = 1/(J M⁻¹ Jᵀ + R), row by row
    Masses,
    /// x = J v
    Velocities,
    /// v ← v + M⁻¹ Jᵀ x
    Push,
    /// x = b
    Bias,
    /// x ← x + R y
    AddCompliance,
    /// x ← (1 + y R)⁻¹ x, y diagonal
    SolveCompliance,
    /// x is projected onto the bounds of the impulses.
    Project,
}

/// Calls a function that is compiled per width only, at the lanes of `$width`.
macro_rules! at_width {
    ($width:expr, $($pass:ident)::+($($arg:expr),*)) => {
        match $width {
            LaneWidth::W1 => $($pass)::+::<f32>($($arg),*),
            LaneWidth::W4 => $($pass)::+::<wide::f32x4>($($arg),*),
            LaneWidth::W8 => $($pass)::+::<wide::f32x8>($($arg),*),
            #[cfg(any(target_feature = "avx512f", feature = "emulated"))]
            LaneWidth::W16 => $($pass)::+::<wide::f32x16>($($arg),*),
            #[cfg(not(any(target_feature = "avx512f", feature = "emulated")))]
            LaneWidth::W16 => unreachable!("widths are limited to those of the build"),
        }
    };
}
pub(crate) use at_width;

/// A pass over contacts, compiled per width and features.
///
/// To add one, implement this trait; [`crate::constraints::kernels::velocity::sweep::Sweep`] is an
/// example.
pub trait Pass {
    /// How constraints of other types take part.
    fn mode(&self) -> PassMode {
        PassMode::InTurn
    }

    /// The rule for position errors of equality rows. Constraints of other types follow it.
    fn law(&self) -> Softness {
        Softness::RIGID
    }

    /// Sums of velocity increments of a Jacobi sweep, one row per body.
    fn sums(&mut self) -> &mut [BodyRow] {
        &mut []
    }

    /// Runs over all segments of `on.batches`, in order.
    fn run<L: Lanes, F: KernelFeatures>(&mut self, on: PassInput<'_>);

    /// Runs the instance compiled for these features.
    fn run_with<L: Lanes>(&mut self, features: &Features, on: PassInput<'_>) {
        match (features.rotation, features.friction, features.two_points) {
            (false, false, false) => self.run::<L, Kernel<false, false, 1>>(on),
            (true, false, false) => self.run::<L, Kernel<true, false, 1>>(on),
            (true, true, false) => self.run::<L, Kernel<true, true, 1>>(on),
            (true, false, true) => self.run::<L, Kernel<true, false, 2>>(on),
            (true, true, true) => self.run::<L, Kernel<true, true, 2>>(on),
            // Friction and a second point have an effect only with rotation.
            (false, ..) => unreachable!("friction or a second point without rotation"),
        }
    }
}

/// A type-erased [`Pass`], the argument of [`crate::constraints::step::Passes::run`].
pub trait AnyPass {
    /// [`Pass::mode`]
    fn mode_of(&self) -> PassMode;

    /// [`Pass::law`]
    fn law_of(&self) -> Softness;

    /// [`Pass::sums`]
    fn sums_of(&mut self) -> &mut [BodyRow];

    /// Runs the instance compiled for this width and these features.
    fn run_at(&mut self, width: LaneWidth, features: &Features, on: PassInput<'_>);
}

impl<P: Pass> AnyPass for P {
    fn mode_of(&self) -> PassMode {
        self.mode()
    }

    fn law_of(&self) -> Softness {
        self.law()
    }

    fn sums_of(&mut self) -> &mut [BodyRow] {
        self.sums()
    }

    fn run_at(&mut self, width: LaneWidth, features: &Features, on: PassInput<'_>) {
        at_width!(width, Self::run_with(self, features, on))
    }
}
