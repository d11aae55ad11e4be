//! Newton's method on the convex relaxation of friction, in the velocities of bodies, with an exact line search: few
//! iterations, each with a sparse factorisation.
//!
//! **Source.** `castro2022` (SAP, Drake's solver: regularised contact impulses as a function of velocity); `todorov2014` and
//! MuJoCo's documentation (its Newton solver with elliptic cones is the same method).
//!
//! **Departures.** Both sources let contacts give way for good: by 1/(4π²) = 0.025 of their effective mass at the least
//! (SAP), by 0.05 to 0.1 (MuJoCo). Here a point gives way around the impulse of the step before by `regularization`, which
//! is less, and where Newton's method has iterations left that centre moves, so that what remains is the relaxation
//! alone. Normal and tangent give way alike. Overlap is pushed apart as in [`super::pgs`] instead of by damped springs.
//!
//! **Cost.** Per substep 2 body passes and 1 warm start, and up to `velocity_iterations` times a few passes over points and a
//! factorisation of 3 × 3 blocks, one per body and two per pair of bodies that touch, fill included, in `f64`, one lane. The
//! pattern is found once while contacts stay the same ones. Sweeps of a step request 0 B per contact.
//!
//! **Fails when** anything slides: the relaxation makes surfaces part at µ times the speed of sliding, as in
//! [`super::apgd`]; and in time, where piles are so wide that factors fill.
//!
//! The method is told in [`crate::engine::constraints::vectors::proximal`].

use super::{Law, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::vectors::proximal::{PointLaw, Proximal};
use crate::engine::constraints::{ImpactLaw, Passes, Solver};
use crate::engine::params::{Budget, LINEAR_SLOP, MAX_PUSH_SPEED, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "sap",
    source: "castro2022",
    summary: "Newton's method on the convex relaxation, with sparse factors: lifts off while sliding",
    budget: Budget { substeps: 1, velocity_iterations: 20, relax_iterations: 0, position_iterations: 0 },
    parameters: &[
        Parameter::BAUMGARTE,
        Parameter {
            name: "regularization",
            unit: "",
            default: 1e-2,
            range: [1e-9, 1.0],
            meaning: "ε: how far contacts give way, as a share of their effective mass",
            trials: &[],
        },
    ],
    breaks: &[(Law::Converges, "to the convex relaxation, which is another law")],
    impacts: ImpactLaw::None,
    make: || Box::new(Sap::default()),
    ..Variant::BASE
};

/// What it keeps.
#[derive(Clone, Debug, Default)]
struct Sap {
    newton: Proximal,
}

impl Solver for Sap {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [fraction, epsilon] = [0, 1].map(|i| passes.parameter(i));
        let rule = Baumgarte::new(fraction, LINEAR_SLOP, MAX_PUSH_SPEED, h);
        let (newton, epsilon) = (&mut self.newton, f64::from(epsilon));
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.warm_start();
            passes.with_system(Phase::Solve, |system| {
                newton.space.load(system, |gap| rule.bias(gap));
                newton.begin(epsilon);
            });
            for _ in 0..budget.velocity_iterations {
                let done = passes.with_system(Phase::Solve, |system| {
                    let done = newton.iterate(PointLaw::Relaxed, epsilon);
                    newton.space.write(system, &newton.impulses);
                    done
                });
                passes.count_sweep(2);
                passes.iteration_done();
                if done {
                    break;
                }
            }
            passes.solves(&Sweep(rule));
            passes.integrate_positions();
            passes.end_substep(substep);
        }
    }

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        self.newton.held_bytes()
    }
}
