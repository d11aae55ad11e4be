//! Residuals of the contact law for velocities and impulses.
//!
//! The law at a contact with relative velocity (un, ut), where un includes the right-hand side b of the
//! chosen [`Target`], and impulse (λn, λt):
//!
//! ```text
//! Signorini   0 ≤ λn ⊥ un ≥ 0
//! Coulomb     |λt| ≤ µ λn;  λt = −µ λn sign(ut) where ut ≠ 0
//! ```
//!
//! The main measure is the natural map (Alart & Curnier 1991). For every ρ > 0, it is zero exactly where the
//! law holds:
//!
//! ```text
//! r_n = λn − max(0, λn − ρn un)
//! r_t = λt − clamp(λt − ρt ut, −µ max(0, λn), µ max(0, λn))
//! ```
//!
//! With ρ = 1/G_ii it is an impulse: the change that one exact sweep over this row alone would make.

use super::joints::BlockLine;
use super::problem::{ContactProblem, DPair, Target, Velocity};
use super::rows::{OwnRow, positive};

/// A problem under a law, with all data that does not depend on impulses.
pub struct LawMeasure<'a> {
    problem: &'a ContactProblem,
    /// Whether residuals along the tangents count: a solver that ends with a sweep without friction has no law there.
    pub friction: bool,
    diagonal: Vec<DPair>,
    rows: Vec<OwnRow>,
    lines: Vec<BlockLine>,
}

impl<'a> LawMeasure<'a> {
    /// The law of `target`, with friction.
    pub fn new(problem: &'a ContactProblem, target: Target) -> Self {
        let rows = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
        let (diagonal, lines) = (problem.delassus_diagonal(), problem.lines(target));
        LawMeasure { problem, friction: true, diagonal, rows, lines }
    }

    fn contact(&self, i: usize, velocities: &[Velocity], impulses: &[DPair]) -> DPair {
        let (c, row, [gn, gt]) = (&self.problem.contacts[i], self.rows[i], self.diagonal[i]);
        let [vn, ut] = c.velocity(velocities);
        let [ln, lt] = impulses[i];
        let un = vn + row.bias + row.compliance * ln;
        let [n, t] = law_residual(c.friction, [un, ut], [ln, lt], [1.0 / (gn + row.compliance), 1.0 / gt]);
        [n, if self.friction { t } else { 0.0 }]
    }

    /// See [`natural_map`]; `velocities` need not follow from `impulses`.
    pub fn natural_map(&self, velocities: &[Velocity], impulses: &[DPair]) -> f64 {
        let contacts = (0..self.problem.contacts.len()).flat_map(|i| self.contact(i, velocities, impulses));
        let joints = self.lines.iter().flat_map(|line| line.residuals(velocities, impulses));
        largest(contacts.chain(joints))
    }
}

/// Largest absolute value; NaN if any value is NaN, which `f64::max` would drop.
pub fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |m: f64, r| if m.is_nan() || m >= r.abs() { m } else { r.abs() })
}

/// Natural map of one contact with relative velocity `u` (m/s), impulse `l` (N·s) and ρ (kg).
pub fn law_residual(mu: f64, [un, ut]: DPair, [ln, lt]: DPair, [rho_n, rho_t]: DPair) -> DPair {
    [ln - positive(ln - rho_n * un), lt - clamp(lt - rho_t * ut, mu * positive(ln))]
}

/// x clamped to [−radius, radius]; NaN stays NaN.
pub(super) fn clamp(x: f64, radius: f64) -> f64 {
    if x > radius {
        radius
    } else if x < -radius {
        -radius
    } else {
        x
    }
}

/// Largest |natural map| over all contacts, in both directions, and all joint rows (N·s); NaN if any value is
/// NaN.
pub fn natural_map(
    problem: &ContactProblem,
    target: Target,
    velocities: &[Velocity],
    impulses: &[DPair],
) -> f64 {
    LawMeasure::new(problem, target).natural_map(velocities, impulses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_by_hand() {
        // µ = 0.5, ρ = (0.5, 0.25): r_n = 4 − max(0, 4 − 1) = 1, r_t = 1 − clamp(1 − 0.75, ±2) = 0.75.
        assert_eq!(law_residual(0.5, [2.0, 3.0], [4.0, 1.0], [0.5, 0.25]), [1.0, 0.75]);
        // A pull: r_n = −2 − max(0, −2 + 0.5) = −2, r_t = 3 − 0.
        assert_eq!(law_residual(0.5, [-1.0, 0.0], [-2.0, 3.0], [0.5, 0.25]), [-2.0, 3.0]);
        // Sliding with un = µ|ut| solves the relaxed cone problem; it must not count as a solution.
        assert_eq!(law_residual(0.5, [1.0, 2.0], [4.0, -2.0], [1.0, 1.0]), [1.0, 0.0]);
        // A solver that blew up does not look exact.
        assert!(law_residual(0.5, [f64::NAN, f64::NAN], [1.0, 0.0], [1.0, 1.0]).iter().all(|r| r.is_nan()));
        // Nor does an impulse that overflowed.
        assert_eq!(law_residual(0.0, [0.0, 2.0], [f64::INFINITY, 1.0], [1.0; 2])[1], 2.0);
        assert!(largest([1.0, f64::NAN, 2.0].into_iter()).is_nan() && largest([].into_iter()) == 0.0);
    }

    #[test]
    fn residuals_vanish_on_the_law_for_any_rho() {
        let on_the_law = [
            ([0.0, 0.0], [4.0, 1.0]),
            ([0.0, 3.0], [4.0, -2.0]),
            ([2.0, 3.0], [0.0, 0.0]),
            ([0.0, -1.0], [2.0, 1.0]),
        ];
        // Powers of two make every operation exact.
        for rho in [0.25, 1.0, 8.0] {
            for (u, l) in on_the_law {
                assert_eq!(law_residual(0.5, u, l, [rho, 2.0 * rho]), [0.0; 2], "{u:?} {l:?}");
            }
        }
    }
}
