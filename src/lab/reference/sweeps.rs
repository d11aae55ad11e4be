//! Sweeps over the rows: projected Gauss–Seidel, Jacobi, and Jacobi with mass splitting.
//!
//! Every method here changes one row at a time, by the impulse that would satisfy it alone,
//!
//! ```text
//! λn' = max(0, λn − un/G_nn),    λt' = clamp(λt − ut/G_tt, −µ λn', µ λn'),
//! ```
//!
//! so its fixed points are the zeros of the natural map. Gauss–Seidel (Catto 2005; NSGS of Jean &
//! Moreau 1992) applies each change at once. Jacobi applies all changes of a sweep together and diverges
//! where λ_max(D⁻¹G) > 2. Mass splitting (Tonge et al. 2012) gives each of the k rows of a body a copy with
//! 1/k of its mass and averages the copies afterward. A row then sees k times the inverse mass, and averaging
//! divides the effect of its impulse by k again. This is Jacobi with D_i = ∑_sides k J_i M⁻¹ J_iᵀ. Since (∑ᵢ
//! xᵢ)² ≤ k ∑ xᵢ² on every body, D ≥ G, so it converges.
//!
//! Joints are solved block by block, before the contacts as in the simulation. Each block gets the impulses
//! that satisfy it alone.

use super::joints::BlockLine;
use super::problem::{ContactProblem, DPair, Velocity};
use super::residual::{LawMeasure, OwnRow, Target, clamp};
use super::rows::positive;

/// Termination criteria of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Relative natural-map residual to reach (1), see [`ContactProblem::impulse_unit`].
    pub tolerance: f64,
    /// Maximum number of iterations.
    pub iterations: usize,
}

/// How an iteration ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The residual reached its tolerance.
    Converged,
    /// The maximum number of iterations was reached.
    Limit,
    /// The residual exceeded 10⁶ times its start, or is not a number.
    Diverged,
    /// The method has no step that reduces the residual.
    Stalled,
}

/// Result of an iterative method.
#[derive(Clone, Debug)]
pub struct IterativeRun {
    /// Final impulses (N·s).
    pub impulses: Vec<DPair>,
    /// v⁺ that follows from the impulses.
    pub velocities: Vec<Velocity>,
    /// Relative natural-map residual: of the start, then after every iteration.
    pub history: Vec<f64>,
    /// How it ended.
    pub status: Status,
}

/// Constants of all rows.
pub(super) struct ScalarRows {
    /// 1/(G_ii + compliance), normal and tangential (kg).
    inverse: Vec<DPair>,
    law: Vec<OwnRow>,
    /// Blocks of joints.
    lines: Vec<BlockLine>,
}

impl ScalarRows {
    pub(super) fn new(problem: &ContactProblem, target: Target) -> Self {
        Self::with_diagonal(problem, target, &problem.delassus_diagonal())
    }

    fn with_diagonal(problem: &ContactProblem, target: Target, diagonal: &[DPair]) -> Self {
        let law: Vec<OwnRow> = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
        let invert = |(g, row): (&DPair, &OwnRow)| [1.0 / (g[0] + row.compliance), 1.0 / g[1]];
        let lines = problem.lines(target);
        ScalarRows { inverse: diagonal.iter().zip(&law).map(invert).collect(), law, lines }
    }

    /// Normal impulse that would satisfy row `i` alone. NaN stays NaN, so that divergence is detected.
    fn normal(&self, i: usize, vn: f64, ln: f64) -> f64 {
        let un = vn + self.law[i].bias + self.law[i].compliance * ln;
        positive(ln - un * self.inverse[i][0])
    }

    /// Tangential impulse that would satisfy row `i` alone, within ±`radius`.
    fn tangent(&self, i: usize, ut: f64, lt: f64, radius: f64) -> f64 {
        clamp(lt - ut * self.inverse[i][1], radius)
    }
}

/// One Gauss–Seidel pass over joints, then contacts. A reversed pass runs from last to first.
pub(super) fn gauss_seidel(
    problem: &ContactProblem,
    rows: &ScalarRows,
    reversed: bool,
    impulses: &mut [DPair],
    velocities: &mut [Velocity],
) {
    if reversed {
        sweep_contacts(problem, rows, (0..problem.contacts.len()).rev(), impulses, velocities);
        sweep_joints(problem, rows.lines.iter().rev(), impulses, velocities);
    } else {
        sweep_joints(problem, rows.lines.iter(), impulses, velocities);
        sweep_contacts(problem, rows, 0..problem.contacts.len(), impulses, velocities);
    }
}

fn sweep_joints<'a>(
    problem: &ContactProblem,
    lines: impl Iterator<Item = &'a BlockLine>,
    impulses: &mut [DPair],
    velocities: &mut [Velocity],
) {
    for line in lines {
        let old = line.read(impulses);
        let new = line.solution(line.velocity(velocities), old);
        line.apply(problem, [0, 1, 2].map(|i| new[i] - old[i]), velocities);
        line.write(new, impulses);
    }
}

