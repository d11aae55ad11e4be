//! `simpulse papers`: re-measures the claims of the sources.

use super::output::{note, print, print_json};
use crate::lab::error::Error;
use clap::Args;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// Re-measure the claims of papers/claims.md
///
/// Each row of its first table has a command, the figure that is read from the command's JSON, and the range in which
/// the figure is expected. Prints every figure; exit code 1 if one is outside its range. With --write the figures in
/// the file are replaced. The figures do not depend on timing.
#[derive(Args, Clone, Debug)]
#[command(after_help = "\
Examples:
  simpulse papers
  simpulse papers --only nncg
  simpulse papers --write")]
pub struct PapersArgs {
    /// The file with the table
    #[arg(default_value = "papers/claims.md")]
    pub file: PathBuf,
    /// Rows that contain this text
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,
    /// Write the figures into the file
    #[arg(long)]
    pub write: bool,
    /// Print JSON instead of text
    #[arg(long)]
    pub json: bool,
}

/// Column of the last printed figure.
const PRINTED: usize = 4;

/// A row of the table: claim, command, figure, expected, printed, verdict.
struct ClaimRow<'a> {
    line: usize,
    cells: Vec<&'a str>,
    command: &'a str,
    figure: &'a str,
    expected: [f64; 2],
}

impl<'a> ClaimRow<'a> {
    /// `None` for lines that are not rows of the table. Errors: a range that cannot be parsed.
    fn parse(line: usize, text: &'a str) -> Result<Option<Self>, Error> {
        let Some(inner) = text.strip_prefix("| ").and_then(|text| text.strip_suffix(" |")) else {
            return Ok(None);
        };
        let cells: Vec<&str> = inner.split(" | ").collect();
        let [_, command, figure, expected, _, _] = cells[..] else { return Ok(None) };
        let [Some(command), Some(figure)] = [command, figure].map(|cell| code(cell.trim())) else {
            return Ok(None);
        };
        let range = expected.split(" to ").map(|bound| bound.trim().parse::<f64>());
        let expected = range.collect::<Result<Vec<_>, _>>().ok().and_then(|range| range.try_into().ok());
        let expected = expected.ok_or_else(|| {
            Error::invalid(
                format!("line {}", line + 1),
                format!("'{}' is not a range 'low to high'", cells[3]),
            )
        })?;
        Ok(Some(ClaimRow { line, command, figure, expected, cells }))
    }
}

/// The text between backticks.
fn code(cell: &str) -> Option<&str> {
    cell.strip_prefix('`')?.strip_suffix('`')
}

/// The value at a path of keys, list indices, and `key=value,…`, which selects the first entry of a list with
/// these values.
fn at<'v>(mut value: &'v Value, path: &str) -> Option<&'v Value> {
    for step in path.split('/') {
        value = match value {
            Value::Array(list) if step.contains('=') => {
                let matches = |entry: &&Value| {
                    step.split(',').all(|condition| {
                        condition
                            .split_once('=')
                            .is_some_and(|(key, expected)| entry[key].as_str() == Some(expected))
                    })
                };
                list.iter().find(matches)?
            }
            Value::Array(list) => list.get(step.parse::<usize>().ok()?)?,
            _ => value.get(step)?,
        };
    }
    Some(value)
}

/// Runs a command of this program and parses its JSON. Errors: another program, no JSON.
fn run_command(command: &str) -> Result<Value, Error> {
    let words: Vec<&str> = command.split_whitespace().collect();
    let ["simpulse", arguments @ ..] = &words[..] else {
        return Err(Error::invalid("command", format!("'{command}' does not begin with 'simpulse'")));
    };
    let program = std::env::current_exe().map_err(Error::io("the program itself"))?;
    // A run whose scene does not hold has a non-zero exit code but still prints its figures.
    let output = Command::new(program).args(arguments).arg("--json").output().map_err(Error::io(command))?;
    let told = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout)
        .map_err(|_| Error::invalid(command, format!("printed no JSON; {told}")))
}

