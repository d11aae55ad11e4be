//! Reports: from [`Record`]s to tables, files and pages. Nothing here runs a simulation.

#[doc(hidden)]
pub mod answer;
#[doc(hidden)]
pub mod by_scene;
pub mod columns;
#[doc(hidden)]
pub mod doc;
pub mod ensemble;
pub mod environment;
#[doc(hidden)]
pub mod html;
pub mod study_file;
#[doc(hidden)]
pub mod style;
#[doc(hidden)]
pub mod sweep;
#[doc(hidden)]
pub mod table;
pub use crate::lab::units;

use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::study::{Record, found};
use doc::DocBlock;
use std::path::{Path, PathBuf};
use study_file::StudyFile;

/// Files of a study, besides its recordings.
const FILES: [&str; 7] =
    ["tables.txt", "study.csv", ensemble::NAME, study_file::NAME, found::NAME, html::NAME, "figures"];

/// Moves the study that a folder holds to `previous/N` below it, with the first free number N, so that no study
/// is ever overwritten. Returns the new place; `None` if the folder holds no study.
pub fn keep_previous(folder: &Path) -> Result<Option<PathBuf>, Error> {
    if !folder.join(study_file::NAME).exists() {
        return Ok(None);
    }
    let mut numbered = (1..).map(|n: u32| folder.join("previous").join(n.to_string()));
    let Some(place) = numbered.find(|place| !place.exists()) else { return Ok(None) };
    std::fs::create_dir_all(&place).map_err(Error::io(&place))?;
    let entries = std::fs::read_dir(folder).map_err(Error::io(folder))?;
    for name in entries.filter_map(|entry| Some(entry.ok()?.file_name())) {
        let text = name.to_string_lossy();
        if FILES.contains(&&*text) || (text.starts_with("replay-") && text.ends_with(".rec")) {
            let path = folder.join(&name);
            std::fs::rename(&path, place.join(&name)).map_err(Error::io(&path))?;
        }
    }
    Ok(Some(place))
}

/// All tables of a study: per scene; without a sweep also what fails later, the performance profiles, and what treatments
/// of contacts change.
pub fn tables(records: &[Record]) -> String {
    let mut text = format!("{}\n", by_scene::LEGEND);
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        let (table, notes) = by_scene::scene_table(scene);
        text += &format!("{}{notes}{}\n", table.text(), sweep::reached(scene));
    }
    if sweep::is_sweep(records) {
        return text;
    }
    let tables = [answer::fail_later(records), by_scene::profile_table(records)];
    let tables = tables.into_iter().chain(by_scene::treatment_tables(records)).map(DocBlock::Table);
    text + &doc::text(&tables.collect::<Vec<_>>())
}

/// Writes `tables.txt`, `study.csv`, `tidy.csv` and `study.json` into `folder`, and the [page](html) made from these and the
/// folder's other files. Returns their paths. Everything except the page is prepared before the first file is written.
pub fn write_study(folder: &Path, study: &StudyFile) -> Result<Vec<PathBuf>, Error> {
    let contents = [
        ("tables.txt", tables(&study.records).into_bytes()),
        ("study.csv", columns::study_csv(&study.records, &study.environment)?),
        (ensemble::NAME, ensemble::csv(&study.records)?),
        (study_file::NAME, study.to_json()?),
    ];
    files::prepare_folder(folder)?;
    let mut paths = Vec::new();
    for (name, bytes) in contents {
        paths.push(folder.join(name));
        files::write(&folder.join(name), &bytes)?;
    }
    paths.push(html::write(folder, study)?);
    Ok(paths)
}
