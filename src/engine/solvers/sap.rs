//! Newton's method on a convex problem in the velocities of the bodies, to machine precision. Contacts
//! and joints are slightly soft, friction is relaxed to a cone, and each step factorizes one sparse
//! matrix with three rows per body.
//!
//! **Source.** `castro2022`, sections III to V: unconstrained formulation, analytical inverse dynamics of
//! a contact, exact line search (Drake's SAP solver). `todorov2014` (MuJoCo) solves the same problem with
//! elliptic cones. `anitescu2006` (the relaxation).
//!
//! **Departures.** The compliance of a contact is `softness` times its effective inverse mass along n, and
//! `tangent_softness` times along t, both 10⁻⁵ by default. For nearly rigid contacts, SAP uses 0.025 and 0.001;
//! MuJoCo's default is about 0.1. Overlap is pushed apart as in [`super::pgs`], but without a slop, within which soft
//! contacts would sink from step to step. Factors are within an envelope (`numerics/envelope.rs`), which has no fill ordering of its own. If a
//! factorization would take more than `factor_work`, conjugate gradients with a block-diagonal
//! preconditioner find the step, as in MuJoCo's second solver. The relative compliance of rigid joint
//! rows is 10⁻⁸; that of springs follows from their law. Motors and capped springs have the nearest
//! impulse within their bound, in the norm of their compliance.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes and up to `velocity_iterations` Newton steps, each a factorization in `f64`, one
//! lane: 9 n b² operations for n bodies in a band of b bodies. A step in which nothing changes state takes one or two.
//!
//! **Fails when** bodies slide: the relaxation separates the surfaces at µ times the sliding speed. When
//! bands are wide. When iterations end early: impulses are velocities divided by `softness`, and mean
//! nothing until the velocities have converged.
//!
//! # The method
//!
//! See `sap/convex.rs`.

#[doc(hidden)]
pub mod convex;

use super::{Guarantee, Islands, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::{ImpactLaw, Passes, Schedule};
use crate::params::{Budget, Parameter};
use convex::Convex;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "sap",
    source: "castro2022",
    summary: "Newton's method on the convex relaxation in velocities, sparse factors: lifts off while sliding",
    budget: Budget { substeps: 1, velocity_iterations: 100, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "softness",
            unit: "",
            default: 1e-5,
            range: [1e-9, 1e3],
            meaning: "what contacts give way, over their effective inverse mass",
            trials: &[1e-6, 1e-4, 1e-3],
        },
        Parameter {
            name: "tangent_softness",
            unit: "",
            default: 1e-5,
            range: [1e-9, 1e3],
            meaning: "the same along the surface; the source has 0.001, and softness 0.025",
            trials: &[],
        },
        Parameter {
            name: "factor_work",
            unit: "10⁶",
            default: 1000.0,
            range: [0.0, 1e9],
            meaning: "multiplications of a factorization, beyond which conjugate gradients take its place",
            trials: &[],
        },
    ],
    exceptions: &[
        (Guarantee::Converges, "to the convex relaxation with soft contacts, which is another law"),
        (Guarantee::NoAllocation, "matrices are as large as the scene"),
    ],
    impacts: ImpactLaw::None,
    islands: Islands::Alone,
    make: Variant::made_by(|| Schedule::boxed(step)),
    ..Variant::BASE
};

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let rule = Baumgarte::new(passes.parameter(0), 0.0, passes.push_speed(), h);
    let [softness, tangent_softness, millions] = [1, 2, 3].map(|i| f64::from(passes.parameter(i)));
    let softness = [softness, tangent_softness];
    let mut last = Vec::new();
    for substep in 0..budget.substeps {
        // Newton's method starts from the velocities of the last step.
        passes.with_system(Phase::Solve, |system| {
            last.clear();
            last.extend(system.rows().iter().map(|row| [0, 1, 2].map(|k| row.velocity[k])));
        });
        passes.integrate_velocities();
        let mut problem = passes
            .with_system(Phase::Solve, |system| Convex::new(system, &rule, softness, h, 1e6 * millions));
        passes.with_system(Phase::Solve, |_| problem.begin(&last));
        for k in 0..budget.velocity_iterations {
            let steps = passes.with_system(Phase::Solve, |_| problem.step());
            if steps {
                passes.count_sweep(2);
            }
            if steps || k == 0 {
                passes.with_system(Phase::Solve, |system| problem.write(system));
            }
            passes.iteration_done();
        }
        passes.integrate_positions();
        passes.end_substep(substep);
    }
}
