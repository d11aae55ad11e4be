//! What is asked of a setting: limits with units, and how far a run is over them.

use crate::lab::error::Error;
use crate::lab::metrics::Errors;
use crate::lab::study::TruthError;

/// Limits that a setting has to keep; where none, anything will do.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct Limits {
    /// Deepest penetration (m).
    pub penetration: Option<f64>,
    /// Time of a step (ns).
    pub time_ns: Option<f64>,
    /// Distance to the truth, in the truth's unit.
    pub truth: Option<f64>,
    /// Contact-law residual, root mean square in body weights (1).
    pub residual: Option<f64>,
}

impl Limits {
    /// The largest of the errors in their limits: up to 1 is within all of them. A truth
    /// that was not reached is infinitely far.
    pub fn of_errors(&self, errors: &Errors, truth: Option<&TruthError>) -> f64 {
        let distance = truth.and_then(|t| t.error).unwrap_or(f64::INFINITY);
        let pairs = [
            (errors.penetration_max, self.penetration),
            (errors.law_rms_body, self.residual),
            (distance, self.truth),
        ];
        pairs.into_iter().fold(0.0, |worst: f64, (value, limit)| worst.max(in_limits(value, limit)))
    }

    /// The time (ns) in its limit.
    pub fn of_time(&self, time_ns: f64) -> f64 {
        in_limits(time_ns, self.time_ns)
    }
}

/// value/limit, where nothing of a limit of nothing is nothing.
fn in_limits(value: f64, limit: Option<f64>) -> f64 {
    match limit {
        Some(limit) if value > 0.0 => value / limit,
        _ => 0.0,
    }
}

const LENGTHS: [(&str, f64); 7] =
    [("nm", 1e-9), ("um", 1e-6), ("µm", 1e-6), ("μm", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

const TIMES: [(&str, f64); 6] =
    [("ns", 1e-9), ("us", 1e-6), ("µs", 1e-6), ("μs", 1e-6), ("ms", 1e-3), ("s", 1.0)];

/// A limit of the option `option` in `unit`: lengths (`m`) and times (`s`) need one of their
/// units behind the number, other quantities may have just their own.
///
/// Errors: what is no number ≥ 0, or has another unit.
pub fn quantity(option: &str, text: &str, unit: &str) -> Result<f64, Error> {
    let refused = |why: String| Err(Error::invalid(option, format!("'{text}' {why}")));
    let own = [(unit, 1.0), ("", 1.0)];
    let units: &[(&str, f64)] = match unit {
        "m" => &LENGTHS,
        "s" => &TIMES,
        _ => &own,
    };
    let text = text.trim();
    // What may stand in a number ends at the first letter that is not an exponent.
    let is_number = |part: &str| part.trim().parse::<f64>().is_ok();
    let Some(split) = (1..=text.len()).rev().find(|&i| text.is_char_boundary(i) && is_number(&text[..i]))
    else {
        return refused("is not a number with a unit".to_string());
    };
    let (number, given) = (text[..split].trim(), text[split..].trim());
    let Some((_, factor)) = units.iter().find(|(name, _)| *name == given) else {
        let known: Vec<&str> = units.iter().map(|u| u.0).filter(|u| !u.is_empty()).collect();
        let which =
            if given.is_empty() { "has no unit".to_string() } else { format!("has the unit '{given}'") };
        return refused(match known[..] {
            [] => format!("{which}, but needs none"),
            [only] => format!("{which}, but needs {only}"),
            _ => format!("{which}, but needs one of {}", known.join(", ")),
        });
    };
    match number.parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(value * factor),
        _ => refused("must be a finite number that is not negative".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read() {
        let length = |text| quantity("x", text, "m").unwrap();
        assert_eq!(
            [length("1mm"), length("250 um"), length("2e-3m"), length("1.5cm")],
            [1e-3, 250.0 * 1e-6, 2e-3, 0.015]
        );
        assert_eq!([length("3µm"), length("3μm"), length("0nm")], [3.0 * 1e-6, 3.0 * 1e-6, 0.0]);
        assert_eq!(quantity("x", "500us", "s").unwrap(), 500.0 * 1e-6);
        assert_eq!(quantity("x", "1e-3", "").unwrap(), 1e-3);
        assert_eq!([quantity("x", "5", "N").unwrap(), quantity("x", "5 N", "N").unwrap()], [5.0, 5.0]);
    }

    #[test]
    fn what_cannot_be_read_is_named() {
        let message = |text, unit| quantity("max-x", text, unit).unwrap_err().to_string();
        for (text, unit, part) in [
            ("5", "m", "'5' has no unit, but needs one of nm, um"),
            ("5parsec", "m", "'parsec'"),
            ("5us", "m", "'us'"),
            ("1mm", "s", "'mm'"),
            ("-1mm", "m", "'-1mm'"),
            ("infm", "m", "'infm'"),
            ("nan", "", "'nan'"),
            ("mm", "m", "'mm' is not a number"),
            ("", "m", "''"),
            ("1%", "", "'%', but needs none"),
            ("5 m", "N", "'m', but needs N"),
        ] {
            let text = message(text, unit);
            assert!(text.starts_with("max-x: ") && text.contains(part), "{text} / {part}");
        }
    }

    #[test]
    fn the_worst_limit_counts() {
        let errors = Errors { penetration_max: 2e-3, law_rms_body: 0.5, ..Errors::default() };
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
