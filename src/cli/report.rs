//! `simpulse report`: the page of a study, from its records.

use crate::lab::error::Error;
use crate::lab::report::html;
use clap::Args;
use std::path::PathBuf;

/// Make the page of a study again, from its records
///
/// Reads study.json of the folder, and if they are there verify.json (`simpulse verify --json`) and
/// the recordings of the study; writes report.html.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of a study
    #[arg(value_name = "DIR", default_value = "results")]
    pub folder: PathBuf,
}

/// Runs the command; what it prints.
pub fn run(args: &ReportArgs) -> Result<String, Error> {
    Ok(format!("wrote {}\n", html::write(&args.folder)?.display()))
}
