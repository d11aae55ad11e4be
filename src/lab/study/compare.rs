//! Decides which of two settings is faster, or that they tie.
//!
//! Each block of one setting is paired with the other's block of the same round. The median of the ratios has
//! a confidence interval for any distribution (Thompson 1936, Savur 1937): of n pairs, the true median lies
//! between the k-th smallest and the k-th largest ratio unless fewer than k of n fair coins fall on one side.
//! An interruption affects one ratio among many, and a drifting clock affects both halves of a pair. If the
//! interval contains 1, the settings tie. A negligible difference is a tie, too. Time in which a thread waited
//! for a processor is not part of the blocks, so it does not widen the interval; a busy machine leaves fewer
//! pairs, which does.

use super::sample::{Sample, median};
use std::cmp::Ordering;

/// Times that differ by less than this fraction are a tie (1): moving code in memory changes them as much.
pub const TIE: f64 = 0.03;

/// Spikes count if the ratio of mean to median of one setting exceeds that of the other by more than this
/// fraction (1).
const SPIKES: f64 = 0.1;

/// Probability that an interval misses the true median. A study compares dozens of settings and takes the
/// fastest one: at 5 % some would win by luck.
const MISS: f64 = 1e-3;

/// Quantile of the normal distribution with half of [`MISS`] beyond it.
const Z: f64 = 3.291;

/// The time of one setting ÷ that of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Median over the pairs of blocks, scaled by the ratio of mean to median if spikes differ.
    pub median: f64,
    /// Confidence interval of the true median; unbounded if there are too few pairs.
    pub interval: [f64; 2],
}

impl Ratio {
    /// Time of `one` ÷ time of `other`; `None` without a pair of blocks. Spikes occur in few blocks, so the
    /// median misses them. If one of the two has clearly more spikes, the ratio is therefore that of the
    /// means.
    pub fn of(one: &Sample, other: &Sample) -> Option<Ratio> {
        let pairs = one.blocks_ns.iter().flatten().zip(other.blocks_ns.iter().flatten());
        let mut ratios: Vec<f64> = pairs.map(|(a, b)| a / b).filter(|r| r.is_finite()).collect();
        ratios.sort_by(f64::total_cmp);
        let interval = match rank(ratios.len()) {
            0 => [0.0, f64::INFINITY],
            k => [ratios[k - 1], ratios[ratios.len() - k]],
        };
        let spikes = one.spikes() / other.spikes();
        let shape = if spikes.ln().abs() > SPIKES.ln_1p() { spikes } else { 1.0 };
        (!ratios.is_empty())
            .then(|| Ratio { median: shape * median(&ratios), interval: interval.map(|bound| shape * bound) })
    }

    /// Whether the difference is too small to call.
    pub fn is_tie(&self) -> bool {
        let [low, high] = self.interval;
        (low <= 1.0 && 1.0 <= high) || self.median.ln().abs() <= TIE.ln_1p()
    }
}

/// Whether `one` is faster ([`Ordering::Less`]) or slower than `other`, or ties with it.
pub fn compare(one: &Sample, other: &Sample) -> Ordering {
    match Ratio::of(one, other) {
        Some(ratio) if !ratio.is_tie() => ratio.median.total_cmp(&1.0),
        _ => Ordering::Equal,
    }
}

/// The largest k for which fewer than k of `n` fair coins fall on one side or the other with a probability of
/// at most [`MISS`].
fn rank(n: usize) -> usize {
    if n > 500 {
        // √n/2 is the standard deviation of the count; ½ corrects for its discrete steps.
        return (0.5 * (n as f64 - Z * (n as f64).sqrt())) as usize;
    }
    let (mut chance, mut below) = (0.5_f64.powi(n as i32), 0.0);
    for k in 0..n {
        below += 2.0 * chance;
        if below > MISS {
            return k;
        }
        chance *= (n - k) as f64 / (k + 1) as f64;
    }
    0
}

#[cfg(test)]
mod tests {
    use super::super::interleave::take_turns;
    use super::super::interleave::tests::sample;
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    #[test]
    fn ranks_are_those_of_tables() {
        // All of 11 coins fall alike with the probability 2/2048 < 0.1 %, all of 10 with 2/1024.
        assert_eq!([rank(0), rank(10), rank(11)], [0, 0, 1]);
        // From tables of the sign test at 0.1 %: at most 2 of 20, 13 of 50, 33 of 100; k is one more.
        assert_eq!([rank(20), rank(50), rank(100)], [3, 14, 34]);
        // The approximation joins without a jump.
        assert!(rank(501).abs_diff(rank(500)) <= 1);
    }

