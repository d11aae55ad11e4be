//! Distance between velocities in the mass norm, for comparisons with a reference.
//!
//! ```text
//! ‖v‖_M = √(vᵀ M v) = √(Σ m |v|² + I ω²),   e = ‖v − v_ref‖_M / max(‖v_ref‖_M, √M g Δt)
//! ```
//!
//! The second scale is the effect of weight in one step, so that the error of a scene at rest is not a
//! quotient of zeros.

use super::balance::{ratio, weight};
use super::state::BodyState;
use glam::DVec2;

/// Linear (m/s) and angular velocity (rad/s) of a body.
pub type BodyVelocity = (DVec2, f64);

/// √(vᵀ M v), the root of twice the kinetic energy (√J); `velocities` has one entry per body.
pub fn mass_norm(bodies: &[BodyState], velocities: impl IntoIterator<Item = BodyVelocity>) -> f64 {
    let square =
        |(b, (v, w)): (&BodyState, BodyVelocity)| b.mass() * v.length_squared() + b.inertia() * w * w;
    bodies.iter().zip(velocities).map(square).sum::<f64>().sqrt()
}

/// The relative error e of the bodies' velocities to `reference`, over a step of `dt` (s). Zero if nothing
/// moves and nothing has weight.
pub fn error(bodies: &[BodyState], reference: &[BodyVelocity], dt: f64) -> f64 {
    let difference = bodies.iter().zip(reference).map(|(b, (v, w))| (b.velocity - v, b.angular_velocity - w));
    let mass: f64 = bodies.iter().map(BodyState::mass).sum();
    let by_weight = ratio(weight(bodies) * dt, mass.sqrt());
    let scale = mass_norm(bodies, reference.iter().copied()).max(by_weight);
    let distance = mass_norm(bodies, difference);
    // Without a scale, rest has error 0 and motion has error 1.
    if scale > 0.0 { distance / scale } else { ratio(distance, distance) }
}

#[cfg(test)]
mod tests {
    use super::super::state::tests::{body, fixed};
    use super::*;
    use crate::engine::bodies::BodyKind;

    #[test]
    fn the_norm_weighs_motion_and_spin() {
        // 2 kg × 25 + 0.5 kg·m² × 4² = 58; static bodies do not count.
        let bodies = [body(), fixed(BodyKind::Static)];
        let norm = mass_norm(&bodies, [(DVec2::new(3.0, 4.0), 4.0), (DVec2::ONE, 1.0)]);
        assert!((norm - 58.0_f64.sqrt()).abs() < 1e-14);
    }

    #[test]
    fn the_error_is_relative_to_the_reference_or_to_weight() {
        let moving = [BodyState { velocity: DVec2::new(3.0, 0.0), ..body() }];
        assert_eq!(error(&moving, &[(DVec2::new(2.0, 0.0), 0.0)], 0.1), 0.5);
        assert_eq!(error(&moving, &[(DVec2::new(3.0, 0.0), 0.0)], 0.1), 0.0);
        // At rest: 20 N on 2 kg make 1 m/s in 0.1 s.
        let heavy = [BodyState { force: DVec2::new(0.0, -20.0), ..moving[0] }];
        assert!((error(&heavy, &[(DVec2::ZERO, 0.0)], 0.1) - 3.0).abs() < 1e-15);
        // Without any scale, motion is an error of 1.
        assert_eq!(error(&moving, &[(DVec2::ZERO, 0.0)], 0.1), 1.0);
        assert_eq!(error(&[body()], &[(DVec2::ZERO, 0.0)], 0.1), 0.0);
    }
}
