//! Sequential impulses, then shock propagation: a last sweep from the ground upward in which whatever
//! a level stands on cannot move.
//!
//! The contact graph has levels: what touches the ground is on the first, what touches that on the
//! second. If the body below cannot move, one sweep of a level makes its contacts right, and so one
//! sweep over all levels a whole stack.
//!
//! **Source.** `guendelman2003`, section 7; otherwise [`super::pgs`].
//!
//! **Departures.** Levels are distances from the nearest body that does not move, not the strongly
//! connected parts of a graph of who rests on whom. The source propagates shocks through contacts
//! and not through collisions; here both are one.
//!
//! **Agreement.** The source at its best: sweeps until contacts are resolved, then 1 upward. Here: 4 iterations,
//! baumgarte 0.3. Apart from the source's method in `f64` over 10 iterations by less than 6e-5:
//! `simpulse agree --solvers shock`.
//!
//! **Cost.** That of [`super::pgs`], then per level one pass over bodies and, over its contacts,
//! three passes: effective masses, a sweep, effective masses. Contacts are grouped by level and
//! color, so that low levels fill few lanes. Sweeps of a step request 1920 B per contact.
//!
//! **Fails when** loads on the ground matter: the impulse of the last sweep takes no weight off the
//! bodies above, and the bodies below do not feel it. Momentum is lost to them. Everything seems lighter
//! from below, a lever tips over the wrong way, and what swings is damped.

use super::{Law, Variant};
use crate::engine::bodies::Bodies;
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::masses::ScaledMasses;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::records::graph::Graph;
use crate::engine::constraints::{Passes, Solver, SweepOrder};
use crate::engine::contacts::Contact;
use crate::engine::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "shock",
    source: "guendelman2003",
    summary: "sequential impulses, then a sweep from the ground up over immovable bodies",
    budget: Budget { substeps: 1, velocity_iterations: 4, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    breaks: &[
        (Law::Momentum, "in the last sweep bodies below do not answer"),
        (Law::Converges, "the last sweep solves another problem"),
        (Law::Rest, "stack:10 creeps at 25 mm/s: a lower body does not react when its load leans"),
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
                // The world and what hangs free of it have no level that is below another.
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

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        self.graph.held_bytes() + self.masses.held_bytes()
    }
}
