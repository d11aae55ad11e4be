//! Semi-smooth Newton on the Alart–Curnier function, with a sparse factorization.
//!
//! Each contact is open, sticking or slipping, depending on how its natural map is clipped:
//!
//! ```text
//! open   λn − ρn un ≤ 0                           λn = λt = 0
//! stick  |λt − ρt ut| < µ (λn − ρn un)            un = 0, ut = 0
//! slip   otherwise, s = sign(λt − ρt ut)          un = 0, λt = s µ λn
//! ```
//!
//! With fixed states the law is linear. The Newton step solves the rows of G named on the right for the
//! normal impulses of closed contacts and the tangential ones of sticking contacts. A slipping contact acts
//! along n + s µ t. In the right states, one step gives the solution.
//!
//! Rows of joints, J v + b + R λ = 0 within bounds, are free or at a bound, by the same sign. A block at its
//! norm cap is fixed at its projection.
//!
//! **Source**: Alart & Curnier 1991; Acary, Brémond & Huber 2018 (line search, proximal outer loop).
//! **Departures**: hyperstatic contacts make the linear problem singular and their states ambiguous. Newton
//! therefore solves a sequence of proximal problems (Rockafellar 1976): ε D (λ − λ_k) is added to the
//! relative velocities, which makes G + ε D definite, and the solution is λ_{k+1}. The error falls by ε/(σ +
//! ε) along every eigenvalue σ of D⁻¹G, and impulses that G leaves undetermined keep their initial values. ε
//! shrinks after every success. After a failure it grows again, and Gauss–Seidel sweeps, twice as many each
//! time, look for a better start. (Without the proximal term, rounding kept switching the states of contacts
//! on an edge: a pyramid of 40 rows stalled at a residual of 10⁻⁶.)
//! **Fails when** friction jams a pile, so that G has relevant eigenvalues near ε. The method then stalls at
//! residuals around 10⁻⁶, and [`mod@super::certify`] rejects its answer.

use super::joints::{BlockLine, RowVector};
use super::problem::{ContactProblem, DPair, ProblemContact, SideRows};
use super::residual::{OwnRow, Target, clamp};
use super::rows::positive;
use super::sparse;
use super::sweeps::{IterativeRun, Status, Stop, SweepDirection, pgs};

/// Symmetric sweeps before the first Newton step. The number doubles after every unsolved proximal problem.
const SWEEPS: usize = 20;
/// Maximum number of sweeps at a time.
const MOST_SWEEPS: usize = 1280;
/// First shift ε of the unit diagonal.
const FIRST_SHIFT: f64 = 1e-3;
/// Smallest shift. LU leaves noise of 10⁻¹⁶/ε in undetermined impulses, which must not switch states.
const LEAST_SHIFT: f64 = 1e-7;
/// Factor by which the shift falls after a solved proximal problem and rises after an unsolved one.
const SHIFT_FACTOR: f64 = 10.0;
/// Maximum number of Newton steps for one proximal problem.
const STEPS: usize = 40;
/// Halvings of a step before it counts as failed.
const HALVINGS: usize = 6;
/// A proximal problem is solved if its residual falls to this fraction of its initial value.
const INEXACT: f64 = 1e-2;

#[derive(Clone, Copy, Debug, PartialEq)]
enum IterateState {
    Open,
    Stick,
    /// Slipping, with the direction of λt.
    Slip(f64),
    /// A row of a joint within its bounds.
    Free,
    /// A row of a joint fixed at this impulse.
    At(f64),
}

