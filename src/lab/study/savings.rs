//! Savings from specialization: the time and memory that kernels save by leaving out features that a scene
//! lacks.
//!
//! The features of a scene select the kernel. Here each feature that a scene lacks is forced on, alone and
//! all together, and interleaved timing measures the extra cost. Since few scenes lack friction, each scene
//! also runs frictionless, with every friction coefficient zero.
//!
//! Scenes with few contacts are left out, because the fixed cost of starting a sweep dominates there.

use super::interleave::time_in_turns;
use super::sample::Sample;
use super::{Progress, StudyPlan, timing_steps};
use crate::engine::clock::Phase;
use crate::engine::constraints::Features;
use crate::engine::lanes::native_width;
use crate::engine::world::{Divergence, Settings};
use crate::lab::error::Error;
use crate::lab::scenes::Scene;

/// Savings from leaving out one feature on a scene that lacks it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Saving {
    /// Scene name with its size.
    pub scene: String,
    /// Name of the solver.
    pub solver: &'static str,
    /// Lanes per instruction.
    pub lanes: usize,
    /// The feature that was left out; `all` for all of them.
    pub feature: &'static str,
    /// Size of prepared records with only the features of the scene (bytes per contact).
    pub bytes: f64,
    /// Size saved by leaving this feature out (bytes per contact).
    pub bytes_saved: f64,
    /// Time of passes over constraints with only the features of the scene (ns per contact and sweep).
    pub ns: f64,
    /// Time saved by leaving this feature out (ns per contact and sweep); negative if it takes longer.
    pub ns_saved: f64,
    /// Whether both runs ended with the same bits.
    pub bits_equal: bool,
}

/// Names of features, and the flags that force them on.
const FEATURES: [(&str, Features); 4] = [
    ("friction", Features { friction: true, ..Features::NONE }),
    ("second point", Features { two_points: true, ..Features::NONE }),
    ("rotation", Features { rotation: true, ..Features::NONE }),
    ("restitution", Features { restitution: true, ..Features::NONE }),
];

/// Minimum average number of contacts of a scene to be included.
const FEWEST_CONTACTS: f64 = 100.0;

/// A copy of the scene with every friction coefficient zero.
fn frictionless(scene: &Scene) -> Scene {
    let mut copy = scene.clone();
    copy.name += " frictionless";
    copy.bodies.iter_mut().flat_map(|b| &mut b.shapes).for_each(|shape| shape.friction = 0.0);
    copy
}

/// For every scene of the plan, the cost of each feature that it lacks, with every solver of the plan at its
/// standard budget and with the plan's widest lanes.
pub fn savings(plan: &StudyPlan, progress: &(dyn Fn(Progress) + Sync)) -> Result<Vec<Saving>, Error> {
    plan.check()?;
    let width = plan.widths.iter().copied().max().unwrap_or(native_width());
    let mut scenes = Vec::new();
    for name in &plan.scenes {
        let scene = plan.open(name)?.scene;
        scenes.extend([frictionless(&scene), scene]);
    }
    let total = plan.solvers.len() * scenes.len();
    let mut savings = Vec::new();
    let mut done = 0;
    for solver in &plan.solvers {
        for scene in &scenes {
            progress(Progress { done, total, what: format!("{} · {}", scene.name, solver.name) });
            done += 1;
            let impacts = plan.impacts.first().copied().unwrap_or_default();
            let base = Settings { impacts, ..Settings::new(solver).exactly(width) };
            savings.extend(of_scene(plan, scene, base)?);
        }
    }
    Ok(savings)
}

/// The savings on one scene; empty if it has every feature, or few contacts.
fn of_scene(plan: &StudyPlan, scene: &Scene, base: Settings) -> Result<Vec<Saving>, Error> {
    let has = scene.build(base.clone())?.features();
    let lacks = |feature: &Features| has.union(*feature) != has;
    let mut forced: Vec<_> = FEATURES.into_iter().filter(|(_, feature)| lacks(feature)).collect();
    if forced.is_empty() {
        return Ok(Vec::new());
    }
    if forced.len() > 1 {
        forced.push(("all", Features { damping: false, ..Features::FULL }));
    }
    let mut settings = vec![base.clone()];
    settings.extend(forced.iter().map(|&(_, extra_features)| Settings { extra_features, ..base.clone() }));
    let samples = time_in_turns(scene, &settings, timing_steps(plan, [scene]), plan.repeats, plan.seed)?;
    let Some(Ok(own)) = samples.first() else { return Ok(Vec::new()) };
    if own.load.contacts < FEWEST_CONTACTS {
        return Ok(Vec::new());
    }
    let ns = per_contact(own);
    let saving = |((feature, _), sample): (&(&'static str, Features), &Result<Sample, Divergence>)| {
        let sample = sample.as_ref().ok()?;
        Some(Saving {
            scene: scene.name.clone(),
            solver: base.solver.name,
            lanes: base.width.lanes(),
            feature,
            bytes: own.load.bytes_per_contact,
            bytes_saved: sample.load.bytes_per_contact - own.load.bytes_per_contact,
            ns,
            ns_saved: per_contact(sample) - ns,
            bits_equal: sample.hash == own.hash,
        })
    };
    Ok(forced.iter().zip(&samples[1..]).filter_map(saving).collect())
}

/// Time per contact and sweep (ns), from the median times of the phases that sweep.
fn per_contact(sample: &Sample) -> f64 {
    let sweeps = Phase::ALL.iter().zip(sample.phase_ns).filter(|(phase, _)| phase.is_sweep());
    let ns: f64 = sweeps.map(|(_, ns)| ns).sum();
    ns / (sample.load.contacts * sample.load.sweeps).max(1.0)
}
