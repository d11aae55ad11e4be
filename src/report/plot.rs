//! `speed_vs_error.svg`: time against error, a row of panels per scene.
//!
//! Both axes are logarithmic. One colour per solver, one curve through its budgets, one
//! marker shape per budget; every point is the fastest lane width of its setting. Axes are
//! drawn here and not by the chart builder, so that a panel of any range has readable
//! decades.

use super::units::si_short;
use crate::error::Error;
use crate::study::Record;
use crate::world::Order;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = Result<(), Box<dyn std::error::Error>>;

const PANEL_WIDTH: i32 = 330;
const PANEL_HEIGHT: i32 = 190;
const TITLE_HEIGHT: i32 = 34;
const LEGEND_HEIGHT: i32 = 74;
/// Space for labels left of and below a panel.
const LEFT: i32 = 62;
const BOTTOM: i32 = 40;
const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(222, 222, 222);
/// Distinct with any colour vision (Okabe and Ito).
const COLORS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
];

/// An error to plot.
struct Axis {
    title: &'static str,
    unit: &'static str,
    /// Errors below this are drawn here: a logarithm has no zero.
    floor: f64,
    error: fn(&Record) -> Option<f64>,
}

const AXES: [Axis; 3] = [
    Axis { title: "deepest penetration", unit: "m", floor: 1e-8, error: |r| Some(r.errors?.penetration_max) },
    Axis { title: "contact-law residual", unit: "", floor: 1e-8, error: |r| Some(r.errors?.law_rms) },
    Axis { title: "distance to truth", unit: "", floor: 1e-8, error: |r| r.truth?.error },
];

/// One setting of a solver at its fastest width.
struct Point {
    solver: usize,
    budget: usize,
    time_us: f64,
    error: f64,
}

/// The picture as SVG text.
pub fn svg(records: &[Record]) -> Result<String, Error> {
    let mut text = String::new();
    draw(records, &mut text).map_err(|e| Error::invalid("speed_vs_error.svg", e.to_string()))?;
    Ok(text)
}

