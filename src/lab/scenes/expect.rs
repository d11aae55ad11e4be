//! Expectations in a scene file: conditions that must hold, and known values.
//!
//! Scenes of the catalog write them with [`Scene::to_json`], so that a printed file is checked like the scene
//! that it came from. Observers of the catalog that no number describes (the twin of a far stack, the apexes
//! of a bounce) are found by its name, as long as the bodies are unchanged.

use super::check::{finite, finite_pair, positive};
use super::holds::Demand;
use super::tolerance::Tolerances;
use super::truth::{Truth, greatest_drop, load_on_ground, rests_at};
use super::{Entry, Loaded, Scene, entry_of, load};
use crate::engine::bodies::BodyKind;
use crate::lab::error::Error;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `"expect"` of a scene file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    /// Scene of the catalog that provides the tolerances, and those observers that nothing else here
    /// describes, as long as the bodies are the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub catalog: Option<String>,
    /// Moving bodies come to rest, and the scene stands for a minute, see [`Demand::Rests`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rests: bool,
    /// Bodies that touch at the start stay together, see [`Demand::Stands`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stands: bool,
    /// The bodies end up one above the other, in their order, see [`Demand::StaysStacked`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub stays_stacked: bool,
    /// The energy never exceeds that of the start, see [`Demand::GainsNoEnergy`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub gains_no_energy: bool,
    /// No body moves farther from its start (m), see [`Demand::StaysWithin`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stays_within: Option<f64>,
    /// No center leaves the box between these corners (m), see [`Demand::Inside`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stays_inside: Option<[[f64; 2]; 2]>,
    /// The known value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference: Option<KnownValue>,
}

/// A known value of the last second of a run, or of all of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownValue {
    /// The measured quantity.
    pub measure: Measure,
    /// The body whose height is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<usize>,
    /// The value, in the unit of the measure.
    pub value: f64,
    /// Largest error of a plausible run, in the same unit; > 0.
    pub tolerance: f64,
}

/// Quantities whose value a file can give.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Measure {
    /// Height of a body's center over the last second (m).
    RestingHeight,
    /// Load of all static bodies over the last second (N).
    GroundLoad,
    /// Largest drop of a body's center over the run (m).
    GreatestDrop,
}

impl Expect {
    /// Rejects invalid expectations. Errors name places within `expect`.
    pub(super) fn validate(&self, scene: &Scene) -> Result<(), Error> {
        self.stays_within.map_or(Ok(()), |limit| positive("stays_within", limit))?;
        if let Some([low, high]) = self.stays_inside {
            [low, high].into_iter().try_for_each(|corner| finite_pair("stays_inside", corner))?;
            Error::require((0..2).all(|k| low[k] < high[k]), "stays_inside", || {
                format!("the first corner must be below and left of the second: {low:?}, {high:?}")
            })?;
        }
        let Some(KnownValue { measure, body, value, tolerance }) = &self.reference else { return Ok(()) };
        positive("reference.tolerance", *tolerance)?;
        finite("reference.value", *value)?;
        let is_dynamic = |i: &usize| scene.bodies.get(*i).is_some_and(|body| body.kind == BodyKind::Dynamic);
        let wrong = match (measure, body) {
            (Measure::RestingHeight, None) => "missing: the bodies whose height is known".to_string(),
            (Measure::RestingHeight, Some(i)) if !is_dynamic(i) => {
                format!("{i} is not a dynamic body of the scene")
            }
            (Measure::GroundLoad | Measure::GreatestDrop, Some(i)) => {
                format!("{i}, but the measure concerns no body")
            }
            _ => return Ok(()),
        };
        Err(Error::invalid("reference.body", wrong))
    }

    /// Expectations of a scene of the catalog.
    pub(super) fn of(name: &str, demands: &[Demand], truth: Option<&Truth>, tolerances: &Tolerances) -> Self {
        let mut expect = Expect { catalog: Some(name.to_string()), ..Expect::default() };
        for demand in demands {
            match demand {
                Demand::Rests => expect.rests = true,
                Demand::Stands => expect.stands = true,
                Demand::StaysStacked => expect.stays_stacked = true,
                Demand::GainsNoEnergy => expect.gains_no_energy = true,
                Demand::StaysWithin(limit) => expect.stays_within = Some(*limit),
                Demand::Inside(corners) => expect.stays_inside = Some(*corners),
                // Restored by the name of the scene.
                Demand::Contains(_) => {}
            }
        }
        let known = truth.and_then(|t| Some((t, t.measure?)));
        expect.reference = known.map(|(truth, (measure, body))| KnownValue {
            measure,
            body,
            value: truth.expected,
            tolerance: tolerances.truth.map_or(f64::MAX, |t| t.value),
        });
        expect
    }

