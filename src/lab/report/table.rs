//! Tables for a terminal of 160 columns.

use super::units::{percent, si};
use crate::lab::metrics::Errors;
use comfy_table::{CellAlignment, ContentArrangement, Table, presets};

/// A table without a frame.
pub(crate) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING).set_content_arrangement(ContentArrangement::Disabled);
    table.set_header(header.to_vec());
    table
}

/// Maximum line length of the page printed by a study (characters).
pub const PAGE_WIDTH: usize = 120;

/// The same table with at most `width` characters per line; long cells are wrapped.
pub(crate) fn narrow(mut table: Table, width: usize) -> Table {
    table.set_content_arrangement(ContentArrangement::Dynamic);
    // Two of these are the blanks after the last column.
    table.set_width(width as u16 + 2);
    table
}

/// Text of a table. All columns except the first `left` are right-aligned; columns are separated by two
/// blanks.
pub(crate) fn finish(mut table: Table, left: usize) -> String {
    for (i, column) in table.column_iter_mut().enumerate() {
        column.set_padding((0, 2));
        if i >= left {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    let text = table.to_string();
    text.lines().map(|line| line.trim_end().to_string() + "\n").collect()
}

/// The errors printed next to a time, on one line.
pub fn error_line(errors: Option<&Errors>) -> String {
    match errors {
        Some(e) => format!(
            "errors of the last {} steps: overlap {} maximum, {} mean; force error {} of the scene's weight, {} of a body's\n",
            e.steps,
            si(e.penetration_max(), "m"),
            si(e.penetration_mean(), "m"),
            percent(e.get("residual_rms_scene_weights").unwrap_or_default()),
            percent(e.law_rms_body())
        ),
        None => "errors: none observed, since no step was taken\n".to_string(),
    }
}

/// The errors of one run, a line each with name, value and meaning. Errors that do not exist are left out.
pub fn error_list(errors: &Errors) -> String {
    let shown = errors.iter().filter_map(|(metric, value)| Some((metric, si(value?, metric.unit))));
    shown.map(|(metric, value)| format!("  {:<36}{value:>12}  {}\n", metric.name, metric.meaning)).collect()
}
