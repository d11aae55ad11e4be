//! Pacing of a run: the time of each step relative to the median of steps with as many contacts.
//!
//! A run is deterministic, so the time of a step is the minimum over several repeats, which excludes
//! disturbances by the machine. More contacts take longer, so a step is compared with the 31 steps of the run
//! with the most similar numbers of contacts. If it has more contacts than those, times per contact are
//! compared: a run with initially overlapping bodies starts with three times the contacts of any later step.

use super::sample::median;
use crate::engine::clock::timed;
use crate::engine::world::World;
use crate::lab::error::Error;

/// Number of steps that a step is compared with.
const NEAREST: usize = 31;

/// Step times of a run relative to the median of steps with as many contacts (1).
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Pace {
    /// Median step time of the run (ns).
    pub median_ns: f64,
    /// The first step, in which pairs, memory and contacts are new.
    pub first: f64,
    /// The longest of all other steps.
    pub longest: f64,
    /// Index of the longest step, counted from 1.
    pub longest_step: u32,
    /// Mean over all steps.
    pub mean: f64,
}

impl Pace {
    /// The pace of a run of `steps` steps, or until it diverges. Errors: a world that cannot be built.
    pub fn measure(
        build: impl Fn() -> Result<World, Error>,
        steps: u32,
        repeats: u32,
    ) -> Result<Self, Error> {
        let (mut times, mut contacts) = (Vec::new(), Vec::new());
        for _ in 0..repeats.max(1) {
            let mut world = build()?;
            for step in 0..steps as usize {
                let (stepped, took) = timed(|| world.step());
                let ns = took.as_nanos() as f64;
                keep_least(&mut times, step, ns);
                if step == contacts.len() {
                    contacts.push(world.counts().contacts);
                }
                if stepped.is_err() {
                    break;
                }
            }
        }
        Ok(Self::of(&times, &contacts))
    }

    /// From the times (ns) and numbers of contacts of all steps.
    fn of(times: &[f64], contacts: &[usize]) -> Self {
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by_key(|&step| contacts[step]);
        let mut ratios = vec![0.0; times.len()];
        for (place, &step) in order.iter().enumerate() {
            let begin = place.saturating_sub(NEAREST / 2).min(times.len().saturating_sub(NEAREST));
            let near = &order[begin..(begin + NEAREST).min(times.len())];
            let of =
                |get: &dyn Fn(usize) -> f64| median(&near.iter().map(|&step| get(step)).collect::<Vec<_>>());
            let more = contacts[step] as f64 / of(&|step| contacts[step] as f64).max(1.0);
            ratios[step] = times[step] / (more.max(1.0) * of(&|step| times[step])).max(1.0);
        }
        let later = ratios.iter().enumerate().skip(1);
        let (longest_step, longest) =
            later.fold((0, 0.0), |most, (step, &ratio)| if ratio > most.1 { (step, ratio) } else { most });
        Pace {
            median_ns: median(times),
            first: ratios.first().copied().unwrap_or(0.0),
            longest,
            longest_step: longest_step as u32 + 1,
            mean: ratios.iter().sum::<f64>() / ratios.len().max(1) as f64,
        }
    }
}

/// Keeps the time of a step if it is the first, or shorter than those of earlier runs.
#[doc(hidden)]
pub fn keep_least(times: &mut Vec<f64>, step: usize, time: f64) {
    match times.get_mut(step) {
        None => times.push(time),
        Some(least) => *least = time.min(*least),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_compared_with_those_of_as_many_contacts() {
        // 1 µs per contact; step 51 takes five times as long.
        let contacts: Vec<usize> = (0..100).map(|step| 10 + 10 * (step / 50)).collect();
        let mut times: Vec<f64> = contacts.iter().map(|&n| 1e3 * n as f64).collect();
        times[50] *= 5.0;
        let pace = Pace::of(&times, &contacts);
        assert_eq!((pace.first, pace.longest, pace.longest_step), (1.0, 5.0, 51));
        assert!((pace.mean - 1.04).abs() < 1e-9 && pace.median_ns == 15e3, "{pace:?}");
        // Two steps have four times the contacts of all others, and the second one takes twice the expected
        // time.
        let contacts: Vec<usize> = (0..100).map(|step| if step < 2 { 40 } else { 10 }).collect();
        let mut times: Vec<f64> = contacts.iter().map(|&n| 1e3 * n as f64).collect();
        times[1] *= 2.0;
        let pace = Pace::of(&times, &contacts);
        assert_eq!((pace.first, pace.longest, pace.longest_step), (1.0, 2.0, 2));
        assert_eq!(Pace::of(&[], &[]), Pace { longest_step: 1, ..Pace::default() });
    }
}
