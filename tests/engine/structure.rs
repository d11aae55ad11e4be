//! Structure of the source tree: imports point downward, every solver has a row, every source has an entry,
//! and every path in `papers/README.md` exists.

use simpulse::engine::solvers::VARIANTS;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every Rust file below a folder, with its contents.
fn files(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display())) {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            let text = std::fs::read_to_string(&path).unwrap();
            found.push((path, text));
        }
    }
    found
}

/// The code of a file without comments and unit tests. Unit tests may import upward.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]").next().unwrap_or(text);
    let lines = text.lines().map(|line| line.split("//").next().unwrap_or(line));
    lines.collect::<Vec<_>>().join("\n")
}

/// The words that follow `prefix` in `text`: the names of imported modules.
fn named_after<'t>(text: &'t str, prefix: &str) -> BTreeSet<&'t str> {
    let word = |rest: &'t str| {
        let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        &rest[..end]
    };
    let mut named = BTreeSet::new();
    for (at, _) in text.match_indices(prefix) {
        let rest = &text[at + prefix.len()..];
        match rest.strip_prefix('{') {
            // A group at the top level: each member begins after a brace or a comma at depth 1.
            Some(group) => {
                let mut depth = 0;
                let mut begins = true;
                for (i, c) in group.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth == 0 => break,
                        '}' => depth -= 1,
                        ',' if depth == 0 => begins = true,
                        c if begins && !c.is_whitespace() => {
                            named.insert(word(&group[i..]));
                            begins = false;
                        }
                        _ => {}
                    }
                }
            }
            None => {
                named.insert(word(rest));
            }
        }
    }
    named
}

/// Modules of a layer, from the lowest floor up. Modules on one floor do not import each other.
const ENGINE: &[&[&str]] = &[
    &["error", "params", "lanes"],
    &["clock", "shapes", "contacts", "coloring", "disjoint"],
    &["bodies"],
    &["broadphase", "narrowphase"],
    &["constraints", "continuous"],
    &["joints"],
    &["solvers"],
    &["world"],
];
const LAB: &[&[&str]] = &[
    &["error"],
    &["estimate", "files", "interned", "overrides", "units"],
    &["reference"],
    &["metrics"],
    &["scenes", "capture", "picture"],
    &["recording", "chart"],
    &["verify", "study", "converge"],
    &["advise", "report"],
    &["ablate", "agree", "profile", "compare", "torture"],
];

const CONSTRAINTS: &[&[&str]] =
    &[&["numerics"], &["records"], &["kernels"], &["joints", "vectors", "impacts"], &["step"]];

#[test]
fn no_import_points_upwards() {
    for (storey, above, floors) in [
        ("engine", &["crate::lab", "crate::cli"][..], ENGINE),
        ("engine/constraints", &[][..], CONSTRAINTS),
        ("lab", &["crate::cli"][..], LAB),
    ] {
        let folder = root().join("src").join(storey);
        let prefix = format!("crate::{}::", storey.replace('/', "::"));
        let floor_of = |room: &str| floors.iter().position(|floor| floor.contains(&room));
        let mut rooms = BTreeSet::new();
        for (path, text) in files(&folder) {
            let code = code(&text);
            for storey in above {
                assert!(!code.contains(storey), "{} imports from {storey}", path.display());
            }
            let place = path.strip_prefix(&folder).unwrap();
            let room = place.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs");
            if room == "mod" || room == "lib" {
                continue;
            }
            rooms.insert(room.to_string());
            let floor = floor_of(room).unwrap_or_else(|| panic!("{storey}/{room} has no floor"));
            for other in named_after(&code, &prefix) {
                let below = floor_of(other).unwrap_or_else(|| panic!("{}: {other}", path.display()));
                assert!(other == room || below < floor, "{} imports {other}", path.display());
            }
        }
        let known: BTreeSet<String> = floors.iter().flat_map(|f| f.iter()).map(|r| r.to_string()).collect();
        assert_eq!(rooms, known, "{storey}: rooms and floors");
    }
}

