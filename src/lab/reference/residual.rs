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
use super::problem::{ContactProblem, DPair, Velocity};
pub use super::rows::OwnRow;
use super::rows::positive;
pub use super::target::Target;

/// Residuals of one contact; all zero exactly where the law holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactResidual {
    /// Natural map, normal part (N·s).
    pub normal: f64,
    /// Natural map, tangential part (N·s).
    pub tangent: f64,
    /// max(0, −un): remaining approach speed (m/s).
    pub approach: f64,
    /// max(0, −λn): pull (N·s).
    pub pull: f64,
    /// max(0, |λt| − µ max(0, λn)): friction outside the cone (N·s).
    pub cone: f64,
    /// |λn un|: force at a distance (J).
    pub complementarity: f64,
    /// |ut| | µ max(0, λn) − |λt| | + max(0, λt ut): sliding with friction off the cone's edge, or friction
    /// that accelerates (J).
    pub dissipation: f64,
    /// |λ − P_K(λ − ρ ũ)|, ũ = (un + µ|ut|, ut) (N·s), De Saxcé & Feng 1998.
    pub de_saxce: f64,
}

/// Residuals of every contact.
///
/// `velocities` need not follow from `impulses`; [`momentum_defect`] measures this.
pub fn contact_residuals(
    problem: &ContactProblem,
    target: Target,
    velocities: &[Velocity],
    impulses: &[DPair],
) -> Vec<ContactResidual> {
    let measure = LawMeasure::new(problem, target);
    (0..problem.contacts.len()).map(|i| measure.contact(i, velocities, impulses)).collect()
}

/// Residual of every joint row (N·s), in their order; see [`super::joints`].
///
/// `velocities` need not follow from `impulses`.
pub fn joint_residuals(
    problem: &ContactProblem,
    target: Target,
    velocities: &[Velocity],
    impulses: &[DPair],
) -> Vec<f64> {
    let lines = problem.lines(target);
    lines.iter().flat_map(|line| line.residuals(velocities, impulses).into_iter().take(line.size)).collect()
}

/// A problem under a law, with all data that does not depend on impulses.
pub(super) struct LawMeasure<'a> {
    problem: &'a ContactProblem,
    diagonal: Vec<DPair>,
    rows: Vec<OwnRow>,
    lines: Vec<BlockLine>,
}

impl<'a> LawMeasure<'a> {
    pub fn new(problem: &'a ContactProblem, target: Target) -> Self {
        let rows = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
        LawMeasure { problem, diagonal: problem.delassus_diagonal(), rows, lines: problem.lines(target) }
    }

    fn contact(&self, i: usize, velocities: &[Velocity], impulses: &[DPair]) -> ContactResidual {
        let (c, row, [gn, gt]) = (&self.problem.contacts[i], self.rows[i], self.diagonal[i]);
        let [vn, ut] = c.velocity(velocities);
        let [ln, lt] = impulses[i];
        let un = vn + row.bias + row.compliance * ln;
        law_residual(c.friction, [un, ut], [ln, lt], [1.0 / (gn + row.compliance), 1.0 / gt])
    }

    /// See [`natural_map`].
    pub fn natural_map(&self, velocities: &[Velocity], impulses: &[DPair]) -> f64 {
        let contacts = (0..self.problem.contacts.len()).flat_map(|i| {
            let r = self.contact(i, velocities, impulses);
            [r.normal, r.tangent]
        });
        let joints = self.lines.iter().flat_map(|line| line.residuals(velocities, impulses));
        // `f64::max` would drop NaN.
        contacts.chain(joints).fold(0.0, |m: f64, r| if m.is_nan() || m >= r.abs() { m } else { r.abs() })
    }
}

