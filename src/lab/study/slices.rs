//! Comparison of all solvers at equal time and at equal error. For each solver: the best setting within that
//! time, or the fastest one within that error.

use super::Record;
use super::compare::compare;
use super::curve::{Curve, ErrorAxis, SettingSample, curves};

/// All solvers on a scene at one given time or error.
#[derive(Clone, Debug)]
pub struct Slice<'a> {
    /// Name of the scene.
    pub scene: &'a str,
    /// The given time (ns) or error.
    pub at: f64,
    /// Unit of the error.
    pub unit: &'static str,
    /// For each solver, its setting; `None` if all its settings take longer or have a larger error.
    pub values: Vec<(&'static str, Option<SettingSample<'a>>)>,
    /// The best solvers: at equal time those with the smallest error, at equal error the fastest one and
    /// those that [tie](compare) with it.
    pub best: Vec<&'static str>,
}

/// The errors on the scene at equal time; `None` if no curve has an error of this kind.
pub fn equal_time(records: &[Record], axis: ErrorAxis) -> Option<Slice<'_>> {
    let best = |least: &SettingSample, other: &SettingSample| other.error <= least.error;
    slice(records, axis, |s| s.time, Curve::best_within, |s| s.error, best)
}

/// The times at equal error.
pub fn equal_error(records: &[Record], axis: ErrorAxis) -> Option<Slice<'_>> {
    let best = |least: &SettingSample, other: &SettingSample| {
        let samples = least.record.sample.as_ref().zip(other.record.sample.as_ref());
        samples.is_some_and(|(least, other)| compare(least, other).is_eq())
    };
    slice(records, axis, |s| s.error, Curve::fastest_within, |s| s.time, best)
}

fn slice<'a>(
    records: &'a [Record],
    axis: ErrorAxis,
    given: fn(&SettingSample) -> f64,
    of: fn(&Curve<'a>, f64) -> Option<SettingSample<'a>>,
    sought: fn(&SettingSample) -> f64,
    as_good: impl Fn(&SettingSample, &SettingSample) -> bool,
) -> Option<Slice<'a>> {
    let curves = curves(records, axis);
    // Ranges without a logarithm are skipped.
    let usable = |[a, b]: &[f64; 2]| *a > 0.0 && b.is_finite();
    let ranges: Vec<[f64; 2]> = curves.iter().filter_map(|c| range(c, given)).filter(usable).collect();
    let at = common(&ranges)?;
    let values: Vec<_> = curves.iter().map(|c| (c.solver, of(c, at))).collect();
    let found = || values.iter().filter_map(|(solver, sample)| Some((*solver, sample.as_ref()?)));
    let least = found().map(|f| f.1).min_by(|a, b| sought(a).total_cmp(&sought(b)));
    let best = found().filter(|(_, s)| least.is_some_and(|least| as_good(least, s))).map(|f| f.0).collect();
    Some(Slice { scene: &records.first()?.scene, at, unit: axis.unit(records), values, best })
}

/// The range of the times or errors of a solver's settings.
fn range(curve: &Curve, given: fn(&SettingSample) -> f64) -> Option<[f64; 2]> {
    let all = || curve.samples.iter().map(given);
    let least = all().min_by(f64::total_cmp)?;
    Some([least, all().fold(least, f64::max)])
}

