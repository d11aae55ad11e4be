//! Time against error of a solver's settings: the curves of a work-precision diagram.

use super::Record;
use crate::engine::params::Budget;
use crate::engine::world::Order;
use crate::lab::scenes::tolerance::{Tolerance, Tolerances};

/// Smaller errors are raised to this value, because logarithms need positive numbers.
pub const ERROR_FLOOR: f64 = 1e-8;

/// An error to compare with time. Rankings differ between errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorAxis {
    /// The penetration as defined by [`Errors::penetration`](crate::lab::metrics::Errors::penetration): the
    /// visible error.
    Penetration,
    /// The contact-law residual: root mean square, relative to the weight of the lighter body. The
    /// mathematical error.
    Law,
    /// The distance to the reference value: the physical error.
    Truth,
    /// The remaining speed in a scene that should come to rest: jitter.
    Rest,
}

impl ErrorAxis {
    /// The axes of tables and plots, in order.
    pub const ALL: [ErrorAxis; 3] = [ErrorAxis::Penetration, ErrorAxis::Law, ErrorAxis::Truth];

    /// All errors that decide whether a setting is good enough.
    pub const JUDGED: [ErrorAxis; 4] =
        [ErrorAxis::Penetration, ErrorAxis::Law, ErrorAxis::Truth, ErrorAxis::Rest];

    /// The tolerance of this error; `None` if the scene does not limit it.
    pub fn tolerance(self, tolerances: &Tolerances) -> Option<Tolerance> {
        match self {
            ErrorAxis::Penetration => Some(tolerances.penetration),
            ErrorAxis::Law => Some(tolerances.residual),
            ErrorAxis::Truth => tolerances.truth,
            ErrorAxis::Rest => tolerances.rest,
        }
    }

    /// Name for headings.
    pub fn name(self) -> &'static str {
        match self {
            ErrorAxis::Penetration => "penetration",
            ErrorAxis::Law => "contact-law residual",
            ErrorAxis::Truth => "distance to reference value",
            ErrorAxis::Rest => "speed at rest",
        }
    }

    /// The error of a record. `None` if the run failed, if the scene has no reference value, or if the run
    /// never reached the observed event.
    pub fn of(self, record: &Record) -> Option<f64> {
        match self {
            ErrorAxis::Penetration => Some(record.errors?.penetration(record.tolerances.rest.is_some())),
            ErrorAxis::Law => Some(record.errors?.law_rms_lighter()),
            ErrorAxis::Truth => record.truth?.error,
            ErrorAxis::Rest => {
                // The extended run of a minute is more reliable than the short run: unrest grows with time.
                let run = record.errors?.rest_velocity();
                Some(record.later.and_then(|later| later.rest_speed_m_s).unwrap_or(run))
            }
        }
    }

    /// The unit of this error in the records of a scene.
    pub fn unit(self, records: &[Record]) -> &'static str {
        match self {
            ErrorAxis::Penetration => "m",
            ErrorAxis::Law => "",
            ErrorAxis::Rest => "m/s",
            ErrorAxis::Truth => records.iter().find_map(|r| r.truth).map_or("", |t| t.unit),
        }
    }
}

/// A setting: a solver, an order and a budget, at its fastest lane width.
#[derive(Clone, Copy, Debug)]
pub struct SettingSample<'a> {
    /// Its record.
    pub record: &'a Record,
    /// Index of the budget among the solver's budgets, in the order in which they were tried.
    pub budget: usize,
    /// Time of a step (ns).
    pub time: f64,
    /// The error, at least [`ERROR_FLOOR`].
    pub error: f64,
}

/// The settings of a solver on one scene.
///
/// The settings are separate runs, so curves are not interpolated.
#[derive(Clone, Debug)]
pub struct Curve<'a> {
    /// Name of the solver.
    pub solver: &'static str,
    /// The settings. Those that do not hold or have no such error are left out.
    pub samples: Vec<SettingSample<'a>>,
}

