//! Tolerances of a scene: limits on errors, with their reasons.
//!
//! They follow from what is visible or what no solver can avoid, not from what some solver reaches. That no
//! solver meets them is a valid result.

use super::format::Scene;
use crate::engine::bodies::{BodyDef, BodyKind};
use crate::engine::params::LINEAR_SLOP;
use crate::lab::interned::{self, Name};

/// Limit on an error in a plausible run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tolerance {
    /// The limit, in the unit of the error.
    pub value: f64,
    /// Reason for the limit.
    #[serde(deserialize_with = "interned::read")]
    pub reason: Name,
    /// Whether no solver can avoid an error of this size; the limit is then the same at every accuracy.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub fixed: bool,
}

impl Tolerance {
    /// A tolerance that shrinks with the accuracy.
    pub const fn new(value: f64, reason: &'static str) -> Self {
        Tolerance { value, reason, fixed: false }
    }

    /// The limit at this multiple of the tolerances (1), see [`Accuracy::share`].
    pub fn at(&self, share: f64) -> f64 {
        if self.fixed { self.value } else { self.value * share }
    }
}

/// Accuracy of a run. Each level is ten times as strict as the one before, in every error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Accuracy {
    /// No visible error: a centimeter for bodies of a meter.
    Plausible,
    /// A millimeter.
    Tight,
    /// A tenth of a millimeter.
    Exact,
}

impl Accuracy {
    /// Every level, loosest first.
    pub const ALL: [Accuracy; 3] = [Accuracy::Plausible, Accuracy::Tight, Accuracy::Exact];

    /// Word for tables.
    pub fn word(self) -> &'static str {
        match self {
            Accuracy::Plausible => "good enough",
            Accuracy::Tight => "10 × tighter",
            Accuracy::Exact => "100 × tighter",
        }
    }

    /// Its tolerances as a fraction of those of [`Accuracy::Plausible`] (1).
    pub fn share(self) -> f64 {
        match self {
            Accuracy::Plausible => 1.0,
            Accuracy::Tight => 0.1,
            Accuracy::Exact => 0.01,
        }
    }
}

/// The tolerances of a scene, for a plausible run.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tolerances {
    /// Penetration (m), see [`Errors::penetration`](crate::lab::metrics::Errors::penetration).
    pub penetration: Tolerance,
    /// Root mean square of the contact-law residual, as a fraction of the lighter body's weight × step (1).
    pub residual: Tolerance,
    /// Distance to the known value, in its unit; `None` if nothing is known.
    #[serde(rename = "reference")]
    pub truth: Option<Tolerance>,
    /// Speed that remains at the end (m/s); `None` if nothing must come to rest.
    #[serde(rename = "rest_speed")]
    pub rest: Option<Tolerance>,
}

/// Tolerances that override a scene's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct GivenTolerances {
    /// Penetration (m).
    pub penetration: Option<f64>,
    /// See [`Tolerances::residual`].
    pub residual: Option<f64>,
    /// Distance to the known value, in the unit of each scene.
    #[serde(rename = "reference")]
    pub truth: Option<f64>,
    /// Speed that remains at the end (m/s).
    #[serde(rename = "rest_speed")]
    pub rest: Option<f64>,
}

/// Visible overlap, relative to the size of a body (1): 1 cm at 1 m.
const SEEN: f64 = 0.01;

/// Speed that is visible at rest, in body sizes per second: half a centimeter per second at a meter, which is
/// a twelfth of a millimeter in each of sixty frames.
const SEEN_MOVING: f64 = 0.005;

/// Size of the moving bodies: the median of their mean extents (m); 1 if nothing moves.
pub fn size(scene: &Scene) -> f64 {
    let bodies = scene.body_defs().unwrap_or_default();
    let extent = |body: &BodyDef| {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for part in &body.shapes {
            let radius = f64::from(part.shape.radius());
            let mut grow = |v: glam::Vec2| {
                for (k, x) in v.to_array().into_iter().enumerate() {
                    low[k] = low[k].min(f64::from(x) - radius);
                    high[k] = high[k].max(f64::from(x) + radius);
                }
            };
            part.shape.for_each_vertex(&mut grow);
        }
        0.5 * (high[0] - low[0] + high[1] - low[1])
    };
    let mut extents: Vec<f64> = bodies.iter().filter(|b| b.kind == BodyKind::Dynamic).map(extent).collect();
    extents.sort_by(f64::total_cmp);
    extents.get(extents.len() / 2).copied().unwrap_or(1.0)
}

