//! How long an iteration takes, measured apart from what it does.

use super::Schedule;
use super::replay::{Replay, Start};

/// Shortest difference of two runs that is timed (ns), far above the clock's resolution.
const TIMED_NS: f64 = 50_000.0;

/// Median time of an iteration of each case (ns).
///
/// The difference between two steps of few and many iterations, over the difference of their
/// numbers, so that set-up is not counted. Every round times every case once, so that a disturbance
/// of the machine meets all of them.
pub(super) fn time(cases: &mut [(&Schedule, &mut Replay)], rounds: u32) -> Vec<f64> {
    const FEW: u32 = 4;
    let difference = |schedule: &Schedule, replay: &mut Replay, more: u32| {
        let mut run = |k| replay.time(schedule.variant, schedule.budget(k), Start::Cold).as_nanos() as f64;
        let few = run(FEW);
        (run(FEW + more) - few) / f64::from(more)
    };
    let more: Vec<u32> = cases
        .iter_mut()
        .map(|(schedule, replay)| {
            let estimate = difference(schedule, replay, 64).max(1.0);
            (TIMED_NS / estimate).clamp(8.0, 4096.0) as u32
        })
        .collect();
    let mut samples = vec![Vec::new(); cases.len()];
    for _ in 0..rounds {
        for (((schedule, replay), &more), samples) in cases.iter_mut().zip(&more).zip(&mut samples) {
            samples.push(difference(schedule, replay, more));
        }
    }
    samples
        .into_iter()
        .map(|mut s| {
            s.sort_by(f64::total_cmp);
            s[s.len() / 2]
        })
        .collect()
}
