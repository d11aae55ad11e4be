//! A pane: one world, its errors, and whether they are good enough.

use crate::engine::constraints::Impacts;
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::Budget;
use crate::engine::world::{Settings, StepError, World};
use crate::lab::error::Error;
use crate::lab::metrics::{Errors, Observation};
use crate::lab::pokes::Pokes;
use crate::lab::scenes::Loaded;
use crate::lab::scenes::holds::SceneMonitor;
use crate::lab::study::curve::ErrorAxis;
use crate::lab::study::{FailedAt, Record, TruthError, budget};
use crate::lab::units::{percent, si};

/// Errors of one step: overlap (m), force error (weights of the lighter body × step), speed (m/s).
pub type StepErrors = [f64; 3];

/// A world under its settings, observed from the start of its scene.
pub struct Pane {
    /// The world.
    pub world: World,
    /// Divergence, or kinetic energy without a source; the pane then stands still.
    pub failure: Option<FailedAt>,
    /// The scene, with the observer of its reference value.
    pub(super) loaded: Loaded,
    monitor: SceneMonitor,
    /// Errors since `since`; `None` if steps were left out.
    meter: Option<Observation>,
    /// Errors of the step that was measured last.
    last: Errors,
    /// Step from which errors count: the last change of settings or bodies.
    pub(super) since: u64,
    pokes: Option<Pokes>,
    /// Whether a player has acted, so that the reference value no longer applies.
    touched: bool,
}

impl Pane {
    /// A pane at the start of a scene.
    pub(super) fn new(loaded: Loaded, settings: Settings, poke: Option<u64>) -> Result<Self, Error> {
        loaded.scene.runs_on(settings.solver)?;
        let world = loaded.scene.build(Settings { record_impulses: true, timed: true, ..settings })?;
        let monitor = SceneMonitor::new(&world, loaded.demands.clone());
        let meter = Some(Observation::new(&world));
        let last = Errors::default();
        let mut pane = Pane {
            world,
            failure: None,
            loaded,
            monitor,
            meter,
            last,
            since: 0,
            pokes: None,
            touched: false,
        };
        pane.poke(poke);
        Ok(pane)
    }

    /// Gives pushes by a seed from now on, or none.
    pub(super) fn poke(&mut self, seed: Option<u64>) {
        self.pokes = seed.map(|seed| Pokes::new(seed, &self.world, u64::MAX));
    }

    /// Number of pushes so far.
    pub(super) fn pokes(&self) -> u32 {
        self.pokes.as_ref().map_or(0, Pokes::given)
    }

    /// The world, to be changed by a player.
    pub(super) fn touch(&mut self) -> &mut World {
        self.touched = true;
        &mut self.world
    }

    /// Starts the measurement again, after bodies were added or settings changed.
    pub(super) fn measure_again(&mut self, bodies_changed: bool) {
        if bodies_changed {
            self.monitor = SceneMonitor::new(&self.world, self.loaded.demands.clone());
        }
        self.meter = Some(Observation::new(&self.world));
        self.since = self.world.step_index();
    }

    /// Takes a step. `measured`: whether its errors are measured, or `None` to measure them with those of all others.
    pub(super) fn step(&mut self, measured: Option<bool>) -> Result<(), Error> {
        if self.failure.is_some() {
            return Ok(());
        }
        if let Some(pokes) = &mut self.pokes {
            let before = pokes.given();
            pokes.act(&mut self.world)?;
            self.touched |= pokes.given() > before;
        }
        let mut single = measured.unwrap_or(true).then(|| Observation::new(&self.world));
        if measured.is_some() {
            self.meter = None;
        }
        match self.world.step() {
            Ok(()) => {}
            Err(StepError::Settings(error)) => return Err(error.into()),
            Err(StepError::Diverged(divergence)) => {
                self.failure = Some(divergence.into());
                return Ok(());
            }
            Err(error) => return Err(Error::invalid("threads", error.to_string())),
        }
        if let Some(single) = &mut single {
            single.observe(&self.world);
            self.last = single.errors();
        }
        self.monitor.observe(&self.world);
        if let Some(meter) = &mut self.meter {
            meter.observe(&self.world);
            // A player gives energy of his own.
            let failure = meter.blown_up().filter(|_| !self.touched);
            self.failure = failure.map(FailedAt::from);
        }
        if let Some(truth) = self.loaded.truth.as_mut().filter(|_| !self.touched) {
            truth.observer.observe(&self.world);
        }
        Ok(())
    }

