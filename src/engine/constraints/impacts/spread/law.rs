//! The impact law of a single point: Newton's restitution with Coulomb friction, which never adds energy.
//!
//! # Newton and Coulomb
//!
//! A point approaches at the normal velocity v < 0 and has to leave at v⁺. Its impulses N along n and T along t
//! are those of the whole impact, so all of N bounds friction:
//!
//! ```text
//! k_nn N + k_nt T = v⁺ − v_n       k_nt = I_a⁻¹ (r_a × n)(r_a × t) + I_b⁻¹ (r_b × n)(r_b × t)
//! k_nt N + k_tt T = −v_t           if |T| ≤ µ N: the point sticks
//!               T = ±µ N           else, with the sign of the T that would stop it
//! ```
//!
//! A disc has k_nt = 0; a corner has not, and both impulses turn it. Both rows are solved together.
//!
//! # Friction takes energy
//!
//! Both laws together may create energy (Kane): a rod at 45° that lands on its end is turned so that the end would slip back, and
//! the impulse that keeps it from slipping pushes the rod off. The work of a point's impulses, from v⁻ before the wave to v⁺ after it, is
//!
//! ```text
//! W = ½ N (v_n⁻ + v_n⁺) + ½ T (v_t⁻ + v_t⁺),      Σ W = K⁺ − K⁻
//! ```
//!
//! so a wave creates no energy if W ≤ 0 at each of its points. The first part is −½ N L with L = |v_n⁻| − v⁺,
//! corrected for height. With v_n⁺ of Newton's law, W is a convex function of T, and T = 0 gains nothing. So
//! T is bounded to W ≤ 0, between the roots of
//!
//! ```text
//! d T² + (k_nn (v_t⁻ + u) + L k_nt) T − L w ≤ 0,      d = k_nn k_tt − k_nt²
//! ```
//!
//! with w the v_n that the point has to gain without its impulses, and u the v_t at which it leaves with T =
//! 0. Impulses stay within the cone, which is convex. If Newton's and Coulomb's laws lose energy, their
//! impulses are unchanged.

/// Accumulated impulses along n and t (N·s) after which a point has gained `wanted` (m/s), or as much of it along t
/// as friction lets it; see the [module](self). `k`: k_nn, k_tt, k_nt (1/kg); `old`: those so far.
pub(super) fn rough_impulses(
    [k_nn, k_tt, k_nt]: [f32; 3],
    mu: f32,
    [old_n, old_t]: [f32; 2],
    [wanted_n, wanted_t]: [f32; 2],
) -> [f32; 2] {
    if mu == 0.0 {
        return [(wanted_n / k_nn + old_n).max(0.0), 0.0];
    }
    // Velocities to gain, starting without the impulses so far.
    let want_n = k_nn.mul_add(old_n, k_nt.mul_add(old_t, wanted_n));
    let want_t = k_nt.mul_add(old_n, k_tt.mul_add(old_t, wanted_t));
    let determinant = k_nn.mul_add(k_tt, -(k_nt * k_nt));
    let inverse = if determinant > 0.0 { 1.0 / determinant } else { 1.0 };
    let stick =
        [k_tt.mul_add(want_n, -(k_nt * want_t)) * inverse, k_nn.mul_add(want_t, -(k_nt * want_n)) * inverse];
    if stick[0] > 0.0 && stick[1].abs() <= mu * stick[0] {
        return stick;
    }
    // Along the edge of the cone the effective inverse mass of N is k_nn ± µ k_nt. If that is not positive,
    // the edge has no solution (Painlevé), and N is the frictionless impulse.
    let slope = mu.copysign(stick[1]);
    let along = slope.mul_add(k_nt, k_nn);
    let edge_n = (want_n / if along > 0.0 { along } else { k_nn }).max(0.0);
    [edge_n, slope * edge_n]
}

