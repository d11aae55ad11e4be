//! Frozen problems: files with contact problems and their certified solutions.
//!
//! # Format
//!
//! UTF-8 text of two lines. Each line is a JSON object that ends with a line feed. The first is the header:
//!
//! ```text
//! {"format":"simpulse-frozen","version":1}
//! ```
//!
//! | key | meaning |
//! |---|---|
//! | `format` | always `simpulse-frozen` |
//! | `version` | 1, or 2 with joints; readers reject larger ones |
//!
//! Other keys, such as those of earlier versions, are ignored.
//!
//! The second line is the payload. Units are SI; vectors are arrays (x, y); velocities of bodies are
//! arrays (vx, vy, w); pairs are arrays (normal, tangential), with t = (n_y, −n_x).
//!
//! | key | meaning |
//! |---|---|
//! | `problem.name` | description of the problem |
//! | `problem.h` | step (s) |
//! | `problem.bodies[]` | non-static bodies: `inv_mass` (1/kg), `inv_inertia` (1/(kg·m²)), `velocity` before the step, `free_velocity` v* after the step without contacts |
//! | `problem.contacts[]` | contact points: `body_a`, `body_b` (index, or null for static), `manifold`, `normal` (from a to b), `arm_a`, `arm_b` (r × n, r × t; m), `gap` (m, negative is overlap), `friction`, `rebound` (m/s), `warm_impulse` (N·s) |
//! | `problem.joints[]` | version 2: joints in the order of solving: `body_a`, `body_b`, `reach` (\|r_a\|, \|r_b\|; m), `blocks` |
//! | `….blocks[]` | rows solved together: `law` and one to three `rows` |
//! | `….law` | `"rigid"`, `"limit"`, `{"motor":{"speed","cap"}}` or `{"spring":{"stiffness","damping","cap"}}`: u (m/s or rad/s), F h (N·s or N·m·s), S (1/s), D (1); a spring without `cap` has no bound |
//! | `….rows[]` | `axis` d (a unit vector, or zero for an angle), `arm_a`, `arm_b` (r × d in m, or 1), `error` C (m or rad), `warm_impulse` (N·s or N·m·s) |
//! | `reference` | null, or the solution of the rigid law |
//! | `reference.velocities[]` | v⁺ of every body |
//! | `reference.impulses[]` | (λn, λt) of every contact (N·s), then (λ, 0) of every joint row |
//! | `reference.certificate` | `method`, `natural_map`, `witness` (null, or `method`, `natural_map`, `distance`), `uniqueness` |
//!
//! Numbers are decimal in the shortest form that reads back as the same `f64`, so writing and reading keep
//! every bit. A file is rejected if it is truncated or newer, or if its reference does not solve its problem. Rows, blocks and laws are derived in [`super::joints`].

use super::certify::Reference;
use super::problem::ContactProblem;
use crate::lab::error::Error;
use crate::lab::files;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// Value of `format` in the header.
const FORMAT: &str = "simpulse-frozen";
/// Newest version that this crate reads, used for problems with joints. Others have version 1.
const VERSION: u64 = 2;

/// A contact problem with its solution, if it is known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Frozen {
    /// The problem.
    pub problem: ContactProblem,
    /// Its certified solution.
    pub reference: Option<Reference>,
}

impl Frozen {
    /// The text of the file. Errors: an invalid problem, or a reference that does not hold.
    pub fn to_text(&self) -> Result<String, Error> {
        self.validate()?;
        let payload = serde_json::to_string(self).map_err(|e| Error::invalid("payload", e.to_string()))?;
        Ok(format!("{{\"format\":\"{FORMAT}\",\"version\":{}}}\n{payload}\n", self.version()))
    }

    /// Parses the text of a file. Errors name `path`.
    pub fn from_text(text: &str, path: &Path) -> Result<Self, Error> {
        let refuse = |message: String| Error::Format { path: path.into(), message };
        let (first, payload) = text.split_once('\n').unwrap_or((text, ""));
        // Format and version are checked first, because the rest depends on them.
        let header: serde_json::Value = serde_json::from_str(first)
            .map_err(|e| refuse(format!("not a frozen problem: the first line is no JSON header ({e})")))?;
        if header["format"] != FORMAT {
            return Err(refuse(format!(
                "not a frozen problem: format is {}, not \"{FORMAT}\"",
                header["format"]
            )));
        }
        let version = match header["version"].as_u64() {
            Some(v) if v > VERSION => {
                return Err(refuse(format!(
                    "version {v} is newer than {VERSION}, the newest this program reads"
                )));
            }
            Some(v @ 1..) => v,
            _ => return Err(refuse(format!("version is {}, must be 1 or {VERSION}", header["version"]))),
        };
        let frozen: Frozen = serde_json::from_str(payload).map_err(|e| refuse(format!("payload: {e}")))?;
        if version != frozen.version() {
            let message = format!("version is {version}, but that of its problem is {}", frozen.version());
            return Err(refuse(message));
        }
        frozen.validate().map_err(|e| refuse(e.to_string()))?;
        Ok(frozen)
    }

