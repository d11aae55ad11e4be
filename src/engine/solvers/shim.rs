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
use crate::constraints::impacts::spread::VISITS;
use crate::constraints::joints::chains::{ChainStage, Chains};
use crate::constraints::kernels::rolling::{Roll, STEADY};
use crate::constraints::kernels::velocity::rules::{Bearing, Between, Relaxed, Rigid, Soft};
use crate::constraints::records::kept::StateSize;
use crate::constraints::step::jams::Jams;
use crate::constraints::step::{Collision, CollisionScene};
use crate::constraints::{ImpactLaw, ImpactWaves, Passes, Solver};
use crate::lanes::BodyRow;
use crate::narrowphase::circles::Rolling;
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
    jams: Jams,
    chains: Chains,
    /// Whether a dynamic body has a joint; empty without joints. `[bodies]`
    joined: Vec<bool>,
    /// `joined` of the last step. `[bodies]`
    last_joined: Vec<bool>,
    /// Changes of velocity per substep under the loads of statics. `[rows]`
    fields: Vec<BodyRow>,
    /// Gravity of the last step (m/s²).
    gravity: Vec2,
    /// Number of bodies that have taken a step. They have the lowest indices.
    stepped: usize,
    /// Whether a candidate pair has a round shape.
    rolls: bool,
}

/// Visit limit for each of the first points of an island that is hit. With it, no step takes four times as
/// long as others. The work of a step outside its substeps takes as long as eight substeps.
fn visits(substeps: u32) -> usize {
    let standard = SOLVER.budget.substeps;
    VISITS * (substeps.min(standard) + 8) as usize / (standard + 8) as usize
}

impl Solver for Shim {
    fn before_collision(&mut self, scene: &mut CollisionScene<'_>, collision: &mut Collision) {
        if !scene.without.leaves_out(part::FRAMES) {
            collision.rolling = Some(Rolling { limit: STEADY * scene.length_unit });
        }
    }

    fn after_collision(&mut self, scene: &mut CollisionScene<'_>) {
        self.rolls = scene.candidates.has_discs();
        if !scene.without.leaves_out(part::JAMS) {
            let push_speed = scene.parameters[PUSH_SPEED];
            self.jams.release(scene, push_speed);
        } else {
            self.jams.clear();
        }
        self.place(scene);
        let joints_changed = self.find_joined(scene);
        let changed = scene.contacts_changed || joints_changed || scene.gravity != self.gravity;
        if changed || self.hand_down.is_stale(scene.contacts, scene.gravity) {
            self.gravity = scene.gravity;
            self.hand_down.build(scene.bodies, &self.joined, scene.contacts, scene.gravity);
        }
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h, dt) = (passes.budget(), passes.h(), passes.dt());
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
        if self.rolls && passes.has(part::FRAMES) {
            let middle = 0.5 * (1.0 - 1.0 / budget.substeps as f32) * dt;
            passes.run(Phase::Prepare, &mut Roll { middle, dt, steady: STEADY * passes.length_unit() });
        }
        self.impacts(passes);
        if passes.has(part::STATICS) {
            self.rest(passes, springs, load_sweeps as u32);
            passes.parts().clock.lap(Phase::Prepare);
        }
        if passes.has(part::CHAINS) {
            passes.find_chains(&mut self.chains);
        } else {
            self.chains = Chains::default();
        }
        for substep in 0..budget.substeps {
            if substep == 0 || self.chains.has_effective_mass_scaling() {
                passes.integrate_velocities();
                passes.snapshot_chains(&mut self.chains);
                passes.warm_start();
            } else {
                passes.integrate_and_warm_start();
            }
            passes.solve_chains(&mut self.chains, ChainStage::Begin);
            for _ in 0..budget.velocity_iterations {
                passes.block_sweep_normal_first(Phase::Solve, soft);
                passes.iteration_done();
            }
            passes.solve_chains(&mut self.chains, ChainStage::Again);
            self.jams.bound(passes);
            passes.integrate_positions();
            for _ in 0..budget.relax_iterations {
                passes.block_sweep_normal_first(Phase::Relax, relaxed);
            }
            passes.solve_chains(&mut self.chains, ChainStage::Relax);
            passes.keep_chains(&self.chains, substep + 1 == budget.substeps);
            self.jams.bound(passes);
            passes.end_substep(substep);
        }
        passes.leave_chains(&mut self.chains);
        self.stepped = passes.parts().work.rows.len() - 1;
    }
}

impl Shim {
    /// Finds which dynamic bodies have joints. Returns whether this has changed since the last step.
    fn find_joined(&mut self, scene: &CollisionScene<'_>) -> bool {
        if scene.types.is_empty() && self.joined.is_empty() {
            return false;
        }
        std::mem::swap(&mut self.joined, &mut self.last_joined);
        self.joined.clear();
        self.joined.resize(if scene.types.is_empty() { 0 } else { scene.bodies.len() }, false);
        for &body in scene.types.iter().flat_map(|joined| joined.kind.ends()).flatten() {
            self.joined[body as usize] = scene.bodies.is_dynamic(body as usize);
        }
        self.joined != self.last_joined
    }

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

    /// Solves impacts before the step.
    fn impacts(&mut self, passes: &mut Passes<'_>) {
        if passes.impacts() == SOLVER.impacts && passes.has(part::IMPACTS) {
            passes.spread_impacts(ImpactWaves {
                timed: passes.has(part::MOMENT),
                inelastic_except: Some(&self.joined),
                writes_rows: true,
                releases: passes.has(part::RELEASE),
                visits: visits(passes.budget().substeps),
            });
            passes.parts().clock.lap(Phase::Prepare);
        }
    }
}
