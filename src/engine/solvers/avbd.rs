//! Augmented vertex block descent: each body in turn moves to where its inertia balances the penalty forces
//! of its contacts. Multipliers and penalties grow until the contacts hold.
//!
//! **Source.** `giles2025`, algorithm 1, with the contact rows of its two-dimensional demonstration.
//!
//! The demonstration's defaults are the defaults here: 10 iterations and one of post-stabilization at 60 Hz,
//! β 10⁵, γ 0.99, a margin of 0.5 mm, sticking within 10 mm.
//!
//! **Departures.** Bodies are solved color by color; in natural order one by one, in the order in which
//! contacts refer to them. The acceleration of a body is measured along all its forces, not only along
//! gravity. A sticking point stores its drift instead of its two anchors, so along n it is where the manifold
//! of the step puts it. There is no geometric stiffness: rows are linear in the motion of a step. Contacts
//! with a gap also have rows, which let the gap close. The cone is that of the normal force of the same
//! iteration, not of the last one. Spins have no limit. Springs of joints follow this crate's spring law,
//! which is exact at rest and in its decay (`avbd/joints.rs`). Motors and springs have their own stiffness
//! instead of a growing penalty.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 3 body passes, and `velocity_iterations` + `position_iterations` times a pass over
//! bodies with their contacts, each seen from both sides, and one over contacts, in lanes over the bodies of
//! a color (`avbd/descent.rs`), and with their joints one by one.
//!
//! **Fails when** a loop of joints spins. Penalties that have grown beyond M/h² lock each body to the
//! positions of its neighbors, and the loop as a whole turns too little per iteration. A triangle of rods
//! speeds up from 3 to 16 rad/s with 10 iterations or 50 (`simpulse verify --cases A29`); with 500, or
//! without growth, it slows down as much as in one step of implicit Euler. Also when iterations are few for
//! the height of a stack: a penalty needs them to grow, and descent carries a change by one body per
//! iteration. In `f32`, the inertia M/h² of a body is lost to rounding where penalties exceed it by more than
//! seven digits. After a cold start, the order of the bodies hardly matters: penalties begin at 1 N/m, M/h²
//! of a unit box is 3600 N/m at 60 Hz, and with penalties that soft a body hardly reacts to what its
//! neighbors do in the same iteration. On the frozen pyramid of five, the cold convergence curves of all
//! orders differ by 2·10⁻⁵ after 100 iterations and by 6·10⁻⁴ at most.
//!
//! # The method
//!
//! With y = x + h v + h² a, each body minimizes |x − y|²_M/(2h²) + the energy of its rows:
//!
//! ```text
//! (M/h² + Σ k JᵀJ) Δx = −M (x − y)/h² + Σ Jᵀ f,   f = λ − k C within its bounds
//! ```
//!
//! where C = (1 − α) C₀ + J (x − x₀): the fraction α of the initial error is left alone. Bounds: f ≥ 0 along
//! n, |f| ≤ µ f_n along t. Then λ ← f and, where f is within its bounds, k ← k + β |C|. From step to step, k
//! keeps the fraction γ.
//!
//! Old errors are removed from positions only, by post-stabilization. In all iterations α = 1, so that old
//! errors affect neither forces nor velocities, and λ is kept in full from step to step. Then velocities are
//! computed, and `position_iterations` with α = 0 move bodies without changing velocities or multipliers.
//! Without position iterations, α is the parameter, and λ keeps the fraction α γ.

mod descent;
mod input;
mod joints;
mod lanes;

