//! Gauss–Seidel with a coarse problem: the total load on each level of the contact graph is solved
//! exactly before each sweep. A load therefore reaches the ground at once, however high the column is.
//!
//! **Source.** *derived* for this crate (`constraints/vectors/levels.rs`). The two-level subspace
//! correction is that of `xu1992`, its multigrid form for bounds that of `kornhuber1994`. The conjugate
//! gradients around it are those of `silcowitz2010`, the sweeps those of [`super::pgs`].
//!
//! **Departures.** There is one coarse level, with three unknowns per level and island: the resultant
//! force and moment. Its change is clamped to the cones afterwards instead of being solved within them.
//! It is skipped if it would not lower the energy. Islands without ground contact, contacts within a
//! level and joints are left to the sweeps.
//!
//! **Agreement.** Within 6e-5 of the solution in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per substep 2 body passes and 1 warm start; `velocity_iterations` times 1 sweep, 3 passes over vectors, and 4
//! passes over points in `f64` and in one lane, in which the coarse matrix is assembled and solved. Sweeps of a step request 8182 B per contact.
//!
//! **Fails when** loads spread sideways: the total load on a level does not determine how a wide pyramid
//! shares it. Contacts that switch between sticking and sliding are left to the sweeps as well.

use super::Variant;
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::Baumgarte;
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::records::graph::Graph;
use crate::engine::constraints::vectors::conjugate::Conjugate;
use crate::engine::constraints::vectors::levels::Levels;
use crate::engine::constraints::{Passes, Solver};
use crate::engine::params::{Budget, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "two_level",
    source: "xu1992",
    summary: "sweeps, and before each what every level of the contact graph carries, exactly",
    budget: Budget { substeps: 1, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
    parameters: &[Parameter::BAUMGARTE],
    make: Variant::made_by(|| Box::new(TwoLevel::default())),
    ..Variant::BASE
};

/// State of the method.
#[derive(Clone, Debug, Default)]
struct TwoLevel {
    graph: Graph,
    levels: Levels,
}

impl Solver for TwoLevel {
    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h) = (passes.budget(), passes.h());
        let rule = Baumgarte::new(passes.parameter(0), passes.slop(), passes.push_speed(), h);
        let TwoLevel { graph, levels } = self;
        passes.build_graph(graph);
        for substep in 0..budget.substeps {
            passes.integrate_velocities();
            passes.warm_start();
            let vectors = [(); 3].map(|_| passes.vector());
            let mut conjugate = Conjugate::new(vectors, passes.energy_masses(Phase::Solve));
            passes.with_system(Phase::Solve, |system| {
                conjugate.begin(system);
                levels.begin(system, graph, |separation| rule.bias(separation));
            });
            for k in 1..=budget.velocity_iterations {
                passes.with_system(Phase::Solve, |system| levels.correct(system));
                passes.velocity_sweep(Phase::Solve, &mut Sweep(rule));
                passes.iteration_done();
                if k < budget.velocity_iterations {
                    passes.with_system(Phase::Solve, |system| conjugate.go_on(system));
                }
            }
            passes.give_back(conjugate.vectors());
            passes.integrate_positions();
            passes.end_substep(substep);
        }
    }

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        self.graph.held_bytes() + self.levels.held_bytes()
    }
}
