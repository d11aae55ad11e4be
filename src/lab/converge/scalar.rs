//! Methods in `f64` that share no code with the solvers, as curves for comparison.

use super::replay::{Sequence, Start};
use super::{ConvergeOptions, CurvePoint, LAWS, ReplayCurve, reached};
use crate::lab::reference::certify::Reference;
use crate::lab::reference::nncg::nncg;
use crate::lab::reference::residual::Target;
use crate::lab::reference::sweeps::{self, Splitting, Stop};
use crate::lab::reference::{ContactProblem, DPair};

/// Curves of the scalar methods in `f64` of [`crate::lab::reference`]. These solve a contact row by row, so
/// with friction the order of rows differs slightly from the solvers' order.
pub(super) fn curves(
    problem: &ContactProblem,
    reference: Option<&Reference>,
    has_warm_start: bool,
    options: &ConvergeOptions,
) -> Vec<ReplayCurve> {
    let stop = Stop { tolerance: 1e-9, iterations: options.max_iterations as usize };
    let mut shuffled = problem.clone();
    let order = Sequence::Shuffled(options.seed);
    let manifolds: Vec<_> = problem.contacts.chunk_by(|p, q| p.manifold == q.manifold).collect();
    shuffled.contacts =
        order.order(manifolds.len()).iter().flat_map(|&i| manifolds[i as usize].iter().copied()).collect();
    shuffled.joints =
        order.order(problem.joints.len()).iter().map(|&i| problem.joints[i as usize].clone()).collect();
    type Method = fn(&ContactProblem, &[DPair], Stop) -> sweeps::IterativeRun;
    let methods: [(&str, &ContactProblem, Sequence, usize, Method); 5] = [
        ("Gauss-Seidel", problem, Sequence::Natural, 1, |p, l, s| {
            sweeps::pgs(p, Target::Rigid, l, sweeps::SweepDirection::Forward, s)
        }),
        ("Gauss-Seidel", &shuffled, order, 1, |p, l, s| {
            sweeps::pgs(p, Target::Rigid, l, sweeps::SweepDirection::Forward, s)
        }),
        ("Jacobi", problem, Sequence::Natural, 1, |p, l, s| {
            sweeps::jacobi(p, Target::Rigid, l, Splitting::Whole, s)
        }),
        ("Jacobi, mass splitting", problem, Sequence::Natural, 1, |p, l, s| {
            sweeps::jacobi(p, Target::Rigid, l, Splitting::Mass, s)
        }),
        ("NNCG", problem, Sequence::Natural, 1, |p, l, s| nncg(p, Target::Rigid, l, s)),
    ];
    let mut curves = Vec::new();
    for (name, problem, order, sweeps, method) in methods {
        for start in [Start::Cold, Start::Warm].into_iter().take(if has_warm_start { 2 } else { 1 }) {
            let impulses = if start == Start::Warm { problem.warm_impulses() } else { problem.no_impulses() };
            let run = method(problem, &impulses, stop);
            let last = run.history.len() - 1;
            let error = reference.map(|r| problem.velocity_error(&run.velocities, &r.velocities));
            let points: Vec<CurvePoint> = (0..=last)
                .map(|k| CurvePoint {
                    iterations: k as u32,
                    sweeps: k * sweeps,
                    rigid: run.history[k],
                    own: Some(run.history[k]),
                    velocity_error: if k == last { error } else { None },
                })
                .collect();
            let [rigid, own] = LAWS.map(|law| reached(&points, law, 0.0));
            curves.push(ReplayCurve {
                solver: name.into(),
                is_part: false,
                arithmetic: "f64",
                order,
                start,
                points,
                rigid,
                own,
                own_is_rigid: true,
                iteration: None,
            });
        }
    }
    curves
}
