//! Text and JSON to standard output.

use crate::lab::error::Error;
use serde_json::Value;
use std::io::Write;
use std::process::ExitCode;

/// To standard output; a reader that has left is not an error.
pub fn print(text: &str) -> Result<ExitCode, Error> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(Error::io("standard output")(e)),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// The same as JSON. What is not finite is a word there: [`finite`].
pub fn print_json(value: &Value) -> Result<ExitCode, Error> {
    print(&format!("{value:#}\n"))
}

/// Anything that can be serialised.
pub fn value(of: &impl serde::Serialize) -> Result<Value, Error> {
    serde_json::to_value(of).map_err(|e| Error::invalid("json", e.to_string()))
}

/// JSON has no infinities: they are words.
pub fn finite(number: f64) -> Value {
    if number.is_finite() { number.into() } else { number.to_string().into() }
}
