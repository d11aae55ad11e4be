//! Results of a study: one record per setting.

use super::budget;
use super::curve::ErrorAxis;
use super::sample::Sample;
use super::sweep::Swept;
use crate::engine::constraints::Impacts;
use crate::engine::lanes::LaneWidth;
use crate::engine::narrowphase::frozen::Freezing;
use crate::engine::params::Budget;
use crate::engine::solvers::find;
use crate::engine::world::{Criterion, Divergence, Order, Quantity, Settings};
use crate::lab::error::Error;
use crate::lab::interned::{self, Name};
use crate::lab::metrics::Errors;
use crate::lab::overrides;
use crate::lab::scenes::Scene;
use crate::lab::scenes::class::SceneClass;
use crate::lab::scenes::holds::{Broken, Mark};
use crate::lab::scenes::tolerance::{Accuracy, Tolerances};
pub use crate::lab::trial::TruthError;
use crate::lab::units::{self, si};

/// One row of the study: a scene, a solver, a budget, an order and a lane width.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct Record {
    /// Scene name with its size.
    pub scene: String,
    /// Number of bodies in the scene.
    pub bodies: usize,
    /// Class of the scene.
    #[serde(default)]
    pub class: SceneClass,
    /// Step length (s).
    pub dt: f64,
    /// Name of the solver.
    #[serde(deserialize_with = "interned::read")]
    pub solver: Name,
    /// Constraint order.
    pub order: Order,
    /// Lanes per instruction.
    pub lanes: usize,
    /// Work per step.
    pub budget: Budget,
    /// Text of the budget, for tables.
    pub budget_text: String,
    /// Treatment of impacts.
    #[serde(default)]
    pub impacts: Impacts,
    /// Treatment of frozen contacts.
    #[serde(default)]
    pub frozen: Freezing,
    /// Parameters of the solver, as `name=value` separated by blanks.
    #[serde(default)]
    pub parameters: String,
    /// Value of a sweep; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swept: Option<Swept>,
    /// Times and counts; `None` if the run failed.
    #[serde(alias = "lap")]
    pub sample: Option<Sample>,
    /// Speedup over one colored lane; `None` if that was not run.
    pub speed_up: Option<f64>,
    /// Errors, the same for all widths; `None` if the run failed.
    pub errors: Option<Errors>,
    /// Distance to the scene's reference value.
    #[serde(rename = "reference")]
    pub truth: Option<TruthError>,
    /// Tolerances of the scene.
    pub tolerances: Tolerances,
    /// The first violated requirement of the scene.
    #[serde(flatten, with = "holding")]
    pub broken: Option<Broken>,
    /// Names of conditions that were not checked.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unchecked: Vec<String>,
    /// Result of the extended run; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub later: Option<Later>,
    /// Result of the run of a minute that was pushed at random; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poked: Option<Later>,
    /// Hash of the state after a timing run, as hexadecimal digits, until the setting is timed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<String>,
    /// Whether this width ended with the same bits as the error run.
    pub bits_equal: Option<bool>,
    /// Divergence that ended the run.
    pub failure: Option<FailedAt>,
}

/// File format: the columns `holds` and `failed_step`, and the body if there is one.
mod holding {
    use super::{Broken, Mark};
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Words {
        holds: String,
        failed_step: Option<u64>,
        #[serde(default, skip_serializing_if = "Option::is_none")]
        failed_body: Option<usize>,
    }

    pub fn serialize<S: Serializer>(broken: &Option<Broken>, serializer: S) -> Result<S::Ok, S::Error> {
        let holds = broken.map_or("yes", |broken| broken.mark.word()).to_string();
        let (failed_step, failed_body) = (broken.map(|b| b.step), broken.and_then(|b| b.body));
        Words { holds, failed_step, failed_body }.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<Broken>, D::Error> {
        let Words { holds, failed_step, failed_body } = Words::deserialize(deserializer)?;
        let Some(step) = failed_step else { return Ok(None) };
        let mark = Mark::ALL.into_iter().find(|mark| mark.word() == holds);
        let mark = mark.ok_or_else(|| D::Error::custom(format!("'{holds}' is no word of 'holds'")))?;
        Ok(Some(Broken { mark, step, body: failed_body }))
    }
}

/// Result of an extended run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Later {
    /// Planned number of steps.
    pub steps: u64,
    /// Planned duration (s).
    pub seconds: f64,
    /// The first violated requirement.
    #[serde(flatten, with = "holding")]
    pub broken: Option<Broken>,
    /// Root mean square of the speed over the last second (m/s); `None` if the scene need not come to rest.
    pub rest_speed_m_s: Option<f64>,
}

