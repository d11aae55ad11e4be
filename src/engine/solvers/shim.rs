//! Soft contacts that do not sag: each contact is shimmed by what its springs give way under the load it
//! bears, so that they are stiff enough to move with and rigid to stand on.
//!
//! **Source.** `papers/shim.md` (*derived*), on the schedule of `catto2024solver2d`.
//!
//! **Departures.** Springs are as stiff as the substep rate allows, a fixed part of it, and bear a load however deep
//! their contact is. What goes beyond [`super::soft_step`], each in a file of its own in `shim/`:
//!
//! * `preload.rs`: each contact has a preload that follows its load, as fast as the slowest mode of the pile allows;
//! * `piles/`: contacts at rest begin with what statics says they bear, each point with the preload of its own load, and a
//!   column that would buckle gets stiffer springs and the sweeps that these need;
//! * `frames.rs`: what rolls or is carried has the frame of the middle of the step;
//! * `plastic/`: what comes in without restitution is stopped before the step; the rest bounces there
//!   ([`crate::engine::constraints::impacts::waves`], at the time of the impact).
//!
//! The two normal rows of a contact are solved together, friction rows after them. Where contacts have come or
//! gone, the first substep relaxes once more, since its impulses come from contacts as they were a step ago. Relaxing takes
//! the angular momentum that pushing bodies apart has made from their spins
//! ([`crate::engine::constraints::kernels::velocity::block::Parting`]).
//!
//! **Cost.** Per step 1 warm start, 1 pass that shortens springs and, if something moves, 1 pass that looks for
//! impacts; per substep 2 body passes, `velocity_iterations` soft block sweeps and `relax_iterations` rigid ones. In
//! steps in which contacts come or go 1 rigid sweep more, and at most every 32 steps, if they have, a search of the
//! contact graph. Sweeps of a step request 5736 B per contact.
//!
//! **Fails when** a column needs more than `column_sweeps`: 100 unit boxes stand for a minute, 150 do not. Where bodies
//! slide past each other, angular momentum is conserved to rounding only in impacts that are seen before the step: arms
//! are those of its beginning, which matters to impacts within it. And where impacts without restitution are many: only
//! 32 contacts at once are followed, and the sweeps of a substep spread what is left by two bodies each. A load that
//! goes or wanders to a new contact within a step is followed by one sweep more: what stood on it comes apart a little
//! (B23.release), and what bears hundreds of times its mass sinks (B23.rolling).

mod arrivals;
mod frames;
mod jams;
mod loads;
pub mod piles;
mod plastic;
mod preload;

use super::{Law, Uses, Variant};
use crate::engine::clock::Phase;
use crate::engine::constraints::impacts::waves;
use crate::engine::constraints::kernels::velocity::block::Parting;
use crate::engine::constraints::kernels::velocity::rules::{Bearing, Rigid, Soft};
use crate::engine::constraints::kernels::velocity::sweep::Sweep;
use crate::engine::constraints::records::batches::Part;
use crate::engine::constraints::records::kept::KeptSize;
use crate::engine::constraints::step::{AFTER_WAVES, Collision, Scene, StepParts};
use crate::engine::constraints::{ImpactLaw, Passes, Solver, Workspace};
use crate::engine::lanes::{BodyRow, held};
use crate::engine::narrowphase::batch::Kind;
use crate::engine::narrowphase::circles::Rolling;
use crate::engine::params::{Budget, Parameter};
use arrivals::Arrivals;
use frames::Roll;
use jams::Jams;
use loads::LoadsOf;
use piles::Found;
use piles::modes::Piles;
use plastic::PlasticImpacts;
use preload::{GIVING, Preload};
use std::f32::consts::TAU;

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "shim",
    source: "shim",
    summary: "substeps, and soft contacts whose springs are preloaded until they do not sag",
    budget: Budget { substeps: 14, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter {
            name: "stiffness",
            unit: "",
            default: 0.16,
            range: [1e-6, 0.2],
            meaning: "frequency of contacts, as a part of the substep rate",
            trials: &[],
        },
        Parameter::DAMPING_RATIO,
        Parameter::PUSH_SPEED,
        Parameter {
            name: "patience",
            unit: "",
            default: 4.0,
            range: [1e-3, 1e6],
            meaning: "time in which preload follows the load, over what the slowest mode of the pile needs",
            trials: &[],
        },
        Parameter {
            name: "preload",
            unit: "",
            default: 0.95,
            range: [0.0, 1.0],
            meaning: "part of its sag that a contact is preloaded by; 0 is none",
            trials: &[],
        },
        Parameter {
            name: "column_sweeps",
            unit: "",
            default: 64.0,
            range: [0.0, 1000.0],
            meaning: "most rigid sweeps per substep added for stiffer springs, where a column would buckle on these",
            trials: &[],
        },
    ],
    breaks: &[(Law::Converges, "preload is part of its law, and comes from the steps before")],
    kept: KeptSize { per_contact: 4, ..KeptSize::NONE },
    impacts: ImpactLaw::Solver { per_contact: waves::FIRST, per_point: waves::PER_POINT },
    make: || Box::new(Shim::default()),
    ..Variant::BASE
};

