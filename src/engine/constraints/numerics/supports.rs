//! Loads of the points that support a body at rest.
//!
//! The loads F of the points balance a force f and a torque τ as far as their laws allow. Let A have the
//! columns (u, r × u/ρ) for the unit normals and tangents u, where ρ is the radius of gyration. Then
//!
//! ```text
//! least |A F + (f, τ/ρ)|,   F_n ≥ 0,   |F_t| ≤ µ F_n
//! ```
//!
//! By Gauss's principle of least constraint, this is also how the body moves if it cannot rest: a disc on an
//! incline gets a friction of m g sin θ/3. Of all such loads, the smallest are used:
//! F = W Aᵀ (A W Aᵀ + ε)⁻¹ b. The weight of a friction is the load of its point, so points with the same normal
//! reach their cones together. A first solution finds the points that carry load, without those that would pull, and how they
//! share it. A second one has frictions in proportion to these loads, clamped to their cones.
//!
//! If no loads balance f and τ, the best ones for τ may push up to twice as hard as f, and the body below
//! passes on twice that. In equilibrium their sum is −f. So loads with a sum longer than f are scaled down to
//! the length of f. By the triangle inequality, a body then passes on no more than the weights of everything
//! that it bears.

use super::cone::friction_f64;
use glam::{DVec2, DVec3};

/// Added to the diagonal of A Aᵀ, whose entries are of the order of 1.
const RIDGE: f64 = 1e-6;

/// A point that supports a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    /// Index of its contact.
    pub contact: u32,
    /// Index of the point in its contact.
    pub point: usize,
    /// Unit normal toward the body.
    pub normal: DVec2,
    /// Arm from the body's center of mass (m).
    pub arm: DVec2,
    /// Coulomb coefficient (1).
    pub friction: f64,
    /// Load along the normal, and along its tangent (n_y, −n_x) (N).
    pub load: [f64; 2],
}

impl Support {
    /// The tangent, (n_y, −n_x) of the normal.
    fn tangent(&self) -> DVec2 {
        -self.normal.perp()
    }

    /// Force on the body (N).
    pub fn force(&self) -> DVec2 {
        self.load[0] * self.normal + self.load[1] * self.tangent()
    }
}

/// Distributes a force (N) and a torque (N·m) on a body of this radius of gyration (m) over `supports`.
pub(crate) fn load(supports: &mut [Support], force: DVec2, torque: f64, gyration: f64) {
    let per_gyration = if gyration > 0.0 { 1.0 / gyration } else { 0.0 };
    let column = |s: &Support, u: DVec2| DVec3::new(u.x, u.y, s.arm.perp_dot(u) * per_gyration);
    let all = -DVec3::new(force.x, force.y, torque * per_gyration);
    supports.iter_mut().for_each(|support| support.load = [1.0, 0.0]);
    for _ in 0..2 {
        let most = supports.iter().map(|s| s.load[0]).fold(0.0, f64::max);
        let per_load = 1.0 / most;
        let mut matrix = Gram::default();
        for support in supports.iter().filter(|s| s.load[0] > 0.0) {
            matrix.add(1.0, column(support, support.normal));
            if support.friction > 0.0 {
                matrix.add(support.load[0] * per_load, column(support, support.tangent()));
            }
        }
        let solution = matrix.solve(all);
        for support in supports.iter_mut().filter(|s| s.load[0] > 0.0) {
            let normal = column(support, support.normal).dot(solution).max(0.0);
            let tangent = support.load[0] * per_load * column(support, support.tangent()).dot(solution);
            support.load = [normal, friction_f64(tangent, support.friction * normal)];
        }
    }
    let total: DVec2 = supports.iter().map(Support::force).sum();
    if total.length_squared() > force.length_squared() {
        let share = (force.length_squared() / total.length_squared()).sqrt();
        supports.iter_mut().for_each(|support| support.load = support.load.map(|load| load * share));
    }
}

/// A W Aᵀ + ε, by the six entries of its upper half.
struct Gram {
    /// Diagonal.
    on: DVec3,
    /// Entries yz, zx and xy.
    off: DVec3,
}

impl Default for Gram {
    fn default() -> Self {
        Gram { on: DVec3::splat(RIDGE), off: DVec3::ZERO }
    }
}

impl Gram {
    /// Adds w c cᵀ.
    fn add(&mut self, weight: f64, c: DVec3) {
        let scaled = weight * c;
        self.on += scaled * c;
        self.off += DVec3::new(scaled.y * c.z, scaled.z * c.x, scaled.x * c.y);
    }

