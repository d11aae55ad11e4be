//! Soft contacts that do not sag. A statics solve finds the load of each contact, and its spring is shortened
//! by its deflection under that load. So bodies rest where they were placed.
//!
//! **Source.** `papers/shim.md` (*derived*), on the schedule of `catto2024solver2d`.
//!
//! **Departures.** The frequency of springs is a fixed fraction of the substep rate, and springs carry their
//! load at any depth. Additions to [`super::soft_step`]:
//!
//! * `shim/rest/`: springs are shortened for static loads, found by projected Gauss-Seidel and handed down by body;
//! * `constraints/step/jams.rs`: bodies caught in another body, or between a piston and a wall, start the step without impulses,
//!   and their speed is limited to what the piston can give them;
//! * `constraints/kernels/rolling.rs`: rolling contacts use the frame of the middle of the step;
//! * chains of joints that hang from a fixed body are solved directly (`constraints/joints/chains`);
//! * contacts between bodies of unequal masses are damped more and over-relaxed (`rules/variations.rs`, `Between`);
//! * approaching bodies bounce or stop before the step, island by island (`constraints/impacts/spread`).
//!
//! The two normal rows of a contact are solved together, friction rows after them.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start, 1 pass that finds closed points, `load_sweeps` light sweeps over their loads, 1
//! pass that shortens springs and, if something is fast, 1 that looks for impacts; per substep 2 body passes, 1 elimination
//! along chains of joints (3 of those that something else acts on), `velocity_iterations` soft block sweeps and `relax_iterations` rigid ones.
//!
//! **Fails when** an impact needs more visits than the limit (B23.heavy), or a load is removed or moves to
//! another contact within a step (B23.release, B23.rolling). Some heavy bodies rock on light ones for many
//! seconds.

mod rest;

use super::{Guarantee, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::kernels::velocity::rules::{Bearing, Between, Relaxed, Rigid, Soft};
use crate::constraints::records::kept::StateSize;
use crate::constraints::step::block_substeps::BlockSubsteps;
use crate::constraints::step::{Collision, CollisionScene};
use crate::constraints::{ImpactLaw, Passes, Solver};
use crate::lanes::BodyRow;
use crate::params::{Budget, Mechanism, Parameter};
use glam::Vec2;
use rest::hand_down::PropagateLoads;
use rest::{PER_CONTACT, PRELOAD, REST_TIME};
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
    mechanisms: &MECHANISMS,
    exceptions: &[(Guarantee::Converges, "preload is part of its law, and comes from the steps before")],
    kept: StateSize { per_contact: PER_CONTACT, ..StateSize::NONE },
    impacts: ImpactLaw::Solver { per_contact: 0, per_point: 0 },
    continuous: true,
    make: Variant::made_by(|| Box::new(Shim::default())),
    ..Variant::BASE
};

/// Factor on the damping ratio of contacts between a body and a much lighter one (1).
const UNEQUAL_DAMPING: f32 = 7.0;

/// Over-relaxation of the rigid rows of such contacts (1).
const UNEQUAL_RELAXATION: f32 = 1.4;

/// Index of this parameter.
const PUSH_SPEED: usize = 2;

/// Indices into [`MECHANISMS`].
mod part {
    pub const STATICS: usize = 0;
    pub const HAND_DOWN: usize = 1;
    pub const RISING: usize = 2;
    pub const BEARING: usize = 3;
    pub const FRAMES: usize = 4;
    pub const IMPACTS: usize = 5;
    pub const MOMENT: usize = 6;
    pub const RELEASE: usize = 7;
    pub const JAMS: usize = 8;
    pub const ONCE: usize = 9;
    pub const CHAINS: usize = 10;
    pub const UNEQUAL: usize = 11;
}

