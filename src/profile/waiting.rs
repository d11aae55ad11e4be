//! How long this thread has waited for a processor: time that a clock on the wall books on whatever
//! phase happens to run.

use std::time::Duration;

/// Time that this thread was ready to run and did not, since it began. None where the system does
/// not say; what a hypervisor takes is not in it.
pub fn waited() -> Option<Duration> {
    parse(&std::fs::read_to_string("/proc/thread-self/schedstat").ok()?)
}

/// Time on a processor, time waiting, times scheduled: nanoseconds, nanoseconds, a count.
fn parse(text: &str) -> Option<Duration> {
    text.split_whitespace().nth(1)?.parse().ok().map(Duration::from_nanos)
}

/// Share of `elapsed` in which the thread waited since `before`.
pub fn share(before: Option<Duration>, elapsed: Duration) -> Option<f64> {
    let waiting = waited()?.saturating_sub(before?);
    Some(waiting.as_secs_f64() / elapsed.as_secs_f64().max(1e-9))
}

/// A line for reports: none where there is nothing to say.
pub fn note(share: Option<f64>) -> String {
    match share {
        Some(share) if share >= 0.01 => format!(
            "this thread waited for a processor {:.0} % of the time; others use this machine too\n",
            100.0 * share
        ),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_number_is_the_wait() {
        assert_eq!(parse("1830 4200 17\n"), Some(Duration::from_nanos(4200)));
        assert_eq!(["", "12", "1 x 3"].map(parse), [None; 3]);
        assert_eq!(share(None, Duration::from_secs(1)), None);
        assert!(note(Some(0.5)).contains("50 %") && note(Some(0.001)).is_empty() && note(None).is_empty());
    }
}
