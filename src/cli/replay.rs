//! `simpulse replay`: recordings side by side on one page.

use super::output::print_beside;
use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::recording::page::{MOST, RecordingPanel, page};
use crate::lab::recording::read::{Recording, read_file};
use crate::lab::report::style::Style;
use clap::Args;
use std::path::PathBuf;
use std::process::ExitCode;

/// Make a page that plays recordings side by side
///
/// `simpulse run SCENE --record FILE` makes a recording. The page is one file that needs no network:
/// play, pause, step, scrub, zoom with the wheel, drag; the error curves run under the picture.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  simpulse run stack:12 --solver pgs --record pgs.rec --record-contacts
  simpulse run stack:12 --solver soft_step --record soft.rec --record-contacts
  simpulse replay pgs.rec soft.rec -o replay.html")]
pub struct ReplayArgs {
    /// Recordings, at most four
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,
    /// Page to write
    #[arg(short, long = "out", alias = "output", value_name = "FILE.html", default_value = "replay.html")]
    pub output: PathBuf,
}

/// Runs the command.
pub fn run(args: &ReplayArgs) -> Result<ExitCode, Error> {
    if args.files.len() > MOST {
        return Err(Error::invalid("replay", format!("{} recordings, at most {MOST} fit", args.files.len())));
    }
    let read = args.files.iter().map(|path| read_file(path)).collect::<Result<Vec<_>, _>>()?;
    let panel = |(bytes, recording): &'_ (Vec<u8>, Recording)| RecordingPanel {
        bytes: bytes.clone(),
        header: recording.header.clone(),
        color: Style::of(&recording.header.solver).color.to_string(),
    };
    let panels: Vec<RecordingPanel> = read.iter().map(panel).collect();
    let text = page(&panels);
    files::write(&args.output, text.as_bytes())?;
    let size = text.len().div_ceil(1024);
    let plural = if panels.len() == 1 { "" } else { "s" };
    let text = format!("wrote {} ({} recording{plural}, {size} KiB)\n", args.output.display(), panels.len());
    print_beside([args.output.as_path()], &text)
}
