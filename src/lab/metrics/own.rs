//! The residual of a solver's own law: a second residual, never mixed with that of the [rigid law](super::law).
//!
//! A solver may solve a law other than the rigid one on purpose: with a bias velocity that removes overlap,
//! or with soft contacts. Its last velocity sweep then solves
//!
//! ```text
//! 0 ≤ λ_n ⊥ J v⁺ + b + c λ_n ≥ 0
//! ```
//!
//! for the impulses of the last substep, with the bias b and the compliance c of its [observed
//! rule](crate::engine::constraints::kernels::observe). The residual is the natural map of this law, with ρ_n
//! = 1/(J M⁻¹ Jᵀ + c). If it is small while the rigid residual is large, more sweeps do not help.
//!
//! Not measured: steps in which a contact may bounce, since bounces come after the last sweep, and solvers that do
//! not end with a velocity sweep.

use super::law::{BodyStep, PointStep, tangent};
use crate::engine::bodies::BodyKind;
use crate::engine::constraints::kernels::observe::{NormalLaw, ObservedRule};
use crate::engine::world::World;
use crate::lab::reference::residual::law_residual;

/// Bias of a row that the rule does not solve (m/s): no body is this fast, so its impulse must be zero.
const OUT_OF_REACH: f64 = 1e30;

impl PointStep {
    /// The natural map of the solver's own law (N·s); `impulse` is that of the last substep.
    pub fn own_residual(&self, a: &BodyStep, b: &BodyStep, law: NormalLaw, friction: bool) -> [f64; 2] {
        let [vn, vt] = self.relative_velocity(&a.after, &b.after);
        let [mass_n, mass_t] =
            [self.normal, tangent(self.normal)].map(|axis| self.effective_mass(axis, &a.before, &b.before));
        let un = vn + law.bias + law.compliance * self.impulse[0];
        let rho = [mass_n / (1.0 + mass_n * law.compliance), mass_t];
        let [normal, tangent] = law_residual(self.friction, [un, vt], self.impulse, rho);
        // A sweep without friction rows has no target along the tangent.
        [normal, if friction { tangent } else { 0.0 }]
    }
}

/// The own residuals of every point of the last step (N·s); empty if there is no own law.
pub(super) fn residuals(
    world: &World,
    bodies: &[BodyStep],
    points: &[([usize; 2], PointStep)],
) -> Vec<[f64; 2]> {
    let bounces = world.contacts.iter().any(|c| c.restitution > 0.0);
    let Some(rule) = world.observed_rule().filter(|_| !bounces) else { return Vec::new() };
    let last = world.contacts.iter().flat_map(|c| c.manifold.points());
    let own = points.iter().zip(last).map(|(([a, b], point), last)| {
        let impulse = [last.normal_impulse, last.tangent_impulse].map(f64::from);
        let point = PointStep { impulse, ..*point };
        let (a_step, b_step) = (&bodies[*a], &bodies[*b]);
        let mass = point.effective_mass(point.normal, &a_step.before, &b_step.before);
        let against_static = a_step.after.kind != BodyKind::Dynamic;
        let separation = separation(&point, rule, [*a, *b]);
        let law = rule.law(against_static, separation as f32, mass);
        let none = NormalLaw { bias: OUT_OF_REACH, compliance: 0.0 };
        point.own_residual(a_step, b_step, law.unwrap_or(none), rule.friction)
    });
    own.collect()
}

/// The separation that the last sweep saw (m):
/// s = gap + n·(Δx + (R(Δθ) − 1) r), b minus a, with
/// n·(R(Δθ) − 1) r = sin Δθ (r × n) + (1 − cos Δθ)(r × t).
fn separation(point: &PointStep, rule: &ObservedRule, bodies: [usize; 2]) -> f64 {
    let (n, t) = (point.normal, tangent(point.normal));
    let [a, b] = [(bodies[0], point.anchor_a), (bodies[1], point.anchor_b)].map(|(body, anchor)| {
        let [dx, dy, turn, _] = rule.deltas[body].map(f64::from);
        n.x * dx + n.y * dy + turn.sin() * anchor.perp_dot(n) + (1.0 - turn.cos()) * anchor.perp_dot(t)
    });
    point.gap + b - a
}

#[cfg(test)]
mod tests {
    use super::super::law::tests::{moving, point, standing};
    use super::*;
    use glam::DVec2;

    fn own(impulse: [f64; 2], velocity: DVec2, bias: f64, compliance: f64) -> [f64; 2] {
        let law = NormalLaw { bias, compliance };
        point(0.0, impulse).own_residual(&standing(), &moving(DVec2::ZERO, velocity), law, true)
    }

    #[test]
    fn the_own_law_is_obeyed_where_the_rigid_one_is_not() {
        // Pushed apart at 0.5 m/s, the target of the bias.
        assert_eq!(own([3.0, 0.0], 0.5 * DVec2::Y, -0.5, 0.0), [0.0; 2]);
        // A spring with 3 N·s gives way at 1/4 kg⁻¹ × 3 N·s = 0.75 m/s.
        assert_eq!(own([3.0, 0.0], 0.25 * DVec2::Y, -1.0, 0.25), [0.0; 2]);
        // Out of reach there is no impulse.
        assert_eq!(own([0.0, 0.0], DVec2::NEG_Y, OUT_OF_REACH, 0.0), [0.0; 2]);
    }

    #[test]
    fn what_breaks_it_does_by_a_known_impulse() {
        // 2 kg that should leave at 0.5 m/s and stand still; and an impulse that must be zero.
        assert_eq!(own([3.0, 0.0], DVec2::ZERO, -0.5, 0.0), [-1.0, 0.0]);
        assert_eq!(own([3.0, 0.0], DVec2::ZERO, OUT_OF_REACH, 0.0)[0], 3.0);
        // Compliance halves the mass: ρ = 1/(1/2 + 1/2) kg times 1.5 m/s.
        assert_eq!(own([3.0, 0.0], DVec2::ZERO, 0.0, 0.5)[0], 1.5);
        // Friction as in the rigid law, if the sweep had any.
        assert_eq!(own([3.0, 0.0], DVec2::X, 0.0, 0.0)[1], 1.5);
        let law = NormalLaw { bias: 0.0, compliance: 0.0 };
        let frictionless = point(0.0, [3.0, 0.0]);
        let r = frictionless.own_residual(&standing(), &moving(DVec2::ZERO, DVec2::X), law, false);
        assert_eq!(r, [0.0; 2]);
    }
}
