//! A trial: one scene under one setting, from before its first step to its verdict.
//!
//! All commands that judge a run step it here, so that "diverged" and "holds" mean the same everywhere:
//!
//! ```
//! use simpulse::{solvers, world::Settings};
//! use simpulse::lab::{scenes, trial::Trial};
//!
//! let mut loaded = scenes::load("stack:3")?;
//! let settings = Settings { record_impulses: true, ..Settings::new(solvers::find("soft_step")?) };
//! let mut highest = f64::NEG_INFINITY;
//! let found = Trial::of(&mut loaded, settings).run(&mut |world| {
//!     highest = highest.max(world.bodies.center(3)[1]);
//!     Ok(())
//! })?;
//! assert!(found.failure.is_none() && found.broken.is_none() && highest < 2.6);
//! assert!(found.errors.is_some_and(|errors| errors.penetration_max() < 0.01));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use crate::engine::world::{Divergence, Settings, StepError, World};
use crate::lab::error::Error;
use crate::lab::interned::{self, Name};
use crate::lab::metrics::{Errors, Observation};
use crate::lab::pokes::Pokes;
use crate::lab::scenes::holds::{Broken, Demand, SceneMonitor};
use crate::lab::scenes::{Loaded, Scene, Truth};

/// What is run, for how long, and what is measured.
pub struct Trial<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// The settings. Residuals need [`Settings::record_impulses`], those of the solver's own law also
    /// [`Settings::observe_rule`].
    pub settings: Settings,
    /// Conditions that every step has to meet, in addition to those on every scene.
    pub demands: Vec<Demand>,
    /// Known value to observe.
    pub truth: Option<&'a mut Truth>,
    /// Number of steps.
    pub steps: u64,
    /// Number of steps at the end whose errors are measured; 0 for none.
    pub measured: u64,
    /// Whether the trial ends at the first violated condition.
    pub until_broken: bool,
    /// Seed of the pushes in the first half of the run; `None` for none.
    pub poked: Option<u64>,
}

/// Result of a trial.
pub struct TrialOutcome {
    /// The world after the last step.
    pub world: World,
    /// Errors of the measured steps. `None` if the run diverged, or none was measured.
    pub errors: Option<Errors>,
    /// Divergence, or kinetic energy without a source, that ended the run.
    pub failure: Option<Divergence>,
    /// Distance to the known value; `None` if there is none, or the run diverged.
    pub truth: Option<TruthError>,
    /// The first violated condition.
    pub broken: Option<Broken>,
    /// Number of pushes.
    pub pokes: u32,
}

impl<'a> Trial<'a> {
    /// All steps of a scene, all of them measured, without conditions and known values of its own.
    pub fn new(scene: &'a Scene, settings: Settings) -> Self {
        let steps = u64::from(scene.steps);
        Trial {
            scene,
            settings,
            demands: Vec::new(),
            truth: None,
            steps,
            measured: steps,
            until_broken: false,
            poked: None,
        }
    }

    /// The same, with the scene's conditions and known value.
    pub fn of(loaded: &'a mut Loaded, settings: Settings) -> Self {
        let (demands, truth) = (loaded.demands.clone(), loaded.truth.as_mut());
        Trial { demands, truth, ..Trial::new(&loaded.scene, settings) }
    }

    /// Runs the trial. `observer` sees the world before the first step (`step_index` 0) and after each step
    /// that did not diverge; its error ends the trial.
    ///
    /// Errors: a scene that cannot be built, and those of the observer.
    pub fn run(self, observer: &mut dyn FnMut(&World) -> Result<(), Error>) -> Result<TrialOutcome, Error> {
        let Trial { scene, settings, demands, truth, steps, measured, until_broken, poked } = self;
        let mut world = scene.build(settings)?;
        let mut measuring = Measuring::new(&world, demands, truth);
        let mut pokes = poked.map(|seed| Pokes::new(seed, &world, steps / 2));
        let mut failure = None;
        observer(&world)?;
        for step in 0..steps {
            if step + measured >= steps {
                measuring.begin_errors(&world);
            }
            if let Some(pokes) = &mut pokes {
                pokes.act(&mut world)?;
            }
            failure = world.step().err().and_then(StepError::divergence);
            failure = failure.or_else(|| measuring.observe(&world));
            if failure.is_some() {
                break;
            }
            observer(&world)?;
            if until_broken && measuring.monitor.broken().is_some() {
                break;
            }
        }
        let Measured { errors, truth, broken } = measuring.end(failure.is_none());
        Ok(TrialOutcome {
            errors,
            truth,
            broken,
            pokes: pokes.map_or(0, |pokes| pokes.given()),
            failure,
            world,
        })
    }
}

