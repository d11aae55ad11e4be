//! `study.json` as far as the page needs it.

use crate::lab::units::lanes;
use serde::Deserialize;
use serde_json::Value;

/// A study as it was written.
#[derive(Debug, Deserialize)]
pub struct Study {
    /// Machine and compiler.
    pub environment: Environment,
    /// What was asked for.
    pub settings: Value,
    /// One per scene, solver, budget, order and width, scene by scene.
    pub records: Vec<Entry>,
    /// Which settings to use, by scene.
    #[serde(default)]
    pub answers: Vec<Verdict>,
    /// Solvers over all scenes, the best first.
    #[serde(default)]
    pub ranking: Vec<Standing>,
    /// Performance profiles, one per error.
    #[serde(default)]
    pub profiles: Vec<Profile>,
}

/// See [`crate::lab::report::environment::Environment`].
#[derive(Debug, Deserialize)]
pub struct Environment {
    pub cpu: String,
    pub processors: usize,
    pub compiler: String,
    pub architecture: String,
    pub system: String,
    pub target_features: Vec<String>,
    pub native_lanes: usize,
    pub version: String,
}

/// A [`crate::lab::study::Record`].
#[derive(Debug, Deserialize)]
pub struct Entry {
    pub scene: String,
    pub bodies: usize,
    pub solver: String,
    pub order: String,
    pub lanes: usize,
    pub budget: Value,
    pub budget_text: String,
    pub lap: Option<Lap>,
    pub speed_up: Option<f64>,
    pub errors: Option<Errors>,
    pub truth: Option<Truth>,
    pub tolerances: Tolerances,
    pub broken: Option<Broken>,
    pub failure: Option<Failure>,
    pub front: Fronts,
}

#[derive(Debug, Deserialize)]
pub struct Lap {
    pub median_ns: f64,
    pub quartiles_ns: [f64; 2],
    pub phase_ns: Vec<f64>,
    pub load: Load,
}

#[derive(Debug, Deserialize)]
pub struct Load {
    pub sweeps: f64,
    pub colors: usize,
    pub occupancy: f64,
}

#[derive(Debug, Deserialize)]
pub struct Errors {
    pub penetration_max: f64,
    pub law_rms_body: f64,
}

#[derive(Debug, Deserialize)]
pub struct Truth {
    pub quantity: String,
    pub unit: String,
    pub error: Option<f64>,
}

#[derive(Debug, Deserialize)]
pub struct Tolerances {
    pub penetration: Tolerance,
    pub residual: Tolerance,
    pub truth: Option<Tolerance>,
}

#[derive(Debug, Deserialize)]
pub struct Tolerance {
    pub value: f64,
}

#[derive(Debug, Deserialize)]
pub struct Broken {
    pub mark: String,
    pub step: u64,
}

#[derive(Debug, Deserialize)]
pub struct Failure {
    pub step: u64,
}

#[derive(Debug, Deserialize)]
pub struct Fronts {
    pub penetration: bool,
    pub law: bool,
    pub truth: bool,
}

/// An [`crate::lab::study::answer::Answer`], as places in the list of records.
#[derive(Debug, Deserialize)]
pub struct Verdict {
    pub scene: String,
    /// The cheapest that holds within tolerance.
    pub best: Option<usize>,
    /// The nearest that is not within tolerance.
    pub nearest: Option<usize>,
    /// Other solvers that tie with the cheapest.
    pub tied: Vec<String>,
    /// The cheapest of another solver.
    pub runner_up: Option<usize>,
    /// Its time in times that of the cheapest.
    pub slower: Option<f64>,
}

/// A [`crate::lab::study::ranking::Standing`].
#[derive(Debug, Deserialize)]
pub struct Standing {
    pub solver: String,
    pub score: f64,
    pub holds: usize,
    pub good: usize,
    pub fastest: usize,
    pub close: usize,
}

/// See [`crate::lab::study::profile::Profile`].
#[derive(Debug, Deserialize)]
pub struct Profile {
    pub error: String,
    pub scenes: usize,
    pub ratios: Vec<(String, Vec<f64>)>,
}

/// One of the three errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    Penetration,
    Residual,
    Truth,
}

/// Errors below this are drawn as this: a logarithm has no zero.
pub const FLOOR: f64 = 1e-8;

impl Axis {
    pub const ALL: [Axis; 3] = [Axis::Penetration, Axis::Residual, Axis::Truth];
}

