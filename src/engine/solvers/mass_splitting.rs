//! Jacobi on split bodies: a body with n contacts becomes n copies with an n-th of its mass each. Every
//! contact has its own copies of its two bodies. After a sweep, all copies of a body get their mean velocity.
//!
//! Contacts share no copies, so all of them can be solved at once. Each copy has a correct velocity, and the
//! mean of those cannot overshoot as the sum of [`super::jacobi`] does.
//!
//! **Source.** `tonge2012`, sections 4 and 5.
//!
//! **Departures.** The rows of a contact are solved one after the other. Overlap is pushed apart by the soft
//! rows of [`super::soft_step`], which the source does not have.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes, 1 warm start, 2 passes for the masses; `velocity_iterations`
//! soft sweeps and `relax_iterations` rigid ones, each of which gathers bodies twice as
//! [`super::jacobi`] does.
//!
//! **Fails when** sweeps are few. The method always converges, but slowly, because each contact acts on only
//! an n-th of a mass.
//!
//! # Why it converges
//!
//! With J split by contacts, the sweep minimizes the sum of the energies of all contacts over the copies,
//! which were equal before it. The mean is the projection onto equal copies in the norm of their masses, n
//! (m/n) = m. Neither raises the energy ½ λᵀ K λ + bᵀ λ. Momentum is conserved: copies get Δλ/(m/n) each, and
//! the body gets the mean, Σ Δλ/m.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::masses::ScaledMasses;
use crate::constraints::kernels::velocity::rules::{Soft, angular_frequencies};
use crate::constraints::records::graph::Graph;
use crate::constraints::{ImpactLaw, Passes, Solver};
use crate::lanes::BodyRow;
use crate::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION_OF_STEP, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "mass_splitting",
    source: "tonge2012",
    summary: "all contacts at once, each with a part of its bodies' masses",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 4, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[Parameter::CONTACT_HERTZ_OF_STEP, Parameter::PUSH_SPEED],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION_OF_STEP, h)),
    exceptions: &[
        (Guarantee::Converges, "too slowly to wait for: ten discs by 0.9938 per sweep, springs slower still"),
        (Guarantee::Rest, "12 slow sweeps are too few for stacks"),
    ],
    impacts: ImpactLaw::BOX2D,
    islands: Islands::Alone,
    make: Variant::made_by(|| Box::new(MassSplitting::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct MassSplitting {
    graph: Graph,
    masses: ScaledMasses,
    /// Sums of velocity increments. `[rows]`
    sums: Vec<BodyRow>,
}

impl Solver for MassSplitting {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [hertz, push_speed] = [0, 1].map(|i| passes.parameter(i));
        let soft = Soft::new(
            angular_frequencies(hertz, CONTACT_HERTZ_FRACTION_OF_STEP, h),
            CONTACT_DAMPING_RATIO,
            push_speed,
            h,
        );
        let rigid = Soft::without_springs(h);
        passes.build_graph(&mut self.graph);
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.warm_start();
            self.sweeps(passes, Phase::Solve, soft, budget.velocity_iterations);
            passes.integrate_positions();
            self.sweeps(passes, Phase::Relax, rigid, budget.relax_iterations);
            passes.end_substep(substep);
        }
    }
}

impl MassSplitting {
    /// Runs `times` sweeps on split bodies.
    fn sweeps(&mut self, passes: &mut Passes<'_>, phase: Phase, rule: Soft, times: u32) {
        let MassSplitting { graph, masses, sums } = self;
        passes.scale_masses(phase, masses, |body| graph.constraints_of(body).max(1) as f32);
        for _ in 0..times {
            passes.jacobi_sweep(phase, rule, 1.0, sums, Some(masses));
            if phase == Phase::Solve {
                passes.iteration_done();
            }
        }
        passes.restore_masses(phase, masses);
    }
}
