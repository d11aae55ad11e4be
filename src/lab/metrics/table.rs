//! The table of metrics. From it follow the columns of `study.csv`, the keys of JSON files, the lines of `run --all` and
//! of `list columns`: a new metric is an entry of [`METRICS`].

use super::Observation;
use super::balance::ratio;
use super::distribution::Sum;
use serde::de::Error;
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;

/// A metric of a run.
#[derive(Clone, Copy, Debug)]
pub struct Metric {
    /// Name of its column in CSV files and of its key in JSON files.
    pub name: &'static str,
    /// Unit; 1 for ratios.
    pub unit: &'static str,
    /// What it measures.
    pub meaning: &'static str,
    of: Formula,
}

#[derive(Clone, Copy, Debug)]
enum Formula {
    /// Every run has a value; zero if there is nothing to measure.
    Always(Always),
    /// Some runs have none.
    Sometimes(Sometimes),
}

type Always = fn(&Observation) -> f64;
type Sometimes = fn(&Observation) -> Option<f64>;

const fn always(name: &'static str, unit: &'static str, meaning: &'static str, of: Always) -> Metric {
    Metric { name, unit, meaning, of: Formula::Always(of) }
}

const fn sometimes(name: &'static str, unit: &'static str, meaning: &'static str, of: Sometimes) -> Metric {
    Metric { name, unit, meaning, of: Formula::Sometimes(of) }
}