/// Numbers that are kept per contact: by how much its springs are shortened (m), negative for the overlap that a body is
/// put into the world with; the time for which that is not raised (s), negative while it gives back what it had more than
/// it keeps; what the preload of the second point is more than that of both (m); and the time of the frame of what rolls,
/// from the beginning of the step (s).
const PRELOAD: usize = 0;
/// See [`PRELOAD`].
const WAIT: usize = 1;
/// See [`PRELOAD`].
const TILT: usize = 2;
/// See [`PRELOAD`].
const LEAD: usize = 3;

/// What it keeps.
#[derive(Clone, Debug, Default)]
struct Shim {
    piles: Piles,
    found: Found,
    /// What contacts bear in statics (N), in the steps in which that has been found, else empty. `[contacts]`
    weights: Vec<f32>,
    jams: Jams,
    plastic: PlasticImpacts,
    /// What the impulses of contacts belong to; none before there are any.
    loads_of: Option<LoadsOf>,
    /// Bodies that have taken a step: the first ones.
    stepped: usize,
    /// Something is round.
    rolls: bool,
}

impl Solver for Shim {
    fn before_collision(&mut self, scene: &mut Scene<'_>, collision: &mut Collision) {
        let new = LoadsOf::of(scene);
        if let Some(old) = self.loads_of.replace(new).filter(|old| *old != new) {
            old.scale(&new, scene);
        }
        collision.rolling = Some(Rolling { limit: frames::STEADY });
    }

    fn after_collision(&mut self, scene: &mut Scene<'_>) {
        self.rolls = [Kind::Circles, Kind::HullCircle, Kind::CircleHull]
            .into_iter()
            .any(|kind| !scene.candidates.of_kind[kind as usize].is_empty());
        let is_placed = self.place(scene);
        // Two bodies of one shape each have one contact.
        if scene.shapes > scene.bodies.len() {
            self.jams.release(scene.contacts);
        }
        self.found.update(&mut self.piles, &mut self.weights, scene, is_placed);
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        let (budget, h, dt) = (passes.budget(), passes.h(), passes.dt());
        let [stiffness, damping_ratio, push_speed, patience, share, most] =
            [0, 1, 2, 3, 4, 5].map(|i| passes.parameter(i));
        let (usual, piles) = (TAU * stiffness / h, self.found.modes);
        let added = added_sweeps(piles.critical_frequency / usual, budget, most);
        let sweeps = (budget.velocity_iterations + budget.relax_iterations).max(1) as f32;
        let omega = usual * (1.0 + added as f32 / sweeps).sqrt();
        let springs = Soft::new([omega, 2.0 * omega], damping_ratio, push_speed, h);
        let rigid = Rigid::new(h);
        let time = patience * piles.slowness / (2.0 * damping_ratio * omega);
        if self.rolls {
            let middle = 0.5 * (1.0 - 1.0 / budget.substeps as f32) * dt;
            passes.run(Phase::Prepare, &mut Roll { middle, dt });
        }
        self.impacts(passes);
        let (rate, weights) = (dt / (dt + time), &self.weights);
        passes.run(Phase::Prepare, &mut Preload { springs, share, rate, h, dt, weights });
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
            // Impulses of the step before meet contacts that came, or miss some that went: one sweep more.
            let settling = u32::from(substep == 0 && self.found.contacts_changed);
            for _ in 0..budget.relax_iterations + added + settling {
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
        self.piles.held_bytes() + held(&self.weights) + self.jams.held_bytes() + self.plastic.held_bytes()
    }
}

impl Shim {
    /// Contacts that are found in the first step of one of their bodies begin with the overlap that it was placed with, and
    /// with all of their sag; whether there are any.
    fn place(&mut self, scene: &mut Scene<'_>) -> bool {
        let mut is_placed = false;
        if self.stepped >= scene.bodies.len() {
            return false;
        }
        let stepped = self.stepped as u32;
        for (i, contact) in scene.contacts.iter().enumerate() {
            if contact.body_a.max(contact.body_b) >= stepped {
                let least = contact.manifold.points().iter().fold(0.0, |least, p| p.separation.min(least));
                let kept = scene.kept.contact(i);
                (kept[PRELOAD], kept[WAIT]) = (least, -GIVING);
                is_placed = true;
            }
        }
        is_placed
    }

