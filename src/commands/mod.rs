//! Commands of the program, a file each: arguments in, files and text out.

pub mod advise;
pub mod capture;
pub mod converge;
pub mod verify;

use crate::error::Error;
use crate::scenes::{self, Scene};
use std::fs;
use std::io::Write;
use std::path::Path;

/// A scene by its name in the catalogue, or from a JSON file.
///
/// What has a separator or ends in `.json` is a path; everything else is a name.
fn scene(text: &str) -> Result<Scene, Error> {
    if text.contains(['/', '\\']) || text.ends_with(".json") {
        Scene::from_file(text)
    } else {
        Ok(scenes::load(text)?.scene)
    }
}

/// Writes a file as a whole: a reader sees the old file or the new one, never a part.
fn write_whole(path: &Path, text: &str) -> Result<(), Error> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    // Temporary files are private by default; this one becomes an ordinary file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(Error::io(path))?;
    file.write_all(text.as_bytes()).map_err(Error::io(path))?;
    file.persist(path).map_err(|e| e.error).map_err(Error::io(path))?;
    Ok(())
}

/// Makes a folder and those above it.
fn make_folder(path: &Path) -> Result<(), Error> {
    fs::create_dir_all(path).map_err(Error::io(path))
}
