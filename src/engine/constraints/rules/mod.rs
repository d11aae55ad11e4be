//! Rules of normal rows that several solvers use, each with its derivation; [`Rule`] is any of them.
//!
//! A rule is the whole difference between many solvers; the [sweep](super::sweep) around it is shared.
//! A solver may bring its own: it implements [`NormalRule`].

mod baumgarte;
mod rigid;
mod soft;
mod touching;

pub use super::sweep::NormalRule;
pub use baumgarte::Baumgarte;
pub use rigid::Rigid;
pub use soft::{Soft, Softness};
pub use touching::Touching;

use super::sweep::{Sweep, VelocitySweep};

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
}

impl Rule {
    /// The sweep under this rule.
    pub fn sweep(&self) -> &dyn VelocitySweep {
        match self {
            Rule::Rigid(sweep) => sweep,
            Rule::Soft(sweep) => sweep,
            Rule::Baumgarte(sweep) => sweep,
            Rule::Touching(sweep) => sweep,
        }
    }
}