    /// Sets the budget. Errors: one that the solver cannot run with.
    pub(super) fn set_budget(&mut self, budget: Budget) -> Result<(), Error> {
        budget::check(&budget, self.world.settings.solver)?;
        self.world.settings.budget = budget;
        self.measure_again(false);
        Ok(())
    }

    /// Sets a parameter. Errors: no such parameter, or a value out of its range.
    pub(super) fn set_parameter(&mut self, name: &str, value: f32) -> Result<(), Error> {
        let settings = &mut self.world.settings;
        settings.solver.set(&mut settings.parameters, name, value)?;
        self.measure_again(false);
        Ok(())
    }

    /// Sets the treatment of frozen contacts and of impacts, and the number of threads.
    pub(super) fn treat(&mut self, frozen: Freezing, impacts: Impacts, threads: usize) {
        let settings = &mut self.world.settings;
        (settings.frozen, settings.impacts, settings.threads) = (frozen, impacts, threads);
        self.measure_again(false);
    }

    /// Errors of the last measured step.
    pub fn last(&self) -> StepErrors {
        [self.last.penetration_max(), self.last.law_rms_lighter(), self.last.rest_velocity()]
    }

    /// Limits of [`Self::last`]; `None` where the scene has none.
    pub(super) fn limits(&self) -> [Option<f64>; 3] {
        let tolerances = &self.loaded.tolerances;
        [
            Some(tolerances.penetration.value),
            Some(tolerances.residual.value),
            tolerances.rest.map(|t| t.value),
        ]
    }

    /// The run so far, as a study would record it.
    pub(super) fn record(&self) -> Record {
        let Loaded { scene, truth, tolerances, .. } = &self.loaded;
        let truth = truth.as_ref().filter(|_| !self.touched).map(TruthError::of);
        // All overlap of a single step counts: where it comes from is known only along a run.
        let alone = || self.last.with("held_depth_p99_m", self.last.penetration_max());
        let errors = self.meter.as_ref().map_or_else(alone, Observation::errors);
        let mut tolerances = *tolerances;
        // Nothing rests, and little is reached, before the run that the scene asks for.
        if self.world.step_index() < u64::from(scene.steps) {
            tolerances.rest = None;
        }
        if truth.is_none_or(|t| t.error.is_none()) {
            tolerances.truth = None;
        }
        Record {
            lanes: self.world.lane_width().lanes(),
            errors: self.failure.is_none().then_some(errors),
            truth,
            broken: self.monitor.broken(),
            failure: self.failure,
            ..Record::of(scene, tolerances, &self.world.settings)
        }
    }

    /// Whether the run is good enough so far, and the sentence that says so.
    pub fn verdict(&self) -> (bool, String) {
        let record = self.record();
        let steps = self.loaded.scene.steps;
        let far = if self.world.step_index() < u64::from(steps) { " so far" } else { "" };
        if let Some(why) = record.why_failed() {
            let why = why.split("; try ").next().unwrap_or_default().to_string();
            return (
                false,
                format!("not good enough, because {}", why.replacen("diverged", "it diverged", 1)),
            );
        }
        let over = ErrorAxis::JUDGED.into_iter().filter_map(|axis| {
            let (error, tolerance) = (axis.of(&record)?, axis.tolerance(&record.tolerances)?.value);
            (error > tolerance).then(|| exceeded(axis, error, tolerance, &record))
        });
        let over: Vec<String> = over.collect();
        match over.is_empty() {
            true => (true, format!("good enough{far}")),
            false => (false, format!("not good enough{far}, because {}", over.join("; "))),
        }
    }

    /// How the run ended, for a recording.
    pub(super) fn outcome(&self) -> String {
        self.record().why_failed().unwrap_or("holds".into())
    }
}

/// `overlap 18.2 mm > 10.0 mm`
fn exceeded(axis: ErrorAxis, error: f64, limit: f64, record: &Record) -> String {
    match axis {
        ErrorAxis::Penetration => format!("overlap {} > {}", si(error, "m"), si(limit, "m")),
        ErrorAxis::Law => format!("force error {} > {} of a body's weight", percent(error), percent(limit)),
        ErrorAxis::Rest => format!("speed at rest {} > {}", si(error, "m/s"), si(limit, "m/s")),
        ErrorAxis::Truth => {
            let (unit, quantity) = record.truth.map_or(("", "reference value"), |t| (t.unit, t.quantity));
            format!("{quantity} is off by {} > {}", si(error, unit), si(limit, unit))
        }
    }
}
