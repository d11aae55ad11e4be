//! Settings of a world.

use crate::bodies::def::{finite_pair, not_negative};
use crate::broadphase::BroadPhaseKind;
use crate::constraints::kernels::motion::{Integrator, RotationUpdate};
use crate::constraints::{Features, ImpactLaw, Impacts};
use crate::error::Error;
use crate::lanes::{LaneWidth, native_width};
use crate::narrowphase::frozen::{FreezeLimits, Freezing};
use crate::params::{Budget, Parameters, Without};
use crate::solvers::{self, Islands, Variant};

/// Default of [`Settings::group_size`]: with records of 100 to 200 bytes per contact and copies of 128, groups take half of a
/// second-level cache of 1 MiB.
pub const GROUP_SIZE: usize = 2048;

/// The order in which constraints are solved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Order {
    /// One after the other, sorted by shape pair (width 1 only).
    Natural,
    /// The natural order reversed (width 1 only).
    Reversed,
    /// One after the other, sorted by a hash of the shape pair: persisting contacts keep their order (width 1
    /// only).
    Shuffled,
    /// Color by color.
    Colored,
}

impl Order {
    /// Every order.
    pub const ALL: [Order; 4] = [Order::Natural, Order::Reversed, Order::Shuffled, Order::Colored];

    /// Name on the command line and in records.
    pub fn name(self) -> &'static str {
        match self {
            Order::Natural => "natural",
            Order::Reversed => "reversed",
            Order::Shuffled => "shuffled",
            Order::Colored => "colored",
        }
    }

    /// Whether contacts are solved one by one, in one lane.
    pub fn is_serial(self) -> bool {
        self != Order::Colored
    }
}

/// Settings of a world: solver, budget, lanes, step, gravity and options.
///
/// ```
/// use simpulse_engine::{params::Budget, solvers, world::Settings};
///
/// let mut settings = Settings {
///     gravity: [0.0, -1.6],
///     budget: Budget { substeps: 8, ..solvers::SOFT_STEP.budget },
///     ..Settings::new(solvers::SOFT_STEP)
/// };
/// // A parameter of the solver's own, by name; its range is checked.
/// settings.solver.set(&mut settings.parameters, "contact_hertz", 60.0)?;
/// assert!(settings.solver.set(&mut settings.parameters, "contact_hertz", -1.0).is_err());
/// # Ok::<(), simpulse_engine::error::Error>(())
/// ```
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    /// The solver: a row of [`crate::solvers::VARIANTS`].
    #[cfg_attr(feature = "serde", serde(with = "super::saved::solver"))]
    pub solver: &'static Variant,
    /// Maximum number of lanes per instruction.
    #[cfg_attr(feature = "serde", serde(rename = "lanes", with = "super::saved::lanes"))]
    pub width: LaneWidth,
    /// Minimum number of lanes that the engine may fall back to when colors are small; see [`Self::exactly`].
    /// Every width gives the same bits.
    #[cfg_attr(feature = "serde", serde(rename = "narrowest_lanes", with = "super::saved::lanes"))]
    pub narrowest: LaneWidth,
    /// Order in which constraints are solved.
    pub order: Order,
    /// Work per step.
    pub budget: Budget,
    /// Gravity (m/s²).
    pub gravity: [f32; 2],
    /// Time step (s).
    pub dt: f32,
    /// Size of typical bodies (m). The engine's own lengths and speeds, such as the slop and the push speed
    /// ([`crate::params`]), are chosen for bodies of about a meter. They are multiplied by this, and
    /// so are `parameters` in m and m/s. A scene therefore moves in the same way at any scale.
    #[cfg_attr(feature = "serde", serde(default = "super::saved::one"))]
    pub length_unit: f32,
    /// Values of the solver's own parameters, see [`Variant::set`].
    pub parameters: Parameters,
    /// Disabled mechanisms of the solver, see [`Variant::mechanism`].
    #[cfg_attr(feature = "serde", serde(default))]
    pub without: Without,
    /// How impacts are solved: by the solver's own law, by waves of impacts before the step, or without
    /// bounce.
    pub impacts: Impacts,
    /// Whether contacts keep their normal and lever arms while bodies hardly move.
    #[cfg_attr(feature = "serde", serde(default))]
    pub frozen: Freezing,
    /// Sum impulses over the substeps into [`crate::contacts::Contact::step_impulse`].
    pub record_impulses: bool,
    /// Find [`World::contact_events`](crate::world::World::contact_events) after each step. In the first such step, contacts that
    /// exist already begin.
    pub contact_events: bool,
    /// Keep the rule of each step's last velocity sweep, see [`crate::world::World::observed_rule`].
    pub observe_rule: bool,
    /// Read the clock around every phase.
    pub timed: bool,
    /// How candidate pairs are found.
    pub broadphase: BroadPhaseKind,
    /// How velocities move bodies.
    pub integrator: Integrator,
    /// How angular velocities rotate bodies.
    pub rotation: RotationUpdate,
    /// Continuous collision: stop fast bodies at surfaces that they would otherwise pass through, see
    /// [`crate::continuous`].
    pub continuous: bool,
    /// Threads that share a step, the calling one included; 0 counts as 1, and there are at most
    /// [`MOST_THREADS`](crate::workers::MOST_THREADS). Every number gives the same bits. Small scenes use one.
    #[cfg_attr(feature = "serde", serde(default = "super::saved::one_thread"))]
    pub threads: usize,
    /// Number of contacts in a group of islands, which is solved while its data are in the cache; 0: the whole world at once.
    /// Every number gives the same bits.
    #[cfg_attr(feature = "serde", serde(default = "super::saved::group_size"))]
    pub group_size: usize,
    /// Islands that have rested for half a second sleep: they are not solved until a body, an edit or a change of settings
    /// wakes them. What moves by less than 5 mm in that time counts as at rest, also if a slow motor drives it. Not for
    /// solvers that need the whole world, nor, with joints or in other orders than by color, for those that need an island
    /// alone ([`Variant::islands`]).
    #[cfg_attr(feature = "serde", serde(default))]
    pub sleep: bool,
    /// Extra kernel features to compile in, to measure their cost.
    pub extra_features: Features,
}