impl Record {
    /// The record of a run of `scene` that has measured nothing yet.
    pub fn of(scene: &Scene, tolerances: Tolerances, settings: &Settings) -> Self {
        let Settings { solver, order, budget, impacts, frozen, .. } = *settings;
        Record {
            scene: scene.name.clone(),
            bodies: scene.bodies.len(),
            class: SceneClass::default(),
            dt: scene.dt,
            solver: solver.name,
            order,
            lanes: settings.width.lanes(),
            budget,
            budget_text: budget::whole(&budget, solver, (impacts, frozen), &settings.parameters),
            impacts,
            frozen,
            parameters: overrides::words(solver, &settings.parameters),
            swept: None,
            sample: None,
            speed_up: None,
            errors: None,
            truth: None,
            tolerances,
            broken: None,
            unchecked: Vec::new(),
            later: None,
            poked: None,
            hash: None,
            bits_equal: None,
            failure: None,
        }
    }

    /// The setting in words: `4 substeps × 8 velocity, 8 lanes`.
    pub fn setting_text(&self) -> String {
        format!("{}, {}", self.budget_text, units::lanes_or_order(self.order, self.lanes))
    }

    /// Key that all widths of one setting of a scene share.
    pub fn setting(&self) -> impl PartialEq {
        let chosen = (self.budget, self.order, self.impacts, self.frozen, self.parameters.as_str());
        (self.scene.as_str(), self.solver, chosen, self.swept)
    }

    /// The settings of its run; those of a sweep of features lack the extra ones.
    ///
    /// Errors: a solver or a parameter that is not known, as in records of another version.
    pub fn settings(&self) -> Result<Settings, Error> {
        let solver = find(self.solver)?;
        let width = LaneWidth::from_lanes(self.lanes).unwrap_or(LaneWidth::W1);
        Ok(Settings {
            order: self.order,
            budget: self.budget,
            impacts: self.impacts,
            frozen: self.frozen,
            parameters: overrides::of_words(solver, &self.parameters)?,
            ..Settings::new(solver).exactly(width)
        })
    }

    /// Time of a step (ns), see [`Sample::cost_ns`]; infinite without a time.
    pub fn cost_ns(&self) -> f64 {
        self.sample.as_ref().map_or(f64::INFINITY, Sample::cost_ns)
    }

    /// Failure in the extended run, in words; `None` if it holds or there was no extended run.
    pub fn fails_later(&self) -> Option<String> {
        self.failure_of(self.later?)
    }

    /// Failure in the run that was pushed, in words; `None` if it survives or there was none.
    pub fn fails_poked(&self) -> Option<String> {
        self.failure_of(self.poked?)
    }

    fn failure_of(&self, later: Later) -> Option<String> {
        if let Some(broken) = later.broken {
            return Some(broken.to_string());
        }
        let limit = self.tolerances.rest?.value;
        let speed = later.rest_speed_m_s?;
        (speed > limit).then(|| format!("moves at {} after {:.0} s", si(speed, "m/s"), later.seconds))
    }

    /// Whether all known errors are within their tolerances at this accuracy. Failures in the extended run
    /// count.
    pub fn is_good(&self, accuracy: Accuracy) -> bool {
        self.excess_at(accuracy.share()) <= 1.0
    }

    /// Why the run does not hold; `None` if it holds.
    pub fn mark(&self) -> Option<Mark> {
        self.broken.map(|b| b.mark).or(self.failure.map(|_| Mark::BlewUp))
    }

    /// Step of the first violated requirement or of the divergence; `None` if the run holds.
    pub fn failed_step(&self) -> Option<u64> {
        self.broken.map(|b| b.step).or(self.failure.map(|f| f.step))
    }

    /// Why the run failed or violates a condition of its scene; `None` if it does neither.
    pub fn why_failed(&self) -> Option<String> {
        self.failure.map(|f| f.to_string()).or(self.broken.map(|b| b.to_string()))
    }

    /// The command that runs this setting on `scene`, a name or a file.
    pub fn command(&self, scene: &str) -> String {
        let mut text = format!("simpulse run {} --solver {}", quoted(scene), self.solver);
        text += &match self.order {
            Order::Colored => format!(" --lanes {}", self.lanes),
            order => format!(" --order {}", units::order(order)),
        };
        text += &format!(" --substeps {}", self.budget.substeps);
        if let Ok(solver) = find(self.solver) {
            let kinds = budget::kinds(&self.budget, solver);
            text += &kinds.map(|(name, n)| format!(" --{name}-iterations {n}")).collect::<String>();
            let own = overrides::of_words(solver, &self.parameters).unwrap_or_else(|_| solver.defaults());
            for word in overrides::changed(solver, &own).split_whitespace() {
                text += &format!(" --set {word}");
            }
        }
        if self.impacts != Impacts::Own {
            text += &format!(" --impacts {}", self.impacts.name());
        }
        if self.frozen != Freezing::Own {
            text += &format!(" --frozen {}", self.frozen);
        }
        text
    }

