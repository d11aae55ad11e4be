//! Time in which this thread waited for a processor. Wall-clock time attributes it to whichever phase is
//! running.

pub use crate::engine::clock::waited;
use crate::lab::study::sample::BUSY;
use std::time::Duration;

/// Fraction of `elapsed` in which the thread waited since `before`.
pub fn share(before: Option<Duration>, elapsed: Duration) -> Option<f64> {
    let waiting = waited()?.saturating_sub(before?);
    Some(waiting.as_secs_f64() / elapsed.as_secs_f64().max(1e-9))
}

/// A line for reports; empty if there is nothing to report.
pub fn note(share: Option<f64>) -> String {
    match share {
        Some(share) if share >= BUSY => format!(
            "this thread waited for a processor {:.0} % of the time: the machine is busy\n",
            100.0 * share
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_is_said_where_there_is_some() {
        assert_eq!(share(None, Duration::from_secs(1)), None);
        assert!(note(Some(0.5)).contains("50 %") && note(Some(0.049)).is_empty() && note(None).is_empty());
    }
}
