//! Time against error along a solver's budgets: the curves of a work-precision diagram.

use super::Record;
use crate::engine::params::Budget;
use crate::engine::world::Order;

/// Errors below this count as this: a logarithm has no zero.
pub const ERROR_FLOOR: f64 = 1e-8;

/// An error to weigh time against. Rankings differ between them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorAxis {
    /// The deepest penetration: what people see.
    Penetration,
    /// The contact-law residual, root mean square: the mathematics.
    Law,
    /// The distance to the truth: the physics.
    Truth,
}

impl ErrorAxis {
    /// All of them, in the order of tables and plots.
    pub const ALL: [ErrorAxis; 3] = [ErrorAxis::Penetration, ErrorAxis::Law, ErrorAxis::Truth];

    /// For headings.
    pub fn name(self) -> &'static str {
        match self {
            ErrorAxis::Penetration => "deepest penetration",
            ErrorAxis::Law => "contact-law residual",
            ErrorAxis::Truth => "distance to truth",
        }
    }

    /// The error of a record; none if it failed, or where no truth is known or came to be seen.
    pub fn of(self, record: &Record) -> Option<f64> {
        match self {
            ErrorAxis::Penetration => Some(record.errors?.penetration_max),
            ErrorAxis::Law => Some(record.errors?.law_rms),
            ErrorAxis::Truth => record.truth?.error,
        }
    }

    /// The unit of that error in the records of a scene.
    pub fn unit(self, records: &[Record]) -> &'static str {
        match self {
            ErrorAxis::Penetration => "m",
            ErrorAxis::Law => "",
            ErrorAxis::Truth => records.iter().find_map(|r| r.truth).map_or("", |t| t.unit),
        }
    }
}

/// One budget of a solver at its fastest lane width.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Which of the solver's budgets, in the order in which they were tried.
    pub budget: usize,
    /// Time of a step (ns).
    pub time: f64,
    /// Spread of that time (ns).
    pub spread: f64,
    /// At least [`ERROR_FLOOR`].
    pub error: f64,
}

/// A solver on one scene, sample by sample along its budgets.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Name of the solver.
    pub solver: &'static str,
    /// Budgets that failed, or have no such error, are left out.
    pub samples: Vec<Sample>,
}

/// Budgets of a solver in the order in which they were tried.
pub fn budgets_of(records: &[Record], solver: &str) -> Vec<Budget> {
    let mut budgets = Vec::new();
    for record in records.iter().filter(|r| r.solver == solver) {
        if !budgets.contains(&record.budget) {
            budgets.push(record.budget);
        }
    }
    budgets
}

/// Solvers in the order in which they were tried.
pub fn solvers_of(records: &[Record]) -> Vec<&'static str> {
    let mut solvers = Vec::new();
    for record in records {
        if !solvers.contains(&record.solver) {
            solvers.push(record.solver);
        }
    }
    solvers
}

/// The curves of one scene, one per solver, of coloured settings where there are any, else
/// of natural ones.
pub fn curves(records: &[Record], axis: ErrorAxis) -> Vec<Curve> {
    let colored = records.iter().any(|r| r.order == Order::Colored);
    let order = if colored { Order::Colored } else { Order::Natural };
    let sample = |solver: &str, budget: usize, value: &Budget| {
        let widths = records.iter().filter(|r| r.solver == solver && r.budget == *value && r.order == order);
        let found = widths.filter_map(|r| Some((r.lap.as_ref()?, axis.of(r)?)));
        let (lap, error) = found.min_by(|a, b| a.0.median_ns.total_cmp(&b.0.median_ns))?;
        Some(Sample { budget, time: lap.median_ns, spread: lap.spread_ns, error: error.max(ERROR_FLOOR) })
    };
    let curve = |solver: &'static str| {
        let budgets = budgets_of(records, solver);
        let samples = budgets.iter().enumerate().filter_map(|(i, b)| sample(solver, i, b));
        Curve { solver, samples: samples.collect() }
    };
    solvers_of(records).into_iter().map(curve).collect()
}