    /// The command that draws this setting where it failed: after the step that violated a requirement, or
    /// the last one before a divergence.
    pub fn command_to_see(&self, scene: &str) -> String {
        let last = self.broken.map(|b| b.step).or(self.failure.map(|f| f.step.saturating_sub(1)));
        let step = last.map_or(String::new(), |step| format!(" --step {step}"));
        format!("{} --picture failed.svg{step}", self.command(scene))
    }

    /// Whether the run holds. Profiles and advice include only such settings.
    pub fn holds(&self) -> bool {
        self.mark().is_none()
    }

    /// Whether most steps were too large for the solver's own method. Errors and times are then those of its
    /// fallback sweeps.
    pub fn is_unsolved(&self) -> bool {
        self.sample.as_ref().is_some_and(|sample| sample.load.unsolved > 0.5)
    }

    /// Error along an axis ÷ its tolerance; `None` if the record has no such error.
    pub fn in_tolerance(&self, axis: ErrorAxis) -> Option<f64> {
        self.in_tolerance_at(axis, 1.0)
    }

    /// The same, with this multiple of the tolerance.
    fn in_tolerance_at(&self, axis: ErrorAxis, share: f64) -> Option<f64> {
        let tolerance = axis.tolerance(&self.tolerances)?.at(share);
        let error = axis.of(self)?;
        Some(if error > 0.0 { error / tolerance } else { 0.0 })
    }

    /// The largest error ÷ tolerance for a plausible run, see [`Self::excess_at`].
    pub fn excess(&self) -> f64 {
        self.excess_at(1.0)
    }

    /// The largest error ÷ this multiple of its tolerance: all are within up to 1. Infinite for a run that does
    /// not hold, that never reached the event of the reference value, or that fallback sweeps solved instead of
    /// the solver's own method.
    pub fn excess_at(&self, share: f64) -> f64 {
        let known = |axis: &ErrorAxis| match axis {
            ErrorAxis::Truth => self.truth.is_some() && self.tolerances.truth.is_some(),
            axis => axis.tolerance(&self.tolerances).is_some(),
        };
        let judged = ErrorAxis::JUDGED.into_iter().filter(known);
        let worst = judged.map(|axis| self.in_tolerance_at(axis, share).unwrap_or(f64::INFINITY));
        let fell = self.later.is_some_and(|later| later.broken.is_some());
        if self.holds() && !fell && !self.is_unsolved() { worst.fold(0.0, f64::max) } else { f64::INFINITY }
    }
}

/// A word of a command, in quotes if a shell would change it.
#[doc(hidden)]
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.:/=,".contains(c);
    match word.chars().all(is_plain) && !word.is_empty() {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// Body and step at which a run diverged.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FailedAt {
    /// Step, counted from 1.
    pub step: u64,
    /// Body index.
    pub body: usize,
    /// Which quantity is out of bounds.
    #[serde(default)]
    pub quantity: Quantity,
    /// The violated criterion.
    #[serde(default)]
    pub criterion: Criterion,
    /// Speed in m/s or rad/s; `None` if it is not finite.
    pub speed: Option<f32>,
}

impl From<Divergence> for FailedAt {
    fn from(d: Divergence) -> Self {
        let speed = Some(d.speed).filter(|s| s.is_finite());
        FailedAt { step: d.step, body: d.body, quantity: d.quantity, criterion: d.criterion, speed }
    }
}

impl std::fmt::Display for FailedAt {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let &FailedAt { step, body, quantity, criterion, speed } = self;
        Divergence::new(step, body, quantity, speed.unwrap_or(f32::NAN), criterion).fmt(f)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lab::scenes::{Scene, SceneBody, SceneShape};
    use crate::lab::study::sample::Load;

    /// A record of `stack:2` by `pgs` in colored order, with a time (µs) and a penetration (m).
    pub fn record(lanes: usize, substeps: u32, time: f64, penetration: f64) -> Record {
        let sample = Sample {
            mean_ns: 1e3 * time,
            median_ns: 1e3 * time,
            worst_ns: 1e3 * time,
            rounds: 1,
            waited: 0.0,
            noise: 0.0,
            spread_ns: 0.0,
            quartiles_ns: [0.0; 2],
            phase_ns: Default::default(),
            row_sweep_ns: 1.0,
            yardstick_ns: 1e4,
            load: Load::default(),
            blocks_ns: vec![vec![1e3 * time; 20]],
            hash: 0,
        };
        Record {
            scene: "stack:2".to_string(),
            bodies: 3,
            class: SceneClass::Moves,
            dt: 0.01,
            solver: "pgs",
            order: Order::Colored,
            lanes,
            budget: Budget { substeps, velocity_iterations: 8, relax_iterations: 0, position_iterations: 0 },
            budget_text: format!("{substeps} substeps"),
            impacts: Impacts::Own,
            frozen: Freezing::Own,
            parameters: String::new(),
            swept: None,
            sample: Some(sample),
            speed_up: None,
            errors: Some(
                Errors::default()
                    .with("penetration_max_m", penetration)
                    .with("held_depth_p99_m", penetration),
            ),
            truth: None,
            tolerances: tolerances(),
            broken: None,
            unchecked: Vec::new(),
            later: None,
            poked: None,
            hash: None,
            bits_equal: Some(true),
            failure: None,
        }
    }

