//! Commands printed in the README and the papers work: they parse with the program's own parser, the quick
//! ones run, and the tests that they name exist.

use clap::Parser;
use simpulse::cli::args::Cli;
use std::path::{Path, PathBuf};

const DOCUMENTS: [&str; 10] = [
    "README.md",
    "papers/README.md",
    "papers/claims.md",
    "papers/contest.md",
    "papers/joints.md",
    "papers/peers.md",
    "papers/shim.md",
    "papers/solver2d.md",
    "src/lab/README.md",
    "src/lab/profile/README.md",
];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Lines of shell blocks, and text between backticks.
fn commands(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut block: Option<String> = None;
    for line in text.lines() {
        match (line.trim_start().strip_prefix("```"), &block) {
            (Some(kind), None) => block = Some(kind.to_string()),
            (Some(_), Some(_)) => block = None,
            (None, Some(kind)) if kind == "sh" => {
                let command = line.split("  #").next().unwrap_or(line);
                found.extend(command.split("; ").map(|part| part.trim().to_string()));
            }
            (None, Some(_)) => {}
            (None, None) => found.extend(line.split('`').skip(1).step_by(2).map(String::from)),
        }
    }
    found
}

/// Words of a complete command of this program; `None` for a mere mention of a subcommand.
fn words(command: &str) -> Option<Vec<&str>> {
    let is_complete = !command.contains(['…', '<', '(', '{']) && !command.contains("NAME");
    let words: Vec<&str> =
        command.split_whitespace().take_while(|word| !["|", ">", "#"].contains(word)).collect();
    (is_complete && words.first() == Some(&"simpulse") && words.len() > 2).then_some(words)
}

#[test]
fn commands_of_the_documents_parse() {
    let (mut count, mut wrong) = (0, Vec::new());
    for name in DOCUMENTS {
        for command in commands(&read(name)) {
            let Some(words) = words(&command) else { continue };
            count += 1;
            if let Err(error) = Cli::try_parse_from(&words) {
                wrong.push(format!("{name}: {command}\n{error}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 60, "{count} commands found");
}

#[test]
fn tests_that_the_documents_name_exist() {
    let mut sources = String::new();
    let mut folders: Vec<PathBuf> = vec![root().join("tests"), root().join("src")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                // Module names are valid filters, too.
                sources += &format!("fn {}\n", path.file_stem().unwrap().to_string_lossy());
                sources += &std::fs::read_to_string(path).unwrap();
            }
        }
    }
    let manifest = read("Cargo.toml");
    let mut count = 0;
    for name in DOCUMENTS {
        for command in commands(&read(name)) {
            let words: Vec<&str> = command.split_whitespace().take_while(|&word| word != "--").collect();
            if words.get(..2) != Some(&["cargo", "test"]) || words.contains(&"NAME") {
                continue;
            }
            if let Some(k) = words.iter().position(|&word| word == "--test") {
                assert!(manifest.contains(&format!("name = \"{}\"", words[k + 1])), "{name}: {command}");
            }
            // A filter is the last word, after an option's value or a flag.
            let Some(&filter) = words.last().filter(|_| words.len() > 5 || words.contains(&"--lib")) else {
                continue;
            };
            let is_target = words[words.len() - 2] == "--test" || filter.starts_with('-');
            if !is_target && !words[words.len() - 2].starts_with("--target") {
                count += 1;
                assert!(
                    sources.lines().any(|l| l.contains("fn ") && l.contains(filter)),
                    "{name}: {command}"
                );
            }
        }
    }
    assert!(count > 10, "{count} filters found");
}

#[test]
fn quick_commands_of_the_readme_run() {
    let folder = tempfile::tempdir().unwrap();
    let quick = ["run", "scene", "scenes", "solvers", "columns", "capture", "converge", "snapshot"];
    let mut count = 0;
    for command in commands(&read("README.md")) {
        let Some(words) = words(&command).filter(|words| quick.contains(&words[1])) else { continue };
        super::succeeds(folder.path(), &words[1..]);
        count += 1;
    }
    assert!(count >= 4, "{count} commands ran");
}

/// Every claim is within the range stated in its row.
#[test]
fn claims_are_within_their_ranges() {
    let printed = super::succeeds(root(), &["papers"]);
    assert!(printed.lines().count() > 30 && !printed.contains("OUTSIDE"), "{printed}");
}

#[test]
fn the_readme_is_short() {
    let length = read("README.md").len();
    assert!(length <= 8192, "{length} bytes");
}
