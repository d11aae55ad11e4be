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
/// # use simpulse_engine::{bodies::{BodyDef, ShapeDef}, solvers, world::{Settings, World}};
/// let mut world = World::new(Settings { timed: true, ..Settings::new(solvers::find("pgs")?) });
/// world.add_body(&BodyDef::dynamic([0.0, 0.5]).with(ShapeDef::circle(0.5)?))?;
/// world.step()?;
/// for phase in Phase::ALL {
///     println!("{:<12} {} ns", phase.name(), world.timings.phase_ns[phase as usize]);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct Timings {
    /// Nanoseconds per phase, indexed by `Phase as usize`.
    pub phase_ns: [u64; Phase::ALL.len()],
    /// Nanoseconds of the whole step.
    pub step_ns: u64,
}

impl Timings {
    /// Nanoseconds of all sweeps.
    pub fn sweep_ns(&self) -> u64 {
        Phase::ALL.iter().filter(|p| p.is_sweep()).map(|&p| self.phase_ns[p as usize]).sum()
    }
}

/// Memory traffic of the passes of one phase, if counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[doc(hidden)]
pub struct Requested {
    /// Sums over visited contacts, by kind of body a: floats read, floats written, rows gathered, half rows
    /// written.
    pub contacts: [[f64; 4]; 3],
    /// Other bytes read and written: of bodies and of vectors.
    pub bytes: [f64; 2],
}

/// Which phases of a step run: all, or one alone on the records of an earlier step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[doc(hidden)]
pub struct PhaseFilter {
    /// The only phase that runs; `None` runs all.
    pub only: Option<Phase>,
    /// Whether the phase runs in one lane that counts, [`crate::lanes::Counted`].
    pub counted: bool,
}

impl PhaseFilter {
    /// All phases of a step.
    pub const ALL: PhaseFilter = PhaseFilter { only: None, counted: false };

    /// Whether passes of `phase` run.
    #[inline]
    pub fn runs(&self, phase: Phase) -> bool {
        self.only.is_none_or(|only| only == phase)
    }
}

/// Stopwatch of a step: each lap adds the time since the last one to a phase. A clock that is off counts laps
/// without reading the time.
#[derive(Debug)]
#[doc(hidden)]
pub struct Clock {
    timings: Timings,
    start: Option<(Instant, Instant)>,
    requested: Requested,
    laps: [u32; Phase::ALL.len()],
    /// Wait time of the thread at the last lap, if waits are subtracted.
    waited: Option<Duration>,
}

impl Clock {
    /// Starts a step; `on`: times are measured.
    pub fn start(on: bool) -> Self {
        let start = on.then(|| {
            let now = Instant::now();
            (now, now)
        });
        Clock {
            timings: Timings::default(),
            start,
            requested: Requested::default(),
            laps: [0; Phase::ALL.len()],
            waited: None,
        }
    }

    /// Starts a step whose times exclude the pauses in which the thread waited for a processor, if the system
    /// reports them. Each lap then costs a few microseconds, which are not counted. The time of the step is
    /// the sum of its phases.
    pub(crate) fn without_pauses() -> Self {
        Clock { waited: waited(), ..Clock::start(true) }
    }

    /// Counts the memory traffic of a pass over `contacts` contacts whose body a is of kind `opposite`.
    pub(crate) fn book(&mut self, opposite: usize, contacts: usize, per_contact: [usize; 4]) {
        for (sum, each) in self.requested.contacts[opposite].iter_mut().zip(per_contact) {
            *sum += contacts as f64 * each as f64;
        }
    }

    /// Adds bytes read and written.
    pub(crate) fn book_bytes(&mut self, bytes: [f64; 2]) {
        self.requested.bytes = [0, 1].map(|k| self.requested.bytes[k] + bytes[k]);
    }

    /// The memory traffic so far.
    pub(crate) fn requested(&self) -> Requested {
        self.requested
    }

    /// Laps of each phase, indexed by `Phase as usize`.
    pub(crate) fn laps(&self) -> [u32; Phase::ALL.len()] {
        self.laps
    }

    /// Adds the time since the last lap to `phase`.
    #[inline]
    pub fn lap(&mut self, phase: Phase) {
        if let Some((_, last)) = &mut self.start {
            let now = Instant::now();
            let mut elapsed = now - *last;
            *last = now;
            if let Some(before) = &mut self.waited {
                let after = waited().unwrap_or(*before);
                elapsed = elapsed.saturating_sub(after.saturating_sub(*before));
                *before = after;
                *last = Instant::now();
            }
            self.timings.phase_ns[phase as usize] += elapsed.as_nanos() as u64;
        }
        self.laps[phase as usize] += 1;
    }

    /// Ends the step.
    pub fn stop(mut self) -> Timings {
        if let Some((begin, _)) = self.start {
            self.timings.step_ns = match self.waited {
                None => begin.elapsed().as_nanos() as u64,
                Some(_) => self.timings.phase_ns.iter().sum(),
            };
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
        assert_eq!(clock.laps()[Phase::Solve as usize], 2);
        assert_eq!(clock.stop().step_ns, 0);
    }

    #[test]
    fn a_filter_lets_one_phase_through() {
        assert!(Phase::ALL.into_iter().all(|phase| PhaseFilter::ALL.runs(phase)));
        let one = PhaseFilter { only: Some(Phase::Solve), counted: false };
        assert!(Phase::ALL.into_iter().all(|phase| one.runs(phase) == (phase == Phase::Solve)));
    }
}