fn draw(records: &[Record], text: &mut String) -> Drawn {
    let scenes: Vec<&[Record]> = records.chunk_by(|a, b| a.scene == b.scene).collect();
    let mut solvers: Vec<&str> = Vec::new();
    for record in records {
        if !solvers.contains(&record.solver) {
            solvers.push(record.solver);
        }
    }
    let row_height = TITLE_HEIGHT + PANEL_HEIGHT;
    let size = (3 * PANEL_WIDTH, LEGEND_HEIGHT + row_height * scenes.len() as i32);
    let root = SVGBackend::with_string(text, (size.0 as u32, size.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    legend(&root, &solvers, records)?;
    for (i, scene) in scenes.iter().enumerate() {
        let top = LEGEND_HEIGHT + row_height * i as i32;
        write(&root, &scene[0].scene, (8, top + 18), 17, HPos::Left)?;
        for (j, axis) in AXES.iter().enumerate() {
            let corner = (PANEL_WIDTH * j as i32, top + TITLE_HEIGHT);
            panel(&root, corner, axis, scene, &solvers)?;
        }
    }
    root.present()?;
    Ok(())
}

fn write(area: &Area, text: &str, at: (i32, i32), size: i32, anchor: HPos) -> Drawn {
    let style = ("sans-serif", size).into_font().color(&INK).pos(Pos::new(anchor, VPos::Center));
    area.draw(&Text::new(text.to_string(), at, style))?;
    Ok(())
}

fn legend(area: &Area, solvers: &[&str], records: &[Record]) -> Drawn {
    write(area, "Time of a step against error: lower left is better", (8, 18), 18, HPos::Left)?;
    let mut x = 12;
    for (i, name) in solvers.iter().enumerate() {
        let color = COLORS[i % COLORS.len()];
        area.draw(&PathElement::new(vec![(x, 44), (x + 26, 44)], color.stroke_width(3)))?;
        write(area, name, (x + 32, 44), 14, HPos::Left)?;
        x += 56 + 7 * name.chars().count() as i32;
    }
    let budgets = solvers.iter().map(|s| budgets_of(records, s).len()).max().unwrap_or(0);
    for budget in 0..budgets {
        marker(area, (x + 6, 44), budget, &INK)?;
        x += 20;
    }
    write(area, "budgets, smallest first; fastest lane width of each", (x + 6, 44), 14, HPos::Left)
}

/// Budgets of a solver in the order in which they were tried.
fn budgets_of(records: &[Record], solver: &str) -> Vec<crate::params::Budget> {
    let mut budgets = Vec::new();
    for record in records.iter().filter(|r| r.solver == solver) {
        if !budgets.contains(&record.budget) {
            budgets.push(record.budget);
        }
    }
    budgets
}

/// Coloured settings where there are any, else natural ones.
fn points(axis: &Axis, records: &[Record], solvers: &[&str]) -> Vec<Point> {
    let colored = records.iter().any(|r| r.order == Order::Colored);
    let order = if colored { Order::Colored } else { Order::Natural };
    let mut points = Vec::new();
    for (solver, name) in solvers.iter().enumerate() {
        for (budget, value) in budgets_of(records, name).iter().enumerate() {
            let widths =
                records.iter().filter(|r| r.solver == *name && r.budget == *value && r.order == order);
            let found = widths
                .filter_map(|r| Some((r.lap.as_ref()?.median_ns / 1e3, (axis.error)(r)?)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((time_us, error)) = found {
                points.push(Point { solver, budget, time_us, error: error.max(axis.floor) });
            }
        }
    }
    points
}

/// Where an axis has its labels: 1, 2, 5, 10 … over a short range, decades over a long one.
/// The first and the last one enclose the values.
fn ticks(values: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let least = values.clone().fold(f64::INFINITY, f64::min).max(1e-12);
    let most = values.fold(least, f64::max);
    let (low, high) = (least.log10().floor() as i32, most.log10().ceil() as i32);
    let factors: &[f64] = if high - low <= 2 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let all: Vec<f64> = (low..=high.max(low + 1))
        .flat_map(|exponent| factors.iter().map(move |f| f * 10f64.powi(exponent)))
        .collect();
    let first = all.iter().rposition(|&t| t <= 1.0001 * least).unwrap_or(0);
    let last = all.iter().position(|&t| t >= 0.9999 * most && t > 1.5 * all[first]);
    all[first..=last.unwrap_or(all.len() - 1)].to_vec()
}

fn panel(area: &Area, corner: (i32, i32), axis: &Axis, records: &[Record], solvers: &[&str]) -> Drawn {
    let points = points(axis, records, solvers);
    let (left, top) = (corner.0 + LEFT, corner.1);
    let (right, bottom) = (corner.0 + PANEL_WIDTH - 24, corner.1 + PANEL_HEIGHT - BOTTOM);
    if points.is_empty() {
        let known = records.iter().any(|r| r.truth.is_some()) || axis.title != AXES[2].title;
        let text = if known { "nothing measured" } else { "no known truth" };
        return write(area, text, ((left + right) / 2, (top + bottom) / 2), 13, HPos::Center);
    }
    let x_ticks = ticks(points.iter().map(|p| p.error));
    let y_ticks = ticks(points.iter().map(|p| p.time_us));
    let along = |value: f64, ticks: &[f64], from: i32, to: i32| {
        let (low, high) = (ticks[0], ticks[ticks.len() - 1]);
        from + ((value / low).log(high / low) * (to - from) as f64).round() as i32
    };
    let at = |p: &Point| (along(p.error, &x_ticks, left, right), along(p.time_us, &y_ticks, bottom, top));

    let truth = records.iter().find_map(|r| r.truth);
    let (unit, title) = match truth {
        Some(truth) if axis.title == AXES[2].title => (truth.unit, format!("error of {}", truth.quantity)),
        _ => (axis.unit, axis.title.to_string()),
    };
    // At most five labels fit side by side.
    let stride = x_ticks.len().div_ceil(5);
    for (i, &tick) in x_ticks.iter().enumerate() {
        let x = along(tick, &x_ticks, left, right);
        area.draw(&PathElement::new(vec![(x, top), (x, bottom)], GRID))?;
        if i % stride == 0 {
            write(area, &label(tick, unit), (x, bottom + 11), 12, HPos::Center)?;
        }
    }
    for &tick in &y_ticks {
        let y = along(tick, &y_ticks, bottom, top);
        area.draw(&PathElement::new(vec![(left, y), (right, y)], GRID))?;
        write(area, &si_short(1e-6 * tick, "s"), (left - 6, y), 12, HPos::Right)?;
    }
    area.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write(area, &fitting(&title), ((left + right) / 2, bottom + 28), 13, HPos::Center)?;

    for solver in 0..solvers.len() {
        let color = COLORS[solver % COLORS.len()];
        let own: Vec<&Point> = points.iter().filter(|p| p.solver == solver).collect();
        let line: Vec<(i32, i32)> = own.iter().map(|p| at(p)).collect();
        area.draw(&PathElement::new(line, color.stroke_width(2)))?;
        for point in own {
            marker(area, at(point), point.budget, &color)?;
        }
    }
    Ok(())
}

/// `1 mm` for lengths and the like, `1e-3` for shares and for much.
fn label(value: f64, unit: &str) -> String {
    if unit.is_empty() || unit == "1" || value >= 1e3 {
        return format!("{value:.0e} {unit}").trim_end().to_string();
    }
    si_short(value, unit)
}

/// As many characters of a title as fit under a panel.
fn fitting(title: &str) -> String {
    const MOST: usize = 42;
    if title.chars().count() <= MOST {
        return title.to_string();
    }
    title.chars().take(MOST - 1).chain(['…']).collect()
}

/// Circle, triangle, square, then crosses.
fn marker(area: &Area, (x, y): (i32, i32), budget: usize, color: &RGBColor) -> Drawn {
    let filled = color.filled();
    match budget {
        0 => area.draw(&Circle::new((x, y), 4, filled))?,
        1 => area.draw(&TriangleMarker::new((x, y), 6, filled))?,
        2 => area.draw(&Rectangle::new([(x - 4, y - 4), (x + 4, y + 4)], filled))?,
        _ => area.draw(&Cross::new((x, y), 4, color.stroke_width(2)))?,
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_enclose_the_values() {
        assert_eq!(ticks([3.0, 30.0].into_iter()), [2.0, 5.0, 10.0, 20.0, 50.0]);
        assert_eq!(ticks([1.0, 1.0].into_iter()), [1.0, 2.0]);
        assert_eq!(ticks([0.3, 3e4].into_iter()).len(), 7);
        for values in [[1e-12, 1e3], [9.99, 10.01], [5.0, 5.0], [2e-5, 3e-5]] {
            let t = ticks(values.into_iter());
            assert!(t.len() >= 2 && t[0] <= values[0] * 1.001 && t[t.len() - 1] >= values[1] * 0.999);
        }
    }

    #[test]
    fn labels_are_short() {
        assert_eq!([label(1e-3, "m"), label(1e-3, ""), label(1e4, "N")], ["1 mm", "1e-3", "1e4 N"]);
        assert!(fitting(&"x".repeat(90)).chars().count() <= 42);
    }
}
