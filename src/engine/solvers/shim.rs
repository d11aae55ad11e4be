//! Stiff soft contacts in substeps, frozen while nothing moves, after impacts have been solved and with joints solved at once.
//!
//! **Source.** `papers/shim.md` (*derived*), on the schedule of `catto2024solver2d`; `catto2024box2d` (frozen contacts).
//!
//! **Departures.** Additions to [`super::soft_step`]:
//!
//! * springs are as stiff as is stable, at a fixed share of the substep rate, and bear a load at any depth ([`Bearing`]);
//! * the two normal rows of a contact are solved together, friction rows after them
//!   ([`crate::constraints::kernels::velocity::block`]);
//! * contacts whose two points bear load are frozen while nothing moves ([`crate::narrowphase::frozen`]);
//! * approaching bodies bounce or stop before the step, island by island (`constraints/impacts/spread`);
//! * chains of joints that hang from a fixed body are solved directly (`constraints/joints/chains`);
//! * `constraints/step/jams.rs`: bodies caught in another body, or between a piston and a wall, start the step without impulses,
//!   and their speed is limited to what the piston can give them;
//! * `constraints/kernels/rolling.rs`: rolling contacts use the frame of the middle of the step.
//!
//! **Agreement.** Within 6e-5 of its source's method in `f64` (`tests/lab/agree`).
//!
//! **Cost.** Per step 1 warm start and, if something is fast, 1 pass that looks for impacts; per substep 2 body passes, 1
//! elimination along chains of joints (3 of those that something else acts on), `velocity_iterations` soft block sweeps and
//! `relax_iterations` rigid ones.
//!
//! **Fails when** nothing may sag: at rest a contact sinks by F/(m_eff ω²), 0.7 mm at the foot of 20 boxes of a meter.
//! An impact that needs more visits than the limit is cut (B23.heavy).
//!
//! # The stiffest stable spring
//!
//! A substep repeats the impulse λ of the last one. Then come the soft row λ ← λ − γ_m m (v_n + β s) − γ_i λ and, after the
//! bodies have moved, the rigid row λ ← λ − m v_n. On a slow mode of a pile one sweep acts as if each row were alone, and
//! only a fraction κ of what it removes reaches the mode. For changes that are slow compared with h, F = λ/h and γ_m ≈ 1 in
//! front of v_n,
//!
//! ```text
//! F' = −2 (m/h²) s' − (γ_m β m/h²) s − (γ_i/h) F,     m s'' = κ F
//! p³ + (γ_i/h) p² + 2 (κ/h²) p + κ γ_m β/h² = 0       with s ~ e^(p t)
//! ```
//!
//! By Routh's criterion this is stable if 2 γ_i > h γ_m β, and γ_m β = h ω² γ_i, so if h ω < √2: 0.225 of the substep
//! rate. Contacts with static bodies have twice the frequency of the others, so the others have at most half of this.
//! An eighth, as in the source, is 0.79 of √2 in a pile, and 1.57 at a static body, where κ is near 1 and a row is solved in one sweep.

use super::{Guarantee, Islands, Uses, Variant};
use crate::clock::Phase;
use crate::constraints::impacts::spread::VISITS;
use crate::constraints::joints::chains::{ChainStage, Chains};
use crate::constraints::kernels::rolling::{Roll, STEADY};
use crate::constraints::kernels::velocity::rules::{Bearing, Rigid, Soft, angular_frequencies};
use crate::constraints::step::jams::Jams;
use crate::constraints::step::{Collision, CollisionScene, ImpactWaves};
use crate::constraints::{ImpactLaw, Passes, Solver};
use crate::narrowphase::circles::Rolling;
use crate::narrowphase::frozen::FreezeLimits;
use crate::params::{Budget, CONTACT_HERTZ_FRACTION, Mechanism, Parameter};

/// See the [module](self).
pub static SOLVER: Variant = Variant {
    name: "shim",
    source: "shim",
    summary: "stiff soft contacts in substeps, frozen at rest, impacts before the step, joints at once",
    budget: Budget { substeps: 14, velocity_iterations: 1, relax_iterations: 1, position_iterations: 0 },
    uses: Uses { velocity: true, relax: true, position: false },
    iterations: |standard, k| Budget { substeps: 1, velocity_iterations: k, relax_iterations: k, ..standard },
    parameters: &[
        Parameter {
            name: "stiffness",
            unit: "",
            default: CONTACT_HERTZ_FRACTION,
            range: [1e-6, 0.2],
            meaning: "frequency of contacts, as a share of the substep rate",
            trials: &[],
        },
        Parameter::DAMPING_RATIO,
        Parameter::PUSH_SPEED,
    ],
    mechanisms: &MECHANISMS,
    exceptions: &[(
        Guarantee::Converges,
        "with contacts alone; chains of joints are solved apart from the sweeps",
    )],
    impacts: ImpactLaw::Solver { per_contact: 0, per_point: 0 },
    frozen: Some(FreezeLimits::LOADED),
    continuous: true,
    islands: Islands::Apart,
    make: Variant::made_by(|| Box::new(Shim::default())),
    ..Variant::BASE
};