impl Curve {
    /// The least error that the curve has at this time (ns); none outside its budgets. Between
    /// neighbouring budgets it is a line of the logarithms.
    pub fn error_at(&self, time: f64) -> Option<f64> {
        self.cross(time, |s| [s.time, s.error]).map(|(error, _)| error)
    }

    /// The least time (ns) at which the curve has this error, with the larger spread of the
    /// two samples around it (ns).
    pub fn time_to(&self, error: f64) -> Option<[f64; 2]> {
        let (time, [a, b]) = self.cross(error, |s| [s.error, s.time])?;
        Some([time, a.spread.max(b.spread)])
    }

    /// The least ordinate at the abscissa `x`: between neighbouring budgets a curve is a line of
    /// the logarithms. A curve may come by more than once, since a larger budget is not
    /// always slower or more exact; none where it does not come by.
    fn cross(&self, x: f64, axes: impl Fn(&Sample) -> [f64; 2]) -> Option<(f64, [Sample; 2])> {
        let alone = self.samples.iter().map(|&s| [s, s]);
        let pieces = self.samples.windows(2).map(|w| [w[0], w[1]]).chain(alone);
        let crossing = |[a, b]: [Sample; 2]| {
            let ([x0, y0], [x1, y1]) = (axes(&a), axes(&b));
            if !(x0.min(x1)..=x0.max(x1)).contains(&x) {
                return None;
            }
            // A piece that runs along the ordinate is at its better end.
            let along =
                if x0 == x1 { if y0 <= y1 { 0.0 } else { 1.0 } } else { (x / x0).ln() / (x1 / x0).ln() };
            Some((y0 * (y1 / y0).powf(along), [a, b]))
        };
        pieces.filter_map(crossing).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, record};

    /// A curve through (time, error), without spread.
    pub fn curve(samples: &[(f64, f64)]) -> Curve {
        let sample =
            |(budget, &(time, error)): (usize, &(f64, f64))| Sample { budget, time, spread: 0.0, error };
        Curve { solver: "pgs", samples: samples.iter().enumerate().map(sample).collect() }
    }

    fn close(value: Option<f64>, expected: f64) -> bool {
        value.is_some_and(|v| (v / expected - 1.0).abs() < 1e-12)
    }

    #[test]
    fn logarithms_are_interpolated() {
        // Error falls with the square of time: 1 at 10, 1/100 at 100.
        let c = curve(&[(10.0, 1.0), (100.0, 0.01)]);
        assert!(close(c.error_at(20.0), 0.25) && close(c.time_to(0.25).map(|t| t[0]), 20.0));
        assert!(close(c.error_at(10.0), 1.0) && close(c.error_at(100.0), 0.01));
        assert_eq!((c.error_at(9.9), c.error_at(101.0)), (None, None));
        assert_eq!((c.time_to(1.1), c.time_to(0.0099)), (None, None));
    }

    #[test]
    fn of_several_crossings_the_best_counts() {
        // The second budget is slower and worse, the third as the first but better.
        let c = curve(&[(10.0, 0.1), (30.0, 0.4), (10.0, 0.01)]);
        assert!(close(c.error_at(10.0), 0.01));
        assert!(close(c.time_to(0.1).map(|t| t[0]), 10.0));
        // One budget is a point, and an upright piece is its lower end.
        assert_eq!(curve(&[(10.0, 0.1)]).error_at(10.0), Some(0.1));
        assert_eq!(curve(&[(10.0, 0.1), (10.0, 0.2)]).error_at(10.0), Some(0.1));
        assert_eq!(curve(&[]).error_at(1.0), None);
    }

    #[test]
    fn a_curve_has_the_fastest_width_of_each_budget() {
        let records = [record(1, 1, 20.0, 0.5), record(8, 1, 10.0, 0.5), record(8, 2, 30.0, 0.0), failed(8)];
        let found = curves(&records, ErrorAxis::Penetration);
        assert_eq!(found, [curve(&[(10e3, 0.5), (30e3, ERROR_FLOOR)])]);
        assert_eq!(curves(&records, ErrorAxis::Truth), [curve(&[])]);
        let (law, unit) = (ErrorAxis::Law.of(&records[0]), ErrorAxis::Penetration.unit(&records));
        assert_eq!((law, unit), (Some(0.0), "m"));
    }
}
