//! How wrong a run of a scene may be: limits with their reasons, written down with the scene.
//!
//! They say what would be noticed, or what no solver can avoid, and not what some solver reaches: it
//! is an answer, too, that none of those tried does.

use super::format::Scene;
use crate::engine::params::LINEAR_SLOP;
use crate::lab::interned::{self, Name};

/// The most that an error may be.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tolerance {
    /// In the unit of the error.
    pub value: f64,
    /// Why this much.
    #[serde(deserialize_with = "interned::read")]
    pub reason: Name,
}

/// The tolerances of a scene.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Tolerances {
    /// Deepest penetration (m).
    pub penetration: Tolerance,
    /// Contact-law residual, root mean square, in the mean weight of a body × step (1).
    pub residual: Tolerance,
    /// Distance to what is known about the scene, in its unit; none where nothing is known.
    pub truth: Option<Tolerance>,
}

/// Tolerances that take the place of a scene's own.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct GivenTolerances {
    /// m
    pub penetration: Option<f64>,
    /// See [`Tolerances::residual`].
    pub residual: Option<f64>,
    /// In the unit of each scene's truth.
    pub truth: Option<f64>,
}

/// Two slops (m): what solvers leave alone, and as much again.
const SEEN: f64 = 2.0 * LINEAR_SLOP as f64;

impl Tolerances {
    /// Those of bodies of about a metre that rest or slide; nothing is known.
    pub fn standard() -> Self {
        Tolerances {
            penetration: Tolerance {
                value: SEEN,
                reason: "two slops: solvers leave one alone, and a hundredth of a metre begins to be seen",
            },
            residual: Tolerance {
                value: 0.1,
                reason: "a tenth of what carries a body: loads are good to a digit",
            },
            truth: None,
        }
    }

    /// Those of a scene whose bodies fall by up to `height` (m) before they hit something.
    ///
    /// Without continuous collision a contact that is not known before a step is met somewhere on
    /// the way of that step, √(2 g H) Δt. The impulse of an impact at v is v/(g Δt) times that of
    /// the weight, 60 times at 10 m/s: a residual of 1 is some hundredths of it.
    pub fn impacts(scene: &Scene, height: f64) -> Self {
        let gravity = scene.gravity[0].hypot(scene.gravity[1]);
        Self::fast(scene, (2.0 * gravity * height).sqrt())
    }

    /// The same of a scene whose bodies hit each other at up to `speed` (m/s).
    pub fn fast(scene: &Scene, speed: f64) -> Self {
        Tolerances {
            penetration: Tolerance {
                value: SEEN + speed * scene.dt,
                reason: "two slops, and the way of the fastest body in a step: nothing sees its contact sooner",
            },
            residual: Tolerance {
                value: 1.0,
                reason: "the weight of a body: impacts take dozens of it, so some hundredths of an impact",
            },
            truth: None,
        }
    }

    /// The same, with this for the deepest penetration (m).
    pub fn penetration(self, value: f64, reason: &'static str) -> Self {
        Self { penetration: Tolerance { value, reason }, ..self }
    }

    /// The same, with this for the residual.
    pub fn residual(self, value: f64, reason: &'static str) -> Self {
        Self { residual: Tolerance { value, reason }, ..self }
    }

    /// The same, with this for what is known.
    pub fn truth(self, value: f64, reason: &'static str) -> Self {
        Self { truth: Some(Tolerance { value, reason }), ..self }
    }

    /// A hundredth of a truth of this size.
    pub fn percent(self, size: f64) -> Self {
        self.truth(0.01 * size.abs(), "a hundredth of what it should be")
    }

    /// A slop in each of so many joints on top of each other.
    pub fn joints(self, count: f64) -> Self {
        self.truth(f64::from(LINEAR_SLOP) * count, "a slop in every joint up to the top")
    }

    /// With those that are given in the place of the scene's own.
    pub fn with(self, given: &GivenTolerances) -> Self {
        let or = |own: Tolerance, given: Option<f64>| {
            given.map_or(own, |value| Tolerance { value, reason: "given" })
        };
        Tolerances {
            penetration: or(self.penetration, given.penetration),
            residual: or(self.residual, given.residual),
            truth: self.truth.map(|own| or(own, given.truth)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impacts_allow_the_way_of_a_step() {
        let scene = Scene::new("x", Vec::new());
        // 20 m under 10 m/s²: 20 m/s, a third of a metre in 1/60 s.
        let t = Tolerances::impacts(&scene, 20.0);
        assert!((t.penetration.value - (0.01 + 20.0 / 60.0)).abs() < 1e-8, "{t:?}");
        assert_eq!(t.truth, None);
    }

    #[test]
    fn what_is_given_takes_the_place_of_a_scenes_own() {
        let given = GivenTolerances { penetration: Some(1e-3), truth: Some(7.0), ..Default::default() };
        let own = Tolerances::standard();
        assert_eq!(own.with(&given).penetration, Tolerance { value: 1e-3, reason: "given" });
        assert_eq!((own.with(&given).truth, own.with(&given).residual), (None, own.residual));
        assert_eq!(own.joints(20.0).with(&given).truth.map(|t| t.value), Some(7.0));
    }
}
