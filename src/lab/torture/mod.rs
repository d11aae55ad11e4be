//! Random scenes, drawn from families, and checks that every solver has to pass.
//!
//! Solvers are tuned on known scenes. Here [`families`] draw others, by seed. Each runs under every solver, and a
//! [`judge`] checks poses only, in double precision: it works for any [`Engine`], this crate's solvers or others.
//! Failing scenes are [minimized](minimize) into scene files.
//!
//! | verdict | failure |
//! |---|---|
//! | diverged | a speed or a position out of bounds |
//! | energy | more energy than gravity, kinematic bodies and the initial state provide, see [`judge::Ledger`] |
//! | flung | a body much faster than the scene can explain |
//! | escaped | a body past the middle of a wall around the scene |
//! | sunk | at the end, two bodies overlap by more than half the half-width of the thinner one |
//! | apart | at the end, a joint with a gap of more than a tenth of a body's reach |
//! | restless | still in motion in the last second, although nothing drives the scene |
//!
//! A step is late if it takes longer than the time that it simulates, not counting waits for a processor.
//! That depends on the machine, so it is reported but is not a failure.

pub mod families;
#[doc(hidden)]
pub mod judge;
pub mod minimize;
#[doc(hidden)]
pub mod shapes;
#[doc(hidden)]
pub mod table;

use crate::engine::clock::timed;
use crate::engine::solvers::Variant;
use crate::engine::world::{Settings, World};
use crate::lab::error::Error;
use crate::lab::scenes::Scene;
use crate::lab::study::pace::Pace;
use families::{FAMILIES, Family};
use judge::Judge;

/// A scene with its conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct TortureCase {
    /// [`Family::name`].
    pub family: &'static str,
    /// Number of the scene in its family, from 0.
    pub number: u32,
    /// The scene.
    pub scene: Scene,
    /// The walls around it.
    pub room: Room,
    /// Whether it should be at rest in its last second.
    pub rests: bool,
    /// Number of substeps, instead of the solver's own, for solvers that take several.
    pub substeps: Option<u32>,
}

/// The inside of four static walls (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Room {
    /// Lower left corner.
    pub low: [f64; 2],
    /// Upper right corner.
    pub high: [f64; 2],
    /// Thickness of the walls.
    pub wall: f64,
}

/// An engine that moves the bodies of a scene.
pub trait Engine {
    /// Advances by the scene's step. Errors: the reason, if the engine itself detects that it diverged.
    fn step(&mut self) -> Result<(), String>;
    /// Center of mass (m) and (cos θ, sin θ) of a body, by its index in the scene.
    fn pose(&self, body: usize) -> [[f64; 2]; 2];
}

/// Failures, in order of precedence.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TortureVerdict {
    /// A speed or a position out of bounds.
    Diverged,
    /// More energy than the budget, see [`judge::Ledger`].
    Energy,
    /// A body is much faster than the scene can explain.
    Flung,
    /// A body left the room.
    Escaped,
    /// Two bodies overlap by more than half the half-width of the thinner one at the end.
    Sunk,
    /// The ends of a joint are apart at the end.
    Apart,
    /// Still in motion at the end.
    Restless,
}

impl TortureVerdict {
    /// Every verdict.
    pub const ALL: [TortureVerdict; 7] = [
        TortureVerdict::Diverged,
        TortureVerdict::Energy,
        TortureVerdict::Flung,
        TortureVerdict::Escaped,
        TortureVerdict::Sunk,
        TortureVerdict::Apart,
        TortureVerdict::Restless,
    ];

    /// Word for tables.
    pub fn word(self) -> &'static str {
        ["diverged", "energy", "flung", "escaped", "sunk", "apart", "restless"][self as usize]
    }
}

/// A failure, with its step and body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Fault {
    /// Kind of failure.
    pub verdict: TortureVerdict,
    /// First step at which it occurred, from 1.
    pub step: u32,
    /// The body, if it concerns one.
    pub body: Option<usize>,
}

/// Result of a scene under a solver.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CaseOutcome {
    /// The first fault of each verdict, in the order of verdicts.
    pub faults: Vec<Fault>,
    /// Largest energy, as a fraction of the energy budget (1).
    pub energy: f64,
    /// Deepest overlap at the end, as a fraction of half the width of the thinner shape (1).
    pub depth: f64,
    /// Speed of the fastest body along its path in the last second (m/s).
    pub rest_speed: f64,
    /// Longest step (ms). It depends on the machine.
    pub slowest_ms: f64,
    /// Number of steps that took longer than the time that they simulate.
    pub late: u32,
    /// How evenly its steps are paced, if measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pace: Option<Pace>,
}

impl CaseOutcome {
    /// Whether the case has any fault.
    pub fn fails(&self) -> bool {
        !self.faults.is_empty()
    }

    /// Whether the case has a fault of this verdict.
    pub fn has(&self, verdict: TortureVerdict) -> bool {
        self.faults.iter().any(|f| f.verdict == verdict)
    }
}

