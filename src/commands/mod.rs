//! Commands of the program, a file each: arguments in, files and text out.

pub mod advise;
pub mod capture;
pub mod converge;
pub mod verify;

use crate::error::Error;
use crate::scenes::{self, Scene};

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
