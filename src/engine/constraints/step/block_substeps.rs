//! Substeps of block sweeps, with what `shim` and `soft_block` do around them: jams, rolling contacts, impacts before the step,
//! and chains of joints.

use super::jams::Jams;
use super::{CollisionScene, ImpactWaves, Passes};
use crate::clock::Phase;
use crate::constraints::impacts::ImpactLaw;
use crate::constraints::impacts::spread::VISITS;
use crate::constraints::joints::chains::{ChainStage, Chains};
use crate::constraints::kernels::rolling::{Roll, STEADY};
use crate::constraints::kernels::velocity::sweep::NormalRule;
use crate::narrowphase::circles::Rolling;

/// Standard number of substeps of both solvers.
const STANDARD: u32 = 14;

/// State kept between steps.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockSubsteps {
    jams: Jams,
    chains: Chains,
    /// Whether a dynamic body has a joint; empty without joints. `[bodies]`
    joined: Vec<bool>,
    /// `joined` of the last step. `[bodies]`
    last_joined: Vec<bool>,
    /// Whether a candidate pair has a disc.
    rolls: bool,
}

/// Visit limit for each of the first points of an island that is hit. With it, no step takes four times as
/// long as others. The work of a step outside its substeps takes as long as eight substeps.
fn visits(substeps: u32) -> usize {
    VISITS * (substeps.min(STANDARD) + 8) as usize / (STANDARD + 8) as usize
}

impl BlockSubsteps {
    /// Which contacts roll.
    pub fn rolling(scene: &CollisionScene<'_>) -> Rolling {
        Rolling { limit: STEADY * scene.length_unit }
    }

    /// Whether each dynamic body has a joint; empty without joints. `[bodies]`
    pub fn joined(&self) -> &[bool] {
        &self.joined
    }

    /// Releases jams, if there is a `push_speed` (m/s), and finds the bodies with joints. Returns whether these
    /// have changed since the last step.
    pub fn after_collision(&mut self, scene: &mut CollisionScene<'_>, push_speed: Option<f32>) -> bool {
        self.rolls = scene.has_discs;
        match push_speed {
            Some(push_speed) => self.jams.release(scene, push_speed),
            None => self.jams.clear(),
        }
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

    /// Turns the records of rolling contacts to the middle of the step.
    pub fn roll(&self, passes: &mut Passes<'_>) {
        if self.rolls {
            let dt = passes.dt();
            let middle = 0.5 * (1.0 - 1.0 / passes.budget().substeps as f32) * dt;
            passes.run(Phase::Prepare, &mut Roll { middle, dt, steady: STEADY * passes.length_unit() });
        }
    }

    /// Solves impacts before the step, unless the run has another law for them. The fields are those of [`ImpactWaves`].
    pub fn impacts(&self, passes: &mut Passes<'_>, timed: bool, writes_rows: bool, releases: bool) {
        if matches!(passes.impacts(), ImpactLaw::Solver { .. }) {
            passes.spread_impacts(ImpactWaves {
                timed,
                inelastic_except: Some(&self.joined),
                writes_rows,
                releases,
                visits: visits(passes.budget().substeps),
            });
            passes.parts().clock.lap(Phase::Prepare);
        }
    }

    /// All substeps: per substep `velocity_iterations` sweeps under `soft`, and `relax_iterations` under `rigid` after bodies
    /// have moved. `chains`: chains of joints are solved at once.
    pub fn run(
        &mut self,
        passes: &mut Passes<'_>,
        soft: impl NormalRule,
        rigid: impl NormalRule,
        chains: bool,
    ) {
        let BlockSubsteps { jams, chains: found, .. } = self;
        if chains {
            passes.find_chains(found);
        } else {
            *found = Chains::default();
        }
        let budget = passes.budget();
        for substep in 0..budget.substeps {
            if substep == 0 || found.has_effective_mass_scaling() {
                passes.integrate_velocities();
                passes.snapshot_chains(found);
                passes.warm_start();
            } else {
                passes.integrate_and_warm_start();
            }
            passes.solve_chains(found, ChainStage::Begin);
            for _ in 0..budget.velocity_iterations {
                passes.block_sweep_normal_first(Phase::Solve, soft);
                passes.iteration_done();
            }
            passes.solve_chains(found, ChainStage::Again);
            jams.bound(passes);
            passes.integrate_positions();
            for _ in 0..budget.relax_iterations {
                passes.block_sweep_normal_first(Phase::Relax, rigid);
            }
            passes.solve_chains(found, ChainStage::Relax);
            passes.keep_chains(found, substep + 1 == budget.substeps);
            jams.bound(passes);
            passes.end_substep(substep);
        }
        passes.leave_chains(found);
    }
}
