//! A pass over all contacts: what it needs to run, and how it finds its instance.
//!
//! A pass is compiled for every lane width and every set of features; the schedule of a solver
//! is compiled once. [`Pass`] is the generic side, which kernels implement; [`AnyPass`] the side
//! that schedules see. Which instance runs is decided once per pass, outside of all loops.

use super::batches::Batches;
use super::bounces::Bounces;
use super::features::{Features, Kernel, KernelFeatures};
use crate::engine::contacts::Contact;
use crate::engine::lanes::{BodyRow, LaneWidth, Lanes};

/// What a pass runs on: the rows of all bodies and one set of batches.
pub struct PassInput<'a> {
    /// One row per body, and an inert one at the end.
    pub rows: &'a mut [BodyRow],
    /// Sums of velocity increments, a row each; empty but in a Jacobi sweep.
    pub sums: &'a mut [BodyRow],
    /// Coloured batches, or serial ones.
    pub batches: &'a mut Batches,
    /// What those contacts keep for bouncing; empty in scenes without restitution.
    pub bounces: &'a mut Bounces,
    /// All contacts.
    pub contacts: &'a mut [Contact],
    /// Changes of velocity in free flight per substep, `[h aₓ, h a_y, h α, 0]` per row.
    pub increments: &'a [[f32; 4]],
}

/// A pass over contacts, compiled per width and features.
///
/// To add one, implement this; [`super::sweep::Sweep`] is the example.
pub trait Pass {
    /// Whether there is an instance that counts operations, for profiles. Kernels that are not
    /// profiled are compiled faster without.
    const COUNTED: bool = true;

    /// Runs over all segments of `on.batches`, in order.
    fn run<L: Lanes, F: KernelFeatures>(&self, on: PassInput<'_>);
}

/// The lanes that a pass runs at: a width, or one lane that counts its operations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PassWidth {
    /// Lanes per instruction.
    pub width: LaneWidth,
    /// Whether operations are counted; then the width is 1.
    pub counted: bool,
}

/// A [`Pass`] behind a pointer: what [`super::Passes::run`] takes.
pub trait AnyPass {
    /// Runs the instance for this width and these features.
    fn run_at(&self, width: PassWidth, features: &Features, on: PassInput<'_>);
}

impl<P: Pass> AnyPass for P {
    fn run_at(&self, width: PassWidth, features: &Features, on: PassInput<'_>) {
        match width.width {
            #[cfg(feature = "count")]
            LaneWidth::W1 if width.counted && P::COUNTED => {
                with_features::<P, crate::engine::lanes::Counted>(self, features, on);
            }
            LaneWidth::W1 => with_features::<P, f32>(self, features, on),
            LaneWidth::W4 => with_features::<P, wide::f32x4>(self, features, on),
            LaneWidth::W8 => with_features::<P, wide::f32x8>(self, features, on),
            LaneWidth::W16 => with_features::<P, wide::f32x16>(self, features, on),
        }
    }
}

fn with_features<P: Pass, L: Lanes>(pass: &P, features: &Features, on: PassInput<'_>) {
    match (features.rotation, features.friction, features.two_points) {
        (false, false, false) => pass.run::<L, Kernel<false, false, 1>>(on),
        (true, false, false) => pass.run::<L, Kernel<true, false, 1>>(on),
        (true, true, false) => pass.run::<L, Kernel<true, true, 1>>(on),
        (true, false, true) => pass.run::<L, Kernel<true, false, 2>>(on),
        (true, true, true) => pass.run::<L, Kernel<true, true, 2>>(on),
        // Friction and a second point act through rotation.
        (false, ..) => unreachable!("friction or a second point without rotation"),
    }
}
