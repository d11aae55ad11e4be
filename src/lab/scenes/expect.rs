//! Expectations in a scene file: conditions that must hold, and known values.
//!
//! Scenes of the catalog write them with [`Scene::to_json`], so that a printed file is checked like the scene
//! that it came from. Observers of the catalog that no number describes (the twin of a far stack, the apexes
//! of a bounce) are found by its name, as long as the bodies are unchanged.

use super::Scene;
use crate::engine::bodies::BodyKind;
use crate::lab::error::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// `"expect"` of a scene file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    /// Scene of the catalog that provides the tolerances, and those observers that nothing else here
    /// describes, as long as the bodies are the same.
    #[serde(default, deserialize_with = "some", skip_serializing_if = "Option::is_none")]
    pub catalog: Option<String>,
    /// [`Demand::Rests`](super::holds::Demand::Rests)
    #[serde(default, skip_serializing_if = "is_false")]
    pub rests: bool,
    /// [`Demand::Stands`](super::holds::Demand::Stands)
    #[serde(default, skip_serializing_if = "is_false")]
    pub stands: bool,
    /// [`Demand::StaysStacked`](super::holds::Demand::StaysStacked)
    #[serde(default, skip_serializing_if = "is_false")]
    pub stays_stacked: bool,
    /// [`Demand::GainsNoEnergy`](super::holds::Demand::GainsNoEnergy)
    #[serde(default, skip_serializing_if = "is_false")]
    pub gains_no_energy: bool,
    /// [`Demand::StaysWithin`](super::holds::Demand::StaysWithin) (m)
    #[serde(default, deserialize_with = "some", skip_serializing_if = "Option::is_none")]
    pub stays_within: Option<f64>,
    /// [`Demand::Inside`](super::holds::Demand::Inside) (m)
    #[serde(default, deserialize_with = "some", skip_serializing_if = "Option::is_none")]
    pub stays_inside: Option<[[f64; 2]; 2]>,
    /// The known value.
    #[serde(default, deserialize_with = "some", skip_serializing_if = "Option::is_none")]
    pub reference: Option<KnownValue>,
}

/// A known value of the last second of a run, or of all of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KnownValue {
    /// The measured quantity.
    pub measure: Measure,
    /// The body whose height is known.
    #[serde(default, deserialize_with = "some", skip_serializing_if = "Option::is_none")]
    pub body: Option<usize>,
    /// The value, in the unit of the measure.
    pub value: f64,
    /// Largest error of a plausible run, in the same unit; > 0.
    pub tolerance: f64,
}

/// Quantities whose value a file can give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Height of a body's center over the last second (m).
    RestingHeight,
    /// Load of all static bodies over the last second (N).
    GroundLoad,
    /// Largest drop of a body's center over the run (m).
    GreatestDrop,
}

/// A key that is present needs a value: `null` is rejected.
fn some<'de, T: Deserialize<'de>, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
    T::deserialize(from).map(Some)
}

fn is_false(value: &bool) -> bool {
    !value
}

impl Expect {
    /// Rejects invalid expectations. Errors name places within `expect`.
    pub(super) fn validate(&self, scene: &Scene) -> Result<(), Error> {
        let positive = |place: &str, value: f64| match value > 0.0 && (value as f32).is_finite() {
            true => Ok(()),
            false => Err(Error::invalid(place, format!("must be positive and finite, is {value}"))),
        };
        if let Some(limit) = self.stays_within {
            positive("stays_within", limit)?;
        }
        if let Some([low, high]) = self.stays_inside
            && !(0..2)
                .all(|k| low[k] < high[k] && (low[k] as f32).is_finite() && (high[k] as f32).is_finite())
        {
            let message = format!("the first corner must be below and left of the second: {low:?}, {high:?}");
            return Err(Error::invalid("stays_inside", message));
        }
        let Some(KnownValue { measure, body, value, tolerance }) = &self.reference else { return Ok(()) };
        positive("reference.tolerance", *tolerance)?;
        if !(*value as f32).is_finite() {
            return Err(Error::invalid("reference.value", format!("must be finite, is {value}")));
        }
        let is_dynamic = |i: &usize| scene.bodies.get(*i).is_some_and(|body| body.kind == BodyKind::Dynamic);
        match (measure, body) {
            (Measure::RestingHeight, Some(i)) if is_dynamic(i) => Ok(()),
            (Measure::RestingHeight, Some(i)) => {
                Err(Error::invalid("reference.body", format!("{i} is not a dynamic body of the scene")))
            }
            (Measure::RestingHeight, None) => {
                Err(Error::invalid("reference.body", "missing: the bodies whose height is known"))
            }
            (_, Some(i)) => {
                Err(Error::invalid("reference.body", format!("{i}, but the measure concerns no body")))
            }
            (_, None) => Ok(()),
        }
    }
}
