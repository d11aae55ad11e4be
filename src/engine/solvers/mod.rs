#![doc = include_str!("README.md")]
//!
//! # Example
//!
//! Two solvers on the same stack:
//!
//! ```
//! use simpulse_engine::prelude::*;
//!
//! let sag = |solver| -> Result<f32, Box<dyn std::error::Error>> {
//!     let mut world = World::new(Settings::new(solver));
//!     world.add_body(&BodyDef::fixed([0.0, -1.0]).with(ShapeDef::rectangle(50.0, 1.0)?))?;
//!     for i in 0..5 {
//!         let cube = ShapeDef::rectangle(0.5, 0.5)?;
//!         world.add_body(&BodyDef::dynamic([0.0, f64::from(i) + 0.5]).with(cube))?;
//!     }
//!     for _ in 0..120 {
//!         world.step()?;
//!     }
//!     let overlaps = world.contacts.iter().map(|c| -c.manifold.points[0].separation);
//!     Ok(overlaps.fold(0.0, f32::max))
//! };
//! assert!(sag(solvers::SHIM)? < 0.5 * sag(solvers::SOFT_STEP)?);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::clock::Clock;
use crate::constraints::records::kept::StateSize;
use crate::constraints::{ImpactLaw, Passes, Schedule, Solver, StepInput, WorkCount, Workspace};
use crate::contacts::Contact;
use crate::error::Error;
use crate::lanes::LaneWidth;
use crate::narrowphase::frozen::FreezeLimits;
use crate::params::{Budget, MAX_PARAMETERS, Mechanism, Parameter, Parameters};

pub mod admm;
pub mod anderson;
pub mod apgd;
pub mod avbd;
pub mod barzilai_borwein;
pub mod box2d;
pub mod direct;
pub mod jacobi;
pub mod jolt;
pub mod local_gs;
pub mod mass_splitting;
pub mod nncg;
pub mod nsgs;
pub mod pgs;
pub mod pgs_ngs;
pub mod pgs_ngs_block;
pub mod pgs_soft;
pub mod pgs_substeps;
pub mod physx;
pub mod projection;
pub mod random_order;
pub mod rapier;
pub mod sap;
pub mod shim;
pub mod shock;
pub mod soft_step;
pub mod sor;
pub mod split_impulse;
pub mod staggered;
pub mod symmetric_gs;
pub mod tgs_ngs;
pub mod tgs_soft;
pub mod tgs_sticky;
pub mod xpbd;

/// The solvers as values, and the table of them.
macro_rules! table {
    ($($name:ident = $file:ident,)*) => {
        $(
            #[doc = concat!("[`", stringify!($file), "`]")]
            pub const $name: &Variant = &$file::SOLVER;
        )*

        /// Every solver of the crate.
        pub static VARIANTS: [&Variant; 34] = [$($name),*];
    };
}

table! {
    PROJECTION = projection,
    PGS = pgs,
    PGS_NGS = pgs_ngs,
    PGS_NGS_BLOCK = pgs_ngs_block,
    PGS_SOFT = pgs_soft,
    PGS_SUBSTEPS = pgs_substeps,
    SYMMETRIC_GS = symmetric_gs,
    SOR = sor,
    RANDOM_ORDER = random_order,
    LOCAL_GS = local_gs,
    NSGS = nsgs,
    NNCG = nncg,
    ANDERSON = anderson,
    APGD = apgd,
    BARZILAI_BORWEIN = barzilai_borwein,
    STAGGERED = staggered,
    ADMM = admm,
    DIRECT = direct,
    SAP = sap,
    SHOCK = shock,
    SPLIT_IMPULSE = split_impulse,
    JACOBI = jacobi,
    MASS_SPLITTING = mass_splitting,
    TGS_NGS = tgs_ngs,
    TGS_SOFT = tgs_soft,
    TGS_STICKY = tgs_sticky,
    XPBD = xpbd,
    AVBD = avbd,
    SOFT_STEP = soft_step,
    SHIM = shim,
    BOX2D = box2d,
    RAPIER = rapier,
    PHYSX = physx,
    JOLT = jolt,
}

