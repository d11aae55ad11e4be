//! Limits on a setting, with units, and how far a run exceeds them.

use crate::lab::metrics::Errors;
use crate::lab::study::TruthError;

/// Limits that a setting has to meet; `None` means no limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Limits {
    /// Penetration (m), see [`Errors::penetration`].
    #[serde(rename = "penetration_m")]
    pub penetration: Option<f64>,
    /// Time of a step (ns).
    pub time_ns: Option<f64>,
    /// Distance to the reference value, in its unit.
    #[serde(rename = "reference")]
    pub truth: Option<f64>,
    /// Contact-law residual, root mean square, as a multiple of the lighter body's weight × step (1).
    pub residual: Option<f64>,
    /// Speed over the last second, where the scene has to rest (m/s).
    #[serde(rename = "rest_speed_m_s")]
    pub rest: Option<f64>,
}

impl Limits {
    /// The largest error ÷ limit: all limits are met if it is at most 1. A reference value that was not
    /// reached counts as infinitely far.
    pub fn of_errors(&self, errors: &Errors, truth: Option<&TruthError>) -> f64 {
        let distance = truth.and_then(|t| t.error).unwrap_or(f64::INFINITY);
        let pairs = [
            (errors.penetration(self.rest.is_some()), self.penetration),
            (errors.law_rms_lighter(), self.residual),
            (errors.rest_velocity(), self.rest),
            (distance, self.truth),
        ];
        pairs.into_iter().fold(0.0, |worst: f64, (value, limit)| worst.max(in_limits(value, limit)))
    }

    /// Time (ns) ÷ its limit.
    pub fn of_time(&self, time_ns: f64) -> f64 {
        in_limits(time_ns, self.time_ns)
    }
}

/// value ÷ limit; 0 without a limit, and for a value of 0 even if the limit is 0.
fn in_limits(value: f64, limit: Option<f64>) -> f64 {
    match limit {
        Some(limit) if value > 0.0 => value / limit,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_limit_counts() {
        let errors =
            Errors::default().with("held_depth_p99_m", 2e-3).with("residual_rms_lighter_weights", 0.5);
        let truth = TruthError { quantity: "", unit: "m", expected: 0.0, error: Some(3.0) };
        let limits = Limits { penetration: Some(1e-3), residual: Some(1.0), ..Limits::default() };
        assert_eq!(limits.of_errors(&errors, None), 2.0);
        assert_eq!(Limits { truth: Some(1.0), ..limits }.of_errors(&errors, Some(&truth)), 3.0);
        assert_eq!(Limits { truth: Some(1.0), ..limits }.of_errors(&errors, None), f64::INFINITY);
        assert_eq!(Limits::default().of_errors(&errors, Some(&truth)), 0.0);
        let timed = Limits { time_ns: Some(10.0), ..limits };
        assert_eq!([timed.of_time(5.0), limits.of_time(5.0)], [0.5, 0.0]);
        let nothing = Limits { penetration: Some(0.0), ..Limits::default() };
        assert_eq!(nothing.of_errors(&Errors::default(), None), 0.0);
    }
}
