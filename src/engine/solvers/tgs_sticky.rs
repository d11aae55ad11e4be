//! Substeps in which friction holds points in place: a drift along the surface is pulled back.
//!
//! **Source.** `catto2024solver2d`, `solve_tgs_sticky`.
//!
//! **Departures.** A point stores its drift instead of two anchors. A sliding point sticks again in the same
//! sweep; in the source, in the next step. The cone of a point is that of the mean normal impulse of the
//! existing points; the source takes half of the sum, even if there is only one point. Arms are those of the
//! start of the step. In relaxing sweeps, a gap may close but no more; the source passes 1/h = 0 there, and
//! so removes the approach velocity at any gap.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes and `velocity_iterations` sticky sweeps; per step
//! `relax_iterations` sticky sweeps without push, 1 pass that brings drifts into the order of the lanes and 1 that
//! books them.
//!
//! **Fails when** stacks are tall: there is no warm start, so each step begins cold, and in every substep 0.8
//! of an overlap is pushed out through velocities.

use super::{Guarantee, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::sticky::Sticky;
use crate::constraints::records::kept::StateSize;
use crate::constraints::step::Drifts;
use crate::constraints::{ImpactLaw, Passes, Solver};
use crate::params::{Budget, LINEAR_SLOP, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "tgs_sticky",
    source: "catto2024solver2d",
    summary: "substeps; friction holds positions instead of velocities; no warm start",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 2, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter {
            name: "baumgarte",
            unit: "",
            default: 0.8,
            range: [0.0, 1.0],
            meaning: "share of the overlap that is removed per substep",
            trials: &[],
        },
        Parameter {
            name: "stick",
            unit: "",
            default: 0.5,
            range: [0.0, 1.0],
            meaning: "share of a drift that is taken back per substep",
            trials: &[],
        },
        Parameter::push_speed(4.0),
    ],
    kept: StateSize { per_point: 1, ..StateSize::NONE },
    exceptions: &[
        (Guarantee::Cone, "a point may take its share of the whole manifold's load"),
        (Guarantee::Converges, "friction holds positions, which is another law"),
        (Guarantee::Rest, "no warm start"),
    ],
    impacts: ImpactLaw::BOX2D,
    make: Variant::made_by(|| Box::new(TgsSticky::default())),
    ..Variant::BASE
};

/// Points with a larger separation (m) do not stick.
const REACH: f32 = 2.0 * LINEAR_SLOP;

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct TgsSticky {
    drifts: Drifts,
}

impl Solver for TgsSticky {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h, reach) = (passes.budget(), passes.h(), REACH * passes.length_unit());
        let [fraction, stick, push_speed] = [0, 1, 2].map(|i| passes.parameter(i));
        let sticky = Sticky { h, fraction, push_speed, stick, reach, patch: None };
        passes.forget_impulses();
        self.drifts.load(passes);
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            if substep > 0 {
                passes.restart_joints();
            }
            for _ in 0..budget.velocity_iterations {
                self.drifts.sweep(passes, Phase::Solve, sticky);
                passes.iteration_done();
            }
            passes.integrate_positions();
            if substep + 1 == budget.substeps {
                for _ in 0..budget.relax_iterations {
                    self.drifts.sweep(passes, Phase::Relax, Sticky { fraction: 0.0, stick: 0.0, ..sticky });
                }
            }
            passes.bounce(substep);
        }
        // Impulses accumulate over the whole step, because none is applied twice.
        passes.record_impulses();
        self.drifts.store(passes, reach);
    }
}
