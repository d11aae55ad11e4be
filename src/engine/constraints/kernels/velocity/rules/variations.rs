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
/// with ω = 1.4. [`Between`] uses ω = 1 + (ω₁ − 1) w, so w ≤ (1 − q)/((1 + q) (ω₁ − 1)) keeps ω (1 + q) ≤ 2 up to q = 1.
/// The bottom corners of a square have q = 0.6 µ.
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
    fn most_weight<L: Lanes>(&self, q: L) -> L {
        let one = L::splat(1.0);
        ((one - q) / ((one + q) * L::splat(self.factor - 1.0))).max(L::zero())
    }

    #[inline(always)]
    fn tangent_slope<L: Lanes>(&self, mass: L) -> L {
        L::splat(self.factor) * self.rule.tangent_slope(mass)
    }
}

/// A blend of two rules, weighted by how unequal the masses of the two bodies are.
///
/// A spring of stiffness k = m ω² and damper c = 2 ζ m ω, with m the mass of the lighter body, damps a body
/// of mass M that rocks on it by only ζ √(m/M), and a sweep removes m/M of that body's speed. With
///
/// ```text
/// w = ((m_a − m_b)/(m_a + m_b))⁴
/// ```
///
/// the line is (1 − w) times that of `equal` plus w times that of `unequal`. Bodies of equal masses get the
/// first, to the bit; a body on one of a tenth of its mass gets 0.45 of the second. The second should damp
/// more, or be [`Relaxed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Between<R, S> {
    /// Rule for bodies of equal masses.
    pub equal: R,
    /// Rule for a body that is much heavier than the other.
    pub unequal: S,
}

impl<R: NormalRule, S: NormalRule> NormalRule for Between<R, S> {
    const FRICTION: bool = R::FRICTION;
    const SEPARATION: bool = R::SEPARATION;
    const BY_MASS: bool = true;

    fn of_errors(&self) -> Softness {
        self.equal.of_errors()
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        self.equal.line(against_static, separation, mass, old)
    }

    #[inline(always)]
    fn line_by_mass<L: Lanes>(&self, weight: L, separation: L, mass: L, old: L) -> [L; 2] {
        let equal = self.equal.line(false, separation, mass, old);
        let unequal = self.unequal.line(false, separation, mass, old);
        [0, 1].map(|k| weight.mul_add(unequal[k] - equal[k], equal[k]))
    }

    #[inline(always)]
    fn most_weight<L: Lanes>(&self, q: L) -> L {
        self.unequal.most_weight(q)
    }

    #[inline(always)]
    fn tangent_slope<L: Lanes>(&self, mass: L) -> L {
        self.equal.tangent_slope(mass)
    }
}
