//! `study.json`: all settings and measurements of a study, written and read back.

use super::columns::{OLDEST_SCHEMA, SCHEMA};
use super::environment::Environment;
use crate::engine::solvers::Variant;
use crate::lab::error::Error;
use crate::lab::overrides;
use crate::lab::study::curve::distinct;
use crate::lab::study::{Record, StudyPlan, search};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Name of the file in a study's folder.
pub const NAME: &str = "study.json";

/// A study: complete, interrupted, or merged.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StudyFile {
    /// [`SCHEMA`]
    pub schema_version: u32,
    /// Where the study ran; for a merged study, where its first part ran.
    pub environment: Environment,
    /// The command that ran it; empty if it was not the command line.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub command: String,
    /// All settings of the study.
    pub settings: Value,
    /// Scenes of the plan without records, because the study was interrupted or is a part of another.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub missing_scenes: Vec<String>,
    /// The parts, if the study was merged. Times are comparable only within a part.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<ShardInfo>,
    /// A record per setting, scene by scene.
    pub records: Vec<Record>,
}

/// A part of a merged study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardInfo {
    /// Where the part ran.
    pub environment: Environment,
    /// Scenes of the part.
    pub scenes: Vec<String>,
}

/// All settings of a study. Constants and the solvers' standard budgets are those of the commit.
pub fn settings(plan: &StudyPlan) -> Value {
    let solver = |v: &&'static Variant| {
        let parameters = overrides::values(v, &plan.overrides).map(|values| overrides::by_name(v, &values));
        json!({"name": v.name, "parameters": parameters.unwrap_or_default()})
    };
    json!({
        "scenes": plan.scenes,
        "solvers": plan.solvers.iter().map(solver).collect::<Vec<_>>(),
        "lanes": plan.widths.iter().map(|w| w.lanes()).collect::<Vec<_>>(),
        "orders": plan.orders,
        "impacts": plan.impacts,
        "frozen": plan.frozen.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "budgets": plan.budgets,
        "budget_search": plan.searched().then(|| json!({"rule": search::rule(), "not_searched": plan.not_searched()})),
        "steps": plan.steps,
        "timing_steps": plan.timing_steps,
        "repeats": plan.repeats,
        "set": plan.overrides,
        "sweep": plan.sweep,
        "tolerance": plan.tolerances,
        "found_to_rest": plan.rests,
        "seed": plan.seed,
        "poke": plan.poke,
        "errors_only": plan.errors_only,
        "share": plan.share,
    })
}

/// The settings with different values in two studies: name, and both values as short text.
pub fn differing_settings(one: &Value, other: &Value) -> Vec<(String, [String; 2])> {
    let maps = [one, other].map(|settings| settings.as_object().cloned().unwrap_or_default());
    let names: BTreeSet<&String> = maps.iter().flat_map(|map| map.keys()).collect();
    let short = |value: Option<&Value>| {
        let text = value.map_or("–".to_string(), Value::to_string);
        if text.chars().count() > 80 { "…".to_string() } else { text }
    };
    let differs = |name: &&String| maps[0].get(*name) != maps[1].get(*name);
    let of = |name: &String| (name.clone(), maps.each_ref().map(|map| short(map.get(name))));
    names.into_iter().filter(differs).map(of).collect()
}

impl StudyFile {
    /// A study that ran on this machine; `missing_scenes` are the scenes that did not run.
    pub fn new(plan: &StudyPlan, records: Vec<Record>, missing_scenes: Vec<String>) -> Self {
        StudyFile {
            schema_version: SCHEMA,
            environment: Environment::current(),
            command: String::new(),
            settings: settings(plan),
            missing_scenes,
            parts: Vec::new(),
            records,
        }
    }

    /// Its parts; itself if it was not merged.
    fn all_parts(&self) -> Vec<ShardInfo> {
        match self.parts.is_empty() {
            true => vec![ShardInfo { environment: self.environment.clone(), scenes: self.scenes() }],
            false => self.parts.clone(),
        }
    }

