//! The friction cone |λt| ≤ µ λn of one contact point.

use crate::lanes::Lanes;

/// The nearest point of the cone. In the plane the cone is a wedge: a point inside it stays, a point
/// inside its polar goes to the tip, and any other point goes to the nearer side, (1, ±µ) times
/// (λn + µ |λt|)/(1 + µ²).
#[inline(always)]
pub fn project<L: Lanes>([normal, tangent]: [L; 2], friction: L) -> [L; 2] {
    let slide = tangent.max(-tangent);
    let scale = friction.mul_add(friction, L::splat(1.0));
    let along = (friction.mul_add(slide, normal) / scale).max(L::zero());
    let side = friction * along;
    let side = tangent.select_positive(side, -side);
    // Positive outside the cone. Without friction the cone is the half-line λn ≥ 0.
    let outside = (slide - friction * normal).max(-normal);
    [outside.select_positive(along, normal), outside.select_positive(side, tangent)]
}

/// As [`project`]. A negative `friction` marks entries that are not contact points, which stay unchanged.
#[inline(always)]
pub fn project_point<L: Lanes>(point: [L; 2], friction: L) -> [L; 2] {
    let nearest = project(point, friction);
    [0, 1].map(|k| (-friction).select_positive(point[k], nearest[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projection_is_the_nearest_point_of_the_cone() {
        for friction in [0.0, 0.3, 1.0, 2.5] {
            for point in
                [[1.0, 0.2], [1.0, -4.0], [-1.0, 0.5], [-0.1, 3.0], [0.0, 0.0], [-2.0, -1.0], [-1.0, 0.0]]
            {
                let nearest = project(point, friction);
                assert!(nearest[0] >= 0.0 && nearest[1].abs() <= friction * nearest[0]);
                let distance = |to: [f32; 2]| (to[0] - point[0]).hypot(to[1] - point[1]);
                for i in 0..200 {
                    let normal = 0.05 * i as f32;
                    for part in [-1.0, -0.5, 0.0, 0.5, 1.0] {
                        let other = [normal, part * friction * normal];
                        assert!(
                            distance(nearest) <= distance(other) + 1e-6,
                            "{point:?} {friction} {other:?}"
                        );
                    }
                }
            }
        }
    }
}
