//! Nonsmooth nonlinear conjugate gradients around Gauss–Seidel sweeps.
//!
//! Takes the change of a sweep as the descent direction, r = sweep(λ) − λ, and adds a multiple of the
//! previous direction, like the Fletcher–Reeves method with gradients.
//!
//! **Source**: Silcowitz-Hansen, Niebe & Erleben 2010, algorithm 1.
//! **Cost**: a sweep per iteration.
//! **Fails when** friction keeps switching: β > 1 then restarts so often that only Gauss–Seidel remains.

use super::problem::{ContactProblem, DPair};
use super::residual::Target;
use super::sweeps::{IterativeRun, ScalarRows, Stop, gauss_seidel, iterate};

/// NNCG from `start`. One iteration is a sweep and an extrapolation.
pub fn nncg(problem: &ContactProblem, target: Target, start: &[DPair], stop: Stop) -> IterativeRun {
    let rows = ScalarRows::new(problem, target);
    let mut direction = problem.no_impulses();
    let mut previous = f64::INFINITY;
    iterate(problem, target, start, stop, |impulses, velocities| {
        let before = impulses.clone();
        gauss_seidel(problem, &rows, false, impulses, velocities);
        let descent: Vec<DPair> =
            impulses.iter().zip(&before).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
        let square: f64 = descent.iter().map(|d| d[0] * d[0] + d[1] * d[1]).sum();
        // β > 1 means that the last direction increased the residual: restart from this sweep.
        let beta = if square <= previous && square > 0.0 { square / previous } else { 0.0 };
        for ((l, p), r) in impulses.iter_mut().zip(&mut direction).zip(&descent) {
            for k in 0..2 {
                l[k] += beta * p[k];
                p[k] = beta * p[k] + r[k];
            }
        }
        previous = square;
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::disc_column;
    use crate::lab::reference::sweeps::{Status, SweepDirection, pgs};

    #[test]
    fn beats_gauss_seidel_threefold_on_columns() {
        for n in [10, 20, 40] {
            let p = disc_column(n);
            let cold = vec![[0.0; 2]; n];
            let stop = Stop { tolerance: 1e-12, iterations: 20_000 };
            let fast = nncg(&p, Target::Rigid, &cold, stop);
            let slow = pgs(&p, Target::Rigid, &cold, SweepDirection::Symmetric, stop);
            assert_eq!(fast.status, Status::Converged);
            let sweeps = |history: &[f64]| history.iter().position(|&r| r <= 1e-4).unwrap();
            assert!(
                3 * sweeps(&fast.history) < sweeps(&slow.history),
                "n {n}: {} {}",
                sweeps(&fast.history),
                sweeps(&slow.history)
            );
            for (i, l) in fast.impulses.iter().enumerate() {
                let load = (n - i) as f64 / 24.0;
                // The residual 1e-12 times the condition number, about n².
                assert!((l[0] - load).abs() < 1e-9 * load, "{} is not {load}", l[0]);
            }
        }
    }
}