/// Standard settings of [`solvers::SHIM`], the solver that fails least.
impl Default for Settings {
    fn default() -> Self {
        Settings::new(solvers::SHIM)
    }
}

impl Settings {
    /// Standard settings of `solver`: its budget, the widest lanes that this build has instructions for,
    /// colored order, gravity (0, −10) m/s², a step of 1/60 s.
    pub fn new(solver: &'static Variant) -> Self {
        Settings {
            solver,
            width: native_width(),
            narrowest: native_width().min(LaneWidth::W4),
            order: Order::Colored,
            budget: solver.budget,
            gravity: [0.0, -10.0],
            dt: 1.0 / 60.0,
            length_unit: 1.0,
            parameters: solver.defaults(),
            without: Without::default(),
            impacts: Impacts::Own,
            frozen: Freezing::Own,
            record_impulses: false,
            contact_events: false,
            observe_rule: false,
            timed: false,
            broadphase: BroadPhaseKind::default(),
            integrator: Integrator::default(),
            rotation: RotationUpdate::default(),
            continuous: solver.continuous,
            threads: 1,
            group_size: GROUP_SIZE,
            sleep: false,
            extra_features: Features::NONE,
        }
    }

    /// Checks the values; each step does so first.
    ///
    /// Errors, with field and value: a `dt` or `length_unit` that is not positive and finite; no substeps, or so many that
    /// the reciprocal of [`Self::h`] is not finite; a gravity that is not finite; a limit of `frozen` that is negative or not
    /// finite; sleep with a solver whose islands see each other; a parameter out of its range.
    pub fn check(&self) -> Result<(), Error> {
        let positive = |place: &str, value: f32| {
            let message = || Error::invalid(place, format!("must be positive and finite, is {value:?}"));
            if value > 0.0 && value.is_finite() { Ok(()) } else { Err(message()) }
        };
        positive("dt", self.dt)?;
        positive("length_unit", self.length_unit)?;
        finite_pair("gravity", self.gravity.map(f64::from))?;
        let substeps = self.budget.substeps;
        if substeps == 0 || !self.h().recip().is_finite() {
            let message = format!("must be at least 1 and leave a substep of dt, is {substeps}");
            return Err(Error::invalid("budget.substeps", message));
        }
        if let Freezing::Within(FreezeLimits { distance, turn, .. }) = self.frozen {
            not_negative("frozen.distance", distance.into())?;
            not_negative("frozen.turn", turn.into())?;
        }
        if self.sleep && self.solver.islands == Islands::Together {
            let message = format!("{} solves all islands together, so none can sleep", self.solver.name);
            return Err(Error::invalid("sleep", message));
        }
        self.solver.check(&self.parameters).map_err(|e| e.within("parameters"))
    }

    /// The narrowest and the widest lanes, limited to those of this build.
    pub(crate) fn widths(&self) -> [LaneWidth; 2] {
        [self.narrowest, self.width].map(|width| width.min(LaneWidth::WIDEST))
    }

    /// Always uses `width` lanes, or the widest of [`LaneWidth::ALL`] if this build does not have as many,
    /// whatever the scene.
    pub fn exactly(self, width: LaneWidth) -> Self {
        Settings { width, narrowest: width, ..self }
    }

    /// The impact law of a step.
    pub fn impact_law(&self) -> ImpactLaw {
        self.impacts.law(self.solver.impacts)
    }

    /// Limits within which contacts are frozen (m, rad); `None` if they are not.
    pub(crate) fn freezing(&self) -> Option<FreezeLimits> {
        let limits = self.frozen.limits(self.solver.frozen)?;
        Some(FreezeLimits { distance: limits.distance * self.length_unit, ..limits })
    }

    /// The solver's parameters, with those in m and m/s multiplied by the length unit.
    pub(crate) fn scaled_parameters(&self) -> Parameters {
        let mut values = self.parameters;
        for (value, parameter) in values.iter_mut().zip(self.solver.parameters) {
            *value *= if matches!(parameter.unit, "m" | "m/s") { self.length_unit } else { 1.0 };
        }
        values
    }

    /// Length of a substep (s).
    pub fn h(&self) -> f32 {
        self.dt / self.budget.substeps as f32
    }
}
