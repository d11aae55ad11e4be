//! Pictures, recordings, pages and documents from the user's point of view. Pages are tested in a real browser
//! if there is one.

mod browser;
mod documents;
mod kept;
mod replay;
mod report;

use std::path::Path;
use std::process::{Command, Output};

/// Runs the program with these words in a folder.
fn simpulse(folder: &Path, words: &str) -> Output {
    let words = words.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_simpulse")).current_dir(folder).args(words).output().unwrap()
}

/// Runs the program, which must succeed. Returns standard output.
fn succeeds(folder: &Path, words: &str) -> String {
    let output = simpulse(folder, words);
    assert_eq!(output.status.code(), Some(0), "{words}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must reject its arguments in one line with these parts, and leave no file.
fn refused(folder: &Path, words: &str, parts: &[&str]) {
    let count = || std::fs::read_dir(folder).unwrap().count();
    let before = count();
    let output = simpulse(folder, words);
    let message = String::from_utf8_lossy(&output.stderr).to_string();
    assert_eq!(output.status.code(), Some(2), "{words}: {message}");
    assert!(message.starts_with("error: ") && message.trim_end().lines().count() == 1, "{words}: {message}");
    for part in parts {
        assert!(message.contains(part), "{words}: '{part}' is not in: {message}");
    }
    assert_eq!(count(), before, "{words}");
}