/// Residuals of one contact with relative velocity `u` (m/s), impulse `l` (N·s) and ρ (kg).
pub fn law_residual(mu: f64, [un, ut]: DPair, [ln, lt]: DPair, [rho_n, rho_t]: DPair) -> ContactResidual {
    let radius = mu * positive(ln);
    // One ρ for both components: P_K is the Euclidean projection only in an unscaled plane.
    let rho = rho_n.min(rho_t);
    let projected = project_cone(mu, [ln - rho * (un + mu * ut.abs()), lt - rho * ut]);
    ContactResidual {
        normal: ln - positive(ln - rho_n * un),
        tangent: lt - clamp(lt - rho_t * ut, radius),
        approach: positive(-un),
        pull: positive(-ln),
        cone: positive(lt.abs() - radius),
        complementarity: (ln * un).abs(),
        dissipation: ut.abs() * (radius - lt.abs()).abs() + positive(lt * ut),
        de_saxce: (ln - projected[0]).hypot(lt - projected[1]),
    }
}

/// Euclidean projection onto the wedge K = {λn ≥ 0, |λt| ≤ µ λn}.
///
/// It is the identity inside K and the apex in the polar wedge {µ|λt| ≤ −λn}. Elsewhere it is the nearest
/// point on the nearer edge, whose direction is (1, ±µ)/√(1 + µ²): n' = (λn + µ|λt|)/(1 + µ²).
pub fn project_cone(mu: f64, [ln, lt]: DPair) -> DPair {
    if ln >= 0.0 && lt.abs() <= mu * ln {
        [ln, lt]
    } else if mu * lt.abs() <= -ln {
        [0.0, 0.0]
    } else {
        let n = (ln + mu * lt.abs()) / (1.0 + mu * mu);
        [n, (mu * n).copysign(lt)]
    }
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

/// ‖v − v* − M⁻¹ Jᵀ λ‖ in the mass norm (√J·√2): how far the velocities are from those that follow from the
/// impulses.
pub fn momentum_defect(problem: &ContactProblem, velocities: &[Velocity], impulses: &[DPair]) -> f64 {
    let follow = problem.velocities(impulses);
    let difference: Vec<Velocity> =
        velocities.iter().zip(&follow).map(|(a, b)| [0, 1, 2].map(|k| a[k] - b[k])).collect();
    problem.mass_norm(&difference)
}

/// Distribution of absolute values; all NaN if one value is NaN.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Largest value.
    pub max: f64,
    /// √(mean square).
    pub rms: f64,
    /// Smallest value not exceeded by at least 95 % of the values.
    pub p95: f64,
}

