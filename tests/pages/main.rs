//! Pictures, recordings and pages from the user's point of view. Pages are tested in a real browser if there
//! is one.

mod browser;
mod documents;
mod files;
mod kept;
mod replay;
mod report;

use std::path::Path;
use std::process::{Command, Output};

/// The color of a solver in every plot.
fn solver_color(name: &str) -> [u8; 3] {
    let simpulse::lab::picture::Color(r, g, b, _) = simpulse::lab::report::style::Style::of(name).rgb();
    [r, g, b]
}

/// Runs the program in a folder.
fn simpulse(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_simpulse")).current_dir(folder).args(args).output().unwrap()
}

/// Runs the program, which must succeed. Returns standard output.
fn succeeds(folder: &Path, args: &[&str]) -> String {
    let output = simpulse(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Runs the program, which must reject its arguments in one line with these parts, and leave no file.
fn refused(folder: &Path, args: &[&str], parts: &[&str]) {
    let count = || std::fs::read_dir(folder).unwrap().count();
    let before = count();
    let output = simpulse(folder, args);
    let message = String::from_utf8_lossy(&output.stderr).to_string();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert!(message.starts_with("error: ") && message.trim_end().lines().count() == 1, "{args:?}: {message}");
    for part in parts {
        assert!(message.contains(part), "{args:?}: '{part}' is not in: {message}");
    }
    assert_eq!(count(), before, "{args:?}");
}
