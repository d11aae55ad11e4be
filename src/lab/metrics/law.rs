//! Residual of the contact law of Signorini and Coulomb, for the impulses of a step.
//!
//! Over a step a contact point has the impulse (λ_n, λ_t) and ends with the velocity (u_n, u_t). The law is
//!
//! ```text
//! 0 ≤ λ_n ⊥ u_n ≥ 0,    |λ_t| ≤ µ λ_n,  and λ_t opposes u_t with |λ_t| = µ λ_n if u_t ≠ 0
//! ```
//!
//! and for any ρ > 0 it holds exactly if both parts of the *natural map* vanish:
//!
//! ```text
//! r_n = λ_n − max(0, λ_n − ρ_n u_n)
//! r_t = λ_t − clamp(λ_t − ρ_t u_t, −µ λ_n, µ λ_n)
//! ```
//!
//! With ρ = effective mass, ρ = 1/(J M⁻¹ Jᵀ), both are impulses (N·s).
//!
//! **What u_n is.** That of the rigid law, whatever the solver's own target was:
//! - overlap or touch at the start (gap ≤ 0): the velocity at the end, u_n = J v⁺;
//! - a gap: it may close, but no more. u_n = (gap + J Δx)/Δt with Δx the motion over the step. With one
//!   substep Δx = Δt v⁺, so this is J v⁺ + gap/Δt. With several, a body may land within the step, and v⁺ is
//!   unrelated to the gap;
//! - a bounce (restitution e > 0, an impulse, approach v⁻ faster than the threshold):
//!   Newton's law, u_n = J v⁺ + e J v⁻.

use super::state::BodyState;
use crate::lab::reference::residual::law_residual;
use glam::DVec2;

/// A contact point over one step; geometry at its start.
#[derive(Clone, Copy, Debug)]
pub struct PointStep {
    /// Unit normal from a to b.
    pub normal: DVec2,
    /// From the center of mass of a to the point (m).
    pub anchor_a: DVec2,
    /// From the center of mass of b to the point (m).
    pub anchor_b: DVec2,
    /// Signed gap (m).
    pub gap: f64,
    /// Coulomb coefficient.
    pub friction: f64,
    /// Restitution.
    pub restitution: f64,
    /// Approach speed above which it bounces (m/s).
    pub slowest: f64,
    /// Normal and tangential impulse on b over the step (N·s).
    pub impulse: [f64; 2],
}

/// A body at the start and the end of a step.
#[derive(Clone, Copy, Debug)]
pub struct BodyStep {
    /// State at the start.
    pub before: BodyState,
    /// State at the end.
    pub after: BodyState,
}

impl BodyStep {
    /// Motion over the step of the material point at `anchor`, linearized (m).
    fn displacement_at(&self, anchor: DVec2) -> DVec2 {
        self.after.position - self.before.position + self.after.turn_since(&self.before) * anchor.perp()
    }
}

/// The tangent of a normal: the normal turned by −90°.
pub fn tangent(normal: DVec2) -> DVec2 {
    -normal.perp()
}

impl PointStep {
    /// Impulse on body b (N·s).
    pub fn impulse_on_b(&self) -> DVec2 {
        self.impulse[0] * self.normal + self.impulse[1] * tangent(self.normal)
    }

    /// 1/(J M⁻¹ Jᵀ) along `direction` (kg); zero if nothing can move.
    pub fn effective_mass(&self, direction: DVec2, a: &BodyState, b: &BodyState) -> f64 {
        let k = a.inv_mass
            + b.inv_mass
            + a.inv_inertia * self.anchor_a.perp_dot(direction).powi(2)
            + b.inv_inertia * self.anchor_b.perp_dot(direction).powi(2);
        if k > 0.0 { 1.0 / k } else { 0.0 }
    }

    /// Velocity of b's material point relative to a's, in the contact frame (m/s).
    pub fn relative_velocity(&self, a: &BodyState, b: &BodyState) -> [f64; 2] {
        let relative = b.velocity_at(self.anchor_b) - a.velocity_at(self.anchor_a);
        [relative.dot(self.normal), relative.dot(tangent(self.normal))]
    }

    /// (u_n, u_t) of the module (m/s).
    pub fn velocities(&self, a: &BodyStep, b: &BodyStep, dt: f64) -> [f64; 2] {
        let [end, slip] = self.relative_velocity(&a.after, &b.after);
        let [approach, _] = self.relative_velocity(&a.before, &b.before);
        // A slow approach may bounce or end at rest: the law of its actual outcome applies.
        let has_left = approach < 0.0 && end > -0.5 * self.restitution * approach;
        let bounces =
            self.restitution > 0.0 && self.impulse[0] > 0.0 && (has_left || approach < -self.slowest);
        let un = if bounces {
            end + self.restitution * approach
        } else if self.gap > 0.0 {
            let moved = b.displacement_at(self.anchor_b) - a.displacement_at(self.anchor_a);
            (self.gap + moved.dot(self.normal)) / dt
        } else {
            end
        };
        [un, slip]
    }

