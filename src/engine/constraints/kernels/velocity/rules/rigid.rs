//! Rigid contacts: no approach velocity, no position feedback.

use super::Rule;
use crate::constraints::kernels::velocity::sweep::{NormalRule, Sweep};
use crate::lanes::Lanes;

/// λ ← max(0, λ − m_eff (v_n + max(s, 0)/h)): gaps may just close; overlap is not corrected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// 1/h (1/s)
    pub inv_h: f32,
}

impl Rigid {
    /// The rule in substeps of `h` (s).
    pub fn new(h: f32) -> Self {
        Rigid { inv_h: 1.0 / h }
    }

    /// As [`Self::new`], wrapped in [`Rule`].
    pub fn rule(h: f32) -> Rule {
        Rule::Rigid(Sweep(Self::new(h)))
    }
}

impl NormalRule for Rigid {
    const FRICTION: bool = true;

    #[inline(always)]
    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let gap = separation.max(L::zero()) * L::splat(self.inv_h);
        [mass.neg_mul_add(gap, old), mass]
    }
}
