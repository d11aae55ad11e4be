//! Soft contacts: implicitly integrated springs.

use super::{Frictionless, Rule, Turned};
use crate::constraints::kernels::velocity::sweep::{NormalRule, Sweep};
use crate::constraints::records::rows::Jacobian;
use crate::lanes::Lanes;
use crate::params::MAX_PUSH_SPEED;
use std::f32::consts::TAU;

/// The coefficients of a spring of angular frequency ω and damping ratio ζ, integrated
/// implicitly over h (`catto2011`):
///
/// ```text
/// λ ← max(0, λ − m_eff (γ_m v_n + γ_m β s) − γ_i λ)
/// β = ω/(2ζ + hω),   a = hω(2ζ + hω),   γ_m = a/(1 + a),   γ_i = 1/(1 + a)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Softness {
    /// β (1/s): recovery speed per unit of depth.
    pub bias_rate: f32,
    /// γ_m (1)
    pub mass_scale: f32,
    /// γ_i (1)
    pub impulse_scale: f32,
    /// Largest speed at which an error of a joint is pushed out (m/s).
    pub push_speed: f32,
}

impl Softness {
    /// No position feedback.
    pub const RIGID: Softness =
        Softness { bias_rate: 0.0, mass_scale: 1.0, impulse_scale: 0.0, push_speed: f32::INFINITY };

    /// Critically damped at ω = 2/h, from 1/h: half of an error is removed per substep. One Gauss–Seidel
    /// sweep per substep is stable for chains of joints and mass ratios of 1 : 700 up to ω h ≤ 2.2; from 2.4
    /// on they buzz (`papers/joints.md`).
    pub fn stiffest(inv_h: f32, push_speed: f32) -> Self {
        Softness { bias_rate: 0.5 * inv_h, mass_scale: 8.0 / 9.0, impulse_scale: 1.0 / 9.0, push_speed }
    }

    /// A spring of `omega` (rad/s) and `damping_ratio` (1) integrated over `h` (s).
    pub fn new(omega: f32, damping_ratio: f32, h: f32) -> Self {
        let denominator = 2.0 * damping_ratio + h * omega;
        let a = h * omega * denominator;
        let (bias_rate, mass_scale) = (omega / denominator, a / (1.0 + a));
        Softness { bias_rate, mass_scale, impulse_scale: 1.0 / (1.0 + a), ..Self::RIGID }
    }

    /// The errors of a rigid block (m or rad), reduced such that β C is at most the push speed, and [`MAX_PUSH_SPEED`] rad/s
    /// for angles. Joints that begin far out of reach would otherwise shoot together.
    #[inline(always)]
    pub fn pushed<L: Lanes, const N: usize>(&self, j: &[Jacobian<L>; N], errors: [L; N]) -> [L; N] {
        if self.bias_rate == 0.0 {
            return errors;
        }
        let reach = self.push_speed / self.bias_rate;
        bounded_errors(j, errors, [reach, MAX_PUSH_SPEED / self.bias_rate])
    }
}

/// Errors of a block (m or rad), reduced to a vector of at most `most[0]` (m) and angles of at most `most[1]` (rad).
#[inline(always)]
pub fn bounded_errors<L: Lanes, const N: usize>(
    j: &[Jacobian<L>; N],
    errors: [L; N],
    most: [f32; 2],
) -> [L; N] {
    let [of_length, of_angle] = most.map(L::splat);
    let mut square = L::zero();
    for i in 0..N {
        let length = j[i].select(errors[i], L::zero());
        square = length.mul_add(length, square);
    }
    let distance = square.sqrt();
    let scale = (distance - of_length).select_positive(of_length / distance, L::splat(1.0));
    std::array::from_fn(|i| j[i].select(errors[i] * scale, errors[i].min(of_angle).max(-of_angle)))
}

/// ω of contacts between dynamic bodies, and of contacts with static and kinematic bodies (rad/s), for a
/// setting of `hertz` (Hz). The first is limited to `fraction` of the substep rate 1/`h` (`h` in s); the
/// second is twice the first.
pub fn angular_frequencies(hertz: f32, fraction: f32, h: f32) -> [f32; 2] {
    let omega = TAU * hertz.min(fraction / h);
    [omega, 2.0 * omega]
}

/// Soft rows for overlap, and rigid rows for gaps, which may just close.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Soft {
    /// 1/h (1/s)
    pub inv_h: f32,
    /// Contacts between dynamic bodies.
    pub dynamic: Softness,
    /// Contacts with static and kinematic bodies.
    pub against_static: Softness,
    /// Largest push-apart speed of overlap, including the factor γ_m (m/s).
    pub push_speed: f32,
}

impl Soft {
    /// Springs of angular frequencies `omega` (rad/s), between dynamic bodies and with static and kinematic
    /// ones, in substeps of `h` (s).
    pub fn new(omega: [f32; 2], damping_ratio: f32, push_speed: f32, h: f32) -> Self {
        let [dynamic, against_static] = omega.map(|omega| Softness::new(omega, damping_ratio, h));
        Soft { inv_h: 1.0 / h, dynamic, against_static, push_speed }
    }