    #[test]
    fn few_pairs_and_small_differences_are_ties() {
        let of = |time: f64, count: usize| sample(vec![vec![time; count]]);
        assert_eq!(compare(&of(1.0, 10), &of(2.0, 10)), Ordering::Equal);
        assert_eq!(compare(&of(1.0, 11), &of(2.0, 11)), Ordering::Less);
        assert_eq!(compare(&of(2.0, 11), &of(1.0, 11)), Ordering::Greater);
        assert_eq!(compare(&of(1.029, 20), &of(1.0, 20)), Ordering::Equal);
        assert_eq!(compare(&of(1.031, 20), &of(1.0, 20)), Ordering::Greater);
        assert_eq!(compare(&of(1.0, 0), &of(1.0, 9)), Ordering::Equal);
        assert_eq!(Ratio::of(&of(1.0, 0), &of(1.0, 9)), None);
    }

    #[test]
    fn spikes_that_come_back_count_and_waiting_does_not() {
        let pass = |time: f64, spike: f64| {
            let mut blocks = vec![time; 20];
            blocks[5] = spike;
            blocks
        };
        let (calm, spiky) = (sample(vec![pass(10.0, 10.0); 3]), sample(vec![pass(8.0, 200.0); 3]));
        assert_eq!(compare(&spiky, &calm), Ordering::Greater);
        // A spike in a single pass is attributed to the machine.
        let once = sample(vec![pass(8.0, 200.0), pass(8.0, 8.0), pass(8.0, 8.0)]);
        assert_eq!(compare(&once, &calm), Ordering::Less);
        // The wait is not in the times.
        let waiting = Sample { waited: 0.3, ..once };
        assert_eq!(compare(&waiting, &calm), Ordering::Less);
    }

    #[test]
    fn only_blocks_of_the_same_round_are_paired() {
        let nan = f64::NAN;
        // In the second pass only the other one was timed, at another speed of the machine.
        let one = sample(vec![vec![10.0; 9], vec![nan; 9]]);
        let other = sample(vec![vec![20.0; 9], vec![5.0; 9]]);
        assert_eq!(Ratio::of(&one, &other).map(|r| r.median), Some(0.5));
    }

    /// Speed of the machine (1) as a function of the elapsed fraction of the study.
    type Weather = fn(f64) -> f64;

    /// Samples of settings with these costs (ns), on a simulated clock. `noise` is the relative scatter of a
    /// block, and one block in twenty is interrupted.
    fn study(costs: &[f64], weather: Weather, noise: f64, seed: u64) -> Vec<Sample> {
        const ROUNDS: usize = 60;
        let mut random = Pcg64::seed_from_u64(seed);
        let mut blocks = vec![vec![vec![f64::NAN; ROUNDS]]; costs.len()];
        let whole = costs.iter().sum::<f64>() * ROUNDS as f64;
        let mut now = 0.0;
        take_turns(costs.len(), ROUNDS, |i, round| {
            let interruption = if random.random_range(0.0..1.0) < 0.05 { 3.0 } else { 1.0 };
            let scatter = 1.0 + noise * random.random_range(-1.0..1.0);
            let time = costs[i] * weather(now / whole) * scatter * interruption;
            now += costs[i];
            blocks[i][0][round] = time;
        });
        blocks.into_iter().map(sample).collect()
    }

    fn verdicts(samples: &[Sample]) -> Vec<Ordering> {
        samples.iter().flat_map(|a| samples.iter().map(|b| compare(a, b))).collect()
    }

    const CALM: Weather = |_| 1.0;
    /// 30 % slower at the end than at the start.
    const DRIFT: Weather = |t| 1.0 + 0.3 * t;
    /// A sudden slowdown by 30 %.
    const JUMP: Weather = |t| if t < 0.4 { 1.0 } else { 1.3 };
    /// Two slow phases.
    const WAVE: Weather = |t| 1.0 + 0.15 * (4.0 * std::f64::consts::TAU * t).sin();

    #[test]
    fn one_setting_entered_three_times_is_a_tie() {
        for weather in [CALM, DRIFT, JUMP, WAVE] {
            for seed in 0..100 {
                let found = verdicts(&study(&[800.0; 3], weather, 0.05, seed));
                assert_eq!(found, [Ordering::Equal; 9], "seed {seed}");
            }
        }
    }

    #[test]
    fn a_clock_that_drifts_changes_no_verdict() {
        let costs = [1.0, 1.1, 0.6, 1.0, 5.0, 1.1, 40.0, 0.61, 2.0];
        for seed in 0..20 {
            let calm = verdicts(&study(&costs, CALM, 0.05, seed));
            for weather in [DRIFT, JUMP, WAVE] {
                assert_eq!(verdicts(&study(&costs, weather, 0.05, seed)), calm, "seed {seed}");
            }
        }
        let order = |a: usize, b: usize| {
            let samples = study(&costs, DRIFT, 0.05, 1);
            compare(&samples[a], &samples[b])
        };
        assert_eq!(
            [order(0, 1), order(0, 3), order(2, 7)],
            [Ordering::Less, Ordering::Equal, Ordering::Equal]
        );
        // If the settings were timed one after the other, the first of two equal ones would win.
        let alone = |from: f64| {
            let blocks = (0..60).map(|i| DRIFT(from + 0.5 * f64::from(i) / 60.0));
            sample(vec![blocks.collect()])
        };
        assert_eq!(compare(&alone(0.0), &alone(0.5)), Ordering::Less);
    }
}