/// A round number that lies in as many of the ranges as possible. Among these, the roundest one, and among
/// equally round ones the one nearest to the middle of all ranges. If no number of two digits lies in any
/// range, the middle of the first one.
fn common(ranges: &[[f64; 2]]) -> Option<f64> {
    let first = ranges.first()?;
    let middle = ranges.iter().map(|[a, b]| 0.5 * (a * b).ln()).sum::<f64>() / ranges.len() as f64;
    let ends = || ranges.iter().flatten();
    let low = ends().copied().fold(f64::INFINITY, f64::min).log10().floor() as i32;
    let high = ends().copied().fold(0.0, f64::max).log10().ceil() as i32;
    // Prefers 1, 2, 5 to other digits, and one digit to two.
    let roundness = |n: i32| match n {
        10 | 20 | 50 => 2,
        n if n % 10 == 0 => 1,
        _ => 0,
    };
    let mut best: Option<((usize, i32, f64), f64)> = None;
    for exponent in low..=high {
        for n in 10..100 {
            let at = n as f64 * 10f64.powi(exponent - 1);
            let reached = ranges.iter().filter(|[a, b]| (*a..=*b).contains(&at)).count();
            let merit = (reached, roundness(n), -(at.ln() - middle).abs());
            if reached > 0 && best.is_none_or(|(other, _)| merit > other) {
                best = Some((merit, at));
            }
        }
    }
    Some(best.map_or((first[0] * first[1]).sqrt(), |b| b.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::record;

    #[test]
    fn the_cut_is_round_and_meets_the_most_curves() {
        let near = |at: Option<f64>, expected: f64| (at.unwrap() / expected - 1.0).abs() < 1e-12;
        // 10 to 20 lies in all three ranges. 20 is as round as 10 and nearer to the middle.
        assert!(near(common(&[[8.0, 90.0], [3.0, 20.0], [10.0, 40.0]]), 20.0));
        // Only the first two ranges overlap.
        assert!(near(common(&[[8.0, 90.0], [40.0, 60.0], [700.0, 800.0]]), 50.0));
        // No number of two digits lies in the range, so its middle is used.
        assert!(near(common(&[[1.31e-4, 1.39e-4]]), (1.31_f64 * 1.39).sqrt() * 1e-4));
        assert_eq!(common(&[]), None);
    }

    #[test]
    fn slices_take_settings_and_leave_out_who_does_not_reach() {
        let other = |time, error| Record { solver: "soft_step", ..record(8, 4, time, error) };
        let records = [
            record(8, 1, 10.0, 0.5),
            record(8, 2, 40.0, 0.03125),
            other(12.0, 0.25),
            Record { solver: "projection", ..record(8, 1, 80.0, 3.0) },
        ];
        let at = |s: &(&'static str, Option<SettingSample>)| s.1.map(|s| (s.time / 1e3, s.error));
        // 20 µs: the second setting of pgs takes longer, and projection has none within that time. The
        // setting of soft_step takes less.
        let time = equal_time(&records, ErrorAxis::Penetration).unwrap();
        assert_eq!((time.scene, time.unit), ("stack:2", "m"));
        assert!((12e3..40e3).contains(&time.at), "{}", time.at);
        let values: Vec<_> = time.values.iter().map(at).collect();
        assert_eq!(values, [Some((10.0, 0.5)), Some((12.0, 0.25)), None]);
        assert_eq!(time.best, ["soft_step"]);
        // An unmeasured time is never the given time.
        let unmeasured = [records[0].clone(), record(8, 4, 0.0, 0.25), other(0.0, 0.125)];
        assert!(equal_time(&unmeasured, ErrorAxis::Penetration).is_none_or(|slice| slice.at > 0.0));
        // An error of 0.1 to 0.25: a setting with a smaller error counts as well.
        let error = equal_error(&records[..3], ErrorAxis::Penetration).unwrap();
        let values: Vec<_> = error.values.iter().map(at).collect();
        assert_eq!((values[0], error.values.len()), (Some((40.0, 0.03125)), 2), "{}", error.at);
        assert!(equal_time(&records, ErrorAxis::Truth).is_none());
    }

    #[test]
    fn a_setting_that_is_done_early_answers_later() {
        // The pyramid of 40 rows at equal time: 385 µs and 7.0 mm are better than 500 µs and 20.3 mm.
        let slow = |substeps, time, error| record(8, substeps, time, error);
        let soft = |substeps, time, error| Record { solver: "soft_step", ..record(8, substeps, time, error) };
        let records = [
            slow(1, 250.0, 35.0e-3),
            slow(2, 500.0, 20.3e-3),
            slow(4, 900.0, 18.0e-3),
            soft(4, 230.0, 7.3e-3),
            soft(8, 385.0, 7.0e-3),
        ];
        let slice = equal_time(&records, ErrorAxis::Penetration).unwrap();
        assert_eq!(slice.best, ["soft_step"], "at {}", slice.at);
        let c = curves(&records, ErrorAxis::Penetration);
        assert_eq!(c[1].best_within(500e3).map(|s| s.error), Some(7.0e-3));
    }

    #[test]
    fn noise_makes_a_tie() {
        let slice = |times: [f64; 3]| {
            let names = ["a", "b", "c"];
            let of = |(solver, time)| Record { solver, ..record(8, 1, time, 0.1) };
            let records: Vec<Record> = names.into_iter().zip(times).map(of).collect();
            equal_error(&records, ErrorAxis::Penetration).unwrap().best
        };
        assert_eq!(slice([100.0, 102.0, 104.0]), ["a", "b"]);
        assert_eq!(slice([105.0, 120.0, 100.0]), ["c"]);
    }
}
