//! `simpulse report`: rebuilds the page of a study from its records.

use super::output::print;
use crate::lab::error::Error;
use crate::lab::report::html;
use crate::lab::report::study_file::StudyFile;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Rebuild the page of a study from its records
///
/// Reads study.json of the folder and, if present, verify.json (`simpulse verify --json > DIR/verify.json`) and the
/// recordings; writes report.html.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of a study
    #[arg(value_name = "DIR", default_value = "results")]
    pub folder: PathBuf,
}

/// Runs the command.
pub fn run(args: &ReportArgs) -> Result<ExitCode, Error> {
    print(&format!("wrote {}\n", html::write(&args.folder, &StudyFile::read(&args.folder)?)?.display()))
}
