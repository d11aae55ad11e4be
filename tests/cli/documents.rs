//! Commands printed in the README and the papers work: they parse with the program's own parser, the quick
//! ones run, and the tests that they name exist.

use clap::Parser;
use simpulse::cli::args::Cli;
use std::path::{Path, PathBuf};

/// Every Markdown file of these folders and the README, with its text.
fn documents() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut paths = vec![root.join("README.md")];
    for folder in ["papers", "src/engine", "src/lab"] {
        let entries = std::fs::read_dir(root.join(folder)).unwrap().map(|entry| entry.unwrap().path());
        paths.extend(entries.filter(|path| path.extension().is_some_and(|e| e == "md")));
    }
    paths.into_iter().map(|path| (path.clone(), std::fs::read_to_string(path).unwrap())).collect()
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
    for (path, text) in documents() {
        for command in commands(&text) {
            let Some(words) = words(&command) else { continue };
            count += 1;
            if let Err(error) = Cli::try_parse_from(&words) {
                wrong.push(format!("{}: {command}\n{error}", path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count > 40, "{count} commands found");
}

/// The functions of the sources below a folder, and the names of their files: filters of tests.
fn filters(folder: &Path) -> String {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let of = |path: PathBuf| match std::fs::read_to_string(&path) {
        _ if path.is_dir() => filters(&path),
        Ok(text) => text.lines().filter(|l| l.contains("fn ")).map(|l| format!("{l}\n")).collect(),
        Err(_) => String::new(),
    };
    entries.map(|path| path.file_name().unwrap().to_string_lossy().into_owned() + "\n" + &of(path)).collect()
}

#[test]
fn tests_that_the_documents_name_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let sources = ["tests", "src"].map(|folder| filters(&root.join(folder))).concat();
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).unwrap();
    let mut count = 0;
    for (path, text) in documents() {
        for command in commands(&text).iter().filter(|c| c.starts_with("cargo test") && !c.contains("NAME")) {
            let words = command.split_whitespace().skip(2).take_while(|&word| word != "--");
            for word in words.filter(|word| !word.starts_with('-') && !word.contains('/')) {
                let is_target = manifest.contains(&format!("\"{word}"));
                assert!(is_target || sources.contains(word), "{}: {word} in {command}", path.display());
                count += usize::from(!is_target);
            }
        }
    }
    assert!(count > 5, "{count} filters found");
}

#[test]
fn quick_commands_of_the_readme_run() {
    let folder = tempfile::tempdir().unwrap();
    let quick = ["run", "list", "converge"];
    let readme = &documents()[0].1;
    assert!(readme.len() <= 8192, "{} bytes: the README is short", readme.len());
    let mut count = 0;
    for command in commands(readme) {
        let Some(words) = words(&command).filter(|words| quick.contains(&words[1])) else { continue };
        super::succeeds(folder.path(), &words[1..].join(" "));
        count += 1;
    }
    assert!(count >= 4, "{count} commands ran");
}
