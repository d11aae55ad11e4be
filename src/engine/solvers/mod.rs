//! Solver variants, one file each; [`VARIANTS`] is the table that everything iterates.
//!
//! A variant is a schedule of passes over a [`Problem`] and a
//! [`NormalRule`](crate::engine::constraints::NormalRule) or two.
//! Variants never import one another. `pgs.rs` is the tutorial: it explains the whole
//! method, the others only what differs.

use crate::engine::clock::Clock;
use crate::engine::constraints::{Kernel, KernelFeatures, Problem, StepInput, WorkCount, Workspace};
use crate::engine::contacts::Contact;
use crate::engine::error::Error;
use crate::engine::lanes::{Counted, LaneWidth, Lanes};
use crate::engine::params::Budget;

pub mod pgs;
pub mod projection;
pub mod soft_step;

/// A solver: what it does within one step.
pub trait Solver {
    /// Runs the step's schedule on a prepared problem.
    fn step<L: Lanes, N: KernelFeatures>(problem: &mut Problem<'_, L, N>);
}

/// Which fields of a [`Budget`] a solver's schedule has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Uses {
    /// [`Budget::velocity_iterations`]
    pub velocity: bool,
    /// [`Budget::relax_iterations`]
    pub relax: bool,
    /// [`Budget::position_iterations`]
    pub position: bool,
}

/// A row of [`VARIANTS`].
#[derive(Debug)]
pub struct Variant {
    /// Name on the command line; also the name of its file.
    pub name: &'static str,
    /// Key in `papers/README.md`.
    pub source: &'static str,
    /// One line for lists.
    pub summary: &'static str,
    /// Its standard budget.
    pub budget: Budget,
    /// The budget fields it reads, besides `substeps`.
    pub uses: Uses,
    /// Angular frequencies (rad/s) of its soft contacts, between dynamic bodies and with
    /// others, from the stiffness asked for (Hz) and the substep (s); none if its contacts are
    /// not springs. At rest such a contact gives way, and metrics tell that from error.
    pub softness: Option<fn(f32, f32) -> [f32; 2]>,
    run: Run,
}

type Run = fn(&mut Workspace, &mut [Contact], &mut Clock, &StepInput, LaneWidth) -> WorkCount;

/// Every solver of the crate.
pub static VARIANTS: [Variant; 3] = [
    Variant {
        name: "projection",
        source: "article",
        summary: "positions pushed apart, then approach velocities removed; no memory, no friction",
        budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 4 },
        uses: Uses { velocity: true, relax: false, position: true },
        softness: None,
        run: dispatch::<projection::Projection>,
    },
    Variant {
        name: "pgs",
        source: "catto2006",
        summary: "sequential impulses with warm starting and Baumgarte stabilisation",
        budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
        uses: Uses { velocity: true, relax: false, position: false },
        softness: None,
        run: dispatch::<pgs::Pgs>,
    },
    Variant {
        name: "soft_step",
        source: "catto2024solver2d",
        summary: "substeps, soft contacts and a relaxing sweep without position feedback",
        budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
        uses: Uses { velocity: true, relax: true, position: false },
        softness: Some(soft_step::angular_frequencies),
        run: dispatch::<soft_step::SoftStep>,
    },
];

/// The solver that is used where none is named.
pub const DEFAULT: &str = "soft_step";

/// The variant called `name`.
pub fn find(name: &str) -> Result<&'static Variant, Error> {
    let known = || VARIANTS.iter().map(|v| v.name).collect();
    let unknown = || Error::Unknown { kind: "solver", name: name.into(), known: known() };
    VARIANTS.iter().find(|v| v.name == name).ok_or_else(unknown)
}

impl Variant {
    /// Prepares and solves one step; returns what was done.
    pub fn run(
        &self,
        work: &mut Workspace,
        contacts: &mut [Contact],
        clock: &mut Clock,
        input: &StepInput,
        width: LaneWidth,
    ) -> WorkCount {
        (self.run)(work, contacts, clock, input, width)
    }
}

/// From values to types, once per step: the width, then the needs.
fn dispatch<S: Solver>(
    work: &mut Workspace,
    contacts: &mut [Contact],
    clock: &mut Clock,
    input: &StepInput,
    width: LaneWidth,
) -> WorkCount {
    match width {
        LaneWidth::W1 if clock.counts() => with_width::<S, Counted>(work, contacts, clock, input),
        LaneWidth::W1 => with_width::<S, f32>(work, contacts, clock, input),
        LaneWidth::W4 => with_width::<S, wide::f32x4>(work, contacts, clock, input),
        LaneWidth::W8 => with_width::<S, wide::f32x8>(work, contacts, clock, input),
        LaneWidth::W16 => with_width::<S, wide::f32x16>(work, contacts, clock, input),
    }
}

fn with_width<S: Solver, L: Lanes>(
    work: &mut Workspace,
    contacts: &mut [Contact],
    clock: &mut Clock,
    input: &StepInput,
) -> WorkCount {
    let features = &input.features;
    let run = match (features.rotation, features.friction, features.two_points) {
        (false, false, false) => with_features::<S, L, Kernel<false, false, 1>>,
        (true, false, false) => with_features::<S, L, Kernel<true, false, 1>>,
        (true, true, false) => with_features::<S, L, Kernel<true, true, 1>>,
        (true, false, true) => with_features::<S, L, Kernel<true, false, 2>>,
        (true, true, true) => with_features::<S, L, Kernel<true, true, 2>>,
        // Friction and a second point act through rotation.
        (false, ..) => unreachable!("friction or a second point without rotation"),
    };
    run(work, contacts, clock, input)
}

fn with_features<S: Solver, L: Lanes, N: KernelFeatures>(
    work: &mut Workspace,
    contacts: &mut [Contact],
    clock: &mut Clock,
    input: &StepInput,
) -> WorkCount {
    let mut problem = Problem::<L, N>::new(work, contacts, clock, input);
    S::step(&mut problem);
    problem.finish()
}