fn sweep_contacts(
    problem: &ContactProblem,
    rows: &ScalarRows,
    order: impl Iterator<Item = usize>,
    impulses: &mut [DPair],
    velocities: &mut [Velocity],
) {
    for i in order {
        let c = &problem.contacts[i];
        let [ln, lt] = impulses[i];
        let normal = rows.normal(i, c.velocity(velocities)[0], ln);
        problem.apply(c, [normal - ln, 0.0], velocities);
        impulses[i][0] = normal;
        if c.friction > 0.0 || lt != 0.0 {
            let tangent = rows.tangent(i, c.velocity(velocities)[1], lt, c.friction * normal);
            problem.apply(c, [0.0, tangent - lt], velocities);
            impulses[i][1] = tangent;
        }
    }
}

/// Direction of Gauss–Seidel sweeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SweepDirection {
    /// In the order of the contacts.
    Forward,
    /// Forward, then backward; counts as one iteration.
    Symmetric,
}

/// Iterates `step` from `start` until `stop`, and measures the residual after every iteration.
pub(super) fn iterate(
    problem: &ContactProblem,
    target: Target,
    start: &[DPair],
    stop: Stop,
    mut step: impl FnMut(&mut Vec<DPair>, &mut Vec<Velocity>),
) -> IterativeRun {
    let (unit, measure) = (problem.impulse_unit(), LawMeasure::new(problem, target));
    let mut impulses = start.to_vec();
    let mut history = Vec::new();
    loop {
        // Velocities are recomputed from the impulses, so that the rounding of millions of updates does not
        // accumulate.
        let mut velocities = problem.velocities(&impulses);
        let residual = measure.natural_map(&velocities, &impulses) / unit;
        history.push(residual);
        let status = if residual <= stop.tolerance {
            Status::Converged
        } else if residual.is_nan() || residual > 1e6 * history[0].max(1.0) {
            Status::Diverged
        } else if history.len() > stop.iterations {
            Status::Limit
        } else {
            step(&mut impulses, &mut velocities);
            continue;
        };
        return IterativeRun { impulses, velocities, history, status };
    }
}

/// Projected Gauss–Seidel from `start`.
pub fn pgs(
    problem: &ContactProblem,
    target: Target,
    start: &[DPair],
    sweep: SweepDirection,
    stop: Stop,
) -> IterativeRun {
    let rows = ScalarRows::new(problem, target);
    iterate(problem, target, start, stop, |impulses, velocities| {
        gauss_seidel(problem, &rows, false, impulses, velocities);
        if sweep == SweepDirection::Symmetric {
            gauss_seidel(problem, &rows, true, impulses, velocities);
        }
    })
}

/// How Jacobi divides the mass of a body among its rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Splitting {
    /// Every row uses the whole mass; may diverge.
    Whole,
    /// Every row uses its share of the mass.
    Mass,
}

/// Projected Jacobi from `start`.
pub fn jacobi(
    problem: &ContactProblem,
    target: Target,
    start: &[DPair],
    split: Splitting,
    stop: Stop,
) -> IterativeRun {
    let diagonal = match split {
        Splitting::Whole => problem.delassus_diagonal(),
        Splitting::Mass => split_diagonal(problem),
    };
    let mut rows = ScalarRows::with_diagonal(problem, target, &diagonal);
    if split == Splitting::Mass {
        let share = shares(problem);
        rows.lines.iter_mut().for_each(|line| line.split(problem, &share));
    }
    iterate(problem, target, start, stop, |impulses, velocities| {
        for line in &rows.lines {
            line.write(line.solution(line.velocity(velocities), line.read(impulses)), impulses);
        }
        for (i, c) in problem.contacts.iter().enumerate() {
            let [un, ut] = c.velocity(velocities);
            let normal = rows.normal(i, un, impulses[i][0]);
            impulses[i] = [normal, rows.tangent(i, ut, impulses[i][1], c.friction * normal)];
        }
    })
}

/// ∑_sides k J_i M⁻¹ J_iᵀ with k the number of rows on that body: two per contact with friction.
fn split_diagonal(problem: &ContactProblem) -> Vec<DPair> {
    let count = shares(problem);
    let mut diagonal = vec![[0.0; 2]; problem.contacts.len()];
    for (c, d) in problem.contacts.iter().zip(&mut diagonal) {
        for (body, block) in c.sides() {
            let b = &problem.bodies[body];
            for (d, row) in d.iter_mut().zip(&block) {
                let whole =
                    b.inv_mass * (row[0] * row[0] + row[1] * row[1]) + b.inv_inertia * row[2] * row[2];
                *d += count[body] * whole;
            }
        }
    }
    diagonal
}