/// Index of this parameter.
const PUSH_SPEED: usize = 2;

/// Indices into [`MECHANISMS`].
mod part {
    pub const FRAMES: usize = 0;
    pub const IMPACTS: usize = 1;
    pub const MOMENT: usize = 2;
    pub const JAMS: usize = 3;
    pub const CHAINS: usize = 4;
}

/// Mechanisms that a run can leave out, each with the case that fails without it.
const MECHANISMS: [Mechanism; 5] = [
    Mechanism::new("frames", "A26.plank", "what rolls has the frame of the middle of the step"),
    Mechanism::new("impacts", "A17.billiards", "what comes in bounces or stops before the step"),
    Mechanism::new("moment", "A27.oblique", "impacts happen at their time in the step"),
    Mechanism::new(
        "jams",
        "random driven energy",
        "what is caught or squeezed begins a step without impulses, within the speed that squeezes it",
    ),
    Mechanism::new(
        "chains",
        "B17.ratio",
        "chains of joints that hang from what does not move are solved at once",
    ),
];

/// State kept between steps.
#[derive(Clone, Debug, Default)]
struct Shim {
    jams: Jams,
    chains: Chains,
}

/// Visit limit for each of the first points of an island that is hit. With fewer substeps than the standard it is lower, so
/// that an impact takes the same part of the time of a step: the work outside substeps takes as long as eight of them.
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
        scene.speed_limits.clear();
        if scene.without.leaves_out(part::JAMS) {
            self.jams.clear();
        } else {
            self.jams.release(scene, scene.parameters[PUSH_SPEED]);
        }
    }

    /// The number of jammed bodies and these bodies; then the numbers of chains.
    fn kept(&self) -> Vec<f64> {
        let jammed: Vec<f64> = self.jams.kept().map(f64::from).collect();
        std::iter::once(jammed.len() as f64)
            .chain(jammed)
            .chain(self.chains.kept().into_flattened())
            .collect()
    }

    fn set_kept(&mut self, kept: &[f64]) -> bool {
        let Some((&count, rest)) = kept.split_first() else { return true };
        if !rest.iter().all(|&x| (x as f32).is_finite()) {
            return false;
        }
        let Some((jammed, chains)) = rest.split_at_checked(count as usize) else { return false };
        let (chains, rest) = chains.as_chunks();
        self.jams.set_kept(jammed.iter().map(|&body| body as u32));
        self.chains.set_kept(chains.to_vec());
        rest.is_empty()
    }

    fn step(&mut self, passes: &mut Passes<'_>) {
        let [stiffness, damping_ratio, push_speed] = [0, 1, 2].map(|i| passes.parameter(i));
        let frequencies = angular_frequencies(f32::INFINITY, stiffness, passes.h());
        let springs = Soft::new(frequencies, damping_ratio, push_speed, passes.h());
        let (soft, rigid) = (Bearing { springs, from: push_speed }, Rigid::new(passes.h()));
        if passes.has_discs() && passes.has(part::FRAMES) {
            let (dt, n) = (passes.dt(), passes.budget().substeps as f32);
            let middle = 0.5 * (1.0 - 1.0 / n) * dt;
            passes.run(Phase::Prepare, &mut Roll { middle, dt, steady: STEADY * passes.length_unit() });
        }
        if passes.has(part::IMPACTS) && matches!(passes.impacts(), ImpactLaw::Solver { .. }) {
            let (timed, visits) = (passes.has(part::MOMENT), visits(passes.budget().substeps));
            passes.spread_impacts(ImpactWaves { timed, stops: true, visits });
            passes.parts().clock.lap(Phase::Prepare);
        }
        let chains = &mut self.chains;
        if passes.has(part::CHAINS) {
            passes.find_chains(chains);
        } else {
            *chains = Chains::default();
        }
        let budget = passes.budget();
        for substep in 0..budget.substeps {
            if substep == 0 || chains.has_effective_mass_scaling() {
                passes.integrate_velocities();
                passes.snapshot_chains(chains);
                passes.warm_start();
            } else {
                passes.integrate_and_warm_start();
            }
            passes.solve_chains(chains, ChainStage::Begin);
            for _ in 0..budget.velocity_iterations {
                passes.block_sweep_normal_first(Phase::Solve, soft);
                passes.iteration_done();
            }
            passes.solve_chains(chains, ChainStage::Again);
            passes.limit_speeds();
            passes.integrate_positions();
            for _ in 0..budget.relax_iterations {
                passes.block_sweep_normal_first(Phase::Relax, rigid);
            }
            passes.solve_chains(chains, ChainStage::Relax);
            passes.keep_chains(chains, substep + 1 == budget.substeps);
            passes.limit_speeds();
            passes.end_substep(substep);
        }
        passes.leave_chains(chains);
    }
}