/// A number with four digits.
fn digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".into(),
        size if (1e-3..1e4).contains(&size) && value.fract() == 0.0 => format!("{value}"),
        size if (1e-3..1e4).contains(&size) => {
            let decimals = (3 - size.log10().floor() as i32).max(0) as usize;
            format!("{value:.decimals$}")
        }
        _ => format!("{value:.3e}"),
    }
}

/// Runs the command.
pub fn run(args: &PapersArgs) -> Result<ExitCode, Error> {
    let text = std::fs::read_to_string(&args.file).map_err(Error::io(&args.file))?;
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    let rows = text.lines().enumerate().map(|(i, line)| ClaimRow::parse(i, line));
    let rows: Vec<ClaimRow> = rows.filter_map(Result::transpose).collect::<Result<_, _>>()?;
    let is_asked =
        |row: &&ClaimRow| args.only.as_ref().is_none_or(|only| row.cells.join(" ").contains(only.as_str()));
    let rows: Vec<&ClaimRow> = rows.iter().filter(is_asked).collect();
    if rows.is_empty() {
        return Err(Error::invalid(
            args.file.to_string_lossy(),
            "has no such row with a command and a range",
        ));
    }
    let mut answers: BTreeMap<&str, Value> = BTreeMap::new();
    let (mut all_within, mut printed, mut found) = (true, String::new(), Vec::new());
    for (i, row) in rows.iter().enumerate() {
        if !answers.contains_key(row.command) {
            note(&format!("{} of {}: {}\n", i + 1, rows.len(), row.command));
            answers.insert(row.command, run_command(row.command)?);
        }
        let value = at(&answers[row.command], row.figure).and_then(Value::as_f64);
        let [low, high] = row.expected;
        let within = value.is_some_and(|value| (low..=high).contains(&value));
        all_within &= within;
        let figure = value.map_or("none".into(), digits);
        let verdict = if within { "within" } else { "OUTSIDE" };
        printed += &format!("{figure:>10}  {verdict:<7}  {low} to {high}  {}\n", row.cells[0]);
        found.push(json!({
            "claim": row.cells[0], "command": row.command, "figure": row.figure, "value": value,
            "expected": row.expected, "within": within,
        }));
        let mut cells = row.cells.clone();
        cells[PRINTED] = &figure;
        lines[row.line] = format!("| {} |", cells.join(" | "));
    }
    if args.write {
        std::fs::write(&args.file, lines.join("\n") + "\n").map_err(Error::io(&args.file))?;
    }
    match args.json {
        true => print_json(&found.into())?,
        false => print(&printed)?,
    };
    Ok(if all_within { ExitCode::SUCCESS } else { ExitCode::from(1) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_a_command_a_figure_and_a_range() {
        let line =
            "| a claim | `simpulse run stack` | `errors/penetration_max` | 0 to 1e-3 | 5 | reproduced |";
        let row = ClaimRow::parse(3, line).unwrap().unwrap();
        assert_eq!((row.command, row.figure), ("simpulse run stack", "errors/penetration_max"));
        assert_eq!((row.expected, row.line), ([0.0, 1e-3], 3));
        assert!(ClaimRow::parse(0, "| a | b | c |").unwrap().is_none());
        assert!(ClaimRow::parse(0, "|---|---|---|---|---|---|").unwrap().is_none());
        assert!(ClaimRow::parse(0, &line.replace("0 to 1e-3", "small")).is_err());
    }

    #[test]
    fn figures_are_found_by_keys_places_and_values() {
        let value =
            json!({ "curves": [{ "solver": "pgs", "first": [3, 7] }, { "solver": "sor", "first": [9] }] });
        assert_eq!(at(&value, "curves/solver=sor/first/0"), Some(&json!(9)));
        assert_eq!(at(&value, "curves/0/first/1"), Some(&json!(7)));
        assert_eq!(at(&value, "curves/solver=none/first"), None);
        assert_eq!(
            [0.0, 196.0, 0.975581, 1.5e-9, 12345.6].map(digits),
            ["0", "196", "0.9756", "1.500e-9", "1.235e4"]
        );
    }
}