/// Mechanisms that a run can leave out, each with the case that fails without it.
const MECHANISMS: [Mechanism; 12] = [
    Mechanism::new(
        "statics",
        "B24.bricks",
        "springs are shortened by the sag of the loads that contacts bear at rest",
    ),
    Mechanism::new("hand_down", "B5.height", "loads go down from body to body"),
    Mechanism::new(
        "rising",
        "random ratios restless",
        "springs are shortened for more load only where nothing moves, within 3 s",
    ),
    Mechanism::new("bearing", "B19.share", "springs bear a load however deep their contact is"),
    Mechanism::new("frames", "A26.plank", "what rolls has the frame of the middle of the step"),
    Mechanism::new("impacts", "A17.billiards", "what comes in bounces or stops before the step"),
    Mechanism::new("moment", "A27.oblique", "impacts happen at their time in the step"),
    Mechanism::new("release", "A26.block", "points that an impact releases have borne their body until then"),
    Mechanism::new(
        "jams",
        "random driven energy",
        "what is caught or squeezed begins a step without impulses, within the speed that squeezes it",
    ),
    Mechanism::new(
        "once",
        "rest::a_pile_of_discs_hardly_breathes",
        "contacts of one point are shortened once, as soon as nothing moves",
    ),
    Mechanism::new(
        "chains",
        "B17.ratio",
        "chains of joints that hang from what does not move are solved at once",
    ),
    Mechanism::new(
        "unequal",
        "random ratios restless",
        "contacts between bodies of unequal masses are damped more and over-relaxed",
    ),
];

/// State kept between steps.
#[derive(Clone, Debug, Default)]
struct Shim {
    hand_down: PropagateLoads,
    substeps: BlockSubsteps,
    /// Changes of velocity per substep under the loads of statics. `[rows]`
    fields: Vec<BodyRow>,
    /// Gravity of the last step (m/s²).
    gravity: Vec2,
    /// Number of bodies that have taken a step. They have the lowest indices.
    stepped: usize,
}

impl Solver for Shim {
    fn before_collision(&mut self, scene: &mut CollisionScene<'_>, collision: &mut Collision) {
        if !scene.without.leaves_out(part::FRAMES) {
            collision.rolling = Some(BlockSubsteps::rolling(scene));
        }
    }

    fn after_collision(&mut self, scene: &mut CollisionScene<'_>) {
        let push_speed = (!scene.without.leaves_out(part::JAMS)).then(|| scene.parameters[PUSH_SPEED]);
        let joints_changed = self.substeps.after_collision(scene, push_speed);
        self.place(scene);
        let changed = scene.contacts_changed || joints_changed || scene.gravity != self.gravity;
        if changed || self.hand_down.is_stale(scene.contacts, scene.gravity) {
            self.gravity = scene.gravity;
            self.hand_down.build(scene.bodies, self.substeps.joined(), scene.contacts, scene.gravity);
        }
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        let h = passes.h();
        let [stiffness, damping_ratio, push_speed, load_sweeps] = [0, 1, 2, 3].map(|i| passes.parameter(i));
        let omega = TAU * stiffness / h;
        let [damping, relaxation] =
            if passes.has(part::UNEQUAL) { [UNEQUAL_DAMPING, UNEQUAL_RELAXATION] } else { [1.0; 2] };
        let from = if passes.has(part::BEARING) { push_speed } else { f32::INFINITY };
        let springs = Soft::new([omega, 2.0 * omega], damping_ratio, push_speed, h);
        let damped = Soft::new([omega, 2.0 * omega], damping * damping_ratio, push_speed, h);
        let rigid = Rigid::new(h);
        let soft = Between { equal: Bearing { springs, from }, unequal: Bearing { springs: damped, from } };
        let relaxed = Between { equal: rigid, unequal: Relaxed { rule: rigid, factor: relaxation } };
        if passes.has(part::FRAMES) {
            self.substeps.roll(passes);
        }
        if passes.has(part::IMPACTS) {
            let (timed, writes_rows) = (passes.has(part::MOMENT), true);
            let releases = passes.has(part::RELEASE);
            self.substeps.impacts(passes, timed, writes_rows, releases);
        }
        if passes.has(part::STATICS) {
            self.rest(passes, springs, load_sweeps as u32);
            passes.parts().clock.lap(Phase::Prepare);
        }
        let chains = passes.has(part::CHAINS);
        self.substeps.run(passes, soft, relaxed, chains);
        self.stepped = passes.parts().work.rows.len() - 1;
    }
}

impl Shim {
    /// Lets contacts found in the first step of one of their bodies bear all of their load at once.
    fn place(&self, scene: &mut CollisionScene<'_>) {
        if self.stepped >= scene.bodies.len() {
            return;
        }
        let stepped = self.stepped as u32;
        for (i, contact) in scene.contacts.iter().enumerate() {
            if contact.body_a.max(contact.body_b) >= stepped {
                let kept = scene.kept.contact(i);
                kept[REST_TIME] = 1.0;
                kept[PRELOAD..].fill(-1.0);
            }
        }
    }
}