    /// Merges parts with the same settings into one study; `names` are the names of the parts in errors.
    ///
    /// Errors: no parts; parts with different settings, or of programs with other lanes or other rounding; a scene in two
    /// parts.
    pub fn merged(parts: Vec<StudyFile>, names: &[String]) -> Result<Self, Error> {
        let Some(first) = parts.first() else { return Err(Error::invalid("merge", "no parts given")) };
        let mut whole =
            StudyFile { missing_scenes: Vec::new(), parts: Vec::new(), records: Vec::new(), ..first.clone() };
        let mut found: Vec<(String, &String)> = Vec::new();
        for (part, name) in parts.iter().zip(names) {
            let differs =
                |(name, _): &(String, [String; 2])| !["scenes", "budget_search", "share"].contains(&&**name);
            if differing_settings(&part.settings, &first.settings).iter().any(differs) {
                let message = format!("{name} was run with different settings than {}", names[0]);
                return Err(Error::invalid("merge", message));
            }
            let builds = [part, first].map(|study| study.environment.build());
            if builds[0] != builds[1] {
                let message = format!(
                    "{name} comes from a program {}, {} from one {}: their results differ; build both for the same processor",
                    builds[0], names[0], builds[1]
                );
                return Err(Error::invalid("merge", message));
            }
            // Errors of a scene may come from several parts, those of a solver on it from one.
            for key in part.units() {
                if let Some((_, other)) = found.iter().find(|(known, _)| *known == key) {
                    return Err(Error::invalid("merge", format!("{key} is in {other} and in {name}")));
                }
                found.push((key, name));
            }
            whole.parts.extend(part.all_parts().into_iter().filter(|part| !part.scenes.is_empty()));
        }
        // Scenes that a part did not finish, and scenes that no part had in its plan.
        let finished = |name: &String| {
            let mut own = parts.iter().filter(|p| names_in(&p.settings["scenes"]).contains(name));
            own.any(|p| !p.missing_scenes.contains(name))
        };
        let missing = parts.iter().flat_map(|p| p.missing_scenes.clone());
        whole.missing_scenes = distinct(missing.filter(|name| !finished(name)));
        let lists = |of: fn(&Value) -> &Value| {
            let all = parts.iter().flat_map(|p| names_in(of(&p.settings)));
            Value::from(distinct(all))
        };
        whole.settings["scenes"] = lists(|settings| &settings["scenes"]);
        if whole.settings["budget_search"].is_object() {
            let others = lists(|settings| &settings["budget_search"]["not_searched"]);
            whole.settings["budget_search"]["not_searched"] = others;
        }
        whole.settings["share"] = Value::Null;
        whole.records = parts.into_iter().flat_map(|part| part.records).collect();
        if whole.errors_only() {
            // Scene by scene, in the order of the plan of the first part.
            let place = |record: &Record| {
                found.iter().position(|(key, _)| key.starts_with(&format!("{} ", record.scene)))
            };
            whole.records.sort_by_key(|record| place(record));
        }
        Ok(whole)
    }

    /// Whether it has no times.
    pub fn errors_only(&self) -> bool {
        self.settings["errors_only"] == true
    }

    /// What no other part may have: its scenes or, without times, its pairs of scene and solver.
    fn units(&self) -> Vec<String> {
        if !self.errors_only() {
            return self.scenes();
        }
        distinct(self.records.iter().map(|r| format!("{} under {}", r.scene, r.solver)))
    }

    /// The number of steps to which runs were limited, if they were.
    pub fn steps(&self) -> Option<u32> {
        self.settings["steps"].as_u64().map(|steps| steps as u32)
    }

    /// The scenes that have records, in order.
    pub fn scenes(&self) -> Vec<String> {
        self.records.chunk_by(|a, b| a.scene == b.scene).map(|scene| scene[0].scene.clone()).collect()
    }

