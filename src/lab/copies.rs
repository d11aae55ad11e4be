//! Many copies of a scene as one batch, each measured as if it ran alone.

use crate::engine::batch::Batch;
use crate::engine::error::Error as Invalid;
use crate::engine::world::{Settings, StepError, World};
use crate::lab::error::Error;
use crate::lab::scenes::Loaded;
use crate::lab::trial::{Measured, Measuring};
use std::time::Instant;

/// What became of all copies.
pub struct Copies {
    /// Of each copy, but for the errors of joints and of energy. `[copies]`
    pub outcomes: Vec<Measured>,
    /// Mean time of a step of one copy in the batch (ns), of a run in which nothing was measured.
    pub copy_step_ns: f64,
    /// Whether that run had the same bits.
    pub same_bits: bool,
}

/// A copy during the run.
struct Copy<'a> {
    /// The copy alone; it is not stepped.
    mirror: World,
    measuring: Measuring<'a>,
    is_lost: bool,
}

/// Runs scenes of equal numbers of bodies, step and length unit as one batch, for the steps of the first. `progress` is called
/// after each step.
///
/// Errors: a scene that cannot be built; a solver that solves copies together; another number of bodies.
pub fn run(loaded: &mut [Loaded], settings: &Settings, progress: &dyn Fn(u64)) -> Result<Copies, Error> {
    let mut copies = Vec::with_capacity(loaded.len());
    let mut scenes = Vec::with_capacity(loaded.len());
    for Loaded { scene, truth, demands, .. } in loaded {
        let mirror = scene.build(settings.clone())?;
        let mut measuring = Measuring::new(&mirror, demands.clone(), truth.as_mut());
        measuring.begin_errors(&mirror);
        copies.push(Copy { mirror, measuring, is_lost: false });
        scenes.push(&*scene);
    }
    let first = scenes.first().ok_or_else(|| Error::invalid("copies", "there are none"))?;
    let settings = copies[0].mirror.settings.clone();
    let batch = |settings| {
        Batch::new(settings, scenes.len(), |copy, world| {
            scenes[copy].add_to(world).map_err(|e| Invalid::invalid("scene", e.to_string()))
        })
    };
    let failed = |e: StepError| Error::invalid("batch", e.to_string());
    let mut measured = batch(settings.clone())?;
    for step in 1..=u64::from(first.steps) {
        measured.step().map_err(failed)?.into_iter().for_each(|copy| copies[copy].is_lost = true);
        for (i, copy) in copies.iter_mut().enumerate().filter(|(_, copy)| !copy.is_lost) {
            measured.read(i, &mut copy.mirror);
            copy.is_lost = copy.measuring.observe(&copy.mirror).is_some();
        }
        progress(step);
    }
    // Measuring evicts the caches.
    let mut timed = batch(Settings { record_impulses: false, ..settings })?;
    let begun = Instant::now();
    for _ in 0..first.steps {
        timed.step().map_err(failed)?;
    }
    let elapsed = begun.elapsed().as_secs_f64() * 1e9;
    let outcomes = copies.into_iter().map(|copy| copy.measuring.end(!copy.is_lost));
    Ok(Copies {
        outcomes: outcomes.collect(),
        copy_step_ns: elapsed / f64::from(first.steps.max(1)) / scenes.len() as f64,
        same_bits: (0..scenes.len()).all(|copy| timed.state_hash(copy) == measured.state_hash(copy)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers;
    use crate::lab::metrics::Errors;
    use crate::lab::study::open_scene;
    use crate::lab::trial::Trial;

    #[test]
    fn a_copy_is_measured_as_if_it_ran_alone() {
        for scene in ["stack:3", "circle_pile:20"] {
            let open = |seed: usize| open_scene(&format!("{scene}@{seed}"), None, Some(90), None).unwrap();
            let settings = Settings { record_impulses: true, ..Settings::new(solvers::SOFT_STEP) };
            let found = run(&mut (1..=3).map(open).collect::<Vec<_>>(), &settings, &|_| ()).unwrap();
            assert!(found.same_bits);
            for (seed, copy) in (1..).zip(found.outcomes) {
                let mut loaded = open(seed);
                let alone = Trial::of(&mut loaded, settings.clone()).run(&mut |_| Ok(())).unwrap();
                assert_eq!((copy.truth, copy.broken), (alone.truth, alone.broken), "{scene}@{seed}");
                let [copy, alone] = [copy.errors, alone.errors].map(|errors| errors.unwrap());
                let figures = |e: &Errors| [e.penetration_max(), e.law_rms_lighter(), e.rest_velocity()];
                assert_eq!(figures(&copy), figures(&alone), "{scene}@{seed}");
            }
        }
    }
}
