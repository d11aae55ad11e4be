#![doc = include_str!("README.md")]
//! # How it measures
//!
//! Whole steps are timed by phase, from the same settled state in every round, in turn with loops that
//! measure the limits of memory and arithmetic units ([`ceilings`]), so a slow spell of the machine affects
//! all of them alike. Bytes and operations of a pass follow from the layout of its records ([`model`]).
//!
//! # The roofline
//!
//! A pass of F operations that moves D bytes takes at least max(F/P, D/B), where P is the rate of
//! arithmetic and B the bandwidth of the level that holds its working set. Source: `williams2009`.

pub mod ceilings;
pub mod model;
pub mod text;
pub mod waiting;

use crate::engine::clock::Phase;
use crate::engine::constraints::Impacts;
use crate::engine::world::{StepCounts, World};
use crate::lab::error::Error;
use crate::lab::metrics::Errors;
use crate::lab::report::environment::Environment;
use crate::lab::study::sample::median;
use ceilings::{Buffer, multiply_adds};
use model::PassWork;
use serde_json::{Value, json};
use std::time::{Duration, Instant};

/// Measurements of one phase.
#[derive(Clone, Debug)]
pub struct PhaseReport {
    /// The phase.
    pub phase: Phase,
    /// Passes per step: sweeps or body passes; 1 for a phase that runs once.
    pub passes: f64,
    /// Rows solved per pass; 0 for a phase that solves none.
    pub rows: usize,
    /// Median time of a pass (ns).
    pub pass_ns: f64,
    /// Mean time of a pass (ns).
    pub mean_ns: f64,
    /// Longest time of a pass, as the mean over its step (ns).
    pub longest_ns: f64,
    /// Median deviation from the median (ns).
    pub spread_ns: f64,
    /// Bytes and operations of one pass; `None` if they are not known for this solver.
    pub work: Option<PassWork>,
    /// Read bandwidth of a buffer as large as the working set (GB/s).
    pub peak_bandwidth: Option<f64>,
}

/// A pass that reaches this fraction of a ceiling is bound by it (1).
const REACHED: f64 = 0.5;

impl PhaseReport {
    /// Fractions of the bandwidth and of the arithmetic ceiling that are reached (1).
    pub fn reached(&self, multiply_adds: Option<f64>) -> [Option<f64>; 2] {
        let rate = |amount: f64, peak: f64| amount / self.pass_ns / peak;
        [
            self.work.zip(self.peak_bandwidth).map(|(work, peak)| rate(work.bytes(), peak)),
            self.work.and_then(|work| work.flops).zip(multiply_adds).map(|(flops, peak)| rate(flops, peak)),
        ]
    }

    /// The limit of the pass in terms of the roofline; `None` if it is not known.
    pub fn limit(&self, multiply_adds: Option<f64>) -> Option<&'static str> {
        match self.reached(multiply_adds) {
            [None, _] => None,
            [Some(memory), None] if memory < REACHED => Some("not bandwidth"),
            [Some(memory), arithmetic] => match arithmetic.unwrap_or(0.0) {
                arithmetic if memory.max(arithmetic) < REACHED => Some("latency-bound"),
                arithmetic if arithmetic > memory => Some("compute-bound"),
                _ => Some("bandwidth-bound"),
            },
        }
    }
}

/// Result of a profile.
#[derive(Clone, Debug)]
pub struct ProfileReport {
    /// Scene.
    pub scene: String,
    /// Solver.
    pub solver: &'static str,
    /// Treatment of impacts.
    pub impacts: Impacts,
    /// Lanes per instruction.
    pub lanes: usize,
    /// Substeps of a step.
    pub substeps: u32,
    /// Bodies of the scene.
    pub bodies: usize,
    /// Whether the scene has constraints other than contacts, whose operations are not counted.
    pub has_joints: bool,
    /// Counts of the last step.
    pub counts: StepCounts,
    /// Phases in the order of a step.
    pub phases: Vec<PhaseReport>,
    /// Rate of multiply-adds at the width of the run (GFLOP/s).
    pub multiply_adds: Option<f64>,
    /// Number of timed steps.
    pub steps: usize,
    /// Fraction of the time in which the thread waited for a processor, if known.
    pub waiting: Option<f64>,
    /// Errors of the steps that settled the scene.
    pub errors: Option<Errors>,
}

/// Timed steps in a round. The state is restored after each, so that the scene does not move far.
const STEPS: usize = 20;
/// Time of one ceiling in one round.
const CEILING: Duration = Duration::from_micros(500);

