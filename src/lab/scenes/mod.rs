//! Scenes: file format, catalog, known values, conditions on a run, and tolerances.
//!
//! A new scene is one file here and one row in [`CATALOG`]. Ids such as A5 in the scene files are those of
//! `simpulse verify`.

mod arch;
mod bounce;
mod card_house;
mod chains;
mod check;
mod circle_pile;
pub mod class;
mod collision;
mod column;
mod compounds;
mod dominoes;
pub mod expect;
mod far;
mod format;
mod free;
mod friction_ramp;
pub mod holds;
mod import;
mod incline;
mod joints;
mod junkyard;
pub mod kind;
mod linked;
mod machines;
mod mass_ratio;
mod overlap;
mod parts;
mod pendulums;
mod pyramid;
mod ragdolls;
mod single_box;
mod sliding;
mod smash;
pub mod tolerance;
mod truth;
mod tumbler;
mod washer;

pub use check::{LENGTH_UNITS, MAX_BODIES, MAX_DT, MAX_FRICTION, MAX_STEPS, MIN_DT};
pub use expect::Measure;
pub use expect::loaded as expecting;
pub use format::{
    Capsule, Circle, DEFAULT_STEPS, Geometry, PolygonGeometry, Rectangle, Scene, SceneBody, SceneShape,
    SegmentGeometry, schema,
};
pub use joints::SceneJoint;
pub(in crate::lab) use truth::largest;
use truth::rests_on_ground;
pub use truth::{Observer, Truth};

use crate::lab::error::Error;
use expect::Expect;
use holds::Demand;
use tolerance::Tolerances;

/// Every scene of the crate, as the command line lists them.
pub static CATALOG: &[Entry] = &[
    free::FALL,
    free::SPIN,
    incline::STICK,
    incline::SLIP,
    incline::ROLL,
    incline::SLIPPING_DISC,
    sliding::STOP,
    sliding::ROLL,
    bounce::BOUNCE,
    bounce::ELASTIC,
    collision::OBLIQUE,
    single_box::DROP,
    column::DISCS,
    column::BOXES,
    column::ZIGZAG,
    column::CIRCLES,
    far::STACK,
    mass_ratio::PAIR,
    mass_ratio::TOPS,
    mass_ratio::LARGE_ON_SMALL,
    friction_ramp::RAMP,
    overlap::RECOVERY,
    pyramid::PYRAMID,
    pyramid::LARGE,
    pyramid::MANY,
    arch::ARCH,
    dominoes::DOMINOES,
    card_house::HOUSE,
    washer::WASHER,
    tumbler::TUMBLER,
    smash::SMASH,
    junkyard::JUNKYARD,
    compounds::COMPOUNDS,
    circle_pile::PILE,
    chains::BRIDGE,
    chains::BALL,
    chains::STRETCHED,
    chains::FAR,
    chains::CANTILEVER,
    chains::HANGING_CHAIN,
    pendulums::PENDULUM,
    pendulums::DOUBLE,
    pendulums::FOUR_BAR,
    pendulums::CRADLE_OF_FIVE,
    machines::VEHICLE,
    machines::CRANE,
    machines::GRID,
    machines::SPINNER,
    machines::HINGES,
    ragdolls::PILE,
    ragdolls::RAIN,
];

/// A row of [`CATALOG`].
#[derive(Debug)]
pub struct Entry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for lists.
    pub summary: &'static str,
    /// The number after the colon, for scenes that have one.
    pub size: Option<Size>,
    /// Builds the scene; the size is within its range, or 0 for scenes without one.
    pub build: fn(u32) -> Scene,
    /// Builds the scene from a size and a seed, for random scenes.
    pub seeded: Option<fn(u32, u64) -> Scene>,
    /// The known value of a scene of that size, for a run of its `steps` at its `dt`.
    pub truth: Option<fn(&Scene, u32) -> Truth>,
    /// Conditions on a run, in addition to those on every run: nothing blows up or passes through static
    /// bodies.
    pub demands: &'static [Demand],
    /// Tolerances, for the scene and its reference value (0 if none is known).
    pub tolerances: fn(&Scene, f64) -> Tolerances,
}

/// Meaning of the size of scenes in which a heavy body is on a light one.
pub const MASS_RATIO: &str = "times as heavy";

/// Size of a scene: a whole number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Default.
    pub default: u32,
    /// Minimum.
    pub min: u32,
    /// Maximum.
    pub max: u32,
    /// The quantity that it counts.
    pub meaning: &'static str,
}

impl Entry {
    const fn new(name: &'static str, summary: &'static str, build: fn(u32) -> Scene) -> Self {
        let tolerances = |scene: &Scene, _| Tolerances::standard(scene);
        Self { name, summary, size: None, build, seeded: None, truth: None, demands: &[], tolerances }
    }

    const fn sized(self, default: u32, min: u32, max: u32, meaning: &'static str) -> Self {
        Self { size: Some(Size { default, min, max, meaning }), ..self }
    }

