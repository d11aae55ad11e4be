//! Semi-smooth Newton on the Alart–Curnier function, with a sparse factorisation.
//!
//! Each contact is open, sticking or slipping by the sign of what its natural map clips:
//!
//! ```text
//! open   λn − ρn un ≤ 0                           λn = λt = 0
//! stick  |λt − ρt ut| < µ (λn − ρn un)            un = 0, ut = 0
//! slip   otherwise, s = sign(λt − ρt ut)          un = 0, λt = s µ λn
//! ```
//!
//! With the states fixed the law is linear: the Newton step solves, for the normal impulses of
//! closed and the tangential ones of sticking contacts, the rows of G named on the right, a
//! slipping contact acting along n + s µ t. In the right states it gives the solution at once.
//!
//! **Source**: Alart & Curnier 1991; Acary, Brémond & Huber 2018 (line search, start).
//! **Departures**: hyperstatic rows make the matrix A singular. It is factorised as A + ε, unit
//! diagonal, and x ← x + (A + ε)⁻¹ (r − A x) is repeated: for a consistent system the proximal
//! point method, which converges to the solution nearest to where it starts, by ε/(σ + ε) along
//! each singular value σ. Where no fraction of the step lowers the merit, Gauss–Seidel sweeps (a
//! number that doubles each time) take over.
//! **Fails when** no sweeps come near a solution, and slowly on large hyperstatic piles near
//! slipping: a pyramid of 4760 points at µ = 0.1 still changes states after 60 steps, where
//! [`super::nncg`] converges.

use super::problem::{Block, ContactProblem, Pair};
use super::residual::{Target, contact_residuals};
use super::sweeps::{Run, Status, Stop, Sweep, pgs};
use faer::Col;
use faer::linalg::solvers::Solve;
use faer::sparse::{SparseColMat, Triplet};

/// Symmetric sweeps before the first Newton step; doubled every time that a step fails.
const SWEEPS: usize = 20;
/// Most sweeps between two Newton steps.
const MOST_SWEEPS: usize = 1280;
/// Shift ε of the unit diagonal: small against the least nonzero eigenvalues of a pile. LU leaves
/// noise of 10⁻¹⁶/ε in undetermined impulses; at ε = 10⁻⁹ that noise kept switching the states of
/// contacts on an edge, and a pyramid of 40 rows stalled at a residual of 10⁻⁶.
const SHIFT: f64 = 1e-6;
/// Proximal steps per linear solve.
const PROXIMAL_STEPS: usize = 8;
/// Halvings of a step before it counts as failed.
const HALVINGS: usize = 6;

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Open,
    Stick,
    /// Direction of λt.
    Slip(f64),
}

/// Newton's method from `start`; one iteration is one linear solve, or a bout of sweeps.
pub fn newton(problem: &ContactProblem, target: Target, start: &[Pair], stop: Stop) -> Run {
    let sweep = |from: &[Pair], n: usize| {
        pgs(problem, target, from, Sweep::Symmetric, Stop { tolerance: stop.tolerance, iterations: n })
    };
    let mut sweeps = SWEEPS;
    let mut run = sweep(start, sweeps);
    run.history = vec![run.history[0], run.history[run.history.len() - 1]];
    while run.status == Status::Limit && run.history.len() <= stop.iterations {
        let next = match step(problem, target, &run) {
            Some(impulses) => sweep(&impulses, 0),
            None => {
                sweeps = (2 * sweeps).min(MOST_SWEEPS);
                sweep(&run.impulses, sweeps)
            }
        };
        let mut history = run.history;
        history.push(next.history[next.history.len() - 1]);
        run = Run { history, ..next };
    }
    run
}

/// Energy-weighted square of the natural map ∑ G_ii r_i² (J): the same in all units of mass.
fn merit(problem: &ContactProblem, target: Target, diagonal: &[Pair], impulses: &[Pair]) -> f64 {
    let velocities = problem.velocities(impulses);
    let residuals = contact_residuals(problem, target, &velocities, impulses);
    residuals.iter().zip(diagonal).map(|(r, g)| g[0] * r.normal.powi(2) + g[1] * r.tangent.powi(2)).sum()
}

