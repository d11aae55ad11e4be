//! Successive over-relaxation: each row changes its impulse by more than its own equation requires.
//!
//! **Source.** `cottle1992` (projected SOR); otherwise [`super::pgs`].
//!
//! **Departures.** None. λ ← max(0, λ + ω (λ_row − λ)), where λ_row is the impulse that satisfies the row
//! alone. Friction rows work the same way, within their bounds.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`].
//!
//! **Fails when** ω was chosen for another scene. A column of N discs converges fastest with ω = 2/(1 +
//! sin(π/2N)): by ω − 1 per sweep instead of cos²(π/2N). Piles with redundant rows gain less (the second
//! point of a box is half of the first), and from ω = 2 on nothing converges. With few sweeps, a large ω
//! leaves larger errors than no over-relaxation.

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{Passes, Schedule};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "sor",
    source: "cottle1992",
    summary: "sequential impulses, over-relaxed",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "relaxation",
            unit: "",
            default: 1.3,
            range: [0.1, 2.0],
            meaning: "factor on the increment of a row; 1 is plain Gauss–Seidel",
            trials: &[1.0, 1.2, 1.4, 1.6],
        },
    ],
    exceptions: &[(Guarantee::Rest, "8 sweeps are too few for tall stacks and large mass ratios")],
    islands: Islands::Apart,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let budget = passes.budget();
    let [fraction, relaxation] = [0, 1].map(|i| passes.parameter(i));
    let rule = Baumgarte::relaxed(fraction, passes.slop(), passes.push_speed(), passes.h(), relaxation);
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &rule);
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