    /// What comes in bounces or stops, before the step.
    fn impacts(&mut self, passes: &mut Passes<'_>) {
        let StepParts { input, .. } = passes.parts();
        if input.impacts != SOLVER.impacts || !passes.runs(Phase::Prepare) {
            return;
        }
        if passes.law() == SOLVER.impacts {
            passes.bounce_before(true);
            passes.begin_bounces(AFTER_WAVES);
        }
        self.plastic_impacts(passes);
        passes.parts().clock.lap(Phase::Prepare);
    }

    /// Stops what comes in without restitution; see [`plastic`].
    fn plastic_impacts(&mut self, passes: &mut Passes<'_>) {
        let (h, dt) = (passes.h(), passes.dt());
        let StepParts { work, contacts, .. } = passes.parts();
        self.plastic.earn(contacts.len());
        if let Some([slowest, least_gain, fastest]) = impact_speeds(work, h, dt) {
            let mut found = std::mem::take(&mut self.plastic.found);
            for (part, found) in [Part::Lanes, Part::Serial].into_iter().zip(&mut found) {
                found.clear();
                passes.over_part(part, &mut Arrivals { h, dt, slowest, least_gain, fastest, found });
            }
            let count: usize = found.iter().map(Vec::len).sum();
            self.plastic.found = found;
            if (1..=arrivals::MOST).contains(&count) {
                let StepParts { work, contacts, input, .. } = passes.parts();
                let Workspace { rows, lanes, serial, motion, kept, .. } = work;
                self.plastic.spread(&mut plastic::On {
                    rows,
                    batches: [lanes, serial],
                    contacts,
                    features: &input.features,
                    increments: motion.velocity_increments(),
                    weights: &mut self.weights,
                    kept: kept.contacts(),
                    dt,
                    h,
                    slowest,
                    record_impulses: input.record_impulses,
                });
                motion.hide_turns(rows);
                if passes.law() == SOLVER.impacts {
                    passes.begin_bounces(AFTER_WAVES);
                }
            }
        }
    }
}

/// Speed below which nothing is an impact, the least that forces add to the speed of a dynamic body in a step, and
/// a speed that no point of a body exceeds (m/s); none if that is slower than an impact.
fn impact_speeds(work: &Workspace, h: f32, dt: f32) -> Option<[f32; 3]> {
    /// Part of what forces make in a step (1).
    const SLOW: f32 = 0.01;
    /// Farthest point of a body over its radius of gyration (1): √3 for a rod, 2.8 for the slimmest triangle.
    const REACH: f32 = 3.0;
    let square = |v: &[f32; 4]| v[0].mul_add(v[0], v[1] * v[1]);
    let (mut fastest, mut most, mut least) = (0.0_f32, 0.0_f32, f32::INFINITY);
    for (BodyRow { velocity, delta }, increment) in work.rows.iter().zip(work.motion.velocity_increments()) {
        let [inv_mass, inv_inertia] = [velocity[3], delta[3]];
        // (ω R)²: infinite for a kinematic body that turns, NaN, which is never the maximum, for one that does not.
        let (top, turning) = (REACH.mul_add(REACH * inv_mass, f32::MIN_POSITIVE), velocity[2] * velocity[2]);
        let straight = square(velocity);
        fastest = fastest.max(straight);
        // Multiplied out, since few bodies are the fastest so far: a division for each takes twice the time of this loop.
        if turning * top > (fastest - straight) * inv_inertia {
            fastest = fastest.max(turning.mul_add(top / inv_inertia, straight));
        }
        let gained = square(increment);
        most = most.max(if inv_mass > 0.0 { gained } else { 0.0 });
        least = least.min(if inv_mass > 0.0 { gained } else { f32::INFINITY });
    }
    let [slowest, least] = [SLOW * most.sqrt(), least.sqrt()].map(|gained| gained * dt / h);
    // |v| + |ω| R ≤ √2 √(v² + ω² R²)
    let fastest = (2.0 * fastest).sqrt();
    (fastest > slowest).then_some([slowest, least, fastest])
}

/// Rigid sweeps per substep for springs `ratio` times as fast as the usual ones: (h ω)² < q, the number of sweeps
/// (`papers/shim.md`), which so has to grow with ω².
fn added_sweeps(ratio: f32, budget: Budget, most: f32) -> u32 {
    let sweeps = (budget.velocity_iterations + budget.relax_iterations) as f32;
    (sweeps * (ratio * ratio - 1.0)).ceil().clamp(0.0, most) as u32
}
