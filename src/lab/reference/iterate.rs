//! Iterations of the oracle's sweeps: projected Gauss–Seidel, Jacobi, and two accelerations of Gauss–Seidel.
//!
//! **Sources**: Gauss–Seidel: Jean & Moreau 1992, Catto 2005. [`ConjugateSweeps`]: Silcowitz-Hansen,
//! Niebe & Erleben 2010, algorithm 1. [`Anderson`]: Walker & Ni 2011.

use super::oracle::{Oracle, RowOrder, ScalarSweep};
use super::problem::{ContactProblem, DPair, Target, Velocity};
use super::residual::LawMeasure;
use super::rows::OwnRow;
use crate::engine::constraints::numerics::matrix::solve_in_place;

/// Termination criteria of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Relative natural-map residual to reach (1), see [`ContactProblem::impulse_unit`].
    pub tolerance: f64,
    /// Maximum number of iterations.
    pub iterations: usize,
}

/// A method; one iteration is a sweep, or two if they are symmetric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Iteration {
    /// Gauss–Seidel in the order of the problem, normal and friction row of each point in turn.
    Forward,
    /// The same forward, then backward.
    Symmetric,
    /// Jacobi; may diverge.
    Jacobi,
    /// Jacobi on bodies that are split among their rows.
    SplitJacobi,
    /// Gauss–Seidel with nonsmooth conjugate gradients.
    Conjugate,
    /// Symmetric Gauss–Seidel with Anderson mixing of this many differences.
    Anderson(usize),
}

/// Result of an iteration.
#[derive(Clone, Debug)]
pub struct IterativeRun {
    /// Final impulses (N·s).
    pub impulses: Vec<DPair>,
    /// v⁺ that follows from the impulses.
    pub velocities: Vec<Velocity>,
    /// Relative natural-map residual: of the start, then after every iteration.
    pub history: Vec<f64>,
}

/// Iterates from `start` until `stop` or until the residual exceeds 10⁶ times its start, and measures the residual
/// after every iteration.
pub fn iterate(
    problem: &ContactProblem,
    target: Target,
    start: &[DPair],
    method: Iteration,
    stop: Stop,
) -> IterativeRun {
    let (unit, measure) = (problem.impulse_unit(), LawMeasure::new(problem, target));
    let law: Vec<OwnRow> = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
    let sweep = ScalarSweep { rows: RowOrder::PointByPoint, ..ScalarSweep::new(&law[..]) };
    let back = ScalarSweep { reversed: true, ..sweep };
    let mut mixing: Option<Box<dyn Acceleration>> = match method {
        Iteration::Conjugate => Some(Box::new(ConjugateSweeps::default())),
        Iteration::Anderson(depth) => Some(Box::new(Anderson::new(depth))),
        _ => None,
    };
    let mut oracle = Oracle::new(problem, target, start.to_vec());
    let mut history = Vec::new();
    loop {
        // Velocities are recomputed from the impulses, so that the rounding of millions of updates does not
        // accumulate.
        oracle.v = problem.velocities(&oracle.l);
        let residual = measure.natural_map(&oracle.v, &oracle.l) / unit;
        history.push(residual);
        let diverges = residual.is_nan() || residual > 1e6 * history[0].max(1.0);
        if residual <= stop.tolerance || diverges || history.len() > stop.iterations {
            break;
        }
        let before = if mixing.is_some() { oracle.l.clone() } else { Vec::new() };
        match method {
            Iteration::Jacobi => oracle.jacobi(&sweep, false, true),
            Iteration::SplitJacobi => oracle.jacobi(&sweep, true, true),
            _ => oracle.sweep(&sweep),
        }
        if matches!(method, Iteration::Symmetric | Iteration::Anderson(_)) {
            oracle.sweep(&back);
        }
        if let Some(mixing) = &mut mixing {
            oracle.l = mixing.next(&before, &oracle.l);
        }
    }
    IterativeRun { impulses: oracle.l, velocities: oracle.v, history }
}

/// Extrapolates from a sweep.
pub trait Acceleration {
    /// The next impulses, from those `before` the sweep and after it.
    fn next(&mut self, before: &[DPair], swept: &[DPair]) -> Vec<DPair>;
}

/// Sum of the products of all entries.
pub fn dot(a: &[DPair], b: &[DPair]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a[0] * b[0] + a[1] * b[1]).sum()
}

/// a + s b
pub fn plus(a: &[DPair], s: f64, b: &[DPair]) -> Vec<DPair> {
    a.iter().zip(b).map(|(a, b)| [a[0] + s * b[0], a[1] + s * b[1]]).collect()
}

/// Nonsmooth nonlinear conjugate gradients: the change of a sweep, r, takes the place of the gradient of
/// Fletcher and Reeves' method, λ ← λ + r + β p with β = |r|²/|r before|².
#[derive(Clone, Debug, Default)]
pub struct ConjugateSweeps {
    direction: Vec<DPair>,
    previous: f64,
}

