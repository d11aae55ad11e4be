//! The exact rate of Gauss–Seidel on a problem.
//!
//! Near a solution without ties the sweeps of projected Gauss–Seidel are linear: separated contacts
//! stay at zero, the tangential impulse of a sliding one is ±µ times its normal impulse, and every
//! other row i changes its error e_i by −(J_i M⁻¹ Jᵀ e)/G_ii. The error falls per sweep by the spectral
//! radius of that map, which power iteration finds. Where contacts outnumber what they determine, some
//! errors change no velocity and stay for ever; so it is the velocities w = M⁻¹ Jᵀ e, in the mass norm,
//! that are watched.

use super::problem::{ContactProblem, Pair, Velocity};
use super::residual::Target;
use super::sweeps::{Status, Stop, Sweep, pgs};

/// Sweeps of the power iteration, in blocks whose factors are compared.
const BLOCK: usize = 200;
const BLOCKS: usize = 100;

/// Blocks that agree to this much (1) have found the rate.
const AGREEMENT: f64 = 1e-9;

/// Impulses below this share of the largest, and friction this near to its bound, count as there (1).
const TIE: f64 = 1e-7;

/// What a contact does at the solution.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Separated,
    Sticks,
    /// λt = this · λn
    Slides(f64),
}

/// Most rows that are updated on the way to the solution.
const MOST_UPDATES: usize = 100_000_000;

/// Factor by which a forward sweep of Gauss–Seidel, in the order of the contacts, reduces the error near
/// the solution that it comes to from zero. (Where loads are not unique, another solution would have
/// another rate.) None where it does not get there, or nothing is left after a sweep or two.
pub fn gauss_seidel_rate(problem: &ContactProblem) -> Option<f64> {
    let count = problem.contacts.len();
    let stop = Stop { tolerance: 1e-12, iterations: MOST_UPDATES / count.max(1) };
    let run = pgs(problem, Target::Rigid, &vec![[0.0; 2]; count], Sweep::Forward, stop);
    (run.status == Status::Converged).then(|| rate_at(problem, &run.impulses))?
}

/// The same near the solution `impulses`.
fn rate_at(problem: &ContactProblem, impulses: &[Pair]) -> Option<f64> {
    let largest = impulses.iter().map(|l| l[0]).fold(0.0, f64::max);
    let state = |(c, l): (&super::ProblemContact, &Pair)| {
        let bound = c.friction * l[0];
        match l {
            _ if l[0] <= TIE * largest => State::Separated,
            _ if l[1].abs() >= (1.0 - TIE) * bound => State::Slides(c.friction * l[1].signum()),
            _ => State::Sticks,
        }
    };
    let states: Vec<State> = problem.contacts.iter().zip(impulses).map(state).collect();
    let diagonal = problem.delassus_diagonal();
    // Any start that is orthogonal to nothing in particular.
    let mut errors: Vec<Pair> =
        (0..states.len()).map(|i| [1.0 + (1.7 * i as f64).sin(), 0.3 * (2.3 * i as f64).cos()]).collect();
    for (error, state) in errors.iter_mut().zip(&states) {
        match state {
            State::Separated => *error = [0.0; 2],
            State::Slides(ratio) => error[1] = ratio * error[0],
            State::Sticks => {}
        }
    }
    let mut change = vec![[0.0; 3]; problem.bodies.len()];
    let set = |change: &mut Vec<Velocity>, errors: &[Pair]| {
        change.iter_mut().for_each(|v| *v = [0.0; 3]);
        problem.contacts.iter().zip(errors).for_each(|(c, &e)| problem.apply(c, e, change));
    };
    set(&mut change, &errors);
    let mut previous = f64::NAN;
    for _ in 0..BLOCKS {
        let before = problem.mass_norm(&change);
        if before == 0.0 {
            return None;
        }
        for (error, v) in errors.iter_mut().zip(std::iter::repeat(1.0 / before)) {
            *error = [error[0] * v, error[1] * v];
        }
        set(&mut change, &errors);
        for _ in 0..BLOCK {
            sweep(problem, &states, &diagonal, &mut errors, &mut change);
        }
        let rate = problem.mass_norm(&change).powf(1.0 / BLOCK as f64);
        if rate < 1e-1 {
            return None;
        }
        if (rate - previous).abs() <= AGREEMENT {
            return Some(rate);
        }
        previous = rate;
    }
    previous.is_finite().then_some(previous)
}

fn sweep(
    problem: &ContactProblem,
    states: &[State],
    diagonal: &[Pair],
    errors: &mut [Pair],
    change: &mut [Velocity],
) {
    for (i, c) in problem.contacts.iter().enumerate() {
        if states[i] == State::Separated {
            continue;
        }
        let normal = -c.velocity(change)[0] / diagonal[i][0];
        errors[i][0] += normal;
        problem.apply(c, [normal, 0.0], change);
        let tangent = match states[i] {
            State::Slides(ratio) => ratio * errors[i][0] - errors[i][1],
            _ if c.friction > 0.0 => -c.velocity(change)[1] / diagonal[i][1],
            _ => 0.0,
        };
        errors[i][1] += tangent;
        problem.apply(c, [0.0, tangent], change);
    }
}

#[cfg(test)]
mod tests {
    use super::super::gallery::{box_pyramid, disc_column, heavy_on_light, sliding_box};
    use super::super::rates::rate;
    use super::*;
    use std::f64::consts::PI;

    fn of(problem: &ContactProblem) -> f64 {
        gauss_seidel_rate(problem).unwrap()
    }

    #[test]
    fn columns_and_mass_ratios_have_their_rates() {
        for n in [5, 10, 20] {
            let exact = (PI / (2 * n) as f64).cos().powi(2);
            assert!(
                (of(&disc_column(n)) - exact).abs() < 1e-6,
                "{n}: {} is not {exact}",
                of(&disc_column(n))
            );
        }
        for ratio in [10.0, 100.0] {
            assert!((of(&heavy_on_light(ratio)) - ratio / (1.0 + ratio)).abs() < 1e-6, "{ratio}");
        }
    }

    #[test]
    fn it_is_the_rate_that_sweeps_have() {
        for problem in [box_pyramid(4, 0.0), box_pyramid(5, 0.5), sliding_box()] {
            let stop = Stop { tolerance: 1e-13, iterations: 100_000 };
            let start = vec![[0.0; 2]; problem.contacts.len()];
            let solved = pgs(&problem, Target::Rigid, &start, Sweep::Forward, stop);
            // A start from zero may miss the slowest error by symmetry; one near the solution that
            // has no symmetry does not.
            let off = |(i, [n, t]): (usize, Pair)| [n * (1.0 + 1e-3 * (1.7 * i as f64).sin()), t * 0.999];
            let start: Vec<Pair> = solved.impulses.into_iter().enumerate().map(off).collect();
            let stop = Stop { tolerance: 1e-10, ..stop };
            let run = pgs(&problem, Target::Rigid, &start, Sweep::Forward, stop);
            let (measured, exact) = (rate(&run.history).unwrap(), of(&problem));
            assert!((measured - exact).abs() < 0.01 * (1.0 - exact), "{measured} is not {exact}");
        }
    }
}
