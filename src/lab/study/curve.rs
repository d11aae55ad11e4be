//! Errors to compare with time.

use super::Record;
use crate::lab::scenes::tolerance::{Tolerance, Tolerances};

/// Smaller errors are raised to this value, because logarithms need positive numbers.
pub const ERROR_FLOOR: f64 = 1e-8;

/// An error to compare with time. Rankings differ between errors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorAxis {
    /// The penetration as defined by [`Errors::penetration`](crate::lab::metrics::Errors::penetration): the
    /// visible error.
    Penetration,
    /// The force error, that is the residual of the contact law: root mean square, relative to the weight of the lighter
    /// body. The mathematical error.
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
            ErrorAxis::Penetration => "overlap",
            ErrorAxis::Law => "force error",
            ErrorAxis::Truth => "distance to reference value",
            ErrorAxis::Rest => "speed at rest",
        }
    }

    /// Name for tables.
    pub fn word(self) -> &'static str {
        match self {
            ErrorAxis::Penetration => "overlap",
            ErrorAxis::Law => "force error",
            ErrorAxis::Truth => "reference",
            ErrorAxis::Rest => "rest speed",
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

    /// The unit in which this error is shown; `%` of values that are fractions.
    pub fn unit(self, records: &[Record]) -> &'static str {
        match self {
            ErrorAxis::Penetration => "m",
            ErrorAxis::Law => "%",
            ErrorAxis::Rest => "m/s",
            ErrorAxis::Truth => records.iter().find_map(|r| r.truth).map_or("", |t| t.unit),
        }
    }
}

/// The values without duplicates, in order.
pub fn distinct<T: PartialEq>(values: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut kept = Vec::new();
    for value in values {
        if !kept.contains(&value) {
            kept.push(value);
        }
    }
    kept
}

/// Solvers, in the order in which they were tried.
pub fn solvers_of(records: &[Record]) -> Vec<&'static str> {
    distinct(records.iter().map(|r| r.solver))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::record;

    #[test]
    fn an_error_is_in_its_own_unit() {
        let records = [record(8, 1, 20.0, 0.5)];
        let (law, unit) = (ErrorAxis::Law.of(&records[0]), ErrorAxis::Penetration.unit(&records));
        assert_eq!((law, unit), (Some(0.0), "m"));
    }
}