/// What is measured of a run.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Errors of the measured steps. `None` if the run diverged, or none was measured.
    pub errors: Option<Errors>,
    /// Distance to the known value; `None` if there is none, or the run diverged.
    pub truth: Option<TruthError>,
    /// The first violated condition.
    pub broken: Option<Broken>,
}

/// Measures a run, step by step.
pub(super) struct Measuring<'a> {
    monitor: SceneMonitor,
    observation: Option<Observation>,
    truth: Option<&'a mut Truth>,
}

impl<'a> Measuring<'a> {
    /// Of a world before its first step.
    pub fn new(world: &World, demands: Vec<Demand>, truth: Option<&'a mut Truth>) -> Self {
        Measuring { monitor: SceneMonitor::new(world, demands), observation: None, truth }
    }

    /// Errors are measured from the next step on.
    pub fn begin_errors(&mut self, world: &World) {
        self.observation.get_or_insert_with(|| Observation::new(world));
    }

    /// Adds a step that did not diverge. Returns kinetic energy without a source, which ends the run.
    pub fn observe(&mut self, world: &World) -> Option<Divergence> {
        self.monitor.observe(world);
        if let Some(observation) = &mut self.observation {
            observation.observe(world);
            if let Some(failure) = observation.blown_up() {
                return Some(failure);
            }
        }
        if let Some(truth) = &mut self.truth {
            truth.observer.observe(world);
        }
        None
    }

    /// What was measured; `well`: whether the run did not fail.
    pub fn end(self, well: bool) -> Measured {
        Measured {
            errors: self.observation.filter(|_| well).map(|observation| observation.errors()),
            truth: self.truth.filter(|_| well).map(|truth| TruthError::of(truth)),
            broken: self.monitor.broken(),
        }
    }
}

/// Distance of a run from a reference value.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TruthError {
    /// Name of the quantity.
    #[serde(deserialize_with = "interned::read")]
    pub quantity: Name,
    /// Unit of both numbers.
    #[serde(deserialize_with = "interned::read")]
    pub unit: Name,
    /// The reference value.
    pub expected: f64,
    /// Distance to it; `None` if the run never reached the observed event.
    pub error: Option<f64>,
}

impl TruthError {
    /// Result of the observer; an infinite distance becomes `None`.
    pub fn of(truth: &Truth) -> Self {
        let error = truth.observer.error().filter(|e| e.is_finite());
        TruthError { quantity: truth.quantity, unit: truth.unit, expected: truth.expected, error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::{DEFAULT, find};
    use crate::lab::scenes::holds::Mark;
    use crate::lab::scenes::load;

    fn settings() -> Settings {
        Settings::new(find(DEFAULT).unwrap())
    }

    #[test]
    fn an_observer_sees_the_start_and_every_step_and_ends_the_trial() {
        let mut loaded = load("stack:2").unwrap();
        let mut seen = Vec::new();
        let trial = Trial { steps: 5, measured: 2, ..Trial::of(&mut loaded, settings()) };
        let found = trial.run(&mut |world| {
            seen.push(world.step_index());
            Ok(())
        });
        let found = found.unwrap();
        assert_eq!((seen, found.errors.unwrap().steps), (vec![0, 1, 2, 3, 4, 5], 2));
        let stop = |world: &World| match world.step_index() {
            3 => Err(Error::invalid("disk", "full")),
            _ => Ok(()),
        };
        let refused = Trial::of(&mut loaded, settings()).run(&mut { stop });
        assert!(refused.err().unwrap().to_string().contains("disk"));
    }

    #[test]
    fn a_trial_ends_at_its_first_violated_condition_and_names_the_body() {
        let loaded = load("bounce").unwrap();
        let demands = vec![Demand::StaysWithin(0.5)];
        let trial = Trial { demands, until_broken: true, ..Trial::new(&loaded.scene, settings()) };
        let found = trial.run(&mut |_| Ok(())).unwrap();
        let broken = found.broken.unwrap();
        assert_eq!((broken.mark, broken.body, broken.step), (Mark::Slid, Some(1), found.world.step_index()));
    }
}