/// Times steps of a settled world for `seconds`, and measures the `ceilings` of the machine in between.
///
/// Errors: the world diverges.
pub fn profile(start: &World, scene: &str, seconds: f64, ceilings: bool) -> Result<ProfileReport, Error> {
    let mut start = start.clone();
    start.settings.timed = true;
    let mut world = start.clone();
    let stepped = |world: &mut World| world.step().map_err(|e| Error::invalid("scene", e.to_string()));
    stepped(&mut world)?;
    let works = Phase::ALL.map(|phase| model::of(&mut world, phase));
    let sets = works.map(|work| work.map_or(0, |w| w.working_set as usize));
    let mut buffer = Buffer::new(if ceilings { *sets.iter().max().unwrap_or(&0) } else { 0 });
    let (mut times, mut peaks) = (vec![Vec::new(); Phase::ALL.len()], vec![Vec::new(); Phase::ALL.len()]);
    let mut arithmetic = Vec::new();
    let (mut laps, mut steps) = ([0; Phase::ALL.len()], 0);
    let (begin, waited) = (Instant::now(), waiting::waited());
    while steps == 0 || begin.elapsed().as_secs_f64() < seconds {
        world.clone_from(&start);
        // The first step after a copy finds cold caches.
        stepped(&mut world)?;
        for _ in 0..STEPS {
            stepped(&mut world)?;
            for (phase, times) in times.iter_mut().enumerate() {
                laps[phase] += world.timings().laps[phase];
                times.push(world.timings().phase_ns[phase] as f64);
            }
            steps += 1;
        }
        if ceilings {
            for (&set, peaks) in sets.iter().zip(&mut peaks).filter(|(set, _)| **set > 0) {
                peaks.push(buffer.read(set, CEILING));
            }
            arithmetic.push(multiply_adds(world.lane_width(), CEILING));
        }
    }
    let waiting = waiting::share(waited, begin.elapsed());
    let rows_per_point = if world.features().friction { 2 } else { 1 };
    let report = |phase: Phase| {
        let index = phase as usize;
        let passes = match phase {
            Phase::WarmStart | Phase::Solve | Phase::Relax | Phase::Position | Phase::Integrate => {
                f64::from(laps[index]) / steps as f64
            }
            // Several laps, but one run.
            _ => f64::from(laps[index].min(1)),
        };
        let pass_ns: Vec<f64> = times[index].iter().map(|time| time / passes).collect();
        let middle = median(&pass_ns);
        let deviations: Vec<f64> = pass_ns.iter().map(|t| (t - middle).abs()).collect();
        let rows = match phase {
            Phase::Solve | Phase::Relax => rows_per_point * world.counts().points,
            Phase::Position | Phase::Restitution => world.counts().points,
            _ => 0,
        };
        PhaseReport {
            phase,
            passes,
            rows,
            pass_ns: middle,
            mean_ns: pass_ns.iter().sum::<f64>() / pass_ns.len() as f64,
            longest_ns: pass_ns.iter().copied().fold(0.0, f64::max),
            spread_ns: median(&deviations),
            work: works[index],
            peak_bandwidth: Some(median(&peaks[index])).filter(|&rate| rate > 0.0),
        }
    };
    let phases = Phase::ALL.into_iter().filter(|&phase| laps[phase as usize] > 0).map(report).collect();
    Ok(ProfileReport {
        scene: scene.to_string(),
        solver: world.settings.solver.name,
        impacts: world.settings.impacts,
        lanes: world.lane_width().lanes(),
        substeps: world.settings.budget.substeps,
        bodies: world.bodies.len(),
        has_joints: !world.workspace().types.is_empty(),
        counts: *world.counts(),
        phases,
        multiply_adds: ceilings.then(|| median(&arithmetic)),
        steps,
        waiting,
        errors: None,
    })
}

/// All measurements as JSON.
pub fn json(report: &ProfileReport) -> Value {
    let phase = |p: &PhaseReport| {
        let [bandwidth, arithmetic] = p.reached(report.multiply_adds);
        json!({
            "phase": p.phase.name(), "passes_per_step": p.passes, "rows": p.rows,
            "median_pass_ns": p.pass_ns, "mean_pass_ns": p.mean_ns, "longest_pass_ns": p.longest_ns,
            "spread_pass_ns": p.spread_ns,
            "bytes_read": p.work.map(|w| w.read), "bytes_written": p.work.map(|w| w.written),
            "working_set_bytes": p.work.map(|w| w.working_set), "flops": p.work.and_then(|w| w.flops),
            "peak_gb_per_s": p.peak_bandwidth, "bandwidth_share": bandwidth, "arithmetic_share": arithmetic,
            "limit": p.limit(report.multiply_adds),
        })
    };
    json!({
        "environment": Environment::current(),
        "scene": report.scene, "solver": report.solver, "impacts": report.impacts.name(),
        "lanes": report.lanes, "substeps": report.substeps, "bodies": report.bodies,
        "contacts": report.counts.contacts, "points": report.counts.points, "colors": report.counts.colors,
        "errors": report.errors, "timed_steps": report.steps,
        "phases": report.phases.iter().map(phase).collect::<Vec<_>>(),
        "peak_gflop_per_s": report.multiply_adds, "waited_share": report.waiting,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lower_ceiling_binds_if_half_of_it_is_reached() {
        let limit = |pass_ns: f64, flops: Option<f64>| {
            let work = PassWork { read: 1000.0, written: 0.0, working_set: 1000.0, flops };
            PhaseReport {
                phase: Phase::Solve,
                passes: 1.0,
                rows: 1,
                pass_ns,
                mean_ns: pass_ns,
                longest_ns: pass_ns,
                spread_ns: 0.0,
                work: Some(work),
                // 100 ns at 10 GB/s.
                peak_bandwidth: Some(10.0),
            }
            .limit(Some(2.0))
        };
        assert_eq!(limit(170.0, Some(10.0)), Some("bandwidth-bound"));
        assert_eq!(limit(230.0, Some(10.0)), Some("latency-bound"));
        // 400 operations take 200 ns.
        assert_eq!(limit(250.0, Some(400.0)), Some("compute-bound"));
        assert_eq!(limit(900.0, None), Some("not bandwidth"));
    }
}
