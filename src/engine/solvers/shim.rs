//! Soft contacts that do not sag. Each spring is shortened by its deflection under the load that statics assigns to
//! it, so bodies rest where they were placed.
//!
//! **Source.** `papers/shim.md` (*derived*), on the schedule of `catto2024solver2d`.
//!
//! **Departures.** Springs have a fixed share of the substep rate as frequency, and carry their load at any depth.
//! What goes beyond [`super::soft_step`], in `shim/`:
//!
//! * `rest/`: loads of statics, found by projected Gauss–Seidel and by a pass down from body to body, shorten the
//!   springs;
//! * `frames.rs`: rolling contacts use the frame of the middle of the step;
//! * `jams.rs`: pairs of bodies that are jammed at several shapes start without impulses;
//! * impacts are solved before the step, island by island (`constraints/impacts/spread`).
//!
//! The two normal rows of a contact are solved together, friction rows after them. When contacts appeared or
//! disappeared, the first substep relaxes once more, because its impulses belong to the contacts of the previous
//! step. Relaxing removes the angular momentum that pushing bodies apart has added to their spins
//! ([`crate::engine::constraints::kernels::velocity::block::Parting`]).
//!
//! **Cost.** Per step 1 warm start, 1 pass that finds closed points, `load_sweeps` light sweeps over their loads, 1
//! pass that shortens springs and, if something is fast, 1 that looks for impacts; per substep 2 body passes,
//! `velocity_iterations` soft block sweeps and `relax_iterations` rigid ones. 1 rigid sweep more in steps in which
//! contacts appear or disappear. Sweeps of a step request 5736 B per contact.
//!
//! **Fails when** an impact takes more visits than its bound (B23.heavy), or a load is removed or moves to another
//! contact within a step (B23.release, B23.rolling). A heavy body that rocks on others keeps rocking for a long time.

mod frames;
mod jams;
mod rest;

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::kernels::velocity::block::Parting;
use crate::engine::constraints::kernels::velocity::rules::{Bearing, Rigid, Soft};
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::records::kept::KeptSize;
use crate::engine::constraints::step::{Collision, Scene};
use crate::engine::constraints::{ImpactLaw, Passes, Solver};
use crate::engine::lanes::{BodyRow, held};
use crate::engine::narrowphase::batch::Kind;
use crate::engine::narrowphase::circles::Rolling;
use crate::engine::params::{Budget, Parameter};
use frames::Roll;
use glam::Vec2;
use jams::Jams;
use rest::hand_down::HandDown;
use rest::shorten::LEFT;
use rest::{LEAD, LESS, PER_CONTACT, PLACED};
use std::f32::consts::TAU;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "shim",
    source: "shim",
    summary: "soft contacts in substeps, shortened by their sag under the loads of statics",
    budget: Budget { substeps: 14, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter {
            name: "stiffness",
            unit: "",
            default: 0.16,
            range: [1e-6, 0.2],
            meaning: "frequency of contacts, as a share of the substep rate",
            trials: &[],
        },
        Parameter::DAMPING_RATIO,
        Parameter::PUSH_SPEED,
        Parameter {
            name: "load_sweeps",
            unit: "",
            default: 2.0,
            range: [0.0, 1000.0],
            meaning: "sweeps per step over the loads of statics; 0 leaves all sag",
            trials: &[],
        },
    ],
    breaks: &[(Law::Converges, "the loads that shorten its springs come from earlier steps")],
    kept: KeptSize { per_contact: PER_CONTACT, ..KeptSize::NONE },
    impacts: ImpactLaw::Solver { per_contact: 0, per_point: 0 },
    make: || Box::new(Shim::default()),
    ..Variant::BASE
};

/// State from step to step.
#[derive(Clone, Debug, Default)]
struct Shim {
    hand_down: HandDown,
    jams: Jams,
    /// Changes of velocity per substep under the loads of statics. `[rows]`
    fields: Vec<BodyRow>,
    /// Of the last step (m/s²).
    gravity: Vec2,
    /// Contacts appeared or disappeared.
    contacts_changed: bool,
    /// Number of bodies that have taken a step; they come first.
    stepped: usize,
    /// Some shape is round.
    rolls: bool,
}

