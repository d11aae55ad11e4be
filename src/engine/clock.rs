//! Phases of a step and the time each takes.

use std::time::{Duration, Instant};

/// Phases of a step; [`Timings`] has one time for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Phase {
    /// Bounds and broad phase.
    Pairs,
    /// Narrow phase and impulse matching.
    Collide,
    /// Coloring and lane assignment.
    Color,
    /// Constraint preparation.
    Prepare,
    /// Warm starting.
    WarmStart,
    /// Velocity sweeps with position feedback.
    Solve,
    /// Velocity sweeps without position feedback.
    Relax,
    /// Position sweeps.
    Position,
    /// Restitution.
    Restitution,
    /// Body integration.
    Integrate,
    /// Write-back of impulses and poses.
    Store,
}

impl Phase {
    /// Every phase, in the order of a step.
    pub const ALL: [Phase; 11] = [
        Phase::Pairs,
        Phase::Collide,
        Phase::Color,
        Phase::Prepare,
        Phase::WarmStart,
        Phase::Solve,
        Phase::Relax,
        Phase::Position,
        Phase::Restitution,
        Phase::Integrate,
        Phase::Store,
    ];

    /// Name for tables.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Pairs => "pairs",
            Phase::Collide => "collide",
            Phase::Color => "color",
            Phase::Prepare => "prepare",
            Phase::WarmStart => "warm start",
            Phase::Solve => "solve",
            Phase::Relax => "relax",
            Phase::Position => "position",
            Phase::Restitution => "restitution",
            Phase::Integrate => "integrate",
            Phase::Store => "store",
        }
    }

    /// Whether the phase is a sweep that solves constraint rows.
    pub fn is_sweep(self) -> bool {
        matches!(self, Phase::Solve | Phase::Relax | Phase::Position | Phase::Restitution)
    }
}

/// Time of each phase of the last step, and of the whole step.
///
/// ```
/// use simpulse_engine::clock::Phase;
/// # use simpulse_engine::prelude::*;
/// let mut world = World::new(Settings { timed: true, ..Settings::new(solvers::PGS) });
/// world.add_body(&BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::circle(0.5)?))?;
/// world.step()?;
/// for phase in Phase::ALL {
///     println!("{:<12} {} ns", phase.name(), world.timings().phase_ns[phase as usize]);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
#[non_exhaustive]
pub struct Timings {
    /// Nanoseconds per phase, indexed by `Phase as usize`.
    pub phase_ns: [u64; Phase::ALL.len()],
    /// Timed pieces per phase: passes over constraints or bodies. Indexed by `Phase as usize`.
    pub laps: [u32; Phase::ALL.len()],
    /// Nanoseconds of the whole step.
    pub step_ns: u64,
}

impl Timings {
    /// Nanoseconds of all sweeps.
    pub fn sweep_ns(&self) -> u64 {
        Phase::ALL.iter().filter(|p| p.is_sweep()).map(|&p| self.phase_ns[p as usize]).sum()
    }
}

/// Stopwatch of a step: each lap adds the time since the last one to a phase. A clock that is off counts laps
/// without reading the time.
#[derive(Debug)]
#[doc(hidden)]
pub struct Clock {
    timings: Timings,
    start: Option<(Instant, Instant)>,
}

impl Clock {
    /// Starts a step; `on`: times are measured.
    pub fn start(on: bool) -> Self {
        let start = on.then(|| {
            let now = Instant::now();
            (now, now)
        });
        Clock { timings: Timings::default(), start }
    }

    /// Adds the time since the last lap to `phase`.
    #[inline]
    pub fn lap(&mut self, phase: Phase) {
        if let Some((_, last)) = &mut self.start {
            let now = Instant::now();
            self.timings.phase_ns[phase as usize] += (now - *last).as_nanos() as u64;
            *last = now;
        }
        self.timings.laps[phase as usize] += 1;
    }

    /// Divides the time since the last lap among phases as `parts` have taken it, which ran one after the other or at the same
    /// time.
    pub fn divide<'t>(&mut self, parts: impl Iterator<Item = &'t Timings>) {
        let mut sum = Timings::default();
        for part in parts {
            (0..Phase::ALL.len()).for_each(|i| {
                sum.phase_ns[i] += part.phase_ns[i];
                sum.laps[i] = sum.laps[i].max(part.laps[i]);
            });
        }
        let all = sum.phase_ns.iter().sum::<u64>().max(1) as f64;
        let elapsed = self.start.as_mut().map_or(0.0, |(_, last)| {
            let now = Instant::now();
            (now - std::mem::replace(last, now)).as_nanos() as f64
        });
        for (i, (ns, laps)) in sum.phase_ns.into_iter().zip(sum.laps).enumerate() {
            self.timings.phase_ns[i] += (elapsed * ns as f64 / all) as u64;
            self.timings.laps[i] += laps;
        }
    }

    /// Ends the step.
    pub fn stop(mut self) -> Timings {
        if let Some((begin, _)) = self.start {
            self.timings.step_ns = begin.elapsed().as_nanos() as u64;
        }
        self.timings
    }
}

/// Time for which this thread was ready but not running, since it started. `None` if the system does not
/// report it. Time taken by a hypervisor is not included.
#[doc(hidden)]
pub fn waited() -> Option<Duration> {
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::fs::FileExt;
        // Kept open: resolving the path takes as long as a step of a small scene.
        thread_local!(static STAT: Option<std::fs::File> = std::fs::File::open("/proc/thread-self/schedstat").ok());
        let mut text = [0; 96];
        let length = STAT.with(|file| file.as_ref()?.read_at(&mut text, 0).ok())?;
        parse_wait(std::str::from_utf8(&text[..length]).ok()?)
    }
    #[cfg(not(target_os = "linux"))]
    None
}

/// Runs `act`; returns its result and its duration without the pauses in which this thread waited for a
/// processor.
#[doc(hidden)]
pub fn timed<T>(act: impl FnOnce() -> T) -> (T, Duration) {
    let (before, start) = (waited(), Instant::now());
    let result = act();
    let elapsed = start.elapsed();
    let pause = before.and_then(|before| Some(waited()?.saturating_sub(before)));
    (result, elapsed.saturating_sub(pause.unwrap_or_default()))
}

/// Reads the wait time from "time on a processor (ns), time waiting (ns), number of times scheduled".
#[cfg(any(target_os = "linux", test))]
fn parse_wait(text: &str) -> Option<Duration> {
    text.split_whitespace().nth(1)?.parse().ok().map(Duration::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_number_is_the_wait() {
        assert_eq!(parse_wait("1830 4200 17\n"), Some(Duration::from_nanos(4200)));
        assert_eq!(["", "12", "1 x 3"].map(parse_wait), [None; 3]);
    }

    #[test]
    fn a_clock_that_is_off_counts_laps_and_no_time() {
        let mut clock = Clock::start(false);
        clock.lap(Phase::Solve);
        clock.lap(Phase::Solve);
        let timings = clock.stop();
        assert_eq!((timings.laps[Phase::Solve as usize], timings.step_ns), (2, 0));
    }
}