impl Acceleration for ConjugateSweeps {
    fn next(&mut self, before: &[DPair], swept: &[DPair]) -> Vec<DPair> {
        let descent = plus(swept, -1.0, before);
        let square = dot(&descent, &descent);
        // β > 1 means that the last direction increased the residual: restart from this sweep.
        let beta = if square <= self.previous && square > 0.0 { square / self.previous } else { 0.0 };
        self.previous = square;
        if beta == 0.0 {
            self.direction = descent;
            return swept.to_vec();
        }
        let next = plus(swept, beta, &self.direction);
        self.direction = plus(&descent, beta, &self.direction);
        next
    }
}

/// Anderson mixing: with f the change by a sweep and g its result, the next impulses are g − ∑ γ Δg with the
/// γ that minimize |f − ∑ γ Δf| over the last sweeps.
#[derive(Clone, Debug)]
pub struct Anderson {
    depth: usize,
    /// Whether growth of |f| by two forgets all sweeps before.
    pub restarts: bool,
    /// Fraction of |Δf|² of each difference that is added to its diagonal of the least-squares problem (1).
    pub damping: f64,
    /// Whether instead that fraction of ∑ |Δf|² is added to all.
    pub damps_sum: bool,
    /// f and g of the last sweep.
    last: Option<[Vec<DPair>; 2]>,
    /// Δf and Δg since the last restart, and the products of each Δf with those up to it.
    differences: Vec<[Vec<DPair>; 2]>,
    products: Vec<Vec<f64>>,
}

impl Anderson {
    /// Mixing of `depth` differences.
    pub fn new(depth: usize) -> Self {
        let (last, differences, products) = (None, Vec::new(), Vec::new());
        Anderson { depth, restarts: true, damping: 1e-14, damps_sum: false, last, differences, products }
    }
}

impl Acceleration for Anderson {
    fn next(&mut self, before: &[DPair], swept: &[DPair]) -> Vec<DPair> {
        let (f, g) = (plus(swept, -1.0, before), swept.to_vec());
        if let Some([last_f, last_g]) = self.last.take() {
            if self.restarts && dot(&f, &f) > 4.0 * dot(&last_f, &last_f) {
                self.differences.clear();
                self.products.clear();
            } else {
                if self.differences.len() == self.depth {
                    self.differences.remove(0);
                    self.products.remove(0);
                    for row in &mut self.products {
                        row.remove(0);
                    }
                }
                self.differences.push([plus(&f, -1.0, &last_f), plus(&g, -1.0, &last_g)]);
                let newest = &self.differences[self.differences.len() - 1][0];
                self.products.push(self.differences.iter().map(|[df, _]| dot(df, newest)).collect());
            }
        }
        let n = self.differences.len();
        let square = |i: usize| self.products[i][i];
        // Scaled to a unit diagonal.
        let size: Vec<f64> = (0..n).map(|i| if self.damps_sum { 1.0 } else { square(i).sqrt() }).collect();
        let sum: f64 = (0..n).map(square).sum();
        let damping = if self.damps_sum { self.damping * sum } else { self.damping };
        let entry = |i: usize, j: usize| {
            self.products[i.max(j)][i.min(j)] / (size[i] * size[j]) + if i == j { damping } else { 0.0 }
        };
        let mut matrix: Vec<f64> = (0..n * n).map(|at| entry(at / n, at % n)).collect();
        let mut gamma: Vec<f64> = (0..n).map(|i| dot(&self.differences[i][0], &f) / size[i]).collect();
        let is_solved = (0..n).all(|i| square(i) > 0.0) && solve_in_place(&mut matrix, &mut gamma, 0.0);
        let mut next = g.clone();
        for i in (0..n).filter(|_| is_solved) {
            next = plus(&next, -gamma[i] / size[i], &self.differences[i][1]);
        }
        self.last = Some([f, g]);
        next
    }
}

/// Maximum number of row updates on the way to the solution.
const MOST_UPDATES: usize = 100_000_000;

/// Asymptotic reduction factor of the residual in a forward sweep of Gauss–Seidel, in the order of the
/// problem and from zero. `None` if the sweeps reach no solution, or converge too fast for a fit.
///
/// Near the solution sweeps are linear, and a power iteration could find their spectral radius. But with more
/// contacts than the velocities determine, some errors change no velocity, and contacts that touch without
/// load are a tie. The rate is therefore fitted to the residuals.
pub fn gauss_seidel_rate(problem: &ContactProblem) -> Option<f64> {
    // A joint block takes as long as several contacts.
    let count = problem.contacts.len() + 4 * problem.joint_rows();
    // The tolerance is well above the rounding floor.
    let stop = Stop { tolerance: 1e-11, iterations: MOST_UPDATES / count.max(1) };
    rate(&iterate(problem, Target::Rigid, &problem.no_impulses(), Iteration::Forward, stop).history)
}

/// Minimum number of points for a fit.
const FEWEST_POINTS: usize = 4;

