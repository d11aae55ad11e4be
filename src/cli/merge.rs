//! `simpulse merge`: merges the parts of a study.

use super::output::print;
use super::study;
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::report;
use crate::lab::report::html;
use crate::lab::report::study_file::StudyFile;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Merge the parts of a study
///
/// `study --shard I/N` runs every N-th scene, so that a study can be spread over N machines or jobs. Scenes are never
/// split, so all times of a scene come from one machine; the result names the machines.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse study --shard 1/2 --out part-1      on one machine
  simpulse study --shard 2/2 --out part-2      on another
  simpulse merge part-1 part-2 --out results")]
pub struct MergeArgs {
    /// Folders of the parts, or their study.json files
    #[arg(value_name = "PART", required = true)]
    pub parts: Vec<PathBuf>,
    /// Merge even if scenes are missing
    #[arg(long)]
    pub partial: bool,
    /// Print the tables of every scene after the answer
    #[arg(long)]
    pub verbose: bool,
    /// Print JSON instead of text: what study.json holds
    #[arg(long)]
    pub json: bool,
    /// Folder for the results
    #[arg(long, default_value = "results", value_name = "FOLDER")]
    pub out: PathBuf,
}

/// Runs the command.
pub fn run(args: &MergeArgs) -> Result<ExitCode, Error> {
    let parts = args.parts.iter().map(|path| StudyFile::read(path)).collect::<Result<Vec<_>, _>>()?;
    let names: Vec<String> = args.parts.iter().map(|path| path.display().to_string()).collect();
    let whole = StudyFile::merged(parts, &names)?;
    if !whole.missing_scenes.is_empty() && !args.partial {
        let missing = whole.missing_scenes.join(", ");
        let message = format!("no part has {missing}; --partial merges without it");
        return Err(Error::invalid("merge", message));
    }
    files::prepare_folder(&args.out)?;
    let _lock = files::Lock::of(&args.out)?;
    // Remove recordings of another study.
    html::write_recordings(&args.out, &[])?;
    let paths = report::write_study(&args.out, &whole)?;
    if args.json {
        return print(&String::from_utf8_lossy(&whole.to_json()?));
    }
    let steps = whole.settings["steps"].as_u64().map(|steps| steps as u32);
    print(&study::text(&whole, steps, &args.out, &paths, args.verbose))
}