/// All metrics, in the order of the columns. Energies are relative to the scale of
/// [`Balance::close`](super::balance::Balance::close).
pub const METRICS: &[Metric] = &[
    always("flight_depth_max_m", "m", "largest overlap of bodies when their contact was found", |o| {
        o.flight_max
    }),
    always(
        "held_depth_p99_m",
        "m",
        "overlap that the solver left, 99th percentile: beyond the depth at which the contact was found",
        |o| o.held.p99(),
    ),
    always("rest_depth_max_m", "m", "largest overlap of the last second", |o| o.depths.largest().penetration),
    always("penetration_max_m", "m", "largest overlap after a step, pairs searched again", |o| {
        o.penetration.max()
    }),
    always("penetration_mean_m", "m", "mean overlap of contact points; open ones count as 0", |o| {
        o.penetration.mean()
    }),
    always("penetration_rms_m", "m", "root mean square of the same", |o| o.penetration.rms()),
    always("penetration_p99_m", "m", "99th percentile of the same", |o| o.penetration.p99()),
    always("penetration_relative", "1", "largest overlap ÷ half the thinnest dynamic shape", |o| {
        ratio(o.penetration.max(), o.half_extent)
    }),
    sometimes(
        "penetration_excess_m",
        "m",
        "largest overlap of the last second beyond the static deflection of the soft contacts",
        |o| Some(o.soft_depths()?.excess),
    ),
    sometimes(
        "soft_floor_m",
        "m",
        "largest static deflection of the soft contacts under the loads of the last second",
        |o| Some(o.soft_depths()?.floor),
    ),
    always(
        "residual_rms_lighter_weights",
        "1",
        "force error: distance of contact impulses from the contact law, rms, each point over weight of its lighter body × step, without the first step",
        |o| match o.lighter.count {
            0 => ratio(o.residual_rms(), o.body_unit()),
            _ => o.lighter.rms(),
        },
    ),
    always("residual_rms_scene_weights", "1", "the same over weight of the scene × step", |o| {
        ratio(o.residual_rms(), o.unit())
    }),
    always("residual_rms_body_weights", "1", "the same over mean weight of a body × step", |o| {
        ratio(o.residual_rms(), o.body_unit())
    }),
    always("residual_normal_rms", "1", "its normal part, rms, over weight of the scene × step", |o| {
        ratio(o.normal.rms(), o.unit())
    }),
    always("residual_normal_max", "1", "its normal part, largest", |o| ratio(o.normal.max(), o.unit())),
    always("residual_tangent_rms", "1", "its tangential part, rms", |o| ratio(o.tangent.rms(), o.unit())),
    always("residual_tangent_max", "1", "its tangential part, largest", |o| ratio(o.tangent.max(), o.unit())),
    always(
        "complementarity",
        "1",
        "largest violation of complementarity, over (weight × step)²/mass",
        |o| ratio(o.violation.complementarity, o.energy_unit()),
    ),
    always("cone", "1", "largest violation of the friction cone, over weight × step", |o| {
        ratio(o.violation.cone, o.unit())
    }),
    always("dissipation", "1", "largest gap to maximal dissipation, over (weight × step)²/mass", |o| {
        ratio(o.violation.dissipation, o.energy_unit())
    }),
    sometimes(
        "own_residual_rms",
        "1",
        "force error under the solver's own law, rms, over weight × substep",
        |o| o.own(Sum::rms),
    ),
    sometimes("own_residual_max", "1", "the same, largest", |o| o.own(Sum::max)),
    sometimes("joint_gap_rms_m", "m", "gap of joints, rms over all of them and all steps", |o| {
        o.joint(|j| j.gap.rms())
    }),
    sometimes("joint_gap_max_m", "m", "the same, largest", |o| o.joint(|j| j.gap.max())),
    sometimes("joint_lean_max_rad", "rad", "error of an angle that a joint holds, largest", |o| {
        o.joint(|j| j.lean_max)
    }),
    sometimes("joint_excess_max", "m or rad", "violation of a joint's limits, largest", |o| {
        o.joint(|j| j.excess_max)
    }),
    sometimes(
        "joint_residual_rms_lighter_weights",
        "1",
        "force error of joints, rms, in the weight of the lighter body × step",
        |o| o.joints.residual(Sum::rms),
    ),
    sometimes("joint_residual_max_lighter_weights", "1", "the same, largest", |o| {
        o.joints.residual(Sum::max)
    }),
    sometimes(
        "joint_motor_miss_max",
        "m/s or rad/s",
        "speed that a motor misses although its impulse is below its cap, largest",
        |o| o.joint(|j| j.motor_miss_max),
    ),
    sometimes("joint_motor_load_max", "1", "impulse of a motor ÷ its cap, largest", |o| {
        o.joint(|j| j.motor_load_max)
    }),
    sometimes(
        "joint_work",
        "1",
        "energy given by springs, motors and driven bodies through joints, relative",
        |o| o.joint(|_| 0.0).map(|_| o.balance.close().joint_work),
    ),
    sometimes("joint_spring_work", "1", "energy given by springs, relative; negative if taken", |o| {
        o.joint_work(|j| j.work[0])
    }),
    sometimes("joint_motor_work", "1", "energy given by motors, relative", |o| o.joint_work(|j| j.work[1])),
    sometimes(
        "joint_limit_work",
        "1",
        "energy given by limits, relative; negative where bodies hit them",
        |o| o.joint_work(|j| j.work[2]),
    ),
    always("momentum", "1", "momentum out of balance, relative", |o| o.balance.close().momentum),
    always("angular_momentum", "1", "angular momentum out of balance, relative", |o| {
        o.balance.close().angular_momentum
    }),
    always("energy_change", "1", "energy gained (positive) or lost over the run, relative", |o| {
        o.balance.close().energy_change
    }),
    always("energy_created", "1", "largest energy gain in one step, relative", |o| {
        o.balance.close().energy_created
    }),
    always("friction_loss", "1", "energy dissipated by friction, relative", |o| {
        o.balance.close().friction_loss
    }),
    always("impact_loss", "1", "energy dissipated by normal impulses, relative", |o| {
        o.balance.close().impact_loss
    }),
    always(
        "energy_unexplained",
        "1",
        "largest energy gain in one step that no impulse explains, relative",
        |o| o.balance.close().energy_unexplained,
    ),
    always("rest_speed_m_s", "m/s", "speed that remains, √(2 E_kin/M), rms over the last second", |o| {
        o.rest.speed()
    }),
    always("creep_m_s", "m/s", "fastest creep of a body on another over the last second", |o| {
        o.rest.creep().speed.abs()
    }),
    always("creep_half_width_m_s", "m/s", "half the width of its 95 % interval", |o| {
        o.rest.creep().half_width
    }),
    sometimes("settled_s", "s", "time at which the scene came to rest; empty if it never did", |o| {
        o.rest.settled()
    }),
];

/// The errors of a run: a value for every metric. All are finite, and zero if there is nothing to measure. A value is
/// `None` if it was not requested or has no meaning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Steps observed.
    pub steps: u64,
    /// Points within contact distance after a step, over all steps.
    pub points: u64,
    values: [Option<f64>; METRICS.len()],
}

impl Default for Errors {
    fn default() -> Self {
        let none = |m: &Metric| matches!(m.of, Formula::Always(_)).then_some(0.0);
        Errors { steps: 0, points: 0, values: std::array::from_fn(|i| none(&METRICS[i])) }
    }
}

