//! Solver parameters by name: `contact_hertz=60`.
//!
//! Several solvers often run together. An override applies to those that have the parameter, and must apply
//! to at least one.

use crate::engine::params::Parameters;
use crate::engine::solvers::{VARIANTS, Variant};
use crate::lab::error::Error;
use std::str::FromStr;

/// A parameter's name and its value.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Override {
    /// Name of the parameter, as in [`Variant::parameters`].
    pub name: String,
    /// Value in the parameter's own unit.
    pub value: f32,
}

impl FromStr for Override {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let refuse = || Error::invalid("set", format!("'{text}' is not NAME=VALUE"));
        let (name, value) = text.split_once('=').ok_or_else(refuse)?;
        let value = value.trim().parse().map_err(|_| refuse())?;
        Ok(Override { name: name.trim().replace('-', "_"), value })
    }
}

/// Checks overrides. Errors: a parameter that none of the solvers has, a value out of its range.
pub fn check(solvers: &[&'static Variant], overrides: &[Override]) -> Result<(), Error> {
    for given in overrides {
        if solvers.iter().all(|v| v.parameter(&given.name).is_err()) {
            let having: Vec<&str> =
                VARIANTS.iter().filter(|v| v.parameter(&given.name).is_ok()).map(|v| v.name).collect();
            if !having.is_empty() {
                let without: Vec<&str> = solvers.iter().map(|v| v.name).collect();
                let (without, having) = (without.join(", "), having.join(", "));
                let message = format!("not a parameter of {without}; solvers that have it: {having}");
                return Err(Error::invalid(given.name.as_str(), message));
            }
            let known = VARIANTS.iter().flat_map(|v| v.parameters).map(|p| p.name);
            return Err(Error::unknown("parameter", &given.name, known));
        }
    }
    solvers.iter().try_for_each(|v| values(v, overrides).map(drop))
}

/// A line for each override that some of the solvers do not have, with the names of these solvers.
pub fn partly(solvers: &[&'static Variant], overrides: &[Override]) -> String {
    let line = |given: &Override| {
        let without: Vec<&str> =
            solvers.iter().filter(|v| v.parameter(&given.name).is_err()).map(|v| v.name).collect();
        (!without.is_empty()).then(|| format!("{} has no effect on {}\n", given.name, without.join(", ")))
    };
    overrides.iter().filter_map(line).collect()
}

/// The parameter values of `variant` with the overrides that apply to it.
pub fn values(variant: &Variant, overrides: &[Override]) -> Result<Parameters, Error> {
    let mut values = variant.defaults();
    for Override { name, value } in overrides.iter().filter(|o| variant.parameter(&o.name).is_ok()) {
        variant.set(&mut values, name, *value)?;
    }
    Ok(values)
}

/// Differences from the default values, for tables: `contact_hertz 60 Hz`; empty if there are none.
pub fn brief(variant: &Variant, values: &Parameters) -> String {
    let changed = variant.parameters.iter().zip(values).filter(|(p, value)| p.default != **value);
    let texts = changed.map(|(p, value)| format!("{} {value} {}", p.name, p.unit).trim_end().to_string());
    texts.collect::<Vec<_>>().join(", ")
}

/// Differences from the default values, in the format of [`of_words`].
pub fn changed(variant: &Variant, values: &Parameters) -> String {
    let changed = variant.parameters.iter().zip(values).filter(|(p, value)| p.default != **value);
    changed.map(|(p, value)| format!("{}={value}", p.name)).collect::<Vec<_>>().join(" ")
}

/// All values as text: `contact_hertz=30 contact_damping_ratio=10`.
pub fn words(variant: &Variant, values: &Parameters) -> String {
    let each = variant.parameters.iter().zip(values).map(|(p, value)| format!("{}={value}", p.name));
    each.collect::<Vec<_>>().join(" ")
}

/// Parses the text of [`words`]. Values that are not listed are the defaults.
///
/// Errors: an unknown parameter, a value out of its range.
pub fn of_words(variant: &Variant, words: &str) -> Result<Parameters, Error> {
    let mut values = variant.defaults();
    for word in words.split_whitespace() {
        let Override { name, value } = word.parse()?;
        variant.set(&mut values, &name, value)?;
    }
    Ok(values)
}

/// All values by name.
pub fn by_name(variant: &Variant, values: &Parameters) -> serde_json::Map<String, serde_json::Value> {
    let each = variant.parameters.iter().zip(values);
    each.map(|(p, &value)| (p.name.to_string(), decimal(value))).collect()
}

/// An `f32` as the shortest decimal that identifies it.
pub fn decimal(value: f32) -> serde_json::Value {
    value.to_string().parse::<f64>().map_or(serde_json::Value::Null, Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::solvers::find;

    #[test]
    fn overrides_reach_the_solvers_that_have_them() {
        let (soft, pgs) = (find("soft_step").unwrap(), find("pgs").unwrap());
        let list: Vec<Override> =
            ["contact-hertz=60", " baumgarte = 0.5"].iter().map(|t| t.parse().unwrap()).collect();
        check(&[soft, pgs], &list).unwrap();
        assert_eq!(brief(soft, &values(soft, &list).unwrap()), "contact_hertz 60 Hz");
        assert_eq!(brief(pgs, &values(pgs, &list).unwrap()), "baumgarte 0.5");
        assert!(check(&[pgs], &list).unwrap_err().to_string().contains("soft_step"));
        assert_eq!(by_name(pgs, &values(pgs, &list).unwrap())["baumgarte"], 0.5);
        for variant in VARIANTS {
            let mut values = variant.defaults();
            values[..variant.parameters.len()].iter_mut().for_each(|v| *v *= 0.7);
            let words = words(variant, &values);
            // Values below a range are rejected; the others are read back with the same bits.
            assert!(of_words(variant, &words).map_or(true, |back| back == values), "{words}");
        }
        assert_eq!(of_words(soft, "contact_hertz=60").unwrap(), values(soft, &list).unwrap());
        assert!(of_words(soft, "penalty=3").is_err());
    }

    #[test]
    fn what_is_no_override_is_refused_with_its_text() {
        for text in ["contact_hertz", "contact_hertz=", "contact_hertz=much", ""] {
            let message = text.parse::<Override>().unwrap_err().to_string();
            assert!(message.contains(&format!("'{text}'")), "{message}");
        }
        let soft = find("soft_step").unwrap();
        let out = Override { name: "contact_hertz".into(), value: -3.0 };
        assert!(check(&[soft], &[out]).unwrap_err().to_string().contains("-3"));
    }
}
