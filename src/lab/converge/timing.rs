//! The time of an iteration, measured separately from its results.

use super::IteratedSchedule;
use super::replay::{Replay, Start};

/// Shortest time difference that is measured (ns), far above the clock's resolution.
const TIMED_NS: f64 = 50_000.0;

/// Time of an iteration (ns), without set-up, over identical rounds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct IterationTime {
    /// Median over the rounds.
    pub median_ns: f64,
    /// Quartiles over the rounds. There is no mean: each round is a difference of two runs, and interruptions
    /// would dominate it.
    pub quartiles_ns: [f64; 2],
}

/// Time of an iteration of each case.
///
/// This is the time difference between two steps with few and with many iterations ÷ the difference of their
/// numbers, so set-up is not counted. Every round times every case once, so a slow spell of the machine
/// affects all cases alike.
///
/// A solver that has reached its final state may have nothing left to do, so further iterations cost nothing.
/// If more iterations change no bit, the iterations up to that state are timed repeatedly instead.
pub(super) fn time(cases: &mut [(&IteratedSchedule, &mut Replay)], rounds: u32) -> Vec<IterationTime> {
    let ranges: Vec<Range> = cases.iter_mut().map(|(schedule, replay)| Range::of(schedule, replay)).collect();
    let mut samples = vec![Vec::new(); cases.len()];
    for _ in 0..rounds {
        for (((schedule, replay), range), samples) in cases.iter_mut().zip(&ranges).zip(&mut samples) {
            samples.push(range.time(schedule, replay));
        }
    }
    samples
        .into_iter()
        .map(|mut s| {
            s.sort_by(f64::total_cmp);
            IterationTime { median_ns: s[s.len() / 2], quartiles_ns: [s[s.len() / 4], s[3 * s.len() / 4]] }
        })
        .collect()
}

/// Iterations that are timed.
struct Range {
    few: u32,
    more: u32,
    /// Number of repetitions.
    times: u32,
}

impl Range {
    fn of(schedule: &IteratedSchedule, replay: &mut Replay) -> Range {
        const FEW: u32 = 4;
        const MOST: f64 = 4096.0;
        let mut outcome = |k: u32| {
            let outcome = replay.run(schedule.variant, schedule.budget(k), Start::Cold);
            (outcome.velocities, outcome.impulses)
        };
        let answer = outcome(FEW);
        let mut range = Range { few: FEW, more: 64, times: 1 };
        if answer == outcome(FEW + range.more) {
            let last = (0..FEW).find(|&k| outcome(k) == answer).unwrap_or(FEW);
            range = Range { few: 0, more: last.max(1), times: 64 };
            let estimate = range.time(schedule, replay).max(1.0);
            range.times = (TIMED_NS / (estimate * f64::from(range.more))).clamp(1.0, MOST) as u32;
        } else {
            let estimate = range.time(schedule, replay).max(1.0);
            range.more = (TIMED_NS / estimate).clamp(8.0, MOST) as u32;
        }
        range
    }

    /// Time of an iteration (ns).
    fn time(&self, schedule: &IteratedSchedule, replay: &mut Replay) -> f64 {
        let mut run = |k| replay.time(schedule.variant, schedule.budget(k), Start::Cold).as_nanos() as f64;
        let sum: f64 = (0..self.times).map(|_| run(self.few + self.more) - run(self.few)).sum();
        sum / f64::from(self.times) / f64::from(self.more)
    }
}
