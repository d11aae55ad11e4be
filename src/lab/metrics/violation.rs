//! The parts of the contact law one by one: which part is violated, and by how much.
//!
//! The [natural map](super::law) vanishes exactly if the law holds, but does not show which part is violated.
//! These measures do, from the same impulses and velocities:
//!
//! ```text
//! complementarity   |λ_n u_n|                  pushed although apart, or approaching
//! cone              max(0, |λ_t| − µ λ_n)      more friction than Coulomb allows
//! dissipation       max(0, µ λ_n |u_t| + λ_t u_t)
//! ```
//!
//! The last is the principle of maximal dissipation: within the cone, friction can dissipate at most µ λ_n
//! |u_t|, and it dissipates −λ_t u_t. The gap is zero if nothing slides or if the full µ λ_n opposes the
//! slip. Full friction that drives the slip counts twice as much as no friction.

use super::law::{BodyStep, PointStep};

/// Violations of the contact law at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Violation {
    /// Violation of complementarity (J).
    pub complementarity: f64,
    /// Violation of the friction cone (N·s).
    pub cone: f64,
    /// Violation of maximal dissipation (J).
    pub dissipation: f64,
}

impl Violation {
    /// The larger value of each.
    pub fn max(self, other: Violation) -> Violation {
        Violation {
            complementarity: self.complementarity.max(other.complementarity),
            cone: self.cone.max(other.cone),
            dissipation: self.dissipation.max(other.dissipation),
        }
    }
}

impl PointStep {
    /// Violations at this point over a step of `dt` (s).
    pub fn violation(&self, a: &BodyStep, b: &BodyStep, dt: f64) -> Violation {
        let ([un, ut], [normal, tangent]) = (self.velocities(a, b, dt), self.impulse);
        let limit = self.friction * normal.max(0.0);
        Violation {
            complementarity: (normal * un).abs(),
            cone: (tangent.abs() - limit).max(0.0),
            dissipation: (limit * ut.abs() + tangent * ut).max(0.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::law::tests::{DT, moving, point, standing};
    use glam::DVec2;

    fn violation(impulse: [f64; 2], velocity: DVec2) -> [f64; 3] {
        let v = point(0.0, impulse).violation(&standing(), &moving(DVec2::ZERO, velocity), DT);
        [v.complementarity, v.cone, v.dissipation]
    }

    #[test]
    fn what_obeys_the_law_violates_nothing() {
        assert_eq!(violation([3.0, 1.0], DVec2::ZERO), [0.0; 3]);
        assert_eq!(violation([0.0, 0.0], DVec2::new(1.0, 2.0)), [0.0; 3]);
        // Sliding along the tangent with full friction: µ λ_n = 1.5.
        assert_eq!(violation([3.0, -1.5], DVec2::X), [0.0; 3]);
    }

    #[test]
    fn each_part_is_broken_by_a_known_amount() {
        // Leaving at 0.5 m/s and sinking at 0.25 m/s, pushed with 3 N·s.
        assert_eq!(violation([3.0, 0.0], 0.5 * DVec2::Y)[0], 1.5);
        assert_eq!(violation([3.0, 0.0], -0.25 * DVec2::Y)[0], 0.75);
        // 2 N·s of friction where 1.5 are allowed, and without a normal impulse.
        assert_eq!(violation([3.0, -2.0], DVec2::ZERO), [0.0, 0.5, 0.0]);
        assert_eq!(violation([0.0, -2.0], DVec2::ZERO)[1], 2.0);
        // Sliding at 2 m/s: 3 J could be dissipated. None is; a third is; the same amount is added.
        assert_eq!(violation([3.0, 0.0], 2.0 * DVec2::X)[2], 3.0);
        assert_eq!(violation([3.0, -0.5], 2.0 * DVec2::X)[2], 2.0);
        assert_eq!(violation([3.0, 1.5], 2.0 * DVec2::X)[2], 6.0);
    }
}
