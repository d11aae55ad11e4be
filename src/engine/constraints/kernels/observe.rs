//! The contact law behind a rule, measured on the rule itself.
//!
//! A sweep under a [`crate::constraints::kernels::velocity::rules::NormalRule`] converges, if at all,
//! to a fixed point of the rule. The contact law at this fixed point is found by evaluating the rule, so a
//! solver is never measured against a law that it does not solve. Nothing is observed unless
//! [`crate::constraints::step::Workspace::observe`] is set; otherwise a step costs one extra branch
//! per sweep.

use crate::constraints::kernels::velocity::rules::Softness;
use crate::constraints::kernels::velocity::sweep::ContactLaw;
use crate::lanes::BodyRow;
use std::fmt;

/// The rule of a velocity sweep, as a function of scalars.
pub struct ObservedRule {
    contact: Box<dyn ContactLaw + Send + Sync>,
    /// Whether the sweep solved friction rows.
    pub friction: bool,
    /// Displacement of each row's body since the step began: Δx, Δy (m), Δθ (rad). The fourth entry is not a
    /// displacement. `[rows]`
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
    /// Bias velocity (m/s); negative pushes apart.
    pub bias: f64,
    /// Compliance (1/kg).
    pub compliance: f64,
}

/// Fastest approach speed that is tried (m/s), far beyond the bias of any rule.
const FASTEST_PROBE: f32 = 1048576.0;

/// Rounding tolerance of κ: two roundings of numbers below 4, relative to one speed.
const KEEP_ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

impl ObservedRule {
    /// Copies `law` and the displacements that its sweep used.
    pub fn of(law: &dyn ContactLaw, rows: &[BodyRow]) -> Self {
        ObservedRule {
            contact: law.boxed(),
            friction: law.has_friction(),
            deltas: rows.iter().map(|row| row.delta).collect(),
            joints: law.of_errors(),
        }
    }

    /// The law at a contact with this separation (m) and effective mass (kg). `None` if the impulse does not
    /// respond to an approach.
    ///
    /// All rules have the form λ ← max(0, κ λ − m (σ v_n + b)), where κ, σ and b depend only on the
    /// separation. Where the result is positive, three evaluations with m = 1 give them:
    ///
    /// ```text
    /// f(v, λ) = κ λ − σ v − b
    /// σ = (f(−2v, 0) − f(−v, 0))/v,   b = f(−2v, 0) − 2 f(−v, 0),   κ = (f(−v, v) − f(−v, 0))/v
    /// ```
    ///
    /// and an unchanged impulse satisfies v_n + b/σ + (1 − κ)/(m σ) λ = 0. The trial speeds are powers of
    /// two, which makes products with them exact, and as small as possible, since the rounding error of b
    /// grows with them.
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
        // A κ that differs from 1 only by the rounding of the trials counts as 1.
        let soft = if (1.0 - keep).abs() > KEEP_ROUNDING { 1.0 - keep } else { 0.0 };
        Some(NormalLaw { bias: (twice - 2.0 * once) / scale, compliance: soft / (mass * scale) })
    }
}