/// One scene under one solver.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TortureRow {
    /// Seed of the campaign.
    pub seed: u64,
    /// [`Family::name`].
    pub family: String,
    /// Number of the scene in its family.
    pub number: u32,
    /// The solver, with options that differ from its defaults.
    pub solver: String,
    /// Its result.
    pub outcome: CaseOutcome,
}

/// The scenes of a campaign.
#[derive(Clone, Debug)]
pub struct Campaign {
    /// Seed from which all scenes are drawn.
    pub seed: u64,
    /// Families; see [`Campaign::new`].
    pub families: Vec<&'static Family>,
    /// Number of scenes over all families.
    pub scenes: u32,
}

impl Campaign {
    /// A campaign over these families, or over all of them if none are given.
    pub fn new(seed: u64, families: &[&'static Family], scenes: u32) -> Self {
        let families = if families.is_empty() { FAMILIES.iter().collect() } else { families.to_vec() };
        Campaign { seed, families, scenes }
    }

    /// Family and number of each scene, families in turn.
    pub fn list(&self) -> Vec<(&'static Family, u32)> {
        let count = self.families.len().max(1) as u32;
        let nth = |i: u32| self.families.get((i % count) as usize).map(|f| (*f, i / count));
        (0..self.scenes).filter_map(nth).collect()
    }
}

/// The family called `name`. Errors: an unknown name.
pub fn family(name: &str) -> Result<&'static Family, Error> {
    FAMILIES
        .iter()
        .find(|f| f.name == name)
        .ok_or_else(|| Error::unknown("family", name, FAMILIES.iter().map(|f| f.name)))
}

/// Runs a case to its end, or until it diverges. Errors: an invalid scene.
pub fn run(case: &TortureCase, engine: &mut dyn Engine) -> Result<CaseOutcome, Error> {
    let mut judge = Judge::new(case)?;
    let (budget, mut slowest, mut late) = (1e3 * case.scene.dt, 0.0_f64, 0);
    for _ in 0..case.scene.steps {
        let (stepped, took) = timed(|| engine.step());
        let ms = 1e3 * took.as_secs_f64();
        slowest = slowest.max(ms);
        late += u32::from(ms > budget);
        if !judge.observe(engine, stepped.is_ok()) {
            break;
        }
    }
    Ok(CaseOutcome { slowest_ms: slowest, late, ..judge.finish() })
}

/// Runs a case under one of this crate's solvers. Errors: an invalid scene.
pub fn run_solver(case: &TortureCase, settings: &Settings) -> Result<CaseOutcome, Error> {
    let mut settings = settings.clone();
    settings.budget.substeps = substeps(case, settings.solver, settings.budget.substeps);
    run(case, &mut Own(case.scene.build(settings)?))
}

/// Measures how evenly a case is paced under one of this crate's solvers. Errors: an invalid scene.
pub fn pace(case: &TortureCase, settings: &Settings, repeats: u32) -> Result<Pace, Error> {
    let mut settings = settings.clone();
    settings.budget.substeps = substeps(case, settings.solver, settings.budget.substeps);
    Pace::measure(|| case.scene.build(settings.clone()), case.scene.steps, repeats)
}

/// Number of substeps that a solver takes in a case; a solver that takes a single one by design keeps it.
pub fn substeps(case: &TortureCase, solver: &Variant, own: u32) -> u32 {
    case.substeps.filter(|_| solver.budget.substeps > 1).unwrap_or(own)
}

/// A world of this crate.
struct Own(World);

impl Engine for Own {
    fn step(&mut self) -> Result<(), String> {
        self.0.step().map_err(|d| d.to_string())
    }

    fn pose(&self, i: usize) -> [[f64; 2]; 2] {
        let rotation = self.0.bodies.pose(i).rotation.as_dvec2();
        [self.0.bodies.center(i), rotation.to_array()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;

    #[test]
    fn families_take_turns_and_numbers_grow() {
        let list = Campaign::new(1, &[&FAMILIES[0], &FAMILIES[3]], 5).list();
        let named: Vec<_> = list.iter().map(|(f, n)| (f.name, *n)).collect();
        let [a, b] = [FAMILIES[0].name, FAMILIES[3].name];
        assert_eq!(named, [(a, 0), (b, 0), (a, 1), (b, 1), (a, 2)]);
        assert!(family("dropz").unwrap_err().to_string().contains("drops"));
    }

    #[test]
    fn a_run_is_the_same_twice_and_its_rows_survive_a_file() {
        let case = FAMILIES[0].case(7, 3);
        let settings = Settings::new(find("soft_step").unwrap());
        let still = |o: CaseOutcome| CaseOutcome { slowest_ms: 0.0, late: 0, ..o };
        let [a, b] = [0, 1].map(|_| still(run_solver(&case, &settings).unwrap()));
        assert_eq!(a, b);
        let row =
            TortureRow { seed: 7, family: "drops".into(), number: 3, solver: "soft_step".into(), outcome: a };
        let text = serde_json::to_string(&row).unwrap();
        assert_eq!(serde_json::from_str::<TortureRow>(&text).unwrap(), row);
    }
}