/// Number of rows on each body: two per contact with friction, and all rows of its joints.
fn shares(problem: &ContactProblem) -> Vec<f64> {
    let mut count = vec![0.0; problem.bodies.len()];
    for c in &problem.contacts {
        for (body, _) in c.sides() {
            count[body] += if c.friction > 0.0 { 2.0 } else { 1.0 };
        }
    }
    for joint in &problem.joints {
        for body in [joint.body_a, joint.body_b].into_iter().flatten() {
            count[body as usize] += joint.rows().count() as f64;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;
    use crate::lab::reference::rates::rate;
    use std::f64::consts::PI;

    fn cold(p: &ContactProblem) -> Vec<DPair> {
        vec![[0.0; 2]; p.contacts.len()]
    }

    /// Far above the rounding floor, and far below the level at which other modes matter.
    const DEEP: Stop = Stop { tolerance: 1e-10, iterations: 20_000 };

    #[test]
    fn gauss_seidel_on_a_column_has_the_rate_of_its_walk() {
        for n in [5, 10, 15, 20] {
            let p = disc_column(n);
            let run = pgs(&p, Target::Rigid, &cold(&p), SweepDirection::Forward, DEEP);
            assert_eq!(run.status, Status::Converged);
            let exact = (PI / (2.0 * n as f64)).cos().powi(2);
            let measured = rate(&run.history).unwrap();
            // The next mode, cos²(3π/2n), is 10⁹ times smaller at the start of the last decade.
            assert!((measured - exact).abs() < 1e-6, "n {n}: {measured} is not {exact}");
        }
    }

    #[test]
    fn jacobi_on_a_column_has_the_square_root_of_it() {
        for n in [5, 10] {
            let p = disc_column(n);
            let run = jacobi(&p, Target::Rigid, &cold(&p), Splitting::Whole, DEEP);
            let exact = (PI / (2.0 * n as f64)).cos();
            let measured = rate(&run.history).unwrap();
            // The modes ±cos θ alternate. A fit over a decade averages this to a few 10⁻⁴.
            assert!((measured - exact).abs() < 1e-3, "n {n}: {measured} is not {exact}");
        }
    }

    #[test]
    fn mass_ratio_sets_the_rate_both_ways() {
        for r in [1.0, 10.0, 100.0, 1000.0] {
            for (p, exact) in [(heavy_on_light(r), r / (1.0 + r)), (light_on_heavy(r), 1.0 / (1.0 + r))] {
                let run = pgs(&p, Target::Rigid, &cold(&p), SweepDirection::Forward, DEEP);
                assert_eq!(run.status, Status::Converged);
                // Light on heavy converges by more than a decade in one or two sweeps: too few points for a
                // fit.
                if exact > 0.2 {
                    let measured = rate(&run.history).unwrap();
                    assert!((measured - exact).abs() < 1e-6, "{}: {measured} is not {exact}", p.name);
                } else {
                    assert!(run.history.len() < 15);
                    assert!((run.history[2] / run.history[1] - exact).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn mass_splitting_cures_jacobi_on_a_plank() {
        // Three supports close together: λ_max(D⁻¹G) is nearly 3.
        let p = plank(&[-0.1, 0.0, 0.1], 0.5);
        let whole = jacobi(
            &p,
            Target::Rigid,
            &cold(&p),
            Splitting::Whole,
            Stop { tolerance: 1e-6, iterations: 1000 },
        );
        assert_ne!(whole.status, Status::Converged);
        let split = jacobi(&p, Target::Rigid, &cold(&p), Splitting::Mass, DEEP);
        assert_eq!(split.status, Status::Converged);
        // The error in the energy norm falls monotonically; the maximum norm may fluctuate slightly.
        assert!(split.history.windows(2).all(|w| w[1] <= 1.001 * w[0]), "{:?}", &split.history[..20]);
        assert!(p.mass_norm(&split.velocities) < 1e-9);
    }

    #[test]
    fn symmetric_sweeps_solve_friction() {
        let p = sliding_box();
        let run = pgs(
            &p,
            Target::Rigid,
            &cold(&p),
            SweepDirection::Symmetric,
            Stop { tolerance: 1e-14, iterations: 1000 },
        );
        assert_eq!(run.status, Status::Converged);
        // 7 N and 13 N times h. The residual bounds the error up to the condition number, about 10.
        assert!((run.impulses[0][0] - 7.0 * p.h).abs() < 1e-12);
        assert!((run.impulses[1][1] + 0.3 * 13.0 * p.h).abs() < 1e-12);
    }

    #[test]
    fn divergence_is_a_status() {
        let p = plank(&[0.0; 10], 0.0);
        let run =
            jacobi(&p, Target::Rigid, &cold(&p), Splitting::Whole, Stop { tolerance: 1e-6, iterations: 50 });
        assert!(matches!(run.status, Status::Limit | Status::Diverged), "{:?}", run.status);
    }
}
