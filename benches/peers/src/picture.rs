//! `peers.svg`: time of a step against mean overlap, a panel per scene.
//!
//! Both axes are logarithmic; lower left is better. A setting that failed the check has no time and no point:
//! it is listed below its panel.

use crate::axes::{Area, Drawn, Edges, INK, LogScale, color, marker, with_dark, write, write_upwards};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;
use serde::Deserialize;
use simpulse::lab::report::units::{si_short, wrapped};

/// What is drawn of a row of `peers.csv`.
#[derive(Debug, Deserialize)]
pub struct Row {
    scene: String,
    engine: String,
    substeps: u32,
    contact_hertz: f32,
    recycling: bool,
    failed: String,
    mean_step_ms: Option<f64>,
    penetration_mean_m: Option<f64>,
}

const COLUMNS: usize = 3;
const PANEL: (i32, i32) = (360, 300);
const LEGEND_HEIGHT: i32 = 62;
/// Margins left of, right of, above and below a plot.
const LEFT: i32 = 76;
const RIGHT: i32 = 26;
const TOP: i32 = 34;
const BOTTOM: i32 = 66;
/// Characters of a line below a panel.
const LINE: usize = 56;

/// Engines that are drawn, in the order of the legend, each at all its settings.
const ENGINES: [&str; 4] = ["Box2D", "rapier", "simpulse soft_step", "simpulse shim"];

/// Index in [`ENGINES`]; `None` for engines that are not drawn. `soft_step` is drawn at the width of the CPU,
/// which comes first.
fn engine(row: &Row, own: &str) -> Option<usize> {
    match row.engine.split(' ').next() {
        Some("Box2D") if row.recycling => Some(0),
        Some("rapier") if row.recycling => Some(1),
        Some("simpulse") => (row.engine == own).then_some(2),
        _ => row.engine.starts_with("our shim").then_some(3),
    }
}

/// A time up to this factor above that of `shim` counts as no longer.
const LONGER: f64 = 1.1;

/// The least mean overlap of each engine within the time of `shim` at its defaults, in Markdown, with its setting and
/// its share of that time.
pub fn equal_times(rows: &[Row]) -> String {
    let mut text = format!("| scene | {} |\n|---|---|---|---|---|", ENGINES.join(" | "));
    for scene in rows.chunk_by(|a, b| a.scene == b.scene) {
        let own = scene.iter().find(|r| r.engine.starts_with("simpulse")).map_or("", |r| &r.engine);
        let of = |k: usize| scene.iter().filter(move |row| engine(row, own) == Some(k));
        let timed = |row: &Row| Some((row.mean_step_ms?, row.penetration_mean_m?));
        let Some((limit, _)) = of(3).find(|row| row.substeps == 14).and_then(timed) else { continue };
        let cell = |k: usize| {
            let settings = of(k).filter_map(|row| Some((row, timed(row)?)));
            let fitting = settings.filter(|(_, (ms, _))| *ms <= LONGER * limit);
            fitting.min_by(|a, b| a.1.1.total_cmp(&b.1.1)).map_or(
                "–".to_string(),
                |(row, (ms, overlap))| {
                    format!("{} ({}, {:.2})", si_short(overlap, "m"), setting(row), ms / limit)
                },
            )
        };
        text += &format!("\n| {} | {} |", scene[0].scene, [0, 1, 2, 3].map(cell).join(" | "));
    }
    text
}

/// The picture of all rows of a race, as SVG text.
pub fn svg(rows: &[Row]) -> Result<String, String> {
    let mut text = String::new();
    draw(&rows.chunk_by(|a, b| a.scene == b.scene).collect::<Vec<_>>(), &mut text)
        .map_err(|e| format!("peers.svg: {e}"))?;
    Ok(with_dark(&text))
}

fn draw(scenes: &[&[Row]], text: &mut String) -> Drawn {
    let rows = scenes.len().div_ceil(COLUMNS) as i32;
    let size = ((COLUMNS as i32 * PANEL.0) as u32, (LEGEND_HEIGHT + rows * PANEL.1) as u32);
    let root = SVGBackend::with_string(text, size).into_drawing_area();
    root.fill(&WHITE)?;
    write(
        &root,
        "Time of a step against overlap, in one run: lower left is better",
        (8, 18),
        18,
        HPos::Left,
    )?;
    let mut x = 12;
    for (k, name) in ENGINES.into_iter().enumerate() {
        marker(&root, (x, 44), k, &color(k))?;
        write(&root, name, (x + 10, 44), 14, HPos::Left)?;
        x += 34 + 8 * name.len() as i32;
    }
    write(
        &root,
        "number: substeps; ′: contacts at 60 Hz, not 30; shim has its own",
        (x, 44),
        14,
        HPos::Left,
    )?;
    for (i, rows) in scenes.iter().enumerate() {
        let (column, row) = ((i % COLUMNS) as i32, (i / COLUMNS) as i32);
        panel(&root, (column * PANEL.0, LEGEND_HEIGHT + row * PANEL.1), rows)?;
    }
    root.present()?;
    Ok(())
}

fn panel(area: &Area, corner: (i32, i32), rows: &[Row]) -> Drawn {
    let own = rows.iter().find(|r| r.engine.starts_with("simpulse")).map_or("", |r| &r.engine);
    let all = rows.iter().filter_map(|row| Some((engine(row, own)?, row)));
    let shown: Vec<(usize, &Row, f64, f64)> = all
        .clone()
        .filter_map(|(k, row)| Some((k, row, row.mean_step_ms?, row.penetration_mean_m?)))
        .filter(|&(.., overlap)| overlap > 0.0)
        .collect();
    let (left, right) = (corner.0 + LEFT, corner.0 + PANEL.0 - RIGHT);
    let (top, bottom) = (corner.1 + TOP, corner.1 + PANEL.1 - BOTTOM);
    write(area, &rows[0].scene, (left, top - 14), 15, HPos::Left)?;
    let overlaps = LogScale::of(shown.iter().map(|s| s.3), 5);
    let times = LogScale::of(shown.iter().map(|s| s.2), 6);
    let labels: [&dyn Fn(f64) -> String; 2] =
        [&|overlap| si_short(overlap, "m"), &|ms| si_short(1e-3 * ms, "s")];
    Edges { left, right, top, bottom }.grid(area, [&overlaps, &times], 12, labels)?;
    area.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write_upwards(area, "time of a step, mean", (corner.0 + 14, (top + bottom) / 2), 12)?;
    write(area, "mean overlap", ((left + right) / 2, bottom + 28), 13, HPos::Center)?;
    for &(k, row, time, overlap) in &shown {
        let (x, y) = (overlaps.pixel(overlap, left, right), times.pixel(time, bottom, top));
        marker(area, (x, y), k, &color(k))?;
        write(area, &setting(row), (x + 7, y - 7), 11, HPos::Left)?;
    }
    let failed = all.filter(|(_, row)| !row.failed.is_empty());
    let failed: Vec<String> = failed.map(|(k, row)| format!("{} {}", ENGINES[k], setting(row))).collect();
    if !failed.is_empty() {
        let line = format!("fails: {}", failed.join(", "));
        for (i, line) in wrapped(&line, LINE).iter().enumerate() {
            write(area, line, (corner.0 + 8, bottom + 44 + 14 * i as i32), 11, HPos::Left)?;
        }
    }
    Ok(())
}

fn setting(row: &Row) -> String {
    format!("{}{}", row.substeps, if row.contact_hertz == 30.0 { "" } else { "′" })
}
