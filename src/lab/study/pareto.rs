//! The Pareto front of time and error.
//!
//! A setting is dominated if another one is at least as good in time and in error, and better in one of them.
//! Times that [tie](compare) count as equal, so that noise decides nothing. Without ties this is the usual
//! front. With them, a setting that is faster by noise alone must have the smaller error.

use super::compare::compare;
use super::sample::Sample;
use std::cmp::Ordering;

/// Time and error of a setting.
#[derive(Clone, Copy, Debug)]
pub struct TimeAndError<'a> {
    /// Times of the setting's fastest lane width.
    pub sample: &'a Sample,
    /// Any error, ≥ 0.
    pub error: f64,
}

impl TimeAndError<'_> {
    fn dominates(&self, other: &TimeAndError) -> bool {
        let by_time = compare(self.sample, other.sample);
        (by_time == Ordering::Less && self.error <= other.error)
            || (by_time != Ordering::Greater && self.error < other.error)
    }
}

/// For each point, whether no other point dominates it.
pub fn front(points: &[TimeAndError]) -> Vec<bool> {
    points.iter().map(|p| !points.iter().any(|q| q.dominates(p))).collect()
}

#[cfg(test)]
mod tests {
    use super::super::interleave::tests::sample;
    use super::*;

    fn fronts(settings: &[(f64, f64)]) -> Vec<bool> {
        let samples: Vec<Sample> = settings.iter().map(|s| sample(vec![vec![s.0; 20]])).collect();
        let points = samples.iter().zip(settings).map(|(sample, s)| TimeAndError { sample, error: s.1 });
        front(&points.collect::<Vec<_>>())
    }

    #[test]
    fn the_front_is_what_no_other_beats_in_both() {
        let points = [(10.0, 3.0), (20.0, 2.0), (30.0, 2.0), (40.0, 1.0), (50.0, 4.0)];
        assert_eq!(fronts(&points), [true, true, false, true, false]);
        assert!(front(&[]).is_empty());
    }

    #[test]
    fn noise_wins_no_place() {
        // 2 % faster, but worse: dominated. 4 % faster: on the front.
        assert_eq!(fronts(&[(98.0, 2.0), (100.0, 1.0)]), [false, true]);
        assert_eq!(fronts(&[(96.0, 2.0), (100.0, 1.0)]), [true, true]);
        // Equal errors and tied times: both stay on the front.
        assert_eq!(fronts(&[(100.0, 1.0), (101.0, 1.0)]), [true, true]);
    }
}