/// The impulses after one damped Newton step, or none if no fraction of it lowers the merit.
fn step(problem: &ContactProblem, target: Target, run: &Run) -> Option<Vec<Pair>> {
    let diagonal = problem.delassus_diagonal();
    let states = classify(problem, target, &diagonal, run);
    let goal = solve_states(problem, target, &diagonal, &states, &run.impulses)?;
    let now = merit(problem, target, &diagonal, &run.impulses);
    let mut fraction = 1.0;
    for _ in 0..=HALVINGS {
        let blend = |(l, g): (&Pair, &Pair)| [0, 1].map(|k| l[k] + fraction * (g[k] - l[k]));
        let trial: Vec<Pair> = run.impulses.iter().zip(&goal).map(blend).collect();
        // The directional derivative of the merit along a Newton step is −2 merit.
        if merit(problem, target, &diagonal, &trial) <= (1.0 - 2e-4 * fraction) * now {
            return Some(trial);
        }
        fraction *= 0.5;
    }
    None
}

fn classify(problem: &ContactProblem, target: Target, diagonal: &[Pair], run: &Run) -> Vec<State> {
    let state = |i: usize| {
        let c = &problem.contacts[i];
        let row = target.row(problem, i);
        let [vn, ut] = c.velocity(&run.velocities);
        let [ln, lt] = run.impulses[i];
        let un = vn + row.bias + row.compliance * ln;
        let normal = ln - un / (diagonal[i][0] + row.compliance);
        let tangent = lt - ut / diagonal[i][1];
        if normal <= 0.0 {
            State::Open
        } else if tangent.abs() < c.friction * normal {
            State::Stick
        } else {
            State::Slip(tangent.signum())
        }
    };
    (0..problem.contacts.len()).map(state).collect()
}

/// Solves the linear problem of fixed states, nearest to `near`; none if it cannot be factorised.
fn solve_states(
    problem: &ContactProblem,
    target: Target,
    diagonal: &[Pair],
    states: &[State],
    near: &[Pair],
) -> Option<Vec<Pair>> {
    // Unknowns (contact, direction); `index` finds them again.
    let mut unknowns: Vec<(usize, usize)> = Vec::new();
    let mut index = vec![[usize::MAX; 2]; states.len()];
    for (i, state) in states.iter().enumerate() {
        let directions = match state {
            State::Open => 0,
            State::Slip(_) => 1,
            State::Stick => 2,
        };
        for (direction, index) in index[i].iter_mut().enumerate().take(directions) {
            *index = unknowns.len();
            unknowns.push((i, direction));
        }
    }
    let n = unknowns.len();
    let scale: Vec<f64> = unknowns.iter().map(|&(i, d)| 1.0 / diagonal[i][d].sqrt()).collect();
    let slope = |i: usize| match states[i] {
        State::Slip(sign) => sign * problem.contacts[i].friction,
        _ => 0.0,
    };

    let mut entries: Vec<Triplet<usize, usize, f64>> = Vec::new();
    for (body, touching) in contacts_of_bodies(problem, states).iter().enumerate() {
        let b = &problem.bodies[body];
        let inverse = [b.inv_mass, b.inv_mass, b.inv_inertia];
        for (i, rows) in touching {
            for (j, columns) in touching {
                let g = |d: usize, e: usize| -> f64 {
                    (0..3).map(|k| rows[d][k] * inverse[k] * columns[e][k]).sum()
                };
                for (d, &row) in index[*i].iter().enumerate().filter(|(_, r)| **r != usize::MAX) {
                    let normal = index[*j][0];
                    let val = (g(d, 0) + slope(*j) * g(d, 1)) * scale[row] * scale[normal];
                    entries.push(Triplet { row, col: normal, val });
                    if states[*j] == State::Stick {
                        let col = index[*j][1];
                        entries.push(Triplet { row, col, val: g(d, 1) * scale[row] * scale[col] });
                    }
                }
            }
        }
    }
    let free = problem.velocities(&vec![[0.0; 2]; states.len()]);
    let mut right = Col::<f64>::zeros(n);
    for (u, &(i, d)) in unknowns.iter().enumerate() {
        let law = target.row(problem, i);
        let bias = if d == 0 { law.bias } else { 0.0 };
        let compliance = if d == 0 { law.compliance } else { 0.0 };
        right[u] = -(problem.contacts[i].velocity(&free)[d] + bias) * scale[u];
        entries.push(Triplet { row: u, col: u, val: compliance * scale[u] * scale[u] });
    }
    let matrix = SparseColMat::try_new_from_triplets(n, n, &entries).ok()?;
    entries.extend((0..n).map(|u| Triplet { row: u, col: u, val: SHIFT }));
    let shifted = SparseColMat::try_new_from_triplets(n, n, &entries).ok()?;
    let factors = shifted.sp_lu().ok()?;

    let mut x = Col::from_fn(n, |u| near[unknowns[u].0][unknowns[u].1] / scale[u]);
    for _ in 0..PROXIMAL_STEPS {
        let residual = &right - &matrix * &x;
        let change = factors.solve(&residual);
        x += &change;
        if change.norm_max() <= 1e-15 * x.norm_max() {
            break;
        }
    }
    if !x.iter().all(|x| x.is_finite()) {
        return None;
    }
    let mut impulses = vec![[0.0; 2]; states.len()];
    for (u, &(i, d)) in unknowns.iter().enumerate() {
        impulses[i][d] = x[u] * scale[u];
    }
    for (i, l) in impulses.iter_mut().enumerate() {
        if matches!(states[i], State::Slip(_)) {
            l[1] = slope(i) * l[0];
        }
    }
    Some(impulses)
}

