//! Structure of the source tree: imports point downward, every solver has a file and a row, every source an entry.

use simpulse::engine::solvers::VARIANTS;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every Rust file below a folder, with its code: without comments and unit tests, which may import upward.
fn files(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            let code = text.split("#[cfg(test)]").next().unwrap_or(&text);
            let lines = code.lines().map(|line| line.split("//").next().unwrap_or(line));
            found.push((path, lines.collect::<Vec<_>>().join("\n")));
        }
    }
    found
}

/// The names in paths that begin with `prefix`.
fn named_after<'t>(code: &'t str, prefix: &str) -> BTreeSet<&'t str> {
    let word = |text: &'t str| text.split(|c: char| !c.is_alphanumeric() && c != '_').next();
    code.split(prefix).skip(1).filter_map(word).collect()
}

/// Modules of a folder, from the lowest layer up. Modules of one layer do not import each other.
const ENGINE: &[&[&str]] = &[
    &["error", "params", "workers"],
    &["lanes"],
    &["clock", "shapes", "contacts", "coloring", "disjoint"],
    &["bodies"],
    &["broadphase", "narrowphase"],
    &["constraints", "continuous"],
    &["joints"],
    &["solvers"],
    &["world"],
    &["prelude"],
];
const CONSTRAINTS: &[&[&str]] =
    &[&["numerics"], &["records"], &["kernels"], &["joints", "vectors"], &["impacts"], &["step"]];
const LAB: &[&[&str]] = &[
    &["error"],
    &["files", "interned", "memory", "overrides", "parallel", "units"],
    &["reference"],
    &["metrics"],
    &["scenes", "capture", "picture", "pokes"],
    &["trial"],
    &["copies"],
    &["recording", "chart"],
    &["verify", "study", "converge"],
    &["report"],
    &["ablate", "profile", "compare", "torture", "view"],
];

#[test]
fn no_import_points_upwards() {
    for (folder, above, layers) in [
        ("engine", &["crate::lab", "crate::cli"][..], ENGINE),
        ("engine/constraints", &[], CONSTRAINTS),
        ("lab", &["crate::cli"], LAB),
    ] {
        let path = root().join("src").join(folder);
        // The engine is a crate of its own.
        let prefix = match folder.strip_prefix("engine") {
            Some(rest) => format!("crate{}::", rest.replace('/', "::")),
            None => format!("crate::{folder}::"),
        };
        let layer_of = |module: &str| layers.iter().position(|layer| layer.contains(&module));
        let mut modules = BTreeSet::new();
        for (file, code) in files(&path) {
            let file = file.strip_prefix(&path).unwrap();
            let module = file.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs").to_string();
            assert!(!above.iter().any(|above| code.contains(above)), "{folder}: {file:?} imports upward");
            if module == "mod" || module == "lib" {
                continue;
            }
            let layer = layer_of(&module).unwrap_or_else(|| panic!("{folder}/{module} has no layer"));
            for other in named_after(&code, &prefix).into_iter().filter(|other| *other != module) {
                // A group of modules in braces has no name here: each is imported on a line of its own.
                let below = layer_of(other).unwrap_or_else(|| panic!("{folder}: {file:?}: {other}"));
                assert!(below < layer, "{folder}: {file:?} imports {other}");
            }
            modules.insert(module);
        }
        let known: BTreeSet<String> = layers.concat().into_iter().map(String::from).collect();
        assert_eq!(modules, known, "{folder}: modules and layers");
    }
}

#[test]
fn every_solver_has_a_file_and_a_source_and_imports_no_other() {
    let folder = root().join("src/engine/solvers");
    let papers = std::fs::read_to_string(root().join("papers/README.md")).unwrap();
    let names: BTreeSet<&str> = VARIANTS.iter().map(|v| v.name).collect();
    let mut modules = BTreeSet::new();
    for (path, code) in files(&folder) {
        // Files in a folder belong to the solver of that name.
        let first = path.strip_prefix(&folder).unwrap().iter().next().unwrap().to_str().unwrap();
        let own = first.trim_end_matches(".rs").to_string();
        let imports = |other: &&str| {
            code.contains(&format!("solvers::{other}")) || code.contains(&format!("super::{other}::"))
        };
        let others = names.iter().filter(|other| **other != own && own != "mod");
        assert_eq!(others.filter(|other| imports(other)).collect::<Vec<_>>(), [&""; 0], "{}", path.display());
        modules.insert(own);
    }
    modules.remove("mod");
    assert_eq!(modules, names.iter().map(|name| name.to_string()).collect(), "files and rows of VARIANTS");
    for variant in VARIANTS {
        let text = std::fs::read_to_string(folder.join(variant.name).with_extension("rs")).unwrap();
        for part in ["**Source.**", "**Departures.**", "**Cost.**", "**Fails when**"] {
            assert!(text.contains(part), "{} has no {part}", variant.name);
        }
        assert!(
            papers.contains(&format!("| `{}`", variant.source)),
            "{} in papers/README.md",
            variant.source
        );
    }
}