/// Newton's method from `start`. One iteration is one proximal problem or a series of sweeps.
pub fn newton(problem: &ContactProblem, target: Target, start: &[DPair], stop: Stop) -> IterativeRun {
    let sweep = |from: &[DPair], n: usize| {
        pgs(
            problem,
            target,
            from,
            SweepDirection::Symmetric,
            Stop { tolerance: stop.tolerance, iterations: n },
        )
    };
    let (mut sweeps, mut shift) = (SWEEPS, FIRST_SHIFT);
    let mut run = sweep(start, sweeps);
    run.history = vec![run.history[0], run.history[run.history.len() - 1]];
    while run.status == Status::Limit && run.history.len() <= stop.iterations {
        let proximal = Proximal::new(problem, target, shift, &run.impulses);
        let next = match proximal.solve() {
            Some(impulses) => {
                shift = (shift / SHIFT_FACTOR).max(LEAST_SHIFT);
                sweep(&impulses, 0)
            }
            None => {
                shift = (shift * SHIFT_FACTOR).min(FIRST_SHIFT);
                sweeps = (2 * sweeps).min(MOST_SWEEPS);
                sweep(&run.impulses, sweeps)
            }
        };
        let mut history = run.history;
        history.push(next.history[next.history.len() - 1]);
        run = IterativeRun { history, ..next };
    }
    run
}

/// The contact law with ε D (λ − λ_center) added to the relative velocities. D is the diagonal of G.
struct Proximal<'a> {
    problem: &'a ContactProblem,
    law: Vec<OwnRow>,
    diagonal: Vec<DPair>,
    lines: Vec<BlockLine>,
    shift: f64,
    center: &'a [DPair],
}

impl<'a> Proximal<'a> {
    fn new(problem: &'a ContactProblem, target: Target, shift: f64, center: &'a [DPair]) -> Self {
        let law = (0..problem.contacts.len()).map(|i| target.row(problem, i)).collect();
        Proximal {
            problem,
            law,
            diagonal: problem.delassus_diagonal(),
            lines: problem.lines(target),
            shift,
            center,
        }
    }

    /// Impulses that solve this problem well enough, or `None`.
    fn solve(&self) -> Option<Vec<DPair>> {
        let mut impulses = self.center.to_vec();
        let mut now = self.merit(&impulses, &self.arguments(&impulses));
        let goal = INEXACT * INEXACT * now;
        let mut states = Vec::new();
        for _ in 0..STEPS {
            let next_states = self.states(&self.arguments(&impulses));
            // Solved exactly: a full step in these states has been taken.
            if now <= goal || next_states == states {
                return Some(impulses);
            }
            let target = self.solve_states(&next_states)?;
            let mut fraction = 1.0;
            let mut halvings = 0;
            (impulses, now) = loop {
                let blend = |(l, g): (&DPair, &DPair)| [0, 1].map(|k| l[k] + fraction * (g[k] - l[k]));
                let trial: Vec<DPair> = impulses.iter().zip(&target).map(blend).collect();
                let merit = self.merit(&trial, &self.arguments(&trial));
                // The directional derivative of the merit along a Newton step is −2 merit.
                if merit <= (1.0 - 2e-4 * fraction) * now {
                    break (trial, merit);
                }
                halvings += 1;
                if halvings > HALVINGS {
                    return None;
                }
                fraction *= 0.5;
            };
            states = if fraction == 1.0 { next_states } else { Vec::new() };
        }
        (now <= goal).then_some(impulses)
    }

    /// (λn − ρn un, λt − ρt ut) of every contact.
    fn arguments(&self, impulses: &[DPair]) -> Vec<DPair> {
        let velocities = self.problem.velocities(impulses);
        let one = |(i, c): (usize, &ProblemContact)| {
            let ([ln, lt], [cn, ct], [gn, gt]) = (impulses[i], self.center[i], self.diagonal[i]);
            let [vn, ut] = c.velocity(&velocities);
            let un = vn + self.law[i].bias + self.law[i].compliance * ln;
            let normal = ln - (un + self.shift * gn * (ln - cn)) / (gn + self.law[i].compliance);
            [normal, lt - ut / gt - self.shift * (lt - ct)]
        };
        let mut arguments: Vec<DPair> = self.problem.contacts.iter().enumerate().map(one).collect();
        for line in &self.lines {
            let (u, l, center) = (line.velocity(&velocities), line.read(impulses), line.read(self.center));
            let fixed = line.fixed();
            let (bias, softness) = (line.bias(), line.softness());
            arguments.extend((0..line.size).map(|i| {
                let k = &line.response[i];
                let soft = softness * (k[0] * l[0] + k[1] * l[1] + k[2] * l[2]);
                let f = u[i] + bias[i] + soft + self.shift * k[i] * (l[i] - center[i]);
                [fixed.map_or_else(|| l[i] - f / (k[i] * (1.0 + softness)), |fixed| fixed[i]), 0.0]
            }));
        }
        arguments
    }

