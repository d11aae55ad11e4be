//! The friction cone |λt| ≤ µ λn of one contact point.

use super::system::Pair;

/// The nearest point of the cone. In the plane the cone is a wedge: what is in it stays, what is
/// in its polar goes to the tip, and the rest to the nearer side, (1, ±µ) times
/// (λn + µ |λt|)/(1 + µ²).
pub fn project([normal, tangent]: Pair, friction: f32) -> Pair {
    if tangent.abs() <= friction * normal {
        return [normal, tangent];
    }
    let along = (normal + friction * tangent.abs()) / (1.0 + friction * friction);
    if along <= 0.0 { [0.0; 2] } else { [along, (friction * along).copysign(tangent)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projection_is_the_nearest_point_of_the_cone() {
        for friction in [0.0, 0.3, 1.0, 2.5] {
            for point in [[1.0, 0.2], [1.0, -4.0], [-1.0, 0.5], [-0.1, 3.0], [0.0, 0.0], [-2.0, -1.0]] {
                let nearest = project(point, friction);
                assert!(nearest[0] >= 0.0 && nearest[1].abs() <= friction * nearest[0]);
                let distance = |to: Pair| (to[0] - point[0]).hypot(to[1] - point[1]);
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
