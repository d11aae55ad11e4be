//! The method of Box2D 3.2: soft contacts in substeps, with friction only in the relaxing sweeps.
//!
//! **Source.** `catto2024box2d` (version 3.2); the rows are those of [`super::soft_step`].
//!
//! **Departures.** Restitution is this crate's ([`crate::engine::constraints::impacts::restitution`]), which
//! conserves energy; Box2D returns e times the approach speed. Manifolds of bodies that hardly moved are kept
//! as in Box2D, except those of discs (`box2d/recycle.rs`). Contacts are solved in the order of this crate's
//! colors.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start; per substep 2 body passes, `velocity_iterations` soft sweeps
//! without friction and `relax_iterations` rigid ones with it. Sweeps of a step request 1638 B per contact.
//!
//! **Fails when** [`super::soft_step`] does. Sliding and sticking are less accurate: in each substep friction
//! is solved only once, on top of the normal velocities that the springs left.

mod recycle;

use super::{Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::rules::{Rigid, Soft, angular_frequencies};
use crate::engine::constraints::step::{Collision, CollisionScene};
use crate::engine::constraints::{ImpactLaw, Passes, Solver};
use crate::engine::params::{Budget, CONTACT_DAMPING_RATIO, CONTACT_HERTZ_FRACTION, LINEAR_SLOP, Parameter};
use recycle::Recycled;

/// Index of `recycle_distance` among the parameters.
const RECYCLE_DISTANCE: usize = 2;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "box2d",
    source: "catto2024box2d",
    summary: "soft contacts in substeps, friction while relaxing only: Box2D 3.2",
    budget: Budget { substeps: 4, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter::CONTACT_HERTZ,
        Parameter::PUSH_SPEED,
        Parameter {
            name: "recycle_distance",
            unit: "m",
            default: 10.0 * LINEAR_SLOP,
            range: [0.0, 1.0],
            meaning: "relative motion within which two bodies keep their manifold; 0: manifolds are never kept",
            trials: &[],
        },
    ],
    softness: Some(|parameters, h| angular_frequencies(parameters[0], CONTACT_HERTZ_FRACTION, h)),
    impacts: ImpactLaw::BOX2D,
    make: Variant::made_by(|| Box::new(Box2d::default())),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct Box2d {
    recycled: Recycled,
}

impl Solver for Box2d {
    fn before_collision(&mut self, scene: &mut CollisionScene<'_>, collision: &mut Collision) {
        let distance = scene.parameters[RECYCLE_DISTANCE];
        self.recycled.update(scene.candidates, scene.contacts, distance, &mut collision.keep);
    }

    fn after_collision(&mut self, scene: &mut CollisionScene<'_>) {
        self.recycled.take_up(scene.candidates, scene.contacts);
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        step(passes);
    }

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        self.recycled.held_bytes()
    }
}

fn step(passes: &mut Passes<'_>) {
    let (budget, h) = (passes.budget(), passes.h());
    let [hertz, push_speed] = [0, 1].map(|i| passes.parameter(i));
    let omega = angular_frequencies(hertz, CONTACT_HERTZ_FRACTION, h);
    let soft = Soft::new(omega, CONTACT_DAMPING_RATIO, push_speed, h).frictionless();
    let rigid = Rigid::rule(h);
    for substep in 0..budget.substeps {
        if substep == 0 {
            passes.integrate_velocities();
            passes.warm_start();
        } else {
            passes.integrate_and_warm_start();
        }
        for _ in 0..budget.velocity_iterations {
            passes.sweep(Phase::Solve, &soft);
            passes.iteration_done();
        }
        passes.integrate_positions();
        for _ in 0..budget.relax_iterations {
            passes.sweep(Phase::Relax, &rigid);
        }
        passes.end_substep(substep);
    }
}
