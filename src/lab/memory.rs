//! Refuses runs that do not fit in memory, before they start.
//!
//! The figures are for pyramids (three contacts of two points per body), rounded. That is accurate enough to
//! tell megabytes from terabytes.

use super::error::Error;

/// Memory of a world, per body (B).
const WORLD_BYTES: f64 = 3000.0;
/// Memory of a scene and of measuring its errors, per body (B).
const ERRORS_BYTES: f64 = 2500.0;

/// Checks that `worlds` worlds of a scene fit in memory at once, and measuring the errors of `measured`
/// worlds at once.
///
/// Errors: more than the system says is available.
pub fn check(what: &str, bodies: usize, worlds: usize, measured: usize) -> Result<(), Error> {
    let measuring = measured as f64 * (WORLD_BYTES + ERRORS_BYTES);
    let needed = bodies as f64 * (worlds as f64 * WORLD_BYTES).max(measuring);
    match free().filter(|&free| needed > free) {
        None => Ok(()),
        Some(free) => {
            let [needed, free] = [needed, free].map(|bytes| bytes / (1024.0 * 1024.0 * 1024.0));
            let message = format!("needs about {needed:.0} GiB of memory, but {free:.1} GiB are free");
            Err(Error::invalid(what, message))
        }
    }
}

/// Memory available from the system (B); `None` if unknown.
pub fn free() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    Some(1024.0 * line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_refused() {
        check("run", 1000, 10, 2).unwrap();
        if free().is_some() {
            let message = check("run", 1_000_000_000, 10, 2).unwrap_err().to_string();
            assert!(message.starts_with("run: needs about 27940 GiB of memory, but "), "{message}");
        }
    }
}