#[test]
fn no_two_files_of_a_room_import_each_other() {
    let mut folders = BTreeMap::<PathBuf, BTreeMap<String, BTreeSet<String>>>::new();
    for (path, text) in files(&root().join("src")).into_iter().chain(files(&root().join("benches/peers/src")))
    {
        let name = path.file_stem().unwrap().to_str().unwrap().to_string();
        let prefix = if path.starts_with(root().join("benches")) { "crate::" } else { "super::" };
        if name == "mod" || name == "main" || name == "lib" {
            continue;
        }
        let code = code(&text);
        let named = named_after(&code, prefix).into_iter().map(str::to_string).collect();
        folders.entry(path.parent().unwrap().into()).or_default().insert(name, named);
    }
    for (folder, imports) in folders {
        // Remove files that import none of the remaining files until none remain.
        let mut left: BTreeSet<&String> = imports.keys().collect();
        loop {
            let free: Vec<&String> = left
                .iter()
                .copied()
                .filter(|f| !imports[*f].iter().any(|i| i != *f && left.contains(i)))
                .collect();
            if free.is_empty() {
                break;
            }
            left.retain(|f| !free.contains(f));
        }
        assert!(left.is_empty(), "{}: a circle through {left:?}", folder.display());
    }
}

/// The type that a line of code declares, private ones included. `type` inside a trait or an `impl` does not
/// count.
fn declared(line: &str) -> Option<&str> {
    let rest = match line.trim_start().strip_prefix("pub") {
        Some(rest) if rest.starts_with('(') => rest.split_once(')')?.1.trim_start(),
        Some(rest) if rest.starts_with(' ') => rest.trim_start(),
        _ => line.trim_start(),
    };
    let (kind, rest) = rest.strip_prefix("unsafe ").unwrap_or(rest).split_once(' ')?;
    let is_type =
        matches!(kind, "struct" | "enum" | "trait" | "union") || kind == "type" && !line.starts_with(' ');
    is_type.then(|| rest.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').next()).flatten()
}

/// Each name denotes one thing across the engine, the laboratory and the command line.
#[test]
fn no_type_name_is_declared_twice() {
    // Each layer has its own error type. The laboratory's wraps the engine's.
    const TWICE: [&str; 1] = ["Error"];
    let source = root().join("src");
    let mut places = BTreeMap::<String, Vec<String>>::new();
    for (path, text) in files(&source) {
        let place = path.strip_prefix(&source).unwrap().display().to_string();
        for name in code(&text).lines().filter_map(declared) {
            places.entry(name.into()).or_default().push(place.clone());
        }
    }
    assert!(places.len() > 400, "{} types found", places.len());
    let twice: Vec<_> = places.iter().filter(|(_, p)| p.len() > 1).collect();
    let unknown: Vec<_> = twice.iter().filter(|(name, _)| !TWICE.contains(&name.as_str())).collect();
    assert!(unknown.is_empty(), "declared twice: {unknown:#?}");
    assert_eq!(twice.len(), TWICE.len(), "names that are declared once are not in the list");
}

#[test]
fn every_solver_file_has_a_row_and_every_row_a_file() {
    let folder = root().join("src/engine/solvers");
    // Files in a folder belong to the solver of that name.
    let in_room = |path: &Path| path.strip_prefix(&folder).unwrap().iter().next().unwrap().to_owned();
    let names: BTreeSet<String> = files(&folder)
        .iter()
        .map(|(path, _)| in_room(path).to_str().unwrap().trim_end_matches(".rs").to_string())
        .filter(|name| name != "mod")
        .collect();
    let mut names: Vec<String> = names.into_iter().collect();
    names.sort();
    let mut rows: Vec<String> = VARIANTS.iter().map(|v| v.name.to_string()).collect();
    rows.sort();
    assert_eq!(names, rows, "files in {} and rows of VARIANTS", folder.display());
}

#[test]
fn every_solver_file_says_what_a_reader_looks_for_and_imports_no_other() {
    for variant in VARIANTS {
        let path = root().join(format!("src/engine/solvers/{}.rs", variant.name));
        let text = std::fs::read_to_string(&path).unwrap();
        for part in ["**Source.**", "**Departures.**", "**Cost.**", "**Fails when**"] {
            assert!(text.contains(part), "{} has no {part}", path.display());
        }
        let code = code(&text);
        let others = VARIANTS.iter().filter(|other| other.name != variant.name);
        for other in others {
            let import = format!("solvers::{}", other.name);
            assert!(
                !code.contains(&import) && !code.contains(&format!("super::{}::", other.name)),
                "{import}"
            );
        }
    }
}

/// Keys of the table in `papers/README.md`.
fn keys(papers: &str) -> BTreeSet<&str> {
    papers.lines().filter_map(|line| line.strip_prefix("| `")?.split('`').next()).collect()
}

#[test]
fn every_source_has_an_entry() {
    let papers = std::fs::read_to_string(root().join("papers/README.md")).unwrap();
    let keys = keys(&papers);
    for variant in VARIANTS {
        assert!(
            keys.contains(variant.source),
            "{}: papers/README.md has no '{}'",
            variant.name,
            variant.source
        );
    }
    // Keys cited anywhere in code or comments: a surname and a year in backticks.
    for (path, text) in files(&root().join("src")) {
        for word in text.split('`').skip(1).step_by(2) {
            let year = word.trim_start_matches(|c: char| c.is_ascii_lowercase());
            let is_key = word.is_ascii()
                && year.len() >= 4
                && year.len() < word.len()
                && year[..4].chars().all(|c| c.is_ascii_digit())
                && (year.starts_with("19") || year.starts_with("20"))
                && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
            assert!(!is_key || keys.contains(word), "{}: papers/README.md has no '{word}'", path.display());
        }
    }
}

#[test]
fn every_path_in_the_list_of_sources_exists() {
    let papers = std::fs::read_to_string(root().join("papers/README.md")).unwrap();
    let mut paths = 0;
    for word in papers.split('`').skip(1).step_by(2) {
        let is_path = word.contains('/') && !word.contains(' ') || word.ends_with(".rs");
        if is_path {
            paths += 1;
            assert!(root().join(word).exists(), "papers/README.md names '{word}'");
        }
    }
    assert!(paths > 40, "{paths} paths found");
}

/// Step times that are compared with each other come from one function. So `run`, `study`, `advise` and
/// `savings` cannot report different times for one setting. All other clocks measure something else.
#[test]
fn steps_are_timed_in_one_place() {
    let source = root().join("src");
    let clocks: BTreeSet<String> = files(&source)
        .into_iter()
        .filter(|(_, text)| code(text).contains("Instant::now"))
        .map(|(path, _)| path.strip_prefix(&source).unwrap().display().to_string())
        .collect();
    let known = [
        // Times of steps.
        "lab/study/interleave.rs",
        // Phases inside a step.
        "engine/clock.rs",
        // Steps and phases on a held state, and ceilings of the machine.
        "lab/profile/ceilings.rs",
        "lab/profile/growth.rs",
        "lab/profile/mod.rs",
        // Iterations of a frozen problem.
        "lab/converge/replay.rs",
        // Run time of a command.
        "cli/times.rs",
        "lab/advise/search.rs",
    ];
    assert_eq!(clocks, known.map(String::from).into_iter().collect());
    for user in [
        "cli/times.rs",
        "lab/study/mod.rs",
        "lab/study/savings.rs",
        "lab/advise/mod.rs",
        "lab/advise/search.rs",
    ] {
        let text = code(&std::fs::read_to_string(source.join(user)).unwrap());
        assert!(text.contains("time_in_turns(") || text.contains("Interleaved::new("), "{user}");
    }
}