/// Closed contacts of every body, with their rows on that body.
fn contacts_of_bodies(problem: &ContactProblem, states: &[State]) -> Vec<Vec<(usize, Block)>> {
    let mut touching = vec![Vec::new(); problem.bodies.len()];
    for (i, c) in problem.contacts.iter().enumerate() {
        if states[i] != State::Open {
            c.sides().for_each(|(body, block)| touching[body].push((i, block)));
        }
    }
    touching
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::truth::gallery::*;
    use crate::truth::residual::natural_map;

    const TIGHT: Stop = Stop { tolerance: 1e-13, iterations: 60 };

    fn solve(p: &ContactProblem) -> Run {
        let run = newton(p, Target::Rigid, &vec![[0.0; 2]; p.contacts.len()], TIGHT);
        assert_eq!(run.status, Status::Converged, "{}: {:?}", p.name, run.history);
        run
    }

    #[test]
    fn long_columns_take_a_step_or_two() {
        // 60 discs: Gauss–Seidel gains a decade per 3360 sweeps.
        let p = disc_column(60);
        let run = solve(&p);
        assert!(run.history.len() < 15, "{:?}", run.history);
        for (i, l) in run.impulses.iter().enumerate() {
            let load = (60 - i) as f64 / 24.0;
            assert!((l[0] - load).abs() < 1e-9, "{} is not {load}", l[0]);
        }
    }

    #[test]
    fn sliding_sticking_rolling_and_heavy() {
        solve(&sliding_box());
        solve(&block_on_incline(0.25, 0.24));
        solve(&block_on_incline(0.25, 0.26));
        solve(&disc_on_incline(0.25, 0.05));
        solve(&heavy_on_light(1e4));
        solve(&painleve_rod(1e-3));
        solve(&wedge(0.25, 0.5));
        solve(&plank(&[-1.5, -0.5, 0.5, 1.5], 0.5));
    }

    #[test]
    fn pyramids_come_to_rest() {
        for base in [5, 20] {
            let p = box_pyramid(base, 0.6);
            let run = solve(&p);
            assert!(p.mass_norm(&run.velocities) < 1e-10, "base {base}");
            assert!(natural_map(&p, Target::Rigid, &run.velocities, &run.impulses) < 1e-13);
        }
    }
}
