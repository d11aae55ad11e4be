//! `speed_vs_error.svg`: time against error, three panels per scene. Panels are stacked vertically, so that
//! they are large enough on a narrow screen.
//!
//! Both axes are logarithmic. One color per solver, one marker shape per budget, a white dot on settings in
//! natural order. Every marker is at the fastest lane width of its setting. A step line shows the shortest
//! time in which the solver reaches each error or less; it has steps because settings are separate runs, with
//! nothing in between.

use super::style::{LEGEND_ROW, legend_places, solver_color, solver_legend};
use super::units::si_short;
use crate::lab::error::Error;
use crate::lab::picture::axes::{
    Area, Drawn, Edges, INK, LogScale, marker, with_dark, wrapped, write, write_upwards,
};
use crate::lab::study::Record;
use crate::lab::study::curve::{Curve, ErrorAxis, budgets_of, curves, solvers_of};
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

const PANEL_WIDTH: i32 = 400;
const PANEL_HEIGHT: i32 = 222;
const TITLE_HEIGHT: i32 = 34;
/// Heights of the heading, and of the line about markers.
const HEADING: i32 = 34;
/// Margins left of, right of and below a panel.
const LEFT: i32 = 78;
const RIGHT: i32 = 26;
const BOTTOM: i32 = 58;
/// Maximum number of characters of a title below a panel.
const TITLE_LENGTH: usize = 48;

/// The picture as SVG text.
pub fn svg(records: &[Record]) -> Result<String, Error> {
    let mut text = String::new();
    draw(records, &mut text).map_err(|e| Error::invalid("speed_vs_error.svg", e.to_string()))?;
    Ok(with_dark(&text))
}

fn draw(records: &[Record], text: &mut String) -> Drawn {
    let scenes: Vec<&[Record]> = records.chunk_by(|a, b| a.scene == b.scene).collect();
    let solvers = solvers_of(records);
    let rows = legend_places(&solvers, PANEL_WIDTH).last().map_or(0, |place| place.1 + 1);
    let head = 2 * HEADING + LEGEND_ROW * rows;
    let scene_height = TITLE_HEIGHT + PANEL_HEIGHT * ErrorAxis::ALL.len() as i32;
    let size = (PANEL_WIDTH, head + scene_height * scenes.len() as i32);
    let root = SVGBackend::with_string(text, (size.0 as u32, size.1 as u32)).into_drawing_area();
    root.fill(&WHITE)?;
    legend(&root, &solvers, &scenes)?;
    for (i, scene) in scenes.iter().enumerate() {
        let top = head + scene_height * i as i32;
        write(&root, &scene[0].scene, (8, top + 18), 17, HPos::Left)?;
        for (j, axis) in ErrorAxis::ALL.into_iter().enumerate() {
            panel(&root, (0, top + TITLE_HEIGHT + PANEL_HEIGHT * j as i32), axis, scene)?;
        }
    }
    root.present()?;
    Ok(())
}

fn legend(area: &Area, solvers: &[&str], scenes: &[&[Record]]) -> Drawn {
    write(area, "Time of a step against error: lower left is better", (8, 18), 16, HPos::Left)?;
    let y = solver_legend(area, solvers, HEADING + 8, PANEL_WIDTH)?;
    let budgets = scenes.iter().flat_map(|own| solvers.iter().map(|s| budgets_of(own, s).len())).max();
    let mut x = 12;
    for budget in 0..budgets.unwrap_or(0).min(4) {
        marker(area, (x + 6, y), budget, &INK)?;
        x += 20;
    }
    write(area, "budgets, smallest first; white dot: natural order", (x + 6, y), 13, HPos::Left)
}