/// Name of the solver used if none is given: [`SHIM`].
pub const DEFAULT: &str = "shim";

/// The fields of a [`Budget`] that a solver's schedule uses.
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

/// A property that tests check for every solver, unless its row declares an exception.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Guarantee {
    /// All lane widths give the same bits.
    SameBits,
    /// Impulses act on two bodies with opposite signs.
    Momentum,
    /// Tangential impulses stay within the friction cone.
    Cone,
    /// A step allocates nothing.
    NoAllocation,
    /// More iterations on one problem converge to the solver's own law.
    Converges,
    /// Piles of a few boxes stay at rest at the standard budget.
    Rest,
}

/// A row of [`VARIANTS`].
///
/// A solver defined outside the crate needs no row in the table to run:
///
/// ```
/// use simpulse_engine::clock::Phase;
/// use simpulse_engine::constraints::kernels::velocity::rules::Baumgarte;
/// use simpulse_engine::constraints::{Passes, Schedule};
/// use simpulse_engine::solvers::Variant;
/// use simpulse_engine::world::{Settings, World};
///
/// static MINE: Variant = Variant { name: "mine", make: || Schedule::boxed(step), ..Variant::BASE };
///
/// fn step(passes: &mut Passes<'_>) {
///     let rule = Baumgarte::rule(0.2, 0.005, 3.0, passes.h());
///     passes.integrate_velocities();
///     passes.warm_start();
///     for _ in 0..passes.budget().velocity_iterations {
///         passes.sweep(Phase::Solve, &rule);
///         passes.iteration_done();
///     }
///     passes.integrate_positions();
///     passes.end_substep(0);
/// }
///
/// let mut world = World::new(Settings::new(&MINE));
/// world.step()?;
/// # Ok::<(), simpulse_engine::world::StepError>(())
/// ```
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
    /// The budget of `k` iterations as the solver counts them, without substeps; used to measure convergence.
    pub iterations: fn(standard: Budget, k: u32) -> Budget,
    /// Its own parameters, [`MAX_PARAMETERS`] at most.
    pub parameters: &'static [Parameter],
    /// Mechanisms that a run can switch off, see [`Variant::mechanism`]; 32 at most.
    pub mechanisms: &'static [Mechanism],
    /// Angular frequencies (rad/s) of its soft contacts, between dynamic bodies and with other bodies, from
    /// its parameters and the substep (s); `None` if its contacts are not springs. A soft contact deflects
    /// under load even at rest, and metrics do not count that deflection as an error.
    pub softness: Option<fn(&Parameters, f32) -> [f32; 2]>,
    /// Impact law of its source.
    pub impacts: ImpactLaw,
    /// Limits within which its source [freezes](crate::narrowphase::frozen) contacts; `None` if it does not.
    pub frozen: Option<FreezeLimits>,
    /// Default of [continuous collision](crate::continuous).
    pub continuous: bool,
    /// Whether islands see each other.
    pub islands: Islands,
    /// Numbers kept from step to step, in addition to impulses.
    pub kept: StateSize,
    /// Why it does not support joints, if it does not.
    pub joints_unsupported: Option<&'static str>,
    /// Properties that it does not have, with the reason.
    pub exceptions: &'static [(Guarantee, &'static str)],
    /// Creates the solver of a world: its schedule and its state.
    pub make: fn() -> Box<dyn Solver>,
}

/// Whether islands, which do not touch, see each other in the arithmetic of a solver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Islands {
    /// They do not, however many it is given.
    Apart,
    /// It couples all that it is given, for example by a common step length or a norm. So it is given one at a time, except in
    /// worlds with joints, and in other orders than by color.
    Alone,
    /// It couples all, and keeps more than impulses from step to step. It is given the whole world.
    Together,
}

/// Errors: a value out of the parameter's range.
fn in_range(parameter: &Parameter, value: f32) -> Result<(), Error> {
    let Parameter { name, unit, range: [least, greatest], .. } = *parameter;
    if (least..=greatest).contains(&value) {
        return Ok(());
    }
    let message = format!("{value} is not within {least} to {greatest} {unit}");
    Err(Error::invalid(name, message.trim_end()))
}

