//! Position-based dynamics: bodies move first, contacts displace them, and velocities are computed from the
//! displacements.
//!
//! **Source.** `muller2020`; `macklin2016` (compliance, zero by default); `catto2024solver2d`, `solve_xpbd`.
//!
//! **Departures.** Velocities are corrected by (x − x_before contacts)/h, which in exact arithmetic gives (x
//! − x₀)/h; contacts without overlap therefore change no bit. Friction holds points where they were at the
//! start of the step (`catto2024solver2d`), not of the substep. Velocity corrections use the arms of the
//! start of the step. Springs and motors of joints are velocity rows, solved once per substep before bodies
//! move, instead of compliances.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 4 body passes, `position_iterations` displacing sweeps, which gather bodies
//! twice, and 1 velocity sweep.
//!
//! **Fails when** stacks are tall or loads heavy: there is no warm start, so each substep begins cold, and
//! the residual of a sweep remains as overlap. Overlap deeper than the limit is pushed apart at the speed
//! limit, and the bodies keep that speed. With compliance, a load sinks in by α times its weight only while
//! that is less than the speed limit times h.

mod displace;

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::{ImpactLaw, Passes, PointVector, Solver, Workspace};
use crate::lanes::BodyRow;
use crate::params::{Budget, Parameter};
use displace::{AfterDisplacing, Approach, Displace};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "xpbd",
    source: "muller2020",
    summary: "substeps of displacements; velocities follow positions",
    budget: Budget { substeps: 4, velocity_iterations: 0, relax_iterations: 0, position_iterations: 1 },
    uses: Uses { velocity: false, relax: false, position: true },
    iterations: |standard, k| Budget { substeps: 1, position_iterations: k, ..standard },
    parameters: &[
        Parameter::push_speed(4.0),
        Parameter {
            name: "compliance",
            unit: "m/N",
            default: 0.0,
            range: [0.0, 1.0],
            meaning: "displacement of a contact point per force; 0 is rigid",
            trials: &[],
        },
    ],
    exceptions: &[
        (Guarantee::Cone, "friction of positions and of velocities have a cone each"),
        (Guarantee::Momentum, "corrections of velocities are in no impulse that it reports"),
        (Guarantee::Converges, "the law that it solves is one of positions"),
        (Guarantee::Rest, "no warm start"),
    ],
    impacts: ImpactLaw::Solver { per_contact: 0, per_point: 2 },
    islands: Islands::Apart,
    make: Variant::made_by(|| Box::new(Xpbd::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct Xpbd {
    /// Rows before a substep displaced them.
    before: Vec<BodyRow>,
    /// Rebound speeds of points (m/s), as normal entries; empty if nothing bounces.
    rebounds: PointVector,
}

impl Solver for Xpbd {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [push_speed, compliance] = [0, 1].map(|i| passes.parameter(i));
        let Xpbd { before, rebounds } = self;
        rebounds.clear();
        if passes.law() == SOLVER.impacts {
            let Workspace { lanes, serial, .. } = passes.parts().work;
            rebounds.reset([lanes, serial], 0);
        }
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.drive_joints();
            if !rebounds.is_empty() {
                let to = passes.parts_of(rebounds);
                passes.run(Phase::Restitution, &mut Approach { to });
            }
            passes.integrate_positions();
            passes.over_bodies(Phase::Integrate, |rows, motion, _| {
                before.clone_from(rows);
                motion.hidden_turns(before);
            });
            for k in 0..budget.position_iterations {
                let mut pass = Displace { h, push_speed, compliance, first: k == 0, before };
                passes.run(Phase::Position, &mut pass);
                passes.count_sweep(passes.rows_per_point());
                passes.iteration_done();
            }
            passes.over_bodies(Phase::Integrate, |rows, _, _| velocities(rows, before, 1.0 / h));
            let rebounds = passes.parts_of(rebounds);
            passes.run(Phase::Solve, &mut AfterDisplacing { rebounds });
            passes.count_sweep(passes.rows_per_point());
            passes.end_substep(substep);
        }
    }
}

/// v ← v + (x − x_before)/h.
fn velocities(rows: &mut [BodyRow], before: &[BodyRow], inv_h: f32) {
    for (row, before) in rows.iter_mut().zip(before) {
        for k in 0..3 {
            row.velocity[k] = (row.delta[k] - before.delta[k]).mul_add(inv_h, row.velocity[k]);
        }
    }
}