impl Summary {
    /// Summary of |values|; zero for an empty list.
    pub fn of(values: &[f64]) -> Self {
        if values.iter().any(|x| x.is_nan()) {
            return Summary { max: f64::NAN, rms: f64::NAN, p95: f64::NAN };
        }
        let mut sorted: Vec<f64> = values.iter().map(|x| x.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let Some(&max) = sorted.last() else { return Summary::default() };
        let rank = (0.95 * sorted.len() as f64).ceil() as usize;
        // Squares of x/max cannot overflow.
        let unit = if max > 0.0 && max.is_finite() { max } else { 1.0 };
        let mean = sorted.iter().map(|x| (x / unit).powi(2)).sum::<f64>() / sorted.len() as f64;
        Summary { max, rms: unit * mean.sqrt(), p95: sorted[rank.max(1) - 1] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_residual_is_nonzero_where_its_law_is_broken() {
        // µ = 0.5, un = 2, ut = 3, λ = (4, 1), ρ = (0.5, 0.25). By hand:
        // r_n = 4 − max(0, 4 − 1) = 1;  r_t = 1 − clamp(1 − 0.75, ±2) = 0.75;
        // λn un = 8; |ut| |2 − 1| + λt ut = 3 + 3 = 6;
        // De Saxcé: ρ = 0.25, ũ = (3.5, 3), λ − ρũ = (3.125, 0.25), inside: r = (0.875, 0.75).
        let r = law_residual(0.5, [2.0, 3.0], [4.0, 1.0], [0.5, 0.25]);
        assert_eq!((r.normal, r.tangent, r.complementarity, r.dissipation), (1.0, 0.75, 8.0, 6.0));
        assert_eq!(r.de_saxce, 0.875f64.hypot(0.75));
        assert_eq!((r.approach, r.pull, r.cone), (0.0, 0.0, 0.0));
        // un = −1, λ = (−2, 3): r_n = −2 − max(0, −2 + 0.5) = −2, r_t = 3 − 0.
        let r = law_residual(0.5, [-1.0, 0.0], [-2.0, 3.0], [0.5, 0.25]);
        assert_eq!((r.normal, r.tangent, r.approach, r.pull, r.cone), (-2.0, 3.0, 1.0, 2.0, 3.0));
        // Tensile: λ − ρũ = (−1.75, 3); µ|λt| = 1.5 ≤ 1.75: apex, so r = λ.
        assert_eq!(r.de_saxce, 2.0f64.hypot(3.0));
    }

    #[test]
    fn residuals_vanish_on_the_law_for_any_rho() {
        let on_the_law = [
            ([0.0, 0.0], [4.0, 1.0]),
            ([0.0, 3.0], [4.0, -2.0]),
            ([2.0, 3.0], [0.0, 0.0]),
            ([0.0, -1.0], [2.0, 1.0]),
        ];
        for (u, l) in on_the_law {
            for rho in [0.25, 1.0, 8.0] {
                let r = law_residual(0.5, u, l, [rho, 2.0 * rho]);
                // Powers of two make every operation exact, except the division by 1 + µ² in P_K.
                assert!(r.de_saxce < 1e-15, "{u:?} {l:?} {r:?}");
                assert_eq!(ContactResidual { de_saxce: 0.0, ..r }, ContactResidual::default());
            }
        }
    }

    #[test]
    fn convex_relaxation_is_not_the_law() {
        // Sliding with un = µ|ut| solves the relaxed cone problem; it must not count as a solution of
        // Coulomb's law.
        let r = law_residual(0.5, [1.0, 2.0], [4.0, -2.0], [1.0, 1.0]);
        assert_eq!((r.normal, r.tangent), (1.0, 0.0));
        assert!(r.de_saxce > 0.5);
    }

    #[test]
    fn cone_projection_has_three_regions() {
        assert_eq!(project_cone(0.5, [2.0, -1.0]), [2.0, -1.0]);
        assert_eq!(project_cone(0.5, [-2.0, 4.0]), [0.0, 0.0]);
        // (0, 5) onto the edge (1, ½): n' = 2.5/1.25 = 2.
        assert_eq!(project_cone(0.5, [0.0, 5.0]), [2.0, 1.0]);
        assert_eq!(project_cone(0.5, [0.0, -5.0]), [2.0, -1.0]);
        assert_eq!(project_cone(0.0, [3.0, 7.0]), [3.0, 0.0]);
        assert_eq!(project_cone(0.0, [-3.0, 7.0]), [0.0, 0.0]);
        assert_eq!(project_cone(0.0, [-3.0, 0.0]), [0.0, 0.0]);
    }

    #[test]
    fn summaries_by_hand_and_with_nan() {
        let s = Summary::of(&[3.0, -4.0]);
        assert_eq!((s.max, s.p95), (4.0, 4.0));
        assert!((s.rms - 12.5f64.sqrt()).abs() < 1e-15);
        let hundred: Vec<f64> = (1..=100).map(f64::from).collect();
        assert_eq!(Summary::of(&hundred).p95, 95.0);
        assert!(Summary::of(&[1.0, f64::NAN]).max.is_nan());
        assert_eq!(Summary::of(&[]), Summary::default());
    }

    #[test]
    fn a_blown_up_solver_does_not_look_exact() {
        let r = law_residual(0.5, [f64::NAN, f64::NAN], [1.0, 0.0], [1.0, 1.0]);
        assert!(r.normal.is_nan() && r.tangent.is_nan() && r.approach.is_nan());
    }
}
