#![doc = include_str!("README.md")]
//! # How it measures
//!
//! A phase is repeated on a frozen state ([`crate::engine::world::HeldWorld`]), in turn with loops that
//! measure the limits of memory and arithmetic units ([`ceilings`]), so a slow spell of the machine affects
//! all of them alike. Its operations are counted by running the same kernel source on a lane that counts
//! ([`crate::engine::lanes::Counted`]). Its bytes follow from the layout ([`traffic`]).
//!
//! # The roofline
//!
//! A pass of F operations that moves D bytes takes at least max(F/P, D/B), where P is the rate of
//! arithmetic and B the bandwidth of the level that holds its working set; so its rate is at most
//! min(P, I B) with the intensity I = F/D. Source: `williams2009`.

pub mod ceilings;
pub mod growth;
pub mod growth_report;
pub mod islands;
pub mod limit;
pub mod records;
pub mod roofline;
pub mod text;
pub mod traffic;
pub mod waiting;

use crate::engine::clock::Phase;
use crate::engine::constraints::Impacts;
use crate::engine::world::{HeldWorld, Probe, StepCounts};
use crate::lab::study::sample::median;
use ceilings::{Buffer, MemoryLevel, levels, multiply_adds};
use std::time::{Duration, Instant};
use traffic::Traffic;

/// Options of a profile.
#[derive(Clone, Debug)]
pub struct ProfileOptions {
    /// Phases, which take turns.
    pub phases: Vec<Phase>,
    /// Time of the whole measurement (s).
    pub seconds: f64,
    /// Whether to measure the machine's ceilings too. Without it, only the phases run.
    pub ceilings: bool,
}

/// Bandwidth of one working set (GB/s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bandwidth {
    /// Reading.
    pub read: f64,
    /// Reading and writing back; bytes of both count.
    pub update: f64,
}

impl Bandwidth {
    /// Bandwidth for traffic of this mix (bytes per nanosecond).
    ///
    /// Half of an update's bytes are written. So traffic with a fraction w of written bytes consists of a
    /// fraction 2w of updates and 1 − 2w of reads, and their times add up.
    pub fn of_mix(&self, traffic: &Traffic) -> f64 {
        let updates = (2.0 * traffic.written / traffic.total().max(1.0)).min(1.0);
        1.0 / (updates / self.update + (1.0 - updates) / self.read)
    }
}

/// Measurements of one phase.
#[derive(Clone, Debug)]
pub struct PhaseReport {
    /// The phase, with its passes in a step.
    pub probe: Probe,
    /// Traffic of one pass (bytes).
    pub traffic: Traffic,
    /// Median time of a pass (ns).
    pub pass_ns: f64,
    /// Mean time of a pass (ns).
    pub mean_ns: f64,
    /// Longest time of a pass, over pieces that were timed as a whole (ns).
    pub longest_ns: f64,
    /// Median deviation from the median (ns).
    pub spread_ns: f64,
    /// Number of timed passes.
    pub passes: u64,
    /// Bandwidth of a buffer as large as the working set.
    pub bandwidth: Option<Bandwidth>,
    /// Floating-point operations of one pass, if it works on lanes.
    pub flops: Option<f64>,
}

impl PhaseReport {
    /// Requested bytes per nanosecond (GB/s).
    pub fn bytes_rate(&self) -> f64 {
        self.traffic.total() / self.pass_ns
    }

    /// Operations per nanosecond (GFLOP/s).
    pub fn flops_rate(&self) -> Option<f64> {
        Some(self.flops? / self.pass_ns)
    }

