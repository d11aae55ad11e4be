//! PhysX's TGS: substeps with one biased sweep each, in which impulses accumulate from zero in every step.
//! Friction acts per contact and holds its points where they began to stick.
//!
//! **Source.** `nvidia2026physx`: `DyTGSDynamics.cpp` (schedule, bias 2/√n), `DyTGSContactPrep.cpp` (rows),
//! with their defaults: 4 position iterations, which are the substeps, 1 velocity iteration, no limit on
//! depenetration, strong friction, friction within 4 cm. Forces act in every substep, which the source does
//! if `eENABLE_EXTERNAL_FORCES_EVERY_ITERATION_TGS` is set.
//!
//! **Departures.** By default the source adds the forces of the whole step before the first substep: columns
//! then never come to rest, and falling bodies are up to half a step ahead (`papers/contest.md`). A patch is
//! a contact: its anchors are its points, matched from step to step. The source grows two anchors in a patch
//! and keeps them while the patch lasts. A point that would hit within the step rebounds at once, from where
//! it is. Impulses of joints restart from zero in each substep, and joints have the rows of this crate.
//! Contacts are swept color by color; the source sweeps by islands and partitions. Sleeping, stabilization,
//! compliant and torsional contacts are left out.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes and `velocity_iterations` sweeps, and `relax_iterations` at the
//! end; per step 1 pass that brings drifts into the order of the lanes and 1 that books them. No warm start.
//!
//! **Fails when** stacks are tall: impulses start from zero in each step.
//!
//! # The rows
//!
//! ```text
//! normal    λ ← max(0, λ − m (v + s c)),   c = 1/h where the step began apart, β/h else,   β = min(0.8, 2/√n)
//! friction  λ ← clamp(λ − β m (v + d β/h), ±µ Σ λn/points)
//! ```
//!
//! s is the current separation (overlap counts as zero in velocity iterations), and d the distance from the
//! anchor.

use super::{Guarantee, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::Soft;
use crate::constraints::kernels::velocity::sticky::{Patch, Sticky};
use crate::constraints::kernels::velocity::sweep::Sweep;
use crate::constraints::records::kept::StateSize;
use crate::constraints::step::Drifts;
use crate::constraints::{Passes, Solver};
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "physx",
    source: "nvidia2026physx",
    summary: "substeps; impulses add up from zero in each step; friction holds places, contact by contact",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter {
            name: "baumgarte",
            unit: "",
            default: 0.8,
            range: [0.0, 1.0],
            meaning: "largest share of an overlap that is removed per substep; 2/√n of n substeps at most",
            trials: &[],
        },
        Parameter::push_speed(1e3),
    ],
    kept: StateSize { per_point: 1, ..StateSize::NONE },
    exceptions: &[
        (Guarantee::Cone, "a point may take its share of the whole contact's load"),
        (Guarantee::Converges, "friction holds positions, which is another law"),
        (Guarantee::Rest, "no warm start"),
    ],
    make: Variant::made_by(|| Box::new(PhysX::default())),
    ..Variant::BASE
};

/// Points with a larger separation (m) have no anchors: `frictionOffsetThreshold`.
const REACH: f32 = 0.04;

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct PhysX {
    drifts: Drifts,
}

impl Solver for PhysX {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h, reach) = (passes.budget(), passes.h(), REACH * passes.length_unit());
        let [baumgarte, push_speed] = [0, 1].map(|i| passes.parameter(i));
        let fraction = baumgarte.min(2.0 / (budget.substeps as f32).sqrt());
        let sticky = Sticky {
            h,
            fraction,
            push_speed,
            stick: fraction,
            reach,
            patch: Some(Patch { ease: fraction, shallowest: f32::MIN }),
        };
        let velocity = Sticky { patch: Some(Patch { ease: fraction, shallowest: 0.0 }), ..sticky };
        let law = Sweep(Soft::baumgarte(fraction, push_speed, h));
        passes.forget_impulses();
        self.drifts.load(passes);
        passes.find_bounces_of_step();
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            if substep > 0 {
                passes.restart_joints();
            }
            for _ in 0..budget.velocity_iterations {
                self.drifts.sweep_by(passes, Phase::Solve, sticky, &law);
                passes.iteration_done();
            }
            passes.integrate_positions();
            if substep + 1 == budget.substeps {
                for _ in 0..budget.relax_iterations {
                    self.drifts.sweep_by(passes, Phase::Relax, velocity, &Sweep(Soft::without_springs(h)));
                }
            }
        }
        // Bounces were found at the start of the step.
        passes.bounce(budget.substeps - 1);
        // Impulses accumulate over the whole step, because none is applied twice.
        passes.record_impulses();
        self.drifts.store(passes, reach);
    }
}