    /// The inverse, by its adjugate, times `b`.
    fn solve(&self, b: DVec3) -> DVec3 {
        let Gram { on, off } = self;
        let rotated = DVec3::new(off.y * off.z, off.z * off.x, off.x * off.y);
        let adjugate_on = DVec3::new(on.y * on.z, on.z * on.x, on.x * on.y) - *off * *off;
        let adjugate_off = rotated - *off * *on;
        let determinant = on.x * adjugate_on.x + off.z * adjugate_off.z + off.y * adjugate_off.y;
        let mixed = DVec3::new(
            adjugate_off.z * b.y + adjugate_off.y * b.z,
            adjugate_off.z * b.x + adjugate_off.x * b.z,
            adjugate_off.y * b.x + adjugate_off.x * b.y,
        );
        (adjugate_on * b + mixed) / determinant
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(normal: DVec2, arm: DVec2, friction: f64) -> Support {
        Support { contact: 0, point: 0, normal, arm, friction, load: [0.0; 2] }
    }

    fn close(found: f64, expected: f64) -> bool {
        (found - expected).abs() < 1e-4 * (1.0 + expected.abs())
    }

    /// A box of half width ½ has its weight of 10 N at x beside its middle: by the lever rule, each corner
    /// bears ½ ± x of it.
    #[test]
    fn two_corners_share_by_their_levers() {
        for x in [-0.25, 0.0, 0.4] {
            let mut corners = [-0.5, 0.5].map(|arm| point(DVec2::Y, DVec2::new(arm, -0.5), 0.0));
            load(&mut corners, DVec2::new(0.0, -10.0), -10.0 * x, 0.4);
            let loads = corners.map(|corner| corner.load[0]);
            assert!(close(loads[0], 10.0 * (0.5 - x)) && close(loads[1], 10.0 * (0.5 + x)), "{x}: {loads:?}");
        }
    }

    /// If the weight is beyond a corner, this corner bears all of it.
    #[test]
    fn no_corner_pulls() {
        let mut corners = [-0.5, 0.5].map(|arm| point(DVec2::Y, DVec2::new(arm, -0.5), 0.0));
        load(&mut corners, DVec2::new(0.0, -10.0), -10.0 * 0.8, 0.4);
        assert_eq!(corners[0].load[0], 0.0);
        assert!(corners[1].load[0] > 9.0);
    }

    /// A disc on an incline rolls: friction is a third of the driving force, or µ times the load if that is
    /// less.
    #[test]
    fn a_disc_on_an_incline_has_a_third_of_its_drive_as_friction() {
        let (sin, cos) = (0.3f64.sin(), 0.3f64.cos());
        for friction in [1.0, 0.05] {
            let mut touching = [point(DVec2::Y, DVec2::new(0.0, -0.5), friction)];
            load(&mut touching, 10.0 * DVec2::new(sin, -cos), 0.0, 0.5 / 2.0f64.sqrt());
            let [normal, tangent] = touching[0].load;
            let expected = (10.0 * sin / 3.0).min(friction * 10.0 * cos);
            assert!(close(normal, 10.0 * cos) && close(-tangent, expected), "{friction}: {normal} {tangent}");
        }
    }

    /// Between two frictionless walls at α to the horizontal, a disc of 10 N loads each with 10 N/(2 cos α).
    #[test]
    fn a_wedge_gets_what_it_asks_for() {
        for (angle, expected) in [(60f64, 10.0), (80.0, 28.794)] {
            let (sin, cos) = angle.to_radians().sin_cos();
            let mut walls = [sin, -sin].map(|x| point(DVec2::new(x, cos), -0.5 * DVec2::new(x, cos), 0.0));
            load(&mut walls, DVec2::new(0.0, -10.0), 0.0, 0.35);
            assert!(walls.iter().all(|wall| close(wall.load[0], expected)), "{angle}: {walls:?}");
        }
    }

    /// The loads that best fit an unbalanced torque exceed the force on the body.
    #[test]
    fn no_body_hands_down_more_than_it_bears() {
        let corners = [-0.5, 0.5].map(|arm| point(DVec2::Y, DVec2::new(arm, -0.5), 0.6));
        for torque in [-100.0, -20.0, 7.0, 30.0] {
            let mut corners = corners;
            load(&mut corners, DVec2::new(0.0, -10.0), torque, 0.4);
            let total: DVec2 = corners.iter().map(Support::force).sum();
            assert!(total.length() < 10.0 + 1e-9 && total.length() > 5.0, "{torque}: {corners:?}");
        }
    }
}
