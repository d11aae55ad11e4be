//! `study.json`: everything that a study chose and measured, written and read back.

use super::environment::Environment;
use super::export::settings;
use crate::lab::error::Error;
use crate::lab::study::{Record, StudyPlan};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Name of the file in a study's folder.
pub const NAME: &str = "study.json";

/// A study: whole, cut short, or put together.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StudyFile {
    /// Where it ran; of a study that was put together, where its first part did.
    pub environment: Environment,
    /// Everything that was chosen.
    pub settings: Value,
    /// Scenes of the plan that have no records, because the study was interrupted or is a part of one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing_scenes: Vec<String>,
    /// What it was put together from. Times are comparable within a part only.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
    /// A record per setting, scene by scene.
    pub records: Vec<Record>,
}

/// A part of a study that was put together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Where it ran.
    pub environment: Environment,
    /// Its scenes.
    pub scenes: Vec<String>,
}

impl StudyFile {
    /// A study that ran here, without some of its scenes.
    pub fn new(plan: &StudyPlan, records: Vec<Record>, missing_scenes: Vec<String>) -> Self {
        StudyFile {
            environment: Environment::current(),
            settings: settings(plan),
            missing_scenes,
            parts: Vec::new(),
            records,
        }
    }

    /// The scenes that have records, in their order.
    pub fn scenes(&self) -> Vec<String> {
        self.records.chunk_by(|a, b| a.scene == b.scene).map(|scene| scene[0].scene.clone()).collect()
    }

    /// What a reader must know first: scenes that are missing, times of several machines. Empty for a
    /// whole study.
    pub fn caution(&self) -> String {
        let mut text = String::new();
        if !self.missing_scenes.is_empty() {
            text += &format!("PARTIAL: without {}\n", self.missing_scenes.join(", "));
        }
        if self.parts.len() > 1 {
            text += &format!(
                "Times come from {} runs; each scene was timed in one of them, and times of different scenes \
                 are not comparable.\n",
                self.parts.len()
            );
        }
        text
    }

    /// The text of the file.
    pub fn to_json(&self) -> Result<Vec<u8>, Error> {
        serde_json::to_vec_pretty(self).map_err(|e| Error::invalid(NAME, e.to_string()))
    }

    /// Reads the study of a folder, or a file.
    ///
    /// Errors: no such file, or one that is no study, with line and column.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let path: PathBuf = if path.is_dir() { path.join(NAME) } else { path.into() };
        let text = std::fs::read(&path).map_err(Error::io(&path))?;
        serde_json::from_slice(&text).map_err(|e| Error::Format { path, message: e.to_string() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn a_study_comes_back_with_the_same_bits() {
        let plan = StudyPlan { scenes: vec!["stack:2".into(), "arch".into()], ..StudyPlan::default() };
        let mut records = vec![record(8, 1, 10.25, 0.1 + 0.2), fell(8, 2, 3.0, 1e-300), failed(4)];
        if let Some(sample) = &mut records[0].lap {
            sample.blocks_ns = vec![vec![10.5, f64::NAN], vec![7.0]];
        }
        let study = StudyFile::new(&plan, records, vec!["arch".into()]);
        assert_eq!(study.caution(), "PARTIAL: without arch\n");
        let text = study.to_json().unwrap();
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(NAME), &text).unwrap();
        let back = StudyFile::read(folder.path()).unwrap();
        assert_eq!(back.to_json().unwrap(), text);
        assert_eq!(format!("{:?}", back.records[0].errors), format!("{:?}", study.records[0].errors));
        assert!(back.records[0].lap.as_ref().unwrap().blocks_ns[0][1].is_nan());
    }

    #[test]
    fn what_is_no_study_is_refused_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        std::fs::write(&path, "{\"records\": [\n{}]}").unwrap();
        let message = StudyFile::read(&path).unwrap_err().to_string();
        assert!(message.contains("x.json") && message.contains("line 2"), "{message}");
        assert!(StudyFile::read(folder.path()).unwrap_err().to_string().contains(NAME));
    }
}
