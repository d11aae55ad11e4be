//! From [`Record`]s to tables, files and a picture. Nothing here runs a simulation.

pub(crate) mod axes;
pub mod environment;
pub mod export;
pub mod html;
pub mod plot;
pub mod profiles;
pub mod reading;
pub mod style;
pub mod table;
pub use crate::lab::units;

use crate::lab::error::Error;
use crate::lab::files;
use crate::lab::study::ablation::NeedCost;
use crate::lab::study::{Record, StudyPlan};
use environment::Environment;
use std::path::{Path, PathBuf};

/// Everything that a study prints.
pub fn text(records: &[Record], ablation: &[NeedCost]) -> String {
    let mut text = String::new();
    for scene in records.chunk_by(|a, b| a.scene == b.scene) {
        text += &table::scene_table(scene);
        text += "\n";
    }
    text += table::LEGEND;
    let ablation = table::ablation_table(ablation);
    if !ablation.is_empty() {
        text += &format!("\n{ablation}");
    }
    let slices = profiles::slice_tables(records);
    let profiles = profiles::profile_table(records);
    text + "\n" + &slices + "\n" + &profiles + "\n" + &reading::reading(records)
}

/// Writes `study.csv`, `study.json`, `speed_vs_error.svg` and `profiles.svg` into `folder`, and the
/// [page](html) made from what is there then; returns their paths.
///
/// All but the page are made before the first is written.
pub fn write_study(
    folder: &Path,
    plan: &StudyPlan,
    records: &[Record],
    ablation: &[NeedCost],
) -> Result<Vec<PathBuf>, Error> {
    let environment = Environment::current();
    let contents = [
        ("study.csv", export::csv(records)?),
        ("study.json", export::json(&environment, plan, records, ablation)?),
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
    paths.push(html::write(folder)?);
    Ok(paths)
}