/// Asymptotic factor per iteration of a residual history, fitted to its last decade; above 1 if it diverges.
///
/// The last decade is the longest tail with all entries within a factor 10 of the last one. The rate is the
/// exponential of the least-squares slope of ln r over it. The history must end above the rounding floor,
/// otherwise its flat end is fitted. `None` if the tail is shorter than four (convergence faster than linear)
/// or the last entry is not a positive number.
pub fn rate(history: &[f64]) -> Option<f64> {
    let points: Vec<[f64; 2]> = history.iter().enumerate().map(|(k, &r)| [k as f64, r]).collect();
    rate_at(&points)
}

/// Like [`rate`], from points (iteration, residual) that may skip iterations.
pub fn rate_at(history: &[[f64; 2]]) -> Option<f64> {
    let &[_, last] = history.last()?;
    if last.is_nan() || last <= 0.0 || last.is_infinite() {
        return None;
    }
    let near = |p: &&[f64; 2]| p[1] >= 0.1 * last && p[1] <= 10.0 * last;
    let tail = &history[history.len() - history.iter().rev().take_while(near).count()..];
    if tail.len() < FEWEST_POINTS {
        return None;
    }
    // Slope ∑ (k − k̄) ln r_k / ∑ (k − k̄)².
    let middle = tail.iter().map(|p| p[0]).sum::<f64>() / tail.len() as f64;
    let sums = tail.iter().fold([0.0, 0.0], |[xy, xx], [k, r]| {
        let x = k - middle;
        [xy + x * r.ln(), xx + x * x]
    });
    Some((sums[0] / sums[1]).exp())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;
    use std::f64::consts::PI;

    /// From zero; whether it converges is the last of its history.
    fn run(p: &ContactProblem, method: Iteration, tolerance: f64) -> (IterativeRun, bool) {
        let stop = Stop { tolerance, iterations: 20_000 };
        let run = iterate(p, Target::Rigid, &p.no_impulses(), method, stop);
        let converges = run.history.last().is_some_and(|&residual| residual <= tolerance);
        (run, converges)
    }

    /// Columns: cos²(π/2n) for Gauss–Seidel, whose next mode is 10⁹ times smaller in the last decade; cos for
    /// Jacobi, whose modes ±cos θ alternate, which a fit averages to a few 10⁻⁴. Mass ratios: R/(1 + R).
    #[test]
    fn rates_are_exact_on_columns_and_mass_ratios() {
        let theta = |n: usize| PI / (2 * n) as f64;
        let mut cases: Vec<(ContactProblem, Iteration, f64, f64)> = Vec::new();
        for n in [5, 10, 15, 20] {
            cases.push((disc_column(n), Iteration::Forward, theta(n).cos().powi(2), 1e-6));
            cases.push((disc_column(n), Iteration::Jacobi, theta(n).cos(), 1e-3));
        }
        for r in [1.0, 10.0, 100.0, 1000.0] {
            cases.push((heavy_on_light(r), Iteration::Forward, r / (1.0 + r), 1e-6));
        }
        cases.push((light_on_heavy(1.0), Iteration::Forward, 0.5, 1e-6));
        for (p, method, exact, error) in cases {
            // Far above the rounding floor and far below the level at which other modes matter.
            let (run, converges) = run(&p, method, 1e-10);
            let measured = rate(&run.history).unwrap();
            assert!(
                converges && (measured - exact).abs() < error,
                "{} {method:?}: {measured} is not {exact}",
                p.name
            );
            if method == Iteration::Forward {
                let found = gauss_seidel_rate(&p).unwrap();
                assert!((found - exact).abs() < 1e-4 * (1.0 - exact), "{}: {found} is not {exact}", p.name);
            }
        }
        // Light on heavy converges by more than a decade in one or two sweeps: too few points for a fit.
        for r in [10.0, 100.0, 1000.0] {
            let history = run(&light_on_heavy(r), Iteration::Forward, 1e-10).0.history;
            assert!(history.len() < 15 && (history[2] / history[1] - 1.0 / (1.0 + r)).abs() < 1e-6, "{r}");
        }
        assert_eq!(gauss_seidel_rate(&sliding_box()), None);
    }

    #[test]
    fn rates_of_geometric_histories_are_their_ratio() {
        let geometric = |r: f64, n: i32| -> Vec<f64> { (0..n).map(|k| 3.0 * r.powi(k)).collect() };
        let close = |history: &[f64], r: f64| assert!((rate(history).unwrap() - r).abs() < 1e-12, "{r}");
        [0.5, 0.99, 1.5].into_iter().for_each(|r| close(&geometric(r, 60), r));
        // The start does not matter.
        close(&[geometric(0.1, 5), geometric(0.8, 80)].concat(), 0.8);
        let uneven: Vec<[f64; 2]> = [0, 1, 2, 5, 9, 10, 17].map(|k| [k as f64, 0.9f64.powi(k)]).to_vec();
        assert!((rate_at(&uneven).unwrap() - 0.9).abs() < 1e-12);
        // No rate from too little.
        for history in [&[][..], &[1.0, 0.5, 0.0], &[1.0, 0.5, f64::NAN], &[1.0, 1e-3, 1e-9, 1e-16]] {
            assert_eq!(rate(history), None);
        }
    }
}
