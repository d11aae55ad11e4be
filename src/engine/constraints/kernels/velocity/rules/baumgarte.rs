//! Rigid contacts with Baumgarte stabilization.

use super::{Relaxed, Rule, Softness};
use crate::constraints::kernels::velocity::sweep::{NormalRule, Sweep};
use crate::lanes::Lanes;

/// λ ← max(0, λ − m_eff (v_n + b)), with the bias velocity of `baumgarte1972`:
///
/// ```text
/// b = s/h                           s > 0   close the gap, no more
/// b = max(β (s + slop)/h, −v_max)   s < −slop
/// b = 0                             between
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Baumgarte {
    /// 1/h (1/s)
    pub inv_h: f32,
    /// β/h (1/s)
    pub rate: f32,
    /// Overlap that is not corrected (m).
    pub slop: f32,
    /// v_max (m/s)
    pub push_speed: f32,
}

impl Baumgarte {
    /// The rule as a value. It removes `fraction` of the overlap beyond `slop` (m) in each substep of `h`
    /// (s), at no more than `push_speed` (m/s).
    pub fn rule(fraction: f32, slop: f32, push_speed: f32, h: f32) -> Rule {
        Rule::Baumgarte(Sweep(Self::new(fraction, slop, push_speed, h)))
    }

    /// As [`Self::rule`], but not wrapped in [`Rule`].
    pub fn new(fraction: f32, slop: f32, push_speed: f32, h: f32) -> Self {
        let inv_h = 1.0 / h;
        Baumgarte { inv_h, rate: fraction * inv_h, slop, push_speed }
    }

    /// Bias velocity b (m/s) at a separation (m).
    pub fn bias<L: Lanes>(&self, separation: L) -> L {
        -self.line(false, separation, L::splat(1.0), L::zero())[0]
    }

    /// As [`Self::rule`], with the increment of each row multiplied by `relaxation`.
    pub fn relaxed(fraction: f32, slop: f32, push_speed: f32, h: f32, relaxation: f32) -> Rule {
        let rule = Self::new(fraction, slop, push_speed, h);
        Rule::BaumgarteRelaxed(Sweep(Relaxed { rule, factor: relaxation }))
    }
}

impl NormalRule for Baumgarte {
    const FRICTION: bool = true;

    fn of_errors(&self) -> Softness {
        Softness { bias_rate: self.rate, push_speed: self.push_speed, ..Softness::RIGID }
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, _against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let gap = separation.max(L::zero()) * L::splat(self.inv_h);
        let overlap = (separation + L::splat(self.slop)).min(L::zero());
        let push = (overlap * L::splat(self.rate)).max(L::splat(-self.push_speed));
        [mass.neg_mul_add(gap + push, old), mass]
    }
}
