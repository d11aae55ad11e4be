//! What it costs to model what a scene does not need.
//!
//! A scene's needs choose the kernel. Here each need that a scene is without is forced on,
//! alone and all together, and the race tells what that would have cost. Since few scenes are
//! without friction, each one also runs smooth, with every friction coefficient zero.
//!
//! Scenes of few contacts are left out: what their sweeps cost is the cost of starting them.

use super::interleave::{Sample, race};
use super::{StudyPlan, timing_steps};
use crate::engine::clock::Phase;
use crate::engine::constraints::Features;
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::scenes::Scene;

/// The cost of one need that a scene does not have.
#[derive(Clone, Debug, serde::Serialize)]
pub struct NeedCost {
    /// Name with size.
    pub scene: String,
    /// Name of the solver.
    pub solver: &'static str,
    /// Lanes per instruction.
    pub lanes: usize,
    /// What was modelled without need; `all` for everything.
    pub need: &'static str,
    /// Prepared records with just what the scene needs (bytes per contact).
    pub bytes: f64,
    /// What leaving this need out saves (bytes per contact).
    pub bytes_saved: f64,
    /// Passes over constraints with just what the scene needs (ns per contact and sweep).
    pub ns: f64,
    /// What leaving this need out saves (ns per contact and sweep); negative if it costs.
    pub ns_saved: f64,
    /// Whether both ended in the same bits.
    pub bits_equal: bool,
}

/// Names of needs and what forces them on.
const NEEDS: [(&str, Features); 4] = [
    ("friction", Features { friction: true, ..Features::NONE }),
    ("second point", Features { two_points: true, ..Features::NONE }),
    ("rotation", Features { rotation: true, ..Features::NONE }),
    ("restitution", Features { restitution: true, ..Features::NONE }),
];

/// Contacts that a scene must have on average to be worth a line.
const FEWEST_CONTACTS: f64 = 100.0;

/// The scene with every friction coefficient zero.
fn smooth(scene: &Scene) -> Scene {
    let mut smooth = scene.clone();
    smooth.name += " smooth";
    smooth.bodies.iter_mut().flat_map(|b| &mut b.shapes).for_each(|shape| shape.friction = 0.0);
    smooth
}

/// The costs, for every scene of the plan, of each need that it is without, with the
/// plan's last solver at its widest lanes and standard budget.
pub fn ablation(plan: &StudyPlan) -> Result<Vec<NeedCost>, Error> {
    let (Some(&solver), Some(&width)) = (plan.solvers.last(), plan.widths.iter().max()) else {
        return Ok(Vec::new());
    };
    let mut costs = Vec::new();
    let mut scenes = Vec::new();
    for name in &plan.scenes {
        let scene = plan.open(name)?.scene;
        scenes.extend([smooth(&scene), scene]);
    }
    for scene in scenes {
        let base = Settings { width, ..Settings::new(solver) };
        let has = scene.build(base.clone())?.features();
        let lacks = |need: &Features| has.union(*need) != has;
        let mut forced: Vec<_> = NEEDS.into_iter().filter(|(_, need)| lacks(need)).collect();
        if forced.is_empty() {
            continue;
        }
        if forced.len() > 1 {
            forced.push(("all", Features { damping: false, ..Features::FULL }));
        }
        let mut settings = vec![base.clone()];
        settings
            .extend(forced.iter().map(|&(_, extra_features)| Settings { extra_features, ..base.clone() }));
        let laps = race(&scene, &settings, timing_steps(plan, &scene), plan.repeats, plan.seed)?;
        let Some(Ok(own)) = laps.first() else { continue };
        if own.load.contacts < FEWEST_CONTACTS {
            continue;
        }
        for ((need, _), lap) in forced.iter().zip(&laps[1..]) {
            let Ok(lap) = lap else { continue };
            let ns = per_contact(own);
            costs.push(NeedCost {
                scene: scene.name.clone(),
                solver: solver.name,
                lanes: width.lanes(),
                need,
                bytes: own.load.bytes_per_contact,
                bytes_saved: lap.load.bytes_per_contact - own.load.bytes_per_contact,
                ns,
                ns_saved: per_contact(lap) - ns,
                bits_equal: lap.hash == own.hash,
            });
        }
    }
    Ok(costs)
}

/// ns per contact and sweep, from the median times of the phases that sweep.
fn per_contact(lap: &Sample) -> f64 {
    let sweeps = Phase::ALL.iter().zip(lap.phase_ns).filter(|(phase, _)| phase.is_sweep());
    let ns: f64 = sweeps.map(|(_, ns)| ns).sum();
    ns / (lap.load.contacts * lap.load.sweeps).max(1.0)
}