/// Budgets of a solver with their parameters, in the order in which they were tried.
pub fn budgets_of<'a>(records: &'a [Record], solver: &str) -> Vec<(Budget, &'a str)> {
    let mut budgets = Vec::new();
    for record in records.iter().filter(|r| r.solver == solver) {
        let own = (record.budget, record.parameters.as_str());
        if !budgets.contains(&own) {
            budgets.push(own);
        }
    }
    budgets
}

/// Solvers, in the order in which they were tried.
pub fn solvers_of(records: &[Record]) -> Vec<&'static str> {
    let mut solvers = Vec::new();
    for record in records {
        if !solvers.contains(&record.solver) {
            solvers.push(record.solver);
        }
    }
    solvers
}

/// The curves of one scene, one per solver: every order and budget that holds, at its fastest width.
pub fn curves(records: &[Record], axis: ErrorAxis) -> Vec<Curve<'_>> {
    let curve = |solver: &'static str| {
        let own = || records.iter().filter(|r| r.solver == solver);
        let mut samples: Vec<SettingSample> = Vec::new();
        for (budget, value) in budgets_of(records, solver).iter().enumerate() {
            for order in Order::ALL {
                let same = |r: &&Record| (r.budget, r.parameters.as_str()) == *value && r.order == order;
                let widths = own().filter(same);
                let timed = widths.filter(|r| r.holds()).filter_map(|record| {
                    let (sample, error) = (record.sample.as_ref()?, axis.of(record)?);
                    Some(SettingSample {
                        record,
                        budget,
                        time: sample.cost_ns(),
                        error: error.max(ERROR_FLOOR),
                    })
                });
                samples.extend(timed.min_by(|a, b| a.time.total_cmp(&b.time)));
            }
        }
        Curve { solver, samples }
    };
    solvers_of(records).into_iter().map(curve).collect()
}

impl<'a> Curve<'a> {
    /// The Pareto-optimal settings of the solver in time and error, the fastest first.
    pub fn front(&self) -> Vec<SettingSample<'a>> {
        let mut sorted = self.samples.clone();
        sorted.sort_by(|a, b| a.time.total_cmp(&b.time).then(a.error.total_cmp(&b.error)));
        let mut least = f64::INFINITY;
        sorted.retain(|s| {
            let is_better = s.error < least;
            least = least.min(s.error);
            is_better
        });
        sorted
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    /// Records of `pgs` with times (µs) and errors (m).
    fn settings(samples: &[(f64, f64)]) -> Vec<Record> {
        samples.iter().zip(1..).map(|(&(time, error), substeps)| record(8, substeps, time, error)).collect()
    }

    fn at(sample: Option<SettingSample>) -> Option<(f64, f64)> {
        sample.map(|s| (s.time / 1e3, s.error))
    }

    #[test]
    fn a_larger_budget_need_not_be_slower_or_better() {
        let records = settings(&[(10.0, 0.1), (30.0, 0.4), (8.0, 0.01), (8.0, 0.02), (20.0, 0.01)]);
        let found = curves(&records, ErrorAxis::Penetration);
        let c = &found[0];
        let front: Vec<_> = c.front().into_iter().map(|s| at(Some(s)).unwrap()).collect();
        assert_eq!(front, [(8.0, 0.01)]);
    }

    #[test]
    fn a_curve_has_the_fastest_width_of_each_budget_in_each_order() {
        let natural = Record { order: Order::Natural, ..record(1, 1, 5.0, 0.7) };
        let records =
            [natural, record(1, 1, 20.0, 0.5), record(8, 1, 10.0, 0.5), record(8, 2, 30.0, 0.0), failed(8)];
        let records: Vec<Record> = records.into_iter().chain([fell(8, 4, 1.0, 0.0)]).collect();
        let found = curves(&records, ErrorAxis::Penetration);
        let samples: Vec<_> = found[0].samples.iter().map(|s| (s.budget, s.time, s.error)).collect();
        assert_eq!(samples, [(0, 5e3, 0.7), (0, 10e3, 0.5), (1, 30e3, ERROR_FLOOR)]);
        assert!(curves(&records, ErrorAxis::Truth)[0].samples.is_empty());
        let (law, unit) = (ErrorAxis::Law.of(&records[0]), ErrorAxis::Penetration.unit(&records));
        assert_eq!((law, unit), (Some(0.0), "m"));
    }
}
