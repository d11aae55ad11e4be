//! Impacts: what happens when bodies hit each other.
//!
//! | law | what it does |
//! |---|---|
//! | [`ImpactLaw::None`] | nothing bounces, whatever the coefficients of restitution |
//! | [`ImpactLaw::Bias`] | the rebound speed of a point is the target of its row ([`bias`]) |
//! | [`ImpactLaw::EndPass`] | one pass at the end of the step gives points that speed ([`restitution`]) |
//! | [`ImpactLaw::Waves`] | bodies bounce before the step, wave by wave (`spread`) |
//! | [`ImpactLaw::Solver`] | the solver's schedule does it |

use crate::constraints::records::bounces::Bounces;
use crate::params::RESTITUTION_THRESHOLD;

#[doc(hidden)]
pub mod bias;
#[doc(hidden)]
pub mod restitution;
pub(crate) mod spread;
pub(crate) mod touch;

/// Choice of the impact law of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum Impacts {
    /// The impact law of the solver's source.
    #[default]
    Own,
    /// Waves of impacts before the step.
    Waves,
    /// None: nothing bounces.
    None,
}

impl Impacts {
    /// Every choice.
    pub const ALL: [Impacts; 3] = [Impacts::Own, Impacts::Waves, Impacts::None];

    /// Name on the command line and in records.
    pub fn name(self) -> &'static str {
        match self {
            Impacts::Own => "own",
            Impacts::Waves => "waves",
            Impacts::None => "none",
        }
    }

    /// The impact law of a step under a solver whose own law is `own`.
    pub fn law(self, own: ImpactLaw) -> ImpactLaw {
        match self {
            Impacts::Own => own,
            Impacts::Waves => ImpactLaw::Waves,
            Impacts::None => ImpactLaw::None,
        }
    }
}

/// How impacts are solved; see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ImpactLaw {
    /// Nothing bounces.
    None,
    /// The rebound speed is the target of the rows.
    Bias,
    /// A pass at the end of the step.
    EndPass {
        /// Approach speed above which a point bounces (m/s).
        threshold: f32,
        /// Points that carried an impulse in the previous step bounce only if e ≥ 1.
        only_new: bool,
    },
    /// Waves before the step, and a pass at its end for bodies that others push together.
    Waves,
    /// Part of the solver's own schedule. The fields are the sizes of its side records.
    Solver {
        /// Lane vectors per contact.
        per_contact: usize,
        /// Lane vectors per contact point.
        per_point: usize,
    },
}

impl ImpactLaw {
    /// As in Box2D 3 (`catto2024box2d`).
    pub const BOX2D: ImpactLaw = ImpactLaw::EndPass { threshold: RESTITUTION_THRESHOLD, only_new: false };
    /// As in rapier (`crozet2025rapier`).
    pub const RAPIER: ImpactLaw = ImpactLaw::EndPass { threshold: 0.0, only_new: true };

    /// One line for lists.
    pub fn summary(self) -> &'static str {
        match self {
            ImpactLaw::None => "none",
            ImpactLaw::Bias => "velocity bias of the rows",
            ImpactLaw::EndPass { only_new: false, .. } => "pass at the end of the step",
            ImpactLaw::EndPass { only_new: true, .. } => "pass at the end of the step, new points",
            ImpactLaw::Waves => "waves before the step",
            ImpactLaw::Solver { .. } => "part of the solver",
        }
    }

    /// Lane vectors in the side record of a contact with `points` points.
    pub fn stride(self, points: usize) -> usize {
        match self {
            ImpactLaw::None => 0,
            ImpactLaw::Bias => bias::stride(points),
            ImpactLaw::EndPass { .. } => restitution::stride(points),
            ImpactLaw::Waves => 0,
            ImpactLaw::Solver { per_contact, per_point } => per_contact + points * per_point,
        }
    }
}

/// Side records for restitution.
#[derive(Clone, Debug, Default)]
pub struct ImpactRecords {
    /// Side records of the colored batches, then of the serial ones.
    pub bounces: [Bounces; 2],
    /// Impacts before the step.
    pub(crate) spread: spread::ImpactPropagation,
}