use super::{Guarantee, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::types::{BodyStates, ConstraintSet};
use crate::constraints::numerics::cone;
use crate::constraints::records::graph::Graph;
use crate::constraints::records::kept::StateSize;
use crate::constraints::step::StepParts;
use crate::constraints::{Features, ImpactLaw, Passes, Solver, Workspace};
use crate::params::{Budget, Parameter};
use descent::{Descent, NORMAL, PER_BODY, PER_POINT, TANGENT};
use input::DescentInput;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "avbd",
    source: "giles2025",
    summary: "descent body by body on growing penalties, with multipliers",
    budget: Budget { substeps: 1, velocity_iterations: 10, relax_iterations: 0, position_iterations: 1 },
    uses: Uses { velocity: true, relax: false, position: true },
    parameters: &[
        Parameter {
            name: "alpha",
            unit: "",
            default: 0.99,
            range: [0.0, 1.0],
            meaning: "share of the old error that a step leaves alone, if no position iterations remove it",
            trials: &[],
        },
        Parameter {
            name: "beta",
            unit: "N/m²",
            default: 1e5,
            range: [0.0, 1e9],
            meaning: "growth of penalties by error",
            trials: &[],
        },
        Parameter {
            name: "gamma",
            unit: "",
            default: 0.99,
            range: [0.0, 1.0],
            meaning: "share of penalties and multipliers that a step begins with",
            trials: &[],
        },
    ],
    kept: StateSize { per_point: PER_POINT, per_body: PER_BODY },
    exceptions: &[
        (Guarantee::Momentum, "bodies are moved one at a time and meet only in the limit"),
        (Guarantee::Converges, "the law that it solves is one of positions"),
    ],
    impacts: ImpactLaw::None,
    make: Variant::made_by(|| Box::new(Avbd::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct Avbd {
    graph: Graph,
    descent: Descent,
}

impl Solver for Avbd {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let [alpha, beta, gamma] = [0, 1, 2].map(|i| passes.parameter(i));
        let stabilizes = budget.position_iterations > 0;
        let (alpha, keep) = if stabilizes { (1.0, 1.0) } else { (alpha, alpha * gamma) };
        self.assign(passes);
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            let motion = passes.motion_after_velocities();
            self.run(passes, Phase::Solve, |descent, on| {
                descent.begin(on, h, motion, [keep, gamma]);
            });
            for _ in 0..budget.velocity_iterations {
                self.descend(passes, Phase::Solve, alpha);
                self.run(passes, Phase::Solve, |descent, on| descent.raise(on, alpha, beta));
                passes.iteration_done();
            }
            self.run(passes, Phase::Solve, |descent, on| descent.velocities(on, h));
            for _ in 0..budget.position_iterations {
                self.descend(passes, Phase::Position, 0.0);
            }
            self.run(passes, Phase::Solve, |descent, on| descent.hold(on));
            keep_impulses(passes, h);
            passes.reload_types();
            passes.exclude_rotation_from_error();
            passes.end_substep(substep);
        }
    }

    fn kept(&self) -> Vec<f64> {
        self.descent.joints.kept()
    }

    fn set_kept(&mut self, kept: &[f64]) -> bool {
        self.descent.joints.set_kept(kept)
    }
}

impl Avbd {
    /// Assigns bodies to lanes, once per step and before everything else.
    fn assign(&mut self, passes: &mut Passes<'_>) {
        passes.build_whole_graph(&mut self.graph);
        let StepParts { work: Workspace { rows, poses, types, lanes, serial, .. }, contacts, width, .. } =
            passes.parts();
        let colored = |types: &[ConstraintSet]| types.iter().any(|joined| joined.is_colored());
        let sequence = (lanes.segments().is_empty() && !colored(types)).then(|| serial.contact());
        self.descent.joints.assign(types, BodyStates { rows, poses });
        self.descent.assign(rows, contacts, &self.graph, width, sequence);
    }

    /// Every body takes one step of block descent. The fraction `alpha` of the errors at the start of the
    /// substep is left alone.
    fn descend(&mut self, passes: &mut Passes<'_>, phase: Phase, alpha: f32) {
        self.run(passes, phase, |descent, on| descent.descend(on, alpha));
        passes.count_sweep(2);
    }

    fn run(
        &mut self,
        passes: &mut Passes<'_>,
        phase: Phase,
        work: impl FnOnce(&mut Descent, &mut DescentInput<'_>),
    ) {
        let StepParts {
            work: Workspace { rows, motion, kept, types, poses, .. },
            contacts,
            input,
            clock,
            ..
        } = passes.parts();
        let Features { rotation, friction, .. } = input.features;
        let (increments, bodies) = (motion.velocity_increments(), rows.len() - 1);
        work(
            &mut self.descent,
            &mut DescentInput {
                rows,
                kept,
                contacts,
                increments,
                bodies,
                rotation,
                friction,
                types,
                poses,
                graph: &self.graph,
                h: input.h,
                length_unit: input.length_unit,
            },
        );
        clock.lap(phase);
    }
}

/// Writes the impulses h λ (N·s) of the forces kept per point into the records, clamped to their cones
/// against rounding, for readers of contact impulses.
fn keep_impulses(passes: &mut Passes<'_>, h: f32) {
    let StepParts { work: Workspace { lanes, serial, kept, .. }, contacts, input, clock, .. } =
        passes.parts();
    for batches in [lanes, serial] {
        let width = batches.width();
        batches.for_each_lane(&input.features, |contact, layout, record, lane| {
            let c = &contacts[contact as usize];
            for p in 0..c.manifold.count as usize {
                let kept = kept.point(contact as usize, p);
                let [normal, tangent] = [h * kept[NORMAL], h * kept[TANGENT]];
                let bound = c.friction * normal;
                record[layout.at(p, layout.normal_impulse) * width + lane] = normal;
                if layout.has_friction {
                    let at = layout.at(p, layout.tangent_impulse) * width + lane;
                    record[at] = cone::friction(tangent, bound);
                }
            }
        });
    }
    clock.lap(Phase::Solve);
}