    /// Energy-weighted square of the natural map ∑ G_ii r_i² (J), independent of the unit of mass.
    fn merit(&self, impulses: &[DPair], arguments: &[DPair]) -> f64 {
        let one = |(i, c): (usize, &ProblemContact)| {
            let ([ln, lt], [yn, yt], [gn, gt]) = (impulses[i], arguments[i], self.diagonal[i]);
            let radius = c.friction * positive(yn);
            gn * (ln - positive(yn)).powi(2) + gt * (lt - clamp(yt, radius)).powi(2)
        };
        let contacts: f64 = self.problem.contacts.iter().enumerate().map(one).sum();
        let of_line = |line: &BlockLine| {
            let (l, y) = (line.read(impulses), line.bound.project(line.read(arguments)));
            (0..line.size).map(|i| line.response[i][i] * (l[i] - y[i]).powi(2)).sum::<f64>()
        };
        contacts + self.lines.iter().map(of_line).sum::<f64>()
    }

    fn states(&self, arguments: &[DPair]) -> Vec<IterateState> {
        let one = |(&[normal, tangent], c): (&DPair, &ProblemContact)| {
            if normal <= 0.0 {
                IterateState::Open
            } else if tangent.abs() < c.friction * normal {
                IterateState::Stick
            } else {
                IterateState::Slip(tangent.signum())
            }
        };
        let mut states: Vec<IterateState> = arguments.iter().zip(&self.problem.contacts).map(one).collect();
        for line in &self.lines {
            let y = line.read(arguments);
            let projected = line.bound.project(y);
            let is_free = line.fixed().is_none() && line.bound.is_inside(y);
            let state = |i: usize| if is_free { IterateState::Free } else { IterateState::At(projected[i]) };
            states.extend((0..line.size).map(state));
        }
        states
    }

