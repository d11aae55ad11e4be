//! Estimates before a run: time and memory from bodies, steps and settings.
//!
//! The figures are for pyramids (three contacts of two points per body) on one Zen 5 core, rounded. Scenes
//! with fewer contacts take a fraction of that, other machines a few times as much. This is accurate enough
//! to tell seconds from hours and megabytes from terabytes.

use super::error::Error;

/// Time of a step without its sweeps, per body (ns).
const STEP_NS: f64 = 350.0;
/// Time of a sweep at one lane, per body (ns).
const SWEEP_NS: f64 = 60.0;
/// Sweeps are faster by the lane width to this power.
const LANE_POWER: f64 = 0.6;
/// Time of measuring the errors of a step, per body (ns).
const ERRORS_NS: f64 = 1500.0;
/// Memory of a world, per body (B).
const WORLD_BYTES: f64 = 3000.0;
/// Memory of a scene and of measuring its errors, per body (B).
const ERRORS_BYTES: f64 = 2500.0;

/// Longest time (s) and largest memory (B) for which no estimate is printed.
const LONG: f64 = 60.0;
const LARGE: f64 = 4.0 * 1024.0 * 1024.0 * 1024.0;

/// Time and memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Wall-clock time (s).
    pub seconds: f64,
    /// Peak memory (B).
    pub bytes: f64,
}

/// Time of one step with this number of bodies (s).
pub fn step(bodies: usize, sweeps: u32, lanes: usize) -> f64 {
    1e-9 * bodies as f64 * (STEP_NS + SWEEP_NS * f64::from(sweeps) / (lanes as f64).powf(LANE_POWER))
}

/// Time of measuring the errors of one step (s).
pub fn errors(bodies: usize) -> f64 {
    1e-9 * bodies as f64 * ERRORS_NS
}

/// Memory of `worlds` worlds of one scene, or of measuring the errors of `measured` worlds at once, whichever
/// is larger (B).
pub fn memory(bodies: usize, worlds: usize, measured: usize) -> f64 {
    let measuring = measured as f64 * (WORLD_BYTES + ERRORS_BYTES);
    bodies as f64 * (worlds as f64 * WORLD_BYTES).max(measuring)
}

impl Estimate {
    /// Both runs in sequence: times add up, memory is the larger of the two.
    pub fn then(self, next: Estimate) -> Estimate {
        Estimate { seconds: self.seconds + next.seconds, bytes: self.bytes.max(next.bytes) }
    }

    /// A message to print before a run with this estimate; empty if the run is short and small.
    ///
    /// Errors: the memory exceeds `free` (B), if that is known.
    pub fn note(&self, what: &str, free: Option<f64>) -> Result<String, Error> {
        if let Some(free) = free.filter(|&free| self.bytes > free) {
            let message =
                format!("needs about {} of memory, but {} are free", bytes(self.bytes), bytes(free));
            return Err(Error::invalid(what, message));
        }
        if self.seconds <= LONG && self.bytes <= LARGE {
            return Ok(String::new());
        }
        Ok(format!("{what}: about {} and {} of memory\n", duration(self.seconds), bytes(self.bytes)))
    }
}

impl Estimate {
    /// The same for time only.
    pub fn time_note(&self, what: &str) -> String {
        if self.seconds <= LONG {
            String::new()
        } else {
            format!("{what}: about {}\n", duration(self.seconds))
        }
    }
}

/// Memory available from the system (B); `None` if unknown.
pub fn free_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(1024.0 * line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()?)
}

/// `40 s`, `12 min`, `5 h`, `3 days`.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 99.5 => format!("{s:.0} s"),
        s if s < 99.5 * 60.0 => format!("{:.0} min", s / 60.0),
        s if s < 48.0 * 3600.0 => format!("{:.0} h", s / 3600.0),
        s => format!("{:.0} days", s / 86400.0),
    }
}

fn bytes(count: f64) -> String {
    const GIB: f64 = 1024.0 * 1024.0 * 1024.0;
    match count / GIB {
        g if g >= 9.95 => format!("{g:.0} GiB"),
        g if g >= 0.95 => format!("{g:.1} GiB"),
        g => format!("{:.0} MiB", 1024.0 * g),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_long_or_large_runs_are_announced_and_impossible_ones_refused() {
        let of = |seconds, gib: f64| Estimate { seconds, bytes: gib * 1024.0 * 1024.0 * 1024.0 };
        assert_eq!(of(59.0, 3.9).note("x", None).unwrap(), "");
        assert_eq!(of(600.0, 0.5).note("x", None).unwrap(), "x: about 10 min and 512 MiB of memory\n");
        assert_eq!(of(1.0, 5.0).note("x", None).unwrap(), "x: about 1 s and 5.0 GiB of memory\n");
        let refused = of(1.0, 50.0).note("x", Some(of(0.0, 20.0).bytes)).unwrap_err().to_string();
        assert_eq!(refused, "x: needs about 50 GiB of memory, but 20 GiB are free");
        assert_eq!(of(2.0, 1.0).then(of(3.0, 0.5)), of(5.0, 1.0));
    }

    #[test]
    fn more_of_anything_takes_longer_and_lanes_help() {
        assert!(step(1000, 8, 16) < step(1000, 8, 1) && step(1000, 8, 1) < step(1000, 80, 1));
        assert_eq!(2.0 * step(1000, 8, 4), step(2000, 8, 4));
        assert!(memory(1000, 100, 2) > memory(1000, 10, 2) && memory(1000, 0, 1) > 0.0);
        let words: Vec<String> = [40.0, 700.0, 20_000.0, 1e6].map(duration).to_vec();
        assert_eq!(words, ["40 s", "12 min", "6 h", "12 days"]);
    }
}
