//! Plots of a sweep: time and errors against the swept value, a curve per solver.

use super::panel::{Band, Panel, PlotArea, legend};
use super::precision::{name, shown};
use super::scale::{Scale, number};
use super::setting::{Setting, fastest, scenes};
use crate::lab::picture::svg::escaped;
use crate::lab::report::style::Style;
use crate::lab::report::sweep;
use crate::lab::study::Record;
use crate::lab::study::curve::{ErrorAxis as Axis, solvers_of};
use crate::lab::study::sweep::Swept;
use crate::lab::units::{bodies, si};

/// Width and height of a plot (pixels).
const SIZE: [f64; 2] = [330.0, 290.0];

/// The quantity that a plot shows against the swept value.
#[derive(Clone, Copy)]
enum Shown {
    Time,
    Error(Axis),
}

impl Shown {
    /// Time (s) or error; `None` if the record has none.
    fn of(self, record: &Record) -> Option<f64> {
        match self {
            // Steps of different length are compared by their time per second of the scene.
            Shown::Time if is_dt(record) => Some(record.time()? / record.dt),
            Shown::Time => record.time(),
            Shown::Error(axis) => record.drawn(axis),
        }
    }
}

fn is_dt(record: &Record) -> bool {
    record.swept.is_some_and(|s| s.name == "dt")
}

