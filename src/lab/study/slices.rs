//! Work-precision curves cut across: the errors of all solvers in equal time, and their
//! times to equal error.

use super::Record;
use super::curve::{Curve, ErrorAxis, curves};
use super::pareto::tie;

/// Every solver of a scene at one time or at one error.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// Name of the scene.
    pub scene: String,
    /// Where the curves are cut: a time (ns) or an error.
    pub at: f64,
    /// Unit of the error.
    pub unit: &'static str,
    /// Solver, and its error or its time with the spread (ns); none where its budgets do
    /// not reach.
    pub values: Vec<(&'static str, Option<[f64; 2]>)>,
}

impl Slice {
    /// The solvers that nobody beats: the best one, and those that [tie] with it.
    pub fn best(&self) -> Vec<&'static str> {
        let least = self.values.iter().filter_map(|v| v.1).min_by(|a, b| a[0].total_cmp(&b[0]));
        let Some(least) = least else { return Vec::new() };
        self.values.iter().filter(|v| v.1.is_some_and(|value| tie(value, least))).map(|v| v.0).collect()
    }
}

/// The errors of the scene in equal time; none if no curve has an error of this kind.
pub fn equal_time(records: &[Record], axis: ErrorAxis) -> Option<Slice> {
    slice(records, axis, |s| s.0, |curve, at| Some([curve.error_at(at)?, 0.0]))
}

/// The times to equal error.
pub fn equal_error(records: &[Record], axis: ErrorAxis) -> Option<Slice> {
    slice(records, axis, |s| s.1, |curve, at| curve.time_to(at))
}

fn slice(
    records: &[Record],
    axis: ErrorAxis,
    abscissa: fn((f64, f64)) -> f64,
    value: impl Fn(&Curve, f64) -> Option<[f64; 2]>,
) -> Option<Slice> {
    let curves = curves(records, axis);
    let ranges: Vec<[f64; 2]> = curves.iter().filter_map(|c| range(c, abscissa)).collect();
    let at = common(&ranges)?;
    let values = curves.iter().map(|c| (c.solver, value(c, at))).collect();
    Some(Slice { scene: records.first()?.scene.clone(), at, unit: axis.unit(records), values })
}

/// From the least to the largest abscissa of a curve.
fn range(curve: &Curve, abscissa: fn((f64, f64)) -> f64) -> Option<[f64; 2]> {
    let all = || curve.samples.iter().map(|s| abscissa((s.time, s.error)));
    let least = all().min_by(f64::total_cmp)?;
    Some([least, all().fold(least, f64::max)])
}

/// A round number that lies in as many of the ranges as any: of those the roundest, and of
/// equally round ones the one nearest to the middle of all ranges. Where no number of two digits
/// lies in any range, the middle of the first.
fn common(ranges: &[[f64; 2]]) -> Option<f64> {
    let first = ranges.first()?;
    let middle = ranges.iter().map(|[a, b]| 0.5 * (a * b).ln()).sum::<f64>() / ranges.len() as f64;
    let ends = || ranges.iter().flatten();
    let low = ends().copied().fold(f64::INFINITY, f64::min).log10().floor() as i32;
    let high = ends().copied().fold(0.0, f64::max).log10().ceil() as i32;
    // 1, 2, 5 before other digits, one digit before two.
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
        // 10 to 20 lies in all three; 20 is as round as 10, and nearer to the middle.
        assert!(near(common(&[[8.0, 90.0], [3.0, 20.0], [10.0, 40.0]]), 20.0));
        // Only the first two meet.
        assert!(near(common(&[[8.0, 90.0], [40.0, 60.0], [700.0, 800.0]]), 50.0));
        // No two digits lie in between: the middle.
        assert!(near(common(&[[1.31e-4, 1.39e-4]]), (1.31_f64 * 1.39).sqrt() * 1e-4));
        assert_eq!(common(&[]), None);
    }

    #[test]
    fn slices_read_the_curves_and_leave_out_who_does_not_reach() {
        let other = |time, error| Record { solver: "soft_step", ..record(8, 4, time, error) };
        let records = [
            record(8, 1, 10.0, 0.5),
            record(8, 2, 40.0, 0.03125),
            other(30.0, 0.25),
            Record { solver: "projection", ..record(8, 1, 5.0, 3.0) },
        ];
        // pgs: error = 50/t². The other two are points, and that of soft_step is at a round time.
        let time = equal_time(&records, ErrorAxis::Penetration).unwrap();
        assert_eq!((time.scene.as_str(), time.unit, time.at), ("stack:2", "m", 30e3));
        assert!((time.values[0].1.unwrap()[0] - 50.0 / 900.0).abs() < 1e-12);
        assert_eq!(time.values[1..], [("soft_step", Some([0.25, 0.0])), ("projection", None)]);
        assert_eq!(time.best(), ["pgs"]);
        let error = equal_error(&records, ErrorAxis::Penetration).unwrap();
        assert!(
            (error.values[0].1.unwrap()[0] / 1e3 - (50.0 / (100.0 * error.at)).sqrt() * 10.0).abs() < 1e-9
        );
        assert_eq!(equal_time(&records, ErrorAxis::Truth), None);
    }

    #[test]
    fn noise_makes_a_tie() {
        let slice = |values: &[[f64; 2]]| {
            let names = ["a", "b", "c"];
            let values = names.into_iter().zip(values).map(|(n, &v)| (n, Some(v))).collect();
            Slice { scene: String::new(), at: 1.0, unit: "m", values }.best()
        };
        assert_eq!(slice(&[[100.0, 0.0], [102.0, 0.0], [104.0, 0.0]]), ["a", "b"]);
        assert_eq!(slice(&[[100.0, 0.0], [110.0, 6.0], [104.0, 0.0]]), ["a", "b"]);
        assert!(slice(&[]).is_empty());
    }
}
