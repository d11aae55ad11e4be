//! The baseline of comparisons: projected Gauss–Seidel in `f64`.
//!
//! Near the solution, as long as no contact changes between sticking, sliding and separation, sweeps are
//! linear and the error falls by the spectral radius of that map. A power iteration could compute the radius.
//! But with more contacts than the velocities determine, the map has errors that change no velocity, and
//! contacts that touch without load are a tie. Both gave radii that no sweep shows. The rate is therefore
//! fitted to the residuals of the sweeps.

use super::problem::ContactProblem;
use super::rates::rate;
use super::residual::Target;
use super::sweeps::{Stop, SweepDirection, pgs};

/// Maximum number of row updates on the way to the solution.
const MOST_UPDATES: usize = 100_000_000;

/// Asymptotic reduction factor of the residual in a forward sweep of Gauss–Seidel, in the order of the
/// contacts and from zero. `None` if the sweeps reach no solution, or converge too fast for a fit.
pub fn gauss_seidel_rate(problem: &ContactProblem) -> Option<f64> {
    // A joint block takes as long as several contacts.
    let count = problem.contacts.len() + 4 * problem.joint_rows();
    // The tolerance is well above the rounding floor.
    let stop = Stop { tolerance: 1e-11, iterations: MOST_UPDATES / count.max(1) };
    rate(&pgs(problem, Target::Rigid, &problem.no_impulses(), SweepDirection::Forward, stop).history)
}

#[cfg(test)]
mod tests {
    use super::super::gallery::{disc_column, heavy_on_light, sliding_box};
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn columns_and_mass_ratios_have_their_rates() {
        let close = |problem: &ContactProblem, exact: f64| {
            let found = gauss_seidel_rate(problem).unwrap();
            assert!((found - exact).abs() < 1e-4 * (1.0 - exact), "{found} is not {exact}");
        };
        for n in [5, 10, 20] {
            close(&disc_column(n), (PI / (2 * n) as f64).cos().powi(2));
        }
        for ratio in [10.0, 100.0] {
            close(&heavy_on_light(ratio), ratio / (1.0 + ratio));
        }
        // The factor is 0.17: too fast for a fit.
        assert_eq!(gauss_seidel_rate(&sliding_box()), None);
    }
}
