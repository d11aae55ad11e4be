//! `peers.svg`: time of a step against mean overlap, a chart per scene; lower left is better. A setting that failed
//! the check has no time: it is in the strip above its chart.

use serde::Deserialize;
use simpulse::lab::chart::{self, Axis, Chart, ChartMark, FailStrip, Scale, Series, Style};
use simpulse::lab::units::si_short;

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

/// Charts beside each other, and the size of one (pixels).
const COLUMNS: usize = 3;
const SIZE: [i32; 2] = [360, 300];

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

/// `soft_step` at the width of the CPU.
fn own(rows: &[Row]) -> &str {
    rows.iter().find(|r| r.engine.starts_with("simpulse")).map_or("", |r| &r.engine)
}

/// A time up to this factor above that of `shim` counts as no longer.
const LONGER: f64 = 1.1;

/// The least mean overlap of each engine within the time of `shim` at its defaults, in Markdown, with its setting and
/// its share of that time.
pub fn equal_times(rows: &[Row]) -> String {
    let mut text = format!("| scene | {} |\n|---|---|---|---|---|", ENGINES.join(" | "));
    for scene in rows.chunk_by(|a, b| a.scene == b.scene) {
        let own = own(scene);
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
pub fn svg(rows: &[Row]) -> String {
    let charts: Vec<Chart> = rows.chunk_by(|a, b| a.scene == b.scene).map(chart).collect();
    let lines: Vec<_> = charts.chunks(COLUMNS).map(|line| (String::new(), line.to_vec())).collect();
    let names: Vec<_> = ENGINES.into_iter().enumerate().map(|(k, name)| (name, Style::at(k))).collect();
    let title = "Time of a step against overlap, in one run: lower left is better. \
                 Number: substeps; ′: contacts at 60 Hz, not 30; shim has its own";
    chart::file(title, &names, &lines)
}

fn chart(rows: &[Row]) -> Chart {
    let own = own(rows);
    let mark = |k: usize, row: &Row| {
        let fails = !row.failed.is_empty();
        let overlap = row.penetration_mean_m.filter(|overlap| *overlap > 0.0)?;
        let ms = if fails { 0.0 } else { row.mean_step_ms? };
        let title = format!("{}, {} substeps at {} Hz", ENGINES[k], row.substeps, row.contact_hertz);
        Some(ChartMark { fails, label: setting(row), ..ChartMark::at(overlap, 1e-3 * ms, 4.0, title) })
    };
    let series = |k: usize| {
        let of = rows.iter().filter(|row| engine(row, own) == Some(k));
        Series::marks(Style::at(k), of.filter_map(|row| mark(k, row)).collect())
    };
    let series: Vec<Series> = (0..ENGINES.len()).map(series).collect();
    let marks = || series.iter().flat_map(|series| &series.marks);
    let axis = |name: &str, scale: Scale| Axis { name: name.into(), scale };
    Chart {
        size: SIZE,
        title: rows[0].scene.clone(),
        x: axis("mean overlap", Scale::log(marks().map(|mark| mark.x), "m")),
        y: axis("time of a step, mean", Scale::log(marks().map(|mark| mark.y), "s")),
        strip: if marks().any(|mark| mark.fails) { FailStrip::Top } else { FailStrip::None },
        good: [None; 2],
        series,
    }
}

fn setting(row: &Row) -> String {
    format!("{}{}", row.substeps, if row.contact_hertz == 30.0 { "" } else { "′" })
}