    /// Tolerances of a box of one meter in a scene that need not come to rest.
    pub fn tolerances() -> Tolerances {
        let body = SceneBody::dynamic([0.0, 0.0], SceneShape::rectangle(0.5, 0.5));
        Tolerances::standard(&Scene::new("x", vec![body]))
    }

    pub fn failed(lanes: usize) -> Record {
        let failure = FailedAt {
            step: 7,
            body: 2,
            quantity: Quantity::Speed,
            criterion: Criterion::Bounds,
            speed: None,
        };
        Record { sample: None, errors: None, failure: Some(failure), ..record(lanes, 9, 0.0, 0.0) }
    }

    /// A record with errors and a time whose run fell.
    pub fn fell(lanes: usize, substeps: u32, time: f64, penetration: f64) -> Record {
        let broken = Some(Broken { mark: Mark::Fell, step: 100, body: None });
        Record { broken, ..record(lanes, substeps, time, penetration) }
    }

    #[test]
    fn an_error_is_judged_in_the_tolerance_of_its_scene() {
        let mut good = record(8, 1, 10.0, 5e-3);
        assert_eq!((good.in_tolerance(ErrorAxis::Truth), good.excess()), (None, 0.5));
        let truth = TruthError { quantity: "", unit: "N", expected: 50.0, error: Some(2.0) };
        (good.truth, good.tolerances) = (Some(truth), good.tolerances.percent(50.0));
        assert_eq!(good.excess(), 4.0);
        good.truth = Some(TruthError { error: None, ..truth });
        assert_eq!(good.excess(), f64::INFINITY);
        for bad in [fell(8, 1, 10.0, 0.0), failed(8)] {
            assert_eq!((bad.excess(), bad.holds()), (f64::INFINITY, false));
        }
        assert_eq!(fell(8, 1, 10.0, 0.0).mark(), Some(Mark::Fell));
        assert_eq!(failed(8).mark(), Some(Mark::BlewUp));
    }

    #[test]
    fn what_falls_or_moves_later_is_not_good() {
        let mut record = record(8, 1, 10.0, 0.9e-3);
        let good = |r: &Record| Accuracy::ALL.map(|a| r.is_good(a));
        assert_eq!((good(&record), record.fails_later()), ([true, true, false], None));
        record.tolerances.rest = Some(crate::lab::scenes::tolerance::Tolerance::new(5e-3, "x"));
        record.errors = record.errors.map(|e| e.with("rest_speed_m_s", 1e-3));
        assert_eq!(good(&record), [true, false, false]);
        let later = Later { steps: 3600, seconds: 60.0, broken: None, rest_speed_m_s: Some(36e-3) };
        record.later = Some(later);
        assert_eq!(
            (good(&record), record.fails_later()),
            ([false; 3], Some("moves at 36.0 mm/s after 60 s".into()))
        );
        let broken = Some(Broken { mark: Mark::Fell, step: 800, body: None });
        record.later = Some(Later { broken, rest_speed_m_s: Some(0.0), ..later });
        assert_eq!((good(&record), record.fails_later()), ([false; 3], Some("fell at step 800".into())));
    }

    #[test]
    fn a_failure_without_a_finite_speed_says_so() {
        let of = |quantity, speed, criterion| {
            FailedAt::from(Divergence::new(3, 1, quantity, speed, criterion)).to_string()
        };
        let bounds = |quantity, speed| of(quantity, speed, Criterion::Bounds);
        let cure = "; try more substeps, a shorter step or another solver";
        let expected = [
            (bounds(Quantity::Speed, f32::NAN), "body 1 has no finite speed"),
            (
                bounds(Quantity::Speed, 2e5),
                "body 1 moves at 2.000e5 m/s, more than 1e5 length units per second",
            ),
            (bounds(Quantity::Spin, 2e5), "body 1 spins at 2.000e5 rad/s, more than 1e5"),
            (bounds(Quantity::Position, f32::NAN), "body 1 has no finite position"),
            (
                of(Quantity::Speed, 82.0, Criterion::Energy),
                "kinetic energy beyond 100 times what start, weight and kinematic bodies give; the fastest, \
                 body 1 moves at 8.200e1 m/s",
            ),
        ];
        for (text, what) in expected {
            assert_eq!(text, format!("diverged at step 3: {what}{cure}"));
        }
    }
}
