//! Tuning constants with their units, and the budget of a step.
//!
//! Lengths and speeds are chosen for bodies of about a meter. For other sizes, a world's
//! [`length_unit`](crate::world::Settings::length_unit) multiplies all of them except gravity and
//! density.

/// Overlap that position correction leaves uncorrected (m), so that resting contacts persist. Larger: visible
/// overlap. Smaller: contacts flicker.
pub const LINEAR_SLOP: f32 = 0.005;

/// Points closer than this (m) become contacts before they touch, so that a step ends at the surface instead
/// of behind it. Four slops.
pub const SPECULATIVE_DISTANCE: f32 = 4.0 * LINEAR_SLOP;

/// Margin by which a shape's bounds are enlarged (m). Pairs are searched again only after a shape leaves its
/// enlarged bounds. Larger: more candidates. Smaller: more searches.
pub const AABB_MARGIN: f32 = 0.1;

/// Fraction of the overlap that Baumgarte stabilization removes per step (1).
pub const BAUMGARTE: f32 = 0.3;

/// Stiffness of a soft contact between two dynamic bodies (Hz); contacts with
/// static bodies use twice this.
pub const CONTACT_HERTZ: f32 = 30.0;

/// A soft contact's frequency is capped at this fraction of the substep rate (1).
pub const CONTACT_HERTZ_FRACTION: f32 = 0.125;

/// [`CONTACT_HERTZ_FRACTION`] of solvers without substeps (1).
pub const CONTACT_HERTZ_FRACTION_OF_STEP: f32 = 1.0 / 3.0;

/// Damping ratio of a soft contact (1), far above critical so that the contact does not bounce.
pub const CONTACT_DAMPING_RATIO: f32 = 10.0;

/// Maximum speed at which overlapping bodies are pushed apart (m/s).
pub const MAX_PUSH_SPEED: f32 = 3.0;

/// Maximum overlap that one position sweep removes at a point (m). Removing more would turn bodies further
/// than a linearized contact can follow.
pub const MAX_POSITION_CORRECTION: f32 = 0.2;

/// Approach speed above which contacts bounce (m/s), unless the solver's source states another.
pub const RESTITUTION_THRESHOLD: f32 = 1.0;

/// Maximum number of vertices of a convex polygon.
pub const MAX_POLYGON_VERTICES: usize = 8;

/// Default friction coefficient (1).
pub const DEFAULT_FRICTION: f64 = 0.6;

/// Default density (kg/m²).
pub const DEFAULT_DENSITY: f64 = 1.0;

/// Default gravity (m/s²).
pub const DEFAULT_GRAVITY: [f64; 2] = [0.0, -10.0];

/// Default step (s).
pub const DEFAULT_DT: f64 = 1.0 / 60.0;

/// Approach speed above which a contact reports a hit (m/s).
pub const HIT_SPEED: f32 = 1.0;

/// A body has diverged if its speed (length units per second) or its spin (rad/s) exceeds this.
pub const DIVERGED_SPEED: f32 = 1.0e5;

/// The work of one step.
///
/// Each solver uses the fields of its schedule and ignores the rest; its row in
/// [`crate::solvers::VARIANTS`] lists them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Budget {
    /// Number of equal substeps of a step (≥ 1).
    pub substeps: u32,
    /// Velocity sweeps over all constraints per substep, with position feedback.
    pub velocity_iterations: u32,
    /// Velocity sweeps per substep without position feedback.
    pub relax_iterations: u32,
    /// Position sweeps per substep.
    pub position_iterations: u32,
}

/// Maximum number of parameters of a solver.
pub const MAX_PARAMETERS: usize = 8;

/// A tunable number of a solver, in addition to its budget.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name for settings, records and the command line, in `snake_case`.
    pub name: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// Default value.
    pub default: f32,
    /// Smallest and largest value.
    pub range: [f32; 2],
    /// Its effect, in one line.
    pub meaning: &'static str,
    /// Values that `simpulse advise` tries; empty to keep the default.
    pub trials: &'static [f32],
}

/// A mechanism of a solver that a run can disable, to measure its effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mechanism {
    /// Name for settings, records and the command line, in `snake_case`.
    pub name: &'static str,
    /// Its purpose in one line.
    pub meaning: &'static str,
    /// A check that fails without it: a case of `simpulse verify`, a test, or `random` with a family and the
    /// kind of failure that becomes more frequent.
    pub case: &'static str,
}

impl Mechanism {
    pub(crate) const fn new(name: &'static str, case: &'static str, meaning: &'static str) -> Self {
        Mechanism { name, meaning, case }
    }
}

/// The set of a solver's disabled mechanisms, by index in its table; empty by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Without(u32);

impl Without {
    /// Also disables the mechanism at index `place`.
    #[must_use]
    pub const fn and(self, place: usize) -> Self {
        Without(self.0 | 1 << place)
    }

    /// Whether the mechanism at index `place` is disabled.
    pub const fn leaves_out(self, place: usize) -> bool {
        self.0 >> place & 1 == 1
    }
}

/// Parameters that several solvers share.
impl Parameter {
    /// Fraction of the overlap that Baumgarte stabilization removes.
    pub const BAUMGARTE: Parameter = Parameter {
        name: "baumgarte",
        unit: "",
        default: BAUMGARTE,
        range: [0.0, 1.0],
        meaning: "share of the overlap that is removed per step",
        trials: &[],
    };

    /// Fraction of the overlap that a position sweep removes.
    pub const CORRECTION: Parameter = Parameter {
        name: "correction",
        unit: "",
        default: 0.2,
        range: [0.0, 1.0],
        meaning: "share of the overlap that a position sweep removes",
        trials: &[],
    };

    /// Frequency of soft contacts, capped by [`CONTACT_HERTZ_FRACTION`].
    pub const CONTACT_HERTZ: Parameter = Parameter {
        name: "contact_hertz",
        unit: "Hz",
        default: CONTACT_HERTZ,
        range: [1e-3, 1e6],
        meaning: "stiffness of contacts; at most an eighth of the substep rate acts",
        trials: &[15.0, 30.0, 60.0, 120.0],
    };

    /// Frequency of soft contacts, capped by [`CONTACT_HERTZ_FRACTION_OF_STEP`].
    pub const CONTACT_HERTZ_OF_STEP: Parameter = Parameter {
        meaning: "stiffness of contacts; at most a third of the substep rate acts",
        ..Parameter::CONTACT_HERTZ
    };

    /// Damping of soft contacts.
    pub const DAMPING_RATIO: Parameter = Parameter {
        name: "damping_ratio",
        unit: "",
        default: CONTACT_DAMPING_RATIO,
        range: [0.0, 1e3],
        meaning: "damping of contacts; 1 is critical",
        trials: &[],
    };

    /// Maximum speed at which overlapping bodies are pushed apart, [`MAX_PUSH_SPEED`].
    pub const PUSH_SPEED: Parameter = Parameter::push_speed(MAX_PUSH_SPEED);

    /// [`Parameter::PUSH_SPEED`] with another default (m/s).
    pub const fn push_speed(default: f32) -> Parameter {
        Parameter {
            name: "push_speed",
            unit: "m/s",
            default,
            range: [0.0, 1e3],
            meaning: "fastest speed at which overlap is pushed apart",
            trials: &[],
        }
    }
}

/// Values of a solver's parameters in the order of its table, padded with zeros.
pub type Parameters = [f32; MAX_PARAMETERS];
