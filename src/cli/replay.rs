//! `simpulse replay`: recordings side by side on one page.

use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::recording::page::{MOST, Panel, page};
use crate::lab::recording::read::read_file;
use crate::lab::report::style::Style;
use clap::Args;
use std::path::PathBuf;

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
    #[arg(short, long, value_name = "FILE.html", default_value = "replay.html")]
    pub output: PathBuf,
}

/// Runs the command; what it prints.
pub fn run(args: &ReplayArgs) -> Result<String, Error> {
    if args.files.len() > MOST {
        return Err(Error::invalid("replay", format!("{} recordings, at most {MOST} fit", args.files.len())));
    }
    let read = args.files.iter().map(|path| read_file(path)).collect::<Result<Vec<_>, _>>()?;
    let panel = |(bytes, recording): &'_ (Vec<u8>, crate::lab::recording::read::Recording)| {
        let color = Style::of(&recording.header.solver).color.to_string();
        (bytes.clone(), recording.header.clone(), color)
    };
    let owned: Vec<_> = read.iter().map(panel).collect();
    let panels: Vec<Panel> = owned
        .iter()
        .map(|(bytes, header, color)| Panel { bytes, header, color: color.clone() })
        .collect();
    let text = page(&panels);
    files::write(&args.output, text.as_bytes())?;
    let size = text.len().div_ceil(1024);
    Ok(format!("wrote {} ({} recordings, {size} KiB)\n", args.output.display(), panels.len()))
}
