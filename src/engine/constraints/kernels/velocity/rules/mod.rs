//! Rules of normal rows shared by several solvers, each with its derivation; [`Rule`] is any of them.
//!
//! Many solvers differ only in their rule; the [sweep](crate::constraints::kernels::velocity::sweep)
//! around it is shared. A solver can define its own rule by implementing [`NormalRule`].

mod baumgarte;
mod rigid;
mod soft;
mod touching;
mod variations;

pub use crate::constraints::kernels::velocity::sweep::NormalRule;
pub use baumgarte::Baumgarte;
pub use rigid::Rigid;
pub use soft::{Bearing, Soft, Softness, angular_frequencies, bounded_errors};
pub use touching::Touching;
pub use variations::{Frictionless, Relaxed, Turned};

use crate::constraints::kernels::velocity::sweep::{Sweep, VelocitySweep};

/// A rule as a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rule {
    /// [`Rigid`]
    Rigid(Sweep<Rigid>),
    /// [`Soft`]
    Soft(Sweep<Soft>),
    /// [`Baumgarte`]
    Baumgarte(Sweep<Baumgarte>),
    /// [`Touching`]
    Touching(Sweep<Touching>),
    /// [`Soft`] without friction rows
    SoftNormal(Sweep<Frictionless<Soft>>),
    /// [`Soft`] with arms that turn with their bodies
    SoftTurned(Sweep<Turned<Soft>>),
    /// [`Baumgarte`], over- or under-relaxed
    BaumgarteRelaxed(Sweep<Relaxed<Baumgarte>>),
}

impl Rule {
    /// The sweep under this rule.
    pub fn sweep(&mut self) -> &mut dyn VelocitySweep {
        match self {
            Rule::Rigid(sweep) => sweep,
            Rule::Soft(sweep) => sweep,
            Rule::Baumgarte(sweep) => sweep,
            Rule::Touching(sweep) => sweep,
            Rule::SoftNormal(sweep) => sweep,
            Rule::SoftTurned(sweep) => sweep,
            Rule::BaumgarteRelaxed(sweep) => sweep,
        }
    }
}