    /// Writes the file atomically: readers see the old file or the new one, never a part.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        files::write(path, self.to_text()?.as_bytes())
    }

    /// Reads a file.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = fs::read(path).map_err(Error::io(path))?;
        let text = std::str::from_utf8(&bytes).map_err(|e| Error::Format {
            path: path.into(),
            message: format!("not a frozen problem: not UTF-8 at byte {}", e.valid_up_to()),
        })?;
        Self::from_text(text, path)
    }

    fn version(&self) -> u64 {
        if self.problem.joints.is_empty() { 1 } else { VERSION }
    }

    fn validate(&self) -> Result<(), Error> {
        self.problem.validate()?;
        match &self.reference {
            Some(reference) => reference.check(&self.problem).map_err(|why| Error::invalid("reference", why)),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::reference::certify::reference;
    use crate::lab::reference::gallery::{box_pyramid, sliding_box};

    fn sample() -> Frozen {
        let problem = sliding_box();
        let reference = Some(reference(&problem).unwrap());
        Frozen { problem, reference }
    }

    fn refusal(text: &str) -> String {
        Frozen::from_text(text, Path::new("some/file.frozen")).unwrap_err().to_string()
    }

    #[test]
    fn every_bit_survives() {
        let mut f = sample();
        f.problem.contacts[0].warm_impulse = [-0.0, 5e-324];
        f.problem.contacts[1].gap = -0.1 - f64::EPSILON;
        f.reference = None;
        let back = Frozen::from_text(&f.to_text().unwrap(), Path::new("x")).unwrap();
        assert_eq!(back, f);
        assert!(back.problem.contacts[0].warm_impulse[0].is_sign_negative());
        for problem in [box_pyramid(3, 0.6), sliding_box()] {
            let f = Frozen { reference: Some(reference(&problem).unwrap()), problem };
            assert_eq!(Frozen::from_text(&f.to_text().unwrap(), Path::new("x")).unwrap(), f);
        }
    }

    #[test]
    fn every_truncation_is_refused() {
        let text = sample().to_text().unwrap();
        // The last byte is an optional line feed.
        for end in (0..text.len() - 1).filter(|&i| text.is_char_boundary(i)) {
            assert!(refusal(&text[..end]).starts_with("some/file.frozen: "), "{end}");
        }
    }

    #[test]
    fn other_files_and_newer_versions_are_refused() {
        let text = sample().to_text().unwrap();
        let newer = text.replacen("\"version\":1", "\"version\":3", 1);
        assert!(refusal(&newer).contains("version 3 is newer"));
        let with_joints = text.replacen("\"version\":1", "\"version\":2", 1);
        assert!(refusal(&with_joints).contains("version is 2, but that of its problem is 1"));
        assert!(refusal(&text.replacen("\"version\":1", "\"version\":0", 1)).contains("version is 0"));
        assert!(refusal("").contains("not a frozen problem"));
        assert!(refusal("{}\n{}\n").contains("not a frozen problem"));
        assert!(refusal("[1]\n").contains("not a frozen problem"));
        assert!(refusal(&(text.clone() + "{}")).contains("payload: trailing characters"));
    }

    #[test]
    fn bad_problems_are_neither_written_nor_read() {
        let mut f = sample();
        f.problem.contacts[0].gap = f64::NAN;
        assert!(f.to_text().unwrap_err().to_string().contains("contacts[0]"));
        let mut f = sample();
        f.problem.contacts[1].body_b = Some(7);
        assert!(f.to_text().unwrap_err().to_string().contains("names body 7 of 1"));
        let mut f = sample();
        f.problem.contacts[0].friction = 0.4;
        assert!(f.to_text().unwrap_err().to_string().contains("natural-map"));
    }

    #[test]
    fn files_are_written_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.frozen");
        sample().write(&path).unwrap();
        sample().write(&path).unwrap();
        assert_eq!(Frozen::read(&path).unwrap(), sample());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        assert!(Frozen::read(&folder.path().join("b")).unwrap_err().to_string().contains('b'));
        assert!(sample().write(&folder.path().join("no/such")).is_err());
        fs::write(&path, [0xff, 0xfe]).unwrap();
        assert!(Frozen::read(&path).unwrap_err().to_string().contains("UTF-8"));
    }
}
