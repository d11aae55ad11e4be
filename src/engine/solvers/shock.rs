//! Sequential impulses, then shock propagation: a last sweep goes from the ground upward, and the bodies that
//! a level stands on are immovable in it.
//!
//! The contact graph has levels: bodies that touch the ground are on level 1, bodies that touch those on
//! level 2, and so on. If the body below cannot move, one sweep over a level satisfies its contacts. One
//! sweep over all levels therefore satisfies a whole stack.
//!
//! **Source.** `guendelman2003`, section 7; otherwise [`super::pgs`].
//!
//! **Departures.** A level is the distance from the nearest body that does not move. The source uses the
//! strongly connected components of a graph of which body rests on which. The source propagates shocks
//! through contacts but not through collisions; here the two are not distinguished.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** That of [`super::pgs`], then per level one pass over bodies and, over its contacts,
//! three passes: effective masses, a sweep, effective masses. Contacts are grouped by level and
//! color, so that low levels fill few lanes.
//!
//! **Fails when** the loads on lower bodies matter. The last sweep pushes the upper bodies without a reaction
//! on the bodies below, so momentum is lost. Loads appear too light from below, levers tip the wrong way, and
//! swinging bodies are damped.

use super::{Guarantee, Variant};
use crate::bodies::Bodies;
use crate::clock::Phase;
use crate::constraints::kernels::velocity::masses::ScaledMasses;
use crate::constraints::kernels::velocity::rules::Baumgarte;
use crate::constraints::records::graph::Graph;
use crate::constraints::{Passes, Solver, SweepOrder};
use crate::contacts::Contact;
use crate::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "shock",
    source: "guendelman2003",
    summary: "sequential impulses, then a sweep from the ground up over immovable bodies",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    exceptions: &[
        (Guarantee::Momentum, "in the last sweep bodies below do not answer"),
        (Guarantee::Converges, "the last sweep solves another problem"),
        (Guarantee::Rest, "stack:10 creeps at 25 mm/s: a lower body does not react when its load leans"),
    ],
    make: Variant::made_by(|| Box::new(Shock::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct Shock {
    graph: Graph,
    masses: ScaledMasses,
}

impl Solver for Shock {
    fn levels(&mut self, bodies: &Bodies, contacts: &[Contact]) -> Option<&Graph> {
        let ends = contacts.iter().map(|c| [c.body_a, c.body_b]);
        self.graph.build(bodies.len(), ends, |body| bodies.is_dynamic(body as usize));
        Some(&self.graph)
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        let budget = passes.budget();
        let rule = Baumgarte::rule(passes.parameter(0), passes.slop(), passes.push_speed(), passes.h());
        let Shock { graph, masses } = self;
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.warm_start();
            for _ in 0..budget.velocity_iterations {
                passes.sweep(Phase::Solve, &rule);
                passes.iteration_done();
            }
            for level in 1..passes.levels() {
                passes.set_order(SweepOrder::Level(level));
                // Bodies without a connection to the ground have the highest level, so they keep their
                // masses.
                let factor = |body| if graph.levels()[body] < level { 0.0 } else { 1.0 };
                passes.scale_masses(Phase::Solve, masses, factor);
                passes.sweep(Phase::Solve, &rule);
                passes.restore_masses(Phase::Solve, masses);
            }
            passes.set_order(SweepOrder::Forward);
            passes.integrate_positions();
            passes.end_substep(substep);
        }
    }
}