/// Values of the sweep, in ascending order and without duplicates.
fn values(scene: &[Record]) -> Vec<f64> {
    let mut values: Vec<f64> = scene.iter().filter_map(|r| r.swept).map(|s| s.value).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// The plots of one scene.
fn panels(scene: &[Record], swept: Swept) -> Vec<String> {
    let mut made = vec![panel(scene, swept, Shown::Time, "s")];
    for axis in Axis::ALL {
        if let Some((_, unit)) = name(scene, axis) {
            made.push(panel(scene, swept, Shown::Error(axis), &unit));
        }
    }
    made
}

fn panel(scene: &[Record], swept: Swept, what: Shown, unit: &str) -> String {
    let settings = fastest(scene);
    // The quantity of the reference value is named above the plots.
    let name = match what {
        Shown::Error(axis) => axis.name(),
        Shown::Time if is_dt(&scene[0]) => "time per second of the scene",
        Shown::Time => "time of a step",
    };
    let held = || settings.iter().filter(|r| r.broke().is_none() && what.of(r).is_some());
    let tolerance = match what {
        Shown::Error(axis) => settings.first().and_then(|r| r.tolerance(axis)),
        Shown::Time => None,
    };
    let ys = held().filter_map(|r| what.of(r)).chain(tolerance);
    let frame = PlotArea { size: SIZE, title: "", names: [swept.name, name], band: Band::Top };
    let mut panel = Panel::new(&frame, Scale::at(&values(scene), swept.unit), Scale::log(ys, unit));
    // In some scenes the tolerance depends on the swept value.
    let same = settings.iter().all(|r| match what {
        Shown::Error(axis) => r.tolerance(axis) == tolerance,
        Shown::Time => true,
    });
    if let Some(tolerance) = tolerance.filter(|_| same) {
        panel.shade_below(tolerance);
    }
    let at = |r: &Record| r.swept.map_or(0.0, |s| s.value);
    // Solvers that fail at the same value are drawn next to each other, three in a row.
    let count = solvers_of(scene).len();
    let (columns, rows) = (count.min(3) as f64, count.div_ceil(3) as f64);
    let place = |i: usize| [9.0 * ((i % 3) as f64 - 0.5 * (columns - 1.0)), ((i / 3) as f64 + 0.5) / rows];
    let grid: Vec<[f64; 2]> = (0..count).map(place).collect();
    for (i, solver) in solvers_of(scene).into_iter().enumerate() {
        for natural in [true, false] {
            let mut own: Vec<&&Record> =
                settings.iter().filter(|r| r.solver == solver && r.is_natural() == natural).collect();
            own.sort_by(|a, b| at(a).total_cmp(&at(b)));
            let class = if natural { "curve natural" } else { "curve" };
            let drawn = |r: &&&Record| r.broke().is_none() && what.of(r).is_some();
            // A failed value interrupts the curve.
            for part in own.chunk_by(|a, b| drawn(a) && drawn(b)).filter(|part| drawn(&part[0])) {
                let line: Vec<[f64; 2]> =
                    part.iter().filter_map(|r| Some(panel.at(at(r), what.of(r)?))).collect();
                panel.line(&line, class, Style::of(solver).color);
            }
            for record in own {
                let words = format!(
                    "{solver}, {} {} {}, {}",
                    swept.name,
                    number(at(record)),
                    swept.unit,
                    record.words()
                );
                match (record.broke(), what.of(record)) {
                    (None, Some(y)) => {
                        if let (Shown::Time, Some(sample), false) = (what, &record.sample, is_dt(record)) {
                            let quartiles = sample.quartiles_ns.map(|ns| (1e-9 * ns).max(1e-12));
                            panel.bar(at(record), quartiles, Style::of(solver).color);
                        }
                        let title =
                            format!("{words}: {}", if unit == "s" { si(y, "s") } else { shown(y, unit) });
                        panel.marker(panel.at(at(record), y), 3.8, solver, natural, false, &title);
                    }
                    (broke, _) => {
                        let title =
                            format!("{words}: {}", broke.unwrap_or_else(|| "missed its reference".into()));
                        let [x, y] = panel.above(at(record), grid[i][1]);
                        let place = [x + grid[i][0], y];
                        panel.marker(place, 3.2, solver, natural, false, &title);
                    }
                }
            }
        }
    }
    panel.finish()
}

/// Plots and table of every scene.
pub fn section(records: &[Record]) -> String {
    let Some(swept) = records.iter().find_map(|r| r.swept) else { return String::new() };
    let mut text = legend(&solvers_of(records));
    for scene in scenes(records) {
        text += &format!(
            "<h3>{} <span class=\"soft\">{}{}</span></h3>\n<div class=\"panels four\">\n{}</div>\n",
            escaped(&scene[0].scene),
            bodies(scene[0].bodies),
            escaped(&reference(scene)),
            panels(scene, swept).concat()
        );
    }
    let table = sweep::tables(records);
    let lines: Vec<String> = table.lines().map(|line| escaped(line).to_string()).collect();
    text + &format!("<pre class=\"sweep-table\">{}</pre>\n", lines.join("\n"))
}

/// The quantity of a scene's reference value; empty if none is known.
fn reference(scene: &[Record]) -> String {
    scene.iter().find_map(|r| r.truth).map_or(String::new(), |t| format!("; reference value: {}", t.quantity))
}

/// `sweep.svg`: the same plots as a separate picture, a row per scene.
pub fn svg(records: &[Record]) -> String {
    let Some(swept) = records.iter().find_map(|r| r.swept) else { return String::new() };
    const HEAD: f64 = 30.0;
    let rows: Vec<(String, Vec<String>)> =
        scenes(records).into_iter().map(|s| (s[0].scene.clone() + &reference(s), panels(s, swept))).collect();
    // Two columns are still readable on a phone.
    const COLUMNS: usize = 2;
    let solvers = solvers_of(records);
    let [width, height] = SIZE;
    let lines: usize = rows.iter().map(|r| r.1.len().div_ceil(COLUMNS)).sum();
    let legend = legend_rows(&solvers, COLUMNS as f64 * width);
    let head = HEAD * legend.len() as f64;
    let whole = [COLUMNS as f64 * width, head + rows.len() as f64 * HEAD + lines as f64 * height];
    let mut text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{0}\" height=\"{1}\" \
         font-family=\"sans-serif\">\n<style>\n{}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        whole[0],
        whole[1],
        plot_rules(),
    );
    for (row, solvers) in legend.iter().enumerate() {
        let mut x = 16.0;
        for solver in solvers {
            let Style { color, marker } = Style::of(solver);
            let y = HEAD * row as f64 + 18.0;
            text += &format!(
                "<path d=\"{}\" fill=\"{color}\"/><text class=\"row\" x=\"{}\" y=\"{}\">{}</text>\n",
                marker.path([x, y], 5.0),
                x + 10.0,
                y + 4.0,
                escaped(solver)
            );
            x += entry_width(solver);
        }
    }
    let mut top = head;
    for (scene, panels) in &rows {
        text += &format!("<text class=\"title\" x=\"16\" y=\"{}\">{}</text>\n", top + 20.0, escaped(scene));
        for (i, panel) in panels.iter().enumerate() {
            let place = format!(
                "<svg x=\"{}\" y=\"{}\" width=\"{width}\" height=\"{height}\" ",
                (i % COLUMNS) as f64 * width,
                top + HEAD + (i / COLUMNS) as f64 * height
            );
            text += &panel.replacen("<svg ", &place, 1);
        }
        top += HEAD + panels.len().div_ceil(COLUMNS) as f64 * height;
    }
    text + "</svg>\n"
}