/// Impulses `rough` along n and t (N·s), with less friction if they would add energy; see the [module](self).
/// `wanted`: velocity to gain, starting without impulses (m/s); `slip`: v_t⁻ (m/s); `lost`: L, if positive
/// (m/s).
pub(super) fn lossy_impulses(
    [k_nn, k_tt, k_nt]: [f32; 3],
    rough: [f32; 2],
    [wanted_n, wanted_t]: [f32; 2],
    [slip, lost]: [f32; 2],
) -> [f32; 2] {
    let d = k_nn.mul_add(k_tt, -(k_nt * k_nt));
    if d <= 0.0 {
        return rough;
    }
    let half_b = 0.5 * lost.mul_add(k_nt, k_nt.mul_add(wanted_n, k_nn * (slip - wanted_t)));
    let c = lost * wanted_n.max(0.0);
    let root = half_b.mul_add(half_b, d * c).max(0.0).sqrt();
    let (least, most) = ((-(half_b + root) / d).min(0.0), ((root - half_b) / d).max(0.0));
    let tangent = rough[1].min(most).max(least);
    if tangent == rough[1] {
        return rough;
    }
    let normal = ((-k_nt).mul_add(tangent, wanted_n) / k_nn).max(0.0);
    [normal, if normal > 0.0 { tangent } else { 0.0 }]
}

#[cfg(test)]
mod tests {
    use super::{lossy_impulses, rough_impulses};

    /// Of a unit square's corner with k_nn, k_tt, k_nt that comes in at 4 m/s and slides at `vt`.
    fn corner(mu: f32, old: [f32; 2], vt: f32) -> [f32; 2] {
        rough_impulses([2.0, 3.0, 1.0], mu, old, [4.0, -vt])
    }

    #[test]
    fn a_corner_sticks_slides_or_is_smooth() {
        // 2 N + T = 4, N + 3 T = −1: N = 13/5, T = −6/5.
        let [n, t] = corner(1.0, [0.0; 2], 1.0);
        assert!((n - 2.6).abs() < 1e-6 && (t + 1.2).abs() < 1e-6, "{n} {t}");
        // T = −N/4 and 2 N + T = 4: N = 16/7.
        let [n, t] = corner(0.25, [0.0; 2], 1.0);
        assert!((n - 16.0 / 7.0).abs() < 1e-6 && (t + 4.0 / 7.0).abs() < 1e-6, "{n} {t}");
        assert_eq!(corner(0.0, [0.0; 2], 1.0), [2.0, 0.0]);
    }

    #[test]
    fn impulses_so_far_are_part_of_the_whole() {
        // (2.6, −1.2) has given all: nothing is left to gain.
        let [n, t] = rough_impulses([2.0, 3.0, 1.0], 1.0, [2.6, -1.2], [0.0, 0.0]);
        assert!((n - 2.6).abs() < 1e-6 && (t + 1.2).abs() < 1e-6, "{n} {t}");
        // Points that leave by themselves take all of it back.
        assert_eq!(rough_impulses([2.0, 3.0, 1.0], 1.0, [1.0, 0.0], [-4.0, -1.0]), [0.0, 0.0]);
    }

    /// A rod at 45° of 2 m and 1 kg that comes in at 1 m/s and slides at `slip`, e = 1: k_nn = k_tt = 5/2, k_nt = −3/2.
    fn rod(slip: f32) -> [f32; 2] {
        let (k, wanted) = ([2.5, 2.5, -1.5], [2.0, -slip]);
        let rough = rough_impulses(k, 1.0, [0.0; 2], wanted);
        lossy_impulses(k, rough, wanted, [slip, 0.0])
    }

    #[test]
    fn a_rod_gains_nothing_from_its_friction() {
        // Newton and Coulomb: T = 7/16, N = 17/16, W = ½ T v_t⁻ = 0.11 J. With T = 1/8 it leaves at −v_t⁻: N = 7/8.
        let [n, t] = rod(0.5);
        assert!((n - 0.875).abs() < 1e-6 && (t - 0.125).abs() < 1e-6, "{n} {t}");
        // Slides against its friction: as Newton and Coulomb have it. T = −(5 − 3)/4, N = (5 − 3)/4 … sticks with W < 0.
        let [n, t] = rod(2.0);
        assert!((n - 0.5).abs() < 1e-6 && (t + 0.5).abs() < 1e-6, "{n} {t}");
    }
}
