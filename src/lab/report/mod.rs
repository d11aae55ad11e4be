//! From [`Record`]s to tables, files and a picture. Nothing here runs a simulation.

pub mod answer;
pub(crate) mod axes;
pub mod columns;
pub mod environment;
pub mod export;
pub mod html;
pub mod plot;
pub mod profiles;
pub mod savings;
pub mod study_file;
pub mod style;
pub mod table;
pub use crate::lab::units;

use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::study::Record;
use std::path::{Path, PathBuf};
use study_file::StudyFile;

/// Everything that a study measured, as tables: per scene, in equal time and to equal error, and the
/// performance profiles.
pub fn tables(records: &[Record]) -> String {
    let mut text = format!("{}\n", table::LEGEND);
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        text += &table::scene_table(scene);
        text += "\n";
    }
    let (slices, profiles) = (profiles::slice_tables(records), profiles::profile_table(records));
    text + &slices + "\n" + &profiles
}

/// Writes `tables.txt`, `study.csv`, `study.json`, `speed_vs_error.svg` and `profiles.svg` into
/// `folder`, and the [page](html) made from them and what else is there; returns their paths.
///
/// All but the page are made before the first is written.
pub fn write_study(folder: &Path, study: &StudyFile) -> Result<Vec<PathBuf>, Error> {
    let records = &study.records;
    let contents = [
        ("tables.txt", tables(records).into_bytes()),
        ("study.csv", export::csv(records)?),
        ("study.json", study.to_json()?),
        ("speed_vs_error.svg", plot::svg(records)?.into_bytes()),
        ("profiles.svg", profiles::svg(records)?.into_bytes()),
    ];
    files::prepare_folder(folder)?;
    let mut paths = Vec::new();
    for (name, bytes) in contents {
        let path = folder.join(name);
        files::write(&path, &bytes)?;
        paths.push(path);
    }
    paths.push(html::write(folder, study)?);
    Ok(paths)
}
