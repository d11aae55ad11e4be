//! The law behind a rule, read off the rule itself.
//!
//! A sweep under a [`crate::engine::constraints::kernels::velocity::rules::NormalRule`] converges, if it does, to impulses that the rule leaves alone.
//! Which contact law those obey is found by trying the rule, so that no solver can be
//! measured against a law that it does not solve. Nothing is observed unless
//! [`crate::engine::constraints::step::Workspace::observe`] is set; a step then costs one branch per sweep.

use crate::engine::constraints::kernels::velocity::rules::Softness;
use crate::engine::constraints::kernels::velocity::sweep::ContactLaw;
use crate::engine::lanes::BodyRow;
use std::fmt;

/// The rule of a velocity sweep, as a function of plain numbers.
pub struct ObservedRule {
    contact: Box<dyn ContactLaw + Send + Sync>,
    /// Whether the sweep solved friction rows.
    pub friction: bool,
    /// How far each row's body had moved since the step began: Δx, Δy (m), Δθ (rad); the fourth
    /// is not a motion. `[rows]`
    pub deltas: Vec<[f32; 4]>,
    /// The rule for rigid rows of joints.
    pub joints: Softness,
}

impl Clone for ObservedRule {
    fn clone(&self) -> Self {
        ObservedRule {
            contact: self.contact.boxed(),
            friction: self.friction,
            deltas: self.deltas.clone(),
            joints: self.joints,
        }
    }
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
    /// Keeps a copy of `law`, and of the motions that its sweep saw.
    pub fn of(law: &dyn ContactLaw, rows: &[BodyRow]) -> Self {
        ObservedRule {
            contact: law.boxed(),
            friction: law.has_friction(),
            deltas: rows.iter().map(|row| row.delta).collect(),
            joints: law.of_errors(),
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
            f64::from(self.contact.normal_impulse(against_static, vn, separation, 1.0, old))
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
