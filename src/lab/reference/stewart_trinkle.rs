//! Exact solution of small contact problems: in the plane Coulomb friction *is* an LCP.
//!
//! **Source**: Stewart & Trinkle 1996; Anitescu & Potra 1997.
//!
//! The matrices are those of [`crate::engine::constraints::numerics::coulomb_lcp`], with the compliance of a target on
//! the diagonal.
//!
//! **Cost**: O(n²) per pivot with n ≤ 4 rows per contact; meant for up to about 150 contacts.

use super::problem::{ContactProblem, DPair};
use super::residual::{Target, natural_map};
use crate::engine::constraints::numerics::coulomb_lcp::CoulombLcp;
use crate::engine::constraints::numerics::lemke::LemkeOutcome;

/// Pivots allowed per row of the LCP; typical runs need one or two.
const PIVOTS_PER_ROW: usize = 50;
/// Covering vectors that are tried until one path ends at an exact solution.
const PATHS: usize = 6;
/// Relative natural-map residual that counts as exact.
const EXACT: f64 = 1e-13;

/// Impulses of a solution, or why there is none. `target` may be compliant.
///
/// On ill-conditioned problems (jammed piles whose G has eigenvalues down to 10⁻⁶) rounding can end
/// one of Lemke's paths on a spurious ray or at an inaccurate basis; then other covering vectors are
/// tried and the answer with the least residual returned.
pub fn stewart_trinkle(problem: &ContactProblem, target: Target) -> Result<Vec<DPair>, LemkeOutcome> {
    let rows: Vec<_> = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
    let free = problem.contact_velocities(&problem.velocities(&vec![[0.0; 2]; rows.len()]));
    let free: Vec<DPair> = free.iter().zip(&rows).map(|(u, row)| [u[0] + row.bias, u[1]]).collect();
    let friction: Vec<f64> = problem.contacts.iter().map(|c| c.friction).collect();
    let g = problem.delassus();
    let lcp = CoulombLcp::new(&friction, &problem.delassus_diagonal(), &free, |i, j| {
        g[(i, j)] + if i == j && i % 2 == 0 { rows[i / 2].compliance } else { 0.0 }
    });
    let mut best: Result<(f64, Vec<DPair>), LemkeOutcome> = Err(LemkeOutcome::Ray);
    for path in 0..PATHS {
        match lcp.solve(&covering_vector(lcp.rows(), path), PIVOTS_PER_ROW * lcp.rows() + 100) {
            Ok(l) => {
                let residual =
                    natural_map(problem, target, &problem.velocities(&l), &l) / problem.impulse_unit();
                if best.as_ref().map_or(true, |(least, _)| residual < *least) {
                    best = Ok((residual, l));
                }
                if residual <= EXACT {
                    break;
                }
            }
            Err(other) => best = best.or(Err(other)),
        }
    }
    best.map(|(_, impulses)| impulses)
}