    /// The conditions, except those that depend on the name of the scene.
    fn demands(&self) -> Vec<Demand> {
        [
            self.stands.then_some(Demand::Stands),
            self.stays_stacked.then_some(Demand::StaysStacked),
            self.stays_within.map(Demand::StaysWithin),
            self.stays_inside.map(Demand::Inside),
            self.rests.then_some(Demand::Rests),
            self.gains_no_energy.then_some(Demand::GainsNoEnergy),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

impl KnownValue {
    fn truth(&self, scene: &Scene) -> Truth {
        match self.measure {
            Measure::RestingHeight => rests_at(scene, self.body.unwrap_or(0), self.value),
            Measure::GroundLoad => load_on_ground(scene, self.value),
            Measure::GreatestDrop => greatest_drop(scene, self.value),
        }
    }
}

/// A scene of a file, with its expectations on a run.
///
/// Errors: an unknown scene of the catalog.
pub fn loaded(scene: Scene) -> Result<Loaded, Error> {
    let left_out = scene.left_out.clone();
    let mut loaded = expected(scene)?;
    loaded.unchecked.extend(left_out.into_iter().map(|what| format!("{what}: left out of the file")));
    Ok(loaded)
}

fn expected(scene: Scene) -> Result<Loaded, Error> {
    let Some(expect) = scene.expect.clone() else {
        let tolerances = Tolerances::standard(&scene);
        let nothing = "conditions and reference values: the file has none (expect)".to_string();
        return Ok(Loaded { scene, truth: None, demands: Vec::new(), tolerances, unchecked: vec![nothing] });
    };
    let mut unchecked = Vec::new();
    let mut demands = expect.demands();
    let mut truth = None;
    let mut tolerances = Tolerances::standard(&scene);
    if let Some(name) = &expect.catalog {
        let (entry, size) = entry_of(name)?;
        let twin = load(name)?.scene;
        if (&twin.bodies, &twin.joints, twin.gravity) == (&scene.bodies, &scene.joints, scene.gravity) {
            let own = entry.loaded(scene.clone(), size);
            demands.extend(own.demands.into_iter().filter(|d| matches!(d, Demand::Contains(_))));
            (truth, tolerances) = (own.truth, own.tolerances);
        } else {
            unchecked.extend(lost(entry, &expect, name));
        }
    }
    if let Some(reference) = &expect.reference {
        truth = Some(reference.truth(&scene));
        tolerances = tolerances.truth(reference.tolerance, "of the scene file");
    } else if truth.is_none() {
        unchecked.push("a reference value: the file has none".to_string());
    }
    if demands.is_empty() && expect.catalog.is_none() {
        unchecked
            .push("whether it stands, rests or stays inside: the file has no such condition".to_string());
    }
    tolerances.rest = expect.rests.then(|| Tolerances::resting(&scene));
    Ok(Loaded { scene, truth, demands, tolerances, unchecked })
}

/// Expectations that are lost because the bodies differ from the catalog's.
fn lost(entry: &Entry, expect: &Expect, name: &str) -> Option<String> {
    let by_name = entry.demands.iter().any(|d| matches!(d, Demand::Contains(_)));
    let value = entry.truth.is_some() && expect.reference.is_none();
    let what = match (by_name, value) {
        (false, false) => return None,
        (true, false) => "whether bodies get out",
        (false, true) => "the reference value",
        (true, true) => "whether bodies get out, and the reference value",
    };
    Some(format!("{what} of the catalog's {name}: the bodies are others"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::CATALOG;

    #[test]
    fn a_scene_that_was_printed_is_checked_as_its_own() {
        for entry in CATALOG {
            let size = entry.size.map_or(String::new(), |s| format!(":{}", s.min));
            let own = load(&format!("{}{size}", entry.name)).unwrap();
            let text = own.scene.to_json();
            let read = loaded(Scene::from_json(&text, "x.json".as_ref()).unwrap()).unwrap();
            let name = |l: &Loaded| l.truth.as_ref().map(|t| (t.quantity, t.expected, t.unit));
            assert_eq!(name(&read), name(&own), "{}", entry.name);
            let limits = |l: &Loaded| {
                let t = l.tolerances;
                [Some(t.penetration), Some(t.residual), t.truth, t.rest].map(|t| t.map(|t| t.value))
            };
            assert_eq!(limits(&read), limits(&own), "{}", entry.name);
            let words = |l: &Loaded| {
                let mut words: Vec<String> = l.demands.iter().map(Demand::meaning).collect();
                words.sort();
                words
            };
            assert_eq!(words(&read), words(&own), "{}", entry.name);
            assert!(own.unchecked.is_empty());
            assert_eq!(
                read.unchecked.is_empty(),
                own.truth.is_some(),
                "{}: {:?}",
                entry.name,
                read.unchecked
            );
        }
    }

    #[test]
    fn what_an_edited_file_cannot_check_is_said() {
        let read = |name: &str, change: fn(&mut Scene)| {
            let mut scene = load(name).unwrap().scene;
            change(&mut scene);
            loaded(Scene::from_json(&scene.to_json(), "x.json".as_ref()).unwrap()).unwrap()
        };
        // A height is a number in the file and is still checked; the apexes of a bounce depend on its bodies.
        let heavier = |scene: &mut Scene| scene.bodies[1].shapes[0].density = 7.0;
        let stack = read("stack:3", heavier);
        assert!(stack.truth.is_some() && stack.unchecked.is_empty() && stack.demands.len() == 2);
        let bounce = read("bounce", heavier);
        assert!(bounce.truth.is_none() && bounce.unchecked[0].contains("reference value"));
        let nothing = read("stack:3", |scene| scene.expect = None);
        assert!(nothing.demands.is_empty() && nothing.unchecked[0].contains("expect"));
    }
}
