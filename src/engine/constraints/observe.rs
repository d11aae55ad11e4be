//! The law behind a rule, read off the rule itself.
//!
//! A sweep under a [`super::rules::NormalRule`] converges, if it does, to impulses that the rule leaves alone.
//! Which contact law those obey is asked of the rule by trying it, so that no solver can be
//! measured against a law that it does not solve. Nothing is observed unless
//! [`super::Workspace::observe`] is set; a step then costs one branch per sweep.

use super::sweep::VelocitySweep;
use crate::engine::lanes::BodyRow;
use std::fmt;

/// The rule of a velocity sweep, as a function of plain numbers.
pub struct ObservedRule {
    sweep: Box<dyn VelocitySweep + Send + Sync>,
    /// Whether the sweep solved friction rows.
    pub friction: bool,
    /// How far each row's body had moved since the step began: Δx, Δy (m), Δθ (rad); the fourth
    /// is not a motion. `[rows]`
    pub deltas: Vec<[f32; 4]>,
}

impl fmt::Debug for ObservedRule {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ObservedRule").field("friction", &self.friction).finish_non_exhaustive()
    }
}

/// Normal law of one contact: un = v_n + bias + compliance λ, 0 ≤ λ ⊥ un ≥ 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalLaw {
    /// m/s; negative pushes apart.
    pub bias: f64,
    /// 1/kg
    pub compliance: f64,
}

/// Fastest approach that is tried (m/s): far beyond any bias a rule may ask for.
const FASTEST_PROBE: f32 = 1048576.0;

/// Two roundings of numbers below 4, relative to one speed.
const KEEP_ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

impl ObservedRule {
    /// Keeps a copy of the rule of `sweep`, and of the motions that it saw.
    pub fn of(sweep: &dyn VelocitySweep, rows: &[BodyRow]) -> Self {
        ObservedRule {
            sweep: sweep.boxed(),
            friction: sweep.has_friction(),
            deltas: rows.iter().map(|row| row.delta).collect(),
        }
    }

    /// The law at a contact with this separation (m) and effective mass (kg); none where the rule
    /// does not answer to an approach, so that the impulse stays what it is.
    ///
    /// All rules have the form λ ← max(0, κ λ − m (σ v_n + b)) with κ, σ and b depending on the
    /// separation only. Where the maximum is not at zero, three trials with m = 1 give them:
    ///
    /// ```text
    /// f(v, λ) = κ λ − σ v − b
    /// σ = (f(−2v, 0) − f(−v, 0))/v,   b = f(−2v, 0) − 2 f(−v, 0),   κ = (f(−v, v) − f(−v, 0))/v
    /// ```
    ///
    /// and an impulse that stays the same has v_n + b/σ + (1 − κ)/(m σ) λ = 0. Speeds tried are
    /// powers of two, so that products with them are exact, and as small as they can be, since
    /// the rounding of b grows with them.
    pub fn law(&self, against_static: bool, separation: f32, mass: f64) -> Option<NormalLaw> {
        let f = |vn: f32, old: f32| {
            f64::from(self.sweep.normal_impulse(against_static, vn, separation, 1.0, old))
        };
        let mut speed = 1.0_f32;
        let [once, twice] = loop {
            let [once, twice] = [f(-speed, 0.0), f(-2.0 * speed, 0.0)];
            if once > 0.0 && twice > once {
                break [once, twice];
            }
            speed *= 2.0;
            if speed > FASTEST_PROBE {
                return None;
            }
        };
        let v = f64::from(speed);
        let scale = (twice - once) / v;
        let keep = (f(-speed, speed) - once) / v;
        // A κ that differs from 1 by the rounding of the trials is 1.
        let soft = if (1.0 - keep).abs() > KEEP_ROUNDING { 1.0 - keep } else { 0.0 };
        Some(NormalLaw { bias: (twice - 2.0 * once) / scale, compliance: soft / (mass * scale) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::constraints::rules::{NormalRule, Rigid, Soft};
    use crate::engine::constraints::sweep::Sweep;
    use crate::engine::lanes::Lanes;

    #[test]
    fn the_rigid_rule_closes_gaps_and_nothing_else() {
        let rule = ObservedRule::of(&Sweep(Rigid { inv_h: 64.0 }), &[]);
        assert!(rule.friction);
        // 2⁻⁶ m in 2⁻⁶ s: every number is a power of two, so exactly 1 m/s.
        let law = |separation| rule.law(false, separation, 3.0).unwrap();
        assert_eq!(law(1.0 / 64.0), NormalLaw { bias: 1.0, compliance: 0.0 });
        assert_eq!(law(0.0), NormalLaw { bias: 0.0, compliance: 0.0 });
        assert_eq!(law(-0.1), NormalLaw { bias: 0.0, compliance: 0.0 });
        // Roundings of a bias that is no power of two are not taken for softness.
        assert_eq!(law(0.0123).compliance, 0.0);
        // A bias beyond the first speeds tried.
        assert_eq!(law(16.0), NormalLaw { bias: 1024.0, compliance: 0.0 });
    }

    #[test]
    fn the_soft_rule_is_an_implicit_spring() {
        // ω = 2π 30, ζ = 10, h = 1/240: β = ω/(2ζ + hω), a = hω(2ζ + hω), and a spring's
        // compliance is 1/(m a).
        let rule = ObservedRule::of(&Sweep(Soft::new([188.49556, 376.99112], 10.0, 3.0, 1.0 / 240.0)), &[]);
        let (omega, h) = (std::f64::consts::TAU * 30.0, 1.0 / 240.0);
        let denominator = 20.0 + h * omega;
        let law = rule.law(false, -0.01, 2.0).unwrap();
        // Three roundings of f32 at numbers below 4.
        assert!((law.bias + 0.01 * omega / denominator).abs() < 1e-6, "{law:?}");
        assert!((law.compliance - 0.5 / (h * omega * denominator)).abs() < 1e-6, "{law:?}");
        // Twice the frequency against what does not move: β grows by 2·20.79/21.57 = 1.93, a by 2.08.
        let against_static = rule.law(true, -0.01, 2.0).unwrap();
        assert!((against_static.bias / law.bias - 1.93).abs() < 0.01, "{against_static:?}");
        assert!((law.compliance / against_static.compliance - 2.08).abs() < 0.01, "{against_static:?}");
    }

    #[test]
    fn a_rule_that_does_not_answer_has_no_law() {
        #[derive(Clone, Copy)]
        struct Deaf;
        impl NormalRule for Deaf {
            const FRICTION: bool = false;
            fn line<L: Lanes>(&self, _: bool, _: L, _: L, old: L) -> [L; 2] {
                [old, L::zero()]
            }
        }
        assert_eq!(ObservedRule::of(&Sweep(Deaf), &[]).law(false, 0.0, 1.0), None);
    }
}
