//! Anderson acceleration of Gauss–Seidel: the next iterate is the combination of the last few sweeps with the
//! smallest change.
//!
//! **Source.** `walker2011`, section 2; the sweeps are those of [`super::pgs`].
//!
//! **Departures.** If the impulses change by more than twice as much in a sweep as in the previous one,
//! the history is discarded. The last sweep is not extrapolated, so that impulses end within their
//! bounds. With joints, products of impulses are sums of energies, Σ x y/m with the effective mass m of
//! each row, since N·s and N·m·s cannot be added.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`], and after each sweep passes over 2·`depth` + 4 vectors, in lanes.
//!
//! **Fails when** iterations are few, or contacts open and close: the combination is exact only for
//! linear sweeps, and clamping is not linear.
//!
//! # The method
//!
//! Let g_k = sweep(λ_k) and f_k = g_k − λ_k. ΔF and ΔG are the last few differences of f and g. With the γ that minimizes
//! |f_k − ΔF γ|,
//!
//! ```text
//! λ_{k+1} = g_k − ΔG γ
//! ```
//!
//! γ is found from the normal equations in `f64`, with at most 5 unknowns. 10⁻⁹ of the trace is added to their diagonal.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::numerics::matrix::solve_in_place;
use crate::constraints::records::point_vector::{difference, energy, plus_scaled, update};
use crate::constraints::{Passes, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "anderson",
    source: "walker2011",
    summary: "Gauss–Seidel sweeps, extrapolated from the last few of them",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "depth",
            unit: "",
            default: 3.0,
            range: [1.0, 5.0],
            meaning: "earlier sweeps that an extrapolation sees",
            trials: &[1.0, 3.0, 5.0],
        },
    ],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

/// Maximum number of earlier sweeps.
const DEPTH: usize = 5;
/// Fraction of the trace that is added to the diagonal of the normal equations (1).
const RIDGE: f64 = 1e-9;
/// Growth of |f|² above which the history is discarded (1).
const GROWTH: f64 = 4.0;

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
    let depth = passes.parameter(1) as usize;
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        let [mut begin, mut swept, mut change, mut last_swept] = [(); 4].map(|_| passes.vector());
        let mut changes: [_; DEPTH] = [(); DEPTH].map(|_| passes.vector());
        let mut images: [_; DEPTH] = [(); DEPTH].map(|_| passes.vector());
        passes.with_system(Phase::Solve, |system| system.lane_impulses(&mut begin));
        let masses = passes.energy_masses(Phase::Solve);
        // Sweeps since the last restart, and |f|² of the previous sweep.
        let (mut seen, mut last) = (0_usize, f64::INFINITY);
        for k in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
            if k + 1 == budget.velocity_iterations {
                break;
            }
            passes.with_system(Phase::Solve, |system| {
                system.lane_impulses(&mut swept);
                let at = seen % depth;
                // Differences of f and g from the previous sweep. `change` still holds the previous f.
                update(
                    [&mut changes[at], &mut images[at], &mut change, &mut last_swept, &mut begin],
                    [&swept],
                    |[.., last_f, last_g, begin], [g]| {
                        let f = difference(g, begin);
                        // The next sweep starts from g, unless g is extrapolated.
                        [difference(f, last_f), difference(g, last_g), f, g, g]
                    },
                );
                let square = energy(&change, &change, masses.as_ref());
                let is_first = seen == 0 || square > GROWTH * last;
                (seen, last) = (if is_first { 1 } else { seen + 1 }, square);
                // The first sweep after a restart has no predecessor. What it stored is not used.
                let columns = (seen - 1).min(depth);
                if is_first {
                    seen = 1;
                    return;
                }
                let place = |j: usize| (at + depth - j) % depth;
                let mut gram = [0.0; DEPTH * DEPTH];
                let mut right = [0.0; DEPTH];
                for i in 0..columns {
                    right[i] = energy(&changes[place(i)], &change, masses.as_ref());
                    for j in 0..=i {
                        let product = energy(&changes[place(i)], &changes[place(j)], masses.as_ref());
                        (gram[i * columns + j], gram[j * columns + i]) = (product, product);
                    }
                }
                let trace: f64 = (0..columns).map(|i| gram[i * columns + i]).sum();
                (0..columns).for_each(|i| gram[i * columns + i] += RIDGE * trace);
                if !solve_in_place(&mut gram[..columns * columns], &mut right[..columns], 0.0) {
                    return;
                }
                for (j, gamma) in right[..columns].iter().enumerate() {
                    let gamma = *gamma as f32;
                    update([&mut begin], [&images[place(j)]], |[b], [d]| [plus_scaled(b, -gamma, d)]);
                }
                system.set_lane_impulses(&mut begin);
                update([&mut swept], [&begin], |[swept], [begin]| [difference(begin, swept)]);
                system.push_lanes(&mut swept);
            });
        }
        passes.give_back(masses);
        passes.give_back(images);
        passes.give_back(changes);
        passes.give_back([begin, swept, change, last_swept]);
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
