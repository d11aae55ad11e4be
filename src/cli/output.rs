//! Text and JSON go to standard output, notes to standard error. A closed pipe (`| head -1`) is not an error.

use crate::lab::error::Error;
use crate::lab::files::is_standard_output;
use serde_json::Value;
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::process::ExitCode;

/// Prints an answer to standard output.
pub fn print(text: &str) -> Result<ExitCode, Error> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io("standard output")(e)),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Prints an answer in addition to files: to standard error if one of the files is standard output.
pub fn print_beside<'a>(files: impl IntoIterator<Item = &'a Path>, text: &str) -> Result<ExitCode, Error> {
    if files.into_iter().any(is_standard_output) {
        note(text);
        return Ok(ExitCode::SUCCESS);
    }
    print(text)
}

/// Prints notes and errors to standard error; write failures are ignored.
pub fn note(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

/// Prints an answer as JSON. Convert numbers that may not be finite with [`finite`].
pub fn print_json(value: &Value) -> Result<ExitCode, Error> {
    print(&format!("{value:#}\n"))
}

/// JSON value of anything that can be serialized.
pub fn value(of: &impl serde::Serialize) -> Result<Value, Error> {
    serde_json::to_value(of).map_err(|e| Error::invalid("json", e.to_string()))
}

/// A number as JSON; a non-finite number, which JSON does not have, becomes a word.
pub fn finite(number: f64) -> Value {
    if number.is_finite() { number.into() } else { number.to_string().into() }
}