/// Width of a solver's entry in the legend (pixels).
fn entry_width(solver: &str) -> f64 {
    30.0 + 7.5 * solver.chars().count() as f64
}

/// Solvers in rows of a legend of this width (pixels).
fn legend_rows(solvers: &[&'static str], width: f64) -> Vec<Vec<&'static str>> {
    let mut rows: Vec<Vec<&'static str>> = vec![Vec::new()];
    let mut x = 16.0;
    for &solver in solvers {
        if x + entry_width(solver) > width && x > 16.0 {
            rows.push(Vec::new());
            x = 16.0;
        }
        x += entry_width(solver);
        if let Some(row) = rows.last_mut() {
            row.push(solver);
        }
    }
    rows
}

/// The page's CSS rules for plots, light and dark, without those that set their size on the page.
fn plot_rules() -> String {
    let css = include_str!("page.css");
    let of = |start: &str| css.lines().filter(|l| l.starts_with(start)).collect::<Vec<_>>().join("\n");
    let (_, dark) = css.split_once("prefers-color-scheme: dark").unwrap_or_default();
    let dark = dark.split_once("\n}").map_or("", |(rules, _)| rules);
    let dark: Vec<&str> = dark.lines().filter(|l| l.starts_with("  svg")).collect();
    format!(
        "svg {{ font-size: 11px; fill: #1f2933; }}\n{}\n@media (prefers-color-scheme: dark) {{\n{}\n}}\n",
        of("svg ."),
        dark.join("\n")
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::record::tests::{fell, record};

    #[test]
    fn a_curve_breaks_where_the_scene_does_not_hold() {
        let at =
            |value: f64, r: Record| Record { swept: Some(Swept { name: "friction", unit: "", value }), ..r };
        let records = [
            at(0.0, record(8, 1, 9.0, 1e-3)),
            at(0.25, record(8, 1, 9.5, 2e-3)),
            at(0.5, fell(8, 1, 10.0, 0.5)),
            at(0.75, record(8, 1, 10.0, 1e-3)),
            at(1.0, record(8, 1, 11.0, 1e-3)),
        ];
        let made = panels(&records, records[0].swept.unwrap());
        // Time, penetration and residual; there is no reference value.
        assert_eq!(made.len(), 3);
        for panel in &made {
            assert_eq!(panel.matches("class=\"curve\"").count(), 2, "{panel}");
            assert_eq!(panel.matches("fell at step 100").count(), 1);
            assert_eq!(panel.matches("<title>pgs").count(), 5);
        }
        let picture = svg(&records);
        assert_eq!(picture.matches("<svg ").count(), 4);
        assert_eq!(picture.matches("<svg ").count(), picture.matches("</svg>").count());
    }
}