impl Solver for Shim {
    fn before_collision(&mut self, _scene: &mut Scene<'_>, collision: &mut Collision) {
        collision.rolling = Some(Rolling { limit: frames::STEADY });
    }

    fn after_collision(&mut self, scene: &mut Scene<'_>) {
        self.rolls = [Kind::Circles, Kind::HullCircle, Kind::CircleHull]
            .into_iter()
            .any(|kind| !scene.candidates.of_kind[kind as usize].is_empty());
        self.contacts_changed = scene.contacts_changed;
        // Two bodies of one shape each have one contact.
        if scene.shapes > scene.bodies.len() {
            self.jams.release(scene.contacts);
        }
        self.place(scene);
        if scene.contacts_changed || scene.gravity != self.gravity {
            self.gravity = scene.gravity;
            self.hand_down.build(scene.bodies, scene.contacts, scene.gravity);
        }
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h, dt) = (passes.budget(), passes.h(), passes.dt());
        let [stiffness, damping_ratio, push_speed, load_sweeps] = [0, 1, 2, 3].map(|i| passes.parameter(i));
        let omega = TAU * stiffness / h;
        let springs = Soft::new([omega, 2.0 * omega], damping_ratio, push_speed, h);
        let rigid = Rigid::new(h);
        if self.rolls {
            let middle = 0.5 * (1.0 - 1.0 / budget.substeps as f32) * dt;
            passes.run(Phase::Prepare, &mut Roll { middle, dt });
        }
        self.impacts(passes);
        if passes.runs(Phase::Prepare) {
            self.rest(passes, springs, load_sweeps as u32);
            passes.parts().clock.lap(Phase::Prepare);
        }
        for substep in 0..budget.substeps {
            if substep == 0 {
                passes.integrate_velocities();
                passes.warm_start();
            } else {
                passes.integrate_and_warm_start();
            }
            for _ in 0..budget.velocity_iterations {
                passes.block_sweep_normal_first(Phase::Solve, Bearing(springs));
                passes.iteration_done();
            }
            passes.integrate_positions();
            // Impulses of the previous step do not fit contacts that appeared or disappeared: one sweep more.
            let settling = u32::from(substep == 0 && self.contacts_changed);
            for _ in 0..budget.relax_iterations + settling {
                let left = budget.substeps - substep;
                if passes.run(Phase::Relax, &mut Parting::new(rigid, h, budget.substeps, left)) {
                    passes.solved(&Sweep(rigid));
                }
            }
            passes.end_substep(substep);
        }
        self.stepped = passes.parts().work.rows.len() - 1;
    }

    fn boxed(&self) -> Box<dyn Solver> {
        Box::new(self.clone())
    }

    fn held_bytes(&self) -> usize {
        self.hand_down.held_bytes() + self.jams.held_bytes() + held(&self.fields)
    }
}

impl Shim {
    /// Contacts found in the first step of one of their bodies start from the overlap that it was placed with.
    fn place(&self, scene: &mut Scene<'_>) {
        if self.stepped >= scene.bodies.len() {
            return;
        }
        let stepped = self.stepped as u32;
        for (i, contact) in scene.contacts.iter().enumerate() {
            if contact.body_a.max(contact.body_b) >= stepped {
                let least = contact.manifold.points().iter().fold(0.0, |least, p| p.separation.min(least));
                let kept = scene.kept.contact(i);
                (kept[PLACED], kept[LESS]) = (least, if least < -LEFT { 0.0 } else { -LEFT });
            }
        }
    }

    /// Solves impacts before the step.
    fn impacts(&mut self, passes: &mut Passes<'_>) {
        if passes.impacts() == SOLVER.impacts && passes.runs(Phase::Prepare) {
            passes.spread_impacts(true, true, Some(LEAD));
            passes.parts().clock.lap(Phase::Prepare);
        }
    }
}