    /// Solves the linear problem with fixed states; `None` if it cannot be factorized.
    fn solve_states(&self, states: &[IterateState]) -> Option<Vec<DPair>> {
        // Unknowns (contact, direction). `index` maps back to them.
        let mut unknowns: Vec<(usize, usize)> = Vec::new();
        let mut index = vec![[usize::MAX; 2]; states.len()];
        for (i, state) in states.iter().enumerate() {
            let directions = match state {
                IterateState::Open | IterateState::At(_) => 0,
                IterateState::Slip(_) | IterateState::Free => 1,
                IterateState::Stick => 2,
            };
            for (direction, index) in index[i].iter_mut().enumerate().take(directions) {
                *index = unknowns.len();
                unknowns.push((i, direction));
            }
        }
        let n = unknowns.len();
        let rows: Vec<(&BlockLine, usize)> =
            self.lines.iter().flat_map(|line| (0..line.size).map(move |i| (line, i))).collect();
        let contacts = self.problem.contacts.len();
        let g = |i: usize, d: usize| match i.checked_sub(contacts) {
            Some(row) => rows[row].0.response[rows[row].1][rows[row].1],
            None => self.diagonal[i][d],
        };
        // Rows and columns are scaled by 1/√G_ii, which gives a unit diagonal.
        let scale: Vec<f64> = unknowns.iter().map(|&(i, d)| 1.0 / g(i, d).sqrt()).collect();
        let slope = |i: usize| match states[i] {
            IterateState::Slip(sign) => sign * self.problem.contacts[i].friction,
            _ => 0.0,
        };

        let mut entries: Vec<sparse::Triplet> = Vec::new();
        for (body, touching) in self.rows_of_bodies(states).iter().enumerate() {
            let b = &self.problem.bodies[body];
            let inverse = [b.inv_mass, b.inv_mass, b.inv_inertia];
            for (i, rows) in touching {
                for (j, columns) in touching {
                    let g = |d: usize, e: usize| -> f64 {
                        (0..3).map(|k| rows[d][k] * inverse[k] * columns[e][k]).sum()
                    };
                    for (d, &row) in index[*i].iter().enumerate().filter(|(_, r)| **r != usize::MAX) {
                        let normal = index[*j][0];
                        let value = (g(d, 0) + slope(*j) * g(d, 1)) * scale[row] * scale[normal];
                        entries.push((normal, row, value));
                        if states[*j] == IterateState::Stick {
                            let tangent = index[*j][1];
                            entries.push((tangent, row, g(d, 1) * scale[row] * scale[tangent]));
                        }
                    }
                }
            }
        }
        let held = |state: &IterateState| if let IterateState::At(l) = *state { [l, 0.0] } else { [0.0; 2] };
        let mut impulses: Vec<DPair> = states.iter().map(held).collect();
        let free = self.problem.velocities(&impulses);
        let mut right = vec![0.0; n];
        for (u, &(i, d)) in unknowns.iter().enumerate() {
            let pull = self.shift * self.center[i][d] / scale[u];
            if let Some(row) = i.checked_sub(contacts) {
                let (line, r) = rows[row];
                right[u] = pull - (line.velocity(&free)[r] + line.bias()[r]) * scale[u];
                entries.push((u, u, self.shift));
                for c in 0..line.size {
                    let column = index[line.first + c][0];
                    entries.push((
                        column,
                        u,
                        line.softness() * line.response[r][c] * scale[u] * scale[column],
                    ));
                }
                continue;
            }
            let law = if d == 0 { self.law[i] } else { OwnRow::default() };
            let velocity = self.problem.contacts[i].velocity(&free)[d] + law.bias;
            right[u] = pull - velocity * scale[u];
            entries.push((u, u, law.compliance * scale[u] * scale[u] + self.shift));
        }
        let x = sparse::solve(entries, &right)?;
        for (u, &(i, d)) in unknowns.iter().enumerate() {
            impulses[i][d] = x[u] * scale[u];
        }
        for (i, l) in impulses.iter_mut().enumerate() {
            if matches!(states[i], IterateState::Slip(_)) {
                l[1] = slope(i) * l[0];
            }
        }
        Some(impulses)
    }

    /// Closed contacts and free joint rows of every body, with their rows on that body.
    fn rows_of_bodies(&self, states: &[IterateState]) -> Vec<Vec<(usize, SideRows)>> {
        let mut touching = vec![Vec::new(); self.problem.bodies.len()];
        for (i, c) in self.problem.contacts.iter().enumerate() {
            if states[i] != IterateState::Open {
                c.sides().for_each(|(body, block)| touching[body].push((i, block)));
            }
        }
        for line in &self.lines {
            for (body, rows) in &line.sides {
                let free = (0..line.size).filter(|i| states[line.first + i] == IterateState::Free);
                touching[*body].extend(free.map(|i| (line.first + i, [rows[i], RowVector::default()])));
            }
        }
        touching
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::gallery::*;
    use crate::lab::reference::residual::natural_map;

    const TIGHT: Stop = Stop { tolerance: 1e-13, iterations: 60 };

    fn solve(p: &ContactProblem) -> IterativeRun {
        let run = newton(p, Target::Rigid, &vec![[0.0; 2]; p.contacts.len()], TIGHT);
        assert_eq!(run.status, Status::Converged, "{}: {:?}", p.name, run.history);
        run
    }

    #[test]
    fn long_columns_take_a_step_or_two() {
        // 60 discs: Gauss–Seidel takes 3360 sweeps per decade.
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