impl Errors {
    pub(super) fn of(observation: &Observation, steps: u64, points: u64) -> Errors {
        let value = |i: usize| match METRICS[i].of {
            Formula::Always(of) => Some(of(observation)),
            Formula::Sometimes(of) => of(observation),
        };
        Errors { steps, points, values: std::array::from_fn(value) }
    }

    /// Every metric with its value.
    pub fn iter(&self) -> impl Iterator<Item = (&'static Metric, Option<f64>)> + '_ {
        METRICS.iter().zip(self.values)
    }

    /// The value of the metric of this name; `None` if the run has none, or if there is no such metric.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.iter().find(|(metric, _)| metric.name == name).and_then(|(_, value)| value)
    }

    /// These errors with another value of a metric.
    pub fn with(mut self, name: &str, value: f64) -> Errors {
        let own = METRICS.iter().zip(&mut self.values).find(|(metric, _)| metric.name == name);
        own.into_iter().for_each(|(_, old)| *old = Some(value));
        self
    }

    fn number(&self, name: &str) -> f64 {
        self.get(name).unwrap_or_default()
    }

    /// The penetration by which a run is judged (m): `held_depth_p99_m`, or, in a scene that must come to rest, the
    /// larger of it and `rest_depth_max_m`.
    pub fn penetration(&self, rests: bool) -> f64 {
        let held = self.number("held_depth_p99_m");
        if rests { held.max(self.number("rest_depth_max_m")) } else { held }
    }

    /// `penetration_max_m` (m)
    pub fn penetration_max(&self) -> f64 {
        self.number("penetration_max_m")
    }

    /// `penetration_mean_m` (m)
    pub fn penetration_mean(&self) -> f64 {
        self.number("penetration_mean_m")
    }

    /// `residual_rms_lighter_weights`, by which a run is judged.
    pub fn law_rms_lighter(&self) -> f64 {
        self.number("residual_rms_lighter_weights")
    }

    /// `residual_rms_body_weights`
    pub fn law_rms_body(&self) -> f64 {
        self.number("residual_rms_body_weights")
    }

    /// `rest_speed_m_s` (m/s)
    pub fn rest_velocity(&self) -> f64 {
        self.number("rest_speed_m_s")
    }
}

impl Serialize for Errors {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(2 + METRICS.len()))?;
        map.serialize_entry("steps", &self.steps)?;
        map.serialize_entry("points", &self.points)?;
        self.iter().try_for_each(|(metric, value)| map.serialize_entry(metric.name, &value))?;
        map.end()
    }
}

impl<'de> Deserialize<'de> for Errors {
    /// Errors: a metric that every run has is missing.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let found = BTreeMap::<String, Option<f64>>::deserialize(deserializer)?;
        let count = |name| found.get(name).copied().flatten().ok_or(Error::missing_field(name));
        let mut errors =
            Errors { steps: count("steps")? as u64, points: count("points")? as u64, ..Errors::default() };
        for (metric, value) in METRICS.iter().zip(&mut errors.values) {
            *value = found.get(metric.name).copied().flatten();
            if value.is_none() && matches!(metric.of, Formula::Always(_)) {
                return Err(Error::missing_field(metric.name));
            }
        }
        Ok(errors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_metric_is_read_back_and_none_that_every_run_has_may_be_missing() {
        let mut errors = Errors { steps: 3, points: 7, ..Errors::default() };
        for (i, metric) in METRICS.iter().enumerate() {
            errors = errors.with(metric.name, 1e-9 + i as f64 / 3.0);
        }
        let text = serde_json::to_string(&errors).unwrap();
        assert_eq!(serde_json::from_str::<Errors>(&text).unwrap(), errors);
        let named = [errors.penetration(true), errors.penetration_max(), errors.penetration_mean()];
        let others = [errors.law_rms_lighter(), errors.law_rms_body(), errors.rest_velocity()];
        assert!(named.into_iter().chain(others).all(|value| value > 0.0), "{errors:?}");
        let none = serde_json::to_string(&Errors::default()).unwrap();
        assert_eq!(serde_json::from_str::<Errors>(&none).unwrap(), Errors::default());
        let message = serde_json::from_str::<Errors>(&text.replace("\"cone\"", "\"con\"")).unwrap_err();
        assert!(message.to_string().contains("missing field `cone`"), "{message}");
    }
}
