//! The scene of a session, and changes to it.

use crate::lab::error::Error;
use crate::lab::scenes::{self, CATALOG, Loaded, Size};
use crate::lab::study::{is_path, open_scene};
use serde::Deserialize;

/// Range of the factor on friction (1).
pub(super) const FRICTION: [f64; 2] = [0.0, 3.0];
/// Greatest gravity (m/s²).
pub(super) const GRAVITY: f64 = 100.0;

/// A scene by name or file, and what was changed in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Name of a scene of the catalog, or a file.
    pub name: String,
    /// Seed of scenes that have one.
    pub seed: Option<u64>,
    /// Steps of a run, if not those of the scene.
    pub steps: Option<u32>,
    /// Step (s), if not that of the scene.
    pub dt: Option<f64>,
    /// Factor on all friction coefficients (1).
    pub friction: f64,
    /// Downward gravity (m/s²), if not that of the scene.
    pub gravity: Option<f64>,
}

/// A change of the scene; what is `None` stays.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Change {
    /// Size of the scene, such as the number of boxes or a ratio of masses.
    pub size: Option<u32>,
    /// Seed.
    pub seed: Option<u64>,
    /// Factor on all friction coefficients (1).
    pub friction: Option<f64>,
    /// Downward gravity (m/s²).
    pub gravity: Option<f64>,
}

impl Source {
    /// An unchanged scene.
    pub fn named(name: &str) -> Self {
        Source { name: name.into(), seed: None, steps: None, dt: None, friction: 1.0, gravity: None }
    }

    /// The source with a change.
    pub(super) fn changed(&self, change: &Change) -> Self {
        let stem = self.name.split(':').next().unwrap_or_default();
        Source {
            name: change.size.map_or(self.name.clone(), |size| format!("{stem}:{size}")),
            seed: change.seed.or(self.seed),
            friction: change.friction.unwrap_or(self.friction),
            gravity: change.gravity.or(self.gravity),
            ..self.clone()
        }
    }

    /// Whether the scene differs from the one that its name stands for.
    pub(super) fn is_changed(&self) -> bool {
        self.friction != 1.0 || self.gravity.is_some()
    }

    /// The size of the scene's row in the catalog, and whether it has a seed; none for files.
    pub(super) fn entry(&self) -> (Option<Size>, bool) {
        let stem = self.name.split(':').next().unwrap_or_default();
        let entry = CATALOG.iter().find(|e| e.name == stem).filter(|_| !is_path(&self.name));
        entry.map_or((None, false), |e| (e.size, e.seeded.is_some()))
    }

    /// Opens the scene. A changed one has no reference value. Errors: a scene that cannot be read; a change out of
    /// range.
    pub(super) fn open(&self) -> Result<Loaded, Error> {
        let loaded = open_scene(&self.name, self.seed, self.steps, self.dt)?;
        if !self.is_changed() {
            return Ok(loaded);
        }
        let [low, high] = FRICTION;
        if !(low..=high).contains(&self.friction) {
            return Err(Error::invalid(
                "friction",
                format!("{} is not within {low} to {high}", self.friction),
            ));
        }
        let mut scene = loaded.scene;
        if let Some(gravity) = self.gravity {
            if !(-GRAVITY..=GRAVITY).contains(&gravity) {
                let message = format!("{gravity} is not within −{GRAVITY} to {GRAVITY} m/s²");
                return Err(Error::invalid("gravity", message));
            }
            scene.gravity = [0.0, -gravity];
        }
        let shapes = scene.bodies.iter_mut().flat_map(|body| &mut body.shapes);
        shapes.for_each(|shape| shape.friction *= self.friction);
        scene.validate()?;
        // Such a file is judged by its conditions alone.
        scenes::expecting(scene)
    }
}