/// All ones, then ones shifted by up to one half by multiples of the golden ratio.
fn covering_vector(n: usize, path: usize) -> Vec<f64> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    (1..=n).map(|i| if path == 0 { 1.0 } else { 0.5 + 0.5 * (GOLDEN * (i * path) as f64).fract() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;
    use crate::lab::reference::residual::natural_map;

    /// Impulses, certified by the residual code, which shares nothing with the LCP.
    fn solve(problem: &ContactProblem) -> Vec<DPair> {
        problem.validate().unwrap();
        let impulses = stewart_trinkle(problem, Target::Rigid).unwrap();
        let residual = natural_map(problem, Target::Rigid, &problem.velocities(&impulses), &impulses);
        let relative = residual / problem.impulse_unit();
        assert!(relative < 1e-12, "{}: natural map {relative:e}", problem.name);
        impulses
    }

    fn close(a: f64, b: f64) {
        assert!((a - b).abs() <= 1e-12 * b.abs().max(1e-3), "{a} is not {b}");
    }

    #[test]
    fn sliding_box_leans_on_its_front() {
        let p = sliding_box();
        let l = solve(&p);
        [(0, 7.0), (1, 13.0)].iter().for_each(|&(i, force)| {
            close(l[i][0], force * p.h);
            close(l[i][1], -0.3 * force * p.h);
        });
        let v = p.velocities(&l)[0];
        close(v[0], 1.0 - 0.3 * GRAVITY * p.h);
        assert!(v[1].abs() < 1e-15 && v[2].abs() < 1e-15);
    }

    #[test]
    fn block_sticks_up_to_the_friction_angle() {
        let slope: f64 = 0.25;
        for (factor, sticks) in [(1.0 + 1e-9, true), (1.0 - 1e-9, false)] {
            let mu = factor * slope.tan();
            let p = block_on_incline(slope, mu);
            let v = p.velocities(&solve(&p))[0];
            let slides = p.h * GRAVITY * (slope.sin() - mu * slope.cos()).max(0.0);
            // The gain near the threshold is 1e-11 m/s, still 10⁵ roundings of v*.
            assert!((v[0] + slides).abs() < 1e-15, "{v:?} {slides:e}");
            assert_eq!(v[0].abs() < 1e-12, sticks);
        }
    }

    #[test]
    fn disc_rolls_above_a_third_of_the_tangent() {
        let slope: f64 = 0.25;
        for (mu, rolls) in [
            (slope.tan() / 3.0 * (1.0 + 1e-9), true),
            (slope.tan() / 3.0 * (1.0 - 1e-6), false),
            (0.05, false),
        ] {
            let p = disc_on_incline(slope, mu);
            let v = p.velocities(&solve(&p))[0];
            let gain = if rolls { 2.0 / 3.0 * slope.sin() } else { slope.sin() - mu * slope.cos() };
            close(v[0], -p.h * GRAVITY * gain);
            assert_eq!((v[0] + 0.5 * v[2]).abs() < 1e-14, rolls, "{v:?}");
        }
    }

    #[test]
    fn columns_carry_what_lies_above() {
        for n in [1, 10, 60] {
            let p = disc_column(n);
            for (i, l) in solve(&p).iter().enumerate() {
                close(l[0], (n - i) as f64 * GRAVITY * p.h);
            }
        }
        let p = heavy_on_light(1e4);
        let l = solve(&p);
        // The scaled G has condition number 4 R = 4e4, which rounding (1e-16) is multiplied by.
        for (i, mass) in [(0, 10001.0), (1, 10000.0)] {
            let truth = mass * GRAVITY * p.h;
            assert!((l[i][0] - truth).abs() < 1e-11 * truth, "{} is not {truth}", l[i][0]);
        }
    }

    #[test]
    fn painleve_rod_is_stopped_by_friction() {
        for (h, force) in [(1e-2, 0.385), (1e-3, 0.3085), (1e-4, 0.30085)] {
            let p = painleve_rod(h);
            let l = solve(&p);
            close(l[0][0], force);
            close(l[0][1], 0.4 + 0.3 * GRAVITY * h);
            let tip = p.contact_velocities(&p.velocities(&l))[0];
            assert!(tip[0].abs() < 1e-14 && tip[1].abs() < 1e-14, "{tip:?}");
        }
    }

    #[test]
    fn hyperstatic_plank_rests_with_the_right_sum() {
        for mu in [0.0, 0.5] {
            let p = plank(&[-1.5, -0.5, 0.5, 1.5], mu);
            let l = solve(&p);
            let [px, py, moment] = p.body_impulses(&l)[0];
            assert!(px.abs() < 1e-16 && moment.abs() < 1e-16, "{px:e} {moment:e}");
            close(py, GRAVITY * p.h);
            assert!(p.mass_norm(&p.velocities(&l)) < 1e-15);
        }
    }

    #[test]
    fn compliant_contact_yields_in_proportion() {
        use crate::lab::reference::residual::OwnRow;
        // u + b + c λ = 0 with u = −g h + λ: λ = (g h − b)/(1 + c).
        let p = disc_column(1);
        let rows = [OwnRow { bias: -0.01, compliance: 0.5 }];
        let l = stewart_trinkle(&p, Target::Own(&rows)).unwrap();
        close(l[0][0], (GRAVITY * p.h + 0.01) / 1.5);
        assert!(natural_map(&p, Target::Own(&rows), &p.velocities(&l), &l) < 1e-17);
        assert!(natural_map(&p, Target::Rigid, &p.velocities(&l), &l) > 1e-3);
    }

    #[test]
    fn gaps_close_overlaps_stay_and_rebounds_rebound() {
        // Disc falling at 2 m/s; h = 1/240 s.
        let disc = |gap: f64, rebound: f64| {
            let mut p = disc_column(1);
            p.bodies[0].free_velocity[1] = -2.0;
            (p.contacts[0].gap, p.contacts[0].rebound) = (gap, rebound);
            p.velocities(&solve(&p))[0][1]
        };
        close(disc(1.0 / 480.0, 0.0), -0.5);
        close(disc(0.1, 0.0), -2.0);
        assert!(disc(-0.1, 0.0).abs() < 1e-15);
        close(disc(0.0, 1.5), 1.5);
    }

    #[test]
    fn a_pyramid_of_100_contacts_rests() {
        let p = box_pyramid(6, 0.6);
        assert!(p.contacts.len() > 100 && p.contacts.len() < 150, "{}", p.contacts.len());
        let l = solve(&p);
        // 21 boxes fall at 1/24 m/s; rest to rounding.
        assert!(p.mass_norm(&p.velocities(&l)) < 1e-13);
    }
}
