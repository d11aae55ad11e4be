//! The settings of a pane in `--solvers`: `soft_step:substeps=8:contact_hertz=60`.

use crate::cli::values::{SettingArgs, frozen};
use crate::engine::constraints::Impacts;
use crate::engine::solvers::{Variant, find};
use crate::engine::workers::MOST_THREADS;
use crate::engine::world::Settings;
use crate::lab::error::Error;
use crate::lab::study::budget;
use clap::builder::{NonEmptyStringValueParser, TypedValueParser};

/// A solver, and what differs from the settings of all panes.
#[derive(Clone, Debug)]
pub struct PaneArg {
    solver: &'static Variant,
    /// Names and values.
    words: Vec<(String, String)>,
}

/// The parser of an element of `--solvers`.
pub fn pane() -> impl TypedValueParser<Value = PaneArg> {
    NonEmptyStringValueParser::new().try_map(|text| parse(&text))
}

fn parse(text: &str) -> Result<PaneArg, Error> {
    let mut parts = text.split(':');
    let solver = find(parts.next().unwrap_or_default())?;
    let word = |part: &str| match part.split_once('=') {
        Some((name, value)) => Ok((name.trim().replace('-', "_"), value.trim().to_string())),
        None => Err(Error::invalid("solvers", format!("'{part}' in '{text}' is not NAME=VALUE"))),
    };
    let pane = PaneArg { solver, words: parts.map(word).collect::<Result<_, Error>>()? };
    // Refused before anything runs.
    pane.settings(&SettingArgs::standard()?)?;
    Ok(pane)
}

impl PaneArg {
    /// The settings of the pane. Errors: a name that the solver does not have, a value out of its range.
    pub fn settings(&self, all: &SettingArgs) -> Result<Settings, Error> {
        let mut settings = SettingArgs { solver: self.solver, ..all.clone() }.settings()?;
        for (name, value) in &self.words {
            let refuse = |what: &str| Error::invalid(name.as_str(), format!("'{value}' is not {what}"));
            let count = || value.parse::<u32>().map_err(|_| refuse("a whole number"));
            match name.strip_suffix("_iterations").unwrap_or(name) {
                "substeps" => settings.budget.substeps = count()?,
                "threads" => {
                    let most = MOST_THREADS as u32;
                    let threads = Some(count()?).filter(|count| (1..=most).contains(count));
                    settings.threads = threads.ok_or_else(|| refuse(&format!("1 to {most}")))? as usize;
                }
                kind @ ("velocity" | "relax" | "position") => {
                    budget::check_used(&format!("{kind}-iterations"), &[self.solver])?;
                    let budget = &mut settings.budget;
                    *match kind {
                        "velocity" => &mut budget.velocity_iterations,
                        "relax" => &mut budget.relax_iterations,
                        _ => &mut budget.position_iterations,
                    } = count()?;
                }
                "frozen" => settings.frozen = frozen(value)?,
                "impacts" => {
                    let found = Impacts::ALL.into_iter().find(|impacts| impacts.name() == value);
                    settings.impacts = found.ok_or_else(|| refuse("own, waves or none"))?;
                }
                _ => {
                    let value = value.parse().map_err(|_| refuse("a number"))?;
                    self.solver.set(&mut settings.parameters, name, value)?;
                }
            }
        }
        budget::check(&settings.budget, self.solver)?;
        Ok(settings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pane_has_settings_of_its_own() {
        let of = |text| parse(text).and_then(|pane| pane.settings(&SettingArgs::standard()?));
        let soft = of("soft_step:substeps=8:contact-hertz=60:relax=2:frozen=off:impacts=waves").unwrap();
        assert_eq!((soft.budget.substeps, soft.budget.relax_iterations), (8, 2));
        let place = soft.solver.parameter("contact_hertz").unwrap();
        assert_eq!((soft.parameters[place], soft.impacts), (60.0, Impacts::Waves));
        for (text, part) in [
            ("softstep", "softstep"),
            ("soft_step:8", "'8'"),
            ("soft_step:substeps=0", "0"),
            ("soft_step:substeps=x", "'x'"),
            ("pgs:relax=2", "no such sweeps"),
            ("pgs:contact_hertz=60", "contact_hertz"),
            ("soft_step:contact_hertz=-1", "-1"),
            ("soft_step:impacts=some", "'some'"),
            ("soft_step:threads=0", "'0'"),
            ("soft_step:frozen=some", "'some'"),
        ] {
            let message = of(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