/// The variant called `name`.
pub fn find(name: &str) -> Result<&'static Variant, Error> {
    let known = || VARIANTS.iter().map(|v| v.name).collect();
    let unknown = || Error::Unknown { kind: "solver", name: name.into(), known: known() };
    VARIANTS.iter().copied().find(|v| v.name == name).ok_or_else(unknown)
}

impl Variant {
    /// Defaults of most rows: sequential impulses in one substep, counted in velocity sweeps.
    pub const BASE: Variant = Variant {
        name: "",
        source: "",
        summary: "",
        budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
        uses: Uses { velocity: true, relax: false, position: false },
        iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, ..standard },
        parameters: &[],
        mechanisms: &[],
        softness: None,
        impacts: ImpactLaw::Bias,
        frozen: None,
        continuous: false,
        islands: Islands::Together,
        kept: StateSize::NONE,
        joints_unsupported: None,
        exceptions: &[],
        make: || Schedule::boxed(|_| {}),
    };

    /// Wraps [`Self::make`] of the solvers of this crate. A static is compiled together with everything that
    /// it refers to, used or not. Unit tests create no solver, and so need not compile any.
    pub(crate) const fn made_by(make: fn() -> Box<dyn Solver>) -> fn() -> Box<dyn Solver> {
        if cfg!(test) { || unreachable!("unit tests make no solver") } else { make }
    }

    /// The budget of `k` iterations as the solver counts them, without substeps.
    pub fn of_iterations(&self, k: u32) -> Budget {
        (self.iterations)(self.budget, k)
    }

    /// Default values of its parameters.
    pub fn defaults(&self) -> Parameters {
        let mut values = [0.0; MAX_PARAMETERS];
        for (value, parameter) in values.iter_mut().zip(self.parameters) {
            *value = parameter.default;
        }
        values
    }

    /// Index of the parameter called `name`; hyphens count as underscores. Errors: no such parameter.
    pub fn parameter(&self, name: &str) -> Result<usize, Error> {
        let plain = name.replace('-', "_");
        self.parameters.iter().position(|p| p.name == plain).ok_or_else(|| Error::Unknown {
            kind: "parameter",
            name: name.into(),
            known: self.parameters.iter().map(|p| p.name).collect(),
        })
    }

    /// Sets the parameter called `name`. Errors: no such parameter, or a value out of its range.
    pub fn set(&self, values: &mut Parameters, name: &str, value: f32) -> Result<(), Error> {
        let place = self.parameter(name)?;
        in_range(&self.parameters[place], value)?;
        values[place] = value;
        Ok(())
    }

    /// Checks values of its parameters. Errors: one out of its range.
    pub fn check(&self, values: &Parameters) -> Result<(), Error> {
        self.parameters.iter().zip(values).try_for_each(|(parameter, &value)| in_range(parameter, value))
    }

    /// Index of the mechanism called `name`, for [`crate::params::Without`]; hyphens count as
    /// underscores. Errors: no such mechanism.
    pub fn mechanism(&self, name: &str) -> Result<usize, Error> {
        let plain = name.replace('-', "_");
        self.mechanisms.iter().position(|m| m.name == plain).ok_or_else(|| Error::Unknown {
            kind: "mechanism",
            name: name.into(),
            known: self.mechanisms.iter().map(|m| m.name).collect(),
        })
    }

    /// Whether it gives this guarantee.
    pub fn promises(&self, guarantee: Guarantee) -> bool {
        self.exceptions.iter().all(|(broken, _)| *broken != guarantee)
    }
}

/// Prepares and solves one step; returns the work done.
pub fn run(
    solver: &mut dyn Solver,
    work: &mut Workspace,
    contacts: &mut [Contact],
    clock: &mut Clock,
    input: &StepInput,
    width: LaneWidth,
) -> WorkCount {
    let mut passes = Passes::new(work, contacts, clock, input, width);
    solver.step(&mut passes);
    passes.finish()
}
