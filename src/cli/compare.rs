//! `simpulse compare`: lists what became better or worse between two studies.

use super::output::{print, print_json, value};
use crate::lab::compare::{self, CompareOptions};
use crate::lab::error::Error;
use crate::lab::report::study_file::StudyFile;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Compare two studies: of two commits, machines or settings
///
/// Pairs the settings that both studies have and lists scenes that no longer hold, and errors and
/// times that changed beyond the noise. Exit code 1 if anything became worse by more than the threshold.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse study --out before          then change something
  simpulse study --out after
  simpulse compare before after
  simpulse compare before after --threshold 20% --relative    on another machine
  simpulse compare before after --all --json > changes.json")]
pub struct CompareArgs {
    /// Folder of the first study, or its study.json
    #[arg(value_name = "BEFORE")]
    pub before: PathBuf,
    /// Folder of the second study, or its study.json
    #[arg(value_name = "AFTER")]
    pub after: PathBuf,
    /// Smallest increase of a time or an error that counts as a regression, such as 0.1 or 10%
    #[arg(long, default_value = "5%", value_name = "SHARE", value_parser = share)]
    pub threshold: f64,
    /// Compare times relative to the median change: for studies from different machines
    #[arg(long)]
    pub relative: bool,
    /// Print every change
    #[arg(long)]
    pub all: bool,
    /// Print JSON instead of text: every setting
    #[arg(long)]
    pub json: bool,
}

fn share(text: &str) -> Result<f64, String> {
    let refused = || format!("'{text}' is not a share: give a number above 0, such as 0.1 or 10%");
    let value = match text.strip_suffix('%') {
        Some(percent) => percent.trim().parse::<f64>().map(|p| p / 100.0),
        None => text.parse(),
    };
    value.ok().filter(|v| *v > 0.0 && v.is_finite()).ok_or_else(refused)
}

/// Runs the command.
pub fn run(args: &CompareArgs) -> Result<ExitCode, Error> {
    let (before, after) = (StudyFile::read(&args.before)?, StudyFile::read(&args.after)?);
    let options = CompareOptions { threshold: args.threshold, relative: args.relative };
    let found = compare::compare(&before, &after, &options);
    if found.pairs.is_empty() {
        let message =
            format!("{} and {} have no setting in common", args.before.display(), args.after.display());
        return Err(Error::invalid("compare", message));
    }
    if args.json {
        print_json(&value(&found)?)?;
    } else {
        print(&(before.caution() + &after.caution() + &compare::text::text(&found, args.all)))?;
    }
    Ok(if found.regressed() { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

#[cfg(test)]
mod tests {
    use super::share;

    #[test]
    fn shares_are_numbers_or_percents() {
        assert_eq!((share("0.1"), share("10%"), share("2.5 %")), (Ok(0.1), Ok(0.1), Ok(0.025)));
        for bad in ["", "%", "-1", "0", "x%", "inf", "NaN"] {
            assert!(share(bad).is_err_and(|e| e.contains(bad)), "{bad}");
        }
    }
}