impl Entry {
    /// Time of a step (s).
    pub fn time(&self) -> Option<f64> {
        self.lap.as_ref().map(|lap| 1e-9 * lap.median_ns)
    }

    /// An error in its unit.
    pub fn error(&self, axis: Axis) -> Option<f64> {
        match axis {
            Axis::Penetration => self.errors.as_ref().map(|e| e.penetration_max),
            Axis::Residual => self.errors.as_ref().map(|e| e.law_rms_body),
            Axis::Truth => self.truth.as_ref()?.error,
        }
    }

    /// The most that it may be.
    pub fn tolerance(&self, axis: Axis) -> Option<f64> {
        match axis {
            Axis::Penetration => Some(self.tolerances.penetration.value),
            Axis::Residual => Some(self.tolerances.residual.value),
            Axis::Truth => self.tolerances.truth.as_ref().map(|t| t.value),
        }
    }

    pub fn on_front(&self, axis: Axis) -> bool {
        match axis {
            Axis::Penetration => self.front.penetration,
            Axis::Residual => self.front.law,
            Axis::Truth => self.front.truth,
        }
    }

    /// What went wrong, and when; none if the run holds.
    pub fn broke(&self) -> Option<String> {
        let broken = self.broken.as_ref().map(|b| format!("{} at step {}", b.mark.replace('_', " "), b.step));
        broken.or_else(|| self.failure.as_ref().map(|f| format!("blew up at step {}", f.step)))
    }

    pub fn is_natural(&self) -> bool {
        self.order == "natural"
    }

    /// The largest of its errors in their tolerances; none if it does not hold, or missed its truth.
    pub fn excess(&self) -> Option<f64> {
        if self.broke().is_some() {
            return None;
        }
        let mut worst = 0.0_f64;
        for axis in Axis::ALL {
            let judged = axis != Axis::Truth || (self.truth.is_some() && self.tolerances.truth.is_some());
            if judged {
                worst = worst.max(self.error(axis)? / self.tolerance(axis)?.max(f64::MIN_POSITIVE));
            }
        }
        Some(worst)
    }

    /// Budget and order or width in words.
    pub fn setting(&self) -> String {
        match self.is_natural() {
            true => format!("{}, natural order", self.budget_text),
            false => format!("{}, {}", self.budget_text, lanes(self.lanes)),
        }
    }

    /// Where a point is: budget and width in few letters.
    pub fn label(&self) -> String {
        let numbers: Vec<&str> = self.budget_text.split(' ').filter(|w| w.parse::<u32>().is_ok()).collect();
        let width = if self.is_natural() { "nat".into() } else { self.lanes.to_string() };
        format!("{}@{width}", numbers.join("·"))
    }

    pub fn same_setting(&self, other: &Entry) -> bool {
        (&self.scene, &self.solver, &self.order) == (&other.scene, &other.solver, &other.order)
            && self.budget == other.budget
    }
}

impl Study {
    /// The records of each scene.
    pub fn scenes(&self) -> Vec<&[Entry]> {
        self.records.chunk_by(|a, b| a.scene == b.scene).collect()
    }

    /// Names of solvers in the order in which they ran.
    pub fn solvers(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for record in &self.records {
            if !names.contains(&record.solver.as_str()) {
                names.push(&record.solver);
            }
        }
        names
    }
}

/// Every setting of a scene at its fastest width; those that failed, at any.
pub fn fastest(scene: &[Entry]) -> Vec<&Entry> {
    let mut kept: Vec<&Entry> = Vec::new();
    for entry in scene {
        match kept.iter_mut().find(|k| k.same_setting(entry)) {
            Some(other) => {
                if entry.time().unwrap_or(f64::INFINITY) < other.time().unwrap_or(f64::INFINITY) {
                    *other = entry;
                }
            }
            None => kept.push(entry),
        }
    }
    kept
}

/// Of each solver the setting in the middle of its budgets, coloured where there is such a run.
pub fn standard<'a>(scene: &'a [Entry], solver: &str) -> Option<&'a Entry> {
    let own: Vec<&Entry> = fastest(scene).into_iter().filter(|e| e.solver == solver).collect();
    let colored: Vec<&Entry> = own.iter().copied().filter(|e| !e.is_natural()).collect();
    let own = if colored.is_empty() { own } else { colored };
    own.get(own.len() / 2).copied()
}