    /// A paragraph on how the settings were chosen; empty if the caller chose them.
    pub fn budgets(&self) -> String {
        let search = &self.settings["budget_search"];
        let Some(rule) = search["rule"].as_str() else { return String::new() };
        let (scenes, others) = (names_in(&self.settings["scenes"]), names_in(&search["not_searched"]));
        let mut text = String::new();
        if scenes.iter().any(|name| !others.contains(name)) {
            text += &format!("Budgets: searched among {rule}.\n");
        }
        if !others.is_empty() {
            text += &format!(
                "Not searched for every solver (half, once and twice the standard budget instead; --thorough searches): {}.\n",
                others.join(", ")
            );
        }
        text
    }

    /// Warnings to show first: missing scenes, times from several machines. Empty for a complete study.
    pub fn caution(&self) -> String {
        let mut text = String::new();
        if !self.missing_scenes.is_empty() {
            text += &format!("PARTIAL: without {}\n", self.missing_scenes.join(", "));
        }
        if self.parts.len() > 1 && !self.errors_only() {
            text += &format!(
                "Times come from {} runs; each scene was timed in one of them, and times of different scenes \
                 are not comparable.\n",
                self.parts.len()
            );
        }
        text
    }

    /// Contents of the file, one record per line.
    pub fn to_json(&self) -> Result<Vec<u8>, Error> {
        let failed = |e: serde_json::Error| Error::invalid(NAME, e.to_string());
        let head = StudyFile { schema_version: SCHEMA, records: Vec::new(), ..self.clone() };
        let head = serde_json::to_string_pretty(&head);
        let lines = self.records.iter().map(serde_json::to_string).collect::<Result<Vec<_>, _>>();
        let (head, lines) = (head.map_err(failed)?, lines.map_err(failed)?);
        // Records are the last member of the object, and the head contains none.
        let head = head.trim_end_matches(['}', '\n', ']']);
        Ok(format!("{head}\n{}\n  ]\n}}\n", lines.join(",\n")).into_bytes())
    }

    /// Reads a study from its folder or file.
    ///
    /// Errors: no such file, or an invalid study, with line and column.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let path: PathBuf = if path.is_dir() { path.join(NAME) } else { path.into() };
        let text = std::fs::read(&path).map_err(Error::io(&path))?;
        #[derive(Deserialize)]
        struct Head {
            #[serde(default)]
            schema_version: Option<u32>,
            environment: Option<Value>,
        }
        if let Ok(Head { schema_version, environment }) = serde_json::from_slice(&text)
            && !schema_version.is_some_and(|version| (OLDEST_SCHEMA..=SCHEMA).contains(&version))
            && (schema_version.is_some() || environment.is_some())
        {
            let by = environment.as_ref().and_then(|e| e["version"].as_str()).unwrap_or("an unknown version");
            let version = schema_version.unwrap_or(1);
            let message = format!(
                "a study of schema version {version} (written by simpulse {by}); this program reads versions {OLDEST_SCHEMA} to {SCHEMA}: run the study again"
            );
            return Err(Error::Format { path, message });
        }
        serde_json::from_slice(&text).map_err(|e| Error::Format { path, message: e.to_string() })
    }
}

