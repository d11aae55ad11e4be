//! Jacobi: every contact solves against the velocities from before the sweep, and the velocity changes of all
//! contacts of a body are summed. No contact depends on the result of another, so the method needs no
//! coloring.
//!
//! **Source.** `catto2024solver2d`, `solve_jacobi`; soft contacts as in [`super::soft_step`].
//!
//! **Departures.** Contacts between two dynamic bodies have half the frequency of contacts with other bodies,
//! as in the source. Sums are formed color by color, so that every width gives the same bits. A factor
//! `relaxation` on all increments is added; 1 is the source's solver.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes and 1 warm start; `velocity_iterations` soft sweeps and, after
//! the positions, `relax_iterations` rigid ones. A sweep gathers each body twice, as it reads old
//! velocities and adds to sums.
//!
//! **Fails when** a body has several contacts: each removes the whole approach velocity, so n of them remove
//! it n times. The iteration x ← x − D⁻¹(A x + b) diverges if D⁻¹A has an eigenvalue above 2, which happens
//! for a body in a pile with three contacts or more. A `relaxation` below 2/λ_max prevents that, but slows
//! down everything else.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Soft, angular_frequencies};
use crate::constraints::{ImpactLaw, Passes, Solver};
use crate::lanes::BodyRow;
use crate::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION_OF_STEP, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "jacobi",
    source: "catto2024solver2d",
    summary: "all contacts at once from the old velocities, soft contacts and relaxing sweeps",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 2, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter::CONTACT_HERTZ_OF_STEP,
        Parameter {
            name: "relaxation",
            unit: "",
            default: 1.0,
            range: [1e-3, 1.0],
            meaning: "factor on what a sweep adds to velocities and impulses",
            trials: &[],
        },
        Parameter::push_speed(4.0),
    ],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION_OF_STEP, h)),
    exceptions: &[
        (Guarantee::Converges, "diverges where a body has three contacts or more"),
        (Guarantee::Rest, "diverges where a body has three contacts or more"),
    ],
    impacts: ImpactLaw::BOX2D,
    islands: Islands::Alone,
    make: Variant::made_by(|| Box::new(Jacobi::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct Jacobi {
    /// Sums of velocity increments. `[rows]`
    sums: Vec<BodyRow>,
}

impl Solver for Jacobi {
    fn step(&mut self, passes: &mut Passes<'_>) {
        step(passes, &mut self.sums);
    }
}

fn step(passes: &mut Passes<'_>, sums: &mut Vec<BodyRow>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, relaxation, push_speed] = [0, 1, 2].map(|i| passes.parameter(i));
    let soft = Soft::new(
        angular_frequencies(hertz, CONTACT_HERTZ_FRACTION_OF_STEP, h),
        CONTACT_DAMPING_RATIO,
        push_speed,
        h,
    );
    let rigid = Soft::without_springs(h);
    for substep in 0..budget.substeps {
        passes.integrate_velocities();
        passes.warm_start();
        for _ in 0..budget.velocity_iterations {
            passes.jacobi_sweep(Phase::Solve, soft, relaxation, sums, None);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.relax_iterations {
            passes.jacobi_sweep(Phase::Relax, rigid, relaxation, sums, None);
        }
        passes.end_substep(substep);
    }
}