    const fn seeded(self, seeded: fn(u32, u64) -> Scene) -> Self {
        Self { seeded: Some(seeded), ..self }
    }

    const fn known(self, truth: fn(&Scene, u32) -> Truth) -> Self {
        Self { truth: Some(truth), ..self }
    }

    /// A pile that must stand and rest, with its weight on the ground known to a percent.
    const fn pile(self) -> Self {
        self.known(|scene, _| rests_on_ground(scene))
            .holds(&[Demand::Stands, Demand::Rests])
            .within(|scene, load| Tolerances::standard(scene).percent(load))
    }

    const fn holds(self, demands: &'static [Demand]) -> Self {
        Self { demands, ..self }
    }

    const fn within(self, tolerances: fn(&Scene, f64) -> Tolerances) -> Self {
        Self { tolerances, ..self }
    }

    /// A scene of this entry, with its known value and conditions for a run of its `steps` at its `dt`.
    pub fn loaded(&self, mut scene: Scene, size: u32) -> Loaded {
        let truth = self.truth.map(|truth| truth(&scene, size));
        let mut tolerances = (self.tolerances)(&scene, truth.as_ref().map_or(0.0, |t| t.expected));
        let rests = self.demands.iter().any(|d| matches!(d, Demand::Rests));
        tolerances.rest = rests.then(|| Tolerances::resting(&scene));
        let name = if self.size.is_some() { format!("{}:{size}", self.name) } else { self.name.to_string() };
        scene.expect = Some(Expect::of(&name, self.demands, truth.as_ref(), &tolerances));
        Loaded { scene, truth, demands: self.demands.to_vec(), tolerances, unchecked: Vec::new() }
    }

    /// Parses a size.
    fn parse_size(&self, text: Option<&str>) -> Result<u32, Error> {
        let refuse = |message| Err(Error::invalid(format!("scene '{}'", self.name), message));
        match (self.size, text) {
            (None, None) => Ok(0),
            (Some(size), None) => Ok(size.default),
            (None, Some(text)) => refuse(format!("has no size, got '{text}'")),
            (Some(Size { min, max, meaning, .. }), Some(text)) => match text.parse() {
                Ok(value) if (min..=max).contains(&value) => Ok(value),
                _ => refuse(format!("size '{text}' is not a whole number from {min} to {max} ({meaning})")),
            },
        }
    }
}

/// A scene of the catalog, and what is known about it.
pub struct Loaded {
    /// The scene, ready to build.
    pub scene: Scene,
    /// Known value; `None` if there is none.
    pub truth: Option<Truth>,
    /// Conditions that a run has to meet.
    pub demands: Vec<Demand>,
    /// Limits on the errors of a run.
    pub tolerances: Tolerances,
    /// Conditions that are not checked, in words: a file may omit them.
    pub unchecked: Vec<String>,
}

impl Loaded {
    /// Whether the scene must come to rest, and therefore stand for a minute.
    pub fn rests(&self) -> bool {
        self.demands.iter().any(|d| matches!(d, Demand::Rests))
    }
}

/// A scene by its name, with its size after a colon: `arch`, `stack`, `stack:40`.
///
/// Errors: a name that is not in [`CATALOG`]; a size that is invalid or out of range.
pub fn load(name: &str) -> Result<Loaded, Error> {
    load_run(name, None, None, None)
}

/// As [`load`], with a seed for random scenes. The same seed gives the same scene; other scenes ignore the
/// seed.
pub fn load_with_seed(name: &str, seed: u64) -> Result<Loaded, Error> {
    load_run(name, Some(seed), None, None)
}

/// The row of a scene's name, and its size.
fn entry_of(name: &str) -> Result<(&'static Entry, u32), Error> {
    let (stem, size) = match name.split_once(':') {
        Some((stem, size)) => (stem, Some(size)),
        None => (name, None),
    };
    let Some(entry) = CATALOG.iter().find(|e| e.name == stem) else {
        return Err(Error::unknown("scene", stem, CATALOG.iter().map(|e| e.name)));
    };
    Ok((entry, entry.parse_size(size)?))
}

/// Whether a scene of the catalog has a random element.
pub fn is_seeded(name: &str) -> bool {
    entry_of(name).is_ok_and(|(entry, _)| entry.seeded.is_some())
}

/// As [`load`], for a run of this number of steps and step length `dt` (s), if given. The reference value is the one
/// for that run.
pub fn load_run(name: &str, seed: Option<u64>, steps: Option<u32>, dt: Option<f64>) -> Result<Loaded, Error> {
    let (entry, size) = entry_of(name)?;
    let mut scene = match (entry.seeded, seed) {
        (Some(build), Some(seed)) => build(size, seed),
        _ => (entry.build)(size),
    };
    if entry.size.is_some() {
        scene.name = format!("{}:{size}", entry.name);
    }
    (scene.steps, scene.dt) = (steps.unwrap_or(scene.steps), dt.unwrap_or(scene.dt));
    scene.validate()?;
    Ok(entry.loaded(scene, size))
}