/// The names in a list.
fn names_in(list: &Value) -> Vec<String> {
    list.as_array().into_iter().flatten().filter_map(|name| Some(name.as_str()?.to_string())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{failed, fell, record};

    #[test]
    fn a_study_comes_back_with_the_same_bits() {
        let plan = StudyPlan { scenes: vec!["stack:2".into(), "arch".into()], ..StudyPlan::default() };
        let mut records = vec![record(8, 1, 10.25, 0.1 + 0.2), fell(8, 2, 3.0, 1e-300), failed(4)];
        if let Some(sample) = &mut records[0].sample {
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
        assert!(back.records[0].sample.as_ref().unwrap().blocks_ns[0][1].is_nan());
    }

    #[test]
    fn parts_make_the_whole_again() {
        let of = |scenes: &[&str], missing: &[&str]| {
            let names = |list: &[&str]| list.iter().map(|s| s.to_string()).collect::<Vec<_>>();
            let plan = StudyPlan { scenes: names(scenes), ..StudyPlan::default() };
            let done = scenes.iter().filter(|s| !missing.contains(s));
            let records = done.map(|&s| Record { scene: s.into(), ..record(8, 1, 1.0, 0.0) }).collect();
            StudyFile::new(&plan, records, names(missing))
        };
        let names = ["one".to_string(), "two".to_string()];
        // A study of the scenes a, b, c, d, e in two parts.
        let parts = vec![of(&["a", "c", "e"], &[]), of(&["b", "d"], &[])];
        let parts = parts.into_iter().zip([vec!["b", "d"], vec!["a", "c", "e"]]).map(|(mut part, others)| {
            part.missing_scenes = others.into_iter().map(String::from).collect();
            part
        });
        let whole = StudyFile::merged(parts.collect(), &names).unwrap();
        assert_eq!(whole.scenes(), ["a", "c", "e", "b", "d"]);
        assert_eq!(whole.settings["scenes"], serde_json::json!(["a", "c", "e", "b", "d"]));
        assert_eq!((whole.missing_scenes.len(), whole.parts.len()), (0, 2));
        assert_eq!(whole.settings["budget_search"]["not_searched"].as_array().map(Vec::len), Some(5));
        assert!(whole.budgets().starts_with("Not searched") && whole.budgets().contains("a, c, e, b, d"));
        assert!(whole.caution().contains("2 runs"), "{}", whole.caution());
        // One part was interrupted before d.
        let cut = StudyFile::merged(vec![of(&["a", "c"], &[]), of(&["b", "d"], &["d"])], &names).unwrap();
        assert_eq!(
            (cut.scenes(), cut.missing_scenes),
            (vec!["a".into(), "c".into(), "b".into()], vec!["d".to_string()])
        );

        let twice = StudyFile::merged(vec![of(&["a"], &[]), of(&["a"], &[])], &names).unwrap_err();
        assert_eq!(twice.to_string(), "merge: a is in one and in two");
        let mut narrow = of(&["b"], &[]);
        narrow.environment.native_lanes = 2;
        let message = StudyFile::merged(vec![of(&["a"], &[]), narrow], &names).unwrap_err().to_string();
        assert!(message.starts_with("merge: two comes from a program with 2 lanes"), "{message}");
        let mut rounded = of(&["b"], &[]);
        let had = rounded.environment.target_features.iter().any(|name| name == "fma");
        rounded.environment.target_features = if had { Vec::new() } else { vec!["fma".into()] };
        assert!(StudyFile::merged(vec![of(&["a"], &[]), rounded], &names).is_err());
        let mut other = of(&["b"], &[]);
        other.settings["seed"] = 9.into();
        let message = StudyFile::merged(vec![of(&["a"], &[]), other], &names).unwrap_err().to_string();
        assert_eq!(message, "merge: two was run with different settings than one");
    }

    #[test]
    fn what_is_no_study_is_refused_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.json");
        std::fs::write(&path, "{\"records\": [\n{}]}").unwrap();
        let message = StudyFile::read(&path).unwrap_err().to_string();
        assert!(message.contains("x.json") && message.contains("line 2"), "{message}");
        assert!(StudyFile::read(folder.path()).unwrap_err().to_string().contains(NAME));
        // For a file of an older program, the error names its version instead of the position of the
        // mismatch.
        std::fs::write(&path, "{\"environment\": {\"version\": \"0.0.9\"}, \"records\": [{}]}").unwrap();
        let message = StudyFile::read(&path).unwrap_err().to_string();
        assert!(message.contains("schema version 1") && message.contains("0.0.9"), "{message}");
        assert!(!message.contains("column"), "{message}");
    }
}