impl Tolerances {
    /// Tolerances for bodies that rest or slide, without a known value.
    pub fn standard(scene: &Scene) -> Self {
        Tolerances {
            penetration: Tolerance::new(SEEN * size(scene), "1 % of a body starts to be visible"),
            residual: Tolerance::new(0.1, "10 % of the lighter body's weight: loads correct to one digit"),
            truth: None,
            rest: None,
        }
    }

    /// Tolerances for a scene whose bodies hit each other.
    ///
    /// The impulse of an impact at v is v/(g Δt) times that of the weight: 60 times at 10 m/s. A residual of
    /// 1 is then a few hundredths of it. The depth at which bodies overlap before they have a contact is not
    /// a solver's error, and not part of the penetration.
    pub fn impacts(scene: &Scene) -> Self {
        let reason =
            "one body weight: impacts reach dozens of weights, so this is a few percent of an impact";
        Tolerances { residual: Tolerance::new(1.0, reason), ..Self::standard(scene) }
    }

    /// Residual speed allowed at rest.
    pub fn resting(scene: &Scene) -> Tolerance {
        Tolerance::new(SEEN_MOVING * size(scene), "0.5 % of a body per second starts to be visible")
    }

    /// The same, with this limit on the penetration (m).
    pub fn penetration(self, value: f64, reason: &'static str) -> Self {
        Self { penetration: Tolerance::new(value, reason), ..self }
    }

    /// The same, with limits that no solver can avoid: on the residual, and on the distance to the known
    /// value.
    pub fn fixed(self, residual: (f64, &'static str), truth: (f64, &'static str)) -> Self {
        let fixed = |(value, reason)| Tolerance { value, reason, fixed: true };
        Self { residual: fixed(residual), truth: Some(fixed(truth)), ..self }
    }

    /// The same, with this limit on the distance to the known value.
    pub fn truth(self, value: f64, reason: &'static str) -> Self {
        Self { truth: Some(Tolerance::new(value, reason)), ..self }
    }

    /// The same, with a hundredth of a known value of this size.
    pub fn percent(self, size: f64) -> Self {
        self.truth(0.01 * size.abs(), "1 % of the expected value")
    }

    /// The same, with a slop in each of `count` joints on top of each other.
    pub fn joints(self, count: f64) -> Self {
        self.truth(f64::from(LINEAR_SLOP) * count, "one slop per joint up to the top")
    }

    /// With the given tolerances instead of the scene's own.
    pub fn with(self, given: &GivenTolerances) -> Self {
        let or =
            |own: Tolerance, given: Option<f64>| given.map_or(own, |value| Tolerance::new(value, "given"));
        Tolerances {
            penetration: or(self.penetration, given.penetration),
            residual: or(self.residual, given.residual),
            truth: self.truth.map(|own| or(own, given.truth)),
            rest: self.rest.map(|own| or(own, given.rest)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::scenes::{SceneBody, SceneShape};

    fn scene(half: f64) -> Scene {
        let shape = SceneShape::rectangle(half, half);
        Scene::new("x", vec![SceneBody::dynamic([0.0, 0.0], shape)])
    }

    #[test]
    fn what_is_seen_grows_with_the_bodies_and_shrinks_with_the_accuracy() {
        assert_eq!((size(&scene(0.5)), size(&scene(2.0)), size(&Scene::new("x", vec![]))), (1.0, 4.0, 1.0));
        let own = Tolerances::standard(&scene(0.5)).penetration;
        let at = Accuracy::ALL.map(|a| own.at(a.share()));
        assert!(at.iter().zip([1e-2, 1e-3, 1e-4]).all(|(a, b)| (a - b).abs() < 1e-12), "{at:?}");
        let bounce = Tolerances::impacts(&scene(0.5)).fixed((2.0, "a"), (0.3, "b"));
        assert_eq!(Accuracy::ALL.map(|a| bounce.residual.at(a.share())), [2.0; 3]);
        assert!((Tolerances::resting(&scene(0.5)).value - 5e-3).abs() < 1e-12);
    }

    #[test]
    fn what_is_given_takes_the_place_of_a_scenes_own() {
        let given = GivenTolerances { penetration: Some(1e-3), truth: Some(7.0), ..Default::default() };
        let own = Tolerances::standard(&scene(0.5));
        assert_eq!(own.with(&given).penetration, Tolerance::new(1e-3, "given"));
        assert_eq!((own.with(&given).truth, own.with(&given).residual), (None, own.residual));
        assert_eq!(own.joints(20.0).with(&given).truth.map(|t| t.value), Some(7.0));
    }
}