    /// As [`Self::new`], wrapped in [`Rule`].
    pub fn rule(omega: [f32; 2], damping_ratio: f32, push_speed: f32, h: f32) -> Rule {
        Rule::Soft(Sweep(Self::new(omega, damping_ratio, push_speed, h)))
    }

    /// No springs: gaps may just close, and overlap is not corrected, as with [`super::Rigid`].
    pub fn without_springs(h: f32) -> Self {
        Self::baumgarte(0.0, 0.0, h)
    }

    /// Rigid rows that remove `fraction` of an overlap in each substep of `h` (s), at no more than
    /// `push_speed` (m/s). No slop.
    pub fn baumgarte(fraction: f32, push_speed: f32, h: f32) -> Self {
        let stiff = Softness { bias_rate: fraction / h, ..Softness::RIGID };
        Soft { inv_h: 1.0 / h, dynamic: stiff, against_static: stiff, push_speed }
    }

    /// The rule without friction rows.
    pub fn frictionless(self) -> Rule {
        Rule::SoftNormal(Sweep(Frictionless(self)))
    }

    /// The rule with arms that turn with their bodies within the step.
    pub fn turned(self) -> Rule {
        Rule::SoftTurned(Sweep(Turned(self)))
    }
}

impl NormalRule for Soft {
    // Solving friction only in the relaxing sweep would let boxes on inclines creep.
    const FRICTION: bool = true;

    fn of_errors(&self) -> Softness {
        Softness { push_speed: self.push_speed, ..self.against_static }
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let soft = if against_static { self.against_static } else { self.dynamic };
        let gap = separation * L::splat(self.inv_h);
        let push = (separation * L::splat(soft.mass_scale * soft.bias_rate)).max(L::splat(-self.push_speed));
        let bias = separation.select_positive(gap, push);
        let scale = separation.select_positive(L::splat(1.0), L::splat(soft.mass_scale));
        let keep = separation.select_positive(L::splat(1.0), L::splat(1.0 - soft.impulse_scale));
        [mass.neg_mul_add(bias, keep * old), mass * scale]
    }
}

/// As [`Soft`], but the bound applies only to the push speed, not to the load that a spring carries.
///
/// The impulse λ of a row at rest leaks as much per substep as the bias adds, γ_i λ = −m γ_m β s. If the bias
/// is capped at the push speed u, the row carries at most m u/γ_i, however large the depth s. So the leak is
/// reduced by the same factor as the bias:
///
/// ```text
/// f = min(1, u/(γ_m β |s|))      λ ← max(0, λ − m_eff (γ_m v_n + γ_m β s f) − γ_i f λ)
/// ```
///
/// Then λ = −m γ_m β s/γ_i at any depth, and unloaded overlap still separates at u.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bearing {
    /// The springs.
    pub springs: Soft,
    /// Push speed above which the leak is reduced (m/s): u, or infinite for plain [`Soft`].
    pub from: f32,
}

impl NormalRule for Bearing {
    const FRICTION: bool = Soft::FRICTION;

    fn of_errors(&self) -> Softness {
        Softness::stiffest(self.springs.inv_h, self.springs.push_speed)
    }

    #[inline(always)]
    fn line<L: Lanes>(&self, against_static: bool, separation: L, mass: L, old: L) -> [L; 2] {
        let Bearing { springs, from } = self;
        let soft = if against_static { springs.against_static } else { springs.dynamic };
        let [constant, slope] = springs.line(against_static, separation, mass, old);
        let depth = separation * L::splat(-soft.mass_scale * soft.bias_rate);
        let beyond = depth - L::splat(*from);
        if !beyond.any_positive() {
            return [constant, slope];
        }
        let cut = L::splat(1.0) - L::splat(springs.push_speed) / beyond.select_positive(depth, L::splat(1.0));
        let kept = (L::splat(soft.impulse_scale) * cut).mul_add(old, constant);
        [beyond.select_positive(kept, constant), slope]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_bear_at_any_depth_what_their_stiffness_says() {
        let springs = Soft::new([900.0, 1800.0], 10.0, 3.0, 1.0 / 960.0);
        let bearing = Bearing { springs, from: springs.push_speed };
        let mass = 2.0;
        let bears = |depth: f32| mass * 900.0f32.powi(2) * depth / 960.0;
        // Relative change of a resting impulse, under the soft row and under the bearing row.
        let kept = |depth: f32| {
            let after = |rule: [f32; 2]| rule[0] / bears(depth) - 1.0;
            let row = [-depth, mass, bears(depth)];
            [
                after(springs.line::<f32>(false, row[0], row[1], row[2])),
                after(bearing.line::<f32>(false, row[0], row[1], row[2])),
            ]
        };
        for shallow in [1e-4, 1e-2, 0.06] {
            assert!(kept(shallow).iter().all(|change| change.abs() < 1e-5), "{shallow}: {:?}", kept(shallow));
        }
        for deep in [0.1, 0.5, 10.0] {
            let [soft, bearing] = kept(deep);
            assert!(soft < -1e-3 && bearing.abs() < 1e-5, "{deep}: {soft} {bearing}");
        }
        // Without a load both rules push at γ_m u.
        let unloaded = bearing.line::<f32>(false, -1.0, mass, 0.0);
        assert_eq!(unloaded, springs.line(false, -1.0, mass, 0.0));
    }
}
