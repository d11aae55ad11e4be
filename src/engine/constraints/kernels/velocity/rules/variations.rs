//! Rules built from other rules.

use super::{NormalRule, Softness};
use crate::lanes::Lanes;

/// Another rule without friction rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frictionless<R>(pub R);

impl<R: NormalRule> NormalRule for Frictionless<R> {
    const FRICTION: bool = false;
    const SEPARATION: bool = R::SEPARATION;

    fn of_errors(&self) -> Softness {
        self.0.of_errors()
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        self.0.line(against_static, separation, mass, old)
    }
}

/// Another rule with arms that turn with their bodies within the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned<R>(pub R);

impl<R: NormalRule> NormalRule for Turned<R> {
    const FRICTION: bool = R::FRICTION;
    const SEPARATION: bool = R::SEPARATION;
    const TURNED: bool = true;

    fn of_errors(&self) -> Softness {
        self.0.of_errors()
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        self.0.line(against_static, separation, mass, old)
    }
}

/// Over- or under-relaxation of another rule's line c − s v: λ + ω (c − s v − λ).
///
/// # Bound of ω
///
/// The friction of a sliding point follows its normal impulse, T = ±µ N. So a change of N by ω (v − v_n)/k_nn changes v_n by
///
/// ```text
/// ω (1 ± q) (v − v_n),      q = µ |k_nt|/k_nn
/// ```
///
/// and rows that oppose each other diverge if ω (1 + q) > 2. A small body that was jammed between two large ones left at 200 m/s
/// with ω = 1.4. The bottom corners of a square have q = 0.6 µ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxed<R> {
    /// The other rule.
    pub rule: R,
    /// ω (1)
    pub factor: f32,
}

impl<R: NormalRule> NormalRule for Relaxed<R> {
    const FRICTION: bool = R::FRICTION;
    const SEPARATION: bool = R::SEPARATION;

    fn of_errors(&self) -> Softness {
        self.rule.of_errors()
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let [constant, slope] = self.rule.line(against_static, separation, mass, old);
        let factor = L::splat(self.factor);
        [factor.mul_add(constant - old, old), factor * slope]
    }

    #[inline(always)]
    fn tangent_slope<L: Lanes>(&self, mass: L) -> L {
        L::splat(self.factor) * self.rule.tangent_slope(mass)
    }
}
