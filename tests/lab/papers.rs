//! The first table of papers/claims.md: each row has a command, the figure that is read from the command's JSON,
//! and the range in which the figure is expected. Prints the figures
//! (`cargo test --release --test lab papers -- --nocapture`), which do not depend on timing.

use serde_json::Value;
use std::collections::BTreeMap;
use std::process::Command;

/// The value at a path of keys, list indices, and `key=value,…`, which selects the first entry of a list with
/// these values.
fn at<'v>(mut value: &'v Value, path: &str) -> Option<&'v Value> {
    for step in path.split('/') {
        let matches = |entry: &&Value| {
            let mut conditions = step.split(',').filter_map(|condition| condition.split_once('='));
            conditions.all(|(key, expected)| entry[key].as_str() == Some(expected))
        };
        value = match value {
            Value::Array(list) if step.contains('=') => list.iter().find(matches)?,
            Value::Array(list) => list.get(step.parse::<usize>().ok()?)?,
            _ => value.get(step)?,
        };
    }
    Some(value)
}

/// Runs a command of the program and parses its JSON. A run whose scene does not hold has a non-zero exit code
/// but still prints its figures.
fn run(program: &str, command: &str) -> Value {
    let words = command.strip_prefix("simpulse ").unwrap_or_else(|| panic!("{command}")).split_whitespace();
    let folder = env!("CARGO_MANIFEST_DIR");
    let output = Command::new(program).current_dir(folder).args(words).arg("--json").output().unwrap();
    serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{command}: {e}: {}", String::from_utf8_lossy(&output.stderr)))
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

/// Every claim is within the range of its row.
#[test]
fn claims_are_within_their_ranges() {
    let program = env!("CARGO_BIN_EXE_simpulse");
    let (mut answers, mut count, mut wrong) = (BTreeMap::new(), 0, Vec::new());
    for line in include_str!("../../papers/claims.md").lines() {
        let cells: Vec<&str> = line.trim_matches(['|', ' ']).split(" | ").map(str::trim).collect();
        let &[claim, command, path, range, _, _] = &cells[..] else { continue };
        let code = |cell: &'static str| cell.strip_prefix('`')?.strip_suffix('`');
        let (Some(command), Some(path)) = (code(command), code(path)) else { continue };
        let range: Option<[f64; 2]> =
            range.split_once(" to ").and_then(|(low, high)| Some([low.parse().ok()?, high.parse().ok()?]));
        let [low, high] = range.unwrap_or_else(|| panic!("no range 'low to high': {line}"));
        let answer = answers.entry(command).or_insert_with(|| run(program, command));
        let value = at(answer, path).and_then(Value::as_f64);
        let figure = value.map_or("none".into(), digits);
        println!("{figure:>10}  {low} to {high}  {claim}");
        count += 1;
        if !value.is_some_and(|value| (low..=high).contains(&value)) {
            wrong.push(format!("{claim}: {figure} is not within {low} to {high}: {command}"));
        }
    }
    assert!(wrong.is_empty() && count > 30, "{count} claims\n{}", wrong.join("\n"));
}