    /// The natural map (r_n, r_t) of the module (N·s).
    pub fn residual(&self, a: &BodyStep, b: &BodyStep, dt: f64) -> [f64; 2] {
        let velocities = self.velocities(a, b, dt);
        let axes = [self.normal, tangent(self.normal)];
        let rho = axes.map(|axis| self.effective_mass(axis, &a.before, &b.before));
        law_residual(self.friction, velocities, self.impulse, rho)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::state::tests::{body, fixed};
    use super::*;
    use crate::engine::bodies::BodyKind;

    pub const DT: f64 = 0.1;

    /// A 2 kg body on a fixed floor, the contact below its center of mass, in its center
    /// so that nothing turns: both effective masses are 2 kg.
    pub fn point(gap: f64, impulse: [f64; 2]) -> PointStep {
        PointStep {
            normal: DVec2::Y,
            anchor_a: DVec2::ZERO,
            anchor_b: DVec2::ZERO,
            gap,
            friction: 0.5,
            restitution: 0.0,
            slowest: 1.0,
            impulse,
        }
    }

    /// A floor over a step.
    pub fn standing() -> BodyStep {
        let floor = fixed(BodyKind::Static);
        BodyStep { before: floor, after: floor }
    }

    /// The body over a step, from one velocity to another.
    pub fn moving(before: DVec2, after: DVec2) -> BodyStep {
        BodyStep {
            before: BodyState { velocity: before, ..body() },
            after: BodyState { velocity: after, position: DT * after, ..body() },
        }
    }

    fn residual(point: PointStep, before: DVec2, after: DVec2) -> [f64; 2] {
        point.residual(&standing(), &moving(before, after), DT)
    }

    #[test]
    fn what_obeys_the_law_has_no_residual() {
        // Rest, sliding along the tangent's +x with full friction, leaving, closing a gap.
        assert_eq!(residual(point(0.0, [3.0, 1.0]), DVec2::ZERO, DVec2::ZERO), [0.0; 2]);
        assert_eq!(residual(point(-0.1, [3.0, -1.5]), DVec2::X, DVec2::X), [0.0; 2]);
        assert_eq!(residual(point(0.0, [0.0, 0.0]), DVec2::ZERO, DVec2::ONE), [0.0; 2]);
        let r = residual(point(0.05, [3.0, 0.0]), DVec2::NEG_Y, DVec2::new(0.0, -0.5));
        assert!(r[0].abs() < 1e-15 && r[1] == 0.0);
    }

    #[test]
    fn what_breaks_it_does_by_a_known_impulse() {
        // Sinking at 0.25 m/s: 2 kg × 0.25 m/s are missing.
        assert_eq!(residual(point(0.0, [3.0, 0.0]), DVec2::ZERO, DVec2::new(0.0, -0.25)), [-0.5, 0.0]);
        // Pushed although it leaves at 5 m/s: at most the whole impulse is wrong.
        assert_eq!(residual(point(0.0, [3.0, 0.0]), DVec2::ZERO, DVec2::new(0.0, 5.0)), [3.0, 0.0]);
        // Pulling.
        assert_eq!(residual(point(0.0, [-1.0, 0.0]), DVec2::ZERO, DVec2::ZERO)[0], -1.0);
        // Outside the cone of 1.5 at rest; sliding without friction, which would be −1.5.
        assert_eq!(residual(point(0.0, [3.0, 2.0]), DVec2::ZERO, DVec2::ZERO), [0.0, 0.5]);
        assert_eq!(residual(point(0.0, [3.0, 0.0]), DVec2::X, DVec2::X), [0.0, 1.5]);
        // Stopped 0.05 m above the floor by an impulse: u_n = 0.5 m/s.
        assert_eq!(residual(point(0.05, [3.0, 0.0]), DVec2::ZERO, DVec2::ZERO), [1.0, 0.0]);
    }

    #[test]
    fn a_bounce_follows_newton_and_a_slow_one_does_not_bounce() {
        let bouncy = PointStep { restitution: 0.5, ..point(0.01, [12.0, 0.0]) };
        assert_eq!(residual(bouncy, DVec2::new(0.0, -4.0), DVec2::new(0.0, 2.0))[0], 0.0);
        // 1.5 instead of 2 m/s.
        assert_eq!(residual(bouncy, DVec2::new(0.0, -4.0), DVec2::new(0.0, 1.5))[0], -1.0);
        let slow = PointStep { restitution: 0.5, ..point(0.0, [1.0, 0.0]) };
        assert_eq!(residual(slow, DVec2::new(0.0, -0.5), DVec2::ZERO)[0], 0.0);
    }

    #[test]
    fn the_effective_mass_counts_the_arm() {
        let arm = PointStep { anchor_b: DVec2::X, ..point(0.0, [9.0, 0.0]) };
        // k = 1/2 + 2 × 1².
        assert_eq!(arm.effective_mass(DVec2::Y, &fixed(BodyKind::Static), &body()), 0.4);
        let floor = fixed(BodyKind::Static);
        assert_eq!(arm.effective_mass(DVec2::Y, &floor, &floor), 0.0);
    }
}