    /// Operations per byte.
    pub fn intensity(&self) -> Option<f64> {
        Some(self.flops? / self.traffic.total()).filter(|i| i.is_finite())
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
    /// Counts of the frozen step.
    pub counts: StepCounts,
    /// Phases in the order of a step.
    pub phases: Vec<PhaseReport>,
    /// Bandwidth of each level of memory.
    pub levels: Vec<(MemoryLevel, Bandwidth)>,
    /// Rate of multiply-adds at the width of the run (GFLOP/s).
    pub multiply_adds: Option<f64>,
    /// Fraction of the time spent restoring the state between the timed repeats.
    pub reset_share: f64,
    /// Time of the measurement (s).
    pub seconds: f64,
    /// Fraction of that time in which the thread waited for a processor, if known.
    pub waiting: Option<f64>,
}

/// Repeats between two resets: few enough that the state does not drift far. A reset costs about as much as
/// one repeat.
const REPEATS: u32 = 100;
/// Time of a phase in one round.
const TURN: Duration = Duration::from_millis(50);
/// Repeats are timed in pieces of about this length, as the ceilings are. Most pieces are shorter than the
/// time slices of a busy machine, so their median contains no pause.
const PIECE: Duration = Duration::from_micros(500);
/// Time of one ceiling in one round.
const CEILING: Duration = Duration::from_micros(500);

/// Samples of one phase.
struct Entrant {
    probe: Probe,
    traffic: Traffic,
    /// Repeats in a piece.
    piece: u32,
    pass_ns: Vec<f64>,
    passes: u64,
    read: Vec<f64>,
    update: Vec<f64>,
}

/// Repeats phases in turn, and measures the ceilings between them.
///
/// Phases that are not in `probes` are left out.
pub fn profile(
    frozen: &mut HeldWorld<'_>,
    probes: &[Probe],
    scene: &str,
    options: &ProfileOptions,
) -> ProfileReport {
    let mut entrants: Vec<Entrant> = probes
        .iter()
        .filter(|probe| options.phases.contains(&probe.phase))
        .map(|&probe| Entrant {
            probe,
            traffic: traffic::of(frozen, &probe),
            piece: 1,
            pass_ns: Vec::new(),
            passes: 0,
            read: Vec::new(),
            update: Vec::new(),
        })
        .collect();
    let largest = entrants.iter().map(|e| e.traffic.working_set as usize).max().unwrap_or(0);
    let levels = if options.ceilings { levels() } else { Vec::new() };
    let mut buffer = Buffer::new(&levels, if options.ceilings { largest } else { 0 });
    let mut level_rates = vec![[Vec::new(), Vec::new()]; levels.len()];
    let mut arithmetic = Vec::new();
    let width = frozen.world().lane_width();
    let (start, mut resets, waited) = (Instant::now(), Duration::ZERO, waiting::waited());
    loop {
        for entrant in &mut entrants {
            resets += entrant.turn(frozen, options.seconds);
            if options.ceilings {
                let bytes = entrant.traffic.working_set as usize;
                entrant.read.push(buffer.read(bytes, CEILING));
                entrant.update.push(buffer.update(bytes, CEILING));
            }
        }
        if options.ceilings {
            for (level, [read, update]) in levels.iter().zip(&mut level_rates) {
                read.push(buffer.read(level.bytes, CEILING));
                update.push(buffer.update(level.bytes, CEILING));
            }
            arithmetic.push(multiply_adds(width, CEILING));
        }
        if start.elapsed().as_secs_f64() >= options.seconds {
            break;
        }
    }
    let waiting = waiting::share(waited, start.elapsed());
    let seconds = start.elapsed().as_secs_f64();
    let world = frozen.world();
    let contacts = world.counts.contacts as f64;
    let bandwidth = |read: &[f64], update: &[f64]| Bandwidth { read: median(read), update: median(update) };
    ProfileReport {
        scene: scene.to_string(),
        solver: world.settings.solver.name,
        impacts: world.settings.impacts,
        lanes: width.lanes(),
        substeps: world.settings.budget.substeps,
        bodies: world.bodies.len(),
        counts: world.counts,
        phases: entrants.iter().map(|e| e.report(contacts)).collect(),
        levels: levels
            .into_iter()
            .zip(&level_rates)
            .map(|(level, [read, update])| (level, bandwidth(read, update)))
            .collect(),
        multiply_adds: options.ceilings.then(|| median(&arithmetic)),
        reset_share: resets.as_secs_f64() / seconds.max(1e-9),
        seconds,
        waiting,
    }
}

impl Entrant {
    /// One turn of the phase; returns the time spent on resets.
    fn turn(&mut self, frozen: &mut HeldWorld<'_>, seconds: f64) -> Duration {
        let (start, mut resets) = (Instant::now(), Duration::ZERO);
        let turn = TURN.min(Duration::from_secs_f64(seconds));
        while start.elapsed() < turn {
            let mut left = REPEATS;
            while left > 0 {
                let times = self.piece.min(left);
                let begin = Instant::now();
                frozen.repeat(self.probe.phase, times);
                let elapsed = begin.elapsed();
                let passes = u64::from(times) * u64::from(self.probe.passes);
                self.pass_ns.push(elapsed.as_nanos() as f64 / passes as f64);
                self.passes += passes;
                let fit = PIECE.as_nanos() as f64 / elapsed.as_nanos().max(1) as f64;
                // The factor is limited: one pause must not make all pieces small, and a clock that stands
                // still must not make one endless.
                self.piece = (f64::from(times) * fit.clamp(0.5, 2.0)).clamp(1.0, f64::from(REPEATS)) as u32;
                left -= times;
            }
            let begin = Instant::now();
            frozen.reset(self.probe.phase);
            resets += begin.elapsed();
        }
        resets
    }

    fn report(&self, contacts: f64) -> PhaseReport {
        let pass_ns = median(&self.pass_ns);
        let deviations: Vec<f64> = self.pass_ns.iter().map(|t| (t - pass_ns).abs()).collect();
        let probe = self.probe;
        // Contacts without a color need as many operations as the others.
        let all = if probe.counted_contacts > 0 { contacts / probe.counted_contacts as f64 } else { 1.0 };
        let flops = probe.operations.map(|o| all * o.flops() as f64 / f64::from(probe.passes));
        let bandwidth = Bandwidth { read: median(&self.read), update: median(&self.update) };
        PhaseReport {
            probe,
            traffic: self.traffic,
            pass_ns,
            mean_ns: self.pass_ns.iter().sum::<f64>() / self.pass_ns.len().max(1) as f64,
            longest_ns: self.pass_ns.iter().copied().fold(0.0, f64::max),
            spread_ns: median(&deviations),
            passes: self.passes,
            bandwidth: (bandwidth.read > 0.0).then_some(bandwidth),
            flops,
        }
    }
}
