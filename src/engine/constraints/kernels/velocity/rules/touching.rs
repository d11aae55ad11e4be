//! Rigid contacts at touching points only.

use super::Rule;
use crate::constraints::kernels::velocity::sweep::{NormalRule, Sweep};
use crate::lanes::Lanes;

/// λ ← max(0, λ − m_eff v_n) at touching points, s < slop; other points keep their impulse. No friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touching {
    /// Largest gap of a touching point (m).
    pub slop: f32,
}

impl Touching {
    /// The rule with points within `slop` (m) counted as touching, wrapped in [`Rule`].
    pub fn rule(slop: f32) -> Rule {
        Rule::Touching(Sweep(Touching { slop }))
    }
}

impl NormalRule for Touching {
    const FRICTION: bool = false;

    #[inline(always)]
    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        [old, (L::splat(self.slop) - separation).select_positive(mass, L::zero())]
    }
}