fn panel(area: &Area, corner: (i32, i32), axis: ErrorAxis, records: &[Record]) -> Drawn {
    let curves = curves(records, axis);
    let samples = || curves.iter().flat_map(|c| &c.samples);
    let (left, top) = (corner.0 + LEFT, corner.1);
    let (right, bottom) = (corner.0 + PANEL_WIDTH - RIGHT, corner.1 + PANEL_HEIGHT - BOTTOM);
    if samples().next().is_none() {
        let known = axis != ErrorAxis::Truth || records.iter().any(|r| r.truth.is_some());
        let text = if known { "nothing measured" } else { "no reference value" };
        return write(area, text, ((left + right) / 2, (top + bottom) / 2), 13, HPos::Center);
    }
    let errors = LogScale::of(samples().map(|s| s.error), 5);
    let times = LogScale::of(samples().map(|s| s.time), 6);
    let unit = axis.unit(records);
    let labels: [&dyn Fn(f64) -> String; 2] = [&|error| label(error, unit), &|ns| si_short(1e-9 * ns, "s")];
    Edges { left, right, top, bottom }.grid(area, [&errors, &times], 12, labels)?;
    area.draw(&Rectangle::new([(left, top), (right, bottom)], INK))?;
    write_upwards(area, "time of a step", (corner.0 + 14, (top + bottom) / 2), 12)?;
    for (i, line) in title(axis, records).iter().enumerate() {
        write(area, line, ((left + right) / 2, bottom + 29 + 15 * i as i32), 13, HPos::Center)?;
    }
    for curve in &curves {
        let at = |time, error| (errors.pixel(error, left, right), times.pixel(time, bottom, top));
        draw_curve(area, curve, &solver_color(curve.solver), at)?;
    }
    Ok(())
}

fn draw_curve(area: &Area, curve: &Curve, color: &RGBColor, at: impl Fn(f64, f64) -> (i32, i32)) -> Drawn {
    let mut line: Vec<(i32, i32)> = Vec::new();
    for sample in curve.front() {
        let next = at(sample.time, sample.error);
        line.extend(line.last().map(|&(x, _)| (x, next.1)));
        line.push(next);
    }
    area.draw(&PathElement::new(line, color.stroke_width(2)))?;
    for sample in &curve.samples {
        let place = at(sample.time, sample.error);
        marker(area, place, sample.budget, color)?;
        if sample.record.order.is_serial() {
            area.draw(&Circle::new(place, 2, WHITE.filled()))?;
        }
    }
    Ok(())
}

/// Name of the horizontal axis, in lines that fit below the panel.
fn title(axis: ErrorAxis, records: &[Record]) -> Vec<String> {
    let truth = records.iter().find_map(|r| r.truth).filter(|_| axis == ErrorAxis::Truth);
    let title = truth.map_or(axis.name().to_string(), |t| format!("error of {}", t.quantity));
    wrapped(&title, TITLE_LENGTH)
}

/// `1 mm` for values with a unit; `1e-3` for ratios and large values.
fn label(value: f64, unit: &str) -> String {
    if !unit.is_empty() && unit != "1" && value < 1e3 {
        return si_short(value, unit);
    }
    // 1.5e3 needs its second digit, 1e3 does not.
    let text = format!("{value:.1e}").replace(".0e", "e");
    format!("{text} {unit}").trim_end().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::study::TruthError;
    use crate::lab::study::record::tests::{failed, record};

    #[test]
    fn labels_are_short() {
        assert_eq!([label(1e-3, "m"), label(1e-3, ""), label(1e4, "N")], ["1 mm", "1e-3", "1e4 N"]);
        assert_eq!(label(1.5e-3, ""), "1.5e-3");
    }

    #[test]
    fn titles_of_truths_are_whole() {
        let quantity = "ground load while the heavy disc rests on the light one, last second";
        let truth = TruthError { quantity, unit: "N", expected: 1.0, error: Some(1.0) };
        let records = [Record { truth: Some(truth), ..record(8, 1, 1.0, 1.0) }];
        assert_eq!(title(ErrorAxis::Truth, &records).join(" "), format!("error of {quantity}"));
        assert!(title(ErrorAxis::Truth, &records).iter().all(|l| l.chars().count() <= TITLE_LENGTH));
        let picture = svg(&records).unwrap();
        assert!(picture.contains("time of a step") && picture.contains("last second"));
        // The SVG writer escapes none of the characters that a scene name may contain. Failed settings are
        // not drawn.
        assert!(svg(&[failed(8)]).unwrap().contains("nothing measured"));
    }
}
